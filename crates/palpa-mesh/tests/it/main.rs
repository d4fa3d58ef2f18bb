//! Integration tests of palpa-mesh, one module per concern.

#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod check;
mod growth;
mod read;
mod repair;
mod shapes;
mod write;
