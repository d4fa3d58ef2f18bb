// Failures of connection, engine, browser and messages: the page shows them and keeps working.

import assert from 'node:assert/strict';
import { after, afterEach, test } from 'node:test';
import WebSocket from 'ws';
import { NO_GL, launch } from './browser.mjs';
import { PalpaPage } from './page.mjs';
import { endShared, sharedBrowser } from './session.mjs';
import { Viewer, until } from './viewer.mjs';

/**
 * The viewer of this file, which is stopped, killed and made to fail. The block builds fastest.
 * @type {Viewer | undefined}
 */
let viewer;
/** Pages that a test opened. @type {PalpaPage[]} */
let pages = [];

afterEach(async () => {
  for (const palpa of pages) await palpa.close();
  pages = [];
});
after(() => viewer?.stop());

async function ownViewer() {
  await endShared();
  viewer ??= await Viewer.start({ scene: 'block' });
  return viewer;
}

async function openPage() {
  const palpa = await PalpaPage.open(await sharedBrowser(), await ownViewer());
  pages.push(palpa);
  await palpa.drawn();
  await palpa.running();
  return palpa;
}

/** @param {PalpaPage} palpa */
async function pressByKeys(palpa) {
  await palpa.focus();
  await palpa.page.keyboard.press('Space');
  const pressed = await palpa.reads('a force', ({ newtons }) => newtons > 0.01);
  await palpa.page.keyboard.press('Escape');
  await palpa.reads('no force', ({ newtons }) => newtons === 0);
  return pressed;
}

test('a lost connection is shown, and comes back', async () => {
  const palpa = await openPage();
  const { port } = palpa.viewer;
  await palpa.tab('tissues');
  await palpa.type('layer-0-young', '321 kPa', ({ layers }) => Math.abs(layers[0].stiffness - 321e3) < 1e3);
  await palpa.by('theme').selectOption('dark');

  await palpa.viewer.kill();
  await palpa.by('connection-lost').waitFor();
  assert.equal(await palpa.page.getByRole('alert').filter({ has: palpa.by('connection-lost') }).count(), 1, 'it is spoken');
  assert.equal(await palpa.by('layer-0-young').inputValue(), '321 kPa', 'what was known is still shown');
  assert.ok(await palpa.by('layer-0-young').isDisabled());

  viewer = await Viewer.start({ port, scene: 'block' });
  palpa.viewer = viewer;
  await palpa.by('connection-lost').waitFor({ state: 'detached' });
  await palpa.running();
  await until('the state is that of the new engine', async () => (await palpa.by('layer-0-young').inputValue()) !== '321 kPa');
  assert.equal(await palpa.page.locator('html').getAttribute('data-theme'), 'dark', 'settings are kept');
  await pressByKeys(palpa);
});

test('a page with a wrong token says so', async () => {
  await endShared();
  const token = 'a-long-word-of-the-test';
  const guarded = await Viewer.start({ scene: 'block', token });
  try {
    const palpa = await PalpaPage.open(await sharedBrowser(), guarded);
    pages.push(palpa);
    await palpa.drawn();
    await palpa.page.goto(guarded.url.replace(token, 'another'));
    await palpa.by('connection-lost').filter({ hasText: 'token' }).waitFor();
  } finally {
    await guarded.stop();
  }
});

test('a page shows that the system has stopped the engine, and recovers', async () => {
  const palpa = await openPage();
  palpa.viewer.child.kill('SIGSTOP');
  try {
    await palpa.by('connection-lost').waitFor();
  } finally {
    palpa.viewer.child.kill('SIGCONT');
  }
  await palpa.by('connection-lost').waitFor({ state: 'detached' });
  await palpa.running();
  await pressByKeys(palpa);
});

test('of two pages one is in control, and a click hands it over', async () => {
  const first = await openPage();
  const second = await openPage();
  const who = (/** @type {PalpaPage} */ palpa) => palpa.by('controller-status').getAttribute('data-controls');
  assert.equal(await who(first), 'you');
  assert.equal(await who(second), 'other');
  await second.tab('tissues');
  assert.ok(await second.by('layer-0-young').isDisabled(), 'who watches changes nothing');
  assert.ok(await second.by('scene-picker').isDisabled());

  // A watching page cannot press.
  await second.press();
  await first.feelsNothing(500);
  await second.release();
  await first.page.bringToFront();
  await first.focus();
  await first.page.keyboard.press('Space');
  await second.reads('the force of the other', ({ newtons }) => newtons > 0.01);
  await first.page.keyboard.press('Escape');

  await second.page.bringToFront();
  await until('the second controls', async () => {
    if ((await who(second)) === 'you') return true;
    await second.by('take-control').click();
    // A starved page may lose its connection, and the request with it. The page says so, and one clicks again.
    return until('the click counts', async () => (await who(second)) === 'you', 20_000).catch(() => false);
  });
  await until('the first watches', async () => (await who(first)) === 'other');
  await pressByKeys(second);
});

test('a fault of the engine is shown, and the engine recovers', async () => {
  const palpa = await openPage();
  const { allows_faults } = await palpa.viewer.state();
  assert.ok(allows_faults);
  await palpa.tab('engine');
  await palpa.by('inject-tissue_panic').click();
  const said = palpa.by('toast').or(palpa.by('problem')).first();
  await said.waitFor();
  assert.ok((await said.innerText()).length > 20, await said.innerText());
  assert.equal(palpa.viewer.child.exitCode, null, 'the program runs');
  if ((await palpa.viewer.state()).phase === 'stopped') await palpa.by('restart').click();
  await palpa.viewer.running('it is well', () => true);
  await palpa.running();
  await pressByKeys(palpa);

  for (const fault of ['spoilt_patch', 'tissue_pause']) {
    await palpa.by(`inject-${fault}`).click();
    await palpa.viewer.running('it is well', () => true);
  }
  await pressByKeys(palpa);
});

test('malformed, huge or too many messages disturb nobody', async () => {
  const palpa = await openPage();
  const { url } = palpa.viewer;
  const socket = () => new WebSocket(new URL('ws', url.replace('http', 'ws')), { origin: new URL(url).origin });
  /** @param {(socket: WebSocket) => void} talk */
  const say = (talk) =>
    new Promise((resolve) => {
      const one = socket();
      one.on('open', () => {
        talk(one);
        // Messages are read in order: after the pong, or an end of the connection, the engine
        // has had all of them.
        one.ping();
      });
      one.on('pong', () => one.terminate());
      one.on('error', () => one.terminate());
      one.on('close', resolve);
    });
  await say((one) => ['{', 'null', '[]', '{"type":"hand"}', '{"type":"seek","time":"x"}', '\u0000', '{"type":"edit","edits":[{"path":"/../x"}]}'].forEach((text) => one.send(text)));
  await say((one) => one.send(Buffer.alloc(1000, 7)));
  await say((one) => one.send('['.repeat(100_000)));
  await say((one) => one.send('x'.repeat(3_000_000)));
  await say((one) => {
    for (let k = 0; k < 2000; k++) one.send(JSON.stringify({ type: 'hand', point: [0, 0, 0], normal: [0, 0, 1], depth: 0.01 }));
  });
  const { status, reply } = await palpa.viewer.control('{"type":"no such"}');
  assert.equal(status, 400);
  assert.ok(reply.error.length > 10);
  const strange = await fetch(url, { headers: { origin: 'http://evil.example' } });
  assert.equal(strange.status, 403);

  await palpa.running();
  assert.equal(await palpa.by('controller-status').getAttribute('data-controls'), 'you');
  assert.equal(await palpa.by('connection-lost').count(), 0);
  await pressByKeys(palpa);
});

test('a browser without WebGL 2 gets advice, and the rest works', async () => {
  const browser = await launch(NO_GL);
  try {
    const palpa = await PalpaPage.open(browser, await ownViewer());
    const message = palpa.by('no-webgl');
    await message.waitFor();
    assert.match(await message.innerText(), /WebGL 2/);
    assert.match(await message.innerText(), /hardware acceleration/);
    await palpa.running();
    // Force and panels are there nevertheless.
    await palpa.tab('motion');
    await palpa.by('motion-run').click();
    await palpa.reads('a force', ({ newtons }) => newtons > 0.01);
  } finally {
    await browser.close();
  }
});
