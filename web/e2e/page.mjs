// The page as a person has it: seen, clicked, typed into.

import assert from 'node:assert/strict';
import { LONG, until } from './viewer.mjs';

export const DESKTOP = { width: 1280, height: 720 };

/** @typedef {{ newtons: number, tick: number, metres: number }} Readout */

export class PalpaPage {
  /** What the console complained of. @type {string[]} */
  complaints = [];
  /** Hosts that were asked. @type {Set<string>} */
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

  /** Until a body is drawn. @returns {Promise<number>} since the page was asked for, ms */
  async drawn() {
    await this.page.waitForFunction(() => document.querySelector('[data-testid=first-body-ms]')?.getAttribute('data-ms') !== '');
    return Number(await this.by('first-body-ms').getAttribute('data-ms'));
  }

  /** Until the page says that the engine runs, and knows as much of it as others do. */
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

  /** The canvas has the focus, and no place was clicked. */
  async focus() {
    await this.canvas.focus();
  }

  /** What is read, all of one moment. @returns {Promise<Readout>} */
  readout() {
    return this.page.evaluate(() => {
      const force = /** @type {HTMLElement} */ (document.querySelector('[data-testid=force-number]'));
      const depth = /** @type {HTMLElement} */ (document.querySelector('[data-testid=depth-number]'));
      return { newtons: Number(force.dataset.newtons), tick: Number(force.dataset.tick), metres: Number(depth.dataset.metres) };
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

  /** Until the force stands, as it does once the hand is where it goes, and all of it is let through. */
  async steady(tolerance = 0.01) {
    /** @type {Readout[]} */
    let last = [];
    return until('the force stands', async () => {
      const now = await this.readout();
      const isHeldBack = (await this.page.locator('.held-back').count()) > 0;
      if (isHeldBack || now.newtons === 0) last = [];
      else if (last.at(-1)?.tick !== now.tick) last.push(now);
      // Six tenths of a second; or three readings, where a slow machine has fewer.
      last = last.filter((other, i) => other.tick > now.tick - 600 || i >= last.length - 3);
      const forces = last.map((other) => other.newtons);
      const isLong = last.length >= 3 && now.tick - last[0].tick > 200;
      return isLong && Math.max(...forces) - Math.min(...forces) < tolerance * now.newtons && now;
    });
  }

  /** No force: nobody presses, and the body is at rest. */
  atRest() {
    return this.reads('no force', ({ newtons, metres }) => newtons === 0 && metres < 0);
  }

  /**
   * Chooses a scene anew, as it is in the gallery.
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
   * A scene that tests before this one may have pressed, and left as it was.
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

  /** What the section's area is said to be, m². */
  async sectionArea() {
    const element = this.by('section-area');
    await element.waitFor();
    const read = async (/** @type {string} */ name) => Number(await element.getAttribute(name));
    return { total: await read('data-area'), lumps: await read('data-lumps') };
  }
}
