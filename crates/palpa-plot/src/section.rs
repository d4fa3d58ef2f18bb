//! Cross-sections: the cut of a plane through a layered body or a surface, and the picture of it.
//!
//! A prism is cut face by face. Every face gives the segment between two cut edges, and the
//! segments join into the outline. Neighbours cut a shared face in the same segment, so the
//! outlines tile the section without gaps or overlaps. A quad face is taken as the surface that its
//! cut edges suggest. If all its four edges are cut (a saddle), corners on the negative side of the
//! plane are kept apart; both neighbours make the same choice.

use std::collections::BTreeMap;

use palpa_mesh::{LayeredBody, Surface, Vec3};

mod draw;
mod means;
mod shades;

pub use draw::{Panel, ToolOutline, draw};
pub use means::{CornerMeans, tissue_means};
pub use shades::{Scale, Shades, SkinShades};

/// A point in the plane, in metres along its axes.
pub type Point2 = [f64; 2];

/// A plane with two axes in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    origin: Vec3,
    right: Vec3,
    up: Vec3,
    normal: Vec3,
}

impl Plane {
    /// The plane through `origin` normal to `normal`. The projection of `up` onto the plane is the
    /// upward axis. Looking against the normal, the first axis points right.
    ///
    /// `None` if `normal` is zero or `up` is parallel to it.
    pub fn new(origin: Vec3, normal: Vec3, up: Vec3) -> Option<Self> {
        let normal = normal.try_normalize(f64::MIN_POSITIVE)?;
        let in_plane = up - normal * up.dot(&normal);
        let up = in_plane.try_normalize(1e-9 * up.norm())?;
        Some(Self {
            origin,
            right: up.cross(&normal),
            up,
            normal,
        })
    }

    /// Height of a point above the plane. m
    pub fn height(&self, point: &Vec3) -> f64 {
        (point - self.origin).dot(&self.normal)
    }

    /// The position in space of a point in the plane. m
    pub fn place(&self, [right, up]: Point2) -> Vec3 {
        self.origin + self.right * right + self.up * up
    }

    /// Projects a point onto the plane.
    pub fn project(&self, point: &Vec3) -> Point2 {
        let p = point - self.origin;
        [p.dot(&self.right), p.dot(&self.up)]
    }
}

/// A cut prism.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// Index of its layer.
    pub layer: usize,
    /// The prism: that of triangle t in interval i is `t (n_levels − 1) + i`.
    pub prism: usize,
    /// Its outline. The corners may run either way round.
    pub outline: Vec<Point2>,
    /// For each corner, its place in the mesh.
    pub places: Vec<EdgePlace>,
}

/// A place on an edge of the mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgePlace {
    /// The nodes of the edge, the smaller one first.
    pub nodes: [usize; 2],
    /// Share of the way from the first node to the second, 0 to 1.
    pub share: f64,
}

impl EdgePlace {
    /// The value here of a field that is linear along the edge, from its value at a node.
    pub fn value(&self, at_node: impl Fn(usize) -> f64) -> f64 {
        let [a, b] = self.nodes.map(at_node);
        a + (b - a) * self.share
    }
}

/// The section of a body.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Section {
    /// The cut prisms.
    pub cells: Vec<Cell>,
    /// Number of nodes in a column of the body.
    pub n_levels: usize,
    /// The lines where the section meets the skin and the borders between layers. In a closed line,
    /// the last point equals the first.
    pub borders: Vec<Vec<Point2>>,
    /// The lines where the section meets the rigid base, in the same form.
    pub base: Vec<Vec<Point2>>,
    /// Names of the layers, from the skin down.
    pub layer_names: Vec<String>,
}

/// An edge of the mesh, smaller node first.
type Edge = [usize; 2];

/// Cuts the body with its nodes at `positions`, in metres.
///
/// # Panics
/// If `positions` does not hold one point per node.
pub fn cut_body(body: &LayeredBody, positions: &[Vec3], plane: &Plane) -> Section {
    assert_eq!(positions.len(), body.n_nodes(), "one position per node");
    let cut = Cut::new(positions, plane);
    let mut cells = Vec::new();
    let mut border_segments = Vec::new();
    let mut base_segments = Vec::new();
    let n_intervals = body.n_levels - 1;
    for t in 0..body.skin.triangles.len() {
        for (i, &layer) in body.interval_layer.iter().enumerate() {
            let [a, b, c, d, e, f] = body.prism(t, i);
            if !cut.passes(&[a, b, c, d, e, f]) {
                continue;
            }
            // Every face runs counter-clockwise seen from outside, so that the segments follow each
            // other.
            let mut segments = Vec::with_capacity(6);
            cut.face(&[a, b, c], &mut segments);
            if i == 0 || body.interval_layer[i - 1] != layer {
                border_segments.extend(&segments);
            }
            let n_upper = segments.len();
            cut.face(&[f, e, d], &mut segments);
            if i + 1 == n_intervals {
                base_segments.extend(&segments[n_upper..]);
            }
            for [p, q] in [[a, b], [b, c], [c, a]] {
                cut.face(&[q, p, p + 1, q + 1], &mut segments);
            }
            let outlines = chains(&segments).into_iter().filter(|c| c.is_closed);
            cells.extend(outlines.map(|chain| Cell {
                layer,
                prism: t * n_intervals + i,
                outline: cut.points(&chain.edges),
                places: chain.edges.iter().map(|&edge| cut.place(edge)).collect(),
            }));
        }
    }
    Section {
        cells,
        n_levels: body.n_levels,
        borders: cut.lines(&border_segments),
        base: cut.lines(&base_segments),
        layer_names: body.layer_names.clone(),
    }
}

/// Cuts a surface. Returns lines; in a closed line, the last point equals the first.
pub fn cut_surface(surface: &Surface, plane: &Plane) -> Vec<Vec<Point2>> {
    let cut = Cut::new(&surface.points, plane);
    let mut segments = Vec::new();
    for triangle in &surface.triangles {
        cut.face(&triangle.map(|v| v as usize), &mut segments);
    }
    cut.lines(&segments)
}

/// Area of a simple polygon. m²
pub fn polygon_area(polygon: &[Point2]) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    let twice: f64 = polygon
        .iter()
        .zip(next)
        .map(|(p, q)| p[0] * q[1] - p[1] * q[0])
        .sum();
    0.5 * twice.abs()
}

/// Points and their heights above the plane.
struct Cut<'a> {
    points: &'a [Vec3],
    plane: &'a Plane,
    heights: Vec<f64>,
}

impl<'a> Cut<'a> {
    fn new(points: &'a [Vec3], plane: &'a Plane) -> Self {
        let heights = points.iter().map(|p| plane.height(p)).collect();
        Self {
            points,
            plane,
            heights,
        }
    }

    /// A node in the plane counts as above it, so that no node is on both sides.
    fn is_above(&self, node: usize) -> bool {
        self.heights[node] >= 0.0
    }

    fn passes(&self, nodes: &[usize]) -> bool {
        nodes
            .iter()
            .any(|&n| self.is_above(n) != self.is_above(nodes[0]))
    }

    /// Appends the segments in which the plane cuts a face. Each runs from the edge where the rim
    /// goes down through the plane to the edge where it next comes up.
    fn face(&self, rim: &[usize], segments: &mut Vec<[Edge; 2]>) {
        let n = rim.len();
        let edge = |i: usize| {
            let [p, q] = [rim[i % n], rim[(i + 1) % n]];
            [p.min(q), p.max(q)]
        };
        let sides = |i: usize| (self.is_above(rim[i % n]), self.is_above(rim[(i + 1) % n]));
        for down in (0..n).filter(|&i| sides(i) == (true, false)) {
            let up = (down + 1..down + n).find(|&i| sides(i) == (false, true));
            segments.extend(up.map(|up| [edge(down), edge(up)]));
        }
    }

    fn points(&self, edges: &[Edge]) -> Vec<Point2> {
        edges.iter().map(|&edge| self.point(edge)).collect()
    }

    /// The lines formed by the segments. In a closed line, the last point equals the first.
    fn lines(&self, segments: &[[Edge; 2]]) -> Vec<Vec<Point2>> {
        let line = |chain: Chain| {
            let mut points = self.points(&chain.edges);
            if chain.is_closed {
                points.push(points[0]);
            }
            points
        };
        chains(segments).into_iter().map(line).collect()
    }

    fn place(&self, [a, b]: Edge) -> EdgePlace {
        let [h_a, h_b] = [self.heights[a], self.heights[b]];
        EdgePlace {
            nodes: [a, b],
            share: h_a / (h_a - h_b),
        }
    }

    fn point(&self, [a, b]: Edge) -> Point2 {
        let share = self.place([a, b]).share;
        self.plane
            .project(&(self.points[a] + (self.points[b] - self.points[a]) * share))
    }
}

/// Cut edges, in the order of the line through them.
struct Chain {
    edges: Vec<Edge>,
    is_closed: bool,
}

/// Joins directed segments end to start, open lines first. A line ends where no segment follows.
fn chains(segments: &[[Edge; 2]]) -> Vec<Chain> {
    let mut next: BTreeMap<Edge, Vec<Edge>> = BTreeMap::new();
    let mut arrivals: BTreeMap<Edge, usize> = BTreeMap::new();
    for &[from, to] in segments {
        next.entry(from).or_default().push(to);
        *arrivals.entry(to).or_default() += 1;
    }
    let open_starts: Vec<Edge> = next
        .keys()
        .filter(|edge| !arrivals.contains_key(*edge))
        .copied()
        .collect();
    let mut chains: Vec<Chain> = open_starts
        .into_iter()
        .map(|start| follow(&mut next, start))
        .collect();
    while let Some((&start, _)) = next.first_key_value() {
        chains.push(follow(&mut next, start));
    }
    chains
}

/// Removes the line that begins at `start` from `next` and returns it.
fn follow(next: &mut BTreeMap<Edge, Vec<Edge>>, start: Edge) -> Chain {
    let mut edges = vec![start];
    let mut at = start;
    while let Some(ends) = next.get_mut(&at) {
        let to = ends.pop();
        if ends.is_empty() {
            next.remove(&at);
        }
        match to {
            Some(to) if to == start => {
                return Chain {
                    edges,
                    is_closed: true,
                };
            }
            Some(to) => {
                edges.push(to);
                at = to;
            }
            None => break,
        }
    }
    Chain {
        edges,
        is_closed: false,
    }
}
