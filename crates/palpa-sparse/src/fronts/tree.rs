//! The order in which columns are eliminated, which of them are eliminated together, and the fill
//! that results.

use std::ops::Range;

use super::dissect::{Part, dissect, multiplications, ranks};
use crate::TooLarge;
use crate::blocks::ColumnPattern;

/// Largest number of entries that a factor may have.
const MOST_NUMBERS: usize = 1 << 30;

/// Number of subtrees that are factored at the same time, and the work (multiplications) below
/// which a subtree is not divided. Neither depends on the machine, so that every machine computes
/// the same.
const BRANCHES: usize = 12;
const LEAST_BRANCH: f64 = 2e6;

/// One half of a tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Half {
    /// The columns outside the zone, eliminated first.
    Exterior,
    /// The columns of the zone. In a tree without a zone, all columns.
    Zone,
}

/// How many threads factor a half; their updates are at other places in the scratch memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Threads {
    /// One, which uses the memory of an update again as soon as it has been added.
    One,
    /// Several, each with memory of its own.
    Several,
}

/// Columns that are eliminated together, and the later columns that they touch or fill.
#[derive(Debug)]
pub(super) struct Front {
    /// Its own columns, as places in the order of elimination.
    pub(super) own: Range<u32>,
    /// The later columns that it touches or fills, as places in the order of elimination,
    /// ascending.
    pub(super) border: Vec<u32>,
    /// The parent, in the same half. The last front of each half has none.
    pub(super) parent: Option<u32>,
    pub(super) children: Vec<u32>,
    /// For each border column, its index among the parent's columns (own columns first). For a
    /// front of the exterior without a parent, its index in the ring.
    pub(super) to_parent: Vec<u32>,
    /// Pairs of neighbours that are assembled in this front.
    pub(super) pairs: Vec<FrontPair>,
    /// Index of the first number of its panel, among those of its half. A panel has
    /// `(own + border) × own` blocks of columns.
    pub(super) panel: usize,
    /// Index of the first number of its update in the scratch memory of its half, for one thread and
    /// for several. An update has `border × border` blocks of columns.
    update: [usize; 2],
}

impl Front {
    /// Index of the first number of its update in the scratch memory of its half.
    pub(super) fn update(&self, threads: Threads) -> usize {
        self.update[threads as usize]
    }

    /// Multiplications for factoring this front, with `width` unknowns in a column.
    fn flops(&self, width: usize) -> f64 {
        let unknowns = |columns: usize| (columns * width) as f64;
        multiplications(unknowns(self.own.len()), unknowns(self.border.len()))
    }
}

/// A pair of neighbours in a front.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrontPair {
    /// Index of the pair's first block.
    pub(super) blocks: u32,
    /// Row and column, as indices among the front's columns.
    pub(super) row: u32,
    pub(super) column: u32,
    /// Whether the blocks are transposed.
    pub(super) is_turned: bool,
}

/// An order of elimination of columns, with everything that depends on it but not on the matrix
/// entries.
#[derive(Debug)]
pub struct Tree {
    pub(super) fronts: Vec<Front>,
    /// Number of fronts in the exterior.
    pub(super) n_exterior: usize,
    /// Columns in the order of elimination, and the place of each column in that order.
    pub(super) order: Vec<u32>,
    pub(super) place: Vec<u32>,
    /// Front of each place in the order.
    pub(super) front_of: Vec<u32>,
    /// Places of the ring: the columns of the zone that touch the exterior. They come last.
    pub(super) ring: Range<u32>,
    /// Pairs of the ring that the exterior contributes to.
    pub(super) ring_pairs: Vec<FrontPair>,
    /// Number of unknowns in a column.
    pub(super) width: usize,
    pub(super) n_levels: usize,
    /// Sizes of panels, in numbers: exterior, then zone.
    pub(super) panels: [usize; 2],
    /// Sizes of scratch memory, in numbers, for one thread and for several: exterior, then zone.
    scratch: [[usize; 2]; 2],
    /// Subtrees of each half that can be factored at the same time; see [`Self::find_branches`].
    pub(super) branches: [Vec<Range<usize>>; 2],
    /// Whether a front is in no branch. `[n_fronts]`
    pub(super) is_trunk: Vec<bool>,
    flops: [f64; 2],
}

impl Tree {
    /// Orders all columns by nested dissection. `places` are the positions of the columns (in any
    /// unit).
    ///
    /// # Errors
    /// When the factor would take more than 8 GiB.
    pub fn whole(pattern: &ColumnPattern, places: &[[f64; 3]]) -> Result<Self, TooLarge> {
        Self::zone_last(pattern, places, &vec![true; pattern.n_columns()])
    }

    /// Orders the columns outside `zone` first, then those inside it, then the ring: the columns of
    /// the zone that touch the exterior. If a change affects only the zone, only the zone's half
    /// must be factored again.
    ///
    /// # Errors
    /// When the factor would take more than 8 GiB.
    pub fn zone_last(
        pattern: &ColumnPattern,
        places: &[[f64; 3]],
        zone: &[bool],
    ) -> Result<Self, TooLarge> {
        let n = pattern.n_columns();
        let is_ring =
            |c: usize| zone[c] && pattern.neighbours(c).iter().any(|&k| !zone[k as usize]);
        let set = |keep: &dyn Fn(usize) -> bool| -> Vec<u32> {
            (0..n).filter(|&c| keep(c)).map(|c| c as u32).collect()
        };
        let exterior = set(&|c| !zone[c]);
        let within = set(&|c| zone[c] && !is_ring(c));
        let ring = set(&|c| is_ring(c));
        let mut ranks = ranks(n);
        let mut parts = Vec::new();
        if !exterior.is_empty() {
            dissect(pattern, places, exterior, &mut ranks, &mut parts);
        }
        let n_exterior = parts.len();
        let ring_len = ring.len();
        if !within.is_empty() {
            dissect(pattern, places, within, &mut ranks, &mut parts);
        }
        if ring_len > 0 {
            let children = (parts.len() > n_exterior).then(|| parts.len() - 1);
            parts.push(Part {
                columns: ring,
                children: children.into_iter().collect(),
            });
        }
        Self::analyse(pattern, parts, n_exterior, ring_len)
    }

    fn analyse(
        pattern: &ColumnPattern,
        parts: Vec<Part>,
        n_exterior: usize,
        ring_len: usize,
    ) -> Result<Self, TooLarge> {
        let n = pattern.n_columns();
        let width = pattern.width();
        let mut order = Vec::with_capacity(n);
        let (mut place, mut front_of) = (vec![0; n], vec![0; n]);
        let mut fronts: Vec<Front> = Vec::with_capacity(parts.len());
        for (f, part) in parts.into_iter().enumerate() {
            let first = order.len() as u32;
            for c in part.columns {
                place[c as usize] = order.len() as u32;
                front_of[order.len()] = f as u32;
                order.push(c);
            }
            for &child in &part.children {
                fronts[child].parent = Some(f as u32);
            }
            fronts.push(Front {
                own: first..order.len() as u32,
                border: Vec::new(),
                parent: None,
                children: part.children.iter().map(|&c| c as u32).collect(),
                to_parent: Vec::new(),
                pairs: Vec::new(),
                panel: 0,
                update: [0; 2],
            });
        }
        let ring = (n - ring_len) as u32..n as u32;
        for f in 0..fronts.len() {
            let last = fronts[f].own.end;
            let mut border: Vec<u32> = fronts[f]
                .own
                .clone()
                .flat_map(|p| pattern.neighbours(order[p as usize] as usize))
                .map(|&c| place[c as usize])
                .chain(
                    fronts[f]
                        .children
                        .iter()
                        .flat_map(|&c| fronts[c as usize].border.clone()),
                )
                .filter(|&p| p >= last)
                .collect();
            border.sort_unstable();
            border.dedup();
            fronts[f].border = border;
        }
        for f in 0..fronts.len() {
            let to_parent = match fronts[f].parent {
                Some(parent) => {
                    let parent = &fronts[parent as usize];
                    fronts[f].border.iter().map(|&p| local(parent, p)).collect()
                }
                None => fronts[f].border.iter().map(|&p| p - ring.start).collect(),
            };
            fronts[f].to_parent = to_parent;
        }
        let mut tree = Self {
            fronts,
            n_exterior,
            order,
            place,
            front_of,
            ring,
            ring_pairs: Vec::new(),
            width,
            n_levels: pattern.n_levels(),
            panels: [0; 2],
            scratch: [[0; 2]; 2],
            branches: [Vec::new(), Vec::new()],
            is_trunk: Vec::new(),
            flops: [0.0; 2],
        };
        tree.assign_pairs(pattern);
        tree.lay_out()?;
        Ok(tree)
    }

    fn assign_pairs(&mut self, pattern: &ColumnPattern) {
        let mut put = |row: u32, column: u32, blocks: usize, is_turned: bool| {
            let f = self.front_of[column as usize] as usize;
            let front = &mut self.fronts[f];
            let pair = FrontPair {
                blocks: blocks as u32,
                row: local(front, row),
                column: column - front.own.start,
                is_turned,
            };
            front.pairs.push(pair);
            if self.ring.contains(&column) {
                self.ring_pairs.push(pair);
            }
        };
        for c in 0..pattern.n_columns() {
            let p = self.place[c];
            put(p, p, pattern.own(c), false);
        }
        for pair in 0..pattern.n_pairs() {
            let [a, b] = pattern.pair(pair).map(|c| self.place[c as usize]);
            put(a.max(b), a.min(b), pattern.between(pair), a < b);
        }
    }

    /// Gives every front its place in memory. Scratch memory is reused as soon as a parent has
    /// added the update; each branch has scratch memory of its own.
    fn lay_out(&mut self) -> Result<(), TooLarge> {
        let b = self.width;
        self.is_trunk = vec![true; self.fronts.len()];
        for half in [Half::Exterior, Half::Zone] {
            let h = half as usize;
            let range = self.range(half);
            for front in &mut self.fronts[range] {
                let (own, border) = (front.own.len() * b, front.border.len() * b);
                self.flops[h] += front.flops(b);
                front.panel = self.panels[h];
                self.panels[h] += own * (own + border);
            }
            self.take_updates(h, Threads::One, self.range(half));
            let branches = self.find_branches(half);
            for branch in &branches {
                self.is_trunk[branch.clone()].fill(false);
                self.take_updates(h, Threads::Several, branch.clone());
            }
            let trunk = self.range(half).filter(|&f| self.is_trunk[f]);
            let trunk = trunk.collect::<Vec<_>>().into_iter();
            self.take_updates(h, Threads::Several, trunk);
            self.branches[h] = branches;
            let largest = self.scratch.iter().map(|of_halves| of_halves[h]);
            if largest.chain([self.panels[h]]).any(|n| n > MOST_NUMBERS) {
                return Err(TooLarge {
                    n_dofs: self.order.len() * b,
                });
            }
        }
        Ok(())
    }

    /// Gives fronts, in the order of elimination, their scratch memory after all that has been
    /// given in this half. Memory of updates of other fronts is not reused.
    fn take_updates(&mut self, half: usize, threads: Threads, fronts: impl Iterator<Item = usize>) {
        let (b, t) = (self.width, threads as usize);
        let start = self.scratch[t][half];
        let mut free: Vec<Range<usize>> = Vec::new();
        for f in fronts {
            let size = (self.fronts[f].border.len() * b).pow(2);
            self.fronts[f].update[t] = take(&mut free, size, &mut self.scratch[t][half]);
            for c in self.fronts[f].children.clone() {
                let child = &self.fronts[c as usize];
                let size = (child.border.len() * b).pow(2);
                let at = child.update[t];
                if at >= start {
                    give(&mut free, at..at + size);
                }
            }
        }
    }

    /// Subtrees of a half that can be factored at the same time, in the order of elimination. The
    /// rest of the half, the trunk, comes after all of them.
    fn find_branches(&self, half: Half) -> Vec<Range<usize>> {
        let range = self.range(half);
        // First front and work of the subtree under each front. A subtree is a range of fronts.
        let mut first: Vec<usize> = (0..self.fronts.len()).collect();
        let mut work: Vec<f64> = self.fronts.iter().map(|f| f.flops(self.width)).collect();
        for f in range.clone() {
            for &c in &self.fronts[f].children {
                first[f] = first[f].min(first[c as usize]);
                work[f] += work[c as usize];
            }
        }
        let is_root = |f: &usize| self.fronts[*f].parent.is_none();
        let mut roots: Vec<usize> = range.filter(is_root).collect();
        while roots.len() < BRANCHES {
            let largest =
                (0..roots.len()).max_by(|&i, &j| work[roots[i]].total_cmp(&work[roots[j]]));
            let Some(i) = largest.filter(|&i| work[roots[i]] > LEAST_BRANCH) else {
                break;
            };
            let children = &self.fronts[roots[i]].children;
            if children.is_empty() {
                break;
            }
            roots.swap_remove(i);
            roots.extend(children.iter().map(|&c| c as usize));
        }
        roots.sort_unstable();
        roots.iter().map(|&f| first[f]..f + 1).collect()
    }

    /// Size of the scratch memory of a half, in numbers.
    pub(super) fn scratch(&self, half: Half, threads: Threads) -> usize {
        self.scratch[threads as usize][half as usize]
    }

    /// The fronts of a half, in the order of elimination.
    pub(super) fn range(&self, half: Half) -> Range<usize> {
        match half {
            Half::Exterior => 0..self.n_exterior,
            Half::Zone => self.n_exterior..self.fronts.len(),
        }
    }

    /// Number of subtrees that can be computed at the same time.
    pub fn n_branches(&self) -> usize {
        self.branches.iter().map(Vec::len).sum()
    }

    /// Number of columns.
    pub fn n_columns(&self) -> usize {
        self.order.len()
    }

    /// Number of columns in the zone, including its ring.
    pub fn n_zone_columns(&self) -> usize {
        self.fronts[self.range(Half::Zone)]
            .iter()
            .map(|f| f.own.len())
            .sum()
    }

    /// Number of columns in the ring between zone and exterior.
    pub fn n_ring_columns(&self) -> usize {
        self.ring.len()
    }

    /// Floating-point operations for factoring a half. A multiplication with its addition counts as
    /// one.
    pub fn flops(&self, half: Half) -> f64 {
        self.flops[half as usize]
    }

    /// The first unknown of a column in vectors that are ordered by elimination.
    pub fn first_dof(&self, column: usize) -> usize {
        self.place[column] as usize * self.width
    }

    /// Index of the zone's first unknown in vectors that are ordered by elimination.
    pub fn first_zone_dof(&self) -> usize {
        self.fronts[..self.n_exterior]
            .iter()
            .map(|f| f.own.len())
            .sum::<usize>()
            * self.width
    }
}

/// Index of a column among the columns of a front. The column is given by its place in the order.
fn local(front: &Front, place: u32) -> u32 {
    if front.own.contains(&place) {
        return place - front.own.start;
    }
    let at = front.border.partition_point(|&p| p < place);
    debug_assert_eq!(front.border.get(at), Some(&place));
    (front.own.len() + at) as u32
}

/// Allocates `size` numbers in the first hole that is large enough, or at the end.
fn take(free: &mut Vec<Range<usize>>, size: usize, end: &mut usize) -> usize {
    if size == 0 {
        return 0;
    }
    if let Some(i) = free.iter().position(|hole| hole.len() >= size) {
        let start = free[i].start;
        free[i].start += size;
        if free[i].is_empty() {
            free.remove(i);
        }
        return start;
    }
    let start = match free.last() {
        Some(hole) if hole.end == *end => free.pop().map_or(*end, |hole| hole.start),
        _ => *end,
    };
    *end = start + size;
    start
}

/// Frees memory and joins it with the neighbouring holes.
fn give(free: &mut Vec<Range<usize>>, room: Range<usize>) {
    if room.is_empty() {
        return;
    }
    let at = free.partition_point(|hole| hole.start < room.start);
    free.insert(at, room);
    if at + 1 < free.len() && free[at].end == free[at + 1].start {
        free[at].end = free[at + 1].end;
        free.remove(at + 1);
    }
    if at > 0 && free[at - 1].end == free[at].start {
        free[at - 1].end = free[at].end;
        free.remove(at);
    }
}
