// A real `palpa view`, started and stopped.

import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { once } from 'node:events';
import { existsSync, mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { asUser } from './browser.mjs';

const ROOT = fileURLToPath(new URL('../../', import.meta.url));
export const TARGET = process.env.CARGO_TARGET_DIR ?? join(ROOT, 'target');

function binary() {
  const path = process.env.PALPA_BIN ?? join(TARGET, 'release', 'palpa');
  if (!existsSync(path)) throw new Error(`${path} is not there: build it (cargo build --release --bin palpa), or set PALPA_BIN`);
  return path;
}

/** Time limit of each wait, ms; generous, for slow machines. */
export const LONG = 120_000;
/** Time that the viewer may take to end, ms. */
const END = 20_000;

/** @param {number} ms */
export const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

/**
 * Waits until `look` finds something, and returns it.
 * @template T
 * @param {string} what
 * @param {() => Promise<T | false | null | undefined> | T | false | null | undefined} look
 * @param {number} timeout
 * @returns {Promise<T>}
 */
export async function until(what, look, timeout = LONG) {
  const end = performance.now() + timeout;
  for (;;) {
    const found = await look();
    if (found) return found;
    if (performance.now() > end) throw new Error(`not within ${timeout / 1000} s: ${what}`);
    await pause(50);
  }
}

/**
 * The scene of a state, as its file writes it.
 * @param {import('../src/generated/api').State} state
 */
export const sceneOf = (state) => /** @type {import('../src/generated/scene').SceneTable} */ (state.scene);

export class Viewer {
  /** Standard error, for a test that fails. */
  stderr = '';

  /**
   * @param {import('node:child_process').ChildProcess} child
   * @param {string} out
   */
  constructor(child, out) {
    this.child = child;
    this.out = out;
    this.url = '';
    this.port = 0;
  }

  /**
   * `isUser` starts it as somebody who is not root, without the right to a higher priority.
   * @param {{ scene?: string, port?: number, token?: string, isUser?: boolean }} options
   */
  static async start({ scene, port = 0, token, isUser = false } = {}) {
    const out = mkdtempSync(join(tmpdir(), 'palpa-e2e-'));
    const args = ['view', '--no-open', '--port', String(port), '--json', '--allow-faults', '--out', out];
    if (token !== undefined) args.push('--token', token);
    const [program, ...words] = [...(isUser ? asUser() : []), binary(), ...args, ...(scene === undefined ? [] : [scene])];
    const child = spawn(program, words, { stdio: ['ignore', 'pipe', 'pipe'] });
    const viewer = new Viewer(child, out);
    child.stderr?.on('data', (data) => (viewer.stderr += data));
    let stdout = '';
    child.stdout?.on('data', (data) => (stdout += data));
    const started = await until('the viewer says where it is', () => {
      if (child.exitCode !== null) throw new Error(`the viewer ended: ${viewer.stderr}`);
      return stdout.includes('}') && JSON.parse(stdout);
    });
    viewer.url = started.url;
    viewer.port = started.port;
    return viewer;
  }

  /** @param {string} path */
  async get(path) {
    const response = await fetch(new URL(path, this.url));
    assert.equal(response.status, 200, `${path}: ${response.status}`);
    return response;
  }

  /** @returns {Promise<import('../src/generated/api').State>} */
  async state() {
    return (await this.get('api/state')).json();
  }

  /** @returns {Promise<import('../src/generated/api').EngineFigures>} */
  async engine() {
    return (await this.get('api/engine')).json();
  }

  /** The exported body; a new scene has none for a moment. @returns {Promise<string>} */
  body() {
    return until('there is a body to export', async () => {
      const response = await fetch(new URL('api/body.vtu', this.url));
      return response.status === 200 && response.text();
    });
  }

  /** Sends a request, or any text, as a program does. @param {object | string} request */
  async control(request) {
    const response = await fetch(new URL('api/control', this.url), {
      method: 'POST',
      headers: { 'content-type': 'application/json' },
      body: typeof request === 'string' ? request : JSON.stringify(request),
    });
    return { status: response.status, reply: await response.json() };
  }

  /**
   * Waits until the engine runs and its state is as expected.
   * @param {string} what
   * @param {(state: import('../src/generated/api').State) => boolean} isSo
   */
  running(what, isSo) {
    return until(`${what} and the engine runs`, async () => {
      const state = await this.state();
      return state.phase === 'running' && isSo(state) && state;
    });
  }

  /** Asks it to end, as Ctrl-C does. */
  async stop() {
    if (this.child.exitCode === null) {
      const ended = once(this.child, 'exit');
      this.child.kill('SIGINT');
      const tooLate = setTimeout(() => this.child.kill('SIGKILL'), END);
      const [code, signal] = await ended;
      clearTimeout(tooLate);
      assert.notEqual(signal, 'SIGKILL', `it did not end within ${END / 1000} s: ${this.stderr}`);
      assert.ok(code === 0 || code === 130, `it ended with ${code ?? signal}: ${this.stderr}`);
    }
    rmSync(this.out, { recursive: true, force: true });
  }

  /** Ends it as a crash would. */
  async kill() {
    const ended = once(this.child, 'exit');
    this.child.kill('SIGKILL');
    await ended;
    rmSync(this.out, { recursive: true, force: true });
  }
}
