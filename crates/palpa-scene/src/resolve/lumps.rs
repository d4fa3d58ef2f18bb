//! The lumps: their shapes, places and tissues.

use super::tissues::tissue;
use super::{Reader, coordinates, direction, each};
use crate::error::Site;
use crate::file::{LumpShapeName, LumpTable};
use crate::limits::{self, Limits};
use crate::lump::{Lump, LumpPlace, LumpShape};
use crate::scene::Target;
use crate::units::Length;
use crate::{Law, SceneError};

impl LumpShapeName {
    /// Name of the shape in a sentence, and the keys of its sizes.
    fn takes(self) -> (&'static str, &'static [&'static str]) {
        match self {
            Self::Sphere => ("a sphere", &["radius"]),
            Self::Ellipsoid => ("an ellipsoid", &["radii", "axis"]),
            Self::Capsule => ("a capsule", &["radius", "length", "axis"]),
            Self::Mesh => ("a mesh", &["file"]),
        }
    }
}

impl Reader<'_> {
    pub(super) fn lumps(
        &self,
        tables: Vec<LumpTable>,
        pressed: Target,
    ) -> Result<Vec<Lump>, SceneError> {
        let at = self.site("lump");
        let (n, most) = (tables.len(), limits::MAX_LUMPS);
        if n > most {
            let message =
                format!("{n} lumps are more than the {most} allowed; join some in a mesh");
            return Err(at.index(most).invalid(message));
        }
        let tables = tables.into_iter().enumerate();
        tables
            .map(|(i, table)| self.lump(&at.index(i), table, pressed))
            .collect()
    }

    fn lump(&self, at: &Site<'_>, table: LumpTable, pressed: Target) -> Result<Lump, SceneError> {
        check_keys(at, &table)?;
        let place = place(at, &table, pressed)?;
        let shape = self.lump_shape(at, &table)?;
        let transition_at = at.key("transition");
        let transition = transition_at.within(table.transition, &limits::TRANSITION)?;
        if let Some(radius) = shape
            .smallest_radius()
            .filter(|r| transition.si() > 2.0 * r)
        {
            return Err(transition_at.invalid(format!(
                "a transition of {transition} is too wide for a lump of radius {}; take {} at most",
                Length::from_si(radius),
                Length::from_si(2.0 * radius)
            )));
        }
        let tissue_at = at.key("tissue");
        let tissue = tissue(&tissue_at, table.tissue)?;
        if matches!(tissue.law, Law::Spring { .. }) {
            return Err(tissue_at.invalid(
                "a lump cannot be a network of bars; give it `young = \"80 kPa\"` instead of `spring`",
            ));
        }
        Ok(Lump {
            name: table.name,
            shape,
            place,
            axis: match table.axis {
                Some(axis) => Some(direction(&at.key("axis"), axis)?),
                None => None,
            },
            tissue,
            transition: transition.si(),
        })
    }

    fn lump_shape(&self, at: &Site<'_>, table: &LumpTable) -> Result<LumpShape, SceneError> {
        let length = |key: &'static str, given: Option<Length>, limits: &Limits<Length>| {
            let given = given.ok_or_else(|| missing(at, table.shape, key))?;
            Ok(at.key(key).within(given, limits)?.si())
        };
        let radius = || length("radius", table.radius, &limits::LUMP_RADIUS);
        Ok(match table.shape {
            LumpShapeName::Sphere => LumpShape::Sphere { radius: radius()? },
            LumpShapeName::Capsule => LumpShape::Capsule {
                radius: radius()?,
                length: length("length", table.length, &limits::LUMP_LENGTH)?,
            },
            LumpShapeName::Ellipsoid => {
                let radii = table
                    .radii
                    .ok_or_else(|| missing(at, table.shape, "radii"))?;
                LumpShape::Ellipsoid {
                    radii: each(&at.key("radii"), radii, &limits::LUMP_RADIUS)?,
                }
            }
            LumpShapeName::Mesh => {
                let file = table.file.as_ref();
                let file = file.ok_or_else(|| missing(at, table.shape, "file"))?;
                LumpShape::Mesh(self.path(&at.key("file"), file)?)
            }
        })
    }
}

fn missing(at: &Site<'_>, shape: LumpShapeName, key: &'static str) -> SceneError {
    let example = match key {
        "radii" => "[\"6 mm\", \"6 mm\", \"4 mm\"]",
        "length" => "\"10 mm\"",
        "file" => "\"lump.ply\"",
        _ => "\"6 mm\"",
    };
    at.invalid(format!(
        "{} needs its {key}; give `{key} = {example}`",
        shape.takes().0
    ))
}

fn check_keys(at: &Site<'_>, lump: &LumpTable) -> Result<(), SceneError> {
    let given = [
        ("radius", lump.radius.is_some()),
        ("radii", lump.radii.is_some()),
        ("length", lump.length.is_some()),
        ("file", lump.file.is_some()),
        ("axis", lump.axis.is_some()),
    ];
    let (name, keys) = lump.shape.takes();
    match given
        .iter()
        .find(|(key, given)| *given && !keys.contains(key))
    {
        None => Ok(()),
        Some((key, _)) => Err(at.key(key).invalid(format!(
            "{name} does not take `{key}`; it takes `{}`",
            keys.join("`, `")
        ))),
    }
}

fn place(at: &Site<'_>, lump: &LumpTable, pressed: Target) -> Result<LumpPlace, SceneError> {
    let target = match (lump.below, lump.below_vertex) {
        (None, None) => None,
        (Some(point), None) => Some(Target::Point(coordinates(&at.key("below"), point)?)),
        (None, Some(vertex)) => Some(Target::Vertex(vertex)),
        (Some(_), Some(_)) => {
            return Err(at
                .key("below_vertex")
                .invalid("the place is given twice; remove `below` or `below_vertex`"));
        }
    };
    match (lump.at, lump.depth, target) {
        (None, Some(depth), target) => Ok(LumpPlace::Below {
            target: target.unwrap_or(pressed),
            depth: at.key("depth").within(depth, &limits::LUMP_DEPTH)?.si(),
        }),
        (Some(point), None, None) => Ok(LumpPlace::At(coordinates(&at.key("at"), point)?)),
        (Some(_), ..) => Err(at.key("at").invalid(
            "the place is given twice; remove `at`, or else `depth`, `below` and `below_vertex`",
        )),
        (None, None, None) if lump.shape == LumpShapeName::Mesh => Ok(LumpPlace::AsRead),
        (None, None, _) => Err(at.invalid(
            "the lump has no place; give `depth = \"8 mm\"` below the skin, or `at` for its centre",
        )),
    }
}
