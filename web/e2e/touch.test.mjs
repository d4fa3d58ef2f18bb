// A body is drawn, and responds to mouse, wheel and keys.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { sharedPage } from './session.mjs';
import { LONG, until } from './viewer.mjs';

/** A PNG too large for an empty canvas. @param {Buffer} png */
const isPicture = (png) => png.subarray(1, 4).toString() === 'PNG' && png.length > 20_000;

test('the page loads, draws a body, and sends requests to the viewer only', async (t) => {
  const palpa = await sharedPage();
  const ms = await palpa.drawn();
  t.diagnostic(`page to first drawn body: ${ms.toFixed(0)} ms`);
  assert.ok(ms > 0);
  assert.equal(await palpa.by('controller-status').getAttribute('data-controls'), 'you');
  assert.ok(isPicture(await palpa.canvas.screenshot()), 'something is drawn');
  assert.deepEqual([...palpa.hosts], [new URL(palpa.viewer.url).host]);
  assert.deepEqual(palpa.complaints, []);
});

test('a press with the mouse gives a force, and none after it', async () => {
  const palpa = await sharedPage();
  await palpa.atRest();
  await palpa.press();
  const pressed = await palpa.reads('a force', ({ newtons, metres }) => newtons > 0.1 && metres > 0);
  assert.match(await palpa.by('force-number').innerText(), /^\d+\.\d\d N$/);
  await palpa.release();
  const after = await palpa.atRest();
  assert.ok(after.tick > pressed.tick);
});

test('the wheel changes the depth, and the force with it', async () => {
  const palpa = await sharedPage();
  await palpa.atRest();
  await palpa.press();
  const before = await palpa.steady();
  // 3 mm, of which the hand's spring takes two thirds.
  for (let k = 0; k < 6; k++) await palpa.page.mouse.wheel(0, -100);
  await palpa.reads('another depth', ({ metres }) => Math.abs(metres - before.metres) > 0.5e-3);
  // A machine that stops for a moment lets the hand sink in, too: what counts is
  // where it comes to rest.
  const after = await palpa.steady();
  await palpa.release();
  const deeper = after.metres - before.metres;
  assert.ok(Math.abs(deeper) > 0.3e-3, `${deeper} m deeper`);
  assert.equal(Math.sign(after.newtons - before.newtons), Math.sign(deeper), 'deeper is harder');
  await palpa.atRest();
});

test('shift and drag presses deeper, and springs back', async () => {
  const palpa = await sharedPage();
  await palpa.atRest();
  await palpa.press();
  // From a light press, which leaves room: a whole one is half a millimetre short of the greatest
  // depth. Friction and damping make a press from above end 0.3 mm less deep than one from below,
  // so this one comes from below, as the last one does.
  const whole = await palpa.steady();
  for (let k = 0; k < 4; k++) await palpa.page.mouse.wheel(0, -100);
  await palpa.reads('a light press', ({ metres }) => metres < whole.metres - 0.3e-3);
  const before = await palpa.steady();
  await palpa.page.keyboard.down('Shift');
  const [x, y] = await palpa.at();
  await palpa.page.mouse.move(x, y + 40, { steps: 5 });
  await palpa.reads('a greater depth', ({ metres }) => metres > before.metres + 0.5e-3);
  await palpa.page.keyboard.up('Shift');
  await palpa.page.mouse.move(x + 1, y + 40);
  await palpa.reads('the depth from before', ({ metres }) => metres < before.metres + 0.4e-3);
  await palpa.release();
  await palpa.atRest();
});

test('a drag strokes over the skin under load', async () => {
  const palpa = await sharedPage();
  await palpa.atRest();
  await palpa.press(0.44);
  await palpa.steady(0.05);
  const forces = [];
  const [x, y] = await palpa.at(0.44);
  for (let k = 1; k <= 10; k++) {
    await palpa.page.mouse.move(x + 8 * k, y);
    forces.push((await palpa.readout()).newtons);
  }
  const end = await palpa.reads('a force at the end', ({ newtons }) => newtons > 0.1);
  assert.ok(end.metres > 0);
  await palpa.release();
  assert.ok(forces.some((force) => force > 0.05), `forces of the stroke: ${forces}`);
  await palpa.atRest();
});

test('keys press, step, deepen and lift', async () => {
  const palpa = await sharedPage();
  // At home, where there is room to go deeper, and not where a stroke ended.
  await palpa.choose('limb');
  await palpa.choose('forearm');
  await palpa.atRest();
  await palpa.focus();
  await palpa.page.keyboard.press('Space');
  const first = await palpa.steady();
  // 4 mm, of which the hand's spring takes more than a half.
  for (let k = 0; k < 8; k++) await palpa.page.keyboard.press('PageDown');
  await palpa.reads('a greater depth and force', ({ metres, newtons }) => metres > first.metres + 0.8e-3 && newtons > 1.2 * first.newtons);
  // At the greatest depth the page says so, and the first step back takes effect.
  for (let k = 0; k < 60; k++) await palpa.page.keyboard.press('PageDown');
  const deepest = palpa.page.getByTestId('deepest');
  await deepest.waitFor({ timeout: LONG });
  await palpa.page.keyboard.press('PageUp');
  await deepest.waitFor({ state: 'detached', timeout: LONG });
  await palpa.page.keyboard.press('Space');
  await palpa.page.keyboard.press('Space');
  await palpa.page.keyboard.press('ArrowRight');
  await palpa.page.keyboard.press('Shift+ArrowUp');
  await palpa.steady(0.05);
  await palpa.page.keyboard.press('Escape');
  await palpa.atRest();
});

test('a drag beside the body turns the view and presses nothing', async () => {
  const palpa = await sharedPage();
  await palpa.atRest();
  const before = await palpa.canvas.screenshot();
  const [x, y] = await palpa.at(0.5, 0.5);
  await palpa.page.mouse.move(x, y);
  await palpa.page.mouse.down({ button: 'right' });
  await palpa.page.mouse.move(x + 80, y + 30, { steps: 5 });
  await palpa.page.mouse.up({ button: 'right' });
  await until('the picture is another', async () => !before.equals(await palpa.canvas.screenshot()));
  assert.equal((await palpa.readout()).newtons, 0);
  await palpa.page.getByRole('button', { name: 'Home', exact: true }).first().click();
});
