// The picture of a surface before it is grown: plain, with a mark at each place of a finding.

import {
  AmbientLight, BackSide, Box3, BufferAttribute, BufferGeometry, CanvasTexture, Color, DirectionalLight, FrontSide, Group, LineBasicMaterial,
  LineSegments, Mesh, MeshLambertMaterial, Points, PointsMaterial, Scene, Vector3, WebGLRenderer, WireframeGeometry,
} from 'three';
import type { FindingSeverity } from '../generated/api';
import type { MeshSnapshot } from '../generated/wire';
import { Gestures } from '../scene/gestures';
import { BONE, SKIN_IN_LIGHT, THEMES } from '../scene/palette';
import { CameraRig, SIDES } from '../scene/rig';

/** Above so many triangles edges would cover the surface. */
const MOST_EDGES = 30_000;
const MARK = 13;
const CHOSEN = 24;
/** A side that should not be seen: the surface is turned inside out there. */
const INSIDE = '#7f6fa8';
export const SEVERITY_COLOURS: Record<FindingSeverity, string> = { unrepairable: '#c62828', repairable: '#d98200', note: '#2c7fb8' };

/** A place of a finding, in the frame of the picture. */
export interface Mark {
  at: [number, number, number];
  severity: FindingSeverity;
  isChosen: boolean;
}

export class Preview {
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly body = new Group();
  private readonly marks = new Group();
  private readonly rig = new CameraRig(() => this.redraw());
  private readonly gestures: Gestures;
  private readonly resizer: ResizeObserver;
  private readonly dot = new CanvasTexture(dotPicture());
  private pending = 0;
  private box = new Box3();

  /** Throws where the browser has no WebGL 2. */
  constructor(private readonly canvas: HTMLCanvasElement, private theme: 'light' | 'dark') {
    this.renderer = new WebGLRenderer({ canvas, alpha: true, antialias: true });
    this.renderer.setClearAlpha(0);
    const key = new DirectionalLight(0xffffff, 2.2);
    key.position.set(-0.5, -0.55, 1);
    const fill = new DirectionalLight(0xffffff, 0.7);
    fill.position.set(0.7, 0.5, -0.4);
    this.scene.add(new AmbientLight(0xffffff, 0.9), key, fill, this.body, this.marks);
    this.gestures = new Gestures(canvas, this.rig);
    this.resizer = new ResizeObserver(() => this.resize());
    this.resizer.observe(canvas.parentElement!);
    this.resize();
  }

  /** Shows a skin and its bones, each moved by an offset from the skin's middle. */
  show(skin: MeshSnapshot, bones: { mesh: MeshSnapshot; offset: [number, number, number] }[]): void {
    clear(this.body);
    const surface = geometryOf(skin);
    const isClear = bones.length > 0;
    const look = { transparent: isClear, opacity: isClear ? 0.45 : 1, depthWrite: !isClear };
    this.body.add(new Mesh(surface, new MeshLambertMaterial({ color: SKIN_IN_LIGHT, side: FrontSide, ...look })));
    // Through a clear skin one sees its other side from within, which is as it should be.
    if (!isClear) this.body.add(new Mesh(surface, new MeshLambertMaterial({ color: INSIDE, side: BackSide })));
    if (skin.triangles.length / 3 <= MOST_EDGES) {
      const edges = new LineBasicMaterial({ color: THEMES[this.theme].wire, transparent: true, opacity: 0.22 });
      this.body.add(new LineSegments(new WireframeGeometry(surface), edges));
    }
    for (const { mesh, offset } of bones) {
      const bone = new Mesh(geometryOf(mesh), new MeshLambertMaterial({ color: BONE }));
      bone.position.set(...offset);
      bone.renderOrder = -1;
      this.body.add(bone);
    }
    this.box = new Box3().setFromObject(this.body);
    if (this.box.isEmpty()) this.box.set(new Vector3(-1, -1, -1), new Vector3(1, 1, 1));
    this.rig.fit(this.box, SIDES.home, false);
  }

  setMarks(marks: readonly Mark[]): void {
    clear(this.marks);
    for (const [chosen, size] of [[false, MARK], [true, CHOSEN]] as const) {
      const some = marks.filter((mark) => mark.isChosen === chosen);
      if (some.length === 0) continue;
      const geometry = new BufferGeometry();
      geometry.setAttribute('position', new BufferAttribute(new Float32Array(some.flatMap(({ at }) => at)), 3));
      const colours = some.flatMap(({ severity }) => new Color(SEVERITY_COLOURS[severity]).toArray());
      geometry.setAttribute('color', new BufferAttribute(new Float32Array(colours), 3));
      const material = new PointsMaterial({
        size, sizeAttenuation: false, vertexColors: true, map: this.dot, transparent: true,
        // Marks behind the body are seen too.
        depthTest: false,
      });
      const points = new Points(geometry, material);
      points.renderOrder = 10;
      this.marks.add(points);
    }
    this.redraw();
  }

  /** Turns the view so that a place is in front. */
  lookAt(at: [number, number, number]): void {
    const from = new Vector3(...at).sub(this.box.getCenter(new Vector3()));
    if (from.lengthSq() === 0) return;
    const side = from.normalize().addScaledVector(SIDES.home, 0.35).normalize();
    this.rig.fit(this.box, side, false);
  }

  /** The theme of the page has changed; the next surface has its colours. */
  setTheme(theme: 'light' | 'dark'): void {
    this.theme = theme;
    this.redraw();
  }

  dispose(): void {
    cancelAnimationFrame(this.pending);
    this.resizer.disconnect();
    this.gestures.dispose();
    clear(this.body);
    clear(this.marks);
    this.dot.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
  }

  private resize(): void {
    const { clientWidth: w, clientHeight: h } = this.canvas.parentElement!;
    if (w === 0 || h === 0) return;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
    this.renderer.setSize(w, h, false);
    this.rig.resize(w / h);
    if (!this.box.isEmpty()) this.rig.fit(this.box, SIDES.home, false);
  }

  private redraw(): void {
    if (this.pending !== 0) return;
    this.pending = requestAnimationFrame(() => {
      this.pending = 0;
      this.renderer.render(this.scene, this.rig.camera);
    });
  }
}

function geometryOf(mesh: MeshSnapshot): BufferGeometry {
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(mesh.positions, 3));
  geometry.setIndex(new BufferAttribute(mesh.triangles, 1));
  geometry.computeVertexNormals();
  return geometry;
}

function clear(group: Group): void {
  for (const child of [...group.children]) {
    group.remove(child);
    const { geometry, material } = child as Mesh;
    geometry.dispose();
    for (const one of [material].flat()) one.dispose();
  }
}

/** A disc, which takes the colour of its mark. */
function dotPicture(): HTMLCanvasElement {
  const canvas = document.createElement('canvas');
  canvas.width = canvas.height = 64;
  const g = canvas.getContext('2d')!;
  g.beginPath();
  g.arc(32, 32, 30, 0, 2 * Math.PI);
  g.fillStyle = '#fff';
  g.fill();
  return canvas;
}
