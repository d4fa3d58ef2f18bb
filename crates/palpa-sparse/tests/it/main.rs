//! Factors against dense linear algebra.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod fronts;
