//! A block multifrontal Cholesky factor on columns. After a change, only the affected part is
//! computed again.
//!
//! ```text
//!            ring               fronts of the zone are factored when the tissue there has moved;
//!          /      \             those of the exterior seldom: their Schur complement on the ring is kept
//!    exterior    within the zone
//! ```
//! A [`Tree`] is built once for a zone. [`Exterior`] and [`Zone`] hold the numbers of the two
//! halves of a factor, in single or double precision. In a tree without a zone, all fronts are in
//! the zone's half. Nothing is allocated after construction.
//!
//! For n columns of a surface with `width` unknowns each, the fill grows as n log n · width², and
//! the work as 15 n^1.5 · width³.

mod compliance;
mod dissect;
mod factor;
mod solve;
mod tree;

pub use compliance::{Compliance, FarCompliance, Push};
pub use factor::{Exterior, FactorScratch, Zone, least_pivot};
pub use solve::{SolveScratch, back_substitute, back_substitute_to, fronts_above, substitute};
pub use tree::{Half, Tree};

use std::ops::{Add, AddAssign, Div, DivAssign, Mul, Neg, Sub, SubAssign};

use pulp::Simd;

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
    + DivAssign
    + PartialOrd
{
    /// The nearest number in this precision.
    fn nearest(x: f64) -> Self;
    /// The same number in double precision.
    fn wide(self) -> f64;
    /// `y −= Σ columns · factors`, with vector instructions. All slices have the same length.
    fn subtract_columns<S: Simd>(
        simd: S,
        columns: [&[Self]; 4],
        factors: [Self; 4],
        y: &mut [Self],
    );
    /// The dot products of four columns with a vector. All slices have the same length.
    fn dot_columns<S: Simd>(simd: S, columns: [&[Self]; 4], x: &[Self]) -> [Self; 4];
}

macro_rules! number {
    ($name:ty, $as_simd:ident, $as_mut_simd:ident, $load:ident, $store:ident, $splat:ident, $mul_add:ident,
     $sum:ident) => {
        impl Number for $name {
            fn nearest(x: f64) -> Self {
                x as Self
            }

            fn wide(self) -> f64 {
                f64::from(self)
            }

            #[inline(always)]
            fn subtract_columns<S: Simd>(
                simd: S,
                columns: [&[Self]; 4],
                factors: [Self; 4],
                y: &mut [Self],
            ) {
                let f = factors.map(|f| simd.$splat(-f));
                let parts = columns.map(|c| S::$as_simd(&c[..y.len()]));
                let (y, y_rest) = S::$as_mut_simd(y);
                let [a, b, c, d] = parts.map(|p| &p.0[..y.len()]);
                for i in 0..y.len() {
                    let one = simd.$mul_add(a[i], f[0], simd.$mul_add(b[i], f[1], y[i]));
                    y[i] = simd.$mul_add(c[i], f[2], simd.$mul_add(d[i], f[3], one));
                }
                if !y_rest.is_empty() {
                    let mut sum = simd.$load(y_rest);
                    for k in 0..4 {
                        sum = simd.$mul_add(simd.$load(parts[k].1), f[k], sum);
                    }
                    simd.$store(y_rest, sum);
                }
            }

            #[inline(always)]
            fn dot_columns<S: Simd>(simd: S, columns: [&[Self]; 4], x: &[Self]) -> [Self; 4] {
                let parts = columns.map(|c| S::$as_simd(&c[..x.len()]));
                let (x, x_rest) = S::$as_simd(x);
                let [a, b, c, d] = parts.map(|p| &p.0[..x.len()]);
                let zero = simd.$splat(0.0);
                let mut even = [zero; 4];
                for i in 0..x.len() {
                    even[0] = simd.$mul_add(a[i], x[i], even[0]);
                    even[1] = simd.$mul_add(b[i], x[i], even[1]);
                    even[2] = simd.$mul_add(c[i], x[i], even[2]);
                    even[3] = simd.$mul_add(d[i], x[i], even[3]);
                }
                if !x_rest.is_empty() {
                    let x = simd.$load(x_rest);
                    for k in 0..4 {
                        even[k] = simd.$mul_add(simd.$load(parts[k].1), x, even[k]);
                    }
                }
                even.map(|sum| simd.$sum(sum))
            }
        }
    };
}

number!(
    f64,
    as_simd_f64s,
    as_mut_simd_f64s,
    partial_load_f64s,
    partial_store_f64s,
    splat_f64s,
    mul_add_e_f64s,
    reduce_sum_f64s
);
number!(
    f32,
    as_simd_f32s,
    as_mut_simd_f32s,
    partial_load_f32s,
    partial_store_f32s,
    splat_f32s,
    mul_add_e_f32s,
    reduce_sum_f32s
);
