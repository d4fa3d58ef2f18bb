//! What the targets share.

use palpa_mesh::{Format, RepairOptions, check_surface, read_surface_bytes, repair};

/// Reads bytes as one format. A surface that can be read is checked, repaired, checked again and repaired
/// again. None of this may panic, triangles must have their vertices, and the second repair must find
/// nothing to do.
pub fn read_check_repair(bytes: &[u8], format: Format) {
    let Ok(file) = read_surface_bytes(bytes, format) else {
        return;
    };
    let n = file.surface.points.len();
    assert!(
        file.surface
            .triangles
            .iter()
            .flatten()
            .all(|&v| (v as usize) < n)
    );
    check_surface(&file.surface);
    let options = RepairOptions {
        recentre: true,
        ..RepairOptions::default()
    };
    let (repaired, _) = repair(&file.surface, &options);
    check_surface(&repaired);
    let (_, again) = repair(&repaired, &options);
    assert!(!again.is_changed(), "{again:?}");
}
