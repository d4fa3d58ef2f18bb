//! Largest stiffness and damping of a wall that each simulated device renders without rattling.
//!
//! In simulated time, the device presses 3 mm into a wall of one spring and one damper, with the
//! coupling off.

use palpa_device::{DeviceModel, Grip, z_width};
use palpa_plot::{Axis, Chart, Guide, PALETTE, Picture, Series, panels};
use serde::Serialize;

/// Names and grips of the hands that hold the devices.
pub const GRIPS: [(&str, Grip); 3] = [
    ("soft", Grip::SOFT),
    ("medium", Grip::MEDIUM),
    ("stiff", Grip::STIFF),
];
/// Smallest tested stiffness, N/m.
const SOFTEST: f64 = 50.0;
/// Largest tested stiffness, N/m.
const STIFFEST: f64 = 51_200.0;
/// Factor from one tested stiffness to the next.
const FACTOR: f64 = std::f64::consts::SQRT_2;
/// Bisections of the last interval, which give the limit to 2 %.
const HALVINGS: usize = 4;
/// Tested dampings, as shares of the largest damping that the law uses on the device.
const DAMPING_SHARES: [f64; 9] = [0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0];

/// Content of `z_width.json`.
#[derive(Debug, Serialize)]
pub struct Found {
    /// Whether the study is complete; false after an interruption.
    pub is_complete: bool,
    /// One row for each combination of device, hand, observer setting and damping.
    pub rows: Vec<WallRow>,
}

/// The largest stable stiffness at one damping.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct WallRow {
    /// Name of the device.
    pub device: &'static str,
    /// Name of the hand.
    pub grip: &'static str,
    /// Whether the energy observer injects damping, as in normal use.
    pub has_observer: bool,
    /// Damping of the wall, N s/m.
    pub damping: f64,
    /// Stiffness up to which all tested walls are stable, N/m; 0 if none is.
    pub stiffness: f64,
    /// Whether the stiffest tested wall is stable too, so that the true limit may be higher.
    pub is_open: bool,
}

/// Devices and hands to test.
#[derive(Debug, Clone, Default)]
pub struct Study {
    /// Names of devices; all if empty.
    pub devices: Vec<String>,
    /// Names of hands; all if empty.
    pub grips: Vec<String>,
}

impl Study {
    fn devices(&self) -> impl Iterator<Item = (&'static str, DeviceModel)> + '_ {
        DeviceModel::ALL
            .into_iter()
            .filter(|d| is_asked(&self.devices, d.0))
    }

    fn grips(&self) -> impl Iterator<Item = (&'static str, Grip)> + Clone + '_ {
        GRIPS.into_iter().filter(|g| is_asked(&self.grips, g.0))
    }

    /// Number of rows of a complete run.
    pub fn n_rows(&self) -> usize {
        self.devices().count() * self.grips().count() * 2 * DAMPING_SHARES.len()
    }

    /// Finds the rows one after the other. Stops when `goes_on`, called before each row, returns
    /// false.
    pub fn run(&self, mut goes_on: impl FnMut() -> bool) -> Found {
        let mut rows = Vec::with_capacity(self.n_rows());
        'all: for (device, model) in self.devices() {
            for (grip_name, grip) in self.grips() {
                for has_observer in [false, true] {
                    for share in DAMPING_SHARES {
                        if !goes_on() {
                            break 'all;
                        }
                        let damping = share * model.spec.max_damping;
                        let (stiffness, is_open) = largest(&model, &grip, damping, has_observer);
                        rows.push(WallRow {
                            device,
                            grip: grip_name,
                            has_observer,
                            damping,
                            stiffness,
                            is_open,
                        });
                    }
                }
            }
        }
        Found {
            is_complete: rows.len() == self.n_rows(),
            rows,
        }
    }
}

fn is_asked(asked: &[String], name: &str) -> bool {
    asked.is_empty() || asked.iter().any(|a| a == name)
}

/// The stiffness up to which all tested walls are stable, N/m, and whether it is the largest tested
/// one.
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

/// A chart for each device; walls below the line are stable.
pub fn picture(rows: &[WallRow]) -> Picture {
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
            .title(model.title);
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
