//! Several numbers at once, whatever the machine's vectors are: the kernel is written on [`Lanes`] and compiled for each
//! instruction set; which one runs is decided when the program starts.

use std::ops::{Add, Mul, Neg, Sub};

use palpa_sparse::fronts::Number;
use pulp::Simd;

/// A vector of numbers of the kernel's precision.
pub(super) trait Lanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self>
{
    /// One of the numbers.
    type Element: Number;
    /// What proves that the machine has the instructions.
    type Token: Copy;
    /// How many there are.
    const N: usize;

    fn splat(token: Self::Token, x: f64) -> Self;
    /// The first [`Self::N`] of a slice.
    fn load(token: Self::Token, from: &[Self::Element]) -> Self;
    fn store(self, into: &mut [Self::Element]);
    /// `self · b + c`.
    fn mul_add(self, b: Self, c: Self) -> Self;
    fn divided_by(self, other: Self) -> Self;
    fn min(self, other: Self) -> Self;
    fn max(self, other: Self) -> Self;
}

macro_rules! lanes {
    ($name:ident, $element:ty, $vector:ident, $as_simd:ident, $as_mut_simd:ident,
     $splat:ident, $add:ident, $sub:ident, $mul:ident, $div:ident, $neg:ident, $min:ident, $max:ident, $mul_add:ident) => {
        /// The machine's vector of this precision.
        #[derive(Clone, Copy)]
        pub(super) struct $name<S: Simd> {
            simd: S,
            v: S::$vector,
        }

        impl<S: Simd> $name<S> {
            #[inline(always)]
            fn with(self, v: S::$vector) -> Self {
                Self { simd: self.simd, v }
            }
        }

        impl<S: Simd> Add for $name<S> {
            type Output = Self;
            #[inline(always)]
            fn add(self, other: Self) -> Self {
                self.with(self.simd.$add(self.v, other.v))
            }
        }

        impl<S: Simd> Sub for $name<S> {
            type Output = Self;
            #[inline(always)]
            fn sub(self, other: Self) -> Self {
                self.with(self.simd.$sub(self.v, other.v))
            }
        }

        impl<S: Simd> Mul for $name<S> {
            type Output = Self;
            #[inline(always)]
            fn mul(self, other: Self) -> Self {
                self.with(self.simd.$mul(self.v, other.v))
            }
        }

        impl<S: Simd> Neg for $name<S> {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                self.with(self.simd.$neg(self.v))
            }
        }

        impl<S: Simd> Lanes for $name<S> {
            type Element = $element;
            type Token = S;
            const N: usize = size_of::<S::$vector>() / size_of::<$element>();

            #[inline(always)]
            fn splat(simd: S, x: f64) -> Self {
                Self {
                    simd,
                    v: simd.$splat(x as $element),
                }
            }

            #[inline(always)]
            fn load(simd: S, from: &[$element]) -> Self {
                Self {
                    simd,
                    v: S::$as_simd(&from[..Self::N]).0[0],
                }
            }

            #[inline(always)]
            fn store(self, into: &mut [$element]) {
                S::$as_mut_simd(&mut into[..Self::N]).0[0] = self.v;
            }

            #[inline(always)]
            fn mul_add(self, b: Self, c: Self) -> Self {
                self.with(self.simd.$mul_add(self.v, b.v, c.v))
            }

            #[inline(always)]
            fn divided_by(self, other: Self) -> Self {
                self.with(self.simd.$div(self.v, other.v))
            }

            #[inline(always)]
            fn min(self, other: Self) -> Self {
                self.with(self.simd.$min(self.v, other.v))
            }

            #[inline(always)]
            fn max(self, other: Self) -> Self {
                self.with(self.simd.$max(self.v, other.v))
            }
        }
    };
}

lanes!(
    Doubles,
    f64,
    f64s,
    as_simd_f64s,
    as_mut_simd_f64s,
    splat_f64s,
    add_f64s,
    sub_f64s,
    mul_f64s,
    div_f64s,
    neg_f64s,
    min_f64s,
    max_f64s,
    mul_add_e_f64s
);
lanes!(
    Singles,
    f32,
    f32s,
    as_simd_f32s,
    as_mut_simd_f32s,
    splat_f32s,
    add_f32s,
    sub_f32s,
    mul_f32s,
    div_f32s,
    neg_f32s,
    min_f32s,
    max_f32s,
    mul_add_e_f32s
);
