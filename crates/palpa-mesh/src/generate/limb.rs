//! A straight limb: a cylinder of tissue round a bone.

use std::f64::consts::TAU;

use super::tube::{Ends, resolution, tube};
use crate::{Surface, Vec3};

/// The skin (open at both ends) and the bone of a cylinder along x, from 0 to `length`. Lengths in
/// metres.
///
/// # Panics
/// Unless `0 < bone_radius < radius`, and `length` and `spacing` are positive.
pub fn cylinder(length: f64, radius: f64, bone_radius: f64, spacing: f64) -> (Surface, Surface) {
    assert!(
        0.0 < bone_radius && bone_radius < radius,
        "a bone of {bone_radius} m in a limb of {radius} m"
    );
    assert!(
        length > 0.0 && spacing > 0.0,
        "length {length} m, spacing {spacing} m"
    );
    let circle = |radius: f64| {
        move |along: f64, angle: f64| {
            Vec3::new(along * length, radius * angle.cos(), radius * angle.sin())
        }
    };
    let (n_rings, n_around) = resolution(length, TAU * radius, spacing);
    let skin = tube(n_rings, n_around, Ends::Open, circle(radius));
    let bone_spacing = spacing.min(bone_radius / 3.0);
    let (n_rings, n_around) = resolution(length, TAU * bone_radius, bone_spacing);
    let bone = tube(n_rings, n_around, Ends::Closed, circle(bone_radius));
    (skin, bone)
}

/// The flat skin of a block, in the plane z = 0, centred on the origin and facing +z. `size` is
/// along x and y, in metres.
///
/// # Panics
/// Unless the sizes and `spacing` are positive.
pub fn block_skin(size: [f64; 2], spacing: f64) -> Surface {
    assert!(
        size.iter().all(|&s| s > 0.0) && spacing > 0.0,
        "size {size:?} m, spacing {spacing} m"
    );
    let [nx, ny] = size.map(|s| (s / spacing).round().max(2.0) as usize);
    let mut skin = Surface::default();
    for j in 0..=ny {
        for i in 0..=nx {
            let at = [i as f64 / nx as f64 - 0.5, j as f64 / ny as f64 - 0.5];
            skin.points
                .push(Vec3::new(at[0] * size[0], at[1] * size[1], 0.0));
        }
    }
    let vertex = |i: usize, j: usize| (j * (nx + 1) + i) as u32;
    for j in 0..ny {
        for i in 0..nx {
            let (a, b, c, d) = (
                vertex(i, j),
                vertex(i + 1, j),
                vertex(i + 1, j + 1),
                vertex(i, j + 1),
            );
            // Diagonals alternate, so that the mesh has no preferred direction.
            if (i + j) % 2 == 0 {
                skin.triangles.extend([[a, b, c], [a, c, d]]);
            } else {
                skin.triangles.extend([[a, b, d], [b, c, d]]);
            }
        }
    }
    skin
}
