//! The law of contact: no triangle can be felt, no load step changes friction, and nothing is left
//! out without a word.

use std::sync::Arc;

use palpa_fem::law::NeoHookean;
use palpa_fem::realtime::{ExteriorMode, Live, LiveParams, LocalModel, StepOutcome};
use palpa_fem::shape::{FlatPunch, Pose, Shape, Sphere, Tool};
use palpa_fem::{
    Load, Material, Materials, Model, ModelParams, Outcome, PosedTool, SolveParams, State,
    Supports, Workspace, advance,
};
use palpa_mesh::Vec3;
use palpa_mesh::generate::{GradedBlock, GradedLayer, LevelStack, Outline, graded_block};

/// A layer of gel with edges of `spacing` (m) within `fine` (m) of its middle.
fn gel(spacing: f64, fine: f64, jitter: Option<u64>) -> Arc<Model> {
    layer(0.45, spacing, fine, jitter)
}

/// The same with Poisson's ratio `nu`.
fn layer(nu: f64, spacing: f64, fine: f64, jitter: Option<u64>) -> Arc<Model> {
    let block = GradedBlock {
        outline: Outline::Square,
        half_width: 0.04,
        centre: [0.0; 2],
        ring_radius: Some(fine),
        spacing,
        inner_growth: 0.0,
        growth: 0.6,
        jitter,
    };
    let levels = LevelStack::graded(&[GradedLayer {
        thickness: 0.03,
        first_height: 2e-3,
        growth: 0.5,
    }]);
    let body = graded_block(&block, &levels);
    let law = NeoHookean::from_young(20e3, nu).unwrap();
    let materials = Materials::of_layers(vec![Material::new("gel", law)]);
    let supports = Supports::on_base(&body);
    Arc::new(Model::build(&body, &materials, &supports, ModelParams::default()).unwrap())
}

fn at(tool: Tool, x: f64, depth: f64) -> PosedTool {
    PosedTool {
        tool,
        pose: Pose::translation(x, 0.0, -depth),
    }
}

/// Forces of a tool at each of these places, one after the other.
fn forces(model: &Model, tool: Tool, places: &[[f64; 2]]) -> Vec<Vec3> {
    let (mut state, mut ws) = (State::new(model), Workspace::new(model));
    let mut tools = vec![at(tool, places[0][0], 0.0)];
    let go = |&[x, depth]: &[f64; 2]| {
        let before = std::mem::replace(&mut tools, vec![at(tool, x, depth)]);
        let [before, after] = [&before, &tools].map(|tools| Load {
            tools,
            ..Load::default()
        });
        let params = SolveParams::default();
        let report = advance(model, &mut state, &mut ws, &before, &after, &params);
        assert_eq!(report.outcome, Outcome::Converged, "{x} {depth}");
        report.tool_forces[0]
    };
    places.iter().map(go).collect()
}

fn sphere(friction: f64) -> Tool {
    Tool::new(Sphere::new(8e-3).unwrap(), friction).unwrap()
}

/// Three edges of the skin to the radius of the contact.
#[test]
fn a_stroke_across_a_triangle_feels_no_triangle() {
    const SPACING: f64 = 1.5e-3;
    const DEPTH: f64 = 2.6e-3;
    for jitter in [None, Some(4)] {
        let model = gel(SPACING, 9e-3, jitter);
        let steps = (0..=12).map(|k| [SPACING * f64::from(k) / 12.0, DEPTH]);
        let places: Vec<_> = [[0.0, 0.5 * DEPTH]].into_iter().chain(steps).collect();
        let along = &forces(&model, sphere(0.0), &places)[1..];
        let heights = || along.iter().map(|force| force.z);
        let (most, least) = (
            heights().fold(0.0, f64::max),
            heights().fold(f64::INFINITY, f64::min),
        );
        let ripple = most / least - 1.0;
        // The mesh must not pull the tool either.
        let pull = along.iter().map(|f| f.x.abs() / f.z).fold(0.0, f64::max);
        println!("{jitter:?}: ripple {ripple:.5}, pull {pull:.5}");
        assert!(ripple < 0.005, "{jitter:?}: {ripple}");
        assert!(pull < 0.005, "{jitter:?}: {pull}");
    }
}

/// A vertex is held where it first touches, however long the step.
#[test]
fn friction_does_not_depend_on_the_load_step() {
    let model = gel(1.5e-3, 9e-3, None);
    let punch = Shape::from(FlatPunch::new(6e-3, 3e-3).unwrap());
    for shape in [Shape::from(Sphere::new(8e-3).unwrap()), punch] {
        let tool = Tool::new(shape, 0.4).unwrap();
        let last = |n: u32| {
            let depth = |k: u32| 4e-3 * f64::from(k) / f64::from(n);
            let places: Vec<_> = (1..=n).map(|k| [0.0, depth(k)]).collect();
            forces(&model, tool, &places).last().unwrap().z
        };
        let (fine, coarse) = (last(40), last(4));
        println!("{}: {fine:.5} N, {coarse:.5} N", shape.name());
        assert!((coarse / fine - 1.0).abs() < 0.01, "{coarse} {fine}");
    }
}

/// The skin under a tool that moves sideways by a part of what lets all of it slip: a disc sticks and
/// the ring round it slips. No move is divided, however nearly incompressible the tissue is.
#[test]
fn a_tool_that_moves_sideways_slips_in_part() {
    const DEPTH: f64 = 1e-3;
    for nu in [0.3, 0.45, 0.4999] {
        let model = layer(nu, 1e-3, 5e-3, None);
        let tool = sphere(0.3);
        let (mut state, mut ws) = (State::new(&model), Workspace::new(&model));
        let mut tools = vec![at(tool, 0.0, 0.0)];
        let forth = [0.1e-3, 0.2e-3, 0.3e-3];
        let back = [0.1e-3, -0.2e-3];
        for (k, &x) in [0.0].iter().chain(&forth).chain(&back).enumerate() {
            let before = std::mem::replace(&mut tools, vec![at(tool, x, DEPTH)]);
            let [before, after] = [&before, &tools].map(|tools| Load {
                tools,
                ..Load::default()
            });
            let params = SolveParams::default();
            let report = advance(&model, &mut state, &mut ws, &before, &after, &params);
            let force = report.tool_forces[0];
            let pressed = state.touches.iter().filter(|t| t.pressure > 0.0);
            let (slips, all) = (pressed.clone().filter(|t| t.is_sliding), pressed);
            let (slips, all) = (slips.count(), all.count());
            let (iterations, substeps) = (report.iterations, report.substeps);
            println!("{nu}, {x}: {force:.4?}, {slips} of {all} slip, {iterations} in {substeps}");
            assert_eq!(report.outcome, Outcome::Converged, "{nu} {x}");
            assert!(force.x.abs() <= 0.3 * force.z, "{nu} {x}: {force}");
            if k > 0 {
                assert_eq!(substeps, 1, "{nu} {x}");
                assert!(iterations <= 12, "{nu} {x}: {iterations}");
                assert!(slips > 0 && slips < all, "{nu} {x}: {slips} of {all}");
            }
        }
    }
}

/// A wide flat tool on a fine mesh: more vertices press than the haptic loop has contacts.
#[test]
fn a_wide_tool_on_a_fine_mesh_presses_with_all_its_vertices() {
    let model = gel(1.2e-3, 11e-3, None);
    let tool = Tool::new(FlatPunch::new(10e-3, 2e-3).unwrap(), 0.0).unwrap();
    let depth = 1.5e-3;
    let expected = forces(&model, tool, &[[0.0, 0.5 * depth], [0.0, depth]])[1].z;
    let params = LiveParams {
        zone_radius: f64::INFINITY,
        ..LiveParams::default()
    };
    let mut live = Live::new(Arc::clone(&model), &[at(tool, 0.0, 0.0)], params).unwrap();
    let mut report = None;
    for k in 1..=16 {
        let tools = [at(tool, 0.0, depth * f64::from(k.min(12)) / 12.0)];
        report = Some(live.step(&tools, 0.005));
    }
    let report = report.unwrap();
    assert_eq!(report.outcome, StepOutcome::Arrived);
    assert!(report.n_active > 160, "{report:?}");
    assert_eq!(report.n_left_out, 0);
    let force = live.tool_force(0).z;
    assert!((force / expected - 1.0).abs() < 0.005, "{force} {expected}");
    // The loop gets all of the force, and the stiffness, in 60 contacts.
    let mut local = LocalModel::default();
    live.local_model(60, &mut local);
    assert!(local.contacts.len() <= 60);
    let sum: f64 = local.contacts.iter().map(|c| c.force.z).sum();
    assert!((sum + force).abs() < 1e-9 * force, "{sum} {force}");
    let mut all = LocalModel::default();
    live.local_model(400, &mut all);
    let [few, all] = [&local, &all].map(|local| local.tools[0].stiffness[(2, 2)]);
    assert!(few > 0.0 && (few / all - 1.0).abs() < 1e-9, "{few} {all}");
}

/// Two fingers far from each other are both felt.
#[test]
fn a_second_tool_far_away_presses_too() {
    let model = gel(2e-3, 20e-3, None);
    let params = LiveParams {
        zone_radius: 8e-3,
        ..LiveParams::default()
    };
    let tool = sphere(0.0);
    let tools = |depth| [at(tool, -15e-3, depth), at(tool, 15e-3, depth)];
    let mut live = Live::new(Arc::clone(&model), &tools(-1e-3), params).unwrap();
    for k in 0..=30 {
        let report = live.step(&tools(0.1e-3 * f64::from(k - 10)), 0.005);
        assert_eq!(report.outcome, StepOutcome::Arrived, "{k}");
        if let Some(job) = live.take_job() {
            live.install(job.run());
        }
    }
    let [left, right] = [0, 1].map(|tool| live.tool_force(tool).z);
    assert!(
        left > 0.05 && (right / left - 1.0).abs() < 0.05,
        "{left} {right}"
    );
}

/// A tool that comes down outside the zone is felt before any background job is done, and without a
/// jump when the zone has come.
#[test]
fn a_touch_outside_the_zone_is_felt_at_once() {
    let model = gel(3e-3, 30e-3, None);
    let params = LiveParams {
        zone_radius: 9e-3,
        exterior: ExteriorMode::Linear,
        ..LiveParams::default()
    };
    for friction in [0.0, 0.4] {
        let tool = sphere(friction);
        let depths = [1e-3, 2e-3, 3e-3, 4e-3];
        let expected = forces(&model, tool, &depths.map(|depth| [15e-3, depth]));
        let mut live = Live::new(Arc::clone(&model), &[at(tool, -15e-3, -5e-3)], params).unwrap();
        let step = |live: &mut Live, x: f64, depth: f64| {
            let report = live.step(&[at(tool, x, depth)], 0.002);
            (report, live.tool_force(0))
        };
        for k in 0..=20 {
            let (report, _) = step(&mut live, -15e-3 + 1.5e-3 * f64::from(k), -5e-3);
            assert_eq!((report.outcome, report.n_far), (StepOutcome::Arrived, 0));
        }
        let (mut before, mut last) = (0.0, Vec3::zeros());
        for k in -49..=40 {
            let depth = 0.1e-3 * f64::from(k);
            let (report, force) = step(&mut live, 15e-3, depth);
            assert_eq!(report.outcome, StepOutcome::Arrived, "{depth}: {report:?}");
            if depth > 0.1e-3 {
                assert!(report.n_far > 0 && force.z > before, "{depth}: {force}");
            }
            before = force.z;
            if let Some(i) = depths.iter().position(|d| (d - depth).abs() < 1e-9) {
                let error = force.z / expected[i].z - 1.0;
                println!("{friction}, {depth}: {force} {} {error:.3}", expected[i]);
                assert!(error.abs() < 0.3, "{depth}: {error}");
            }
        }
        // One job may be from the way there; then the zone comes.
        let mut largest = 0.0_f64;
        for k in 0..20 {
            if let Some(job) = live.take_job() {
                live.install(job.run());
            }
            let (report, force) = step(&mut live, 15e-3, 4e-3);
            // The zone follows the tool to its depth in some steps.
            let is_there = report.outcome == StepOutcome::Arrived;
            assert!(
                is_there || (k < 8 && report.outcome == StepOutcome::Behind),
                "{k}: {report:?}"
            );
            assert!(report.n_far == 0 || k < 2, "{k}: {report:?}");
            largest = largest.max(force.z);
            last = force;
        }
        assert!(largest < 1.1 * expected[3].z, "{largest}");
        let error = (last - expected[3]).norm() / expected[3].norm();
        // Friction remembers that the last part of the way there was one step.
        let bound = if friction > 0.0 { 0.04 } else { 0.01 };
        assert!(error < bound, "{last} {}", expected[3]);
    }
}

/// A step that fails leaves no trace in friction: the last good state has its own anchors.
#[test]
fn friction_that_slid_does_not_come_back_after_it_sticks() {
    let model = gel(2e-3, 14e-3, None);
    let tool = sphere(0.3);
    let params = LiveParams {
        zone_radius: f64::INFINITY,
        ..LiveParams::default()
    };
    let mut live = Live::new(Arc::clone(&model), &[at(tool, -3e-3, 0.0)], params).unwrap();
    let down = (1..=20).map(|k| [-3e-3, 0.1e-3 * f64::from(k)]);
    let along = (1..=60).map(|k| [-3e-3 + 0.1e-3 * f64::from(k), 2e-3]);
    for [x, depth] in down.clone().chain(along.clone()) {
        let report = live.step(&[at(tool, x, depth)], 0.002);
        assert_eq!(report.outcome, StepOutcome::Arrived);
        assert!(report.is_contact_settled);
    }
    let places: Vec<_> = down.chain(along).collect();
    let expected = *forces(&model, tool, &places).last().unwrap();
    let force = live.tool_force(0);
    // Sliding at the border of the cone: both components.
    assert!(
        (force - expected).norm() < 0.02 * expected.norm(),
        "{force} {expected}"
    );
    assert!(-force.x > 0.25 * force.z, "{force}");
}
