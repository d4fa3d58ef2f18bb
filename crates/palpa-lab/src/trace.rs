//! Force while moving: the force of the 1 kHz loop compared with the converged force of the body at
//! the same place.

use anyhow::bail;
use palpa_device::{Path, Scripted};
use palpa_fem::{Load, Outcome, PosedTool, SolveParams, State, Workspace, advance};
use palpa_servo::Vec3;
use serde::Serialize;

use palpa::live::{LiveScene, RehearsalParams, device_model, rehearse};
use palpa_plot::{Axis, Chart, Picture, Series, panels};

/// One moment of a trace. Forces along the device's z, out of the tissue.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TraceRow {
    /// Clock, s.
    pub time_s: f64,
    /// Depth of the tip below the first touch, mm.
    pub depth_mm: f64,
    /// Position across the skin, along the device's x, mm.
    pub across_mm: f64,
    /// Speed of the device, mm/s.
    pub speed_mm_s: f64,
    /// Force that the loop commands, N.
    pub force_n: f64,
    /// Force of the tissue's last step, at the pose of that step, N.
    pub step_force_n: f64,
    /// Converged quasi-static force at the device's pose, N.
    pub static_force_n: f64,
    /// Length of the difference between the commanded and the converged force vector, N.
    pub error_n: f64,
    /// Vertices that touch in the loop's contact problem.
    pub n_active: u32,
    /// Sweeps over these vertices.
    pub sweeps: u32,
    /// Relative change of the contact forces in the last sweep.
    pub residual: f64,
    /// Vertices that press in the tissue's last step.
    pub step_active: usize,
    /// Candidates of the tissue's last step.
    pub step_candidates: usize,
}

impl TraceRow {
    /// The error as a share of the converged force.
    pub fn share(&self) -> f64 {
        self.error_n / self.static_force_n.abs().max(1e-9)
    }

    /// Whether the error is at most this share of the converged force, or at most this many
    /// newtons.
    pub fn is_within(&self, share: f64, newtons: f64) -> bool {
        self.error_n <= newtons || self.share() <= share
    }
}

/// Moves an ideal device along a path and compares forces. At every `every`-th tick, solves for the
/// converged force, each from the previous one. Above the first touch, which is `above` (m) under
/// the device's origin, the force is zero. `params` gives the time that a step of the tissue takes.
///
/// # Errors
/// If the body cannot be factored, or no converged force is found.
pub fn force_while_moving(
    live: &LiveScene,
    above: f64,
    path: &Path,
    params: &RehearsalParams,
    every: usize,
) -> anyhow::Result<Vec<TraceRow>> {
    let mut tissue = live.tissue()?;
    let spec = device_model(palpa_scene::DevicePreset::Ideal).spec;
    let mut device = Scripted::new(path.clone(), spec);
    let mut step_forces = Vec::new();
    let ticks = rehearse(&mut tissue, &mut device, params, |tissue, input, _| {
        let last = tissue
            .last()
            .map_or((0, 0), |r| (r.n_active, r.n_candidates));
        step_forces.push((input.tick as usize, tissue.force(0).z, last));
    });
    let places = ticks.iter().step_by(every).map(|tick| tick.position);
    let converged = converged_forces(live, above, places)?;
    let mut rows = Vec::new();
    for ((k, tick), truth) in ticks.iter().enumerate().step_by(every).zip(converged) {
        let before = &ticks[k.saturating_sub(1)];
        let known = step_forces.partition_point(|(at, ..)| *at <= k);
        let step = known.checked_sub(1).map(|i| step_forces[i]);
        rows.push(TraceRow {
            time_s: tick.time,
            depth_mm: (-tick.position.z - above) * 1e3,
            across_mm: tick.position.x * 1e3,
            speed_mm_s: (tick.position - before.position).norm() / params.servo.period * 1e3,
            force_n: tick.force.z,
            step_force_n: step.map_or(0.0, |s| s.1),
            static_force_n: truth.z,
            error_n: (tick.force - truth).norm(),
            n_active: tick.report.n_active,
            sweeps: tick.report.sweeps,
            residual: tick.report.residual,
            step_active: step.map_or(0, |s| s.2.0),
            step_candidates: step.map_or(0, |s| s.2.1),
        });
    }
    Ok(rows)
}

/// Converged quasi-static forces on the tool at places of the device, N, in the device's frame.
/// Each is found from the previous one. Above the first touch, which is `above` (m) under the
/// device's origin, the force is zero.
///
/// # Errors
/// If no converged force is found at a place.
pub fn converged_forces(
    live: &LiveScene,
    above: f64,
    places: impl IntoIterator<Item = Vec3>,
) -> anyhow::Result<Vec<Vec3>> {
    let mut converged = Converged::new(live);
    let force = |place: Vec3| {
        if place.z > -above {
            converged.let_go();
            Ok(Vec3::zeros())
        } else {
            converged.force(place)
        }
    };
    places.into_iter().map(force).collect()
}

/// Solves for the body's equilibria, one after the other.
struct Converged<'a> {
    live: &'a LiveScene,
    state: State,
    ws: Workspace,
    before: PosedTool,
}

impl<'a> Converged<'a> {
    fn new(live: &'a LiveScene) -> Self {
        Self {
            state: State::new(&live.model),
            ws: Workspace::new(&live.model),
            before: live.posed(Vec3::zeros()),
            live,
        }
    }

    /// Returns the body to rest. No equilibrium is solved, because a relative residual is not
    /// defined without forces.
    fn let_go(&mut self) {
        self.state = State::new(&self.live.model);
        self.before = self.live.posed(Vec3::zeros());
    }

    /// Force on the tool at a place of the device, N, in the device's frame.
    fn force(&mut self, position: Vec3) -> anyhow::Result<Vec3> {
        let (before, after) = ([self.before], [self.live.posed(position)]);
        let from = Load {
            tools: &before,
            ..Load::default()
        };
        let to = Load {
            tools: &after,
            ..Load::default()
        };
        let params = SolveParams::default();
        let report = advance(
            &self.live.model,
            &mut self.state,
            &mut self.ws,
            &from,
            &to,
            &params,
        );
        if report.outcome != Outcome::Converged {
            bail!("no converged force at {position:?}: {:?}", report.outcome);
        }
        self.before = after[0];
        let turn = self.live.scene_from_device.rotation;
        Ok(turn.inverse_transform_vector(&report.tool_forces[0]))
    }
}

/// Plots force and error against time for several traces.
pub fn trace_picture(title: &str, traces: &[(&str, Vec<TraceRow>)]) -> Picture {
    let mut charts = Vec::new();
    for (name, rows) in traces {
        let line = |value: fn(&TraceRow) -> f64| -> Vec<[f64; 2]> {
            rows.iter().map(|r| [r.time_s, value(r)]).collect()
        };
        charts.push(
            Chart::new(
                Axis::linear("time [s]"),
                Axis::linear("force [N]").with_zero(),
            )
            .title(*name)
            .line("1 kHz loop", line(|r| r.force_n))
            .series(Series::new("tissue's step", line(|r| r.step_force_n)))
            .series(Series::new("converged", line(|r| r.static_force_n)).dashed()),
        );
        charts.push(
            Chart::new(
                Axis::linear("time [s]"),
                Axis::linear("error [N]").with_zero(),
            )
            .title(format!("{name}: error"))
            .line("error", line(|r| r.error_n))
            .series(Series::new("5 %", line(|r| 0.05 * r.static_force_n.abs())).dashed()),
        );
    }
    panels(title, &charts, 2)
}
