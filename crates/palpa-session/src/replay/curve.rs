//! The course of a recording in a bounded number of points.

use std::path::Path;

use palpa::live::Ruler;
use palpa_mesh::Vec3;
use palpa_rt::{LogError, Row, Rows};
use palpa_viewer::control::RecordingCurve;

/// Largest number of stretches of time. Each keeps up to four ticks.
const MOST: usize = 512;
/// Time between two ticks beyond which the curve is broken, s.
const GAP: f64 = 0.1;

/// One tick of the curve.
#[derive(Debug, Clone, Copy)]
struct Moment {
    time: f64,
    depth: f64,
    place: [f64; 3],
    force: Vec3,
    axial: f64,
    tissue_force: f64,
    /// Number of gaps before it.
    n_gaps: u32,
}

/// The ticks of a stretch of time in which force and depth are least and largest.
#[derive(Debug, Clone, Copy)]
struct Stretch {
    /// Least force, largest force, least depth, largest depth.
    ends: [Moment; 4],
}

impl Stretch {
    fn of(moment: Moment) -> Self {
        Self { ends: [moment; 4] }
    }

    fn join(&mut self, other: &Self) {
        let force = |m: &Moment| m.force.norm();
        let [least, most, high, deep] = &mut self.ends;
        let [other_least, other_most, other_high, other_deep] = &other.ends;
        if force(other_least) < force(least) {
            *least = *other_least;
        }
        if force(other_most) > force(most) {
            *most = *other_most;
        }
        if other_high.depth < high.depth {
            *high = *other_high;
        }
        if other_deep.depth > deep.depth {
            *deep = *other_deep;
        }
    }
}

/// Collects moments. When the stretches are as many as they may be, each two of them become one.
#[derive(Debug)]
struct Thinned {
    stretches: Vec<Stretch>,
    /// Moments in a stretch.
    length: usize,
    /// Moments in the last stretch.
    filled: usize,
    first: Option<Moment>,
    last: Option<Moment>,
}

impl Thinned {
    fn new() -> Self {
        Self {
            stretches: Vec::with_capacity(MOST),
            length: 1,
            filled: 1,
            first: None,
            last: None,
        }
    }

    fn add(&mut self, mut moment: Moment) {
        if let Some(last) = self.last {
            let is_gap = moment.time - last.time > GAP;
            moment.n_gaps = last.n_gaps + u32::from(is_gap);
        }
        self.first.get_or_insert(moment);
        self.last = Some(moment);
        let added = Stretch::of(moment);
        match self.stretches.last_mut() {
            Some(stretch) if self.filled < self.length => {
                stretch.join(&added);
                self.filled += 1;
                return;
            }
            _ => {}
        }
        if self.stretches.len() == MOST {
            let pairs = self.stretches.chunks(2);
            self.stretches = pairs
                .map(|pair| {
                    let mut joined = pair[0];
                    pair[1..].iter().for_each(|other| joined.join(other));
                    joined
                })
                .collect();
            self.length *= 2;
        }
        self.stretches.push(added);
        self.filled = 1;
    }

    /// All moments that were kept, in order.
    fn moments(&self) -> Vec<Moment> {
        let ends = self.stretches.iter().flat_map(|stretch| stretch.ends);
        let mut all: Vec<Moment> = ends.chain(self.first).chain(self.last).collect();
        all.sort_by(|a, b| a.time.total_cmp(&b.time));
        all.dedup_by(|a, b| a.time.total_cmp(&b.time).is_eq());
        all
    }
}

/// The course of the first device in a log.
///
/// # Errors
/// When the log cannot be read.
pub(crate) fn curve_of(log: &Path, ruler: &Ruler) -> Result<RecordingCurve, LogError> {
    let mut thinned = Thinned::new();
    let mut now = f64::NAN;
    for row in Rows::open(log)? {
        match row? {
            Row::Tick(tick) => now = tick.now,
            Row::Device(0, device) => {
                // Where the device cannot be read, as after its end, there is no place.
                let Some(felt) = ruler.measure(&device) else {
                    continue;
                };
                thinned.add(Moment {
                    time: now,
                    depth: felt.depth,
                    place: felt.place,
                    force: ruler.in_scene(device.force),
                    axial: Ruler::along(&device),
                    tissue_force: Vec3::from(device.tissue_force).norm(),
                    n_gaps: 0,
                });
            }
            _ => {}
        }
    }
    Ok(drawn(&thinned.moments()))
}

/// The moments as lists, rounded to what can be seen: 0.1 µs, 1 nm and 1 µN.
fn drawn(moments: &[Moment]) -> RecordingCurve {
    let round = |value: f64, to: f64| (value * to).round() / to;
    let lengths = |m: [f64; 3]| m.map(|x| round(x, 1e9));
    let forces = |x: f64| round(x, 1e6);
    let gaps = (moments.windows(2).enumerate())
        .filter(|(_, pair)| pair[1].n_gaps > pair[0].n_gaps)
        .map(|(k, _)| k as u32 + 1);
    RecordingCurve {
        time: moments.iter().map(|m| round(m.time, 1e7)).collect(),
        depth: moments.iter().map(|m| round(m.depth, 1e9)).collect(),
        place: moments.iter().map(|m| lengths(m.place)).collect(),
        force: (moments.iter())
            .map(|m| <[f64; 3]>::from(m.force).map(forces))
            .collect(),
        axial: moments.iter().map(|m| forces(m.axial)).collect(),
        tissue_force: moments.iter().map(|m| forces(m.tissue_force)).collect(),
        gaps: gaps.collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moment(time: f64, force: f64, depth: f64) -> Moment {
        Moment {
            time,
            depth,
            place: [0.0; 3],
            force: Vec3::new(0.0, 0.0, force),
            axial: force,
            tissue_force: force,
            n_gaps: 0,
        }
    }

    #[test]
    fn peaks_of_a_single_tick_stay_and_the_number_of_points_is_bounded() {
        let mut thinned = Thinned::new();
        let n = 600_000;
        for k in 0..n {
            let force = if k == 314_159 {
                7.25
            } else {
                1.0 + 0.1 * f64::from(k % 7)
            };
            let depth = if k == 271_828 { -9e-3 } else { 1e-3 };
            thinned.add(moment(1e-3 * f64::from(k), force, depth));
        }
        let curve = drawn(&thinned.moments());
        assert!(
            curve.time.len() > MOST && curve.time.len() <= 4 * MOST + 2,
            "{}",
            curve.time.len()
        );
        assert!(curve.time.windows(2).all(|pair| pair[0] < pair[1]));
        let peak = curve.force.iter().position(|f| f[2] > 7.0).unwrap();
        assert!((curve.force[peak][2] - 7.25).abs() < 1e-9);
        assert!((curve.time[peak] - 314.159).abs() < 1e-6);
        let high = curve.depth.iter().position(|d| *d < -8e-3).unwrap();
        assert!((curve.time[high] - 271.828).abs() < 1e-6);
        assert!(curve.time[0].abs() < 1e-12 && curve.gaps.is_empty());
        assert!((curve.time.last().unwrap() - 1e-3 * f64::from(n - 1)).abs() < 1e-6);
    }

    #[test]
    fn missing_ticks_break_the_curve() {
        let mut thinned = Thinned::new();
        for k in 0..5000 {
            let pause = if k < 2000 { 0.0 } else { 3.0 };
            thinned.add(moment(1e-3 * f64::from(k) + pause, 1.0, 0.0));
        }
        let curve = drawn(&thinned.moments());
        let [gap] = curve.gaps[..] else {
            panic!("{:?}", curve.gaps)
        };
        let gap = gap as usize;
        assert!(curve.time[gap - 1] < 2.0 && curve.time[gap] >= 5.0);
    }
}
