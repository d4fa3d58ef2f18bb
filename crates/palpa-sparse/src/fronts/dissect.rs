//! Nested dissection: a graph in the plane or on a surface is cut in two along a line of its
//! columns, recursively.

use crate::blocks::ColumnPattern;

/// A set with at most this many columns is not cut further.
const LEAF: usize = 2;
/// A cut may be up to this many steps away from the middle, if the line of columns is shorter
/// there. `STEP` is the length of a step, as a share of the columns in the set.
const STEPS: i32 = 4;
const STEP: f64 = 0.02;
/// No cut is made across a direction in which the set's extent is below this share of its largest
/// extent.
const SLENDER: f64 = 0.75;

/// A set of columns that are eliminated together, after the columns of its children.
#[derive(Debug)]
pub(super) struct Part {
    pub(super) columns: Vec<u32>,
    pub(super) children: Vec<usize>,
}

/// Cuts `set` and appends its parts in the order of elimination. Returns the index of the last
/// part.
pub(super) fn dissect(
    pattern: &ColumnPattern,
    places: &[[f64; 3]],
    set: Vec<u32>,
    side: &mut [u8],
    parts: &mut Vec<Part>,
) -> usize {
    if set.len() > LEAF
        && let Some(cut) = best_cut(pattern, places, &set, side)
    {
        let children = [cut.one, cut.other]
            .into_iter()
            .filter(|half| !half.is_empty())
            .map(|half| dissect(pattern, places, half, side, parts))
            .collect();
        parts.push(Part {
            columns: cut.separator,
            children,
        });
    } else {
        parts.push(Part {
            columns: set,
            children: Vec::new(),
        });
    }
    parts.len() - 1
}

struct Cut {
    one: Vec<u32>,
    other: Vec<u32>,
    separator: Vec<u32>,
}

fn best_cut(
    pattern: &ColumnPattern,
    places: &[[f64; 3]],
    set: &[u32],
    side: &mut [u8],
) -> Option<Cut> {
    let place = |c: u32, axis: usize| places[c as usize][axis];
    let extent = [0, 1, 2].map(|axis| {
        let ends = set
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |e, &c| {
                [e[0].min(place(c, axis)), e[1].max(place(c, axis))]
            });
        ends[1] - ends[0]
    });
    let widest = extent.iter().copied().fold(0.0, f64::max);
    let mut best: Option<(f64, usize, usize, bool)> = None;
    let mut sorted = set.to_vec();
    for (axis, &across) in extent.iter().enumerate() {
        if across < SLENDER * widest {
            continue;
        }
        sort(&mut sorted, places, axis);
        for step in -STEPS..=STEPS {
            let share = 0.5 + STEP * f64::from(step);
            let half = (sorted.len() as f64 * share).round() as usize;
            if half == 0 || half >= sorted.len() {
                continue;
            }
            mark(&sorted, half, side);
            // The line of columns may be taken from either half.
            for from_first in [true, false] {
                let (own, across) = if from_first { (1, 2) } else { (2, 1) };
                let from = if from_first {
                    &sorted[..half]
                } else {
                    &sorted[half..]
                };
                let line = from
                    .iter()
                    .filter(|&&c| touches(pattern, c, side, across))
                    .count();
                debug_assert!(from.iter().all(|&c| side[c as usize] == own));
                let rest = from.len() - line;
                let other = sorted.len() - from.len();
                let lopsided = (rest as f64 - other as f64).abs() / sorted.len() as f64;
                let cost = (line as f64 + 0.5) * (1.0 + 0.5 * lopsided);
                if best.is_none_or(|b| cost < b.0) {
                    best = Some((cost, axis, half, from_first));
                }
            }
        }
    }
    for &c in set {
        side[c as usize] = 0;
    }
    let (_, axis, half, from_first) = best?;
    sort(&mut sorted, places, axis);
    mark(&sorted, half, side);
    let (from, other) = if from_first {
        (&sorted[..half], &sorted[half..])
    } else {
        (&sorted[half..], &sorted[..half])
    };
    let across = if from_first { 2 } else { 1 };
    let (mut separator, one): (Vec<u32>, Vec<u32>) = from
        .iter()
        .partition(|&&c| touches(pattern, c, side, across));
    let mut other = other.to_vec();
    for &c in set {
        side[c as usize] = 0;
    }
    if one.is_empty() {
        // All columns of one half are in the line, so a cut gains nothing.
        return None;
    }
    if separator.is_empty() {
        // The halves do not touch, but a part needs at least one column.
        separator.extend(other.pop());
    }
    Some(Cut {
        one,
        other,
        separator,
    })
}

fn sort(columns: &mut [u32], places: &[[f64; 3]], axis: usize) {
    columns.sort_unstable_by(|&a, &b| {
        places[a as usize][axis]
            .total_cmp(&places[b as usize][axis])
            .then(a.cmp(&b))
    });
}

fn mark(sorted: &[u32], half: usize, side: &mut [u8]) {
    for (i, &c) in sorted.iter().enumerate() {
        side[c as usize] = if i < half { 1 } else { 2 };
    }
}

fn touches(pattern: &ColumnPattern, column: u32, side: &[u8], which: u8) -> bool {
    pattern
        .neighbours(column as usize)
        .iter()
        .any(|&n| side[n as usize] == which)
}
