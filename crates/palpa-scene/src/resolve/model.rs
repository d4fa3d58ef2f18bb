//! The models of response and the mesh.

use super::Reader;
use crate::SceneError;
use crate::file::{DynamicsName, MeshTable, ModelTable, ReferenceTable};
use crate::limits;
use crate::model::{Damping, Dynamics, Mesh, Model};
use crate::scene::Reference;
use crate::tool::Tool;
use crate::units::Length;

impl Reader<'_> {
    pub(super) fn model(&self, model: &ModelTable) -> Result<Model, SceneError> {
        let at = self.site("model");
        let dynamics = match (model.dynamics, &model.damping) {
            (DynamicsName::QuasiStatic, None) => Dynamics::QuasiStatic,
            (DynamicsName::QuasiStatic, Some(_)) => {
                return Err(at.key("damping").invalid(
                    "damping has no effect in equilibrium; add `dynamics = \"implicit\"` or remove `damping`",
                ));
            }
            (DynamicsName::Implicit, None) => Dynamics::Implicit(Damping::default()),
            (DynamicsName::Implicit, Some(damping)) => {
                let at = at.key("damping");
                let mass = at.key("mass").within(damping.mass, &limits::DAMPING_MASS)?;
                let stiffness = at
                    .key("stiffness")
                    .within(damping.stiffness, &limits::DAMPING_STIFFNESS)?;
                Dynamics::Implicit(Damping {
                    mass: mass.si(),
                    stiffness: stiffness.si(),
                })
            }
        };
        Ok(Model {
            kind: model.kind,
            alpha: match model.alpha {
                None => None,
                Some(alpha) => Some(at.key("alpha").within(alpha, &limits::ALPHA)?),
            },
            below: None,
            dynamics,
            tolerance: at
                .key("tolerance")
                .within(model.tolerance, &limits::TOLERANCE)?,
        })
    }

    pub(super) fn mesh(&self, mesh: &MeshTable, tool: &Tool) -> Result<Mesh, SceneError> {
        let at = self.site("mesh");
        let edge = |key, length: Option<Length>| match length {
            None => Ok(None),
            Some(length) => Ok(Some(at.key(key).within(length, &limits::EDGE_LENGTH)?.si())),
        };
        let growth = |key, growth: Option<f64>| match growth {
            None => Ok(None),
            Some(growth) => at.key(key).within(growth, &limits::GROWTH).map(Some),
        };
        if let (Some(_), Some(near_tool)) = (mesh.accuracy, mesh.near_tool) {
            return Err(at.key("near_tool").invalid(format!(
                "{near_tool} beside `accuracy`, which chooses this length; remove one of the two"
            )));
        }
        if mesh.accuracy.is_some() && !mesh.refine {
            return Err(at.key("refine").invalid(
                "false beside `accuracy`, which needs a mesh that may be refined; remove one of the two",
            ));
        }
        if mesh.accuracy.is_some() && !tool.has_size() {
            return Err(at.key("accuracy").invalid(Mesh::NO_LIMIT));
        }
        Ok(Mesh {
            refine: mesh.refine,
            coarsen: mesh.coarsen,
            near_tool: edge("near_tool", mesh.near_tool)?,
            near_lumps: edge("near_lumps", mesh.near_lumps)?,
            growth: growth("growth", mesh.growth)?,
            level_growth: growth("level_growth", mesh.level_growth)?,
            max_vertices: at
                .key("max_vertices")
                .within(mesh.max_vertices, &limits::MESH_VERTICES)?
                as usize,
            accuracy: match mesh.accuracy {
                None => None,
                Some(share) => Some(at.key("accuracy").within(share, &limits::ACCURACY)?.si()),
            },
            max_time: match mesh.max_time {
                None => None,
                Some(time) => Some(at.key("max_time").within(time, &limits::SEARCH_TIME)?.si()),
            },
            moves: mesh.moves,
        })
    }

    pub(super) fn reference(&self, reference: &ReferenceTable) -> Result<Reference, SceneError> {
        let at = self.site("reference");
        let gain = |key, gain| at.key(key).within(gain, &limits::GAIN);
        Ok(Reference {
            substeps: at
                .key("substeps")
                .within(reference.substeps, &limits::SUBSTEPS)?,
            solver: reference.solver,
            in_plane: reference.in_plane,
            spring_gain: gain("spring_gain", reference.spring_gain)?,
            shape_gain: gain("shape_gain", reference.shape_gain)?,
        })
    }
}
