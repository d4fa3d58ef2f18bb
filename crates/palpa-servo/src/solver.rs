//! The contact problem of one tick: all candidates of all tools at once, at the devices' poses.
//!
//! ```text
//! x = x0 + W (r − r0),   y_i = x_i − q_t,   q_t = −c_t Σ r_i      tool t stands off its device by the coupling c_t
//! ```
//! Block Gauss–Seidel over the contacts, each solved exactly ([`Contact`]), with a nonlinear conjugate gradient step on
//! top of every sweep (after Silcowitz-Hansen, Niebe & Erleben 2010): plain sweeps need 3 to 10 times as many where fine
//! meshes or a coupling tie the contacts together. `x` is kept with `r` through all of it, so that nothing is multiplied
//! by the whole of `W` but when a patch arrives, and a tick starts from where the last one ended.

use crate::axpy::add_three;
use crate::contact::{Contact, ContactInput};
use crate::{ContactPatch, MAX_CONTACTS, MAX_TOOLS, Mat3, Pose, ServoParams, Vec3};

const N: usize = ContactPatch::STRIDE;
/// Contact forces below this do not matter, N: a change of their sum by it ends the sweeps.
const FORCE_DUST: f64 = 1e-7;

/// Visits of contacts in one tick, whatever the settings say: what is not settled then goes on in the next.
const MAX_VISITS: u32 = 1200;
/// How much of the changes of single contacts counts beside that of the tools' forces.
const CONTACT_SHARE: f64 = 0.1;

/// What a solution says of itself.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Solution {
    pub(crate) sweeps: u32,
    pub(crate) residual: f64,
    pub(crate) n_active: u32,
    pub(crate) n_sliding: u32,
}

/// What a solution says of one tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ToolLoad {
    /// Force of the tissue on it, N.
    pub(crate) force: Vec3,
    /// Its moment about the device's position, N m.
    pub(crate) torque: Vec3,
    /// `rᵀ W r` of its own contacts, J: twice the energy that the patch's tissue holds.
    pub(crate) work: f64,
}

impl ToolLoad {
    pub(crate) const ZERO: Self = Self {
        force: Vec3::new(0.0, 0.0, 0.0),
        torque: Vec3::new(0.0, 0.0, 0.0),
        work: 0.0,
    };
}

/// Who a force belongs to, so that it is known again in the next patch.
#[derive(Debug, Clone, Copy)]
struct Known {
    vertex: u32,
    tool: u32,
    force: Vec3,
    anchor: Vec3,
}

/// The contacts of the current patch with their forces and the memory of friction.
#[derive(Debug, Clone)]
pub(crate) struct ContactSolver {
    n: usize,
    /// Forces of the tools on the vertices, N.
    force: [Vec3; MAX_CONTACTS],
    /// Where friction holds each, in the tool's frame.
    anchor: [Vec3; MAX_CONTACTS],
    is_sliding: [bool; MAX_CONTACTS],
    contact: [Contact; MAX_CONTACTS],
    /// Each vertex's own compliance: out of `W`, where every one of them is a cache line apart.
    own: [Mat3; MAX_CONTACTS],
    /// Vertices, flat: `x`, and where they would be without any force.
    position: [f64; N],
    free: [f64; N],
    /// Of the conjugate gradients: direction and its displacement, and where the sweep began.
    direction: [Vec3; MAX_CONTACTS],
    drift: [f64; N],
    last_force: [Vec3; MAX_CONTACTS],
    last_position: [f64; N],
    /// Displacement of each tool off its device, m.
    stretch: [Vec3; MAX_TOOLS],
}

impl ContactSolver {
    pub(crate) const fn new() -> Self {
        Self {
            n: 0,
            force: [Vec3::new(0.0, 0.0, 0.0); MAX_CONTACTS],
            anchor: [Vec3::new(0.0, 0.0, 0.0); MAX_CONTACTS],
            is_sliding: [false; MAX_CONTACTS],
            contact: [Contact::NONE; MAX_CONTACTS],
            own: [Mat3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0); MAX_CONTACTS],
            position: [0.0; N],
            free: [0.0; N],
            direction: [Vec3::new(0.0, 0.0, 0.0); MAX_CONTACTS],
            drift: [0.0; N],
            last_force: [Vec3::new(0.0, 0.0, 0.0); MAX_CONTACTS],
            last_position: [0.0; N],
            stretch: [Vec3::new(0.0, 0.0, 0.0); MAX_TOOLS],
        }
    }

    /// Forgets all forces and what friction held.
    pub(crate) fn clear(&mut self) {
        self.n = 0;
        self.stretch = [Vec3::zeros(); MAX_TOOLS];
    }

    /// Takes a patch over: forces and anchors of vertices that were known go on, of the others the patch's do.
    pub(crate) fn adopt(&mut self, patch: &ContactPatch, old: &ContactPatchKey) {
        let mut known = [Known {
            vertex: u32::MAX,
            tool: 0,
            force: Vec3::zeros(),
            anchor: Vec3::zeros(),
        }; MAX_CONTACTS];
        let n_known = self.n;
        for (((known, key), force), anchor) in known
            .iter_mut()
            .zip(&old.keys)
            .zip(&self.force)
            .zip(&self.anchor)
        {
            *known = Known {
                vertex: key.0,
                tool: key.1,
                force: *force,
                anchor: *anchor,
            };
        }
        let known = known.get(..n_known).unwrap_or_default();
        self.n = patch.n_contacts.min(MAX_CONTACTS);
        for (i, ((candidate, force), anchor)) in patch
            .contacts
            .iter()
            .zip(&mut self.force)
            .zip(&mut self.anchor)
            .take(self.n)
            .enumerate()
        {
            let is_bonded = tool_of(patch, candidate.tool).is_some_and(|tool| tool.is_bonded);
            // The order is mostly the same from patch to patch: the search starts at the same place.
            let (before, after) = known.split_at(i.min(known.len()));
            let found = after
                .iter()
                .chain(before)
                .find(|k| k.vertex == candidate.vertex && k.tool == candidate.tool);
            (*force, *anchor) = match found {
                Some(found) if is_bonded => (found.force, candidate.anchor),
                Some(found) => (found.force, found.anchor),
                None => (candidate.force, candidate.anchor),
            };
        }
        for (i, own) in self.own.iter_mut().enumerate().take(self.n) {
            *own = patch.block(i, i);
        }
        for (free, candidate) in self.free.chunks_exact_mut(3).zip(&patch.contacts) {
            free.copy_from_slice(candidate.position.as_slice());
        }
        let used = 3 * self.n;
        for (j, candidate) in patch.contacts.iter().enumerate().take(self.n) {
            add_columns(
                &patch.compliance,
                j,
                used,
                &-candidate.force,
                &mut self.free,
            );
        }
        self.position = self.free;
        for (j, force) in self.force.iter().enumerate().take(self.n) {
            add_columns(&patch.compliance, j, used, force, &mut self.position);
        }
    }

    /// Finds the forces at these poses, from those of the last call. `couplings` are in m/N; the tick has `solutions` like
    /// this one to share its time.
    pub(crate) fn solve(
        &mut self,
        patch: &ContactPatch,
        poses: &[Pose; MAX_TOOLS],
        couplings: &[f64; MAX_TOOLS],
        params: &ServoParams,
        solutions: u32,
    ) -> Solution {
        let mut solution = Solution::default();
        let passes = params.passes.clamp(1, 4);
        let bound = MAX_VISITS / solutions.max(1) / u32::try_from(self.n).unwrap_or(1).max(1);
        let max_sweeps = params.max_sweeps.clamp(1, 200).min(bound.max(1));
        for pass in 0..passes {
            self.update_stretch(patch, couplings);
            self.linearise(patch, poses, couplings);
            let left = max_sweeps - solution.sweeps;
            // A part is kept for the passes to come: what they correct matters more than the last digit of this one.
            let allowed = if pass + 1 == passes {
                left
            } else {
                (left * 2 / 3).max(1)
            };
            let before = solution.sweeps;
            self.sweep_until_done(patch, couplings, params.tolerance, allowed, &mut solution);
            // A pass that found nothing to do in its first sweep was the last that is needed.
            if solution.sweeps >= max_sweeps || pass > 0 && solution.sweeps == before + 1 {
                break;
            }
        }
        for (force, is_sliding) in self.force.iter().zip(&self.is_sliding).take(self.n) {
            let is_active = *force != Vec3::zeros();
            solution.n_active += u32::from(is_active);
            solution.n_sliding += u32::from(is_active && *is_sliding);
        }
        solution
    }

    /// Friction follows: a vertex that slides, or does not touch, is held from now on where it is.
    pub(crate) fn move_anchors(&mut self, patch: &ContactPatch, poses: &[Pose; MAX_TOOLS]) {
        for ((((candidate, anchor), force), is_sliding), x) in patch
            .contacts
            .iter()
            .zip(&mut self.anchor)
            .zip(&self.force)
            .zip(&self.is_sliding)
            .zip(self.position.chunks_exact(3))
            .take(self.n)
        {
            let t = candidate.tool as usize;
            let (Some(tool), Some(pose), Some(stretch)) = (
                tool_of(patch, candidate.tool),
                poses.get(t),
                self.stretch.get(t),
            ) else {
                continue;
            };
            if !tool.is_bonded && (*is_sliding || *force == Vec3::zeros()) {
                let y = vec3(x) - stretch;
                *anchor = pose.inverse_transform_point(&y.into()).coords;
            }
        }
    }

    /// Lets go of all that friction holds: each vertex is held from now on where it is.
    pub(crate) fn release_anchors(&mut self, patch: &ContactPatch, poses: &[Pose; MAX_TOOLS]) {
        self.is_sliding = [true; MAX_CONTACTS];
        self.move_anchors(patch, poses);
    }

    /// What acts on a tool.
    pub(crate) fn load(&self, patch: &ContactPatch, tool: usize, pose: &Pose) -> ToolLoad {
        let mut load = ToolLoad::ZERO;
        for (((candidate, force), x), free) in patch
            .contacts
            .iter()
            .zip(&self.force)
            .zip(self.position.chunks_exact(3))
            .zip(self.free.chunks_exact(3))
            .take(self.n)
        {
            if candidate.tool as usize == tool {
                let x = vec3(x);
                load.force -= force;
                load.torque -= (x - pose.translation.vector).cross(force);
                load.work += force.dot(&(x - vec3(free)));
            }
        }
        load
    }

    /// Compliance of the vertex that a tool is nearest to, m/N, as a mean over directions.
    pub(crate) fn nearest_compliance(
        &self,
        patch: &ContactPatch,
        tool: usize,
        pose: &Pose,
    ) -> Option<f64> {
        let mut nearest = None;
        let mut least = f64::INFINITY;
        for ((candidate, own), x) in patch
            .contacts
            .iter()
            .zip(&self.own)
            .zip(self.position.chunks_exact(3))
            .take(self.n)
        {
            let d = pose.inverse_transform_point(&vec3(x).into()).coords - candidate.surface;
            let gap = candidate.normal.dot(&d);
            if candidate.tool as usize == tool && gap < least {
                least = gap;
                nearest = Some(own.trace() / 3.0);
            }
        }
        nearest
    }

    /// How far a tool stands off its device, m.
    pub(crate) fn stretch(&self, tool: usize) -> Vec3 {
        self.stretch.get(tool).copied().unwrap_or_default()
    }

    fn update_stretch(&mut self, patch: &ContactPatch, couplings: &[f64; MAX_TOOLS]) {
        for (t, (stretch, coupling)) in self.stretch.iter_mut().zip(couplings).enumerate() {
            let sum = (patch.contacts.iter())
                .zip(&self.force)
                .take(self.n)
                .filter(|(candidate, _)| candidate.tool as usize == t)
                .fold(Vec3::zeros(), |sum, (_, force)| sum + force);
            *stretch = -*coupling * sum;
        }
    }

    fn linearise(
        &mut self,
        patch: &ContactPatch,
        poses: &[Pose; MAX_TOOLS],
        couplings: &[f64; MAX_TOOLS],
    ) {
        for (((((contact, candidate), own), anchor), force), x) in self
            .contact
            .iter_mut()
            .zip(&patch.contacts)
            .zip(&self.own)
            .zip(&self.anchor)
            .zip(&mut self.force)
            .zip(self.position.chunks_exact(3))
            .take(self.n)
        {
            let t = candidate.tool as usize;
            let (Some(tool), Some(pose), Some(stretch), Some(coupling)) = (
                tool_of(patch, candidate.tool),
                poses.get(t),
                self.stretch.get(t),
                couplings.get(t),
            ) else {
                *contact = Contact::NONE;
                *force = Vec3::zeros();
                continue;
            };
            *contact = Contact::linearised(&ContactInput {
                candidate,
                pose,
                position: &(vec3(x) - stretch),
                anchor,
                own: &(own + Mat3::identity() * *coupling),
                friction: tool.friction,
                is_bonded: tool.is_bonded,
            });
        }
    }

    fn sweep_until_done(
        &mut self,
        patch: &ContactPatch,
        couplings: &[f64; MAX_TOOLS],
        tolerance: f64,
        allowed: u32,
        solution: &mut Solution,
    ) {
        let used = 3 * self.n;
        let mut last_sq = 0.0;
        for k in 0..allowed {
            self.last_force = self.force;
            self.last_position = self.position;
            let (change, change_sq, sum) = self.sweep(patch, couplings);
            solution.sweeps += 1;
            solution.residual = change / sum.max(FORCE_DUST);
            // A NaN ends it too.
            if change.is_nan() || change <= tolerance * sum + FORCE_DUST || k + 1 == allowed {
                break;
            }
            let beta = if k > 0 && last_sq > 0.0 {
                change_sq / last_sq
            } else {
                0.0
            };
            last_sq = change_sq;
            // Sweeps that grow again have met another set of contacts: the directions begin anew.
            let beta = if beta > 1.0 { 0.0 } else { beta };
            for (((force, last), direction), _) in self
                .force
                .iter_mut()
                .zip(&self.last_force)
                .zip(&mut self.direction)
                .zip(0..self.n)
            {
                let step = *force - last;
                let kept = if beta > 0.0 {
                    *direction * beta
                } else {
                    Vec3::zeros()
                };
                *force += kept;
                *direction = kept + step;
            }
            for (((x, last), drift), _) in self
                .position
                .iter_mut()
                .zip(&self.last_position)
                .zip(&mut self.drift)
                .zip(0..used)
            {
                let step = *x - last;
                let kept = if beta > 0.0 { *drift * beta } else { 0.0 };
                *x += kept;
                *drift = kept + step;
            }
            self.update_stretch(patch, couplings);
        }
    }

    /// Once over all contacts. How much changed, the sum of the changes' squares, and the sum of the forces.
    ///
    /// What matters is the tools' forces; the contacts', which settle last where vertices are dense, count for a tenth.
    fn sweep(&mut self, patch: &ContactPatch, couplings: &[f64; MAX_TOOLS]) -> (f64, f64, f64) {
        let used = 3 * self.n;
        let (mut change, mut change_sq, mut sum) = (0.0, 0.0, 0.0);
        let mut tool_change = [Vec3::zeros(); MAX_TOOLS];
        for (i, (((contact, candidate), force), is_sliding)) in self
            .contact
            .iter()
            .zip(&patch.contacts)
            .zip(&mut self.force)
            .zip(&mut self.is_sliding)
            .enumerate()
            .take(self.n)
        {
            let t = candidate.tool as usize;
            let (Some(x), Some(stretch), Some(coupling)) = (
                self.position.get(3 * i..3 * i + 3),
                self.stretch.get_mut(t),
                couplings.get(t),
            ) else {
                continue;
            };
            let relaxed = contact.relax(&(vec3(x) - *stretch), force);
            *is_sliding = relaxed.is_sliding;
            let by_sq = relaxed.force.norm_squared();
            if by_sq != 0.0 {
                *force += relaxed.force;
                if force.norm_squared() < 1e-24 {
                    *force = Vec3::zeros();
                }
                *stretch -= relaxed.force * *coupling;
                add_columns(
                    &patch.compliance,
                    i,
                    used,
                    &relaxed.force,
                    &mut self.position,
                );
                change += libm::sqrt(by_sq);
                change_sq += by_sq;
                if let Some(tool_change) = tool_change.get_mut(t) {
                    *tool_change += relaxed.force;
                }
            }
            sum += force.norm();
        }
        let tools = tool_change.iter().map(Vec3::norm).sum::<f64>();
        (tools + CONTACT_SHARE * change, change_sq, sum)
    }
}

/// Which vertex of which tool each contact of a patch is.
#[derive(Debug, Clone)]
pub(crate) struct ContactPatchKey {
    keys: [(u32, u32); MAX_CONTACTS],
}

impl ContactPatchKey {
    pub(crate) const fn new() -> Self {
        Self {
            keys: [(u32::MAX, 0); MAX_CONTACTS],
        }
    }

    pub(crate) fn set(&mut self, patch: &ContactPatch) {
        for (key, candidate) in self.keys.iter_mut().zip(&patch.contacts) {
            *key = (candidate.vertex, candidate.tool);
        }
    }
}

/// A tool of a patch, if the patch has it.
fn tool_of(patch: &ContactPatch, tool: u32) -> Option<&crate::ToolContact> {
    patch
        .tools
        .get(..patch.n_tools.min(MAX_TOOLS))
        .and_then(|tools| tools.get(tool as usize))
}

/// Adds the compliance of contact `j` times a force to the first `used` entries of `x`.
fn add_columns(compliance: &[f64; N * N], j: usize, used: usize, force: &Vec3, x: &mut [f64; N]) {
    let column = |c: usize| {
        let at = N * (3 * j + c);
        compliance.get(at..at + used).unwrap_or_default()
    };
    add_three(
        x,
        [column(0), column(1), column(2)],
        [force.x, force.y, force.z],
    );
}

fn vec3(x: &[f64]) -> Vec3 {
    let mut v = Vec3::zeros();
    for (v, x) in v.iter_mut().zip(x) {
        *v = *x;
    }
    v
}
