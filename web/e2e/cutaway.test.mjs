// The cutaway: its section is the slice of the exported body.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { sharedPage } from './session.mjs';
import { until } from './viewer.mjs';
import { extent, readBody, sliceAreas } from './vtu.mjs';

const AXES = /** @type {const} */ (['x', 'y', 'z']);
/** Share of the way through the body that the plane leaves out at either end. */
const MARGIN = 0.002;
/** ms. */
const SECTION_WAIT = 20_000;

/** @param {import('./page.mjs').PalpaPage} palpa */
async function exported(palpa) {
  return readBody(await palpa.viewer.body());
}

/**
 * Where the slider's position puts the plane, m: the way goes through the body at rest.
 * @param {import('./vtu.mjs').Body & { displacement: import('./vtu.mjs').Vec3[] | null }} body
 */
function planeAt(body, axis = 0, position = 0.5) {
  const { displacement } = body;
  assert.ok(displacement, 'the file tells displacements');
  const rest = body.points.map((p, i) => /** @type {import('./vtu.mjs').Vec3} */ (p.map((x, c) => x - displacement[i][c])));
  const [low, high] = extent(rest, axis);
  return low + (high - low) * (MARGIN + (1 - 2 * MARGIN) * position);
}

/**
 * Compares the shown section with the slice of the body exported now.
 * @param {import('./page.mjs').PalpaPage} palpa
 * @param {number} axis
 */
async function compared(palpa, axis) {
  const position = Number(await palpa.by('cutaway-position').inputValue());
  const body = await exported(palpa);
  const layers = sliceAreas(body, axis, planeAt(body, axis, position));
  const slice = layers.reduce((sum, area) => sum + area, 0);
  assert.ok(slice > 1e-4, `a slice of ${slice} m²`);
  const shown = await palpa.sectionArea();
  const shownLayers = palpa.by('section-area').locator('[data-layer]');
  let worstLayer = 0;
  for (const [layer, area] of layers.entries()) {
    if (area < 0.02 * slice) continue;
    const told = Number(await shownLayers.nth(layer).getAttribute('data-area'));
    worstLayer = Math.max(worstLayer, Math.abs(told - area) / slice);
  }
  return { shown, slice, off: Math.abs(shown.total - slice) / slice, worstLayer };
}

/**
 * The page draws a section some frames after it was asked for.
 * @param {import('./page.mjs').PalpaPage} palpa
 * @param {number} axis
 * @param {string} when
 */
async function assertSameArea(palpa, axis, when) {
  let words = '';
  const look = async () => {
    const found = await compared(palpa, axis);
    const { shown, slice, off, worstLayer } = found;
    words = `${when}: shown ${shown.total} m², slice of the file ${slice} m²: ${(100 * off).toFixed(3)} % apart, a layer ${(100 * worstLayer).toFixed(3)} %`;
    return off < 0.01 && worstLayer < 0.01 && found;
  };
  return until('the section is the slice', look, SECTION_WAIT).catch((error) => assert.fail(`${error.message}; ${words}`));
}

test('the section has the area of the slice of the exported body, at rest and pressed', async (t) => {
  const palpa = await sharedPage();
  await palpa.atRest();
  await palpa.tab('view');
  await palpa.by('cutaway-toggle').check();
  for (const [axis, name] of AXES.entries()) {
    await palpa.by(`cutaway-axis-${name}`).check({ force: true });
    // Off the middle, where nothing is symmetric.
    await palpa.by('cutaway-position').focus();
    const before = await palpa.by('cutaway-position').inputValue();
    for (let k = 0; k <= axis; k++) await palpa.page.keyboard.press('ArrowLeft');
    await until('the plane moves', async () => (await palpa.by('cutaway-position').inputValue()) !== before);
    await until('an area is shown', async () => (await palpa.sectionArea()).total > 0);
    const { slice, off } = await assertSameArea(palpa, axis, `at rest, ${name}`);
    t.diagnostic(`${name}: slice of ${(slice * 1e6).toFixed(1)} mm², section ${(100 * off).toFixed(4)} % apart`);
  }

  await palpa.by('cutaway-axis-x').check({ force: true });
  await palpa.focus();
  await palpa.page.keyboard.press('Space');
  await palpa.steady();
  const { slice, off } = await assertSameArea(palpa, 0, 'pressed');
  t.diagnostic(`pressed: slice of ${(slice * 1e6).toFixed(1)} mm², section ${(100 * off).toFixed(4)} % apart`);
  await palpa.page.keyboard.press('Escape');
  await palpa.atRest();
  await palpa.by('cutaway-toggle').uncheck();
  assert.equal(await palpa.by('section-area').count(), 0);
});

test('colours have a legend with units, and layers can be taken away', async () => {
  const palpa = await sharedPage();
  await palpa.tab('view');
  await palpa.focus();
  await palpa.page.keyboard.press('Space');
  await palpa.reads('a force', ({ newtons }) => newtons > 0.1);
  const units = { displacement: 'mm', von_mises: 'Pa', pressure: 'Pa', stretch: '', stiffness: 'Pa' };
  for (const [colour, unit] of Object.entries(units)) {
    await palpa.by('colour-by').selectOption(colour);
    const scale = palpa.by('legend').locator('.legend-scale');
    await until(`a legend of ${colour}`, async () => {
      const [text, min, max] = await Promise.all([scale.innerText(), scale.getAttribute('data-min'), scale.getAttribute('data-max')]);
      return text.includes(unit) && Number(max) > Number(min);
    });
  }
  await palpa.by('colour-by').selectOption('layer');
  await palpa.by('legend').locator('li').first().waitFor();
  await palpa.page.keyboard.press('Escape');
  await palpa.by('colour-by').selectOption('tissue');

  await palpa.focus();
  await palpa.page.keyboard.press('Escape');
  await palpa.atRest();
  const before = await palpa.canvas.screenshot();
  await palpa.by('layer-0-visible').uncheck();
  await until('the picture is another', async () => !before.equals(await palpa.canvas.screenshot()));
  await palpa.by('layer-0-visible').check();
});
