// The curves: ghosts, strokes, gaps, recordings, and that they are not drawn at rest.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { PalpaPage } from './page.mjs';
import { endShared, sharedBrowser, sharedPage } from './session.mjs';
import { Viewer, sceneOf, until } from './viewer.mjs';

/** @param {import('./page.mjs').PalpaPage} palpa @param {string} kind */
async function curve(palpa, kind) {
  const figure = palpa.by(`curve-figure-${kind}`);
  const read = async (/** @type {string} */ name) => {
    const text = await figure.getAttribute(`data-${name}`);
    return text === null ? null : Number(text);
  };
  return { earlier: await read('earlier'), before: await read('before'), gaps: await read('gaps'), from: await read('from') };
}

/** Shows a curve at the last place. @param {import('./page.mjs').PalpaPage} palpa @param {string} kind */
async function show(palpa, kind) {
  if ((await palpa.by(`curve-${kind}`).count()) === 0) await palpa.by('curve-choose-2').selectOption(kind);
  await palpa.by(`curve-${kind}`).locator('canvas').waitFor();
}

/**
 * Counts the pixels of a plot in the colour of a variable of the page's style, column by column.
 * @param {import('./page.mjs').PalpaPage} palpa
 * @param {string} kind
 * @param {string} variable
 * @returns {Promise<number[]>}
 */
function inked(palpa, kind, variable) {
  return palpa.page.evaluate(([id, name]) => {
    const place = /** @type {HTMLElement} */ (document.querySelector(`[data-testid=${id}]`));
    const canvas = /** @type {HTMLCanvasElement} */ (place.querySelector('canvas'));
    const over = /** @type {HTMLElement | null} */ (place.querySelector('.u-over'));
    // Between two plots there is none for a moment.
    if (over === null) return [0];
    const [left, top, width, height] = [over.offsetLeft, over.offsetTop, over.offsetWidth, over.offsetHeight].map((x) => Math.round(x * devicePixelRatio));
    const paint = document.createElement('canvas').getContext('2d');
    if (paint === null) throw new Error('no canvas');
    paint.fillStyle = getComputedStyle(place).getPropertyValue(name).trim();
    paint.fillRect(0, 0, 1, 1);
    const [r, g, b] = paint.getImageData(0, 0, 1, 1).data;
    const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
    const { data } = context.getImageData(left, top, width, height);
    const columns = new Array(width).fill(0);
    for (let i = 0; i < data.length; i += 4) {
      const isNear = Math.abs(data[i] - r) + Math.abs(data[i + 1] - g) + Math.abs(data[i + 2] - b) < 60;
      if (isNear && data[i + 3] > 100) columns[(i / 4) % width]++;
    }
    return columns;
  }, /** @type {const} */ ([`curve-${kind}`, variable]));
}

const sum = (/** @type {number[]} */ values) => values.reduce((a, b) => a + b, 0);

/** A press and a release by keys. @param {import('./page.mjs').PalpaPage} palpa */
async function pressByKeys(palpa) {
  await palpa.atRest();
  await palpa.focus();
  await palpa.page.keyboard.press('Space');
  await palpa.steady(0.05);
  await palpa.page.keyboard.press('Escape');
  await palpa.atRest();
}

test('runs stay as ghosts, also those of the body before a change', async () => {
  const palpa = await sharedPage();
  await palpa.choose('limb');
  await palpa.choose('block');
  await show(palpa, 'force-depth');
  await pressByKeys(palpa);
  await until('the run is drawn', async () => sum(await inked(palpa, 'force-depth', '--force')) > 30);
  assert.equal((await curve(palpa, 'force-depth')).before, 0);
  assert.equal(sum(await inked(palpa, 'force-depth', '--before')), 0);

  await palpa.tab('tissues');
  await palpa.type('layer-0-young', '30 kPa', ({ layers }) => Math.abs(layers[0].stiffness - 30e3) < 100);
  await pressByKeys(palpa);
  await until('the first run is a ghost of the body before', async () => ((await curve(palpa, 'force-depth')).before ?? 0) >= 1);
  await until('both are drawn', async () => sum(await inked(palpa, 'force-depth', '--before')) > 20 && sum(await inked(palpa, 'force-depth', '--force')) > 30);
  await palpa.page.getByText('before the change').first().waitFor();

  // Three ghosts at most, the newest.
  for (let k = 0; k < 3; k++) await pressByKeys(palpa);
  await until('the runs before the change are gone', async () => {
    const { earlier, before } = await curve(palpa, 'force-depth');
    return earlier === 3 && before === 0;
  });
  await palpa.by('curve-clear-force-depth').click();
  await until('no run is left', async () => (await curve(palpa, 'force-depth')).earlier === 0 && sum(await inked(palpa, 'force-depth', '--force')) === 0);

  // The curves of one body mean nothing for another.
  await pressByKeys(palpa);
  await until('a run is drawn', async () => sum(await inked(palpa, 'force-depth', '--force')) > 30);
  await palpa.choose('limb');
  await until('nothing is drawn', async () => sum(await inked(palpa, 'force-depth', '--force')) === 0);
  await palpa.choose('block');
});

test('strokes are drawn over the way along the skin', async (t) => {
  const palpa = await sharedPage();
  await palpa.have('block');
  await show(palpa, 'force-distance');
  await palpa.tab('motion');
  await palpa.by('motion-kind').selectOption('drag');
  await palpa.viewer.running('the motion is a drag', (state) => sceneOf(state).motion?.kind === 'drag');
  await palpa.type('motion-length', '20 mm', (state) => sceneOf(state).motion?.length === '20 mm');
  // On a busy machine the engine may let the force go on the way.
  let drawn = 0;
  for (let attempt = 0; attempt < 4 && drawn < 0.7; attempt++) {
    await palpa.by('motion-run').click();
    await palpa.viewer.running('the motion runs', (state) => state.is_motion_running);
    await palpa.viewer.running('the motion is over', (state) => !state.is_motion_running);
    await palpa.atRest();
    const columns = await inked(palpa, 'force-distance', '--force');
    drawn = columns.filter((n) => n > 0).length / columns.length;
  }
  assert.ok(drawn >= 0.7, `${drawn} of the way is drawn`);
  // There and back are strokes of their own.
  await until('there is a stroke before', async () => ((await curve(palpa, 'force-distance')).earlier ?? 0) >= 1);
  const { from } = await curve(palpa, 'force-distance');
  t.diagnostic(`the axis of force begins at ${from} N`);
  await palpa.choose('block');
});

test('a curve is chosen, exchanged and kept', async () => {
  const palpa = await sharedPage();
  await palpa.by('curve-choose-2').selectOption('depth-time');
  await palpa.by('curve-depth-time').waitFor();
  await palpa.by('curve-choose-0').selectOption('depth-time');
  assert.deepEqual(await Promise.all([0, 1, 2].map((k) => palpa.by(`curve-choose-${k}`).inputValue())), ['depth-time', 'force-time', 'force-depth']);
  await palpa.by('curve-lines').selectOption('parts');
  await palpa.by('curve-window-force-time').selectOption('5');
  await palpa.page.reload();
  await palpa.drawn();
  await palpa.running();
  assert.equal(await palpa.by('curve-choose-0').inputValue(), 'depth-time');
  assert.equal(await palpa.by('curve-lines').inputValue(), 'parts');
  assert.equal(await palpa.by('curve-window-depth-time').inputValue(), '5');
  await palpa.by('curve-choose-0').selectOption('force-depth');
  await palpa.by('curve-choose-2').selectOption('force-distance');
  await palpa.by('curve-lines').selectOption('size');
  await palpa.by('curve-window-force-time').selectOption('15');
});

test('the spectrum of the force is asked for only while it is shown', async () => {
  const palpa = await sharedPage();
  await palpa.have('block');
  let n = 0;
  palpa.page.on('request', (request) => {
    if (request.url().includes('/api/spectrum')) n++;
  });
  await show(palpa, 'spectrum');
  await until('it is asked for', () => n >= 2);
  await palpa.focus();
  await palpa.page.keyboard.press('Space');
  await until('it is drawn', async () => sum(await inked(palpa, 'spectrum', '--force')) > 30);
  await palpa.page.keyboard.press('Escape');
  await palpa.atRest();
  const response = await palpa.viewer.get('api/spectrum');
  const { step, amplitude } = /** @type {import('../src/generated/api').Spectrum} */ (await response.json());
  assert.ok(Math.abs(step * (amplitude.length - 1) - 500) < 1e-6, `up to ${step * (amplitude.length - 1)} Hz`);
  await show(palpa, 'force-distance');
  const asked = n;
  const { tick } = await palpa.readout();
  await palpa.reads('two seconds later', (now) => now.tick > tick + 2000);
  assert.ok(n <= asked + 1, `${n - asked} more`);
});

test('at rest nothing is drawn', async () => {
  const palpa = await sharedPage();
  await palpa.have('block');
  await palpa.atRest();
  await palpa.page.mouse.move(...(await palpa.at(0.02, 0.9)));
  const { tick: begin } = await palpa.readout();
  // The hand comes to its place over the skin.
  await palpa.reads('two seconds of rest', ({ tick }) => tick > begin + 2000);
  await palpa.page.evaluate(() => {
    const counted = /** @type {any} */ (window);
    counted.cleared = 0;
    const { clearRect } = CanvasRenderingContext2D.prototype;
    counted.clearRect = clearRect;
    CanvasRenderingContext2D.prototype.clearRect = /** @type {typeof clearRect} */ (function (x, y, width, height) {
      counted.cleared++;
      return clearRect.call(this, x, y, width, height);
    });
  });
  const cleared = () => palpa.page.evaluate(() => /** @type {any} */ (window).cleared);
  const { tick } = await palpa.readout();
  await palpa.reads('three seconds later', (now) => now.tick > tick + 3000);
  assert.equal(await cleared(), 0);
  await pressByKeys(palpa);
  assert.ok((await cleared()) > 0, 'a press is drawn');
  await palpa.page.evaluate(() => {
    CanvasRenderingContext2D.prototype.clearRect = /** @type {any} */ (window).clearRect;
  });
});

test('a recording is drawn as a whole, and a click on its curve goes there', async (t) => {
  const palpa = await sharedPage();
  await palpa.have('block');
  await palpa.atRest();
  await show(palpa, 'depth-time');
  await palpa.tab('record');
  await palpa.by('record-start').click();
  await palpa.by('record-stop').waitFor();
  for (let k = 0; k < 2; k++) await pressByKeys(palpa);
  await palpa.by('record-stop').click();
  const { recording } = await palpa.viewer.running('a recording is kept', (state) => state.recording.duration > 0 && !state.recording.is_recording);

  /** @type {import('../src/generated/api').RecordingCurve} */
  const course = await (await palpa.viewer.get('api/recording/curve')).json();
  const forces = course.force.map(([x, y, z]) => Math.hypot(x, y, z));
  const [header, ...lines] = (await (await palpa.viewer.get('api/recording.csv')).text()).trim().split('\n');
  assert.deepEqual(header.split(',').slice(0, 8), ['time_s', 'depth_mm', 'force_n', 'place_x_mm', 'place_y_mm', 'place_z_mm', 'tick', 'now']);
  const rows = lines.map((line) => line.split(',').slice(0, 8).map((cell) => (cell === '' ? NaN : Number(cell))));
  const highest = rows.reduce((most, row) => (row[2] > most[2] ? row : most));
  const peak = forces.indexOf(Math.max(...forces));
  assert.ok(Math.abs(forces[peak] - highest[2]) < 1e-5 && Math.abs(course.time[peak] - highest[0]) < 1e-5, `peak ${forces[peak]} N at ${course.time[peak]} s, in the table ${highest[2]} N at ${highest[0]} s`);
  assert.ok(Math.abs(course.depth[peak] * 1e3 - highest[1]) < 1e-4 && highest[1] > 0.5);
  assert.ok(course.time.length <= 2100 && course.time.length < rows.length);
  t.diagnostic(`${rows.length} ticks, ${course.time.length} points`);

  await palpa.by('replay-open').click();
  await palpa.by('replay-slider').waitFor();
  // Both presses are there.
  const columns = await until('the whole is drawn', async () => {
    const drawn = await inked(palpa, 'force-time', '--force');
    return sum(drawn) > 50 && drawn;
  });
  assert.ok(columns.findLastIndex((n) => n > 0) > 0.5 * columns.length && columns.findIndex((n) => n > 0) < 0.2 * columns.length);
  const playhead = palpa.by('playhead-force-time');
  await playhead.waitFor();

  const over = palpa.by('curve-force-time').locator('.u-over');
  const box = await over.boundingBox();
  assert.ok(box, 'the plot is seen');
  const wanted = course.time[peak] / Math.max(recording.duration, course.time.at(-1) ?? 0);
  await palpa.page.mouse.click(box.x + wanted * box.width, box.y + 0.5 * box.height);
  const pixel = recording.duration / box.width;
  await until('the playhead is there', async () => Math.abs(Number(await playhead.getAttribute('data-time')) - course.time[peak]) < 2 * pixel + 0.4);
  await palpa.reads('the force there', ({ newtons }) => newtons > 0.5 * forces[peak]);
  // Dragged to the left end.
  await palpa.page.mouse.move(box.x + 0.5 * box.width, box.y + 0.5 * box.height);
  await palpa.page.mouse.down();
  await palpa.page.mouse.move(box.x + 0.2 * box.width, box.y + 0.5 * box.height);
  await palpa.page.mouse.move(box.x + 1, box.y + 0.5 * box.height);
  await palpa.page.mouse.up();
  await until('the playhead is at the beginning', async () => Number(await playhead.getAttribute('data-time')) < 2 * pixel + 0.4);
  await palpa.reads('no force', ({ newtons }) => newtons < 0.05 * forces[peak]);
  await palpa.by('playhead-force-depth').waitFor();
  await palpa.by('replay-close').click();
  await playhead.waitFor({ state: 'detached' });
  await show(palpa, 'force-distance');
  await palpa.atRest();
});

test('a gap in the frames is not bridged', async () => {
  await endShared();
  const viewer = await Viewer.start({ scene: 'block' });
  const browser = await sharedBrowser();
  const context = await browser.newContext({ viewport: { width: 1280, height: 720 }, colorScheme: 'light', locale: 'en' });
  const palpa = new PalpaPage(await context.newPage(), viewer);
  try {
    let isHeld = false;
    await palpa.page.routeWebSocket(/\/ws/, (socket) => {
      const server = socket.connectToServer();
      server.onMessage((message) => {
        // Frames are lost; the rest of the connection lives.
        const isFrame = typeof message !== 'string' && message.readUInt32LE(4) === 2;
        if (!isHeld || !isFrame) socket.send(message);
      });
    });
    await palpa.page.goto(viewer.url);
    await palpa.drawn();
    await palpa.running();
    await palpa.focus();
    await palpa.page.keyboard.press('Space');
    const { tick } = await palpa.steady(0.05);
    isHeld = true;
    await until('four seconds pass', async () => (await viewer.engine()).seconds > tick / 1000 + 4);
    isHeld = false;
    await palpa.reads('frames again', (now) => now.tick > tick + 4000);
    await palpa.page.keyboard.press('PageDown');
    await until('the line is broken', async () => ((await curve(palpa, 'force-time')).gaps ?? 0) >= 1);
    const columns = await until('the line goes on', async () => {
      const drawn = await inked(palpa, 'force-time', '--force');
      const last = drawn.findLastIndex((n) => n > 0);
      return last > 0.97 * drawn.length && drawn;
    });
    // Of 15 s, some four are empty between parts that are not.
    let [longest, run] = [0, 0];
    for (const n of columns.slice(columns.findIndex((one) => one > 0))) {
      run = n === 0 ? run + 1 : 0;
      longest = Math.max(longest, run);
    }
    assert.ok(longest > (3 / 15) * columns.length, `${longest} of ${columns.length} columns are empty`);
    await palpa.page.keyboard.press('Escape');
    await palpa.atRest();
    await until('the run has a gap too', async () => ((await curve(palpa, 'force-depth')).gaps ?? 0) >= 1);
  } finally {
    await palpa.close();
    await viewer.stop();
  }
});
