//! Reading of surfaces: OBJ, STL, PLY, OFF, GLB and glTF files become a welded [`Surface`].
//!
//! The readers are our own, because no crate on crates.io does three things at once. It must read
//! coordinates of text files as `f64` (a scan in a map frame lies millions of metres from its
//! origin). A false count in a header must not cause a large allocation. Errors must name the line.
//! `stl_io` and `tobj` read `f32` or lose the line. `ply-rs` and `stl_io` reserve the memory that
//! the header asks for. `gltf` panics on a short GLB length and refuses files because of faults in
//! their materials.
//!
//! The time and memory of every reader are bounded by the size of the file: before memory is
//! reserved for a count, the count is compared with the remaining bytes.

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

use schemars::JsonSchema;
use serde::Serialize;

use crate::Surface;
use crate::check::Severity;
use crate::weld::weld_exact;
use builder::Builder;
pub use format::Format;

/// Largest file that is read, in bytes. A skin of 20 million triangles fits. A wrong file is
/// refused here, before it exhausts the memory.
pub const MAX_FILE_BYTES: u64 = 2 << 30;

/// A surface read from a file, with information about the file.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceFile {
    /// The surface in the units of the file. Vertices at exactly the same place are merged.
    pub surface: Surface,
    /// The format of the content, which may differ from that of the extension.
    pub format: Format,
    /// Counts of the items in the file.
    pub counts: FileCounts,
    /// The reader's remarks, in the order in which they came up.
    pub notes: Vec<ReadNote>,
}

/// Counts of the items in a file, before vertices were welded and polygons cut into triangles.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct FileCounts {
    /// Number of vertices in the file.
    pub n_points: usize,
    /// Number of faces in the file, with any number of corners.
    pub n_faces: usize,
    /// Number of faces with more than three corners, which were cut into triangles.
    pub n_polygons: usize,
    /// Number of objects, solids or mesh instances; 1 if the format has no such items.
    pub n_objects: usize,
}

/// A problem that the reader could work around.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema, thiserror::Error)]
#[serde(tag = "kind", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum ReadNote {
    /// The content does not match the extension.
    #[error("named .{extension}, but its content is {format}; read as {format}")]
    ExtensionMismatch {
        /// The extension of the file.
        extension: String,
        /// The format of the content.
        format: Format,
    },
    /// The text was UTF-16.
    #[error("text is UTF-16; save it as UTF-8 for other programs")]
    Utf16,
    /// Faces with fewer than three corners were left out.
    #[error("{count} face(s) with fewer than three corners left out, the first at {first}")]
    ShortFaces {
        /// Number of such faces.
        count: usize,
        /// Place of the first one.
        first: Place,
    },
    /// Polygons that cross themselves, double back, or are bent so much that they cannot be cut
    /// into flat triangles.
    #[error(
        "{count} polygon(s) that fold over themselves, the first at {first}; cut them into triangles in a mesh program"
    )]
    FoldedPolygons {
        /// Number of such polygons.
        count: usize,
        /// Place of the first one.
        first: Place,
    },
    /// Coordinates that are not numbers, in vertices that no face uses.
    #[error("{count} vertex line(s) that are not numbers, the first at {first}; no face uses them")]
    UnreadVertices {
        /// Number of such vertices.
        count: usize,
        /// Place of the first one.
        first: Place,
    },
    /// Lines and points, or other parts that are not faces.
    #[error("{count} part(s) of lines or points left out")]
    NotFaces {
        /// Number of such elements.
        count: usize,
    },
    /// There are bytes after the last record.
    #[error("{bytes} byte(s) after the last record were not read")]
    TrailingBytes {
        /// Number of bytes.
        bytes: usize,
    },
}

impl ReadNote {
    /// How severe the remark is.
    pub fn severity(&self) -> Severity {
        match self {
            Self::ShortFaces { .. } => Severity::Repairable,
            _ => Severity::Note,
        }
    }
}

/// A place in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
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

/// Reason why a surface could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The file does not exist or is not readable.
    #[error("cannot read {}: {source}; check the path and its permissions", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
    /// A directory, a device or a pipe.
    #[error("{} is not a file; name a file with a surface in it", path.display())]
    NotAFile {
        /// The path that was given.
        path: PathBuf,
    },
    /// The file is larger than [`MAX_FILE_BYTES`].
    #[error(
        "{} has {bytes} bytes, more than the {MAX_FILE_BYTES} that are read; thin the mesh out or cut the part of interest from it",
        path.display()
    )]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Size of the file, in bytes.
        bytes: u64,
    },
    /// The format is unknown, both by content and by extension.
    #[error(
        "{} is in no known surface format; give an OBJ, STL, PLY, OFF, GLB or glTF file",
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
        /// The error in the content, with its place.
        source: ContentError,
    },
}

/// An error in the content of a file, with its place.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{format}, {place}: {problem}")]
pub struct ContentError {
    /// The format that the file was read as.
    pub format: Format,
    /// The place of the error.
    pub place: Place,
    /// What was found, what was expected, and what to do.
    pub problem: String,
}

/// The result of a reader; the caller adds the format.
type Parsed<T> = Result<T, Fault>;

/// A problem at a place, inside a reader.
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
/// The content decides the format; the extension matters only if the content leaves it open.
/// Polygons are cut into triangles, transforms of glTF nodes are applied, and vertices at exactly
/// the same place are merged. Coordinates stay in the units of the file: metres for glTF, unknown
/// for the other formats.
///
/// # Errors
/// When the file cannot be read, is too large, has an unknown format, breaks the rules of its
/// format, or has no faces.
pub fn read_surface(path: &Path) -> Result<SurfaceFile, ReadError> {
    let bytes = load(path, MAX_FILE_BYTES)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    read_as(path, &bytes, Some(folder))
}

/// Reads a surface from the bytes of a file, like [`read_surface`] from the file itself. Of the path,
/// only the name counts: it is named in errors, and its extension matters if the content leaves the
/// format open.
///
/// A glTF with buffers in other files cannot be read this way.
///
/// # Errors
/// When the bytes have an unknown format, break the rules of their format, or hold no faces.
pub fn read_surface_named(path: &Path, bytes: &[u8]) -> Result<SurfaceFile, ReadError> {
    read_as(path, bytes, None)
}

fn read_as(path: &Path, bytes: &[u8], folder: Option<&Path>) -> Result<SurfaceFile, ReadError> {
    let extension = path
        .extension()
        .map(|e| e.to_string_lossy().to_ascii_lowercase());
    let Some(format) = Format::of(bytes, extension.as_deref()) else {
        return Err(ReadError::UnknownFormat { path: path.into() });
    };
    let mut file = parse(bytes, format, folder).map_err(|source| ReadError::Content {
        path: path.into(),
        source,
    })?;
    if let Some(extension) = extension.filter(|e| !format.extensions().contains(&e.as_str())) {
        let note = ReadNote::ExtensionMismatch { extension, format };
        file.notes.insert(0, note);
    }
    Ok(file)
}

/// Reads a surface from bytes in memory, like [`read_surface`] from a file.
///
/// A glTF with buffers in other files cannot be read this way.
///
/// # Errors
/// When the bytes break the rules of the format or hold no faces.
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

/// Reads the bytes of a regular file of at most `limit` bytes.
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
    // The file may grow after its length was read, hence the second limit.
    let mut bytes = Vec::with_capacity(metadata.len() as usize);
    let file = File::open(path).map_err(io)?;
    file.take(limit + 1).read_to_end(&mut bytes).map_err(io)?;
    if bytes.len() as u64 > limit {
        return Err(too_large(bytes.len() as u64));
    }
    Ok(bytes)
}
