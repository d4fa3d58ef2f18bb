//! The moving step under a sphere that strokes to and fro, and its patch, wall time. `palpa bench`
//! has rates with their errors.

use std::sync::Arc;

use criterion::{Criterion, criterion_group, criterion_main};
use palpa_fem::PosedTool;
use palpa_fem::realtime::{Live, LocalModel};
use palpa_fem::shape::{Pose, Sphere, Tool};
use palpa_lab::bench::{Mode, cases, ride};
use palpa_mesh::Vec3;

/// How deep the sphere is, m, how far it goes to and fro, m, and in a step, m.
const DEPTH: f64 = 3e-3;
const SWAY: f64 = 2e-3;
const TRAVEL: f64 = 0.1e-3;
/// Contacts that the 1 kHz loop gets at most.
const MOST_CONTACTS: usize = 60;

fn tool(radius: f64, at: Vec3) -> [PosedTool; 1] {
    let sphere = Sphere::new(radius).expect("a valid radius");
    [PosedTool {
        tool: Tool::new(sphere, 0.0).expect("no friction is valid"),
        pose: Pose::translation(at.x, at.y, at.z),
    }]
}

fn moving_step(criterion: &mut Criterion) {
    for (name, mode) in [
        ("1k", Mode::Whole),
        ("4k", Mode::Whole),
        ("4k", Mode::Zone),
        ("16k", Mode::Zone),
    ] {
        let case = cases().iter().find(|case| case.name == name);
        let case = case.expect("a case of this name");
        let model = case.model().expect("a body that can be computed with");
        let (at, radius) = (case.ride().at, case.radius);
        let params = ride::params(mode, 15e-3);
        let start = tool(radius, at);
        let mut live =
            Live::new(Arc::clone(&model), &start, params).expect("a body that can be at rest");
        let n_down = (DEPTH / TRAVEL).round() as usize;
        let mut step = 0_usize;
        let mut advance = |live: &mut Live| {
            step += 1;
            let down = step.min(n_down) as f64 * TRAVEL;
            let phase = (step as f64 * TRAVEL / SWAY) % 2.0;
            let sway = SWAY * phase.min(2.0 - phase);
            live.step(
                &tool(radius, at + Vec3::new(sway, 0.0, -down)),
                TRAVEL / 0.05,
            )
        };
        for _ in 0..2 * n_down {
            advance(&mut live);
            if let Some(job) = live.take_job() {
                live.install(job.run());
            }
        }
        let id = format!("step, {name}, {}", mode.name());
        criterion.bench_function(&id, |bencher| bencher.iter(|| advance(&mut live)));
        let mut local = LocalModel::default();
        let id = format!("patch, {name}, {}", mode.name());
        criterion.bench_function(&id, |bencher| {
            bencher.iter(|| live.local_model(MOST_CONTACTS, &mut local));
        });
    }
}

criterion_group!(benches, moving_step);
criterion_main!(benches);
