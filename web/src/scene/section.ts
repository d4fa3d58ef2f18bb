// The section of a body of prisms by a plane: polygons, one or more per prism, exact for
// its straight edges.
//
// ```text
//        2                  Nodes and edges of a prism. The plane cuts edges; walking round every face, from each edge
//       /|\                 where it leaves the kept side to the next where it comes back, gives directed segments, and
//    2 / | \ 1              those of all faces join to loops. What a face gives depends on the sides of its own nodes
//     0--+--1               alone, so two prisms agree on the face between them and the section has no gaps.
//     | 0|8 |
//    6|  5  |7              edges 0–2 above, 3–5 below, 6–8 upright; faces 0 above, 1 below, 2–4 sides
//     | / \ |
//     3-----4
// ```

import type { Body } from './body';
import type { CutPlane } from './contour';

const EDGES = [[0, 1], [1, 2], [2, 0], [3, 4], [4, 5], [5, 3], [0, 3], [1, 4], [2, 5]];
const FACES = [[0, 1, 2], [3, 5, 4], [0, 3, 4, 1], [1, 4, 5, 2], [2, 5, 3, 0]];

/** The edges of a loop in order, each with the face that holds the segment to the next edge. */
interface Loop {
  edges: number[];
  faces: number[];
}

/** The loops of a prism, by the nodes on the positive side as bits. */
const CASES: Loop[][] = Array.from({ length: 64 }, (_, mask) => loopsOf(mask));

function loopsOf(mask: number): Loop[] {
  const side = (node: number) => (mask >> node) & 1;
  const edgeOf = (a: number, b: number) => EDGES.findIndex(([p, q]) => (p === a && q === b) || (p === b && q === a));
  const next = new Map<number, [edge: number, face: number]>();
  FACES.forEach((face, f) => {
    face.forEach((a, i) => {
      const b = face[(i + 1) % face.length];
      if (!side(a) || side(b)) return;
      for (let k = 1; k < face.length; k++) {
        const c = face[(i + k) % face.length], d = face[(i + k + 1) % face.length];
        if (!side(c) && side(d)) {
          next.set(edgeOf(a, b), [edgeOf(c, d), f]);
          return;
        }
      }
    });
  });
  const loops: Loop[] = [];
  while (next.size > 0) {
    const loop: Loop = { edges: [], faces: [] };
    let at: number = next.keys().next().value!;
    for (let to = next.get(at); to !== undefined; to = next.get(at)) {
      next.delete(at);
      loop.edges.push(at);
      loop.faces.push(to[1]);
      at = to[0];
    }
    loops.push(loop);
  }
  return loops;
}

/** A growing list of numbers, reused for every cut. */
class Grown<T extends Float32Array | Uint32Array> {
  length = 0;
  constructor(public data: T) {}
  /** Makes room for `n` more. */
  reserve(n: number): void {
    if (this.length + n <= this.data.length) return;
    // Whole corners and segments, so that attributes end with the buffer.
    const wider = new (this.data.constructor as new (n: number) => T)(12 * Math.ceil((this.length + n) / 6));
    wider.set(this.data.subarray(0, this.length));
    this.data = wider;
  }
}

/** Values that colour the section, of nodes or of prisms. */
export interface SectionValues {
  nodes: Float32Array | null;
  prisms: Float32Array | null;
}

export class Section {
  /** Corners: place, place at rest, value, layer. */
  readonly positions = new Grown(new Float32Array(3 * (1 << 14)));
  readonly rest = new Grown(new Float32Array(3 * (1 << 14)));
  readonly values = new Grown(new Float32Array(3 * (1 << 12)));
  readonly layers = new Grown(new Float32Array(3 * (1 << 12)));
  readonly indices = new Grown(new Uint32Array(3 * (1 << 14)));
  /** Segments between layers and around the body: both ends. */
  readonly outline = new Grown(new Float32Array(3 * (1 << 13)));
  /** Segments on the faces of all prisms. */
  readonly wire = new Grown(new Float32Array(3 * (1 << 13)));
  /** Area of each layer, m². */
  area: number[] = [];
  private height = new Float32Array(0);
  private state = new Uint8Array(0);
  private readonly corner = new Float64Array(6 * 16);

  /** Cuts the deformed body, or only its columns `near` a place. Areas include the layers that are not shown. */
  cut(body: Body, plane: CutPlane, values: SectionValues, shown: readonly boolean[], near?: { middle: readonly number[]; radius: number }): void {
    const { positions: x, rest, nLevels, nVertices, triangles, intervalLayer, rimBits, nNodes } = body;
    for (const list of [this.positions, this.rest, this.values, this.layers, this.indices, this.outline, this.wire]) list.length = 0;
    this.area = body.layerStart.map(() => 0);
    if (this.height.length < nNodes) this.height = new Float32Array(nNodes);
    if (this.state.length < nVertices) this.state = new Uint8Array(nVertices);
    const { height, state } = this;
    const [nx, ny, nz] = plane.normal;
    // Columns that lie wholly on one side (1 or 2) are found first, so that their
    // prisms are skipped.
    for (let v = 0, node = 0; v < nVertices; v++) {
      let sides = 0;
      if (near && (x[3 * node] - near.middle[0]) ** 2 + (x[3 * node + 1] - near.middle[1]) ** 2 + (x[3 * node + 2] - near.middle[2]) ** 2 > near.radius ** 2) {
        state[v] = 0;
        node += nLevels;
        continue;
      }
      for (let l = 0; l < nLevels; l++, node++) {
        const h = nx * x[3 * node] + ny * x[3 * node + 1] + nz * x[3 * node + 2] - plane.offset;
        height[node] = h;
        sides |= h >= 0 ? 1 : 2;
      }
      state[v] = sides;
    }
    const nodes = [0, 0, 0, 0, 0, 0];
    for (let t = 0; 3 * t < triangles.length; t++) {
      const va = triangles[3 * t], vb = triangles[3 * t + 1], vc = triangles[3 * t + 2];
      if ((state[va] | state[vb] | state[vc]) !== 3 || state[va] === 0 || state[vb] === 0 || state[vc] === 0) continue;
      const a = va * nLevels, b = vb * nLevels, c = vc * nLevels;
      let above = (height[a] >= 0 ? 1 : 0) | (height[b] >= 0 ? 2 : 0) | (height[c] >= 0 ? 4 : 0);
      for (let i = 0; i < nLevels - 1; i++) {
        const below = (height[a + i + 1] >= 0 ? 1 : 0) | (height[b + i + 1] >= 0 ? 2 : 0) | (height[c + i + 1] >= 0 ? 4 : 0);
        const mask = above | (below << 3);
        above = below;
        if (mask === 0 || mask === 63) continue;
        nodes[0] = a + i; nodes[1] = b + i; nodes[2] = c + i;
        nodes[3] = a + i + 1; nodes[4] = b + i + 1; nodes[5] = c + i + 1;
        const layer = intervalLayer[i];
        // Faces on which a line between layers runs: above where a layer begins, below at the
        // base, sides on rims.
        const isLast = i === nLevels - 2 || (intervalLayer[i + 1] !== layer && shown[intervalLayer[i + 1]] === false);
        const lined = (i === 0 || intervalLayer[i - 1] !== layer ? 1 : 0) | (isLast ? 2 : 0) | (rimBits[t] << 2);
        for (const loop of CASES[mask]) {
          this.polygon(loop, nodes, x, rest, values, t * (nLevels - 1) + i, layer, shown[layer] !== false, lined, plane.normal);
        }
      }
    }
  }

  private polygon(
    loop: Loop, nodes: number[], x: Float32Array, rest: Float32Array, values: SectionValues, prism: number,
    layer: number, isShown: boolean, lined: number, normal: readonly number[],
  ): void {
    const { height, corner } = this;
    const n = loop.edges.length;
    for (let k = 0; k < n; k++) {
      const edge = EDGES[loop.edges[k]];
      const p = nodes[edge[0]], q = nodes[edge[1]];
      // From the lower node, so that all prisms at the edge get exactly the same point.
      const from = p < q ? p : q, to = p < q ? q : p;
      const t = height[from] / (height[from] - height[to]);
      for (let c = 0; c < 3; c++) {
        corner[8 * k + c] = x[3 * from + c] + t * (x[3 * to + c] - x[3 * from + c]);
        corner[8 * k + 3 + c] = rest[3 * from + c] + t * (rest[3 * to + c] - rest[3 * from + c]);
      }
      corner[8 * k + 6] = values.prisms ? values.prisms[prism] : values.nodes ? values.nodes[from] + t * (values.nodes[to] - values.nodes[from]) : 0;
    }
    let area = 0;
    for (let k = 1; k < n - 1; k++) {
      const o = 0, p = 8 * k, q = 8 * (k + 1);
      const ux = corner[p] - corner[o], uy = corner[p + 1] - corner[o + 1], uz = corner[p + 2] - corner[o + 2];
      const vx = corner[q] - corner[o], vy = corner[q + 1] - corner[o + 1], vz = corner[q + 2] - corner[o + 2];
      area += normal[0] * (uy * vz - uz * vy) + normal[1] * (uz * vx - ux * vz) + normal[2] * (ux * vy - uy * vx);
    }
    this.area[layer] += 0.5 * Math.abs(area);
    if (!isShown) return;

    const { positions, rest: rests, values: vals, layers, indices, outline, wire } = this;
    const first = layers.length;
    positions.reserve(3 * n); rests.reserve(3 * n); vals.reserve(n); layers.reserve(n);
    indices.reserve(3 * n); outline.reserve(6 * n); wire.reserve(6 * n);
    for (let k = 0; k < n; k++) {
      for (let c = 0; c < 3; c++) {
        positions.data[positions.length++] = corner[8 * k + c];
        rests.data[rests.length++] = corner[8 * k + 3 + c];
      }
      vals.data[vals.length++] = corner[8 * k + 6];
      layers.data[layers.length++] = layer;
      const lines = (lined >> loop.faces[k]) & 1 ? outline : wire;
      const to = 8 * ((k + 1) % n);
      for (let c = 0; c < 3; c++) lines.data[lines.length++] = corner[8 * k + c];
      for (let c = 0; c < 3; c++) lines.data[lines.length++] = corner[to + c];
    }
    for (let k = 1; k < n - 1; k++) {
      indices.data[indices.length++] = first;
      indices.data[indices.length++] = first + k;
      indices.data[indices.length++] = first + k + 1;
    }
  }
}
