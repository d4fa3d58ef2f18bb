//! The local model of a body under its tools. The haptic loop uses it between two steps.
//!
//! ```text
//! x_i = x0_i + Σ_j W_ij (r_j − r0_j)
//! ```

use palpa_mesh::Vec3;

use super::MOST_CANDIDATES;
use super::candidate::Candidate;
use super::contact_problem::{ContactProblem, factor_symmetric, substitute_symmetric};
use crate::Mat3;
use crate::posed_tool::PosedTool;
use crate::shape::Pose;

/// A skin vertex under or near a tool, or two neighbouring pressing vertices merged into one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalContact {
    /// Index of the skin vertex. A merged contact has a number of its own, the same in every step
    /// and never that of a vertex.
    pub vertex: u32,
    /// Index of the tool.
    pub tool: usize,
    /// Position, m.
    pub position: Vec3,
    /// Force of the tool on it, N.
    pub force: Vec3,
    /// Nearest point of the tool, in the tool's frame, m.
    pub surface: Vec3,
    /// The tool's outward normal there, in the tool's frame.
    pub normal: Vec3,
    /// The tool's curvature there, in the tool's frame, 1/m.
    pub curvature: Mat3,
    /// Its anchor, the point where friction holds it, in the tool's frame, m.
    pub anchor: Vec3,
}

/// A tool, and the body's force on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalTool {
    /// Pose of the tool.
    pub pose: Pose,
    /// Coefficient of friction.
    pub friction: f64,
    /// Force of the tissue on the tool, N.
    pub force: Vec3,
    /// Stiffness of that force against a displacement of the tool, along the normals of the
    /// pressing vertices, N/m.
    pub stiffness: Mat3,
}

/// The local model; its memory is kept from step to step.
#[derive(Debug, Clone, Default)]
pub struct LocalModel {
    /// Contacts, active or not.
    pub contacts: Vec<LocalContact>,
    /// The tools.
    pub tools: Vec<LocalTool>,
    /// Compliance `W`, `3 n × 3 n`, column-major, symmetric, m/N.
    pub compliance: Vec<f64>,
}

impl LocalModel {
    /// Compliance block: displacement of contact `i` per force on contact `j`, m/N.
    pub fn block(&self, i: usize, j: usize) -> Mat3 {
        let n = 3 * self.contacts.len();
        Mat3::from_fn(|r, c| self.compliance[3 * i + r + n * (3 * j + c)])
    }
}

/// If removing the supports leaves a pivot below this share of its own diagonal entry, the body
/// counts as unstable.
const LEAST_RELEASE: f64 = 0.05;

/// One or two candidates, and their share of the force.
#[derive(Clone, Copy)]
struct Cluster {
    members: [usize; 2],
    shares: [f64; 2],
}

impl ContactProblem {
    /// Fills the local model with at most `most` contacts.
    pub(super) fn local_model(
        &mut self,
        tools: &[PosedTool],
        skin: &[Vec3],
        most: usize,
        out: &mut LocalModel,
    ) {
        let mut clusters = [Cluster {
            members: [0; 2],
            shares: [1.0, 0.0],
        }; MOST_CANDIDATES];
        let n = self.clusters(skin, most, &mut clusters);
        let clusters = &clusters[..n];
        self.release();
        out.contacts.clear();
        out.contacts.extend(clusters.iter().map(|cluster| {
            let members = cluster.members.map(|m| &self.candidates[m]);
            let share = cluster.shares;
            let position = place(members[0]) * share[0] + place(members[1]) * share[1];
            let force = if share[1] > 0.0 {
                members[0].force() + members[1].force()
            } else {
                members[0].force()
            };
            let anchor = members[0].anchor * share[0] + members[1].anchor * share[1];
            let PosedTool { tool, pose } = &tools[members[0].tool as usize];
            let local = pose.inverse_transform_point(&position.into()).coords;
            let distance = tool.shape().distance(&local);
            // The midpoint of two points on a curved tool lies inside it; use the surface point and
            // normal of both.
            let (surface, normal) = if share[1] > 0.0 {
                let mean = members[0].normal * share[0] + members[1].normal * share[1];
                (
                    local,
                    pose.rotation.inverse_transform_vector(&mean.normalize()),
                )
            } else {
                (local - distance.normal * distance.distance, distance.normal)
            };
            LocalContact {
                vertex: if share[1] > 0.0 {
                    number_of_pair(members[0].vertex, members[1].vertex)
                } else {
                    members[0].vertex
                },
                tool: members[0].tool as usize,
                position,
                force,
                surface,
                normal,
                curvature: distance.curvature,
                anchor,
            }
        }));
        out.compliance.clear();
        out.compliance.resize(9 * n * n, 0.0);
        for (j, cj) in clusters.iter().enumerate() {
            for (i, ci) in clusters.iter().enumerate() {
                let mut block = Mat3::zeros();
                for (a, &share_a) in ci.members.iter().zip(&ci.shares) {
                    for (b, &share_b) in cj.members.iter().zip(&cj.shares) {
                        let share = share_a * share_b;
                        if share > 0.0 {
                            block += self.full_block(*a, *b) * share;
                        }
                    }
                }
                for c in 0..3 {
                    for r in 0..3 {
                        out.compliance[3 * i + r + 3 * n * (3 * j + c)] = block[(r, c)];
                    }
                }
            }
        }
        out.tools.clear();
        for (t, tool) in tools.iter().enumerate() {
            let own = self.candidates.iter().filter(|c| c.tool as usize == t);
            let force = -own.map(Candidate::force).sum::<Vec3>();
            out.tools.push(LocalTool {
                pose: tool.pose,
                friction: tool.tool.friction(),
                force,
                stiffness: self.tool_stiffness(t),
            });
        }
    }

    /// Removes the supports, which exist only in the step's matrix, from the compliance. With the
    /// normals of the supported vertices in `N`,
    ///
    /// ```text
    /// W + W N (1/κ − Nᵀ W N)⁻¹ Nᵀ W
    /// ```
    /// If the free body is not stable, this is not a valid compliance. Then only as much of the
    /// supports is removed as leaves it stable.
    fn release(&mut self) {
        /// Shares of the supports that are removed, tried in this order.
        const SHARES: [f64; 5] = [1.0, 0.9, 0.7, 0.4, 0.1];
        let (n, has_friction) = (self.candidates.len(), self.has_friction);
        let per = if has_friction { 3 } else { 1 };
        let size = per * n;
        self.released[..size * size].copy_from_slice(&self.compliance[..size * size]);
        let mut rows = [0; MOST_CANDIDATES];
        let mut m = 0;
        for (i, candidate) in self.candidates.iter().enumerate() {
            if candidate.support > 0.0 {
                rows[m] = i;
                m += 1;
            }
        }
        let rows = &rows[..m];
        let (candidates, along) = (&self.candidates, &self.along);
        let is_stable = SHARES.iter().any(|share| {
            let entry = |r: usize, c: usize| {
                let own = if r == c {
                    1.0 / (share * candidates[rows[r]].support)
                } else {
                    0.0
                };
                own - along[rows[r] + n * rows[c]]
            };
            factor_symmetric(m, entry, &mut self.factor)
                && (0..m).all(|r| self.factor[r * m + r] > LEAST_RELEASE * entry(r, r))
        });
        if !is_stable {
            return;
        }
        // Column r of the spread: displacements by a unit force along the normal of row r.
        for (r, &i) in rows.iter().enumerate() {
            for k in 0..size {
                self.spread[k + size * r] = if has_friction {
                    let normal = &self.candidates[i].normal;
                    (0..3)
                        .map(|c| self.compliance[k + size * (3 * i + c)] * normal[c])
                        .sum()
                } else {
                    self.compliance[k + size * i]
                };
            }
        }
        for j in 0..size {
            let mut x = [0.0; MOST_CANDIDATES];
            for (r, x) in x[..m].iter_mut().enumerate() {
                *x = self.spread[j + size * r];
            }
            substitute_symmetric(m, &self.factor, &mut x[..m]);
            for (r, x) in x[..m].iter().enumerate() {
                let spread = &self.spread[size * r..size * (r + 1)];
                let column = &mut self.released[size * j..size * (j + 1)];
                for (w, s) in column.iter_mut().zip(spread) {
                    *w += x * s;
                }
            }
        }
    }

    /// A block of the compliance without supports.
    fn full_block(&self, i: usize, j: usize) -> Mat3 {
        let n = self.candidates.len();
        if self.has_friction {
            let n = 3 * n;
            return Mat3::from_fn(|r, c| self.released[3 * i + r + n * (3 * j + c)]);
        }
        let along = self.released[i + n * j];
        self.candidates[i].normal * self.candidates[j].normal.transpose() * along
    }

    /// Merges neighbouring pressing candidates until there are at most `most`, and leaves out the
    /// farthest of the others.
    fn clusters(&self, skin: &[Vec3], most: usize, out: &mut [Cluster; MOST_CANDIDATES]) -> usize {
        let n = self.candidates.len();
        let mut partner = [usize::MAX; MOST_CANDIDATES];
        let pressing = |i: usize| self.candidates[i].pressure > 0.0;
        let n_idle = (0..n).filter(|&i| !pressing(i)).count();
        // Of the candidates that do not press, a few of the nearest are enough.
        let n_kept_idle = n_idle.min((most / 6).max(most.saturating_sub(n - n_idle)));
        let mut n_over = (n - n_idle + n_kept_idle).saturating_sub(most);
        while n_over > 0 {
            let mut best = (f64::INFINITY, 0, 0);
            for i in (0..n).filter(|&i| pressing(i) && partner[i] == usize::MAX) {
                for j in (i + 1..n).filter(|&j| pressing(j) && partner[j] == usize::MAX) {
                    let (a, b) = (&self.candidates[i], &self.candidates[j]);
                    // Distances at rest, so that the same candidates are merged in every step.
                    let points = [a, b].map(|c| skin[c.vertex as usize]);
                    let distance = (points[0] - points[1]).norm_squared();
                    if a.tool == b.tool && distance < best.0 {
                        best = (distance, i, j);
                    }
                }
            }
            if best.0 == f64::INFINITY {
                break;
            }
            (partner[best.1], partner[best.2]) = (best.2, best.1);
            n_over -= 1;
        }
        let mut idle = [0; MOST_CANDIDATES];
        let mut count = 0;
        for i in (0..n).filter(|&i| !pressing(i)) {
            idle[count] = i;
            count += 1;
        }
        let gap = |i: &usize| self.candidates[*i].gap;
        idle[..count].sort_unstable_by(|a, b| gap(a).total_cmp(&gap(b)).then(a.cmp(b)));
        let mut kept = [false; MOST_CANDIDATES];
        for &i in &idle[..n_kept_idle] {
            kept[i] = true;
        }
        let mut filled = 0;
        for i in 0..n {
            let other = partner[i];
            if filled == most || other < i || (!pressing(i) && !kept[i]) {
                continue;
            }
            let alone = Cluster {
                members: [i, i],
                shares: [1.0, 0.0],
            };
            out[filled] = if other == usize::MAX {
                alone
            } else {
                let (p, q) = (self.candidates[i].pressure, self.candidates[other].pressure);
                let share = p / (p + q);
                if share >= 0.5 {
                    Cluster {
                        members: [i, other],
                        shares: [share, 1.0 - share],
                    }
                } else {
                    Cluster {
                        members: [other, i],
                        shares: [1.0 - share, share],
                    }
                }
            };
            filled += 1;
        }
        filled
    }

    /// Stiffness of the pressing vertices against a displacement of their tool, along their
    /// normals, N/m.
    fn tool_stiffness(&mut self, tool: usize) -> Mat3 {
        let mut rows = [0; MOST_CANDIDATES];
        let mut m = 0;
        for (i, candidate) in self.candidates.iter().enumerate() {
            if candidate.pressure > 0.0 {
                rows[m] = i;
                m += 1;
            }
        }
        let n = self.candidates.len();
        let along = &self.along;
        let entry = |r: usize, c: usize| along[rows[r] + n * rows[c]];
        if m == 0 || !factor_symmetric(m, entry, &mut self.factor) {
            return Mat3::zeros();
        }
        let mut stiffness = Mat3::zeros();
        for axis in 0..3 {
            let mut x = [0.0; MOST_CANDIDATES];
            for (x, &i) in x.iter_mut().zip(&rows[..m]) {
                if self.candidates[i].tool as usize == tool {
                    *x = self.candidates[i].normal[axis];
                }
            }
            substitute_symmetric(m, &self.factor, &mut x[..m]);
            for (x, &i) in x.iter().zip(&rows[..m]) {
                let candidate = &self.candidates[i];
                if candidate.tool as usize == tool {
                    let taken = x - candidate.support * candidate.normal[axis];
                    let column = stiffness.column(axis) + candidate.normal * taken;
                    stiffness.set_column(axis, &column);
                }
            }
        }
        stiffness
    }
}

/// A number for a merged pair of vertices, different from all vertex numbers.
fn number_of_pair(a: u32, b: u32) -> u32 {
    let (a, b) = (a.min(b), a.max(b));
    a.wrapping_mul(0x9e37_79b1).wrapping_add(b) | 1 << 31
}

/// Position of a candidate at the end of the iteration.
fn place(candidate: &Candidate) -> Vec3 {
    candidate.start + candidate.displacement
}
