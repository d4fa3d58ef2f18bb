//! Filters of a force, sample by sample.

/// The band in which hands feel vibration, Hz.
pub(crate) const VIBRATION: [f64; 2] = [20.0, 400.0];

/// A band-pass filter of the three components of a force.
#[derive(Debug, Clone)]
pub(crate) struct BandPass {
    /// High pass and low pass of each component.
    filters: [[Biquad; 2]; 3],
}

impl BandPass {
    /// A filter for the frequencies from `low` to `high`, Hz, of samples that are `period` apart, s.
    pub(crate) fn new([low, high]: [f64; 2], period: f64) -> Self {
        // The upper edge must lie below half the sampling rate.
        let high = high.min(0.49 / period);
        let pair = [
            Biquad::high_pass(low * period),
            Biquad::low_pass(high * period),
        ];
        Self { filters: [pair; 3] }
    }

    /// Takes the next force, N; returns the square of the filtered force, N².
    pub(crate) fn square(&mut self, force: [f64; 3]) -> f64 {
        (self.filters.iter_mut().zip(force))
            .map(|([high, low], f)| low.next(high.next(f)).powi(2))
            .sum()
    }
}

/// A second-order Butterworth filter, direct form II transposed. From the bilinear transform:
/// Zölzer, DAFX (2011), 2.3.
#[derive(Debug, Clone, Copy)]
struct Biquad {
    b: [f64; 3],
    a: [f64; 2],
    state: [f64; 2],
}

impl Biquad {
    /// `f` is the corner in cycles per sample.
    fn low_pass(f: f64) -> Self {
        let k = (std::f64::consts::PI * f).tan();
        Self::new([k * k, 2.0 * k * k, k * k], k)
    }

    fn high_pass(f: f64) -> Self {
        Self::new([1.0, -2.0, 1.0], (std::f64::consts::PI * f).tan())
    }

    fn new(b: [f64; 3], k: f64) -> Self {
        let scale = 1.0 / (1.0 + std::f64::consts::SQRT_2 * k + k * k);
        Self {
            b: b.map(|b| b * scale),
            a: [
                2.0 * (k * k - 1.0) * scale,
                (1.0 - std::f64::consts::SQRT_2 * k + k * k) * scale,
            ],
            state: [0.0; 2],
        }
    }

    fn next(&mut self, x: f64) -> f64 {
        let y = self.b[0] * x + self.state[0];
        self.state = [
            self.b[1] * x - self.a[0] * y + self.state[1],
            self.b[2] * x - self.a[1] * y,
        ];
        y
    }
}
