//! The contact problem of one tick: all candidates of all tools at once, at the devices' poses.
//!
//! ```text
//! x = x0 + W (r − r0),   y_i = x_i − q_t,   q_t = −c_t Σ r_i      tool t stands off its device by the coupling c_t
//! ```
//! Block Gauss–Seidel over the contacts, each solved exactly ([`Contact`]). A nonlinear conjugate
//! gradient step follows every sweep (after Silcowitz-Hansen, Niebe & Erleben 2010). Where fine
//! meshes or a coupling tie the contacts together, plain sweeps need 3 to 10 times as many. The
//! solver updates `x` together with `r`, so it multiplies by the whole of `W` only when a patch
//! arrives. A tick starts from the solution of the previous tick.

mod adopt;
mod anchors;
mod store;
mod sweeps;

use self::adopt::Key;
use self::sweeps::Solution;
use crate::axpy::add_three;
use crate::contact::{Contact, ContactInput};
use crate::{ContactPatch, MAX_CONTACTS, MAX_TOOLS, Mat3, Pose, ServoParams, Vec3};

const N: usize = ContactPatch::STRIDE;
/// Largest number of contact visits in one tick, whatever the settings say. The next tick continues
/// from there.
const MAX_VISITS: u32 = 1200;
/// Ratio of the squared norm of a compliance to its squared trace above which it counts as of rank
/// one. It is 1 for rank one, and below 0.6 for a vertex of an elastic half-space.
const RANK_ONE: f64 = 0.98;

/// The load of a solution on one tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ToolLoad {
    /// Force of the tissue on the tool, N.
    pub(crate) force: Vec3,
    /// Its moment about the device's position, N m.
    pub(crate) torque: Vec3,
    /// `rᵀ W r` of the tool's own contacts, J: twice the energy that the tissue stores in the
    /// patch's model.
    pub(crate) work: f64,
    /// Energy stored in the local model, J.
    pub(crate) stored: f64,
    /// Energy that friction took in the tick, J.
    pub(crate) rubbed: f64,
}

impl ToolLoad {
    pub(crate) const ZERO: Self = Self {
        force: Vec3::new(0.0, 0.0, 0.0),
        torque: Vec3::new(0.0, 0.0, 0.0),
        work: 0.0,
        stored: 0.0,
        rubbed: 0.0,
    };

    /// Whether all numbers are finite, and force and moment are of a plausible size.
    pub(crate) fn is_finite(&self) -> bool {
        let small = |x: &f64| x.abs() < 1e12;
        self.force.iter().all(small)
            && self.torque.iter().all(small)
            && [self.work, self.stored, self.rubbed].iter().all(small)
    }
}

/// The contacts of the current patch, with their forces and friction anchors.
#[derive(Debug, Clone)]
pub(crate) struct ContactSolver {
    /// Number of contacts; of each array below, the first `n` entries are used.
    n: usize,
    /// Vertex and tool of each contact.
    key: [Key; MAX_CONTACTS],
    /// Forces of the tools on the vertices, N.
    force: [Vec3; MAX_CONTACTS],
    /// Anchor of each contact, in its tool's frame, m.
    anchor: [Vec3; MAX_CONTACTS],
    is_sliding: [bool; MAX_CONTACTS],
    contact: [Contact; MAX_CONTACTS],
    /// Each vertex's own compliance, m/N: a copy of the diagonal blocks of `W`, which lie a cache
    /// line or more apart.
    own: [Mat3; MAX_CONTACTS],
    /// Positions `x` of the vertices, m, as a flat array.
    position: [f64; N],
    /// Positions of the vertices without any force, m, as a flat array.
    free: [f64; N],
    /// Direction of the conjugate gradients, N.
    direction: [Vec3; MAX_CONTACTS],
    /// Displacement by `direction`, m, as a flat array.
    drift: [f64; N],
    /// Forces before the sweep, N.
    last_force: [Vec3; MAX_CONTACTS],
    /// Positions before the sweep, m.
    last_position: [f64; N],
    /// Displacement of each tool from its device, m.
    stretch: [Vec3; MAX_TOOLS],
}

impl ContactSolver {
    pub(crate) const fn new() -> Self {
        Self {
            n: 0,
            key: [Key::NONE; MAX_CONTACTS],
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

    /// Forgets all forces and anchors.
    pub(crate) fn clear(&mut self) {
        self.n = 0;
        self.stretch = [Vec3::zeros(); MAX_TOOLS];
    }

    /// Finds the forces at these poses, starting from those of the last call. `couplings` are in
    /// m/N. The tick makes `solutions` such calls, and they share its limit of contact visits.
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
            // Some sweeps are reserved for the later passes: their corrections matter more than the
            // last digit of this pass.
            let allowed = if pass + 1 == passes {
                left
            } else {
                (left * 2 / 3).max(1)
            };
            let before = solution.sweeps;
            self.sweep_until_done(patch, couplings, params.tolerance, allowed, &mut solution);
            // A pass that converges in its first sweep changes nothing, so no further pass is
            // needed.
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

    /// The load on a tool.
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

    /// Compliance along the tool's normal of the vertex nearest to the tool, m/N; `None` without
    /// candidates.
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
                nearest = Some(along_normal(own, &(pose.rotation * candidate.normal)));
            }
        }
        nearest
    }

    /// Displacement of a tool from its device by the coupling, m.
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
}

/// Compliance of a vertex along a unit normal, m/N.
///
/// Without friction the tissue computes the response along the normal of its step only: a matrix of
/// rank one, whose trace is that compliance.
fn along_normal(own: &Mat3, normal: &Vec3) -> f64 {
    let trace = own.trace();
    if own.norm_squared() > RANK_ONE * trace * trace {
        trace
    } else {
        normal.dot(&(own * normal))
    }
}

/// A tool of a patch; `None` if the patch does not have it.
fn tool_of(patch: &ContactPatch, tool: u32) -> Option<&crate::ToolContact> {
    patch
        .tools
        .get(..patch.n_tools.min(MAX_TOOLS))
        .and_then(|tools| tools.get(tool as usize))
}

/// Adds the compliance of contact `j` times a force to the first `used` entries of `x`.
#[inline]
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

#[inline]
fn vec3(x: &[f64]) -> Vec3 {
    let mut v = Vec3::zeros();
    for (v, x) in v.iter_mut().zip(x) {
        *v = *x;
    }
    v
}
