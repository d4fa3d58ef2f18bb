//! Pictures and files of results: charts, cross-sections of bodies, VTU for ParaView, and output
//! folders. Every output file is either complete or absent.

mod axis;
mod canvas;
mod chart;
pub mod output;
mod picture;
pub mod section;
pub mod vtu;

pub use axis::Axis;
pub use canvas::Color;
pub use chart::{Band, Chart, Guide, Series, panels};
pub use picture::{PALETTE, Picture};
