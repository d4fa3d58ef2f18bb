// Undo and redo, saved views, links, and the words of the scene's state: by mouse and keyboard, on the block.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { sharedPage } from './session.mjs';
import { sceneOf, until } from './viewer.mjs';

/** @param {number} kilopascals */
const isYoung = (kilopascals) => (/** @type {import('../src/generated/api').State} */ { layers }) => Math.abs(layers[0].stiffness - 1e3 * kilopascals) < 100;

test('changes of the scene are undone and redone by keys and buttons, also across scenes', async () => {
  const palpa = await sharedPage();
  await palpa.choose('block');
  const { layers } = await palpa.viewer.state();
  const first = layers[0].stiffness / 1e3;
  await palpa.tab('scene');
  assert.equal(await palpa.by('scene-changed').getAttribute('data-changed'), 'false');
  await palpa.tab('tissues');
  await palpa.type('layer-0-young', '30 kPa', isYoung(30));
  await palpa.type('layer-1-young', '444 kPa', ({ layers }) => Math.abs(layers[1].stiffness - 444e3) < 500);
  await palpa.choose('limb');

  // From the body, from a field that was committed, and by the buttons.
  await palpa.focus();
  await palpa.page.keyboard.press('Control+z');
  await palpa.viewer.running('the block is back', ({ gallery_key, is_changed }) => gallery_key === 'block' && is_changed);
  await palpa.running();
  await palpa.tab('tissues');
  await palpa.by('layer-1-young').focus();
  await palpa.page.keyboard.press('Control+z');
  await palpa.viewer.running('layer 2 is as before', (state) => isYoung(30)(state) && Math.abs(state.layers[1].stiffness - 444e3) > 500);
  await palpa.running();
  await palpa.by('undo').click();
  await palpa.viewer.running('layer 1 is as before', (state) => isYoung(first)(state) && !state.is_changed);
  await palpa.running();
  await palpa.focus();
  await palpa.page.keyboard.press('Control+Shift+Z');
  await palpa.viewer.running('redone', isYoung(30));
  await palpa.running();
  await palpa.by('redo').click();
  await palpa.viewer.running('redone twice', ({ layers }) => Math.abs(layers[1].stiffness - 444e3) < 500);
  await palpa.running();

  // Text that is being typed has its own undo.
  const field = palpa.by('layer-0-young');
  await field.focus();
  await palpa.page.keyboard.press('End');
  await palpa.page.keyboard.type('7');
  await palpa.page.keyboard.press('Control+z');
  await palpa.page.keyboard.press('Escape');
  assert.ok(isYoung(30)(await palpa.viewer.state()));

  // The scene says that it was changed, and can be reset, which can be undone.
  await palpa.tab('scene');
  await palpa.page.locator('[data-testid=scene-changed][data-changed=true]').waitFor();
  await palpa.by('scene-reset').click();
  await palpa.viewer.running('it is as it was loaded', (state) => !state.is_changed && isYoung(first)(state));
  await palpa.page.locator('[data-testid=scene-changed][data-changed=false]').waitFor();
  assert.ok(await palpa.by('scene-reset').isDisabled());
  await palpa.focus();
  await palpa.page.keyboard.press('Control+z');
  await palpa.viewer.running('the change is back', isYoung(30));
  await palpa.choose('block');
});

test('nothing is undone during a recording or a game, and the page says why', async () => {
  const palpa = await sharedPage();
  await palpa.choose('block');
  await palpa.tab('tissues');
  await palpa.type('layer-0-young', '30 kPa', isYoung(30));
  await palpa.tab('record');
  await palpa.by('record-start').click();
  await palpa.viewer.running('it is recorded', ({ recording }) => recording.is_recording);
  await palpa.running();
  await until('the button knows', () => palpa.by('undo').isDisabled());
  await palpa.focus();
  await palpa.page.keyboard.press('Control+z');
  await palpa.by('toast').filter({ hasText: 'Stop the recording first' }).waitFor();
  assert.ok(isYoung(30)(await palpa.viewer.state()));
  // The engine refuses it as well.
  await palpa.by('record-stop').click();
  await palpa.viewer.running('the recording is over', ({ recording }) => !recording.is_recording);

  await palpa.tab('game');
  await palpa.by('game-start').click();
  await palpa.viewer.running('a lump is hidden', ({ game }) => game != null);
  await palpa.running();
  await palpa.focus();
  await palpa.page.keyboard.press('Control+z');
  await palpa.by('toast').filter({ hasText: 'End the game first' }).waitFor();
  await palpa.page.getByRole('button', { name: 'Give up' }).click();
  await palpa.viewer.running('the game is over', ({ game }) => game == null);
  await palpa.choose('block');
});

test('views are saved under a name, applied, kept by the browser and removed', async () => {
  const palpa = await sharedPage();
  await palpa.have('block');
  await palpa.tab('view');
  await palpa.by('cutaway-toggle').check();
  await palpa.by('cutaway-position').fill('0.7');
  await palpa.by('view-top').click();
  await palpa.by('view-name').fill('From above');
  await palpa.page.keyboard.press('Enter');
  await palpa.by('saved-view-From above').waitFor();
  await palpa.by('cutaway-toggle').uncheck();
  await palpa.by('view-front').click();

  await palpa.page.reload();
  await palpa.drawn();
  await palpa.running();
  await palpa.tab('view');
  assert.ok(!(await palpa.by('cutaway-toggle').isChecked()));
  await palpa.by('saved-view-From above').click();
  await until('the body is cut', () => palpa.by('cutaway-toggle').isChecked());
  assert.equal(await palpa.by('cutaway-position').inputValue(), '0.7');
  await palpa.by('saved-views').getByRole('button', { name: 'Remove From above' }).click();
  await palpa.by('saved-view-From above').waitFor({ state: 'detached' });
  await palpa.by('cutaway-toggle').uncheck();
  await palpa.by('view-home').click();
});

test('a link carries the changed scene, the seed and the view, and opens them', async () => {
  const palpa = await sharedPage();
  await palpa.choose('block');
  await palpa.tab('tissues');
  await palpa.type('layer-0-young', '37 kPa', isYoung(37));
  await palpa.tab('game');
  await palpa.by('game-seed').fill('4242');
  await palpa.tab('view');
  await palpa.by('cutaway-toggle').check();
  await palpa.page.context().grantPermissions(['clipboard-read', 'clipboard-write']);
  await palpa.tab('scene');
  await palpa.by('share').click();
  await palpa.by('toast').filter({ hasText: 'The link is copied' }).waitFor();
  const link = await palpa.page.evaluate(() => navigator.clipboard.readText());
  assert.ok(link.startsWith(palpa.viewer.url) && link.includes('#palpa=') && link.length < 8000, `${link.length} characters`);

  await palpa.tab('view');
  await palpa.by('cutaway-toggle').uncheck();
  await palpa.choose('limb');
  // Another page, opened by the link, as from a mail.
  await palpa.page.goto('about:blank');
  await palpa.page.goto(link);
  await palpa.drawn();
  const state = await palpa.viewer.running('the scene of the link', (now) => now.gallery_key === 'block' && isYoung(37)(now));
  assert.ok(state.is_changed);
  await palpa.by('toast').filter({ hasText: 'The scene of the link is open' }).waitFor();
  assert.equal(await palpa.by('toast').filter({ hasText: 'damaged' }).count(), 0);
  assert.equal(await palpa.by('game-seed').inputValue(), '4242');
  await palpa.tab('view');
  assert.ok(await palpa.by('cutaway-toggle').isChecked());
  assert.equal(new URL(palpa.page.url()).hash, '', 'a reload does not open it again');

  // Into a page that is open, and damaged.
  await palpa.by('cutaway-toggle').uncheck();
  await palpa.page.evaluate(() => (location.hash = 'palpa=AAAA'));
  await palpa.by('toast').filter({ hasText: 'damaged' }).waitFor();
  await palpa.tab('game');
  await palpa.by('game-seed').fill('');
  await palpa.choose('block');
});

test('errors name layers as the panel does, and places are in millimetres', async () => {
  const palpa = await sharedPage();
  await palpa.choose('forearm');
  await palpa.tab('tissues');
  await palpa.by('layer-2-young').fill('12 apples');
  await palpa.by('layer-2-young').press('Enter');
  const error = palpa.page.locator('.field-error').first();
  await error.waitFor();
  assert.match(await error.innerText(), /3\. Muscle, Young’s modulus/);
  assert.doesNotMatch(await error.innerText(), /layer\[/);
  await palpa.by('layer-2-young').press('Escape');

  await palpa.tab('motion');
  await palpa.by('motion-place').click();
  const before = JSON.stringify(sceneOf(await palpa.viewer.state()).press?.at);
  await palpa.page.mouse.click(...(await palpa.at(0.45, 0.5)));
  await palpa.viewer.running('the place is another', (state) => JSON.stringify(sceneOf(state).press?.at) !== before);
  await palpa.running();
  const fields = await palpa.page.getByRole('group', { name: 'Point on the skin' }).getByRole('textbox').all();
  assert.equal(fields.length, 3);
  for (const field of fields) await until('it is in millimetres', async () => /^-?\d+(\.\d{1,2})? mm$/.test(await field.inputValue()));
  await palpa.choose('block');
});
