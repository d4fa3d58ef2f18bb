//! The pictures of an indentation: force against depth and time, and the section through the press
//! point.

use std::path::PathBuf;

use palpa_mesh::Vec3;
use palpa_scene::{Scene, Tool};

use super::super::cut;
use super::record::BarRecord;
use super::report::BarResult;
use palpa::build::{BuiltBody, in_mm};
use palpa::press::Phase;
use palpa::press::reference::{BarIndentation, BarOutcome, BarSample};
use palpa_plot::output::OutDir;
use palpa_plot::section::{Panel, ToolOutline, cut_body, draw};
use palpa_plot::{Axis, Chart, Guide};

pub(super) fn draw_pictures(
    out: &OutDir,
    scene: &Scene,
    built: &BuiltBody,
    indentation: &BarIndentation,
    recorded: &BarRecord,
    result: &BarResult,
) -> anyhow::Result<Vec<PathBuf>> {
    let samples: Vec<&BarSample> = recorded
        .samples
        .iter()
        .filter(|s| s.outcome != BarOutcome::Diverged)
        .collect();
    let of_phase = |phases: &[Phase]| -> Vec<[f64; 2]> {
        samples
            .iter()
            .filter(|s| phases.contains(&s.phase))
            .map(|s| [s.depth_mm, s.force_n])
            .collect()
    };
    let subtitle = format!(
        "{}; skin edges {:.1} mm near it; {}",
        scene.tool,
        indentation.mesh_size * 1e3,
        result.material_status
    );
    let mut depth_chart = Chart::new(
        Axis::linear("depth, mm").with_zero(),
        Axis::linear("force, N").with_zero(),
    )
    .title("Force against depth")
    .subtitle(&subtitle)
    .line("loading", of_phase(&[Phase::Load, Phase::Hold]));
    let mut retracting = of_phase(&[Phase::Retract]);
    if !retracting.is_empty() {
        // The retraction curve begins at the end of the hold.
        retracting.splice(0..0, of_phase(&[Phase::Load, Phase::Hold]).last().copied());
        depth_chart =
            depth_chart.series(palpa_plot::Series::new("retracting", retracting).dashed());
    }
    if let Some(depth) = result.inverted_from_mm {
        depth_chart = depth_chart.guide(Guide::x(depth, "prisms turned over"));
    }
    let time: Vec<[f64; 2]> = samples.iter().map(|s| [s.time_s, s.force_n]).collect();
    let time_chart = Chart::new(
        Axis::linear("time, s").with_zero(),
        Axis::linear("force, N").with_zero(),
    )
    .title("Force against time")
    .subtitle(&subtitle)
    .line("force", time);
    let mut paths = Vec::new();
    paths.extend(
        depth_chart
            .draw()
            .save(out, "force_depth")?
            .into_iter()
            .rev(),
    );
    paths.extend(time_chart.draw().save(out, "force_time")?);
    if let Some(picture) = section_picture(scene, built, indentation, recorded) {
        paths.extend(picture.save(out, "section")?);
    }
    Ok(paths)
}

/// The body cut through the press point, at rest and at the deepest sample.
fn section_picture(
    scene: &Scene,
    built: &BuiltBody,
    indentation: &BarIndentation,
    recorded: &BarRecord,
) -> Option<palpa_plot::Picture> {
    let body = &built.growth.body;
    let direction = indentation.place.direction.into_inner();
    let plane = cut::plane(body, &indentation.place)?;
    let bones = cut::lines(&built.bones, &plane);
    let tool = |at: Vec3| match scene.tool {
        Tool::Disc { radius } => ToolOutline::disc(&plane, &at, &direction, radius),
        Tool::Node | Tool::Contact(_) => ToolOutline::node(&plane, &at),
    };
    let (rest, pressed) = (
        cut_body(body, &body.positions, &plane),
        cut_body(body, &recorded.deepest, &plane),
    );
    let depth = recorded.deepest_depth;
    let pressed_title = format!("pressed {depth:.1} mm");
    let panels = [
        Panel {
            title: "at rest",
            section: &rest,
            bones: &bones,
            lumps: &[],
            shades: None,
            tool: Some(tool(indentation.place.at)),
        },
        Panel {
            title: &pressed_title,
            section: &pressed,
            bones: &bones,
            lumps: &[],
            shades: None,
            tool: Some(tool(indentation.place.at + direction * (depth * 1e-3))),
        },
    ];
    let subtitle = format!(
        "through ({}) mm, the press direction downward",
        in_mm(indentation.place.at)
    );
    Some(draw("Section through the press point", &subtitle, &panels))
}
