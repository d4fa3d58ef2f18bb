//! The laboratory: how right and how fast the models are, and their problems in the words of other solvers.

pub mod bench;
pub mod export;
pub mod reproduce;
pub mod trace;
pub mod verify;
pub mod z_width;
