//! Nested dissection: a graph in the plane or on a surface is cut in two along a line of its
//! columns, recursively.

use crate::blocks::ColumnPattern;

/// A set with at most this many columns is not cut further.
const LEAF: usize = 2;
/// Columns on the smaller side of a cut, as a share of the set, at least; and number of places between
/// that and the middle at which cuts are tried.
const SMALLER: f64 = 0.2;
const TRIES: usize = 20;
/// No cut is made across a direction in which the set's extent is below this share of its largest
/// extent.
const SLENDER: f64 = 0.5;
/// Directions across which cuts are tried: along the axes, and between two of them.
const DIRECTIONS: [[f64; 3]; 9] = [
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [DIAGONAL, DIAGONAL, 0.0],
    [DIAGONAL, -DIAGONAL, 0.0],
    [DIAGONAL, 0.0, DIAGONAL],
    [DIAGONAL, 0.0, -DIAGONAL],
    [0.0, DIAGONAL, DIAGONAL],
    [0.0, DIAGONAL, -DIAGONAL],
];
const DIAGONAL: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Rank of a column that is not in the set.
const OUTSIDE: u32 = u32::MAX;

/// A set of columns that are eliminated together, after the columns of its children.
#[derive(Debug)]
pub(super) struct Part {
    pub(super) columns: Vec<u32>,
    pub(super) children: Vec<usize>,
}

/// Cuts `set` and appends its parts in the order of elimination. `ranks` has a number for each column, and is
/// made by [`ranks`]. Returns the index of the last part.
pub(super) fn dissect(
    pattern: &ColumnPattern,
    places: &[[f64; 3]],
    set: Vec<u32>,
    ranks: &mut [u32],
    parts: &mut Vec<Part>,
) -> usize {
    if set.len() > LEAF
        && let Some(cut) = best_cut(pattern, places, &set, ranks)
    {
        let children = [cut.one, cut.other]
            .into_iter()
            .filter(|half| !half.is_empty())
            .map(|half| dissect(pattern, places, half, ranks, parts))
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

/// Memory for [`dissect`].
pub(super) fn ranks(n_columns: usize) -> Vec<u32> {
    vec![OUTSIDE; n_columns]
}

struct Cut {
    one: Vec<u32>,
    other: Vec<u32>,
    separator: Vec<u32>,
}

/// The best place for a cut.
struct Best {
    work: f64,
    direction: [f64; 3],
    /// Number of columns before the cut.
    half: usize,
    /// Whether the separator is taken from those.
    from_first: bool,
}

fn best_cut(
    pattern: &ColumnPattern,
    places: &[[f64; 3]],
    set: &[u32],
    ranks: &mut [u32],
) -> Option<Cut> {
    let mut sorted = set.to_vec();
    rank(&sorted, ranks);
    let border = border(pattern, set, ranks);
    let extents = DIRECTIONS.map(|direction| extent(places, set, direction));
    let widest = extents.iter().copied().fold(0.0, f64::max);
    let mut best: Option<Best> = None;
    let mut counts = Counts::default();
    for (direction, extent) in DIRECTIONS.into_iter().zip(extents) {
        if extent < SLENDER * widest {
            continue;
        }
        sort(&mut sorted, places, direction);
        rank(&sorted, ranks);
        counts.count(pattern, &sorted, &border, ranks);
        for half in places_of_cuts(set.len()) {
            // The line of columns may be taken from either half.
            for from_first in [true, false] {
                let work = counts.work(half, from_first, set.len(), border.len());
                let is_better = |work: f64| best.as_ref().is_none_or(|best| work < best.work);
                if let Some(work) = work.filter(|&work| is_better(work)) {
                    best = Some(Best {
                        work,
                        direction,
                        half,
                        from_first,
                    });
                }
            }
        }
    }
    let cut = best.map(|best| {
        sort(&mut sorted, places, best.direction);
        rank(&sorted, ranks);
        cut(pattern, &sorted, &best, ranks)
    });
    for &c in set {
        ranks[c as usize] = OUTSIDE;
    }
    cut
}

/// Places at which a set of `n` columns is cut: numbers of columns before the cut, ascending.
fn places_of_cuts(n: usize) -> impl Iterator<Item = usize> {
    let middle = TRIES as f64;
    let share = move |i: usize| 0.5 + (0.5 - SMALLER) * (i as f64 - middle) / middle;
    let place = move |i: usize| (n as f64 * share(i)).round() as usize;
    (0..=2 * TRIES)
        .map(move |i| (place(i), i.checked_sub(1).map(place)))
        .filter(move |(half, before)| (1..n).contains(half) && *before != Some(*half))
        .map(|(half, _)| half)
}

/// Columns outside a set that touch it. They are eliminated after it.
fn border(pattern: &ColumnPattern, set: &[u32], ranks: &[u32]) -> Vec<u32> {
    let neighbours = set.iter().flat_map(|&c| pattern.neighbours(c as usize));
    let is_outside = |c: &u32| ranks[*c as usize] == OUTSIDE;
    let mut border: Vec<u32> = neighbours.copied().filter(is_outside).collect();
    border.sort_unstable();
    border.dedup();
    border
}

/// For each number of columns before a cut: how many columns touch the other side of it.
#[derive(Default)]
struct Counts {
    /// Of the columns before the cut, and of those behind it.
    lines: [Vec<u32>; 2],
    /// Of the set's border, those that touch columns before the cut, and behind it.
    touched: [Vec<u32>; 2],
}

impl Counts {
    fn count(&mut self, pattern: &ColumnPattern, sorted: &[u32], border: &[u32], ranks: &[u32]) {
        let n = sorted.len();
        for counts in self.lines.iter_mut().chain(&mut self.touched) {
            counts.clear();
            counts.resize(n + 1, 0);
        }
        // Each column counts for a range of cuts, so first only changes are noted.
        let note = |counts: &mut [u32], from: usize, to: usize| {
            counts[from] = counts[from].wrapping_add(1);
            counts[to] = counts[to].wrapping_sub(1);
        };
        let [before, behind] = &mut self.lines;
        for (i, &c) in sorted.iter().enumerate() {
            let [low, high] = ends(pattern, c, ranks).unwrap_or([i, i]);
            if high > i {
                note(before, i + 1, high + 1);
            }
            if low < i {
                note(behind, low + 1, i + 1);
            }
        }
        let [before, behind] = &mut self.touched;
        for &c in border {
            if let Some([low, high]) = ends(pattern, c, ranks) {
                note(before, low + 1, n);
                note(behind, 0, high + 1);
            }
        }
        for counts in self.lines.iter_mut().chain(&mut self.touched) {
            let mut sum = 0_u32;
            for count in counts {
                sum = sum.wrapping_add(*count);
                *count = sum;
            }
        }
    }

    /// Estimates the work if `half` of `n` columns are before the cut: that of the front of the separator,
    /// and of both halves, whose border is the separator and the part of the set's border that touches them.
    /// `None` if all columns of one half are in the separator: such a cut gains nothing.
    fn work(&self, half: usize, from_first: bool, n: usize, border: usize) -> Option<f64> {
        let from = usize::from(!from_first);
        let line = self.lines[from][half] as usize;
        let mut sizes = [half, n - half];
        sizes[from] -= line;
        if sizes[from] == 0 {
            return None;
        }
        let halves = sizes.into_iter().zip(&self.touched);
        let of_halves = halves.map(|(n, touched)| work(n, line + touched[half] as usize));
        Some(multiplications(line as f64, border as f64) + of_halves.sum::<f64>())
    }
}

/// Lowest and highest rank among the neighbours of a column; `None` if none is in the set.
fn ends(pattern: &ColumnPattern, column: u32, ranks: &[u32]) -> Option<[usize; 2]> {
    let neighbours = pattern.neighbours(column as usize).iter();
    let inside = neighbours
        .map(|&c| ranks[c as usize])
        .filter(|&r| r != OUTSIDE);
    let (low, high) = inside.fold((OUTSIDE, 0), |(low, high), r| (low.min(r), high.max(r)));
    (low != OUTSIDE).then_some([low as usize, high as usize])
}

/// Estimates the work for `n` columns with a border of so many, as if they were a square that is cut in
/// equal halves again and again.
fn work(n: usize, border: usize) -> f64 {
    const LINE: f64 = 0.9;
    let (mut n, mut border) = (n as f64, border as f64);
    let (mut work, mut times) = (0.0, 1.0);
    while n > LEAF as f64 {
        let line = LINE * n.sqrt();
        work += times * multiplications(line, border);
        border = 0.5 * border + line;
        n = 0.5 * (n - line);
        times *= 2.0;
    }
    work
}

/// Multiplications for a front with so many unknowns of its own and of its border.
pub(super) fn multiplications(own: f64, border: f64) -> f64 {
    own * (own * own / 3.0 + own * border + border * border)
}

/// Cuts a set at a place.
fn cut(pattern: &ColumnPattern, sorted: &[u32], at: &Best, ranks: &[u32]) -> Cut {
    let (first, second) = sorted.split_at(at.half);
    let (from, other) = if at.from_first {
        (first, second)
    } else {
        (second, first)
    };
    let touches_other = |c: &u32| {
        ends(pattern, *c, ranks).is_some_and(|[low, high]| {
            if at.from_first {
                high >= at.half
            } else {
                low < at.half
            }
        })
    };
    let (mut separator, one): (Vec<u32>, Vec<u32>) = from.iter().partition(|c| touches_other(c));
    let mut other = other.to_vec();
    if separator.is_empty() {
        // The halves do not touch, but a part needs at least one column.
        separator.extend(other.pop());
    }
    Cut {
        one,
        other,
        separator,
    }
}

fn along(places: &[[f64; 3]], column: u32, direction: [f64; 3]) -> f64 {
    let place = places[column as usize];
    (0..3).map(|axis| place[axis] * direction[axis]).sum()
}

fn extent(places: &[[f64; 3]], set: &[u32], direction: [f64; 3]) -> f64 {
    let along = set.iter().map(|&c| along(places, c, direction));
    let ends = [f64::INFINITY, f64::NEG_INFINITY];
    let [low, high] = along.fold(ends, |[low, high], x| [low.min(x), high.max(x)]);
    high - low
}

fn sort(columns: &mut [u32], places: &[[f64; 3]], direction: [f64; 3]) {
    columns.sort_unstable_by(|&a, &b| {
        along(places, a, direction)
            .total_cmp(&along(places, b, direction))
            .then(a.cmp(&b))
    });
}

fn rank(sorted: &[u32], ranks: &mut [u32]) {
    for (i, &c) in sorted.iter().enumerate() {
        ranks[c as usize] = i as u32;
    }
}
