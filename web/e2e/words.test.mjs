// Words: nothing that the engine names lacks them in one of the page's languages. Kinds of notes, events and notices are
// checked by the compiler; these names are not in the types.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import ts from 'typescript';

const ROOT = new URL('../../', import.meta.url);
/** @param {string} path */
const read = (path) => readFileSync(new URL(path, ROOT), 'utf8');

/**
 * The keys of an object that a module of the page declares.
 * @param {string} path
 * @param {string} name
 */
function keysOf(path, name) {
  /** @type {Set<string>} */
  const keys = new Set();
  const file = ts.createSourceFile(path, read(path), ts.ScriptTarget.ES2022);
  file.forEachChild((statement) => {
    if (!ts.isVariableStatement(statement)) return;
    for (const { name: declared, initializer } of statement.declarationList.declarations) {
      if (!ts.isIdentifier(declared) || declared.text !== name || initializer === undefined) continue;
      const object = ts.isSatisfiesExpression(initializer) ? initializer.expression : initializer;
      assert.ok(ts.isObjectLiteralExpression(object), `${name} of ${path} is an object`);
      for (const { name: key } of object.properties) if (key !== undefined && (ts.isIdentifier(key) || ts.isStringLiteral(key))) keys.add(key.text);
    }
  });
  assert.ok(keys.size > 0, `${path} declares ${name}`);
  return keys;
}

/** @param {Iterable<string>} wanted @param {Set<string>} there */
const missing = (wanted, there) => [...wanted].filter((key) => !there.has(key));

test('every kind of finding has words in both languages', () => {
  const body = /pub enum FindingKind \{([^}]*)\}/.exec(read('crates/palpa-mesh/src/check/mod.rs'))?.[1] ?? '';
  const kinds = [...body.matchAll(/^\s+([A-Z]\w*),$/gm)].map(([, name]) => name.replace(/(?!^)[A-Z]/g, '-$&').toLowerCase());
  assert.ok(kinds.length >= 22, `kinds: ${kinds}`);
  for (const language of ['en', 'ja']) {
    assert.deepEqual(missing(kinds, keysOf('web/src/i18n/findings.ts', language)), [], language);
  }
});

test('tissues of the catalogue and scenes of the gallery have names in both languages', () => {
  const tissues = [...read('crates/palpa-scene/data/tissues.toml').matchAll(/^name = "(.*)"$/gm)].map(([, name]) => `tissue.${name}`);
  const scenes = [...read('crates/palpa-scene/src/built_in.rs').matchAll(/in_gallery\(scene!\(\s*"(\w+)"/g)].map(([, key]) => key);
  const names = [...tissues, ...scenes.flatMap((key) => [`gallery.${key}`, `gallery_about.${key}`])];
  // Tissues and lumps that those scenes name themselves.
  for (const key of scenes) {
    for (const [, name] of read(`crates/palpa-scene/scenes/${key}.toml`).matchAll(/\bname = "(.*?)"/g)) names.push(`tissue.${name}`);
  }
  assert.ok(tissues.length >= 15, `tissues: ${tissues}`);
  assert.ok(scenes.length >= 6, `scenes: ${scenes}`);
  for (const language of ['en', 'ja']) {
    assert.deepEqual(missing(names, keysOf(`web/src/i18n/${language}.ts`, language)), [], language);
  }
});
