//! Force while moving: the shipped moving step and law against converged equilibria on the same
//! mesh, in simulated time.

use palpa::live::{LiveScene, RehearsalParams};
use palpa_device::Path as Way;
use palpa_device::Vec3;
use palpa_lab::trace::{TraceRow, force_while_moving, trace_picture};
use palpa_testkit::Scene;

use crate::{live, results};

const ABOVE: f64 = 5e-3;
const DEPTH: f64 = 7e-3;
/// Time of a tissue step, s.
const STEP_TIME: f64 = 4e-3;
/// The law lets its whole force through half a second after the start. s
const START: f64 = 0.8;

/// The layers of benchmark B2, with a mesh for a motion.
fn scene(motion: &str) -> LiveScene {
    let scene = Scene::skin_fat_muscle(2, 2)
        .press(7.0)
        .near_tool(3.0)
        .growth(0.8)
        .motion(motion, 7.0)
        .set("motion", "length", "10 mm")
        .set("motion", "above", "5 mm");
    live(&scene)
}

fn down(from: Vec3) -> Vec3 {
    from - Vec3::z() * (ABOVE + DEPTH)
}

fn press(speed: f64) -> Way {
    Way::from(Vec3::zeros())
        .hold(START)
        .to(down(Vec3::zeros()), speed)
        .hold(0.3)
}

fn stroke(speed: f64, half: f64) -> Way {
    let [from, to] = [-half, half].map(|x| Vec3::x() * x);
    Way::from(from)
        .hold(START)
        .to(down(from), 0.02)
        .hold(0.2)
        .to(down(to), speed)
        .hold(0.3)
}

fn trace(live: &LiveScene, way: &Way) -> Vec<TraceRow> {
    let params = RehearsalParams {
        step_time: STEP_TIME,
        duration: way.duration(),
        ..RehearsalParams::default()
    };
    force_while_moving(live, ABOVE, way, &params, 8).unwrap()
}

/// The worst row past a depth (mm) while moving, and the worst relative error in the last 0.1 s,
/// when the tool is held still.
fn worst(rows: &[TraceRow], past_mm: f64) -> (TraceRow, f64) {
    let excess = |r: &&TraceRow| r.error_n / (0.05 * r.static_force_n.abs()).max(0.03);
    let moving = rows.iter().filter(|r| r.depth_mm > past_mm);
    let worst = moving
        .max_by(|a, b| excess(a).total_cmp(&excess(b)))
        .unwrap();
    let end = rows.last().unwrap().time_s - 0.1;
    let still = rows.iter().filter(|r| r.time_s > end);
    let held = still.map(TraceRow::share).max_by(f64::total_cmp).unwrap();
    (*worst, held)
}

/// The promise: within 5 % or 0.03 N past 2 mm (4 mm at 100 mm/s), 2 % held still.
#[test]
fn force_while_moving_stays_near_the_converged_one() {
    let (still, wide) = (scene("press"), scene("stroke"));
    println!(
        "{} nodes for presses, {} for the stroke",
        still.model.n_nodes(),
        wide.model.n_nodes()
    );
    let cases = [
        ("press at 20 mm/s", &still, press(0.02), 2.0),
        ("press at 50 mm/s", &still, press(0.05), 2.0),
        ("press at 100 mm/s", &still, press(0.1), 4.0),
        ("stroke at 50 mm/s", &wide, stroke(0.05, 5e-3), 2.0),
    ];
    let out = results("moving");
    let mut traces = Vec::new();
    let mut failures = Vec::new();
    for (name, live, way, past) in &cases {
        let rows = trace(live, way);
        let (row, held) = worst(&rows, *past);
        println!(
            "{name}: worst past {past} mm {:.1} % = {:.4} N of {:.3} N at {:.2} mm; held still {:.2} %",
            100.0 * row.share(),
            row.error_n,
            row.static_force_n,
            row.depth_mm,
            100.0 * held
        );
        if !row.is_within(0.05, 0.03) || held > 0.02 {
            failures.push(*name);
        }
        let mut table = out
            .table::<TraceRow>(&format!("{}.csv", name.replace([' ', '/'], "_")))
            .unwrap();
        for row in &rows {
            table.push(row).unwrap();
        }
        table.finish().unwrap();
        let from = START - 0.05;
        traces.push((
            *name,
            rows.into_iter().filter(|r| r.time_s > from).collect(),
        ));
    }
    let title = "Force while moving: layered block, ball of radius 10 mm, tissue steps of 4 ms";
    trace_picture(title, &traces)
        .save(&out, "force_while_moving")
        .unwrap();
    assert!(failures.is_empty(), "{failures:?}");
}
