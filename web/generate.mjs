// TypeScript from what Rust generates: the control API (an OpenAPI document), the scene file and the engine's notes (JSON
// Schemas).
//
// npm run generate: reads the three files and writes api.ts, scene.ts and notes.ts into src/generated. The inputs are made by
// Rust tests, which also compare them: PALPA_BLESS=1 cargo test -p palpa-viewer -p palpa-scene -p palpa.

import { readFile, writeFile } from 'node:fs/promises';
import openapiTS, { astToString, COMMENT_HEADER } from 'openapi-typescript';

const SCENE_SCHEMA = new URL('../crates/palpa-scene/schema/scene.schema.json', import.meta.url);
const NOTE_SCHEMA = new URL('../crates/palpa/schema/note.schema.json', import.meta.url);
const GENERATED = new URL('src/generated/', import.meta.url);

/** Name of the type of the whole file. */
const SCENE = 'SceneTable';

/** @param {URL} url */
const readJson = async (url) => JSON.parse(await readFile(url, 'utf8'));

/** A schema's definitions as the components of an OpenAPI document, which is what the tool reads. @param {any} schema @param {string} name the type of the whole */
function asOpenApi({ $defs, $schema: _, title: __, ...whole }, name) {
  const schemas = { [name]: whole, ...$defs };
  const text = JSON.stringify({ openapi: '3.1.0', info: { title: name, version: '1' }, paths: {}, components: { schemas } });
  return JSON.parse(text.replaceAll('#/$defs/', '#/components/schemas/'));
}

/** The words of every definition that is a choice of words, as values for menus: types are gone when the page runs. @param {any} $defs */
function choices($defs) {
  const lines = Object.entries($defs)
    .filter(([, { oneOf }]) => oneOf?.every((/** @type {any} */ one) => typeof one.const === 'string'))
    .map(([name, { oneOf }]) => `  ${name}: [${oneOf.map((/** @type {any} */ one) => `'${one.const}'`).join(', ')}],\n`);
  return `/** What may be chosen, in the order of the schema. */\nexport const CHOICES = {\n${lines.join('')}} as const;\n`;
}

/** @param {any} document @param {import('openapi-typescript').OpenAPITSOptions} options */
async function typescript(document, options = {}) {
  return COMMENT_HEADER + astToString(await openapiTS(document, { rootTypes: true, rootTypesNoSchemaPrefix: true, ...options }));
}

const api = await readJson(new URL('openapi.json', GENERATED));
await writeFile(new URL('api.ts', GENERATED), await typescript(api));
const scene = await readJson(SCENE_SCHEMA);
// A key with a default may be left out; a list of three is a point.
const types = await typescript(asOpenApi(scene, SCENE), { defaultNonNullable: false, arrayLength: true });
await writeFile(new URL('scene.ts', GENERATED), `${types}\n${choices(scene.$defs)}`);
const notes = asOpenApi(await readJson(NOTE_SCHEMA), 'Note');
await writeFile(new URL('notes.ts', GENERATED), await typescript(notes, { arrayLength: true }));
