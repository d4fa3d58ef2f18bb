//! `--audit N`: the force of the loop at N of its poses, against static forces on finer meshes.
//!
//! ```text
//!  log ─► N poses, spread over the time in contact ─► straight presses, or their way again ─► errors
//! ```

use palpa::audit::{
    LEAST_FORCE, LONGEST_TIME, LONGEST_WAY, Pressed, Quality, REFERENCE_SHARE, Reference, Stop,
    quantile, relaxes, rubs, thinned,
};
use palpa::live::LiveScene;
use palpa_rt::{Log, StepRecord, TickEntry};
use palpa_scene::Scene;
use palpa_servo::Vec3;
use serde::Serialize;

use super::Run;
use crate::cli::Context;
use crate::table::Table;

/// Where the way matters: most contacts whose way is gone again.
const MOST_CONTACTS: usize = 3;
const SEED: u64 = 14;
/// A pose stands for the time until the next one, but for no more than this, s.
const LONGEST_STEP: f64 = 0.1;

/// The audit of a run.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(Default))]
pub(super) struct Audit {
    /// Number of poses that were solved again.
    pub(super) n: usize,
    /// Quantiles of the error of the force, as a share of the static force; `None` without poses.
    error_p50: Option<f64>,
    pub(super) error_p95: Option<f64>,
    error_max: Option<f64>,
    /// 95th percentile of the part that the loop's mesh has in it: static forces on that mesh.
    /// `None` if the mesh moves, or the way matters.
    mesh_error_p95: Option<f64>,
    /// Number of poses without a static equilibrium.
    pub(super) n_failed: usize,
    /// Whether the way to each pose was gone again; if not, each was pressed straight from above.
    goes_the_way: bool,
    /// What the audit does not cover.
    not_audited: Vec<String>,
    reference: Option<MeshOfReference>,
    poses: Vec<Audited>,
    /// The contacts whose way was gone again.
    pub(super) ways: Vec<Vec<OnWay>>,
}

/// A static step of a way that was gone again.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct OnWay {
    /// Position of the tool, in the device's frame.
    pub(super) position_mm: [f64; 3],
    /// Static force on the hand, in the device's frame.
    pub(super) static_n: [f64; 3],
}

/// The mesh that static forces come from, and how good it is.
#[derive(Debug, Clone, Copy, Serialize)]
struct MeshOfReference {
    nodes: usize,
    mesh_size_mm: f64,
    /// Number of nodes of a mesh with 0.7 times the sizes.
    finer_nodes: Option<usize>,
    /// Change of the static force at one pose on that mesh, as a share of it.
    finer_changes_it_by: Option<f64>,
}

/// One pose.
#[derive(Debug, Clone, Serialize)]
struct Audited {
    time_s: f64,
    /// Position of the tool's tip, in the scene's frame.
    tip_mm: [f64; 3],
    /// Force on the hand then, in the device's frame.
    felt_n: [f64; 3],
    /// Static force, in the device's frame; `None` without an equilibrium.
    static_n: Option<[f64; 3]>,
    /// Size of the difference, as a share of the static force.
    error: Option<f64>,
    /// The same for the static force on the loop's mesh.
    mesh_error: Option<f64>,
}

/// A step of the tissue with the tick at which its poses were taken.
#[derive(Debug, Clone, Copy)]
struct Pose<'a> {
    step: &'a StepRecord,
    tick: &'a TickEntry,
}

impl Pose<'_> {
    /// Force on the hand, in the device's frame, N.
    fn felt(&self) -> Vec3 {
        self.tick.devices[0].force.into()
    }

    fn touches(&self) -> bool {
        Vec3::from(self.tick.devices[0].tissue_force) != Vec3::zeros()
    }

    /// Place of the tool in that tick, in the device's frame: that of the device, and the stretch of the
    /// coupling along the force. The step itself looks ahead.
    fn position(&self) -> Vec3 {
        let device = &self.tick.devices[0];
        let force = Vec3::from(device.tissue_force);
        let along = force.try_normalize(0.0).unwrap_or_default();
        Vec3::from(device.position) + along * device.stretch
    }

    fn stop(&self, live: &LiveScene) -> Stop {
        Stop {
            tool: live.posed(self.position()),
            time: self.step.sampled_at,
        }
    }
}

/// All poses of the run before its end.
fn poses<'a>(log: &'a Log, until: f64) -> Vec<Pose<'a>> {
    let mut ticks = log.ticks.iter().peekable();
    let at_tick = |step: &'a StepRecord| {
        while ticks.next_if(|entry| entry.tick.tick < step.tick).is_some() {}
        let tick = *ticks.peek()?;
        (tick.tick.tick == step.tick && tick.tick.now <= until).then_some(Pose { step, tick })
    };
    log.steps.iter().filter_map(at_tick).collect()
}

/// At most `n` of the poses at which the tool presses firmly, at full force: one at random in each of `n`
/// equal parts of the time of these, so that many short steps at rest do not stand for a stroke. Indices,
/// ascending, each once.
fn drawn(poses: &[Pose<'_>], n: usize) -> Vec<usize> {
    let size = |pose: &Pose<'_>| pose.felt().norm();
    let largest = poses.iter().map(size).fold(0.0, f64::max);
    let firm: Vec<usize> = (poses.iter().enumerate())
        .filter(|(_, pose)| {
            let is_whole = pose.tick.tick.gain >= 1.0 && pose.tick.devices[0].is_there;
            is_whole && size(pose) > 0.0 && size(pose) >= LEAST_FORCE * largest
        })
        .map(|(i, _)| i)
        .collect();
    let time = |i: usize| poses[i].tick.tick.now;
    let until: Vec<f64> = (firm.iter())
        .scan(0.0, |sum, &i| {
            let next = poses.get(i + 1).map_or(time(i), |next| next.tick.tick.now);
            *sum += (next - time(i)).clamp(f64::MIN_POSITIVE, LONGEST_STEP);
            Some(*sum)
        })
        .collect();
    let whole = until.last().copied().unwrap_or(0.0);
    let mut random = fastrand::Rng::with_seed(SEED);
    let mut drawn: Vec<usize> = (0..n)
        .filter_map(|part| {
            let at = (part as f64 + random.f64()) / n as f64 * whole;
            firm.get(until.partition_point(|until| *until <= at))
                .copied()
        })
        .collect();
    drawn.dedup();
    drawn
}

/// Contacts: ranges of poses from the last one in the air to the last one that touches.
fn contacts(poses: &[Pose<'_>]) -> Vec<std::ops::Range<usize>> {
    let mut contacts: Vec<std::ops::Range<usize>> = Vec::new();
    for i in 1..poses.len() {
        if !poses[i].touches() {
            continue;
        }
        match contacts.last_mut() {
            Some(last) if last.end == i => last.end = i + 1,
            _ if !poses[i - 1].touches() => contacts.push(i - 1..i + 1),
            _ => {}
        }
    }
    contacts
}

/// Solves `n` poses of a run again.
///
/// # Errors
/// If no finer mesh can be made.
pub(super) fn audit(
    n: usize,
    run: &Run,
    log: &Log,
    scene: &Scene,
    live: &LiveScene,
    context: &Context,
) -> anyhow::Result<Audit> {
    let all = poses(log, run.until);
    let bar = context.progress(n, "audit");
    let mut audit = Audit::new(rubs(scene) || relaxes(scene));
    let found = if audit.goes_the_way {
        along_the_way(n, &all, scene, live, context, &mut audit)?
    } else {
        let mut found = Vec::new();
        for i in drawn(&all, n) {
            if context.is_interrupted() {
                break;
            }
            let tool = all[i].stop(live).tool;
            let tip = tool.pose.translation.vector;
            let reference = Reference::round(&live.prepared, tip, REFERENCE_SHARE)?;
            found.push((i, reference.press(&tool)));
            audit.keep_coarsest(&reference);
            bar.inc(1);
        }
        found
    };
    audit.judge_reference(&all, &found, live, context);
    let turn = |force: Vec3| {
        live.scene_from_device
            .rotation
            .inverse_transform_vector(&force)
    };
    for (i, Pressed { force, on_loop }) in found {
        let pose = &all[i];
        let stop = pose.stop(live);
        // A mesh that moves was another one then.
        let on_loop = on_loop.filter(|_| !scene.mesh.moves);
        let felt = pose.felt();
        let error = |found: Vec3, force: Vec3| (found - force).norm() / force.norm();
        audit.poses.push(Audited {
            time_s: pose.tick.tick.now,
            tip_mm: (stop.tool.pose.translation.vector * 1e3).into(),
            felt_n: felt.into(),
            static_n: force.map(|force| turn(force).into()),
            error: force.map(|force| error(felt, turn(force))),
            mesh_error: (on_loop.zip(force)).map(|(found, force)| error(found, force)),
        });
    }
    audit.sum_up(n);
    bar.finish_and_clear();
    Ok(audit)
}

/// Goes the way of some contacts again. Index of each pose, and the static force there, N, in the
/// scene's frame.
fn along_the_way(
    n: usize,
    all: &[Pose<'_>],
    scene: &Scene,
    live: &LiveScene,
    context: &Context,
    audit: &mut Audit,
) -> anyhow::Result<Vec<(usize, Pressed)>> {
    let contacts = contacts(all);
    let relaxes = relaxes(scene);
    let (ways, n_left): (Vec<std::ops::Range<usize>>, usize) = if relaxes {
        // What happened before is part of the force, so the way begins with the first contact.
        let first = contacts.first().cloned();
        (
            first.into_iter().collect(),
            contacts.len().saturating_sub(1),
        )
    } else {
        let chosen = spread(contacts.len(), MOST_CONTACTS);
        let ways = chosen.iter().map(|&i| contacts[i].clone()).collect();
        (ways, contacts.len() - chosen.len())
    };
    if n_left > 0 {
        audit.not_audited.push(format!(
            "{n_left} of {} contacts, because the way to each pose matters and takes long to be gone again",
            contacts.len()
        ));
    }
    if relaxes {
        audit
            .not_audited
            .push("relaxation faster than the static steps, which are 50 ms long".to_owned());
    }
    let mut found = Vec::new();
    for (k, way) in ways.iter().enumerate() {
        let [from, to] = [k, k + 1].map(|k| k * n / ways.len());
        let chosen: Vec<usize> = (drawn(&all[way.clone()], to - from).into_iter())
            .map(|i| way.start + i)
            .collect();
        let Some(&last) = chosen.last() else {
            continue;
        };
        let whole: Vec<Stop> = (all[way.start..=last].iter())
            .map(|pose| pose.stop(live))
            .collect();
        let in_way: Vec<usize> = chosen.iter().map(|i| i - way.start).collect();
        let longest_time = relaxes.then_some(LONGEST_TIME);
        let kept = thinned(&whole, &in_way, LONGEST_WAY, longest_time);
        let stops: Vec<Stop> = kept.iter().map(|&i| whole[i]).collect();
        let reference = Reference::along(&live.prepared, &stops, REFERENCE_SHARE)?;
        let forces = reference.follow(&stops, || !context.is_interrupted());
        let turn = live.scene_from_device.rotation;
        let on_way = kept.iter().zip(&forces).filter_map(|(&i, force)| {
            Some(OnWay {
                position_mm: (all[way.start + i].position() * 1e3).into(),
                static_n: turn.inverse_transform_vector(force.as_ref()?).into(),
            })
        });
        audit.ways.push(on_way.collect());
        let of_chosen = (kept.iter().zip(forces)).filter(|(i, _)| in_way.binary_search(i).is_ok());
        found.extend(of_chosen.map(|(i, force)| {
            let on_loop = None;
            (way.start + i, Pressed { force, on_loop })
        }));
        audit.keep_coarsest(&reference);
    }
    Ok(found)
}

/// `n` of `of` numbers, at random, ascending: one in each of `n` equal parts.
fn spread(of: usize, n: usize) -> Vec<usize> {
    let (mut random, n) = (fastrand::Rng::with_seed(SEED), n.min(of));
    (0..n)
        .map(|part| random.usize(part * of / n..(part + 1) * of / n))
        .collect()
}

impl Audit {
    fn new(goes_the_way: bool) -> Self {
        Self {
            n: 0,
            error_p50: None,
            error_p95: None,
            error_max: None,
            mesh_error_p95: None,
            n_failed: 0,
            goes_the_way,
            not_audited: Vec::new(),
            reference: None,
            poses: Vec::new(),
            ways: Vec::new(),
        }
    }

    /// Of several references, the report names the one with the fewest nodes.
    fn keep_coarsest(&mut self, reference: &Reference) {
        let nodes = reference.n_nodes();
        if self.reference.is_none_or(|known| nodes < known.nodes) {
            self.reference = Some(MeshOfReference {
                nodes,
                mesh_size_mm: reference.mesh_size() * 1e3,
                finer_nodes: None,
                finer_changes_it_by: None,
            });
        }
    }

    /// Presses one pose on the reference and on a still finer mesh.
    fn judge_reference(
        &mut self,
        all: &[Pose<'_>],
        found: &[(usize, Pressed)],
        live: &LiveScene,
        context: &Context,
    ) {
        let (Some((i, _)), Some(mesh)) = (found.get(found.len() / 2), &mut self.reference) else {
            return;
        };
        let tool = all[*i].stop(live).tool;
        let quality = Quality::find(&live.prepared, &tool, || !context.is_interrupted());
        mesh.finer_nodes = quality.map(|quality| quality.finer_nodes);
        mesh.finer_changes_it_by = quality.map(|quality| quality.change);
    }

    fn sum_up(&mut self, asked: usize) {
        self.n_failed = self.poses.iter().filter(|p| p.static_n.is_none()).count();
        let sorted = |error: fn(&Audited) -> Option<f64>| {
            let mut errors: Vec<f64> = self.poses.iter().filter_map(error).collect();
            errors.sort_by(f64::total_cmp);
            errors
        };
        let errors = sorted(|pose| pose.error);
        self.n = errors.len();
        [self.error_p50, self.error_p95, self.error_max] =
            [0.5, 0.95, 1.0].map(|q| quantile(&errors, q));
        self.mesh_error_p95 = quantile(&sorted(|pose| pose.mesh_error), 0.95);
        if self.n < asked {
            let missing = asked - self.n;
            self.not_audited.push(format!(
                "{missing} of the {asked} poses that were asked for: {} have no static equilibrium; for the others the run had \
                 too few moments with enough force, or the audit was interrupted",
                self.n_failed
            ));
        }
    }

    /// Prints the audit.
    pub(super) fn say(&self, context: &Context) -> anyhow::Result<()> {
        let mut table = Table::new(["audit: time s", "tip at mm", "felt N", "static N", "error"]);
        for pose in &self.poses {
            let [x, y, z] = pose.tip_mm;
            let size = |force: [f64; 3]| format!("{:.3}", Vec3::from(force).norm());
            table.push([
                format!("{:.2}", pose.time_s),
                format!("{x:.1} {y:.1} {z:.1}"),
                size(pose.felt_n),
                pose.static_n.map_or_else(|| "–".to_owned(), size),
                pose.error.map_or_else(|| "–".to_owned(), percent),
            ]);
        }
        context.say(table)?;
        let or_none = |share: Option<f64>| share.map_or_else(|| "–".to_owned(), percent);
        let mesh = match self.mesh_error_p95 {
            Some(share) => format!(
                "; of the loop's mesh alone: 95th percentile {}",
                percent(share)
            ),
            None => String::new(),
        };
        context.say(format!(
            "error of the force at {} poses: median {}, 95th percentile {}, largest {}{mesh}",
            self.n,
            or_none(self.error_p50),
            or_none(self.error_p95),
            or_none(self.error_max),
        ))?;
        if let Some(mesh) = &self.reference {
            let quality = match (mesh.finer_changes_it_by, mesh.finer_nodes) {
                (Some(change), Some(nodes)) => {
                    format!("{nodes} nodes change its force by {}", percent(change))
                }
                _ => "how good it is was not found".to_owned(),
            };
            let way = if self.goes_the_way {
                "the way of the tool gone again in static steps"
            } else {
                "each pose pressed straight from above"
            };
            context.say(format!(
                "reference: {way}, on {} nodes or more, skin edges of {:.1} mm near the tool; {quality}",
                mesh.nodes, mesh.mesh_size_mm
            ))?;
        }
        for not in &self.not_audited {
            context.say(format!("not audited: {not}"))?;
        }
        Ok(())
    }
}

fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpa_rt::{DeviceRecord, TickRecord};

    /// A log in which the tool touches from tick 101 to 200 and from 301 to 400, with a force that
    /// grows; a step every other tick.
    fn log() -> Log {
        let mut log = Log::default();
        for n in 1..=500_u64 {
            let (in_first, in_second) = ((101..=200).contains(&n), (301..=400).contains(&n));
            let force = match (in_first, in_second) {
                (true, _) => (n - 100) as f64 / 100.0,
                (_, true) => (n - 300) as f64 / 100.0,
                _ => 0.0,
            };
            let now = n as f64 * 1e-3;
            let mut entry = TickEntry {
                tick: TickRecord {
                    tick: n,
                    now,
                    gain: 1.0,
                    ..TickRecord::default()
                },
                ..TickEntry::default()
            };
            entry.devices[0] = DeviceRecord {
                is_there: true,
                force: [0.0, 0.0, force],
                tissue_force: [0.0, 0.0, force],
                position: [0.0, 0.0, -1e-4 * n as f64],
                ..DeviceRecord::default()
            };
            log.ticks.push(entry);
            if n.is_multiple_of(2) {
                let step = StepRecord {
                    step: n / 2,
                    tick: n,
                    sampled_at: now,
                    ..StepRecord::default()
                };
                log.steps.push(step);
            }
        }
        log
    }

    #[test]
    fn poses_are_drawn_where_the_tool_presses_firmly_and_spread_over_that_time() {
        let log = log();
        let all = poses(&log, 0.45);
        assert_eq!(all.len(), 225);
        let chosen = drawn(&all, 8);
        assert_eq!(chosen.len(), 8);
        assert!(chosen.is_sorted() && chosen.iter().all(|&i| all[i].felt().norm() >= 0.2));
        let in_first = chosen.iter().filter(|&&i| all[i].tick.tick.tick <= 200);
        assert_eq!(in_first.count(), 4);
        assert_eq!(drawn(&all, 8), chosen, "the seed is fixed");
        assert_eq!(drawn(&all[..40], 8), [] as [usize; 0]);
        // Of the second contact there are few steps, each ten times as long.
        let mut few = log;
        few.steps
            .retain(|step| step.tick < 300 || step.tick.is_multiple_of(20));
        let all = poses(&few, 0.45);
        let chosen = drawn(&all, 8);
        let in_first = |i: &&usize| all[**i].tick.tick.tick <= 200;
        let n_first = chosen.iter().filter(in_first).count();
        assert!(
            chosen.windows(2).all(|pair| pair[0] < pair[1]),
            "{chosen:?}"
        );
        assert!(n_first <= 4 && chosen.len() >= n_first + 3, "{chosen:?}");
    }

    #[test]
    fn a_way_begins_in_the_air_and_ends_with_the_contact() {
        let log = log();
        let all = poses(&log, 1.0);
        let contacts = contacts(&all);
        // Steps are at even ticks: the last one in the air is that of tick 100.
        assert_eq!(contacts, [49..100, 149..200]);
    }

    #[test]
    fn contacts_are_spread_over_the_run() {
        assert_eq!(spread(0, 3), [] as [usize; 0]);
        assert_eq!(spread(2, 3), [0, 1]);
        let many = spread(30, 3);
        assert!(
            many[0] < 10 && (10..20).contains(&many[1]) && many[2] >= 20,
            "{many:?}"
        );
    }
}
