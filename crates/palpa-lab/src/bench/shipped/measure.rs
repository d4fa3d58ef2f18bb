//! Measures a case: rate over all places, error at poses drawn along each way.

use fastrand::Rng;
use palpa::audit::{
    LEAST_FORCE, LONGEST_TIME, LONGEST_WAY, Pressed, Quality, REFERENCE_SHARE, Reference, Stop,
    has_history, quantile, relaxes, thinned,
};
use palpa::live::{ACCURACY, LiveScene};
use palpa_mesh::Vec3;
use rayon::prelude::*;

use super::drive::{Driven, Felt, Part, StepTime, drive};
use super::places::{Spot, draw_spots};
use super::{PoseRow, ShippedCase, ShippedRow};

/// Poses are drawn from this depth on, m.
const FROM_DEPTH: f64 = 2e-3;
const SEED: u64 = 7;
/// Ticks of each part of a way in which the force is compared with that of steps that take no time.
const TICKS: usize = 100;

/// How much is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MeasureParams {
    /// Number of places.
    pub n_places: usize,
    /// Poses that are solved again on each part of the way: down, across, and up.
    pub n_poses: usize,
}

/// What is found of a case.
#[derive(Debug, Clone)]
pub struct Measured {
    /// Its row of the table.
    pub row: ShippedRow,
    /// Its poses that were solved again.
    pub poses: Vec<PoseRow>,
}

/// What the audit of a way finds.
#[derive(Debug, Default)]
struct Audit {
    poses: Vec<PoseRow>,
    /// Least number of nodes of a reference mesh.
    nodes: Option<usize>,
    /// See [`ShippedRow::reference_change`].
    change: Option<f64>,
}

/// Measures a case: goes all ways one after the other, then solves poses of several ways at a time.
/// `goes_on` is asked before each place and pose; if it returns false, what was measured until then is
/// the result.
///
/// # Errors
/// If the body cannot be grown or pressed, or a place has no room.
pub fn measure(
    case: &ShippedCase,
    params: &MeasureParams,
    goes_on: impl Fn() -> bool + Sync,
) -> anyhow::Result<Measured> {
    let mut row = ShippedRow {
        case: case.name.clone(),
        accuracy: case.scene.mesh.accuracy.unwrap_or(ACCURACY),
        hand_mm_per_s_min: f64::INFINITY,
        ..ShippedRow::default()
    };
    let (mut times, mut ways, mut n_nodes) = (Vec::new(), Vec::new(), 0);
    let (mut duration, mut background) = (0.0, 0.0);
    let mut moving: Vec<Moving> = Vec::new();
    let spots = draw_spots(case, params.n_places, &goes_on)?;
    for (spot, live) in &spots {
        if !goes_on() {
            break;
        }
        let scene = spot.scene(&case.scene);
        let driven = drive(&scene, live, StepTime::Own)?;
        if !goes_on() {
            break;
        }
        let ideal = drive(&scene, live, StepTime::Zero)?;
        note(&mut row, spot, &driven);
        let ticks = drawn(&ideal.felt, TICKS, ways.len());
        moving.extend(ticks.iter().map(|&i| Moving {
            part: ideal.felt[i].part,
            error: share(driven.felt[i].force, ideal.felt[i].force),
            is_whole: driven.felt[i].is_whole,
        }));
        let poses = drawn(&ideal.felt, params.n_poses, ways.len());
        n_nodes += live.model.n_nodes();
        duration += driven.duration;
        background += driven.background;
        times.extend(driven.times);
        ways.push((live, driven.felt, poses));
    }
    anyhow::ensure!(row.n_places > 0, "no place was measured");
    row.nodes = n_nodes / row.n_places;
    let whole: f64 = times.iter().sum();
    times.sort_by(f64::total_cmp);
    row.n_steps = times.len();
    row.steps_per_s_mean = times.len() as f64 / whole;
    row.step_ms_p99 = quantile(&times, 0.99).unwrap_or(f64::NAN) * 1e3;
    row.background_cpu_share = background / duration;
    row.steps_cpu_share = whole / duration;
    enter_motion(&mut row, &moving);
    let audits = ways.par_iter().enumerate().map(|(k, (live, felt, poses))| {
        if goes_on() {
            audit(felt, live, poses, (&row, k), &goes_on)
        } else {
            Ok(Audit::default())
        }
    });
    let audits = audits.collect::<anyhow::Result<Vec<Audit>>>()?;
    row.reference_nodes = audits.iter().filter_map(|audit| audit.nodes).min();
    row.reference_change = audits.iter().find_map(|audit| audit.change);
    let poses: Vec<PoseRow> = audits.into_iter().flat_map(|audit| audit.poses).collect();
    enter_errors(&mut row, &poses);
    Ok(Measured { row, poses })
}

fn note(row: &mut ShippedRow, spot: &Spot, driven: &Driven) {
    let speed = spot.speed * 1e3;
    row.hand_mm_per_s_min = row.hand_mm_per_s_min.min(speed);
    row.hand_mm_per_s_max = row.hand_mm_per_s_max.max(speed);
    row.n_places += 1;
    row.n_behind += driven.n_behind;
    row.n_unfinished += driven.n_unfinished;
    row.n_failed += driven.n_failed;
}

fn enter_errors(row: &mut ShippedRow, audited: &[PoseRow]) {
    let of_poses = (audited.iter()).map(|pose| Some((pose.part, pose.total_error?)));
    let errors: Vec<(Part, f64)> = of_poses.flatten().collect();
    row.n_poses = errors.len();
    row.n_poses_failed = audited.len() - errors.len();
    let largest = Largest::of(&errors);
    row.total_error_p95 = largest.p95;
    row.total_error_max = largest.max;
    [
        row.total_error_p95_press,
        row.total_error_p95_stroke,
        row.total_error_p95_lift,
    ] = largest.p95_of_parts;
    row.mesh_error_p95 = quantile_of(audited.iter().filter_map(|pose| pose.mesh_error), 0.95);
}

/// The large ones of some errors.
struct Largest {
    p95: Option<f64>,
    max: Option<f64>,
    /// 95th percentiles down, across and up.
    p95_of_parts: [Option<f64>; 3],
}

impl Largest {
    fn of(errors: &[(Part, f64)]) -> Self {
        let all = || errors.iter().map(|(_, error)| *error);
        Self {
            p95: quantile_of(all(), 0.95),
            max: quantile_of(all(), 1.0),
            p95_of_parts: [Part::Press, Part::Stroke, Part::Lift].map(|part| {
                let of_part = errors.iter().filter(|(of, _)| *of == part);
                quantile_of(of_part.map(|(_, error)| *error), 0.95)
            }),
        }
    }
}

fn quantile_of(values: impl Iterator<Item = f64>, share: f64) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    quantile(&values, share)
}

/// The force in a tick, compared with that of steps that take no time.
struct Moving {
    part: Part,
    error: f64,
    is_whole: bool,
}

/// Solves poses of a way again.
fn audit(
    felt: &[Felt],
    live: &LiveScene,
    chosen: &[usize],
    (row, place): (&ShippedRow, usize),
    goes_on: &impl Fn() -> bool,
) -> anyhow::Result<Audit> {
    let mut audit = Audit::default();
    let Some(&last) = chosen.last() else {
        return Ok(audit);
    };
    let stops: Vec<Stop> = felt.iter().map(stop).collect();
    let prepared = &live.prepared;
    let of_chosen: Vec<Stop> = chosen.iter().map(|&i| stops[i]).collect();
    if place == 0 {
        let tool = &of_chosen[of_chosen.len() / 2].tool;
        audit.change = Quality::find(prepared, tool, goes_on).map(|quality| quality.change);
    }
    let scene = &prepared.scene;
    let mut forces: Vec<Pressed> = Vec::new();
    if has_history(scene) {
        let longest_time = relaxes(scene).then_some(LONGEST_TIME);
        let kept = thinned(&stops[..=last], chosen, LONGEST_WAY, longest_time);
        let way: Vec<Stop> = kept.iter().map(|&i| stops[i]).collect();
        let mesh = Reference::along(prepared, &of_chosen, REFERENCE_SHARE)?;
        audit.nodes = Some(mesh.n_nodes());
        let found = kept.iter().zip(mesh.follow(&way, goes_on));
        let found = found.filter(|(i, _)| chosen.binary_search(i).is_ok());
        forces.extend(found.map(|(_, force)| Pressed {
            force,
            on_loop: None,
        }));
        if !goes_on() {
            // These were not solved, so they have not failed.
            forces.retain(|found| found.force.is_some());
        }
    } else {
        for stop in &of_chosen {
            if !goes_on() {
                break;
            }
            let at = stop.tool.pose.translation.vector;
            let mesh = Reference::round(prepared, at, REFERENCE_SHARE)?;
            let n_nodes = mesh.n_nodes();
            audit.nodes = Some(audit.nodes.map_or(n_nodes, |least| least.min(n_nodes)));
            forces.push(mesh.press(&stop.tool));
        }
    }
    let poses = chosen.iter().zip(forces).map(|(&i, found)| {
        let felt = &felt[i];
        let Pressed { force, on_loop } = found;
        let error = |found: Vec3| Some(share(found, force?));
        PoseRow {
            case: row.case.clone(),
            accuracy: row.accuracy,
            place,
            part: felt.part,
            depth_mm: felt.depth * 1e3,
            force_n: felt.force.norm(),
            static_n: force.map(|force| force.norm()),
            on_mesh_n: on_loop.map(|force| force.norm()),
            total_error: error(felt.force),
            mesh_error: on_loop.and_then(error),
        }
    });
    audit.poses = poses.collect();
    Ok(audit)
}

/// Difference between two forces, as a share of the second.
fn share(found: Vec3, expected: Vec3) -> f64 {
    (found - expected).norm() / expected.norm()
}

/// Enters by how much the force differs from that of steps that take no time.
fn enter_motion(row: &mut ShippedRow, moving: &[Moving]) {
    let errors: Vec<(Part, f64)> = moving.iter().map(|m| (m.part, m.error)).collect();
    let largest = Largest::of(&errors);
    row.motion_error_p95 = largest.p95;
    row.motion_error_max = largest.max;
    [
        row.motion_error_p95_press,
        row.motion_error_p95_stroke,
        row.motion_error_p95_lift,
    ] = largest.p95_of_parts;
    let n_let_go = moving.iter().filter(|m| !m.is_whole).count();
    row.let_go_share = n_let_go as f64 / moving.len().max(1) as f64;
}

fn stop(felt: &Felt) -> Stop {
    Stop {
        tool: felt.tool,
        time: felt.time,
    }
}

/// `n` poses of each part of a way, at random, spread over the part: where the force of steps that take
/// no time is firm. Indices, ascending.
fn drawn(felt: &[Felt], n: usize, k: usize) -> Vec<usize> {
    let largest = felt.iter().map(|f| f.force.norm()).fold(0.0, f64::max);
    let mut rng = Rng::with_seed(SEED + k as u64);
    let mut chosen = Vec::new();
    for part in [Part::Press, Part::Stroke, Part::Lift] {
        let is_firm = |f: &Felt| {
            let force = f.force.norm();
            f.depth >= FROM_DEPTH && force > 0.0 && force >= LEAST_FORCE * largest
        };
        let firm: Vec<usize> = (felt.iter().enumerate())
            .filter(|(_, f)| f.part == part && is_firm(f))
            .map(|(i, _)| i)
            .collect();
        let n = n.min(firm.len());
        chosen
            .extend((0..n).map(|i| firm[rng.usize(i * firm.len() / n..(i + 1) * firm.len() / n)]));
    }
    chosen.sort_unstable();
    chosen
}
