//! The path of a simulated hand or of a scripted device.

mod motions;
mod tremor;

use palpa_servo::Vec3;

/// Ratio of the largest to the mean speed of a minimum-jerk motion (Flash & Hogan 1985).
const PEAK_OVER_MEAN: f64 = 1.875;

/// A path through waypoints, with sines added. Between waypoints it has minimum jerk, as a hand
/// moves.
///
/// ```
/// use palpa_device::{Path, Vec3};
/// let path = Path::from(Vec3::zeros()).to(Vec3::new(0.0, 0.0, -0.01), 0.05).hold(1.0);
/// assert!((path.at(path.duration()).z + 0.01).abs() < 1e-15);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    start: Vec3,
    /// Waypoints: time of arrival, s, and place, m.
    points: Vec<(f64, Vec3)>,
    waves: Vec<Wave>,
}

/// A sine added to a path, between two moments.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Wave {
    /// m
    amplitude: Vec3,
    /// Hz
    frequency: f64,
    /// rad
    phase: f64,
    /// s
    from: f64,
    to: f64,
}

impl From<Vec3> for Path {
    /// A path that stays at one point.
    fn from(start: Vec3) -> Self {
        Self {
            start,
            points: Vec::new(),
            waves: Vec::new(),
        }
    }
}

impl Path {
    /// Goes on to a point, m, with this largest speed, m/s.
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

    /// Goes on to a point, m, in this time, s.
    #[must_use]
    pub fn to_in(mut self, point: Vec3, time: f64) -> Self {
        let ends_at = self.duration() + time.max(0.0);
        self.points.push((ends_at, point));
        self
    }

    /// Stays for this time, s.
    #[must_use]
    pub fn hold(self, time: f64) -> Self {
        let end = self.end();
        self.to_in(end, time)
    }

    /// Adds a sine of this amplitude, m, frequency, Hz, and phase, rad, from one moment to another,
    /// s; it fades in and out over 50 ms.
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

    /// Position at a time, m.
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

    /// Time of arrival at the last waypoint, s.
    pub fn duration(&self) -> f64 {
        self.points.last().map_or(0.0, |(ends, _)| *ends)
    }

    /// The last waypoint, m.
    pub fn end(&self) -> Vec3 {
        self.points.last().map_or(self.start, |(_, point)| *point)
    }
}
