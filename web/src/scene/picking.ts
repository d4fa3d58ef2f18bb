// Picking: from a ray to the place at rest that it meets.

import { Vector3, type Ray } from 'three';
import type { Body } from './body';
import type { CutPlane } from './contour';
import type { Picked, Vec3 } from './options';
import type { Section } from './section';

interface Hit {
  distance: number;
  /** At rest. */
  point: Vec3;
  normal: Vec3;
  /** Corners (nodes or vertices) and their shares. */
  triangle: number;
  shares: Vec3;
}

const EPS = 1e-12;

/** The first triangle that a ray meets from its outer side, with shares of its corners. */
function cast(ray: Ray, x: Float32Array, triangles: Uint32Array | number[], n: number, stride: number, isTwoSided: boolean, isKept: (p: Vector3) => boolean) {
  const { origin: o, direction: d } = ray;
  let best: { distance: number; triangle: number; shares: Vec3 } | null = null;
  const p = new Vector3();
  for (let t = 0; t < n; t += 3) {
    const a = 3 * triangles[t] * stride, b = 3 * triangles[t + 1] * stride, c = 3 * triangles[t + 2] * stride;
    const ux = x[b] - x[a], uy = x[b + 1] - x[a + 1], uz = x[b + 2] - x[a + 2];
    const vx = x[c] - x[a], vy = x[c + 1] - x[a + 1], vz = x[c + 2] - x[a + 2];
    const px = d.y * vz - d.z * vy, py = d.z * vx - d.x * vz, pz = d.x * vy - d.y * vx;
    const det = ux * px + uy * py + uz * pz;
    if (isTwoSided ? Math.abs(det) < EPS : det < EPS) continue;
    const sx = o.x - x[a], sy = o.y - x[a + 1], sz = o.z - x[a + 2];
    const s = (sx * px + sy * py + sz * pz) / det;
    if (s < 0 || s > 1) continue;
    const qx = sy * uz - sz * uy, qy = sz * ux - sx * uz, qz = sx * uy - sy * ux;
    const r = (d.x * qx + d.y * qy + d.z * qz) / det;
    if (r < 0 || s + r > 1) continue;
    const distance = (vx * qx + vy * qy + vz * qz) / det;
    if (distance <= 0 || (best && distance >= best.distance)) continue;
    if (!isKept(ray.at(distance, p))) continue;
    best = { distance, triangle: t, shares: [1 - s - r, s, r] };
  }
  return best;
}

/** What a ray may meet besides the skin. */
interface Pickable {
  section: { section: Section; plane: CutPlane } | null;
  bones: boolean;
  isKept: (p: Vector3) => boolean;
}

/** The nearest of skin, section and bones. */
export function pickNearest(ray: Ray, body: Body, pickable: Pickable): Picked | null {
  return nearestPart(ray, body, pickable).picked;
}

function nearestPart(ray: Ray, body: Body, { section, bones, isKept }: Pickable): { picked: Picked | null; distance: number } {
  const hits = [
    { part: 'skin' as const, hit: pickSkin(ray, body, false, isKept) },
    { part: 'section' as const, hit: section && pickSection(ray, section.section, section.plane) },
    { part: 'bone' as const, hit: bones ? pickBone(ray, body, isKept) : null },
  ];
  let best: Picked | null = null;
  let nearest = Infinity;
  for (const { part, hit } of hits) {
    if (!hit || hit.distance >= nearest) continue;
    nearest = hit.distance;
    best = { point: hit.point, normal: hit.normal, part };
  }
  return { picked: best, distance: nearest };
}

/** The part under the pointer that is not skin: an end or side where the body was cut off, a section, a bone. */
export type NoSkin = 'end' | 'section' | 'bone';

/** The part under a ray that is nearer than the skin and is not skin; null beside the body. */
export function pickNoSkin(ray: Ray, body: Body, pickable: Pickable): NoSkin | null {
  const { isKept } = pickable;
  const ends = cast(ray, body.rest, body.endTriangles, body.endTriangles.length, 1, true, isKept);
  const { picked, distance } = nearestPart(ray, body, pickable);
  if (ends && ends.distance < distance) return 'end';
  return picked && picked.part !== 'skin' ? picked.part : null;
}

/** Picks the skin, deformed or at rest, outside the part that is cut away. */
export function pickSkin(ray: Ray, body: Body, atRest: boolean, isKept: (p: Vector3) => boolean): Hit | null {
  const hit = cast(ray, atRest ? body.rest : body.positions, body.triangles, body.triangles.length, body.nLevels, false, isKept);
  return hit && { ...hit, ...skinAt(body, hit.triangle, hit.shares) };
}

/** The point and normal of the skin at rest in a triangle (its first index). */
function skinAt(body: Body, triangle: number, shares: Vec3): { point: Vec3; normal: Vec3 } {
  const point: Vec3 = [0, 0, 0], normal: Vec3 = [0, 0, 0];
  for (let k = 0; k < 3; k++) {
    const v = body.triangles[triangle + k];
    for (let c = 0; c < 3; c++) {
      point[c] += shares[k] * body.rest[3 * v * body.nLevels + c];
      normal[c] += shares[k] * body.restNormals[3 * v + c];
    }
  }
  const scale = 1 / (Math.hypot(...normal) || 1);
  return { point, normal: [normal[0] * scale, normal[1] * scale, normal[2] * scale] };
}

function pickBone(ray: Ray, body: Body, isKept: (p: Vector3) => boolean): Hit | null {
  const hit = cast(ray, body.bonePositions, body.boneTriangles, body.boneTriangles.length, 1, false, isKept);
  if (!hit) return null;
  const at = ray.at(hit.distance, new Vector3());
  return { ...hit, point: at.toArray() as Vec3, normal: ray.direction.clone().negate().toArray() as Vec3 };
}

function pickSection(ray: Ray, section: Section, plane: CutPlane): Hit | null {
  const hit = cast(ray, section.positions.data, section.indices.data, section.indices.length, 1, true, () => true);
  if (!hit) return null;
  const point: Vec3 = [0, 0, 0];
  for (let k = 0; k < 3; k++) {
    for (let c = 0; c < 3; c++) point[c] += hit.shares[k] * section.rest.data[3 * section.indices.data[hit.triangle + k] + c];
  }
  const side = ray.direction.dot(new Vector3(...plane.normal)) > 0 ? -1 : 1;
  return { ...hit, point, normal: plane.normal.map((c) => side * c) as Vec3 };
}

/** The place of the skin at rest that is nearest to a point: its triangle's first index, and
 * shares of the corners. */
export function nearestOnSkin(body: Body, p: Vec3): { triangle: number; shares: Vec3; point: Vec3; normal: Vec3 } {
  const { triangles, rest, nLevels } = body;
  let best = Infinity, triangle = 0;
  let shares: Vec3 = [1, 0, 0];
  for (let t = 0; t < triangles.length; t += 3) {
    const a = 3 * triangles[t] * nLevels;
    const s = closest(p, rest, a, 3 * triangles[t + 1] * nLevels, 3 * triangles[t + 2] * nLevels);
    if (s.distanceSq < best) {
      best = s.distanceSq;
      triangle = t;
      shares = s.shares;
    }
  }
  return { triangle, shares, ...skinAt(body, triangle, shares) };
}

/** The nearest point of a triangle; after Ericson, Real-Time Collision Detection (2005), §5.1.5. */
function closest(p: Vec3, x: Float32Array, a: number, b: number, c: number): { distanceSq: number; shares: Vec3 } {
  const ab = [x[b] - x[a], x[b + 1] - x[a + 1], x[b + 2] - x[a + 2]];
  const ac = [x[c] - x[a], x[c + 1] - x[a + 1], x[c + 2] - x[a + 2]];
  const dot = (u: number[], v: number[]) => u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
  const from = (k: number) => [p[0] - x[k], p[1] - x[k + 1], p[2] - x[k + 2]];
  const ap = from(a), bp = from(b), cp = from(c);
  const d1 = dot(ab, ap), d2 = dot(ac, ap), d3 = dot(ab, bp), d4 = dot(ac, bp), d5 = dot(ab, cp), d6 = dot(ac, cp);
  const va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
  let shares: Vec3;
  if (d1 <= 0 && d2 <= 0) shares = [1, 0, 0];
  else if (d3 >= 0 && d4 <= d3) shares = [0, 1, 0];
  else if (d6 >= 0 && d5 <= d6) shares = [0, 0, 1];
  else if (vc <= 0 && d1 >= 0 && d3 <= 0) shares = [1 - d1 / (d1 - d3), d1 / (d1 - d3), 0];
  else if (vb <= 0 && d2 >= 0 && d6 <= 0) shares = [1 - d2 / (d2 - d6), 0, d2 / (d2 - d6)];
  else if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const t = (d4 - d3) / (d4 - d3 + d5 - d6);
    shares = [0, 1 - t, t];
  } else {
    const s = 1 / (va + vb + vc);
    shares = [va * s, vb * s, vc * s];
  }
  let distanceSq = 0;
  for (let k = 0; k < 3; k++) {
    const q = shares[0] * x[a + k] + shares[1] * x[b + k] + shares[2] * x[c + k];
    distanceSq += (p[k] - q) ** 2;
  }
  return { distanceSq, shares };
}
