//! The red forest: triangles divided into four, with hanging vertices on the edges of larger
//! neighbours.

use std::collections::{HashMap, VecDeque};
use std::f64::consts::SQRT_2;

use super::RefineParams;
use super::origin::Origins;
use crate::{Surface, Vec3};

/// Sizes above the wanted one by less than this factor are not too large.
const ROUNDING: f64 = 1.0 + 1e-9;
/// Where triangles may be divided into two, the size of a triangle is twice the root of its area, the longest
/// side of a right triangle with equal legs; of a slender one, this share of its longest side.
const SLENDER: f64 = 0.75;
/// Sides of at least this share of the longest one may be divided.
const LONG_SIDE: f64 = 0.8;

/// A triangle of the forest.
#[derive(Debug, Clone, Copy)]
struct Tree {
    corners: [u32; 3],
    /// The triangle of the old skin that this one is a part of.
    root: u32,
    depth: u32,
    /// Whether it was divided. If not, it is a leaf.
    is_split: bool,
    /// Its size as a multiple of the wanted one.
    excess: f64,
}

/// Divided triangles over a skin. The leaves obey two rules, so that the green closure exists and
/// has good angles: no edge of a leaf is divided more than once, and at most one of its three edges
/// is divided.
#[derive(Debug)]
pub(super) struct Forest {
    points: Vec<Vec3>,
    n_old: usize,
    /// For each new vertex, the ends of the edge whose midpoint it is. `[n_new]`
    ends: Vec<[u32; 2]>,
    trees: Vec<Tree>,
    /// The vertex at the midpoint of an edge (smaller end first).
    middles: HashMap<[u32; 2], u32>,
    /// The leaf on a directed edge.
    leaf_of: HashMap<[u32; 2], u32>,
    /// Leaves that violate a rule.
    forced: Vec<u32>,
    /// Leaves that are larger than wanted, level by level, so that a limit omits the finest
    /// divisions.
    wanted: VecDeque<u32>,
    /// See [`RefineParams::divides_in_two`].
    divides_in_two: bool,
}

impl Forest {
    pub(super) fn new(skin: &Surface) -> Self {
        let mut forest = Self {
            points: skin.points.clone(),
            n_old: skin.points.len(),
            ends: Vec::new(),
            trees: Vec::new(),
            middles: HashMap::new(),
            leaf_of: HashMap::with_capacity(3 * skin.triangles.len()),
            forced: Vec::new(),
            wanted: VecDeque::new(),
            divides_in_two: false,
        };
        for (t, &corners) in skin.triangles.iter().enumerate() {
            forest.plant(corners, t as u32, 0);
        }
        forest
    }

    /// Divides leaves until all are as small as wanted, or until a limit is reached.
    pub(super) fn refine(
        &mut self,
        params: &RefineParams,
        wanted: impl Fn(u32, &[Vec3; 3]) -> f64,
    ) {
        self.divides_in_two = params.divides_in_two;
        for leaf in 0..self.trees.len() as u32 {
            self.measure(leaf, &wanted);
        }
        loop {
            let next = self.forced.pop().or_else(|| {
                let is_full = self.points.len() >= params.max_vertices;
                if is_full {
                    None
                } else {
                    self.wanted.pop_front()
                }
            });
            let Some(leaf) = next else { break };
            let tree = self.trees[leaf as usize];
            if tree.is_split {
                continue;
            }
            // The rules take precedence over the limit of depth. If a leaf is forced beyond it, its
            // neighbours are at the limit.
            let breaks_rule = self.breaks_rule(tree.corners);
            if breaks_rule || (tree.excess > self.limit() && tree.depth < params.max_depth) {
                for child in self.split(leaf) {
                    self.measure(child, &wanted);
                }
            }
        }
        if self.divides_in_two {
            self.bisect(params);
        }
    }

    /// Multiple of the wanted size from which a leaf is divided into four.
    fn limit(&self) -> f64 {
        if self.divides_in_two {
            SQRT_2 * ROUNDING
        } else {
            1.0
        }
    }

    /// Divides leaves that are still larger than wanted into two, the largest first.
    fn bisect(&mut self, params: &RefineParams) {
        let is_large = |tree: &Tree| !tree.is_split && tree.excess > ROUNDING;
        let mut large: Vec<u32> = (0..self.trees.len() as u32)
            .filter(|&leaf| is_large(&self.trees[leaf as usize]))
            .collect();
        large.sort_by(|&a, &b| {
            let excess = |leaf: u32| self.trees[leaf as usize].excess;
            excess(b).total_cmp(&excess(a))
        });
        for leaf in large {
            if self.points.len() >= params.max_vertices {
                break;
            }
            let corners = self.trees[leaf as usize].corners;
            if (0..3).any(|k| self.middle(corners, k).is_some()) {
                self.trees[leaf as usize].excess /= SQRT_2;
                continue;
            }
            let sides = [0, 1, 2].map(|k| [corners[k], corners[(k + 1) % 3]]);
            let lengths = sides.map(|side| self.length(side));
            let longest = lengths.into_iter().fold(0.0, f64::max);
            // Of the long sides, the one whose other triangle wants to be divided too.
            let other_wants = |[a, b]: [u32; 2]| {
                let Some(&other) = self.leaf_of.get(&[b, a]) else {
                    return false;
                };
                let other = &self.trees[other as usize];
                other.excess > ROUNDING && (0..3).all(|k| self.middle(other.corners, k).is_none())
            };
            let key = |k: usize| (other_wants(sides[k]), lengths[k]);
            let best = (0..3)
                .filter(|&k| lengths[k] >= LONG_SIDE * longest)
                .max_by(|&a, &b| {
                    let (a, b) = (key(a), key(b));
                    a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
                });
            if let Some(k) = best {
                let [a, b] = sides[k];
                self.trees[leaf as usize].excess /= SQRT_2;
                self.add_middle([a.min(b), a.max(b)]);
            }
        }
    }

    fn length(&self, [a, b]: [u32; 2]) -> f64 {
        (self.points[a as usize] - self.points[b as usize]).norm()
    }

    /// The conforming triangles, in the order of the old ones, and the index of each one's old
    /// triangle.
    pub(super) fn triangles(&self) -> (Vec<[u32; 3]>, Vec<u32>) {
        let mut found = Vec::with_capacity(self.trees.len() + self.trees.len() / 4);
        for tree in self.trees.iter().filter(|tree| !tree.is_split) {
            self.close(tree.root, tree.corners, &mut found);
        }
        // A stable sort keeps the parts of one triangle in the order of their creation.
        found.sort_by_key(|(root, _)| *root);
        found.into_iter().map(|(root, t)| (t, root)).unzip()
    }

    /// Divides a triangle at the longest of its divided sides, and its halves likewise.
    fn close(&self, root: u32, corners: [u32; 3], found: &mut Vec<(u32, [u32; 3])>) {
        let divided = (0..3).filter_map(|k| Some((k, self.middle(corners, k)?)));
        let length = |k: usize| self.length([corners[k], corners[(k + 1) % 3]]);
        let longest = divided.max_by(|(j, _), (k, _)| length(*j).total_cmp(&length(*k)));
        let Some((k, m)) = longest else {
            found.push((root, corners));
            return;
        };
        let [a, b, c] = [0, 1, 2].map(|s| corners[(k + s) % 3]);
        self.close(root, [a, m, c], found);
        self.close(root, [m, b, c], found);
    }

    /// The origin of each vertex, the old vertices first.
    pub(super) fn origins(&self) -> Origins {
        let mut origins = Origins::identity(self.n_old);
        for &ends in &self.ends {
            origins.push_between(ends, 0.5);
        }
        origins
    }

    /// A run of rim vertices, with the new vertices between them. In a closed run, also those
    /// between the last and the first.
    pub(super) fn along_rim(&self, run: &[u32], is_closed: bool) -> Vec<u32> {
        let mut filled = Vec::with_capacity(2 * run.len());
        for (k, &v) in run.iter().enumerate() {
            filled.push(v);
            if let Some(&next) = run.get(k + 1) {
                self.fill(v, next, &mut filled);
            } else if is_closed {
                self.fill(v, run[0], &mut filled);
            }
        }
        filled
    }

    pub(super) fn n_too_large(&self) -> usize {
        let is_left = |tree: &&Tree| !tree.is_split && tree.excess > ROUNDING;
        self.trees.iter().filter(is_left).count()
    }

    fn fill(&self, a: u32, b: u32, run: &mut Vec<u32>) {
        if let Some(&m) = self.middles.get(&[a.min(b), a.max(b)]) {
            self.fill(a, m, run);
            run.push(m);
            self.fill(m, b, run);
        }
    }

    fn plant(&mut self, corners: [u32; 3], root: u32, depth: u32) -> u32 {
        let id = self.trees.len() as u32;
        self.trees.push(Tree {
            corners,
            root,
            depth,
            is_split: false,
            excess: 0.0,
        });
        for k in 0..3 {
            let edge = [corners[k], corners[(k + 1) % 3]];
            let before = self.leaf_of.insert(edge, id);
            assert!(
                before.is_none(),
                "two triangles walk the edge {edge:?} alike"
            );
        }
        id
    }

    /// Adds a leaf to the list if it is larger than wanted.
    fn measure(&mut self, leaf: u32, wanted: &impl Fn(u32, &[Vec3; 3]) -> f64) {
        let limit = self.limit();
        let tree = &mut self.trees[leaf as usize];
        let corners = tree.corners.map(|v| self.points[v as usize]);
        let longest = (0..3)
            .map(|k| (corners[(k + 1) % 3] - corners[k]).norm())
            .fold(0.0, f64::max);
        let size = if self.divides_in_two {
            let [a, b, c] = corners;
            let area = 0.5 * (b - a).cross(&(c - a)).norm();
            (2.0 * area.sqrt()).max(SLENDER * longest)
        } else {
            longest
        };
        let wanted = wanted(tree.root, &corners);
        tree.excess = if wanted <= 0.0 {
            f64::INFINITY
        } else {
            size / wanted
        };
        if tree.excess > limit {
            self.wanted.push_back(leaf);
        }
    }

    /// The vertex at the midpoint of side `k` of a triangle, if that edge is divided.
    fn middle(&self, corners: [u32; 3], k: usize) -> Option<u32> {
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        self.middles.get(&[a.min(b), a.max(b)]).copied()
    }

    /// Whether a leaf with these corners has two divided edges, or an edge that is divided twice.
    fn breaks_rule(&self, corners: [u32; 3]) -> bool {
        let is_split = |a: u32, b: u32| self.middles.contains_key(&[a.min(b), a.max(b)]);
        let mut n_split = 0;
        for k in 0..3 {
            if let Some(m) = self.middle(corners, k) {
                n_split += 1;
                if n_split > 1 || is_split(corners[k], m) || is_split(m, corners[(k + 1) % 3]) {
                    return true;
                }
            }
        }
        false
    }

    /// Divides a leaf into four and lists the leaves that now violate a rule.
    fn split(&mut self, leaf: u32) -> [u32; 4] {
        let Tree {
            corners: [a, b, c],
            root,
            depth,
            ..
        } = self.trees[leaf as usize];
        self.trees[leaf as usize].is_split = true;
        let middles = [[a, b], [b, c], [c, a]].map(|[from, to]| {
            self.leaf_of.remove(&[from, to]);
            self.halve(from, to)
        });
        let [ma, mb, mc] = middles;
        let children = [[a, ma, mc], [ma, b, mb], [mc, mb, c], [ma, mb, mc]]
            .map(|corners| self.plant(corners, root, depth + 1));
        for (k, child) in children.into_iter().enumerate() {
            // An edge of the leaf may already have been divided twice. The inner child has no part
            // of the leaf's edges.
            if k < 3 && self.breaks_rule(self.trees[child as usize].corners) {
                self.forced.push(child);
            }
        }
        children
    }

    /// The vertex at the midpoint of an edge. If it is new, checks the leaf on the other side of
    /// the edge. That leaf has this edge as a side, or an edge of which this one is a half.
    fn halve(&mut self, from: u32, to: u32) -> u32 {
        let edge = [from.min(to), from.max(to)];
        if let Some(&m) = self.middles.get(&edge) {
            return m;
        }
        let m = self.add_middle(edge);
        let beyond = self.leaf_of.get(&[to, from]).copied().or_else(|| {
            let [whole_from, whole_to] = self.whole(from, to)?;
            self.leaf_of.get(&[whole_to, whole_from]).copied()
        });
        if let Some(leaf) = beyond
            && self.breaks_rule(self.trees[leaf as usize].corners)
        {
            self.forced.push(leaf);
        }
        m
    }

    /// Adds the vertex at the midpoint of an edge, smaller end first.
    fn add_middle(&mut self, edge: [u32; 2]) -> u32 {
        let m = self.points.len() as u32;
        let [a, b] = edge.map(|v| self.points[v as usize]);
        self.points.push((a + b) * 0.5);
        self.ends.push(edge);
        self.middles.insert(edge, m);
        m
    }

    /// The edge that `from`–`to` is a half of, in the same direction.
    fn whole(&self, from: u32, to: u32) -> Option<[u32; 2]> {
        let ends_of = |v: u32| self.ends.get((v as usize).checked_sub(self.n_old)?);
        let other = |[a, b]: [u32; 2], v: u32| if a == v { b } else { a };
        if let Some(&ends) = ends_of(to).filter(|ends| ends.contains(&from)) {
            return Some([from, other(ends, from)]);
        }
        let ends = ends_of(from).filter(|ends| ends.contains(&to))?;
        Some([other(*ends, to), to])
    }
}
