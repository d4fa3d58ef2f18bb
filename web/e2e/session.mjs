// One viewer, one browser and one page that tests share: each of them costs seconds.

import { after } from 'node:test';
import { launch } from './browser.mjs';
import { PalpaPage } from './page.mjs';
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

/** The page that controls the shared viewer; nothing is held. */
export async function sharedPage() {
  page ??= open();
  const palpa = await page;
  // A test before that failed may hold something.
  await palpa.page.mouse.up();
  await palpa.page.keyboard.up('Shift');
  await palpa.page.keyboard.press('Escape');
  await palpa.running();
  return palpa;
}

async function open() {
  const palpa = await PalpaPage.open(await sharedBrowser(), await sharedViewer());
  await palpa.drawn();
  return palpa;
}

/** Ends the shared page and viewer: a test that has its own needs the cores for them. */
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
