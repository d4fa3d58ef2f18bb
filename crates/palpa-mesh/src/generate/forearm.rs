//! A forearm by formula: the skin from girths, ulna and radius from centre lines and half-widths.
//!
//! ```text
//! +x  from the elbow to the wrist (0 at the upper cut)     z   dorsal
//! +y  to the thumb's side                                  │ (U) (R)      U ulna, R radius
//! +z  to the back of the hand's side                       └──── y
//! ```
//! Each table names the source of its numbers. None of them is a measurement of one person. The
//! shape is for experiments without a download; forces from it are only as good as its assumed
//! tissues.

use std::f64::consts::TAU;

use super::tube::{Ends, resolution, tube};
use crate::{Surface, Vec3};

/// Length between the cuts. Assumed: a man's forearm of about 0.25 m without the ends at the
/// joints.
const LENGTH: f64 = 0.22;

/// Girth along the arm, `[x, girth]` in m. The largest is 270 mm (general anthropometry,
/// NASA-STD-3000 and ANSUR, quoted from memory: adults 270, s.d. 20). The wrist's 165 mm and the
/// values between are assumed.
const GIRTH: [[f64; 2]; 6] = [
    [0.0, 0.262],
    [0.035, 0.270],
    [0.08, 0.257],
    [0.13, 0.222],
    [0.18, 0.184],
    [0.22, 0.165],
];

/// Ratio of width to height of the section, `[x, ratio]`. Assumed: nearly round at the elbow, flat
/// at the wrist.
const FLATNESS: [[f64; 2]; 3] = [[0.0, 1.05], [0.12, 1.12], [0.22, 1.38]];

/// A bone: rows `[x, y, z, half-width along y, half-width along z]` in m.
type Bone = [[f64; 5]; 6];

/// Ulna. Shaft radius 7–8 mm (textbook, from memory). Positions and the widths of the olecranon and
/// the head are assumed. The ulna lies on the side of the little finger, close under the skin at
/// the edge of the arm.
const ULNA: Bone = [
    [-0.010, -0.012, 0.015, 0.0105, 0.0115],
    [0.030, -0.014, 0.016, 0.0090, 0.0095],
    [0.080, -0.0165, 0.0145, 0.0075, 0.0075],
    [0.140, -0.0190, 0.0095, 0.0065, 0.0065],
    [0.190, -0.0185, 0.0065, 0.0060, 0.0060],
    [0.230, -0.0175, 0.0055, 0.0075, 0.0075],
];

/// Radius. Shaft radius 7–8 mm (textbook, from memory). Positions and the widths of the head and
/// the wrist end are assumed.
const RADIUS: Bone = [
    [-0.005, 0.0145, 0.0090, 0.0105, 0.0105],
    [0.020, 0.0155, 0.0090, 0.0080, 0.0080],
    [0.080, 0.0190, 0.0095, 0.0075, 0.0070],
    [0.140, 0.0185, 0.0085, 0.0080, 0.0070],
    [0.190, 0.0140, 0.0045, 0.0105, 0.0080],
    [0.230, 0.0110, 0.0020, 0.0140, 0.0095],
];

/// Skin (open at both cuts), ulna and radius of an average adult's forearm, scaled by `scale`.
/// Edges of the skin are about `spacing` metres long.
///
/// # Panics
/// Unless `spacing` and `scale` are positive.
pub fn forearm(spacing: f64, scale: f64) -> (Surface, [Surface; 2]) {
    assert!(
        spacing > 0.0 && scale > 0.0,
        "spacing {spacing} m, scale {scale}"
    );
    let largest = GIRTH.iter().map(|row| row[1]).fold(0.0, f64::max);
    let (n_rings, n_around) = resolution(LENGTH * scale, largest * scale, spacing);
    let skin = tube(n_rings, n_around, Ends::Open, |along, angle| {
        skin_point(along * LENGTH, angle) * scale
    });
    (skin, [&ULNA, &RADIUS].map(|b| bone(b, scale)))
}

/// A point of the skin: on an ellipse with the girth and flatness at `x`.
fn skin_point(x: f64, angle: f64) -> Vec3 {
    let flatness = spline(&FLATNESS, x, 1).sqrt();
    let (width, height) = (flatness, 1.0 / flatness);
    // The perimeter of the ellipse of these half-axes, by Ramanujan's second formula (relative
    // error below 1e-9 here).
    let h = ((width - height) / (width + height)).powi(2);
    let perimeter =
        0.5 * TAU * (width + height) * (1.0 + 3.0 * h / (10.0 + (4.0 - 3.0 * h).sqrt()));
    let size = spline(&GIRTH, x, 1) / perimeter;
    Vec3::new(x, size * width * angle.cos(), size * height * angle.sin())
}

fn bone(rows: &Bone, scale: f64) -> Surface {
    const SPACING: f64 = 0.004;
    let (first, last) = (rows[0][0], rows[rows.len() - 1][0]);
    let (n_rings, n_around) = resolution(last - first, TAU * 0.008, SPACING);
    tube(n_rings, n_around, Ends::Closed, |along, angle| {
        let x = first + along * (last - first);
        let [y, z, half_width, half_height] = [1, 2, 3, 4].map(|column| spline(rows, x, column));
        Vec3::new(
            x,
            y + half_width * angle.cos(),
            z + half_height * angle.sin(),
        ) * scale
    })
}

/// Smooth interpolation of a column in a table whose rows begin with x. It is cubic Hermite with
/// slopes from the neighbouring rows (Catmull–Rom for uneven rows), and constant beyond the ends.
fn spline<const N: usize>(rows: &[[f64; N]], x: f64, column: usize) -> f64 {
    let last = rows.len() - 1;
    let i = rows.partition_point(|row| row[0] <= x).clamp(1, last) - 1;
    let ([x0, a], [x1, b]) = (
        [rows[i][0], rows[i][column]],
        [rows[i + 1][0], rows[i + 1][column]],
    );
    let h = x1 - x0;
    let t = ((x - x0) / h).clamp(0.0, 1.0);
    let slope = |k: usize| {
        let (lo, hi) = (k.saturating_sub(1), (k + 1).min(last));
        (rows[hi][column] - rows[lo][column]) / (rows[hi][0] - rows[lo][0])
    };
    let (t2, t3) = (t * t, t * t * t);
    a * (2.0 * t3 - 3.0 * t2 + 1.0)
        + b * (3.0 * t2 - 2.0 * t3)
        + h * (slope(i) * (t3 - 2.0 * t2 + t) + slope(i + 1) * (t3 - t2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn girths_are_those_of_the_table() {
        for [x, girth] in GIRTH {
            let n = 20_000;
            let p = |i: usize| skin_point(x, i as f64 / n as f64 * TAU);
            let measured: f64 = (0..n).map(|i| (p(i + 1) - p(i)).norm()).sum();
            assert!(
                (measured / girth - 1.0).abs() < 1e-6,
                "{measured} at {x}, not {girth}"
            );
        }
    }

    #[test]
    fn bones_lie_inside_the_skin_with_room_for_tissue() {
        let (skin, bones) = forearm(0.005, 1.0);
        let index = crate::SurfaceIndex::build(&skin);
        for bone in &bones {
            for p in bone.points.iter().filter(|p| p.x > 0.0 && p.x < LENGTH) {
                let depth = -index.closest(*p).unwrap().signed_distance;
                assert!(depth > 2e-3, "{:.2} mm at {:?}", depth * 1e3, p * 1e3);
            }
        }
    }

    #[test]
    fn surfaces_are_oriented_outward() {
        let (skin, bones) = forearm(0.006, 1.0);
        let volume = |s: &Surface| -> f64 {
            (0..s.triangles.len())
                .map(|t| s.area_vector(t).dot(&s.corners(t)[0]) / 3.0)
                .sum()
        };
        assert!(
            bones
                .iter()
                .all(|b| volume(b) > 2e-5 && b.boundary_loops().is_empty())
        );
        assert_eq!(skin.boundary_loops().len(), 2);
        let normals = skin.vertex_normals();
        assert!(
            skin.points
                .iter()
                .zip(&normals)
                .all(|(p, n)| n.y * p.y + n.z * p.z > 0.0)
        );
    }
}
