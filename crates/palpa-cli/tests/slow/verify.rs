//! Every case of `palpa verify` that needs no reference tables, with the slow ones among them.

use palpa_lab::verify::{Options, cases, tolerance};

/// The tolerances that a case may use; none for a case whose rows state their own.
fn promised(case: &str) -> &'static [f64] {
    use tolerance::*;
    match case {
        "patch" => &[PATCH],
        "columns" => &[COLUMN],
        "prony" => &[PRONY],
        "lame" | "cook" => &[NEARLY_INCOMPRESSIBLE],
        "small lump" => &[SMALL_LUMP],
        "mindlin" => &[SMALL_STRAIN, PARTIAL_SLIP, STICKING],
        "spence" => &[SMALL_STRAIN, FRICTION_STIFFENS, ADHESION, STICKING],
        _ => &[],
    }
}

#[test]
fn every_case_by_formula_is_within_its_tolerance() {
    let mut n_cases = 0;
    for case in cases().iter().filter(|case| !case.needs_reference) {
        let found = case.run(&Options::default()).unwrap();
        println!("{}: {} figures", case.name, found.rows.len());
        assert!(!found.rows.is_empty(), "{}", case.name);
        let allowed = promised(case.name);
        for row in &found.rows {
            assert!(row.pass, "{row:#?}");
            assert!(
                allowed.is_empty() || allowed.contains(&row.tolerance),
                "{row:#?} is not among {allowed:?}"
            );
        }
        n_cases += 1;
    }
    assert_eq!(n_cases, 10);
}
