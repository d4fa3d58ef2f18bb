// Reads the body that is exported for ParaView, and cuts it, without anything of the page.

/** @typedef {[number, number, number]} Vec3 */
/** @typedef {{ points: Vec3[], wedges: number[][], layer: number[] }} Body */

/**
 * The arrays of a file: base64 of a length (UInt64) and the values.
 * @param {string} text
 * @returns {Map<string, ArrayLike<number | bigint>>}
 */
function arrays(text) {
  const found = new Map();
  for (const [, type, name, inside] of text.matchAll(/<DataArray type="(\w+)" Name="([^"]*)"[^>]*>\s*([^<]*)<\/DataArray>/g)) {
    const bytes = Buffer.from(inside.trim(), 'base64');
    const length = Number(bytes.readBigUInt64LE(0));
    if (length !== bytes.length - 8) throw new Error(`${name}: ${length} bytes told, ${bytes.length - 8} there`);
    // A copy, for Buffer.from may begin anywhere.
    const data = new Uint8Array(bytes.subarray(8)).buffer;
    const kinds = { Float64: Float64Array, Int64: BigInt64Array, UInt32: Uint32Array, UInt8: Uint8Array };
    found.set(name, new kinds[/** @type {keyof typeof kinds} */ (type)](data));
  }
  return found;
}

/** @param {ArrayLike<number | bigint>} flat @returns {Vec3[]} */
function vectors(flat) {
  return Array.from({ length: flat.length / 3 }, (_, i) => [Number(flat[3 * i]), Number(flat[3 * i + 1]), Number(flat[3 * i + 2])]);
}

/** @param {string} text @returns {Body & { displacement: Vec3[] | null }} */
export function readBody(text) {
  const all = arrays(text);
  const need = (/** @type {string} */ name) => {
    const values = all.get(name);
    if (values === undefined) throw new Error(`no array ${name} among ${[...all.keys()]}`);
    return values;
  };
  const types = need('types');
  if (Array.from(types).some((type) => type !== 13)) throw new Error('cells that are no wedges');
  const nodes = Array.from(need('connectivity'), Number);
  const displacement = all.get('displacement');
  return {
    points: vectors(need('Points')),
    wedges: Array.from({ length: types.length }, (_, i) => nodes.slice(6 * i, 6 * i + 6)),
    layer: Array.from(need('layer'), Number),
    displacement: displacement === undefined ? null : vectors(displacement),
  };
}

const QUADS = [[0, 1, 4, 3], [1, 2, 5, 4], [2, 0, 3, 5]];
const ENDS = [[0, 2, 1], [3, 4, 5]];

/** @param {Vec3[]} points @returns {Vec3} */
const mean = (points) => /** @type {Vec3} */ ([0, 1, 2].map((c) => points.reduce((sum, p) => sum + p[c], 0) / points.length));

/**
 * A wedge as tetrahedra round its middle; each four-sided face as four triangles round the face's:
 * the same from both sides.
 * @param {Vec3[]} corners
 */
function tetrahedra(corners) {
  const middle = mean(corners);
  const faces = ENDS.map((face) => face.map((k) => corners[k]));
  for (const quad of QUADS) {
    const four = quad.map((k) => corners[k]);
    const centre = mean(four);
    four.forEach((corner, k) => faces.push([corner, four[(k + 1) % 4], centre]));
  }
  return faces.map((face) => [...face, middle]);
}

/** @param {Vec3} a @param {Vec3} b @returns {Vec3} */
const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
/** @param {Vec3} a @param {Vec3} b @returns {Vec3} */
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/**
 * Area of the slice of a tetrahedron with heights over a plane.
 * @param {Vec3[]} corners
 * @param {number[]} heights
 */
function slice(corners, heights) {
  const above = [0, 1, 2, 3].filter((k) => heights[k] > 0);
  const below = [0, 1, 2, 3].filter((k) => heights[k] <= 0);
  if (above.length === 0 || below.length === 0) return 0;
  const crossing = (/** @type {number} */ a, /** @type {number} */ b) => {
    const t = heights[a] / (heights[a] - heights[b]);
    return /** @type {Vec3} */ (corners[a].map((x, c) => x + t * (corners[b][c] - x)));
  };
  const area = (/** @type {Vec3} */ a, /** @type {Vec3} */ b, /** @type {Vec3} */ c) => Math.hypot(...cross(minus(b, a), minus(c, a))) / 2;
  if (above.length === 2) {
    const [a, b, c, d] = [[0, 0], [0, 1], [1, 1], [1, 0]].map(([i, k]) => crossing(above[i], below[k]));
    return area(a, b, c) + area(a, c, d);
  }
  const [one, others] = above.length === 1 ? [above[0], below] : [below[0], above];
  const [a, b, c] = others.map((other) => crossing(one, other));
  return area(a, b, c);
}

/**
 * Area of the slice at a place along an axis (0, 1, 2), m², of each layer.
 * @param {Body} body @param {number} axis @param {number} at
 */
export function sliceAreas({ points, wedges, layer }, axis, at) {
  /** @type {number[]} */
  const areas = [];
  wedges.forEach((nodes, cell) => {
    const corners = nodes.map((node) => points[node]);
    const heights = corners.map((corner) => corner[axis] - at);
    if (heights.every((h) => h > 0) || heights.every((h) => h <= 0)) return;
    for (const four of tetrahedra(corners)) {
      areas[layer[cell]] = (areas[layer[cell]] ?? 0) + slice(four, four.map((corner) => corner[axis] - at));
    }
  });
  return Array.from(areas, (area) => area ?? 0);
}

/**
 * Least and greatest coordinate along an axis.
 * @param {Vec3[]} points
 * @param {number} axis
 * @returns {[number, number]}
 */
export function extent(points, axis) {
  let [low, high] = [Infinity, -Infinity];
  for (const point of points) {
    low = Math.min(low, point[axis]);
    high = Math.max(high, point[axis]);
  }
  return [low, high];
}
