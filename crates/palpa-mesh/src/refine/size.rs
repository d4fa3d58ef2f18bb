//! Wanted sizes of triangles.

use rstar::RTree;

use crate::Vec3;

/// A function that wants edges of length `h` within `radius` of any of the points. Outside, the
/// wanted length grows by `growth` times the distance beyond. Lengths in metres.
///
/// The function returns a lower bound of the wanted length in a triangle. It uses the distance of
/// the triangle's centre minus the distance from the centre to the farthest corner. So no point
/// between the corners of a large triangle is missed. Without points, there is no limit.
///
/// # Panics
/// If lengths or `growth` are negative or not finite, or a point is not finite.
pub fn near_points(
    points: &[Vec3],
    radius: f64,
    h: f64,
    growth: f64,
) -> impl Fn(u32, &[Vec3; 3]) -> f64 + use<> {
    assert!(
        [radius, h, growth]
            .iter()
            .all(|x| *x >= 0.0 && x.is_finite()),
        "radius {radius} m, h {h} m, growth {growth}"
    );
    assert!(
        points.iter().flat_map(|p| p.iter()).all(|x| x.is_finite()),
        "points must be finite"
    );
    let tree = RTree::bulk_load(points.iter().map(|&p| <[f64; 3]>::from(p)).collect());
    move |_, corners| {
        let centre = corners.iter().sum::<Vec3>() / 3.0;
        let reach = corners
            .iter()
            .map(|p| (p - centre).norm())
            .fold(0.0, f64::max);
        match tree.nearest_neighbor(<[f64; 3]>::from(centre)) {
            Some(nearest) => {
                let distance = (Vec3::from(*nearest) - centre).norm();
                h + growth * (distance - reach - radius).max(0.0)
            }
            None => f64::INFINITY,
        }
    }
}
