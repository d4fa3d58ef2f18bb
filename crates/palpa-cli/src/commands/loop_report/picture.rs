//! The plots of a run.

use palpa_rt::{Log, StepStatus, TickEntry};
use palpa_servo::{Faults, Vec3};

use super::audit::OnWay;
use super::bars::BarFigures;
use super::figures::Figures;
use palpa_plot::{Axis, Band, Chart, Color, Guide, PALETTE, Picture, Series, panels};

/// Largest number of points of a curve: more than there are pixels.
const MOST_POINTS: usize = 6000;
/// Buckets of a histogram per doubling of time.
const PER_DOUBLING: f64 = 4.0;
/// Colour of secondary curves.
const FAINT: Color = Color::rgb(0xc4, 0xc8, 0xcc);

/// Histograms of a tick's CPU time and of its lateness.
pub(super) fn times(figures: &Figures) -> Picture {
    // The time axis includes the guide, µs, to show the distance to it.
    let chart = |title: &str, label: &str, filled: &[(f64, f64, u64)], guide: f64| {
        let points = steps(filled);
        let ends = points.iter().map(|p| p[0]);
        let (low, high) = ends.fold((guide / 2.0, 1.3 * guide), |(low, high), x| {
            (low.min(x), high.max(x))
        });
        Chart::new(Axis::log(label).with_range(low, high), Axis::log("ticks"))
            .title(title)
            .series(Series::new("", points))
    };
    let cpu = chart(
        "compute",
        "thread-CPU time of a tick [µs]",
        &figures.cpu_histogram,
        200.0,
    )
    .guide(Guide::x(200.0, "at most"));
    let late = chart(
        "wake-up",
        "lateness of a tick, wall time [µs]",
        &figures.lateness_histogram,
        1000.0,
    )
    .guide(Guide::x(1000.0, "a period"));
    panels("Ticks of the 1 kHz loop", &[cpu, late], 2)
}

/// The outline of a histogram, in µs and ticks. Empty buckets count as a tenth of a tick, so that a
/// logarithmic axis can show them.
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

/// Plots force and height against time. Shaded where the tissue was behind the tool or gave no
/// force. Error bars stand where they were computed.
pub(super) fn forces(log: &Log, bars: &[BarFigures], subtitle: &str) -> Picture {
    let missing = missing(log);
    let legend = if missing.is_empty() {
        ""
    } else {
        "; grey: the tissue was behind the tool, or there was no force"
    };
    let force = Chart::new(Axis::linear("time [s]"), Axis::linear("force [N]"))
        .title("Force on the hand")
        .subtitle(format!("{subtitle}{legend}"))
        .line("along the press", curve(log, |d| d.force[2]))
        .line("across", curve(log, |d| d.force[0].hypot(d.force[1])));
    let force = with_bars(force, bars, |bar| bar.time_s);
    let force = missing.into_iter().fold(force, |chart, [from, to]| {
        chart.band(Band::x(from, to, "", FAINT))
    });
    let place = Chart::new(
        Axis::linear("time [s]"),
        Axis::linear("height of the tool [mm]"),
    )
    .title("The tool's tip")
    .line("height", curve(log, |d| d.position[2] * 1e3));
    panels("Force while moving", &[force, place], 1)
}

/// Time spans, s, in which the patch belonged to a place that the tool had left, or was stale.
fn missing(log: &Log) -> Vec<[f64; 2]> {
    /// Spans closer together than this are merged, s.
    const GAP: f64 = 0.05;
    let behind = log
        .steps
        .iter()
        .filter(|s| s.n_contacts > 0 && s.status >= StepStatus::Behind as u8);
    let behind = behind.map(|s| [s.now, s.now + s.wall]);
    let stale = log.ticks.iter().filter(|t| {
        let bits = u16::try_from(t.tick.faults).unwrap_or(0);
        Faults::from_bits(bits).contains(Faults::STALE_PATCH)
    });
    let mut times: Vec<[f64; 2]> = behind
        .chain(stale.map(|t| [t.tick.now, t.tick.now + log.header.period]))
        .collect();
    times.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut merged: Vec<[f64; 2]> = Vec::new();
    for [from, to] in times {
        match merged.last_mut() {
            Some(last) if from <= last[1] + GAP => last[1] = last[1].max(to),
            _ => merged.push([from, to]),
        }
    }
    merged
}

/// Plots force against depth below the first touch, which is `above` (m) under the device's origin.
pub(super) fn depth(log: &Log, bars: &[BarFigures], above: f64, subtitle: &str) -> Picture {
    let point = |t: &TickEntry| {
        let device = &t.devices[0];
        [(-device.position[2] - above) * 1e3, device.force[2]]
    };
    let entries: Vec<&TickEntry> = thinned(log).collect();
    let is_off = |t: &&TickEntry| t.devices[0].force[2] == 0.0;
    let last = entries.iter().rposition(is_off).unwrap_or(0);
    let points = |of: &[&TickEntry]| of.iter().map(|t| point(t)).collect();
    let chart = Chart::new(
        Axis::linear("depth below the first touch [mm]"),
        Axis::linear("force along the press [N]"),
    )
    .title("Force against depth")
    .subtitle(subtitle)
    .series(Series::new("on the way", points(&entries[..last])).with_color(FAINT))
    .line("the last press", points(&entries[last..]));
    with_bars(chart, bars, |bar| bar.depth_mm).draw()
}

/// Plots force against place along the way across the skin: against the motion, and out of the skin.
/// With friction the first is a loop, as wide as twice the friction. Beside them the static forces of
/// the ways that were gone again.
pub(super) fn across(log: &Log, along: &Vec3, ways: &[Vec<OnWay>], subtitle: &str) -> Picture {
    let out = Vec3::z();
    let chart = |title: &str, direction: &Vec3| {
        let value = |force: [f64; 3]| Vec3::from(force).dot(direction);
        let felt = thinned(log).map(|t| {
            let device = &t.devices[0];
            let is_felt = device.force.iter().any(|f| *f != 0.0);
            // A point that is not finite is a gap.
            let force = if is_felt {
                value(device.force)
            } else {
                f64::NAN
            };
            [1e3 * Vec3::from(device.position).dot(along), force]
        });
        let chart = Chart::new(
            Axis::linear("place along the way [mm]"),
            Axis::linear("force [N]"),
        )
        .title(title)
        .subtitle(subtitle)
        .line("felt at 1 kHz", felt.collect());
        let points = ways.iter().flatten().map(|stop| {
            let at = Vec3::from(stop.position_mm).dot(along);
            [at, value(stop.static_n)]
        });
        let points: Vec<[f64; 2]> = points.collect();
        if points.is_empty() {
            return chart;
        }
        let name = "the same way in static steps, on a finer mesh";
        chart.series(Series::new(name, points).only_markers())
    };
    let charts = [
        chart("Force along the way", along),
        chart("Force out of the skin", &out),
    ];
    panels("Force across the skin", &charts, 1)
}

/// Adds the static forces with their error bars.
fn with_bars(chart: Chart, bars: &[BarFigures], x: impl Fn(&BarFigures) -> f64) -> Chart {
    let known = || (bars.iter()).filter_map(|bar| Some((x(bar), bar.static_n?, bar.error_bar_n?)));
    let forces: Vec<[f64; 2]> = known().map(|(x, force, _)| [x, force]).collect();
    if forces.is_empty() {
        return chart;
    }
    // A point that is not finite is a gap between two bars.
    let ends =
        known().flat_map(|(x, force, half)| [[x, force - half], [x, force + half], [f64::NAN; 2]]);
    let color = PALETTE[7 % PALETTE.len()];
    let name = "static force on the same mesh, with its error bar";
    chart
        .series(Series::new("", ends.collect()).with_color(color))
        .series(Series::new(name, forces).only_markers().with_color(color))
}

fn curve(log: &Log, value: impl Fn(&palpa_rt::DeviceRecord) -> f64) -> Vec<[f64; 2]> {
    thinned(log)
        .map(|t| [t.tick.now, value(&t.devices[0])])
        .collect()
}

fn thinned(log: &Log) -> impl Iterator<Item = &TickEntry> {
    let step = (log.ticks.len() / MOST_POINTS).max(1);
    log.ticks
        .iter()
        .step_by(step)
        .filter(|t| t.devices[0].is_there)
}
