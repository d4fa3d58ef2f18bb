//! A scripted indentation: the tool goes down, rests and comes back, and the force is recorded.
//!
//! [`mod@reference`] uses the network of bars of 2009, [`tissue`] the continuum. Both share the
//! place and the waypoints.

pub mod lump;
pub mod mesh;
mod place;
mod programme;
pub mod reference;
pub mod tissue;

pub use place::{Place, column_length};
pub use programme::{Phase, Waypoint, n_steps, waypoints};
pub(crate) use reference::nodes_under_disc;

/// Removes the digits that come from binary fractions.
fn tidy(x: f64) -> f64 {
    (x * 1e9).round() / 1e9
}
