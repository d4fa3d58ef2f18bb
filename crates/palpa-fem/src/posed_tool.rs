//! A tool and its pose.

use crate::shape::{Pose, Tool};

/// A tool with a pose in the body's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PosedTool {
    /// Shape and friction.
    pub tool: Tool,
    /// Transformation from the tool's frame to the body's, m.
    pub pose: Pose,
}
