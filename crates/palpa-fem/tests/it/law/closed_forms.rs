//! Stresses of simple strains, by formula and by another program.

use palpa_fem::Mat3;
use palpa_fem::law::{
    Fung, Gent, Law, Linear, MooneyRivlin, NeoHookean, Ogden, OgdenTerm, StVenantKirchhoff,
    Volumetric, Yeoh,
};

use super::assert_close;

const VOLUMETRIC: Volumetric = Volumetric::Quadratic { bulk: 1e5 };

fn diagonal(x: f64, y: f64, z: f64) -> Mat3 {
    Mat3::from_diagonal(&[x, y, z].into())
}

/// Difference of the Cauchy stresses along and across a stretch that keeps the volume.
fn tension(law: impl Into<Law>, stretch: f64) -> f64 {
    let across = stretch.sqrt().recip();
    let cauchy = law.into().cauchy_stress(&diagonal(across, across, stretch));
    cauchy[(2, 2)] - cauchy[(0, 0)]
}

#[test]
fn tension_at_constant_volume() {
    for stretch in [0.4, 0.8, 1.001, 1.5, 2.5_f64] {
        let (strain, x) = (
            stretch.powi(2) - 1.0 / stretch,
            stretch.powi(2) + 2.0 / stretch - 3.0,
        );
        let neo_hookean = NeoHookean::new(1e4, VOLUMETRIC).unwrap();
        assert_close(tension(neo_hookean, stretch), 1e4 * strain, 1e-12);
        let mooney = MooneyRivlin::new(3e3, 2e3, VOLUMETRIC).unwrap();
        assert_close(
            tension(mooney, stretch),
            2.0 * (3e3 + 2e3 / stretch) * strain,
            1e-12,
        );
        let yeoh = Yeoh::new([3e3, 500.0, 70.0], VOLUMETRIC).unwrap();
        assert_close(
            tension(yeoh, stretch),
            2.0 * (3e3 + 1e3 * x + 210.0 * x * x) * strain,
            1e-12,
        );
        let fung = Fung::new(1e4, 2.0, VOLUMETRIC).unwrap();
        assert_close(
            tension(fung, stretch),
            1e4 * (2.0 * x).exp() * strain,
            1e-11,
        );
        let gent = Gent::new(1e4, 9.0, VOLUMETRIC).unwrap();
        assert_close(
            tension(gent, stretch),
            1e4 * 9.0 / (9.0 - x) * strain,
            1e-12,
        );
        let terms = [(4e3, 5.0), (2e3, -3.0), (1e3, 0.5)];
        let expected: f64 = terms
            .iter()
            .map(|&(mu, alpha)| {
                2.0 * mu / alpha * (stretch.powf(alpha) - stretch.powf(-0.5 * alpha))
            })
            .sum();
        let ogden = Ogden::new(
            &terms.map(|(mu, alpha)| OgdenTerm { mu, alpha }),
            VOLUMETRIC,
        )
        .unwrap();
        assert_close(tension(ogden, stretch), expected, 1e-12);
    }
}

#[test]
fn simple_shear() {
    for slope in [0.01, 0.5, 2.0] {
        let f = Mat3::new(1.0, slope, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
        let shear = |law: Law| law.cauchy_stress(&f)[(0, 1)];
        assert_close(
            shear(NeoHookean::new(1e4, VOLUMETRIC).unwrap().into()),
            1e4 * slope,
            1e-13,
        );
        assert_close(
            shear(MooneyRivlin::new(3e3, 2e3, VOLUMETRIC).unwrap().into()),
            1e4 * slope,
            1e-13,
        );
        let fung = Fung::new(1e4, 0.7, VOLUMETRIC).unwrap();
        assert_close(
            shear(fung.into()),
            1e4 * slope * (0.7 * slope * slope).exp(),
            1e-12,
        );
        let gent = Gent::new(1e4, 5.0, VOLUMETRIC).unwrap();
        assert_close(
            shear(gent.into()),
            1e4 * slope * 5.0 / (5.0 - slope * slope),
            1e-12,
        );
        assert_close(
            shear(Linear::new(1e4, 1e5).unwrap().into()),
            1e4 * slope,
            1e-13,
        );
    }
}

/// `W = λ/2 (tr E)² + μ E:E`, the form of the books, whose parts are split otherwise here.
#[test]
fn the_two_hookean_laws_are_those_of_the_books() {
    let (mu, lambda) = (1e4, 3e4);
    let bulk = lambda + 2.0 / 3.0 * mu;
    let whole = |strain: Mat3| 0.5 * lambda * strain.trace().powi(2) + mu * strain.norm_squared();
    let f = Mat3::new(1.2, 0.1, -0.3, 0.2, 0.8, 0.05, 0.0, 0.15, 1.1);
    let green = 0.5 * (f.transpose() * f - Mat3::identity());
    let kirchhoff = Law::from(StVenantKirchhoff::new(mu, bulk).unwrap());
    assert_close(kirchhoff.energy(&f), whole(green), 1e-13);
    let second = lambda * green.trace() * Mat3::identity() + 2.0 * mu * green;
    assert!((kirchhoff.stress(&f) - f * second).norm() < 1e-13 * second.norm());
    let small = 0.5 * (f + f.transpose()) - Mat3::identity();
    let linear = Law::from(Linear::new(mu, bulk).unwrap());
    assert_close(linear.energy(&f), whole(small), 1e-13);
}

/// Nominal stresses of the quadratic neo-Hookean law in a frictionless column that may swell, from
/// a solution of the two equations that is independent of this code; CalculiX agrees with it.
#[test]
fn free_column() {
    // Poisson's ratio, axial and lateral stretch, nominal stress in Pa; E = 30 kPa.
    for (poisson, axial, lateral, stress) in [
        (0.45, 0.95, 1.0233915, -1582.4155),
        (0.45, 0.7, 1.1756426, -13477.943),
        (0.45, 0.5, 1.3693836, -35100.741),
        (0.45, 1.3, 0.88990196, 7009.2867),
        (0.49, 0.8, 1.1157467, -7632.6922),
    ] {
        let law = Law::from(NeoHookean::from_young(30e3, poisson).unwrap());
        let side = |lateral: f64| law.stress(&diagonal(lateral, lateral, axial))[(0, 0)];
        let (mut low, mut high) = (0.5, 2.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if side(middle) < 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        assert_close(low, lateral, 1e-7);
        assert_close(law.stress(&diagonal(low, low, axial))[(2, 2)], stress, 1e-7);
    }
}

/// Nominal pressures of a confined column of the same law, where CalculiX gives the same to 7
/// digits.
#[test]
fn confined_column() {
    let law = Law::from(NeoHookean::from_young(30e3, 0.45).unwrap());
    for (stretch, pressure) in [(0.95, 5732.4263), (0.8, 23601.233), (0.5, 66421.39)] {
        let stress = law.stress(&diagonal(1.0, 1.0, stretch));
        assert_close(-stress[(2, 2)], pressure, 1e-7);
    }
}
