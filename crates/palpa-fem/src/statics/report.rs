//! The result of a static step.

use palpa_mesh::Vec3;

use super::contacts::ContactResiduals;
use super::newton::Newton;
use super::workspace::Workspace;
use crate::assembly::energy;
use crate::state::State;

/// The outcome of a step.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Outcome {
    /// All laws hold within the tolerances.
    Converged,
    /// The iteration limit was reached.
    IterationLimit {
        /// Place of the largest unbalanced force, at rest, m.
        at: [f64; 3],
    },
    /// Tissue would be turned inside out.
    Inverted {
        /// The place, at rest, m.
        at: [f64; 3],
    },
    /// The stiffness could not be made positive definite.
    Singular,
}

/// Figures of a step.
#[derive(Debug, Clone, PartialEq)]
pub struct StepReport {
    /// The outcome. Unless the step converged, the state is unchanged.
    pub outcome: Outcome,
    /// Newton iterations, of all substeps.
    pub iterations: usize,
    /// Number of substeps, 1 if the step was not divided.
    pub substeps: usize,
    /// Residual: unbalanced forces relative to the forces that hold the body.
    pub residual: f64,
    /// Violation of the laws of contact.
    pub contact: ContactResiduals,
    /// Strain energy, J; for a viscous material, the energy of the step's potential.
    pub energy: f64,
    /// Force of the tissue on each tool, N.
    pub tool_forces: Vec<Vec3>,
    /// Area of skin in contact with each tool, m² at rest.
    pub tool_areas: Vec<f64>,
    /// Largest pressure at a vertex under each tool, Pa (mean over the area round it, at rest).
    pub tool_pressures: Vec<f64>,
    /// Force of the tissue on the holds and guides of nodes, N.
    pub held_force: Vec3,
    /// Force of the tissue on its supports (bone, cut faces), N.
    pub support_force: Vec3,
    /// Largest shift that made the stiffness positive definite, relative to its diagonal.
    pub shift: f64,
}

impl Newton<'_> {
    /// The report of a solve that has ended.
    pub(super) fn report(&self, ws: &Workspace, state: &State, outcome: Outcome) -> StepReport {
        let tools = || 0..self.load.tools.len();
        let contacts = &ws.contacts;
        let mut report = StepReport {
            outcome,
            iterations: self.iterations,
            substeps: 1,
            residual: self.residual,
            contact: ContactResiduals {
                mismatch: self.mismatch,
                penetration: contacts.penetration(),
            },
            energy: energy(self.model, &ws.memory, &state.displacements),
            tool_forces: tools().map(|tool| contacts.tool_force(tool)).collect(),
            tool_areas: tools().map(|tool| contacts.area(tool)).collect(),
            tool_pressures: tools()
                .map(|tool| contacts.largest_pressure(tool))
                .collect(),
            held_force: Vec3::zeros(),
            support_force: Vec3::zeros(),
            shift: self.shift,
        };
        self.report_holds(ws, &mut report);
        report
    }

    /// Forces on holds, guides and supports.
    fn report_holds(&self, ws: &Workspace, report: &mut StepReport) {
        for &(node, _) in self.load.held {
            report.held_force -= ws.forces[node];
        }
        for (node, direction, _) in self.load.guided {
            report.held_force -= direction * direction.dot(&ws.forces[*node]);
        }
        for (node, hold) in self.model.supports.iter().enumerate() {
            if hold.n > 0 {
                report.support_force -= ws.forces[node] - hold.free_part(&ws.forces[node]);
            }
        }
    }
}
