//! Tests of the scene file as a program sees it.

#![expect(
    clippy::float_cmp,
    clippy::format_push_string,
    clippy::unwrap_used,
    reason = "units are exact bit for bit where said; a test may panic, and need not be fast"
)]

mod catalogue;
mod continuum;
mod errors;
mod robust;
mod scenes;
mod schema;
mod thickness;
mod units;
