//! Amplitude spectrum of the force in the last second.

use palpa_rt::LateTick;
use palpa_viewer::control::Spectrum;
use std::f64::consts::TAU;

/// Number of samples, a power of two.
const N: usize = 1024;
/// Period of the loop, s.
const PERIOD: f64 = 1e-3;
/// Amplitudes are rounded to this, N.
const ROUND: f64 = 1e-9;

/// The spectrum of the newest ticks; `None` if there are less than a second of them.
///
/// A tick that came late or not at all is replaced by a straight line between its neighbours, so that the
/// samples are even.
pub(crate) fn spectrum(ticks: &[LateTick]) -> Option<Spectrum> {
    let last = ticks.last()?.now;
    let first = last - (N - 1) as f64 * PERIOD;
    if ticks.first()?.now > first {
        return None;
    }
    let samples = even(ticks, first)?;
    let mut squares = vec![0.0; N / 2 + 1];
    for axis in 0..3 {
        let mut re: Vec<f64> = samples.iter().map(|force| force[axis]).collect();
        // Weighted by the window, so that a vibration does not leak into the lowest amplitudes.
        let weighted = re.iter().enumerate().map(|(k, value)| hann(k) * value);
        let mean = weighted.sum::<f64>() / (0.5 * N as f64);
        for (k, value) in re.iter_mut().enumerate() {
            *value = (*value - mean) * hann(k);
        }
        let mut im = vec![0.0; N];
        transform(&mut re, &mut im);
        for (k, square) in squares.iter_mut().enumerate() {
            *square += re[k] * re[k] + im[k] * im[k];
        }
    }
    // The mean of Hann's window is a half, and a vibration shares its amplitude with its mirror image.
    let scale = 2.0 / (0.5 * N as f64);
    let rounded = |square: f64| (scale * square.sqrt() / ROUND).round() * ROUND;
    Some(Spectrum {
        time: last,
        step: 1.0 / (N as f64 * PERIOD),
        amplitude: squares.into_iter().map(rounded).collect(),
    })
}

/// The force at `first`, `first + PERIOD`, …; `None` if a value is not finite.
fn even(ticks: &[LateTick], first: f64) -> Option<Vec<[f64; 3]>> {
    let mut after = 0;
    (0..N)
        .map(|k| {
            let at = first + k as f64 * PERIOD;
            while ticks[after].now < at && after + 1 < ticks.len() {
                after += 1;
            }
            let (a, b) = (&ticks[after.saturating_sub(1)], &ticks[after]);
            let span = b.now - a.now;
            let share = if span > 0.0 {
                ((at - a.now) / span).clamp(0.0, 1.0)
            } else {
                1.0
            };
            let force: [f64; 3] =
                std::array::from_fn(|i| a.force[i] + share * (b.force[i] - a.force[i]));
            force.iter().all(|f| f.is_finite()).then_some(force)
        })
        .collect()
}

fn hann(k: usize) -> f64 {
    0.5 - 0.5 * (TAU * k as f64 / N as f64).cos()
}

/// Fourier transform in place, by decimation in time. The length is a power of two.
fn transform(re: &mut [f64], im: &mut [f64]) {
    let n = re.len();
    let bits = n.trailing_zeros();
    for i in 0..n {
        let j = i.reverse_bits() >> (usize::BITS - bits);
        if i < j {
            re.swap(i, j);
            im.swap(i, j);
        }
    }
    let mut half = 1;
    while half < n {
        for k in 0..half {
            let (sin, cos) = (-TAU * k as f64 / (2 * half) as f64).sin_cos();
            for a in (k..n).step_by(2 * half) {
                let b = a + half;
                let turned = (cos * re[b] - sin * im[b], sin * re[b] + cos * im[b]);
                (re[b], im[b]) = (re[a] - turned.0, im[a] - turned.1);
                re[a] += turned.0;
                im[a] += turned.1;
            }
        }
        half *= 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ticks(force: impl Fn(f64) -> [f64; 3]) -> Vec<LateTick> {
        (0..1500)
            .map(|k| {
                let now = 3.0 + f64::from(k) * PERIOD;
                LateTick {
                    now,
                    force: force(now),
                    ..LateTick::default()
                }
            })
            .collect()
    }

    #[test]
    fn a_vibration_has_its_amplitude_at_its_frequency() {
        // Between two frequencies of the spectrum, Hann's window loses at most 15 %.
        for (frequency, least) in [(125.0, 0.999), (250.488_281_25, 0.84), (40.0, 0.9)] {
            let all = ticks(|t| {
                let wave = (TAU * frequency * t).sin();
                [0.006 * wave, 2.0 + 0.008 * wave, -1.0]
            });
            let found = spectrum(&all).unwrap();
            let (peak, amplitude) = (found.amplitude.iter().copied().enumerate())
                .max_by(|a, b| a.1.total_cmp(&b.1))
                .unwrap();
            assert!((peak as f64 * found.step - frequency).abs() <= 0.5 * found.step + 1e-9);
            assert!(
                (least..1.001).contains(&(amplitude / 0.01)),
                "{frequency}: {amplitude}"
            );
            // Far from it there is nothing.
            let far = (found.amplitude.iter().enumerate())
                .filter(|(k, _)| k.abs_diff(peak) > 60)
                .map(|(_, a)| *a)
                .fold(0.0, f64::max);
            assert!(far < 1e-6, "{far}");
        }
    }

    #[test]
    fn missing_ticks_are_bridged_and_short_or_broken_ones_have_no_spectrum() {
        let slow = |t: f64| [(TAU * 3.0 * t).sin(), 0.0, 0.0];
        let mut all = ticks(slow);
        let whole = spectrum(&all).unwrap();
        all.drain(900..905);
        let bridged = spectrum(&all).unwrap();
        let same = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-3;
        assert!(whole.amplitude.iter().zip(&bridged.amplitude).all(same));
        assert!(spectrum(&all[..1000]).is_none() && spectrum(&[]).is_none());
        all[1200].force[1] = f64::NAN;
        assert!(spectrum(&all).is_none());
    }
}
