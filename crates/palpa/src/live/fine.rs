//! Meshes of the scene's body that are fine where the tool is.

use std::collections::VecDeque;
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use palpa_fem::realtime::FineBodies;
use palpa_fem::{FemError, Model};
use palpa_mesh::Vec3;
use palpa_scene::Scene;

use crate::build::nearest;
use crate::continuum;
use crate::prepare::{Prepared, element_params};
use crate::press::mesh::CoarseBody;

/// The fine part of the mesh is larger than what the tool presses by this margin, m: the tool may go
/// about half of it until the mesh ahead of it must be ready. Beside the fine part, where there is no contact,
/// edges grow as in a mesh that does not move.
const MARGIN: f64 = 12e-3;
/// Largest number of meshes that are kept for reuse.
const MOST_KEPT: usize = 24;

/// Meshes of the scene's body, each fine around one vertex of the body as it was grown.
pub struct FineScene {
    prepared: Arc<Prepared>,
    coarse: CoarseBody,
    radius: f64,
    /// Meshes kept for reuse, with the place around which each is fine; the latest is last. It is
    /// not locked while a mesh is made, so a panic there leaves it whole.
    kept: Mutex<VecDeque<(Vec3, Arc<Model>)>>,
}

impl fmt::Debug for FineScene {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("FineScene")
            .field("radius", &self.radius)
            .finish_non_exhaustive()
    }
}

impl FineScene {
    /// Sets up the meshes of a prepared scene.
    ///
    /// # Errors
    /// When the scene does not fit the body.
    pub fn new(prepared: Arc<Prepared>) -> anyhow::Result<Self> {
        let scene = &prepared.scene;
        Ok(Self {
            coarse: CoarseBody::build(
                scene,
                &prepared.grown,
                prepared.lumps(),
                prepared.mesh.sizes,
            )?,
            radius: pressed_radius(scene) + MARGIN,
            kept: Mutex::default(),
            prepared,
        })
    }

    fn kept(&self) -> MutexGuard<'_, VecDeque<(Vec3, Arc<Model>)>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes the mesh of a place from those that are kept.
    fn take(&self, place: Vec3) -> Option<Arc<Model>> {
        let mut kept = self.kept();
        let found = kept.iter().position(|(at, _)| *at == place)?;
        kept.remove(found).map(|(_, model)| model)
    }

    fn build(&self, place: Vec3) -> Result<Model, FemError> {
        let scene = &self.prepared.scene;
        let body = self.coarse.fine_round(scene, place, self.radius);
        let supports = continuum::supports(scene.body.cut_faces, &body, &mut Vec::new());
        Model::build(
            &body,
            &self.prepared.materials,
            &supports,
            element_params(scene),
        )
    }
}

/// Radius of the skin that the tool presses at the depth of the scene's motion, m.
pub(super) fn pressed_radius(scene: &Scene) -> f64 {
    let radius = scene.tool.contact_radius();
    scene.tool.contact().map_or(radius, |tool| {
        let ([x, y], round) = tool.shape.reach(scene.motion.depth);
        x.hypot(y) + round
    })
}

impl FineBodies for FineScene {
    fn place(&self, point: Vec3) -> Vec3 {
        let skin = &self.coarse.body.skin;
        skin.points[nearest(skin, point)]
    }

    fn radius(&self) -> f64 {
        self.radius
    }

    fn model(&self, place: Vec3) -> Result<Arc<Model>, FemError> {
        let model = match self.take(place) {
            Some(model) => model,
            None => Arc::new(self.build(place)?),
        };
        let mut kept = self.kept();
        if kept.len() >= MOST_KEPT {
            kept.pop_front();
        }
        kept.push_back((place, Arc::clone(&model)));
        Ok(model)
    }
}
