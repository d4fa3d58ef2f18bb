//! Small tables for people: aligned columns under their headers.

use std::fmt;

/// A table of text cells, printed with columns aligned at the right.
///
/// ```
/// let mut table = palpa_cli::table::Table::new(["depth mm", "force N"]);
/// table.push(["1.0".to_owned(), "0.031".to_owned()]);
/// assert_eq!(table.to_string(), "depth mm  force N\n     1.0    0.031");
/// ```
#[derive(Debug, Clone)]
pub struct Table<const N: usize> {
    header: [String; N],
    rows: Vec<[String; N]>,
    /// Number of columns that are aligned at the left, from the first.
    n_left: usize,
}

impl<const N: usize> Table<N> {
    /// An empty table under `header`; put the unit into the column's name.
    pub fn new(header: [&str; N]) -> Self {
        Self {
            header: header.map(str::to_owned),
            rows: Vec::new(),
            n_left: 0,
        }
    }

    /// Aligns the first column at the left, for words.
    #[must_use]
    pub fn with_left_names(mut self) -> Self {
        self.n_left = 1;
        self
    }

    /// Aligns all columns at the left, for words.
    #[must_use]
    pub fn with_left_columns(mut self) -> Self {
        self.n_left = N;
        self
    }

    /// Appends a row.
    pub fn push(&mut self, row: [String; N]) {
        self.rows.push(row);
    }
}

impl<const N: usize> fmt::Display for Table<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let lines = || std::iter::once(&self.header).chain(&self.rows);
        let width: [usize; N] = std::array::from_fn(|column| {
            lines()
                .map(|line| line[column].chars().count())
                .max()
                .unwrap_or(0)
        });
        for (i, line) in lines().enumerate() {
            if i > 0 {
                writeln!(f)?;
            }
            for (column, cell) in line.iter().enumerate() {
                let gap = if column == 0 { "" } else { "  " };
                let mut pad = width[column] - cell.chars().count();
                if column < self.n_left {
                    // Nothing follows the last column.
                    if column + 1 == N {
                        pad = 0;
                    }
                    write!(f, "{gap}{cell}{:pad$}", "")?;
                } else {
                    write!(f, "{gap}{:pad$}{cell}", "")?;
                }
            }
        }
        Ok(())
    }
}
