//! Laws that are special cases of others, and strains at which formulas degenerate.

use palpa_fem::law::{
    Fung, Gent, Law, MooneyRivlin, NeoHookean, Ogden, OgdenTerm, Volumetric, Yeoh,
};
use palpa_fem::{Mat3, Response};

use super::{Chance, every_law};

const MU: f64 = 1e4;
const VOLUMETRIC: Volumetric = Volumetric::Quadratic { bulk: 1e5 };

#[track_caller]
fn assert_same(found: &Response, expected: &Response, relative: f64) {
    let scale = expected.energy + 1e-6 * MU;
    assert!(
        (found.energy - expected.energy).abs() <= relative * scale,
        "{} instead of {}",
        found.energy,
        expected.energy
    );
    let scale = expected.stress.norm() + 1e-3 * MU;
    assert!(
        (found.stress - expected.stress).norm() <= relative * scale,
        "{} instead of {}",
        found.stress,
        expected.stress
    );
    let error = (found.tangent - expected.tangent).norm() / expected.tangent.norm();
    assert!(error <= relative, "tangent off by {error:e}");
}

/// The same law written in another way.
#[track_caller]
fn assert_same_law(found: impl Into<Law>, expected: impl Into<Law>, relative: f64) {
    let (found, expected) = (found.into(), expected.into());
    for f in Chance::new(11).deformations() {
        assert_same(
            &found.deviatoric_response(&f),
            &expected.deviatoric_response(&f),
            relative,
        );
    }
}

fn ogden(mu: f64, alpha: f64) -> Ogden {
    Ogden::new(&[OgdenTerm { mu, alpha }], VOLUMETRIC).expect("a sound law")
}

#[test]
fn each_law_ends_in_neo_hookean() {
    let expected = NeoHookean::new(MU, VOLUMETRIC).unwrap();
    assert_same_law(ogden(MU, 2.0), expected, 1e-12);
    assert_same_law(
        MooneyRivlin::new(0.5 * MU, 0.0, VOLUMETRIC).unwrap(),
        expected,
        1e-14,
    );
    assert_same_law(
        Yeoh::new([0.5 * MU, 0.0, 0.0], VOLUMETRIC).unwrap(),
        expected,
        1e-14,
    );
    assert_same_law(Fung::new(MU, 1e-14, VOLUMETRIC).unwrap(), expected, 1e-12);
    assert_same_law(Gent::new(MU, 1e14, VOLUMETRIC).unwrap(), expected, 1e-12);
}

/// `Ī2` is `Ī1` of the inverse, so that the exponent −2 is the second constant of Mooney and
/// Rivlin.
#[test]
fn ogden_of_two_and_minus_two_is_mooney_rivlin() {
    assert_same_law(
        ogden(MU, -2.0),
        MooneyRivlin::new(0.0, 0.5 * MU, VOLUMETRIC).unwrap(),
        1e-12,
    );
    let terms = [
        OgdenTerm {
            mu: 0.7 * MU,
            alpha: 2.0,
        },
        OgdenTerm {
            mu: 0.3 * MU,
            alpha: -2.0,
        },
    ];
    assert_same_law(
        Ogden::new(&terms, VOLUMETRIC).unwrap(),
        MooneyRivlin::new(0.35 * MU, 0.15 * MU, VOLUMETRIC).unwrap(),
        1e-12,
    );
}

#[test]
fn fung_starts_as_yeoh() {
    // μ/(2b) (e^{bx} − 1) = μ/2 (x + b x²/2 + b² x³/6 + …)
    let b = 0.01;
    let series = Yeoh::new([0.5 * MU, 0.25 * b * MU, b * b * MU / 12.0], VOLUMETRIC).unwrap();
    let (series, fung) = (
        Law::from(series),
        Law::from(Fung::new(MU, b, VOLUMETRIC).unwrap()),
    );
    for f in (0..20).map(|seed| Chance::new(seed).deformation(0.3)) {
        assert_same(
            &fung.deviatoric_response(&f),
            &series.deviatoric_response(&f),
            1e-7,
        );
    }
}

/// At the limit of stretch the energy and the stress grow without bound, and beyond it there is no
/// law.
#[test]
fn gent_ends_at_its_limit() {
    let limit = 2.0;
    let gent = Law::from(Gent::new(MU, limit, VOLUMETRIC).unwrap());
    // Ī1 − 3 = λ² + 2/λ − 3 of an incompressible tension.
    let tension = |stretch: f64| {
        let across = stretch.sqrt().recip();
        Mat3::from_diagonal(&[stretch, across, across].into())
    };
    let excess = |stretch: f64| stretch * stretch + 2.0 / stretch - 3.0;
    let (mut inside, mut outside) = (1.0, 3.0);
    for _ in 0..60 {
        let middle = 0.5 * (inside + outside);
        if excess(middle) < limit {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    let stress = |share: f64| {
        let f = tension(1.0 + share * (inside - 1.0));
        let (energy, stress) = gent.deviatoric_stress(&f);
        assert!(energy.is_finite(), "{share}: {energy}");
        stress.norm()
    };
    assert!(stress(0.9) > 3.0 * stress(0.5));
    assert!(stress(1.0 - 1e-9) > 1e6 * stress(0.9));
    for stretch in [1.0 + 1.000_001 * (inside - 1.0), 3.0, 1e3] {
        let refused = gent.deviatoric_response(&tension(stretch));
        assert_eq!(refused.energy, f64::INFINITY, "{stretch}");
        assert_eq!(refused.stress, Mat3::zeros());
        assert_eq!(gent.deviatoric_energy(&tension(stretch)), f64::INFINITY);
    }
}

/// Two or three equal stretches are 0/0 in the tangent of a law of stretches.
#[test]
fn equal_stretches_are_as_exact_as_others() {
    let mut chance = Chance::new(12);
    let neo_hookean = Law::from(NeoHookean::new(MU, VOLUMETRIC).unwrap());
    for stretches in [
        [1.0, 1.0, 1.0],
        [1.3, 1.3, 1.3],
        [0.7, 0.7, 1.6],
        [2.0, 0.8, 2.0],
        [0.5, 1.1, 1.1],
    ] {
        for apart in [0.0, 1e-15, 1e-12, 1e-9, 1e-7, 1e-5, 1e-3] {
            let [a, b, c] = stretches;
            let stretches = Mat3::from_diagonal(&[a * (1.0 + apart), b, c * (1.0 - apart)].into());
            for f in [stretches, chance.rotation() * stretches * chance.rotation()] {
                let found = Law::from(ogden(MU, 2.0)).deviatoric_response(&f);
                assert_same(&found, &neo_hookean.deviatoric_response(&f), 1e-12);
            }
        }
    }
}

/// A tangent must not jump where stretches become equal, for no exponent.
#[test]
fn tangents_are_continuous_at_equal_stretches() {
    for law in every_law() {
        for stretches in [[1.0, 1.0, 1.0], [0.7, 0.7, 1.6], [1.4, 0.9, 1.4]] {
            let f = Mat3::from_diagonal(&stretches.into());
            let near = f + 1e-9 * Chance::new(13).matrix();
            let (at, beside) = (
                law.deviatoric_response(&f).tangent,
                law.deviatoric_response(&near).tangent,
            );
            assert!(
                (at - beside).norm() <= 1e-6 * at.norm(),
                "{law:?} at {stretches:?}"
            );
        }
    }
}

/// Small tissue in large numbers: the invariants hold from 1e-40 to 1e40, far from rest.
#[test]
fn size_does_not_spoil_the_digits() {
    for law in every_law()
        .into_iter()
        .filter(|law| !matches!(law, Law::Linear(_) | Law::StVenantKirchhoff(_)))
    {
        for factor in [1e-40, 1e-9, 1e-3, 1e3, 1e40] {
            for f in (20..25).map(|seed| Chance::new(seed).deformation(0.4)) {
                let (energy, expected) = (
                    law.deviatoric_energy(&(factor * f)),
                    law.deviatoric_energy(&f),
                );
                assert!(
                    (energy - expected).abs() <= 1e-12 * expected,
                    "{law:?}: {energy} instead of {expected}"
                );
            }
        }
    }
}
