// The lens, the cutaway at the tool, the probe, and the pressure of the tool.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { sharedPage } from './session.mjs';
import { saveShot } from './shots.mjs';
import { until } from './viewer.mjs';

/** @param {import('./page.mjs').PalpaPage} palpa @param {string} id @param {string} name */
const number = async (palpa, id, name) => Number(await palpa.by(id).getAttribute(name));

test('while the tool presses, the lens shows what lies under it', async () => {
  const palpa = await sharedPage();
  await palpa.have('forearm_lump');
  await palpa.atRest();
  assert.equal(await palpa.by('lens').count(), 0);
  await palpa.press();
  await palpa.by('lens').waitFor();
  await palpa.steady(0.02);
  // The names of the layers, from the skin down, and the force beside the tool.
  const words = await palpa.by('lens').innerText();
  assert.match(words, /Fat[\s\S]*Muscle/);
  // The force may still change a little, so both are read until they are of one time.
  await until('the lens and the readout show one force', async () => {
    const { newtons } = await palpa.readout();
    const written = Number(/([\d.]+) N/.exec(await palpa.by('lens').innerText())?.[1]);
    return newtons > 0.05 && Math.abs(written - newtons) < 0.1 * newtons;
  });
  assert.ok((await number(palpa, 'lens', 'data-pressure')) > 500, 'the tool presses the skin');
  await saveShot(palpa, 'lens');
  await palpa.release();
  await palpa.by('lens').waitFor({ state: 'detached' });

  // Held by keys, the tool stays while the mouse is elsewhere.
  await palpa.focus();
  await palpa.page.keyboard.press('Space');
  await palpa.by('lens-close').click();
  await palpa.by('lens').waitFor({ state: 'detached' });
  await palpa.page.keyboard.press('Escape');
  await palpa.tab('view');
  assert.equal(await palpa.by('show-lens').isChecked(), false);
  await palpa.by('show-lens').check();
  await palpa.atRest();
  assert.deepEqual(palpa.complaints, []);
});

test('a cutaway follows the tool', async () => {
  const palpa = await sharedPage();
  await palpa.have('forearm_lump');
  await palpa.tab('view');
  await palpa.by('cutaway-toggle').check();
  await palpa.by('cutaway-axis-tool').click();
  await palpa.press(0.45);
  const here = await until('the plane is at the tool', async () => (await palpa.readout()).newtons > 0.05 && (await palpa.sectionArea()).total);
  const [x, y] = await palpa.at(0.56);
  await palpa.page.mouse.move(x, y, { steps: 8 });
  await until('it has followed', async () => Math.abs((await palpa.sectionArea()).total - here) > 0.005 * here);
  await palpa.release();
  await palpa.by('cutaway-axis-x').click();
  await palpa.by('cutaway-toggle').uncheck();
  await palpa.atRest();
});

test('a probe reads a point of the skin, and the pressure of the tool colours it', async () => {
  const palpa = await sharedPage();
  await palpa.have('forearm_lump');
  await palpa.tab('view');
  await palpa.by('probe-place').click();
  await palpa.page.mouse.click(...(await palpa.at(0.5, 0.5)));
  await palpa.by('probe').waitFor();
  assert.match(await palpa.by('probe').innerText(), /Skin surface[\s\S]*mm[\s\S]*Young/);
  assert.ok((await number(palpa, 'probe', 'data-displacement')) < 1e-4, 'the skin is at rest');

  await palpa.by('colour-by').selectOption('contact');
  await palpa.press(0.5, 0.5);
  await palpa.steady(0.02);
  await until('the point has given way', async () => (await number(palpa, 'probe', 'data-displacement')) > 1e-3);
  await until('the tool presses there', async () => (await number(palpa, 'probe', 'data-contact')) > 200);
  assert.match(await palpa.by('legend').innerText(), /kPa/);
  await saveShot(palpa, 'probe');
  await palpa.release();
  await palpa.atRest();
  await palpa.by('probe-remove').click();
  await palpa.by('probe').waitFor({ state: 'detached' });
  await palpa.by('colour-by').selectOption('tissue');
});
