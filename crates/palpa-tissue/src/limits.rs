//! What each key of a scene may be at most and at least. The descriptions in `file.rs` repeat these in words.

use std::fmt;

use crate::units::{Density, Kind, Length, Pressure, Quantity, Stiffness, Time, Velocity};

/// Larger scene files are refused unread. bytes
pub(crate) const MAX_FILE: u64 = 1 << 20;
/// Most layers of a scene.
pub(crate) const MAX_LAYERS: usize = 32;
/// Most levels of a scene's layers together.
pub(crate) const MAX_LEVELS: usize = 256;
/// Most bones.
pub(crate) const MAX_BONES: usize = 64;
/// Most rows of a thickness table.
pub(crate) const MAX_ROWS: usize = 1000;
/// Most results of a press on the way down: `depth / step`.
pub(crate) const MAX_STEPS: f64 = 5000.0;
/// Most skin vertices that a generator is asked for.
pub(crate) const MAX_VERTICES: f64 = 500_000.0;

/// What a value may be, both ends included.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits<T> {
    pub(crate) min: T,
    pub(crate) max: T,
}

impl<T: PartialOrd> Limits<T> {
    pub(crate) fn contains(&self, value: &T) -> bool {
        self.min <= *value && *value <= self.max
    }
}

impl<T: fmt::Display> fmt::Display for Limits<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} to {}", self.min, self.max)
    }
}

const fn between<K: Kind>(min: f64, max: f64) -> Limits<Quantity<K>> {
    Limits {
        min: Quantity::from_si(min),
        max: Quantity::from_si(max),
    }
}

const fn numbers<T>(min: T, max: T) -> Limits<T> {
    Limits { min, max }
}

pub(crate) const COORDINATE: Limits<Length> = between(-10.0, 10.0);
pub(crate) const CUTOUT_RADIUS: Limits<Length> = between(5e-3, 1.0);
pub(crate) const SPACING: Limits<Length> = between(0.5e-3, 0.1);
pub(crate) const BLOCK_SIZE: Limits<Length> = between(1e-3, 2.0);
pub(crate) const CYLINDER_LENGTH: Limits<Length> = between(1e-3, 2.0);
pub(crate) const CYLINDER_RADIUS: Limits<Length> = between(1e-3, 1.0);
pub(crate) const BONE_RADIUS: Limits<Length> = between(0.5e-3, 1.0);
pub(crate) const SCALE: Limits<f64> = numbers(0.2, 3.0);
pub(crate) const THICKNESS: Limits<Length> = between(1e-5, 0.5);
pub(crate) const MIN_THICKNESS: Limits<Length> = between(1e-6, 0.1);
pub(crate) const LEVELS: Limits<u32> = numbers(1, 64);
/// Below the softest gel, above what is still not rigid beside tissue.
pub(crate) const YOUNG: Limits<Pressure> = between(10.0, 1e9);
/// At 0.5 the volume is constant and the stiffness infinite.
pub(crate) const POISSON: Limits<f64> = numbers(0.0, 0.4999);
pub(crate) const SPRING: Limits<Stiffness> = between(1e-6, 1e6);
pub(crate) const DENSITY: Limits<Density> = between(100.0, 20000.0);
pub(crate) const TOOL_RADIUS: Limits<Length> = between(0.1e-3, 0.2);
pub(crate) const DEPTH: Limits<Length> = between(1e-6, 0.5);
pub(crate) const SPEED: Limits<Velocity> = between(1e-5, 1.0);
pub(crate) const HOLD: Limits<Time> = between(0.0, 600.0);
pub(crate) const SUBSTEPS: Limits<u32> = numbers(1, 1024);
pub(crate) const GAIN: Limits<f64> = numbers(0.0, 1.0);

#[cfg(test)]
mod tests {
    use super::*;

    /// What the schema says of a key must be what is checked.
    #[test]
    fn the_schema_names_every_range() {
        let schema = crate::scene_schema();
        let says = |table: &str, key: &str, limits: &dyn fmt::Display| {
            let description = &schema["$defs"][table]["properties"][key]["description"];
            let description = description
                .as_str()
                .unwrap_or_else(|| panic!("{table}.{key} is not described"));
            let description = description.replace('\n', " ");
            assert!(
                description.contains(&limits.to_string()),
                "{table}.{key} is limited to {limits}, and described as: {description}"
            );
        };
        says("BodyTable", "cutout_radius", &CUTOUT_RADIUS);
        says(
            "BodyTable",
            "cutout_at",
            &format!("within {}", COORDINATE.max),
        );
        says("BodyTable", "bones", &format!("{MAX_BONES} at most"));
        says("GeneratorTable", "spacing", &SPACING);
        says("GeneratorTable", "size", &BLOCK_SIZE);
        says("GeneratorTable", "length", &CYLINDER_LENGTH);
        says("GeneratorTable", "radius", &CYLINDER_RADIUS);
        says("GeneratorTable", "bone_radius", &BONE_RADIUS);
        says("GeneratorTable", "scale", &SCALE);
        says("LayerTable", "thickness", &THICKNESS);
        says("LayerTable", "levels", &LEVELS);
        says("LayerTable", "min_thickness", &MIN_THICKNESS);
        says("TissueTable", "young", &YOUNG);
        says("TissueTable", "poisson", &POISSON);
        says("TissueTable", "spring", &SPRING);
        says("TissueTable", "density", &DENSITY);
        says("ThicknessTable", "table", &THICKNESS);
        says(
            "ThicknessTable",
            "table",
            &format!("within {}", COORDINATE.max),
        );
        says(
            "ThicknessTable",
            "table",
            &format!("{MAX_ROWS} pairs at most"),
        );
        says("ToolTable", "radius", &TOOL_RADIUS);
        says("PressTable", "at", &format!("within {}", COORDINATE.max));
        says("PressTable", "depth", &DEPTH);
        says("PressTable", "speed", &SPEED);
        says("PressTable", "hold", &HOLD);
        says("PressTable", "step", &format!("a {MAX_STEPS}th of it"));
        says("ReferenceTable", "substeps", &SUBSTEPS);
        says("ReferenceTable", "spring_gain", &GAIN);
        says("ReferenceTable", "shape_gain", &GAIN);
        let layers = schema["properties"]["layer"]["description"]
            .as_str()
            .unwrap_or_default();
        assert!(layers.contains(&format!("1 to {MAX_LAYERS}")), "{layers}");
        assert!(
            layers.contains(&format!("{MAX_LEVELS} levels at most")),
            "{layers}"
        );
    }
}
