//! Reference tables: CSV files of named columns of numbers.

use std::path::Path;

use crate::verify::{Options, VerifyError};

/// A table of numbers by column name; empty cells and words are NaN.
#[derive(Debug)]
pub(crate) struct Table {
    header: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// Reads a table of the reference folder.
    pub(crate) fn read(
        options: &Options,
        name: &str,
        columns: &[&str],
    ) -> Result<Self, VerifyError> {
        let folder = options
            .reference
            .as_deref()
            .ok_or(VerifyError::NoReference)?;
        Self::of_file(&folder.join(name), columns)
    }

    fn of_file(path: &Path, columns: &[&str]) -> Result<Self, VerifyError> {
        let fail = |reason: String| VerifyError::Table {
            path: path.to_owned(),
            reason,
        };
        let mut reader = csv::Reader::from_path(path).map_err(|e| fail(e.to_string()))?;
        let header: Vec<String> = reader
            .headers()
            .map_err(|e| fail(e.to_string()))?
            .iter()
            .map(str::to_owned)
            .collect();
        if let Some(missing) = columns.iter().find(|c| !header.iter().any(|h| h == *c)) {
            return Err(fail(format!("there is no column \"{missing}\"")));
        }
        let rows = reader
            .records()
            .map(|record| Ok(record?.iter().map(str::to_owned).collect()))
            .collect::<Result<Vec<Vec<String>>, csv::Error>>()
            .map_err(|e| fail(e.to_string()))?;
        Ok(Self { header, rows })
    }

    pub(crate) fn len(&self) -> usize {
        self.rows.len()
    }

    /// The text in a column that was requested when reading.
    pub(crate) fn text(&self, row: usize, column: &str) -> &str {
        let at = self.header.iter().position(|h| h == column);
        at.and_then(|at| self.rows[row].get(at))
            .map_or("", String::as_str)
    }

    /// The number in a column; NaN if there is none.
    pub(crate) fn number(&self, row: usize, column: &str) -> f64 {
        self.text(row, column).trim().parse().unwrap_or(f64::NAN)
    }
}
