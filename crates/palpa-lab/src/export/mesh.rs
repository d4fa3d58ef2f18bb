//! Nodes and elements, numbered from 0.
//!
//! ```text
//!      6                    3 nodes of the lower triangle, 3 of the upper,
//!     /|\                   then (C3D15) the middles of the lower edges,
//!   12 | 11                 of the upper, and of the vertical ones
//!   /  15  \     skin
//!  4---10---5
//!  |   |    |
//! 13   3   14
//!  |  / \   |
//!  | 9   8  |
//!  |/     \ |
//!  1---7----2    toward the base
//! ```

use palpa_fem::lump::Lump;
use palpa_mesh::Vec3;

use super::{Element, Export};

/// The mesh of a deck.
#[derive(Debug)]
pub(super) struct DeckMesh {
    /// Positions: the body's nodes, then the middles of edges, m.
    pub(super) nodes: Vec<Vec3>,
    /// For each middle node, the two ends of its edge.
    pub(super) ends: Vec<[usize; 2]>,
    /// Nodes of each element in CalculiX's order.
    pub(super) elements: Vec<Vec<usize>>,
    /// The material of each element.
    pub(super) material: Vec<usize>,
}

impl DeckMesh {
    pub(super) fn build(export: &Export<'_>) -> Self {
        let body = export.body;
        let middles = (export.element == Element::C3d15).then(|| Middles::new(export));
        let ends = middles.as_ref().map_or_else(Vec::new, Middles::ends);
        let mut nodes = body.positions.clone();
        nodes.extend(
            ends.iter()
                .map(|&[a, b]| 0.5 * (body.positions[a] + body.positions[b])),
        );
        let (mut elements, mut material) = (Vec::new(), Vec::new());
        for interval in 0..body.n_levels - 1 {
            for t in 0..body.skin.triangles.len() {
                let prism = body.prism(t, interval);
                let [a, b, c, below_a, below_b, below_c] = prism;
                let mut element = vec![below_a, below_b, below_c, a, b, c];
                if let Some(middles) = &middles {
                    element.extend(middles.of_prism(t, interval));
                }
                elements.push(element);
                let middle = prism.iter().map(|&n| body.positions[n]).sum::<Vec3>() / 6.0;
                let lump = export
                    .lumps
                    .iter()
                    .rev()
                    .find(|l| l.fraction(&middle) > 0.5);
                material.push(lump.map_or(body.interval_layer[interval], Lump::material));
            }
        }
        Self {
            nodes,
            ends,
            elements,
            material,
        }
    }

    /// The marked nodes of the body, and the middles of edges with both ends marked.
    pub(super) fn with_middles(&self, is_marked: &[bool]) -> Vec<usize> {
        let n = is_marked.len();
        let nodes = (0..n).filter(|&node| is_marked[node]);
        let middles = (self.ends.iter().enumerate())
            .filter(|(_, ends)| ends.iter().all(|&end| is_marked[end]))
            .map(|(i, _)| n + i);
        nodes.chain(middles).collect()
    }
}

/// Numbering of the middles of edges: first the edges in the levels, edge by edge, then the
/// vertical ones.
struct Middles<'a> {
    export: &'a Export<'a>,
    edges: Vec<[u32; 2]>,
}

impl<'a> Middles<'a> {
    fn new(export: &'a Export<'a>) -> Self {
        Self {
            edges: export.body.skin.edges(),
            export,
        }
    }

    fn ends(&self) -> Vec<[usize; 2]> {
        let body = self.export.body;
        let mut ends = Vec::new();
        for &[a, b] in &self.edges {
            let [a, b] = [a as usize, b as usize];
            ends.extend((0..body.n_levels).map(|l| [body.node(a, l), body.node(b, l)]));
        }
        for v in 0..body.n_vertices() {
            ends.extend((1..body.n_levels).map(|l| [body.node(v, l - 1), body.node(v, l)]));
        }
        ends
    }

    /// The middle nodes of the prism under triangle `t`: of its lower, upper and vertical edges, in
    /// this order.
    fn of_prism(&self, t: usize, interval: usize) -> impl Iterator<Item = usize> {
        let body = self.export.body;
        let [a, b, c] = body.skin.triangles[t];
        let first = body.n_nodes();
        let in_level = |u: u32, v: u32, level: usize| {
            let edge = self.edges.binary_search(&[u.min(v), u.max(v)]);
            first + edge.expect("a triangle's side is an edge") * body.n_levels + level
        };
        let triangle = |level| [(a, b), (b, c), (c, a)].map(|(u, v)| in_level(u, v, level));
        let first_vertical = first + self.edges.len() * body.n_levels;
        let vertical =
            [a, b, c].map(|v| first_vertical + v as usize * (body.n_levels - 1) + interval);
        [triangle(interval + 1), triangle(interval), vertical]
            .into_iter()
            .flatten()
    }
}
