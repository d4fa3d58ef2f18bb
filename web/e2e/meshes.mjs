// Small surfaces as files, made for the tests; and what is needed to drop them on a page.

import { mkdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { inflateRawSync } from 'node:zlib';

/** @typedef {{ points: [number, number, number][], triangles: [number, number, number][] }} Surface */

/**
 * A closed ellipsoid with its long axis along x.
 * @param {[number, number, number]} radii
 * @returns {Surface}
 */
export function ellipsoid(radii, around = 32, along = 28) {
  /** @type {[number, number, number][]} */
  const points = [[-radii[0], 0, 0]];
  for (let i = 1; i < along; i++) {
    const u = (Math.PI * i) / along;
    for (let k = 0; k < around; k++) {
      const v = (2 * Math.PI * k) / around;
      points.push([-radii[0] * Math.cos(u), radii[1] * Math.sin(u) * Math.cos(v), radii[2] * Math.sin(u) * Math.sin(v)]);
    }
  }
  points.push([radii[0], 0, 0]);
  const last = points.length - 1;
  const at = (/** @type {number} */ i, /** @type {number} */ k) => 1 + (i - 1) * around + (k % around);
  /** @type {[number, number, number][]} */
  const triangles = [];
  for (let k = 0; k < around; k++) {
    triangles.push([0, at(1, k + 1), at(1, k)]);
    triangles.push([last, at(along - 1, k), at(along - 1, k + 1)]);
    for (let i = 1; i < along - 1; i++) {
      triangles.push([at(i, k), at(i, k + 1), at(i + 1, k)]);
      triangles.push([at(i, k + 1), at(i + 1, k + 1), at(i + 1, k)]);
    }
  }
  return { points, triangles };
}

/** @param {Surface} surface @param {number} factor @returns {Surface} */
export const scaled = ({ points, triangles }, factor) => ({
  points: points.map((p) => /** @type {[number, number, number]} */ (p.map((x) => x * factor))),
  triangles,
});

/** A binary STL. @param {Surface} surface */
export function stl({ points, triangles }) {
  const bytes = Buffer.alloc(84 + 50 * triangles.length);
  bytes.writeUInt32LE(triangles.length, 80);
  triangles.forEach((triangle, t) => {
    triangle.flatMap((v) => points[v]).forEach((x, k) => bytes.writeFloatLE(x, 84 + 50 * t + 12 + 4 * k));
  });
  return bytes;
}

/** @param {Surface} surface */
export function obj({ points, triangles }) {
  const lines = [...points.map((p) => `v ${p.join(' ')}`), ...triangles.map((t) => `f ${t.map((v) => v + 1).join(' ')}`)];
  return Buffer.from(`${lines.join('\n')}\n`);
}

/** A binary glTF. @param {Surface} surface */
export function glb({ points, triangles }) {
  const indices = Buffer.alloc(4 * 3 * triangles.length);
  triangles.flat().forEach((v, k) => indices.writeUInt32LE(v, 4 * k));
  const positions = Buffer.alloc(4 * 3 * points.length);
  points.flat().forEach((x, k) => positions.writeFloatLE(x, 4 * k));
  const document = {
    asset: { version: '2.0' },
    scenes: [{ nodes: [0] }],
    scene: 0,
    nodes: [{ mesh: 0 }],
    meshes: [{ primitives: [{ attributes: { POSITION: 1 }, indices: 0 }] }],
    accessors: [
      { bufferView: 0, componentType: 5125, count: 3 * triangles.length, type: 'SCALAR' },
      { bufferView: 1, componentType: 5126, count: points.length, type: 'VEC3' },
    ],
    bufferViews: [
      { buffer: 0, byteOffset: 0, byteLength: indices.length },
      { buffer: 0, byteOffset: indices.length, byteLength: positions.length },
    ],
    buffers: [{ byteLength: indices.length + positions.length }],
  };
  const chunk = (/** @type {string} */ kind, /** @type {Buffer} */ content, /** @type {string} */ fill) => {
    const padded = Buffer.concat([content, Buffer.alloc((4 - (content.length % 4)) % 4, fill)]);
    const head = Buffer.alloc(8);
    head.writeUInt32LE(padded.length, 0);
    head.write(kind, 4, 'latin1');
    return Buffer.concat([head, padded]);
  };
  const chunks = Buffer.concat([chunk('JSON', Buffer.from(JSON.stringify(document)), ' '), chunk('BIN\0', Buffer.concat([indices, positions]), '\0')]);
  const head = Buffer.alloc(12);
  head.write('glTF', 0, 'latin1');
  head.writeUInt32LE(2, 4);
  head.writeUInt32LE(12 + chunks.length, 8);
  return Buffer.concat([head, chunks]);
}

/** The files of a ZIP, by name. @param {Buffer} bytes @returns {Map<string, Buffer>} */
export function unzipped(bytes) {
  const files = new Map();
  const end = bytes.lastIndexOf(Buffer.from('PK\x05\x06', 'latin1'));
  let at = bytes.readUInt32LE(end + 16);
  for (let k = bytes.readUInt16LE(end + 10); k > 0; k--) {
    const [method, size, nName, nExtra, nComment] = [10, 20, 28, 30, 32].map((o) => (o === 20 ? bytes.readUInt32LE(at + o) : bytes.readUInt16LE(at + o)));
    const local = bytes.readUInt32LE(at + 42);
    const name = bytes.subarray(at + 46, at + 46 + nName).toString();
    const from = local + 30 + bytes.readUInt16LE(local + 26) + bytes.readUInt16LE(local + 28);
    const content = bytes.subarray(from, from + size);
    files.set(name, method === 8 ? inflateRawSync(content) : content);
    at += 46 + nName + nExtra + nComment;
  }
  return files;
}

/**
 * Drops files on a page, as one drags them from a folder of the system.
 * @param {import('./page.mjs').PalpaPage} palpa
 * @param {string[]} paths
 */
export async function dropPaths(palpa, paths, x = 640, y = 360) {
  const session = await palpa.page.context().newCDPSession(palpa.page);
  const data = { items: [], files: paths, dragOperationsMask: 1 };
  for (const type of /** @type {const} */ (['dragEnter', 'dragOver', 'drop'])) {
    await session.send('Input.dispatchDragEvent', { type, x, y, data });
    if (type === 'dragOver') {
      const isDialogOpen = (await palpa.page.locator('dialog[open]').count()) > 0;
      if (!isDialogOpen) await palpa.by('drop').waitFor();
    }
  }
  await session.detach();
}

/**
 * Writes files and drops them on a page.
 * @param {import('./page.mjs').PalpaPage} palpa
 * @param {Record<string, Buffer | string>} files by name
 */
export async function drop(palpa, files) {
  const folder = join(palpa.viewer.out, `dropped-${(n += 1)}`);
  mkdirSync(folder, { recursive: true });
  const paths = Object.entries(files).map(([name, bytes]) => {
    const path = join(folder, name);
    writeFileSync(path, bytes);
    return path;
  });
  await dropPaths(palpa, paths);
}
let n = 0;
