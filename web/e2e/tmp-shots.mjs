import { launch } from './browser.mjs';
import { drop, ellipsoid, obj } from './meshes.mjs';
import { PalpaPage } from './page.mjs';
import { Viewer, until } from './viewer.mjs';
const OUT = '/tmp/h/own-shots';
const viewer = await Viewer.start({ scene: 'forearm' });
const browser = await launch();
try {
  const palpa = await PalpaPage.open(browser, viewer, { colorScheme: 'dark', locale: 'ja' });
  await palpa.drawn();
  const limb = ellipsoid([110, 38, 34]);
  const { points, triangles } = limb;
  await drop(palpa, { 'damaged.obj': obj({ points, triangles: [...triangles.slice(0, 400), triangles[0], ...triangles.slice(402)] }) });
  await palpa.by('own-figures').waitFor();
  await until('drawn', async () => (await palpa.by('own-picture').getAttribute('data-drawn')) !== null);
  await palpa.by('finding-hole').getByRole('button').click();
  await palpa.page.waitForTimeout(800);
  await palpa.page.screenshot({ path: `${OUT}/ja-dialog.png` });
  await palpa.by('own-close').click();
  await palpa.tab('tissues');
  await palpa.type('layer-0-young', '100 kPa', ({ layers }) => Math.abs(layers[0].stiffness - 1e5) < 100);
  await palpa.tab('scene');
  await palpa.page.waitForTimeout(800);
  await palpa.page.screenshot({ path: `${OUT}/ja-scene.png` });
  await palpa.tab('view');
  await palpa.by('view-save').scrollIntoViewIfNeeded();
  await palpa.by('view-save').click();
  await palpa.by('view-save').scrollIntoViewIfNeeded();
  await palpa.page.screenshot({ path: `${OUT}/ja-view.png` });
  await palpa.by('help-open').click();
  await palpa.page.waitForTimeout(300);
  await palpa.page.screenshot({ path: `${OUT}/ja-help.png` });
} finally {
  await browser.close();
  await viewer.stop();
}
