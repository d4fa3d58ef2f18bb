//! The cross-section through the pressed place.

use palpa_mesh::{LayeredBody, Surface, Vec3};

use palpa::press::Place;
use palpa_plot::section::{Plane, Point2, cut_surface};

/// The plane through the pressed place that contains the press direction, which points down in it.
/// It is parallel to a flat cut face beside the press, so it cuts across a limb. Without such a
/// face, its normal is x, or y if the press is nearly along x.
pub(super) fn plane(body: &LayeredBody, place: &Place) -> Option<Plane> {
    let direction = place.direction.into_inner();
    let across = body
        .cut_faces
        .iter()
        .find(|f| f.is_flat && f.normal.dot(&direction).abs() < 0.9)
        .map(|f| f.normal);
    let other = if direction.x.abs() < 0.7 {
        Vec3::x()
    } else {
        Vec3::y()
    };
    Plane::new(
        place.at,
        across.unwrap_or(other).cross(&direction).cross(&direction),
        -direction,
    )
}

/// The lines in which the plane cuts the surfaces.
pub(super) fn lines(surfaces: &[Surface], plane: &Plane) -> Vec<Vec<Point2>> {
    surfaces
        .iter()
        .flat_map(|surface| cut_surface(surface, plane))
        .collect()
}
