// What a page costs the engine: a client without a browser, on a body of about 10,000 nodes.
//
//   npm run load                     the engine alone and with a client, 60 s each
//   npm run load -- --seconds 5      the same, shorter
//   npm run load -- --memory 10      memory over 10 minutes with 100 reconnections
//   npm run load -- --scene FILE     another scene
//
// A table on standard output, and the same as JSON with --json.

import { readFileSync, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { cpus, tmpdir } from 'node:os';
import { join } from 'node:path';
import { parseArgs } from 'node:util';
import WebSocket from 'ws';
import { Viewer, pause } from './viewer.mjs';

/** The forearm of the gallery, fine all over. */
const SCENE = `
[body]
generator = { kind = "forearm", spacing = "11 mm" }

[[layer]]
tissue = { name = "skin", young = "210 kPa", poisson = 0.45 }
thickness = "1.5 mm"

[[layer]]
tissue = { name = "fat", c10 = "0.42 kPa", bulk = "36 kPa" }
thickness = "4 mm"

[[layer]]
tissue = { name = "muscle", young = "22 kPa", poisson = 0.45 }
levels = 3

[tool]
shape = "sphere"
radius = "10 mm"

[press]
at = ["120 mm", "0 mm", "40 mm"]
depth = "6 mm"

[device]
preset = "falcon"
`;

/** Of the hand's messages: the engine lifts when none comes for a second. */
const HAND_PERIOD = 100;
const RECONNECTS = 100;
const MESH = 1;
const FRAME = 2;

/** @typedef {import('../src/generated/api').Hand} Hand */

/** Reads all that a page reads, and presses as one does. */
class Client {
  frames = { n: 0, bytes: 0 };
  meshes = { n: 0, bytes: 0 };
  /** Times between frames, ms. @type {number[]} */
  gaps = [];
  #last = 0;

  /** @param {WebSocket} socket */
  constructor(socket) {
    this.socket = socket;
    socket.on('message', (data, isBinary) => {
      if (!isBinary) return;
      const bytes = /** @type {Buffer} */ (data);
      const kind = bytes.readUInt32LE(4);
      const sum = kind === FRAME ? this.frames : kind === MESH ? this.meshes : undefined;
      if (sum === undefined) throw new Error(`snapshot of kind ${kind}`);
      sum.n += 1;
      sum.bytes += bytes.length;
      if (kind !== FRAME) return;
      const now = performance.now();
      if (this.#last > 0) this.gaps.push(now - this.#last);
      this.#last = now;
    });
  }

  /** @param {Viewer} viewer @returns {Promise<Client>} */
  static open(viewer) {
    return new Promise((resolve, reject) => {
      const socket = new WebSocket(new URL('ws', viewer.url.replace(/^http/, 'ws')));
      const client = new Client(socket);
      socket.on('open', () => resolve(client));
      socket.on('error', reject);
    });
  }

  /** @param {object} request */
  ask(request) {
    this.socket.send(JSON.stringify(request));
  }
}

/**
 * Presses in and out by a millimetre, so that there is work for the tissue.
 * @param {Hand} home
 * @param {number} depth
 * @param {number} seconds
 * @returns {Hand}
 */
function handAt({ point, normal }, depth, seconds) {
  return { point, normal, depth: depth + 1e-3 * Math.sin(2 * Math.PI * seconds) };
}

/**
 * The engine under a press, with a client or without.
 * @param {string} scene @param {number} seconds @param {boolean} hasClient
 */
async function measure(scene, seconds, hasClient) {
  const viewer = await Viewer.start({ scene });
  try {
    const state = await viewer.running('the body is there', ({ n_nodes }) => n_nodes > 0);
    const client = hasClient ? await Client.open(viewer) : undefined;
    client?.ask({ type: 'take_control' });
    const begin = performance.now();
    const first = await viewer.engine();
    const framesBefore = client?.frames.n ?? 0;
    /** @type {import('../src/generated/api').EngineFigures[]} */
    const figures = [];
    let refused = 0;
    for (;;) {
      const now = (performance.now() - begin) / 1e3;
      if (now > seconds) break;
      const request = { type: 'hand', ...handAt(state.home, state.usual_depth, now) };
      if (client) client.ask(request);
      else if ((await viewer.control(request)).status !== 200) refused += 1;
      if (figures.length < Math.floor(now)) figures.push(await viewer.engine());
      await pause(HAND_PERIOD);
    }
    const last = await viewer.engine();
    figures.push(last);
    const mean = (/** @type {number[]} */ values) => values.reduce((sum, value) => sum + value, 0) / Math.max(values.length, 1);
    const gaps = client?.gaps.sort((a, b) => a - b) ?? [];
    const result = {
      client: hasClient,
      seconds,
      nodes: state.n_nodes,
      tick_rate: { mean: mean(figures.map((f) => f.tick_rate)), least: Math.min(...figures.map((f) => f.tick_rate)) },
      missed: last.missed - first.missed,
      // Since the start of the engine, which was a moment ago: median, 99.9 %, longest, s.
      tick_cpu: last.tick_cpu,
      lateness: last.lateness,
      step_cpu: last.step_cpu,
      tissue_rate: mean(figures.map((f) => f.tissue_rate)),
      refused,
      snapshots: client && {
        rate: (client.frames.n - framesBefore) / seconds,
        bytes_per_frame: client.frames.bytes / Math.max(client.frames.n, 1),
        meshes: client.meshes.n,
        bytes_per_mesh: client.meshes.bytes / Math.max(client.meshes.n, 1),
        longest_gap: (gaps.at(-1) ?? 0) / 1e3,
      },
    };
    client?.socket.terminate();
    return result;
  } finally {
    await viewer.stop();
  }
}

/** Memory of a process that is in use, bytes. @param {number} pid */
function resident(pid) {
  const found = /VmRSS:\s+(\d+) kB/.exec(readFileSync(`/proc/${pid}/status`, 'utf8'));
  if (found === null) throw new Error('the system does not tell memory');
  return Number(found[1]) * 1024;
}

/** @param {string} scene @param {number} minutes */
async function measureMemory(scene, minutes) {
  const viewer = await Viewer.start({ scene });
  try {
    const state = await viewer.running('the body is there', ({ n_nodes }) => n_nodes > 0);
    const pid = /** @type {number} */ (viewer.child.pid);
    const begin = performance.now();
    const total = minutes * 60;
    /** @type {number[]} */
    const bytes = [];
    for (let k = 0; k < RECONNECTS; k++) {
      const client = await Client.open(viewer);
      client.ask({ type: 'take_control' });
      const end = ((k + 1) * total) / RECONNECTS;
      do {
        const now = (performance.now() - begin) / 1e3;
        client.ask({ type: 'hand', ...handAt(state.home, state.usual_depth, now) });
        await pause(HAND_PERIOD);
      } while ((performance.now() - begin) / 1e3 < end);
      // Some close as a page does, some vanish.
      if (k % 2 === 0) client.socket.close();
      else client.socket.terminate();
      bytes.push(resident(pid));
    }
    const tenth = Math.floor(RECONNECTS / 10);
    return { minutes, reconnects: RECONNECTS, first: bytes[0], after_a_tenth: bytes[tenth], last: bytes[RECONNECTS - 1], most: Math.max(...bytes) };
  } finally {
    await viewer.stop();
  }
}

const micro = (/** @type {number[]} */ values) => values.map((s) => `${(s * 1e6).toFixed(1)}`).join(' / ') + ' µs';

/** @param {Awaited<ReturnType<typeof measure>>} r */
function rows(r) {
  return {
    'nodes': String(r.nodes),
    'ticks a second, mean (least)': `${r.tick_rate.mean.toFixed(1)} (${r.tick_rate.least.toFixed(1)})`,
    'missed ticks': String(r.missed),
    'CPU of a tick, 50 % / 99.9 % / longest': micro(r.tick_cpu),
    'lateness, 50 % / 99.9 % / longest': micro(r.lateness),
    'tissue steps a second': r.tissue_rate.toFixed(1),
    'CPU of a step, 50 % / 99.9 % / longest': micro(r.step_cpu),
    'snapshots a second': r.snapshots?.rate.toFixed(1) ?? '-',
    'bytes of a frame': r.snapshots?.bytes_per_frame.toFixed(0) ?? '-',
    'bytes of a mesh (meshes)': r.snapshots ? `${r.snapshots.bytes_per_mesh.toFixed(0)} (${r.snapshots.meshes})` : '-',
    'longest gap between frames': r.snapshots ? `${(r.snapshots.longest_gap * 1e3).toFixed(0)} ms` : '-',
  };
}

const { values } = parseArgs({
  options: { seconds: { type: 'string', default: '60' }, memory: { type: 'string' }, scene: { type: 'string' }, json: { type: 'boolean', default: false } },
});
const folder = mkdtempSync(join(tmpdir(), 'palpa-load-'));
try {
  const scene = values.scene ?? join(folder, 'forearm_10k.toml');
  if (values.scene === undefined) writeFileSync(scene, SCENE);
  if (values.memory !== undefined) {
    const result = await measureMemory(scene, Number(values.memory));
    const mib = (/** @type {number} */ bytes) => `${(bytes / 2 ** 20).toFixed(1)} MiB`;
    console.log(`memory over ${result.minutes} min with ${result.reconnects} reconnections: first ${mib(result.first)}, after a tenth ${mib(result.after_a_tenth)}, last ${mib(result.last)}, most ${mib(result.most)}`);
    if (values.json) console.log(JSON.stringify(result));
  } else {
    const alone = await measure(scene, Number(values.seconds), false);
    const watched = await measure(scene, Number(values.seconds), true);
    const [a, b] = [rows(alone), rows(watched)];
    console.log(`${'on ' + cpus().length + ' cores'.padEnd(1)}`.padEnd(42), 'no client'.padEnd(28), 'with a client');
    for (const name of /** @type {(keyof typeof a)[]} */ (Object.keys(a))) console.log(name.padEnd(42), a[name].padEnd(28), b[name]);
    if (values.json) console.log(JSON.stringify({ alone, watched }));
  }
} finally {
  rmSync(folder, { recursive: true, force: true });
}
