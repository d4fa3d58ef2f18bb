// One viewer, one browser and one page that all tests share, because each of them
// takes seconds to start.

import { after, afterEach } from 'node:test';
import { launch } from './browser.mjs';
import { PalpaPage } from './page.mjs';
import { savePage } from './shots.mjs';
import { Viewer } from './viewer.mjs';

/** @type {Promise<Viewer> | undefined} */
let viewer;
/** @type {Promise<import('playwright-core').Browser> | undefined} */
let browser;
/** @type {Promise<PalpaPage> | undefined} */
let page;

export function sharedViewer() {
  viewer ??= Viewer.start();
  return viewer;
}

export function sharedBrowser() {
  browser ??= launch();
  return browser;
}

/** The page that controls the shared viewer, with nothing held. */
export async function sharedPage() {
  // One that failed to open is tried again: the tests after it shall not all fail with its error.
  page ??= open().catch((error) => {
    page = undefined;
    throw error;
  });
  const palpa = await page;
  // An earlier test that failed may hold something.
  await palpa.page.mouse.up();
  await palpa.page.keyboard.up('Shift');
  await palpa.page.keyboard.press('Escape');
  await palpa.running();
  return palpa;
}

// What the page showed when a test failed, before the next one changes it.
afterEach(async (context) => {
  // Node's types lack `passed`.
  const test = /** @type {import('node:test').TestContext & { passed: boolean }} */ (context);
  if (test.passed || !page) return;
  const shown = await page.catch(() => undefined);
  if (shown) test.diagnostic(await savePage(shown, `failed-${test.name}`));
});

async function open() {
  const palpa = await PalpaPage.open(await sharedBrowser(), await sharedViewer());
  await palpa.drawn();
  return palpa;
}

/** Ends the shared page and viewer, so that a test with its own has the cores. */
export async function endShared() {
  const [before, served] = [await page, await viewer];
  page = viewer = undefined;
  await before?.close();
  await served?.stop();
}

after(async () => {
  await endShared();
  await (await browser)?.close();
});
