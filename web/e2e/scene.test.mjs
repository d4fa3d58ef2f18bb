// Tissues, lumps, tool and motion, changed on the page: on the block, which builds fastest.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { sharedPage } from './session.mjs';
import { saveShot } from './shots.mjs';
import { until } from './viewer.mjs';
import { extent, readBody } from './vtu.mjs';

/**
 * Force and depth of a press by keys.
 * @param {import('./page.mjs').PalpaPage} palpa
 * @param {() => Promise<void>} whilePressed
 */
async function forceOfPress(palpa, whilePressed = async () => {}) {
  await palpa.atRest();
  await palpa.focus();
  await palpa.page.keyboard.press('Space');
  const { newtons, metres } = await palpa.steady();
  await whilePressed();
  await palpa.page.keyboard.press('Escape');
  await palpa.atRest();
  return { newtons, metres };
}

test('a harder tissue gives more force at the same press', async (t) => {
  const palpa = await sharedPage();
  await palpa.have('block');
  const before = await forceOfPress(palpa);
  await palpa.tab('tissues');
  await palpa.type('layer-0-young', '30 kPa', ({ layers }) => Math.abs(layers[0].stiffness - 30e3) < 100);
  const after = await forceOfPress(palpa);
  t.diagnostic(`top layer of 10 kPa: ${before.newtons.toFixed(3)} N, of 30 kPa: ${after.newtons.toFixed(3)} N`);
  assert.ok(after.newtons > 1.2 * before.newtons, `${before.newtons} N, then ${after.newtons} N`);
  await palpa.choose('block');
});

test('a press that keys hold stays held while a tissue is changed under it', async () => {
  const palpa = await sharedPage();
  await palpa.have('block');
  await palpa.atRest();
  await palpa.focus();
  await palpa.page.keyboard.press('Space');
  const before = await palpa.steady();
  await palpa.tab('tissues');
  await palpa.type('layer-0-young', '30 kPa', ({ layers }) => Math.abs(layers[0].stiffness - 30e3) < 100);
  await palpa.reads('more force of the harder tissue', ({ newtons }) => newtons > 1.1 * before.newtons);
  // From wherever the focus is.
  await palpa.page.keyboard.press('Escape');
  await palpa.atRest();
  await palpa.choose('block');
});

test('reset restores a layer, even after a broken file', async () => {
  const palpa = await sharedPage();
  await palpa.have('block');
  await palpa.openBrokenFile();
  await palpa.tab('tissues');
  await palpa.type('layer-0-young', '20 kPa', ({ layers }) => Math.abs(layers[0].stiffness - 20e3) < 100);
  await palpa.by('layer-0-reset').click();
  await palpa.viewer.running('the tissue is as before', ({ layers }) => Math.abs(layers[0].stiffness - 10e3) < 100);
  await palpa.running();
});

test('an invalid value is refused with a message at its field', async () => {
  const palpa = await sharedPage();
  await palpa.have('block');
  await palpa.tab('tissues');
  await palpa.by('layer-0-young').fill('-3 kPa');
  await palpa.by('layer-0-young').press('Enter');
  const alert = palpa.page.locator('#panel .field-error');
  await alert.waitFor();
  assert.ok((await alert.innerText()).length > 10);
  assert.equal(await palpa.by('layer-0-young').getAttribute('aria-invalid'), 'true');
  await palpa.by('layer-0-young').press('Escape');
});

test('a lump is added, seen in the section, and removed', async () => {
  const palpa = await sharedPage();
  await palpa.have('block');
  await palpa.tab('lumps');
  await palpa.by('lump-add').click();
  const withLump = await palpa.viewer.running('a lump is there', (state) => state.lumps.length === 1);
  await palpa.by('lump-0').waitFor();
  await palpa.running();

  await palpa.tab('view');
  await palpa.by('cutaway-toggle').check();
  await palpa.by('cutaway-axis-x').check({ force: true });
  // To where the lump lies.
  const { centre, shape } = withLump.lumps[0];
  const { points } = readBody(await palpa.viewer.body());
  const [low, high] = extent(points, 0);
  await palpa.by('cutaway-position').fill(((centre[0] - low) / (high - low)).toFixed(2));
  await until('the section meets the lump', async () => (await palpa.sectionArea()).lumps > 2e-5);
  const { lumps: area } = await palpa.sectionArea();
  assert.ok(shape.kind === 'ellipsoid', 'a ball');
  const largest = Math.PI * shape.radii[0] ** 2;
  assert.ok(area > 2e-5 && area < 1.02 * largest, `the section shows ${area} m² of a lump whose largest slice is ${largest} m²`);
  await palpa.by('cutaway-toggle').uncheck();

  await palpa.tab('lumps');
  await palpa.type('lump-0-radius', '8 mm', (state) => state.lumps[0].shape.kind === 'ellipsoid' && Math.abs(state.lumps[0].shape.radii[0] - 8e-3) < 1e-6);
  await palpa.by('lump-0-remove').click();
  await palpa.viewer.running('the lump is gone', (state) => state.lumps.length === 0);
});

test('tool and friction change', async () => {
  const palpa = await sharedPage();
  await palpa.have('block');
  await palpa.tab('tool');
  await palpa.by('tool-shape').selectOption('sphere');
  await palpa.viewer.running('the tool is a ball', ({ tool }) => tool.shape?.kind === 'sphere');
  await palpa.type('tool-friction', '0.8', ({ tool }) => tool.friction === 0.8);
  const { newtons } = await forceOfPress(palpa);
  assert.ok(newtons > 0.1, `${newtons} N`);
  await palpa.choose('block');
});

test('a cone can be chosen, made blunter and pressed', async (t) => {
  const palpa = await sharedPage();
  await palpa.have('block');
  await palpa.tab('tool');
  await palpa.by('tool-shape').selectOption('cone');
  await palpa.viewer.running('the tool is a cone', ({ tool }) => tool.shape?.kind === 'cone');
  await palpa.type('tool-opening_angle', '140 deg',
    ({ tool }) => tool.shape?.kind === 'cone' && Math.abs(tool.shape.opening_angle - (7 * Math.PI) / 9) < 1e-6);
  await palpa.type('tool-tip_radius', '2 mm', ({ tool }) => tool.shape?.kind === 'cone' && Math.abs(tool.shape.tip_radius - 2e-3) < 1e-9);
  const { newtons } = await forceOfPress(palpa, () => saveShot(palpa, 'cone'));
  t.diagnostic(`a cone presses with ${newtons.toFixed(3)} N`);
  assert.ok(newtons > 0.02, `${newtons} N`);
  await palpa.choose('block');
});

test('the motion of the scene runs by itself', async () => {
  const palpa = await sharedPage();
  await palpa.have('block');
  await palpa.atRest();
  await palpa.tab('motion');
  await palpa.by('motion-run').click();
  await palpa.reads('a force of the motion', ({ newtons }) => newtons > 0.1);
  await palpa.by('motion-stop').or(palpa.by('motion-run')).waitFor();
  await palpa.viewer.running('the motion is over', (state) => !state.is_motion_running);
  await palpa.atRest();
});

for (const key of ['block', 'limb', 'patch_bars', 'patch_tissue', 'forearm', 'forearm_lump']) {
  test(`the scene ${key} of the gallery can be pressed`, async () => {
    const palpa = await sharedPage();
    await palpa.choose(key);
    await palpa.focus();
    await palpa.page.keyboard.press('Space');
    await palpa.reads('a force', ({ newtons }) => newtons > 0);
    await palpa.page.keyboard.press('Escape');
    await palpa.reads('no force', ({ newtons }) => newtons < 1e-9);
  });
}
