//! The result of a static step.

use palpa_mesh::Vec3;

use super::active_set::ContactResiduals;
use super::newton::Newton;
use super::workspace::Workspace;
use crate::posed_tool::PosedTool;
use crate::state::{State, Touch};

/// How a step ended.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Outcome {
    /// All laws hold to the tolerances.
    Converged,
    /// The iterations were used up.
    IterationLimit {
        /// Where the forces are most out of balance, at rest, m.
        at: [f64; 3],
    },
    /// Tissue would be turned inside out.
    Inverted {
        /// Where, at rest, m.
        at: [f64; 3],
    },
    /// The stiffness could not be made positive definite.
    Singular,
}

/// Figures of a step.
#[derive(Debug, Clone, PartialEq)]
pub struct StepReport {
    /// How it ended; unless it converged, the state is as it was before.
    pub outcome: Outcome,
    /// Newton iterations, of all substeps.
    pub iterations: usize,
    /// Substeps into which the step was divided, 1 if it went in one.
    pub substeps: usize,
    /// Forces out of balance, as a share of those that hold the body.
    pub residual: f64,
    /// How far the state is from obeying the laws of contact.
    pub contact: ContactResiduals,
    /// Slip over which friction had to be smoothed, m; vertices that would be held creep by about
    /// as much. 0 for the exact law, which nearly every step obeys.
    pub friction_smoothing: f64,
    /// Strain energy, J; of a viscous material, the energy of the step's potential.
    pub energy: f64,
    /// For each tool the force of the tissue on it, N.
    pub tool_forces: Vec<Vec3>,
    /// For each tool the area of skin that touches it, m² at rest.
    pub tool_areas: Vec<f64>,
    /// For each tool the largest pressure on a vertex, Pa (force by its area at rest).
    pub tool_pressures: Vec<f64>,
    /// Force of the tissue on the holds and guides of nodes, N.
    pub held_force: Vec3,
    /// Force of the tissue on its supports (bone, cut faces), N.
    pub support_force: Vec3,
    /// Largest shift that the stiffness needed to be positive definite, as a share of its diagonal.
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
            energy: self.energy,
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

    /// Forces on the tools, and how well the laws of contact hold.
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
