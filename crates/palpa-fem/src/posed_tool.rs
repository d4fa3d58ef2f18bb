//! A tool and its place.

use crate::shape::{Pose, Tool};

/// A tool at a place in the body's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PosedTool {
    /// Shape and friction.
    pub tool: Tool,
    /// From the tool's frame to the body's, m.
    pub pose: Pose,
}
