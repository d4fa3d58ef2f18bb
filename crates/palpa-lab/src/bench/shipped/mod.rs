//! Rate and error of the loop that ships: scenes through the same door as `palpa loop-report` and
//! the viewer, with the default mesh.
//!
//! ```text
//! scene ─► a place drawn at random ─► LiveScene ─► press, stroke, lift ─► forces at 1 kHz ─► audit
//! places.rs                                        drive.rs                                  measure.rs
//! ```
//! Nothing is tuned to a place: it is drawn on the skin, with the direction of the stroke and its
//! speed, from a fixed seed.

mod cases;
mod drive;
mod measure;
mod places;
mod row;

pub use cases::{ShippedCase, Variant, shipped_cases};
pub use drive::{Driven, Felt, Part, StepTime, drive};
pub use measure::{MeasureParams, Measured, measure};
pub use places::{Spot, draw_spots};
pub use row::{PoseRow, ShippedRow};
