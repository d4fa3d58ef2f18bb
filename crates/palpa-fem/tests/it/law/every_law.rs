//! Properties of every law.

use palpa_fem::law::Law;
use palpa_fem::{Kinematics, Mat3, Mat9, VolumeMeasure};
use palpa_testkit::cases;
use proptest::prelude::*;

use super::{Chance, assert_close, every_law};

fn finite_laws() -> impl Iterator<Item = Law> {
    every_law()
        .into_iter()
        .filter(|law| law.kinematics() == Kinematics::Finite)
}

/// Derivative of `value` along entry `ij`, by central differences of two widths (Richardson).
fn derivative<T>(f: &Mat3, ij: usize, width: f64, value: impl Fn(&Mat3) -> T) -> T
where
    T: std::ops::Sub<Output = T> + std::ops::Mul<f64, Output = T>,
{
    let central = |width: f64| {
        let (mut ahead, mut behind) = (*f, *f);
        ahead[ij] += width;
        behind[ij] -= width;
        (value(&ahead) - value(&behind)) * (0.5 / width)
    };
    central(0.5 * width) * (4.0 / 3.0) - central(width) * (1.0 / 3.0)
}

/// A width that suits the sharpest of the laws: they vary on the scale of the least stretch.
fn width(f: &Mat3) -> f64 {
    2e-4 * f.singular_values().min()
}

#[test]
fn stress_is_the_derivative_of_energy() {
    for law in every_law() {
        for f in Chance::new(1).deformations() {
            let (energy, stress) = law.deviatoric_stress(&f);
            let expected = Mat3::from_iterator(
                (0..9).map(|ij| derivative(&f, ij, width(&f), |f| law.deviatoric_energy(f))),
            );
            let error = (stress - expected).norm();
            let scale = stress.norm() + energy + 1e-3 * law.shear_modulus();
            assert!(error <= 1e-7 * scale, "{law:?} at {f}: {:e}", error / scale);
            assert_eq!(energy.to_bits(), law.deviatoric_energy(&f).to_bits());
        }
    }
}

#[test]
fn tangent_is_the_derivative_of_stress_and_symmetric() {
    for law in every_law() {
        for f in Chance::new(2).deformations() {
            let response = law.deviatoric_response(&f);
            let mut expected = Mat9::zeros();
            for kl in 0..9 {
                let column = derivative(&f, kl, width(&f), |f| law.deviatoric_stress(f).1);
                expected.column_mut(kl).copy_from_slice(column.as_slice());
            }
            let scale = response.tangent.norm();
            let error = (response.tangent - expected).norm();
            assert!(error <= 1e-8 * scale, "{law:?} at {f}: {:e}", error / scale);
            let skew = (response.tangent - response.tangent.transpose()).norm();
            assert!(skew <= 1e-14 * scale, "{law:?}: {:e}", skew / scale);

            let (energy, stress) = law.deviatoric_stress(&f);
            assert_eq!(response.energy.to_bits(), energy.to_bits());
            assert!((response.stress - stress).norm() <= 1e-14 * stress.norm());
        }
    }
}

#[test]
fn volumetric_slopes_are_derivatives() {
    for law in every_law() {
        for v in [0.3, 0.9, 1.0, 1.001, 1.2, 2.5] {
            let [_, slope, curvature] = law.volumetric(v);
            let central = |k: usize, h: f64| {
                (law.volumetric(v + h)[k] - law.volumetric(v - h)[k]) / (2.0 * h)
            };
            let expected =
                [0, 1].map(|k| (4.0 * central(k, 5e-4 * v) - central(k, 1e-3 * v)) / 3.0);
            let bulk = law.bulk_modulus();
            assert!(
                (slope - expected[0]).abs() < 1e-9 * bulk / v.min(1.0),
                "{law:?} at {v}"
            );
            assert!(
                (curvature - expected[1]).abs() < 1e-9 * bulk / (v * v).min(1.0),
                "{law:?} at {v}"
            );
        }
    }
}

#[test]
fn volume_gradients_are_derivatives() {
    for measure in [
        VolumeMeasure::Jacobian,
        VolumeMeasure::GreenTrace,
        VolumeMeasure::SmallTrace,
    ] {
        assert_eq!(
            measure.value(&Mat3::identity()).to_bits(),
            1.0_f64.to_bits()
        );
        for f in Chance::new(3).deformations() {
            let expected = Mat3::from_iterator(
                (0..9).map(|ij| derivative(&f, ij, 1e-3, |f| measure.value(f))),
            );
            assert!((measure.gradient(&f) - expected).norm() < 1e-11 * expected.norm());
        }
    }
}

#[test]
fn whole_stress_is_the_derivative_of_the_whole_energy() {
    for law in every_law() {
        for f in Chance::new(4).deformations() {
            let expected = Mat3::from_iterator(
                (0..9).map(|ij| derivative(&f, ij, width(&f), |f| law.energy(f))),
            );
            let stress = law.stress(&f);
            let scale = stress.norm() + law.energy(&f) + 1e-3 * law.bulk_modulus();
            assert!((stress - expected).norm() <= 1e-7 * scale, "{law:?} at {f}");
            let cauchy = law.cauchy_stress(&f);
            assert!(
                (cauchy - cauchy.transpose()).norm()
                    <= 1e-13 * (cauchy.norm() + law.bulk_modulus())
            );
        }
    }
}

#[test]
fn turning_the_body_turns_the_stress_and_keeps_the_energy() {
    let mut chance = Chance::new(5);
    for law in finite_laws() {
        for f in chance.deformations() {
            let q = chance.rotation();
            let (energy, stress) = law.deviatoric_stress(&f);
            let (turned_energy, turned_stress) = law.deviatoric_stress(&(q * f));
            let scale = energy + 1e-3 * law.shear_modulus();
            assert!(
                (turned_energy - energy).abs() <= 1e-12 * scale,
                "{law:?} at {f}"
            );
            let error = (turned_stress - q * stress).norm();
            assert!(
                error <= 1e-12 * (stress.norm() + law.shear_modulus()),
                "{law:?} at {f}: {error}"
            );
            let total = (law.energy(&(q * f)) - law.energy(&f)).abs();
            assert!(total <= 1e-12 * (law.energy(&f) + law.bulk_modulus()));
        }
    }
}

#[test]
fn turning_the_material_changes_nothing() {
    let mut chance = Chance::new(6);
    for law in every_law() {
        for f in chance.deformations() {
            let q = chance.rotation();
            // The small strain does not see F Q as the same material, only the turn of both sides.
            let (turned, expected) = match law.kinematics() {
                Kinematics::Finite => (f * q, law.deviatoric_stress(&f).1 * q),
                Kinematics::Small => (
                    q.transpose() * f * q,
                    q.transpose() * law.deviatoric_stress(&f).1 * q,
                ),
            };
            let (energy, stress) = law.deviatoric_stress(&turned);
            let scale = law.deviatoric_energy(&f) + 1e-3 * law.shear_modulus();
            assert!(
                (energy - law.deviatoric_energy(&f)).abs() <= 1e-12 * scale,
                "{law:?} at {f}"
            );
            assert!(
                (stress - expected).norm() <= 1e-12 * (expected.norm() + law.shear_modulus()),
                "{law:?}"
            );
        }
    }
}

#[test]
fn deviatoric_energy_of_jacobian_laws_knows_no_volume() {
    for law in every_law()
        .into_iter()
        .filter(|law| law.volume_measure() == VolumeMeasure::Jacobian)
    {
        for f in Chance::new(7).deformations() {
            for factor in [0.6, 0.999, 1.3, 2.0] {
                let energy = law.deviatoric_energy(&f);
                let swollen = law.deviatoric_energy(&(factor * f));
                assert!(
                    (energy - swollen).abs() <= 1e-12 * (energy + 1e-3 * law.shear_modulus()),
                    "{law:?} at {f}"
                );
            }
            // So its stress does no work on a change of volume.
            let (_, stress) = law.deviatoric_stress(&f);
            assert!(
                stress.dot(&f).abs() <= 1e-12 * (stress.norm() + law.shear_modulus()) * f.norm()
            );
        }
    }
}

#[test]
fn all_is_zero_at_rest() {
    for law in every_law() {
        let response = law.deviatoric_response(&Mat3::identity());
        assert_eq!(response.energy, 0.0, "{law:?}");
        assert!(
            response.stress.norm() <= 1e-15 * law.shear_modulus(),
            "{law:?}"
        );
        assert_eq!(law.volumetric(1.0)[..2], [0.0, 0.0]);
        assert_eq!(law.energy(&Mat3::identity()), 0.0);
    }
}

/// Also where subtracting 3 from an invariant would leave no digit: `ε² = 1e-16`.
#[test]
fn small_strain_is_that_of_the_linear_law() {
    use palpa_fem::law::Linear;
    let mut chance = Chance::new(8);
    for law in every_law() {
        let linear = Law::from(Linear::new(law.shear_modulus(), law.bulk_modulus()).unwrap());
        for strain in [1e-4, 1e-6, 1e-8] {
            // Exponents magnify strain: the first difference from linear is of relative size b ε or
            // α ε.
            let tolerance = 60.0 * strain + 1e-15 / strain;
            for _ in 0..5 {
                let h = strain * chance.matrix();
                let f = Mat3::identity() + 0.5 * (h + h.transpose());
                let (found, expected) =
                    (law.deviatoric_response(&f), linear.deviatoric_response(&f));
                assert_close(found.energy, expected.energy, tolerance);
                assert!(
                    (found.stress - expected.stress).norm() <= tolerance * expected.stress.norm(),
                    "{law:?}"
                );
                assert!(
                    (found.tangent - expected.tangent).norm()
                        <= tolerance * expected.tangent.norm(),
                    "{law:?}"
                );
                let total = (law.stress(&f) - linear.stress(&f)).norm();
                // Where the volume hardly changes, its rounding is still a share of the bulk
                // modulus.
                let rounding = 1e-15 * law.bulk_modulus();
                assert!(
                    total <= tolerance * linear.stress(&f).norm() + rounding,
                    "{law:?}: {total}"
                );
            }
        }
        assert_close(law.young(), linear.young(), 1e-15);
        let young = law.young();
        assert_close(
            young,
            2.0 * law.shear_modulus() * (1.0 + law.poisson()),
            1e-12,
        );
        assert_close(
            young,
            3.0 * law.bulk_modulus() * (1.0 - 2.0 * law.poisson()),
            1e-10,
        );
    }
}

#[test]
fn without_volume_there_is_no_energy() {
    let flat = Mat3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0);
    let inside_out = Mat3::new(1.1, 0.2, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -0.5);
    for law in finite_laws() {
        for f in [flat, inside_out, -Mat3::identity(), Mat3::zeros()] {
            let response = law.deviatoric_response(&f);
            assert_eq!(response.energy, f64::INFINITY, "{law:?}");
            assert_eq!(response.stress, Mat3::zeros());
            assert_eq!(response.tangent, Mat9::zeros());
            assert_eq!(law.deviatoric_energy(&f), f64::INFINITY);
            assert_eq!(law.deviatoric_stress(&f), (f64::INFINITY, Mat3::zeros()));
            assert_eq!(law.energy(&f), f64::INFINITY);
            assert_eq!(law.stress(&f), Mat3::zeros());
        }
    }
}

fn any_matrix() -> impl Strategy<Value = Mat3> {
    let entry = prop_oneof![
        3 => -3.0..3.0,
        1 => any::<f64>(),
        1 => prop::sample::select(vec![0.0, 1.0, -1.0, 1e-160, 1e-100, 1e-12, 1e12, 1e150, f64::NAN, f64::INFINITY]),
    ];
    let entries =
        prop::array::uniform9(entry.boxed()).prop_map(|entries| Mat3::from_row_slice(&entries));
    let stretched =
        (prop::array::uniform3(-120.0..120.0), any::<u64>()).prop_map(|(powers, seed)| {
            let mut chance = Chance::new(seed);
            let stretches = nalgebra::Vector3::from(powers.map(|power: f64| 10.0_f64.powf(power)));
            chance.rotation() * Mat3::from_diagonal(&stretches) * chance.rotation()
        });
    prop_oneof![entries, stretched]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(2000)))]

    #[test]
    fn no_deformation_gives_a_nan(f in any_matrix()) {
        for law in every_law() {
            let response = law.deviatoric_response(&f);
            prop_assert!(response.energy >= 0.0, "{law:?}: {}", response.energy);
            prop_assert!(response.stress.iter().all(|p| p.is_finite()), "{law:?}: {}", response.stress);
            prop_assert!(response.tangent.iter().all(|a| a.is_finite()), "{law:?}");
            prop_assert!(law.energy(&f) >= 0.0);
            prop_assert!(!law.stress(&f).iter().any(|p| p.is_nan()), "{law:?}");
            prop_assert!(!law.cauchy_stress(&f).iter().any(|p| p.is_nan()), "{law:?}");
        }
    }
}
