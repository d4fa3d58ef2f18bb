// The page as a user has it: seen, clicked, typed into.

import assert from 'node:assert/strict';
import { LONG, until } from './viewer.mjs';

const DESKTOP = { width: 1280, height: 720 };

/** @typedef {{ newtons: number, tick: number, metres: number }} Readout */

export class PalpaPage {
  /** Errors on the console. @type {string[]} */
  complaints = [];
  /** Hosts that got requests. @type {Set<string>} */
  hosts = new Set();

  /**
   * @param {import('playwright-core').Page} page
   * @param {import('./viewer.mjs').Viewer} viewer
   */
  constructor(page, viewer) {
    this.page = page;
    this.viewer = viewer;
    page.setDefaultTimeout(LONG);
    page.on('console', (message) => {
      if (message.type() === 'error') this.complaints.push(message.text());
    });
    page.on('pageerror', (error) => this.complaints.push(String(error)));
    page.on('request', (request) => {
      const url = new URL(request.url());
      if (url.protocol !== 'blob:' && url.protocol !== 'data:') this.hosts.add(url.host);
    });
    page.on('websocket', (socket) => this.hosts.add(new URL(socket.url()).host));
  }

  /**
   * @param {import('playwright-core').Browser} browser
   * @param {import('./viewer.mjs').Viewer} viewer
   * @param {import('playwright-core').BrowserContextOptions} options
   */
  static async open(browser, viewer, options = {}) {
    const context = await browser.newContext({ viewport: DESKTOP, colorScheme: 'light', reducedMotion: 'reduce', locale: 'en', ...options });
    const palpa = new PalpaPage(await context.newPage(), viewer);
    await palpa.page.goto(viewer.url);
    return palpa;
  }

  async close() {
    await this.page.context().close();
  }

  /** @param {string} id */
  by(id) {
    return this.page.getByTestId(id);
  }

  /** Waits until a body is drawn. @returns {Promise<number>} ms since the page was requested */
  async drawn() {
    await this.page.waitForFunction(() => document.querySelector('[data-testid=first-body-ms]')?.getAttribute('data-ms') !== '');
    return Number(await this.by('first-body-ms').getAttribute('data-ms'));
  }

  /** Waits until the page shows that the engine runs, and has the newest state. */
  async running() {
    const { revision } = await this.viewer.state();
    await this.page.waitForFunction((least) => {
      const { status, phase, revision } = /** @type {HTMLElement} */ (document.querySelector('[data-testid=connection-status]')).dataset;
      return status === 'open' && phase === 'running' && Number(revision) >= least;
    }, revision);
  }

  /** @param {string} name */
  async tab(name) {
    const tab = this.by(`tab-${name}`);
    const isShown = await tab.getAttribute('aria-controls');
    if (isShown === null) await tab.click();
    await this.page.locator(`#panel[aria-labelledby=tab-${name}]`).waitFor();
  }

  get canvas() {
    return this.page.locator('#body-canvas');
  }

  /** A point of the canvas, in shares of its size. @returns {Promise<[number, number]>} */
  async at(x = 0.5, y = 0.5) {
    const box = await this.canvas.boundingBox();
    assert.ok(box, 'the canvas is seen');
    return [box.x + x * box.width, box.y + y * box.height];
  }

  /** The mouse goes down at a point of the canvas. */
  async press(x = 0.5, y = 0.5) {
    await this.page.mouse.move(...(await this.at(x, y)));
    await this.page.mouse.down();
  }

  async release() {
    await this.page.mouse.up();
  }

  /** Focuses the canvas without a click. */
  async focus() {
    await this.canvas.focus();
  }

  /** Force, depth and tick as shown, all of one frame. @returns {Promise<Readout>} */
  readout() {
    return this.page.evaluate(() => {
      const number = /** @type {HTMLElement & { shown?: Readout }} */ (document.querySelector('[data-testid=force-number]'));
      return number.shown ?? { newtons: 0, tick: 0, metres: NaN };
    });
  }

  /**
   * @param {string} what
   * @param {(readout: Readout) => boolean} isSo
   */
  reads(what, isSo) {
    return until(`the page reads ${what}`, async () => {
      const readout = await this.readout();
      return isSo(readout) && readout;
    });
  }

  /** Waits until the force is steady: the hand is at rest and the force is not reduced. `tolerance`
   * is a share of the force. */
  async steady(tolerance = 0.01) {
    /** @type {Readout[]} */
    let last = [];
    return until('the force is steady', async () => {
      const now = await this.readout();
      const isHeldBack = (await this.page.locator('.held-back[data-on]').count()) > 0;
      if (isHeldBack || now.newtons === 0) last = [];
      else if (last.at(-1)?.tick !== now.tick) last.push(now);
      // Six tenths of a second; or three readings, where a slow machine has fewer.
      last = last.filter((other, i) => other.tick > now.tick - 600 || i >= last.length - 3);
      const forces = last.map((other) => other.newtons);
      const isLong = last.length >= 3 && now.tick - last[0].tick > 200;
      return isLong && Math.max(...forces) - Math.min(...forces) < tolerance * now.newtons && now;
    });
  }

  /** Waits until nobody presses and the body is at rest. */
  atRest() {
    return this.reads('no force', ({ newtons, metres }) => newtons === 0 && metres < 0);
  }

  /**
   * Reads every frame for so many ticks of the loop and asserts that none has a force.
   * @param {number} ticks
   */
  async feelsNothing(ticks) {
    const { tick: begin } = await this.readout();
    await this.reads('frames without a force', ({ newtons, tick }) => {
      assert.equal(newtons, 0, `a force at tick ${tick}`);
      return tick > begin + ticks;
    });
  }

  /** Opens a scene file, given as its text. @param {string} name @param {string | Buffer} text */
  async openFile(name, text) {
    await this.tab('scene');
    await this.by('scene-file').setInputFiles({ name, mimeType: 'text/plain', buffer: Buffer.from(text) });
  }

  /** Opens a file that is no scene, and waits until its name is in a notice. */
  async openBrokenFile() {
    await this.openFile('broken.toml', '[layer');
    await this.by('toast').filter({ hasText: 'broken.toml' }).first().waitFor();
  }

  /**
   * Loads a scene of the gallery, unchanged.
   * @param {string} key
   */
  async choose(key) {
    await this.tab('scene');
    const before = (await this.viewer.state()).revision;
    await this.by(`scene-${key}`).click();
    const state = await this.viewer.running(`${key} is there`, (now) => now.revision > before && now.gallery_key === key);
    await this.running();
    return state;
  }

  /**
   * Loads a scene of the gallery unless it is loaded. Tests leave it as they found it.
   * @param {string} key
   */
  async have(key) {
    if ((await this.viewer.state()).gallery_key !== key) await this.choose(key);
  }

  /**
   * Types a quantity into its field, and waits until the engine has it.
   * @param {string} id
   * @param {string} text
   * @param {(state: import('../src/generated/api').State) => boolean} isTaken
   */
  async type(id, text, isTaken) {
    await this.by(id).fill(text);
    await this.by(id).press('Enter');
    const state = await this.viewer.running(`${id} is ${text}`, isTaken);
    await this.running();
    return state;
  }

  /** Areas of the section as shown, m². */
  async sectionArea() {
    const element = this.by('section-area');
    await element.waitFor();
    const read = async (/** @type {string} */ name) => Number(await element.getAttribute(name));
    return { total: await read('data-area'), lumps: await read('data-lumps') };
  }
}
