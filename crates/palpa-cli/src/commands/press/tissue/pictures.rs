//! The pictures of a press: force against depth and time, relaxation, layers, and the section
//! through the press point.

use std::path::PathBuf;

use palpa_fem::PosedTool;
use palpa_mesh::{Surface, Vec3};
use palpa_scene::{Scene, Tool};

use super::super::{Job, cut};
use super::result::PressResult;
use palpa::build::in_mm;
use palpa::press::Phase;
use palpa::press::lump::Embedded;
use palpa::press::tissue::{Indentation, Record, Sample};
use palpa_plot::section::{
    CornerMeans, Panel, Plane, Scale, Shades, SkinShades, ToolOutline, cut_body, draw, tissue_means,
};
use rayon::prelude::*;

use palpa_plot::{Axis, Chart, PALETTE, Picture, Series};

/// If the contact pressure is more than so many times the stress, small stresses get more colours.
const WIDE: f64 = 4.0;

pub(super) fn draw_pictures(
    job: &Job<'_>,
    indentation: &Indentation,
    recorded: &Record<'_>,
    result: &PressResult,
) -> anyhow::Result<Vec<PathBuf>> {
    let out = job.out;
    let samples = recorded.converged();
    let subtitle = format!(
        "{}; skin edges {:.1} mm near it; {}",
        job.scene.tool,
        indentation.mesh().mesh_size * 1e3,
        result.material_status
    );
    let mut charts = vec![
        ("force_depth", force_depth(&samples, indentation)),
        ("force_time", force_time(&samples, indentation)),
        ("layers", layers(&samples, indentation)),
    ];
    if indentation.is_viscous && samples.iter().any(|s| s.phase == Phase::Hold) {
        charts.push(("relaxation", relaxation(&samples, indentation)));
    }
    let mut pictures: Vec<(&str, Picture)> = (charts.into_iter())
        .map(|(stem, chart)| (stem, chart.subtitle(&subtitle).draw()))
        .collect();
    if let Some([section, stress]) = sections(job, indentation, recorded) {
        pictures.extend([("section", section), ("stress", stress)]);
    }
    let save = |(stem, picture): &(&str, Picture)| picture.save(out, stem);
    let saved: Vec<[PathBuf; 2]> = pictures
        .par_iter()
        .map(save)
        .collect::<anyhow::Result<_>>()?;
    // The PNG comes first, because the command prints the first path at the end.
    Ok((saved.into_iter())
        .flat_map(|[svg, png]| [png, svg])
        .collect())
}

/// The body cut through the press point, at rest and at the deepest sample: its layers and lumps,
/// and its stress.
fn sections(
    job: &Job<'_>,
    indentation: &Indentation,
    recorded: &Record<'_>,
) -> Option<[Picture; 2]> {
    let body = &indentation.mesh().body;
    let place = indentation.place();
    let deepest = &recorded.deepest;
    let plane = cut::plane(body, place)?;
    let at_rest = indentation.prepared.lump_surfaces();
    let moved: Vec<Surface> = (at_rest.iter())
        .map(|surface| {
            let embedded = Embedded::new(body, &surface.points);
            let steps = embedded.displacements(&deepest.displacements);
            let points = surface.points.iter().zip(steps).map(|(p, u)| p + u);
            Surface {
                points: points.collect(),
                triangles: surface.triangles.clone(),
            }
        })
        .collect();
    let positions: Vec<Vec3> = (body.positions.iter().zip(&deepest.displacements))
        .map(|(p, u)| p + u)
        .collect();
    let bones = cut::lines(&indentation.prepared.grown.bones, &plane);
    let [rest_lumps, pressed_lumps] = [&at_rest, &moved].map(|s| cut::lines(s, &plane));
    let [rest, pressed] =
        [&body.positions, &positions].map(|positions| cut_body(body, positions, &plane));
    let tool = |depth: f64| tool_outline(job.scene, indentation, &plane, depth);
    let title = format!("pressed {:.1} mm", deepest.depth_mm);
    let panels = [
        Panel {
            title: "at rest",
            section: &rest,
            bones: &bones,
            lumps: &rest_lumps,
            shades: None,
            tool: Some(tool(0.0)),
        },
        Panel {
            title: &title,
            section: &pressed,
            bones: &bones,
            lumps: &pressed_lumps,
            shades: None,
            tool: Some(tool(deepest.depth_mm * 1e-3)),
        },
    ];
    let through = format!(
        "through ({}) mm, the press direction downward",
        in_mm(place.at)
    );
    let layers = draw("Section through the press point", &through, &panels);
    let stress = stress_means(indentation, &deepest.von_mises);
    let pressure: Vec<f64> = deepest.skin_pressure.iter().map(|p| p * 1e-3).collect();
    // The number of the table; a single node has no area and none.
    let largest = recorded.samples.get(deepest.sample);
    let largest = largest.and_then(|sample| sample.max_pressure_kpa);
    let shades = Shades {
        name: "von Mises stress, kPa",
        values: &stress,
        scale: scale_of(
            &stress.in_section(&pressed),
            largest,
            job.scene.tool.is_bonded(),
        ),
        on_skin: largest.map(|largest| SkinShades {
            name: "contact pressure",
            values: &pressure,
            largest,
        }),
    };
    let [_, panel] = panels;
    let stressed = Panel {
        shades: Some(shades),
        ..panel
    };
    Some([layers, draw("Stress under the tool", &through, &[stressed])])
}

/// Stress in kPa at the corners of the prisms. Means go over prisms of one tissue: stress jumps
/// between layers, and at the border of a lump.
fn stress_means(indentation: &Indentation, von_mises: &[f64]) -> CornerMeans {
    let body = &indentation.mesh().body;
    let kpa: Vec<f64> = von_mises.iter().map(|s| s * 1e-3).collect();
    let n_intervals = body.n_levels - 1;
    let lumps = indentation.prepared.lump_shares();
    let tissue = |p: usize| {
        let is_in_lump = lumps.get(p).is_some_and(|&share| share >= 0.5);
        2 * body.interval_layer[p % n_intervals] + usize::from(is_in_lump)
    };
    let tissues: Vec<usize> = (0..body.n_prisms()).map(tissue).collect();
    tissue_means(body, &tissues, &kpa)
}

/// Colours for the stresses in the section, kPa, and for a contact pressure up to `largest`. Under a
/// bonded tool, the largest stress need not be in the range: at the sharp edge it has no limit on ever
/// finer meshes, and would take the contrast from all other places.
fn scale_of(stresses: &[f64], largest: Option<f64>, is_bonded: bool) -> Scale {
    let mut sorted = stresses.to_vec();
    sorted.sort_by(f64::total_cmp);
    let usual = if is_bonded {
        sorted.get((sorted.len() * 98) / 100)
    } else {
        sorted.last()
    };
    let usual = usual.copied().unwrap_or(0.0);
    let most = usual.max(largest.unwrap_or(0.0));
    if most <= 0.0 {
        Scale::Linear(1.0)
    } else if most > WIDE * usual {
        Scale::Root(most)
    } else {
        Scale::Linear(most)
    }
}

/// Outline of the tool at a depth, m.
fn tool_outline(
    scene: &Scene,
    indentation: &Indentation,
    plane: &Plane,
    depth: f64,
) -> ToolOutline {
    let direction = indentation.place().direction.into_inner();
    let at = indentation.place().at + direction * depth;
    let Some(PosedTool { tool, pose }) = indentation.tool_at(depth) else {
        return match scene.tool {
            Tool::Disc { radius } => ToolOutline::disc(plane, &at, &direction, radius),
            _ => ToolOutline::node(plane, &at),
        };
    };
    let size = tool.shape().footprint_radius();
    let distance = |p: &Vec3| tool.distance_at(&pose, p).distance;
    // The point on the axis that is farthest inside the tool.
    let tip = pose.translation.vector;
    let on_axis = (1..=40).map(|i| tip - direction * (size * f64::from(i) / 20.0));
    let inside = on_axis
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
        .unwrap_or(tip);
    ToolOutline::shape(plane, &inside, 1.5 * size, distance)
}

/// The name of a run if there are several.
fn speed_name(indentation: &Indentation, index: usize) -> String {
    format!("{} mm/s", indentation.speeds[index] * 1e3)
}

/// The error bar of a sample, at this place of the x axis.
fn bar_at(x: f64, s: &Sample) -> Option<[f64; 3]> {
    let bar = s.error_bar_n?;
    Some([x, s.force_n - bar, s.force_n + bar])
}

/// Loops of force against depth, one colour for each speed; the retraction is dashed.
fn force_depth(samples: &[&Sample], indentation: &Indentation) -> Chart {
    let mut chart = Chart::new(
        Axis::linear("depth, mm").with_zero(),
        Axis::linear("force, N").with_zero(),
    )
    .title("Force against depth");
    let n_runs = indentation.speeds.len();
    let has_bars = samples.iter().any(|s| s.error_bar_n.is_some());
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
                (0, 1) if has_bars => "loading, with its error bar".to_owned(),
                (0, 1) => "loading".to_owned(),
                (0, _) => speed_name(indentation, index),
                _ => String::new(),
            };
            let mut down = points(&[Phase::Load, Phase::Hold]);
            if cycle > 0 {
                // The loading curve begins where the last cycle ended.
                let before = of_run.iter().rfind(|s| s.cycle + 1 == cycle);
                down.splice(0..0, before.map(|s| [s.depth_mm, s.force_n]));
            }
            let mut back = points(&[Phase::Retract]);
            let first = || (of_run.iter()).filter(|s| cycle == 0 && s.is_first_loading());
            let bars = first().filter_map(|s| bar_at(s.depth_mm, s));
            let series = Series::new(name, down.clone()).with_color(color);
            chart = chart.series(series.with_spread(bars.collect()));
            let extrapolated: Vec<[f64; 2]> = first()
                .filter_map(|s| Some([s.depth_mm, s.extrapolated_n?]))
                .collect();
            if !extrapolated.is_empty() {
                let name = if n_runs == 1 {
                    "extrapolated to a fine mesh"
                } else {
                    ""
                };
                let series = Series::new(name, extrapolated).only_markers();
                chart = chart.series(series.with_color(color));
            }
            if !back.is_empty() {
                back.splice(0..0, down.last().copied());
                let name = if (cycle, n_runs) == (0, 1) {
                    "retracting"
                } else {
                    ""
                };
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
        let of_run = || samples.iter().filter(move |s| s.run == index);
        let points = of_run().map(|s| [s.time_s, s.force_n]).collect();
        let bars: Vec<[f64; 3]> = of_run().filter_map(|s| bar_at(s.time_s, s)).collect();
        let name = match indentation.speeds.len() {
            1 if bars.is_empty() => "force".to_owned(),
            1 => "force, with its error bar".to_owned(),
            _ => speed_name(indentation, index),
        };
        chart = chart.series(Series::new(name, points).with_spread(bars));
    }
    chart
}

/// Force during the first hold, as a share of the force at its beginning, against the logarithm of
/// time.
fn relaxation(samples: &[&Sample], indentation: &Indentation) -> Chart {
    let mut chart = Chart::new(
        Axis::log("time since the tool rests, s"),
        Axis::linear("force over that at the beginning"),
    )
    .title("Relaxation");
    for index in 0..indentation.speeds.len() {
        let of_run = || {
            samples
                .iter()
                .filter(move |s| s.run == index && s.cycle == 0)
        };
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

/// Thickness of each layer along the pressed column during the first loading, as a share of the
/// thickness at rest.
fn layers(samples: &[&Sample], indentation: &Indentation) -> Chart {
    let mut chart = Chart::new(
        Axis::linear("depth, mm").with_zero(),
        Axis::linear("thickness over that at rest, %"),
    )
    .title("Layers under the tool");
    let down: Vec<&&Sample> = (samples.iter())
        .filter(|s| s.run == 0 && s.is_first_loading())
        .collect();
    let Some(rest) = down.first() else {
        return chart;
    };
    let names = &indentation.mesh().body.layer_names;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_colour_scale_holds_the_contact_pressure() {
        let stresses: Vec<f64> = (0..100).map(f64::from).collect();
        // A tool that touches: the largest stress, or the contact pressure.
        assert_eq!(scale_of(&stresses, Some(20.0), false), Scale::Linear(99.0));
        assert_eq!(
            scale_of(&stresses, Some(150.0), false),
            Scale::Linear(150.0)
        );
        // A bonded one: not the stress at its edge, and small stresses stay apart.
        assert_eq!(scale_of(&stresses, None, true), Scale::Linear(98.0));
        assert_eq!(scale_of(&stresses, Some(500.0), true), Scale::Root(500.0));
        // Nothing is pressed.
        assert_eq!(scale_of(&[0.0; 9], Some(0.0), false), Scale::Linear(1.0));
        assert_eq!(scale_of(&[], None, true), Scale::Linear(1.0));
    }
}
