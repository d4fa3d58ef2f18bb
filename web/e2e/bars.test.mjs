// The error bar of the force appears beside it when the tool stays, and goes when the tool leaves.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { sharedPage } from './session.mjs';
import { until } from './viewer.mjs';

/** The bar as shown; null if there is none. @param {import('./page.mjs').PalpaPage} palpa */
const shown = (palpa) =>
  palpa.page.evaluate(() => {
    const bar = /** @type {HTMLElement | null} */ (document.querySelector('[data-testid=force-bar]'));
    const words = document.querySelector('[data-testid=force-bar-words]')?.textContent ?? '';
    return bar === null ? null : { kind: bar.dataset.kind, share: Number(bar.dataset.share), text: bar.textContent ?? '', title: bar.title, words };
  });

test('a held press gets an error bar, which says where it was computed', async (t) => {
  const palpa = await sharedPage();
  await palpa.choose('forearm');
  await palpa.atRest();
  assert.equal(await shown(palpa), null, 'no bar without a press');
  await palpa.focus();
  await palpa.page.keyboard.press('Space');
  const { metres } = await palpa.steady();
  const bar = await until('the error bar is known', async () => {
    const bar = await shown(palpa);
    assert.notEqual(bar?.kind, 'failed', bar?.words);
    return bar?.kind === 'known' && bar;
  });
  t.diagnostic(`${bar.text}; ${bar.words}; ${bar.title}`);
  assert.ok(bar.share > 0 && bar.share < 0.5, `${bar.share}`);
  assert.match(bar.text, /^± \d+(\.\d+)? %$/);
  const depth = Number(/probed at ([\d.]+) mm/.exec(bar.words)?.[1]);
  assert.ok(Math.abs(depth - metres * 1e3) < 0.3 * depth, `${depth} and ${metres}`);
  assert.match(bar.title, /infinitely fine mesh/);

  // In Japanese as well.
  await palpa.by('language').selectOption('ja');
  await until('the words are Japanese', async () => (await shown(palpa))?.words.includes('メッシュ誤差'));
  await palpa.by('language').selectOption('en');

  // Elsewhere it holds no longer.
  await palpa.focus();
  for (let k = 0; k < 3; k++) await palpa.page.keyboard.press('Shift+ArrowUp');
  await until('the bar of the old place is gone', async () => (await shown(palpa))?.kind !== 'known');
  await palpa.page.keyboard.press('Escape');
  await until('no bar without a press', async () => (await shown(palpa)) === null);
  await palpa.atRest();
});
