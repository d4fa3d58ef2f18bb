//! The tool.

use super::{Reader, direction};
use crate::error::Site;
use crate::file::ToolTable;
use crate::shape::ToolShape;
use crate::tool::{ContactTool, Tool};
use crate::{ContactShape, SceneError, limits};

impl Reader<'_> {
    pub(super) fn tool(&self, table: &ToolTable) -> Result<Tool, SceneError> {
        let at = self.site("tool");
        check_keys(&at, table)?;
        let Some(shape) = ContactShape::read(&at, table)? else {
            return Ok(match table.shape {
                ToolShape::Node => Tool::Node,
                _ => Tool::Disc {
                    radius: crate::shape::disc_radius(&at, table)?,
                },
            });
        };
        let friction = table.friction.unwrap_or(0.0);
        Ok(Tool::Contact(ContactTool {
            shape,
            friction: at.key("friction").within(friction, &limits::FRICTION)?,
            axis: match table.axis {
                Some(axis) => Some(direction(&at.key("axis"), axis)?),
                None => None,
            },
        }))
    }
}

fn check_keys(at: &Site<'_>, tool: &ToolTable) -> Result<(), SceneError> {
    // Every key is named, so that the compiler asks for a new one.
    let ToolTable {
        shape,
        radius,
        radii,
        length,
        size,
        opening_angle,
        tip_radius,
        edge_radius,
        axis,
        friction,
    } = tool;
    let given = [
        ("radius", radius.is_some()),
        ("radii", radii.is_some()),
        ("length", length.is_some()),
        ("size", size.is_some()),
        ("opening_angle", opening_angle.is_some()),
        ("tip_radius", tip_radius.is_some()),
        ("edge_radius", edge_radius.is_some()),
        ("axis", axis.is_some()),
        ("friction", friction.is_some()),
    ];
    let (name, keys) = shape.takes();
    let Some((key, _)) = given
        .iter()
        .find(|(key, given)| *given && !keys.contains(key))
    else {
        return Ok(());
    };
    let advice = match keys {
        [] => "it takes nothing but `shape`".to_owned(),
        keys => format!("it takes `{}`", keys.join("`, `")),
    };
    Err(at
        .key(key)
        .invalid(format!("{name} does not take `{key}`; {advice}")))
}
