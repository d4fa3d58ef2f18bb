//! From tools and lumps back to their tables.

use super::{Names, direction, point, relative, tissue, vertex};
use crate::file::{LumpShapeName, LumpTable, ToolTable};
use crate::lump::{Lump, LumpPlace, LumpShape};
use crate::scene::Scene;
use crate::shape::ToolShape;
use crate::tool::Tool;
use crate::units::Length;

pub(super) fn tool(tool: &Tool) -> ToolTable {
    let mut table = ToolTable::default();
    let tool = match tool {
        Tool::Disc { radius } => {
            table.radius = Some(Length::from_si(*radius));
            return table;
        }
        Tool::Node => {
            table.shape = ToolShape::Node;
            return table;
        }
        Tool::Contact(tool) => tool,
    };
    table.friction = Some(tool.friction);
    table.axis = tool.axis.map(direction);
    tool.shape.write(&mut table);
    table
}

pub(super) fn lump(scene: &Scene, lump: &Lump, names: Names) -> LumpTable {
    let mut table = LumpTable {
        name: lump.name.clone(),
        shape: LumpShapeName::Sphere,
        radius: None,
        radii: None,
        length: None,
        file: None,
        depth: None,
        below: None,
        below_vertex: None,
        at: None,
        axis: lump.axis.map(direction),
        tissue: tissue(&lump.tissue, names),
        transition: Length::from_si(lump.transition),
    };
    match lump.place {
        LumpPlace::Below { target, depth } => {
            table.depth = Some(Length::from_si(depth));
            table.below = point(target);
            table.below_vertex = vertex(target);
        }
        LumpPlace::At(centre) => table.at = Some(centre.map(Length::from_si)),
        LumpPlace::AsRead => {}
    }
    match &lump.shape {
        LumpShape::Sphere { radius } => table.radius = Some(Length::from_si(*radius)),
        LumpShape::Ellipsoid { radii } => {
            table.shape = LumpShapeName::Ellipsoid;
            table.radii = Some(radii.map(Length::from_si));
        }
        LumpShape::Capsule { radius, length } => {
            table.shape = LumpShapeName::Capsule;
            table.radius = Some(Length::from_si(*radius));
            table.length = Some(Length::from_si(*length));
        }
        LumpShape::Mesh(file) => {
            table.shape = LumpShapeName::Mesh;
            table.file = Some(relative(scene, file));
        }
    }
    table
}
