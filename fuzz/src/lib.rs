//! What the targets share.

use palpa_mesh::{Format, RepairOptions, check_surface, read_surface_bytes, repair};

/// Reads bytes as one format; what can be read is checked, repaired and checked again. None of this may panic, and what comes
/// out must have its vertices.
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
    let (repaired, _) = repair(
        &file.surface,
        &RepairOptions {
            recentre: true,
            ..RepairOptions::default()
        },
    );
    check_surface(&repaired);
}
