//! Matchings of a general graph: as many pairs as possible, at low cost.
//!
//! First greedy by cost. Then Edmonds' blossom search (1965) augments from every unpaired vertex,
//! which gives the largest possible number of pairs. Then swaps along short alternating cycles and
//! paths lower the cost at the same number.

use std::collections::VecDeque;

use super::swaps::Swaps;

/// No vertex.
pub(super) const NONE: u32 = u32::MAX;

/// An edge of the graph: its ends, and the cost of pairing them (not negative).
#[derive(Debug, Clone, Copy)]
pub(super) struct Edge {
    pub(super) ends: [u32; 2],
    pub(super) cost: f64,
}

/// Neighbours of each vertex with the cost of pairing with them.
#[derive(Debug)]
pub(super) struct Graph {
    first: Vec<u32>,
    neighbours: Vec<(u32, f64)>,
}

impl Graph {
    fn new(n: usize, edges: impl Iterator<Item = Edge> + Clone) -> Self {
        let mut first = vec![0_u32; n + 1];
        for edge in edges.clone() {
            for end in edge.ends {
                first[end as usize + 1] += 1;
            }
        }
        for v in 0..n {
            first[v + 1] += first[v];
        }
        let mut next = first.clone();
        let mut neighbours = vec![(NONE, 0.0); first[n] as usize];
        for Edge { ends: [a, b], cost } in edges {
            for (from, to) in [(a, b), (b, a)] {
                neighbours[next[from as usize] as usize] = (to, cost);
                next[from as usize] += 1;
            }
        }
        Self { first, neighbours }
    }

    pub(super) fn around(&self, v: u32) -> &[(u32, f64)] {
        let v = v as usize;
        &self.neighbours[self.first[v] as usize..self.first[v + 1] as usize]
    }

    pub(super) fn cost(&self, a: u32, b: u32) -> Option<f64> {
        self.around(a)
            .iter()
            .find(|&&(to, _)| to == b)
            .map(|&(_, cost)| cost)
    }
}

/// The partner of each of `n` vertices, or `None`, in a matching with as many pairs as the graph
/// allows.
///
/// Among the matchings of that size it prefers those without edges above `avoided_cost`, and cheap
/// ones. It does not guarantee the least cost. The same graph always gives the same matching.
pub(super) fn matching(n: usize, edges: &[Edge], avoided_cost: f64) -> Vec<Option<u32>> {
    let wanted = edges.iter().copied().filter(|e| e.cost <= avoided_cost);
    let mut mate = greedy(n, wanted.clone());
    let preferred = Graph::new(n, wanted);
    augment(&preferred, &mut mate);
    let graph = Graph::new(n, edges.iter().copied());
    augment(&graph, &mut mate);
    replace_avoided(edges, avoided_cost, &preferred, &mut mate);
    Swaps::new(&graph, &mut mate).run();
    mate.iter().map(|&m| (m != NONE).then_some(m)).collect()
}

fn greedy(n: usize, edges: impl Iterator<Item = Edge>) -> Vec<u32> {
    let mut by_cost: Vec<Edge> = edges.collect();
    by_cost.sort_by(|a, b| a.cost.total_cmp(&b.cost).then(a.ends.cmp(&b.ends)));
    let mut mate = vec![NONE; n];
    for Edge { ends: [a, b], .. } in by_cost {
        if mate[a as usize] == NONE && mate[b as usize] == NONE {
            mate[a as usize] = b;
            mate[b as usize] = a;
        }
    }
    mate
}

/// Makes the matching as large as the graph allows.
fn augment(graph: &Graph, mate: &mut [u32]) {
    let mut search = Search::new(mate.len());
    for root in 0..mate.len() as u32 {
        if mate[root as usize] == NONE && !search.augment_from(root, graph, mate) {
            search.leave(Label::Dead);
        }
    }
}

/// Replaces avoided edges if a path of other edges exists: each is given up, and its ends are
/// paired otherwise.
fn replace_avoided(edges: &[Edge], avoided_cost: f64, preferred: &Graph, mate: &mut [u32]) {
    let mut search = Search::new(mate.len());
    for &Edge { ends: [a, b], cost } in edges {
        if cost > avoided_cost && mate[a as usize] == b {
            mate[a as usize] = NONE;
            mate[b as usize] = NONE;
            if !search.augment_from(a, preferred, mate) {
                search.leave(Label::Unseen);
                mate[a as usize] = b;
                mate[b as usize] = a;
            }
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Label {
    Unseen,
    /// At an even distance from the root, or inside a blossom: may reach out.
    Even,
    Odd,
    /// In a tree that could not be augmented; no later one can use it.
    Dead,
}

/// One alternating tree at a time. After a search, its changes are undone vertex by vertex, so its
/// cost is its own size.
#[derive(Debug)]
struct Search {
    label: Vec<Label>,
    /// The vertex from which a vertex can be paired when the path through it is flipped.
    before: Vec<u32>,
    /// Towards the base of the blossom in which a vertex lies, by halving paths.
    base: Vec<u32>,
    stamp_of: Vec<u32>,
    stamp: u32,
    queue: VecDeque<u32>,
    touched: Vec<u32>,
}

impl Search {
    fn new(n: usize) -> Self {
        Self {
            label: vec![Label::Unseen; n],
            before: vec![NONE; n],
            base: (0..n as u32).collect(),
            stamp_of: vec![0; n],
            stamp: 0,
            queue: VecDeque::new(),
            touched: Vec::new(),
        }
    }

    /// Grows a tree from an unpaired root and flips the first augmenting path. If there is none,
    /// the caller must clear the tree.
    fn augment_from(&mut self, root: u32, graph: &Graph, mate: &mut [u32]) -> bool {
        self.queue.clear();
        self.touch(root, Label::Even);
        self.queue.push_back(root);
        while let Some(v) = self.queue.pop_front() {
            for &(u, _) in graph.around(v) {
                work::count();
                match self.label[u as usize] {
                    Label::Dead | Label::Odd => {}
                    Label::Unseen => {
                        self.before[u as usize] = v;
                        self.touch(u, Label::Odd);
                        let partner = mate[u as usize];
                        if partner == NONE {
                            self.flip(u, mate);
                            self.leave(Label::Unseen);
                            return true;
                        }
                        self.touch(partner, Label::Even);
                        self.queue.push_back(partner);
                    }
                    Label::Even => {
                        if self.find(u) != self.find(v) {
                            let base = self.common_base(u, v, mate);
                            self.contract(u, v, base, mate);
                            self.contract(v, u, base, mate);
                        }
                    }
                }
            }
        }
        false
    }

    fn touch(&mut self, v: u32, label: Label) {
        self.label[v as usize] = label;
        self.touched.push(v);
    }

    fn leave(&mut self, label: Label) {
        for v in self.touched.drain(..) {
            self.label[v as usize] = label;
            self.before[v as usize] = NONE;
            self.base[v as usize] = v;
        }
    }

    /// Pairs along the path that ends at the unpaired `u`, back to the root.
    fn flip(&self, mut u: u32, mate: &mut [u32]) {
        while u != NONE {
            let v = self.before[u as usize];
            let next = mate[v as usize];
            mate[u as usize] = v;
            mate[v as usize] = u;
            u = next;
        }
    }

    fn find(&mut self, mut v: u32) -> u32 {
        while self.base[v as usize] != v {
            let above = self.base[self.base[v as usize] as usize];
            self.base[v as usize] = above;
            v = above;
        }
        v
    }

    /// The base of the blossom that the edge between the even vertices `a` and `b` closes.
    fn common_base(&mut self, mut a: u32, mut b: u32, mate: &[u32]) -> u32 {
        self.stamp += 1;
        loop {
            if a != NONE {
                a = self.find(a);
                if self.stamp_of[a as usize] == self.stamp {
                    return a;
                }
                self.stamp_of[a as usize] = self.stamp;
                let partner = mate[a as usize];
                a = if partner == NONE {
                    NONE
                } else {
                    self.before[partner as usize]
                };
            }
            std::mem::swap(&mut a, &mut b);
        }
    }

    /// Draws one arm of a blossom, from `v` down to `base`, into it; `from` is the other end of the
    /// closing edge.
    fn contract(&mut self, mut v: u32, mut from: u32, base: u32, mate: &[u32]) {
        while self.find(v) != base {
            self.before[v as usize] = from;
            let partner = mate[v as usize];
            if self.label[partner as usize] == Label::Odd {
                self.label[partner as usize] = Label::Even;
                self.queue.push_back(partner);
            }
            for u in [v, partner] {
                if self.base[u as usize] == u {
                    self.base[u as usize] = base;
                }
            }
            from = partner;
            v = self.before[partner as usize];
        }
    }
}

/// Neighbours looked at on this thread, counted in tests only: a bound on the work.
pub(super) mod work {
    #[cfg(test)]
    thread_local! {
        static N: std::cell::Cell<u64> = const { std::cell::Cell::new(0) };
    }

    #[inline]
    pub(in super::super) fn count() {
        #[cfg(test)]
        N.set(N.get() + 1);
    }

    /// The count so far.
    #[cfg(test)]
    pub(in super::super) fn n() -> u64 {
        N.get()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Size and least cost of the largest matchings, by trying all.
    fn exhaustive(edges: &[Edge], used: u32, from: usize) -> (usize, f64) {
        let mut best = (0, 0.0);
        for (k, edge) in edges.iter().enumerate().skip(from) {
            let bits = edge.ends.map(|v| 1_u32 << v).iter().sum::<u32>();
            if used & bits == 0 {
                let (size, cost) = exhaustive(edges, used | bits, k + 1);
                let found = (size + 1, cost + edge.cost);
                if found.0 > best.0 || (found.0 == best.0 && found.1 < best.1) {
                    best = found;
                }
            }
        }
        best
    }

    fn size_and_cost(mate: &[Option<u32>], edges: &[Edge]) -> (usize, f64) {
        let chosen: Vec<&Edge> = edges
            .iter()
            .filter(|e| mate[e.ends[0] as usize] == Some(e.ends[1]))
            .collect();
        for (v, partner) in mate.iter().enumerate() {
            if let Some(u) = partner {
                assert_eq!(mate[*u as usize], Some(v as u32), "pairs are mutual");
            }
        }
        let n_paired = mate.iter().flatten().count();
        assert_eq!(n_paired, 2 * chosen.len(), "pairs are edges");
        (chosen.len(), chosen.iter().map(|e| e.cost).sum())
    }

    fn graph(n: u32, max_edges: usize) -> impl Strategy<Value = (usize, Vec<Edge>)> {
        let edge = (0..n, 0..n, 0.0..1.0_f64);
        prop::collection::vec(edge, 0..max_edges).prop_map(move |raw| {
            let mut edges: Vec<Edge> = raw
                .into_iter()
                .filter(|(a, b, _)| a != b)
                .map(|(a, b, cost)| Edge {
                    ends: [a.min(b), a.max(b)],
                    cost,
                })
                .collect();
            edges.sort_by_key(|e| e.ends);
            edges.dedup_by_key(|e| e.ends);
            (n as usize, edges)
        })
    }

    proptest! {
        #[test]
        fn small_graphs_get_the_largest_matching((n, edges) in graph(9, 16), avoided in 0.3..1.0_f64) {
            let (size, cost) = exhaustive(&edges, 0, 0);
            let found = size_and_cost(&matching(n, &edges, avoided), &edges);
            prop_assert_eq!(found.0, size);
            prop_assert!(found.1 > cost - 1e-12);
        }

        #[test]
        fn avoided_edges_are_used_only_where_the_size_needs_them((n, edges) in graph(10, 18)) {
            let is_avoided = |e: &Edge| e.cost > 0.6;
            let raised: Vec<Edge> = edges
                .iter()
                .map(|e| Edge { cost: e.cost + if is_avoided(e) { 100.0 } else { 0.0 }, ..*e })
                .collect();
            let (size, cost) = exhaustive(&raised, 0, 0);
            let found = size_and_cost(&matching(n, &raised, 50.0), &raised);
            prop_assert_eq!(found.0, size);
            prop_assert_eq!((found.1 / 100.0) as usize, (cost / 100.0) as usize);
        }

        #[test]
        fn large_graphs_get_as_many_pairs_as_petgraph_finds((n, edges) in graph(120, 260)) {
            let mut other = petgraph::graph::UnGraph::<(), ()>::default();
            let nodes: Vec<_> = (0..n).map(|_| other.add_node(())).collect();
            for e in &edges {
                other.add_edge(nodes[e.ends[0] as usize], nodes[e.ends[1] as usize], ());
            }
            let expected = petgraph::algo::maximum_matching(&other).len();
            prop_assert_eq!(size_and_cost(&matching(n, &edges, 0.5), &edges).0, expected);
        }
    }

    #[test]
    fn a_blossom_is_passed_through() {
        // 0–1–2–3–4–2: an augmenting path from 0 to 5 leads round the triangle 2 3 4.
        let edges: Vec<Edge> = [[0, 1], [1, 2], [2, 3], [3, 4], [2, 4], [3, 5]]
            .into_iter()
            .map(|ends| Edge {
                ends,
                cost: if ends == [1, 2] || ends == [3, 4] {
                    0.0
                } else {
                    1.0
                },
            })
            .collect();
        assert_eq!(size_and_cost(&matching(6, &edges, 2.0), &edges).0, 3);
    }

    #[test]
    fn swaps_find_the_cheap_cycle_and_leave_the_dear_one_alone() {
        // A hexagon: greedy takes the one free edge and with it the two dear ones opposite.
        let costs = [0.0, 0.4, 1.0, 0.4, 1.0, 0.4];
        let edges: Vec<Edge> = (0..6_u32)
            .map(|k| Edge {
                ends: [k, (k + 1) % 6],
                cost: costs[k as usize],
            })
            .collect();
        let mate = matching(6, &edges, 2.0);
        assert!((size_and_cost(&mate, &edges).1 - 1.2).abs() < 1e-12);
        // A path of three: the dear edge is given up.
        let edges = [(0, 1, 1.0), (1, 2, 0.1)].map(|(a, b, cost)| Edge { ends: [a, b], cost });
        assert_eq!(matching(3, &edges, 2.0), [None, Some(2), Some(1)]);
    }
}
