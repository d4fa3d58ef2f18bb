//! The state of a vertex of the skin: what it keeps from one step to the next.

use palpa_mesh::Vec3;

use crate::posed_tool::PosedTool;

/// How a skin vertex touches a tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// Which tool; meaningless without pressure.
    pub tool: u32,
    /// Pressure, Pa; 0 without contact.
    pub pressure: f64,
    /// Force of friction on the vertex, N.
    pub friction: Vec3,
    /// The point of the tool that holds it, in the tool's frame, m.
    pub anchor: Vec3,
    /// Whether it slid at the end of the last step, so that kinetic friction acts.
    pub is_sliding: bool,
}

impl Touch {
    /// No contact.
    pub const OPEN: Self = Self {
        tool: 0,
        pressure: 0.0,
        friction: Vec3::new(0.0, 0.0, 0.0),
        anchor: Vec3::new(0.0, 0.0, 0.0),
        is_sliding: false,
    };

    /// Index of the touched tool, if any.
    pub fn tool(&self) -> Option<usize> {
        (self.pressure > 0.0).then_some(self.tool as usize)
    }
}

/// The point of a tool's surface nearest to `x`, in the tool's frame, m.
pub(crate) fn anchor_at(tool: &PosedTool, x: &Vec3) -> Vec3 {
    let distance = tool.tool.distance_at(&tool.pose, x);
    let surface = x - distance.normal * distance.distance;
    tool.pose.inverse_transform_point(&surface.into()).coords
}

/// Where a vertex that goes from `from` to `to` first touches a tool on its way from `before` to
/// `after`: the point in the tool's frame, m, and the share of the way that was left. A vertex that
/// is outside at the end is anchored there.
pub(crate) fn first_touch(
    before: &PosedTool,
    after: &PosedTool,
    from: &Vec3,
    to: &Vec3,
) -> (Vec3, f64) {
    let gap = |at: &PosedTool, x: &Vec3| at.tool.distance_at(&at.pose, x).distance;
    let (start, end) = (gap(before, from), gap(after, to));
    if end >= 0.0 {
        return (anchor_at(after, to), 0.0);
    }
    let share = if start > 0.0 {
        start / (start - end)
    } else {
        0.0
    };
    let (a, b) = (&before.pose, &after.pose);
    let at = PosedTool {
        tool: after.tool,
        pose: crate::shape::Pose::from_parts(
            a.translation
                .vector
                .lerp(&b.translation.vector, share)
                .into(),
            a.rotation.slerp(&b.rotation, share),
        ),
    };
    (anchor_at(&at, &from.lerp(to, share)), 1.0 - share)
}
