//! Small vectors and matrices in lanes.

#![expect(
    clippy::inline_always,
    reason = "compiled in its caller with the machine's instructions"
)]

use super::super::lanes::Lanes;
use super::super::principal::{PLACES, Six};

/// A vector in lanes.
pub(in super::super) type V3<R> = [R; 3];
/// A matrix in lanes, by rows.
pub(in super::super) type M3<R> = [[R; 3]; 3];

#[inline(always)]
pub(in super::super) fn dot<R: Lanes>(a: &V3<R>, b: &V3<R>) -> R {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}

#[inline(always)]
pub(super) fn cross<R: Lanes>(a: &V3<R>, b: &V3<R>) -> V3<R> {
    [
        a[1].mul_add(b[2], -(a[2] * b[1])),
        a[2].mul_add(b[0], -(a[0] * b[2])),
        a[0].mul_add(b[1], -(a[1] * b[0])),
    ]
}

/// Rows of the matrix times the vector.
#[inline(always)]
pub(in super::super) fn mul<R: Lanes>(m: &M3<R>, v: &V3<R>) -> V3<R> {
    [dot(&m[0], v), dot(&m[1], v), dot(&m[2], v)]
}

#[inline(always)]
pub(super) fn cofactor<R: Lanes>(f: &M3<R>) -> M3<R> {
    [
        cross(&f[1], &f[2]),
        cross(&f[2], &f[0]),
        cross(&f[0], &f[1]),
    ]
}

#[inline(always)]
pub(in super::super) fn scale<R: Lanes>(s: R, v: &V3<R>) -> V3<R> {
    [s * v[0], s * v[1], s * v[2]]
}

/// `s v + to`.
#[inline(always)]
pub(in super::super) fn axpy<R: Lanes>(s: R, v: &V3<R>, to: &V3<R>) -> V3<R> {
    [
        s.mul_add(v[0], to[0]),
        s.mul_add(v[1], to[1]),
        s.mul_add(v[2], to[2]),
    ]
}

/// `FᵀF`.
#[inline(always)]
pub(super) fn cauchy_green<R: Lanes>(f: &M3<R>) -> Six<R> {
    let mut six = [f[0][0]; 6];
    for (c, (i, k)) in six.iter_mut().zip(PLACES) {
        *c = f[0][i].mul_add(f[0][k], f[1][i].mul_add(f[1][k], f[2][i] * f[2][k]));
    }
    six
}

/// A symmetric matrix (`xx, yy, zz, xy, yz, zx`) times a vector.
#[inline(always)]
pub(super) fn six_times<R: Lanes>(six: &Six<R>, v: &V3<R>) -> V3<R> {
    let [xx, yy, zz, xy, yz, zx] = *six;
    [
        dot(v, &[xx, xy, zx]),
        dot(v, &[xy, yy, yz]),
        dot(v, &[zx, yz, zz]),
    ]
}

/// `J^(−1/3)`, by four steps of fourth order from a rational guess; to rounding for J of 0.002 to
/// 60.
#[inline(always)]
pub(super) fn inv_cbrt<R: Lanes>(token: R::Token, j: R) -> R {
    let c = |x: f64| R::splat(token, x);
    let mut y = c(2.6).divided_by(j + c(1.6)) + c(-0.03) * (j - c(1.0)).min(c(1.0));
    for _ in 0..4 {
        let e = c(1.0) - j * y * y * y;
        let series = e.mul_add(c(35.0 / 243.0), c(14.0 / 81.0));
        let series = e.mul_add(series, c(2.0 / 9.0));
        let series = e.mul_add(series, c(1.0 / 3.0));
        y = (y * e).mul_add(series, y);
    }
    y
}
