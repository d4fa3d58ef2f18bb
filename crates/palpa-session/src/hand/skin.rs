//! The skin at rest: places on it, their normals and the depth of the tissue under them.

use palpa_mesh::{Surface, SurfaceIndex, Vec3};

/// Deepest press, as a share of the tissue's depth.
pub(super) const MOST_OF_TISSUE: f64 = 0.65;

/// The skin at rest, with an index to find places on it.
#[derive(Debug)]
pub(crate) struct Skin {
    pub(super) surface: Surface,
    index: SurfaceIndex,
    normals: Vec<Vec3>,
    /// Depth of the tissue under each vertex, m.
    thickness: Vec<f64>,
    /// Mean of the vertices, m.
    pub(super) middle: Vec3,
    /// Unit vector along which the body is longest.
    pub(super) axis: Vec3,
}

/// A place on the skin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Place {
    /// The point, m.
    pub(crate) point: Vec3,
    /// The outward normal there.
    pub(crate) normal: Vec3,
    /// Depth of the tissue, m.
    pub(crate) thickness: f64,
}

impl Place {
    /// Deepest that a hand presses here, m.
    pub(crate) fn deepest(&self) -> f64 {
        MOST_OF_TISSUE * self.thickness
    }
}

impl Skin {
    /// `thickness` is the depth of the tissue under each vertex, m. `[n_vertices]`
    pub(crate) fn new(surface: Surface, thickness: Vec<f64>) -> Self {
        let n = surface.points.len().max(1) as f64;
        let middle = surface.points.iter().sum::<Vec3>() / n;
        let spread = surface
            .points
            .iter()
            .map(|p| (p - middle) * (p - middle).transpose())
            .sum::<nalgebra::Matrix3<f64>>();
        let eigen = spread.symmetric_eigen();
        let axis = eigen.eigenvectors.column(eigen.eigenvalues.imax());
        Self {
            index: SurfaceIndex::build(&surface),
            normals: surface.vertex_normals(),
            axis: axis.into(),
            surface,
            thickness,
            middle,
        }
    }

    /// The surface.
    pub(crate) fn surface(&self) -> &Surface {
        &self.surface
    }

    /// The place nearest to a point.
    pub(crate) fn nearest(&self, point: Vec3) -> Option<Place> {
        let closest = self.index.closest(point)?;
        let corners = self.surface.triangles.get(closest.triangle as usize)?;
        let mut normal = Vec3::zeros();
        let mut thickness = 0.0;
        for (&v, share) in corners.iter().zip(closest.weights) {
            normal += self.normals[v as usize] * share;
            thickness += self.thickness[v as usize] * share;
        }
        Some(Place {
            point: closest.point,
            normal: normal.try_normalize(1e-9)?,
            thickness,
        })
    }

    /// Vertices at least `distance` (m) from the rims where the body was cut. For each: its place,
    /// its share of the skin's area (m²), and the depth of the tissue under it (m).
    pub(crate) fn away_from_rim(&self, distance: f64) -> impl Iterator<Item = (Vec3, f64, f64)> {
        let surface = &self.surface;
        let rim: Vec<Vec3> = (surface.boundary_loops().iter().flatten())
            .map(|&v| surface.points[v as usize])
            .collect();
        let mut areas = vec![0.0; surface.points.len()];
        for (t, corners) in surface.triangles.iter().enumerate() {
            for &v in corners {
                areas[v as usize] += surface.area_vector(t).norm() / 3.0;
            }
        }
        (0..surface.points.len())
            .map(move |v| (surface.points[v], areas[v], self.thickness[v]))
            .filter(move |(p, ..)| rim.iter().all(|q| (p - q).norm() >= distance))
    }

    /// Distance of a point from the skin, m.
    pub(super) fn distance(&self, point: Vec3) -> f64 {
        self.index
            .closest(point)
            .map_or(f64::INFINITY, |c| (c.point - point).norm())
    }
}
