//! Cheaper matchings of the same size, by swapping along short alternating cycles and paths.

use super::matching::{Graph, NONE, work};

/// Longest swap that is tried, in pairs given up. Cycles of three rotate the six triangles around a
/// vertex. On 23,000 irregular triangles, swaps of up to 3, 7, 11 and 13 lower the sum of costs by
/// 2, 7, 10 and 11 %. From 11 to 13 the time grows by a third.
const LONGEST_SWAP: usize = 11;
/// Largest number of rounds of swapping; that mesh needs four.
const MAX_ROUNDS: usize = 20;
/// Gains below this are rounding.
const SMALLEST_GAIN: f64 = 1e-9;

/// Swaps that keep the number of pairs and lower the cost.
#[derive(Debug)]
pub(super) struct Swaps<'a> {
    graph: &'a Graph,
    mate: &'a mut [u32],
    /// Pairs given up on the way, `[entered at, left at]`.
    path: Vec<[u32; 2]>,
    is_on_path: Vec<bool>,
    best: Vec<[u32; 2]>,
    best_gain: f64,
}

impl<'a> Swaps<'a> {
    pub(super) fn new(graph: &'a Graph, mate: &'a mut [u32]) -> Self {
        let is_on_path = vec![false; mate.len()];
        Self {
            graph,
            mate,
            path: Vec::new(),
            is_on_path,
            best: Vec::new(),
            best_gain: 0.0,
        }
    }

    pub(super) fn run(mut self) {
        for _ in 0..MAX_ROUNDS {
            let mut has_changed = false;
            for v in 0..self.mate.len() as u32 {
                has_changed |= self.improve_at(v);
            }
            if !has_changed {
                break;
            }
        }
    }

    /// The best swap that starts at `v`: a cycle through its pair, or a path that pairs it and
    /// leaves another vertex unpaired.
    fn improve_at(&mut self, v: u32) -> bool {
        self.best_gain = SMALLEST_GAIN;
        self.best.clear();
        let partner = self.mate[v as usize];
        if partner == NONE {
            self.is_on_path[v as usize] = true;
            self.extend_path(v, 0.0);
            self.is_on_path[v as usize] = false;
        } else {
            let gain = self.pair_cost(v);
            self.enter(v);
            self.extend_cycle(v, partner, gain);
            self.leave();
        }
        if self.best.is_empty() {
            return false;
        }
        let n = self.best.len();
        if partner == NONE {
            let mut alone = v;
            for &[at, out] in &self.best {
                self.mate[alone as usize] = at;
                self.mate[at as usize] = alone;
                alone = out;
            }
            self.mate[alone as usize] = NONE;
        } else {
            for k in 0..n {
                let (out, at) = (self.best[k][1], self.best[(k + 1) % n][0]);
                self.mate[out as usize] = at;
                self.mate[at as usize] = out;
            }
        }
        true
    }

    fn pair_cost(&self, v: u32) -> f64 {
        self.graph
            .cost(v, self.mate[v as usize])
            .expect("pairs are edges of the graph")
    }

    fn enter(&mut self, v: u32) {
        let partner = self.mate[v as usize];
        self.path.push([v, partner]);
        self.is_on_path[v as usize] = true;
        self.is_on_path[partner as usize] = true;
    }

    fn leave(&mut self) {
        for v in self.path.pop().expect("a pair was entered") {
            self.is_on_path[v as usize] = false;
        }
    }

    /// Extends the swap from `out`, whose pair was given up, to other pairs or back to `start`. A
    /// cycle with a gain can be walked so that the gain is positive all the way (Lin & Kernighan
    /// 1973). Both directions are tried, by starting at either end of each pair. So paths without
    /// gain need not be followed.
    fn extend_cycle(&mut self, start: u32, out: u32, gain: f64) {
        let graph = self.graph;
        for &(to, cost) in graph.around(out) {
            work::count();
            let rest = gain - cost;
            if to == start {
                if self.path.len() > 1 && rest > self.best_gain {
                    self.best_gain = rest;
                    self.best.clone_from(&self.path);
                }
            } else if rest > 0.0
                && !self.is_on_path[to as usize]
                && self.mate[to as usize] != NONE
                && self.path.len() < LONGEST_SWAP
            {
                let next = self.mate[to as usize];
                let rest = rest + self.pair_cost(to);
                self.enter(to);
                self.extend_cycle(start, next, rest);
                self.leave();
            }
        }
    }

    fn extend_path(&mut self, alone: u32, gain: f64) {
        let graph = self.graph;
        for &(to, cost) in graph.around(alone) {
            work::count();
            if self.is_on_path[to as usize]
                || self.mate[to as usize] == NONE
                || self.path.len() >= LONGEST_SWAP
            {
                continue;
            }
            let next = self.mate[to as usize];
            let rest = gain - cost + self.pair_cost(to);
            self.enter(to);
            if rest > self.best_gain {
                self.best_gain = rest;
                self.best.clone_from(&self.path);
            }
            self.extend_path(next, rest);
            self.leave();
        }
    }
}
