//! Vectors of numbers, independent of the machine's vector size. The kernel is written with
//! [`Lanes`] and compiled for each instruction set; the program chooses one when it starts.

use std::ops::{Add, Mul, Neg, Sub};

use palpa_sparse::fronts::Number;
use pulp::Simd;

/// Number of lanes of the widest vector.
const WIDTH: usize = 16;

/// A vector of numbers of the kernel's precision.
pub(super) trait Lanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self>
{
    /// Type of one number.
    type Element: Number;
    /// A proof that the machine has the instructions.
    type Token: Copy;
    /// Number of lanes.
    const N: usize;
    /// Distance of 1 to the next number.
    const EPSILON: f64;

    fn splat(token: Self::Token, x: f64) -> Self;
    /// The first [`Self::N`] of a slice.
    fn load(token: Self::Token, from: &[Self::Element]) -> Self;
    fn store(self, into: &mut [Self::Element]);
    /// `self · b + c`.
    fn mul_add(self, b: Self, c: Self) -> Self;
    fn divided_by(self, other: Self) -> Self;
    fn min(self, other: Self) -> Self;
    fn max(self, other: Self) -> Self;
    fn sqrt(self) -> Self;
    /// `then` where `self < other`, `otherwise` elsewhere.
    fn select_less(self, other: Self, then: Self, otherwise: Self) -> Self;
    /// `m` from √½ to √2 and the whole number `k` with `self = m 2^k`, for positive normal numbers.
    fn split(self) -> [Self; 2];
    /// `2^self`, for whole numbers in the range of normal exponents.
    fn power_of_two(self) -> Self;
}

macro_rules! lanes {
    ($name:ident, $element:ty, $vector:ident, $as_simd:ident, $as_mut_simd:ident,
     $splat:ident, $add:ident, $sub:ident, $mul:ident, $div:ident, $neg:ident, $min:ident, $max:ident, $mul_add:ident,
     $sqrt:ident, $less_than:ident, $select:ident, $signed:ident, $mantissa:expr, $bias:expr) => {
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
            const EPSILON: f64 = <$element>::EPSILON as f64;

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

            #[inline(always)]
            fn sqrt(self) -> Self {
                self.with(self.simd.$sqrt(self.v))
            }

            #[inline(always)]
            fn select_less(self, other: Self, then: Self, otherwise: Self) -> Self {
                let mask = self.simd.$less_than(self.v, other.v);
                self.with(self.simd.$select(mask, then.v, otherwise.v))
            }

            #[inline(always)]
            fn split(self) -> [Self; 2] {
                let least = <$element>::to_bits(std::f64::consts::FRAC_1_SQRT_2 as $element);
                let (mut m, mut k) = ([0.0; WIDTH], [0.0; WIDTH]);
                self.store(&mut m);
                for (m, k) in m.iter_mut().zip(&mut k).take(Self::N) {
                    let bits = m.to_bits();
                    let exponent = bits.wrapping_sub(least).cast_signed() >> $mantissa;
                    *k = f32::from(exponent as i16).into();
                    *m = <$element>::from_bits(bits.wrapping_sub((exponent << $mantissa) as _));
                }
                [Self::load(self.simd, &m), Self::load(self.simd, &k)]
            }

            #[inline(always)]
            fn power_of_two(self) -> Self {
                let mut k = [0.0; WIDTH];
                self.store(&mut k);
                for k in k.iter_mut().take(Self::N) {
                    let exponent = <$signed>::from(*k as i32 + $bias);
                    *k = <$element>::from_bits((exponent << $mantissa) as _);
                }
                Self::load(self.simd, &k)
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
    mul_add_e_f64s,
    sqrt_f64s,
    less_than_f64s,
    select_f64s,
    i64,
    52,
    1023
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
    mul_add_e_f32s,
    sqrt_f32s,
    less_than_f32s,
    select_f32s,
    i32,
    23,
    127
);
