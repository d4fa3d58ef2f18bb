//! Bodies made by formula.

pub mod forearm;
pub mod graded;
pub mod levels;
pub mod limb;
pub mod mapped;
pub mod patch;
mod random;
pub mod tube;

pub use forearm::forearm;
pub use graded::{GradedBlock, Outline, graded_block};
pub use levels::{GradedLayer, LevelStack};
pub use limb::{block_skin, cylinder};
pub use mapped::{Diagonal, Grid, mapped_grid};
