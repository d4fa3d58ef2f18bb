//! Snapshots are read back as the page reads them: little-endian, each thing at a multiple of its
//! size.

use palpa_viewer::wire::{FrameSnapshot, MeshSnapshot, SNAPSHOT_VERSION};
use proptest::{array::uniform3, array::uniform4, array::uniform6, collection::vec, prelude::*};

/// Reads as `Reader` of `web/src/generated/wire.ts` does.
struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Reader<'a> {
    fn take(&mut self, size: usize, n: usize) -> &'a [u8] {
        let from = self.at.next_multiple_of(size);
        assert!(self.bytes[self.at..from].iter().all(|&b| b == 0));
        self.at = from + size * n;
        &self.bytes[from..self.at]
    }

    fn items<T, const N: usize>(&mut self, of: impl Fn([u8; N]) -> T) -> Vec<T> {
        let n = self.u32() as usize;
        self.take(N, n)
            .chunks_exact(N)
            .map(|c| of(c.try_into().unwrap()))
            .collect()
    }

    fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.take(4, 1).try_into().unwrap())
    }

    fn f64(&mut self) -> f64 {
        f64::from_le_bytes(self.take(8, 1).try_into().unwrap())
    }

    fn f64s<const N: usize>(&mut self) -> [f64; N] {
        std::array::from_fn(|_| self.f64())
    }

    fn head(bytes: &'a [u8], kind: u32) -> Self {
        let mut reader = Reader { bytes, at: 0 };
        assert_eq!((reader.u32(), reader.u32()), (SNAPSHOT_VERSION, kind));
        reader
    }
}

fn read_mesh(bytes: &[u8]) -> MeshSnapshot {
    let mut r = Reader::head(bytes, 1);
    let mesh = MeshSnapshot {
        mesh: r.u32(),
        n_levels: r.u32(),
        positions: r.items(f32::from_le_bytes),
        triangles: r.items(u32::from_le_bytes),
        interval_layer: r.items(u8::from_le_bytes),
        stiffness: r.items(f32::from_le_bytes),
        bone_positions: r.items(f32::from_le_bytes),
        bone_triangles: r.items(u32::from_le_bytes),
    };
    assert_eq!(r.at, bytes.len());
    mesh
}

fn read_frame(bytes: &[u8]) -> FrameSnapshot {
    let mut r = Reader::head(bytes, 2);
    let frame = FrameSnapshot {
        mesh: r.u32(),
        sequence: r.u32(),
        is_replay: r.u32(),
        tick: r.f64(),
        time: r.f64(),
        device: r.f64s(),
        tool: r.f64s(),
        orientation: r.f64s(),
        force: r.f64s(),
        tissue_force: r.f64s(),
        place: r.f64s(),
        depth: r.f64(),
        deepest: r.f64(),
        gain: r.f64(),
        n_active: r.u32(),
        step_status: r.u32(),
        faults: r.u32(),
        limits: r.u32(),
        displacement_unit: r.f64(),
        displacements: r.items(i16::from_le_bytes),
        contacts: r.items(u32::from_le_bytes),
        contact_pressures: r.items(f32::from_le_bytes),
        field: r.u32(),
        field_min: r.f64(),
        field_max: r.f64(),
        field_values: r.items(u16::from_le_bytes),
    };
    assert_eq!(r.at, bytes.len());
    frame
}

proptest! {
    #[test]
    fn a_mesh_is_read_back(
        mesh: u32,
        n_levels: u32,
        positions in vec(-1e3f32..1e3, 0..40),
        triangles in vec(any::<u32>(), 0..20),
        interval_layer in vec(any::<u8>(), 0..9),
        stiffness in vec(0f32..1e9, 0..9),
        bone_positions in vec(-1f32..1.0, 0..9),
        bone_triangles in vec(any::<u32>(), 0..9),
    ) {
        let mesh = MeshSnapshot {
            mesh, n_levels, positions, triangles, interval_layer, stiffness, bone_positions, bone_triangles,
        };
        prop_assert_eq!(read_mesh(&mesh.encode()), mesh);
    }

    #[test]
    fn a_frame_is_read_back(
        numbers in uniform4(any::<u32>()),
        places in uniform6(uniform3(-1.0..1.0)),
        orientation in uniform4(-1.0..1.0),
        displacements in vec(any::<i16>(), 0..40),
        contacts in vec(any::<u32>(), 0..9),
        contact_pressures in vec(0f32..1e6, 0..9),
        field_values in vec(any::<u16>(), 0..40),
    ) {
        let [mesh, sequence, faults, limits] = numbers;
        let [device, tool, force, tissue_force, place, [depth, gain, time]] = places;
        let frame = FrameSnapshot {
            mesh, sequence, faults, limits, device, tool, force, tissue_force, place, depth, gain, time, orientation,
            displacements, contacts, contact_pressures, field_values, displacement_unit: 1e-6, field: 2, field_min: -1e3, field_max: 4e5,
            is_replay: 1, tick: 1e9, n_active: 17, step_status: 2, deepest: 0.0125,
        };
        prop_assert_eq!(read_frame(&frame.encode()), frame);
    }
}

#[test]
fn where_things_lie() {
    let frame = FrameSnapshot {
        mesh: 0x0102_0304,
        tick: 1.0,
        displacements: vec![-2, 3, 4],
        field_values: vec![65535],
        ..FrameSnapshot::default()
    };
    let bytes = frame.encode();
    assert_eq!(bytes[..12], [5, 0, 0, 0, 2, 0, 0, 0, 4, 3, 2, 1]);
    // Version, kind, mesh, sequence, is_replay; then doubles from the next multiple of 8.
    assert_eq!(bytes[24..32], 1f64.to_le_bytes());
    // 2 + 19 + 3 doubles, 4 numbers, a double; the list's length and its items.
    let list = 24 + 24 * 8 + 4 * 4 + 8;
    assert_eq!(bytes[list..list + 10], [3, 0, 0, 0, 0xfe, 0xff, 3, 0, 4, 0]);
    // Two empty lists (at a multiple of 4), the field, two doubles, a list of one.
    let field = (list + 10).next_multiple_of(4) + 8;
    let end = (field + 4).next_multiple_of(8) + 16 + 4 + 2;
    assert_eq!(bytes.len(), end);
    assert_eq!(bytes[end - 2..], [0xff, 0xff]);
}

/// How many bytes a frame of a body costs.
#[test]
fn a_frame_of_ten_thousand_nodes() {
    let frame = FrameSnapshot {
        displacements: vec![0; 30_000],
        ..FrameSnapshot::default()
    };
    assert!(frame.encode().len() < 60_300);
    let with_field = FrameSnapshot {
        field_values: vec![0; 10_000],
        ..frame
    };
    assert!(with_field.encode().len() < 80_300);
}
