// Made from crates/palpa-viewer/src/wire.rs by its tests; do not edit.

export const SNAPSHOT_VERSION = 5;

class Reader {
  private at = 0;
  private readonly view: DataView;
  constructor(private readonly buffer: ArrayBuffer) {
    this.view = new DataView(buffer);
  }
  private take(size: number, n = 1): number {
    const from = Math.ceil(this.at / size) * size;
    this.at = from + size * n;
    if (this.at > this.buffer.byteLength) throw new Error('snapshot is cut off');
    return from;
  }
  u32(): number {
    return this.view.getUint32(this.take(4), true);
  }
  f64(): number {
    return this.view.getFloat64(this.take(8), true);
  }
  u8s(): Uint8Array {
    const n = this.u32();
    return new Uint8Array(this.buffer, this.take(1, n), n);
  }
  u16s(): Uint16Array {
    const n = this.u32();
    return new Uint16Array(this.buffer, this.take(2, n), n);
  }
  i16s(): Int16Array {
    const n = this.u32();
    return new Int16Array(this.buffer, this.take(2, n), n);
  }
  u32s(): Uint32Array {
    const n = this.u32();
    return new Uint32Array(this.buffer, this.take(4, n), n);
  }
  f32s(): Float32Array {
    const n = this.u32();
    return new Float32Array(this.buffer, this.take(4, n), n);
  }
}

/** A body at rest. Sent to each page once, and again when the mesh changes. */
export interface MeshSnapshot {
  kind: 1;
  /** Number of the mesh; each frame names the mesh that it belongs to. */
  mesh: number;
  /** Nodes in a column. Node (v, l) of skin vertex v has the index `v * n_levels + l`; level 0 is the skin, the last level is held by bone or base. */
  n_levels: number;
  /** Nodes at rest, m: x, y, z of each in turn. */
  positions: Float32Array;
  /** Triangles of the skin, oriented outward: three vertices each. Under each triangle is one prism per interval between two levels. */
  triangles: Uint32Array;
  /** Index of the layer that each interval belongs to. */
  interval_layer: Uint8Array;
  /** Young's modulus at small strain of every prism, Pa (N/m for bars): prism (t, i) at `t * (n_levels - 1) + i`. */
  stiffness: Float32Array;
  /** Vertices of the bones' surfaces, m; they do not move. */
  bone_positions: Float32Array;
  /** Triangles of the bones' surfaces. */
  bone_triangles: Uint32Array;
}

function readMeshSnapshot(r: Reader): MeshSnapshot {
  return {
    kind: 1,
    mesh: r.u32(),
    n_levels: r.u32(),
    positions: r.f32s(),
    triangles: r.u32s(),
    interval_layer: r.u8s(),
    stiffness: r.f32s(),
    bone_positions: r.f32s(),
    bone_triangles: r.u32s(),
  };
}

/** One moment of the pressed body and of the tool. */
export interface FrameSnapshot {
  kind: 2;
  /** Number of the mesh that the frame belongs to. */
  mesh: number;
  /** Counts the frames. */
  sequence: number;
  /** 1 for a frame of a recording, 0 for a live one. */
  is_replay: number;
  /** Number of the tick of the 1 kHz loop. */
  tick: number;
  /** Time of the tick, s since the engine's start; in a recording, s since its start. */
  time: number;
  /** Position of the device: the tip of the tool as the hand holds it, m. */
  device: [number, number, number];
  /** Position of the tool's tip, m. It differs from the device where the tissue is stiffer than the device can render. */
  tool: [number, number, number];
  /** Orientation of the tool: quaternion i, j, k, w. */
  orientation: [number, number, number, number];
  /** Force on the hand commanded at this tick, N. */
  force: [number, number, number];
  /** Force of the tissue on the hand by the local model, before the limits of the device, N. */
  tissue_force: [number, number, number];
  /** The place of the skin at rest that is nearest to the tool's tip, m. */
  place: [number, number, number];
  /** Depth of the tip below the skin at rest, m. */
  depth: number;
  /** Largest depth that the hand presses there, m; the thickness of the tissue limits it. */
  deepest: number;
  /** Factor on the force, 0 to 1; below 1 after a fault. */
  gain: number;
  /** Number of skin vertices in contact. */
  n_active: number;
  /** Result of the tissue's last step: 0 converged, 1 unfinished, 2 behind the tool, 3 settling, 4 failed. */
  step_status: number;
  /** Faults at this tick, as bits. */
  faults: number;
  /** Force limits reached at this tick, as bits. */
  limits: number;
  /** Length of one unit of `displacements`, m. */
  displacement_unit: number;
  /** Displacements of the nodes: x, y, z of each in turn. */
  displacements: Int16Array;
  /** Vertices of the skin in contact, ascending. */
  contacts: Uint32Array;
  /** Pressure of the tool on each of them, Pa. */
  contact_pressures: Float32Array;
  /** Field in `field_values`: 0 none, 1 von Mises stress (Pa), 2 pressure (Pa), 3 largest stretch. */
  field: number;
  /** Field value that 0 stands for. */
  field_min: number;
  /** Field value that 65535 stands for. */
  field_max: number;
  /** The field at the nodes; empty without a field. */
  field_values: Uint16Array;
}

function readFrameSnapshot(r: Reader): FrameSnapshot {
  return {
    kind: 2,
    mesh: r.u32(),
    sequence: r.u32(),
    is_replay: r.u32(),
    tick: r.f64(),
    time: r.f64(),
    device: [r.f64(), r.f64(), r.f64()],
    tool: [r.f64(), r.f64(), r.f64()],
    orientation: [r.f64(), r.f64(), r.f64(), r.f64()],
    force: [r.f64(), r.f64(), r.f64()],
    tissue_force: [r.f64(), r.f64(), r.f64()],
    place: [r.f64(), r.f64(), r.f64()],
    depth: r.f64(),
    deepest: r.f64(),
    gain: r.f64(),
    n_active: r.u32(),
    step_status: r.u32(),
    faults: r.u32(),
    limits: r.u32(),
    displacement_unit: r.f64(),
    displacements: r.i16s(),
    contacts: r.u32s(),
    contact_pressures: r.f32s(),
    field: r.u32(),
    field_min: r.f64(),
    field_max: r.f64(),
    field_values: r.u16s(),
  };
}

/** The palpation map: the places of the skin that were felt. Sent after every change, a few times a second. */
export interface MapSnapshot {
  kind: 3;
  /** Grows with every change. */
  revision: number;
  /** Places of the skin at rest, m: x, y, z of each in turn. */
  points: Float32Array;
  /** Outward normals there. */
  normals: Float32Array;
  /** Secant stiffness of each place, N/m. */
  stiffness: Float32Array;
  /** By how much each place is stiffer than its surroundings, as a share of them; NaN if too little around it was felt. */
  shares: Float32Array;
  /** Width of each spot (standard deviation), m. */
  widths: Float32Array;
  /** 1 if a place stands out from its surroundings. */
  has_finding: number;
  /** That place, m. */
  finding: [number, number, number];
  /** By how much it is stiffer than its surroundings, as a share of them. */
  finding_share: number;
  /** Number of places that were forgotten, because there were too many. */
  n_forgotten: number;
}

function readMapSnapshot(r: Reader): MapSnapshot {
  return {
    kind: 3,
    revision: r.u32(),
    points: r.f32s(),
    normals: r.f32s(),
    stiffness: r.f32s(),
    shares: r.f32s(),
    widths: r.f32s(),
    has_finding: r.u32(),
    finding: [r.f64(), r.f64(), r.f64()],
    finding_share: r.f64(),
    n_forgotten: r.u32(),
  };
}

export type Snapshot = MeshSnapshot | FrameSnapshot | MapSnapshot;

/** Reads a snapshot; its lists look into `buffer`. Throws when it is of another version or cut off. */
export function readSnapshot(buffer: ArrayBuffer): Snapshot {
  const r = new Reader(buffer);
  const version = r.u32();
  if (version !== SNAPSHOT_VERSION) throw new Error(`snapshot of version ${version}, expected ${SNAPSHOT_VERSION}`);
  const kind = r.u32();
  if (kind === 1) return readMeshSnapshot(r);
  if (kind === 2) return readFrameSnapshot(r);
  if (kind === 3) return readMapSnapshot(r);
  throw new Error(`snapshot of unknown kind ${kind}`);
}
