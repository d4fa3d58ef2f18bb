//! Velocity from positions that come in steps of an encoder.
//!
//! First-order adaptive windowing (Janabi-Sharifi, Hayward & Chen 2000): it uses the longest window
//! in which a straight line passes all readings within the resolution. A still hand gives zero or
//! the drift over the whole window; a fast hand gives a short window and little lag.

use crate::Vec3;

/// Longest window, readings.
const WINDOW: usize = 24;

/// The last readings of one position.
#[derive(Debug, Clone, Copy)]
pub(crate) struct VelocityEstimate {
    /// Newest first: time, s, and position, m.
    readings: [(f64, Vec3); WINDOW],
    n: usize,
}

impl VelocityEstimate {
    pub(crate) const fn new() -> Self {
        Self {
            readings: [(0.0, Vec3::new(0.0, 0.0, 0.0)); WINDOW],
            n: 0,
        }
    }

    pub(crate) fn clear(&mut self) {
        self.n = 0;
    }

    /// Adds a reading and returns the new velocity, m/s.
    pub(crate) fn update(&mut self, time: f64, position: &Vec3, resolution: f64) -> Vec3 {
        self.readings.rotate_right(1);
        if let Some(first) = self.readings.first_mut() {
            *first = (time, *position);
        }
        self.n = (self.n + 1).min(WINDOW);
        let mut best = Vec3::zeros();
        for (length, (start, from)) in self.readings.iter().enumerate().take(self.n).skip(1) {
            let span = time - start;
            if span <= 0.0 {
                break;
            }
            let slope = (position - from) / span;
            let fits = (self.readings.iter().take(length).skip(1))
                .all(|(at, p)| (from + slope * (at - start) - p).amax() <= resolution);
            if !fits {
                break;
            }
            best = slope;
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flicker_of_one_count_is_no_velocity() {
        let mut estimate = VelocityEstimate::new();
        for k in 0..200 {
            let x = if k % 3 == 0 { 5e-5 } else { 0.0 };
            let v = estimate.update(f64::from(k) * 1e-3, &Vec3::new(x, 0.0, 0.0), 5e-5);
            assert!(k < 30 || v.norm() < 3e-3, "{v}");
        }
    }

    #[test]
    fn steady_and_fast_motions_are_followed() {
        for speed in [0.01, 0.05, 0.3, 1.0] {
            let mut estimate = VelocityEstimate::new();
            let mut v = Vec3::zeros();
            for k in 0..60 {
                let t = f64::from(k) * 1e-3;
                let x = libm::round(speed * t / 5e-5) * 5e-5;
                v = estimate.update(t, &Vec3::new(0.0, x, 0.0), 5e-5);
            }
            assert!((v.y - speed).abs() < 0.03 * speed + 2.5e-3, "{speed} {v}");
        }
    }
}
