//! The pictures of a press: force against depth and time, relaxation, layers, and the section through the press point.

use std::path::PathBuf;

use super::super::Job;
use super::record::Recorded;
use super::result::PressResult;
use crate::build::BuiltBody;
use crate::plot::{Axis, Chart, PALETTE, Series};
use crate::press::Phase;
use crate::press::tissue::{Indentation, Sample};

pub(super) fn draw_pictures(
    job: &Job<'_>,
    built: &BuiltBody,
    indentation: &Indentation,
    recorded: &Recorded,
    result: &PressResult,
) -> anyhow::Result<Vec<PathBuf>> {
    let out = job.out;
    let samples: Vec<&Sample> = (recorded.samples.iter())
        .filter(|s| s.outcome == "converged")
        .collect();
    let subtitle = format!(
        "{}; skin edges {:.1} mm near it; {}",
        job.scene.tool,
        indentation.mesh.mesh_size * 1e3,
        result.material_status
    );
    let mut paths = Vec::new();
    let depth = force_depth(&samples, indentation).subtitle(&subtitle).draw();
    // The PNG first: the command ends with its path.
    paths.extend(depth.save(out, "force_depth")?.into_iter().rev());
    let time = force_time(&samples, indentation).subtitle(&subtitle).draw();
    paths.extend(time.save(out, "force_time")?);
    let layers = layers(&samples, indentation).subtitle(&subtitle).draw();
    paths.extend(layers.save(out, "layers")?);
    if indentation.is_viscous && samples.iter().any(|s| s.phase == Phase::Hold) {
        let relaxation = relaxation(&samples, indentation).subtitle(&subtitle).draw();
        paths.extend(relaxation.save(out, "relaxation")?);
    }
    let _ = built;
    Ok(paths)
}

/// The name of a run, where there are several.
fn speed_name(indentation: &Indentation, index: usize) -> String {
    format!("{} mm/s", indentation.speeds[index] * 1e3)
}

/// Loops of force against depth, a colour for each speed; the way back is dashed.
fn force_depth(samples: &[&Sample], indentation: &Indentation) -> Chart {
    let mut chart = Chart::new(
        Axis::linear("depth, mm").with_zero(),
        Axis::linear("force, N").with_zero(),
    )
    .title("Force against depth");
    let n_runs = indentation.speeds.len();
    for index in 0..n_runs {
        let of_run: Vec<&Sample> = samples.iter().copied().filter(|s| s.run == index).collect();
        let last_cycle = of_run.iter().map(|s| s.cycle).max().unwrap_or(0);
        for cycle in 0..=last_cycle {
            let points = |phases: &[Phase]| -> Vec<[f64; 2]> {
                (of_run.iter())
                    .filter(|s| s.cycle == cycle && phases.contains(&s.phase))
                    .map(|s| [s.depth_mm, s.force_n])
                    .collect()
            };
            let color = PALETTE[if n_runs > 1 { index } else { 0 } % PALETTE.len()];
            let name = match (cycle, n_runs) {
                (0, 1) => "loading".to_owned(),
                (0, _) => speed_name(indentation, index),
                _ => String::new(),
            };
            let mut down = points(&[Phase::Load, Phase::Hold]);
            if cycle > 0 {
                // It begins where the last cycle has ended.
                let before = of_run.iter().rfind(|s| s.cycle + 1 == cycle);
                down.splice(0..0, before.map(|s| [s.depth_mm, s.force_n]));
            }
            let mut back = points(&[Phase::Retract]);
            chart = chart.series(Series::new(name, down.clone()).with_color(color));
            if !back.is_empty() {
                back.splice(0..0, down.last().copied());
                let name = if (cycle, n_runs) == (0, 1) { "retracting" } else { "" };
                chart = chart.series(Series::new(name, back).with_color(color).dashed());
            }
        }
    }
    chart
}

fn force_time(samples: &[&Sample], indentation: &Indentation) -> Chart {
    let mut chart = Chart::new(
        Axis::linear("time, s").with_zero(),
        Axis::linear("force, N").with_zero(),
    )
    .title("Force against time");
    for index in 0..indentation.speeds.len() {
        let of_run = samples.iter().filter(|s| s.run == index);
        let points = of_run.map(|s| [s.time_s, s.force_n]).collect();
        let name = match indentation.speeds.len() {
            1 => "force".to_owned(),
            _ => speed_name(indentation, index),
        };
        chart = chart.line(name, points);
    }
    chart
}

/// Force during the first rest, as a share of that at its beginning, over the logarithm of time.
fn relaxation(samples: &[&Sample], indentation: &Indentation) -> Chart {
    let mut chart = Chart::new(
        Axis::log("time since the tool rests, s"),
        Axis::linear("force over that at the beginning"),
    )
    .title("Relaxation");
    for index in 0..indentation.speeds.len() {
        let of_run = || samples.iter().filter(move |s| s.run == index && s.cycle == 0);
        let Some(top) = of_run().rfind(|s| s.phase == Phase::Load) else {
            continue;
        };
        let points = of_run()
            .filter(|s| s.phase == Phase::Hold)
            .map(|s| [s.time_s - top.time_s, s.force_n / top.force_n])
            .collect();
        let name = speed_name(indentation, index);
        chart = chart.series(Series::new(name, points).with_markers());
    }
    chart
}

/// Thickness of each layer along the pressed column on the first way down, as a share of that at rest.
fn layers(samples: &[&Sample], indentation: &Indentation) -> Chart {
    let mut chart = Chart::new(
        Axis::linear("depth, mm").with_zero(),
        Axis::linear("thickness over that at rest, %"),
    )
    .title("Layers under the tool");
    let down: Vec<&&Sample> = (samples.iter())
        .filter(|s| s.run == 0 && s.cycle == 0 && s.phase == Phase::Load)
        .collect();
    let Some(rest) = down.first() else {
        return chart;
    };
    let names = &indentation.mesh.body.layer_names;
    for (i, name) in names.iter().enumerate() {
        let at_rest = rest.layer_thickness_mm[i];
        let points = down
            .iter()
            .map(|s| [s.depth_mm, 100.0 * s.layer_thickness_mm[i] / at_rest])
            .collect();
        chart = chart.line(format!("{name}, {at_rest:.1} mm"), points);
    }
    chart
}
