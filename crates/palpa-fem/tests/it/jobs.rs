//! Background jobs of the moving step: jobs that are lost, and memory that goes round.

use std::sync::Arc;

use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use palpa_fem::law::{Gent, Moduli, NeoHookean, Prony, PronyTerm, Volumetric};
use palpa_fem::realtime::{
    ExteriorMode, Live, LiveParams, LocalModel, Rebuild, Rebuilt, Roaming, StepOutcome,
};
use palpa_fem::{Material, Materials, Model, ModelParams, PosedTool, Supports};
use palpa_mesh::Vec3;

use crate::realtime::{Meshes, at, block, levels, model_of, sphere};

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

/// Steps that a job takes.
const LATE: usize = 5;
const DT: f64 = 0.005;

const MODES: [ExteriorMode; 2] = [ExteriorMode::Followed, ExteriorMode::Linear];

fn params(exterior: ExteriorMode) -> LiveParams {
    LiveParams {
        zone_radius: 12e-3,
        exterior,
        stale: 0.5e-3,
        ..LiveParams::default()
    }
}

fn prony() -> Prony {
    let terms = vec![
        PronyTerm { g: 0.3, tau: 0.02 },
        PronyTerm { g: 0.2, tau: 0.1 },
    ];
    Prony::new(terms, Moduli::Instantaneous, true).unwrap()
}

/// Down in 20 steps, 20 mm along in 80, and still for 60.
fn stroke() -> impl Iterator<Item = [PosedTool; 1]> {
    let tool = sphere(0.0);
    (1..=160_u32).map(move |k| {
        let down = f64::from(k.min(20)) / 20.0;
        let along = f64::from(k.clamp(20, 100) - 20) / 80.0;
        at(tool, -10e-3 + 20e-3 * along, 0.0, 3e-3 * down)
    })
}

/// Forces of a stroke in which jobs with these numbers are lost, and the zone of each step.
fn forces(model: &Arc<Model>, exterior: ExteriorMode, lost: &[usize]) -> Vec<(f64, u64)> {
    let start = at(sphere(0.0), -10e-3, 0.0, -1e-3);
    let mut live = Live::new(Arc::clone(model), &start, params(exterior)).unwrap();
    let mut out: Option<(usize, Option<Rebuilt>)> = None;
    let (mut n_jobs, mut forces) = (0, Vec::new());
    for (k, tools) in stroke().enumerate() {
        let is_given_up = live.has_given_up_job();
        match out.take_if(|(due, _)| *due <= k || is_given_up) {
            Some((_, Some(done))) => live.install(done),
            Some((_, None)) => live.job_failed(),
            None => {}
        }
        let report = live.step(&tools, DT);
        // While jobs are lost the tool may leave the zone.
        let is_good = report.outcome == StepOutcome::Arrived;
        let is_there = !matches!(report.outcome, StepOutcome::Held | StepOutcome::Failed);
        assert!(is_good || is_there && !lost.is_empty(), "{k}: {report:?}");
        forces.push((live.tool_force(0).z, report.zone));
        if let Some(job) = live.take_job() {
            n_jobs += 1;
            let done = (!lost.contains(&n_jobs)).then(|| job.run());
            out = Some((k + LATE, done));
        }
    }
    assert!(n_jobs > 8, "{n_jobs} jobs");
    forces
}

/// A zone, the job that makes another room, and three jobs in a row.
const LOST: [usize; 5] = [2, 3, 6, 7, 8];

#[test]
fn after_jobs_that_are_lost_the_body_catches_up() {
    for prony in [None, Some(prony())] {
        let model = model_of(25, false, prony.as_ref());
        for exterior in MODES {
            let what = format!("viscous: {}, {exterior:?}", prony.is_some());
            let expected = forces(&model, exterior, &[]);
            let found = forces(&model, exterior, &LOST);
            let error = |k: usize| (found[k].0 / expected[k].0 - 1.0).abs();
            let worst_of = |steps: std::ops::Range<usize>| steps.map(error).fold(0.0, f64::max);
            let zone = found[159].1;
            // Meanwhile the tool leaves its zone.
            let (without, with, last) = (worst_of(20..70), worst_of(80..160), worst_of(140..160));
            println!("{what}: {without:.5}, {with:.5}, {last:.5} at the end, zone {zone}");
            assert!(zone > found[60].1 && zone > 3, "{what}");
            assert!(with < 0.01, "{what}: {with}");
            assert!(last < 0.001, "{what}: {last}");
        }
    }
}

/// After a job that took long, a hand that hurries to another place gets a zone of the usual size: with one that covers
/// all of its way, jobs would take ever longer.
#[test]
fn a_hand_that_hurries_after_a_slow_job_gets_no_huge_zone() {
    const SLOW: usize = 60;
    let model = model_of(25, false, None);
    let start = at(sphere(0.0), -15e-3, 0.0, -1e-3);
    let mut live = Live::new(model, &start, params(ExteriorMode::Linear)).unwrap();
    let usual = live.n_columns()[0];
    let mut out: Option<(usize, Rebuilt)> = None;
    let (mut largest, mut n_zones) = (0, 0);
    for k in 0..400_usize {
        if let Some((_, done)) = out.take_if(|(due, _)| *due <= k) {
            live.install(done);
        }
        // To and fro over 30 mm, ten times a second.
        let phase = k as f64 * DT / 0.1;
        let along = 30e-3 * (phase % 2.0 - 1.0).abs() - 15e-3;
        let report = live.step(&at(sphere(0.0), along, 0.0, -1e-3), DT);
        n_zones = report.zone;
        largest = largest.max(live.n_columns()[0]);
        if let Some(job) = live.take_job() {
            out = Some((k + SLOW, job.run()));
        }
    }
    println!("zones of {usual} columns at first, {largest} at most, {n_zones} zones");
    assert!(n_zones > 3);
    assert!(largest as f64 <= 1.6 * usual as f64, "{usual} {largest}");
}

/// A zone is made for the place where the tool will be while it serves, so jobs may take as long as the tool
/// needs for a quarter of the zone's radius. Where one comes later, as when the tool begins to stroke while a long job
/// is under way, the steps with a wrong force say so.
#[test]
fn slow_jobs_make_their_zones_ahead_of_the_tool_or_steps_say_that_they_are_late() {
    const SLOW: usize = 20;
    let model = model_of(25, false, None);
    let tool = sphere(0.0);
    let way = || {
        (1..=240_u32).map(move |k| {
            let down = f64::from(k.min(60)) / 60.0;
            let along = f64::from(k.clamp(60, 200) - 60);
            at(tool, -9e-3 + 0.13e-3 * along, 0.0, 3e-3 * down)
        })
    };
    let start = at(tool, -9e-3, 0.0, -1e-3);
    let forces = |late: usize| -> Vec<(f64, bool)> {
        let params = LiveParams {
            zone_radius: 9e-3,
            ..params(ExteriorMode::Linear)
        };
        let mut live = Live::new(Arc::clone(&model), &start, params).unwrap();
        let (mut out, mut zone) = (None, 0);
        let forces = way().enumerate().map(|(k, tools)| {
            if let Some((_, done)) = out.take_if(|(due, _)| *due <= k) {
                live.install(done);
            }
            let report = live.step(&tools, DT);
            let is_late = report.outcome == StepOutcome::Behind;
            assert!(
                is_late || report.outcome == StepOutcome::Arrived,
                "{late}, {k}: {report:?}"
            );
            zone = report.zone;
            if let Some(job) = live.take_job() {
                out = Some((k + late, job.run()));
            }
            (live.tool_force(0).z, is_late)
        });
        let forces = forces.collect();
        assert!(zone > 4, "{zone} zones");
        forces
    };
    let expected = forces(1);
    for late in [SLOW, SLOW + 3, SLOW + 6, SLOW + 10] {
        let found = forces(late);
        let n_late = found.iter().filter(|found| found.1).count();
        let errors = expected.iter().zip(&found).skip(60);
        let errors = errors.map(|(a, b)| ((b.0 / a.0 - 1.0).abs(), b.1));
        let unsaid = errors.filter(|error| !error.1).map(|error| error.0);
        let worst = unsaid.fold(0.0, f64::max);
        println!("{late}: {n_late} steps late, others {worst:.4} off at most");
        assert!(worst < 0.03, "{late}: {worst}");
        assert!(
            n_late < 30 && (late > SLOW || n_late == 0),
            "{late}: {n_late}"
        );
    }
}

/// A factor that is under way is given up for a zone that is due, which then comes sooner. Whether its thread noticed or
/// had done already makes no difference to any bit, so that a replay is the same.
#[test]
fn a_factor_gives_way_to_a_zone() {
    const LONG: usize = 14;
    /// How soon the thread of a job notices: it has done before, at once, or not at all.
    #[derive(Clone, Copy, PartialEq)]
    enum Thread {
        Quick,
        Slow,
        Deaf,
    }
    enum Under {
        Way(Rebuild),
        Done(Rebuilt),
    }
    let start = at(sphere(0.0), -10e-3, 0.0, -1e-3);
    for prony in [None, Some(prony())] {
        let model = model_of(25, false, prony.as_ref());
        let go = |thread: Thread| -> (Vec<[u64; 3]>, usize, u64) {
            let params = LiveParams {
                stale: 0.2e-3,
                ..params(ExteriorMode::Linear)
            };
            let mut live = Live::new(Arc::clone(&model), &start, params).unwrap();
            let mut out: Option<(usize, Under)> = None;
            let (mut forces, mut n_given_up, mut zones) = (Vec::new(), 0, 0);
            for (k, tools) in stroke().enumerate() {
                match out.take_if(|(due, _)| *due <= k) {
                    Some((_, Under::Way(job))) => live.install(job.run()),
                    Some((_, Under::Done(done))) => live.install(done),
                    None => {}
                }
                let report = live.step(&tools, DT);
                let force = live.tool_force(0);
                forces.push([force.x, force.y, force.z].map(f64::to_bits));
                zones += report.zone;
                if let (true, Some((due, _))) = (live.has_given_up_job(), &mut out)
                    && *due > k + 1
                {
                    n_given_up += 1;
                    if thread != Thread::Deaf {
                        *due = k + 1;
                    }
                }
                if let Some(job) = live.take_job() {
                    let job = match thread {
                        Thread::Quick => Under::Done(job.run()),
                        Thread::Slow | Thread::Deaf => Under::Way(job),
                    };
                    out = Some((k + LONG, job));
                }
            }
            (forces, n_given_up, zones)
        };
        let [quick, slow, deaf] = [Thread::Quick, Thread::Slow, Thread::Deaf].map(go);
        println!("viscous: {}: {} given up", prony.is_some(), slow.1);
        assert!(slow.1 > 0);
        assert!(quick == slow);
        // Zones come sooner: the sum of their numbers over all steps is larger.
        assert!(slow.2 > deaf.2, "{} {}", slow.2, deaf.2);
    }
}

#[test]
fn after_jobs_that_are_lost_the_mesh_moves_on() {
    for prony in [None, Some(prony())] {
        let tool = sphere(0.0);
        let start = at(tool, -25e-3, 1e-3, -1e-3);
        let point = Vec3::new(-25e-3, 1e-3, 0.0);
        let run = |is_lost: &dyn Fn(usize) -> bool| {
            let meshes = Meshes {
                coarse: block(10, 0.1, None, &levels()),
                prony: prony.clone(),
            };
            let params = LiveParams {
                zone_radius: 14e-3,
                ..params(ExteriorMode::Linear)
            };
            let mut body = Roaming::new(Arc::new(meshes), &start, params, point).unwrap();
            let mut out = None;
            let mut n_jobs = 0;
            for k in 0..260 {
                let (down, along) = ((k.min(16) as f64) / 16.0, (k.clamp(16, 216) - 16) as f64);
                let tools = at(tool, -25e-3 + 0.25e-3 * along, 1e-3, 4e-3 * down);
                match out.take_if(|(due, _)| *due <= k) {
                    Some((_, Some(done))) => body.install(done),
                    Some((_, None)) => body.job_failed(),
                    None => {}
                }
                body.step(&tools, DT);
                if let Some(job) = body.take_job() {
                    n_jobs += 1;
                    out = Some((k + LATE, (!is_lost(n_jobs)).then(|| job.run())));
                }
            }
            (body.live().tool_force(0).z, body.n_meshes())
        };
        let (expected, meshes) = run(&|_| false);
        // Zones, meshes and moves.
        let (force, found) = run(&|n| [2, 3, 5, 8, 13, 21, 34].contains(&n));
        println!("{force} N, {expected} N; {found:?} and {meshes:?} meshes");
        assert!(found[0] > 2 && found[1] == 0, "{found:?} and {meshes:?}");
        assert!((force / expected - 1.0).abs() < 0.01, "{force} {expected}");
    }
}

/// A body whose fat has a law that the lanes do not have.
fn mixed() -> Arc<Model> {
    let body = block(25, 0.06, Some(2), &levels());
    let material = |young| Material {
        prony: Some(prony()),
        ..Material::new("t", NeoHookean::from_young(young, 0.45).unwrap())
    };
    let gent = Gent::new(2e3, 10.0, Volumetric::Quadratic { bulk: 20e3 }).unwrap();
    let fat = Material {
        prony: Some(prony()),
        ..Material::new("fat", gent)
    };
    let materials = Materials::of_layers(vec![material(100e3), fat, material(30e3)]);
    let supports = Supports::on_base(&body);
    Arc::new(Model::build(&body, &materials, &supports, ModelParams::default()).unwrap())
}

#[test]
fn steps_and_zones_neither_allocate_nor_free() {
    let bodies = [
        ("elastic", model_of(25, false, None)),
        ("viscous", model_of(25, false, Some(&prony()))),
        ("viscous, some pairs one by one", mixed()),
    ];
    for (what, model) in bodies {
        for exterior in MODES {
            let start = at(sphere(0.3), -10e-3, 0.0, -1e-3);
            let live = Live::new(Arc::clone(&model), &start, params(exterior)).unwrap();
            let mut body = Roaming::fixed(live);
            let mut local = LocalModel::default();
            local.contacts.reserve(60);
            local.tools.reserve(1);
            local.compliance.reserve(9 * 60 * 60);
            let (mut out, mut zones, mut n_jobs) = (None, [0; 2], 0);
            for (k, tools) in stroke().enumerate() {
                let done = out.take_if(|(due, _)| *due <= k).map(|(_, done)| done);
                let step = || {
                    match done {
                        Some(Some(done)) => body.install(done),
                        Some(None) => body.job_failed(),
                        None => {}
                    }
                    let report = body.step(&tools, DT);
                    body.live_mut().local_model(60, &mut local);
                    (report.zone, body.take_job())
                };
                // The first steps touch the skin and fill buffers.
                let (zone, job) = if k < 10 {
                    step()
                } else {
                    assert_no_alloc(step)
                };
                if k == 10 {
                    zones[0] = zone;
                }
                zones[1] = zone;
                if let Some(job) = job {
                    // One is lost, with the room that it had.
                    n_jobs += 1;
                    out = Some((k + LATE, (n_jobs != 7).then(|| job.run())));
                }
            }
            assert!(n_jobs > 10, "{what}, {exterior:?}: {n_jobs} jobs");
            assert!(zones[1] > zones[0] + 2, "{what}, {exterior:?}: {zones:?}");
        }
    }
}
