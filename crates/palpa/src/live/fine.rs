//! The scene's body, fine where the tool is.

use std::collections::VecDeque;
use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

use palpa_fem::realtime::FineBodies;
use palpa_fem::{FemError, Materials, Model, ModelParams};
use palpa_mesh::Vec3;
use palpa_scene::Scene;

use super::zone_radius;
use crate::build::{BuiltBody, nearest};
use crate::continuum;
use crate::press::mesh::CoarseBody;

/// The fine part holds a zone, and so much round it, m.
const MARGIN: f64 = 15e-3;
/// Meshes that are kept to be used again.
const MOST_KEPT: usize = 24;

/// Meshes of the scene's body, each fine round a vertex of the body as it was grown.
pub struct FineScene {
    scene: Scene,
    coarse: CoarseBody,
    materials: Materials,
    radius: f64,
    /// The latest last. Only the background takes it.
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
    /// Of a scene and the body that was grown for it.
    ///
    /// # Errors
    /// When the scene does not fit the body.
    pub fn new(scene: &Scene, built: &BuiltBody) -> anyhow::Result<Self> {
        let lumps = continuum::lumps(scene, built, &mut Vec::new())?;
        let coarse = CoarseBody::build(scene, built, &lumps)?;
        Ok(Self {
            coarse,
            materials: Materials {
                materials: continuum::materials(scene)?,
                layers: (0..scene.layers.len()).collect(),
                lumps,
                stiffness: None,
            },
            radius: zone_radius(scene) + MARGIN,
            kept: Mutex::default(),
            scene: scene.clone(),
        })
    }

    fn build(&self, place: Vec3) -> Result<Model, FemError> {
        let body = self.coarse.fine_round(&self.scene, place, self.radius);
        let supports = continuum::supports(self.scene.body.cut_faces, &body, &mut Vec::new());
        let params = ModelParams {
            alpha: self.scene.model.alpha,
        };
        Model::build(&body, &self.materials, &supports, params)
    }
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
        // Whoever panicked with it left whole meshes behind.
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let found = kept.iter().position(|(at, _)| *at == place);
        let model = match found.and_then(|i| kept.remove(i)) {
            Some((_, model)) => model,
            None => Arc::new(self.build(place)?),
        };
        if kept.len() >= MOST_KEPT {
            kept.pop_front();
        }
        kept.push_back((place, Arc::clone(&model)));
        Ok(model)
    }
}
