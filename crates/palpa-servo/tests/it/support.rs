//! Patches made by formula, a mailbox, and an oracle that knows nothing of the law's solver.

use palpa_servo::{
    Candidate, ContactPatch, DeviceSpec, DeviceState, ForceCommand, MAX_CONTACTS, Mat3,
    PatchSource, Pose, Servo, ServoParams, TickReport, ToolContact, Vec3,
};

pub(crate) const SPEC: DeviceSpec = DeviceSpec {
    max_force: 20.0,
    max_torque: 1.0,
    max_slew: 5000.0,
    max_stiffness: 1e9,
    max_damping: 10.0,
};

pub(crate) struct Mail {
    pub(crate) current: Box<ContactPatch>,
    pub(crate) next: Option<Box<ContactPatch>>,
}

impl Mail {
    pub(crate) fn new() -> Self {
        Self {
            current: Box::new(ContactPatch::EMPTY),
            next: None,
        }
    }
}

impl PatchSource for Mail {
    fn current(&self) -> &ContactPatch {
        &self.current
    }
    fn is_newer(&self) -> bool {
        self.next.is_some()
    }
    fn take(&mut self) {
        // The old one goes where the new one was: nothing is freed in the tick.
        if let Some(next) = &mut self.next {
            std::mem::swap(&mut self.current, next);
        }
    }
}

/// A sphere of 8 mm over a grid of `n` vertices `spacing` apart on an elastic half-space, nothing
/// pressed yet.
pub(crate) struct HalfSpace {
    pub(crate) spacing: f64,
    pub(crate) compliance: f64,
    pub(crate) friction: f64,
    pub(crate) n: usize,
}

pub(crate) const RADIUS: f64 = 8e-3;

impl HalfSpace {
    pub(crate) fn places(&self) -> Vec<Vec3> {
        let side = (self.n as f64).sqrt().ceil() as usize;
        let half = 0.5 * (side - 1) as f64;
        (0..self.n)
            .map(|k| {
                let (i, j) = (k % side, k / side);
                Vec3::new(
                    (i as f64 - half) * self.spacing,
                    (j as f64 - half) * self.spacing,
                    0.0,
                )
            })
            .collect()
    }

    /// Boussinesq and Cerruti with `ν = 0.45`, a vertex's own as of a disc: coupled between
    /// directions.
    pub(crate) fn block(&self, a: &Vec3, b: &Vec3) -> Mat3 {
        let nu = 0.45;
        let d = a - b;
        let soft = 0.5 * self.spacing;
        let r = (d.norm_squared() + soft * soft).sqrt();
        let (x, y) = (d.x / r, d.y / r);
        let w = Mat3::new(
            1.0 - nu + nu * x * x,
            nu * x * y,
            0.0,
            nu * x * y,
            1.0 - nu + nu * y * y,
            0.0,
            0.0,
            0.0,
            1.0 - nu,
        );
        w * (self.compliance * soft / r / (1.0 - nu))
    }

    pub(crate) fn fill(&self, centre: Vec3, id: u64, patch: &mut ContactPatch) {
        let places = self.places();
        patch.id = id;
        patch.period = 5e-3;
        patch.n_tools = 1;
        patch.tools[0] = ToolContact {
            friction: self.friction,
            pose: Pose::translation(centre.x, centre.y, centre.z),
            ..ToolContact::NONE
        };
        patch.n_contacts = places.len().min(MAX_CONTACTS);
        for (i, place) in places.iter().enumerate() {
            let normal = (place - centre).normalize();
            patch.contacts[i] = Candidate {
                vertex: i as u32,
                position: *place,
                surface: normal * RADIUS,
                normal,
                curvature: (Mat3::identity() - normal * normal.transpose()) / RADIUS,
                anchor: place - centre,
                ..Candidate::NONE
            };
            for (j, other) in places.iter().enumerate() {
                patch.set_block(i, j, &self.block(place, other));
            }
        }
    }

    /// The forces on the vertices by plain relaxation until nothing moves, with the patch's own
    /// gaps.
    pub(crate) fn oracle(&self, patch: &ContactPatch, centre: Vec3, anchors: &[Vec3]) -> Vec<Vec3> {
        let places = self.places();
        let n = places.len();
        let mut force = vec![Vec3::zeros(); n];
        let w: Vec<Mat3> = (0..n * n)
            .map(|e| self.block(&places[e % n], &places[e / n]))
            .collect();
        let mut x = places.clone();
        for _ in 0..200_000 {
            let mut change: f64 = 0.0;
            for i in 0..n {
                let c = &patch.contacts[i];
                let d = x[i] - centre - c.surface;
                let slope = c.normal + c.curvature * d;
                let gap = (c.normal.dot(&d) + 0.5 * d.dot(&(c.curvature * d))) / slope.norm();
                let normal = slope.normalize();
                let own = w[i + n * i];
                // A tenth of a Newton step each: slow and sure.
                let pressed = (normal.dot(&force[i]) - 0.5 * gap / own.m33).max(0.0);
                let flat = |v: Vec3| v - normal * normal.dot(&v);
                let slip = flat(x[i] - centre - anchors[i]);
                let mut held = flat(force[i]) - slip * (0.5 / own.m33);
                let most = self.friction * pressed;
                if held.norm() > most {
                    held *= most / held.norm();
                }
                let by = normal * pressed + held - force[i];
                change = change.max(by.norm());
                force[i] += by;
                for j in 0..n {
                    x[j] += w[j + n * i] * by;
                }
            }
            if change < 1e-13 {
                break;
            }
        }
        force
    }
}

pub(crate) fn state(time: f64, centre: Vec3) -> DeviceState {
    DeviceState {
        time,
        pose: Pose::translation(centre.x, centre.y, centre.z),
        velocity: Vec3::zeros(),
        buttons: 0,
    }
}

/// A loop around the law.
pub(crate) struct Loop {
    pub(crate) servo: Box<Servo>,
    pub(crate) mail: Mail,
    pub(crate) now: f64,
    pub(crate) command: [ForceCommand; 1],
}

impl Loop {
    pub(crate) fn new(params: &ServoParams, spec: DeviceSpec) -> Self {
        Self {
            servo: Box::new(Servo::new(params, &[spec])),
            mail: Mail::new(),
            now: 0.0,
            command: [ForceCommand::ZERO],
        }
    }

    /// A patch arrives with the next tick.
    pub(crate) fn send(&mut self, mut patch: Box<ContactPatch>) {
        patch.sampled_at = self.now;
        self.mail.next = Some(patch);
    }

    pub(crate) fn tick(&mut self, at: Option<Vec3>) -> TickReport {
        self.now += 1e-3;
        let states = [at.map(|at| state(self.now, at))];
        let report = self
            .servo
            .tick(self.now, &states, &mut self.mail, &mut self.command);
        self.mail.next = None;
        report
    }

    /// Ticks with the patch renewed every 5 ms until the force is let through.
    pub(crate) fn settle(&mut self, patch: &ContactPatch, at: Vec3, ticks: usize) -> TickReport {
        let mut report = TickReport::ZERO;
        for k in 0..ticks {
            if k % 5 == 0 {
                let mut patch = Box::new(patch.clone());
                patch.id += k as u64;
                self.send(patch);
            }
            report = self.tick(Some(at));
        }
        report
    }
}
