// Recordings: equal to what was shown, replayed, downloaded.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { test } from 'node:test';
import { sharedPage } from './session.mjs';
import { until } from './viewer.mjs';
import { readBody } from './vtu.mjs';

/** Longest time between two frames of a recording on a slow machine, s. */
const FRAME = 0.4;

/** @param {string} text @returns {{ tick: number, time: number, force: number }[]} */
function readRows(text) {
  const lines = text.trim().split('\n').filter((line) => !line.startsWith('#'));
  const names = lines[0].split(',');
  const column = (/** @type {RegExp} */ name) => {
    const found = names.findIndex((other) => name.test(other));
    assert.ok(found >= 0, `no column ${name} among ${names}`);
    return found;
  };
  const [tick, time, x, y, z] = [/^tick$/, /^now$/, /^force_x/, /^force_y/, /^force_z/].map(column);
  return lines.slice(1).map((line) => {
    const values = line.split(',').map(Number);
    return { tick: values[tick], time: values[time], force: Math.hypot(values[x], values[y], values[z]) };
  });
}

/** @param {import('./page.mjs').PalpaPage} palpa @param {import('playwright-core').Locator} link */
async function download(palpa, link) {
  const [file] = await Promise.all([palpa.page.waitForEvent('download'), link.click()]);
  return { name: file.suggestedFilename(), bytes: await readFile(await file.path()) };
}

test('a recording equals what was shown, tick by tick, and replays', async (t) => {
  const palpa = await sharedPage();
  await palpa.have('block');
  await palpa.atRest();
  await palpa.tab('record');
  await palpa.by('record-start').click();
  await palpa.by('record-stop').waitFor();
  const { tick: began } = await palpa.readout();

  /** @type {import('./page.mjs').Readout[]} */
  const shown = [];
  await palpa.press();
  await until('twenty moments of a press are read', async () => {
    const now = await palpa.readout();
    if (now.tick > began && now.newtons > 0 && shown.at(-1)?.tick !== now.tick) shown.push(now);
    return shown.length >= 20;
  });
  await palpa.release();
  await palpa.atRest();
  await palpa.by('record-stop').click();
  await palpa.viewer.running('a recording is kept', ({ recording }) => recording.duration > 0 && !recording.is_recording);

  const { name, bytes } = await download(palpa, palpa.by('save-csv'));
  assert.match(name, /\.csv$/);
  const rows = readRows(bytes.toString());
  const byTick = new Map(rows.map((row) => [row.tick, row]));
  const inside = shown.filter(({ tick }) => tick >= rows[0].tick && tick <= rows[rows.length - 1].tick);
  assert.ok(inside.length >= 15, `${inside.length} of ${shown.length} moments lie in ticks ${rows[0].tick} to ${rows[rows.length - 1].tick}; shown ${shown[0].tick} to ${shown.at(-1)?.tick}`);
  for (const { tick, newtons } of inside) {
    const row = byTick.get(tick);
    assert.ok(row, `tick ${tick} is recorded`);
    assert.ok(Math.abs(row.force - newtons) <= 1e-9 * newtons, `tick ${tick}: shown ${newtons} N, recorded ${row.force} N`);
  }
  t.diagnostic(`${inside.length} moments shown are those of the recorder; it has ${rows.length} ticks`);

  const log = await download(palpa, palpa.by('save-mcap'));
  assert.deepEqual([...log.bytes.subarray(0, 5)], [0x89, ...Buffer.from('MCAP')]);

  await palpa.by('replay-open').click();
  const slider = palpa.by('replay-slider');
  await slider.waitFor();
  if (await palpa.viewer.state().then((state) => state.recording.is_playing)) await palpa.by('replay-play').click();
  await palpa.viewer.running('the replay stands', ({ recording }) => recording.is_replaying && !recording.is_playing);
  const greatest = rows.reduce((most, row) => (row.force > most.force ? row : most));
  for (const time of [greatest.time, 0, 0.9 * greatest.time]) {
    await slider.fill(time.toFixed(3));
    // The body's own last frame may still be shown, and its ticks began anew when the recording ended.
    await palpa.reads(`the moment ${time} with its force`, ({ tick, newtons }) => {
      const row = byTick.get(tick);
      return row !== undefined && Math.abs(row.time - Math.max(time, rows[0].time)) < FRAME && Math.abs(row.force - newtons) <= 1e-9 * Math.max(newtons, 1e-9);
    });
  }
  // By keys, too.
  await slider.focus();
  await palpa.page.keyboard.press('Home');
  const first = await palpa.reads('the beginning', ({ tick }) => (byTick.get(tick)?.time ?? Infinity) < rows[0].time + FRAME);
  for (let k = 0; k < 10; k++) await palpa.page.keyboard.press('ArrowRight');
  await palpa.reads('half a second later', ({ tick }) => (byTick.get(tick)?.time ?? 0) > (byTick.get(first.tick)?.time ?? 0) + 0.5 - FRAME);
  await palpa.page.keyboard.press('End');
  await palpa.reads('the end', ({ tick }) => (byTick.get(tick)?.time ?? 0) > rows[rows.length - 1].time - 2 * FRAME);
  await palpa.by('replay-close').click();
  await slider.waitFor({ state: 'detached' });
  await palpa.viewer.running('the replay is closed', ({ recording }) => !recording.is_replaying);
  await palpa.atRest();
});

test('scene, body and picture can be saved', async () => {
  const palpa = await sharedPage();
  await palpa.tab('scene');
  const scene = await download(palpa, palpa.by('scene-save'));
  assert.match(scene.bytes.toString(), /^\[\[layer\]\]/m);
  const body = await download(palpa, palpa.by('save-vtu'));
  const { points, wedges } = readBody(body.bytes.toString());
  assert.ok(wedges.length > 100 && wedges.flat().every((node) => node < points.length));

  await palpa.tab('view');
  const picture = await download(palpa, palpa.by('save-png'));
  assert.match(picture.name, /\.png$/);
  assert.equal(picture.bytes.subarray(1, 4).toString(), 'PNG');
  const [width, height] = [picture.bytes.readUInt32BE(16), picture.bytes.readUInt32BE(20)];
  assert.ok(width > 300 && height > 200 && picture.bytes.length > 10_000, `${width} × ${height}, ${picture.bytes.length} bytes`);

  // What was saved can be opened.
  await palpa.openFile('mine.toml', scene.bytes);
  await palpa.viewer.running('the saved scene is there', (state) => state.gallery_key == null);
  await palpa.openBrokenFile();
  await palpa.choose('block');
});
