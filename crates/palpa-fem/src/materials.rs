//! The material at each point of a body: layers, lumps in them, and a field of stiffness over both.
//!
//! Material is sampled where the element asks for it, so a lump need not follow the mesh. The
//! energy of a place that is partly lump lies between those of both materials, but it is not their
//! mean by volume. If one material is much stiffer, it is hardly strained itself, so the mean would
//! overstate its effect many times. The share c of the lump's energy is
//!
//! ```text
//! G = G_m + c (G_l − G_m),  c = φ / (1 + (1 − φ) β (G_l/G_m − 1))
//! β = s β_E + (1 − s),      β_E = 2 (4 − 5 ν)/(15 (1 − ν))        s = V/(V + V_l)
//! ```
//! with φ the lump's share of volume, ν that of the layer; a place wholly inside has c = 1. With
//! `β = β_E` the lump is a grain inside the group (Eshelby 1957, Mori & Tanaka 1973; for the bulk
//! modulus `β_E = (1 + ν)/(3 (1 − ν))`), with β = 1 both are in series: to a group that is small
//! beside the lump its border is a plane, and the group's one strain is stiff enough as it is (a
//! hard ball in a soft block adds 6 to 17 % too much stiffness as grains, at most 6 % in series,
//! with three groups to its radius). The volumes of group and lump say which it is. A lump softer
//! than its layer is a grain to all groups: in series a trace of it would take all their stiffness
//! (a soft ball takes 7 % too little as grains, and would 14 % too much in series).

use palpa_mesh::{LayeredBody, Vec3};

use crate::columns::Structure;
use crate::element::{GroupGeometry, N_POINTS, Phase};
use crate::error::FemError;
use crate::law::Law;
use crate::lump::Lump;
use crate::{Kinematics, Material};

/// Number of samples along each side of a triangle, and over half the height of a prism that a
/// lump's border crosses.
const IN_PLANE: usize = 8;
const IN_DEPTH: usize = 6;

/// A factor on the stiffness as a function of the position at rest.
pub type StiffnessField = Box<dyn Fn(&Vec3) -> f64 + Send + Sync>;

/// The materials of a body.
#[derive(Default)]
pub struct Materials {
    /// All materials of the body.
    pub materials: Vec<Material>,
    /// Index of the material of each layer. `[n_layers]`
    pub layers: Vec<usize>,
    /// The lumps. Where they overlap, the later one counts.
    pub lumps: Vec<Lump>,
    /// Multiplies the stiffness everywhere; sampled over every half prism.
    pub stiffness: Option<StiffnessField>,
}

impl std::fmt::Debug for Materials {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Materials")
            .field("materials", &self.materials)
            .field("layers", &self.layers)
            .field("lumps", &self.lumps)
            .field("stiffness", &self.stiffness.as_ref().map(|_| "a field"))
            .finish()
    }
}

impl Materials {
    /// One material for each layer, and no lumps.
    pub fn of_layers(materials: Vec<Material>) -> Self {
        Self {
            layers: (0..materials.len()).collect(),
            materials,
            ..Self::default()
        }
    }

    /// Checks that the materials fit the body and each other.
    pub(crate) fn check(&self, body: &LayeredBody) -> Result<(), FemError> {
        let n_layers = body.layer_names.len();
        if self.layers.len() != n_layers {
            return Err(FemError::Layers {
                n_layers,
                n_materials: self.layers.len(),
            });
        }
        let n_materials = self.materials.len();
        let used = self.layers.iter().copied();
        for material in used.chain(self.lumps.iter().map(Lump::material)) {
            if material >= n_materials {
                return Err(FemError::NoSuchMaterial {
                    material,
                    n_materials,
                });
            }
        }
        for material in &self.materials {
            material.check().map_err(|source| FemError::Material {
                name: material.name.clone(),
                source,
            })?;
        }
        let of = |kinematics: Kinematics| {
            self.materials
                .iter()
                .find(|m| m.law.kinematics() == kinematics)
        };
        if let (Some(linear), Some(finite)) = (of(Kinematics::Small), of(Kinematics::Finite)) {
            return Err(FemError::MixedKinematics {
                linear: linear.name.clone(),
                finite: finite.name.clone(),
            });
        }
        for lump in &self.lumps {
            let lump = &self.materials[lump.material()];
            for &layer in &self.layers {
                let layer = &self.materials[layer];
                if lump.law.volume_measure() != layer.law.volume_measure() {
                    return Err(FemError::MixedVolume {
                        lump: lump.name.clone(),
                        layer: layer.name.clone(),
                    });
                }
            }
        }
        Ok(())
    }

    /// Shares of each lump at a point; their sum is at most 1.
    fn shares_at(&self, nearby: &[usize], p: &Vec3, shares: &mut [f64]) {
        let mut left = 1.0;
        for &lump in nearby.iter().rev() {
            let share = left * self.lumps[lump].fraction(p);
            shares[lump] = share;
            left -= share;
        }
    }
}

/// Shares and stiffness factor of one half of a wedge.
#[derive(Clone)]
struct Half {
    lumps: Vec<f64>,
    stiffness: f64,
}

/// The phases of every group: its materials at each of its points.
pub(crate) fn assign(
    body: &LayeredBody,
    structure: &Structure,
    geometries: &[GroupGeometry],
    materials: &Materials,
) -> (Vec<Phase>, Vec<u32>) {
    let n_groups = structure.groups.len();
    let mut phases = Vec::with_capacity(geometries.len());
    let mut first = Vec::with_capacity(geometries.len() + 1);
    for (g, geometry) in geometries.iter().enumerate() {
        first.push(phases.len() as u32);
        let interval = g / n_groups;
        let group = &structure.groups[g % n_groups];
        let layer = materials.layers[body.interval_layer[interval]];
        let wedges: Vec<[Vec3; 6]> = group.triangles[..usize::from(group.shape.n_wedges)]
            .iter()
            .map(|&t| body.prism(t as usize, interval).map(|n| body.positions[n]))
            .collect();
        let nearby = nearby(materials, &wedges);
        if nearby.is_empty() && materials.stiffness.is_none() {
            phases.push(Phase {
                material: layer as u32,
                points: [1.0; N_POINTS],
                volume: 1.0,
            });
            continue;
        }
        let halves: Vec<[Half; 2]> = wedges
            .iter()
            .map(|corners| sample(materials, &nearby, corners))
            .collect();
        push_phases(materials, layer, geometry, &nearby, &halves, &mut phases);
    }
    first.push(phases.len() as u32);
    (phases, first)
}

/// Lumps that may reach into a group.
fn nearby(materials: &Materials, wedges: &[[Vec3; 6]]) -> Vec<usize> {
    let corners = || wedges.iter().flatten();
    let n = corners().count() as f64;
    let middle = corners().sum::<Vec3>() / n;
    let reach = corners().map(|x| (x - middle).norm()).fold(0.0, f64::max);
    (0..materials.lumps.len())
        .filter(|&i| {
            let (centre, radius) = materials.lumps[i].bounding_sphere();
            (centre - middle).norm() <= radius + reach
        })
        .collect()
}

/// Means over the lower and the upper half of a wedge, in the order of the depth points.
fn sample(materials: &Materials, nearby: &[usize], corners: &[Vec3; 6]) -> [Half; 2] {
    let mut shares = vec![0.0; materials.lumps.len()];
    [-1.0, 1.0].map(|side| {
        let mut half = Half {
            lumps: vec![0.0; materials.lumps.len()],
            stiffness: 0.0,
        };
        let mut n = 0.0;
        for k in 0..IN_DEPTH {
            let zeta = side * (k as f64 + 0.5) / IN_DEPTH as f64;
            for (r, s) in triangle_points() {
                let in_plane = [1.0 - r - s, r, s];
                let p: Vec3 = (0..3)
                    .map(|c| {
                        let (upper, lower) = (corners[c], corners[c + 3]);
                        (upper * f64::midpoint(1.0, zeta) + lower * f64::midpoint(1.0, -zeta))
                            * in_plane[c]
                    })
                    .sum();
                materials.shares_at(nearby, &p, &mut shares);
                for &lump in nearby {
                    half.lumps[lump] += shares[lump];
                }
                half.stiffness += materials.stiffness.as_ref().map_or(1.0, |field| field(&p));
                n += 1.0;
            }
        }
        half.lumps.iter_mut().for_each(|share| *share /= n);
        half.stiffness /= n;
        half
    })
}

/// Centroids of the small triangles that a triangle is divided into.
fn triangle_points() -> impl Iterator<Item = (f64, f64)> {
    let n = IN_PLANE as f64;
    (0..IN_PLANE).flat_map(move |i| {
        (0..IN_PLANE - i).flat_map(move |j| {
            let corner = (i as f64 / n, j as f64 / n);
            let upright = (corner.0 + 1.0 / (3.0 * n), corner.1 + 1.0 / (3.0 * n));
            let turned = (corner.0 + 2.0 / (3.0 * n), corner.1 + 2.0 / (3.0 * n));
            std::iter::once(upright).chain((i + j + 1 < IN_PLANE).then_some(turned))
        })
    })
}

fn push_phases(
    materials: &Materials,
    layer: usize,
    geometry: &GroupGeometry,
    nearby: &[usize],
    halves: &[[Half; 2]],
    phases: &mut Vec<Phase>,
) {
    // Shares at the six points and of the whole, from those of the halves by volume.
    let mean = |of: &dyn Fn(&Half) -> f64| -> ([f64; N_POINTS], f64) {
        let mut points = [0.0; N_POINTS];
        let (mut sum, mut total) = (0.0, 0.0);
        for q in 0..2 {
            let (mut depth_sum, mut depth_volume) = (0.0, 0.0);
            for (w, halves) in halves.iter().enumerate() {
                let volume = geometry.wedges[w].volumes[q];
                let value = of(&halves[q]);
                points[2 + 2 * w + q] = value;
                depth_sum += volume * value;
                depth_volume += volume;
            }
            points[q] = depth_sum / depth_volume;
            sum += depth_sum;
            total += depth_volume;
        }
        (points, sum / total)
    };
    let (stiffness, mean_stiffness) = mean(&|half| half.stiffness);
    let base = &materials.materials[layer].law;
    let mut matrix = Phase {
        material: layer as u32,
        points: stiffness,
        volume: mean_stiffness,
    };
    for &lump in nearby {
        let (shares, share) = mean(&|half| half.lumps[lump]);
        if share == 0.0 {
            continue;
        }
        let material = materials.lumps[lump].material();
        let law = &materials.materials[material].law;
        let volume = geometry.volume();
        let grain = volume / (volume + materials.lumps[lump].volume());
        let mut phase = Phase {
            material: material as u32,
            points: [0.0; N_POINTS],
            volume: mean_stiffness * volume_share(base, law, share, grain),
        };
        matrix.volume -= phase.volume;
        for (point, share) in shares.into_iter().enumerate() {
            phase.points[point] = stiffness[point] * shear_share(base, law, share, grain);
            matrix.points[point] -= phase.points[point];
        }
        phases.push(phase);
    }
    // A group wholly inside a lump has no share of its layer.
    let is_left = matrix.volume > 1e-12 || matrix.points.iter().any(|&share| share > 1e-12);
    if is_left {
        phases.push(matrix);
    }
}

fn shear_share(layer: &Law, lump: &Law, share: f64, grain: f64) -> f64 {
    let nu = layer.poisson();
    let beta = 2.0 * (4.0 - 5.0 * nu) / (15.0 * (1.0 - nu));
    let ratio = lump.shear_modulus() / layer.shear_modulus();
    concentrated(share, beta, ratio, grain)
}

fn volume_share(layer: &Law, lump: &Law, share: f64, grain: f64) -> f64 {
    let nu = layer.poisson();
    let beta = (1.0 + nu) / (3.0 * (1.0 - nu));
    let ratio = lump.bulk_modulus() / layer.bulk_modulus();
    concentrated(share, beta, ratio, grain)
}

/// `c` of the formula in the module's documentation; `grain` is `s`.
fn concentrated(share: f64, of_grain: f64, ratio: f64, grain: f64) -> f64 {
    let beta = if ratio > 1.0 {
        grain * of_grain + 1.0 - grain
    } else {
        of_grain
    };
    share / (1.0 + (1.0 - share) * beta * (ratio - 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Between layer and lump, and where both are alike nothing changes.
    #[test]
    fn stiffness_of_mixtures_lies_between_that_of_series_and_the_mean() {
        for ratio in [0.01, 0.5, 1.0, 2.0, 30.0] {
            for grain in [1e-6, 0.3, 0.9] {
                for beta in [0.4, 0.9] {
                    let mut last = 1.0;
                    for share in [0.0, 0.1, 0.5, 0.9, 1.0] {
                        let c = concentrated(share, beta, ratio, grain);
                        let stiffness = 1.0 + c * (ratio - 1.0);
                        let series = 1.0 / (1.0 - share + share / ratio);
                        let mean = 1.0 + share * (ratio - 1.0);
                        assert!(series - 1e-12 <= stiffness && stiffness <= mean + 1e-12);
                        assert!((stiffness - last) * (ratio - 1.0) >= 0.0);
                        last = stiffness;
                    }
                    assert!((last - ratio).abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn samples_of_a_triangle_have_its_centroid() {
        let points: Vec<(f64, f64)> = triangle_points().collect();
        assert_eq!(points.len(), IN_PLANE * IN_PLANE);
        let mean = points.iter().map(|p| p.0).sum::<f64>() / points.len() as f64;
        assert!((mean - 1.0 / 3.0).abs() < 1e-12);
        let [lower, upper] = crate::element::GAUSS;
        assert!(lower < upper, "the lower half comes first");
    }
}
