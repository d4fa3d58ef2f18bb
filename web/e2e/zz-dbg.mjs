import { sharedPage } from './session.mjs';
import { test } from 'node:test';
test('x', async () => {
  const p = await sharedPage();
  await p.have('forearm');
  await p.tab('game');
  await p.by('game-level-easy').click();
  await p.by('game-seed').fill('7');
  await p.by('game-start').click();
  await p.viewer.running('hidden', (s) => s.game != null && s.game.result == null);
  await p.running();
  await p.by('game-mark-mode').click();
  await p.page.mouse.click(...(await p.at(0.8, 0.42)));
  await p.viewer.running('m', (s) => s.game.marks.length === 1);
  await p.by('game-reveal').click();
  await p.by('game-verdict').waitFor();
  await p.by('game-same-seed').click();
  await p.viewer.running('hidden', (s) => s.game != null && s.game.result == null);
  await p.running();
  await p.press(0.5, 0.5);
  for (let i = 0; i < 12; i++) { await new Promise((r) => setTimeout(r, 1000)); console.log(JSON.stringify(await p.readout())); }
  await p.page.screenshot({ path: '/tmp/n/dbg.png' });
  await p.release();
  const f = await p.viewer.engine(); console.log(JSON.stringify(f).slice(0, 1500));
});
