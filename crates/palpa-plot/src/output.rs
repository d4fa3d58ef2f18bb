//! Result files that are whole or absent: written under a temporary name beside the target, then renamed.

use std::fs;
use std::io::{self, BufWriter, Write};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use serde::Serialize;
use tempfile::{Builder, NamedTempFile};

/// An output folder that exists and can be written to.
#[derive(Debug)]
pub struct OutDir {
    path: PathBuf,
}

impl OutDir {
    /// Makes the folder if needed, and tries that files can be made in it.
    ///
    /// # Errors
    /// When the folder cannot be made or written to.
    pub fn create(path: PathBuf) -> anyhow::Result<Self> {
        let advice = || {
            format!(
                "cannot write results to \"{}\"; choose another folder with --out DIR",
                path.display()
            )
        };
        fs::create_dir_all(&path).with_context(advice)?;
        temporary(&path).with_context(advice)?;
        Ok(Self { path })
    }

    /// Where the folder is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the file `name` (a subfolder in it is made) and returns its path.
    ///
    /// # Errors
    /// When the file cannot be written; then an older file of that name stays as it was.
    pub fn write(&self, name: &str, bytes: &[u8]) -> anyhow::Result<PathBuf> {
        self.write_with(name, |w| w.write_all(bytes))
    }

    /// Like [`write`](Self::write), for content that is produced piece by piece.
    ///
    /// # Errors
    /// When `content` fails or the file cannot be written; then an older file of that name stays as it was.
    pub fn write_with(
        &self,
        name: &str,
        content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> anyhow::Result<PathBuf> {
        let path = self.path.join(name);
        let write = || {
            let mut w = BufWriter::new(temporary_for(&path)?);
            content(&mut w)?;
            let file = w.into_inner().map_err(io::IntoInnerError::into_error)?;
            file.persist(&path).map_err(|e| e.error)
        };
        write().with_context(|| cannot_write(&path))?;
        Ok(path)
    }

    /// Writes `value` as JSON.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write_json(&self, name: &str, value: &impl Serialize) -> anyhow::Result<PathBuf> {
        self.write_with(name, |w| {
            serde_json::to_writer_pretty(&mut *w, value)?;
            writeln!(w)
        })
    }

    /// Begins a CSV table whose columns are the fields of `R`.
    ///
    /// # Errors
    /// When the file cannot be made.
    pub fn table<R: Serialize>(&self, name: &str) -> anyhow::Result<CsvTable<R>> {
        self.begin_table(name, true)
    }

    /// Begins a CSV table under a given header, for rows whose fields are lists.
    ///
    /// # Errors
    /// When the file cannot be made.
    pub fn table_under<R: Serialize>(
        &self,
        name: &str,
        header: &[String],
    ) -> anyhow::Result<CsvTable<R>> {
        let mut table = self.begin_table(name, false)?;
        let written = table.writer.write_record(header);
        written.with_context(|| cannot_write(&table.path))?;
        Ok(table)
    }

    fn begin_table<R>(&self, name: &str, has_header: bool) -> anyhow::Result<CsvTable<R>> {
        let path = self.path.join(name);
        let file = temporary_for(&path).with_context(|| cannot_write(&path))?;
        let mut builder = csv::WriterBuilder::new();
        Ok(CsvTable {
            path,
            writer: builder.has_headers(has_header).from_writer(file),
            row: PhantomData,
        })
    }
}

/// A CSV table that grows row by row, and takes its name when it is [finished](Self::finish).
///
/// Every row reaches the file whole, so that an interrupted command finishes the table with the rows it has. A table that
/// is dropped unfinished leaves nothing.
#[derive(Debug)]
pub struct CsvTable<R> {
    path: PathBuf,
    writer: csv::Writer<NamedTempFile>,
    row: PhantomData<R>,
}

impl<R: Serialize> CsvTable<R> {
    /// Appends a row; the header comes from the field names of the first.
    ///
    /// # Errors
    /// When the file cannot be written, the disk being full for one.
    pub fn push(&mut self, row: &R) -> anyhow::Result<()> {
        self.writer
            .serialize(row)
            .with_context(|| cannot_write(&self.path))?;
        self.writer
            .flush()
            .with_context(|| cannot_write(&self.path))
    }

    /// Gives the table its name, and returns its path.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn finish(self) -> anyhow::Result<PathBuf> {
        let Self { path, writer, .. } = self;
        let finish = || -> io::Result<()> {
            let file = writer
                .into_inner()
                .map_err(|e| io::Error::other(e.to_string()))?;
            file.persist(&path).map_err(|e| e.error)?;
            Ok(())
        };
        finish().with_context(|| cannot_write(&path))?;
        Ok(path)
    }
}

fn cannot_write(path: &Path) -> String {
    format!("cannot write \"{}\"", path.display())
}

fn temporary_for(path: &Path) -> io::Result<NamedTempFile> {
    let folder = path.parent().unwrap_or(Path::new("."));
    fs::create_dir_all(folder)?;
    temporary(folder)
}

/// A hidden file beside the target, on the same file system, so that the rename is atomic.
fn temporary(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = Builder::new();
    builder.prefix(".palpa-").suffix(".partial");
    // A temporary file is private by default; a result is as readable as any other file of this user.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder)
}
