//! Axes: they map values to places and choose the ticks.

/// One axis of a chart.
#[derive(Debug, Clone)]
pub struct Axis {
    pub(super) label: String,
    is_log: bool,
    range: Option<[f64; 2]>,
    includes_zero: bool,
}

impl Axis {
    /// A linear axis over the range of the data. Write the unit into the label: `force [N]`.
    pub fn linear(label: impl Into<String>) -> Self {
        Self {
            label: label.into(),
            is_log: false,
            range: None,
            includes_zero: false,
        }
    }

    /// A decimal logarithmic axis. The chart leaves out values that are not positive.
    pub fn log(label: impl Into<String>) -> Self {
        Self {
            is_log: true,
            ..Self::linear(label)
        }
    }

    /// Shows exactly this range instead of the range of the data.
    #[must_use]
    pub fn with_range(mut self, from: f64, to: f64) -> Self {
        self.range = Some([from, to]);
        self
    }

    /// Always includes 0 in the range (linear axes only).
    #[must_use]
    pub fn with_zero(mut self) -> Self {
        self.includes_zero = true;
        self
    }

    /// Whether this axis can show a value.
    pub(super) fn shows(&self, value: f64) -> bool {
        value.is_finite() && (!self.is_log || value > 0.0)
    }

    /// Fits the axis to data. If `is_loose`, the range is widened to whole ticks.
    pub(super) fn fit(
        &self,
        values: impl Iterator<Item = f64>,
        n_ticks: f64,
        is_loose: bool,
    ) -> Fit {
        let [mut lo, mut hi] = self.range.unwrap_or_else(|| {
            values
                .filter(|&v| self.shows(v))
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], v| {
                    [lo.min(v), hi.max(v)]
                })
        });
        if lo > hi {
            [lo, hi] = [0.0, 1.0];
        }
        if self.is_log {
            let lo = if lo > 0.0 { lo } else { hi * 1e-3 };
            return Fit::log(lo, hi.max(lo));
        }
        if self.includes_zero {
            [lo, hi] = [lo.min(0.0), hi.max(0.0)];
        }
        let widen = is_loose && self.range.is_none();
        Fit::linear(lo, hi, n_ticks, widen)
    }
}

/// An axis fitted to data.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    lo: f64,
    hi: f64,
    is_log: bool,
    /// Value and label of each tick.
    pub(super) ticks: Vec<(f64, String)>,
    /// Values of fainter grid lines (logarithmic axes).
    pub(super) minor: Vec<f64>,
    /// The common power of ten of all tick labels: a value is its label times 10 to this power. 0
    /// for no common power.
    pub(super) exponent: i32,
}

impl Fit {
    /// Position of `value` between the ends of the axis: 0 to 1 inside the range.
    pub(super) fn place(&self, value: f64) -> f64 {
        if self.is_log {
            (value / self.lo).ln() / (self.hi / self.lo).ln()
        } else {
            (value - self.lo) / (self.hi - self.lo)
        }
    }

    fn linear(mut lo: f64, mut hi: f64, n_ticks: f64, widen: bool) -> Self {
        // Constant data get room on both sides. A range below the rounding error counts as
        // constant.
        let size = lo.abs().max(hi.abs());
        if hi - lo <= 1e-12 * size || hi <= lo {
            let room = if size > 0.0 { 0.1 * size } else { 1.0 };
            [lo, hi] = [lo - room, hi + room];
        }
        let step = round_step((hi - lo) / n_ticks);
        if widen {
            // Half a percent of slack: a curve that ends at 1.001 does not need another tick at
            // 1.2.
            let slack = 0.005 * (hi - lo) / step;
            lo = (lo / step + slack).floor() * step;
            hi = (hi / step - slack).ceil() * step;
        }
        let exponent = shared_exponent(lo.abs().max(hi.abs()));
        let unit = 10.0_f64.powi(exponent);
        let decimals = -(((step / unit).log10() + 1e-9).floor() as i32);
        let first = (lo / step - 1e-6).ceil();
        let ticks = (0..100)
            .map(|i| (first + f64::from(i)) * step)
            .take_while(|value| *value <= hi + 1e-6 * step)
            .map(|value| (value, number(value / unit, decimals)))
            .collect();
        Self {
            lo,
            hi,
            is_log: false,
            ticks,
            minor: Vec::new(),
            exponent,
        }
    }

    fn log(lo: f64, hi: f64) -> Self {
        // The range covers at least a factor of 4, so that it contains a tick at 1, 2 or 5.
        let room = (4.0 * lo / hi).sqrt().max(1.0);
        let [lo, hi] = [lo / room, hi * room];
        let first = lo.log10().floor() as i32;
        let last = hi.log10().ceil() as i32;
        let is_short = hi / lo < 50.0;
        let (lo, hi) = if is_short {
            (lo * 0.9, hi * 1.1)
        } else {
            (lo * 0.8, hi * 1.25)
        };
        // If there are many decades, only every second or third has a label.
        let stride = ((last - first) / 8 + 1).max(1);
        let mut ticks = Vec::new();
        let mut minor = Vec::new();
        for decade in first - 1..=last {
            for digit in 1..10 {
                let value = f64::from(digit) * 10.0_f64.powi(decade);
                if value < lo || value > hi {
                    continue;
                }
                let is_tick = match digit {
                    1 => (decade - first).rem_euclid(stride) == 0,
                    2 | 5 => is_short,
                    _ => false,
                };
                if is_tick {
                    ticks.push((value, log_label(f64::from(digit), decade)));
                } else if stride < 3 {
                    minor.push(value);
                }
            }
        }
        Self {
            lo,
            hi,
            is_log: true,
            ticks,
            minor,
            exponent: 0,
        }
    }
}

/// The smallest step of 1, 2 or 5 times a power of ten that is at least `rough`.
fn round_step(rough: f64) -> f64 {
    let power = 10.0_f64.powf(rough.log10().floor());
    let factor = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .find(|f| f * power >= rough * (1.0 - 1e-9))
        .unwrap_or(10.0);
    factor * power
}

/// The common exponent of the labels: a multiple of 3 for very large or small numbers, else 0.
fn shared_exponent(size: f64) -> i32 {
    let exponent = size.log10().floor() as i32;
    if (-2..5).contains(&exponent) {
        0
    } else {
        exponent.div_euclid(3) * 3
    }
}

fn log_label(digit: f64, decade: i32) -> String {
    if (-3..5).contains(&decade) {
        number(digit * 10.0_f64.powi(decade), -decade)
    } else if digit > 1.0 {
        format!("{digit}·{}", power_of_ten(decade))
    } else {
        power_of_ten(decade)
    }
}

/// The text `10` with a superscript exponent.
pub(super) fn power_of_ten(exponent: i32) -> String {
    const RAISED: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let digits = exponent.to_string();
    let raised = digits
        .chars()
        .map(|c| c.to_digit(10).map_or('⁻', |digit| RAISED[digit as usize]));
    "10".chars().chain(raised).collect()
}

/// A number with a typographic minus sign; zero has no sign.
fn number(value: f64, decimals: i32) -> String {
    let decimals = decimals.max(0).unsigned_abs() as usize;
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(size) if size.chars().all(|c| c == '0' || c == '.') => size.to_owned(),
        Some(size) => format!("−{size}"),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(fit: &Fit) -> Vec<&str> {
        fit.ticks.iter().map(|(_, label)| label.as_str()).collect()
    }

    #[test]
    fn ticks_are_round_numbers_and_cover_the_data() {
        let axis = Axis::linear("x");
        let fit = axis.fit([0.0, 7.9].into_iter(), 6.0, true);
        assert_eq!(labels(&fit), ["0", "2", "4", "6", "8"]);
        assert!((fit.place(4.0) - 0.5).abs() < 1e-12);
        let fit = axis.fit([-0.13, 0.31].into_iter(), 6.0, true);
        assert_eq!(
            labels(&fit),
            ["−0.2", "−0.1", "0.0", "0.1", "0.2", "0.3", "0.4"]
        );
    }

    #[test]
    fn small_numbers_share_a_power_of_ten() {
        let fit = Axis::linear("F").fit([0.0, 8.1e-5].into_iter(), 5.0, true);
        assert_eq!(fit.exponent, -6);
        assert_eq!(labels(&fit), ["0", "20", "40", "60", "80", "100"]);
        assert_eq!(power_of_ten(-6), "10⁻⁶");
        assert_eq!(power_of_ten(145), "10¹⁴⁵");
    }

    #[test]
    fn decades_of_a_logarithmic_axis() {
        let fit = Axis::log("n").fit([27.0, 16_000.0, -1.0].into_iter(), 6.0, true);
        assert_eq!(labels(&fit), ["100", "1000", "10000"]);
        let fit = Axis::log("n").fit([1e-9, 1e-2].into_iter(), 6.0, true);
        assert_eq!(labels(&fit)[..2], ["10⁻⁹", "10⁻⁸"]);
    }

    #[test]
    fn constant_empty_and_unbounded_data_have_an_axis() {
        for data in [
            vec![],
            vec![3.0],
            vec![0.0, 0.0],
            vec![f64::NAN, f64::INFINITY],
            vec![1e300, -1e300],
        ] {
            for axis in [
                Axis::linear("x"),
                Axis::log("x"),
                Axis::linear("x").with_zero(),
            ] {
                let fit = axis.fit(data.iter().copied(), 6.0, true);
                assert!(fit.lo < fit.hi, "{data:?}: {fit:?}");
                assert!(
                    !fit.ticks.is_empty() && fit.ticks.len() < 30,
                    "{data:?}: {fit:?}"
                );
            }
        }
    }
}
