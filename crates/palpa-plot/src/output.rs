//! Result files that are either complete or absent. They are written under a temporary name beside
//! the target, then renamed.

use std::fmt;
use std::fs;
use std::io::{self, BufWriter, Write};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use serde::de::{IgnoredAny, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use tempfile::{Builder, NamedTempFile};

/// An output folder that exists and is writable.
#[derive(Debug)]
pub struct OutDir {
    path: PathBuf,
}

impl OutDir {
    /// Creates the folder if needed, and checks that files can be created in it.
    ///
    /// # Errors
    /// When the folder cannot be created or is not writable.
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

    /// Path of the folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the file `name` and returns its path. A subfolder in `name` is created.
    ///
    /// # Errors
    /// When the file cannot be written. An older file of that name then stays unchanged.
    pub fn write(&self, name: &str, bytes: &[u8]) -> anyhow::Result<PathBuf> {
        self.write_with(name, |w| w.write_all(bytes))
    }

    /// Like [`write`](Self::write), for content that is produced piece by piece.
    ///
    /// # Errors
    /// When `content` fails or the file cannot be written. An older file of that name then stays
    /// unchanged.
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

    /// Like [`write`](Self::write), but never replaces a file.
    ///
    /// # Errors
    /// When there is a file of that name, or it cannot be written.
    pub fn write_new(&self, name: &str, bytes: &[u8]) -> anyhow::Result<PathBuf> {
        let path = self.path.join(name);
        let write = || {
            let mut file = temporary_for(&path)?;
            file.write_all(bytes)?;
            file.persist_noclobber(&path).map_err(|e| e.error)
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
    /// When the file cannot be created.
    pub fn table<R: Serialize>(&self, name: &str) -> anyhow::Result<CsvTable<R>> {
        self.begin_table(name, None)
    }

    /// Like [`table`](Self::table), for rows whose last field is a list. `list` names the columns
    /// of that list.
    ///
    /// # Errors
    /// When the file cannot be created.
    pub fn table_with_list<R: Serialize>(
        &self,
        name: &str,
        list: Vec<String>,
    ) -> anyhow::Result<CsvTable<R>> {
        self.begin_table(name, Some(list))
    }

    fn begin_table<R>(&self, name: &str, list: Option<Vec<String>>) -> anyhow::Result<CsvTable<R>> {
        let path = self.path.join(name);
        let file = temporary_for(&path).with_context(|| cannot_write(&path))?;
        let mut builder = csv::WriterBuilder::new();
        Ok(CsvTable {
            path,
            writer: builder.has_headers(list.is_none()).from_writer(file),
            list,
            row: PhantomData,
        })
    }
}

/// A CSV table that is written row by row. It gets its name when it is [finished](Self::finish).
///
/// The file always holds complete rows, so that an interrupted command can finish the table with
/// the rows it has. If a table is dropped unfinished, no file remains.
#[derive(Debug)]
pub struct CsvTable<R> {
    path: PathBuf,
    writer: csv::Writer<NamedTempFile>,
    /// Names for the columns of the list at the end of the rows; `None` once the header is written.
    list: Option<Vec<String>>,
    row: PhantomData<R>,
}

impl<R: Serialize> CsvTable<R> {
    /// Appends a row. The header comes from the field names of the first row.
    ///
    /// # Errors
    /// When the file cannot be written, for example because the disk is full.
    pub fn push(&mut self, row: &R) -> anyhow::Result<()> {
        if let Some(list) = self.list.take() {
            let mut header = field_names(row)?;
            header.pop();
            header.extend(list);
            (self.writer.write_record(header)).with_context(|| cannot_write(&self.path))?;
        }
        self.writer
            .serialize(row)
            .with_context(|| cannot_write(&self.path))?;
        self.writer
            .flush()
            .with_context(|| cannot_write(&self.path))
    }

    /// Gives the table its final name and returns its path.
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

/// Names of the fields of a row, in order.
fn field_names(row: &impl Serialize) -> anyhow::Result<Vec<String>> {
    /// The keys of a JSON object; `serde_json::Value` would sort them.
    struct Keys(Vec<String>);

    impl<'de> Deserialize<'de> for Keys {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            deserializer.deserialize_map(KeyVisitor)
        }
    }

    struct KeyVisitor;

    impl<'de> Visitor<'de> for KeyVisitor {
        type Value = Keys;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("a row with named fields")
        }

        fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Keys, A::Error> {
            let mut keys = Vec::new();
            while let Some((key, IgnoredAny)) = map.next_entry()? {
                keys.push(key);
            }
            Ok(Keys(keys))
        }
    }

    let text = serde_json::to_string(row)?;
    Ok(serde_json::from_str::<Keys>(&text)?.0)
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
    // A temporary file is private by default. A result gets the same permissions as any other file
    // of this user.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder)
}
