//! The local model of a body under its tools. The haptic loop uses it between two steps.
//!
//! ```text
//! x_i = x0_i + Σ_j W_ij (r_j − r0_j)
//! ```

use std::f64::consts::TAU;

use nalgebra::Rotation3;
use palpa_mesh::Vec3;

use super::MOST_CANDIDATES;
use super::candidate::Candidate;
use super::contact_problem::ContactProblem;
use super::dense;
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
    /// Whether the compliance is free of springs that exist only in the step's matrix. Where the body is not stable
    /// without them, it is not, and is not the body's.
    pub is_own: bool,
    /// Where each contact was in an earlier model, and the turn of its normal since; see
    /// [`Self::give_way_as`].
    known: Vec<Option<(usize, Mat3)>>,
}

impl LocalModel {
    /// An empty model with room for so many contacts and tools: to fill it, nothing is allocated.
    pub fn with_room(n_contacts: usize, n_tools: usize) -> Self {
        Self {
            contacts: Vec::with_capacity(n_contacts),
            tools: Vec::with_capacity(n_tools),
            compliance: Vec::with_capacity(9 * n_contacts * n_contacts),
            is_own: true,
            known: Vec::with_capacity(n_contacts),
        }
    }

    /// Takes over the compliance of an earlier model of the same mesh, turned with the normals, where its own is
    /// not the body's ([`Self::is_own`], [`super::LiveReport::is_altered`]). Contacts that were not in the earlier one
    /// keep their own, and do not act on the others.
    pub fn give_way_as(&mut self, before: &Self) {
        let normal = |model: &Self, contact: &LocalContact| {
            let tool = model.tools.get(contact.tool);
            tool.map_or(contact.normal, |tool| tool.pose.rotation * contact.normal)
        };
        let mut known = std::mem::take(&mut self.known);
        known.clear();
        known.extend(self.contacts.iter().map(|contact| {
            let is_same =
                |old: &LocalContact| old.vertex == contact.vertex && old.tool == contact.tool;
            let at = before.contacts.iter().position(is_same)?;
            let [old, new] = [normal(before, &before.contacts[at]), normal(self, contact)];
            let turn = Rotation3::rotation_between(&old, &new)?;
            Some((at, turn.into_inner()))
        }));
        let n = self.contacts.len();
        for (i, row) in known.iter().enumerate() {
            for (j, column) in known.iter().enumerate() {
                let block = match (row, column) {
                    (Some((a, turn)), Some((b, other))) => {
                        turn * before.block(*a, *b) * other.transpose()
                    }
                    (None, None) => continue,
                    _ => Mat3::zeros(),
                };
                set_block(&mut self.compliance, n, (i, j), &block);
            }
        }
        for (tool, old) in self.tools.iter_mut().zip(&before.tools) {
            tool.stiffness = old.stiffness;
        }
        self.known = known;
    }

    /// Compliance block: displacement of contact `i` per force on contact `j`, m/N.
    pub fn block(&self, i: usize, j: usize) -> Mat3 {
        block_of(&self.compliance, self.contacts.len(), (i, j))
    }
}

/// If removing the supports leaves a pivot below this share of its own diagonal entry, the body
/// counts as unstable.
const LEAST_RELEASE: f64 = 0.05;
/// Share of a vertex's area that presses in the local model in addition to what does: the points that
/// press alone need not determine the forces on their vertices.
const ALSO_CLOSED: f64 = 0.02;
/// Where, between the least and the mean gap of its points, a vertex begins to bear in the local model.
/// Pressed at 50 mm/s on triangles of 3 mm, a ball of 10 mm feels 8 % too much at 2 mm with 0, 0.1 %
/// too little with this, and 2 % too little with 0.5 or 1.
const BEGIN: f64 = 0.25;
/// A tool touches as much of a vertex that does not press yet as a sphere does at this depth, m. A ball of 16 mm on
/// triangles of 10 mm felt 2.7 times too much half a millimetre to a millimetre deep, as if it pressed half of each;
/// on triangles of 4 mm, 1.4 times. With this it feels 0.97 and 1.1 times as much as the tissue gives.
const FIRST_DEPTH: f64 = 0.15e-3;
/// A contact bears along its force where that is nearly along the normals of its vertices (cosine), else along
/// these, as the compliance is along them: a vertex that hardly presses any more may have forces of its points left
/// that point anywhere.
const LEAST_ALONG: f64 = 0.9;
/// Growth of the cells in which neighbours are merged, from one attempt to the next, and the largest
/// number of attempts.
const CELL_GROWTH: f64 = 1.25;
const MOST_CELLS: usize = 40;

/// Candidates that are one contact of the local model.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Cluster {
    /// Range of its members in [`Clusters::members`].
    first: usize,
    end: usize,
    /// Number in every step.
    number: u32,
}

/// The gaps of the points of a vertex: the least, m, and the sum by area, m³.
#[derive(Debug, Clone, Copy)]
struct Onset {
    least: f64,
    sum: f64,
    area: f64,
}

impl Onset {
    const NONE: Self = Self {
        least: f64::INFINITY,
        sum: 0.0,
        area: 0.0,
    };
}

/// The clusters, and the memory to find them.
#[derive(Debug, Default)]
pub(super) struct Clusters {
    all: Vec<Cluster>,
    /// Candidates, cluster by cluster, and their shares of the cluster's force.
    members: Vec<u16>,
    shares: Vec<f64>,
    /// Cell and candidate.
    cells: Vec<([i32; 3], u16)>,
    onsets: Vec<Onset>,
    /// A row of sums of the compliance.
    sums: Vec<Mat3>,
    /// Mean normal of each cluster's members.
    normals: Vec<Vec3>,
    /// Pressing members, as indices into `members`; and the row of each candidate among them.
    rows: Vec<usize>,
    row_of: Vec<usize>,
    /// Stiffness of the law under each row with all its area pressing, N/m, and a solution.
    closed: Vec<f64>,
    solution: Vec<f64>,
}

impl Clusters {
    pub(super) fn new() -> Self {
        Self {
            all: Vec::with_capacity(MOST_CANDIDATES),
            members: Vec::with_capacity(MOST_CANDIDATES),
            shares: Vec::with_capacity(MOST_CANDIDATES),
            cells: Vec::with_capacity(MOST_CANDIDATES),
            onsets: Vec::with_capacity(MOST_CANDIDATES),
            sums: Vec::with_capacity(MOST_CANDIDATES),
            normals: Vec::with_capacity(MOST_CANDIDATES),
            rows: Vec::with_capacity(MOST_CANDIDATES),
            row_of: Vec::with_capacity(MOST_CANDIDATES),
            closed: Vec::with_capacity(MOST_CANDIDATES),
            solution: Vec::with_capacity(MOST_CANDIDATES),
        }
    }
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
        let mut clusters = std::mem::take(&mut self.clusters);
        self.measure_onsets(&mut clusters.onsets);
        self.gather(skin, most, &mut clusters);
        out.is_own = self.release();
        self.measure_normals(&mut clusters);
        out.contacts.clear();
        for (cluster, normal) in clusters.all.iter().zip(&clusters.normals) {
            let members = &clusters.members[cluster.first..cluster.end];
            let shares = &clusters.shares[cluster.first..cluster.end];
            out.contacts
                .push(self.contact(tools, members, shares, (cluster.number, normal)));
        }
        self.comply(&mut clusters, &mut out.compliance);
        self.give_way(&mut clusters, &out.contacts, &mut out.compliance);
        let is_factored = self.factor_newton();
        self.describe_tools(tools, is_factored, &mut out.tools);
        self.clusters = clusters;
    }

    /// A local model without contacts, with the forces alone.
    pub(super) fn no_local_model(&mut self, tools: &[PosedTool], out: &mut LocalModel) {
        out.contacts.clear();
        out.compliance.clear();
        out.is_own = true;
        self.describe_tools(tools, false, &mut out.tools);
    }

    /// The tools with their forces, and with their stiffness if [`Self::factor_newton`] has found it.
    fn describe_tools(&mut self, tools: &[PosedTool], is_factored: bool, out: &mut Vec<LocalTool>) {
        out.clear();
        for (t, tool) in tools.iter().enumerate() {
            let own = self.candidates.iter().filter(|c| c.tool as usize == t);
            let force = -own.map(Candidate::force).sum::<Vec3>();
            let stiffness = if is_factored {
                self.tool_stiffness(t)
            } else {
                Mat3::zeros()
            };
            out.push(LocalTool {
                pose: tool.pose,
                friction: tool.tool.friction(),
                force,
                stiffness,
            });
        }
    }

    /// Finds how far tools are from those candidates that do not press.
    ///
    /// A vertex begins to bear when the first point of its triangles does, softly, and bears fully when
    /// the points do on average. The local model has a straight line between ([`BEGIN`]).
    fn measure_onsets(&mut self, onsets: &mut Vec<Onset>) {
        onsets.clear();
        onsets.resize(self.candidates.len(), Onset::NONE);
        for point in &self.points {
            let spot = &point.spot;
            let corners = point.corners.map(usize::from);
            let (pressure, moved) = self.at_point(point);
            let gap = spot.gap + spot.normal.dot(&moved) - pressure / spot.stiffness;
            for (&i, share) in corners.iter().zip(&spot.shares) {
                let onset = &mut onsets[i];
                onset.least = onset.least.min(gap);
                onset.sum += gap * share * spot.area;
                onset.area += share * spot.area;
            }
        }
        for (candidate, onset) in self.candidates.iter_mut().zip(onsets) {
            let mean = onset.sum / onset.area;
            candidate.gap = onset.least + BEGIN * (mean - onset.least);
        }
    }

    /// Finds the mean normal of each cluster's members.
    fn measure_normals(&self, clusters: &mut Clusters) {
        let Clusters {
            all,
            members,
            shares,
            normals,
            ..
        } = clusters;
        normals.clear();
        for cluster in all.iter() {
            let range = cluster.first..cluster.end;
            let parts = members[range.clone()].iter().zip(&shares[range]);
            let mean: Vec3 = parts
                .map(|(&m, share)| self.candidates[usize::from(m)].normal * *share)
                .sum();
            normals.push(mean.try_normalize(0.0).unwrap_or_else(Vec3::zeros));
        }
    }

    /// One contact of the local model, with its number and the mean normal of its members.
    fn contact(
        &self,
        tools: &[PosedTool],
        members: &[u16],
        shares: &[f64],
        (number, normal): (u32, &Vec3),
    ) -> LocalContact {
        let parts = || {
            let members = members.iter().map(|&m| &self.candidates[usize::from(m)]);
            members.zip(shares)
        };
        let tool = parts().next().map_or(0, |(c, _)| c.tool as usize);
        let position: Vec3 = parts().map(|(c, share)| place(c) * *share).sum();
        let anchor: Vec3 = parts().map(|(c, share)| c.anchor * *share).sum();
        let push: Vec3 = parts().map(|(c, _)| c.push()).sum();
        let normal = direction(&push, normal);
        let gap: f64 = parts().map(|(c, share)| c.gap.max(0.0) * share).sum();
        let is_pressing = parts().any(|(c, _)| c.pressure > 0.0);
        let PosedTool { tool: shape, pose } = &tools[tool];
        let local = pose.inverse_transform_point(&position.into()).coords;
        let normal = pose.rotation.inverse_transform_vector(&normal);
        // Where it presses, its points do on average, wherever the vertex itself is.
        let gap = if is_pressing { 0.0 } else { gap };
        LocalContact {
            vertex: number,
            tool,
            position,
            force: parts().map(|(c, _)| c.force()).sum(),
            surface: local - normal * gap,
            normal,
            curvature: shape.shape().distance(&local).curvature,
            anchor,
        }
    }

    /// The compliance between clusters.
    fn comply(&self, clusters: &mut Clusters, compliance: &mut Vec<f64>) {
        let n = clusters.all.len();
        compliance.clear();
        compliance.resize(9 * n * n, 0.0);
        let Clusters {
            all,
            members,
            shares,
            sums,
            ..
        } = clusters;
        for (j, cj) in all.iter().enumerate() {
            sums.clear();
            sums.resize(self.candidates.len(), Mat3::zeros());
            for (&b, &share) in members[cj.first..cj.end]
                .iter()
                .zip(&shares[cj.first..cj.end])
            {
                for &a in members.iter() {
                    let (a, b) = (usize::from(a), usize::from(b));
                    sums[a] += self.full_block(a, b) * share;
                }
            }
            for (i, ci) in all.iter().enumerate() {
                let mut block = Mat3::zeros();
                let range = ci.first..ci.end;
                for (&a, &share) in members[range.clone()].iter().zip(&shares[range]) {
                    block += sums[usize::from(a)] * share;
                }
                add_block(compliance, n, (i, j), &block);
            }
        }
    }

    /// Adds how the law gives way under the clusters, in addition to the tissue.
    ///
    /// With the points that press, `F_i = Σ φ_i (Σ φ_j F_j/A_j − ε g)` by area. So displacements of the
    /// vertices towards the tool change their forces by `(1 − M/A)⁻¹ ε M`, where `M` is the mass matrix
    /// of the part of the triangles that presses, and the law's compliance is `(M⁻¹ − A⁻¹)/ε`: nothing
    /// against a pressure that does not vary, and as much as the tissue at the border of the contact
    /// and for waves as short as a triangle. A vertex that does not press yet is taken to give way as
    /// if half of its area pressed, or as much of it as the tool touches at first ([`FIRST_DEPTH`]) where
    /// that is less.
    fn give_way(
        &mut self,
        clusters: &mut Clusters,
        contacts: &[LocalContact],
        compliance: &mut [f64],
    ) {
        let Clusters {
            all,
            members,
            shares,
            normals,
            rows,
            row_of,
            closed,
            solution,
            ..
        } = clusters;
        let n = all.len();
        rows.clear();
        row_of.clear();
        row_of.resize(self.candidates.len(), usize::MAX);
        for (at, &member) in members.iter().enumerate() {
            let member = usize::from(member);
            if self.candidates[member].pressure > 0.0 {
                row_of[member] = rows.len();
                rows.push(at);
            }
        }
        let m = rows.len();
        let stiffness = &mut self.spread[..m * m];
        stiffness.fill(0.0);
        closed.clear();
        closed.resize(m, 0.0);
        for &(row, column, spring, _) in &self.scratch.stiffness {
            let (r, c) = (row_of[usize::from(row)], row_of[usize::from(column)]);
            if r < m && c < m {
                stiffness[r * m + c] += spring;
                closed[r] += spring;
            }
        }
        for (r, &at) in rows.iter().enumerate() {
            closed[r] = closed[r].max(self.candidates[usize::from(members[at])].yielding);
            stiffness[r * m + r] += ALSO_CLOSED * closed[r];
        }
        let entry = |r: usize, c: usize| stiffness[r * m + c];
        solution.clear();
        solution.resize(m, 0.0);
        if !dense::factor_symmetric(m, entry, &mut self.factor, solution) {
            return;
        }
        let along = |at: usize, normal: &Vec3| {
            let candidate = &self.candidates[usize::from(members[at])];
            shares[at] * candidate.normal.dot(normal)
        };
        for (j, cj) in all.iter().enumerate() {
            let first = usize::from(members[cj.first]);
            if row_of[first] == usize::MAX {
                let candidate = &self.candidates[first];
                // 2 π R of a sphere of radius R.
                let touched = FIRST_DEPTH * 2.0 * TAU / contacts[j].curvature.trace();
                let yielding = candidate.yielding / (1.0 + candidate.area / touched);
                let own = normals[j] * normals[j].transpose() / yielding;
                add_block(compliance, n, (j, j), &own);
                continue;
            }
            solution.clear();
            solution.resize(m, 0.0);
            for at in cj.first..cj.end {
                solution[row_of[usize::from(members[at])]] = along(at, &normals[j]);
            }
            dense::solve_symmetric(m, &self.factor, solution);
            for at in cj.first..cj.end {
                let row = row_of[usize::from(members[at])];
                solution[row] -= along(at, &normals[j]) / closed[row];
            }
            for (i, ci) in all.iter().enumerate() {
                let by: f64 = (ci.first..ci.end)
                    .filter(|&at| row_of[usize::from(members[at])] < m)
                    .map(|at| solution[row_of[usize::from(members[at])]] * along(at, &normals[i]))
                    .sum();
                let block = normals[i] * normals[j].transpose() * by;
                add_block(compliance, n, (i, j), &block);
            }
        }
    }

    /// Removes the supports, which exist only in the step's matrix, from the compliance. With the
    /// normals of the supported vertices in `N`,
    ///
    /// ```text
    /// W + W N (1/κ − Nᵀ W N)⁻¹ Nᵀ W
    /// ```
    /// If the free body is not stable, this is not a valid compliance. Then only as much of the
    /// supports is removed as leaves it stable. Returns whether they are removed.
    fn release(&mut self) -> bool {
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
        let candidates = &self.candidates;
        let (mut factor, mut row) = (std::mem::take(&mut self.factor), [0.0; MOST_CANDIDATES]);
        let released = SHARES.iter().find(|&share| {
            let entry = |r: usize, c: usize| {
                let own = if r == c {
                    1.0 / (share * candidates[rows[r]].support)
                } else {
                    0.0
                };
                own - self.along_with_springs(rows[r], rows[c])
            };
            dense::factor_symmetric(m, entry, &mut factor, &mut row)
                && (0..m).all(|r| factor[r * m + r] > LEAST_RELEASE * entry(r, r))
        });
        self.factor = factor;
        let Some(released) = released else {
            return false;
        };
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
            dense::solve_symmetric(m, &self.factor, &mut x[..m]);
            for (r, x) in x[..m].iter().enumerate() {
                let spread = &self.spread[size * r..size * (r + 1)];
                let column = &mut self.released[size * j..size * (j + 1)];
                for (w, s) in column.iter_mut().zip(spread) {
                    *w += x * s;
                }
            }
        }
        *released >= 1.0
    }

    /// Compliance along the normals in the step's matrix.
    fn along_with_springs(&self, i: usize, j: usize) -> f64 {
        if self.has_friction {
            let (a, b) = (&self.candidates[i].normal, &self.candidates[j].normal);
            return a.dot(&(self.block(i, j) * b));
        }
        self.compliance[i + self.candidates.len() * j]
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

    /// Merges neighbouring pressing candidates until there are at most `most` contacts, and leaves
    /// out the farthest of the others. Cells of the skin at rest decide which are merged, so that
    /// they are the same in every step.
    fn gather(&self, skin: &[Vec3], most: usize, out: &mut Clusters) {
        let n = self.candidates.len();
        let pressing = |i: usize| self.candidates[i].pressure > 0.0;
        let n_pressing = (0..n).filter(|&i| pressing(i)).count();
        let n_idle = n - n_pressing;
        // Of the candidates that do not press, a few of the nearest are enough.
        let n_kept_idle = n_idle.min((most / 6).max(most.saturating_sub(n_pressing)));
        let (all, members, shares) = (&mut out.all, &mut out.members, &mut out.shares);
        all.clear();
        members.clear();
        shares.clear();
        let mut add = |group: &[([i32; 3], u16)], number: u32| {
            let first = members.len();
            let sum: f64 = group
                .iter()
                .map(|g| self.candidates[usize::from(g.1)].pressure)
                .sum();
            for &(_, i) in group {
                members.push(i);
                let own = self.candidates[usize::from(i)].pressure;
                shares.push(if sum > 0.0 { own / sum } else { 1.0 });
            }
            let end = members.len();
            all.push(Cluster { first, end, number });
        };
        let room = most - n_kept_idle;
        let mut size = self.least_cell();
        let mut level = 0;
        loop {
            out.cells.clear();
            for i in (0..n).filter(|&i| pressing(i)) {
                let candidate = &self.candidates[i];
                let cell = if n_pressing <= room {
                    [candidate.vertex.cast_signed(), 0, 0]
                } else {
                    let at = skin[candidate.vertex as usize] / size;
                    // Tools do not share a cluster.
                    let by_tool = candidate.tool.cast_signed() * 0x0100_0000;
                    [
                        at.x.floor() as i32 + by_tool,
                        at.y.floor() as i32,
                        at.z.floor() as i32,
                    ]
                };
                out.cells.push((cell, i as u16));
            }
            out.cells.sort_unstable();
            let n_cells = out.cells.chunk_by(|a, b| a.0 == b.0).count();
            if n_cells <= room || level == MOST_CELLS {
                break;
            }
            size *= CELL_GROWTH;
            level += 1;
        }
        for group in out.cells.chunk_by(|a, b| a.0 == b.0).take(room) {
            let vertex = self.candidates[usize::from(group[0].1)].vertex;
            let number = if group.len() == 1 {
                vertex
            } else {
                number_of_cell(group[0].0, level)
            };
            add(group, number);
        }
        out.cells.clear();
        out.cells
            .extend((0..n).filter(|&i| !pressing(i)).map(|i| ([0; 3], i as u16)));
        let gap = |i: &([i32; 3], u16)| self.candidates[usize::from(i.1)].gap;
        out.cells
            .sort_unstable_by(|a, b| gap(a).total_cmp(&gap(b)).then(a.1.cmp(&b.1)));
        for idle in out.cells.iter().take(n_kept_idle) {
            let vertex = self.candidates[usize::from(idle.1)].vertex;
            add(&[*idle], vertex);
        }
    }

    /// Edge of the first cells, m: of the size of the area of a candidate.
    fn least_cell(&self) -> f64 {
        let areas = self.pressing().map(|c| c.area);
        let least = areas.fold(f64::INFINITY, f64::min);
        if least.is_finite() {
            least.sqrt()
        } else {
            1e-3
        }
    }
}

/// Direction in which a contact bears, from its force and the mean normal of its vertices.
fn direction(push: &Vec3, normal: &Vec3) -> Vec3 {
    push.try_normalize(0.0)
        .filter(|along| along.dot(normal) > LEAST_ALONG)
        .unwrap_or(*normal)
}

/// A block of a compliance of `n` contacts.
fn block_of(compliance: &[f64], n: usize, (i, j): (usize, usize)) -> Mat3 {
    Mat3::from_fn(|r, c| compliance[3 * i + r + 3 * n * (3 * j + c)])
}

/// Adds to a block of a compliance of `n` contacts.
fn add_block(compliance: &mut [f64], n: usize, (i, j): (usize, usize), block: &Mat3) {
    for c in 0..3 {
        for r in 0..3 {
            compliance[3 * i + r + 3 * n * (3 * j + c)] += block[(r, c)];
        }
    }
}

/// Sets a block of a compliance of `n` contacts.
fn set_block(compliance: &mut [f64], n: usize, (i, j): (usize, usize), block: &Mat3) {
    for c in 0..3 {
        for r in 0..3 {
            compliance[3 * i + r + 3 * n * (3 * j + c)] = block[(r, c)];
        }
    }
}

/// A number for the vertices of a cell, different from all vertex numbers.
fn number_of_cell(cell: [i32; 3], level: usize) -> u32 {
    let mut number = level as u32;
    for at in cell {
        number = number
            .wrapping_mul(0x9e37_79b1)
            .wrapping_add(at.cast_unsigned());
        number ^= number >> 15;
    }
    number | 1 << 31
}

/// Position of a candidate at the end of the iteration.
fn place(candidate: &Candidate) -> Vec3 {
    candidate.start + candidate.displacement
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Both are from a stroke over the forearm with a lump, where the loop would otherwise have felt 1,000 N for
    /// a tick: the contact gives way along its normal only, and its force was at right angles to that.
    #[test]
    fn a_contact_that_hardly_presses_bears_along_its_normal() {
        let normal = Vec3::new(-0.748, -0.059, -0.661).normalize();
        let left = Vec3::new(-1.456e-11, 0.532e-11, 1.602e-11);
        assert_eq!(direction(&left, &normal), normal);
        assert_eq!(direction(&Vec3::zeros(), &normal), normal);
        let push = Vec3::new(-0.7, 0.0, -0.7);
        assert!((direction(&push, &normal) - push.normalize()).norm() < 1e-12);
    }

    fn contact(vertex: u32, normal: Vec3) -> LocalContact {
        LocalContact {
            vertex,
            tool: 0,
            position: Vec3::zeros(),
            force: Vec3::zeros(),
            surface: Vec3::zeros(),
            normal,
            curvature: Mat3::zeros(),
            anchor: Vec3::zeros(),
        }
    }

    /// A model in which contact `i` gives way to itself by `own`, and to the others by half of that.
    fn model(contacts: Vec<LocalContact>, own: f64) -> LocalModel {
        let n = contacts.len();
        let mut model = LocalModel {
            contacts,
            compliance: vec![0.0; 9 * n * n],
            ..LocalModel::default()
        };
        for i in 0..n {
            for j in 0..n {
                let by = if i == j { own } else { 0.5 * own };
                let [a, b] = [i, j].map(|k| model.contacts[k].normal);
                let block = a * b.transpose() * by;
                set_block(&mut model.compliance, n, (i, j), &block);
            }
        }
        model
    }

    #[test]
    fn a_compliance_is_taken_over_by_vertex_and_turned_with_the_normals() {
        let (out, aside) = (Vec3::z(), Vec3::new(0.6, 0.0, 0.8));
        let before = model(
            vec![contact(7, out), contact(3, out), contact(5, out)],
            1e-3,
        );
        // 9 is new, 5 has turned, and 7 has left.
        let mut now = model(
            vec![contact(3, out), contact(9, out), contact(5, aside)],
            1e-5,
        );
        now.give_way_as(&before);
        let expected = [
            [
                out * out.transpose() * 1e-3,
                Mat3::zeros(),
                out * aside.transpose() * 0.5e-3,
            ],
            [Mat3::zeros(), out * out.transpose() * 1e-5, Mat3::zeros()],
            [
                aside * out.transpose() * 0.5e-3,
                Mat3::zeros(),
                aside * aside.transpose() * 1e-3,
            ],
        ];
        for (i, row) in expected.iter().enumerate() {
            for (j, block) in row.iter().enumerate() {
                let difference = (now.block(i, j) - block).norm();
                assert!(difference < 1e-15, "{i} {j}: {difference}");
            }
        }
    }
}
