//! `palpa press`: a scripted indentation, as table, plots, pictures and a series for ParaView.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail};
use palpa_mesh::growth::GrowthReport;
use palpa_mesh::{LayeredBody, Surface, Vec3};
use palpa_tissue::units::{Length, Time, Velocity};
use palpa_tissue::{MaterialStatus, Scene, Status, Target, Tool};
use serde::Serialize;

use super::Outcome;
use crate::build::{BuiltBody, build, in_mm};
use crate::cli::Context;
use crate::output::OutDir;
use crate::plot::{Axis, Chart, Guide};
use crate::press::{Indentation, Phase, Run, Sample};
use crate::section::{Panel, Plane, ToolOutline, cut_body, cut_surface, draw};
use crate::table::Table;
use crate::vtu::{Grid, write_series};

/// Press a body along a script and record the force
///
/// Without a SCENE, a forearm made by formula is pressed. Writes the table (press.csv, press.json), force against depth
/// and time (SVG and PNG), a cross-section, and the deformed body as a VTU/PVD series for ParaView.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Scene file (TOML); the embedded forearm if none is given
    scene: Option<PathBuf>,
    /// Press at the skin point nearest to this one, "X,Y,Z" with units: "120 mm,0 mm,40 mm"
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    at: Option<String>,
    /// Press at this vertex of the skin surface
    #[arg(long, value_name = "N", conflicts_with = "at")]
    vertex: Option<u32>,
    /// How deep, with its unit: "8 mm"
    #[arg(long)]
    depth: Option<Length>,
    /// How fast, with its unit: "10 mm/s"
    #[arg(long)]
    speed: Option<Velocity>,
    /// How long to rest at the depth: "0.5 s"
    #[arg(long)]
    hold: Option<Time>,
    /// Depth between two results: "0.5 mm"
    #[arg(long)]
    step: Option<Length>,
    /// Stop at the depth instead of coming back
    #[arg(long)]
    no_retract: bool,
    /// Deformed bodies in the series for ParaView, rest and deepest among them; 0 for none
    #[arg(long, default_value_t = 9, value_name = "N")]
    frames: usize,
}

/// What `--json` prints and press.json holds.
#[derive(Debug, Serialize)]
struct PressReport<'a> {
    model: &'static str,
    scene: String,
    body: &'a GrowthReport,
    materials: &'a [MaterialStatus],
    press: PressFacts,
    result: PressResult,
    notes: &'a [String],
    samples: &'a [Sample],
}

#[derive(Debug, Serialize)]
struct PressFacts {
    vertex: usize,
    at_m: [f64; 3],
    direction: [f64; 3],
    tool: String,
    n_operated_nodes: usize,
    mesh_size_near_tool_mm: f64,
    tissue_depth_mm: f64,
    substeps: u32,
}

#[derive(Debug, Serialize)]
struct PressResult {
    outcome: &'static str,
    max_force_n: f64,
    at_depth_mm: f64,
    secant_stiffness_n_per_mm: Option<f64>,
    force_after_retract_n: Option<f64>,
    /// Depth from which on prisms are turned over, so that the force is that of the bars alone.
    inverted_from_mm: Option<f64>,
    material_status: String,
}

/// Runs the command.
///
/// # Errors
/// On a bad scene or body, and when a result cannot be written.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<Outcome> {
    let scene = adjusted_scene(args)?;
    let out = context.out_dir()?;
    let spinner = context.progress(0, "growing the body");
    let built = build(&scene)?;
    drop(spinner);
    let indentation = Indentation::build(&scene, &built)?;
    let notes: Vec<String> = built
        .notes
        .iter()
        .chain(&indentation.notes)
        .cloned()
        .collect();
    let materials = scene.material_status();
    let scene_name = args
        .scene
        .as_deref()
        .map_or("embedded forearm".to_owned(), |p| p.display().to_string());
    announce(
        context,
        &scene_name,
        &scene,
        &built,
        &indentation,
        &materials,
    )?;

    remove_older(out.path())?;
    let recorded = record(args, context, out, &built, &indentation)?;
    let result = result_of(&recorded.samples, &materials);
    let report = PressReport {
        model: "reference",
        scene: scene_name.clone(),
        body: &built.growth.report,
        materials: &materials,
        press: facts(&scene, &indentation),
        result,
        notes: &notes,
        samples: &recorded.samples,
    };
    out.write_json("press.json", &report)?;
    let pictures = draw_pictures(out, &scene, &built, &indentation, &recorded, &report.result)?;
    context.json(&report)?;
    conclude(context, out.path(), &recorded, &report, &pictures, &notes)?;
    Ok(match (context.is_interrupted(), report.result.outcome) {
        (true, _) => Outcome::Interrupted,
        (_, "diverged") => Outcome::NotGood,
        _ => Outcome::Done,
    })
}

/// The scene with what the command line changes in it.
fn adjusted_scene(args: &Args) -> anyhow::Result<Scene> {
    let mut scene = match &args.scene {
        Some(path) => Scene::load(path)?,
        None => Scene::embedded(),
    };
    let press = &mut scene.press;
    if let Some(text) = &args.at {
        press.target = Target::Point(parse_point(text)?);
    }
    if let Some(vertex) = args.vertex {
        press.target = Target::Vertex(vertex);
    }
    if let Some(depth) = args.depth {
        // The step keeps its share of the depth unless it is given, too.
        press.step *= depth.si() / press.depth;
        press.depth = depth.si();
    }
    if let Some(step) = args.step {
        press.step = step.si();
    }
    if let Some(speed) = args.speed {
        press.speed = speed.si();
    }
    if let Some(hold) = args.hold {
        press.hold = hold.si();
    }
    press.retract &= !args.no_retract;
    if let Err(problem) = press.check() {
        bail!("{problem}; see --depth, --step, --speed and --hold");
    }
    Ok(scene)
}

fn parse_point(text: &str) -> anyhow::Result<[f64; 3]> {
    let parts: Vec<&str> = text.split(',').collect();
    let [x, y, z] = parts[..] else {
        bail!(
            "--at \"{text}\" has {} parts; give three lengths with units, as in \"120 mm,0 mm,40 mm\"",
            parts.len()
        );
    };
    let length = |part: &str| -> anyhow::Result<f64> {
        Ok(part
            .trim()
            .parse::<Length>()
            .with_context(|| format!("--at \"{text}\""))?
            .si())
    };
    Ok([length(x)?, length(y)?, length(z)?])
}

/// Removes the files of an earlier run into the same folder, of which this one might leave some standing.
fn remove_older(folder: &Path) -> anyhow::Result<()> {
    let pictures = ["force_depth", "force_time", "section"];
    let mut older: Vec<PathBuf> = ["press.csv", "press.json", "press.pvd"]
        .map(|name| folder.join(name))
        .into();
    older.extend(
        pictures
            .iter()
            .flat_map(|stem| ["svg", "png"].map(|end| folder.join(format!("{stem}.{end}")))),
    );
    if let Ok(series) = std::fs::read_dir(folder.join("series")) {
        let is_ours = |name: &str| name.starts_with("body_") || name.starts_with("bone_");
        older.extend(
            series
                .flatten()
                .filter(|f| is_ours(&f.file_name().to_string_lossy()))
                .map(|f| f.path()),
        );
    }
    for path in older.iter().filter(|path| path.exists()) {
        std::fs::remove_file(path)
            .with_context(|| format!("cannot remove the older \"{}\"", path.display()))?;
    }
    Ok(())
}

/// What came out of a run.
struct Recorded {
    samples: Vec<Sample>,
    /// Positions at the deepest sample reached.
    deepest: Vec<Vec3>,
    deepest_depth: f64,
}

/// Runs the script; every sample goes to the table at once, so that an interrupted run leaves a valid one.
fn record(
    args: &Args,
    context: &Context,
    out: &OutDir,
    built: &BuiltBody,
    indentation: &Indentation,
) -> anyhow::Result<Recorded> {
    let mut table = out.table::<Sample>("press.csv")?;
    let mut series = Series::new(args.frames, indentation);
    let mut run = indentation.start(&built.growth.body);
    let mut recorded = Recorded {
        samples: Vec::new(),
        deepest: run.state.positions.clone(),
        deepest_depth: 0.0,
    };
    let progress = context.progress(indentation.n_samples(), "pressing");
    while let Some(sample) = run.advance() {
        table.push(&sample)?;
        if sample.outcome != "diverged" {
            series.offer(out, built, &run, recorded.samples.len(), &sample)?;
            if sample.depth_mm > recorded.deepest_depth {
                recorded.deepest_depth = sample.depth_mm;
                recorded.deepest.clone_from(&run.state.positions);
            }
        }
        recorded.samples.push(sample);
        progress.inc(1);
        if context.is_interrupted() {
            break;
        }
    }
    table.finish()?;
    series.finish(out, &built.bones)?;
    Ok(recorded)
}

/// The deformed body at some of the samples, as VTU files under one PVD.
struct Series {
    wanted: Vec<usize>,
    frames: Vec<(f64, String)>,
}

impl Series {
    /// Picks `n` samples, evenly spread; from two on the first and the deepest are among them.
    fn new(n: usize, indentation: &Indentation) -> Self {
        let (last, deepest) = (indentation.n_samples() - 1, indentation.deepest());
        let n = n.min(last + 1);
        let mut wanted: Vec<usize> = match n {
            0 => Vec::new(),
            1 => vec![deepest],
            2 => vec![0, deepest],
            _ => (0..n).map(|i| (i * last) / (n - 1)).collect(),
        };
        if let Some(nearest) = wanted
            .iter_mut()
            .skip(1)
            .min_by_key(|w| w.abs_diff(deepest))
        {
            *nearest = deepest;
        }
        wanted.sort_unstable();
        wanted.dedup();
        Self {
            wanted,
            frames: Vec::new(),
        }
    }

    fn offer(
        &mut self,
        out: &OutDir,
        built: &BuiltBody,
        run: &Run<'_>,
        index: usize,
        sample: &Sample,
    ) -> anyhow::Result<()> {
        if !self.wanted.contains(&index) {
            return Ok(());
        }
        let growth = &built.growth;
        let body = &growth.body;
        let per_column = |values: &[f64]| -> Vec<f64> {
            values
                .iter()
                .flat_map(|&x| std::iter::repeat_n(x, body.n_levels))
                .collect()
        };
        let displacement: Vec<Vec3> = run
            .state
            .positions
            .iter()
            .zip(&body.positions)
            .map(|(now, rest)| now - rest)
            .collect();
        let mut grid = Grid::of_body(body, &run.state.positions)
            .with_point_vectors("displacement", &displacement)
            .with_point_vectors("force", &run.state.node_forces)
            .with_point_scalars("thinning", per_column(&growth.thinning))
            .with_point_scalars(
                "is_base",
                (0..body.n_nodes())
                    .map(|n| f64::from(u8::from(body.is_base(n))))
                    .collect(),
            )
            .with_point_scalars("cut_face", per_column(&cut_faces(body)));
        if !growth.stand_off.is_empty() {
            grid = grid.with_point_scalars("stand_off", per_column(&growth.stand_off));
        }
        let name = format!("body_{:03}.vtu", self.frames.len());
        out.write_with(&format!("series/{name}"), |w| grid.write(w))?;
        self.frames.push((sample.time_s, format!("series/{name}")));
        Ok(())
    }

    fn finish(self, out: &OutDir, bones: &[Surface]) -> anyhow::Result<()> {
        if !self.frames.is_empty() {
            for (i, bone) in bones.iter().enumerate() {
                out.write_with(&format!("series/bone_{i}.vtu"), |w| {
                    Grid::of_surface(bone).write(w)
                })?;
            }
            out.write_with("press.pvd", |w| write_series(w, &self.frames))?;
        }
        Ok(())
    }
}

/// For each skin vertex the number of its cut face, from 1; 0 on none.
fn cut_faces(body: &LayeredBody) -> Vec<f64> {
    let mut number = vec![0.0; body.n_vertices()];
    for (i, face) in body.cut_faces.iter().enumerate() {
        for &v in &face.vertices {
            number[v as usize] = (i + 1) as f64;
        }
    }
    number
}

fn facts(scene: &Scene, indentation: &Indentation) -> PressFacts {
    PressFacts {
        vertex: indentation.vertex,
        at_m: indentation.at.into(),
        direction: indentation.direction.into_inner().into(),
        tool: tool_name(scene),
        n_operated_nodes: indentation.model.operated().len(),
        mesh_size_near_tool_mm: indentation.mesh_size * 1e3,
        tissue_depth_mm: indentation.tissue_depth * 1e3,
        substeps: scene.reference.substeps,
    }
}

fn tool_name(scene: &Scene) -> String {
    match scene.tool {
        Tool::Disc { radius } => format!("bonded disc, radius {:.1} mm", radius * 1e3),
        Tool::Node => "single operated node".to_owned(),
    }
}

fn result_of(samples: &[Sample], materials: &[MaterialStatus]) -> PressResult {
    let good: Vec<&Sample> = samples.iter().filter(|s| s.outcome != "diverged").collect();
    let max = good.iter().max_by(|a, b| a.force_n.total_cmp(&b.force_n));
    let (max_force_n, at_depth_mm) = max.map_or((0.0, 0.0), |s| (s.force_n, s.depth_mm));
    let is_any = |outcome: &str| samples.iter().any(|s| s.outcome == outcome);
    PressResult {
        outcome: match () {
            () if is_any("diverged") => "diverged",
            () if is_any("euler_fallback") => "euler_fallback",
            () => "converged",
        },
        max_force_n,
        at_depth_mm,
        secant_stiffness_n_per_mm: (at_depth_mm > 0.0).then(|| max_force_n / at_depth_mm),
        force_after_retract_n: good
            .last()
            .filter(|s| s.phase == Phase::Retract && s.depth_mm == 0.0)
            .map(|s| s.force_n),
        inverted_from_mm: good.iter().find(|s| s.n_inverted > 0).map(|s| s.depth_mm),
        material_status: status_line(materials),
    }
}

/// One sentence on how far the stiffnesses can be trusted.
fn status_line(materials: &[MaterialStatus]) -> String {
    let named = |status: Status| -> Vec<&str> {
        materials
            .iter()
            .filter(|m| m.status == status)
            .map(|m| m.tissue.as_str())
            .collect()
    };
    let parts: Vec<String> = [
        (Status::Measured, "measured"),
        (Status::Literature, "from literature"),
        (Status::Assumed, "ASSUMED"),
        (Status::Given, "given by the scene"),
    ]
    .into_iter()
    .filter_map(|(status, word)| {
        let names = named(status);
        (!names.is_empty()).then(|| format!("{word}: {}", names.join(", ")))
    })
    .collect();
    format!("stiffness {}", parts.join("; "))
}

fn announce(
    context: &Context,
    scene_name: &str,
    scene: &Scene,
    built: &BuiltBody,
    indentation: &Indentation,
    materials: &[MaterialStatus],
) -> anyhow::Result<()> {
    let r = &built.growth.report;
    context.say(format!(
        "{scene_name}: {} skin vertices × {} levels = {} nodes, {} prisms, all valid (scaled Jacobian: smallest {:.2}, \
         5 % below {:.2})",
        r.n_vertices, r.n_levels, r.n_nodes, r.n_prisms, r.scaled_jacobian.min, r.scaled_jacobian.p05
    ))?;
    let mut table = Table::new(["layer", "levels", "thickness mm", "stiffness", "status"]);
    for ((layer, material), spec) in r.layers.iter().zip(materials).zip(&scene.layers) {
        let t = &layer.thickness;
        table.push([
            layer.name.clone(),
            spec.levels.to_string(),
            format!(
                "{:.2} ({:.2}–{:.2})",
                t.median * 1e3,
                t.min * 1e3,
                t.max * 1e3
            ),
            match (material.young, material.spring) {
                (Some(young), _) => format!("E {:.1} kPa", young / 1e3),
                (_, Some(spring)) => format!("k {spring:.3e} N/m per bar"),
                _ => String::new(),
            },
            format!("{:?}", material.status).to_lowercase(),
        ]);
    }
    context.say(table)?;
    if let Some(worst) = &r.worst_thinning {
        context.say(format!(
            "layers thinned below {:.1} % of the skin, for want of room; most at ({}) mm, to {:.0} % of their thickness",
            100.0 * r.thinned_share,
            in_mm(worst.at.into()),
            100.0 * worst.value
        ))?;
    }
    if let (Some(spread), Some(worst)) = (&r.stand_off, &r.worst_stand_off) {
        context.say(format!(
            "rigid core stands off the bone by {:.1} mm (median; 95 % below {:.1}), most {:.1} mm under ({}) mm",
            spread.median * 1e3,
            spread.p95 * 1e3,
            worst.value * 1e3,
            in_mm(worst.at.into())
        ))?;
    }
    context.say(format!(
        "reference method; {} holding {} nodes at ({}) mm, where the tissue is {:.1} mm deep; skin edges near the tool \
         {:.1} mm",
        tool_name(scene),
        indentation.model.operated().len(),
        in_mm(indentation.at),
        indentation.tissue_depth * 1e3,
        indentation.mesh_size * 1e3
    ))
}

fn conclude(
    context: &Context,
    folder: &Path,
    recorded: &Recorded,
    report: &PressReport<'_>,
    pictures: &[PathBuf],
    notes: &[String],
) -> anyhow::Result<()> {
    const ROWS: usize = 12;
    let loading: Vec<&Sample> = recorded
        .samples
        .iter()
        .filter(|s| s.phase == Phase::Load)
        .collect();
    let mut table = Table::new(["depth mm", "force N"]);
    let stride = loading.len().div_ceil(ROWS).max(1);
    for (i, sample) in loading.iter().enumerate() {
        if i % stride == 0 || i + 1 == loading.len() {
            table.push([
                format!("{:.2}", sample.depth_mm),
                format!("{:.4}", sample.force_n),
            ]);
        }
    }
    context.say(table)?;
    let r = &report.result;
    context.say(format!(
        "largest force {:.3} N at {:.2} mm{}",
        r.max_force_n,
        r.at_depth_mm,
        r.secant_stiffness_n_per_mm
            .map_or(String::new(), |k| format!(" ({k:.3} N/mm on average)"))
    ))?;
    context.say(format!(
        "{}. Bars have Poisson's ratio ¼ whatever the tissue's.",
        r.material_status
    ))?;
    if let Some(depth) = r.inverted_from_mm {
        context.say(format!(
            "from {depth:.2} mm on prisms are TURNED OVER: bars have no volume, and a soft layer is pressed through \
             itself. Take the force up to there only"
        ))?;
    }
    if r.outcome == "diverged" {
        context.say(
            "the last step DIVERGED; results end before it. Use more substeps or a smaller step",
        )?;
    }
    for note in notes {
        context.say(format!("note: {note}"))?;
    }
    context.say(format!(
        "table, series and pictures in {}",
        folder.display()
    ))?;
    if let Some(picture) = pictures.first() {
        context.say(format!("force against depth: {}", picture.display()))?;
    }
    Ok(())
}

fn draw_pictures(
    out: &OutDir,
    scene: &Scene,
    built: &BuiltBody,
    indentation: &Indentation,
    recorded: &Recorded,
    result: &PressResult,
) -> anyhow::Result<Vec<PathBuf>> {
    let samples: Vec<&Sample> = recorded
        .samples
        .iter()
        .filter(|s| s.outcome != "diverged")
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
        tool_name(scene),
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
        // The way back begins where the rest ended.
        retracting.splice(0..0, of_phase(&[Phase::Load, Phase::Hold]).last().copied());
        depth_chart =
            depth_chart.series(crate::plot::Series::new("retracting", retracting).dashed());
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
    indentation: &Indentation,
    recorded: &Recorded,
) -> Option<crate::plot::Picture> {
    let body = &built.growth.body;
    let direction = indentation.direction.into_inner();
    // Across the limb where it has an end; else along the longest way.
    let across = body
        .cut_faces
        .iter()
        .find(|f| f.is_flat && f.normal.dot(&direction).abs() < 0.9)
        .map(|f| f.normal);
    let other = if direction.x.abs() < 0.7 {
        Vec3::x()
    } else {
        Vec3::y()
    };
    let plane = Plane::new(
        indentation.at,
        across.unwrap_or(other).cross(&direction).cross(&direction),
        -direction,
    )?;
    let bones: Vec<_> = built
        .bones
        .iter()
        .flat_map(|b: &Surface| cut_surface(b, &plane))
        .collect();
    let tool = |at: Vec3| match scene.tool {
        Tool::Disc { radius } => ToolOutline::disc(&plane, &at, &direction, radius),
        Tool::Node => ToolOutline::node(&plane, &at),
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
            tool: Some(tool(indentation.at)),
        },
        Panel {
            title: &pressed_title,
            section: &pressed,
            bones: &bones,
            tool: Some(tool(indentation.at + direction * (depth * 1e-3))),
        },
    ];
    let subtitle = format!(
        "through ({}) mm, the press direction downward",
        in_mm(indentation.at)
    );
    Some(draw("Section through the press point", &subtitle, &panels))
}
