//! Layers of linear material under punches, pressures and spheres at small strain; shared by A1 to
//! A3.

use palpa_fem::law::Linear;
use palpa_fem::shape::{Sphere, Tool};
use palpa_fem::{Load, Material, Materials};
use palpa_mesh::Vec3;

use crate::verify::VerifyError;
use crate::verify::press::Pressed;
use crate::verify::sector::{Finest, Outline, Sector};

/// Tolerance of the force balance, relative to the forces that hold the body. A wide body has
/// larger rounding errors than a small one.
const TOLERANCE: f64 = 1e-4;

/// Contact radius that a sphere should have, relative to the disc's radius: the mesh must be fine
/// at the edge of the contact.
pub(crate) const TOUCHED: f64 = 0.9;
/// Edges per radius of the disc for quoted results, under punches and pressures, where the rim
/// matters.
const RIM: usize = 16;
/// Edges per radius of the disc under spheres.
const INSIDE: usize = 12;
/// Edges per radius of the disc where displacements around it are measured.
const AROUND: usize = 8;
/// Edge lengths of the meshes in the error study, relative to the mesh of the quoted results.
pub(crate) const STUDIED: [f64; 4] = [2.0, 1.5, 1.0, 0.75];

/// Number of sectors in the whole body; a force on the sector is multiplied by it.
const N_SECTORS: f64 = 6.0;

/// A layer: thickness (m), Young's modulus (Pa) and Poisson's ratio.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Layer {
    pub(crate) thickness: f64,
    pub(crate) young: f64,
    pub(crate) nu: f64,
}

impl Layer {
    fn material(&self) -> Material {
        let law = Linear::from_young(self.young, self.nu).expect("valid constants");
        Material::new(format!("{:.0} Pa", self.young), law)
    }
}

/// A measured value, and the number of nodes that can move.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Measured {
    pub(crate) value: f64,
    pub(crate) nodes: usize,
}

/// A sixth of a wide stack of layers with a disc in its middle.
pub(crate) struct Stack {
    pub(crate) sector: Sector,
    layers: Vec<Layer>,
}

impl Stack {
    /// A stack with a disc of radius `ring`, m. Edges are `size` times as long as on the mesh of
    /// the quoted results.
    pub(crate) fn new(ring: f64, size: f64, finest: Finest, width: f64, layers: &[Layer]) -> Self {
        let thicknesses: Vec<f64> = layers.iter().map(|l| l.thickness).collect();
        let n = match finest {
            Finest::Rim => RIM,
            Finest::Inside => INSIDE,
            Finest::Around => AROUND,
        };
        let n = (n as f64 / size).round() as usize;
        Self {
            sector: Sector::new(Outline::Round, ring, n, finest, width, &thicknesses),
            layers: layers.to_vec(),
        }
    }

    fn pressed(&self) -> Result<Pressed, VerifyError> {
        let materials = Materials::of_layers(self.layers.iter().map(Layer::material).collect());
        let Sector { body, supports, .. } = &self.sector;
        let mut pressed = Pressed::new(body, &materials, supports)?;
        pressed.params.tolerance = TOLERANCE;
        Ok(pressed)
    }

    /// Stiffness against a frictionless flat punch on the disc, N/m.
    pub(crate) fn punch(&self) -> Result<Measured, VerifyError> {
        let Sector { body, ring, .. } = &self.sector;
        let mut pressed = self.pressed()?;
        let patch = self.sector.patch.iter();
        let guided: Vec<(usize, Vec3, f64)> = patch
            .map(|&v| (body.node(v as usize, 0), Vec3::z(), -ring))
            .collect();
        let load = Load {
            guided: &guided,
            ..Load::default()
        };
        let report = pressed.step(&load, "smooth flat punch")?;
        Ok(Measured {
            value: N_SECTORS * report.held_force.z / ring,
            nodes: pressed.nodes(),
        })
    }

    /// Stiffness against a bonded disc, N/m.
    pub(crate) fn bonded(&self) -> Result<Measured, VerifyError> {
        let Sector { patch, ring, .. } = &self.sector;
        let mut pressed = self.pressed()?;
        let force = pressed.hold_down(patch, *ring)?;
        Ok(Measured {
            value: N_SECTORS * force / ring,
            nodes: pressed.nodes(),
        })
    }

    /// The ring of vertices nearest to `radius`: its radius, m, and its mean radial and downward
    /// displacement, m.
    pub(crate) fn ring_displacement(&self, pressed: &Pressed, radius: f64) -> (f64, [f64; 2]) {
        let body = &self.sector.body;
        let nearest = body
            .skin
            .points
            .iter()
            .map(palpa_mesh::Vec3::norm)
            .min_by(|a, b| (a - radius).abs().total_cmp(&(b - radius).abs()))
            .expect("there are vertices");
        let (mut sum, mut n) = ([0.0; 2], 0.0);
        for (v, p) in body.skin.points.iter().enumerate() {
            if (p.norm() - nearest).abs() <= 1e-9 * nearest {
                let u = pressed.state.displacements[body.node(v, 0)];
                sum[0] += u.dot(&p.normalize());
                sum[1] -= u.z;
                n += 1.0;
            }
        }
        (nearest, sum.map(|u| u / n))
    }

    /// Solves the stack under 1 N spread evenly over the disc. Returns it with the mean
    /// indentation, m.
    pub(crate) fn under_pressure(&self) -> Result<(Pressed, f64), VerifyError> {
        let Sector { body, patch, .. } = &self.sector;
        let mut pressed = self.pressed()?;
        let mut forces = vec![Vec3::zeros(); body.n_nodes()];
        let mut total = 0.0;
        for (t, triangle) in body.skin.triangles.iter().enumerate() {
            if triangle.iter().all(|v| patch.binary_search(v).is_ok()) {
                let area = body.skin.area_vector(t).norm();
                total += area;
                for &v in triangle {
                    forces[body.node(v as usize, 0)].z -= area / 3.0;
                }
            }
        }
        for force in &mut forces {
            *force /= N_SECTORS * total;
        }
        let load = Load {
            forces: &forces,
            ..Load::default()
        };
        pressed.step(&load, "disc under pressure")?;
        let work: f64 = forces
            .iter()
            .zip(&pressed.state.displacements)
            .map(|(force, u)| force.dot(u))
            .sum();
        Ok((pressed, N_SECTORS * work))
    }

    /// Force on a paraboloid r²/2R whose tip is `depth` below the plane, N. It should touch nearly
    /// all of the disc, see [`TOUCHED`]. The problem is solved for a depth of `shallow` radii of
    /// the disc, so small that vertices hardly slide along the sphere. Linear material has no
    /// length scale, so the force can be scaled to the requested depth.
    pub(crate) fn paraboloid(
        &self,
        radius: f64,
        depth: f64,
        shallow: f64,
    ) -> Result<Measured, VerifyError> {
        // At this depth the sphere is a paraboloid with the same contact, and the force is smaller
        // by `scale`.
        let shallow = shallow * self.sector.ring;
        let scale = shallow / depth;
        let radius = radius / scale;
        let tool = Tool::new(Sphere::new(radius).expect("valid size"), 0.0).expect("no friction");
        let force = self.indented(tool, shallow, |p| p.norm_squared() / (2.0 * radius))?;
        Ok(Measured {
            value: force.value / scale,
            ..force
        })
    }

    /// Force on a smooth tool whose tip is `depth` below the plane, N. It should touch nearly all
    /// of the disc, see [`TOUCHED`]. `height` is the height of the tool over its tip, m.
    pub(crate) fn indented(
        &self,
        tool: Tool,
        depth: f64,
        height: impl Fn(&Vec3) -> f64,
    ) -> Result<Measured, VerifyError> {
        let Sector { body, ring, .. } = &self.sector;
        let mut pressed = self.pressed()?;
        pressed.params.gap_tolerance = 1e-6 * depth;
        // Initial guess for the contact, to shorten the search: the whole disc, and nothing
        // outside.
        for (v, p) in body.skin.points.iter().enumerate() {
            let r = p.norm();
            let apart = if r <= *ring { -1e-3 } else { 1e-3 };
            let surface = height(p) - depth;
            pressed.state.displacements[body.node(v, 0)].z = (surface - apart * depth).min(0.0);
        }
        let report = pressed.press(tool, [0.0; 2], depth)?;
        Ok(Measured {
            value: N_SECTORS * report.tool_forces[0].z,
            nodes: pressed.nodes(),
        })
    }
}
