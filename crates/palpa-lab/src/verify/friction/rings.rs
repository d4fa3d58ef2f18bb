//! A rigid punch with friction on a half-space, solved on rings: the reference of case `spence`.
//!
//! A half-space under a pressure p(r) and an outward shear q(r) sinks and spreads by
//!
//! ```text
//! 2G w(r) = 2(1−ν) ∫ p s ∫ J₀(ξs) J₀(ξr) dξ ds − (1−2ν) ∫ᵣ q ds
//! 2G u(r) = 2(1−ν) ∫ q s ∫ J₁(ξs) J₁(ξr) dξ ds − (1−2ν)/r ∫₀ʳ p s ds
//! ```
//! Pressure draws the skin inwards; friction holds it back, and what holds it back makes the
//! half-space stiffer. A flat punch sinks by w = 1 everywhere. Where it sticks, u = 0 and q < μ p;
//! where it slips, q = μ p and u < 0. Stick is a disc of radius c.
//!
//! A sphere touches an ever larger disc. While that grows by da, w grows by the same amount in the
//! whole contact, u does not grow where it sticks, and q grows by μ times the growth of p where it
//! slips: that is the flat punch of radius a. So c/a is that of the flat punch, and the sphere's
//! force is a sum of the forces of flat punches (D. A. Spence, J. Elasticity 5 (1975) 297–319; of
//! full adhesion: Proc. R. Soc. A 305 (1968) 55–80). With W(x) the displacement of the skin beside
//! a flat punch of radius 1, the depth is `δ = D a²/2`, where `D (1/2 − ∫₁^∞ W/x³ dx) = 1/(2R)`.
//!
//! Known limits, which a test compares: without friction 2 a E/(1−ν²) and Hertz; with full adhesion
//! a flat punch is stiffer by `(1−ν) ln(3−4ν)/(1−2ν)`; and where shear does not change the pressure
//! (ν → ½), `ln((a+c)/(a−c)) a/2c = μ K′(c/a)/β` with `β = (1−2ν)/(2−2ν)` (K. L. Johnson, *Contact
//! Mechanics* (1985), section 5.4).

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{DMatrix, DVector};

/// Number of rings. 200 change the forces by 0.002 %.
const N: usize = 100;

/// A punch with friction against the same punch without.
#[derive(Debug, Clone, Copy)]
pub(super) struct Punch {
    /// Radius of the disc that sticks, as a share of the contact radius.
    pub(super) stick: f64,
    /// Force of a flat punch, relative to that without friction.
    #[cfg_attr(not(test), expect(dead_code, reason = "a known limit in the tests"))]
    pub(super) flat: f64,
    /// Force of a sphere at the same depth, relative to that without friction.
    pub(super) sphere: f64,
}

impl Punch {
    /// The punch on a half-space with Poisson's ratio `nu`, with the friction coefficient
    /// `friction`.
    pub(super) fn new(nu: f64, friction: f64) -> Self {
        let rings = Rings::new(nu);
        let mut sticks = [true; N];
        let tractions = loop {
            let tractions = rings.solve(&sticks, friction);
            let spread = rings.spread(&tractions);
            let next: [bool; N] = std::array::from_fn(|i| {
                let [p, q] = [tractions[i], tractions[N + i]];
                if sticks[i] {
                    q <= friction * p
                } else {
                    spread[i] > 0.0
                }
            });
            if next == sticks {
                break tractions;
            }
            sticks = next;
        };
        let n_sticking = sticks.iter().filter(|sticks| **sticks).count();
        let areas = rings
            .edges
            .windows(2)
            .map(|e| PI * (e[1] * e[1] - e[0] * e[0]));
        let force: f64 = areas.zip(&tractions).map(|(area, p)| area * p).sum();
        let flat = force * (1.0 - nu) / 4.0;
        let growth = 1.0 / (1.0 - 2.0 * rings.beside(&tractions));
        Self {
            stick: rings.edges[n_sticking],
            flat,
            // Without friction, flat = 1 and D = 2/R.
            sphere: flat * (2.0 / growth).sqrt(),
        }
    }
}

/// A disc of radius 1 on a half-space with shear modulus 1 Pa.
struct Rings {
    nu: f64,
    edges: [f64; N + 1],
    /// Displacements down and outwards at the middles, under pressure and shear of the rings.
    answer: DMatrix<f64>,
}

impl Rings {
    fn new(nu: f64) -> Self {
        // Narrow at the rim, where pressure is unbounded.
        let edges: [f64; N + 1] = std::array::from_fn(|i| (FRAC_PI_2 * i as f64 / N as f64).sin());
        let at: [f64; N] = std::array::from_fn(|i| 0.5 * (edges[i] + edges[i + 1]));
        let gauss = legendre(16);
        let across = 0.5 * (1.0 - 2.0 * nu);
        let answer = DMatrix::from_fn(2 * N, 2 * N, |row, column| {
            let (i, j) = (row % N, column % N);
            let (r, [from, to]) = (at[i], [edges[j], edges[j + 1]]);
            match (row < N, column < N) {
                (true, true) => (1.0 - nu) * (sunk(to, r) - sunk(from, r)),
                (true, false) => -across * (to.max(r) - from.max(r)),
                (false, true) => -across * 0.5 * (to.min(r).powi(2) - from.min(r).powi(2)) / r,
                (false, false) => (1.0 - nu) * spread_by(from, to, r, &gauss),
            }
        });
        Self { nu, edges, answer }
    }

    /// Pressures and shears of the rings under the punch.
    fn solve(&self, sticks: &[bool; N], friction: f64) -> Vec<f64> {
        // Unknowns are all pressures, and the shears where the punch sticks.
        let mut matrix = self.answer.clone();
        let mut right = DVector::from_fn(2 * N, |row, _| if row < N { 1.0 } else { 0.0 });
        for i in (0..N).filter(|&i| !sticks[i]) {
            let shear = self.answer.column(N + i) * friction;
            let mut pressure = matrix.column_mut(i);
            pressure += shear;
            matrix.column_mut(N + i).fill(0.0);
            matrix.row_mut(N + i).fill(0.0);
            matrix[(N + i, N + i)] = 1.0;
            right[N + i] = 0.0;
        }
        let mut found = matrix
            .lu()
            .solve(&right)
            .expect("the rings are independent");
        for i in (0..N).filter(|&i| !sticks[i]) {
            found[N + i] = friction * found[i];
        }
        found.as_slice().to_vec()
    }

    /// Outward displacements of the rings.
    fn spread(&self, tractions: &[f64]) -> Vec<f64> {
        let all = &self.answer * DVector::from_column_slice(tractions);
        all.as_slice()[N..].to_vec()
    }

    /// `∫₁^∞ W/x³ dx` of the displacement W beside the punch.
    fn beside(&self, tractions: &[f64]) -> f64 {
        // With x = 1/y and y = 1 − (1 − t)², which takes out the root at the rim.
        let shares = legendre(40).into_iter().map(|(t, weight)| {
            let [t, weight] = [0.5 * (t + 1.0), 0.5 * weight];
            let y = 1.0 - (1.0 - t).powi(2);
            let of_ring =
                |j: usize| sunk(self.edges[j + 1], 1.0 / y) - sunk(self.edges[j], 1.0 / y);
            let w: f64 = (0..N).map(|j| tractions[j] * of_ring(j)).sum();
            2.0 * (1.0 - t) * weight * y * (1.0 - self.nu) * w
        });
        shares.sum()
    }
}

/// Displacement at `r` under a unit pressure on a disc of radius `b`, over (1 − ν)/G.
fn sunk(b: f64, r: f64) -> f64 {
    if b == 0.0 {
        return 0.0;
    }
    if r <= b {
        let (_, e) = elliptic(r / b);
        return b * e / FRAC_PI_2;
    }
    let k = b / r;
    let (first, e) = elliptic(k);
    r * (e - (1.0 - k * k) * first) / FRAC_PI_2
}

/// Outward displacement at `r` under a unit shear on the ring from `from` to `to`, over (1 − ν)/G.
fn spread_by(from: f64, to: f64, r: f64, gauss: &[(f64, f64)]) -> f64 {
    // The kernel is a logarithm at s = r, so points gather there.
    let part = |near: f64, far: f64| -> f64 {
        let length = (far - near).abs();
        let points = gauss.iter().map(|&(t, weight)| {
            let t = 0.5 * (t + 1.0);
            let s = near + (far - near) * t.powi(3);
            let (low, high) = (s.min(r), s.max(r));
            let (first, second) = elliptic(low / high);
            0.5 * weight * 3.0 * t * t * length * s * (first - second) / (FRAC_PI_2 * low)
        });
        points.sum()
    };
    if r <= from {
        part(from, to)
    } else if r >= to {
        part(to, from)
    } else {
        part(r, from) + part(r, to)
    }
}

/// Complete elliptic integrals of the first and second kind of the modulus `k` < 1, by the
/// arithmetic–geometric mean.
fn elliptic(k: f64) -> (f64, f64) {
    let (mut a, mut b, mut c) = (1.0, ((1.0 - k) * (1.0 + k)).max(1e-30).sqrt(), k);
    let (mut sum, mut power) = (0.5 * c * c, 0.5);
    while c.abs() > 1e-15 {
        c = 0.5 * (a - b);
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
        power *= 2.0;
        sum += power * c * c;
    }
    let first = FRAC_PI_2 / a;
    (first, first * (1.0 - sum))
}

/// Points and weights of Gauss and Legendre on (−1, 1).
fn legendre(n: usize) -> Vec<(f64, f64)> {
    let point = |i: usize| {
        let mut x = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..20 {
            let (mut last, mut p) = (1.0, x);
            for j in 2..=n {
                let j = j as f64;
                (last, p) = (p, ((2.0 * j - 1.0) * x * p - (j - 1.0) * last) / j);
            }
            slope = n as f64 * (x * p - last) / (x * x - 1.0);
            x -= p / slope;
        }
        (x, 2.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..n).map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::{Punch, elliptic};

    fn is_near(found: f64, known: f64, tolerance: f64) {
        assert!((found - known).abs() <= tolerance, "{found} {known}");
    }

    #[test]
    fn without_friction_it_is_the_smooth_punch_and_hertz() {
        let punch = Punch::new(0.3, 0.0);
        is_near(punch.flat, 1.0, 1e-4);
        is_near(punch.sphere, 1.0, 1e-4);
        is_near(punch.stick, 0.0, 1e-9);
    }

    #[test]
    fn with_full_adhesion_it_is_the_bonded_punch() {
        for nu in [0.0, 0.2, 0.3, 0.45_f64] {
            let known = (1.0 - nu) * (3.0 - 4.0 * nu).ln() / (1.0 - 2.0 * nu);
            is_near(Punch::new(nu, 1e3).flat, known, 6e-4);
        }
    }

    /// Where shear hardly changes the pressure, stick ends where the formula for that limit says.
    #[test]
    fn near_one_half_stick_ends_where_the_uncoupled_formula_says() {
        for (nu, friction) in [(0.45_f64, 0.05), (0.47, 0.03), (0.48, 0.02)] {
            let beta = (1.0 - 2.0 * nu) / (2.0 - 2.0 * nu);
            let c = Punch::new(nu, friction).stick;
            let (complementary, _) = elliptic((1.0 - c * c).sqrt());
            let needed = ((1.0 + c) / (1.0 - c)).ln() / (2.0 * c) * beta / complementary;
            is_near(needed, friction, 0.01 * friction);
        }
    }

    /// Values of the same equations by other quadratures (200 rings, another program).
    #[test]
    fn forces_are_those_of_another_program() {
        for (nu, friction, stick, flat, sphere) in [
            (0.0, 0.1, 0.016, 1.01809, 1.0112),
            (0.0, 0.3, 0.502, 1.0524, 1.03181),
            (0.3, 0.2, 0.702, 1.01927, 1.01178),
            (0.0, 1e3, 1.0, 1.0986, 1.05289),
        ] {
            let punch = Punch::new(nu, friction);
            is_near(punch.stick, stick, 0.016);
            is_near(punch.flat, flat, 1e-3);
            is_near(punch.sphere, sphere, 1e-4);
        }
    }
}
