//! The tool.

use super::{Reader, direction, each};
use crate::SceneError;
use crate::error::Site;
use crate::file::{ToolShape, ToolTable};
use crate::limits::{self, Limits};
use crate::tool::{ContactShape, ContactTool, Tool};
use crate::units::Length;

/// Radius of a tool of which none is given. m
const RADIUS: f64 = 8e-3;
/// Length of a capsule's straight part. m
const LENGTH: f64 = 20e-3;
/// Size of a box. m
const SIZE: [f64; 3] = [16e-3; 3];
/// Radii of a finger's pad: they curve by 9.1 mm along and 7 mm across, within the 7–10 mm and 6–8 mm of index fingers
/// (from memory, after Serina et al. 1998). m
const FINGERTIP: [f64; 3] = [8e-3, 7e-3, 7e-3];
/// Share of a punch's radius, or of half a box's smallest size, by which its edges are rounded.
const EDGE: f64 = 0.3;

impl ToolShape {
    /// Its name in a sentence, and the keys it takes.
    fn takes(self) -> (&'static str, &'static [&'static str]) {
        match self {
            Self::Disc => ("a disc", &["radius"]),
            Self::Node => ("a node", &[]),
            Self::Sphere => ("a sphere", &["radius", "friction"]),
            Self::FlatPunch => ("a flat punch", &["radius", "edge_radius", "friction"]),
            Self::Capsule => ("a capsule", &["radius", "length", "axis", "friction"]),
            Self::Box => ("a box", &["size", "edge_radius", "axis", "friction"]),
            Self::Fingertip => ("a fingertip", &["radii", "axis", "friction"]),
        }
    }
}

impl Reader<'_> {
    pub(super) fn tool(&self, tool: &ToolTable) -> Result<Tool, SceneError> {
        let at = self.site("tool");
        check_keys(&at, tool)?;
        let length = |key, given: Option<Length>, default, limits: &Limits<Length>| {
            let length = given.unwrap_or(Length::from_si(default));
            Ok::<f64, SceneError>(at.key(key).within(length, limits)?.si())
        };
        let radius = || length("radius", tool.radius, RADIUS, &limits::TOOL_RADIUS);
        let edge_radius = |most: f64| {
            let edge = length(
                "edge_radius",
                tool.edge_radius,
                EDGE * most,
                &limits::EDGE_RADIUS,
            )?;
            if edge > most {
                return Err(at.key("edge_radius").invalid(format!(
                    "edges rounded by {} are rounder than the tool, which has room for {}; make `edge_radius` smaller",
                    Length::from_si(edge),
                    Length::from_si(most)
                )));
            }
            Ok(edge)
        };
        let shape = match tool.shape {
            ToolShape::Disc => return Ok(Tool::Disc { radius: radius()? }),
            ToolShape::Node => return Ok(Tool::Node),
            ToolShape::Sphere => ContactShape::Sphere { radius: radius()? },
            ToolShape::FlatPunch => {
                let radius = radius()?;
                ContactShape::FlatPunch {
                    radius,
                    edge_radius: edge_radius(radius)?,
                }
            }
            ToolShape::Capsule => ContactShape::Capsule {
                radius: radius()?,
                length: length("length", tool.length, LENGTH, &limits::TOOL_LENGTH)?,
            },
            ToolShape::Box => {
                let size = tool.size.unwrap_or(SIZE.map(Length::from_si));
                let size = each(&at.key("size"), size, &limits::TOOL_SIZE)?;
                let smallest = size.iter().copied().fold(f64::INFINITY, f64::min);
                ContactShape::Box {
                    size,
                    edge_radius: edge_radius(smallest / 2.0)?,
                }
            }
            ToolShape::Fingertip => {
                let radii = tool.radii.unwrap_or(FINGERTIP.map(Length::from_si));
                ContactShape::Fingertip {
                    radii: each(&at.key("radii"), radii, &limits::TOOL_RADIUS)?,
                }
            }
        };
        let friction = tool.friction.unwrap_or(0.0);
        Ok(Tool::Contact(ContactTool {
            shape,
            friction: at.key("friction").within(friction, &limits::FRICTION)?,
            axis: match tool.axis {
                Some(axis) => Some(direction(&at.key("axis"), axis)?),
                None => None,
            },
        }))
    }
}

fn check_keys(at: &Site<'_>, tool: &ToolTable) -> Result<(), SceneError> {
    let given = [
        ("radius", tool.radius.is_some()),
        ("radii", tool.radii.is_some()),
        ("length", tool.length.is_some()),
        ("size", tool.size.is_some()),
        ("edge_radius", tool.edge_radius.is_some()),
        ("axis", tool.axis.is_some()),
        ("friction", tool.friction.is_some()),
    ];
    let (name, keys) = tool.shape.takes();
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
