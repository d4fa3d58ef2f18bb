//! The tremor of a hand.

use super::Path;
use palpa_servo::Vec3;

impl Path {
    /// Adds physiological tremor from one moment to another, s: three sines of 8 to 12 Hz in
    /// directions drawn by the seed. `amplitude` is their root mean square, m; a healthy hand has
    /// 0.05 to 0.2 mm.
    #[must_use]
    pub fn trembling(mut self, amplitude: f64, seed: u64, from: f64, to: f64) -> Self {
        let mut state = seed;
        let each = amplitude * (2.0_f64 / 3.0).sqrt();
        for _ in 0..3 {
            let mut draw = || uniform(&mut state);
            let direction = Vec3::new(draw() - 0.5, draw() - 0.5, draw() - 0.5);
            let direction = direction.try_normalize(1e-6).unwrap_or_else(Vec3::z);
            let (frequency, phase) = (8.0 + 4.0 * draw(), std::f64::consts::TAU * draw());
            self = self.with_wave(direction * each, frequency, phase, from, to);
        }
        self
    }
}

/// A random number from 0 to 1 by splitmix64 (Steele, Lea & Flood 2014). `palpa-mesh` has the same
/// generator in `generate/random.rs`; neither crate depends on the other, and a library's may draw
/// other numbers in its next version.
fn uniform(state: &mut u64) -> f64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_seed_trembles_alike() {
        let path = |seed| {
            Path::from(Vec3::zeros())
                .hold(2.0)
                .trembling(1e-4, seed, 0.0, 2.0)
        };
        assert_eq!(path(3), path(3));
        assert_ne!(path(3), path(4));
        let mean_sq = (0..20000)
            .map(|k| path(3).at(f64::from(k) * 1e-4).norm_squared())
            .sum::<f64>()
            / 20000.0;
        assert!((mean_sq.sqrt() - 1e-4).abs() < 2e-5, "{}", mean_sq.sqrt());
    }
}
