//! Connectivity: edges with the triangles on them, and connected parts.

use crate::Surface;

/// One side of a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Side {
    /// The edge, smaller vertex first.
    pub(crate) edge: [u32; 2],
    /// The triangle that it belongs to.
    pub(crate) triangle: u32,
    /// Whether the triangle has it in the direction from the smaller vertex to the larger.
    pub(crate) is_forward: bool,
}

impl Side {
    /// The vertices in the direction in which the triangle has them.
    pub(crate) fn directed(self) -> [u32; 2] {
        let [a, b] = self.edge;
        if self.is_forward { [a, b] } else { [b, a] }
    }
}

/// The sides of some triangles, sorted so that the sides on one edge are consecutive. Triangles
/// with a repeated vertex are left out, because they enclose no area.
pub(crate) fn sides(surface: &Surface, triangles: impl Iterator<Item = u32>) -> Vec<Side> {
    let mut sides: Vec<Side> = triangles
        .filter(|&t| !has_repeated_vertex(surface.triangles[t as usize]))
        .flat_map(|t| {
            let [a, b, c] = surface.triangles[t as usize];
            [[a, b], [b, c], [c, a]].map(|[from, to]| Side {
                edge: [from.min(to), from.max(to)],
                triangle: t,
                is_forward: from < to,
            })
        })
        .collect();
    sides.sort_unstable();
    sides
}

/// Whether the same vertex occurs twice in a triangle.
pub(crate) fn has_repeated_vertex([a, b, c]: [u32; 3]) -> bool {
    a == b || b == c || c == a
}

/// All sides of a surface, sorted.
pub(crate) fn all_sides(surface: &Surface) -> Vec<Side> {
    sides(surface, 0..surface.triangles.len() as u32)
}

/// The sides, grouped by edge.
pub(crate) fn by_edge(sides: &[Side]) -> impl Iterator<Item = &[Side]> {
    sides.chunk_by(|a, b| a.edge == b.edge)
}

/// Disjoint sets of items numbered from 0, which can be joined in pairs.
#[derive(Debug)]
pub(crate) struct UnionFind {
    parent: Vec<u32>,
}

impl UnionFind {
    pub(crate) fn new(n: usize) -> Self {
        let parent = (0..n as u32).collect();
        Self { parent }
    }

    /// The smallest member of the set of `i`.
    pub(crate) fn find(&mut self, mut i: u32) -> u32 {
        while self.parent[i as usize] != i {
            let above = self.parent[self.parent[i as usize] as usize];
            self.parent[i as usize] = above;
            i = above;
        }
        i
    }

    pub(crate) fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }

    /// The sets, each ascending, in the order of their smallest members.
    pub(crate) fn groups(&mut self) -> Vec<Vec<u32>> {
        let n = self.parent.len() as u32;
        let mut groups: Vec<Vec<u32>> = Vec::new();
        let mut group_of = vec![u32::MAX; n as usize];
        for i in 0..n {
            let root = self.find(i) as usize;
            if group_of[root] == u32::MAX {
                group_of[root] = groups.len() as u32;
                groups.push(Vec::new());
            }
            groups[group_of[root] as usize].push(i);
        }
        groups
    }
}

/// Whether each vertex belongs to a triangle. `[n_points]`
pub(crate) fn is_used(surface: &Surface) -> Vec<bool> {
    let mut is_used = vec![false; surface.points.len()];
    for &v in surface.triangles.iter().flatten() {
        is_used[v as usize] = true;
    }
    is_used
}

/// Whether each triangle has a side in `sides`. `[n_triangles]`
pub(crate) fn has_sides(surface: &Surface, sides: &[Side]) -> Vec<bool> {
    let mut has_sides = vec![false; surface.triangles.len()];
    for side in sides {
        has_sides[side.triangle as usize] = true;
    }
    has_sides
}

/// The triangles of each connected part; triangles are connected over edges. Triangles without a
/// side in `sides` are left out.
pub(crate) fn components(surface: &Surface, sides: &[Side]) -> Vec<Vec<u32>> {
    let mut sets = UnionFind::new(surface.triangles.len());
    for on_edge in by_edge(sides) {
        for pair in on_edge.windows(2) {
            sets.join(pair[0].triangle, pair[1].triangle);
        }
    }
    let mut groups = sets.groups();
    let has_sides = has_sides(surface, sides);
    groups.retain(|group| has_sides[group[0] as usize]);
    groups
}
