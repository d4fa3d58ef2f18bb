//! Where a hand wants to be: what moves a simulated hand, or a scripted device.

use palpa_servo::Vec3;

/// Largest speed of a minimum-jerk motion over its mean (Flash & Hogan 1985).
const PEAK_OVER_MEAN: f64 = 1.875;

/// A path through waypoints, each reached as hands do, with minimum jerk, and waves on top.
///
/// ```
/// use palpa_device::{Path, Vec3};
/// let path = Path::from(Vec3::zeros()).to(Vec3::new(0.0, 0.0, -0.01), 0.05).hold(1.0);
/// assert!((path.at(path.duration()).z + 0.01).abs() < 1e-15);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    start: Vec3,
    /// When each ends, s, and where, m.
    points: Vec<(f64, Vec3)>,
    waves: Vec<Wave>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Wave {
    amplitude: Vec3,
    frequency: f64,
    phase: f64,
    from: f64,
    to: f64,
}

impl From<Vec3> for Path {
    /// Begins there, and stays.
    fn from(start: Vec3) -> Self {
        Self {
            start,
            points: Vec::new(),
            waves: Vec::new(),
        }
    }
}

impl Path {
    /// On to a point, at most at that speed, m/s.
    #[must_use]
    pub fn to(self, point: Vec3, speed: f64) -> Self {
        let length = (point - self.end()).norm();
        let time = if speed > 0.0 {
            PEAK_OVER_MEAN * length / speed
        } else {
            0.0
        };
        self.to_in(point, time)
    }

    /// On to a point in that time, s.
    #[must_use]
    pub fn to_in(mut self, point: Vec3, time: f64) -> Self {
        let ends_at = self.duration() + time.max(0.0);
        self.points.push((ends_at, point));
        self
    }

    /// Stays for that time, s.
    #[must_use]
    pub fn hold(self, time: f64) -> Self {
        let end = self.end();
        self.to_in(end, time)
    }

    /// A sine of that amplitude, m, and frequency, Hz, from one moment to another, s, faded in and out over 50 ms.
    #[must_use]
    pub fn with_wave(
        mut self,
        amplitude: Vec3,
        frequency: f64,
        phase: f64,
        from: f64,
        to: f64,
    ) -> Self {
        self.waves.push(Wave {
            amplitude,
            frequency,
            phase,
            from,
            to,
        });
        self
    }

    /// The trembling of a hand: three sines of 8 to 12 Hz, physiological tremor, in directions that the seed draws;
    /// `amplitude` is the root of their mean square, m, of 0.05 to 0.2 mm for a healthy hand.
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

    /// Down by a depth and held: from `above` along `into`, a unit vector.
    pub fn press(above: Vec3, into: Vec3, depth: f64, speed: f64, hold: f64) -> Self {
        Self::from(above).to(above + into * depth, speed).hold(hold)
    }

    /// Down, across by a vector, and up.
    pub fn stroke(above: Vec3, into: Vec3, depth: f64, across: Vec3, speed: f64) -> Self {
        let down = above + into * depth;
        Self::press(above, into, depth, speed, 0.1)
            .to(down + across, speed)
            .to(above + across, speed)
    }

    /// There and back across while pressed, a number of times.
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

    /// Quick short presses, a number of times.
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

    /// As a physician feels for a lump: pressed at points along a line, with small circles at each.
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

    /// Where it is at a time, m.
    pub fn at(&self, time: f64) -> Vec3 {
        let (mut from, mut began) = (self.start, 0.0);
        let mut position = self.end();
        for (ends, point) in &self.points {
            if time < *ends {
                let s = ((time - began) / (ends - began)).clamp(0.0, 1.0);
                let share = s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
                position = from + (point - from) * share;
                break;
            }
            (from, began) = (*point, *ends);
        }
        for wave in &self.waves {
            let inside = (time - wave.from).min(wave.to - time);
            if inside > 0.0 {
                let angle =
                    std::f64::consts::TAU * wave.frequency * (time - wave.from) + wave.phase;
                position += wave.amplitude * angle.sin() * (inside / 0.05).min(1.0);
            }
        }
        position
    }

    /// When the last waypoint is reached, s.
    pub fn duration(&self) -> f64 {
        self.points.last().map_or(0.0, |(ends, _)| *ends)
    }

    /// The last waypoint, m.
    pub fn end(&self) -> Vec3 {
        self.points.last().map_or(self.start, |(_, point)| *point)
    }
}

/// From 0 to 1, by splitmix64 (Steele, Lea & Flood 2014).
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
    fn the_speed_asked_for_is_the_largest() {
        let path = Path::press(Vec3::zeros(), -Vec3::z(), 0.02, 0.05, 0.0);
        let mut fastest: f64 = 0.0;
        for k in 0..2000 {
            let t = path.duration() * f64::from(k) / 2000.0;
            fastest = fastest.max((path.at(t + 1e-6) - path.at(t)).norm() / 1e-6);
        }
        assert!((fastest - 0.05).abs() < 1e-4, "{fastest}");
    }

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
