//! Integration tests of palpa-mesh, one module per concern.

#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod check;
mod coarsen;
mod generate;
mod growth;
mod imprint;
mod read;
mod refine;
mod repair;
mod shapes;
mod slide;
mod sound;
mod thickness;
mod write;
