//! Hardening of a law, in a form that the moving step's kernel evaluates for many points at once.

use super::Ogden;

/// How the deviatoric energy of a law grows with strain, for one half of the shear modulus at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Hardening {
    /// In `x = Ī1 − 3`: `w' = 1`.
    None,
    /// `w' = 1 + 2 a x + 3 b x²`.
    Cubic { a: f64, b: f64 },
    /// `w' = exp(b x)`.
    Exponential { b: f64 },
    /// `Σ_p 4 share_p/α_p² (λ̄_1^α_p + λ̄_2^α_p + λ̄_3^α_p − 3)`.
    Powers(Powers),
}

/// Powers of the isochoric stretches, whose shares add up to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Powers {
    terms: [Power; Ogden::MOST_TERMS],
    n: usize,
}

/// One of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Power {
    /// Share of the shear modulus at rest.
    pub(crate) share: f64,
    /// Exponent `α`.
    pub(crate) alpha: f64,
}

impl Powers {
    /// Of moduli, in one unit, and exponents; at most [`Ogden::MOST_TERMS`].
    pub(super) fn new(terms: impl Iterator<Item = (f64, f64)> + Clone) -> Self {
        let sum: f64 = terms.clone().map(|term| term.0).sum();
        let mut powers = Self {
            terms: [Power {
                share: 0.0,
                alpha: 2.0,
            }; Ogden::MOST_TERMS],
            n: 0,
        };
        for (own, (modulus, alpha)) in powers.terms.iter_mut().zip(terms) {
            let share = modulus / sum;
            *own = Power { share, alpha };
            powers.n += 1;
        }
        powers
    }

    pub(crate) fn terms(&self) -> &[Power] {
        &self.terms[..self.n]
    }
}
