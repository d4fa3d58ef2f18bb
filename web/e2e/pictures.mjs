// The pictures of README and docs: `npm run pictures -- FOLDER`. They are of the page as a user has it; the machine should have
// nothing else to do. The frames of the animated one are put together by tools/animate.py.

import { mkdirSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { launch } from './browser.mjs';
import { PalpaPage } from './page.mjs';
import { Viewer, pause, until } from './viewer.mjs';

const folder = resolve(process.argv[2] ?? 'pictures');
const frames = join(folder, 'frames');
mkdirSync(frames, { recursive: true });

/** Rows of strokes over the lump as seen from above, 6 mm apart, in shares of the picture's height, and their ends, in shares of its width. */
const ROWS = [0.455, 0.476, 0.497, 0.518, 0.539];
const ENDS = [0.42, 0.66];
/** Moves of a stroke, and time between two of them, ms. */
const MOVES = 36;
const STEP = 60;
/** Every so many moves a frame is kept. */
const KEPT = 6;

const viewer = await Viewer.start();
const browser = await launch();
try {
  const palpa = await PalpaPage.open(browser, viewer);
  const { page } = palpa;
  const shot = (/** @type {string} */ name) => page.screenshot({ path: join(folder, `${name}.png`) });
  await palpa.drawn();

  await palpa.press(0.47, 0.5);
  await palpa.steady();
  await pause(2500);
  await shot('viewer_press');
  await palpa.release();

  await palpa.choose('forearm_lump');
  await palpa.tab('view');
  await palpa.by('view-top').click();
  await pause(1500);
  let n = 0;
  const keep = () => page.screenshot({ path: join(frames, `${String(n++).padStart(4, '0')}.png`), clip: { x: 361, y: 48, width: 919, height: 672 } });
  for (const [row, y] of ROWS.entries()) {
    const [from, to] = row % 2 === 0 ? ENDS : [...ENDS].reverse();
    await palpa.press(from, y);
    await palpa.reads('a force', ({ newtons }) => newtons > 0.1);
    for (let k = 0; k <= MOVES; k++) {
      await page.mouse.move(...(await palpa.at(from + ((to - from) * k) / MOVES, y)));
      if (k % KEPT === 0) await keep();
      await pause(STEP);
    }
    await palpa.release();
    await keep();
  }
  await palpa.atRest();
  await pause(2500);
  await keep();
  await shot('viewer_map');

  await palpa.by('view-home').click();
  await pause(1500);
  await palpa.by('cutaway-toggle').check();
  await palpa.by('cutaway-axis-tool').click();
  await palpa.press(0.535, 0.41);
  await palpa.steady(0.02);
  await pause(2500);
  await shot('viewer_cutaway');
  await palpa.release();
  await palpa.by('cutaway-axis-x').click();
  await palpa.by('cutaway-toggle').uncheck();
  await palpa.atRest();

  await palpa.choose('forearm');
  await palpa.tab('game');
  await palpa.by('game-level-easy').click();
  await palpa.by('game-seed').fill('4');
  await palpa.by('game-start').click();
  await palpa.by('game-bar').waitFor();
  await palpa.by('game-reveal').click();
  await viewer.running('it is shown', ({ game }) => game?.result != null);
  await pause(4000);
  // Played again, the lump is at the same place, where the camera looks now.
  await palpa.by('game-same-seed').click();
  await viewer.running('it is hidden again', ({ game }) => game != null && game.result == null);
  await palpa.atRest();
  for (const y of [0.42, 0.47, 0.52, 0.57]) {
    await palpa.press(0.38, y);
    await palpa.reads('a force', ({ newtons }) => newtons > 0.1);
    for (let k = 0; k <= MOVES; k++) {
      await page.mouse.move(...(await palpa.at(0.38 + (0.24 * k) / MOVES, y)));
      await pause(STEP);
    }
    await palpa.release();
  }
  await palpa.by('game-mark-mode').click();
  await page.mouse.click(...(await palpa.at(0.515, 0.51)));
  await until('it is marked', async () => ((await viewer.state()).game?.marks.length ?? 0) === 1);
  await palpa.by('game-reveal').click();
  await viewer.running('it is shown', ({ game }) => game?.result != null);
  await pause(4000);
  await shot('viewer_game');
} finally {
  await browser.close();
  await viewer.stop();
}
