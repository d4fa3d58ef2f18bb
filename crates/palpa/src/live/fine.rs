//! Meshes of the scene's body that are fine where the tool is.

use std::collections::VecDeque;
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use palpa_fem::realtime::FineBodies;
use palpa_fem::{FemError, Model};
use palpa_mesh::{SurfaceIndex, Vec3};
use palpa_scene::Scene;

use crate::continuum;
use crate::prepare::{Prepared, element_params};
use crate::press::mesh::CoarseBody;

/// The fine part of the mesh is larger than what the tool presses by this margin, m: the tool may go
/// about half of it until the mesh ahead of it must be ready. Beside the fine part, where there is no contact,
/// edges grow as in a mesh that does not move.
const MARGIN: f64 = 9e-3;
/// Number of parts of an edge of the grown body, between which there are places: with vertices only, a
/// tool would be up to half an edge beside the middle of the fine part.
const PARTS: f64 = 3.0;
/// Largest number of nodes in the meshes that are kept for reuse, but for the latest: a node with its elements takes some
/// 3 kB.
const MOST_KEPT: usize = 60_000;

/// Meshes of the scene's body, each fine around one place of the body as it was grown.
pub struct FineScene {
    prepared: Arc<Prepared>,
    coarse: CoarseBody,
    /// Of the coarse body's skin.
    index: SurfaceIndex,
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
        let coarse = CoarseBody::build(
            scene,
            &prepared.grown,
            prepared.lumps(),
            prepared.mesh.sizes,
        )?;
        Ok(Self {
            index: SurfaceIndex::build(&coarse.body.skin),
            coarse,
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

/// Barycentric weights near the given ones that are multiples of a part.
fn in_parts(weights: [f64; 3]) -> [f64; 3] {
    let exact = weights.map(|w| PARTS * w);
    let mut parts = exact.map(f64::round);
    let excess = parts.iter().sum::<f64>() - PARTS;
    let gives = |k: &usize| excess * (parts[*k] - exact[*k]);
    let most = (0..3).max_by(|a, b| gives(a).total_cmp(&gives(b)));
    parts[most.unwrap_or(0)] -= excess;
    parts.map(|part| part / PARTS)
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
        let Some(closest) = self.index.closest(point) else {
            return point;
        };
        let corners = (self.coarse.body.skin).corners(closest.triangle as usize);
        let weights = in_parts(closest.weights);
        corners.iter().zip(weights).map(|(at, w)| at * w).sum()
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
        let mut n_nodes: usize = kept.iter().map(|(_, model)| model.n_nodes()).sum();
        while n_nodes > MOST_KEPT {
            let Some((_, oldest)) = kept.pop_front() else {
                break;
            };
            n_nodes -= oldest.n_nodes();
        }
        kept.push_back((place, Arc::clone(&model)));
        Ok(model)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_thirds_of_edges_near_the_point() {
        for (given, expected) in [
            ([1.0, 0.0, 0.0], [3, 0, 0]),
            ([0.34, 0.33, 0.33], [1, 1, 1]),
            ([0.5, 0.5, 0.0], [2, 1, 0]),
            ([0.8, 0.1, 0.1], [3, 0, 0]),
            // Rounded one by one, these have a sum of 2 and of 4 thirds.
            ([0.48, 0.37, 0.15], [1, 1, 1]),
            ([0.52, 0.17, 0.31], [2, 0, 1]),
        ] {
            let found = in_parts(given);
            let thirds = found.map(|w| (PARTS * w).round() as i32);
            assert_eq!(thirds, expected, "{given:?}");
            assert!((found.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
    }
}
