//! `palpa z-width`: how stiff and how damped a wall each simulated device can render without rattling.

use palpa_device::{DeviceModel, Grip, z_width};
use serde::Serialize;

use super::Outcome;
use crate::cli::Context;
use crate::table::Table;
use palpa_plot::{Axis, Chart, Guide, PALETTE, Picture, Series, panels};

/// Names of the devices.
const DEVICES: [&str; 4] = ["falcon", "touch", "inverse3", "ideal"];
/// The hands that hold the devices.
const GRIPS: [(&str, Grip); 3] = [
    ("soft", Grip::SOFT),
    ("medium", Grip::MEDIUM),
    ("stiff", Grip::STIFF),
];
/// Least and largest stiffness that is tried, N/m, and the factor from one to the next.
const SOFTEST: f64 = 50.0;
const STIFFEST: f64 = 51_200.0;
const FACTOR: f64 = std::f64::consts::SQRT_2;
/// The border is then halved so often: to 2 %.
const HALVINGS: usize = 4;
/// Dampings that are tried: from none, in shares of the largest that the law asks of the device.
const DAMPING_SHARES: [f64; 9] = [0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0];

/// Find the stable range of stiffness and damping of each simulated device
///
/// A wall of one spring and a damper is pressed by 3 mm with the coupling off, in simulated time, for each device in each
/// hand; stable is where the force between 20 and 400 Hz stays below 0.02 N over two seconds with the hand's target still.
/// For each damping the largest stiffness is given up to which all that were tried are stable, without and with the energy
/// observer. Writes a table, the figures and the picture (CSV, JSON, SVG and PNG).
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Only this device; may be repeated [default: all]
    #[arg(long = "device", value_name = "NAME", value_parser = DEVICES)]
    devices: Vec<String>,
    /// Only in this hand; may be repeated [default: all]
    #[arg(long = "grip", value_name = "NAME", value_parser = ["soft", "medium", "stiff"])]
    grips: Vec<String>,
}

/// What is written to `z_width.json`.
#[derive(Debug, Serialize)]
struct Found {
    /// Whether it was not interrupted.
    is_complete: bool,
    rows: Vec<Row>,
}

/// The largest stable stiffness at one damping.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
struct Row {
    device: &'static str,
    grip: &'static str,
    /// Whether the energy observer injects damping, as in use.
    has_observer: bool,
    /// Damping that the wall has. N s/m
    damping: f64,
    /// All walls that were tried up to this are stable; 0 if none is. N/m
    stiffness: f64,
    /// Whether the stiffest wall that is tried is stable, too.
    is_open: bool,
}

/// Runs the command.
///
/// # Errors
/// When a result cannot be written.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<Outcome> {
    let out = context.out_dir()?;
    context.begin_recording();
    let is_asked =
        |asked: &[String], name: &str| asked.is_empty() || asked.iter().any(|a| a == name);
    let devices = DeviceModel::ALL
        .into_iter()
        .filter(|d| is_asked(&args.devices, d.0));
    let grips: Vec<(&'static str, Grip)> = GRIPS
        .into_iter()
        .filter(|g| is_asked(&args.grips, g.0))
        .collect();
    let n_rows = devices.clone().count() * grips.len() * 2 * DAMPING_SHARES.len();
    let bar = context.progress(n_rows, "walls");
    let mut rows = Vec::with_capacity(n_rows);
    'all: for (device, model) in devices {
        for &(grip_name, grip) in &grips {
            for has_observer in [false, true] {
                for share in DAMPING_SHARES {
                    if context.is_interrupted() {
                        break 'all;
                    }
                    let damping = share * model.spec.max_damping;
                    let (stiffness, is_open) = largest(&model, &grip, damping, has_observer);
                    rows.push(Row {
                        device,
                        grip: grip_name,
                        has_observer,
                        damping,
                        stiffness,
                        is_open,
                    });
                    bar.inc(1);
                }
            }
        }
    }
    bar.finish_and_clear();
    let mut csv = out.table::<Row>("z_width.csv")?;
    for row in &rows {
        csv.push(row)?;
    }
    csv.finish()?;
    if !rows.is_empty() {
        picture(&rows).save(out, "z_width")?;
    }
    say(&rows, context)?;
    let found = Found {
        is_complete: rows.len() == n_rows,
        rows,
    };
    out.write_json("z_width.json", &found)?;
    context.say(format_args!("written to {}", out.path().display()))?;
    context.json(&found)?;
    Ok(if context.is_interrupted() {
        Outcome::Interrupted
    } else {
        Outcome::Done
    })
}

/// The stiffness up to which all walls are stable, N/m, and whether that is the stiffest that is tried.
fn largest(model: &DeviceModel, grip: &Grip, damping: f64, has_observer: bool) -> (f64, bool) {
    let is_stable =
        |stiffness| z_width(model, grip, &[stiffness], &[damping], has_observer)[0].is_stable;
    let mut stable = 0.0;
    let mut tried = SOFTEST;
    while is_stable(tried) {
        stable = tried;
        tried *= FACTOR;
        if tried > STIFFEST * 1.001 {
            return (stable, true);
        }
    }
    if stable > 0.0 {
        for _ in 0..HALVINGS {
            let middle = (stable * tried).sqrt();
            if is_stable(middle) {
                stable = middle;
            } else {
                tried = middle;
            }
        }
    }
    (stable, false)
}

/// The limits without damping, which is what the law relies on.
fn say(rows: &[Row], context: &Context) -> anyhow::Result<()> {
    let mut table = Table::new([
        "stable to, N/m",
        "soft",
        "medium",
        "stiff",
        "observer: soft",
        "medium",
        "stiff",
        "law's limit",
    ])
    .with_left_names();
    for (device, model) in DeviceModel::ALL {
        if !rows.iter().any(|row| row.device == device) {
            continue;
        }
        let cell = |grip: usize, has_observer: bool| {
            let row = rows.iter().find(|row| {
                row.device == device
                    && row.grip == GRIPS[grip].0
                    && row.has_observer == has_observer
                    && row.damping == 0.0
            });
            row.map_or_else(String::new, |row| {
                let more = if row.is_open { ">" } else { "" };
                format!("{more}{:.0}", row.stiffness)
            })
        };
        table.push([
            device.to_owned(),
            cell(0, false),
            cell(1, false),
            cell(2, false),
            cell(0, true),
            cell(1, true),
            cell(2, true),
            format!("{:.0}", model.spec.max_stiffness),
        ]);
    }
    context.say(table)
}

/// A chart for each device: below its line a hand is safe.
fn picture(rows: &[Row]) -> Picture {
    let stable = rows.iter().map(|row| row.stiffness.max(SOFTEST));
    let (low, high) = stable.fold((STIFFEST, SOFTEST), |(low, high), k| {
        (low.min(k), high.max(k))
    });
    let limits = DeviceModel::ALL.map(|(_, model)| model.spec.max_stiffness);
    let low = limits.into_iter().fold(low, f64::min);
    let charts: Vec<Chart> = (DeviceModel::ALL.iter())
        .filter(|(device, _)| rows.iter().any(|row| row.device == *device))
        .map(|(device, model)| {
            let mut chart = Chart::new(
                Axis::linear("damping of the wall [N s/m]").with_zero(),
                Axis::log("largest stable stiffness [N/m]").with_range(0.8 * low, 1.25 * high),
            )
            .title(title(device));
            for has_observer in [false, true] {
                for ((grip, _), color) in GRIPS.into_iter().zip(PALETTE) {
                    let points: Vec<[f64; 2]> = rows
                        .iter()
                        .filter(|r| {
                            r.device == *device && r.grip == grip && r.has_observer == has_observer
                        })
                        .map(|r| [r.damping, r.stiffness.max(SOFTEST)])
                        .collect();
                    if points.is_empty() {
                        continue;
                    }
                    let series = if has_observer {
                        Series::new(format!("{grip}, observer"), points).dashed()
                    } else {
                        Series::new(grip, points)
                    };
                    chart = chart.series(series.with_color(color));
                }
            }
            let spec = model.spec;
            chart
                .guide(Guide::y(spec.max_stiffness, "relied on"))
                .guide(Guide::x(spec.max_damping, ""))
        })
        .collect();
    panels(
        "Stable walls: stiffness and damping that each device renders quietly",
        &charts,
        2,
    )
}

/// The name that a person knows a device by.
fn title(device: &str) -> &'static str {
    match device {
        "falcon" => "Novint Falcon",
        "touch" => "3D Systems Touch",
        "inverse3" => "Haply Inverse3",
        _ => "ideal device",
    }
}
