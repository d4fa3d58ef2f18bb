//! Notes on settings that are known to make a press less accurate, and on the samples of a press.

use palpa_fem::Model;
use palpa_mesh::LayeredBody;
use palpa_scene::{CutFaces, Scene};

use super::{Record, Sample};
use crate::note::Note;
use crate::press::mesh::PressedBody;

/// A contact whose radius is fewer edges than this gets a note: on a layered block under a ball the
/// force is off by 3 to 8 % there, and by 1 % with a third of the radius.
const FEWEST_EDGES: f64 = 2.0;
/// If more than this share of the skin triangles has no partner, there is a note.
const FEW_SINGLES: f64 = 0.01;

/// Adds a note where the mesh is known to be too coarse.
pub(crate) fn note_mesh(model: &Model, mesh: &PressedBody, scene: &Scene, notes: &mut Vec<Note>) {
    let n_triangles = mesh.body.skin.triangles.len();
    let n_singles = model.n_single_triangles();
    if n_singles as f64 > FEW_SINGLES * n_triangles as f64 {
        notes.push(Note::SingleTriangles {
            n: n_singles,
            n_all: n_triangles,
        });
    }
    let radius = scene.tool.contact_radius();
    if radius > 0.0 && radius < FEWEST_EDGES * mesh.mesh_size {
        notes.push(Note::CoarseUnderTool {
            edge: mesh.mesh_size,
            radius,
        });
    }
    let edge = scene.tool.rounded_edge();
    if let Some(edge) = edge.filter(|&edge| edge < mesh.mesh_size) {
        notes.push(Note::CoarseAtEdge {
            edge: mesh.mesh_size,
            edge_radius: edge,
        });
    }
}

/// Adds a note where free cut faces release the tension of a layer.
pub(crate) fn note_tension(body: &LayeredBody, scene: &Scene, notes: &mut Vec<Note>) {
    let tense = scene.layers.iter().find(|layer| layer.prestress > 0.0);
    let is_free = scene.body.cut_faces == CutFaces::Free && !body.cut_faces.is_empty();
    if let Some(layer) = tense.filter(|_| is_free) {
        notes.push(Note::TensionLost {
            layer: layer.tissue.name.clone(),
        });
    }
}

impl Record<'_> {
    /// Notes on the samples. Those on the scene and its mesh are in [`Indentation::notes`].
    ///
    /// [`Indentation::notes`]: super::Indentation::notes
    pub fn notes(&self) -> Vec<Note> {
        let good = self.converged();
        let mut notes: Vec<Note> = (self.failures.iter())
            .map(|failure| Note::StepFailed {
                speed: failure.speed_mm_s * 1e-3,
                depth: failure.depth_mm * 1e-3,
                outcome: failure.outcome,
            })
            .collect();
        if let Some(turned) = &self.deepest.turned {
            notes.push(Note::TurnedPrisms {
                n: turned.n,
                depth: self.deepest.depth_mm * 1e-3,
                at: turned.at.into(),
            });
        }
        if !self.indentation.is_bonded() {
            notes.extend(note_touching(&good, self.indentation.mesh().mesh_size));
        }
        notes
    }
}

/// A note if the largest contact of these samples is small for the skin's edges, of length `edge`
/// (m).
fn note_touching(samples: &[&Sample], edge: f64) -> Option<Note> {
    let widest =
        (samples.iter()).max_by(|a, b| a.contact_area_mm2.total_cmp(&b.contact_area_mm2))?;
    let radius = (widest.contact_area_mm2 * 1e-6 / std::f64::consts::PI).sqrt();
    (radius < FEWEST_EDGES * edge).then_some(Note::FewTouching {
        n_vertices: widest.n_touching,
        radius,
        edge,
    })
}
