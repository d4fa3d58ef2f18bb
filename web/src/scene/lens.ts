// The lens: the section through the tool, enlarged, drawn into a corner of the picture. It shows the tool, the
// layers and lumps as they give way, the pressure along the skin, and the force beside the tool.
//
// ```text
//        ▲ up: the tool's axis, out of the tissue
//   ┌────┼────────┐
//   │   (tool) ↑F │   right: to the right in the picture, in the skin
//   │────╲__╱─────│   The plane holds both axes and the tool's tip.
//   │  layers     │
//   └─────────────┘
// ```

import {
  BufferAttribute, BufferGeometry, DoubleSide, DynamicDrawUsage, Mesh, MeshBasicMaterial, OrthographicCamera, Quaternion, Scene,
  ShaderMaterial, Vector2, Vector3, type WebGLRenderer,
} from 'three';
import type { ContactShape } from '../generated/api';
import type { FrameSnapshot } from '../generated/wire';
import type { Body } from './body';
import type { CutPlane } from './contour';
import type { SharedUniforms } from './materials';
import type { SectionValues } from './section';
import { SectionView } from './sectionview';
import { reachOf, toolGeometry } from './toolshapes';

/** Half the width of the section, in reaches of the tool, and its limits, m. */
const WIDTH_IN_TOOLS = 2.6;
const LEAST_HALF = 14e-3;
const MOST_HALF = 60e-3;
/** Height of the picture in its widths, and the share of it that lies above the skin at rest. */
const ASPECT = 0.82;
const ABOVE = 0.34;
/** Width of the lens: a share of the picture, within limits, px; and its distance from the corner. */
const SHARE = 0.3;
const LEAST_WIDTH = 170;
const MOST_WIDTH = 320;
const MARGIN = { right: 10, top: 54 };
/** The lens stays for this long after the last contact, ms: a hand that strokes lifts off for moments. */
const STAYS_MS = 900;
/** Pressure bars and the arrow of the force at their longest, in half widths. */
const LONGEST_BAR = 0.4;
const LONGEST_ARROW = 0.62;
/** The arrow is longest at a round force above the largest so far, and at least at this one, N. */
const LEAST_SCALE = 1;
/** Forces below this have no arrow, N. */
const LEAST_FORCE = 0.01;
/** Part of the width at the left edge where the names of layers stand. */
const NAMES = 0.16;
/** Least height of a layer that has room for its name, px. */
const ROOM_FOR_NAME = 12;
/** The body around the tool that is cut, in half widths: the rest is out of sight. */
const NEAR = 1.75;
const COLOURS = { force: 0xe5252a, pressure: 0xe5252a };

/** What the frame around the lens says, with places in px from its upper left corner. */
export interface LensPicture {
  /** In the picture of the body, px. */
  place: { x: number; y: number; width: number; height: number };
  /** Size of the force, N, and where it is written. */
  force: number;
  forceAt: { x: number; y: number } | null;
  /** Largest pressure of the tool on the skin, Pa; null where the engine knows none. */
  pressure: number | null;
  /** Layers that have room for their names, from the skin down. */
  names: { layer: number; y: number }[];
  /** Length of 10 mm, px. */
  tenMillimetres: number;
}

/** What of the body is shown. */
export interface LensLook {
  values: SectionValues;
  layers: boolean[];
  bones: boolean;
}

export class LensView {
  /** The section, in the same colours as a cutaway. */
  readonly section: SectionView;
  private readonly scene = new Scene();
  private readonly camera = new OrthographicCamera();
  private readonly tool = new Mesh(new BufferGeometry(), toolMaterial());
  private readonly bars = new Mesh(new BufferGeometry(), over(COLOURS.pressure, 0.5));
  private readonly arrow = new Mesh(new BufferGeometry(), over(COLOURS.force, 1));
  private readonly pressures: { of: Body | null; values: Float32Array } = { of: null, values: new Float32Array(0) };
  private readonly right = new Vector3(1, 0, 0);
  private readonly up = new Vector3(0, 0, 1);
  private readonly out = new Vector3(0, -1, 0);
  private readonly middle = new Vector3();
  private form = '';
  private reach = 5e-3;
  private half = LEAST_HALF;
  private scale = LEAST_SCALE;
  private touchedAt = -Infinity;
  private isOn = false;

  constructor(shared: SharedUniforms) {
    this.section = new SectionView(shared);
    this.tool.renderOrder = 8;
    this.bars.renderOrder = 9;
    this.arrow.renderOrder = 10;
    for (const mesh of [this.tool, this.bars, this.arrow]) mesh.frustumCulled = false;
    this.scene.add(this.section.group, this.tool, this.bars, this.arrow);
  }

  /** The tool's shape; null for a node that has none. */
  set(form: ContactShape | null): void {
    const key = JSON.stringify(form);
    if (key === this.form) return;
    this.form = key;
    this.scale = LEAST_SCALE;
    this.reach = form === null ? 5e-3 : reachOf(form);
    this.half = Math.min(Math.max(WIDTH_IN_TOOLS * this.reach, LEAST_HALF), MOST_HALF);
    this.tool.geometry.dispose();
    this.tool.geometry = form === null ? new BufferGeometry() : toolGeometry(form, 6 * this.half);
  }

  /** Whether the tool touches, or did so just now. `now` in ms. */
  isDue(frame: FrameSnapshot | null, now: number): boolean {
    if (frame && frame.n_active > 0) this.touchedAt = now;
    return now - this.touchedAt < STAYS_MS;
  }

  /** Time until the lens closes unless the tool touches again, ms. */
  static readonly stays = STAYS_MS;

  /** Cuts the body as it lies now. `right` and `up` are the axes of the picture. */
  update(body: Body, frame: FrameSnapshot, look: LensLook, axes: { right: Vector3; up: Vector3 }): void {
    this.isOn = true;
    this.tool.position.fromArray(frame.tool);
    this.tool.quaternion.fromArray(frame.orientation);
    this.turn(this.tool.quaternion, axes);
    const { out, up, half, middle } = this;
    middle.fromArray(frame.place).addScaledVector(up, (ABOVE - 0.5) * 2 * half * ASPECT);
    const tip = this.tool.position;
    const plane: CutPlane = { normal: out.toArray(), offset: out.dot(tip) };
    // In the plane itself: the place of the skin may lie beside it.
    middle.addScaledVector(out, plane.offset - out.dot(middle));
    this.section.section.cut(body, plane, look.values, look.layers, { middle: middle.toArray(), radius: NEAR * half });
    this.section.update(body, plane, look.bones);
    this.showPressure(body, frame, plane);
    this.showForce(frame);
    const { camera } = this;
    camera.left = -half;
    camera.right = half;
    camera.top = half * ASPECT;
    camera.bottom = -half * ASPECT;
    camera.near = 0;
    camera.far = 8 * half;
    camera.position.copy(middle).addScaledVector(out, 4 * half);
    camera.up.copy(up);
    camera.lookAt(middle);
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
  }

  /** Draws into the corner of the picture, `size` px large. Returns what its frame says. */
  draw(renderer: WebGLRenderer, size: Vector2, background: string, frame: FrameSnapshot): LensPicture | null {
    if (!this.isOn) return null;
    const place = placeIn(size);
    this.section.size = new Vector2(place.width, place.height);
    renderer.setScissorTest(true);
    renderer.setScissor(place.x, size.y - place.y - place.height, place.width, place.height);
    renderer.setViewport(place.x, size.y - place.y - place.height, place.width, place.height);
    renderer.setClearColor(background, 1);
    renderer.clear();
    renderer.autoClear = false;
    renderer.render(this.scene, this.camera);
    renderer.autoClear = true;
    renderer.setClearColor(0, 0);
    renderer.setScissorTest(false);
    renderer.setViewport(0, 0, size.x, size.y);
    const force = new Vector3().fromArray(frame.force).length();
    const at = this.arrow.visible ? this.toPixels(this.arrowEnd, place) : null;
    return {
      place, force, forceAt: at,
      pressure: frame.contact_pressures.length > 0 ? frame.contact_pressures.reduce((a, b) => Math.max(a, b), 0) : null,
      names: this.names(place),
      tenMillimetres: (place.width * 10e-3) / (2 * this.half),
    };
  }

  close(): void {
    this.isOn = false;
  }

  dispose(): void {
    this.section.dispose();
    for (const mesh of [this.tool, this.bars, this.arrow]) {
      mesh.geometry.dispose();
      mesh.material.dispose();
    }
  }

  private readonly arrowEnd = new Vector3();

  /** The plane's axes: up along the tool, right as in the picture. */
  private turn(orientation: Quaternion, axes: { right: Vector3; up: Vector3 }): void {
    this.up.set(0, 0, 1).applyQuaternion(orientation);
    const flat = (v: Vector3) => this.right.copy(v).addScaledVector(this.up, -v.dot(this.up));
    // Seen from the side of the limb, the picture's own direction points into the skin.
    if (flat(axes.right).lengthSq() < 0.1) flat(axes.up);
    this.right.normalize();
    this.out.crossVectors(this.right, this.up);
  }

  /** Bars of pressure on the skin's line in the section. */
  private showPressure(body: Body, frame: FrameSnapshot, plane: CutPlane): void {
    const { contacts, contact_pressures: given } = frame;
    const held = this.pressures;
    if (held.of !== body) {
      held.of = body;
      held.values = new Float32Array(body.nVertices);
    }
    let most = 0;
    for (let i = 0; i < contacts.length; i++) {
      held.values[contacts[i]] = given[i];
      most = Math.max(most, given[i]);
    }
    const corners: number[] = [];
    if (most > 0) {
      const height = (LONGEST_BAR * this.half) / most;
      const ends: { at: Vector3; bar: Vector3 }[] = [];
      for (let t = 0; t < body.triangles.length; t += 3) {
        const vertices = [body.triangles[t], body.triangles[t + 1], body.triangles[t + 2]];
        if (vertices.every((v) => held.values[v] === 0)) continue;
        ends.length = 0;
        for (let e = 0; e < 3; e++) {
          const end = this.crossing(body, plane, vertices[e], vertices[(e + 1) % 3], height);
          if (end) ends.push(end);
        }
        if (ends.length !== 2) continue;
        const [a, b] = ends;
        for (const p of [a.at, b.at, b.bar, a.at, b.bar, a.bar]) corners.push(p.x, p.y, p.z);
      }
    }
    for (const v of contacts) held.values[v] = 0;
    refill(this.bars, corners);
  }

  /** Where the plane crosses an edge of the skin, and the end of the bar there. */
  private crossing({ positions: x, normals, nLevels }: Body, { normal, offset }: CutPlane, v: number, w: number, height: number) {
    const at = (i: number, from: Float32Array) => new Vector3().fromArray(from, 3 * i * nLevels);
    const p = at(v, x), q = at(w, x);
    const n = new Vector3(...normal);
    const hp = n.dot(p) - offset, hq = n.dot(q) - offset;
    if (hp >= 0 === hq >= 0) return null;
    const share = hp / (hp - hq);
    const values = this.pressures.values;
    const pressure = values[v] + share * (values[w] - values[v]);
    const out = at(v, normals).lerp(at(w, normals), share);
    out.addScaledVector(n, -out.dot(n)).normalize();
    const point = p.lerp(q, share);
    return { at: point, bar: point.clone().addScaledVector(out, height * pressure) };
  }

  /** The arrow of the force beside the tool, in the plane. */
  private showForce(frame: FrameSnapshot): void {
    const force = new Vector3().fromArray(frame.force);
    const size = force.length();
    this.arrow.visible = size > LEAST_FORCE;
    if (!this.arrow.visible) return;
    while (size > this.scale) this.scale *= this.scale.toExponential()[0] === '2' ? 2.5 : 2;
    const { right, up, half } = this;
    const way = new Vector3().addScaledVector(right, force.dot(right) / size).addScaledVector(up, force.dot(up) / size);
    const length = Math.max((size / this.scale) * LONGEST_ARROW * half, 0.1 * half);
    const along = way.lengthSq() > 1e-6 ? way.normalize() : up.clone();
    const across = new Vector3().crossVectors(this.out, along);
    // Right of the tool, beginning at the skin at rest.
    const from = new Vector3().fromArray(frame.place).addScaledVector(right, this.reach + 0.2 * half);
    const head = Math.min(0.16 * half, 0.6 * length), thick = 0.022 * half;
    const point = (a: number, b: number) => from.clone().addScaledVector(along, a).addScaledVector(across, b);
    const shaft = [point(0, -thick), point(0, thick), point(length - head, thick), point(length - head, -thick)];
    const tip = [point(length - head, -0.4 * head), point(length - head, 0.4 * head), point(length, 0)];
    const corners = [shaft[0], shaft[1], shaft[2], shaft[0], shaft[2], shaft[3], ...tip];
    refill(this.arrow, corners.flatMap((p) => p.toArray()));
    this.arrowEnd.copy(point(length, 0));
  }

  private toPixels(p: Vector3, { width, height }: LensPicture['place']): { x: number; y: number } {
    const off = p.clone().sub(this.middle);
    const scale = width / (2 * this.half);
    return { x: width / 2 + scale * off.dot(this.right), y: height / 2 - scale * off.dot(this.up) };
  }

  /** Where the names of the layers stand, at the left edge. */
  private names({ width, height }: LensPicture['place']): LensPicture['names'] {
    const { positions, layers } = this.section.section;
    const scale = width / (2 * this.half);
    const low: number[] = [], high: number[] = [];
    for (let i = 0; i < layers.length; i++) {
      const off = new Vector3().fromArray(positions.data, 3 * i).sub(this.middle);
      const x = width / 2 + scale * off.dot(this.right);
      if (x < 0 || x > NAMES * width) continue;
      const y = Math.min(Math.max(height / 2 - scale * off.dot(this.up), 0), height);
      const layer = layers.data[i];
      low[layer] = Math.min(low[layer] ?? Infinity, y);
      high[layer] = Math.max(high[layer] ?? -Infinity, y);
    }
    return low.flatMap((y, layer) => (high[layer] - y >= ROOM_FOR_NAME ? [{ layer, y: (y + high[layer]) / 2 }] : []));
  }
}

/** The lens in a picture of this size, px. */
function placeIn(size: Vector2): LensPicture['place'] {
  const width = Math.round(Math.min(Math.max(SHARE * size.x, LEAST_WIDTH), MOST_WIDTH, size.x - 2 * MARGIN.right));
  const height = Math.round(ASPECT * width);
  return { x: size.x - MARGIN.right - width, y: MARGIN.top, width, height };
}

function refill(mesh: Mesh<BufferGeometry>, corners: number[]): void {
  mesh.visible = corners.length > 0;
  let position = mesh.geometry.getAttribute('position') as BufferAttribute | undefined;
  if (!position || position.array.length < corners.length) {
    mesh.geometry.dispose();
    mesh.geometry = new BufferGeometry();
    position = new BufferAttribute(new Float32Array(Math.max(64, 2 * corners.length)), 3);
    position.setUsage(DynamicDrawUsage);
    mesh.geometry.setAttribute('position', position);
  }
  (position.array as Float32Array).set(corners);
  position.needsUpdate = true;
  mesh.geometry.setDrawRange(0, corners.length / 3);
}

function over(color: number, opacity: number): MeshBasicMaterial {
  return new MeshBasicMaterial({ color, opacity, side: DoubleSide, depthTest: false, depthWrite: false, transparent: true, toneMapped: false });
}

/** Steel, light inside and dark where the surface turns away: an outline. */
function toolMaterial(): ShaderMaterial {
  return new ShaderMaterial({
    vertexShader: /* glsl */ `
varying vec3 vNormal;
void main() {
  vNormal = normalMatrix * normal;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`,
    fragmentShader: /* glsl */ `
varying vec3 vNormal;
void main() {
  float facing = abs(normalize(vNormal).z);
  float inside = smoothstep(0.12, 0.3, facing);
  vec3 c = mix(vec3(0.10, 0.13, 0.17), mix(vec3(0.50, 0.56, 0.62), vec3(0.80, 0.84, 0.88), facing), inside);
  gl_FragColor = vec4(c, mix(0.95, 0.72, inside));
  #include <colorspace_fragment>
}`,
    depthTest: false,
    depthWrite: false,
    transparent: true,
  });
}
