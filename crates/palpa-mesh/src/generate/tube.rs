//! Tubes along x: the skins and bones of limbs made by formula.

use std::f64::consts::TAU;

use crate::{Surface, Vec3};

/// Whether the ends of a tube are left open (a skin that is cut there) or closed (a bone).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ends {
    /// Two open rims.
    Open,
    /// Closed by a flat fan at each end.
    Closed,
}

/// A tube of `n_rings` rings with `n_around` vertices each. Ring `i` has the points
/// `section(i / (n_rings − 1), angle)`.
///
/// Angles run from 0 to 2π, counter-clockwise as seen from the far end. Every second ring is turned
/// by half a step, so that triangles are nearly equilateral if the spacings allow it. The surface
/// is oriented outward.
///
/// # Panics
/// With fewer than 2 rings, or fewer than 3 vertices around.
pub fn tube(
    n_rings: usize,
    n_around: usize,
    ends: Ends,
    section: impl Fn(f64, f64) -> Vec3,
) -> Surface {
    assert!(
        n_rings >= 2 && n_around >= 3,
        "a tube needs 2 rings of 3 vertices, not {n_rings} of {n_around}"
    );
    let mut surface = Surface::default();
    for i in 0..n_rings {
        let along = i as f64 / (n_rings - 1) as f64;
        let turn = if i % 2 == 1 { 0.5 } else { 0.0 };
        for j in 0..n_around {
            surface
                .points
                .push(section(along, (j as f64 + turn) / n_around as f64 * TAU));
        }
    }
    let vertex = |i: usize, j: usize| (i * n_around + j % n_around) as u32;
    for i in 0..n_rings - 1 {
        for j in 0..n_around {
            let (a, b) = (vertex(i, j), vertex(i, j + 1));
            let (c, d) = (vertex(i + 1, j), vertex(i + 1, j + 1));
            if i % 2 == 0 {
                surface.triangles.extend([[a, b, c], [b, d, c]]);
            } else {
                surface.triangles.extend([[a, d, c], [a, b, d]]);
            }
        }
    }
    if ends == Ends::Closed {
        for (ring, is_first) in [(0, true), (n_rings - 1, false)] {
            let rim: Vec<u32> = (0..n_around).map(|j| vertex(ring, j)).collect();
            let centre = rim
                .iter()
                .map(|&v| surface.points[v as usize])
                .sum::<Vec3>()
                / n_around as f64;
            let hub = surface.points.len() as u32;
            surface.points.push(centre);
            for j in 0..n_around {
                let (a, b) = (rim[j], rim[(j + 1) % n_around]);
                surface
                    .triangles
                    .push(if is_first { [hub, b, a] } else { [hub, a, b] });
            }
        }
    }
    surface
}

/// Number of rings, and of vertices around, for a tube of the given length and girth with edges of
/// about `spacing`.
pub(super) fn resolution(length: f64, girth: f64, spacing: f64) -> (usize, usize) {
    // In a row of equilateral triangles the rings lie √3/2 of a side apart.
    let n_rings = (length / (spacing * 0.75_f64.sqrt())).round().max(1.0) as usize + 1;
    let n_around = (girth / spacing).round().max(8.0) as usize;
    (n_rings, n_around)
}
