//! A bed of tissue for trials of the loop: small and dense, it stiffens with depth, has friction,
//! and is solved without the servo's code.
//!
//! ```text
//! W_ij = s_i s_j a / √(|p_i − p_j|² + a²) · 1 / (1 + κ δ)        a softened 1/r, as of an elastic half-space
//! ```
//! `δ` is the tool's depth; `κ` makes the tissue stiffen; `s` is smaller over a lump. The contact
//! is solved by plain Gauss–Seidel to convergence, so the bed also checks the results of the servo.

use palpa_servo::{Candidate, ContactPatch, MAX_CONTACTS, Mat3, Pose, ToolContact, Vec3};

/// Settings of a bed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BedParams {
    /// Compliance of one vertex, m/N. The tool touches several vertices at once, so it feels a
    /// stiffer tissue.
    pub compliance: f64,
    /// Stiffening with depth, 1/m.
    pub stiffening: f64,
    /// Distance between neighbouring vertices, m.
    pub spacing: f64,
    /// Vertices along a side.
    pub n_side: usize,
    /// Radius of the spherical tool, m.
    pub radius: f64,
    /// Coefficient of friction.
    pub friction: f64,
    /// Stiffness where `x > 0`, relative to the stiffness elsewhere.
    pub edge: f64,
}

impl Default for BedParams {
    fn default() -> Self {
        Self {
            compliance: 0.02,
            stiffening: 50.0,
            spacing: 2e-3,
            n_side: 21,
            radius: 8e-3,
            friction: 0.0,
            edge: 1.0,
        }
    }
}

/// The bed. Its surface is `z = 0` around the origin. The tool is a sphere centred at the device's
/// position and pressed along −z.
#[derive(Debug, Clone)]
pub struct Bed {
    params: BedParams,
    rest: Vec<Vec3>,
    soft: Vec<f64>,
    force: Vec<Vec3>,
    anchor: Vec<Vec3>,
    step: u64,
}

impl Bed {
    /// A bed that nothing touches yet.
    pub fn new(params: &BedParams) -> Self {
        let half = 0.5 * (params.n_side.saturating_sub(1)) as f64 * params.spacing;
        let mut rest = Vec::new();
        for j in 0..params.n_side {
            for i in 0..params.n_side {
                let at = |k: usize| k as f64 * params.spacing - half;
                rest.push(Vec3::new(at(i), at(j), 0.0));
            }
        }
        let soft = rest
            .iter()
            .map(|p| {
                if p.x > 0.0 {
                    1.0 / params.edge.sqrt()
                } else {
                    1.0
                }
            })
            .collect();
        Self {
            params: *params,
            soft,
            force: vec![Vec3::zeros(); rest.len()],
            anchor: vec![Vec3::zeros(); rest.len()],
            rest,
            step: 0,
        }
    }

    /// Solves the contact with the tool at this pose and writes it to `patch`. Returns the force on
    /// the tool, N.
    pub fn step(
        &mut self,
        pose: &Pose,
        sampled_at: f64,
        period: f64,
        patch: &mut ContactPatch,
    ) -> Vec3 {
        let centre = pose.translation.vector;
        let radius = self.params.radius;
        let depth = (radius - centre.z).max(0.0);
        let scale = self.params.compliance / (1.0 + self.params.stiffening * depth);
        let mut near: Vec<(f64, usize)> = (self.rest.iter().enumerate())
            .map(|(i, p)| ((p - centre).norm() - radius, i))
            .filter(|(gap, _)| *gap < 3e-3)
            .collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        near.truncate(40.min(MAX_CONTACTS));
        near.sort_by_key(|(_, i)| *i);
        let ids: Vec<usize> = near.iter().map(|(_, i)| *i).collect();
        let k = ids.len();
        for (i, force) in self.force.iter_mut().enumerate() {
            if ids.binary_search(&i).is_err() {
                *force = Vec3::zeros();
            }
        }
        let a = self.params.spacing;
        let compliance = |i: usize, j: usize| {
            let apart = (self.rest[i] - self.rest[j]).norm_squared();
            scale * self.soft[i] * self.soft[j] * a / (apart + a * a).sqrt()
        };
        let w: Vec<f64> = (0..k * k)
            .map(|e| compliance(ids[e % k], ids[e / k]))
            .collect();
        let mut x: Vec<Vec3> = (0..k)
            .map(|i| {
                (0..k).fold(self.rest[ids[i]], |x, j| {
                    x + self.force[ids[j]] * w[i + k * j]
                })
            })
            .collect();
        for _ in 0..2000 {
            let mut change = 0.0;
            for i in 0..k {
                let id = ids[i];
                let own = w[i + k * i];
                let outward = (x[i] - centre).normalize();
                let gap = (x[i] - centre).norm() - radius;
                let old = self.force[id];
                let pressed = (outward.dot(&old) - gap / own).max(0.0);
                let flat = |v: Vec3| v - outward * outward.dot(&v);
                let slip = flat(x[i] - centre - self.anchor[id]);
                let mut held = flat(old) - slip / own;
                let most = self.params.friction * pressed;
                if held.norm() > most {
                    held *= most / held.norm();
                }
                let by = outward * pressed + held - old;
                self.force[id] += by;
                change += by.norm();
                for (j, x) in x.iter_mut().enumerate() {
                    *x += by * w[j + k * i];
                }
            }
            if change < 1e-9 {
                break;
            }
        }
        let mut total = Vec3::zeros();
        for (i, id) in ids.iter().enumerate() {
            let force = self.force[*id];
            let outward = (x[i] - centre).normalize();
            let held = force - outward * outward.dot(&force);
            let slides = held.norm() >= self.params.friction * outward.dot(&force) * (1.0 - 1e-9);
            if slides || force == Vec3::zeros() {
                self.anchor[*id] = x[i] - centre;
            }
            total -= force;
        }
        self.step += 1;
        self.fill(pose, sampled_at, period, &ids, &x, &w, patch);
        total
    }

    #[expect(clippy::too_many_arguments, reason = "the parts of one step")]
    fn fill(
        &self,
        pose: &Pose,
        sampled_at: f64,
        period: f64,
        ids: &[usize],
        x: &[Vec3],
        w: &[f64],
        patch: &mut ContactPatch,
    ) {
        let k = ids.len();
        patch.id = self.step;
        patch.sampled_at = sampled_at;
        patch.period = period;
        patch.n_tools = 1;
        patch.n_contacts = k;
        let mut total = Vec3::zeros();
        for (i, id) in ids.iter().enumerate() {
            let d = x[i] - pose.translation.vector;
            let normal = d.normalize();
            let force = self.force[*id];
            total -= force;
            patch.contacts[i] = Candidate {
                vertex: u32::try_from(*id).unwrap_or(u32::MAX),
                tool: 0,
                position: x[i],
                force,
                surface: normal * self.params.radius,
                normal,
                curvature: (Mat3::identity() - normal * normal.transpose()) / self.params.radius,
                anchor: self.anchor[*id],
            };
            for j in 0..k {
                patch.set_block(i, j, &(Mat3::identity() * w[i + k * j]));
            }
        }
        patch.tools[0] = ToolContact {
            pose: *pose,
            friction: self.params.friction,
            is_bonded: false,
            force: total,
            // The bed does not know it; the servo estimates it.
            stiffness: Mat3::zeros(),
        };
    }
}
