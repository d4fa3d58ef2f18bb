//! The cases of `palpa verify` that compare with reference tables; `make test-slow` has the others.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use palpa_lab::verify::{Case, Options, Row, cases, tolerance};

/// The tolerances that a case may use; none for a case whose rows state their own.
fn promised(case: &str) -> &'static [f64] {
    use tolerance::*;
    match case {
        "V patch" => &[PATCH],
        "A1" | "A2" | "A3" => &[SMALL_STRAIN],
        "A4" => &[LUMP],
        "B1" | "B2" | "B4" => &[BLOCK, PROFILE],
        "B3c" => &[BLOCK_LUMP],
        "B5" => &[BONDED, BONDED_DEEP],
        _ => &[],
    }
}

#[test]
fn every_figure_is_within_its_tolerance() {
    let options = Options {
        reference: Some(crate::reference()),
    };
    let next = AtomicUsize::new(0);
    let rows: Mutex<Vec<Row>> = Mutex::default();
    let n_threads = thread::available_parallelism().map_or(1, usize::from);
    let cases: Vec<&Case> = cases().iter().filter(|case| case.needs_reference).collect();
    thread::scope(|scope| {
        for _ in 0..n_threads.min(cases.len()) {
            scope.spawn(|| {
                while let Some(case) = cases.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let found = case.run(&options).unwrap();
                    println!("{}: {} figures", case.name, found.rows.len());
                    assert!(!found.rows.is_empty(), "{}", case.name);
                    rows.lock().unwrap().extend(found.rows);
                }
            });
        }
    });
    let rows = rows.into_inner().unwrap();
    for row in &rows {
        let allowed = promised(row.case);
        assert!(
            allowed.is_empty() || allowed.contains(&row.tolerance),
            "{row:#?} is not among {allowed:?}"
        );
    }
    let failed: Vec<&Row> = rows.iter().filter(|row| !row.pass).collect();
    assert!(
        failed.is_empty(),
        "{} of {} out of tolerance: {failed:#?}",
        failed.len(),
        rows.len()
    );
}
