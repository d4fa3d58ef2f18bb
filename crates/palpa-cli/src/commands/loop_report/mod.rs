//! `palpa loop-report`: runs the whole engine in real time and reports on it.

mod audit;
mod bars;
mod figures;
mod force;
mod hand;
mod picture;
mod verdicts;

use std::path::PathBuf;
use std::time::Duration;

use palpa_rt::{Engine, EngineParams, Log, RecorderParams, Report};
use palpa_scene::built_in::LOOPED;
use palpa_scene::{Dynamics, ModelKind, Scene};

use self::audit::Audit;
use self::bars::{BarFigures, Bars, LOOK_PERIOD};
use self::figures::{Figures, Setup};
use self::hand::still_spans;
use super::Outcome;
use crate::cli::Context;
use crate::named_scene::{self, NamedScene};
use palpa::live::{LiveScene, Watch, across, machine, notes_of, open_device, path, servo_params};
use palpa_plot::output::OutDir;

/// Shortest duration of a run, s. Shorter runs do not show rare ticks, and the RMS of the force
/// needs two seconds.
const LEAST_SECONDS: f64 = 5.0;
const MOST_SECONDS: f64 = 3600.0;

/// Run the engine in real time and report deadlines, smoothness and energy
///
/// A simulated hand holds the haptic device of the scene and moves it as the scene's motion says.
/// The tissue is computed with finite elements, the force at 1 kHz. Without a SCENE, the hand
/// strokes a forearm with a lump. Each guarantee is judged; one that the run gave nothing to judge by
/// is not kept. Afterwards, error bars of the force are computed at up to five places along the way. Writes the log (log.mcap, for `palpa replay`), the figures
/// (loop.json), histograms of the times of ticks, and force against time and depth (SVG and PNG).
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Scene file (TOML), or the name of a built-in scene; see `palpa scenes` [default:
    /// `forearm_loop`]
    scene: Option<PathBuf>,
    /// Duration in seconds, 5 to 3600
    #[arg(
        long,
        default_value_t = 60.0,
        value_name = "S",
        allow_negative_numbers = true
    )]
    seconds: f64,
    /// Spin for this many µs before each tick instead of sleeping, 0 to 1000: ticks are less late,
    /// but the CPU load rises
    #[arg(
        long,
        default_value_t = 0.0,
        value_name = "µS",
        allow_negative_numbers = true
    )]
    spin_us: f64,
    /// Compute no error bars
    #[arg(long)]
    no_error_bars: bool,
    /// After the run, solve N poses of the tool again statically on finer meshes, and report the
    /// error of the force there, 1 to 500
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=500))]
    audit: Option<u16>,
    /// Print the scene as a start for your own, and run nothing
    #[arg(long)]
    print_scene: bool,
}

/// Runs the command.
///
/// # Errors
/// If the scene is not fit for real time, a thread cannot be started, or a result cannot be
/// written.
pub fn run(args: &Args, context: &Context) -> anyhow::Result<Outcome> {
    anyhow::ensure!(
        (LEAST_SECONDS..=MOST_SECONDS).contains(&args.seconds),
        "--seconds {} is outside the allowed range {LEAST_SECONDS} to {MOST_SECONDS}",
        args.seconds
    );
    anyhow::ensure!(
        (0.0..=1000.0).contains(&args.spin_us),
        "--spin-us {} is outside the allowed range 0 to 1000",
        args.spin_us
    );
    let NamedScene {
        scene, built_in, ..
    } = named_scene::load_or(args.scene.as_deref(), LOOPED)?;
    if args.print_scene {
        let text = match built_in {
            Some(built_in) => built_in.toml.to_owned(),
            None => scene.to_toml(),
        };
        context.say(text.trim_end())?;
        context.json(&serde_json::json!({ "scene": text }))?;
        return Ok(Outcome::Done);
    }
    anyhow::ensure!(
        scene.model.kind == ModelKind::Tissue,
        "the loop presses a continuum, and [model] kind is \"reference\"; remove it, or use `palpa view` or `palpa press`"
    );
    let out = context.out_dir()?;
    let live = LiveScene::build(&scene)?;
    if scene.model.dynamics != Dynamics::QuasiStatic {
        context.note(
            "[model] dynamics is not used in real time: the tissue is in equilibrium at every moment",
        );
    }
    for note in &live.notes {
        context.note(note);
    }
    let tissue = live.tissue()?;
    context.say(format!(
        "{} nodes; skin edges of {:.1} mm near the tool, zone of {} columns in a ring of {}",
        live.model.n_nodes(),
        live.mesh_size * 1e3,
        tissue.live().n_columns()[0],
        tissue.live().n_columns()[1],
    ))?;
    let log = out.path().join("log.mcap");
    let mut run = run_engine(args, context, &scene, &live, tissue, log)?;
    let log = Log::open(out.path().join("log.mcap"))?;
    let setup = Setup::new(&live, scene.motion.speed);
    let mut figures = Figures::new(&run, &log, &setup);
    if let Some(n) = args.audit.filter(|_| !context.is_interrupted()) {
        // An audit takes long and may be ended.
        out.write_json("loop.json", &figures)?;
        run.audit = Some(audit::audit(n.into(), &run, &log, &scene, &live, context)?);
        figures = Figures::new(&run, &log, &setup);
    }
    let subtitle = format!(
        "{} at up to {:.0} mm/s; {} in a {} hand",
        scene.motion.kind.name(),
        1e3 * scene.motion.speed,
        scene.device.preset.name(),
        scene.device.grip.name()
    );
    write(&figures, &log, &scene, &live, &subtitle, out)?;
    figures.say(context)?;
    for problem in verdicts::problems(&figures.verdicts) {
        context.say(format!("NOT GOOD: {problem}"))?;
    }
    if figures.is_good {
        let so_far = if context.is_interrupted() {
            ", in the part that was run"
        } else {
            ""
        };
        context.say(format!("GOOD: every guarantee was judged and kept{so_far}"))?;
        if figures.audit.is_none() {
            context.say(
                "How far the force is from that of finer meshes was not judged: --audit 12 does.",
            )?;
        }
    }
    context.say(format!("written to {}", out.path().display()))?;
    context.json(&figures)?;
    Ok(if context.is_interrupted() {
        Outcome::Interrupted
    } else if figures.is_good {
        Outcome::Done
    } else {
        Outcome::NotGood
    })
}

/// The results of a run.
struct Run {
    report: Report,
    /// When the ramp down at the end began, s on the loop's clock: later ticks do not count.
    until: f64,
    /// Spans of the path of the hand in which its target was still, s.
    still: Vec<[f64; 2]>,
    /// `None` if none were asked for.
    bars: Option<Vec<BarFigures>>,
    /// `None` if none was asked for.
    audit: Option<Audit>,
    /// What the system granted to the threads.
    threads: Vec<String>,
}

/// Runs for the requested time or until Ctrl-C, and then computes the error bars.
fn run_engine(
    args: &Args,
    context: &Context,
    scene: &Scene,
    live: &LiveScene,
    tissue: palpa::live::LiveTissue,
    log: PathBuf,
) -> anyhow::Result<Run> {
    let way = path(scene, &live.scene_from_device, args.seconds);
    let still = still_spans(&way, args.seconds);
    let device = open_device(&scene.device, way)?;
    let params = EngineParams {
        servo: servo_params(&*device),
        spin: args.spin_us * 1e-6,
        ..EngineParams::default()
    };
    let recorder = RecorderParams {
        path: Some(log),
        scene: scene.to_toml(),
        notes: notes_of(scene)?,
        machine: machine(),
    };
    context.begin_recording();
    let bar = context.progress(args.seconds.ceil() as usize, "real time");
    let mut bars = (!args.no_error_bars).then(|| Bars::new(scene, live));
    let (watch, mut looks) = Watch::new(LOOK_PERIOD);
    let tissue = match &bars {
        Some(_) => tissue.watched(watch),
        None => tissue,
    };
    let mut engine = Engine::start(tissue, vec![device], &params, &recorder)?;
    while engine.now() < args.seconds && !context.is_interrupted() {
        std::thread::sleep(Duration::from_millis(20));
        if let Some(bars) = &mut bars {
            bars.look(&mut engine, &mut looks);
        }
        bar.set_position(engine.now() as u64);
    }
    bar.finish_and_clear();
    let until = engine.now().min(args.seconds);
    let report = engine.stop();
    let threads = report.granted.iter().map(ToString::to_string).collect();
    Ok(Run {
        report,
        until,
        still,
        bars: bars.map(|bars| bars.probe(context)),
        audit: None,
        threads,
    })
}

fn write(
    figures: &Figures,
    log: &Log,
    scene: &Scene,
    live: &LiveScene,
    subtitle: &str,
    out: &OutDir,
) -> anyhow::Result<()> {
    out.write_json("loop.json", figures)?;
    picture::times(figures).save(out, "loop_times")?;
    let bars = figures.error_bars.as_deref().unwrap_or_default();
    picture::forces(log, bars, subtitle).save(out, "force_time")?;
    picture::depth(log, bars, scene.motion.above, subtitle).save(out, "force_depth")?;
    if scene.motion.kind.goes_across() {
        let along = across(&scene.motion, &live.scene_from_device);
        let ways = figures.audit.as_ref().map_or(&[][..], |audit| &audit.ways);
        picture::across(log, &along, ways, subtitle).save(out, "force_across")?;
    }
    Ok(())
}
