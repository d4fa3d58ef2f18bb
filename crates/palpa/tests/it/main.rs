//! Integration tests of the library.

#![expect(clippy::unwrap_used, reason = "a test may panic")]
#![expect(clippy::float_cmp, reason = "what is exact is compared exactly")]

mod accuracy;
mod audit;
mod coarsen;
mod error_bar;
mod live;
mod machine;
mod notes;
mod panics;
mod place;
mod record;
