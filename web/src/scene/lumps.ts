// Lumps: their surfaces, moved by the tissue around them, and their area in a section.

import { BufferAttribute, BufferGeometry, CapsuleGeometry, FrontSide, Group, Matrix4, Mesh, SphereGeometry, Vector3, type Plane } from 'three';
import type { LumpInfo } from '../generated/api';
import type { Body } from './body';
import { SurfaceMaterial, type SharedUniforms } from './materials';
import type { Section } from './section';
import type { Stage } from './stage';

/** The three tetrahedra of a prism by its diagonals 0–4, 1–5 and 0–5. */
const TETS = [[0, 1, 2, 5], [0, 1, 5, 4], [0, 4, 5, 3]];

export class LumpsView {
  readonly group = new Group();
  private readonly material: SurfaceMaterial;
  private shown: { mesh: Mesh<BufferGeometry, SurfaceMaterial>; rest: Float32Array; nodes: Int32Array; shares: Float32Array }[] = [];
  private key = '';

  constructor(shared: SharedUniforms, stage: Stage, planes: Plane[]) {
    this.material = new SurfaceMaterial(shared, stage.light, planes);
  }

  /** `isTruth`: the lumps of a game's result, which are drawn over everything else. */
  set(lumps: LumpInfo[], body: Body, colour: string, isTruth: boolean): void {
    const key = `${body.id} ${isTruth} ${JSON.stringify(lumps)}`;
    if (key === this.key) return;
    this.key = key;
    this.clear();
    this.material.look({ colour, opacity: isTruth ? 0.8 : 1, isMapped: false, skin: 0.4, side: FrontSide });
    this.material.depthTest = !isTruth;
    for (const lump of lumps) {
      const geometry = shape(lump);
      const rest = (geometry.getAttribute('position').array as Float32Array).slice();
      const n = rest.length / 3;
      const nodes = new Int32Array(4 * n).fill(-1), shares = new Float32Array(4 * n);
      locate(body, rest, nodes, shares);
      geometry.setAttribute('rest', new BufferAttribute(rest, 3));
      geometry.setAttribute('value', new BufferAttribute(new Float32Array(n), 1));
      const mesh = new Mesh(geometry, this.material);
      mesh.frustumCulled = false;
      mesh.renderOrder = isTruth ? 7 : 0;
      this.group.add(mesh);
      this.shown.push({ mesh, rest, nodes, shares });
    }
  }

  /** The body has moved. */
  update(body: Body): void {
    for (const { mesh, rest, nodes, shares } of this.shown) {
      const position = mesh.geometry.getAttribute('position') as BufferAttribute;
      const x = position.array;
      for (let i = 0; i < rest.length / 3; i++) {
        for (let c = 0; c < 3; c++) {
          let moved = 0;
          for (let k = 0; k < 4; k++) {
            const node = nodes[4 * i + k];
            if (node >= 0) moved += shares[4 * i + k] * (body.positions[3 * node + c] - body.rest[3 * node + c]);
          }
          x[3 * i + c] = rest[3 * i + c] + moved;
        }
      }
      position.needsUpdate = true;
      mesh.geometry.computeVertexNormals();
    }
  }

  private clear(): void {
    for (const { mesh } of this.shown) {
      mesh.geometry.dispose();
      mesh.removeFromParent();
    }
    this.shown = [];
  }

  dispose(): void {
    this.clear();
    this.material.dispose();
  }
}

/** The surface of a lump at rest, in the frame of the body. */
function shape({ shape: form, axes, centre }: LumpInfo): BufferGeometry {
  const geometry = form.kind === 'capsule'
    ? new CapsuleGeometry(form.radius, form.length, 10, 28).rotateZ(-Math.PI / 2)
    : new SphereGeometry(1, 32, 20).scale(...(form.kind === 'ellipsoid' ? (form.radii as [number, number, number]) : ([form.radius, form.radius, form.radius] as const)));
  const [a, b, c] = axes.map((v) => new Vector3().fromArray(v));
  return geometry.applyMatrix4(new Matrix4().makeBasis(a, b, c).setPosition(...(centre as [number, number, number])));
}

/** Finds the tetrahedron of the body at rest around each point, and the point's shares of its
 * corners. Points outside get none. */
function locate(body: Body, points: Float32Array, nodes: Int32Array, shares: Float32Array): void {
  const { rest: x, triangles, nLevels } = body;
  const n = points.length / 3;
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < points.length; i++) {
    low[i % 3] = Math.min(low[i % 3], points[i]);
    high[i % 3] = Math.max(high[i % 3], points[i]);
  }
  const prism = [0, 0, 0, 0, 0, 0];
  const w = [0, 0, 0, 0];
  for (let t = 0; t < triangles.length; t += 3) {
    for (let l = 0; l < nLevels - 1; l++) {
      for (let k = 0; k < 3; k++) {
        prism[k] = triangles[t + k] * nLevels + l;
        prism[k + 3] = prism[k] + 1;
      }
      if (!overlaps(x, prism, low, high)) continue;
      for (const tet of TETS) {
        for (let i = 0; i < n; i++) {
          if (nodes[4 * i] >= 0 || !tetShares(x, prism[tet[0]], prism[tet[1]], prism[tet[2]], prism[tet[3]], points, 3 * i, w)) continue;
          for (let k = 0; k < 4; k++) {
            nodes[4 * i + k] = prism[tet[k]];
            shares[4 * i + k] = w[k];
          }
        }
      }
    }
  }
}

function overlaps(x: Float32Array, prism: number[], low: number[], high: number[]): boolean {
  for (let c = 0; c < 3; c++) {
    let min = Infinity, max = -Infinity;
    for (const node of prism) {
      min = Math.min(min, x[3 * node + c]);
      max = Math.max(max, x[3 * node + c]);
    }
    if (max < low[c] || min > high[c]) return false;
  }
  return true;
}

function tetShares(x: Float32Array, a: number, b: number, c: number, d: number, p: Float32Array, at: number, out: number[]): boolean {
  const volume = (o: number, i: number, j: number, k: number, from: ArrayLike<number>) => {
    const ux = x[3 * i] - from[o], uy = x[3 * i + 1] - from[o + 1], uz = x[3 * i + 2] - from[o + 2];
    const vx = x[3 * j] - from[o], vy = x[3 * j + 1] - from[o + 1], vz = x[3 * j + 2] - from[o + 2];
    const wx = x[3 * k] - from[o], wy = x[3 * k + 1] - from[o + 1], wz = x[3 * k + 2] - from[o + 2];
    return ux * (vy * wz - vz * wy) + uy * (vz * wx - vx * wz) + uz * (vx * wy - vy * wx);
  };
  const all = volume(3 * a, b, c, d, x);
  if (all === 0) return false;
  out[0] = volume(at, b, c, d, p) / all;
  out[1] = -volume(at, a, c, d, p) / all;
  out[2] = volume(at, a, b, d, p) / all;
  out[3] = -volume(at, a, b, c, p) / all;
  return out[0] >= -1e-4 && out[1] >= -1e-4 && out[2] >= -1e-4 && out[3] >= -1e-4;
}

/** Below 0 inside a lump, at rest; roughly a distance. */
export function outside({ shape: form, centre, axes }: LumpInfo, x: number, y: number, z: number): number {
  const d = [x - centre[0], y - centre[1], z - centre[2]];
  const p = axes.map((a) => a[0] * d[0] + a[1] * d[1] + a[2] * d[2]);
  if (form.kind === 'capsule') {
    const along = Math.max(-form.length / 2, Math.min(form.length / 2, p[0]));
    return Math.hypot(p[0] - along, p[1], p[2]) - form.radius;
  }
  const r = form.kind === 'ellipsoid' ? form.radii : [form.radius, form.radius, form.radius];
  return (Math.hypot(p[0] / r[0], p[1] / r[1], p[2] / r[2]) - 1) * Math.min(...r);
}

/** From a lump's centre to its farthest point, m. */
export function lumpReach({ shape }: LumpInfo): number {
  return shape.kind === 'capsule' ? shape.radius + shape.length / 2 : shape.kind === 'ellipsoid' ? Math.max(...shape.radii) : shape.radius;
}

/** Area of the section that lies in lumps, m². */
export function lumpArea(section: Section, lumps: LumpInfo[]): number {
  if (lumps.length === 0) return 0;
  const { positions: { data: x }, rest: { data: r }, indices } = section;
  let sum = 0;
  for (const lump of lumps) {
    const reach = lumpReach(lump);
    for (let t = 0; t < indices.length; t += 3) {
      const [a, b, c] = [indices.data[t], indices.data[t + 1], indices.data[t + 2]].map((i) => 3 * i);
      const mx = (r[a] + r[b] + r[c]) / 3 - lump.centre[0], my = (r[a + 1] + r[b + 1] + r[c + 1]) / 3 - lump.centre[1], mz = (r[a + 2] + r[b + 2] + r[c + 2]) / 3 - lump.centre[2];
      const size = Math.hypot(r[b] - r[a], r[b + 1] - r[a + 1], r[b + 2] - r[a + 2]) + Math.hypot(r[c] - r[a], r[c + 1] - r[a + 1], r[c + 2] - r[a + 2]);
      if (mx * mx + my * my + mz * mz > (reach + size) ** 2) continue;
      const u = [x[b] - x[a], x[b + 1] - x[a + 1], x[b + 2] - x[a + 2]], v = [x[c] - x[a], x[c + 1] - x[a + 1], x[c + 2] - x[a + 2]];
      const area = 0.5 * Math.hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]);
      sum += area * shareInside(lump, r, a, b, c);
    }
  }
  return sum;
}

/** Share of a triangle that lies in a lump, sampled at the middles of its 64 equal parts. */
function shareInside(lump: LumpInfo, r: Float32Array, a: number, b: number, c: number): number {
  const n = 8;
  let inside = 0;
  for (let i = 0; i < n; i++) {
    for (let k = 0; k < n - i; k++) {
      for (const [s, t] of i + k < n - 1 ? [[1 / 3, 1 / 3], [2 / 3, 2 / 3]] : [[1 / 3, 1 / 3]]) {
        const q = (i + s) / n, w = (k + t) / n, p = 1 - q - w;
        if (outside(lump, p * r[a] + q * r[b] + w * r[c], p * r[a + 1] + q * r[b + 1] + w * r[c + 1], p * r[a + 2] + q * r[b + 2] + w * r[c + 2]) < 0) inside++;
      }
    }
  }
  return inside / (n * n);
}
