//! Snapshots: the binary messages with the picture. These types are the only definition of the
//! format; the page's reader is generated from them.
//!
//! Each snapshot is one message: version (u32), kind (u32), then the fields in order,
//! little-endian. A number starts at a multiple of its own size. A list is its length (u32), then
//! its items, which start at a multiple of their size. So a page can use lists in place, without a
//! copy.

use std::fmt::Write as _;

/// Increased with every change of a field.
pub const SNAPSHOT_VERSION: u32 = 5;

/// A type that a snapshot can hold.
trait Wire {
    /// Its type in TypeScript.
    const TYPE: &'static str;
    const READ: &'static str;
    fn put(&self, out: &mut Vec<u8>);
}

fn align(out: &mut Vec<u8>, to: usize) {
    out.resize(out.len().next_multiple_of(to), 0);
}

macro_rules! number {
    ($($type:ty, $read:literal, $array:literal;)*) => {$(
        impl Wire for $type {
            const TYPE: &'static str = "number";
            const READ: &'static str = concat!("r.", $read, "()");
            fn put(&self, out: &mut Vec<u8>) {
                align(out, size_of::<$type>());
                out.extend_from_slice(&self.to_le_bytes());
            }
        }
        impl Wire for Vec<$type> {
            const TYPE: &'static str = $array;
            const READ: &'static str = concat!("r.", $read, "s()");
            fn put(&self, out: &mut Vec<u8>) {
                (self.len() as u32).put(out);
                align(out, size_of::<$type>());
                out.extend(self.iter().flat_map(|v| v.to_le_bytes()));
            }
        }
    )*};
}
number! {
    u8, "u8", "Uint8Array";
    u16, "u16", "Uint16Array";
    i16, "i16", "Int16Array";
    u32, "u32", "Uint32Array";
    f32, "f32", "Float32Array";
    f64, "f64", "Float64Array";
}

macro_rules! fixed {
    ($($n:literal, $type:literal, $read:literal;)*) => {$(
        impl Wire for [f64; $n] {
            const TYPE: &'static str = $type;
            const READ: &'static str = $read;
            fn put(&self, out: &mut Vec<u8>) {
                for v in self {
                    v.put(out);
                }
            }
        }
    )*};
}
fixed! {
    3, "[number, number, number]", "[r.f64(), r.f64(), r.f64()]";
    4, "[number, number, number, number]", "[r.f64(), r.f64(), r.f64(), r.f64()]";
}

/// Defines a struct, its encoder, and its part of the page's reader.
macro_rules! snapshot {
    ($(#[doc = $doc:literal])* $name:ident = $kind:literal { $($(#[doc = $field_doc:literal])* $field:ident: $type:ty,)* }) => {
        $(#[doc = $doc])*
        #[derive(Debug, Clone, PartialEq, Default)]
        pub struct $name { $($(#[doc = $field_doc])* pub $field: $type,)* }

        impl $name {
            /// The snapshot as bytes.
            pub fn encode(&self) -> Vec<u8> {
                let mut out = Vec::new();
                SNAPSHOT_VERSION.put(&mut out);
                ($kind as u32).put(&mut out);
                $(self.$field.put(&mut out);)*
                out
            }

            fn typescript(out: &mut String) {
                let docs = [$($doc),*].concat();
                let _ = write!(out, "\n/**{docs} */\nexport interface {} {{\n  kind: {};\n", stringify!($name), $kind);
                $(
                    let docs = [$($field_doc),*].concat();
                    let _ = write!(out, "  /**{docs} */\n  {}: {};\n", stringify!($field), <$type as Wire>::TYPE);
                )*
                let _ = write!(out, "}}\n\nfunction read{}(r: Reader): {} {{\n  return {{\n    kind: {},\n", stringify!($name), stringify!($name), $kind);
                $(let _ = write!(out, "    {}: {},\n", stringify!($field), <$type as Wire>::READ);)*
                out.push_str("  };\n}\n");
            }
        }
    };
}

snapshot! {
    /// A body at rest. Sent to each page once, and again when the mesh changes.
    MeshSnapshot = 1 {
        /// Number of the mesh; each frame names the mesh that it belongs to.
        mesh: u32,
        /// Nodes in a column. Node (v, l) of skin vertex v has the index `v * n_levels + l`; level
        /// 0 is the skin, the last level is held by bone or base.
        n_levels: u32,
        /// Nodes at rest, m: x, y, z of each in turn.
        positions: Vec<f32>,
        /// Triangles of the skin, oriented outward: three vertices each. Under each triangle is one
        /// prism per interval between two levels.
        triangles: Vec<u32>,
        /// Index of the layer that each interval belongs to.
        interval_layer: Vec<u8>,
        /// Young's modulus at small strain of every prism, Pa (N/m for bars): prism (t, i) at
        /// `t * (n_levels - 1) + i`.
        stiffness: Vec<f32>,
        /// Vertices of the bones' surfaces, m; they do not move.
        bone_positions: Vec<f32>,
        /// Triangles of the bones' surfaces.
        bone_triangles: Vec<u32>,
    }
}

snapshot! {
    /// One moment of the pressed body and of the tool.
    FrameSnapshot = 2 {
        /// Number of the mesh that the frame belongs to.
        mesh: u32,
        /// Counts the frames.
        sequence: u32,
        /// 1 for a frame of a recording, 0 for a live one.
        is_replay: u32,
        /// Number of the tick of the 1 kHz loop.
        tick: f64,
        /// Time of the tick, s since the engine's start; in a recording, s since its start.
        time: f64,
        /// Position of the device: the tip of the tool as the hand holds it, m.
        device: [f64; 3],
        /// Position of the tool's tip, m. It differs from the device where the tissue is stiffer
        /// than the device can render.
        tool: [f64; 3],
        /// Orientation of the tool: quaternion i, j, k, w.
        orientation: [f64; 4],
        /// Force on the hand commanded at this tick, N.
        force: [f64; 3],
        /// Force of the tissue on the hand by the local model, before the limits of the device, N.
        tissue_force: [f64; 3],
        /// The place of the skin at rest that is nearest to the tool's tip, m.
        place: [f64; 3],
        /// Depth of the tip below the skin at rest, m.
        depth: f64,
        /// Largest depth that the hand presses there, m; the thickness of the tissue limits it.
        deepest: f64,
        /// Factor on the force, 0 to 1; below 1 after a fault.
        gain: f64,
        /// Number of skin vertices in contact.
        n_active: u32,
        /// Result of the tissue's last step: 0 converged, 1 unfinished, 2 behind the tool, 3
        /// settling, 4 failed.
        step_status: u32,
        /// Faults at this tick, as bits.
        faults: u32,
        /// Force limits reached at this tick, as bits.
        limits: u32,
        /// Length of one unit of `displacements`, m.
        displacement_unit: f64,
        /// Displacements of the nodes: x, y, z of each in turn.
        displacements: Vec<i16>,
        /// Vertices of the skin in contact, ascending.
        contacts: Vec<u32>,
        /// Pressure of the tool on each of them, Pa.
        contact_pressures: Vec<f32>,
        /// Field in `field_values`: 0 none, 1 von Mises stress (Pa), 2 pressure (Pa), 3 largest
        /// stretch.
        field: u32,
        /// Field value that 0 stands for.
        field_min: f64,
        /// Field value that 65535 stands for.
        field_max: f64,
        /// The field at the nodes; empty without a field.
        field_values: Vec<u16>,
    }
}

snapshot! {
    /// The palpation map: the places of the skin that were felt. Sent after every change, a few times a second.
    MapSnapshot = 3 {
        /// Grows with every change.
        revision: u32,
        /// Places of the skin at rest, m: x, y, z of each in turn.
        points: Vec<f32>,
        /// Outward normals there.
        normals: Vec<f32>,
        /// Secant stiffness of each place, N/m.
        stiffness: Vec<f32>,
        /// By how much each place is stiffer than its surroundings, as a share of them; NaN if too little around
        /// it was felt.
        shares: Vec<f32>,
        /// Width of each spot (standard deviation), m.
        widths: Vec<f32>,
        /// 1 if a place stands out from its surroundings.
        has_finding: u32,
        /// That place, m.
        finding: [f64; 3],
        /// By how much it is stiffer than its surroundings, as a share of them.
        finding_share: f64,
        /// Number of places that were forgotten, because there were too many.
        n_forgotten: u32,
    }
}

/// The page's reader of snapshots, as TypeScript source.
pub fn typescript() -> String {
    let mut out = format!(
        "// Made from crates/palpa-viewer/src/wire.rs by its tests; do not edit.\n\n\
         export const SNAPSHOT_VERSION = {SNAPSHOT_VERSION};\n{READER}"
    );
    MeshSnapshot::typescript(&mut out);
    FrameSnapshot::typescript(&mut out);
    MapSnapshot::typescript(&mut out);
    out.push_str(
        "\nexport type Snapshot = MeshSnapshot | FrameSnapshot | MapSnapshot;\n\n\
         /** Reads a snapshot; its lists look into `buffer`. Throws when it is of another version or cut off. */\n\
         export function readSnapshot(buffer: ArrayBuffer): Snapshot {\n\
         \x20 const r = new Reader(buffer);\n\
         \x20 const version = r.u32();\n\
         \x20 if (version !== SNAPSHOT_VERSION) throw new Error(`snapshot of version ${version}, expected ${SNAPSHOT_VERSION}`);\n\
         \x20 const kind = r.u32();\n\
         \x20 if (kind === 1) return readMeshSnapshot(r);\n\
         \x20 if (kind === 2) return readFrameSnapshot(r);\n\
         \x20 if (kind === 3) return readMapSnapshot(r);\n\
         \x20 throw new Error(`snapshot of unknown kind ${kind}`);\n\
         }\n",
    );
    out
}

const READER: &str = r"
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
";
