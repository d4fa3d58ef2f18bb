// Cuts of closed surfaces by a plane: loops, and the areas they enclose.

import { ShapeUtils, Vector2 } from 'three';

/** The points x with normal · x = offset; the normal is a unit vector. */
export interface CutPlane {
  normal: [number, number, number];
  offset: number;
}

/** Two unit vectors in a plane, right-handed with its normal. */
export function planeAxes(n: readonly number[]): [[number, number, number], [number, number, number]] {
  const k = Math.abs(n[2]) < 0.9 ? [0, 0, 1] : [0, 1, 0];
  const u: [number, number, number] = [k[1] * n[2] - k[2] * n[1], k[2] * n[0] - k[0] * n[2], k[0] * n[1] - k[1] * n[0]];
  const s = 1 / Math.hypot(...u);
  u[0] *= s; u[1] *= s; u[2] *= s;
  return [u, [n[1] * u[2] - n[2] * u[1], n[2] * u[0] - n[0] * u[2], n[0] * u[1] - n[1] * u[0]]];
}

/** Loops in which a plane cuts a triangulated surface: x, y, z one after the other. Loops left open
 * by holes are closed straight. */
export function contourLoops(positions: Float32Array, triangles: Uint32Array, plane: CutPlane): number[][] {
  const [nx, ny, nz] = plane.normal;
  const nNodes = positions.length / 3;
  const height = new Float64Array(nNodes);
  for (let i = 0; i < nNodes; i++) {
    height[i] = nx * positions[3 * i] + ny * positions[3 * i + 1] + nz * positions[3 * i + 2] - plane.offset;
  }
  // Every point of the contour lies on an edge of the surface, which joins its two segments.
  const points = new Map<number, number[]>();
  const links = new Map<number, number[]>();
  const cross = (a: number, b: number): number => {
    const key = Math.min(a, b) * nNodes + Math.max(a, b);
    if (!points.has(key)) {
      const t = height[a] / (height[a] - height[b]);
      points.set(key, [0, 1, 2].map((c) => positions[3 * a + c] + t * (positions[3 * b + c] - positions[3 * a + c])));
      links.set(key, []);
    }
    return key;
  };
  for (let t = 0; t < triangles.length; t += 3) {
    const a = triangles[t], b = triangles[t + 1], c = triangles[t + 2];
    const sa = height[a] >= 0, sb = height[b] >= 0, sc = height[c] >= 0;
    if (sa === sb && sb === sc) continue;
    const alone = sb === sc ? [a, b, c] : sa === sc ? [b, c, a] : [c, a, b];
    const p = cross(alone[0], alone[1]), q = cross(alone[0], alone[2]);
    links.get(p)!.push(q);
    links.get(q)!.push(p);
  }
  const seen = new Set<number>();
  const loops: number[][] = [];
  const walk = (start: number) => {
    const loop: number[] = [];
    let at: number | undefined = start;
    while (at !== undefined) {
      seen.add(at);
      loop.push(...points.get(at)!);
      at = links.get(at)!.find((to) => !seen.has(to));
    }
    if (loop.length >= 9) loops.push(loop);
  };
  // Ends first, so that an open chain is followed from end to end.
  for (const [key, to] of links) if (to.length === 1 && !seen.has(key)) walk(key);
  for (const key of links.keys()) if (!seen.has(key)) walk(key);
  return loops;
}

/** Triangles that fill loops of a plane by the even-odd rule: x, y, z of corners
 * one after the other. */
export function fillLoops(loops: number[][], plane: CutPlane): number[] {
  const [u, v] = planeAxes(plane.normal);
  const flat = loops.map((loop) => {
    const points: Vector2[] = [];
    for (let i = 0; i < loop.length; i += 3) {
      points.push(new Vector2(
        u[0] * loop[i] + u[1] * loop[i + 1] + u[2] * loop[i + 2],
        v[0] * loop[i] + v[1] * loop[i + 1] + v[2] * loop[i + 2],
      ));
    }
    return points;
  });
  const around = flat.map((loop, i) => flat.flatMap((other, k) => (k !== i && isInside(loop[0], other) ? [k] : [])));
  const out: number[] = [];
  flat.forEach((outer, i) => {
    if (around[i].length % 2 === 1) return;
    const holes = flat.flatMap((_, k) => (around[k].length === around[i].length + 1 && around[k].includes(i) ? [k] : []));
    const corners = [i, ...holes].flatMap((k) => loops[k].length / 3 === flat[k].length ? Array.from(flat[k], (_, p) => [k, p] as const) : []);
    for (const face of ShapeUtils.triangulateShape(outer, holes.map((k) => flat[k]))) {
      for (const corner of face) {
        const [k, p] = corners[corner];
        out.push(loops[k][3 * p], loops[k][3 * p + 1], loops[k][3 * p + 2]);
      }
    }
  });
  return out;
}

/** Triangles of corners' indices that fill one loop in space, which need not be quite flat. */
export function fillLoop(points: ArrayLike<number>[]): number[] {
  // Newell's normal.
  const n = [0, 0, 0];
  points.forEach((p, i) => {
    const q = points[(i + 1) % points.length];
    n[0] += (p[1] - q[1]) * (p[2] + q[2]);
    n[1] += (p[2] - q[2]) * (p[0] + q[0]);
    n[2] += (p[0] - q[0]) * (p[1] + q[1]);
  });
  const length = Math.hypot(n[0], n[1], n[2]);
  if (length === 0) return [];
  const [u, v] = planeAxes(n.map((c) => c / length));
  const flat = points.map((p) => new Vector2(u[0] * p[0] + u[1] * p[1] + u[2] * p[2], v[0] * p[0] + v[1] * p[1] + v[2] * p[2]));
  return ShapeUtils.triangulateShape(flat, []).flat();
}

function isInside(p: Vector2, loop: Vector2[]): boolean {
  let inside = false;
  for (let i = 0, k = loop.length - 1; i < loop.length; k = i++) {
    const a = loop[i], b = loop[k];
    if (a.y > p.y !== b.y > p.y && p.x < a.x + ((p.y - a.y) / (b.y - a.y)) * (b.x - a.x)) inside = !inside;
  }
  return inside;
}
