//! The thickness of a layer as a function of place.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::LengthUnit;
use crate::limits::THICKNESS;
use crate::units::Length;

/// Largest size of a thickness file, bytes.
const MAX_FILE: u64 = 64 << 20;

/// The thickness of a layer. All lengths in metres.
#[derive(Debug, Clone, PartialEq)]
pub enum Thickness {
    /// Uniform.
    Uniform(f64),
    /// Varying along an axis.
    Along {
        /// Unit vector of the axis; the position of a point is its scalar product with this vector.
        axis: [f64; 3],
        /// Position along the axis (strictly ascending) and thickness there; at least one pair.
        table: Vec<[f64; 2]>,
    },
    /// Samples in a file; see [`read_thickness`].
    File(PathBuf),
}

impl Thickness {
    /// The smallest thickness anywhere, in metres; `None` for a file.
    pub fn smallest(&self) -> Option<f64> {
        match self {
            Self::Uniform(thickness) => Some(*thickness),
            Self::Along { table, .. } => table.iter().map(|row| row[1]).min_by(f64::total_cmp),
            Self::File(_) => None,
        }
    }

    /// The largest thickness anywhere, in metres; `None` for a file.
    pub fn largest(&self) -> Option<f64> {
        match self {
            Self::Uniform(thickness) => Some(*thickness),
            Self::Along { table, .. } => table.iter().map(|row| row[1]).max_by(f64::total_cmp),
            Self::File(_) => None,
        }
    }
}

/// The thickness at one point of the skin, in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThicknessSample {
    /// The point.
    pub point: [f64; 3],
    /// The thickness there.
    pub thickness: f64,
}

/// The reason why a thickness file is refused.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ThicknessError {
    /// The file could not be opened.
    #[error("{}: cannot be read: {source}; check the path and its permissions", path.display())]
    Io {
        /// The thickness file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// The file is too large.
    #[error("{}: is larger than {MAX_FILE} bytes; thin out its samples", path.display())]
    TooLarge {
        /// The thickness file.
        path: PathBuf,
    },
    /// A row is not four numbers, or the heading is wrong.
    #[error("{}: {message}; the file needs the columns x,y,z,thickness with one number each", path.display())]
    Malformed {
        /// The thickness file.
        path: PathBuf,
        /// Message of the reader, with the line.
        message: String,
    },
    /// A thickness or coordinate is out of range.
    #[error("{}:{line}: {found}; check the `unit` of the scene's body", path.display())]
    OutOfRange {
        /// The thickness file.
        path: PathBuf,
        /// Line, from 1.
        line: u64,
        /// The value that was found, and the allowed range.
        found: String,
    },
    /// The file has a heading only.
    #[error("{}: has no samples; give at least one row of x,y,z,thickness", path.display())]
    Empty {
        /// The thickness file.
        path: PathBuf,
    },
}

/// Reads the samples of a thickness file: CSV with the columns `x,y,z,thickness`, lengths in
/// `unit`.
///
/// # Errors
/// When the file cannot be read, is malformed, or holds a value out of range.
pub fn read_thickness(
    path: &Path,
    unit: LengthUnit,
) -> Result<Vec<ThicknessSample>, ThicknessError> {
    #[derive(Deserialize)]
    struct Row {
        x: f64,
        y: f64,
        z: f64,
        thickness: f64,
    }

    let file = std::fs::File::open(path).and_then(|file| Ok((file.metadata()?.len(), file)));
    let (size, file) = file.map_err(|source| ThicknessError::Io {
        path: path.to_owned(),
        source,
    })?;
    if size > MAX_FILE {
        return Err(ThicknessError::TooLarge {
            path: path.to_owned(),
        });
    }
    let malformed = |error: csv::Error| ThicknessError::Malformed {
        path: path.to_owned(),
        message: error.to_string(),
    };
    // A device file can report size zero and never end, so the limit also applies to the reader.
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(std::io::Read::take(file, MAX_FILE));
    let headers = reader.headers().map_err(malformed)?.clone();
    let mut samples = Vec::new();
    let mut record = csv::StringRecord::new();
    while reader.read_record(&mut record).map_err(malformed)? {
        let row: Row = record.deserialize(Some(&headers)).map_err(malformed)?;
        let metres = unit.metres();
        let point = [row.x, row.y, row.z].map(|coordinate| coordinate * metres);
        let thickness = row.thickness * metres;
        let out_of_range = |found: String| ThicknessError::OutOfRange {
            path: path.to_owned(),
            line: record.position().map_or(0, csv::Position::line),
            found,
        };
        if !point.iter().all(|coordinate| coordinate.is_finite()) {
            return Err(out_of_range(
                "a coordinate is not a finite number".to_owned(),
            ));
        }
        let length = Length::from_si(thickness);
        if !THICKNESS.contains(&length) {
            let found = format!("a thickness of {length} is outside the allowed {THICKNESS}");
            return Err(out_of_range(found));
        }
        samples.push(ThicknessSample { point, thickness });
    }
    if samples.is_empty() {
        return Err(ThicknessError::Empty {
            path: path.to_owned(),
        });
    }
    Ok(samples)
}
