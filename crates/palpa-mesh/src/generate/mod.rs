//! Bodies made by formula.

pub mod patch;
