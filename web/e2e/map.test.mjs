// The palpation map: the skin remembers what was felt.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { sharedPage } from './session.mjs';
import { until } from './viewer.mjs';

test('a stroke paints the skin, and the map is saved and cleared', async () => {
  const palpa = await sharedPage();
  await palpa.have('forearm');
  await palpa.atRest();
  const box = palpa.by('map-box');
  const n = async () => Number(await box.getAttribute('data-n'));
  if ((await n()) > 0) await palpa.by('map-clear').click();
  await until('the map is empty', async () => (await n()) === 0);
  assert.match(await box.innerText(), /Press or stroke/);

  await palpa.press(0.46, 0.47);
  await until('a settled press is painted', async () => (await n()) >= 1);
  const [from, to, y] = [(await palpa.at(0.46))[0], (await palpa.at(0.54))[0], (await palpa.at(0, 0.47))[1]];
  for (let k = 1; (await n()) < 6; k++) {
    assert.ok(k < 400, 'a stroke is painted');
    const share = Math.abs((((k / 60) % 2) + 2) % 2 - 1);
    await palpa.page.mouse.move(to + (from - to) * share, y);
  }
  await palpa.release();
  await palpa.atRest();

  await palpa.by('map-absolute').click();
  await until('the legend is in N/mm', async () => /N\/mm/.test(await palpa.by('map-scale').innerText()));
  const rows = (await (await palpa.viewer.get('api/map.csv')).text()).trim().split('\n');
  assert.equal(rows[0], 'x_mm,y_mm,z_mm,stiffness_n_per_mm,against_surroundings,depth_mm,force_n,contact_radius_mm,touches');
  assert.ok(rows.length > 6);
  for (const row of rows.slice(1)) {
    const [, , , stiffness, , depth, force] = row.split(',').map(Number);
    assert.ok(Math.abs(stiffness - force / depth) < 0.01 * stiffness + 1e-3, row);
  }
  const vtu = await (await palpa.viewer.get('api/map.vtu')).text();
  for (const name of ['stiffness', 'against_surroundings', 'coverage']) assert.ok(vtu.includes(`Name="${name}"`), name);

  const [picture] = await Promise.all([palpa.page.waitForEvent('download'), palpa.by('map-png').click()]);
  assert.match(picture.suggestedFilename(), /^palpation-map-.*\.png$/);
  const png = readFileSync(await picture.path());
  assert.ok(png.length > 20_000 && png.subarray(1, 4).toString() === 'PNG');

  await palpa.by('map-clear').click();
  await until('nothing is remembered', async () => (await n()) === 0);
  await palpa.by('map-surroundings').click();
  assert.deepEqual(palpa.complaints, []);
});
