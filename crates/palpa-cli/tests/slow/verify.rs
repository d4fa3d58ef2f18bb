//! Every case of `palpa verify` that needs no reference tables, with the slow ones among them.

use palpa_lab::verify::{Options, cases};

#[test]
fn every_case_by_formula_is_within_its_tolerance() {
    let mut n_cases = 0;
    for case in cases().iter().filter(|case| !case.needs_reference) {
        let found = case.run(&Options::default()).unwrap();
        println!("{}: {} figures", case.name, found.rows.len());
        assert!(!found.rows.is_empty(), "{}", case.name);
        for row in &found.rows {
            assert!(row.pass, "{row:#?}");
        }
        n_cases += 1;
    }
    assert_eq!(n_cases, 8);
}
