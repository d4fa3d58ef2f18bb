// Real and awkward meshes, dropped on the page: `make test-data`. The folder is that of PALPA_SHARED; it is not part of this repository.

import assert from 'node:assert/strict';
import { existsSync, readdirSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { launch } from './browser.mjs';
import { dropPaths } from './meshes.mjs';
import { PalpaPage } from './page.mjs';
import { saveShot } from './shots.mjs';
import { Viewer, until } from './viewer.mjs';

const SHARED = process.env.PALPA_SHARED ?? '';
const DATA = join(SHARED, 'data');
if (SHARED === '' || !existsSync(DATA)) throw new Error('PALPA_SHARED names no folder with data/: run `make test-data SHARED=FOLDER`');

/** @type {Viewer} */
let viewer;
/** @type {import('playwright-core').Browser} */
let browser;
/** @type {PalpaPage} */
let palpa;

before(async () => {
  viewer = await Viewer.start({ scene: 'block' });
  browser = await launch();
  palpa = await PalpaPage.open(browser, viewer);
  await palpa.drawn();
  await palpa.running();
});
after(async () => {
  await browser?.close();
  await viewer?.stop();
});

/** Drops files of the data, and waits until the page has a surface with its check, or a refusal. @param {string[]} names */
async function dropped(names) {
  await dropPaths(palpa, names.map((name) => join(DATA, name)));
  return until(`${names[0]} is checked or refused`, async () => {
    if ((await palpa.by('own-busy').count()) > 0) return false;
    const problem = palpa.by('own-problem');
    if ((await problem.count()) > 0) return { problem: await problem.innerText(), verdict: null, unit: null, findings: '', marks: 0 };
    const figures = palpa.by('own-figures');
    if ((await figures.count()) === 0) return false;
    return {
      problem: null,
      verdict: await figures.getAttribute('data-verdict'),
      unit: await figures.getAttribute('data-unit'),
      findings: await palpa.by('own-findings').innerText(),
      marks: Number(await palpa.by('own-picture').getAttribute('data-marks')),
    };
  });
}

async function closed() {
  await palpa.by('own-close').click();
  await palpa.by('own').waitFor({ state: 'detached' });
}

/** Grows what was dropped. @returns {Promise<string | null>} why it was refused */
async function grown() {
  const { origin } = await viewer.state();
  await palpa.by('own-grow').click();
  return until('it has grown or is refused', async () => {
    if ((await palpa.by('own-problem').count()) > 0) return palpa.by('own-problem').innerText();
    const now = await viewer.state();
    return now.phase === 'running' && now.origin !== origin && (await palpa.by('own').count()) === 0 && 'grown';
  }, 400_000).then((text) => (text === 'grown' ? null : text));
}

test('every awkward mesh gets findings with places, or a refusal in words', async (t) => {
  const names = readdirSync(join(DATA, 'awkward')).filter((name) => !name.endsWith('.md'));
  assert.ok(names.length > 25, `${names.length} files`);
  let nRefused = 0;
  let nBad = 0;
  for (const name of names) {
    const { problem, verdict, findings, marks } = await dropped([`awkward/${name}`]);
    t.diagnostic(`${name}: ${problem ?? `${verdict}, ${marks} places`}`);
    if (problem !== null) {
      nRefused += 1;
      assert.ok(problem.includes(name.replaceAll(/[^\w.-]/g, '_')), problem);
    } else if (verdict !== 'good') {
      nBad += 1;
      // A surface of infinite points only has no place to show.
      assert.ok(marks > 0 || /no numbers/.test(findings), `${name}: ${findings}`);
    }
    await closed();
  }
  assert.ok(nRefused >= 2 && nBad >= 10, `${nRefused} refused, ${nBad} with defects`);
  assert.equal((await viewer.state()).phase, 'running');
});

/** Bodies, the unit that must be guessed, and whether they must grow. @type {[string, string[], string, boolean][]} */
const BODIES = [
  ['forearm with bones', ['forearm/forearm_skin_2k.stl', 'forearm/ulna.ply', 'forearm/radius.ply'], 'm', true],
  ['forearm in millimetres', ['awkward/derived_forearm_ascii_mm.stl'], 'mm', true],
  ['calf of 10,000 vertices', ['calf_mri/calf_skin_10k.stl', 'calf_mri/tibia.ply', 'calf_mri/fibula.ply'], 'm', true],
  ['fingertip', ['parts/fingertip_index_1k5.obj'], 'm', true],
  ['abdomen', ['parts/abdomen_3k.obj'], 'm', true],
  ['hand', ['parts/hand_4k.obj'], 'm', false],
  ['face', ['parts/face_open.obj'], 'm', false],
  ['forearm that passes through itself', ['awkward/derived_forearm_self_intersecting.obj'], 'm', false],
];
for (const [name, files, unit, mustGrow] of BODIES) {
  test(`the ${name} is dropped, grown and touched${mustGrow ? '' : ', or refused with a reason'}`, async (t) => {
    const { problem, unit: guessed } = await dropped(files);
    assert.equal(problem, null);
    assert.equal(guessed, unit);
    await until('the surface is drawn', async () => (await palpa.by('own-picture').getAttribute('data-drawn')) !== null);
    await saveShot(palpa, `data-${name.replaceAll(' ', '-')}`);
    const refusal = await grown();
    if (refusal !== null) {
      t.diagnostic(refusal);
      assert.ok(!mustGrow, refusal);
      assert.doesNotMatch(refusal, /bug in Palpa|\/tmp\//);
      await closed();
      return;
    }
    await palpa.running();
    await palpa.focus();
    await palpa.page.keyboard.press('Space');
    const { newtons } = await palpa.reads('a force', (readout) => readout.newtons > 0.005);
    t.diagnostic(`${(await viewer.state()).n_nodes} nodes, ${newtons.toFixed(3)} N`);
    await palpa.page.keyboard.press('Escape');
    await palpa.atRest();
  });
}
