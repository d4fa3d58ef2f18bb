//! The moving step against converged equilibria of the same mesh.

use std::sync::Arc;

use palpa_fem::law::{Moduli, NeoHookean, Prony, PronyTerm};
use palpa_fem::realtime::{
    ExteriorMode, FineBodies, Live, LiveParams, LocalModel, Roaming, StepOutcome,
};
use palpa_fem::shape::{Pose, Sphere, Tool};
use palpa_fem::{
    FemError, Load, Material, Materials, Model, ModelParams, Outcome, PosedTool, SolveParams,
    State, Supports, Workspace, advance,
};
use palpa_mesh::generate::{Diagonal, Grid, LevelStack, mapped_grid};
use palpa_mesh::refine::{RefineParams, near_points, refine};
use palpa_mesh::{LayeredBody, Vec3};

/// Skin, fat and muscle, 60 mm square; its supports hold the base and, if asked, two sides.
fn model(n: usize, with_sides: bool) -> Arc<Model> {
    model_of(n, with_sides, None)
}

/// Skin, fat and muscle over 30 mm.
pub(crate) fn levels() -> LevelStack {
    LevelStack {
        depths: vec![0.0, 2e-3, 7e-3, 12e-3, 30e-3],
        interval_layer: vec![0, 1, 1, 2],
    }
}

/// A square block of so many cells a side.
pub(crate) fn block(n: usize, side: f64, jitter: Option<u64>, levels: &LevelStack) -> LayeredBody {
    let grid = Grid {
        n_cells: [n, n],
        diagonal: Diagonal::Alternate,
        jitter,
    };
    let place = |u: f64, v: f64| Vec3::new(side * (u - 0.5), side * (v - 0.5), 0.0);
    mapped_grid(&grid, place, levels)
}

pub(crate) fn model_of(n: usize, with_sides: bool, prony: Option<&Prony>) -> Arc<Model> {
    let levels = levels();
    let body = block(n, 0.06, Some(2), &levels);
    let mut supports = Supports::on_base(&body);
    if with_sides {
        let x = 0.03 - 1e-9;
        for (node, position) in body.positions.iter().enumerate() {
            if position.x > x {
                supports.planes.push((node, Vec3::x()));
            } else if position.x < -x {
                supports.fixed.push(node);
            }
        }
    }
    model_on(&body, &supports, prony)
}

fn model_on(body: &LayeredBody, supports: &Supports, prony: Option<&Prony>) -> Arc<Model> {
    let material = |young| {
        let law = NeoHookean::from_young(young, 0.45).unwrap();
        Material {
            prony: prony.cloned(),
            ..Material::new("t", law)
        }
    };
    let materials = Materials::of_layers(vec![material(100e3), material(5e3), material(30e3)]);
    Arc::new(Model::build(body, &materials, supports, ModelParams::default()).unwrap())
}

pub(crate) fn sphere(friction: f64) -> Tool {
    Tool::new(Sphere::new(8e-3).unwrap(), friction).unwrap()
}

pub(crate) fn at(tool: Tool, x: f64, y: f64, depth: f64) -> [PosedTool; 1] {
    let pose = Pose::translation(x, y, -depth);
    [PosedTool { tool, pose }]
}

/// The converged force after a path of tools.
fn converged(model: &Model, path: &[[PosedTool; 1]]) -> Vec3 {
    let mut state = State::new(model);
    let mut ws = Workspace::new(model);
    let mut force = Vec3::zeros();
    for pair in path.windows(2) {
        let before = Load {
            tools: &pair[0],
            ..Load::default()
        };
        let load = Load {
            tools: &pair[1],
            ..Load::default()
        };
        let report = advance(
            model,
            &mut state,
            &mut ws,
            &before,
            &load,
            &SolveParams::default(),
        );
        assert_eq!(report.outcome, Outcome::Converged, "{:?}", pair[1][0].pose);
        force = report.tool_forces[0];
    }
    force
}

/// Follows a path in steps; jobs are done at once. Returns the last force and how many zones there
/// were.
fn follow(live: &mut Live, path: impl Iterator<Item = [PosedTool; 1]>) -> (Vec3, u64) {
    let mut zones = 0;
    for tools in path {
        let report = live.step(&tools, 0.002);
        assert_eq!(report.outcome, StepOutcome::Arrived);
        zones = report.zone;
        if let Some(job) = live.take_job() {
            live.install(job.run());
        }
    }
    (live.tool_force(0), zones)
}

const MODES: [(f64, ExteriorMode); 3] = [
    (f64::INFINITY, ExteriorMode::Followed),
    (14e-3, ExteriorMode::Followed),
    (14e-3, ExteriorMode::Linear),
];

fn params((zone_radius, exterior): (f64, ExteriorMode)) -> LiveParams {
    LiveParams {
        zone_radius,
        exterior,
        stale: 1e-3,
        ..LiveParams::default()
    }
}

#[test]
fn a_press_is_followed_to_the_converged_force() {
    for with_sides in [false, true] {
        let model = model(13, with_sides);
        let tool = sphere(0.0);
        let (x, y) = (0.6e-3, -0.4e-3);
        let path: Vec<_> = (0..=4)
            .map(|k| at(tool, x, y, 1e-3 * f64::from(k)))
            .collect();
        let expected = converged(&model, &path);
        for mode in MODES {
            let mut live = Live::new(Arc::clone(&model), &path[0], params(mode)).unwrap();
            let steps = (1..=32).map(|k| at(tool, x, y, 0.125e-3 * f64::from(k)));
            let (moving, _) = follow(&mut live, steps);
            let error = (moving - expected).norm() / expected.norm();
            assert!(error < 0.01, "{mode:?}: {moving} {expected} {error}");
            // Held still it converges, and the body with it.
            let (still, _) = follow(&mut live, (0..30).map(|_| at(tool, x, y, 4e-3)));
            let error = (still - expected).norm() / expected.norm();
            assert!(error < 2e-3, "{mode:?}: {still} {expected} {error}");
        }
    }
}

#[test]
fn a_stroke_goes_from_zone_to_zone() {
    let model = model(13, false);
    for friction in [0.0, 0.4] {
        let tool = sphere(friction);
        let down = |k: u32| at(tool, -8e-3, 0.0, 0.25e-3 * f64::from(k));
        let along = |k: u32| at(tool, -8e-3 + 0.25e-3 * f64::from(k), 0.0, 2.5e-3);
        let path: Vec<_> = (0..=10).map(down).chain((1..=64).map(along)).collect();
        // Friction remembers the way there, in longer steps; without it only the end counts.
        let expected = if friction > 0.0 {
            let strokes = (1..=16).map(|k| along(4 * k));
            converged(
                &model,
                &(0..=5)
                    .map(|k| down(2 * k))
                    .chain(strokes)
                    .collect::<Vec<_>>(),
            )
        } else {
            let end = (0..=2).map(|k| at(tool, 8e-3, 0.0, 1.25e-3 * f64::from(k)));
            converged(&model, &end.collect::<Vec<_>>())
        };
        for mode in MODES {
            let mut live = Live::new(Arc::clone(&model), &path[0], params(mode)).unwrap();
            let (force, zones) = follow(&mut live, path[1..].iter().copied());
            assert!(mode.0.is_infinite() || zones > 2, "{mode:?}: {zones} zones");
            let error = (force - expected).norm() / expected.norm();
            let bound = if friction > 0.0 { 0.05 } else { 0.02 };
            assert!(
                error < bound,
                "{mode:?}, {friction}: {force} {expected} {error}"
            );
            if friction > 0.0 {
                // It is dragged back.
                assert!(force.x < -0.2 * force.z, "{force}");
            }
        }
    }
}

/// Where the coarse block is near to giving way under the ball, the true stiffness of the exterior
/// is more than twice that of a moment before: taken back whole, its forces out of balance would
/// grow from step to step, and swing.
#[test]
fn a_followed_exterior_does_not_swing() {
    let levels = LevelStack {
        depths: vec![0.0, 2e-3, 12e-3, 40e-3],
        interval_layer: vec![0, 1, 2],
    };
    let body = block(15, 0.1, None, &levels);
    let model = model_on(&body, &Supports::on_base(&body), None);
    let tool = Tool::new(Sphere::new(10e-3).unwrap(), 0.0).unwrap();
    let start = at(tool, -10e-3, 0.0, -1e-3);
    let whole = LiveParams {
        exterior: ExteriorMode::Followed,
        ..LiveParams::default()
    };
    for step in [0.02e-3, 0.0179e-3] {
        let mut live = Live::new(Arc::clone(&model), &start, whole).unwrap();
        let down = (1..=120_i32).map(|k| at(tool, -10e-3, 0.0, 0.05e-3 * f64::from(k) - 1e-3));
        let along = (1..=320_i32).map(|k| at(tool, -10e-3 + step * f64::from(k), 0.0, 5e-3));
        let mut before = 0.0;
        for (k, tools) in down.chain(along).enumerate() {
            let report = live.step(&tools, 4e-4);
            assert_eq!(report.outcome, StepOutcome::Arrived, "{report:?}");
            assert!(report.outside < 0.02, "{report:?}");
            let force = live.tool_force(0).norm();
            let change: f64 = force / before - 1.0;
            assert!(k <= 120 || change.abs() < 0.01, "{k}: {change}");
            before = force;
            if let Some(job) = live.take_job() {
                live.install(job.run());
            }
        }
    }
}

/// A block with edges of 4 mm within 24 mm of a place, and of 10 mm elsewhere.
#[derive(Debug)]
pub(crate) struct Meshes {
    pub(crate) coarse: LayeredBody,
    pub(crate) prony: Option<Prony>,
}

impl FineBodies for Meshes {
    fn place(&self, point: Vec3) -> Vec3 {
        let points = self.coarse.skin.points.iter();
        let nearest = points.min_by(|a, b| (*a - point).norm().total_cmp(&(*b - point).norm()));
        *nearest.unwrap()
    }

    fn radius(&self) -> f64 {
        24e-3
    }

    fn model(&self, place: Vec3) -> Result<Arc<Model>, FemError> {
        let near = near_points(&[place], self.radius(), 4e-3, 0.7);
        let body = refine(&self.coarse, &RefineParams::default(), near).body;
        Ok(model_on(
            &body,
            &Supports::on_base(&body),
            self.prony.as_ref(),
        ))
    }
}

#[test]
fn a_fine_mesh_moves_with_the_tool() {
    const LATE: u32 = 6;
    let levels = levels();
    let terms = vec![PronyTerm { g: 0.4, tau: 0.1 }];
    let prony = Prony::new(terms, Moduli::Instantaneous, true).unwrap();
    for (friction, prony) in [(0.0, None), (0.3, None), (0.0, Some(prony))] {
        let meshes = Meshes {
            coarse: block(10, 0.1, None, &levels),
            prony: prony.clone(),
        };
        // The same triangles everywhere.
        let fine = refine(&meshes.coarse, &RefineParams::default(), |_, _| 4e-3).body;
        let fine = model_on(&fine, &Supports::on_base(&fine), prony.as_ref());
        let tool = sphere(friction);
        let down = (1..=16).map(|k| at(tool, -25e-3, 1e-3, 0.25e-3 * f64::from(k)));
        let along = (1..=200).map(|k| at(tool, -25e-3 + 0.25e-3 * f64::from(k), 1e-3, 4e-3));
        let params = params((14e-3, ExteriorMode::Linear));
        let start = at(tool, -25e-3, 1e-3, -1e-3);
        let point = Vec3::new(-25e-3, 1e-3, 0.0);
        let mut roaming = Roaming::new(Arc::new(meshes), &start, params, point).unwrap();
        let mut whole = Live::new(Arc::clone(&fine), &start, params).unwrap();
        let (mut under, mut zone, mut before, mut meshes) = (None, None, 0.0_f64, 1);
        let (mut worst, mut jump) = (0.0_f64, 0.0_f64);
        for (k, tools) in (0_u32..).zip(down.chain(along)) {
            let is_due = |due: u32, is_given_up: bool| due <= k || is_given_up;
            let is_given_up = roaming.has_given_up_job();
            if let Some((_, done)) = under.take_if(|(due, _)| is_due(*due, is_given_up)) {
                roaming.install(done);
            }
            let report = roaming.step(&tools, 0.005);
            assert_eq!(report.outcome, StepOutcome::Arrived, "{k}: {report:?}");
            if let Some(job) = roaming.take_job() {
                under = Some((k + LATE, job.run()));
            }
            let is_given_up = whole.has_given_up_job();
            if let Some((_, done)) = zone.take_if(|(due, _)| is_due(*due, is_given_up)) {
                whole.install(done);
            }
            whole.step(&tools, 0.005);
            if let Some(job) = whole.take_job() {
                zone = Some((k + LATE, job.run()));
            }
            let (force, expected) = (roaming.live().tool_force(0), whole.tool_force(0));
            if k > 12 {
                worst = worst.max((force - expected).norm() / expected.norm());
            }
            if roaming.n_meshes()[0] > meshes {
                jump = jump.max((force.norm() / before - 1.0).abs());
            }
            meshes = roaming.n_meshes()[0];
            before = force.norm();
        }
        assert!(
            meshes > 2 && roaming.n_meshes()[1] == 0,
            "{:?}",
            roaming.n_meshes()
        );
        // The memory of a linear exterior lags by a job, and a mesh takes two.
        let bound = if prony.is_some() { 0.05 } else { 0.0125 };
        println!(
            "{friction} {}: {meshes} meshes, {worst:.4}, {jump:.4}",
            prony.is_some()
        );
        assert!(worst < bound, "{friction}: {worst}");
        let bound = if prony.is_some() { 0.012 } else { 0.005 };
        assert!(jump < bound, "{friction}: {jump}");
    }
}

/// The tool flies to a place that it was told of, and comes down before its mesh could be made from where it was.
#[test]
fn the_mesh_of_the_place_that_a_tool_flies_to_is_made_meanwhile() {
    const LATE: u32 = 6;
    let tool = sphere(0.0);
    let aim = Vec3::new(25e-3, 0.0, 0.0);
    // 50 mm in 0.1 s, 1.5 mm over the skin.
    let flight = (1..=20).map(|k| at(tool, -25e-3 + 2.5e-3 * f64::from(k), 0.0, -1.5e-3));
    let run = |is_told: bool| {
        let meshes = Meshes {
            coarse: block(10, 0.1, None, &levels()),
            prony: None,
        };
        let start = at(tool, -25e-3, 0.0, -1.5e-3);
        let params = params((14e-3, ExteriorMode::Linear));
        let mut body = Roaming::new(Arc::new(meshes), &start, params, -aim).unwrap();
        let down = (1..=10).map(|k| at(tool, 25e-3, 0.0, -1.5e-3 + 0.35e-3 * f64::from(k)));
        let (mut under, mut far) = (None, 0);
        for (k, tools) in (0_u32..).zip(flight.clone().chain(down)) {
            let is_given_up = body.has_given_up_job();
            if let Some((_, done)) = under.take_if(|(due, _)| *due <= k || is_given_up) {
                body.install(done);
            }
            body.set_aim(is_told.then_some(aim));
            far = far.max(body.step(&tools, 0.005).n_far);
            if let Some(job) = body.take_job() {
                under = Some((k + LATE, job.run()));
            }
        }
        let (middle, _) = body.fine().unwrap();
        ((middle - aim).norm(), body.n_meshes(), far)
    };
    let (off, meshes, far) = run(true);
    assert!(
        off < 10e-3 && meshes == [2, 0] && far == 0,
        "{off} {meshes:?} {far}"
    );
    // Told nothing, it presses outside the zone first.
    let (_, _, far) = run(false);
    assert!(far > 0);
}

/// A hand never stays at exactly the same place. While it stays within a micrometre, a body in equilibrium has nothing to do; a
/// hand that creeps is followed all the same.
#[test]
fn a_tool_that_stays_within_a_micrometre_needs_no_iterations() {
    let model = model(13, false);
    let tool = sphere(0.3);
    let place = |k: u32, by: f64| at(tool, 0.0, 0.0, 2e-3 + by * f64::from(k));
    let mut live = rested(&model, tool);
    let still: usize = (0..50)
        .map(|k| live.step(&place(k % 2, 0.4e-6), 0.002).iterations)
        .sum();
    assert_eq!(still, 0);
    let before = live.tool_force(0).z;
    let reports: Vec<_> = (0..100)
        .map(|k| live.step(&place(k, 0.4e-6), 0.002))
        .collect();
    let worked = reports
        .iter()
        .filter(|report| report.iterations > 0)
        .count();
    assert!((20..=50).contains(&worked), "{worked}");
    // 40 µm more of 2 mm.
    let change = live.tool_force(0).z / before - 1.0;
    assert!((0.015..0.05).contains(&change), "{change}");
}

/// A body in equilibrium with a tool that is 2 mm deep.
fn rested(model: &Arc<Model>, tool: Tool) -> Live {
    let params = params((14e-3, ExteriorMode::Linear));
    let mut live = Live::new(Arc::clone(model), &at(tool, 0.0, 0.0, 0.0), params).unwrap();
    for k in 0..100 {
        live.step(&at(tool, 0.0, 0.0, 0.1e-3 * f64::from(k.min(20))), 0.002);
        if let Some(job) = live.take_job() {
            live.install(job.run());
        }
    }
    live
}

/// The tool goes on while a zone is being made for it, in which columns are that were in none.
#[test]
fn zones_that_come_late_lose_nothing() {
    const LATE: u32 = 8;
    let model = model(25, false);
    let tool = sphere(0.0);
    let down = (1..=10).map(|k| at(tool, -10e-3, 0.0, 0.3e-3 * f64::from(k)));
    let along = (1..=80).map(|k| at(tool, -10e-3 + 0.25e-3 * f64::from(k), 0.0, 3e-3));
    let end = (0..=2).map(|k| at(tool, 10e-3, 0.0, 1.5e-3 * f64::from(k)));
    let expected = converged(&model, &end.collect::<Vec<_>>());
    let start = at(tool, -10e-3, 0.0, 0.0);
    let mut live = Live::new(
        Arc::clone(&model),
        &start,
        params((12e-3, ExteriorMode::Linear)),
    )
    .unwrap();
    let (mut under, mut zones, mut before) = (None, 1, 0.0_f64);
    for (k, tools) in (0_u32..).zip(down.chain(along)) {
        if let Some((_, done)) = under.take_if(|(due, _)| *due <= k) {
            live.install(done);
        }
        let report = live.step(&tools, 0.005);
        assert_eq!(report.outcome, StepOutcome::Arrived, "{k}: {report:?}");
        zones = zones.max(report.zone);
        if let Some(job) = live.take_job() {
            under = Some((k + LATE, job.run()));
        }
        let force = live.tool_force(0).norm();
        if k > 15 {
            assert!((force / before - 1.0).abs() < 0.03, "{k}: {force} {before}");
        }
        before = force;
    }
    assert!(zones > 3, "{zones} zones");
    let error = (live.tool_force(0) - expected).norm() / expected.norm();
    assert!(error < 0.02, "{error}");
}

#[test]
fn tissue_relaxes_under_a_tool_that_moves_and_holds() {
    const DT: f64 = 0.005;
    let terms = vec![
        PronyTerm { g: 0.4, tau: 0.03 },
        PronyTerm { g: 0.2, tau: 0.3 },
    ];
    let prony = Prony::new(terms, Moduli::Instantaneous, true).unwrap();
    let model = model_of(13, false, Some(&prony));
    let tool = sphere(0.0);
    // Down in 0.1 s, 15 mm along in 0.2 s, and still for 0.2 s.
    let path: Vec<_> = (0..=100_u32)
        .map(|k| {
            let (down, along) = (
                f64::from(k.min(20)) / 20.0,
                f64::from(k.clamp(20, 60) - 20) / 40.0,
            );
            at(tool, -7e-3 + 15e-3 * along, 0.0, 3e-3 * down)
        })
        .collect();
    let mut state = State::new(&model);
    let mut ws = Workspace::new(&model);
    let mut expected = Vec::new();
    for pair in path.windows(2) {
        let [before, load] = [&pair[0], &pair[1]].map(|tools| Load {
            tools,
            duration: DT,
            ..Load::default()
        });
        let report = advance(
            &model,
            &mut state,
            &mut ws,
            &before,
            &load,
            &SolveParams::default(),
        );
        assert_eq!(
            report.outcome,
            Outcome::Converged,
            "{report:?} {:?}",
            pair[1][0].pose
        );
        expected.push(report.tool_forces[0].z);
    }
    assert!(
        expected[99] < 0.85 * expected[60],
        "{} {}",
        expected[60],
        expected[99]
    );
    for (mode, bound) in MODES.into_iter().zip([0.01, 0.02, 0.05]) {
        let mut live = Live::new(Arc::clone(&model), &path[0], params(mode)).unwrap();
        let mut worst = 0.0_f64;
        for (k, tools) in path[1..].iter().enumerate() {
            live.step(tools, DT);
            if let Some(job) = live.take_job() {
                live.install(job.run());
            }
            if k >= 15 {
                let error = live.tool_force(0).z / expected[k] - 1.0;
                worst = worst.max(error.abs());
            }
        }
        assert!(worst < bound, "{mode:?}: {worst}");
    }
}

#[test]
fn it_lets_go_when_the_tool_leaves() {
    let model = model(13, false);
    let tool = sphere(0.3);
    let mut live = Live::new(
        Arc::clone(&model),
        &at(tool, 0.0, 0.0, 0.0),
        params(MODES[2]),
    )
    .unwrap();
    let steps = (1..=20).chain((-4..20).rev());
    let (force, _) = follow(
        &mut live,
        steps.map(|k| at(tool, 0.0, 0.0, 0.15e-3 * f64::from(k))),
    );
    assert_eq!(force, Vec3::zeros());
    follow(&mut live, (0..10).map(|_| at(tool, 0.0, 0.0, -1e-3)));
    live.settle();
    let most = live
        .displacements()
        .iter()
        .map(Vec3::norm)
        .fold(0.0, f64::max);
    // The exterior is linear about where it was last brought up to date.
    assert!(most < 5e-6, "{most}");
}

#[test]
fn a_body_at_rest_is_let_be_and_wakes_when_touched() {
    const DT: f64 = 0.01;
    let term = PronyTerm { g: 0.5, tau: 0.1 };
    let viscous = Prony::new(vec![term], Moduli::Instantaneous, true).unwrap();
    let tool = sphere(0.3);
    let press = |live: &mut Live| {
        for k in 1..=20 {
            live.step(&at(tool, 0.0, 0.0, 0.15e-3 * f64::from(k)), DT);
            if let Some(job) = live.take_job() {
                live.install(job.run());
            }
        }
        live.tool_force(0)
    };
    for (prony, mode) in [None, Some(&viscous)]
        .into_iter()
        .flat_map(|prony| MODES.map(|mode| (prony, mode)))
    {
        let what = format!("viscous: {}, {mode:?}", prony.is_some());
        // A linear exterior is that of the depth at which it was last brought up to date, at rest
        // or not.
        let (left_bound, force_bound) = match mode.1 {
            ExteriorMode::Followed => (5e-7, 1e-3),
            ExteriorMode::Linear => (2e-5, 0.04),
        };
        let model = model_of(13, false, prony);
        let away = at(tool, 0.0, 0.0, -5e-3);
        // Friction keeps what a step leaves out of balance, and two presses do not leave the same.
        let params = LiveParams {
            tolerance: 5e-5,
            ..params(mode)
        };
        let mut live = Live::new(Arc::clone(&model), &away, params).unwrap();
        let first = press(&mut live);
        // Four seconds are forty times the longest memory.
        let mut n_solved = 0;
        for _ in 0..400 {
            n_solved += live.step(&away, DT).iterations;
            if let Some(job) = live.take_job() {
                live.install(job.run());
            }
        }
        assert!(n_solved > 0, "{what}: the skin comes back");
        // It takes in what the last job has brought; no job is taken from here on.
        live.step(&away, DT);
        live.settle();
        let before = live.displacements().to_vec();
        let most = before.iter().map(Vec3::norm).fold(0.0, f64::max);
        assert!(most < left_bound, "{what}: {most} m are left");
        for _ in 0..20 {
            assert_eq!(live.step(&away, DT).iterations, 0, "{what}");
        }
        assert_eq!(live.displacements(), before, "{what}");
        let second = press(&mut live);
        let error = (second - first).norm() / first.norm();
        assert!(
            error < force_bound,
            "{what}: {first} N, and then {second} N"
        );
    }
}

#[test]
fn a_tool_that_stays_costs_nothing_until_it_moves_or_the_tissue_relaxes() {
    const DT: f64 = 0.005;
    let term = PronyTerm { g: 0.5, tau: 10.0 };
    let viscous = Prony::new(vec![term], Moduli::Instantaneous, true).unwrap();
    let tool = sphere(0.3);
    let step = |live: &mut Live, depth: f64| {
        let report = live.step(&at(tool, 0.0, 0.0, depth), DT);
        if let Some(job) = live.take_job() {
            live.install(job.run());
        }
        report
    };
    for (prony, mode) in [None, Some(&viscous)]
        .into_iter()
        .flat_map(|prony| MODES.map(|mode| (prony, mode)))
    {
        let what = format!("viscous: {}, {mode:?}", prony.is_some());
        let model = model_of(13, false, prony);
        let mut live = Live::new(model, &at(tool, 0.0, 0.0, -1e-3), params(mode)).unwrap();
        for k in 1..=30 {
            step(&mut live, 0.1e-3 * f64::from(k));
        }
        for _ in 0..40 {
            step(&mut live, 3e-3);
        }
        let (force, before) = (live.tool_force(0), live.displacements().to_vec());
        assert!(force.norm() > 0.1, "{what}: {force} N");
        for _ in 0..20 {
            let report = step(&mut live, 3e-3);
            assert_eq!(report.iterations == 0, prony.is_none(), "{what}");
            assert!(report.n_active > 0, "{what}: it still presses");
        }
        if prony.is_some() {
            assert!(
                live.tool_force(0).norm() < force.norm(),
                "{what}: it relaxes"
            );
            continue;
        }
        assert_eq!(live.tool_force(0), force, "{what}");
        assert_eq!(live.displacements(), before, "{what}");
        let report = step(&mut live, 3.1e-3);
        assert!(report.iterations > 0, "{what}");
        assert!(live.tool_force(0).norm() > 1.01 * force.norm(), "{what}");
    }
}

#[test]
fn a_pressed_tool_that_leaps_is_followed_in_short_steps() {
    let tool = sphere(0.0);
    for mode in MODES {
        let mut live = Live::new(
            model(13, false),
            &at(tool, -2.5e-3, 0.0, -1e-3),
            params(mode),
        )
        .unwrap();
        follow(
            &mut live,
            (1..=20).map(|k| at(tool, -2.5e-3, 0.0, 0.1e-3 * f64::from(k))),
        );
        let target = at(tool, 2.5e-3, 0.0, 4e-3);
        let mut n_behind = 0;
        loop {
            let report = live.step(&target, 5e-3);
            if let Some(job) = live.take_job() {
                live.install(job.run());
            }
            if report.outcome == StepOutcome::Arrived {
                break;
            }
            assert_eq!(report.outcome, StepOutcome::Behind, "{mode:?}");
            n_behind += 1;
            assert!(n_behind < 10, "{mode:?}: it never gets there");
        }
        assert!(n_behind >= 4, "{mode:?}: {n_behind} steps");
    }
}

#[test]
fn the_local_model_tells_the_force_of_a_small_further_press() {
    let model = model(19, false);
    let tool = sphere(0.0);
    let depth = 3e-3;
    let down =
        |n: i32| (1..=n).map(move |k| at(tool, 0.0, 0.0, depth * f64::from(k) / f64::from(n)));
    for most in [60, 12] {
        let mut live = Live::new(
            Arc::clone(&model),
            &at(tool, 0.0, 0.0, 0.0),
            params(MODES[0]),
        )
        .unwrap();
        let (force, _) = follow(&mut live, down(40));
        follow(&mut live, (0..5).map(|_| at(tool, 0.0, 0.0, depth)));
        let mut local = LocalModel::default();
        live.local_model(most, &mut local);
        assert!(local.contacts.len() <= most && !local.contacts.is_empty());
        let sum: Vec3 = local.contacts.iter().map(|c| c.force).sum();
        assert!((sum + force).norm() < 0.01 * force.norm(), "{sum} {force}");
        // Every contact that presses has no gap.
        for contact in local.contacts.iter().filter(|c| c.force != Vec3::zeros()) {
            let place = local.tools[0]
                .pose
                .inverse_transform_point(&contact.position.into());
            let gap = (place.coords - contact.surface).dot(&contact.normal);
            assert!(gap.abs() < 1e-9, "{gap}");
        }
        for i in 0..local.contacts.len() {
            for j in 0..local.contacts.len() {
                let (a, b) = (local.block(i, j), local.block(j, i).transpose());
                assert!((a - b).norm() < 1e-6 * local.block(i, i).norm());
            }
        }
        let further = 0.05e-3;
        let (next, _) = follow(
            &mut live,
            (1..=4).map(|k| at(tool, 0.0, 0.0, depth + further * f64::from(k) / 4.0)),
        );
        let predicted = local.tools[0].stiffness[(2, 2)] * further;
        let true_change = next.z - force.z;
        assert!(
            (predicted / true_change - 1.0).abs() < 0.1,
            "{predicted} {true_change}"
        );
    }
}

#[test]
fn a_step_too_far_backs_off_and_recovers() {
    let model = model(13, false);
    let tool = sphere(0.0);
    let mut live = Live::new(
        Arc::clone(&model),
        &at(tool, 0.0, 0.0, 0.0),
        params(MODES[1]),
    )
    .unwrap();
    let (mut bad, mut local) = (0, LocalModel::default());
    let jump = [2e-3, 31e-3, 31e-3, 31e-3, 31e-3, 31e-3];
    for depth in jump.into_iter().chain([2e-3; 40]) {
        let report = live.step(&at(tool, 0.0, 0.0, depth), 0.002);
        // A patch can be asked for after any step, failed ones too.
        live.local_model(60, &mut local);
        assert!(local.compliance.iter().all(|w| w.is_finite()));
        bad += u32::from(report.outcome != StepOutcome::Arrived);
        assert!(
            live.displacements()
                .iter()
                .all(|u| u.iter().all(|x| x.is_finite()))
        );
        // Never through the skin.
        let has_failed = matches!(report.outcome, StepOutcome::Held | StepOutcome::Failed);
        assert!(
            has_failed || depth < 30e-3 || report.n_active > 0,
            "{depth}: {report:?}"
        );
        if let Some(job) = live.take_job() {
            live.install(job.run());
        }
    }
    assert!(bad >= 5);
    let path: Vec<_> = [0.0, 1e-3, 2e-3].map(|d| at(tool, 0.0, 0.0, d)).to_vec();
    let expected = converged(&model, &path);
    let force = live.tool_force(0);
    assert!(
        (force - expected).norm() < 0.02 * expected.norm(),
        "{force} {expected}"
    );
}

#[test]
fn a_patch_after_a_failed_step_is_empty_and_the_force_is_that_of_the_state_returned_to() {
    let model = model(13, false);
    let mut n_failed = 0;
    for (mode, friction, leap) in [
        (MODES[0], 0.0, 25e-3),
        (MODES[1], 0.0, 31e-3),
        (MODES[1], 0.5, 28e-3),
        (MODES[2], 0.0, 28e-3),
        (MODES[2], 0.0, 31e-3),
    ] {
        let tool = sphere(friction);
        let start = at(tool, 0.0, 0.0, 0.0);
        let mut live = Live::new(Arc::clone(&model), &start, params(mode)).unwrap();
        let mut local = LocalModel::default();
        let mut forces = vec![Vec3::zeros()];
        let course = [3e-3; 8].into_iter().chain([leap; 60]).chain([3e-3; 60]);
        for depth in course {
            let report = live.step(&at(tool, 0.0, 0.0, depth), 0.002);
            live.local_model(60, &mut local);
            let force = live.tool_force(0);
            let sum: Vec3 = local.contacts.iter().map(|c| c.force).sum();
            assert!((local.tools[0].force - force).norm() == 0.0);
            if matches!(report.outcome, StepOutcome::Held | StepOutcome::Failed) {
                n_failed += 1;
                assert!(local.contacts.is_empty() && local.compliance.is_empty());
                let returned = |was: &Vec3| (was - force).norm() <= 1e-9 * force.norm();
                assert!(forces.iter().any(returned), "{force}");
            } else {
                forces.push(force);
                assert!((sum + force).norm() <= 1e-9 * force.norm().max(1.0));
            }
            if let Some(job) = live.take_job() {
                live.install(job.run());
            }
        }
    }
    assert!(n_failed >= 5, "{n_failed}");
}

#[test]
fn the_same_steps_and_jobs_give_the_same_bits() {
    let model = model(13, false);
    let tool = sphere(0.3);
    let run = || {
        let mut live = Live::new(
            Arc::clone(&model),
            &at(tool, -5e-3, 0.0, 0.0),
            params(MODES[2]),
        )
        .unwrap();
        let mut pending = None;
        let mut forces = Vec::new();
        for k in 0..80_i32 {
            let tools = at(
                tool,
                -5e-3 + 0.2e-3 * f64::from(k),
                0.0,
                0.1e-3 * f64::from(k.min(25)),
            );
            live.step(&tools, 0.002);
            forces.push(live.tool_force(0));
            // Results come a while after they were asked for.
            if k % 4 == 3
                && let Some(done) = pending.take()
            {
                live.install(done);
            }
            if pending.is_none() {
                pending = live.take_job().map(palpa_fem::realtime::Rebuild::run);
            }
        }
        forces
    };
    let (one, other) = (run(), run());
    assert!(one.iter().any(|f| f.norm() > 0.05));
    let bits = |forces: &[Vec3]| -> Vec<[u64; 3]> {
        forces
            .iter()
            .map(|f| [f.x.to_bits(), f.y.to_bits(), f.z.to_bits()])
            .collect()
    };
    assert_eq!(bits(&one), bits(&other));
}
