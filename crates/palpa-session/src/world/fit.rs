//! Adapts a scene for touch: a tool that presses by contact, and a mesh that is fine where the hand
//! goes.

use palpa::Note;
use palpa_scene::{ContactShape, ContactTool, ModelKind, Scene, Tool};

/// Least edge length under the tool if the scene gives none, as a share of the contact radius and in m.
/// With finer meshes, which tools of a few millimetres and rounded edges ask for, the engine would not keep
/// pace with a hand.
const EDGE_SHARE: f64 = 0.4;
const LEAST_EDGE: f64 = 3e-3;
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
    let least = (EDGE_SHARE * scene.tool.contact_radius()).max(LEAST_EDGE);
    let mesh = &mut scene.mesh;
    let usual = mesh.near_tool_at(&scene.tool, EDGE_SHARE);
    if mesh.refine && usual.is_some_and(|usual| usual < least) && mesh.near_tool.is_none() {
        mesh.near_tool = Some(least);
        notes.push(Note::CoarserForTouch { edge: least });
    }
    scene
}
