//! The pictures of a run.

use palpa_rt::Log;

use super::figures::Figures;
use crate::plot::{Axis, Chart, Guide, Picture, Series, panels};

/// Most points of a curve: more than there are pixels.
const MOST_POINTS: usize = 6000;
/// Buckets of a histogram in a doubling of time.
const PER_DOUBLING: f64 = 4.0;

/// Histograms of a tick's CPU time and of its lateness.
pub(super) fn times(figures: &Figures) -> Picture {
    let chart = |title: &str, label: &str, filled: &[(f64, f64, u64)]| {
        Chart::new(Axis::log(label), Axis::log("ticks"))
            .title(title)
            .series(Series::new("", steps(filled)))
    };
    let cpu = chart(
        "compute",
        "thread-CPU time of a tick [µs]",
        &figures.cpu_histogram,
    )
    .guide(Guide::x(200.0, "200 µs"));
    let late = chart(
        "wake-up",
        "lateness of a tick, wall time [µs]",
        &figures.lateness_histogram,
    )
    .guide(Guide::x(1000.0, "a period"));
    panels("Ticks of the 1 kHz loop", &[cpu, late], 2)
}

/// The outline of a histogram, in µs and ticks; empty buckets count as a tenth of a tick, which a logarithm can show.
fn steps(filled: &[(f64, f64, u64)]) -> Vec<[f64; 2]> {
    let bucket = |seconds: f64| ((seconds * 1e6).max(0.01).log2() * PER_DOUBLING).floor() as i32;
    let mut counts = std::collections::BTreeMap::new();
    for &(lower, upper, n) in filled {
        *counts.entry(bucket(0.5 * (lower + upper))).or_insert(0_u64) += n;
    }
    let (Some((&first, _)), Some((&last, _))) = (counts.first_key_value(), counts.last_key_value())
    else {
        return Vec::new();
    };
    let edge = |b: i32| (f64::from(b) / PER_DOUBLING).exp2();
    let mut points = vec![[edge(first), 0.5]];
    for b in first..=last {
        let n = counts.get(&b).map_or(0.5, |n| *n as f64);
        points.extend([[edge(b), n], [edge(b + 1), n]]);
    }
    points.push([edge(last + 1), 0.5]);
    points
}

/// Force and depth against time.
pub(super) fn forces(log: &Log) -> Picture {
    let force = Chart::new(Axis::linear("time [s]"), Axis::linear("force [N]"))
        .title("force on the hand")
        .line("along the press", curve(log, |d| d.force[2]))
        .line("across", curve(log, |d| d.force[0].hypot(d.force[1])));
    let place = Chart::new(
        Axis::linear("time [s]"),
        Axis::linear("height of the tool [mm]"),
    )
    .title("the tool's tip")
    .line("height", curve(log, |d| d.position[2] * 1e3));
    panels("Force while moving", &[force, place], 1)
}

/// Force against depth.
pub(super) fn depth(log: &Log) -> Picture {
    let points = thinned(log)
        .map(|t| [-t.devices[0].position[2] * 1e3, t.devices[0].force[2]])
        .collect();
    Chart::new(
        Axis::linear("depth below the start [mm]"),
        Axis::linear("force along the press [N]"),
    )
    .title("Force against depth")
    .line("", points)
    .draw()
}

fn curve(log: &Log, value: impl Fn(&palpa_rt::DeviceRecord) -> f64) -> Vec<[f64; 2]> {
    thinned(log)
        .map(|t| [t.tick.now, value(&t.devices[0])])
        .collect()
}

fn thinned(log: &Log) -> impl Iterator<Item = &palpa_rt::TickEntry> {
    let step = (log.ticks.len() / MOST_POINTS).max(1);
    log.ticks
        .iter()
        .step_by(step)
        .filter(|t| t.devices[0].is_there)
}
