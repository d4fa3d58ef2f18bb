//! Logarithm and exponential in lanes, to a few units of the last place.

#![expect(
    clippy::inline_always,
    reason = "compiled in its caller with the machine's instructions"
)]

use std::f64::consts::LOG2_E;

use super::lanes::Lanes;

/// `ln 2` minus [`LN_2_REST`]. It has so few bits that its product with a whole number is exact,
/// even in single precision.
const LN_2_SHORT: f64 = 0.693359375;
const LN_2_REST: f64 = -2.121_944_400_546_905_8e-4;
/// Largest exponent of `e`; beyond it, the result is not a normal number in single precision.
const LARGEST_EXPONENT: f64 = 87.0;

/// `ln x` of positive normal numbers.
///
/// ```text
/// x = m 2^k,  √½ ≤ m < √2,   ln x = k ln 2 + 2 artanh s,   s = (m − 1)/(m + 1)
/// ```
#[inline(always)]
pub(super) fn ln<R: Lanes>(token: R::Token, x: R) -> R {
    let c = |x: f64| R::splat(token, x);
    let [m, k] = x.split();
    let s = (m - c(1.0)).divided_by(m + c(1.0));
    let square = s * s;
    // |s| < 0.172: the rest is below 1e-17 of the sum.
    let mut sum = c(1.0 / 21.0);
    for n in (1..10).rev() {
        sum = sum.mul_add(square, c(1.0 / f64::from(2 * n + 1)));
    }
    let twice = s + s;
    let small = k.mul_add(c(LN_2_REST), (twice * square).mul_add(sum, twice));
    k.mul_add(c(LN_2_SHORT), small)
}

/// `e^x`. Exponents beyond ±87 are clamped.
#[inline(always)]
pub(super) fn exp<R: Lanes>(token: R::Token, x: R) -> R {
    let c = |x: f64| R::splat(token, x);
    let x = x.min(c(LARGEST_EXPONENT)).max(c(-LARGEST_EXPONENT));
    // Adding it rounds to whole numbers.
    let whole = c(1.5 / R::EPSILON);
    let k = x.mul_add(c(LOG2_E), whole) - whole;
    let r = k.mul_add(c(-LN_2_REST), k.mul_add(c(-LN_2_SHORT), x));
    // |r| < 0.35: the rest is below 1e-17.
    let mut sum = c(1.0);
    for n in (1..14).rev() {
        sum = (sum * r).mul_add(c(1.0 / f64::from(n)), c(1.0));
    }
    sum * k.power_of_two()
}

/// `sinh z / z` where `|z| < ½`.
#[inline(always)]
pub(super) fn sinh_ratio<R: Lanes>(token: R::Token, z: R) -> R {
    let c = |x: f64| R::splat(token, x);
    let square = z * z;
    let mut sum = c(1.0);
    for n in (1..8).rev() {
        sum = (sum * square).mul_add(c(1.0 / f64::from(2 * n * (2 * n + 1))), c(1.0));
    }
    sum
}

#[cfg(test)]
mod tests {
    use palpa_sparse::fronts::Number;
    use pulp::{Arch, Simd, WithSimd};

    use super::super::lanes::{Doubles, Singles};
    use super::*;

    /// Compares with the functions of the standard library, in units of rounding.
    struct Compare;

    impl WithSimd for Compare {
        type Output = [f64; 2];

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> [f64; 2] {
            [worst::<Doubles<S>>(simd), worst::<Singles<S>>(simd)]
        }
    }

    fn worst<R: Lanes>(token: R::Token) -> f64 {
        let mut out = [R::Element::default(); 16];
        let mut worst = 0.0_f64;
        let mut compare = |found: R, expected: f64, size: f64| {
            found.store(&mut out);
            let error = (out[R::N - 1].wide() - expected).abs();
            worst = worst.max(error / (R::EPSILON * size));
        };
        for i in -20_000_i32..20_000 {
            // What the number is in this precision counts.
            let of = |x: f64| R::Element::nearest(x).wide();
            let x = of(4e-3 * f64::from(i));
            compare(exp(token, R::splat(token, x)), x.exp(), x.exp());
            let near = of(1.0 + 1e-9 * f64::from(i).powi(3) / 1e4);
            for y in [of(x.exp()), near.abs().max(0.1)] {
                let y = of(y);
                let size = y.ln().abs().max(R::EPSILON);
                compare(ln(token, R::splat(token, y)), y.ln(), size);
            }
            let z = of(2.4e-5 * f64::from(i));
            let ratio = if z == 0.0 { 1.0 } else { z.sinh() / z };
            compare(sinh_ratio(token, R::splat(token, z)), ratio, 1.0);
        }
        worst
    }

    #[test]
    fn they_are_right_to_rounding_in_both_precisions() {
        for (precision, error) in ["double", "single"]
            .iter()
            .zip(Arch::new().dispatch(Compare))
        {
            assert!(error < 4.0, "{precision}: {error} units");
        }
    }
}
