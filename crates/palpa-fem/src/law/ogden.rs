//! Ogden law.
//!
//! With the principal stretches `λ_a`, `λ̄_a = J^(−1/3) λ_a`, and unit vectors `v_a` at rest and
//! `u_a` in space, `F = Σ λ_a u_a⊗v_a`:
//!
//! ```text
//! W_d(F) = Σ_p 2 μ_p/α_p² (λ̄_1^α_p + λ̄_2^α_p + λ̄_3^α_p − 3),   μ = Σ μ_p        [J/m³]
//! P(F)   = Σ_a g_a/λ_a u_a⊗v_a                                                   [Pa]
//! g_a    = ∂W_d/∂ ln λ_a = Σ_p 2 μ_p/α_p (λ̄_a^α_p − m_p),   m_p = ⅓ Σ_b λ̄_b^α_p
//! ```
//! In the frame of the `u_a⊗v_b` the tangent has a 3 × 3 block for the stretches and, for each pair
//! `a < b`, one stiffness against stretching askew and one against spin: `(W_a − W_b)/(λ_a − λ_b)`
//! and `(W_a + W_b)/(λ_a + λ_b)`, `W_a = g_a/λ_a`. The first is written with `sinh`, so that equal
//! stretches are no special case but for 0/0 itself. Ogden, Proc. R. Soc. A 326 (1972).

use super::error::{check_positive, moduli};
use super::invariants::Isochoric;
use super::spectral::eigen;
use super::tangent::add_outer;
use super::{Described, Hardening, LawError, Powers, Response, Volumetric};
use crate::{Mat3, Mat9};

const NAME: &str = "Ogden";

/// One term of an Ogden law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OgdenTerm {
    /// Share of the term in the shear modulus, Pa; positive.
    pub mu: f64,
    /// Exponent `α`; positive or negative.
    pub alpha: f64,
}

/// A sum of powers of the isochoric stretches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ogden {
    terms: [OgdenTerm; Ogden::MOST_TERMS],
    n_terms: usize,
    volumetric: Volumetric,
}

impl Ogden {
    /// How many terms there may be.
    pub const MOST_TERMS: usize = 6;
    /// Exponents outside these sizes overflow or cancel, and fit no tissue.
    const EXPONENTS: [f64; 2] = [1e-3, 100.0];

    /// From 1 to 6 terms. Where a published fit has a negative `mu`, its energy is not convex, and
    /// it is refused.
    ///
    /// # Errors
    /// No term or too many; a `mu` that is not positive; an exponent of a size outside 0.001 to
    /// 100.
    pub fn new(terms: &[OgdenTerm], volumetric: Volumetric) -> Result<Self, LawError> {
        if terms.is_empty() || terms.len() > Self::MOST_TERMS {
            return Err(LawError::Terms {
                owner: NAME,
                count: terms.len(),
                most: Self::MOST_TERMS,
            });
        }
        let [least, most] = Self::EXPONENTS;
        for (index, term) in terms.iter().enumerate() {
            check_positive(NAME, "the modulus mu of a term", term.mu, "Pa")?;
            if !(least..=most).contains(&term.alpha.abs()) {
                return Err(LawError::Exponent {
                    term: index + 1,
                    value: term.alpha,
                    least,
                    most,
                });
            }
        }
        let mut own = [OgdenTerm {
            mu: 0.0,
            alpha: 2.0,
        }; Self::MOST_TERMS];
        own[..terms.len()].copy_from_slice(terms);
        let law = Self {
            terms: own,
            n_terms: terms.len(),
            volumetric: volumetric.checked(NAME)?,
        };
        check_positive(NAME, "the shear modulus", law.shear(), "Pa")?;
        Ok(law)
    }

    /// One term of the exponent `alpha`, from Young's modulus (Pa) and Poisson's ratio, with the
    /// quadratic volumetric energy.
    ///
    /// # Errors
    /// A modulus that is not positive, a ratio outside (−1, ½), or an exponent of a size outside
    /// 0.001 to 100.
    pub fn from_young(young: f64, poisson: f64, alpha: f64) -> Result<Self, LawError> {
        let (shear, bulk) = moduli(NAME, young, poisson)?;
        Self::new(
            &[OgdenTerm { mu: shear, alpha }],
            Volumetric::Quadratic { bulk },
        )
    }

    pub(super) fn energy_at(&self, f: &Mat3) -> f64 {
        Principal::new(f).map_or(f64::INFINITY, |principal| self.energy_of(&principal))
    }

    pub(super) fn stress_at(&self, f: &Mat3) -> (f64, Mat3) {
        let Some(principal) = Principal::new(f) else {
            return (f64::INFINITY, Mat3::zeros());
        };
        (
            self.energy_of(&principal),
            principal.stress(self.forces(&principal)),
        )
    }

    pub(super) fn response_at(&self, f: &Mat3) -> Response {
        let Some(principal) = Principal::new(f) else {
            return Response::REFUSED;
        };
        let g = self.forces(&principal);
        Response {
            energy: self.energy_of(&principal),
            stress: principal.stress(g),
            tangent: self.tangent(&principal, g),
        }
    }

    /// Its terms.
    pub fn terms(&self) -> &[OgdenTerm] {
        &self.terms[..self.n_terms]
    }

    fn energy_of(&self, principal: &Principal) -> f64 {
        // Σ_a ln λ̄_a = 0, so the part of first order is left out rather than cancelled.
        self.terms()
            .iter()
            .map(|&OgdenTerm { mu, alpha }| {
                2.0 * mu / (alpha * alpha)
                    * principal
                        .ln_bar
                        .iter()
                        .map(|e| exp_beyond_first(alpha * e))
                        .sum::<f64>()
            })
            .sum()
    }

    /// `g_a = ∂W_d/∂ ln λ_a`.
    fn forces(&self, principal: &Principal) -> [f64; 3] {
        let mut g = [0.0; 3];
        for &OgdenTerm { mu, alpha } in self.terms() {
            let power = principal.ln_bar.map(|e| (alpha * e).exp_m1());
            let mean = power.iter().sum::<f64>() / 3.0;
            for (g, power) in g.iter_mut().zip(power) {
                *g += 2.0 * mu / alpha * (power - mean);
            }
        }
        g
    }

    fn tangent(&self, principal: &Principal, g: [f64; 3]) -> Mat9 {
        let Principal {
            ln_bar, stretch, ..
        } = principal;
        let mut hessian = Mat3::zeros(); // ∂g_a/∂ ln λ_b
        let mut askew = [0.0; 3]; // (g_a − g_b)/(λ_a − λ_b), for the pairs of PAIRS
        for &OgdenTerm { mu, alpha } in self.terms() {
            let power = ln_bar.map(|e| (alpha * e).exp());
            let mean = power.iter().sum::<f64>() / 3.0;
            for a in 0..3 {
                for b in 0..3 {
                    let own = if a == b { power[a] } else { 0.0 };
                    hessian[(a, b)] += 2.0 * mu * (own + (mean - power[a] - power[b]) / 3.0);
                }
            }
            for (askew, [a, b]) in askew.iter_mut().zip(PAIRS) {
                let half = 0.5 * (ln_bar[a] - ln_bar[b]);
                let middle = (0.5 * alpha * (ln_bar[a] + ln_bar[b])).exp()
                    / (stretch[a] * stretch[b]).sqrt();
                let sinhs = if half == 0.0 {
                    alpha
                } else {
                    (alpha * half).sinh() / half.sinh()
                };
                *askew += 2.0 * mu / alpha * middle * sinhs;
            }
        }

        let mut tangent = Mat9::zeros();
        for a in 0..3 {
            let aa = principal.dyad(a, a);
            for b in 0..3 {
                let own = if a == b { g[a] } else { 0.0 };
                let stiffness = (hessian[(a, b)] - own) / (stretch[a] * stretch[b]);
                add_outer(&mut tangent, stiffness, &aa, &principal.dyad(b, b));
            }
        }
        for (askew, [a, b]) in askew.into_iter().zip(PAIRS) {
            let (ab, ba) = (principal.dyad(a, b), principal.dyad(b, a));
            let (flip, twist) = (ab + ba, ab - ba);
            let against_flip = askew / stretch[a] - g[b] / (stretch[a] * stretch[b]);
            let against_twist = (g[a] / stretch[a] + g[b] / stretch[b]) / (stretch[a] + stretch[b]);
            add_outer(&mut tangent, 0.5 * against_flip, &flip, &flip);
            add_outer(&mut tangent, 0.5 * against_twist, &twist, &twist);
        }
        tangent
    }
}

impl Described for Ogden {
    const NAME: &'static str = NAME;

    fn shear(&self) -> f64 {
        self.terms().iter().map(|term| term.mu).sum()
    }

    fn volumetric(&self) -> &Volumetric {
        &self.volumetric
    }

    fn hardening(&self) -> Option<Hardening> {
        let terms = self.terms().iter().map(|term| (term.mu, term.alpha));
        Some(Hardening::Powers(Powers::new(terms)))
    }
}

const PAIRS: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

/// The principal stretches of a deformation gradient, and where they lie.
struct Principal {
    /// `ln λ̄_a`; they add up to zero.
    ln_bar: [f64; 3],
    /// `λ_a`.
    stretch: [f64; 3],
    /// `v_a` as columns: where the stretches lie at rest.
    at_rest: Mat3,
    /// `u_a` as columns: where they lie in space.
    in_space: Mat3,
}

impl Principal {
    /// `None` where there is no such law: `det F ≤ 0`, or so near that that doubles do not hold it.
    fn new(f: &Mat3) -> Option<Self> {
        let iso = Isochoric::new(f)?;
        // C = t (I + D): the eigenvalues of the small D keep small strains exact.
        let (d, at_rest) = eigen(&iso.deviator());
        if d.iter().any(|&d| d <= -1.0) {
            return None;
        }
        let half_ln = d.map(|d| 0.5 * d.ln_1p());
        let mean = half_ln.iter().sum::<f64>() / 3.0;
        let stretch = d.map(|d| (iso.mean() * (1.0 + d)).sqrt());
        let mut in_space = f * at_rest;
        for (mut column, stretch) in in_space.column_iter_mut().zip(stretch) {
            column /= stretch;
        }
        Some(Self {
            ln_bar: half_ln.map(|e| e - mean),
            stretch,
            at_rest,
            in_space,
        })
    }

    /// `u_a⊗v_b`.
    fn dyad(&self, a: usize, b: usize) -> Mat3 {
        self.in_space.column(a) * self.at_rest.column(b).transpose()
    }

    fn stress(&self, g: [f64; 3]) -> Mat3 {
        (0..3)
            .map(|a| g[a] / self.stretch[a] * self.dyad(a, a))
            .sum()
    }
}

/// `eˣ − 1 − x`.
fn exp_beyond_first(x: f64) -> f64 {
    if x.abs() > 0.1 {
        return x.exp_m1() - x;
    }
    // Taylor to x¹¹: the rest is below 1e-17 of the sum.
    let tail = (3..=11)
        .rev()
        .fold(1.0, |tail, n| 1.0 + tail * x / f64::from(n));
    0.5 * x * x * tail
}
