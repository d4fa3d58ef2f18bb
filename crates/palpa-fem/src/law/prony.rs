//! Linear viscoelasticity of the stress: a Prony series.
//!
//! The elastic law says the stress at once; it relaxes by
//!
//! ```text
//! G(t) = 1 − Σ g_i (1 − e^(−t/τ_i)),    S_visco(t) = ∫ G(t − s) dS(s)
//! ```
//! For `S` linear in time over each step this convolution is exact with one memory `h_i` per term:
//!
//! ```text
//! h_i ← e^(−x) h_i + m g_i φ(x) (S_new − S_old),   x = Δt/τ_i,   φ(x) = (1 − e^(−x))/x
//! S_visco = m (1 − Σ g_i) S_new + Σ h_i = c S_new + H
//! c = m (1 − Σ g_i (1 − φ_i)),   H = Σ (e^(−x) h_i − m g_i φ_i S_old)
//! ```
//! where `S` is what the *law* says and `m` takes it to the instantaneous scale: 1, or
//! `1/(1 − Σ g_i)` where the law's moduli are those of the long term. `c` and `H` do not depend on
//! what is being solved for, so a step has the energy `c W_d(F) + H : E`, `E = (FᵀF − I)/2`, the
//! stress `c P(F) + F H`, and Newton's method sees an elastic body.
//!
//! A point keeps its history as `[[f64; N]; n_terms + 1]`: the last `S`, then each `h_i`; all zero
//! at rest. `N` is 6 for a symmetric second Piola–Kirchhoff stress ([`six_of`]) and 1 for the
//! volumetric stress `U'`.

use super::LawError;
use super::error::check_positive;
use crate::Mat3;

const NAME: &str = "Prony series";

/// One term of a Prony series.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PronyTerm {
    /// Share of the instantaneous stiffness that relaxes; positive.
    pub g: f64,
    /// Its time, s; positive.
    pub tau: f64,
}

/// Which state the moduli of a law describe.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Moduli {
    /// Right after a sudden step; the stress then relaxes to `1 − Σ g` times the law's stress.
    Instantaneous,
    /// After full relaxation; right after a step the stress is `1/(1 − Σ g)` times the law's
    /// stress.
    LongTerm,
}

/// How the stress of a material relaxes.
#[derive(Debug, Clone, PartialEq)]
pub struct Prony {
    terms: Vec<PronyTerm>,
    moduli: Moduli,
    relaxes_volume: bool,
}

impl Prony {
    /// How many terms there may be.
    pub const MOST_TERMS: usize = 16;

    /// From 1 to 16 terms. With `relaxes_volume` the volumetric stress relaxes alike, so that
    /// Poisson's ratio stays; without, it stays elastic at what the law says.
    ///
    /// # Errors
    /// No term or too many; a `g` or `tau` that is not positive and finite; a sum of `g` of 1 or
    /// more.
    pub fn new(
        terms: Vec<PronyTerm>,
        moduli: Moduli,
        relaxes_volume: bool,
    ) -> Result<Self, LawError> {
        if terms.is_empty() || terms.len() > Self::MOST_TERMS {
            return Err(LawError::Terms {
                owner: NAME,
                count: terms.len(),
                most: Self::MOST_TERMS,
            });
        }
        for term in &terms {
            check_positive(NAME, "a share g", term.g, "")?;
            check_positive(NAME, "a time tau", term.tau, "s")?;
        }
        let prony = Self {
            terms,
            moduli,
            relaxes_volume,
        };
        let sum = prony.relaxing();
        if sum < 1.0 {
            Ok(prony)
        } else {
            Err(LawError::RelaxesAway { sum })
        }
    }

    /// The terms of the series.
    pub fn terms(&self) -> &[PronyTerm] {
        &self.terms
    }

    /// Which state the moduli of the law describe.
    pub fn moduli(&self) -> Moduli {
        self.moduli
    }

    /// Whether the volumetric stress relaxes too.
    pub fn relaxes_volume(&self) -> bool {
        self.relaxes_volume
    }

    /// Rows that a point's history has: the last elastic stress and one memory per term.
    pub fn n_rows(&self) -> usize {
        self.terms.len() + 1
    }

    /// `m`: the stress right after a sudden step, as a multiple of what the law says.
    pub fn instantaneous(&self) -> f64 {
        match self.moduli {
            Moduli::Instantaneous => 1.0,
            Moduli::LongTerm => 1.0 / (1.0 - self.relaxing()),
        }
    }

    /// The stress a long time after a step, as a multiple of what the law says.
    pub fn long_term(&self) -> f64 {
        match self.moduli {
            Moduli::Instantaneous => 1.0 - self.relaxing(),
            Moduli::LongTerm => 1.0,
        }
    }

    /// The stress a time `t` (s, from 0) after a sudden step, as a multiple of what the law says.
    pub fn relaxation(&self, t: f64) -> f64 {
        let gone: f64 = self
            .terms
            .iter()
            .map(|term| -term.g * (-t / term.tau).exp_m1())
            .sum();
        self.instantaneous() * (1.0 - gone)
    }

    /// Storage and loss modulus at the angular frequency `omega` (rad/s), as multiples of the law's
    /// modulus: `m (1 − Σ g + Σ g (ωτ)²/(1 + (ωτ)²))` and `m Σ g ωτ/(1 + (ωτ)²)`.
    pub fn dynamic(&self, omega: f64) -> [f64; 2] {
        let mut sum = [1.0 - self.relaxing(), 0.0];
        for term in &self.terms {
            let x = omega * term.tau;
            sum[0] += term.g / (1.0 + x.powi(-2));
            sum[1] += term.g / (x + x.recip());
        }
        sum.map(|part| part * self.instantaneous())
    }

    /// Factors of a step of the duration `dt` (s), the same at every point. `dt = 0` is a sudden step, `dt = ∞`
    /// relaxes fully.
    ///
    /// # Panics
    /// On a negative `dt` or a NaN.
    pub fn step(&self, dt: f64) -> PronyStep {
        assert!(dt >= 0.0, "a step lasts {dt} s");
        let m = self.instantaneous();
        let mut step = PronyStep {
            scale: self.long_term(),
            decay: [0.0; Self::MOST_TERMS],
            gain: [0.0; Self::MOST_TERMS],
        };
        for (i, term) in self.terms.iter().enumerate() {
            let x = dt / term.tau;
            step.decay[i] = (-x).exp();
            step.gain[i] = m * term.g * if x == 0.0 { 1.0 } else { -(-x).exp_m1() / x };
            step.scale += step.gain[i];
        }
        step
    }

    /// Factors with which [`PronyStep::advance`] leaves the memories as they are and only takes over
    /// the last stress.
    pub(crate) fn hold(&self) -> PronyStep {
        PronyStep {
            scale: self.long_term(),
            decay: [1.0; Self::MOST_TERMS],
            gain: [0.0; Self::MOST_TERMS],
        }
    }

    fn relaxing(&self) -> f64 {
        self.terms.iter().map(|term| term.g).sum()
    }
}

/// One time step of a Prony series; made once per step and material by [`Prony::step`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PronyStep {
    scale: f64,
    decay: [f64; Prony::MOST_TERMS],
    gain: [f64; Prony::MOST_TERMS],
}

impl PronyStep {
    /// `c`: what multiplies the law's new stress, its tangent and its energy.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// For each term what is left of its memory, and what a change of the elastic stress adds to
    /// it.
    pub(crate) fn factors(&self) -> ([f64; Prony::MOST_TERMS], [f64; Prony::MOST_TERMS]) {
        (self.decay, self.gain)
    }

    /// `H`, in Pa: the part of the new stress that the past has fixed. `history` is `[n_terms + 1]`
    /// rows, as the last step left them.
    #[inline]
    pub fn memory<const N: usize>(&self, history: &[[f64; N]]) -> [f64; N] {
        let mut memory = [0.0; N];
        let Some((last, rows)) = history.split_first() else {
            return memory;
        };
        for (row, (decay, gain)) in rows.iter().zip(self.decay.iter().zip(&self.gain)) {
            for k in 0..N {
                memory[k] += decay * row[k] - gain * last[k];
            }
        }
        memory
    }

    /// Ends the step: `stress` is what the law (unscaled) says at the end of it, in Pa.
    #[inline]
    pub fn advance<const N: usize>(&self, history: &mut [[f64; N]], stress: &[f64; N]) {
        let Some((last, rows)) = history.split_first_mut() else {
            return;
        };
        for (row, (decay, gain)) in rows.iter_mut().zip(self.decay.iter().zip(&self.gain)) {
            for k in 0..N {
                row[k] = decay * row[k] + gain * (stress[k] - last[k]);
            }
        }
        *last = *stress;
    }
}

/// The six numbers `xx, yy, zz, xy, yz, zx` of a symmetric matrix (not doubled), as histories keep
/// them.
#[inline]
pub fn six_of(symmetric: &Mat3) -> [f64; 6] {
    let s = symmetric;
    [
        s[(0, 0)],
        s[(1, 1)],
        s[(2, 2)],
        s[(0, 1)],
        s[(1, 2)],
        s[(2, 0)],
    ]
}

/// The symmetric matrix of six numbers `xx, yy, zz, xy, yz, zx`.
#[inline]
pub fn symmetric_of(six: &[f64; 6]) -> Mat3 {
    let [xx, yy, zz, xy, yz, zx] = *six;
    Mat3::new(xx, xy, zx, xy, yy, yz, zx, yz, zz)
}
