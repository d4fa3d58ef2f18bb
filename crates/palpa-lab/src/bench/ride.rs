//! The path of a tool, and the moving step along it.

use std::sync::Arc;
use std::time::Duration;

use cpu_time::ThreadTime;
use palpa_fem::realtime::{
    ExteriorMode, Live, LiveParams, LiveReport, LocalModel, Rebuilt, StepOutcome,
};
use palpa_fem::shape::{Pose, Sphere, Tool};
use palpa_fem::{
    FemError, Load, Model, Outcome, PosedTool, SolveParams, State, Workspace, advance,
};
use palpa_mesh::Vec3;
use palpa_servo::MAX_CONTACTS;

/// Speed of the tool if the steps allow it, m/s.
const FASTEST: f64 = 0.05;
/// Largest travel of the tool in a step, m; the tool goes slower to keep it.
const LONGEST_TRAVEL: f64 = 0.25e-3;
/// Largest number of steps per millimetre of the path; more would only take longer.
const MOST_STEPS_PER_MM: usize = 60;
/// Height above the skin at which the tool starts and ends, m.
const ABOVE: f64 = 1e-3;
/// Smallest depth at which forces are compared, m.
pub const JUDGED_FROM: f64 = 2e-3;
/// Distance between the places where forces are compared, m; all paths are multiples of it.
const JUDGED_EVERY: f64 = 1e-3;

/// The path of a sphere: from above the skin straight down, sideways, and up. All parts are whole
/// millimetres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ride {
    /// Point of the skin that the sphere presses, m.
    pub at: Vec3,
    /// Radius of the sphere, m.
    pub radius: f64,
    /// Depth of the press along −z, m.
    pub depth: f64,
    /// Length of the stroke along x, m.
    pub stroke: f64,
}

impl Ride {
    /// Length of the path, m.
    pub fn length(&self) -> f64 {
        2.0 * self.down() + self.stroke
    }

    /// Length of the way down, m: the position where the sphere first reaches its depth.
    fn down(&self) -> f64 {
        self.depth + ABOVE
    }

    /// Depth (m) and pose of the tool at the position `s` along the path (m).
    fn at_length(&self, s: f64) -> (f64, PosedTool) {
        let down = self.down();
        let (x, depth) = if s <= down {
            (0.0, s - ABOVE)
        } else if s <= down + self.stroke {
            (s - down, self.depth)
        } else {
            (self.stroke, self.depth - (s - down - self.stroke))
        };
        let tip = self.at + Vec3::new(x, 0.0, -depth);
        let sphere = Sphere::new(self.radius).expect("a valid radius");
        let tool = PosedTool {
            tool: Tool::new(sphere, 0.0).expect("no friction is valid"),
            pose: Pose::translation(tip.x, tip.y, tip.z),
        };
        (depth, tool)
    }

    /// Depth of the tool at the position `s` along the path. All in m.
    pub fn depth_at(&self, s: f64) -> f64 {
        self.at_length(s).0
    }

    /// The places where forces are compared: positions along the path, m.
    pub fn judged(&self) -> Vec<f64> {
        let n = (self.length() / JUDGED_EVERY).round() as usize;
        let lengths = (0..=n).map(|i| i as f64 * JUDGED_EVERY);
        lengths
            .filter(|&s| self.at_length(s).0 >= JUDGED_FROM - 1e-9)
            .collect()
    }
}

/// A converged force, exact on its mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Known {
    /// Position along the path, m.
    pub at: f64,
    /// Depth of the tool, m.
    pub depth: f64,
    /// Whether the tool has not moved sideways yet.
    pub is_press: bool,
    /// Force of the tissue on the tool, N.
    pub force: Vec3,
}

/// Forces of the converged body, computed step by step at the speed of the tool. The places are
/// every `every`-th of [`Ride::judged`] and the one where the tool first reaches its depth.
/// `speed`, m/s, matters for tissue that relaxes.
///
/// # Errors
/// If a step does not converge: its place (m along the path) and how it ended.
pub fn converged(
    model: &Model,
    ride: &Ride,
    speed: f64,
    every: usize,
) -> Result<Vec<Known>, (f64, Outcome)> {
    let deepest = ride.down();
    let places = ride.judged().into_iter().enumerate();
    let places = places.filter(|(i, s)| i.is_multiple_of(every) || (s - deepest).abs() < 1e-9);
    converged_at(model, ride, speed, places.map(|(_, s)| s))
}

/// As [`converged`], of the press alone.
///
/// # Errors
/// As [`converged`].
pub fn converged_press(model: &Model, ride: &Ride) -> Result<Vec<Known>, (f64, Outcome)> {
    let deepest = ride.down();
    let places = ride.judged().into_iter().filter(|s| *s <= deepest + 1e-9);
    converged_at(model, ride, f64::INFINITY, places)
}

fn converged_at(
    model: &Model,
    ride: &Ride,
    speed: f64,
    places: impl Iterator<Item = f64>,
) -> Result<Vec<Known>, (f64, Outcome)> {
    let (mut state, mut ws) = (State::new(model), Workspace::new(model));
    let (mut before, mut s_before): (Vec<PosedTool>, f64) = (Vec::new(), ABOVE);
    let deepest = ride.down();
    let mut known = Vec::new();
    for s in places {
        let (depth, tool) = ride.at_length(s);
        let tools = vec![tool];
        let load = Load {
            tools: &tools,
            duration: (s - s_before) / speed,
            ..Load::default()
        };
        let last = Load {
            tools: &before,
            ..Load::default()
        };
        let params = SolveParams::default();
        let report = advance(model, &mut state, &mut ws, &last, &load, &params);
        if report.outcome != Outcome::Converged {
            return Err((s, report.outcome));
        }
        known.push(Known {
            at: s,
            depth,
            is_press: s <= deepest + 1e-9,
            force: report.tool_forces[0],
        });
        before = tools;
        s_before = s;
    }
    Ok(known)
}

/// Result of a ride.
#[derive(Debug)]
pub struct Ridden {
    /// Times of the steps in contact, s, ascending: with the patch, and with the result of a
    /// background job if one was installed before the step.
    pub times: Vec<f64>,
    /// Number of all steps.
    pub n_steps: usize,
    /// CPU time of the background's work and of the steps, s.
    pub cpu: [f64; 2],
    /// Number of background jobs.
    pub n_jobs: usize,
    /// Time between two steps, s.
    pub dt: f64,
    /// Travel of the tool between two steps, m.
    pub travel: f64,
    /// Position along the path (m) and force (N) after every step.
    pub forces: Vec<(f64, Vec3)>,
    /// Number of zones that were taken over.
    pub n_zone_switches: usize,
    /// Number of factors of the exterior that were taken over, new zones included.
    pub n_factors: usize,
    /// Number of steps after which the number of pressing vertices changed.
    pub n_active_changes: usize,
    /// Largest number of vertices that pressed at once, and of candidates.
    pub most: [usize; 2],
    /// Total Newton iterations of all steps.
    pub n_iterations: usize,
    /// Number of steps that went part of the way, and that failed.
    pub n_bad: [usize; 2],
    /// Number of columns of the last zone.
    pub zone_columns: usize,
}

impl Ridden {
    /// Median time of the steps in contact, s; NaN if there was none.
    pub fn median(&self) -> f64 {
        self.quantile(0.5)
    }

    /// Quantile `q` (0 to 1) of the times of the steps in contact, s; NaN if there was none.
    pub fn quantile(&self, q: f64) -> f64 {
        let last = self.times.len().saturating_sub(1);
        let at = (q * last as f64).round() as usize;
        self.times.get(at).copied().unwrap_or(f64::NAN)
    }

    /// Mean time of the steps in contact, s; NaN if there was none.
    pub fn mean(&self) -> f64 {
        self.times.iter().sum::<f64>() / self.times.len() as f64
    }

    /// Largest relative error along the press of the forces at all judged places, down, across and
    /// up, against the force that is known at each depth, N; `None` if none is known.
    pub fn error_by_depth(
        &self,
        ride: &Ride,
        force_at: impl Fn(f64) -> Option<f64>,
    ) -> Option<f64> {
        let errors = ride.judged().into_iter().filter_map(|s| {
            let found = self.forces.iter().find(|f| (f.0 - s).abs() < 1e-9)?;
            Some((found.1.z / force_at(ride.depth_at(s))? - 1.0).abs())
        });
        errors.reduce(f64::max)
    }

    /// Largest relative error of the forces against known ones.
    pub fn error(&self, known: &[Known]) -> f64 {
        let errors = known.iter().filter_map(|k| {
            let found = self.forces.iter().find(|f| (f.0 - k.at).abs() < 1e-9)?;
            Some((found.1 - k.force).norm() / k.force.norm())
        });
        errors.fold(0.0, f64::max)
    }
}

/// A running background job.
struct Under {
    result: Rebuilt,
    /// Number of the step before which the result is installed.
    due: usize,
}

/// Rides at the step's own rate, which a short pilot ride measures first. A background job runs at
/// once, and its result is installed as many steps later as its CPU time is long. This imitates a
/// second thread, but apart from the times it gives the same result in every run.
///
/// # Errors
/// If the body has no state of rest or is too large.
pub fn ride(model: &Arc<Model>, ride: &Ride, params: LiveParams) -> Result<Ridden, FemError> {
    /// Depth of the pilot ride, m: enough to find the median time to a few per cent.
    const PILOT: f64 = 4e-3;
    let pilot = run(model, ride, params, LONGEST_TRAVEL, None, ABOVE + PILOT)?;
    let rate = 1.0 / pilot.median();
    let mut speed = FASTEST;
    if pilot.n_jobs > 0 && params.zone_radius.is_finite() {
        // The tool goes no faster than new zones arrive and, if the exterior is followed with an
        // old stiffness, its new factors.
        let job = pilot.cpu[0] / pilot.n_jobs as f64;
        speed = speed.min(params.longest_way() / job);
    }
    let per_mm = (1e-3 * rate / speed).ceil() as usize;
    let least = (1e-3 / LONGEST_TRAVEL).ceil() as usize;
    let travel = 1e-3 / per_mm.clamp(least, MOST_STEPS_PER_MM) as f64;
    let dt = (travel / speed).max(1.0 / rate);
    run(model, ride, params, travel, Some(dt), ride.length())
}

fn run(
    model: &Arc<Model>,
    ride: &Ride,
    params: LiveParams,
    travel: f64,
    dt: Option<f64>,
    length: f64,
) -> Result<Ridden, FemError> {
    // Without a given `dt`, a step takes the time of the usual speed.
    let dt = dt.unwrap_or(travel / FASTEST);
    let mut live = Live::new(Arc::clone(model), &[ride.at_length(0.0).1], params)?;
    let n_steps = (length / travel).round() as usize;
    let mut ridden = Ridden {
        times: Vec::with_capacity(n_steps),
        n_steps,
        cpu: [0.0; 2],
        n_jobs: 0,
        dt,
        travel,
        forces: Vec::with_capacity(n_steps),
        n_zone_switches: 0,
        n_factors: 0,
        n_active_changes: 0,
        most: [0; 2],
        n_iterations: 0,
        n_bad: [0; 2],
        zone_columns: 0,
    };
    let mut under: Option<Under> = None;
    let mut last: Option<LiveReport> = None;
    let mut patch = LocalModel::default();
    for step in 1..=n_steps {
        let s = step as f64 * travel;
        let tools = [ride.at_length(s).1];
        let clock = ThreadTime::now();
        if let Some(done) = under.take_if(|under| under.due <= step) {
            live.install(done.result);
        }
        let report = live.step(&tools, dt);
        live.local_model(MAX_CONTACTS, &mut patch);
        let time = clock.elapsed();
        if let Some(job) = live.take_job() {
            let clock = ThreadTime::now();
            let result = job.run();
            let late = clock.elapsed();
            ridden.cpu[0] += late.as_secs_f64();
            ridden.n_jobs += 1;
            let due = step + 1 + (late.as_secs_f64() / dt) as usize;
            under = Some(Under { result, due });
        }
        ridden.note(&report, last.as_ref(), time);
        ridden.forces.push((s, live.tool_force(0)));
        last = Some(report);
    }
    ridden.zone_columns = live.n_columns()[0];
    ridden.times.sort_by(f64::total_cmp);
    Ok(ridden)
}

impl Ridden {
    fn note(&mut self, report: &LiveReport, last: Option<&LiveReport>, time: Duration) {
        let time = time.as_secs_f64();
        self.cpu[1] += time;
        if report.n_active > 0 {
            self.times.push(time);
        }
        self.n_iterations += report.iterations;
        self.most[0] = self.most[0].max(report.n_active);
        self.most[1] = self.most[1].max(report.n_candidates);
        match report.outcome {
            StepOutcome::Arrived | StepOutcome::Behind => {}
            StepOutcome::BackedOff => self.n_bad[0] += 1,
            StepOutcome::Held | StepOutcome::Failed => self.n_bad[1] += 1,
        }
        if let Some(last) = last {
            self.n_zone_switches += usize::from(last.zone != report.zone);
            self.n_factors += usize::from(last.factor != report.factor);
            self.n_active_changes += usize::from(last.n_active != report.n_active);
        }
    }
}

/// Parameters of the moving step in a mode.
pub fn params(mode: super::Mode, zone_radius: f64) -> LiveParams {
    let shipped = LiveParams::default();
    match mode {
        super::Mode::Full => LiveParams {
            zone_radius: f64::INFINITY,
            ..shipped
        },
        super::Mode::Whole => LiveParams {
            zone_radius,
            exterior: ExteriorMode::Followed,
            ..shipped
        },
        super::Mode::Zone => LiveParams {
            zone_radius,
            exterior: ExteriorMode::Linear,
            ..shipped
        },
    }
}
