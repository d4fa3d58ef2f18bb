//! Lumps: bodies of another tissue hidden in the layers, with sharp or gradual borders.

use palpa_mesh::{Surface, SurfaceIndex, Vec3};

use crate::shape::{Capsule, Ellipsoid, Pose, Sphere};

/// A body of another tissue inside the layers.
#[derive(Debug)]
pub struct Lump {
    shape: LumpShape,
    pose: Pose,
    transition: f64,
    material: usize,
}

/// The shape of a lump, in its own frame. The origin is the middle; for a mesh, the centroid of its
/// volume.
#[derive(Debug)]
pub enum LumpShape {
    /// A ball.
    Sphere(Sphere),
    /// An ellipsoid with its axes along x, y and z.
    Ellipsoid(Ellipsoid),
    /// A cylinder along x with round ends.
    Capsule(Capsule),
    /// Any closed surface.
    Mesh(ClosedMesh),
}

/// The inside of a closed surface, moved so that the centroid of its volume is the origin.
#[derive(Debug)]
pub struct ClosedMesh {
    index: SurfaceIndex,
    centroid: Vec3,
    volume: f64,
    bounding_radius: f64,
}

/// The reason why a lump is refused.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LumpError {
    /// The transition is wider than the lump, or negative or not a number.
    #[error(
        "lump: a transition of {transition} m is not possible; give 0 (sharp) to {limit} m, the width of the lump"
    )]
    Transition {
        /// The given transition, m.
        transition: f64,
        /// The largest transition that leaves part of the lump, m.
        limit: f64,
    },
    /// The surface is not closed.
    #[error(
        "lump: the surface is open: {n_edges} edges have one triangle only, the first at ({:.6}, {:.6}, {:.6}) m; close \
         its holes, or join equal points if it was never joined", at.x, at.y, at.z
    )]
    Open {
        /// Number of edges without a second triangle.
        n_edges: usize,
        /// Midpoint of the first of them, m.
        at: Vec3,
    },
    /// Triangles with inconsistent orientation, or more than two at an edge.
    #[error(
        "lump: the triangles at the edge at ({:.6}, {:.6}, {:.6}) m do not agree on which side is outside, or are more \
         than two; orient and repair the surface", at.x, at.y, at.z
    )]
    Orientation {
        /// Midpoint of the edge, m.
        at: Vec3,
    },
    /// The surface encloses no volume.
    #[error(
        "lump: the surface has {n_triangles} triangles and encloses no volume; give a closed surface"
    )]
    NoVolume {
        /// Number of its triangles.
        n_triangles: usize,
    },
    /// A point with a coordinate that is not finite.
    #[error("lump: point {point} of the surface is not finite; mend the file")]
    NotFinite {
        /// Index of the point in the surface.
        point: usize,
    },
}

impl Lump {
    /// A lump of the given `material` (an index of the caller's) at `pose`. The border is
    /// `transition` metres wide, half of it inside the shape and half outside; 0 is sharp.
    ///
    /// # Errors
    /// When the transition is negative, or wider than the lump is thick.
    pub fn new(
        shape: LumpShape,
        pose: Pose,
        transition: f64,
        material: usize,
    ) -> Result<Self, LumpError> {
        let limit = shape.widest_transition();
        if !(0.0..=limit).contains(&transition) {
            return Err(LumpError::Transition { transition, limit });
        }
        Ok(Self {
            shape,
            pose,
            transition,
            material,
        })
    }

    /// The shape.
    pub fn shape(&self) -> &LumpShape {
        &self.shape
    }

    /// Pose: transformation from its own frame to the world's.
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    /// Width of its border, m.
    pub fn transition(&self) -> f64 {
        self.transition
    }

    /// Index of its material.
    pub fn material(&self) -> usize {
        self.material
    }

    /// Distance of `p` (world) from the lump's surface, m; negative inside.
    pub fn signed_distance(&self, p: &Vec3) -> f64 {
        let from_middle = p - self.pose.translation.vector;
        let p = self.pose.rotation.inverse_transform_vector(&from_middle);
        match &self.shape {
            LumpShape::Sphere(shape) => shape.distance_centred(&p).distance,
            LumpShape::Ellipsoid(shape) => shape.distance_centred(&p).distance,
            LumpShape::Capsule(shape) => shape.distance_centred(&p).distance,
            LumpShape::Mesh(shape) => shape.signed_distance(&p),
        }
    }

    /// Share of the lump in the material at `p` (world): 1 inside, 0 outside, and `3 t² − 2 t³`
    /// between. `t` rises from 0 to 1 over the width of the transition and is ½ at the surface.
    pub fn fraction(&self, p: &Vec3) -> f64 {
        let (middle, radius) = self.bounding_sphere();
        if (p - middle).norm_squared() > radius * radius {
            return 0.0;
        }
        let d = self.signed_distance(p);
        if self.transition == 0.0 {
            return f64::from(u8::from(d <= 0.0));
        }
        let t = (0.5 - d / self.transition).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    }

    /// Centre (world) and radius of a ball outside which the fraction is 0, m.
    pub fn bounding_sphere(&self) -> (Vec3, f64) {
        let radius = match &self.shape {
            LumpShape::Sphere(shape) => shape.radius(),
            LumpShape::Ellipsoid(shape) => shape.radii().max(),
            LumpShape::Capsule(shape) => shape.radius() + 0.5 * shape.length(),
            LumpShape::Mesh(shape) => shape.bounding_radius,
        };
        (self.pose.translation.vector, radius + 0.5 * self.transition)
    }

    /// Volume inside its surface, m³.
    pub fn volume(&self) -> f64 {
        let ball = 4.0 / 3.0 * std::f64::consts::PI;
        match &self.shape {
            LumpShape::Sphere(shape) => ball * shape.radius().powi(3),
            LumpShape::Ellipsoid(shape) => ball * shape.radii().product(),
            LumpShape::Capsule(shape) => {
                let r = shape.radius();
                ball * r.powi(3) + std::f64::consts::PI * r * r * shape.length()
            }
            LumpShape::Mesh(shape) => shape.volume,
        }
    }
}

impl LumpShape {
    /// The smallest width through the middle, m. With a wider transition even the middle would not
    /// be fully lump.
    fn widest_transition(&self) -> f64 {
        match self {
            Self::Sphere(shape) => 2.0 * shape.radius(),
            Self::Ellipsoid(shape) => 2.0 * shape.radii().min(),
            Self::Capsule(shape) => 2.0 * shape.radius(),
            // A bent mesh may be thinner anywhere; only its overall size is known.
            Self::Mesh(shape) => 2.0 * shape.bounding_radius,
        }
    }
}

impl ClosedMesh {
    /// Prepares the inside of `surface` (m). If all its triangles face inward, it is turned inside
    /// out. The caller must check that it does not intersect itself.
    ///
    /// # Errors
    /// When the surface is not closed, not consistently oriented, or without volume.
    pub fn new(surface: &Surface) -> Result<Self, LumpError> {
        if let Some(point) = surface
            .points
            .iter()
            .position(|p| !p.iter().all(|x| x.is_finite()))
        {
            return Err(LumpError::NotFinite { point });
        }
        check_closed(surface)?;
        let (mut volume, mut moment) = (0.0, Vec3::zeros());
        let n_triangles = surface.triangles.len();
        // Tetrahedra from a nearby point: from the world's origin, large terms would cancel.
        let (lo, hi) = surface
            .bounds()
            .ok_or(LumpError::NoVolume { n_triangles })?;
        let reference = 0.5 * (lo + hi);
        for t in 0..n_triangles {
            let [a, b, c] = surface.corners(t).map(|p| p - reference);
            let v = a.dot(&b.cross(&c)) / 6.0;
            volume += v;
            moment += (a + b + c) * (0.25 * v);
        }
        // Tolerance for rounding, so that a flat closed surface is found.
        if volume.abs() <= 1e-12 * (hi - lo).norm().powi(3) {
            return Err(LumpError::NoVolume { n_triangles });
        }
        let centroid = reference + moment / volume;
        let mut centred = Surface {
            points: surface.points.iter().map(|p| p - centroid).collect(),
            triangles: surface.triangles.clone(),
        };
        if volume < 0.0 {
            for triangle in &mut centred.triangles {
                triangle.swap(1, 2);
            }
        }
        let used = centred.triangles.iter().flatten();
        let bounding_radius = used
            .map(|&v| centred.points[v as usize].norm())
            .fold(0.0, f64::max);
        Ok(Self {
            index: SurfaceIndex::build(&centred),
            centroid,
            volume: volume.abs(),
            bounding_radius,
        })
    }

    /// The centroid of the volume in the surface's own coordinates, m. A pose with this translation
    /// puts the mesh back in its place.
    pub fn centroid(&self) -> Vec3 {
        self.centroid
    }

    fn signed_distance(&self, p: &Vec3) -> f64 {
        let closest = self.index.closest(*p).expect("a closed mesh has triangles");
        closest.signed_distance
    }
}

/// Whether every edge has exactly two triangles, which run along it in opposite directions.
fn check_closed(surface: &Surface) -> Result<(), LumpError> {
    let middle = |[a, b]: [u32; 2]| 0.5 * (surface.points[a as usize] + surface.points[b as usize]);
    let mut directed: Vec<[u32; 2]> = surface
        .triangles
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .collect();
    directed.sort_unstable();
    if let Some(twice) = directed.windows(2).find(|w| w[0] == w[1]) {
        return Err(LumpError::Orientation {
            at: middle(twice[0]),
        });
    }
    let mut alone = directed
        .iter()
        .filter(|[a, b]| directed.binary_search(&[*b, *a]).is_err());
    match alone.next() {
        Some(&first) => Err(LumpError::Open {
            n_edges: 1 + alone.count(),
            at: middle(first),
        }),
        None => Ok(()),
    }
}
