//! Counts of durations in buckets of fixed relative width. One thread writes, any thread reads.

use std::{
    fmt,
    sync::atomic::{AtomicU64, Ordering},
};

/// Buckets per doubling: the width of a bucket is at most 1/32 of its value.
const SUB: usize = 32;
const SUB_BITS: u32 = SUB.trailing_zeros();
/// Doublings past the linear part: the last bucket ends at 2⁴² ns, more than an hour.
const DOUBLINGS: usize = 37;
const N_BUCKETS: usize = SUB * (DOUBLINGS + 1);

/// A log-linear histogram of durations, s, counted in nanoseconds, with a resolution of 3 %.
///
/// [`Histogram::add`] neither allocates nor waits, and only one thread may call it; others may read
/// meanwhile.
pub struct Histogram {
    buckets: Box<[AtomicU64]>,
    count: AtomicU64,
    /// Largest value, ns.
    max: AtomicU64,
    /// Sum of values, ns.
    sum: AtomicU64,
}

/// Summary of a histogram; durations in seconds. All zero if the histogram is empty.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Quantiles {
    /// Number of values.
    pub count: u64,
    /// Mean.
    pub mean: f64,
    /// Median.
    pub p50: f64,
    /// 99 of 100 values are below.
    pub p99: f64,
    /// 999 of 1000 values are below.
    pub p999: f64,
    /// The largest value, exact.
    pub max: f64,
}

impl Histogram {
    /// An empty histogram with all its memory allocated.
    pub fn new() -> Self {
        Self {
            buckets: (0..N_BUCKETS).map(|_| AtomicU64::new(0)).collect(),
            count: AtomicU64::new(0),
            max: AtomicU64::new(0),
            sum: AtomicU64::new(0),
        }
    }

    /// Counts a duration, s; negative ones and NaN count as zero.
    #[inline]
    pub fn add(&self, seconds: f64) {
        let ns = (seconds * 1e9) as u64; // saturates, and NaN becomes 0
        // There is one writer, so plain loads and stores suffice, without the cost of an atomic
        // addition.
        let bump = |cell: &AtomicU64, by: u64| {
            cell.store(
                cell.load(Ordering::Relaxed).wrapping_add(by),
                Ordering::Relaxed,
            );
        };
        if let Some(bucket) = self.buckets.get(bucket_of(ns)) {
            bump(bucket, 1);
        }
        bump(&self.count, 1);
        bump(&self.sum, ns);
        if ns > self.max.load(Ordering::Relaxed) {
            self.max.store(ns, Ordering::Relaxed);
        }
    }

    /// Number of values counted.
    pub fn count(&self) -> u64 {
        self.count.load(Ordering::Relaxed)
    }

    /// The quantile for `q` from 0 to 1, s: the upper end of its bucket, at most the maximum.
    pub fn quantile(&self, q: f64) -> f64 {
        let counts: Vec<u64> = self
            .buckets
            .iter()
            .map(|b| b.load(Ordering::Relaxed))
            .collect();
        let total: u64 = counts.iter().sum();
        let rank = ((q.clamp(0.0, 1.0) * total as f64).ceil() as u64).max(1);
        let mut seen = 0;
        for (bucket, count) in counts.iter().enumerate() {
            seen += count;
            if seen >= rank {
                return (upper_end(bucket) as f64 * 1e-9).min(self.max());
            }
        }
        self.max()
    }

    /// The largest duration, s.
    pub fn max(&self) -> f64 {
        self.max.load(Ordering::Relaxed) as f64 * 1e-9
    }

    /// The usual quantiles.
    pub fn quantiles(&self) -> Quantiles {
        let count = self.count();
        Quantiles {
            count,
            mean: self.sum.load(Ordering::Relaxed) as f64 * 1e-9 / (count.max(1) as f64),
            p50: self.quantile(0.5),
            p99: self.quantile(0.99),
            p999: self.quantile(0.999),
            max: self.max(),
        }
    }

    /// Filled buckets in order: lower end, upper end (s) and count. For plots.
    pub fn filled(&self) -> Vec<(f64, f64, u64)> {
        let lower = |b: usize| if b == 0 { 0 } else { upper_end(b - 1) };
        (self.buckets.iter().enumerate())
            .map(|(b, n)| (b, n.load(Ordering::Relaxed)))
            .filter(|(_, n)| *n > 0)
            .map(|(b, n)| (lower(b) as f64 * 1e-9, upper_end(b) as f64 * 1e-9, n))
            .collect()
    }
}

impl Default for Histogram {
    fn default() -> Self {
        Self::new()
    }
}

impl fmt::Debug for Histogram {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.quantiles().fmt(f)
    }
}

/// Values below 32 ns have a bucket each; from there on 32 per doubling.
fn bucket_of(ns: u64) -> usize {
    if ns < SUB as u64 {
        return ns as usize;
    }
    let shift = ns.ilog2() - SUB_BITS;
    let bucket = SUB * (shift as usize + 1) + ((ns >> shift) as usize - SUB);
    bucket.min(N_BUCKETS - 1)
}

fn upper_end(bucket: usize) -> u64 {
    if bucket < SUB {
        return bucket as u64 + 1;
    }
    let shift = bucket / SUB - 1;
    ((bucket % SUB + SUB + 1) as u64) << shift
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_lies_in_its_bucket() {
        for ns in (0..5000).chain([123_456, 1_000_000, 999_999_999, 1 << 40]) {
            let b = bucket_of(ns);
            assert!(ns < upper_end(b), "{ns} in {b}");
            assert!(b == 0 || ns >= upper_end(b - 1), "{ns} in {b}");
        }
    }

    #[test]
    fn quantiles_of_a_ramp_are_within_three_percent() {
        let h = Histogram::new();
        for k in 1..=10_000 {
            h.add(f64::from(k) * 1e-7);
        }
        let q = h.quantiles();
        for (got, want) in [
            (q.p50, 5e-4),
            (q.p99, 9.9e-4),
            (q.p999, 9.99e-4),
            (q.max, 1e-3),
        ] {
            assert!((got / want - 1.0).abs() < 0.032, "{got} for {want}");
        }
        assert!((q.mean / 5.0005e-4 - 1.0).abs() < 1e-3);
        assert_eq!(h.filled().iter().map(|f| f.2).sum::<u64>(), 10_000);
    }

    #[test]
    fn odd_values_are_counted_too() {
        let h = Histogram::new();
        for v in [f64::NAN, -1.0, f64::INFINITY, 0.0] {
            h.add(v);
        }
        assert_eq!(h.count(), 4);
        assert_eq!(Histogram::new().quantiles(), Quantiles::default());
    }
}
