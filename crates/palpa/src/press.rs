//! A scripted indentation: the tool goes down, rests and comes back, and the force is kept.
//!
//! [`mod@reference`] does it with the network of bars of 2009, [`tissue`] with the continuum; where and when is common to both.

pub mod lump;
pub mod mesh;
mod place;
mod programme;
pub mod reference;
pub mod tissue;

pub use place::{Place, column_length};
pub use programme::{Phase, Waypoint, n_steps, waypoints};
pub(crate) use reference::nodes_under_disc;

/// Without the digits that binary fractions leave behind.
fn tidy(x: f64) -> f64 {
    (x * 1e9).round() / 1e9
}
