//! The place that a scene presses, and the direction.

use anyhow::bail;
use nalgebra::Unit;
use palpa_mesh::{LayeredBody, Vec3};
use palpa_scene::Scene;

use crate::build::in_mm;
use crate::note::Note;

/// The mesh size near the tool is the mean of the edges within this many tool radii of the press
/// point.
const NEAR_TOOL: f64 = 2.0;
/// A press direction further than this angle from the inward normal (60°) gives a note.
const OBLIQUE_COS: f64 = 0.5;

/// The place that is pressed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// The skin vertex that is pressed.
    pub vertex: usize,
    /// Its position at rest, m.
    pub at: Vec3,
    /// Unit vector along which the tool moves.
    pub direction: Unit<Vec3>,
    /// Depth of the tissue below the vertex, m.
    pub tissue_depth: f64,
}

impl Place {
    /// The place of `scene`'s press at a skin vertex of the body.
    ///
    /// # Errors
    /// When the direction leads out of the body, or the depth leads through it.
    pub fn find(
        scene: &Scene,
        body: &LayeredBody,
        vertex: usize,
        notes: &mut Vec<Note>,
    ) -> anyhow::Result<Self> {
        let at = body.skin.points[vertex];
        let inward = -body.skin.vertex_normals()[vertex];
        let direction = scene.press.direction.map_or(inward, Vec3::from);
        let Some(direction) = Unit::try_new(direction, f64::MIN_POSITIVE) else {
            bail!(
                "the skin has no normal at vertex {vertex} ({}) mm; give a press direction",
                in_mm(at)
            );
        };
        let slant = direction.dot(&inward);
        if slant <= 0.0 {
            bail!(
                "the press direction ({:.2}, {:.2}, {:.2}) points out of the skin at ({}) mm; turn it, or leave it out to \
                 press along the inward normal",
                direction.x,
                direction.y,
                direction.z,
                in_mm(at)
            );
        }
        if slant < OBLIQUE_COS {
            notes.push(Note::ObliquePress {
                angle: slant.acos(),
            });
        }
        let tissue_depth = column_length(body, vertex);
        if scene.press.depth >= tissue_depth {
            bail!(
                "press depth {:.2} mm reaches beyond the body: at ({}) mm the tissue is {:.2} mm deep; press less deep, \
                 or at another place",
                scene.press.depth * 1e3,
                in_mm(at),
                tissue_depth * 1e3,
            );
        }
        let mut on_rim = body.cut_faces.iter().flat_map(|face| &face.vertices);
        if on_rim.any(|&v| v as usize == vertex) {
            notes.push(Note::PressOnCutFace);
        }
        Ok(Self {
            vertex,
            at,
            direction,
            tissue_depth,
        })
    }
}

/// Length of the column under a skin vertex, m.
pub fn column_length(body: &LayeredBody, v: usize) -> f64 {
    let p = |l: usize| body.positions[body.node(v, l)];
    (1..body.n_levels).map(|l| (p(l) - p(l - 1)).norm()).sum()
}

/// Mean length of the skin's edges near a place, m; if the tool is smaller than the mesh, of the
/// edges at the nearest vertex.
pub(super) fn mesh_size_near(body: &LayeredBody, at: Vec3, radius: f64) -> f64 {
    let skin = &body.skin;
    let edges: Vec<(f64, f64)> = skin
        .edges()
        .iter()
        .map(|&[a, b]| {
            let (a, b) = (skin.points[a as usize], skin.points[b as usize]);
            ((a - at).norm().min((b - at).norm()), (a - b).norm())
        })
        .collect();
    let nearest = edges.iter().map(|e| e.0).fold(f64::INFINITY, f64::min);
    let reach = (NEAR_TOOL * radius).max(nearest);
    let near: Vec<f64> = edges.iter().filter(|e| e.0 <= reach).map(|e| e.1).collect();
    near.iter().sum::<f64>() / near.len().max(1) as f64
}
