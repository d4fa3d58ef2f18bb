// A body as it is drawn: its nodes at rest and deformed, the normals of its levels, its open rims.

import { Box3, BufferAttribute, BufferGeometry, Vector3 } from 'three';
import type { FrameSnapshot, MeshSnapshot } from '../generated/wire';
import { fillLoop } from './contour';

export class Body {
  readonly id: number;
  readonly nLevels: number;
  readonly nVertices: number;
  readonly nTriangles: number;
  readonly nNodes: number;
  /** Nodes, node-major; node (v, l) is v * nLevels + l. */
  readonly rest: Float32Array;
  readonly positions: Float32Array;
  /** Normals of nodes, three numbers each; only those of the levels last updated are current. */
  readonly normals: Float32Array;
  /** Normals of the skin at rest, three numbers a vertex. */
  readonly restNormals: Float32Array;
  readonly triangles: Uint32Array;
  readonly intervalLayer: Uint8Array;
  /** The level at which each layer begins. */
  readonly layerStart: number[];
  /** Rim edges, which belong to one triangle only: two vertices each, in the triangle's order. */
  readonly rimEdges: Uint32Array;
  /** For each triangle, bit e is set if its edge from corner e is on a rim. */
  readonly rimBits: Uint8Array;
  /** Triangles of the deepest level, closed over the rims: three nodes each. */
  readonly coreTriangles: Uint32Array;
  /** Number of core triangles under the skin; those after them close the rims. */
  readonly nCoreSides: number;
  private ends: Uint32Array | null = null;
  readonly stiffness: Float32Array;
  readonly bonePositions: Float32Array;
  readonly boneTriangles: Uint32Array;
  /** Smooth normals of the bones, three numbers a point. */
  readonly boneNormals: Float32Array;
  readonly box = new Box3();
  readonly centre = new Vector3();
  readonly radius: number;

  /** `before` is the body on the mesh before; bones that are the same keep their normals. */
  constructor(mesh: MeshSnapshot, before: Body | null = null) {
    this.id = mesh.mesh;
    this.nLevels = mesh.n_levels;
    this.rest = mesh.positions;
    this.positions = mesh.positions.slice();
    this.normals = new Float32Array(mesh.positions.length);
    this.triangles = mesh.triangles;
    this.intervalLayer = mesh.interval_layer;
    this.stiffness = mesh.stiffness;
    this.bonePositions = mesh.bone_positions;
    this.boneTriangles = mesh.bone_triangles;
    const isSame = before !== null && areEqual(before.bonePositions, this.bonePositions) && areEqual(before.boneTriangles, this.boneTriangles);
    this.boneNormals = isSame ? before.boneNormals : smoothNormals(this.bonePositions, this.boneTriangles);
    this.nNodes = mesh.positions.length / 3;
    this.nVertices = this.nNodes / this.nLevels;
    this.nTriangles = mesh.triangles.length / 3;
    this.layerStart = [];
    mesh.interval_layer.forEach((layer, i) => (this.layerStart[layer] ??= i));
    [this.rimEdges, this.rimBits] = rims(mesh.triangles, this.nVertices);

    this.updateNormals([0]);
    this.restNormals = new Float32Array(3 * this.nVertices);
    for (let v = 0; v < this.nVertices; v++) {
      for (let c = 0; c < 3; c++) this.restNormals[3 * v + c] = this.normals[3 * v * this.nLevels + c];
    }

    const last = this.nLevels - 1;
    const core = Array.from(this.triangles, (v) => v * this.nLevels + last);
    for (const loop of rimLoops(this.rimEdges)) {
      const nodes = loop.map((v) => v * this.nLevels + last);
      for (const k of fillLoop(nodes.map((n) => this.rest.subarray(3 * n, 3 * n + 3)))) core.push(nodes[k]);
    }
    this.coreTriangles = Uint32Array.from(core);
    this.nCoreSides = this.nTriangles;

    this.box.setFromArray(this.rest);
    this.box.getCenter(this.centre);
    this.radius = 0.5 * this.box.getSize(new Vector3()).length();
  }

  /** The faces where the body was cut off, from the skin to the core: three nodes each. */
  get endTriangles(): Uint32Array {
    if (this.ends) return this.ends;
    const walls = wallTriangles(this, 0, this.nLevels - 1);
    const core = this.coreTriangles.subarray(3 * this.nCoreSides);
    this.ends = new Uint32Array(walls.length + core.length);
    this.ends.set(walls);
    this.ends.set(core, walls.length);
    return this.ends;
  }

  /** Moves the nodes to their places in a frame. */
  deform(frame: Pick<FrameSnapshot, 'displacements' | 'displacement_unit'>): void {
    const { displacements, displacement_unit: unit } = frame;
    const n = Math.min(displacements.length, this.positions.length);
    for (let i = 0; i < n; i++) this.positions[i] = this.rest[i] + displacements[i] * unit;
  }

  /** Smooth normals of some levels, weighted by area. */
  updateNormals(levels: readonly number[]): void {
    const { positions: x, normals, triangles, nLevels, nVertices } = this;
    for (const level of levels) {
      for (let v = 0; v < nVertices; v++) {
        const at = 3 * (v * nLevels + level);
        normals[at] = normals[at + 1] = normals[at + 2] = 0;
      }
      for (let t = 0; t < triangles.length; t += 3) {
        const a = 3 * (triangles[t] * nLevels + level);
        const b = 3 * (triangles[t + 1] * nLevels + level);
        const c = 3 * (triangles[t + 2] * nLevels + level);
        const ux = x[b] - x[a], uy = x[b + 1] - x[a + 1], uz = x[b + 2] - x[a + 2];
        const vx = x[c] - x[a], vy = x[c + 1] - x[a + 1], vz = x[c + 2] - x[a + 2];
        const nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
        normals[a] += nx; normals[a + 1] += ny; normals[a + 2] += nz;
        normals[b] += nx; normals[b + 1] += ny; normals[b + 2] += nz;
        normals[c] += nx; normals[c + 1] += ny; normals[c + 2] += nz;
      }
      for (let v = 0; v < nVertices; v++) {
        const at = 3 * (v * nLevels + level);
        const scale = 1 / (Math.hypot(normals[at], normals[at + 1], normals[at + 2]) || 1);
        normals[at] *= scale; normals[at + 1] *= scale; normals[at + 2] *= scale;
      }
    }
  }
}

function areEqual(a: ArrayLike<number>, b: ArrayLike<number>): boolean {
  if (a.length !== b.length) return false;
  for (let i = 0; i < a.length; i++) if (a[i] !== b[i]) return false;
  return true;
}

function smoothNormals(positions: Float32Array, triangles: Uint32Array): Float32Array {
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(positions, 3));
  geometry.setIndex(new BufferAttribute(triangles, 1));
  geometry.computeVertexNormals();
  return geometry.getAttribute('normal').array as Float32Array;
}

/** Two triangles for every interval between two levels at every open edge. */
export function wallTriangles({ rimEdges, nLevels }: Pick<Body, 'rimEdges' | 'nLevels'>, from: number, to: number): Uint32Array {
  const out = new Uint32Array((rimEdges.length / 2) * (to - from) * 6);
  let n = 0;
  for (let e = 0; e < rimEdges.length; e += 2) {
    for (let l = from; l < to; l++) {
      const a = rimEdges[e] * nLevels + l, b = rimEdges[e + 1] * nLevels + l;
      out.set([a, a + 1, b, b, a + 1, b + 1], n);
      n += 6;
    }
  }
  return out;
}

/** The edges that belong to one triangle only. */
function rims(triangles: Uint32Array, nVertices: number): [Uint32Array, Uint8Array] {
  const open = new Map<number, number>();
  for (let i = 0; i < triangles.length; i++) {
    const a = triangles[i], b = triangles[i % 3 === 2 ? i - 2 : i + 1];
    const key = Math.min(a, b) * nVertices + Math.max(a, b);
    if (!open.delete(key)) open.set(key, i);
  }
  const edges = new Uint32Array(2 * open.size);
  const bits = new Uint8Array(triangles.length / 3);
  let n = 0;
  for (const i of open.values()) {
    edges[n++] = triangles[i];
    edges[n++] = triangles[i % 3 === 2 ? i - 2 : i + 1];
    bits[Math.floor(i / 3)] |= 1 << i % 3;
  }
  return [edges, bits];
}

function rimLoops(edges: Uint32Array): number[][] {
  const next = new Map<number, number>();
  for (let i = 0; i < edges.length; i += 2) next.set(edges[i], edges[i + 1]);
  const loops: number[][] = [];
  while (next.size > 0) {
    const loop: number[] = [];
    let v: number | undefined = next.keys().next().value;
    while (v !== undefined && next.has(v)) {
      loop.push(v);
      const to: number = next.get(v)!;
      next.delete(v);
      v = to;
    }
    if (loop.length >= 3) loops.push(loop);
  }
  return loops;
}
