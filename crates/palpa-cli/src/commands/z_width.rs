//! `palpa z-width`: largest stiffness and damping of a wall that each simulated device can render
//! without rattling.

use palpa_device::DeviceModel;
use palpa_lab::z_width::{GRIPS, Study, WallRow, picture};

use super::Outcome;
use crate::cli::Context;
use crate::table::Table;

/// Find the stable range of stiffness and damping of each simulated device
///
/// In simulated time, each device in each grip presses 3 mm into a wall, a spring with a damper,
/// with the coupling off. A wall is stable if the force between 20 and 400 Hz stays below 0.02 N
/// over two seconds while the hand's target is still. For each damping, reports the largest
/// stiffness up to which every tested wall is stable, without and with the energy observer. Writes
/// a table, the figures and a picture (CSV, JSON, SVG and PNG).
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Test only this device; may be repeated [default: all]
    #[arg(long = "device", value_name = "NAME", value_parser = DeviceModel::ALL.map(|(name, _)| name))]
    devices: Vec<String>,
    /// Test only this grip; may be repeated [default: all]
    #[arg(long = "grip", value_name = "NAME", value_parser = GRIPS.map(|(name, _)| name))]
    grips: Vec<String>,
}

/// Runs the command.
///
/// # Errors
/// If a result cannot be written.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<Outcome> {
    let out = context.out_dir()?;
    context.begin_recording();
    let study = Study {
        devices: args.devices.clone(),
        grips: args.grips.clone(),
    };
    let bar = context.progress(study.n_rows(), "walls");
    let found = study.run(|| {
        bar.inc(1);
        !context.is_interrupted()
    });
    bar.finish_and_clear();
    let mut csv = out.table::<WallRow>("z_width.csv")?;
    for row in &found.rows {
        csv.push(row)?;
    }
    csv.finish()?;
    if !found.rows.is_empty() {
        picture(&found.rows).save(out, "z_width")?;
    }
    say(&found.rows, context)?;
    out.write_json("z_width.json", &found)?;
    context.say(format_args!("written to {}", out.path().display()))?;
    context.json(&found)?;
    Ok(if context.is_interrupted() {
        Outcome::Interrupted
    } else {
        Outcome::Done
    })
}

/// Prints the limits without damping, on which the law relies.
fn say(rows: &[WallRow], context: &Context) -> anyhow::Result<()> {
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
