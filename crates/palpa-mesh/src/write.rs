//! Writing of surfaces: OBJ, PLY, OFF and STL.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::{Format, Surface};

/// Reason why a surface could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The extension does not name a format that can be written.
    #[error("{}: surfaces are written as .obj, .ply, .off or .stl; choose one of these", path.display())]
    UnknownFormat {
        /// The path that was given.
        path: PathBuf,
    },
    /// For example, the folder does not exist or the disk is full.
    #[error("cannot write {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
}

/// Writes a surface in the format of the extension. OBJ and OFF are written as text and PLY as
/// binary, in `f64` and so without loss. STL is written as binary, which rounds to `f32` and
/// repeats each vertex for each triangle.
///
/// The file is either complete or absent: it is written under another name in the same folder, and
/// then renamed.
///
/// # Errors
/// When the extension is none of these, or when the file cannot be written.
pub fn write_surface(path: &Path, surface: &Surface) -> Result<(), WriteError> {
    let extension = path
        .extension()
        .map(|e| e.to_string_lossy().to_ascii_lowercase());
    let write: fn(&Surface, &mut dyn Write) -> io::Result<()> =
        match extension.as_deref().and_then(Format::of_extension) {
            Some(Format::Obj) => write_obj,
            Some(Format::Off) => write_off,
            Some(Format::Ply) => write_ply,
            Some(Format::Stl) => write_stl,
            _ => return Err(WriteError::UnknownFormat { path: path.into() }),
        };
    write_whole(path, |out| write(surface, out)).map_err(|source| WriteError::Io {
        path: path.into(),
        source,
    })
}

/// Writes a new file beside `path` and renames it to `path`. An existing file stays until then.
fn write_whole(path: &Path, fill: impl Fn(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let (file, beside) = create_beside(path)?;
    let written = fill_and_close(file, fill).and_then(|()| fs::rename(&beside, path));
    if written.is_err() {
        // The original error matters more than an error while cleaning up.
        let _ = fs::remove_file(&beside);
    }
    written
}

fn fill_and_close(file: File, fill: impl Fn(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut out = BufWriter::new(file);
    fill(&mut out)?;
    out.into_inner()
        .map_err(io::IntoInnerError::into_error)?
        .sync_all()
}

/// Creates a new file with an unused name in the folder of `path`.
fn create_beside(path: &Path) -> io::Result<(File, PathBuf)> {
    const TRIES: u32 = 100;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    for i in 0..TRIES {
        let beside = path.with_file_name(format!(".{name}.{}-{i}.part", std::process::id()));
        match OpenOptions::new()
            .write(true)
            .create_new(true)
            .open(&beside)
        {
            Ok(file) => return Ok((file, beside)),
            Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
            Err(e) => return Err(e),
        }
    }
    Err(io::ErrorKind::AlreadyExists.into())
}

fn write_obj(surface: &Surface, out: &mut dyn Write) -> io::Result<()> {
    for p in &surface.points {
        // `{}` writes the shortest digits that read back as the same number.
        writeln!(out, "v {} {} {}", p.x, p.y, p.z)?;
    }
    for t in &surface.triangles {
        let [a, b, c] = t.map(|v| v + 1);
        writeln!(out, "f {a} {b} {c}")?;
    }
    Ok(())
}

fn write_off(surface: &Surface, out: &mut dyn Write) -> io::Result<()> {
    writeln!(
        out,
        "OFF\n{} {} 0",
        surface.points.len(),
        surface.triangles.len()
    )?;
    for p in &surface.points {
        writeln!(out, "{} {} {}", p.x, p.y, p.z)?;
    }
    for [a, b, c] in &surface.triangles {
        writeln!(out, "3 {a} {b} {c}")?;
    }
    Ok(())
}

fn write_ply(surface: &Surface, out: &mut dyn Write) -> io::Result<()> {
    writeln!(
        out,
        "ply\nformat binary_little_endian 1.0\n\
         element vertex {}\nproperty double x\nproperty double y\nproperty double z\n\
         element face {}\nproperty list uchar uint vertex_indices\nend_header",
        surface.points.len(),
        surface.triangles.len()
    )?;
    for x in surface.points.iter().flatten() {
        out.write_all(&x.to_le_bytes())?;
    }
    for t in &surface.triangles {
        out.write_all(&[3])?;
        for v in t {
            out.write_all(&v.to_le_bytes())?;
        }
    }
    Ok(())
}

fn write_stl(surface: &Surface, out: &mut dyn Write) -> io::Result<()> {
    let n = u32::try_from(surface.triangles.len()).map_err(|_| {
        io::Error::new(
            io::ErrorKind::InvalidInput,
            "STL holds at most 2³² − 1 triangles",
        )
    })?;
    let mut header = [0; 80];
    header[..16].copy_from_slice(b"written by palpa");
    out.write_all(&header)?;
    out.write_all(&n.to_le_bytes())?;
    for t in 0..surface.triangles.len() {
        let normal = surface
            .area_vector(t)
            .try_normalize(0.0)
            .unwrap_or_default();
        for x in std::iter::once(normal)
            .chain(surface.corners(t))
            .flat_map(|p| [p.x, p.y, p.z])
        {
            out.write_all(&(x as f32).to_le_bytes())?;
        }
        out.write_all(&[0, 0])?;
    }
    Ok(())
}
