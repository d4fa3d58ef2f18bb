//! The cross-section through the place that is pressed.

use palpa_mesh::{LayeredBody, Surface, Vec3};

use palpa::press::Place;
use palpa_plot::section::{Plane, Point2, cut_surface};

/// The plane through the place that holds the press direction, which points down in it: across the limb where it has an end;
/// else along the longest way.
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

/// The lines in which the plane cuts surfaces.
pub(super) fn lines(surfaces: &[Surface], plane: &Plane) -> Vec<Vec<Point2>> {
    surfaces
        .iter()
        .flat_map(|surface| cut_surface(surface, plane))
        .collect()
}
