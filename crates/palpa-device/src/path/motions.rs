//! The motions of a hand on tissue: press, stroke, drag, tap, palpate. Lengths in m, speeds in m/s.

use super::Path;
use palpa_servo::Vec3;

impl Path {
    /// Presses down by a depth and holds: from `above` along `into`, a unit vector.
    pub fn press(above: Vec3, into: Vec3, depth: f64, speed: f64, hold: f64) -> Self {
        Self::from(above).to(above + into * depth, speed).hold(hold)
    }

    /// Presses down, moves across by a vector, and goes up.
    pub fn stroke(above: Vec3, into: Vec3, depth: f64, across: Vec3, speed: f64) -> Self {
        let down = above + into * depth;
        Self::press(above, into, depth, speed, 0.1)
            .to(down + across, speed)
            .to(above + across, speed)
    }

    /// Presses down, then moves across and back while pressed, `times` times.
    pub fn drag(
        above: Vec3,
        into: Vec3,
        depth: f64,
        across: Vec3,
        speed: f64,
        times: usize,
    ) -> Self {
        let down = above + into * depth;
        let mut path = Self::press(above, into, depth, speed, 0.1);
        for _ in 0..times {
            path = path.to(down + across, speed).to(down, speed);
        }
        path
    }

    /// Makes quick short presses, `times` times.
    pub fn tap(above: Vec3, into: Vec3, depth: f64, speed: f64, times: usize) -> Self {
        let mut path = Self::from(above);
        for _ in 0..times {
            path = path
                .to(above + into * depth, speed)
                .to(above, speed)
                .hold(0.1);
        }
        path
    }

    /// Presses at points along a line, with small circles at each point, like a physician who feels
    /// for a lump.
    pub fn palpate(
        above: Vec3,
        into: Vec3,
        depth: f64,
        across: Vec3,
        speed: f64,
        points: usize,
    ) -> Self {
        let mut path = Self::from(above);
        let along = across.try_normalize(1e-9).unwrap_or_else(Vec3::x);
        let side = into.cross(&along);
        for k in 0..points {
            let share = k as f64 / points.saturating_sub(1).max(1) as f64;
            let over = above + across * share;
            path = path.to(over, speed).to(over + into * depth, speed);
            let from = path.duration();
            path = path
                .hold(1.0)
                .with_wave(along * 2e-3, 2.0, 0.0, from, from + 1.0)
                .with_wave(
                    side * 2e-3,
                    2.0,
                    std::f64::consts::FRAC_PI_2,
                    from,
                    from + 1.0,
                )
                .to(over, speed);
        }
        path
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_speed_asked_for_is_the_largest() {
        let path = Path::press(Vec3::zeros(), -Vec3::z(), 0.02, 0.05, 0.0);
        let mut fastest: f64 = 0.0;
        for k in 0..2000 {
            let t = path.duration() * f64::from(k) / 2000.0;
            fastest = fastest.max((path.at(t + 1e-6) - path.at(t)).norm() / 1e-6);
        }
        assert!((fastest - 0.05).abs() < 1e-4, "{fastest}");
    }
}
