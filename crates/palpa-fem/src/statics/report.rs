//! The result of a static step.

use palpa_mesh::Vec3;

use super::active_set::ContactResiduals;
use super::newton::Newton;
use super::workspace::Workspace;
use crate::assembly::energy;
use crate::posed_tool::PosedTool;
use crate::state::{State, Touch};

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
    /// Slip over which friction had to be smoothed, m: vertices that would stick creep by about
    /// this much. 0 for the exact law, which nearly every step satisfies.
    pub friction_smoothing: f64,
    /// Strain energy, J; for a viscous material, the energy of the step's potential.
    pub energy: f64,
    /// Force of the tissue on each tool, N.
    pub tool_forces: Vec<Vec3>,
    /// Area of skin in contact with each tool, m² at rest.
    pub tool_areas: Vec<f64>,
    /// Largest pressure on a vertex under each tool, Pa (force divided by its area at rest).
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
    pub(super) fn report(&self, state: &State, ws: &Workspace, outcome: Outcome) -> StepReport {
        let n_tools = self.load.tools.len();
        let mut report = StepReport {
            outcome,
            iterations: self.iterations,
            substeps: 1,
            residual: self.residual,
            contact: ContactResiduals::default(),
            friction_smoothing: ws.contacts.smoothing,
            energy: energy(self.model, &ws.memory, &state.displacements),
            tool_forces: vec![Vec3::zeros(); n_tools],
            tool_areas: vec![0.0; n_tools],
            tool_pressures: vec![0.0; n_tools],
            held_force: Vec3::zeros(),
            support_force: Vec3::zeros(),
            shift: self.shift,
        };
        self.report_contacts(state, ws, &mut report);
        self.report_holds(ws, &mut report);
        report
    }

    /// Forces on the tools, and the violation of the laws of contact.
    fn report_contacts(&self, state: &State, ws: &Workspace, report: &mut StepReport) {
        let model = self.model;
        for contact in &ws.contacts.active {
            let Some(tool) = contact.touch.tool() else {
                continue;
            };
            let force = ws.forces[contact.node];
            contact.measure(&force, &mut report.contact);
            report.tool_forces[tool] -= force;
            let area = model.skin_areas[contact.vertex];
            report.tool_areas[tool] += area;
            let pressure = contact.pressure(&force) / area;
            report.tool_pressures[tool] = report.tool_pressures[tool].max(pressure);
        }
        for (vertex, touch) in state.touches.iter().enumerate() {
            let node = model.body.node(vertex, 0);
            if *touch == Touch::Open && ws.given[node].n < 3 {
                let x = model.body.positions[node] + state.displacements[node];
                for PosedTool { tool, pose } in self.load.tools {
                    let depth = -tool.distance_at(pose, &x).distance;
                    report.contact.penetration = report.contact.penetration.max(depth);
                }
            }
        }
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
