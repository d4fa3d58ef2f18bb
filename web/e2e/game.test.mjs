// The game: a lump is hidden, felt for, marked and shown; by levels, and in a series.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { test } from 'node:test';
import { sharedPage } from './session.mjs';
import { saveShot } from './shots.mjs';

/** @typedef {import('./page.mjs').PalpaPage} PalpaPage */
/** @typedef {import('../src/generated/api').State} State */

/** @param {readonly number[]} a @param {readonly number[]} b */
const distance = (a, b) => Math.hypot(...a.map((x, c) => x - b[c]));

/**
 * Chooses a game and starts it; the seed is typed.
 * @param {PalpaPage} palpa
 * @param {{ level: string, rounds?: number, seed: number }} game
 */
async function start(palpa, { level, rounds = 1, seed }) {
  await endLeft(palpa);
  await palpa.have('forearm');
  await palpa.tab('game');
  await palpa.by(`game-level-${level}`).click();
  await palpa.by(`game-rounds-${rounds}`).click();
  await palpa.by('game-lumps-1').click();
  await palpa.by('game-seed').fill(String(seed));
  await palpa.by('game-start').click();
  return isHidden(palpa);
}

/** Ends a game that an earlier test left when it failed. @param {PalpaPage} palpa */
async function endLeft(palpa) {
  const { game } = await palpa.viewer.state();
  if (game == null) return;
  await palpa.tab('game');
  await (game.result == null ? palpa.page.getByRole('button', { name: 'Give up' }) : palpa.by('game-end')).click();
  await palpa.viewer.running('the game is over', (state) => state.game == null);
}

/** @param {PalpaPage} palpa */
async function isHidden(palpa) {
  const state = await palpa.viewer.running('a lump is hidden', ({ game }) => game != null && game.result == null);
  await palpa.running();
  await palpa.by('game-bar').waitFor();
  return state;
}

/** Shows the body from its usual side. @param {PalpaPage} palpa */
async function home(palpa) {
  await palpa.page.locator('.stage-tools').getByRole('button', { name: 'Home' }).click();
}

/**
 * Presses until a force is felt, without a break for so many ticks of the loop, and lifts. On a busy machine a page may be silent
 * for so long that the hand lifts by itself: then it is pressed again.
 * @param {PalpaPage} palpa
 */
async function pressOnce(palpa, x = 0.46, y = 0.5, ticks = 0) {
  let isFelt = false;
  for (let k = 0; k < 8 && !isFelt; k++) {
    const { tick: begin } = await palpa.readout();
    let since = Infinity;
    await palpa.press(x, y);
    await palpa.reads('a force, or a hand that lifted', ({ newtons, tick }) => {
      since = newtons > 0.1 ? Math.min(since, tick) : Infinity;
      isFelt = tick >= since + ticks;
      return isFelt || tick > begin + 15_000;
    });
    await palpa.release();
    await palpa.atRest();
  }
  assert.ok(isFelt, 'a press is felt');
}

/** Marks a place by a click. @param {PalpaPage} palpa */
async function markAt(palpa, x = 0.5, y = 0.5) {
  await palpa.by('game-mark-mode').click();
  await palpa.page.mouse.click(...(await palpa.at(x, y)));
  await palpa.viewer.running('the mark is kept', ({ game }) => game?.marks.length === 1);
}

/** @param {PalpaPage} palpa */
async function revealed(palpa) {
  const { game } = await palpa.viewer.running('the truth is told', (state) => state.game?.result != null);
  await palpa.by('game-verdict').waitFor();
  assert.ok(game?.result);
  return { game, result: game.result };
}

/** @param {PalpaPage} palpa */
async function end(palpa) {
  await palpa.by('game-end').click();
  const after = await palpa.viewer.running('the game is over', (state) => state.game == null);
  await palpa.running();
  assert.deepEqual(after.lumps, [], 'the scene is what it was');
}

test('a round: hidden, missed, shown by the camera, then found at that place', async () => {
  const palpa = await sharedPage();
  const hidden = await start(palpa, { level: 'easy', seed: 7 });
  assert.equal(hidden.game?.seed, 7);
  assert.deepEqual(hidden.lumps, [], 'no place is told');
  assert.ok(!/"lump"/.test(JSON.stringify(hidden.scene)), 'nor in the scene');
  assert.equal(hidden.game?.result ?? null, null);
  assert.deepEqual(hidden.game?.series.rounds, [], 'nor in the series');
  const toml = await (await palpa.viewer.get('api/scene.toml')).text();
  assert.ok(!/^\[\[lump\]\]/m.test(toml), 'nor in the file');
  assert.equal(await palpa.by('game-sides').count(), 0, 'an easy lump lies on the side of the press point');
  await palpa.tab('view');
  assert.ok(await palpa.by('cutaway-toggle').isDisabled(), 'nor by the cutaway');

  await pressOnce(palpa);
  await home(palpa);
  await markAt(palpa, 0.8, 0.42);
  await palpa.by('game-reveal').click();
  const { game, result } = await revealed(palpa);
  assert.equal(result.lumps.length, 1);
  const { error, over, path, tolerance, radius, is_found, mark } = result.lumps[0];
  assert.ok(error != null && mark === 0);
  assert.ok(Math.abs(tolerance - radius - 5e-3) < 1e-12, 'found is within the radius and 5 mm');
  const length = path.slice(1).reduce((sum, point, i) => sum + distance(point, path[i]), 0);
  assert.ok(Math.abs(length - error) < 1e-9, 'the distance is that of the path along the skin');
  assert.ok(distance(path[0], game.marks[0]) < 1e-3 && distance(path[path.length - 1], over) < 1e-9, 'from the mark to the lump');
  assert.ok(error >= distance(path[0], over) - 1e-9, 'and no shorter than through the body');
  assert.ok(error > tolerance && !is_found, 'it is far off');
  assert.match(await palpa.by('game-verdict').innerText(), /Missed: your mark is \d+ mm from the lump/);
  assert.equal(await palpa.by('game-lump').getAttribute('data-found'), 'false');
  assert.equal(result.score.total, 0);
  assert.equal(await palpa.by('game-score').getAttribute('data-total'), '0');
  assert.ok(result.n_presses >= 1 && result.max_force > 0.1);
  assert.equal(await palpa.by('game-presses').innerText(), String(result.n_presses));
  assert.ok(result.covered > 0 && result.covered < 1 && result.coverage.length > 0);
  assert.equal(await palpa.by('game-covered').innerText(), `${Math.round(result.covered * 100)} %`);
  await saveShot(palpa, 'game-result');

  // The same seed hides it at the same place, and the camera still looks there.
  await palpa.by('game-same-seed').click();
  await isHidden(palpa);
  await pressOnce(palpa, 0.5, 0.5);
  await markAt(palpa);
  await palpa.by('game-reveal').click();
  const again = (await revealed(palpa)).result;
  assert.deepEqual(again.lumps[0].lump, result.lumps[0].lump);
  const off = again.lumps[0].error;
  assert.ok(off != null && off < 2e-3, `the camera looks at the lump: ${off} m off`);
  assert.ok(again.lumps[0].is_found && again.lumps[0].is_explored);
  assert.match(await palpa.by('game-verdict').innerText(), /Found: your mark is/);
  assert.ok(again.score.total > 0);
  assert.match(await palpa.by('game-score').innerText(), /seen this round before/, 'it does not count for the best');
  await saveShot(palpa, 'game-found');
  await end(palpa);
});

test('easy shows the map, medium its stiffness, hard nothing before the result', async () => {
  const palpa = await sharedPage();
  const box = palpa.by('map-box');
  /** Holds a press until it is settled. */
  const settle = () => pressOnce(palpa, 0.5, 0.5, 2000);
  const n = async () => Number(await box.getAttribute('data-n'));
  /** Presses until the map has a place: those are left out in which the tissue is late. */
  const paint = async () => {
    for (let k = 0; k < 8 && (await n()) === 0; k++) await settle();
    assert.ok((await n()) >= 1, 'the press is on the map');
  };
  await start(palpa, { level: 'easy', seed: 21 });
  await paint();
  assert.equal(await palpa.by('map-surroundings').count(), 1);
  await palpa.page.getByRole('button', { name: 'Give up' }).click();
  await palpa.viewer.running('the game is over', ({ game }) => game == null);

  await start(palpa, { level: 'medium', seed: 21 });
  assert.match(await palpa.by('level-words').innerText(), /stiffness only/);
  await paint();
  assert.equal(await palpa.by('map-surroundings').count(), 0, 'no comparison with the surroundings');
  assert.equal(await palpa.by('map-csv').count(), 0);
  const answer = await fetch(new URL('api/map.csv', palpa.viewer.url));
  assert.equal(answer.status, 404, 'nor in the file');
  await palpa.page.getByRole('button', { name: 'Give up' }).click();
  await palpa.viewer.running('the game is over', ({ game }) => game == null);

  await start(palpa, { level: 'hard', seed: 21 });
  assert.equal(await box.count(), 0, 'no map');
  assert.match(await palpa.by('game-sides').innerText(), /either side/);
  await settle();
  assert.equal(await box.count(), 0, 'no map after a press');
  await palpa.by('game-reveal').click();
  const { result } = await revealed(palpa);
  assert.equal(result.lumps[0].error ?? null, null);
  assert.match(await palpa.by('game-verdict').innerText(), /you set no mark/);
  await paint();
  assert.equal(await palpa.by('map-surroundings').count(), 1, 'the whole map');

  // Another scene ends a game whose lumps are revealed.
  const { game } = await palpa.choose('block');
  assert.equal(game ?? null, null);
  await palpa.choose('forearm');
});

test('the body is turned over, and a mark there says that the lump is on the other side', async () => {
  const palpa = await sharedPage();
  await home(palpa);
  // With this seed, the lump lies on the far side.
  await start(palpa, { level: 'hard', seed: 3 });
  /** Height of the mark over the press point, along the normal there. */
  const height = async () => {
    const { home: at, game } = await palpa.viewer.state();
    const mark = game?.marks[0];
    assert.ok(mark);
    return at.normal.reduce((sum, n, c) => sum + n * (mark[c] - at.point[c]), 0);
  };
  await palpa.by('game-turn').click();
  await markAt(palpa);
  const far = await height();
  assert.ok(far < -0.02, `the mark is on the far side: ${far} m`);
  await palpa.by('game-unmark').click();
  await palpa.viewer.running('the mark is taken back', ({ game }) => game?.marks.length === 0);
  await palpa.by('game-turn').click();
  await markAt(palpa);
  const near = await height();
  assert.ok(near > far + 0.02, `turned back, it is on the side of the press point: ${near} m`);
  await palpa.by('game-reveal').click();
  const { result } = await revealed(palpa);
  const { is_other_side, error, over, path } = result.lumps[0];
  assert.ok(is_other_side, 'on the other side');
  assert.ok(error != null && error > 1.1 * distance(path[0], over), 'round the body, not through it');
  assert.match(await palpa.by('game-verdict').innerText(), /on the other side of the body/);
  await home(palpa);
  await end(palpa);
});

test('a series of three rounds by mouse and keyboard, with its table', async () => {
  const palpa = await sharedPage();
  const { page } = palpa;
  const enter = async (/** @type {string} */ id) => {
    await palpa.by(id).focus();
    await page.keyboard.press('Enter');
  };
  await endLeft(palpa);
  await home(palpa);
  await palpa.have('forearm');
  await palpa.tab('game');
  await palpa.by('game-level-drawn').focus();
  await page.keyboard.press('Space');
  await palpa.by('game-rounds-3').click();
  await palpa.by('game-lumps-1').click();
  await palpa.by('game-seed').fill('11');
  await enter('game-start');
  /** @type {string[]} */
  const levels = [];
  for (let round = 1; round <= 3; round++) {
    const { game } = await isHidden(palpa);
    assert.ok(game && game.series.n_rounds === 3 && game.series.rounds.length === round - 1);
    levels.push(game.level);
    assert.match(await palpa.by('game-round').innerText(), new RegExp(`Round ${round} of 3`));
    assert.equal(await palpa.by('map-box').count(), game.level === 'hard' ? 0 : 1);
    if (round === 2) {
      // By the keyboard alone.
      await palpa.focus();
      await page.keyboard.press('Space');
      await palpa.reads('a force', ({ newtons }) => newtons > 0.1);
      await page.keyboard.press('Escape');
      await palpa.atRest();
      await enter('game-mark-mode');
      await palpa.focus();
      await page.keyboard.press('Enter');
      await palpa.viewer.running('the mark is kept', (state) => state.game?.marks.length === 1);
      await enter('game-reveal');
    } else {
      await pressOnce(palpa);
      await markAt(palpa, 0.5, 0.5);
      await palpa.by('game-reveal').click();
    }
    await revealed(palpa);
    await home(palpa);
    assert.equal(await palpa.by('game-summary').count(), round === 3 ? 1 : 0);
    if (round < 3) await (round === 1 ? palpa.by('game-next').click() : enter('game-next'));
  }
  assert.ok(new Set(levels).size > 1, `levels are drawn: ${levels.join()}`);
  const { game } = await palpa.viewer.state();
  assert.ok(game);
  const { rounds } = game.series;
  assert.deepEqual(rounds.map(({ level }) => level), levels);
  const rows = palpa.by('game-summary').locator('tbody tr');
  assert.equal(await rows.count(), 3);
  await saveShot(palpa, 'game-series');

  const [download] = await Promise.all([page.waitForEvent('download'), palpa.by('game-csv').click()]);
  assert.equal(download.suggestedFilename(), 'find-the-lump.csv');
  const lines = (await readFile(await download.path(), 'utf8')).trim().split('\n').map((line) => line.split(','));
  const head = lines[0];
  assert.equal(lines.length, 4, 'a row for each round');
  for (const [k, cells] of lines.slice(1).entries()) {
    assert.equal(cells.length, head.length);
    const cell = (/** @type {string} */ name) => cells[head.indexOf(name)];
    const { seed, level, seconds, marks, result } = rounds[k];
    const [{ lump, error, is_found, radius, depth }] = result.lumps;
    assert.deepEqual([cell('scene'), cell('series_seed'), cell('round'), cell('seed'), cell('level')], ['forearm', '11', String(k + 1), String(seed), level]);
    assert.equal(cell('verdict'), is_found ? 'found' : 'missed');
    assert.equal(cell('presses'), String(result.n_presses));
    assert.equal(cell('score'), String(result.score.total));
    assert.ok(error != null);
    const near = (/** @type {string} */ name, /** @type {number} */ value, tolerance = 0.006) =>
      assert.ok(cell(name) !== '' && Math.abs(Number(cell(name)) - value) < tolerance, `${name}: ${cell(name)}, not ${value}`);
    near('error_mm', 1e3 * error);
    near('lump_radius_mm', 1e3 * radius);
    near('lump_depth_mm', 1e3 * depth);
    near('lump_young_kpa', 1e-3 * lump.stiffness);
    for (const [c, axis] of ['x', 'y', 'z'].entries()) {
      near(`lump_${axis}_mm`, 1e3 * lump.centre[c]);
      near(`mark_${axis}_mm`, 1e3 * marks[0][c]);
    }
    near('time_s', seconds, 0.06);
    near('max_force_n', result.max_force, 6e-4);
    near('area_share', result.covered, 6e-4);
  }
  await end(palpa);
  assert.equal(await palpa.by('game-csv').count(), 1, 'the table outlives the game');
  assert.deepEqual(palpa.complaints.filter((words) => !words.includes('404')), []);
});
