//! Gradients and volumes at the points of an element, from its rest shape.
//!
//! All integrals of the element are exact with one point in the plane of a wedge and two over its
//! thickness: volumes and gradient integrals of a six-node prism are linear in the plane and of
//! second order over the thickness.

use palpa_mesh::Vec3;

use crate::Mat3;

/// Place of the two Gauss points over the thickness, in the natural coordinate −1 (lower) to 1
/// (upper).
pub(crate) const GAUSS: [f64; 2] = [-0.577_350_269_189_625_8, 0.577_350_269_189_625_8];

/// A wedge at its two points.
///
/// ```text
///      2            ζ = 1: nodes 0 1 2 (upper),  ζ = −1: nodes 3 4 5 (lower)
///     /|\
///    0-+-1          point 0 at ζ = −1/√3, point 1 at ζ = 1/√3, both over the centroid of the triangle
///    | 5 |
///    |/ \|
///    3---4
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct WedgeGeometry {
    /// Gradients of the six shape functions. `[point][node]`, 1/m
    pub(crate) gradients: [[Vec3; 6]; 2],
    /// Volume that a point stands for, in m³; not positive for an inverted wedge.
    pub(crate) volumes: [f64; 2],
}

/// A pair of wedges (or a single one) at its points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct GroupGeometry {
    /// The wedges; the second is a copy of the first in a group of one, and has no volume.
    pub(crate) wedges: [WedgeGeometry; 2],
    /// `∂X/∂ζ`, one for the whole group, in m.
    pub(crate) thickness: Vec3,
    /// `grad ζ`, one for the whole group, scaled to `thickness · thickness_gradient = 1`. 1/m
    pub(crate) thickness_gradient: Vec3,
}

impl WedgeGeometry {
    /// The geometry of a wedge of these corners, and `∂X/∂ζ` and `grad ζ` in its middle.
    pub(crate) fn new(corners: &[Vec3; 6]) -> (Self, Vec3, Vec3) {
        let (geometry, _) = at_points(corners);
        let middle = jacobian(corners, 0.0);
        let thickness = middle.column(2).into_owned();
        let gradient = middle.try_inverse().map_or(Vec3::zeros(), |inverse| {
            inverse.row(2).transpose().into_owned()
        });
        (geometry, thickness, gradient)
    }

    pub(crate) fn volume(&self) -> f64 {
        self.volumes[0] + self.volumes[1]
    }
}

fn at_points(corners: &[Vec3; 6]) -> (WedgeGeometry, [Mat3; 2]) {
    let mut geometry = WedgeGeometry {
        gradients: [[Vec3::zeros(); 6]; 2],
        volumes: [0.0; 2],
    };
    let mut jacobians = [Mat3::zeros(); 2];
    for (q, &zeta) in GAUSS.iter().enumerate() {
        let jacobian = jacobian(corners, zeta);
        let inverse = jacobian.try_inverse().unwrap_or_else(Mat3::zeros);
        for (node, gradient) in geometry.gradients[q].iter_mut().enumerate() {
            *gradient = inverse.transpose() * natural_gradient(node, zeta);
        }
        // Half: the area of the triangle in natural coordinates. The weight of a Gauss point is 1.
        geometry.volumes[q] = 0.5 * jacobian.determinant();
        jacobians[q] = jacobian;
    }
    (geometry, jacobians)
}

/// `∂N/∂(r, s, ζ)` over the centroid, for corners (0, 0), (1, 0), (0, 1) of the natural triangle.
fn natural_gradient(node: usize, zeta: f64) -> Vec3 {
    let (corner, side) = (node % 3, if node < 3 { 1.0 } else { -1.0 });
    let in_plane = [(-1.0, -1.0), (1.0, 0.0), (0.0, 1.0)][corner];
    let share = f64::midpoint(1.0, side * zeta);
    Vec3::new(in_plane.0 * share, in_plane.1 * share, side / 6.0)
}

/// `∂X/∂(r, s, ζ)` over the centroid.
fn jacobian(corners: &[Vec3; 6], zeta: f64) -> Mat3 {
    let mut jacobian = Mat3::zeros();
    for (node, x) in corners.iter().enumerate() {
        jacobian += x * natural_gradient(node, zeta).transpose();
    }
    jacobian
}

impl GroupGeometry {
    /// The geometry of one or two wedges.
    pub(crate) fn new(corners: &[[Vec3; 6]]) -> Self {
        let parts: Vec<(WedgeGeometry, Vec3, Vec3)> =
            corners.iter().map(WedgeGeometry::new).collect();
        let volume: f64 = parts.iter().map(|p| p.0.volume()).sum();
        let mean = |vector: fn(&(WedgeGeometry, Vec3, Vec3)) -> Vec3| -> Vec3 {
            parts
                .iter()
                .map(|p| vector(p) * (p.0.volume() / volume))
                .sum()
        };
        let (thickness, gradient) = (mean(|p| p.1), mean(|p| p.2));
        let first = parts[0].0;
        let second = parts.get(1).map_or(
            WedgeGeometry {
                volumes: [0.0; 2],
                ..first
            },
            |p| p.0,
        );
        Self {
            wedges: [first, second],
            thickness,
            thickness_gradient: gradient / thickness.dot(&gradient),
        }
    }

    /// Rest volume in m³.
    pub(crate) fn volume(&self) -> f64 {
        self.wedges[0].volume() + self.wedges[1].volume()
    }
}
