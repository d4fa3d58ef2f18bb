//! Memory of viscous pairs during the change from one set of batches to another.

use super::Batches;
use super::kernel::N_POINTS;
use crate::Material;
use crate::law::Prony;
use crate::model::Model;

/// Memory of all pairs of a body, for the change from one zone to another.
#[derive(Debug, Clone)]
pub(crate) struct History {
    n_rows: usize,
    /// `[pair][row][six stresses at six points, pressure]`, Pa
    numbers: Vec<f64>,
    /// Whether a pair's memory is here. `[pair]`
    is_known: Vec<bool>,
}

/// Number of values in a row of a pair.
const ROW: usize = 6 * N_POINTS + 1;

impl History {
    pub(crate) fn new(model: &Model) -> Self {
        let rows = |m: &Material| m.prony.as_ref().map_or(0, Prony::n_rows);
        let n_rows = model.materials.iter().map(rows).max().unwrap_or(0);
        let n_pairs = if model.has_memory {
            model.geometries.len()
        } else {
            0
        };
        Self {
            n_rows,
            numbers: vec![0.0; n_pairs * n_rows * ROW],
            is_known: vec![false; n_pairs],
        }
    }

    /// Marks the memory of all pairs as unknown.
    pub(crate) fn forget(&mut self) {
        self.is_known.fill(false);
    }

    /// Adds a multiple of another memory, row by row; only the last elastic stress if `is_last`.
    pub(crate) fn add(&mut self, by: f64, other: &Self, is_last: bool) {
        let n_rows = if is_last {
            self.n_rows.min(1)
        } else {
            self.n_rows
        };
        for (pair, _) in self
            .is_known
            .iter()
            .enumerate()
            .filter(|(_, known)| **known)
        {
            for row in 0..n_rows {
                let range = self.row(pair, row);
                let from = &other.numbers[range.clone()];
                for (into, from) in self.numbers[range].iter_mut().zip(from) {
                    *into += by * from;
                }
            }
        }
    }

    /// Takes over the memory of another mesh's pairs. `old` has, for each of this pair's two
    /// wedges, the old pair and the index of the wedge in it.
    pub(crate) fn carry(&mut self, pair: usize, from: &Self, old: [(usize, usize); 2]) {
        if !old.iter().all(|&(old, _)| from.is_known[old]) {
            return;
        }
        self.is_known[pair] = true;
        for row in 0..self.n_rows {
            let into = self.row(pair, row);
            let into = &mut self.numbers[into];
            let [a, b] = old.map(|(old, _)| &from.numbers[from.row(old, row)]);
            let mean = |i: usize| 0.5 * (a[i] + b[i]);
            // The means of a pair at its two depths, and its pressure.
            (0..12).chain([ROW - 1]).for_each(|i| into[i] = mean(i));
            for ((k, (_, half)), old) in old.into_iter().enumerate().zip([a, b]) {
                into[12 * (k + 1)..12 * (k + 2)]
                    .copy_from_slice(&old[12 * (half + 1)..12 * (half + 2)]);
            }
        }
    }

    fn row(&self, pair: usize, row: usize) -> std::ops::Range<usize> {
        let first = (pair * self.n_rows + row) * ROW;
        first..first + ROW
    }
}

impl Batches {
    /// Puts the memory of these pairs into a history.
    pub(crate) fn store(&self, history: &mut History) {
        for batch in &self.full {
            let Some(past) = &batch.past else { continue };
            for (lane, &pair) in batch.pairs.iter().enumerate().take(batch.n) {
                history.is_known[pair as usize] = true;
                for (r, row) in past.rows.iter().enumerate() {
                    let range = history.row(pair as usize, r);
                    let numbers = row.stress.iter().flatten().chain([&row.pressure]);
                    for (into, from) in history.numbers[range].iter_mut().zip(numbers) {
                        *into = from[lane];
                    }
                }
            }
        }
    }

    /// Takes the memory of these pairs from a history, as far as it is known there.
    pub(crate) fn load(&mut self, history: &History) {
        self.update(history, |into, from| *into = from);
    }

    /// Adds a history to the memory of these pairs, as far as it is known.
    pub(crate) fn add(&mut self, history: &History) {
        self.update(history, |into, from| *into += from);
    }

    fn update(&mut self, history: &History, put: impl Fn(&mut f64, f64)) {
        for batch in &mut self.full {
            let Some(past) = &mut batch.past else {
                continue;
            };
            for (lane, &pair) in batch.pairs.iter().enumerate() {
                if !history.is_known[pair as usize] {
                    continue;
                }
                for (r, row) in past.rows.iter_mut().enumerate() {
                    let range = history.row(pair as usize, r);
                    let numbers = row.stress.iter_mut().flatten().chain([&mut row.pressure]);
                    for (into, from) in numbers.zip(&history.numbers[range]) {
                        put(&mut into[lane], *from);
                    }
                }
            }
        }
    }
}
