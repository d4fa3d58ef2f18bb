//! What is written reads back the same.

use palpa_mesh::{Format, WriteError, read_surface, write_surface};

use crate::shapes::{icosphere, moved};

#[test]
fn round_trips_lose_nothing_but_in_stl() {
    let folder = tempfile::tempdir().unwrap();
    // Thirds of coordinates far from the origin need all 17 digits.
    let surface = moved(&icosphere(2).scaled(1.0 / 3.0), [4.5e6, -1.2e6, 3e-7]);
    for name in ["a.obj", "a.PLY", "a.off"] {
        let path = folder.path().join(name);
        write_surface(&path, &surface).unwrap();
        assert_eq!(read_surface(&path).unwrap().surface, surface, "{name}");
    }
    let surface = icosphere(2);
    let path = folder.path().join("a.stl");
    write_surface(&path, &surface).unwrap();
    let back = read_surface(&path).unwrap();
    assert_eq!((back.format, back.counts.n_points), (Format::Stl, 3 * 320));
    assert_eq!(back.surface.points.len(), surface.points.len());
    // In the order of their first use, hence triangle by triangle.
    for t in 0..surface.triangles.len() {
        for (a, b) in surface.corners(t).iter().zip(back.surface.corners(t)) {
            assert!((a - b).amax() <= f64::from(f32::EPSILON) / 2.0);
        }
    }
}

#[test]
fn a_file_is_replaced_whole_and_nothing_is_left_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("skin.off");
    std::fs::write(&path, "something old").unwrap();
    write_surface(&path, &icosphere(0)).unwrap();
    assert_eq!(read_surface(&path).unwrap().surface, icosphere(0));
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1);

    let nowhere = folder.path().join("missing/skin.off");
    assert!(matches!(
        write_surface(&nowhere, &icosphere(0)),
        Err(WriteError::Io { .. })
    ));
    let unknown = folder.path().join("skin.fbx");
    assert!(matches!(
        write_surface(&unknown, &icosphere(0)),
        Err(WriteError::UnknownFormat { .. })
    ));
}
