// A press to a typed depth or a typed force, the target band, the pain limit.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { sharedPage } from './session.mjs';
import { saveShot } from './shots.mjs';
import { until } from './viewer.mjs';

test('a depth is typed, and refused where the tissue ends', async () => {
  const palpa = await sharedPage();
  await palpa.have('forearm');
  await palpa.by('press-depth').fill('3');
  await palpa.by('press-depth').press('Enter');
  await until('it is in millimetres', async () => (await palpa.by('press-depth').inputValue()) === '3 mm');
  await palpa.press();
  const { metres } = await palpa.steady(0.02);
  assert.ok(Math.abs(metres - 3e-3) < 3e-4, `${metres} m`);
  await palpa.release();
  await palpa.by('press-depth').fill('4 apples');
  await palpa.by('press-depth').press('Enter');
  await palpa.page.locator('.field-error', { hasText: 'for example 4 mm' }).waitFor();
  await palpa.by('press-depth').fill('1 m');
  await palpa.by('press-depth').press('Enter');
  await palpa.page.locator('.field-error', { hasText: 'from' }).waitFor();
  await palpa.by('press-depth').press('Escape');
  await palpa.atRest();
});

test('a force is held, with mouse and keys, and the band and the limit say where it is', async () => {
  const palpa = await sharedPage();
  await palpa.have('forearm');
  await palpa.tab('device');
  await palpa.by('band-on').check();
  await palpa.by('band-high').fill('0.9 N');
  await palpa.by('band-high').press('Enter');
  await palpa.by('band-low').fill('0.6 N');
  await palpa.by('band-low').press('Enter');
  await palpa.by('pain-on').check();
  await palpa.by('pain-limit').fill('1.2 N');
  await palpa.by('pain-limit').press('Enter');
  await palpa.by('press-by-force').click();
  await palpa.by('press-force').fill('0.75 N');
  await palpa.by('press-force').press('Enter');
  const isReached = (/** @type {string} */ where) => until(`the page says ${where}`, async () => (await palpa.by('reach').getAttribute('data-reached')) === where);

  await palpa.press();
  await palpa.reads('the force', ({ newtons }) => Math.abs(newtons - 0.75) < 0.03);
  const { newtons } = await palpa.steady(0.02);
  assert.ok(Math.abs(newtons - 0.75) < 0.03, `${newtons} N`);
  await isReached('in');
  await saveShot(palpa, 'goals');
  // A stroke keeps the force.
  await palpa.page.mouse.move(...(await palpa.at(0.56)), { steps: 10 });
  await palpa.reads('the force again', ({ newtons: now }) => Math.abs(now - 0.75) < 0.05);
  // A notch of the wheel is a tenth of a newton.
  for (let k = 0; k < 6; k++) await palpa.page.mouse.wheel(0, 100);
  await palpa.reads('more force', ({ newtons: now }) => Math.abs(now - 1.35) < 0.07);
  await isReached('pain');
  await palpa.release();
  await palpa.atRest();
  await isReached('none');

  await palpa.focus();
  await palpa.page.keyboard.press('Space');
  await palpa.reads('the force by keys', ({ newtons: now }) => Math.abs(now - 0.75) < 0.03);
  await palpa.page.keyboard.press('PageUp');
  await palpa.page.keyboard.press('PageUp');
  await palpa.page.keyboard.press('PageUp');
  await isReached('below');
  await palpa.page.keyboard.press('Escape');
  await palpa.atRest();

  await palpa.by('press-by-depth').click();
  await palpa.by('band-on').uncheck();
  await palpa.by('pain-on').uncheck();
  assert.equal(await palpa.by('reach').count(), 0);
  assert.deepEqual(palpa.complaints, []);
});
