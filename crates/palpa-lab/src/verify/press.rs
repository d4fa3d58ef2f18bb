//! Shared by the cases: bodies pressed by a bonded disc or by a tool.

use palpa_fem::shape::{Pose, Tool};
use palpa_fem::{
    Load, Material, Materials, Model, ModelParams, Outcome, PosedTool, SolveParams, State,
    StepReport, Supports, Workspace, advance,
};
use palpa_mesh::{LayeredBody, Vec3};

use crate::verify::VerifyError;

/// Share of the pair's mean deviator in all cases: the default of a scene.
pub(crate) const ALPHA: f64 = 0.8;

/// A body that is being pressed.
pub(crate) struct Pressed {
    pub(crate) model: Model,
    pub(crate) state: State,
    pub(crate) ws: Workspace,
    pub(crate) params: SolveParams,
    held: Vec<(usize, Vec3)>,
    tools: Vec<PosedTool>,
}

impl Pressed {
    pub(crate) fn new(
        body: &LayeredBody,
        materials: &Materials,
        supports: &Supports,
    ) -> Result<Self, VerifyError> {
        let model = Model::build(body, materials, supports, ModelParams::even(ALPHA))?;
        Ok(Self {
            state: State::new(&model),
            ws: Workspace::new(&model),
            model,
            params: SolveParams::default(),
            held: Vec::new(),
            tools: Vec::new(),
        })
    }

    /// A body on a fixed base, with one material for each layer.
    pub(crate) fn layered(
        body: &LayeredBody,
        materials: Vec<Material>,
    ) -> Result<Self, VerifyError> {
        Self::new(
            body,
            &Materials::of_layers(materials),
            &Supports::on_base(body),
        )
    }

    pub(crate) fn nodes(&self) -> usize {
        self.model.n_free_nodes()
    }

    /// Solves for a load. If it does not converge, returns an error that names `what`.
    pub(crate) fn step(&mut self, load: &Load<'_>, what: &str) -> Result<StepReport, VerifyError> {
        let before = Load {
            tools: &self.tools,
            held: &self.held,
            ..Load::default()
        };
        let report = advance(
            &self.model,
            &mut self.state,
            &mut self.ws,
            &before,
            load,
            &self.params,
        );
        if report.outcome != Outcome::Converged {
            return Err(VerifyError::NotConverged {
                what: what.to_owned(),
                outcome: format!("{:?}", report.outcome),
            });
        }
        self.tools = load.tools.to_vec();
        self.held = load.held.to_vec();
        Ok(report)
    }

    /// Moves the bonded skin vertices down by `depth`, m. Returns the resisting force, N.
    pub(crate) fn hold_down(&mut self, vertices: &[u32], depth: f64) -> Result<f64, VerifyError> {
        let held: Vec<(usize, Vec3)> = vertices
            .iter()
            .map(|&v| (self.model.body().node(v as usize, 0), -Vec3::z() * depth))
            .collect();
        let load = Load {
            held: &held,
            ..Load::default()
        };
        let report = self.step(&load, &format!("disc at {:.1} mm", depth * 1e3))?;
        Ok(report.held_force.z)
    }

    /// Moves a tool at (x, y) down to `depth`, m, below the plane z = 0.
    pub(crate) fn press(
        &mut self,
        tool: Tool,
        at: [f64; 2],
        depth: f64,
    ) -> Result<StepReport, VerifyError> {
        let tools = [PosedTool {
            tool,
            pose: Pose::translation(at[0], at[1], -depth),
        }];
        let load = Load {
            tools: &tools,
            ..Load::default()
        };
        self.step(&load, &format!("tool at {:.3} mm", depth * 1e3))
    }

    /// Displacement of the skin at the reference point (x, y), m, linear in its triangle; `None`
    /// off the skin.
    pub(crate) fn skin_displacement(&self, x: f64, y: f64) -> Option<Vec3> {
        let body = self.model.body();
        for triangle in &body.skin.triangles {
            let p = triangle.map(|v| body.skin.points[v as usize]);
            let area = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| {
                (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
            };
            let [a, b, c] = p.map(|p| [p.x, p.y]);
            let whole = area(a, b, c);
            let at = [x, y];
            let w = [area(at, b, c), area(a, at, c), area(a, b, at)].map(|s| s / whole);
            if w.iter().all(|&w| w >= -1e-9) {
                let u = triangle.map(|v| self.state.displacements[body.node(v as usize, 0)]);
                return Some(u[0] * w[0] + u[1] * w[1] + u[2] * w[2]);
            }
        }
        None
    }
}
