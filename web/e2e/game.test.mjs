// The game: a lump is hidden, felt for, marked and shown.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { sharedPage } from './session.mjs';
import { saveShot } from './shots.mjs';

test('a round of finding a lump', async () => {
  const palpa = await sharedPage();
  await palpa.have('forearm');
  await palpa.tab('game');
  await palpa.by('game-seed').fill('7');
  await palpa.by('game-start').click();
  const hidden = await palpa.viewer.running('a lump is hidden', ({ game }) => game != null);
  await palpa.running();
  assert.equal(hidden.game?.seed, 7);
  assert.deepEqual(hidden.lumps, [], 'no place is told');
  assert.ok(!/"lump"/.test(JSON.stringify(hidden.scene)), 'nor in the scene');
  assert.equal(hidden.game?.result ?? null, null);
  const toml = await (await palpa.viewer.get('api/scene.toml')).text();
  assert.ok(!/^\[\[lump\]\]/m.test(toml), 'nor in the file');
  await palpa.tab('view');
  assert.ok(await palpa.by('cutaway-toggle').isDisabled(), 'nor by the cutaway');

  await palpa.press(0.46);
  await palpa.reads('a force', ({ newtons }) => newtons > 0.1);
  await palpa.release();
  await palpa.atRest();

  await palpa.by('game-mark-mode').click();
  await palpa.page.mouse.click(...(await palpa.at(0.5, 0.5)));
  await palpa.viewer.running('the mark is kept', ({ game }) => game?.marks.length === 1);
  await palpa.by('game-reveal').click();
  const { game } = await palpa.viewer.running('the truth is told', (state) => state.game?.result != null);
  const result = game?.result;
  assert.ok(result);
  assert.equal(result.lumps.length, 1);
  const { error, over } = result.lumps[0];
  const mark = game?.marks[0];
  assert.ok(error != null && mark);
  assert.ok(Math.abs(error - Math.hypot(...[0, 1, 2].map((c) => over[c] - mark[c]))) < 1e-9, 'the error is the distance of the mark from the point over the lump');
  assert.ok(result.covered > 0 && result.covered < 1 && result.coverage.length > 0 && result.max_force > 0.1);

  await palpa.tab('game');
  const panel = palpa.by('game-result');
  await panel.waitFor();
  assert.match(await panel.innerText(), new RegExp(`${(error * 1e3).toFixed(1)} mm`));
  assert.equal(await palpa.by('game-covered').innerText(), `${Math.round(result.covered * 100)} %`);
  await saveShot(palpa, 'game-result');

  // The same seed hides it at the same place.
  await palpa.by('game-same-seed').click();
  await palpa.viewer.running('a round again', (state) => state.game != null && state.game.result == null);
  await palpa.by('game-reveal').click();
  const again = await palpa.viewer.running('the truth again', (state) => state.game?.result != null);
  assert.deepEqual(again.game?.result?.lumps[0].lump, result.lumps[0].lump);
  await palpa.by('game-end').click();
  const after = await palpa.viewer.running('the game is over', (state) => state.game == null);
  assert.deepEqual(after.lumps, [], 'and the scene is what it was');
});
