//! How many cases a property is tested with.

/// The variable that [`cases`] reads: a whole number.
const FACTOR: &str = "PALPA_HUNT_FACTOR";

/// Number of cases of a property test that says itself how many: `n`, times the environment's
/// `PALPA_HUNT_FACTOR`, which `make hunt` sets. (`PROPTEST_CASES` is no factor: it would set the
/// number of every property, quick or slow.)
///
/// # Panics
/// If the variable is no whole number above 0, or the product is too large.
pub fn cases(n: u32) -> u32 {
    let factor = match std::env::var(FACTOR) {
        Err(_) => 1,
        Ok(text) => match text.parse() {
            Ok(factor @ 1_u32..) => factor,
            _ => panic!("{FACTOR} is {text:?}; give a whole number above 0"),
        },
    };
    n.checked_mul(factor).expect("fewer cases than 2^32")
}
