// What the page costs and how soon it feels, as a user has it: the viewer and a browser that draws
// in software, both at ordinary priority, on an otherwise idle machine.
//
//   make bench-page                        all of it
//   npm run bench-page -- --presses 10     fewer presses
//   npm run bench-page -- --minutes 60     mixed use for an hour, for memory
//   npm run bench-page -- --scene block    another scene
//
// A table on standard output, and the same as JSON with --json FILE. Exit status 1 if a bound of
// docs/viewer.md is not kept; --no-bounds only measures.

import { readdirSync, readFileSync, writeFileSync } from 'node:fs';
import { cpus } from 'node:os';
import { parseArgs } from 'node:util';
import WebSocket from 'ws';
import { launch } from './browser.mjs';
import { PalpaPage } from './page.mjs';
import { pause, until, Viewer } from './viewer.mjs';

const { values } = parseArgs({
  options: {
    scene: { type: 'string' },
    presses: { type: 'string', default: '100' },
    strokes: { type: 'string', default: '20' },
    rest: { type: 'string', default: '20' },
    minutes: { type: 'string' },
    granted: { type: 'boolean', default: false },
    json: { type: 'string' },
    'no-bounds': { type: 'boolean', default: false },
  },
});

/** Clock ticks a second of /proc/PID/stat. */
const HERTZ = 100;
const FRAME = 2;
/** A press: how long the button is held, and the pause before the next, ms. */
const HOLD = 2500;
const BETWEEN = 700;
/** The last part of a press is its final force, ms. */
const SETTLED = 500;
/** A dip: the force is lower than before and after by this share, in this time, s. */
const DIP_SHARE = 0.1;
const DIP_TIME = 0.25;
/** Forces below this are not judged, N. */
const LEAST_FORCE = 0.1;

// Processes

/** Fields of /proc/PID/stat after the name. @param {number} pid */
function stat(pid) {
  try {
    const text = readFileSync(`/proc/${pid}/stat`, 'utf8');
    return text.slice(text.lastIndexOf(')') + 2).split(' ');
  } catch {
    return undefined;
  }
}

/** A process and all under it. @param {number} root @returns {number[]} */
function tree(root) {
  /** @type {Map<number, number[]>} */
  const children = new Map();
  for (const name of readdirSync('/proc')) {
    const pid = Number(name);
    const parent = Number.isInteger(pid) ? Number(stat(pid)?.[1] ?? NaN) : NaN;
    if (Number.isNaN(parent)) continue;
    children.set(parent, [...(children.get(parent) ?? []), pid]);
  }
  const all = [root];
  for (const pid of all) all.push(...(children.get(pid) ?? []));
  return all;
}

/** CPU time of processes, s. @param {number[]} pids */
const cpuOf = (pids) => pids.reduce((sum, pid) => {
  const fields = stat(pid);
  return sum + (fields ? (Number(fields[11]) + Number(fields[12])) / HERTZ : 0);
}, 0);

/** Memory of processes that they do not share, bytes. @param {number[]} pids */
function memoryOf(pids) {
  let sum = 0;
  for (const pid of pids) {
    try {
      const text = readFileSync(`/proc/${pid}/smaps_rollup`, 'utf8');
      sum += 1024 * Number(/^Pss:\s+(\d+)/m.exec(text)?.[1] ?? 0);
    } catch {
      // It has ended.
    }
  }
  return sum;
}

// What is measured in the page and beside it

/** Runs in the page before its own code: notes when pictures are drawn, frames come and the button goes down. */
function watch() {
  const seen = { pictures: /** @type {number[]} */ ([]), frames: /** @type {[number, number, number][]} */ ([]), downs: /** @type {number[]} */ ([]), writes: 0, strokes: 0 };
  /** @type {any} */ (window).palpaSeen = seen;
  let isNew = true;
  const ask = window.requestAnimationFrame.bind(window);
  window.requestAnimationFrame = (callback) => ask((now) => {
    isNew = true;
    callback(now);
  });
  for (const name of /** @type {const} */ (['drawElements', 'drawArrays'])) {
    const draw = WebGL2RenderingContext.prototype[name];
    /** @type {any} */ (WebGL2RenderingContext.prototype)[name] = function (/** @type {any[]} */ ...args) {
      if (isNew) seen.pictures.push(performance.now());
      isNew = false;
      // @ts-expect-error the arguments are passed on
      return draw.apply(this, args);
    };
  }
  const stroke = CanvasRenderingContext2D.prototype.stroke;
  /** @type {any} */ (CanvasRenderingContext2D.prototype).stroke = function (/** @type {any[]} */ ...args) {
    seen.strokes += 1;
    // @ts-expect-error the arguments are passed on
    return stroke.apply(this, args);
  };
  const Socket = window.WebSocket;
  // @ts-expect-error the page uses no more of it
  window.WebSocket = function (/** @type {string} */ url) {
    const socket = new Socket(url);
    socket.addEventListener('message', ({ data }) => {
      if (typeof data === 'string') return;
      const view = new DataView(data);
      if (view.getUint32(4, true) !== 2) return;
      const at = /** @type {any} */ (window).palpaOffsets;
      if (!at) return;
      const force = Math.hypot(...[0, 1, 2].map((c) => view.getFloat64(at.force + 8 * c, true)));
      seen.frames.push([performance.now(), view.getFloat64(at.time, true), force]);
    });
    return socket;
  };
  Object.assign(window.WebSocket, { OPEN: Socket.OPEN, CONNECTING: Socket.CONNECTING });
  window.addEventListener('pointerdown', () => seen.downs.push(performance.now()), { capture: true });
  new MutationObserver((list) => (seen.writes += list.length)).observe(document, { subtree: true, childList: true, characterData: true, attributes: true });
}

/** @typedef {{ at: number, time: number, force: number, gain: number, depth: number, status: number }} Seen */

/** A client that watches the force beside the page: what the engine did, whatever the page shows. */
class Watcher {
  /** @type {Seen[]} */
  frames = [];
  bytes = 0;
  /** @param {WebSocket} socket @param {Offsets} at */
  constructor(socket, at) {
    this.socket = socket;
    socket.on('message', (data, isBinary) => {
      const bytes = /** @type {Buffer} */ (data);
      if (!isBinary || bytes.readUInt32LE(4) !== FRAME) return;
      this.bytes += bytes.length;
      this.frames.push({
        at: performance.now(),
        time: bytes.readDoubleLE(at.time),
        force: Math.hypot(...[0, 1, 2].map((c) => bytes.readDoubleLE(at.force + 8 * c))),
        gain: bytes.readDoubleLE(at.gain),
        depth: bytes.readDoubleLE(at.depth),
        status: bytes.readUInt32LE(at.status),
      });
    });
  }

  /** @param {Viewer} viewer @returns {Promise<Watcher>} */
  static open(viewer) {
    return new Promise((resolve, reject) => {
      const socket = new WebSocket(new URL('ws', viewer.url.replace(/^http/, 'ws')));
      const watcher = new Watcher(socket, offsets());
      socket.on('open', () => resolve(watcher));
      socket.on('error', reject);
    });
  }
}

/** @typedef {Record<'time' | 'force' | 'gain' | 'depth' | 'status', number>} Offsets */

/** Where the parts of a frame lie, read off the page's own reader. @returns {Offsets} */
function offsets() {
  const text = readFileSync(new URL('../src/generated/wire.ts', import.meta.url), 'utf8');
  const body = /function readFrameSnapshot[\s\S]*?\n}/.exec(text)?.[0] ?? '';
  const sizes = { u32: 4, f64: 8 };
  /** @type {Record<string, number>} */
  const found = {};
  let at = 8;
  for (const line of body.split('\n')) {
    const name = /(?:const )?(\w+)(?: =|:)/.exec(line)?.[1];
    const reads = [...line.matchAll(/\.(u32|f64)\(\)/g)].map((m) => /** @type {'u32' | 'f64'} */ (m[1]));
    if (/\.(u8s|u16s|i16s|u32s|f32s)\(\)/.test(line)) break;
    for (const [k, kind] of reads.entries()) {
      at = Math.ceil(at / sizes[kind]) * sizes[kind];
      if (k === 0 && name) found[name] = at;
      at += sizes[kind];
    }
  }
  const { time, force, gain, depth, step_status: status } = found;
  for (const [name, value] of Object.entries({ time, force, gain, depth, status })) if (value === undefined) throw new Error(`a frame has no ${name}`);
  return { time, force, gain, depth, status };
}

// Sums

/** @param {number[]} sorted @param {number} share */
const quantile = (sorted, share) => sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))] ?? NaN;
/** @param {number[]} list */
const spread = (list) => {
  const sorted = list.filter(Number.isFinite).sort((a, b) => a - b);
  return { median: quantile(sorted, 0.5), p95: quantile(sorted, 0.95), largest: sorted.at(-1) ?? NaN, n: sorted.length };
};

/** The deepest dip of a force: by how much it was below what it was before and after. @param {Seen[]} frames */
function deepestDip(frames) {
  let worst = { share: 0, at: NaN };
  for (let i = 0; i < frames.length; i++) {
    let before = 0, after = 0;
    for (let k = i; k >= 0 && frames[i].time - frames[k].time < DIP_TIME; k--) before = Math.max(before, frames[k].force);
    for (let k = i; k < frames.length && frames[k].time - frames[i].time < DIP_TIME; k++) after = Math.max(after, frames[k].force);
    const level = Math.min(before, after);
    if (level < LEAST_FORCE) continue;
    const share = 1 - frames[i].force / level;
    if (share > worst.share) worst = { share, at: frames[i].time };
  }
  return worst;
}

// Runs

/** CPU of the two over so many seconds; shares of a core. @param {Bench} bench @param {number} seconds */
async function cpu({ viewer, browserPid }, seconds) {
  const engine = [/** @type {number} */ (viewer.child.pid)];
  const before = { engine: cpuOf(engine), browser: browserPid ? cpuOf(tree(browserPid)) : 0, at: performance.now() };
  await pause(seconds * 1e3);
  const took = (performance.now() - before.at) / 1e3;
  return {
    engine: (cpuOf(engine) - before.engine) / took,
    browser: browserPid ? (cpuOf(tree(browserPid)) - before.browser) / took : 0,
  };
}

/** @typedef {{ viewer: Viewer, palpa: PalpaPage, watcher: Watcher, browserPid: number }} Bench */

/** @typedef {{ pictures: number[], frames: [at: number, time: number, force: number][], downs: number[], writes: number, strokes: number }} InPage */

/** What was seen since the last call. @param {Bench} bench @returns {Promise<InPage>} */
const seenOf = ({ palpa }) => palpa.page.evaluate(() => {
  const seen = /** @type {any} */ (window).palpaSeen;
  const taken = { ...seen };
  Object.assign(seen, { pictures: [], frames: [], downs: [], writes: 0, strokes: 0 });
  return taken;
});

/** @param {Bench} bench */
async function untouched(bench, seconds = Number(values.rest)) {
  await seenOf(bench);
  const [n, bytes] = [bench.watcher.frames.length, bench.watcher.bytes];
  const used = await cpu(bench, seconds);
  const after = await seenOf(bench);
  return {
    ...used,
    pictures: after.pictures.length / seconds,
    writes: after.writes / seconds,
    strokes: after.strokes / seconds,
    snapshots: (bench.watcher.frames.length - n) / seconds,
    bytes: (bench.watcher.bytes - bytes) / seconds,
  };
}

/** Numbers that look random and are the same in every run. */
function* shares(seed = 7) {
  let x = seed;
  for (;;) {
    x = (x * 1103515245 + 12345) % 2147483648;
    yield x / 2147483648;
  }
}

/**
 * Presses at places all over the visible body, each held at rest.
 * @param {Bench} bench @param {number} n @param {number} hover time over the place before the press, ms
 */
async function presses(bench, n, hover) {
  const { palpa, watcher } = bench;
  const random = shares();
  const next = () => /** @type {number} */ (random.next().value);
  const results = [];
  const used = { engine: 0, browser: 0 };
  for (let i = 0; i < n; i++) {
    const [x, y] = await palpa.at(0.3 + 0.4 * next(), 0.44 + 0.1 * next());
    await palpa.page.mouse.move(x, y);
    if (hover > 0) await pause(hover);
    const from = watcher.frames.length;
    await seenOf(bench);
    await palpa.page.mouse.down();
    const load = await cpu(bench, HOLD / 1e3);
    const seen = await seenOf(bench);
    await palpa.page.mouse.up();
    used.engine += load.engine / n;
    used.browser += load.browser / n;
    const down = seen.downs[0];
    const frames = seen.frames.filter(([at]) => at >= down);
    const end = down + HOLD;
    const held = watcher.frames.slice(from).filter(({ depth }) => depth > 0);
    // A body at rest sends two frames a second: the last one before that time still holds.
    const settled = frames.findLastIndex(([at]) => at <= end - SETTLED);
    const late = frames.slice(Math.max(settled, 0)).filter(([at]) => at <= end).map(([, , force]) => force).sort((a, b) => a - b);
    const final = quantile(late, 0.5);
    const first = frames.find(([, , force]) => force > 0.01);
    const most = frames.find(([, , force]) => force > 0.95 * final);
    const dip = deepestDip(held);
    results.push({
      place: [x, y], final,
      first: first ? (first[0] - down) / 1e3 : NaN,
      most: most ? (most[0] - down) / 1e3 : NaN,
      pictures: seen.pictures.filter((at) => at > down && at <= end).length / (HOLD / 1e3),
      moving: rateIn(seen.pictures, down, most ? most[0] : end),
      dip: dip.share,
      gain: held.reduce((least, { gain }) => Math.min(least, gain), 1),
    });
    await pause(BETWEEN);
  }
  return { used, results };
}

/** @param {number[]} at @param {number} begin @param {number} end */
const rateIn = (at, begin, end) => at.filter((t) => t > begin && t <= end).length / ((end - begin) / 1e3);

/** Strokes along the body, forth and back. @param {Bench} bench @param {number} n */
async function strokes(bench, n) {
  const { palpa, watcher } = bench;
  const results = [];
  const used = { engine: 0, browser: 0 };
  for (let i = 0; i < n; i++) {
    const y = 0.46 + 0.06 * (i % 3) / 2;
    const [from, to] = i % 2 === 0 ? [0.38, 0.62] : [0.62, 0.38];
    await palpa.page.mouse.move(...(await palpa.at(from, y)));
    await pause(300);
    await palpa.page.mouse.down();
    await pause(1200);
    const begin = watcher.frames.length;
    await seenOf(bench);
    const load = cpu(bench, 3);
    const steps = 90;
    for (let k = 1; k <= steps; k++) {
      await palpa.page.mouse.move(...(await palpa.at(from + ((to - from) * k) / steps, y)));
      await pause(30);
    }
    const { engine, browser } = await load;
    used.engine += engine / n;
    used.browser += browser / n;
    const seen = await seenOf(bench);
    const frames = watcher.frames.slice(begin);
    await palpa.page.mouse.up();
    const took = (frames.at(-1)?.at ?? 0) - (frames[0]?.at ?? 0);
    results.push({
      dip: deepestDip(frames).share,
      gain: frames.reduce((least, { gain }) => Math.min(least, gain), 1),
      pictures: seen.pictures.length / (took / 1e3),
      behind: frames.filter(({ status }) => status === 2).length / Math.max(frames.length, 1),
    });
    await pause(BETWEEN);
  }
  return { used, results };
}

/** Mixed use for memory. @param {Bench} bench @param {number} minutes */
async function memory(bench, minutes) {
  const { palpa, viewer, browserPid } = bench;
  const end = performance.now() + minutes * 60e3;
  const own = () => ({ engine: memoryOf([/** @type {number} */ (viewer.child.pid)]), browser: memoryOf(tree(browserPid)) });
  const first = own();
  const most = { ...first };
  let rounds = 0;
  const look = () => {
    const now = own();
    most.engine = Math.max(most.engine, now.engine);
    most.browser = Math.max(most.browser, now.browser);
    return now;
  };
  let last = first;
  while (performance.now() < end) {
    await presses(bench, 3, 200);
    look();
    await strokes(bench, 2);
    look();
    await palpa.tab('view');
    for (const name of ['displacement', 'von_mises', 'tissue']) {
      await palpa.by('colour-by').selectOption(name);
      await pause(1000);
    }
    if (rounds % 4 === 3) {
      for (const request of [{ type: 'start_game', n_lumps: 2 }, { type: 'reveal' }, { type: 'end_game' }]) {
        await askPage(bench, request);
        await viewer.running('the round is there', () => true);
        await presses(bench, 1, 200);
        look();
      }
      for (const key of ['block', 'forearm']) await palpa.choose(key);
    }
    rounds += 1;
    last = look();
  }
  return { minutes, rounds, first, last, most };
}

/** A request of the page that is in control. @param {Bench} bench @param {object} request */
async function askPage(bench, request) {
  const { type } = /** @type {{ type: string }} */ (request);
  const { palpa } = bench;
  await palpa.tab('game');
  await palpa.by({ start_game: 'game-start', reveal: 'game-reveal', end_game: 'game-end' }[type] ?? type).click();
  await until(`${type} is done`, async () => {
    const { phase } = await bench.viewer.state();
    return phase === 'running';
  });
}

// Table

const percent = (/** @type {number} */ share) => `${(100 * share).toFixed(0)} %`;
const ms = (/** @type {number} */ s) => `${(1e3 * s).toFixed(0)} ms`;
const mib = (/** @type {number} */ bytes) => `${(bytes / 2 ** 20).toFixed(0)} MiB`;
/** @param {{ median: number, p95: number, largest: number }} s @param {(x: number) => string} as */
const three = (s, as) => `${as(s.median)}, ${as(s.p95)}, ${as(s.largest)}`;

/** @type {[what: string, found: string, bound: string, isKept: boolean | null][]} */
const rows = [];
/** @param {string} what @param {string} found @param {string} [bound] @param {boolean} [isKept] */
const row = (what, found, bound = '', isKept) => rows.push([what, found, bound, isKept ?? null]);

const viewer = await Viewer.start({ scene: values.scene, isUser: !values.granted });
/** @type {Record<string, unknown>} */
const all = { cores: cpus().length, model: cpus()[0].model };
let browser;
try {
  await viewer.running('the body is there', ({ n_nodes }) => n_nodes > 0);
  await pause(3000);
  const alone = await cpu({ viewer, browserPid: 0, palpa: /** @type {any} */ (null), watcher: /** @type {any} */ (null) }, Number(values.rest));
  browser = await launch(undefined, { isBehind: false });
  const context = await browser.newContext({ viewport: { width: 1280, height: 720 }, locale: 'en', colorScheme: 'light' });
  const page = await context.newPage();
  await page.addInitScript(watch);
  await page.addInitScript((at) => {
    /** @type {any} */ (window).palpaOffsets = at;
  }, offsets());
  const palpa = new PalpaPage(page, viewer);
  await page.goto(viewer.url);
  const first = await palpa.drawn();
  await palpa.running();
  const watcher = await Watcher.open(viewer);
  const browserPid = await until('the browser is found', () => tree(process.pid).find((pid) => pid !== viewer.child.pid && /chrom/.test(commandOf(pid))));
  /** @type {Bench} */
  const bench = { viewer, palpa, watcher, browserPid };
  // A new page settles: fonts, the full picture, error bars.
  await pause(15_000);
  if (values.minutes !== undefined) {
    const used = await memory(bench, Number(values.minutes));
    all.memory = used;
    row(`memory of the engine over ${used.minutes} min: first, last, most`, [used.first, used.last, used.most].map((m) => mib(m.engine)).join(', '));
    row('memory of the browser: first, last, most', [used.first, used.last, used.most].map((m) => mib(m.browser)).join(', '));
  } else {
    const rest = await untouched(bench);
    const hovered = await presses(bench, Number(values.presses), 300);
    const stroked = await strokes(bench, Number(values.strokes));
    await pause(10_000);
    const after = await untouched(bench);
    const engine = await viewer.engine();
    Object.assign(all, { alone, first, rest, hovered, stroked, after, engine });
    row('first picture of the body', ms(first / 1e3));
    row('at rest: engine without a page', percent(alone.engine));
    row('at rest: engine', percent(rest.engine), '≤ alone + 5 %', rest.engine <= alone.engine + 0.05);
    row('at rest: browser', percent(rest.browser), '≤ 5 %', rest.browser <= 0.05);
    row('at rest: snapshots, pictures, DOM writes, curves a second', [rest.snapshots, rest.pictures, rest.writes, rest.strokes].map((x) => x.toFixed(1)).join(', '), '≤ 2, 0, 0, 0', rest.snapshots <= 2.2 && rest.pictures === 0 && rest.writes === 0 && rest.strokes === 0);
    row('at rest after use: engine, browser', `${percent(after.engine)}, ${percent(after.browser)}`);
    const list = hovered.results;
    const [firsts, mosts] = [spread(list.map((r) => r.first)), spread(list.map((r) => r.most))];
    row(`${list.length} presses: first force, median, 95 %, largest`, three(firsts, ms), '≤ 150 ms (median)', firsts.median <= 0.15);
    row('95 % of the final force', three(mosts, ms), '≤ 600 ms (median)', mosts.median <= 0.6);
    row('pictures a second while the body moves', three(spread(list.map((r) => -r.moving)), (x) => (-x).toFixed(1)), '≥ 15 (median)', -spread(list.map((r) => -r.moving)).median >= 15);
    row('engine, browser while pressing', `${percent(hovered.used.engine)}, ${percent(hovered.used.browser)}`);
    row('presses without a force', String(list.filter((r) => !(r.final > 0.05)).length));
    const drops = list.filter((r) => r.dip > DIP_SHARE || r.gain < 1 - DIP_SHARE);
    row('presses with a drop of more than 10 % (deepest; least share of the force)', `${drops.length} (${percent(Math.max(...list.map((r) => r.dip)))}; ${percent(Math.min(...list.map((r) => r.gain)))})`, '0', drops.length === 0);
    const s = stroked.results;
    const sunk = s.filter((r) => r.dip > DIP_SHARE || r.gain < 1 - DIP_SHARE);
    row(`${s.length} strokes with a drop of more than 10 % (deepest; least share)`, `${sunk.length} (${percent(Math.max(...s.map((r) => r.dip)))}; ${percent(Math.min(...s.map((r) => r.gain)))})`, '0', sunk.length === 0);
    row('pictures a second in a stroke', three(spread(s.map((r) => -r.pictures)), (x) => (-x).toFixed(1)), '≥ 15 (median)', -spread(s.map((r) => -r.pictures)).median >= 15);
    row('frames of strokes behind the hand', percent(s.reduce((sum, r) => sum + r.behind, 0) / Math.max(s.length, 1)));
    row('engine, browser in a stroke', `${percent(stroked.used.engine)}, ${percent(stroked.used.browser)}`);
    row('memory: engine, browser', `${mib(memoryOf([/** @type {number} */ (viewer.child.pid)]))}, ${mib(memoryOf(tree(browserPid)))}`);
  }
  watcher.socket.terminate();
} finally {
  await browser?.close();
  await viewer.stop();
}

/** @param {number} pid */
function commandOf(pid) {
  try {
    return readFileSync(`/proc/${pid}/cmdline`, 'utf8');
  } catch {
    return '';
  }
}

console.log(`${cpus().length} cores, ${cpus()[0].model}; engine ${values.granted ? 'with the priority that it asks for' : 'at ordinary priority'}, browser at ordinary priority, drawing in software`);
for (const [what, found, bound, isKept] of rows) console.log(what.padEnd(78), found.padEnd(30), bound.padEnd(20), isKept === null ? '' : isKept ? 'kept' : 'NOT KEPT');
if (values.json !== undefined) writeFileSync(values.json, `${JSON.stringify({ ...all, rows }, null, 1)}\n`);
if (!values['no-bounds'] && rows.some(([, , , isKept]) => isKept === false)) process.exitCode = 1;
