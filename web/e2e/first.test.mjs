// The first minute: a hint where to press, a hand that shows it, and words for what a newcomer meets.

import assert from 'node:assert/strict';
import { after, test } from 'node:test';
import { PalpaPage } from './page.mjs';
import { endShared, sharedBrowser, sharedPage } from './session.mjs';
import { until, Viewer } from './viewer.mjs';

const LUMP = 'forearm_lump';

/** A viewer of their own, so that newcomers are in control. @type {Viewer | undefined} */
let viewer;
/** @type {PalpaPage | undefined} */
let visitor;

/** A page of somebody who was never here. @param {import('playwright-core').BrowserContextOptions} options */
async function newcomer(options = {}) {
  await endShared();
  await visitor?.close();
  viewer ??= await Viewer.start();
  const palpa = (visitor = await PalpaPage.open(await sharedBrowser(), viewer, options));
  await palpa.drawn();
  await until('the newcomer controls', async () => (await palpa.by('controller-status').getAttribute('data-controls')) === 'you');
  await palpa.running();
  return palpa;
}

async function endNewcomers() {
  await visitor?.close();
  await viewer?.stop();
  visitor = viewer = undefined;
}

after(endNewcomers);

/** The place that the hint points to. @param {PalpaPage} palpa @returns {Promise<[number, number]>} */
async function pointedAt(palpa) {
  const ring = await until('the hint points somewhere', () => palpa.page.locator('.first-ring').boundingBox());
  return [ring.x + ring.width / 2, ring.y + ring.height / 2];
}

/** @param {PalpaPage} palpa */
const ghostOf = (palpa) => palpa.page.evaluate(() => /** @type {HTMLElement | null} */ (document.querySelector('[data-testid=ghost]'))?.dataset.ghost ?? null);

/**
 * Presses until a force is felt. On a busy machine a page may be silent for so long that the hand lifts by itself: then it is
 * pressed again.
 * @param {PalpaPage} palpa
 * @param {[number, number]} at
 * @param {() => Promise<void>} isDown what is asked at once after the mouse is down
 */
async function press(palpa, at, isDown = async () => {}) {
  for (let k = 0; k < 5; k++) {
    const { tick: begin } = await palpa.readout();
    await palpa.page.mouse.move(...at);
    await palpa.page.mouse.down();
    await isDown();
    const { newtons, metres } = await palpa.reads('a force, or a hand that lifted', (now) => (now.newtons > 0.1 && now.metres > 0) || now.tick > begin + 15_000);
    if (newtons > 0.1 && metres > 0) return;
    await palpa.release();
    await palpa.atRest();
  }
  assert.fail('no force at all');
}

/** @param {PalpaPage} palpa */
const strokes = (palpa) => until('the ghost strokes', async () => (await ghostOf(palpa)) === 'stroking');

test('a hint points to the place to press until the first press, also on the next visit', async () => {
  const palpa = await newcomer();
  await palpa.have('forearm');
  const hint = palpa.by('first-hint');
  await hint.waitFor();
  assert.match(await hint.innerText(), /Press here and drag/);
  const before = await pointedAt(palpa);
  // It stays at its place while the picture turns.
  const [x, y] = await palpa.at();
  await palpa.page.mouse.move(x, y);
  await palpa.page.mouse.down({ button: 'right' });
  await palpa.page.mouse.move(x + 40, y + 80, { steps: 4 });
  await palpa.page.mouse.up({ button: 'right' });
  await until('the hint has moved with the body', async () => Math.hypot(...(await pointedAt(palpa)).map((c, i) => c - before[i])) > 5);
  await palpa.page.getByRole('button', { name: 'Home', exact: true }).first().click();
  await until('the hint is back', async () => Math.hypot(...(await pointedAt(palpa)).map((c, i) => c - before[i])) < 2);

  await press(palpa, before);
  await hint.waitFor({ state: 'detached' });
  await palpa.release();
  await palpa.atRest();
  assert.equal(await hint.count(), 0);
  await palpa.page.reload();
  await palpa.drawn();
  await palpa.running();
  await palpa.by('depth-number').filter({ hasText: 'above the skin' }).waitFor();
  assert.equal(await hint.count(), 0);
  assert.deepEqual(palpa.complaints, []);
});

test('a hand strokes over the lump when its scene is opened for the first time, then it is the user’s turn', async () => {
  const palpa = await newcomer({ reducedMotion: 'no-preference' });
  await palpa.have('forearm');
  await palpa.by('map-off').click();
  await palpa.choose(LUMP);
  const hint = palpa.by('first-hint');
  let [isFelt, isDone] = [false, false];
  // A page that a busy machine left without its engine for seconds ends the stroke, and is asked again.
  for (let k = 0; k < 5 && !isDone; k++) {
    if (k > 0) await palpa.by('show-me').click();
    await strokes(palpa);
    assert.ok(await palpa.by('map-surroundings').isChecked(), 'the map is on');
    await until('the ghost has ended', async () => {
      const { newtons, metres } = await palpa.readout();
      if (newtons > 0.1 && metres > 0) isFelt = true;
      return (await ghostOf(palpa)) === null;
    });
    await hint.waitFor();
    isDone = isFelt && (await hint.getAttribute('data-turn')) === 'true';
  }
  assert.ok(isDone, 'the ghost felt a force, and has ended by itself');
  assert.match(await hint.innerText(), /Your turn/);
  await palpa.atRest();

  await press(palpa, await pointedAt(palpa));
  await hint.waitFor({ state: 'detached' });
  await palpa.release();
  await palpa.atRest();
  // Once is enough.
  await palpa.choose('forearm');
  await palpa.choose(LUMP);
  await palpa.feelsNothing(1500);
  assert.equal(await palpa.by('ghost').count(), 0);
  assert.deepEqual(palpa.complaints, []);
});

test('a key or a press stops the ghost at once', async () => {
  const palpa = await newcomer({ reducedMotion: 'no-preference' });
  await palpa.have(LUMP);
  for (const input of ['key', 'press']) {
    await palpa.by('show-me').click();
    await strokes(palpa);
    if (input === 'key') {
      await palpa.page.keyboard.press('a');
      assert.equal(await palpa.by('ghost').count(), 0);
      await palpa.atRest();
      continue;
    }
    // The press is the user's from then on.
    await press(palpa, await palpa.at(0.62, 0.47), async () => assert.equal(await palpa.by('ghost').count(), 0));
    await palpa.release();
    await palpa.atRest();
  }
});

test('with reduced motion the ghost comes on request only', async () => {
  const palpa = await newcomer({ reducedMotion: 'reduce' });
  await palpa.have('forearm');
  await palpa.choose(LUMP);
  await palpa.feelsNothing(1500);
  assert.equal(await palpa.by('ghost').count(), 0);
  await palpa.choose('forearm');
  // The button opens the scene, too.
  await palpa.by('show-me').click();
  await strokes(palpa);
  assert.equal((await palpa.viewer.state()).gallery_key, LUMP);
  await palpa.by('ghost-stop').click();
  await palpa.atRest();
  assert.equal(await palpa.by('ghost').count(), 0);
});

test('height and zero are said as such, and a depth as a depth', async () => {
  await endNewcomers();
  const palpa = await sharedPage();
  await palpa.have('forearm');
  await palpa.atRest();
  const [depth, force] = [palpa.by('depth-number'), palpa.by('force-number')];
  assert.match(await depth.innerText(), /^\d+(\.\d)? mm above the skin$/);
  assert.notEqual(await force.getAttribute('data-none'), null);
  await palpa.press();
  await palpa.steady(0.05);
  assert.match(await depth.innerText(), /^\d+\.\d mm$/);
  assert.equal(await force.getAttribute('data-none'), null);
  await palpa.release();
  await palpa.atRest();
  await until('zero is grey again', async () => (await force.getAttribute('data-none')) !== null);
});

test('a press on a cut face, a section or a bone says that it is no skin, and moves nothing', async () => {
  const palpa = await sharedPage();
  await palpa.have('forearm');
  await palpa.atRest();
  const missed = palpa.by('missed');
  const layout = () => palpa.page.evaluate(() => ['.stage', '.readout', '.rail', '.map-box'].map((name) => JSON.stringify(document.querySelector(name)?.getBoundingClientRect())));
  const before = await layout();
  /** @type {Set<string | null>} */
  const parts = new Set();
  // Across the end that is turned to the viewer.
  for (let k = 0; k < 40 && parts.size < 2; k++) {
    await palpa.page.mouse.click(...(await palpa.at(0.075 + 0.002 * k, 0.5 + 0.005 * k)));
    if ((await missed.count()) === 0) continue;
    parts.add(await missed.getAttribute('data-part'));
    assert.match(await missed.innerText(), /^Press the skin/);
    assert.deepEqual(await layout(), before);
  }
  assert.deepEqual([...parts].sort(), ['bone', 'end']);
  assert.equal((await palpa.readout()).newtons, 0);

  await palpa.tab('view');
  await palpa.by('cutaway-toggle').click();
  await palpa.sectionArea();
  await palpa.page.mouse.click(...(await palpa.at(0.5, 0.57)));
  await until('the section is named', async () => (await missed.count()) > 0 && (await missed.getAttribute('data-part')) === 'section');
  await palpa.by('cutaway-toggle').click();
  // A press of the skin ends it.
  await press(palpa, await palpa.at(), () => missed.waitFor({ state: 'detached' }));
  await palpa.release();
  await palpa.atRest();
});

test('the legend of a cutaway names bone, core and a lump that is cut', async () => {
  const palpa = await sharedPage();
  await palpa.choose(LUMP);
  await palpa.tab('view');
  assert.equal(await palpa.by('legend').count(), 0);
  await palpa.by('cutaway-toggle').click();
  const legend = palpa.by('legend');
  await legend.waitFor();
  assert.deepEqual((await legend.innerText()).split('\n').slice(0, 6), ['Tissue', 'Skin', 'Fat', 'Muscle', 'Bone', 'Rigid core']);
  // Through the lump, by the slider's keys.
  await palpa.by('cutaway-position').focus();
  for (let k = 0; (await palpa.sectionArea()).lumps === 0; k++) {
    assert.ok(k < 60, 'the plane meets the lump');
    await palpa.page.keyboard.press('ArrowLeft');
    await until('the section is of the new plane', async () => (await palpa.sectionArea()).total > 0);
  }
  await legend.filter({ hasText: 'Lump' }).waitFor();
  await palpa.by('show-lumps').click();
  await until('a hidden lump is not in the legend', async () => !/Lump/.test(await legend.innerText()));
  await palpa.by('show-lumps').click();
  await palpa.by('show-bones').click();
  await until('nor are hidden bones', async () => !/Bone|core/.test(await legend.innerText()));
  await palpa.by('show-bones').click();
  await palpa.by('cutaway-toggle').click();
  await legend.waitFor({ state: 'detached' });
  await palpa.choose('forearm');
});

test('the shadow on the ground is that of what a cutaway leaves', async () => {
  const palpa = await sharedPage();
  await palpa.have('forearm');
  await palpa.atRest();
  await palpa.tab('view');
  // A place of the ground in the shadow of the half that is cut away, where nothing else is drawn.
  const [x, y] = await palpa.at(0.27, 0.71);
  const brightness = async () => {
    const png = await palpa.page.screenshot({ clip: { x: x - 4, y: y - 4, width: 8, height: 8 } });
    return palpa.page.evaluate(async (data) => {
      const image = await createImageBitmap(new Blob([Uint8Array.from(atob(data), (c) => c.charCodeAt(0))]));
      const g = /** @type {CanvasRenderingContext2D} */ (Object.assign(document.createElement('canvas'), { width: image.width, height: image.height }).getContext('2d'));
      g.drawImage(image, 0, 0);
      const { data: pixels } = g.getImageData(0, 0, image.width, image.height);
      return pixels.reduce((sum, value, i) => (i % 4 === 3 ? sum : sum + value), 0) / ((pixels.length / 4) * 3);
    }, png.toString('base64'));
  };
  const shaded = await brightness();
  await palpa.by('cutaway-toggle').click();
  await palpa.sectionArea();
  const lit = await until('the shadow is gone', async () => {
    const now = await brightness();
    return now > shaded + 8 && now;
  });
  await palpa.by('cutaway-toggle').click();
  await until('the shadow is back', async () => (await brightness()) < lit - 8);
});
