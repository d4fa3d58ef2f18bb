// The browser that the tests drive: one that is installed, Debian's Chromium for one;
// none is downloaded.
//
// `node e2e/browser.mjs` says which it is; with `--install` it asks Debian for one
// when there is none.

import { execFileSync, spawnSync } from 'node:child_process';
import { accessSync, constants, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { delimiter, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { chromium } from 'playwright-core';

const NAMES = ['chromium', 'chromium-browser', 'google-chrome'];

const HINT = `no browser was found. Install Chromium (on Debian: apt-get install chromium), or say where one is:
  PALPA_CHROMIUM=/path/to/chromium`;

/** Debian's packages: the browser, and letters for the page in Japanese. */
const PACKAGES = ['chromium', 'fonts-ipafont-gothic'];

/** Quiet. */
const ARGS = [
  '--no-sandbox',
  '--disable-quic',
  '--no-first-run',
  '--disable-background-networking',
  '--disable-component-update',
  '--disable-sync',
];
/** Where there is no graphics card the processor draws WebGL, and the browser puts pages together without it, as it
 * does for users. */
const SOFTWARE_GL = ['--enable-unsafe-swiftshader'];
export const NO_GL = ['--disable-gpu', '--disable-software-rasterizer', '--disable-3d-apis'];

/** @param {string} path */
function canRun(path) {
  try {
    accessSync(path, constants.X_OK);
    return true;
  } catch {
    return false;
  }
}

/** @param {string} name */
function inPath(name) {
  const folders = (process.env.PATH ?? '').split(delimiter);
  return folders.map((folder) => join(folder, name)).find(canRun);
}

/** Path of a browser, or none. */
function findBrowser() {
  const told = process.env.PALPA_CHROMIUM;
  if (told !== undefined && told !== '') {
    if (!canRun(told)) throw new Error(`PALPA_CHROMIUM=${told} cannot be run`);
    return told;
  }
  return NAMES.map(inPath).find((path) => path !== undefined);
}

/** Before a command: takes from root what users have not, the right to a higher priority. */
export function asUser() {
  const setpriv = process.getuid?.() === 0 ? inPath('setpriv') : undefined;
  return setpriv ? [setpriv, '--bounding-set', '-sys_nice'] : [];
}

/**
 * A program that runs the browser behind everything else. Drawing in software takes all cores, and
 * as root Chromium would even put itself before the engine's tissue, which then answers too late to
 * be felt. Where the kernel shares the cores out by terminal sessions first (autogroups), it is the
 * session that has to be behind; the browser has one of its own.
 * @param {string} browser
 * @param {boolean} isBehind whether it is; if not, it has the priority that it has for a user
 */
function wrapped(browser, isBehind) {
  const nice = isBehind ? inPath('nice') : undefined;
  const before = [...asUser(), ...(nice ? [nice, '-n', '10'] : [])];
  const group = isBehind ? '(echo 19 > /proc/self/autogroup) 2>/dev/null\n' : '';
  const folder = mkdtempSync(join(tmpdir(), 'palpa-browser-'));
  process.once('exit', () => rmSync(folder, { recursive: true, force: true }));
  const path = join(folder, 'browser');
  const words = [...before, browser].map((word) => `'${word.replaceAll("'", String.raw`'\''`)}'`);
  writeFileSync(path, `#!/bin/sh\n${group}exec ${words.join(' ')} "$@"\n`, { mode: 0o755 });
  return path;
}

/**
 * @param {string[]} graphics
 * @param {{ isBehind?: boolean }} options
 * @returns {Promise<import('playwright-core').Browser>}
 */
export function launch(graphics = SOFTWARE_GL, { isBehind = true } = {}) {
  const found = findBrowser();
  if (found === undefined) throw new Error(HINT);
  return chromium.launch({ executablePath: wrapped(found, isBehind), args: [...ARGS, ...graphics] });
}

function install() {
  const apt = inPath('apt-get');
  if (apt === undefined) throw new Error(HINT);
  const isRoot = process.getuid?.() === 0;
  if (!isRoot && spawnSync('sudo', ['-n', 'true']).status !== 0) throw new Error(HINT);
  const asRoot = (/** @type {string[]} */ ...args) => {
    const [program, ...rest] = isRoot ? [apt, ...args] : ['sudo', '-n', apt, ...args];
    execFileSync(program, rest, { stdio: 'inherit', env: { ...process.env, DEBIAN_FRONTEND: 'noninteractive' } });
  };
  try {
    asRoot('install', '--yes', '--no-install-recommends', ...PACKAGES);
  } catch {
    // Lists of packages may be old, or not there at all.
    asRoot('update');
    asRoot('install', '--yes', '--no-install-recommends', ...PACKAGES);
  }
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  try {
    if (findBrowser() === undefined && process.argv.includes('--install')) install();
    const found = findBrowser();
    if (found === undefined) throw new Error(HINT);
    console.log(found);
  } catch (error) {
    console.error(error instanceof Error ? error.message : error);
    process.exitCode = 1;
  }
}
