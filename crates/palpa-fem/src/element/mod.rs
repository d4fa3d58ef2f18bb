//! The element: a pair of wedges under a quadrilateral of two skin triangles, in one interval
//! between levels.
//!
//! ```text
//! W = α Σ_q V_q W_d(F^_q)  +  (1 − α) Σ_wedges Σ_q V_wq W_d(F^_wq)  +  V U(v̄)
//!     + ½ γ K V₀ V₁/V (v̄₀ − v̄₁)²,   v̄ = Σ V_wq v(F_wq) / V
//! ```
//! `F_wq` is the deformation gradient of wedge w over its centroid at depth point q, `F_q` the mean
//! of both wedges' by volume. The volume change is one number per pair, which is what removes
//! locking; the deviator of the pair's mean alone would leave hourglass modes, which the wedges'
//! own deviators, weighted by 1 − α, hold. `F^` is corrected for thickness, see [`unit`]. A
//! triangle without a partner is a group of one.
//!
//! Derivation: `docs/theory/paired_prism.md`.

#![expect(
    clippy::needless_range_loop,
    reason = "wedges, points and nodes index several arrays together"
)]

mod geometry;
#[cfg(test)]
mod tests;
mod unit;

use palpa_mesh::Vec3;

#[cfg(test)]
pub(crate) use geometry::GAUSS;
pub(crate) use geometry::GroupGeometry;
pub(crate) use unit::cofactor;
use unit::{Corrected, PointResponse, UnitResponse, add_second_derivative_of_det};

use crate::{Kinematics, Law, Mat3, Mat9, VolumeMeasure};

/// Number of points at which a group evaluates its material: two of the pair's mean, two of each
/// wedge.
pub(crate) const N_POINTS: usize = 6;
/// The two points of the pair's mean, and of each wedge, among the points of a group.
const PAIR: usize = 0;
const WEDGES: [usize; 2] = [2, 4];

/// A material of a group and its share at every place: the six points, then the volume.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Phase {
    pub(crate) material: u32,
    pub(crate) points: [f64; N_POINTS],
    pub(crate) volume: f64,
}

/// Stress that stays constant during a step of a viscous or pre-stressed material, at every place
/// of a group.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Overstress {
    /// Second Piola–Kirchhoff stress that does not depend on the step's deformation, in Pa.
    pub(crate) points: [Mat3; N_POINTS],
    /// The like for the volume, in Pa.
    pub(crate) volume: f64,
}

/// One phase with everything that its response depends on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PhaseAt<'a> {
    pub(crate) law: &'a Law,
    pub(crate) phase: &'a Phase,
    /// Factors of the law's deviatoric and volumetric part in this step.
    pub(crate) scale: [f64; 2],
    pub(crate) overstress: Option<&'a Overstress>,
}

/// How a group stands in the mesh: which columns its wedges have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct GroupLayout {
    /// For each wedge the local columns of its corners, as the triangle has them.
    pub(crate) wedges: [[u8; 3]; 2],
    /// 1 or 2.
    pub(crate) n_wedges: u8,
}

/// Shares of a pair's mean and of its wedges in its energy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shares {
    /// `α`, that of the pair's mean deviator, 0 to below 1; the rest is that of the single wedges. Near 1,
    /// single nodes show hourglass modes.
    pub alpha: f64,
    /// `γ`, that of the bulk modulus with which the wedges resist to change their volumes against each
    /// other, 0 to 1.
    pub apart: f64,
}

/// Number of nodes of a pair; those of column c are 2 c (upper) and 2 c + 1 (lower).
pub(crate) const N_NODES: usize = 8;
/// Number of node pairs a ≥ b, in the order `a (a + 1)/2 + b`.
pub(crate) const N_BLOCKS: usize = N_NODES * (N_NODES + 1) / 2;

/// Energy, forces and stiffness of a group.
#[derive(Debug, Clone)]
pub(crate) struct GroupResponse {
    /// J; infinite when the group is inverted, and then nothing else is to be used.
    pub(crate) energy: f64,
    /// Force of the body on its nodes' displacements, `∂W/∂u`, in N.
    pub(crate) forces: [Vec3; N_NODES],
    /// `∂²W/∂u_a∂u_b` for a ≥ b, rows of a, in N/m.
    pub(crate) stiffness: [Mat3; N_BLOCKS],
}

impl GroupResponse {
    pub(crate) fn new() -> Self {
        Self {
            energy: 0.0,
            forces: [Vec3::zeros(); N_NODES],
            stiffness: [Mat3::zeros(); N_BLOCKS],
        }
    }
}

/// Local node of a wedge's corner (0–2 upper, 3–5 lower).
fn node(columns: [u8; 3], corner: usize) -> usize {
    2 * usize::from(columns[corner % 3]) + corner / 3
}

/// Deformation gradients of the wedges at their points.
pub(crate) fn deformation(
    shape: GroupLayout,
    geometry: &GroupGeometry,
    displacements: &[Vec3; N_NODES],
) -> [[Mat3; 2]; 2] {
    let mut f = [[Mat3::identity(); 2]; 2];
    for w in 0..usize::from(shape.n_wedges) {
        let columns = shape.wedges[w];
        for q in 0..2 {
            for (corner, gradient) in geometry.wedges[w].gradients[q].iter().enumerate() {
                f[w][q] += displacements[node(columns, corner)] * gradient.transpose();
            }
        }
    }
    f
}

/// Evaluates a group.
pub(crate) fn evaluate(
    shape: GroupLayout,
    geometry: &GroupGeometry,
    displacements: &[Vec3; N_NODES],
    phases: &[PhaseAt<'_>],
    shares: Shares,
    with_tangent: bool,
    out: &mut GroupResponse,
) {
    let n_wedges = usize::from(shape.n_wedges);
    let kinematics = phases[0].law.kinematics();
    let f = deformation(shape, geometry, displacements);
    out.energy = 0.0;
    out.forces = [Vec3::zeros(); N_NODES];
    if with_tangent {
        out.stiffness = [Mat3::zeros(); N_BLOCKS];
    }
    let alpha = if n_wedges == 2 { shares.alpha } else { 0.0 };
    let Some(volume) = volumetric(shape, geometry, &f, phases, kinematics, shares.apart) else {
        out.energy = f64::INFINITY;
        return;
    };
    out.energy += volume.energy;

    if alpha > 0.0 {
        let pair = PairMean::new(geometry, &f);
        let Some(response) = two_points(
            kinematics,
            &pair.f,
            pair.volumes,
            geometry,
            phases,
            PAIR,
            alpha,
            with_tangent,
        ) else {
            out.energy = f64::INFINITY;
            return;
        };
        out.energy += response.energy;
        let gradients = pair.node_gradients(shape, geometry);
        let nodes = [0, 1, 2, 3, 4, 5, 6, 7];
        add(&nodes, &gradients, &response, with_tangent, out);
    }
    for w in 0..n_wedges {
        let wedge = &geometry.wedges[w];
        let Some(mut response) = two_points(
            kinematics,
            &f[w],
            wedge.volumes,
            geometry,
            phases,
            WEDGES[w],
            1.0 - alpha,
            with_tangent,
        ) else {
            out.energy = f64::INFINITY;
            return;
        };
        out.energy += response.energy;
        for q in 0..2 {
            response.stress[q] += volume.stress[w][q];
            if with_tangent {
                match volume.measure {
                    VolumeMeasure::Jacobian => add_second_derivative_of_det(
                        &mut response.tangent[q][q],
                        &f[w][q],
                        volume.pressures[w] * wedge.volumes[q],
                    ),
                    VolumeMeasure::GreenTrace => {
                        for i in 0..9 {
                            response.tangent[q][q][(i, i)] +=
                                volume.pressures[w] * wedge.volumes[q];
                        }
                    }
                    VolumeMeasure::SmallTrace => {}
                }
            }
        }
        let nodes: [usize; 6] = std::array::from_fn(|corner| node(shape.wedges[w], corner));
        add(&nodes, &wedge.gradients, &response, with_tangent, out);
    }
    if with_tangent {
        add_bulk_stiffness(shape, geometry, &volume, out);
    }
}

/// The volumetric part of a group.
struct VolumePart {
    /// Mean of `v` over the group, less 1.
    change: f64,
    energy: f64,
    /// Pressure of the wedges, positive in tension: the mean of `U'` over the phases, and what the
    /// two wedges have against each other. Pa
    pressures: [f64; 2],
    /// `U''/V`, in Pa/m³.
    stiffness: f64,
    /// `κ V/(V₀ V₁)`, in Pa/m³; 0 for a single wedge.
    apart: f64,
    measure: VolumeMeasure,
    /// `∂v/∂F` at the points.
    derivative: [[Mat3; 2]; 2],
    /// `∂(V U)/∂F` at the points, in N m.
    stress: [[Mat3; 2]; 2],
}

/// Volume change at a point, less 1, and its derivative.
pub(crate) fn volume_change(measure: VolumeMeasure, f: &Mat3) -> (f64, Mat3) {
    match measure {
        VolumeMeasure::Jacobian => {
            let cofactor = cofactor(f);
            (f.column(0).dot(&cofactor.column(0)) - 1.0, cofactor)
        }
        VolumeMeasure::GreenTrace => (0.5 * (f.norm_squared() - 3.0), *f),
        VolumeMeasure::SmallTrace => (f.trace() - 3.0, Mat3::identity()),
    }
}

fn volumetric(
    shape: GroupLayout,
    geometry: &GroupGeometry,
    f: &[[Mat3; 2]; 2],
    phases: &[PhaseAt<'_>],
    kinematics: Kinematics,
    apart_share: f64,
) -> Option<VolumePart> {
    let measure = phases[0].law.volume_measure();
    let total = geometry.volume();
    let mut derivative = [[Mat3::zeros(); 2]; 2];
    let mut changes = [0.0; 2];
    for w in 0..usize::from(shape.n_wedges) {
        for q in 0..2 {
            if kinematics == Kinematics::Finite
                && measure != VolumeMeasure::Jacobian
                && f[w][q].determinant() <= 0.0
            {
                return None;
            }
            let (v, dv) = volume_change(measure, &f[w][q]);
            changes[w] += geometry.wedges[w].volumes[q] / geometry.wedges[w].volume() * v;
            derivative[w][q] = dv;
        }
    }
    let share = |w: usize| geometry.wedges[w].volume() / total;
    let change = share(0) * changes[0] + share(1) * changes[1];
    let (mut energy, mut pressure, mut bulk, mut kappa) = (0.0, 0.0, 0.0, 0.0);
    for at in phases {
        let [u, du, ddu] = at.law.volumetric(1.0 + change);
        // Without the factors of a step: it has no memory.
        kappa += apart_share * at.phase.volume * at.law.volumetric(1.0)[2];
        let scale = at.scale[1] * at.phase.volume;
        let constant = at.phase.volume * at.overstress.map_or(0.0, |o| o.volume);
        energy += total * (scale * u + constant * change);
        pressure += scale * du + constant;
        bulk += scale * ddu;
    }
    let mut pressures = [pressure; 2];
    let mut apart = 0.0;
    if shape.n_wedges == 2 {
        let difference = changes[0] - changes[1];
        energy += 0.5 * kappa * total * share(0) * share(1) * difference * difference;
        pressures[0] += kappa * share(1) * difference;
        pressures[1] -= kappa * share(0) * difference;
        apart = kappa / (total * share(0) * share(1));
    }
    if !energy.is_finite() {
        return None;
    }
    let stress = [0, 1]
        .map(|w| [0, 1].map(|q| derivative[w][q] * (pressures[w] * geometry.wedges[w].volumes[q])));
    Some(VolumePart {
        change,
        energy,
        pressures,
        stiffness: bulk / total,
        apart,
        measure,
        derivative,
        stress,
    })
}

fn add_bulk_stiffness(
    shape: GroupLayout,
    geometry: &GroupGeometry,
    volume: &VolumePart,
    out: &mut GroupResponse,
) {
    let total = geometry.volume();
    let mut gradient = [Vec3::zeros(); N_NODES];
    let mut difference = [Vec3::zeros(); N_NODES];
    for w in 0..usize::from(shape.n_wedges) {
        let wedge = &geometry.wedges[w];
        let other = if w == 0 {
            geometry.wedges[1].volume() / total
        } else {
            -geometry.wedges[0].volume() / total
        };
        for q in 0..2 {
            let weighted = volume.derivative[w][q] * wedge.volumes[q];
            for corner in 0..6 {
                let at = node(shape.wedges[w], corner);
                let part = weighted * wedge.gradients[q][corner];
                gradient[at] += part;
                difference[at] += part * other;
            }
        }
    }
    for a in 0..N_NODES {
        let left = gradient[a] * volume.stiffness;
        let apart = difference[a] * volume.apart;
        for b in 0..=a {
            out.stiffness[a * (a + 1) / 2 + b] +=
                left * gradient[b].transpose() + apart * difference[b].transpose();
        }
    }
}

/// The mean of both wedges by volume, at the two depth points.
struct PairMean {
    f: [Mat3; 2],
    volumes: [f64; 2],
    share: [[f64; 2]; 2],
}

impl PairMean {
    fn new(geometry: &GroupGeometry, f: &[[Mat3; 2]; 2]) -> Self {
        let v = [0, 1].map(|w| geometry.wedges[w].volumes);
        let volumes = [0, 1].map(|q| v[0][q] + v[1][q]);
        let share = [0, 1].map(|w| [0, 1].map(|q| v[w][q] / volumes[q]));
        Self {
            f: [0, 1].map(|q| f[0][q] * share[0][q] + f[1][q] * share[1][q]),
            volumes,
            share,
        }
    }

    fn node_gradients(&self, shape: GroupLayout, geometry: &GroupGeometry) -> [[Vec3; N_NODES]; 2] {
        let mut gradients = [[Vec3::zeros(); N_NODES]; 2];
        for w in 0..2 {
            for q in 0..2 {
                for (corner, gradient) in geometry.wedges[w].gradients[q].iter().enumerate() {
                    gradients[q][node(shape.wedges[w], corner)] += gradient * self.share[w][q];
                }
            }
        }
        gradients
    }
}

/// Deviatoric response of two points over the thickness; `None` when one is inverted.
#[expect(clippy::too_many_arguments, reason = "a kernel: all of it is local")]
fn two_points(
    kinematics: Kinematics,
    f: &[Mat3; 2],
    volumes: [f64; 2],
    geometry: &GroupGeometry,
    phases: &[PhaseAt<'_>],
    first_point: usize,
    weight: f64,
    with_tangent: bool,
) -> Option<UnitResponse> {
    let (thickness, gradient) = (&geometry.thickness, &geometry.thickness_gradient);
    let corrected = Corrected::new(kinematics, f, volumes, thickness, gradient)?;
    let points = [0, 1].map(|q| {
        deviatoric(
            phases,
            first_point + q,
            &corrected.f[q],
            weight * volumes[q],
            with_tangent,
        )
    });
    let response = corrected.pull_back(&points, thickness, gradient, with_tangent);
    response.energy.is_finite().then_some(response)
}

/// Deviatoric response of all phases together at a point.
fn deviatoric(
    phases: &[PhaseAt<'_>],
    point: usize,
    f: &Mat3,
    volume: f64,
    with_tangent: bool,
) -> PointResponse {
    let mut sum = PointResponse {
        energy: 0.0,
        stress: Mat3::zeros(),
        tangent: Mat9::zeros(),
    };
    for at in phases {
        let share = volume * at.phase.points[point];
        let scale = share * at.scale[0];
        if with_tangent {
            let response = at.law.deviatoric_response(f);
            sum.energy += scale * response.energy;
            sum.stress += response.stress * scale;
            sum.tangent += response.tangent * scale;
        } else {
            let (energy, stress) = at.law.deviatoric_stress(f);
            sum.energy += scale * energy;
            sum.stress += stress * scale;
        }
        if let Some(overstress) = at.overstress {
            let s = overstress.points[point] * share;
            match at.law.kinematics() {
                Kinematics::Finite => {
                    // ½ S : (FᵀF − I)
                    sum.energy += 0.5 * (s.component_mul(&(f.transpose() * f)).sum() - s.trace());
                    sum.stress += f * s;
                    if with_tangent {
                        for j in 0..3 {
                            for l in 0..3 {
                                for i in 0..3 {
                                    sum.tangent[(i + 3 * j, i + 3 * l)] += s[(j, l)];
                                }
                            }
                        }
                    }
                }
                Kinematics::Small => {
                    sum.energy += s.component_mul(f).sum() - s.trace();
                    sum.stress += s;
                }
            }
        }
    }
    sum
}

/// Adds a unit's response to its nodes.
fn add<const N: usize>(
    nodes: &[usize; N],
    gradients: &[[Vec3; N]; 2],
    response: &UnitResponse,
    with_tangent: bool,
    out: &mut GroupResponse,
) {
    for (a, &node) in nodes.iter().enumerate() {
        out.forces[node] +=
            response.stress[0] * gradients[0][a] + response.stress[1] * gradients[1][a];
    }
    if !with_tangent {
        return;
    }
    for (b, &node_b) in nodes.iter().enumerate() {
        // The tangent contracted with the gradients of b: rows of (i, j), columns of k.
        let mut half = [nalgebra::SMatrix::<f64, 9, 3>::zeros(); 2];
        for (p, half) in half.iter_mut().enumerate() {
            for r in 0..2 {
                let tangent = &response.tangent[p][r];
                let g = &gradients[r][b];
                for l in 0..3 {
                    *half += tangent.fixed_columns::<3>(3 * l) * g[l];
                }
            }
        }
        for (a, &node_a) in nodes.iter().enumerate() {
            if node_a < node_b {
                continue;
            }
            let mut block = Mat3::zeros();
            for p in 0..2 {
                let g = &gradients[p][a];
                for j in 0..3 {
                    block += half[p].fixed_rows::<3>(3 * j) * g[j];
                }
            }
            out.stiffness[node_a * (node_a + 1) / 2 + node_b] += block;
        }
    }
}

/// The deviatoric stress of a law at every point of a group, as second Piola–Kirchhoff stress, and
/// its `U'`.
pub(crate) fn elastic_stresses(
    shape: GroupLayout,
    geometry: &GroupGeometry,
    displacements: &[Vec3; N_NODES],
    law: &Law,
) -> Option<Overstress> {
    let f = deformation(shape, geometry, displacements);
    let kinematics = law.kinematics();
    let mut stresses = Overstress {
        points: [Mat3::zeros(); N_POINTS],
        volume: 0.0,
    };
    let pair = PairMean::new(geometry, &f);
    let n_wedges = usize::from(shape.n_wedges);
    let units = [
        (PAIR, pair.f, pair.volumes),
        (WEDGES[0], f[0], geometry.wedges[0].volumes),
        (WEDGES[1], f[1], geometry.wedges[1].volumes),
    ];
    let used = if n_wedges == 2 { 0..3 } else { 1..2 };
    for (first, f, volumes) in &units[used] {
        let corrected = Corrected::new(
            kinematics,
            f,
            *volumes,
            &geometry.thickness,
            &geometry.thickness_gradient,
        )?;
        for q in 0..2 {
            let (_, stress) = law.deviatoric_stress(&corrected.f[q]);
            stresses.points[first + q] = match kinematics {
                Kinematics::Finite => corrected.f[q].try_inverse()? * stress,
                Kinematics::Small => stress,
            };
        }
    }
    let total = geometry.volume();
    let mut change = 0.0;
    for w in 0..n_wedges {
        for q in 0..2 {
            let share = geometry.wedges[w].volumes[q] / total;
            change += share * volume_change(law.volume_measure(), &f[w][q]).0;
        }
    }
    stresses.volume = law.volumetric(1.0 + change)[1];
    Some(stresses)
}

/// For each wedge of a group: Cauchy stress, mean deformation gradient, volume ratio and energy
/// density.
pub(crate) fn element_fields(
    shape: GroupLayout,
    geometry: &GroupGeometry,
    displacements: &[Vec3; N_NODES],
    phases: &[PhaseAt<'_>],
    shares: Shares,
) -> [(Mat3, Mat3, f64, f64); 2] {
    let f = deformation(shape, geometry, displacements);
    let kinematics = phases[0].law.kinematics();
    let mut fields = [(Mat3::zeros(), Mat3::identity(), 1.0, 0.0); 2];
    let Some(volume) = volumetric(shape, geometry, &f, phases, kinematics, shares.apart) else {
        return fields;
    };
    let n_wedges = usize::from(shape.n_wedges);
    let alpha = if n_wedges == 2 { shares.alpha } else { 0.0 };
    let pair = PairMean::new(geometry, &f);
    let total = geometry.volume();
    for w in 0..n_wedges {
        let wedge = &geometry.wedges[w];
        let mean = (f[w][0] * wedge.volumes[0] + f[w][1] * wedge.volumes[1]) / wedge.volume();
        let mut cauchy = Mat3::zeros();
        let mut energy = volume.energy / total;
        let units = [
            (PAIR, &pair.f, pair.volumes, alpha),
            (WEDGES[w], &f[w], wedge.volumes, 1.0 - alpha),
        ];
        for (first, f, volumes, weight) in units.into_iter().filter(|unit| unit.3 > 0.0) {
            let corrected = Corrected::new(
                kinematics,
                f,
                volumes,
                &geometry.thickness,
                &geometry.thickness_gradient,
            );
            let Some(corrected) = corrected else { continue };
            for q in 0..2 {
                let share = weight * volumes[q] / (volumes[0] + volumes[1]);
                let at = &corrected.f[q];
                let point = deviatoric(phases, first + q, at, share, false);
                energy += point.energy;
                cauchy += match kinematics {
                    Kinematics::Finite => point.stress * at.transpose() / at.determinant(),
                    Kinematics::Small => point.stress,
                };
            }
        }
        // Volumetric stress p ∂v/∂F, turned to the present frame.
        cauchy += match volume.measure {
            VolumeMeasure::Jacobian | VolumeMeasure::SmallTrace => {
                Mat3::identity() * volume.pressures[w]
            }
            VolumeMeasure::GreenTrace => {
                mean * mean.transpose() * (volume.pressures[w] / mean.determinant())
            }
        };
        fields[w] = (cauchy, mean, 1.0 + volume.change, energy);
    }
    fields
}
