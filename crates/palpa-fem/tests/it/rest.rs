//! Bodies with tension in their layers begin, and begin again, at rest.

use std::sync::Arc;

use palpa_fem::law::{Moduli, NeoHookean, Prony, PronyTerm};
use palpa_fem::realtime::{ExteriorMode, FineBodies, Live, LiveParams, Roaming, StepOutcome};
use palpa_fem::{
    FemError, Load, Material, Materials, Model, ModelParams, Outcome, SolveParams, State, Supports,
    Workspace, advance,
};
use palpa_mesh::refine::{RefineParams, near_points, refine};
use palpa_mesh::{LayeredBody, Vec3};

use crate::realtime::{at, block, levels, sphere};

const DT: f64 = 0.005;
/// The tool is near an edge, where tension moves the skin.
const X: f64 = 16e-3;

const MODES: [ExteriorMode; 2] = [ExteriorMode::Followed, ExteriorMode::Linear];

fn params(exterior: ExteriorMode) -> LiveParams {
    LiveParams {
        zone_radius: 14e-3,
        exterior,
        ..LiveParams::default()
    }
}

/// Skin of 20 kPa tension, over fat and muscle.
fn tense(body: &LayeredBody, is_viscous: bool) -> Arc<Model> {
    let prony = is_viscous.then(|| {
        let term = PronyTerm { g: 0.4, tau: 0.05 };
        Prony::new(vec![term], Moduli::Instantaneous, true).unwrap()
    });
    let material = |young, prestress| Material {
        prony: prony.clone(),
        prestress,
        ..Material::new("t", NeoHookean::from_young(young, 0.45).unwrap())
    };
    let layers = vec![
        material(100e3, 20e3),
        material(5e3, 0.0),
        material(30e3, 0.0),
    ];
    let materials = Materials::of_layers(layers);
    let supports = Supports::on_base(body);
    Arc::new(Model::build(body, &materials, &supports, ModelParams::default()).unwrap())
}

/// The state in equilibrium with the tension, relaxed.
fn rest(model: &Model) -> State {
    let mut state = State::new(model);
    let mut ws = Workspace::new(model);
    let load = Load {
        duration: f64::INFINITY,
        ..Load::default()
    };
    let (before, params) = (Load::default(), SolveParams::default());
    let report = advance(model, &mut state, &mut ws, &before, &load, &params);
    assert_eq!(report.outcome, Outcome::Converged);
    state
}

fn largest(a: &[Vec3], b: &[Vec3]) -> f64 {
    let changes = a.iter().zip(b).map(|(a, b)| (a - b).norm());
    changes.fold(0.0, f64::max)
}

#[test]
fn a_body_under_tension_begins_in_balance() {
    let body = block(17, 0.06, Some(2), &levels());
    for is_viscous in [false, true] {
        let model = tense(&body, is_viscous);
        let rest = rest(&model).displacements;
        let tension = largest(&rest, &vec![Vec3::zeros(); rest.len()]);
        assert!(tension > 0.5e-3, "the tension moves it by {tension} m");
        for exterior in MODES {
            let away = at(sphere(0.0), X, 0.0, -5e-3);
            let mut live = Live::new(Arc::clone(&model), &away, params(exterior)).unwrap();
            let mut residual = 0.0_f64;
            for k in 0..20 {
                let report = live.step(&away, DT);
                assert_eq!(report.outcome, StepOutcome::Arrived, "{k}: {report:?}");
                residual = residual.max(report.residual).max(report.outside);
                assert_eq!(live.tool_force(0), Vec3::zeros());
                if let Some(job) = live.take_job() {
                    live.install(job.run());
                }
            }
            live.settle();
            let moved = largest(live.displacements(), &rest);
            println!("viscous: {is_viscous}, {exterior:?}: {moved:.2e} m, {residual:.2e}");
            // A thousandth of the smallest displacement that matters: the step of an encoder, 45 µm.
            // The first steps correct what statics leaves over.
            assert!(moved < 45e-9, "{exterior:?}: {moved} m");
            assert!(residual < LiveParams::default().tolerance, "{residual}");
        }
    }
}

#[test]
fn a_press_of_tense_skin_is_followed_to_the_converged_force() {
    let model = tense(&block(17, 0.06, Some(2), &levels()), false);
    let tool = sphere(0.0);
    let mut state = rest(&model);
    let mut ws = Workspace::new(&model);
    let mut expected = Vec3::zeros();
    for k in 0..4 {
        let tools = [k, k + 1].map(|k| at(tool, X, 0.0, 0.5e-3 * f64::from(k)));
        let [before, load] = [0, 1].map(|i| Load {
            tools: &tools[i],
            ..Load::default()
        });
        let params = SolveParams::default();
        let report = advance(&model, &mut state, &mut ws, &before, &load, &params);
        assert_eq!(report.outcome, Outcome::Converged);
        expected = report.tool_forces[0];
    }
    for exterior in MODES {
        let start = at(tool, X, 0.0, -1e-3);
        let mut live = Live::new(Arc::clone(&model), &start, params(exterior)).unwrap();
        for k in 0..80 {
            let depth = 2e-3 * f64::from(k.min(40)) / 40.0;
            live.step(&at(tool, X, 0.0, depth), DT);
            if let Some(job) = live.take_job() {
                live.install(job.run());
            }
        }
        let error = (live.tool_force(0) - expected).norm() / expected.norm();
        println!("{exterior:?}: {error:.5} of {} N", expected.norm());
        assert!(error < 0.01, "{exterior:?}: {error}");
    }
}

#[test]
fn a_body_under_tension_begins_again_at_rest() {
    for is_viscous in [false, true] {
        let model = tense(&block(17, 0.06, Some(2), &levels()), is_viscous);
        let rest = rest(&model).displacements;
        let tool = sphere(0.0);
        let mut sum = 0;
        for exterior in MODES {
            let start = at(tool, X, 0.0, -1e-3);
            // With more iterations these steps do not fail.
            let params = LiveParams {
                max_iterations: 2,
                ..params(exterior)
            };
            let mut live = Live::new(Arc::clone(&model), &start, params).unwrap();
            let mut n_again = 0;
            for k in 0..200 {
                // Deep, and deep at another place.
                let depth = if k < 4 { 0.5e-3 * f64::from(k) } else { 45e-3 };
                let x = if k / 20 % 2 == 0 { X } else { X - 12e-3 };
                let report = live.step(&at(tool, x, 0.0, depth), DT);
                let is_at_rest = live.displacements() == &*rest;
                n_again += u32::from(report.outcome == StepOutcome::Failed && is_at_rest);
                if let Some(job) = live.take_job() {
                    live.install(job.run());
                }
            }
            sum += n_again;
            // A pressed tool goes 0.7 mm a step, so the way out takes a hundred.
            let away = at(tool, X, 0.0, -8e-3);
            for _ in 0..160 {
                live.step(&away, DT);
                if let Some(job) = live.take_job() {
                    live.install(job.run());
                }
            }
            live.settle();
            let left = largest(live.displacements(), &rest);
            println!("viscous: {is_viscous}, {exterior:?}: {left:.2e} m left, {n_again} times");
            assert!(left < 1e-5, "{exterior:?}: {left} m");
        }
        assert!(sum > 0, "viscous: {is_viscous}: it never began again");
    }
}

/// The block with edges of 4 mm within 24 mm of a place, and of 10 mm elsewhere.
#[derive(Debug)]
struct TenseMeshes {
    coarse: LayeredBody,
    is_viscous: bool,
}

impl FineBodies for TenseMeshes {
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
        Ok(tense(&body, self.is_viscous))
    }
}

#[test]
fn each_fine_mesh_of_tense_skin_begins_at_its_own_rest() {
    for is_viscous in [false, true] {
        let meshes = TenseMeshes {
            coarse: block(10, 0.1, None, &levels()),
            is_viscous,
        };
        let tool = sphere(0.0);
        let along = |k: u32| at(tool, -35e-3 + 0.5e-3 * f64::from(k), 0.0, -3e-3);
        let point = Vec3::new(-35e-3, 0.0, 0.0);
        let params = params(ExteriorMode::Linear);
        // Slow enough in the air for meshes to follow.
        let dt = 0.5e-3 / 40e-3;
        let mut body = Roaming::new(Arc::new(meshes), &along(0), params, point).unwrap();
        let mut meshes = 0;
        for k in 0..140 {
            let report = body.step(&along(k), dt);
            assert_eq!(report.outcome, StepOutcome::Arrived, "{k}: {report:?}");
            assert_eq!(body.live().tool_force(0), Vec3::zeros());
            assert!(report.residual < params.tolerance, "{k}: {report:?}");
            if body.n_meshes()[0] > meshes {
                meshes = body.n_meshes()[0];
                body.live_mut().settle();
                let rest = rest(body.live().model()).displacements;
                let off = largest(body.live().displacements(), &rest);
                println!("viscous: {is_viscous}, mesh {meshes}: {off:.2e} m");
                assert!(off < 2e-6, "mesh {meshes}: {off} m");
            }
            if let Some(job) = body.take_job() {
                body.install(job.run());
            }
        }
        assert!(
            meshes > 2 && body.n_meshes()[1] == 0,
            "{:?}",
            body.n_meshes()
        );
    }
}
