// Pictures of the page in both themes, kept for people to look at.

import { mkdirSync } from 'node:fs';
import { join } from 'node:path';
import { TARGET, pause } from './viewer.mjs';

const FOLDER = process.env.PALPA_SHOTS ?? join(TARGET, 'tmp', 'screenshots');

/**
 * Two files: `NAME-light.png` and `NAME-dark.png`.
 * @param {import('./page.mjs').PalpaPage} palpa
 * @param {string} name
 */
export async function saveShot(palpa, name) {
  mkdirSync(FOLDER, { recursive: true });
  for (const theme of ['dark', 'light']) {
    await palpa.by('theme').selectOption(theme);
    await palpa.page.locator(`html[data-theme=${theme}]`).waitFor();
    // Until the body is drawn in the theme's colours.
    await pause(1000);
    await palpa.page.screenshot({ path: join(FOLDER, `${name}-${theme}.png`) });
  }
  await palpa.by('theme').selectOption('auto');
}

/**
 * One picture of the page as it is. Returns its path, and what the page says over the body.
 * @param {import('./page.mjs').PalpaPage} palpa
 * @param {string} name
 */
export async function savePage(palpa, name) {
  mkdirSync(FOLDER, { recursive: true });
  const path = join(FOLDER, `${name.replaceAll(/[^\p{L}\d]+/gu, '-')}.png`);
  await palpa.page.screenshot({ path });
  const words = await palpa.page.locator('.stage .chip, .toast').allInnerTexts();
  return `${path}: ${JSON.stringify({ ...(await palpa.readout()), words })}`;
}
