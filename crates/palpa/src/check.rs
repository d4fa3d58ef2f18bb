//! What is wrong with a surface, or with the surfaces that a scene names: the checks behind
//! `palpa check` and behind the viewer's page.

use std::path::{Path, PathBuf};

use palpa_mesh::check::{Examination, Severity};
use palpa_mesh::read::FileCounts;
use palpa_mesh::{Format, RepairOptions, Surface, SurfaceFile, read_surface};
use palpa_scene::{LengthUnit, Scene, Skin};
use serde::Serialize;

/// Usual size of a body that is scanned or modelled, from corner to corner, m: between a hand and a
/// person.
const USUAL_SIZE: f64 = 0.35;
/// Sizes that a body can have, m.
const BODY_SIZES: std::ops::RangeInclusive<f64> = 0.005..=3.0;
/// Units of files, each with the factor by which its size may be further from the usual one and still
/// be preferred: most files are in metres or millimetres.
const UNITS: [(LengthUnit, f64); 4] = [
    (LengthUnit::M, 1.0),
    (LengthUnit::Mm, 1.0),
    (LengthUnit::Cm, 4.0),
    (LengthUnit::In, 8.0),
];

/// The check of one surface.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SurfaceCheck {
    /// The file.
    pub file: PathBuf,
    /// The format of its content.
    pub format: Format,
    /// Counts of the items in the file.
    pub counts: FileCounts,
    /// The reader's remarks.
    pub notes: Vec<NoteCheck>,
    /// The findings, and the repaired copy if there is one.
    #[serde(flatten)]
    pub examination: Examination,
}

/// A remark of the reader, in English.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct NoteCheck {
    /// How severe it is.
    pub severity: Severity,
    /// The remark.
    pub message: String,
}

impl SurfaceCheck {
    /// Checks a surface whose coordinates are in `unit`, and repairs a copy if that helps.
    pub fn of(
        file: PathBuf,
        surface: &SurfaceFile,
        unit: LengthUnit,
        options: &RepairOptions,
    ) -> Self {
        let notes = surface.notes.iter().map(|note| NoteCheck {
            severity: note.severity(),
            message: note.to_string(),
        });
        Self {
            file,
            format: surface.format,
            counts: surface.counts,
            notes: notes.collect(),
            examination: surface.examine(unit.metres(), options),
        }
    }
}

/// Reads the surfaces that a scene names: its skin, if that is a file, and its bones.
///
/// # Errors
/// When one of them cannot be read.
pub fn surfaces_of(scene: &Scene) -> anyhow::Result<Vec<(PathBuf, SurfaceFile)>> {
    let skin = match &scene.body.skin {
        Skin::File(path) => Some(path),
        Skin::Generated(_) => None,
    };
    skin.into_iter()
        .chain(&scene.body.bones)
        .map(|path| Ok((path.clone(), read_surface(path)?)))
        .collect()
}

/// The unit that a file's coordinates are probably in: the one in which the body is nearest to its
/// usual size. A glTF file is in metres by its standard, if a body can have that size.
pub fn probable_unit(format: Format, surface: &Surface) -> LengthUnit {
    let size = size_of(surface);
    if format == Format::Gltf && BODY_SIZES.contains(&size) {
        return LengthUnit::M;
    }
    let mut best = (LengthUnit::M, f64::INFINITY);
    for (unit, factor) in UNITS {
        let off = (size * unit.metres() / USUAL_SIZE).ln().abs() + factor.ln();
        if off < best.1 {
            best = (unit, off);
        }
    }
    best.0
}

/// Size of a surface from corner to corner of its bounding box, in the unit of its coordinates. Only
/// finite coordinates count.
pub fn size_of(surface: &Surface) -> f64 {
    let is_finite = |p: &&palpa_mesh::Vec3| p.iter().all(|x| x.is_finite());
    let mut points = surface.points.iter().filter(is_finite);
    let Some(&first) = points.next() else {
        return 0.0;
    };
    let (lo, hi) = points.fold((first, first), |(lo, hi), p| (lo.inf(p), hi.sup(p)));
    (hi - lo).norm()
}

/// Whether a file is a scene, by its name.
pub fn is_scene(file: &Path) -> bool {
    file.extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("toml"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpa_mesh::Vec3;

    fn cube(side: f64) -> Surface {
        Surface {
            points: vec![Vec3::zeros(), Vec3::new(side, side, side)],
            triangles: vec![],
        }
    }

    #[test]
    fn the_unit_is_guessed_from_the_size() {
        let unit = |side: f64| probable_unit(Format::Stl, &cube(side));
        assert_eq!(unit(0.25), LengthUnit::M, "a limb");
        assert_eq!(unit(0.01), LengthUnit::M, "a fingertip");
        assert_eq!(unit(1.0), LengthUnit::M, "a person");
        assert_eq!(unit(250.0), LengthUnit::Mm, "a limb");
        assert_eq!(unit(60.0), LengthUnit::Mm, "a hand");
        assert_eq!(unit(1000.0), LengthUnit::Mm, "a person");
        assert_eq!(unit(20.0), LengthUnit::Cm, "a limb in centimetres");
        assert_eq!(probable_unit(Format::Gltf, &cube(1.5)), LengthUnit::M);
        assert_eq!(probable_unit(Format::Gltf, &cube(250.0)), LengthUnit::Mm);
        // Without a size any unit is as good.
        assert_eq!(unit(0.0), LengthUnit::M);
        assert_eq!(unit(f64::NAN), LengthUnit::M);
    }
}
