//! The allowed range of each key of a scene. The descriptions in `file.rs` repeat these in words.

use std::fmt;

use crate::units::{
    Angle, Density, Kind, Length, Pressure, Quantity, Rate, Share, SpringConstant, Time, Velocity,
};

/// Largest size of a scene file, bytes.
pub(crate) const MAX_FILE: u64 = 1 << 20;
/// Most layers of a scene.
pub(crate) const MAX_LAYERS: usize = 32;
/// Most levels of a scene's layers together.
pub(crate) const MAX_LEVELS: usize = 256;
/// Most bones.
pub(crate) const MAX_BONES: usize = 64;
/// Most lumps.
pub(crate) const MAX_LUMPS: usize = 64;
/// Most terms of Ogden's energy.
pub(crate) const MAX_OGDEN_TERMS: usize = 6;
/// Most terms of a Prony series.
pub(crate) const MAX_PRONY_TERMS: usize = 12;
/// Most speeds of a sweep.
pub(crate) const MAX_SPEEDS: usize = 16;
/// Most rows of a thickness table.
pub(crate) const MAX_ROWS: usize = 1000;
/// Most results of a press on the way down: `depth / step`.
pub(crate) const MAX_STEPS: f64 = 5000.0;
/// Largest number of skin vertices of a generated body.
pub(crate) const MAX_VERTICES: f64 = 500_000.0;

/// An allowed range, both ends included.
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
/// From below the softest gel to nearly rigid compared with tissue.
pub(crate) const YOUNG: Limits<Pressure> = between(10.0, 1e9);
/// At 0.5 the bulk modulus would be infinite.
pub(crate) const POISSON: Limits<f64> = numbers(0.0, 0.4999);
/// Shear moduli, and the constants that determine them.
pub(crate) const SHEAR: Limits<Pressure> = between(1.0, 1e9);
/// At least a hundredth of the stiffness must remain in the end, as in `PRONY_SUM`.
pub(crate) const PRONY_G: Limits<f64> = numbers(0.001, 0.99);
pub(crate) const PRONY_SUM: f64 = 0.99;
pub(crate) const PRONY_TAU: Limits<Time> = between(1e-4, 1e5);
pub(crate) const PRESTRESS: Limits<Pressure> = between(0.0, 1e6);
pub(crate) const SPRING: Limits<SpringConstant> = between(1e-6, 1e6);
pub(crate) const DENSITY: Limits<Density> = between(100.0, 20000.0);
pub(crate) const TOOL_RADIUS: Limits<Length> = between(0.1e-3, 0.2);
pub(crate) const TOOL_SIZE: Limits<Length> = between(0.2e-3, 0.4);
pub(crate) const TOOL_LENGTH: Limits<Length> = between(0.1e-3, 0.4);
pub(crate) const EDGE_RADIUS: Limits<Length> = between(1e-6, 0.2);
/// 20° and 160°, as the reader converts them from degrees.
pub(crate) const OPENING_ANGLE: Limits<Angle> = between(0.349065850398866, 2.792526803190927);
pub(crate) const FRICTION: Limits<f64> = numbers(0.0, 5.0);
pub(crate) const LUMP_RADIUS: Limits<Length> = between(0.1e-3, 0.2);
pub(crate) const LUMP_LENGTH: Limits<Length> = between(0.1e-3, 0.4);
pub(crate) const LUMP_DEPTH: Limits<Length> = between(0.1e-3, 0.5);
pub(crate) const TRANSITION: Limits<Length> = between(0.0, 0.05);
/// At 1 the element would have modes without energy.
pub(crate) const ALPHA: Limits<f64> = numbers(0.0, 0.95);
pub(crate) const TOLERANCE: Limits<f64> = numbers(1e-12, 1e-3);
pub(crate) const DAMPING_MASS: Limits<Rate> = between(0.0, 1e5);
pub(crate) const DAMPING_STIFFNESS: Limits<Time> = between(0.0, 10.0);
pub(crate) const EDGE_LENGTH: Limits<Length> = between(0.1e-3, 0.1);
pub(crate) const GROWTH: Limits<f64> = numbers(0.02, 5.0);
pub(crate) const MESH_VERTICES: Limits<u32> = numbers(100, 500_000);
pub(crate) const ACCURACY: Limits<Share> = between(0.002, 0.5);
pub(crate) const SEARCH_TIME: Limits<Time> = between(1.0, 86_400.0);
pub(crate) const CYCLES: Limits<u32> = numbers(1, 100);
pub(crate) const DEPTH: Limits<Length> = between(1e-6, 0.5);
pub(crate) const SPEED: Limits<Velocity> = between(1e-5, 1.0);
pub(crate) const HOLD: Limits<Time> = between(0.0, 600.0);
pub(crate) const ACROSS: Limits<Length> = between(0.1e-3, 0.5);
/// A larger amplitude than a pathological tremor is a motion.
pub(crate) const TREMOR: Limits<Length> = between(0.0, 5e-3);
pub(crate) const ABOVE: Limits<Length> = between(0.1e-3, 0.1);
pub(crate) const SUBSTEPS: Limits<u32> = numbers(1, 1024);
pub(crate) const GAIN: Limits<f64> = numbers(0.0, 1.0);

#[cfg(test)]
mod tests {
    use std::sync::LazyLock;

    use super::*;

    /// Checks that the range in the schema's description is the one that is enforced.
    fn says(table: &str, key: &str, limits: &dyn fmt::Display) {
        static SCHEMA: LazyLock<serde_json::Value> = LazyLock::new(crate::scene_schema);
        let keys = match table {
            "" => &SCHEMA["properties"],
            table => &SCHEMA["$defs"][table]["properties"],
        };
        let description = keys[key]["description"]
            .as_str()
            .unwrap_or_else(|| panic!("{table}.{key} is not described"));
        assert!(
            description.contains(&limits.to_string()),
            "{table}.{key} is limited to {limits}, and described as: {description}"
        );
    }

    #[test]
    fn the_schema_names_every_range_of_the_body() {
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
        says("LayerTable", "prestress", &PRESTRESS);
        says("", "layer", &format!("1 to {MAX_LAYERS}"));
        says("", "layer", &format!("{MAX_LEVELS} levels at most"));
    }

    #[test]
    fn the_schema_names_every_range_of_a_tissue() {
        says("TissueTable", "young", &YOUNG);
        says("TissueTable", "shear", &SHEAR);
        says("TissueTable", "c10", &SHEAR);
        says("TissueTable", "terms", &format!("1 to {MAX_OGDEN_TERMS}"));
        says("TissueTable", "bulk", &POISSON);
        says("OgdenTable", "mu", &SHEAR);
        says("OgdenTable", "alpha", &numbers(0.001, 100.0));
        says("PronyTable", "terms", &format!("1 to {MAX_PRONY_TERMS}"));
        says("PronyTable", "terms", &format!("{PRONY_SUM} at most"));
        says("PronyTermTable", "g", &PRONY_G);
        says("PronyTermTable", "tau", &PRONY_TAU);
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
    }

    #[test]
    fn the_schema_names_every_range_of_tools_and_lumps() {
        says("ToolTable", "radius", &TOOL_RADIUS);
        says("ToolTable", "radii", &TOOL_RADIUS);
        says("ToolTable", "length", &TOOL_LENGTH);
        says("ToolTable", "size", &TOOL_SIZE);
        says("ToolTable", "edge_radius", &EDGE_RADIUS);
        says("ToolTable", "opening_angle", &OPENING_ANGLE);
        says("ToolTable", "tip_radius", &EDGE_RADIUS);
        says("ToolTable", "friction", &FRICTION);
        says("LumpTable", "radius", &LUMP_RADIUS);
        says("LumpTable", "radii", &LUMP_RADIUS);
        says("LumpTable", "length", &LUMP_LENGTH);
        says("LumpTable", "depth", &LUMP_DEPTH);
        says("LumpTable", "at", &format!("within {}", COORDINATE.max));
        says("LumpTable", "below", &format!("within {}", COORDINATE.max));
        says("LumpTable", "transition", &TRANSITION);
        says("", "lump", &format!("{MAX_LUMPS} at most"));
    }

    #[test]
    fn the_schema_names_every_range_of_press_and_models() {
        says("ModelTable", "alpha", &ALPHA);
        says("ModelTable", "tolerance", &TOLERANCE);
        says("DampingTable", "mass", &DAMPING_MASS);
        says("DampingTable", "stiffness", &DAMPING_STIFFNESS);
        says("MeshTable", "near_tool", &EDGE_LENGTH);
        says("MeshTable", "near_lumps", &EDGE_LENGTH);
        says("MeshTable", "growth", &GROWTH);
        says("MeshTable", "level_growth", &GROWTH);
        says("MeshTable", "max_vertices", &MESH_VERTICES);
        says("MeshTable", "accuracy", &ACCURACY);
        says("MeshTable", "max_time", &SEARCH_TIME);
        says("PressTable", "at", &format!("within {}", COORDINATE.max));
        says("PressTable", "depth", &DEPTH);
        says("PressTable", "speed", &SPEED);
        says("PressTable", "speeds", &SPEED);
        says("PressTable", "speeds", &format!("{MAX_SPEEDS} at most"));
        says("PressTable", "cycles", &CYCLES);
        says("PressTable", "hold", &HOLD);
        says("PressTable", "step", &format!("a {MAX_STEPS}th of it"));
        says("MotionTable", "depth", &DEPTH);
        says("MotionTable", "speed", &SPEED);
        says("MotionTable", "hold", &HOLD);
        says("MotionTable", "length", &ACROSS);
        says("MotionTable", "times", &CYCLES);
        says("MotionTable", "tremor", &TREMOR);
        says("MotionTable", "above", &ABOVE);
        says("ReferenceTable", "substeps", &SUBSTEPS);
        says("ReferenceTable", "spring_gain", &GAIN);
        says("ReferenceTable", "shape_gain", &GAIN);
    }
}
