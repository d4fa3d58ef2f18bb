//! Bodies made by formula.

pub mod forearm;
pub mod limb;
pub mod patch;
pub mod tube;

pub use forearm::forearm;
pub use limb::{block_skin, cylinder};
