//! Material laws: what holds for every one of them, what holds for each, and relaxation.

mod closed_forms;
mod every_law;
mod limits;
mod parameters;
mod relaxation;

use palpa_fem::Mat3;
use palpa_fem::law::{
    Fung, Gent, Law, LawError, Linear, MooneyRivlin, NeoHookean, Ogden, OgdenTerm,
    StVenantKirchhoff, Volumetric, Yeoh,
};

/// Every law, each with several sets of parameters: soft and hard, compressible and nearly not.
pub(crate) fn every_law() -> Vec<Law> {
    let quadratic = |bulk| Volumetric::Quadratic { bulk };
    let logarithmic = |bulk| Volumetric::Logarithmic { bulk };
    let term = |mu, alpha| OgdenTerm { mu, alpha };
    vec![
        law(Linear::from_young(30e3, 0.45)),
        law(Linear::from_young(1e6, -0.3)),
        law(StVenantKirchhoff::from_young(30e3, 0.3)),
        law(StVenantKirchhoff::from_young(5e3, 0.49)),
        law(NeoHookean::from_young(30e3, 0.45)),
        law(NeoHookean::from_young(5e3, 0.499)),
        law(NeoHookean::new(2e9, logarithmic(1e9))),
        law(MooneyRivlin::from_young(30e3, 0.45, 0.3)),
        law(MooneyRivlin::new(0.0, 4e3, logarithmic(1e5))),
        law(MooneyRivlin::new(9.4e3, 82e3, quadratic(5e6))),
        law(Yeoh::from_young(30e3, 0.45, [0.2, 0.05])),
        law(Yeoh::new([0.95e3, -0.1e3, 4.94e2], quadratic(2e5))),
        law(Ogden::from_young(30e3, 0.45, 8.0)),
        law(Ogden::new(&[term(4e3, -3.0)], logarithmic(5e4))),
        law(Ogden::new(
            &[
                term(4.1e5, 1.3),
                term(3e3, 5.0),
                term(1e4, -2.0),
                term(50.0, 9.0),
            ],
            quadratic(1e7),
        )),
        law(Ogden::new(
            &[term(1e4, 0.01), term(1e4, -0.5)],
            quadratic(1e5),
        )),
        law(Fung::from_young(30e3, 0.45, 1.2)),
        law(Fung::new(300.0, 12.0, logarithmic(3e4))),
        law(Gent::from_young(30e3, 0.45, 60.0)),
        law(Gent::new(300.0, 12.0, logarithmic(3e4))),
    ]
}

fn law(law: Result<impl Into<Law>, LawError>) -> Law {
    law.expect("a sound law").into()
}

/// Numbers without a pattern, the same in each run.
pub(crate) struct Chance(fastrand::Rng);

impl Chance {
    pub(crate) fn new(seed: u64) -> Self {
        Self(fastrand::Rng::with_seed(seed))
    }

    /// Evenly between −1 and 1.
    pub(crate) fn signed(&mut self) -> f64 {
        2.0 * self.0.f64() - 1.0
    }

    pub(crate) fn matrix(&mut self) -> Mat3 {
        Mat3::from_fn(|_, _| self.signed())
    }

    /// Any rotation.
    pub(crate) fn rotation(&mut self) -> Mat3 {
        let angles = [0, 1, 2].map(|_| self.signed() * std::f64::consts::PI);
        nalgebra::Rotation3::from_euler_angles(angles[0], angles[1], angles[2]).into_inner()
    }

    /// Stretches between `e^−strength` and `e^strength`, between two rotations.
    pub(crate) fn deformation(&mut self, strength: f64) -> Mat3 {
        let stretches = nalgebra::Vector3::from_fn(|_, _| (strength * self.signed()).exp());
        self.rotation() * Mat3::from_diagonal(&stretches) * self.rotation()
    }

    /// Small steps from rest, moderate strains, and strong ones.
    pub(crate) fn deformations(&mut self) -> Vec<Mat3> {
        let mut all = vec![Mat3::identity()];
        all.extend((0..4).map(|_| Mat3::identity() + 0.02 * self.matrix()));
        all.extend((0..6).map(|_| self.deformation(0.3)));
        all.extend((0..6).map(|_| self.deformation(0.9)));
        all
    }
}

#[track_caller]
pub(crate) fn assert_close(found: f64, expected: f64, relative: f64) {
    assert!(
        (found - expected).abs() <= relative * expected.abs(),
        "{found} instead of {expected}"
    );
}
