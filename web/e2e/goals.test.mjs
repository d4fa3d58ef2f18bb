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
  // The hand gives way, so that the tool stops before the typed depth.
  await palpa.press();
  const shallow = await palpa.steady(0.02);
  assert.ok(shallow.metres > 1e-3 && shallow.metres < 3.1e-3, `${shallow.metres} m`);
  await palpa.release();
  await palpa.atRest();
  await palpa.by('press-depth').fill('7 mm');
  await palpa.by('press-depth').press('Enter');
  await palpa.press();
  const deep = await palpa.reads('a deeper press', ({ metres }) => metres > 1.3 * shallow.metres);
  assert.ok(deep.metres < 7.1e-3, `${deep.metres} m`);
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

test('a force is held, with mouse and keys, and the band and the limit say where it is', async (t) => {
  const palpa = await sharedPage();
  // Tests after this one press to a depth, however it ends.
  t.after(() => palpa.by('press-by-depth').click());
  await palpa.have('forearm');
  await palpa.tab('device');
  await palpa.by('band-on').check();
  await palpa.by('band-high').fill('0.9 N');
  await palpa.by('band-high').press('Enter');
  await palpa.by('band-low').fill('0.6 N');
  await palpa.by('band-low').press('Enter');
  await palpa.by('pain-on').check();
  await palpa.by('pain-limit').fill('1 N');
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
  // The wheel asks for more, up to the greatest depth there (1.2 N); a slow page takes several notches as one.
  await until('there is more force', async () => {
    await palpa.page.mouse.wheel(0, 100);
    return (await palpa.readout()).newtons > 1.05;
  });
  await isReached('pain');
  await palpa.release();
  await palpa.atRest();
  await isReached('none');

  // A stroke keeps the force.
  await palpa.press();
  await palpa.reads('the force of the next press', ({ newtons: now }) => Math.abs(now - 0.75) < 0.03);
  await palpa.page.mouse.move(...(await palpa.at(0.54)), { steps: 10 });
  await palpa.reads('the force again', ({ newtons: now }) => Math.abs(now - 0.75) < 0.05);
  await palpa.release();
  await palpa.atRest();

  await palpa.focus();
  await palpa.page.keyboard.press('Space');
  await palpa.reads('the force by keys', ({ newtons: now }) => Math.abs(now - 0.75) < 0.03);
  await saveShot(palpa, 'goals');
  await palpa.focus();
  await palpa.page.keyboard.press('PageUp');
  await palpa.page.keyboard.press('PageUp');
  await palpa.page.keyboard.press('PageUp');
  await isReached('below');
  await palpa.page.keyboard.press('Escape');
  await palpa.atRest();

  await palpa.by('band-on').uncheck();
  await palpa.by('pain-on').uncheck();
  assert.equal(await palpa.by('reach').count(), 0);
  assert.deepEqual(palpa.complaints, []);
});
