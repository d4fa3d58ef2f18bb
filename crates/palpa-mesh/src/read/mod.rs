//! Surfaces in: OBJ, STL, PLY, OFF, GLB and glTF, read into a welded [`Surface`].
//!
//! The readers are our own, because what is on crates.io does not hold three things at once: coordinates of text files
//! as `f64` (a scan in a map frame lies millions of metres from its origin), no allocation that a header can lie into
//! being, and errors that name the line. `stl_io` and `tobj` read `f32` or lose the line; `ply-rs` and `stl_io` reserve
//! what the header says; `gltf` panics on a short GLB length and refuses files for faults in their materials.
//!
//! Every reader works in time and memory bounded by the size of the file: a count is compared with the bytes that are
//! left before anything is reserved for it.

mod builder;
mod format;
mod gltf;
mod obj;
mod off;
mod ply;
mod polygon;
mod stl;
mod text;

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::Surface;
use crate::check::Severity;
use crate::weld::weld_exact;
use builder::Builder;
pub use format::Format;

/// The largest file that is read, in bytes. A skin of 20 million triangles fits; a wrong file stops here, and not
/// where the memory ends.
pub const MAX_FILE_BYTES: u64 = 2 << 30;

/// A surface as it came from a file, with what the file said.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceFile {
    /// The surface in the units of the file; vertices at exactly the same place are one vertex.
    pub surface: Surface,
    /// The format that was found, which need not be that of the extension.
    pub format: Format,
    /// What was in the file.
    pub counts: FileCounts,
    /// What the reader had to say, in the order in which it was met.
    pub notes: Vec<ReadNote>,
}

/// How much a file held before vertices were welded and polygons cut into triangles.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct FileCounts {
    /// Vertices as they stand in the file.
    pub n_points: usize,
    /// Faces as they stand in the file, of any number of corners.
    pub n_faces: usize,
    /// Faces with more than three corners, which were cut into triangles.
    pub n_polygons: usize,
    /// Objects, solids or mesh instances; 1 where the format has no such thing.
    pub n_objects: usize,
}

/// Something that a reader met and got over.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum ReadNote {
    /// The content is not what the extension says.
    #[error("named .{extension}, but its content is {format}; read as {format}")]
    ExtensionMismatch {
        /// The extension of the file.
        extension: String,
        /// What the content is.
        format: Format,
    },
    /// The text was UTF-16.
    #[error("text is UTF-16; save it as UTF-8 for other programs")]
    Utf16,
    /// Faces that have fewer than three corners were left out.
    #[error("{count} face(s) with fewer than three corners left out, the first at {first}")]
    ShortFaces {
        /// How many.
        count: usize,
        /// Where the first of them is.
        first: Place,
    },
    /// Polygons that cross themselves, double back or are bent so far that no cut into triangles lies flat.
    #[error(
        "{count} polygon(s) that fold over themselves, the first at {first}; cut them into triangles in a mesh program"
    )]
    FoldedPolygons {
        /// How many.
        count: usize,
        /// Where the first of them is.
        first: Place,
    },
    /// Coordinates that are not numbers, in vertices that no face uses.
    #[error("{count} vertex line(s) that are not numbers, the first at {first}; no face uses them")]
    UnreadVertices {
        /// How many.
        count: usize,
        /// Where the first of them is.
        first: Place,
    },
    /// Lines and points, or other parts that are not faces.
    #[error("{count} part(s) of lines or points left out")]
    NotFaces {
        /// How many.
        count: usize,
    },
    /// There are bytes behind the last record.
    #[error("{bytes} byte(s) after the last record were not read")]
    TrailingBytes {
        /// How many.
        bytes: usize,
    },
}

impl ReadNote {
    /// How much it matters.
    pub fn severity(&self) -> Severity {
        match self {
            Self::ShortFaces { .. } => Severity::Repairable,
            _ => Severity::Note,
        }
    }
}

/// A place in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Place {
    /// A line of a text file, counted from 1.
    Line(usize),
    /// A byte of a binary file, counted from 0.
    Byte(usize),
    /// The n-th record of its kind, counted from 0.
    Record(usize),
    /// The file as a whole.
    File,
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Line(n) => write!(f, "line {n}"),
            Self::Byte(n) => write!(f, "byte {n}"),
            Self::Record(n) => write!(f, "record {n}"),
            Self::File => f.write_str("the file"),
        }
    }
}

/// Why a surface could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The file is not there or not readable.
    #[error("cannot read {}: {source}; check the path and its permissions", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A directory, a device or a pipe.
    #[error("{} is not a file; name a file with a surface in it", path.display())]
    NotAFile {
        /// What was named.
        path: PathBuf,
    },
    /// More than [`MAX_FILE_BYTES`].
    #[error(
        "{} has {bytes} bytes, more than the {MAX_FILE_BYTES} that are read; thin the mesh out or cut the part of interest from it",
        path.display()
    )]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Its size.
        bytes: u64,
    },
    /// Neither content nor extension is known.
    #[error(
        "{} is no surface that is known; give an OBJ, STL, PLY, OFF, GLB or glTF file",
        path.display()
    )]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// The content breaks the rules of its format.
    #[error("{}: {source}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// What is wrong and where.
        source: ContentError,
    },
}

/// What is wrong with the content of a file, and where.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{format}, {place}: {problem}")]
pub struct ContentError {
    /// The format it was read as.
    pub format: Format,
    /// Where the reader stood.
    pub place: Place,
    /// What was found, what was expected and what to do.
    pub problem: String,
}

/// What a reader of one format returns; the format is added on the way out.
type Parsed<T> = Result<T, Fault>;

/// A problem at a place, from inside a reader.
#[derive(Debug)]
struct Fault {
    place: Place,
    problem: String,
}

impl Fault {
    fn new(place: Place, problem: impl Into<String>) -> Self {
        let problem = problem.into();
        Self { place, problem }
    }
}

/// Reads a surface from an OBJ, STL, PLY, OFF, GLB or glTF file.
///
/// The format is known by its content, and by the extension only where the content leaves it open. Polygons are cut
/// into triangles, transforms of glTF nodes are applied, and vertices at exactly the same place become one. The
/// coordinates are those of the file: glTF is in metres, the others say nothing about their unit.
///
/// # Errors
/// When the file cannot be read, is too large, is in no known format, breaks the rules of its format, or has no faces.
pub fn read_surface(path: &Path) -> Result<SurfaceFile, ReadError> {
    let bytes = load(path, MAX_FILE_BYTES)?;
    let extension = path
        .extension()
        .map(|e| e.to_string_lossy().to_ascii_lowercase());
    let Some(format) = Format::of(&bytes, extension.as_deref()) else {
        return Err(ReadError::UnknownFormat { path: path.into() });
    };
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut file = parse(&bytes, format, Some(folder)).map_err(|source| ReadError::Content {
        path: path.into(),
        source,
    })?;
    if let Some(extension) = extension.filter(|e| !format.extensions().contains(&e.as_str())) {
        let note = ReadNote::ExtensionMismatch { extension, format };
        file.notes.insert(0, note);
    }
    Ok(file)
}

/// Reads a surface from bytes in memory, as [`read_surface`] does from a file.
///
/// A glTF that keeps its buffers in other files cannot be read this way.
///
/// # Errors
/// When the bytes break the rules of the format, or hold no faces.
pub fn read_surface_bytes(bytes: &[u8], format: Format) -> Result<SurfaceFile, ContentError> {
    parse(bytes, format, None)
}

fn parse(bytes: &[u8], format: Format, folder: Option<&Path>) -> Result<SurfaceFile, ContentError> {
    let mut builder = Builder::new(bytes.len());
    let parsed = match format {
        Format::Obj => obj::parse(bytes, &mut builder),
        Format::Stl => stl::parse(bytes, &mut builder),
        Format::Ply => ply::parse(bytes, &mut builder),
        Format::Off => off::parse(bytes, &mut builder),
        Format::Gltf => gltf::parse(bytes, folder, &mut builder),
    };
    let faults = |fault: Fault| ContentError {
        format,
        place: fault.place,
        problem: fault.problem,
    };
    parsed
        .and_then(|()| builder.check_faces())
        .map_err(faults)?;
    let (raw, counts, notes) = builder.finish();
    let surface = weld_exact(&raw).surface;
    Ok(SurfaceFile {
        surface,
        format,
        counts,
        notes,
    })
}

/// The bytes of a file, as long as it is a plain file of no more than `limit` bytes.
fn load(path: &Path, limit: u64) -> Result<Vec<u8>, ReadError> {
    let io = |source| ReadError::Io {
        path: path.into(),
        source,
    };
    let metadata = std::fs::metadata(path).map_err(io)?;
    if !metadata.is_file() {
        return Err(ReadError::NotAFile { path: path.into() });
    }
    let too_large = |bytes| ReadError::TooLarge {
        path: path.into(),
        bytes,
    };
    if metadata.len() > limit {
        return Err(too_large(metadata.len()));
    }
    // The file may grow between the question and the answer, hence the second limit.
    let mut bytes = Vec::with_capacity(metadata.len() as usize);
    let file = File::open(path).map_err(io)?;
    file.take(limit + 1).read_to_end(&mut bytes).map_err(io)?;
    if bytes.len() as u64 > limit {
        return Err(too_large(bytes.len() as u64));
    }
    Ok(bytes)
}
