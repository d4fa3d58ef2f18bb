//! When the target of the simulated hand stands still.

use palpa_device::Path;

/// Time between two positions of the target that are compared, s.
const STEP: f64 = 1e-3;
/// The target stands still if it moves no farther in a [`STEP`], m. Slower is no motion of a hand.
const STILL: f64 = 1e-7;

/// Spans of the path's time, s, up to `until`, in which the target stands still.
pub(super) fn still_spans(path: &Path, until: f64) -> Vec<[f64; 2]> {
    let mut spans: Vec<[f64; 2]> = Vec::new();
    let mut last = path.at(0.0);
    for n in 1..=(until / STEP).floor() as usize {
        let time = n as f64 * STEP;
        let now = path.at(time);
        if (now - last).norm() <= STILL {
            match spans.last_mut() {
                Some([_, to]) if time - *to < 1.5 * STEP => *to = time,
                _ => spans.push([time - STEP, time]),
            }
        }
        last = now;
    }
    spans
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpa_device::Vec3;

    #[test]
    fn a_hand_is_still_where_its_target_is() {
        let path = Path::from(Vec3::zeros())
            .hold(0.5)
            .to_in(Vec3::z(), 1.0)
            .hold(2.0)
            .to_in(Vec3::zeros(), 1.0);
        let spans = still_spans(&path, 10.0);
        let close = |[from, to]: [f64; 2], want: [f64; 2]| {
            (from - want[0]).abs() < 0.01 && (to - want[1]).abs() < 0.01
        };
        assert_eq!(spans.len(), 3, "{spans:?}");
        assert!(close(spans[0], [0.0, 0.5]), "{spans:?}");
        assert!(close(spans[1], [1.5, 3.5]), "{spans:?}");
        assert!(close(spans[2], [4.5, 10.0]), "{spans:?}");
        let trembling = path.with_wave(Vec3::x() * 1e-3, 9.0, 0.0, 0.0, 10.0);
        assert_eq!(still_spans(&trembling, 9.9).len(), 0);
    }
}
