// TypeScript from what the server generates: the control API (an OpenAPI document) and the scene file (a JSON Schema).
//
// npm run generate: reads both files and writes src/generated/api.ts and src/generated/scene.ts. The two inputs are made by
// Rust tests, which also compare them: PALPA_BLESS=1 cargo test -p palpa-viewer -p palpa-scene.

import { readFile, writeFile } from 'node:fs/promises';
import openapiTS, { astToString, COMMENT_HEADER } from 'openapi-typescript';

const SCENE_SCHEMA = new URL('../crates/palpa-scene/schema/scene.schema.json', import.meta.url);
const GENERATED = new URL('src/generated/', import.meta.url);

/** Name of the type of the whole file. */
const SCENE = 'SceneTable';

/** @param {URL} url */
const readJson = async (url) => JSON.parse(await readFile(url, 'utf8'));

/** A schema's definitions as the components of an OpenAPI document, which is what the tool reads. @param {any} schema */
function asOpenApi({ $defs, $schema: _, title: __, ...scene }) {
  const schemas = { [SCENE]: scene, ...$defs };
  const text = JSON.stringify({ openapi: '3.1.0', info: { title: SCENE, version: '1' }, paths: {}, components: { schemas } });
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
const types = await typescript(asOpenApi(scene), { defaultNonNullable: false, arrayLength: true });
await writeFile(new URL('scene.ts', GENERATED), `${types}\n${choices(scene.$defs)}`);
