//! Parameters that make no material are refused, in words.

use palpa_fem::law::{
    Fung, Gent, LawError, Linear, Material, Moduli, MooneyRivlin, NeoHookean, Ogden, OgdenTerm,
    Prony, PronyTerm, StVenantKirchhoff, Volumetric, Yeoh,
};

const VOLUMETRIC: Volumetric = Volumetric::Quadratic { bulk: 1e5 };

#[track_caller]
fn assert_refused<T: std::fmt::Debug>(result: Result<T, LawError>, expected: &str) {
    assert_eq!(result.expect_err("must be refused").to_string(), expected);
}

#[test]
fn moduli_must_be_those_of_a_solid() {
    for young in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let message =
            format!("neo-Hookean: Young's modulus is {young} Pa, but must be positive and finite");
        assert_refused(NeoHookean::from_young(young, 0.45), &message);
        assert!(Linear::from_young(young, 0.3).is_err());
        assert!(StVenantKirchhoff::from_young(young, 0.3).is_err());
        assert!(Fung::from_young(young, 0.3, 1.0).is_err());
        assert!(Gent::from_young(young, 0.3, 1.0).is_err());
        assert!(Linear::new(young, 1e3).is_err());
        assert!(Linear::new(1e3, young).is_err());
        let volumetric = Volumetric::Logarithmic { bulk: young };
        let message =
            format!("neo-Hookean: the bulk modulus is {young} Pa, but must be positive and finite");
        assert_refused(NeoHookean::new(1e4, volumetric), &message);
    }
    assert_refused(
        Linear::from_young(1e4, 0.5),
        "linear: Poisson's ratio is 0.5, but must lie above -1 and below 0.5; take 0.45 to 0.499 for tissue that hardly \
         changes its volume",
    );
    for poisson in [-1.0, 0.6, f64::NAN] {
        assert!(matches!(
            NeoHookean::from_young(1e4, poisson),
            Err(LawError::Poisson { .. })
        ));
    }
}

#[test]
fn constants_must_keep_the_energy_growing() {
    assert_refused(
        MooneyRivlin::new(-1.0, 5.0, VOLUMETRIC),
        "Mooney-Rivlin: C10 is -1 Pa, but must be finite and not negative",
    );
    assert!(MooneyRivlin::new(0.0, 0.0, VOLUMETRIC).is_err());
    assert_refused(
        MooneyRivlin::from_young(1e4, 0.4, 1.5),
        "Mooney-Rivlin: the share of C01 is 1.5, but must lie between 0 and 1",
    );
    assert!(Yeoh::new([1.0, -0.5, 0.1], VOLUMETRIC).is_ok());
    assert_refused(
        Yeoh::new([1.0, -0.6, 0.1], VOLUMETRIC),
        "Yeoh: with C10 = 1 Pa, C20 = -0.6 Pa and C30 = 0.1 Pa the energy stops growing with strain, so that nothing \
         holds the tissue; C30 must not be negative, and a negative C20 must stay above -sqrt(3 C10 C30)",
    );
    assert!(Yeoh::new([1.0, 0.1, -0.1], VOLUMETRIC).is_err());
    assert!(Yeoh::new([1.0, f64::NAN, 1.0], VOLUMETRIC).is_err());
    assert_refused(
        Fung::new(1e4, 0.0, VOLUMETRIC),
        "Fung: the exponent b is 0, but must be positive and finite",
    );
    assert_refused(
        Gent::new(1e4, 0.0, VOLUMETRIC),
        "Gent: the limit Jm is 0, but must be positive and finite",
    );
}

#[test]
fn terms_must_be_few_and_sound() {
    let term = OgdenTerm {
        mu: 1.0,
        alpha: 2.0,
    };
    assert!(Ogden::new(&[term; 6], VOLUMETRIC).is_ok());
    assert_refused(
        Ogden::new(&[term; 7], VOLUMETRIC),
        "Ogden: 7 terms, but there must be 1 to 6",
    );
    assert_refused(
        Ogden::new(&[], VOLUMETRIC),
        "Ogden: 0 terms, but there must be 1 to 6",
    );
    assert_refused(
        Ogden::new(
            &[
                term,
                OgdenTerm {
                    mu: 1.0,
                    alpha: 0.0,
                },
            ],
            VOLUMETRIC,
        ),
        "Ogden: the exponent of term 2 is 0, but its size must be between 0.001 and 100",
    );
    assert!(
        Ogden::new(
            &[OgdenTerm {
                mu: -1.0,
                alpha: 2.0
            }],
            VOLUMETRIC
        )
        .is_err()
    );

    let series = |shares: &[f64], tau| {
        let terms = shares.iter().map(|&g| PronyTerm { g, tau }).collect();
        Prony::new(terms, Moduli::Instantaneous, false)
    };
    assert!(series(&[0.5, 0.4], 1.0).is_ok());
    assert_refused(
        series(&[0.5, 0.5], 1.0),
        "Prony series: its shares g add up to 1, but must stay below 1, so that some stiffness is left in the end",
    );
    assert_refused(
        series(&[0.5, -0.1], 1.0),
        "Prony series: a share g is -0.1, but must be positive and finite",
    );
    assert_refused(
        series(&[0.5], 0.0),
        "Prony series: a time tau is 0 s, but must be positive and finite",
    );
    assert!(series(&[0.5], f64::NAN).is_err());
    assert!(series(&[], 1.0).is_err());
    assert_refused(
        series(&[0.01; 17], 1.0),
        "Prony series: 17 terms, but there must be 1 to 16",
    );
}

#[test]
fn materials_have_weight() {
    let mut fat = Material::new("fat", NeoHookean::from_young(5e3, 0.49).unwrap());
    assert!(fat.check().is_ok());
    fat.density = 0.0;
    assert_refused(
        fat.check(),
        "material: the density is 0 kg/m³, but must be positive and finite",
    );
    fat.density = 920.0;
    fat.prestress = -1.0;
    assert_refused(
        fat.check(),
        "material: the prestress is -1 Pa, but must be finite and not negative",
    );
}
