//! What a moving step costs, and what it is worth: rates of the shipped step with the errors that it has at them.
//!
//! A tool presses to 5 mm, strokes 20 mm sideways and lifts, at the row's own rate, with contact that changes, zones that
//! are left and the background's work, which comes as late as it takes. Errors are those of the forces on the way.

pub mod cases;
pub mod growth;
pub mod picture;
pub mod ratios;
pub mod refined;
pub mod ride;
pub mod row;

pub use cases::{BenchCase, cases};
pub use row::{BenchReport, BenchRow, Mode};
