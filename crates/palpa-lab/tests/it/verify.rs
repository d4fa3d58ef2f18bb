//! The cases by formula pass, and the tolerances are no looser than promised.

use palpa_lab::verify::{Case, Options, VerifyError, cases, tolerance};

/// Cases that take long without optimisation; `make test-slow` runs all.
const SLOW: [&str; 5] = ["cone", "contact", "mindlin", "spence", "small lump"];

#[test]
fn cases_by_formula_pass() {
    for slow in SLOW {
        assert!(cases().iter().any(|case| case.name == slow), "{slow}");
    }
    let is_quick = |case: &&Case| !case.needs_reference && !SLOW.contains(&case.name);
    let mut n_cases = 0;
    for case in cases().iter().filter(is_quick) {
        n_cases += 1;
        let findings = case.run(&Options::default()).unwrap();
        assert!(!findings.rows.is_empty(), "{}", case.name);
        for row in &findings.rows {
            assert!(row.pass, "{row:#?}");
            assert!(row.case == case.name && row.nodes > 0, "{row:#?}");
            assert!(
                row.reference.is_finite() && row.computed.is_finite(),
                "{row:#?}"
            );
        }
    }
    assert_eq!(n_cases, 5);
}

/// On each curve the error on the finest mesh is the smallest, and much smaller than on the
/// coarsest.
#[test]
fn errors_fall_as_the_mesh_becomes_finer() {
    let case = cases().iter().find(|case| case.name == "lame").unwrap();
    let study = case.run(&Options::default()).unwrap().study;
    let mut n_curves = 0;
    for first in study.iter().filter(|p| p.h > 0.2) {
        let errors: Vec<f64> = (study.iter())
            .filter(|p| p.series == first.series)
            .map(|p| p.error.abs())
            .collect();
        assert_eq!(errors.len(), 4, "{}", first.series);
        assert!(
            errors.windows(2).all(|e| e[1] < 0.6 * e[0]),
            "{}: {errors:?}",
            first.series
        );
        n_curves += 1;
    }
    assert_eq!(n_curves, 4);
}

#[test]
fn without_its_tables_a_case_says_what_it_needs() {
    let mut n_cases = 0;
    for case in cases().iter().filter(|case| case.needs_reference) {
        n_cases += 1;
        let error = case.run(&Options::default()).unwrap_err();
        assert!(matches!(error, VerifyError::NoReference), "{error}");
        let empty = Options {
            reference: Some("no such folder".into()),
        };
        let error = case.run(&empty).unwrap_err().to_string();
        let error = error.replace('\\', "/");
        assert!(error.contains("no such folder/"), "{}: {error}", case.name);
    }
    assert_eq!(n_cases, 11);
}

#[test]
fn tolerances_are_those_that_were_promised() {
    use tolerance::*;
    // Whoever loosens one changes what is claimed of the model, not a setting.
    for (name, found, promised) in [
        ("patch test and rigid motions", PATCH, 1e-9),
        ("columns", COLUMN, 1e-6),
        ("bonded cylinder to 6 mm", BONDED, 0.02),
        ("bonded cylinder to 12 mm", BONDED_DEEP, 0.04),
        ("relaxation", PRONY, 0.005),
        ("Lamé and Cook", NEARLY_INCOMPRESSIBLE, 0.015),
        ("A1, A2, A3", SMALL_STRAIN, 0.02),
        ("A4", LUMP, 0.10),
        ("A4, from", LUMP_LEAST, 0.02),
        ("B1, B2, B4", BLOCK, 0.03),
        ("economy", ECONOMY, 0.02),
        ("economy, irregular", ECONOMY_IRREGULAR, 0.025),
        ("economy, fine", ECONOMY_FINE, 0.01),
        ("B3c", BLOCK_LUMP, 0.15),
        ("profiles", PROFILE, 0.05),
        ("a lump in one prism", SMALL_LUMP, 0.15),
        ("law of contact", MISMATCH, 2e-4),
        ("penetration, edges", PENETRATION, 0.15),
        ("load steps with friction", FRICTION_STEPS, 0.01),
        ("partial slip", PARTIAL_SLIP, 0.03),
        ("friction against no friction", FRICTION_STIFFENS, 0.002),
        ("adhesion against no friction", ADHESION, 0.03),
        ("disc that sticks, contact radii", STICKING, 0.1),
        ("load steps", LOAD_STEPS, 0.001),
    ] {
        assert!(found <= promised, "{name}: {found} instead of {promised}");
    }
}
