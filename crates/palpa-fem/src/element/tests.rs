//! Laws that the element must obey whatever its shape and material.

use nalgebra::{DMatrix, Rotation3};

use super::*;
use crate::law::{
    Fung, Gent, Linear, MooneyRivlin, NeoHookean, Ogden, OgdenTerm, StVenantKirchhoff, Volumetric,
    Yeoh,
};

/// Numbers between −1 and 1, the same in each run.
struct Noise(fastrand::Rng);

impl Noise {
    fn new(seed: u64) -> Self {
        Self(fastrand::Rng::with_seed(seed))
    }

    fn next(&mut self) -> f64 {
        2.0 * self.0.f64() - 1.0
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next())
    }
}

fn laws() -> Vec<Law> {
    let (mu, bulk) = (10e3, 200e3);
    let quadratic = Volumetric::Quadratic { bulk };
    let logarithmic = Volumetric::Logarithmic { bulk };
    let terms = [
        OgdenTerm {
            mu: 6e3,
            alpha: 4.0,
        },
        OgdenTerm {
            mu: 4e3,
            alpha: -3.0,
        },
    ];
    vec![
        Linear::new(mu, bulk).unwrap().into(),
        StVenantKirchhoff::new(mu, bulk).unwrap().into(),
        NeoHookean::new(mu, quadratic).unwrap().into(),
        NeoHookean::new(mu, logarithmic).unwrap().into(),
        MooneyRivlin::new(3e3, 2e3, quadratic).unwrap().into(),
        Yeoh::new([5e3, 1e3, 500.0], quadratic).unwrap().into(),
        Ogden::new(&terms, quadratic).unwrap().into(),
        Fung::new(mu, 3.0, quadratic).unwrap().into(),
        Gent::new(mu, 5.0, quadratic).unwrap().into(),
    ]
}

const PAIR_SHAPE: GroupLayout = GroupLayout {
    wedges: [[0, 1, 2], [3, 2, 1]],
    n_wedges: 2,
};
const SINGLE_SHAPE: GroupLayout = GroupLayout {
    wedges: [[0, 1, 2], [0, 1, 2]],
    n_wedges: 1,
};

/// A distorted pair: columns 0 (1 2) 3 around a quadrilateral, leaning and of unequal height.
fn nodes(noise: &mut Noise) -> [Vec3; N_NODES] {
    let plan = [(0.0, 0.0), (1.0, 0.1), (0.1, 0.9), (1.1, 1.0)];
    std::array::from_fn(|n| {
        let (x, y) = plan[n / 2];
        let z = if n % 2 == 0 { 0.6 } else { 0.0 };
        Vec3::new(x, y, z) + noise.vector() * 0.08
    })
}

fn geometry(shape: GroupLayout, nodes: &[Vec3; N_NODES]) -> GroupGeometry {
    let corners: Vec<[Vec3; 6]> = shape.wedges[..usize::from(shape.n_wedges)]
        .iter()
        .map(|columns| std::array::from_fn(|corner| nodes[node(*columns, corner)]))
        .collect();
    GroupGeometry::new(&corners)
}

fn plain() -> Phase {
    Phase {
        material: 0,
        points: [1.0; N_POINTS],
        volume: 1.0,
    }
}

/// A stress that a past or a tension has left, and factors as of relaxation.
fn overstress(noise: &mut Noise) -> Overstress {
    let points = std::array::from_fn(|_| {
        let m = Mat3::from_columns(&[noise.vector(), noise.vector(), noise.vector()]);
        (m + m.transpose()) * 500.0
    });
    Overstress {
        points,
        volume: 300.0,
    }
}

struct Case {
    name: String,
    shape: GroupLayout,
    geometry: GroupGeometry,
    law: Law,
    second: Option<Law>,
    overstress: Option<Overstress>,
    displacements: [Vec3; N_NODES],
}

impl Case {
    fn respond(&self, displacements: &[Vec3; N_NODES], with_tangent: bool) -> GroupResponse {
        let mut out = GroupResponse::new();
        let mixed = Phase {
            material: 0,
            points: [0.7, 0.6, 0.7, 0.6, 0.8, 0.5],
            volume: 0.65,
        };
        let rest = Phase {
            material: 1,
            points: [0.3, 0.4, 0.3, 0.4, 0.2, 0.5],
            volume: 0.35,
        };
        let whole = plain();
        let at = |law, phase, scale| PhaseAt {
            law,
            phase,
            scale,
            overstress: self.overstress.as_ref(),
        };
        let phases = match &self.second {
            Some(second) => vec![
                at(&self.law, &mixed, [1.2, 0.9]),
                at(second, &rest, [1.0, 1.0]),
            ],
            None => vec![at(&self.law, &whole, [1.0, 1.0])],
        };
        evaluate(
            self.shape,
            &self.geometry,
            displacements,
            &phases,
            Shares {
                alpha: 0.8,
                apart: 0.1,
            },
            with_tangent,
            &mut out,
        );
        out
    }
}

fn cases() -> Vec<Case> {
    let mut noise = Noise::new(7);
    let mut cases = Vec::new();
    for (shape, kind) in [(PAIR_SHAPE, "pair"), (SINGLE_SHAPE, "single")] {
        for law in laws() {
            for variant in 0..3 {
                let rest = nodes(&mut noise);
                let size = if law.kinematics() == Kinematics::Small {
                    1.0
                } else {
                    0.15
                };
                // Different laws meet only where they measure volume alike.
                let second = (variant == 1).then_some(law);
                cases.push(Case {
                    name: format!("{kind}, {}, variant {variant}", law.name()),
                    shape,
                    geometry: geometry(shape, &rest),
                    law,
                    second,
                    overstress: (variant == 2).then(|| overstress(&mut noise)),
                    displacements: std::array::from_fn(|_| noise.vector() * size),
                });
            }
        }
    }
    cases
}

fn n_nodes(case: &Case) -> usize {
    if case.shape.n_wedges == 2 { 8 } else { 6 }
}

#[test]
fn forces_are_the_slope_of_the_energy_and_stiffness_that_of_the_forces() {
    const STEP: f64 = 1e-6;
    for case in cases() {
        let middle = case.respond(&case.displacements, true);
        assert!(middle.energy.is_finite(), "{}", case.name);
        let force_size = middle.forces.iter().map(Vec3::norm).fold(0.0, f64::max);
        let stiffness_size = middle.stiffness.iter().map(Mat3::norm).fold(0.0, f64::max);
        for b in 0..n_nodes(&case) {
            for k in 0..3 {
                let moved = |sign: f64| {
                    let mut u = case.displacements;
                    u[b][k] += sign * STEP;
                    case.respond(&u, false)
                };
                let (plus, minus) = (moved(1.0), moved(-1.0));
                let slope = (plus.energy - minus.energy) / (2.0 * STEP);
                assert!(
                    (slope - middle.forces[b][k]).abs() < 1e-6 * force_size + 1e-9 * stiffness_size,
                    "{}: energy of node {b}: {slope} and {}",
                    case.name,
                    middle.forces[b][k]
                );
                for a in b..n_nodes(&case) {
                    let slope = (plus.forces[a] - minus.forces[a]) / (2.0 * STEP);
                    let column = middle.stiffness[a * (a + 1) / 2 + b].column(k).into_owned();
                    assert!(
                        (slope - column).norm() < 1e-7 * stiffness_size,
                        "{}: force of node {a} by node {b}: {slope} and {column}",
                        case.name
                    );
                }
            }
        }
    }
}

#[test]
fn turning_the_body_turns_its_forces() {
    let turn = Rotation3::from_euler_angles(0.7, -1.1, 2.0);
    for case in cases() {
        if case.law.kinematics() == Kinematics::Small {
            continue;
        }
        // Displacements of the turned body need its rest positions; u' = R (X + u) − X.
        let mut noise = Noise::new(7);
        let _ = noise.next();
        let still = case.respond(&case.displacements, false);
        let f = deformation(case.shape, &case.geometry, &case.displacements);
        let sum: Vec3 = still.forces.iter().sum();
        assert!(
            sum.norm() < 1e-9 * still.forces[0].norm().max(1.0),
            "{}",
            case.name
        );
        for f in f.iter().take(usize::from(case.shape.n_wedges)).flatten() {
            let (energy, stress) = case.law.deviatoric_stress(f);
            let (turned_energy, turned) = case.law.deviatoric_stress(&(turn.matrix() * f));
            assert!((energy - turned_energy).abs() <= 1e-9 * energy.abs().max(1.0));
            assert!((turn.matrix() * stress - turned).norm() <= 1e-9 * stress.norm().max(1.0));
        }
    }
}

/// The stiffness as a full matrix.
fn full(case: &Case, response: &GroupResponse) -> DMatrix<f64> {
    let n = n_nodes(case);
    DMatrix::from_fn(3 * n, 3 * n, |i, j| {
        let (a, b) = (i / 3, j / 3);
        if a >= b {
            response.stiffness[a * (a + 1) / 2 + b][(i % 3, j % 3)]
        } else {
            response.stiffness[b * (b + 1) / 2 + a][(j % 3, i % 3)]
        }
    })
}

#[test]
fn at_rest_only_rigid_motions_cost_nothing() {
    for case in cases().into_iter().filter(|c| c.overstress.is_none()) {
        let response = case.respond(&[Vec3::zeros(); N_NODES], true);
        let stiffness = full(&case, &response);
        let asymmetry = (&stiffness - stiffness.transpose()).norm();
        assert!(
            asymmetry < 1e-9 * stiffness.norm(),
            "{}: {asymmetry}",
            case.name
        );
        let mut modes: Vec<f64> = stiffness.symmetric_eigenvalues().iter().copied().collect();
        modes.sort_by(f64::total_cmp);
        let largest = modes[modes.len() - 1];
        assert!(
            modes[..6].iter().all(|m| m.abs() < 1e-9 * largest),
            "{}: {:?}",
            case.name,
            &modes[..8]
        );
        // A lone wedge has one more (its volume change may be linear over the thickness); its
        // neighbours hold that.
        let first = if case.shape.n_wedges == 2 { 6 } else { 7 };
        assert!(
            modes[first] > 1e-4 * largest,
            "{}: no seventh zero, {:?}",
            case.name,
            &modes[..8]
        );
        assert!(response.energy.abs() < 1e-12 && response.forces.iter().all(|f| f.norm() < 1e-9));
    }
}

#[test]
fn an_inverted_element_is_refused() {
    for case in cases() {
        if case.law.kinematics() == Kinematics::Small {
            continue;
        }
        let mut u = [Vec3::zeros(); N_NODES];
        for (n, u) in u.iter_mut().enumerate() {
            // The upper nodes are pressed through the lower ones.
            if n % 2 == 0 {
                *u = Vec3::new(0.0, 0.0, -1.5);
            }
        }
        assert!(case.respond(&u, true).energy.is_infinite(), "{}", case.name);
    }
}
