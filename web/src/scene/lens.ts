// The lens: the section through the tool, enlarged, on a canvas of its own in a corner of the picture. It shows the
// tool, the layers and lumps as they give way, the pressure along the skin, and the force beside the tool.
//
// ```text
//        ▲ up: the tool's axis, out of the tissue
//   ┌────┼────────┐
//   │   (tool) ↑F │   right: to the right in the picture, in the skin
//   │────╲__╱─────│   The plane holds both axes and the tool's tip.
//   │  layers     │
//   └─────────────┘
// ```
// A plain canvas stays sharp while pictures of the body are coarse, and costs a few milliseconds.

import { BufferGeometry, Quaternion, Vector2, Vector3 } from 'three';
import type { ContactShape, LumpInfo } from '../generated/api';
import type { FrameSnapshot } from '../generated/wire';
import type { Body } from './body';
import { contourLoops, fillLoops, type CutPlane } from './contour';
import { lumpReach, outside } from './lumps';
import { Section, type SectionValues } from './section';
import { reachOf, toolGeometry } from './toolshapes';

/** Half the width of the section, in reaches of the tool, and its limits, m. */
const WIDTH_IN_TOOLS = 2.4;
const LEAST_HALF = 14e-3;
const MOST_HALF = 60e-3;
/** Height of the picture in its widths, and the share of it that lies above the skin at rest. */
const ASPECT = 0.82;
const ABOVE = 0.36;
/** Width of the lens: a share of the picture, within limits, px; and its distance from the corner. */
const SHARE = 0.4;
const LEAST_WIDTH = 180;
/** Its greatest height, in heights of the picture: more would hide the body. */
const MOST_HEIGHT = 0.42;
const MOST_WIDTH = 360;
const MARGIN = { right: 10, top: 54 };
/** The lens stays for this long after the last contact, ms: a hand that strokes lifts off for moments. */
const STAYS_MS = 900;
/** Pressure bars and the arrow of the force at their longest, in half widths. */
const LONGEST_BAR = 0.34;
const LONGEST_ARROW = 0.6;
/** The arrow is longest at a round force above the largest so far, and at least at this one, N. */
const LEAST_SCALE = 1;
/** Forces below this have no arrow, N. */
const LEAST_FORCE = 0.01;
/** Where the names of layers stand, as a share of the width. */
const NAMES = 0.1;
/** Least height of a layer that has room for its name, px. */
const ROOM_FOR_NAME = 12;
/** The body around the tool that is cut, in half widths: the rest is out of sight. */
const NEAR = 1.75;
/** Parts into which triangles near a lump are divided, m: the outline of a lump is finer than the mesh. */
const LUMP_GRAIN = 1e-3;
const FORCE = '#e5252a';
const PRESSURE = 'rgb(229 37 42 / 0.5)';

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

/** What of the body is shown, and how. */
export interface LensLook {
  values: SectionValues;
  /** The colour of a value; null for the colours of the layers. */
  colourOf: ((value: number) => string) | null;
  layers: { colour: string; visible: boolean }[];
  bones: boolean;
  lumps: LumpInfo[];
  colours: { background: string; core: string; bone: string; lump: string; outline: string };
}

export class LensView {
  readonly canvas = document.createElement('canvas');
  /** Time until the lens closes unless the tool touches again, ms. */
  static readonly stays = STAYS_MS;
  /** The tool before it is laid over the rest, half transparent. */
  private readonly layer = document.createElement('canvas');
  private readonly section = new Section();
  private readonly right = new Vector3(1, 0, 0);
  private readonly up = new Vector3(0, 0, 1);
  private readonly out = new Vector3(0, -1, 0);
  private readonly middle = new Vector3();
  private form = '';
  /** Corners of the convex parts of the tool, in its own frame, m. */
  private parts: Vector3[][] = [];
  private reach = 5e-3;
  private half = LEAST_HALF;
  private scale = LEAST_SCALE;
  private touchedAt = -Infinity;
  /** Pressure at each vertex of the skin; zero between two pictures. */
  private pressures = new Float32Array(0);
  /** Pixels of the lens per metre. */
  private zoom = 1;
  private width = 1;
  private height = 1;
  private place: LensPicture['place'] = { x: 0, y: 0, width: 0, height: 0 };

  constructor() {
    this.canvas.className = 'scene-lens';
    this.canvas.hidden = true;
    this.canvas.setAttribute('aria-hidden', 'true');
  }

  /** The tool's shape; null for a node that has none. */
  set(form: ContactShape | null): void {
    const key = JSON.stringify(form);
    if (key === this.form) return;
    this.form = key;
    this.scale = LEAST_SCALE;
    this.reach = form === null ? 5e-3 : reachOf(form);
    this.half = Math.min(Math.max(WIDTH_IN_TOOLS * this.reach, LEAST_HALF), MOST_HALF);
    this.parts = form === null ? [] : partsOf(toolGeometry(form, 6 * this.half));
  }

  /** Whether the tool touches, or did so just now. `now` in ms. */
  isDue(frame: FrameSnapshot, now: number): boolean {
    if (frame.n_active > 0) this.touchedAt = now;
    return now - this.touchedAt < STAYS_MS;
  }

  close(): void {
    this.canvas.hidden = true;
  }

  /** Whether the lens lies over a place of the picture, px. */
  covers(at: { x: number; y: number }): boolean {
    const { x, y, width, height } = this.place;
    return !this.canvas.hidden && at.x > x && at.x < x + width && at.y > y && at.y < y + height;
  }

  /** Cuts the body as it lies now and draws it. `size` is that of the picture, px; `axes` are its directions. */
  draw(body: Body, frame: FrameSnapshot, look: LensLook, axes: { right: Vector3; up: Vector3 }, size: Vector2): LensPicture {
    const place = (this.place = placeIn(size));
    const g = this.begin(place, look.colours.background);
    const tip = new Vector3().fromArray(frame.tool);
    const orientation = new Quaternion().fromArray(frame.orientation);
    this.turn(orientation, axes);
    const { out, up, half, middle } = this;
    middle.fromArray(frame.place).addScaledVector(up, (ABOVE - 0.5) * 2 * half * ASPECT);
    const plane: CutPlane = { normal: out.toArray(), offset: out.dot(tip) };
    // In the plane itself: the place of the skin may lie beside it.
    middle.addScaledVector(out, plane.offset - out.dot(middle));

    const visible = look.layers.map((layer) => layer.visible);
    this.section.cut(body, plane, look.values, visible, { middle: middle.toArray(), radius: NEAR * half });
    if (look.bones) this.drawBones(g, body, plane, look);
    this.drawTissue(g, look);
    this.drawLumps(g, look);
    this.drawOutline(g, look.colours.outline);
    this.drawPressure(g, body, frame, plane);
    this.drawTool(g, tip, orientation);
    return {
      place,
      force: new Vector3().fromArray(frame.force).length(),
      forceAt: this.drawForce(g, frame),
      pressure: frame.contact_pressures.length > 0 ? frame.contact_pressures.reduce((a, b) => Math.max(a, b), 0) : null,
      names: this.names(),
      tenMillimetres: 10e-3 * this.zoom,
    };
  }

  dispose(): void {
    this.canvas.remove();
  }

  private begin({ x, y, width, height }: LensPicture['place'], background: string): CanvasRenderingContext2D {
    const { canvas } = this;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    if (canvas.hidden) canvas.hidden = false;
    if (canvas.width !== Math.round(ratio * width) || canvas.height !== Math.round(ratio * height)) {
      canvas.width = Math.round(ratio * width);
      canvas.height = Math.round(ratio * height);
    }
    const style = `left:${x}px;top:${y}px;width:${width}px;height:${height}px`;
    if (canvas.getAttribute('style') !== style) canvas.setAttribute('style', style);
    const g = canvas.getContext('2d')!;
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    g.fillStyle = background;
    g.fillRect(0, 0, width, height);
    g.lineJoin = 'round';
    [this.width, this.height] = [width, height];
    this.zoom = width / (2 * this.half);
    return g;
  }

  /** The plane's axes: up along the tool, right as in the picture. */
  private turn(orientation: Quaternion, axes: { right: Vector3; up: Vector3 }): void {
    this.up.set(0, 0, 1).applyQuaternion(orientation);
    const flat = (v: Vector3) => this.right.copy(v).addScaledVector(this.up, -v.dot(this.up));
    // Seen from the side of the limb, the picture's own direction points into the skin.
    if (flat(axes.right).lengthSq() < 0.1) flat(axes.up);
    this.right.normalize();
    this.out.crossVectors(this.right, this.up);
  }

  /** The place of a point, px. */
  private x(p: ArrayLike<number>, i = 0): number {
    const { right: r, middle: m } = this;
    return this.width / 2 + this.zoom * ((p[i] - m.x) * r.x + (p[i + 1] - m.y) * r.y + (p[i + 2] - m.z) * r.z);
  }
  private y(p: ArrayLike<number>, i = 0): number {
    const { up: u, middle: m } = this;
    return this.height / 2 - this.zoom * ((p[i] - m.x) * u.x + (p[i + 1] - m.y) * u.y + (p[i + 2] - m.z) * u.z);
  }

  private triangle(g: CanvasPath, p: ArrayLike<number>, a: number, b: number, c: number): void {
    g.moveTo(this.x(p, a), this.y(p, a));
    g.lineTo(this.x(p, b), this.y(p, b));
    g.lineTo(this.x(p, c), this.y(p, c));
    g.closePath();
  }

  private drawBones(g: CanvasRenderingContext2D, body: Body, plane: CutPlane, { colours }: LensLook): void {
    const hasBones = body.boneTriangles.length > 0;
    const parts = [
      [fillLoops(contourLoops(body.rest, body.coreTriangles, plane), plane), hasBones ? colours.core : colours.bone],
      [hasBones ? fillLoops(contourLoops(body.bonePositions, body.boneTriangles, plane), plane) : [], colours.bone],
    ] as const;
    for (const [corners, colour] of parts) {
      g.beginPath();
      for (let i = 0; i < corners.length; i += 9) this.triangle(g, corners, i, i + 3, i + 6);
      g.fillStyle = colour;
      g.fill();
    }
  }

  /** All triangles of a layer are one path, so that no seams are seen between them. */
  private drawTissue(g: CanvasRenderingContext2D, { layers, colourOf }: LensLook): void {
    const { positions: { data: p }, indices, layers: of, values } = this.section;
    if (colourOf) {
      for (let t = 0; t < indices.length; t += 3) {
        const [a, b, c] = [indices.data[t], indices.data[t + 1], indices.data[t + 2]];
        g.beginPath();
        this.triangle(g, p, 3 * a, 3 * b, 3 * c);
        g.fillStyle = g.strokeStyle = colourOf((values.data[a] + values.data[b] + values.data[c]) / 3);
        g.lineWidth = 1;
        g.fill();
        g.stroke();
      }
      return;
    }
    layers.forEach(({ colour }, layer) => {
      g.beginPath();
      for (let t = 0; t < indices.length; t += 3) {
        const a = indices.data[t];
        if (of.data[a] === layer) this.triangle(g, p, 3 * a, 3 * indices.data[t + 1], 3 * indices.data[t + 2]);
      }
      g.fillStyle = colour;
      g.fill();
    });
  }

  /** Lumps with their own shape at rest, carried along by the tissue. */
  private drawLumps(g: CanvasRenderingContext2D, { lumps, colours, colourOf }: LensLook): void {
    const { positions: { data: p }, rest: { data: r }, indices } = this.section;
    for (const lump of lumps) {
      const reach = lumpReach(lump);
      const fill = new Path2D(), edge = new Path2D();
      for (let t = 0; t < indices.length; t += 3) {
        const [a, b, c] = [3 * indices.data[t], 3 * indices.data[t + 1], 3 * indices.data[t + 2]];
        const far = Math.hypot(r[a] - lump.centre[0], r[a + 1] - lump.centre[1], r[a + 2] - lump.centre[2]);
        const longest = Math.max(apart(r, a, b), apart(r, b, c), apart(r, c, a));
        if (far > reach + longest) continue;
        this.clip(lump, p, r, [a, b, c], Math.min(8, Math.ceil(longest / LUMP_GRAIN)), fill, edge);
      }
      g.fillStyle = colours.lump;
      if (!colourOf) g.fill(fill);
      g.strokeStyle = colourOf ? '#ffffff' : darker(colours.lump);
      g.lineWidth = 1.4;
      g.stroke(edge);
    }
  }

  /** Adds the part of a triangle that lies in a lump, in `n` × `n` parts, and the lump's outline in it. */
  private clip(lump: LumpInfo, p: Float32Array, r: Float32Array, [a, b, c]: [number, number, number], n: number, fill: Path2D, edge: Path2D): void {
    const at = (from: Float32Array, s: number, t: number) => [0, 1, 2].map((k) => (1 - s - t) * from[a + k] + s * from[b + k] + t * from[c + k]);
    const corner = (i: number, k: number) => {
      const [s, t] = [i / n, k / n];
      const q = at(p, s, t), [x, y, z] = at(r, s, t);
      return { x: this.x(q), y: this.y(q), d: outside(lump, x, y, z) };
    };
    type Corner = ReturnType<typeof corner>;
    const part = (corners: Corner[]) => {
      const kept: { x: number; y: number }[] = [], crossed: { x: number; y: number }[] = [];
      corners.forEach((from, i) => {
        const to = corners[(i + 1) % 3];
        if (from.d < 0) kept.push(from);
        if (from.d < 0 === to.d < 0) return;
        const share = from.d / (from.d - to.d);
        const cross = { x: from.x + share * (to.x - from.x), y: from.y + share * (to.y - from.y) };
        kept.push(cross);
        crossed.push(cross);
      });
      kept.forEach(({ x, y }, i) => (i === 0 ? fill.moveTo(x, y) : fill.lineTo(x, y)));
      if (kept.length > 0) fill.closePath();
      if (crossed.length === 2) {
        edge.moveTo(crossed[0].x, crossed[0].y);
        edge.lineTo(crossed[1].x, crossed[1].y);
      }
    };
    for (let i = 0; i < n; i++) {
      for (let k = 0; k < n - i; k++) {
        part([corner(i, k), corner(i + 1, k), corner(i, k + 1)]);
        if (i + k < n - 1) part([corner(i + 1, k), corner(i + 1, k + 1), corner(i, k + 1)]);
      }
    }
  }

  private drawOutline(g: CanvasRenderingContext2D, colour: string): void {
    const { data, length } = this.section.outline;
    g.beginPath();
    for (let i = 0; i < length; i += 6) {
      g.moveTo(this.x(data, i), this.y(data, i));
      g.lineTo(this.x(data, i + 3), this.y(data, i + 3));
    }
    g.strokeStyle = colour;
    g.lineWidth = 1.1;
    g.stroke();
  }

  /** Bars of pressure on the skin's line in the section. */
  private drawPressure(g: CanvasRenderingContext2D, body: Body, { contacts, contact_pressures: given }: FrameSnapshot, plane: CutPlane): void {
    if (this.pressures.length < body.nVertices) this.pressures = new Float32Array(body.nVertices);
    const { pressures } = this;
    let most = 0;
    for (let i = 0; i < contacts.length; i++) {
      pressures[contacts[i]] = given[i];
      most = Math.max(most, given[i]);
    }
    if (most === 0) return;
    const height = (LONGEST_BAR * this.half) / most;
    g.beginPath();
    for (let t = 0; t < body.triangles.length; t += 3) {
      const vertices = [body.triangles[t], body.triangles[t + 1], body.triangles[t + 2]];
      if (vertices.every((v) => pressures[v] === 0)) continue;
      const ends = [0, 1, 2].flatMap((e) => this.crossing(body, plane, vertices[e], vertices[(e + 1) % 3], height) ?? []);
      if (ends.length !== 2) continue;
      const [a, b] = ends;
      for (const [i, q] of [a.at, b.at, b.bar, a.bar].entries()) {
        if (i === 0) g.moveTo(this.x(q), this.y(q));
        else g.lineTo(this.x(q), this.y(q));
      }
      g.closePath();
    }
    g.fillStyle = PRESSURE;
    g.fill();
    for (const v of contacts) pressures[v] = 0;
  }

  /** Where the plane crosses an edge of the skin, and the end of the bar there. */
  private crossing({ positions: x, normals, nLevels }: Body, { normal, offset }: CutPlane, v: number, w: number, height: number) {
    const at = (i: number, from: Float32Array) => new Vector3().fromArray(from, 3 * i * nLevels);
    const p = at(v, x), q = at(w, x);
    const n = new Vector3(...normal);
    const hp = n.dot(p) - offset, hq = n.dot(q) - offset;
    if (hp >= 0 === hq >= 0) return null;
    const share = hp / (hp - hq);
    const pressure = this.pressures[v] + share * (this.pressures[w] - this.pressures[v]);
    const out = at(v, normals).lerp(at(w, normals), share);
    out.addScaledVector(n, -out.dot(n)).normalize();
    const point = p.lerp(q, share);
    return { at: point.toArray(), bar: point.clone().addScaledVector(out, height * pressure).toArray() };
  }

  /** The tool as it is seen along the plane's normal: its parts are convex, so their outlines are those of their
   * corners. */
  private drawTool(g: CanvasRenderingContext2D, tip: Vector3, orientation: Quaternion): void {
    const corner = new Vector3();
    const at: [number, number, number] = [0, 0, 0];
    const path = new Path2D();
    for (const part of this.parts) {
      const outline = hullOf(part.map((c) => {
        corner.copy(c).applyQuaternion(orientation).add(tip).toArray(at);
        return new Vector2(this.x(at), this.y(at));
      }));
      outline.forEach(({ x, y }, i) => (i === 0 ? path.moveTo(x, y) : path.lineTo(x, y)));
      path.closePath();
    }
    // The outline is what a wider, dark tool shows around the light one.
    const { layer } = this;
    if (layer.width !== this.canvas.width || layer.height !== this.canvas.height) [layer.width, layer.height] = [this.canvas.width, this.canvas.height];
    const h = layer.getContext('2d')!;
    h.setTransform(1, 0, 0, 1, 0, 0);
    h.clearRect(0, 0, layer.width, layer.height);
    h.setTransform(g.getTransform());
    h.strokeStyle = '#28323c';
    h.lineWidth = 3;
    h.lineJoin = 'round';
    h.stroke(path);
    h.fillStyle = '#c3ccd4';
    h.fill(path);
    g.save();
    g.setTransform(1, 0, 0, 1, 0, 0);
    g.globalAlpha = 0.72;
    g.drawImage(layer, 0, 0);
    g.restore();
  }

  /** The arrow of the force beside the tool. Returns where its number stands. */
  private drawForce(g: CanvasRenderingContext2D, frame: FrameSnapshot): { x: number; y: number } | null {
    const force = new Vector3().fromArray(frame.force);
    const size = force.length();
    if (size <= LEAST_FORCE) return null;
    while (size > this.scale) this.scale *= this.scale.toExponential()[0] === '2' ? 2.5 : 2;
    const { right, up, half, zoom } = this;
    let [ax, ay] = [force.dot(right) / size, -force.dot(up) / size];
    const inPlane = Math.hypot(ax, ay);
    [ax, ay] = inPlane > 1e-3 ? [ax / inPlane, ay / inPlane] : [0, -1];
    const length = Math.max((size / this.scale) * LONGEST_ARROW * half, 0.14 * half) * zoom;
    // Right of the tool, beginning at the skin at rest.
    const from = new Vector3().fromArray(frame.place).addScaledVector(right, this.reach + 0.22 * half).toArray();
    const [x, y] = [this.x(from), this.y(from)];
    const head = Math.min(13, 0.7 * length);
    const at = (along: number, across: number) => [x + ax * along - ay * across, y + ay * along + ax * across] as const;
    g.beginPath();
    const corners = [at(0, -1.6), at(0, 1.6), at(length - head, 1.6), at(length - head, 0.4 * head), at(length, 0), at(length - head, -0.4 * head), at(length - head, -1.6)];
    corners.forEach(([px, py], i) => (i === 0 ? g.moveTo(px, py) : g.lineTo(px, py)));
    g.closePath();
    g.fillStyle = FORCE;
    g.fill();
    const [tx, ty] = at(length, 0);
    return { x: Math.min(tx, this.width - 34), y: Math.max(ty, 52) };
  }

  /** Where the names of the layers stand, at the left edge. */
  private names(): LensPicture['names'] {
    const { positions: { data: p }, indices, layers } = this.section;
    const low: number[] = [], high: number[] = [];
    // Where the triangles cross an upright line: a coarse mesh may have no corner near the edge.
    const line = NAMES * this.width;
    for (let t = 0; t < indices.length; t++) {
      const a = indices.data[t], b = indices.data[t % 3 === 2 ? t - 2 : t + 1];
      const ax = this.x(p, 3 * a), bx = this.x(p, 3 * b);
      if (ax >= line === bx >= line) continue;
      const ay = this.y(p, 3 * a), by = this.y(p, 3 * b);
      const y = Math.min(Math.max(ay + ((line - ax) / (bx - ax)) * (by - ay), 0), this.height);
      const layer = layers.data[a];
      low[layer] = Math.min(low[layer] ?? Infinity, y);
      high[layer] = Math.max(high[layer] ?? -Infinity, y);
    }
    return low.flatMap((y, layer) => (high[layer] - y >= ROOM_FOR_NAME ? [{ layer, y: (y + high[layer]) / 2 }] : []));
  }
}

/** The lens in a picture of this size, px. */
function placeIn(size: Vector2): LensPicture['place'] {
  const width = Math.round(Math.min(Math.max(SHARE * size.x, LEAST_WIDTH), MOST_WIDTH, size.x - 2 * MARGIN.right, (MOST_HEIGHT * size.y) / ASPECT));
  return { x: Math.round(size.x - MARGIN.right - width), y: MARGIN.top, width, height: Math.round(ASPECT * width) };
}

/** The corners of each group of a geometry, each place once. */
function partsOf(geometry: BufferGeometry): Vector3[][] {
  const { index } = geometry;
  const positions = geometry.getAttribute('position');
  const whole = { start: 0, count: index?.count ?? positions.count };
  const parts = (geometry.groups.length > 0 ? geometry.groups : [whole]).map(({ start, count }) => {
    const found = new Map<string, Vector3>();
    for (let i = start; i < start + count; i++) {
      const corner = new Vector3().fromBufferAttribute(positions, index?.getX(i) ?? i);
      found.set(corner.toArray().map((x) => Math.round(x * 1e6)).join(), corner);
    }
    return [...found.values()];
  });
  geometry.dispose();
  return parts;
}

/** The corners of the convex hull of points in a plane, in order. */
function hullOf(points: Vector2[]): Vector2[] {
  points.sort((a, b) => a.x - b.x || a.y - b.y);
  /** Of the points in this order, the chain on the right of the way. */
  const chain = (along: Vector2[]) => {
    const kept: Vector2[] = [];
    for (const p of along) {
      while (kept.length > 1) {
        const [a, b] = kept.slice(-2);
        if ((b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x) > 0) break;
        kept.pop();
      }
      kept.push(p);
    }
    return kept.slice(0, -1);
  };
  return [...chain(points), ...chain([...points].reverse())];
}

function apart(p: Float32Array, a: number, b: number): number {
  return Math.hypot(p[a] - p[b], p[a + 1] - p[b + 1], p[a + 2] - p[b + 2]);
}

function darker(hex: string): string {
  const n = parseInt(hex.slice(1), 16);
  return `rgb(${[n >> 16, (n >> 8) & 255, n & 255].map((c) => Math.round(0.45 * c)).join(' ')})`;
}
