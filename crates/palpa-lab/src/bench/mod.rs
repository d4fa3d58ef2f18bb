//! Cost and accuracy of the moving step: its rates with default settings, and its errors at these
//! rates.
//!
//! A tool presses to 5 mm, strokes 20 mm sideways and lifts, at the rate of the row. Contact
//! changes on the way, the tool leaves zones, and results of the background's work arrive as late
//! as it takes. The errors are errors of the force along the path.

pub mod cases;
pub mod growth;
pub mod picture;
pub mod ratios;
pub mod refined;
pub mod ride;
pub mod row;
pub mod shipped;

pub use cases::{BenchCase, cases};
pub use row::{BenchReport, BenchRow, Mode};
