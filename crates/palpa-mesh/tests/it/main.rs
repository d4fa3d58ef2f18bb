//! Integration tests of palpa-mesh, one module per concern.

mod check;
mod read;
mod repair;
mod shapes;
mod write;
