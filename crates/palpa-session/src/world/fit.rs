//! Adapts a scene for touch: a tool that presses by contact, and a mesh that is fine where the hand
//! goes.

use palpa::Note;
use palpa::live::EDGE_SHARE;
use palpa_scene::{ContactShape, ContactTool, ModelKind, Scene, Tool};

/// Least edge length under the tool if the scene gives none, m. With finer meshes the engine would
/// not keep pace with a hand.
const LEAST_EDGE: f64 = 3e-3;
/// Edge length in lumps if the scene gives none, m.
const NEAR_LUMPS: f64 = 6e-3;
/// Radius of the sphere that replaces a single held node, m.
const LEAST_TOOL: f64 = 5e-3;

/// The scene adapted for touch. `notes` receives each change that a user should know of.
pub(super) fn fit_for_touch(scene: &Scene, notes: &mut Vec<Note>) -> Scene {
    let mut scene = scene.clone();
    if scene.model.kind == ModelKind::Reference {
        return scene;
    }
    let shape = match scene.tool {
        Tool::Contact(_) => None,
        Tool::Disc { radius } => Some(ContactShape::FlatPunch {
            radius,
            edge_radius: 0.3 * radius,
        }),
        Tool::Node => Some(ContactShape::Sphere { radius: LEAST_TOOL }),
    };
    if let Some(shape) = shape {
        let tool = Tool::Contact(ContactTool {
            shape,
            friction: 0.0,
            axis: None,
        });
        notes.push(Note::ToolReplaced {
            tool: scene.tool,
            by: tool,
        });
        scene.tool = tool;
    }
    scene.mesh.moves |= scene.mesh.refine;
    let usual = scene.mesh.near_tool_of(&scene.tool);
    if scene.mesh.refine && scene.mesh.near_tool.is_none() {
        let fine = (EDGE_SHARE * scene.tool.contact_radius()).max(LEAST_EDGE);
        scene.mesh.near_tool = Some(fine);
        if usual.is_some_and(|usual| 1.5 * usual < fine) {
            notes.push(Note::CoarserForTouch { edge: fine });
        }
    }
    if scene.mesh.near_lumps.is_none() {
        scene.mesh.near_lumps = Some(NEAR_LUMPS);
    }
    scene
}
