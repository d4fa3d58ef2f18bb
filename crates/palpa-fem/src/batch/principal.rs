//! Laws in powers of the principal stretches, in lanes.
//!
//! With `C = Σ x_a v_a⊗v_a`, `x_a = λ_a²`, `e_a = ln λ̄_a`, and `w` for half the shear modulus at
//! rest
//!
//! ```text
//! g_a  = ∂W_d/∂ ln λ_a = 4/3 w Σ_p share_p Σ_b (λ̄_a^α − λ̄_b^α)/α,      S = Σ_a S_a v_a⊗v_a,   S_a = g_a/x_a
//! h_ab = ∂g_a/∂ ln λ_b = 4 w Σ_p share_p [δ_ab λ̄_a^α + (m − λ̄_a^α − λ̄_b^α)/3],   m = ⅓ Σ_c λ̄_c^α
//! dS_aa = Σ_b (h_ab − 2 δ_ab g_a)/(x_a x_b) dE_bb,      dS_ab = 2 (S_a − S_b)/(x_a − x_b) dE_ab,   a ≠ b
//! ```
//! in the frame of the `v_a`. Differences are taken as
//! `λ̄_a^α − λ̄_b^α = 2 (λ̄_a λ̄_b)^(α/2) sinh z`, `z = α (e_a − e_b)/2`, so that equal stretches
//! are no special case. Work on vectors is written as loops: closures may be compiled without the
//! machine's instructions.

#![expect(
    clippy::inline_always,
    reason = "one piece of arithmetic on several arrays, compiled in its caller with the machine's instructions"
)]

use palpa_sparse::fronts::Number;

use super::elementary::{exp, ln, sinh_ratio};
use super::kernel::{M3, V3, WIDTH, axpy, dot, mul, scale};
use super::lanes::Lanes;
use crate::law::Powers;

/// Largest number of sweeps of rotations. Each sweep squares the off-diagonal part; five are enough
/// in double precision.
const SWEEPS: usize = 6;
/// Off-diagonal part that may remain, as a share of the trace, in units of rounding.
const LEFT: f64 = 0.1;
/// From this size on, `sinh` is computed from powers instead of its series.
const WIDE: f64 = 0.5;

/// Symmetric: `xx, yy, zz, xy, yz, zx`.
pub(super) type Six<R> = [R; 6];

/// Where the stretches lie, and how the second Piola–Kirchhoff stress changes with Green's strain
/// there.
#[derive(Clone, Copy)]
pub(super) struct Frame<R> {
    /// `v_a`.
    axes: M3<R>,
    /// `∂S_aa/∂E_bb`, Pa
    normal: M3<R>,
    /// `2 ∂S_ab/∂E_ab` for a, b = 01, 12, 20, Pa
    askew: V3<R>,
}

/// Eigenvalues of a symmetric positive matrix, and eigenvectors as rows, by Jacobi's rotations.
#[inline(always)]
fn eigen<R: Lanes>(token: R::Token, symmetric: &Six<R>) -> (V3<R>, M3<R>) {
    let c = |x: f64| R::splat(token, x);
    let (zero, one) = (c(0.0), c(1.0));
    let mut a = *symmetric;
    let mut axes = [[one, zero, zero], [zero, one, zero], [zero, zero, one]];
    let smallest = c(LEFT * R::EPSILON) * (a[0] + a[1] + a[2]);
    for _ in 0..SWEEPS {
        let mut excess = [R::Element::nearest(0.0); WIDTH];
        let off = a[3].max(-a[3]) + a[4].max(-a[4]) + a[5].max(-a[5]);
        (off - smallest).store(&mut excess);
        if !excess.iter().any(|&x| x > R::Element::nearest(0.0)) {
            break;
        }
        for p in 0..3 {
            let (q, r) = ((p + 1) % 3, (p + 2) % 3);
            // a_pq, a_qr, a_rp stand at 3 + p, 3 + q, 3 + r.
            let twice = a[3 + p] + a[3 + p];
            let difference = a[q] - a[p];
            let root = difference
                .mul_add(difference, twice * twice)
                .sqrt()
                .max(c(1e-30));
            let root = difference.select_less(zero, -root, root);
            let tan = twice.divided_by(difference + root);
            let cos = one.divided_by(tan.mul_add(tan, one).sqrt());
            let sin = tan * cos;
            a[p] = a[p] - tan * a[3 + p];
            a[q] = a[q] + tan * a[3 + p];
            a[3 + p] = zero;
            let (rp, rq) = (a[3 + r], a[3 + q]);
            a[3 + r] = cos * rp - sin * rq;
            a[3 + q] = sin * rp + cos * rq;
            let (vp, vq) = (axes[p], axes[q]);
            axes[p] = axpy(-sin, &vq, &scale(cos, &vp));
            axes[q] = axpy(sin, &vp, &scale(cos, &vq));
        }
    }
    ([a[0], a[1], a[2]], axes)
}

/// The deviatoric second Piola–Kirchhoff stress at Cauchy and Green's `C`, Pa, of a law whose half
/// shear modulus at rest is `slope`, Pa; and how it changes.
#[inline(always)]
pub(super) fn respond<R: Lanes>(
    token: R::Token,
    powers: &Powers,
    slope: R,
    cauchy_green: &Six<R>,
) -> (Six<R>, Frame<R>) {
    let c = |x: f64| R::splat(token, x);
    let zero = c(0.0);
    let (x, axes) = eigen(token, cauchy_green);
    let (mut inverse, mut stretch, mut half_ln) = ([zero; 3], [zero; 3], [zero; 3]);
    for a in 0..3 {
        // It can be less only if a prism is inside out.
        let x = x[a].max(c(1e-30));
        inverse[a] = c(1.0).divided_by(x);
        stretch[a] = x.sqrt();
        half_ln[a] = c(0.5) * ln(token, x);
    }
    let mean = c(1.0 / 3.0) * (half_ln[0] + half_ln[1] + half_ln[2]);
    let apart = [
        half_ln[0] - half_ln[1],
        half_ln[1] - half_ln[2],
        half_ln[2] - half_ln[0],
    ];

    let mut slopes = [[zero; 3]; 3];
    let mut differences = [zero; 3];
    let mut middles = [zero; 3];
    for term in powers.terms() {
        let alpha = c(term.alpha);
        let modulus = c(4.0 * term.share) * slope;
        let (mut root, mut power) = ([zero; 3], [zero; 3]);
        for a in 0..3 {
            root[a] = exp(token, c(0.5) * alpha * (half_ln[a] - mean));
            power[a] = root[a] * root[a];
        }
        let third = c(1.0 / 3.0) * (power[0] + power[1] + power[2]);
        for a in 0..3 {
            for b in a..3 {
                let own = if a == b { power[a] } else { zero };
                let fall = c(1.0 / 3.0) * (third - power[a] - power[b]);
                slopes[a][b] = modulus.mul_add(own + fall, slopes[a][b]);
            }
            let b = (a + 1) % 3;
            let z = c(0.5) * alpha * apart[a];
            let middle = root[a] * root[b];
            let sinh = sinh_by(token, z, power[a] - power[b], middle);
            let middle = modulus * middle * sinh;
            middles[a] = middles[a] + middle;
            differences[a] = middle.mul_add(apart[a], differences[a]);
        }
    }
    // g_0 = (d_01 − d_20)/3, and so on.
    let mut force = [zero; 3];
    for a in 0..3 {
        force[a] = c(1.0 / 3.0) * (differences[a] - differences[(a + 2) % 3]);
    }

    let mut frame = Frame {
        axes,
        normal: [[zero; 3]; 3],
        askew: [zero; 3],
    };
    for a in 0..3 {
        for b in 0..3 {
            let own = if a == b { c(2.0) * force[a] } else { zero };
            let slope = slopes[a.min(b)][a.max(b)];
            frame.normal[a][b] = (slope - own) * inverse[a] * inverse[b];
        }
        let b = (a + 1) % 3;
        let product = stretch[a] * stretch[b];
        let sinh = sinh_by(token, apart[a], x[a] - x[b], product);
        let ratio = c(0.5) * middles[a].divided_by(product * sinh);
        frame.askew[a] = c(4.0) * (ratio * x[b] - force[b]) * inverse[a] * inverse[b];
    }
    let mut stress = [zero; 6];
    for a in 0..3 {
        let own = force[a] * inverse[a];
        for (sum, (i, k)) in stress.iter_mut().zip(PLACES) {
            *sum = (own * axes[a][i]).mul_add(axes[a][k], *sum);
        }
    }
    (stress, frame)
}

/// Rows and columns of six numbers.
pub(super) const PLACES: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)];

/// `sinh z / z`, if `2 middle sinh z = difference` is also known.
#[inline(always)]
fn sinh_by<R: Lanes>(token: R::Token, z: R, difference: R, middle: R) -> R {
    let twice = (middle + middle) * z;
    z.max(-z).select_less(
        R::splat(token, WIDE),
        sinh_ratio(token, z),
        difference.divided_by(twice),
    )
}

impl<R: Lanes> Frame<R> {
    /// Green's strains `aa` and then `01, 12, 20` for the three directions of a node's
    /// displacement, 1/m: of its gradient `hat`, and of the change `turn` (1/m) of the stretch of
    /// `carried` along `normal`.
    #[inline(always)]
    pub(super) fn strains(
        &self,
        token: R::Token,
        deformation: &M3<R>,
        carried: &V3<R>,
        normal: &V3<R>,
        hat: &V3<R>,
        turn: &V3<R>,
    ) -> [V3<R>; 6] {
        let (zero, half) = (R::splat(token, 0.0), R::splat(token, 0.5));
        let (mut f, mut kappa, mut m, mut g) = ([[zero; 3]; 3], [zero; 3], [zero; 3], [zero; 3]);
        for a in 0..3 {
            f[a] = mul(deformation, &self.axes[a]);
            kappa[a] = dot(&f[a], carried);
            m[a] = dot(&self.axes[a], normal);
            g[a] = dot(&self.axes[a], hat);
        }
        let mut strains = [[zero; 3]; 6];
        for a in 0..3 {
            let b = (a + 1) % 3;
            strains[a] = axpy(kappa[a] * m[a], turn, &scale(g[a], &f[a]));
            let own = axpy(half * g[b], &f[a], &scale(half * g[a], &f[b]));
            let mixed = kappa[a].mul_add(m[b], kappa[b] * m[a]);
            strains[3 + a] = axpy(half * mixed, turn, &own);
        }
        strains
    }

    /// The stresses of these strains, times `volume`, so that the product with other strains is
    /// their stiffness.
    #[inline(always)]
    pub(super) fn stresses(&self, volume: R, strains: &[V3<R>; 6]) -> [V3<R>; 6] {
        let mut stresses = *strains;
        for a in 0..3 {
            let [x, y, z] = self.normal[a];
            let sum = axpy(y, &strains[1], &scale(x, &strains[0]));
            stresses[a] = scale(volume, &axpy(z, &strains[2], &sum));
            stresses[3 + a] = scale(volume * self.askew[a], &strains[3 + a]);
        }
        stresses
    }
}
