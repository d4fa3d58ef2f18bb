//! The laboratory: accuracy and speed of the models, and export of their problems to other solvers.

pub mod bench;
pub mod coverage;
pub mod export;
pub mod reproduce;
pub mod trace;
pub mod verify;
pub mod z_width;
