//! A block multifrontal Cholesky factor on columns, of which only the part that changes is made anew.
//!
//! ```text
//!            ring               fronts of the zone are factored when the tissue there has moved;
//!          /      \             those of the exterior seldom: what they leave on the ring is kept
//!    exterior    within the zone
//! ```
//! [`Tree`] is made once for a zone; [`Exterior`] and [`Zone`] hold the numbers of the two halves of a factor, in single or
//! double precision. A tree without a zone has all fronts in the zone's half. Nothing is allocated after construction.
//!
//! Fill grows as n log n · width² for n columns of a surface and `width` unknowns each, work as 15 n^1.5 · width³.

mod compliance;
mod dissect;
mod factor;
mod solve;
mod tree;

pub use compliance::{Compliance, Unit};
pub use factor::{Exterior, FactorScratch, Zone};
pub use solve::{SolveScratch, back_substitute, substitute};
pub use tree::{Half, Tree};

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// Single or double precision.
pub trait Number:
    faer::traits::RealField
    + Copy
    + Default
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + PartialOrd
{
    /// The nearest number of this precision.
    fn nearest(x: f64) -> Self;
    /// The same number in double precision.
    fn wide(self) -> f64;
}

impl Number for f64 {
    fn nearest(x: f64) -> Self {
        x
    }

    fn wide(self) -> f64 {
        self
    }
}

impl Number for f32 {
    fn nearest(x: f64) -> Self {
        x as Self
    }

    fn wide(self) -> f64 {
        f64::from(self)
    }
}
