//! The columns of a zone, and the elimination order of all columns.

use palpa_mesh::{Vec3, closest_on_triangle};
use palpa_sparse::fronts::Tree;
use palpa_sparse::{Block, ColumnPattern, Singular, TooLarge};

use crate::assembly::Inverted;
use crate::columns::{SurfaceGroup, places};
use crate::model::Model;

/// Stiffness of the springs that hold a supported node, relative to its own.
const SUPPORT: f64 = 1e3;
/// The reason why a step failed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Trouble {
    /// A prism is turned inside out; its middle at rest, m.
    Inverted(Vec3),
    /// A matrix could not be made positive definite.
    Singular,
    /// What was to be made is no longer wanted.
    GivenUp,
}

impl From<Inverted> for Trouble {
    fn from(inverted: Inverted) -> Self {
        Self::Inverted(inverted.at)
    }
}

impl From<Singular> for Trouble {
    fn from(_: Singular) -> Self {
        Self::Singular
    }
}

/// Share of the radius within which all triangles belong to a zone as a whole, however large.
const WHOLE: f64 = 0.5;
/// Largest number of tools with a centre of their own; others share the last.
const MOST_CENTRES: usize = 3;

/// A point of the skin at rest for each tool, m.
#[derive(Debug, Clone, Copy)]
pub(super) struct Centres {
    points: [Vec3; MOST_CENTRES],
    n: usize,
}

impl Centres {
    /// One for each of `n` tools; at least one.
    pub(super) fn new(n: usize, point: impl Fn(usize) -> Vec3) -> Self {
        let n = n.clamp(1, MOST_CENTRES);
        let points = std::array::from_fn(|k| point(k.min(n - 1)));
        Self { points, n }
    }

    /// That of a tool.
    pub(super) fn of(&self, tool: usize) -> Vec3 {
        self.points[tool.min(self.n - 1)]
    }

    fn all(&self) -> &[Vec3] {
        &self.points[..self.n]
    }

    /// Largest distance of a tool's centre from that in `other`, m.
    pub(super) fn farthest_from(&self, other: &Self) -> f64 {
        let tools = 0..self.n.max(other.n);
        let distances = tools.map(|tool| (self.of(tool) - other.of(tool)).norm());
        distances.fold(0.0, f64::max)
    }

    /// Distance of a point from the nearest of them, m.
    pub(super) fn distance(&self, point: &Vec3) -> f64 {
        let distances = self.all().iter().map(|centre| (point - centre).norm());
        distances.fold(f64::INFINITY, f64::min)
    }
}

/// The columns of a zone, and the elimination order of all columns.
#[derive(Debug)]
pub(super) struct Plan {
    /// Number of the zone, counted from 1.
    pub(super) id: u64,
    /// Centres at rest, one for each tool, m.
    pub(super) centres: Centres,
    /// Radius, m; infinite for the whole body.
    pub(super) radius: f64,
    /// Order of elimination: exterior, zone, ring.
    pub(super) tree: Tree,
    /// Whether a vertex is in the zone. `[n_vertices]`
    pub(super) is_inside: Vec<bool>,
    /// Skin vertices of the zone, ascending.
    pub(super) vertices: Vec<u32>,
    /// Triangles of the skin that are in the zone as a whole and can move.
    pub(super) triangles: Vec<u32>,
    /// The other triangles of the skin that can move.
    pub(super) outer_triangles: Vec<u32>,
    /// Nodes with unknowns, each with the first of its three unknowns: nodes of the zone (ring
    /// included), of the ring, and of the exterior.
    pub(super) zone: Vec<[u32; 2]>,
    pub(super) ring: Vec<[u32; 2]>,
    pub(super) exterior: Vec<[u32; 2]>,
}

impl Plan {
    /// The zone of all columns whose skin vertex at rest is within `radius` of one of `centres`, with whole
    /// triangles near them, and with all neighbours of those within `inner`, which so are not of the ring.
    /// Both in m.
    pub(super) fn new(
        model: &Model,
        pattern: &ColumnPattern,
        id: u64,
        centres: Centres,
        [inner, radius]: [f64; 2],
    ) -> Result<Self, TooLarge> {
        let points = &model.body.skin.points;
        let mut is_inside: Vec<bool> = points
            .iter()
            .map(|p| centres.distance(p) <= radius)
            .collect();
        let skin = &model.body.skin;
        for (t, triangle) in skin.triangles.iter().enumerate() {
            let corners = skin.corners(t);
            let is_near = |centre: &Vec3| {
                let nearest = closest_on_triangle(*centre, corners).0;
                (nearest - centre).norm() <= WHOLE * radius
            };
            if centres.all().iter().any(is_near) {
                for &v in triangle {
                    is_inside[v as usize] = true;
                }
            }
        }
        let within = (0..points.len()).filter(|&v| centres.distance(&points[v]) <= inner);
        for &neighbour in within.flat_map(|v| pattern.neighbours(v)) {
            is_inside[neighbour as usize] = true;
        }
        if !is_inside.contains(&true) {
            is_inside.fill(true);
        }
        let tree = Tree::zone_last(pattern, &places(&model.body.skin), &is_inside)?;
        let nodes = |keep: &dyn Fn(usize) -> bool| -> Vec<[u32; 2]> {
            (0..points.len())
                .filter(|&v| keep(v))
                .flat_map(|v| {
                    let first = tree.first_dof(v);
                    (0..model.structure.n_free_levels)
                        .map(move |l| [model.body.node(v, l) as u32, (first + 3 * l) as u32])
                })
                .collect()
        };
        let ring_start = model.structure.n_dofs() - tree.n_ring_columns() * pattern.width();
        let has_ring = tree.n_ring_columns() > 0;
        let zone = nodes(&|v| is_inside[v]);
        let ring = nodes(&|v| has_ring && is_inside[v] && tree.first_dof(v) >= ring_start);
        let exterior = nodes(&|v| !is_inside[v]);
        let is_held = |&v: &u32| model.supports[model.body.node(v as usize, 0)].n == 3;
        let can_move = |t: &u32| !skin.triangles[*t as usize].iter().all(is_held);
        let moving = (0..skin.triangles.len() as u32).filter(can_move);
        let (triangles, outer_triangles) = moving.partition(|&t| {
            let corners = skin.triangles[t as usize].iter();
            corners.copied().all(|v| is_inside[v as usize])
        });
        Ok(Self {
            id,
            centres,
            radius,
            vertices: (0..points.len() as u32)
                .filter(|&v| is_inside[v as usize])
                .collect(),
            triangles,
            outer_triangles,
            zone,
            ring,
            exterior,
            tree,
            is_inside,
        })
    }

    /// Whether all columns of a group are in the zone.
    pub(super) fn holds(&self, group: &SurfaceGroup) -> bool {
        group.is_within(&self.is_inside)
    }

    /// Adds stiff springs where nodes are supported.
    pub(super) fn support(
        &self,
        model: &Model,
        pattern: &ColumnPattern,
        inside: bool,
        blocks: &mut [Block<f32>],
    ) {
        for &[node, _] in if inside { &self.zone } else { &self.exterior } {
            let hold = &model.supports[node as usize];
            if hold.n == 0 {
                continue;
            }
            let (v, l) = (
                node as usize / model.body.n_levels,
                node as usize % model.body.n_levels,
            );
            let block = &mut blocks[pattern.own(v) + 2 * l];
            let size = (block[0] + block[4] + block[8]) / 3.0 * SUPPORT as f32;
            for k in 0..usize::from(hold.n) {
                let axis = hold.frame.column(k);
                for c in 0..3 {
                    for r in 0..3 {
                        block[r + 3 * c] += size * (axis[r] * axis[c]) as f32;
                    }
                }
            }
        }
    }
}
