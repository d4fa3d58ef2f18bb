// The surroundings of the body: light, and a soft shadow on the ground. The background is
// CSS behind a transparent canvas: painting it with software WebGL would take a third of the
// time of a picture.

import {
  CanvasTexture, Color, DirectionalLight, Mesh, MeshBasicMaterial, PlaneGeometry, Scene, Vector3,
} from 'three';
import type { Body } from './body';
import type { CutPlane } from './contour';
import { THEMES, type Theme } from './palette';

/** Direction to the key light: over the left shoulder, seen from home. */
const LIGHT = new Vector3(-0.5, -0.55, 1.0).normalize();
const BLOB = 128;
/** Side of the ground, in radii of the body. */
const SPREAD = 2.9;

export class Stage {
  readonly scene = new Scene();
  readonly light = { value: LIGHT };
  readonly key = new DirectionalLight(0xffffff, 1);
  private readonly ground: Mesh<PlaneGeometry, MeshBasicMaterial>;
  private readonly blob = document.createElement('canvas');
  private drawnFor = '';

  constructor() {
    this.key.castShadow = true;
    this.key.shadow.mapSize.set(1024, 1024);
    this.key.shadow.radius = 3.5;
    this.scene.add(this.key, this.key.target);
    this.blob.width = this.blob.height = BLOB;
    this.ground = new Mesh(
      new PlaneGeometry(1, 1),
      new MeshBasicMaterial({ map: new CanvasTexture(this.blob), transparent: true, depthWrite: false, toneMapped: false }),
    );
    this.ground.renderOrder = -10;
    this.ground.visible = false;
    this.scene.add(this.ground);
  }

  theme(name: 'light' | 'dark'): Theme {
    const theme = THEMES[name];
    this.ground.material.color = new Color(theme.shadow);
    this.ground.material.opacity = theme.shadowOpacity;
    return theme;
  }

  /** Sets light and shadow for a body. */
  setBody(body: Body): void {
    const { centre, radius, box } = body;
    this.key.position.copy(LIGHT).multiplyScalar(4 * radius).add(centre);
    this.key.target.position.copy(centre);
    const camera = this.key.shadow.camera;
    const r = 1.15 * radius;
    camera.left = camera.bottom = -r;
    camera.right = camera.top = r;
    camera.near = 2 * radius;
    camera.far = 6 * radius;
    camera.updateProjectionMatrix();
    this.key.shadow.bias = -0.0006;
    this.key.shadow.normalBias = 0.004 * radius;

    const side = SPREAD * radius;
    this.ground.scale.set(side, side, 1);
    this.ground.position.set(centre.x, centre.y, box.min.z - 0.03 * radius);
  }

  /** Paints the shadow on the ground of what a cut leaves of a body at rest; a press does not change it visibly. */
  paintGround(body: Body, cut: CutPlane | null): void {
    const { centre, radius, box } = body;
    // Meshes of one body, and neighbouring cuts, differ by less than the shadow's softness.
    const shape = [...box.min.toArray(), ...box.max.toArray()].map((x) => Math.round(x * 250));
    const plane = cut === null ? [] : [...cut.normal.map((x) => Math.round(x * 50)), Math.round(cut.offset * 1000)];
    const key = [...shape, ...plane].join();
    if (key === this.drawnFor) return;
    this.drawnFor = key;
    const side = SPREAD * radius;
    const g = this.blob.getContext('2d')!;
    g.clearRect(0, 0, BLOB, BLOB);
    const shadow = document.createElement('canvas');
    shadow.width = shadow.height = BLOB;
    const s = shadow.getContext('2d')!;
    s.fillStyle = '#fff';
    // With both sides in one path the windings would cancel. What a cut leaves may have only one of them.
    for (const facing of cut === null ? [-1] : [-1, 1]) {
      s.beginPath();
      for (let t = 0; t < body.triangles.length; t += 3) {
        const at = [0, 1, 2].map((k) => 3 * body.triangles[t + k] * body.nLevels);
        const corners = cut === null ? at.map((i) => [body.rest[i], body.rest[i + 1]]) : keptCorners(body.rest, at, cut);
        if (corners.length < 3) continue;
        const x = corners.map(([px]) => (0.5 + (px - centre.x) / side) * BLOB);
        const y = corners.map(([, py]) => (0.5 + (centre.y - py) / side) * BLOB);
        if (((x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0])) * facing <= 0) continue;
        s.moveTo(x[0], y[0]);
        for (let k = 1; k < x.length; k++) s.lineTo(x[k], y[k]);
        s.closePath();
      }
      s.fill('nonzero');
    }
    g.globalAlpha = 0.75;
    g.filter = `blur(${BLOB * 0.055}px)`;
    g.drawImage(shadow, 0, 0);
    g.globalAlpha = 0.55;
    g.filter = `blur(${BLOB * 0.018}px)`;
    g.drawImage(shadow, 0, 0);
    g.filter = 'none';
    g.globalAlpha = 1;
    this.ground.material.map!.needsUpdate = true;
    this.ground.visible = true;
  }

  set hasGround(on: boolean) {
    this.ground.visible = on && this.drawnFor !== '';
  }

  dispose(): void {
    this.ground.geometry.dispose();
    this.ground.material.map?.dispose();
    this.ground.material.dispose();
    this.key.dispose();
  }
}

/** The part of a triangle that a cut leaves, seen from above. */
function keptCorners(rest: Float32Array, at: number[], { normal, offset }: CutPlane): number[][] {
  const height = at.map((i) => normal[0] * rest[i] + normal[1] * rest[i + 1] + normal[2] * rest[i + 2] - offset);
  const out: number[][] = [];
  for (let k = 0; k < 3; k++) {
    const next = (k + 1) % 3;
    const [a, b] = [at[k], at[next]];
    if (height[k] >= 0) out.push([rest[a], rest[a + 1]]);
    if (height[k] >= 0 === height[next] >= 0) continue;
    const share = height[k] / (height[k] - height[next]);
    out.push([0, 1].map((c) => rest[a + c] + share * (rest[b + c] - rest[a + c])));
  }
  return out;
}
