// A body of one's own: dropped, checked, shown, grown, touched, saved and opened again.

import assert from 'node:assert/strict';
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { drop, ellipsoid, glb, obj, scaled, stl, unzipped } from './meshes.mjs';
import { PalpaPage } from './page.mjs';
import { endShared, sharedBrowser, sharedPage } from './session.mjs';
import { saveShot } from './shots.mjs';
import { Viewer, until } from './viewer.mjs';

/** Half lengths of a limb, mm. */
const LIMB = ellipsoid([110, 38, 34]);

/** Waits for the check of a dropped surface, and returns what the dialog says of it. @param {PalpaPage} palpa */
async function checked(palpa) {
  const figures = palpa.by('own-figures');
  await figures.waitFor();
  await until('nothing is being done', async () => (await palpa.by('own-busy').count()) === 0);
  const read = (/** @type {string} */ name) => figures.getAttribute(`data-${name}`);
  return { triangles: Number(await read('triangles')), unit: await read('unit'), verdict: await read('verdict') };
}

/** Waits until the picture of the surface is drawn. @param {PalpaPage} palpa */
async function pictured(palpa) {
  await until('the surface is drawn', async () => (await palpa.by('own-picture').getAttribute('data-drawn')) !== null);
}

/** Grows the draft by the keyboard. @param {PalpaPage} palpa @param {string[]} files */
async function grown(palpa, files) {
  const before = (await palpa.viewer.state()).origin;
  await palpa.by('own-grow').focus();
  await palpa.page.keyboard.press('Enter');
  const state = await palpa.viewer.running('the body has grown', (now) => now.origin !== before);
  assert.deepEqual(state.files, files);
  await palpa.by('own').waitFor({ state: 'detached' });
  await palpa.running();
  return state;
}

/** @param {PalpaPage} palpa */
async function touched(palpa) {
  await palpa.press();
  const { newtons } = await palpa.reads('a force', (readout) => readout.newtons > 0.05);
  await palpa.release();
  await palpa.atRest();
  return newtons;
}

/** @param {PalpaPage} palpa @param {string} id */
async function saved(palpa, id) {
  const [download] = await Promise.all([palpa.page.waitForEvent('download'), palpa.by(id).click()]);
  return readFileSync(await download.path());
}

test('a closed STL in millimetres is dropped, checked, grown, touched, changed, saved and opened again', async (t) => {
  const palpa = await sharedPage();
  await drop(palpa, { 'my limb.stl': stl(LIMB) });
  assert.deepEqual(await checked(palpa), { triangles: LIMB.triangles.length, unit: 'mm', verdict: 'good' });
  await pictured(palpa);
  assert.match(await palpa.by('own-layers').innerText(), /Skin 1.5 mm · Fat 4 mm · Muscle/);
  await saveShot(palpa, 'own-dialog');

  // In metres no body has this size.
  await palpa.by('own-unit').selectOption('m');
  await palpa.by('finding-scale').waitFor();
  await palpa.by('own-unit').selectOption('mm');
  await palpa.by('finding-scale').waitFor({ state: 'detached' });

  await grown(palpa, ['my_limb.stl']);
  t.diagnostic(`pressed with ${(await touched(palpa)).toFixed(2)} N`);
  await saveShot(palpa, 'own-grown');
  await palpa.tab('tissues');
  await palpa.type('layer-1-thickness', '5 mm', ({ layers }) => Math.abs(layers[1].thickness - 5e-3) < 3e-4);

  await palpa.tab('scene');
  const bytes = await saved(palpa, 'scene-save-zip');
  const files = unzipped(bytes);
  assert.deepEqual([...files.keys()].sort(), ['my_limb.stl', 'scene.toml']);
  assert.deepEqual(files.get('my_limb.stl'), stl(LIMB));

  // Dropped on the page, the ZIP is the same scene.
  const before = await palpa.viewer.state();
  await drop(palpa, { 'scene.zip': bytes });
  const again = await palpa.viewer.running('the ZIP is open', (state) => state.origin !== before.origin);
  assert.deepEqual(again.files, ['my_limb.stl']);
  assert.equal(again.layers[1].thickness.toFixed(4), before.layers[1].thickness.toFixed(4));

  // So it is unpacked, for the command.
  const folder = join(palpa.viewer.out, 'unpacked');
  mkdirSync(folder);
  for (const [name, content] of files) writeFileSync(join(folder, name), content);
  const other = await Viewer.start({ scene: join(folder, 'scene.toml') });
  try {
    const state = await other.running('it is there', () => true);
    assert.equal(state.n_nodes, again.n_nodes);
  } finally {
    await other.stop();
  }
  await palpa.choose('block');
});

test('an OBJ in metres with a bone grows down to it', async () => {
  const palpa = await sharedPage();
  const bone = ellipsoid([80, 12, 12], 16, 20);
  await drop(palpa, { 'bone.obj': obj(scaled(bone, 1e-3)), 'skin.obj': obj(scaled(LIMB, 1e-3)) });
  assert.deepEqual(await checked(palpa), { triangles: LIMB.triangles.length, unit: 'm', verdict: 'good' });
  assert.match(await palpa.by('own-bones').innerText(), /bone\.obj/);
  assert.match(await palpa.by('own-layers').innerText(), /Muscle to the bone/);
  await pictured(palpa);
  await saveShot(palpa, 'own-bone');
  await grown(palpa, ['bone.obj', 'skin.obj']);
  await touched(palpa);
  await palpa.choose('block');
});

test('a GLB is grown with another template, by the file dialog of the panel', async () => {
  const palpa = await sharedPage();
  await palpa.tab('scene');
  await palpa.by('scene-file').setInputFiles({ name: 'limb.glb', mimeType: 'model/gltf-binary', buffer: glb(scaled(LIMB, 1e-3)) });
  assert.deepEqual(await checked(palpa), { triangles: LIMB.triangles.length, unit: 'm', verdict: 'good' });
  await palpa.by('own-template').selectOption('phantom');
  const state = await grown(palpa, ['limb.glb']);
  assert.deepEqual(state.layers.map(({ name }) => name), ['soft silicone']);
  await touched(palpa);
  await palpa.choose('block');
});

test('a broken file is refused with its place, and one with defects shows them on the mesh', async () => {
  const palpa = await sharedPage();
  await drop(palpa, { 'broken.obj': 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n' });
  await palpa.by('own-problem').waitFor();
  assert.match(await palpa.by('own-problem').innerText(), /broken\.obj.*line 4.*vertex 9/);
  await palpa.page.keyboard.press('Escape');
  await palpa.by('own').waitFor({ state: 'detached' });
  await drop(palpa, { 'letter.docx': 'Dear reader' });
  await palpa.by('own-problem').filter({ hasText: '.docx' }).waitFor();
  await palpa.by('own-close').click();

  // Two triangles are missing, one is there twice.
  const { points, triangles } = LIMB;
  const damaged = { points, triangles: [...triangles.slice(0, 400), triangles[0], ...triangles.slice(402)] };
  await drop(palpa, { 'damaged.obj': obj(damaged) });
  assert.equal((await checked(palpa)).verdict, 'bad');
  await pictured(palpa);
  const hole = palpa.by('finding-hole');
  assert.match(await hole.innerText(), /mm/);
  assert.ok(Number(await palpa.by('own-picture').getAttribute('data-marks')) >= 2);
  await palpa.by('finding-duplicate').waitFor();
  await hole.getByRole('button').click();
  await hole.getByRole('button', { name: /Place 1 of/ }).waitFor();
  await saveShot(palpa, 'own-defects');
  await palpa.by('own-close').click();

  // A scene without its meshes says what to do.
  await palpa.openFile('alone.toml', '[body]\nsurface = "skin.ply"\n[[layer]]\ntissue = "fat"\nthickness = "9 mm"\n[press]\ndepth = "2 mm"\n');
  await palpa.by('problem').filter({ hasText: 'skin.ply' }).waitFor();
  await palpa.choose('block');
});

test('a scene is dropped with the mesh that it refers to, and a watching page opens nothing', async () => {
  const palpa = await sharedPage();
  const scene = '[body]\nsurface = "skin.stl"\nunit = "mm"\n[[layer]]\ntissue = "fat"\nthickness = "12 mm"\n[tool]\nshape = "sphere"\nradius = "8 mm"\n[press]\ndepth = "3 mm"\n';
  const before = (await palpa.viewer.state()).origin;
  await drop(palpa, { 'limb.toml': scene, 'skin.stl': stl(LIMB) });
  const state = await palpa.viewer.running('it is there', (now) => now.origin !== before);
  assert.deepEqual([state.files, state.layers.map(({ name }) => name)], [['skin.stl'], ['fat']]);

  const second = await PalpaPage.open(await sharedBrowser(), palpa.viewer);
  try {
    await second.drawn();
    await drop(second, { 'skin.stl': stl(LIMB) });
    await second.by('toast').filter({ hasText: 'Take control' }).waitFor();
    assert.equal(await second.by('own').count(), 0);
  } finally {
    await second.close();
  }
  await palpa.page.bringToFront();
  await palpa.choose('block');
});

test('after a restart of the engine the page brings back the body that was dropped, as it was changed', async () => {
  await endShared();
  let viewer = await Viewer.start({ scene: 'block' });
  const { port } = viewer;
  const palpa = await PalpaPage.open(await sharedBrowser(), viewer);
  try {
    await palpa.drawn();
    await palpa.running();
    await drop(palpa, { 'limb.stl': stl(LIMB) });
    await checked(palpa);
    await grown(palpa, ['limb.stl']);
    await palpa.tab('tissues');
    await palpa.type('layer-0-young', '123 kPa', ({ layers }) => Math.abs(layers[0].stiffness - 123e3) < 100);

    // The files on the disk stay; those of the engine go with it.
    const kept = viewer.out;
    const ended = new Promise((resolve) => viewer.child.once('exit', resolve));
    viewer.child.kill('SIGKILL');
    await ended;
    await palpa.by('connection-lost').waitFor();
    viewer = await Viewer.start({ port, scene: 'block' });
    palpa.viewer = viewer;
    await palpa.by('restore').waitFor();
    await saveShot(palpa, 'restore');
    await palpa.by('restore-scene').click();
    await palpa.by('restore').waitFor({ state: 'detached' }).catch(async () => assert.fail(await palpa.by('restore').innerText()));
    const state = await viewer.running('the body is back', ({ files }) => files.length === 1);
    assert.ok(Math.abs(state.layers[0].stiffness - 123e3) < 100, 'with its change');
    await palpa.running();
    await touched(palpa);

    // A page that keeps the new scene has it without a question.
    await viewer.kill();
    await palpa.by('connection-lost').waitFor();
    viewer = await Viewer.start({ port, scene: 'block' });
    palpa.viewer = viewer;
    await palpa.by('restore-keep').click();
    await palpa.by('restore').waitFor({ state: 'detached' });
    await palpa.running();
    assert.equal((await viewer.state()).gallery_key, 'block');
    assert.ok(kept !== viewer.out);
  } finally {
    await palpa.close();
    await viewer.stop();
  }
});
