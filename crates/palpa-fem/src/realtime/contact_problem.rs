//! The small contact problem of a moving step: forces on a few skin vertices (the *candidates*),
//! given their compliance.
//!
//! The law is that of [`crate::contact`], which statics and the haptic loop have as well:
//!
//! | who | where | unknowns | friction |
//! | --- | --- | --- | --- |
//! | statics, each Newton iteration | [`crate::statics`], `contacts.rs` | displacements of all nodes, pressure and friction of the vertices near the tools | with everything else, in one system |
//! | moving step, each iteration at some 500 Hz | here | pressing forces on the candidates, on their compliance | in turns with the pressing forces, by sweeps |
//! | servo, each tick at 1 kHz | `palpa-servo`, `solver.rs` and `contact.rs` | forces on at most 60 vertices or clusters of the patch, each on its own compliance in series with the law's, and the coupling's displacement | each tick, on the round cone, one vertex after the other |
//!
//! ```text
//! s = s0 + w (f − p0),   p = f − κ s,   p_i = ∫ φ_i max(0, Σ φ_j p_j/A_j − ε g(s))
//! ```
//! along the normals. `s` is the displacement of a vertex, m, `p` its pressing force, N, `g` the gap
//! at a point, m, and `f` the force in the linear system, N. Where `κ > 0`, a spring holds the vertex
//! in the linear system: deep under a tool the free body is not stable, and only the tool holds it.
//! The compliance `w`, m/N, includes the spring; `p` excludes the spring's force. Newton's method
//! finds the forces; with friction, `|t| ≤ μ p`, and where `t` reaches that limit it opposes the slip
//! from the anchor. Sweeps find it for given pressing forces, in turns with these.

use palpa_mesh::Vec3;

use super::MOST_CANDIDATES;
use super::candidate::{Candidate, Point};
use super::dense;
use super::local::Clusters;
use crate::Mat3;
use crate::contact::first_touch;
use crate::posed_tool::PosedTool;

/// Largest number of Newton iterations, and of halvings in one.
const MOST_ITERATIONS: usize = 30;
const MOST_HALVINGS: usize = 6;
/// Largest number of turns with friction, and of sweeps in each.
const MOST_TURNS: usize = 20;
const SWEEPS: usize = 60;
/// Relative error of the pressing forces, and relative change of the forces in a sweep and in a turn,
/// at which they count as settled.
const SETTLED: f64 = 1e-7;
const SETTLED_SWEEP: f64 = 1e-6;
const SETTLED_TURN: f64 = 1e-5;
/// Errors of the forces above this share count as unsettled.
const UNSETTLED: f64 = 1e-3;

/// The problem, in memory for [`MOST_CANDIDATES`].
#[derive(Debug)]
pub(super) struct ContactProblem {
    /// Sorted by vertex.
    pub(super) candidates: Vec<Candidate>,
    /// Points of the skin near the tools.
    pub(super) points: Vec<Point>,
    /// Tools at the start of the step.
    pub(super) tools_before: Vec<PosedTool>,
    /// Whether any tool has friction: a candidate then has three unknowns, otherwise one.
    pub(super) has_friction: bool,
    /// Whether the last solution satisfies the law of contact.
    pub(super) is_settled: bool,
    /// Compliance, column by column, m/N: `n × n` along the normals, or `3 n × 3 n` along the axes
    /// with friction.
    pub(super) compliance: Vec<f64>,
    /// Change of the force in the linear system, `f − p0`: along the normals, or along the axes
    /// with friction, N.
    pub(super) change: Vec<f64>,
    /// Compliance along the normals without the springs, m/N; column by column.
    pub(super) along: Vec<f64>,
    /// Compliance with the springs removed as far as possible, and scratch memory for it.
    pub(super) released: Vec<f64>,
    pub(super) spread: Vec<f64>,
    pub(super) factor: Vec<f64>,
    pub(super) clusters: Clusters,
    pub(super) scratch: Scratch,
}

#[derive(Debug)]
pub(super) struct Scratch {
    order: Vec<usize>,
    order_of_newton: Vec<usize>,
    /// Row of each candidate in the system, or `usize::MAX`; and the candidates of the rows.
    row_of: Vec<usize>,
    rows: Vec<usize>,
    /// Displacements along the normals without changes of the forces, m.
    rest: Vec<f64>,
    slides: Vec<f64>,
    /// Forces at the start, in the present iteration, and in a trial, N.
    start: Vec<f64>,
    forces: Vec<f64>,
    trial: Vec<f64>,
    laws: Vec<f64>,
    /// Whether any point of the triangles of a candidate presses, by the law.
    is_closed: Vec<bool>,
    right: Vec<f64>,
    solution: Vec<f64>,
    friction_before: Vec<Vec3>,
    moved: Vec<Vec3>,
    /// Entries of the law's stiffness: row, column, N/m per m, and per area.
    pub(super) stiffness: Vec<(u16, u16, f64, f64)>,
}

impl ContactProblem {
    pub(super) fn new() -> Self {
        let n = MOST_CANDIDATES;
        Self {
            candidates: Vec::with_capacity(n),
            points: Vec::with_capacity(super::MOST_POINTS),
            tools_before: Vec::with_capacity(8),
            has_friction: false,
            is_settled: true,
            compliance: vec![0.0; 9 * n * n],
            change: vec![0.0; 3 * n],
            along: vec![0.0; n * n],
            released: vec![0.0; 9 * n * n],
            spread: vec![0.0; 3 * n * n],
            factor: vec![0.0; n * n],
            clusters: Clusters::new(),
            scratch: Scratch {
                order: vec![0; n],
                order_of_newton: vec![0; n],
                row_of: vec![usize::MAX; n],
                rows: Vec::with_capacity(n),
                rest: vec![0.0; n],
                slides: vec![0.0; n],
                start: vec![0.0; n],
                forces: vec![0.0; n],
                trial: vec![0.0; n],
                laws: vec![0.0; n],
                is_closed: vec![false; n],
                right: vec![0.0; n],
                solution: vec![0.0; n],
                friction_before: vec![Vec3::zeros(); n],
                moved: vec![Vec3::zeros(); n],
                stiffness: Vec::with_capacity(9 * super::MOST_POINTS),
            },
        }
    }

    /// Forgets candidates and points, and the law's stiffness, which refers to them.
    pub(super) fn clear(&mut self) {
        self.candidates.clear();
        self.points.clear();
        self.scratch.stiffness.clear();
        self.scratch.is_closed.fill(false);
    }

    /// The candidates with a pressing force.
    pub(super) fn pressing(&self) -> impl Iterator<Item = &Candidate> + Clone {
        self.candidates.iter().filter(|c| c.pressure > 0.0)
    }

    /// The block of the compliance between two candidates, with friction.
    pub(super) fn block(&self, i: usize, j: usize) -> Mat3 {
        let n = 3 * self.candidates.len();
        Mat3::from_fn(|r, c| self.compliance[3 * i + r + n * (3 * j + c)])
    }

    /// Finds forces and displacements. Cost: proportional to n³ for n vertices of pressing triangles;
    /// with friction, also n² for n candidates in each sweep.
    pub(super) fn solve(&mut self, tools: &[PosedTool]) {
        let (n, has_friction) = (self.candidates.len(), self.has_friction);
        self.change.fill(0.0);
        for i in 0..n {
            let candidate = &self.candidates[i];
            self.scratch.start[i] = candidate.pressure;
            self.scratch.forces[i] = candidate.pressure;
            self.scratch.rest[i] = candidate.displacement.dot(&candidate.normal);
            self.scratch.friction_before[i] = candidate.friction;
            self.scratch.moved[i] = candidate.displacement;
        }
        for j in 0..n {
            for i in 0..n {
                self.along[i + n * j] = if has_friction {
                    let (a, b) = (&self.candidates[i].normal, &self.candidates[j].normal);
                    a.dot(&(self.block(i, j) * b))
                } else {
                    self.compliance[i + n * j]
                };
            }
        }
        if !self.remove_springs() {
            self.is_settled = false;
            return;
        }
        self.is_settled = self.press();
        if !has_friction {
            for i in 0..n {
                self.keep(i);
                self.change[i] = self.taken(i) - self.scratch.start[i];
            }
            self.turn_aside();
            return;
        }
        for turn in 0.. {
            let before: f64 = self.scratch.forces[..n].iter().sum();
            self.keep_all();
            let has_moved = self.rub(tools);
            self.springs_after_friction();
            let is_settled = self.press();
            let after = &self.scratch.forces[..n];
            let change: f64 = (after.iter().zip(&self.candidates))
                .map(|(new, candidate)| (new - candidate.pressure).abs())
                .sum();
            let share = change / before.max(f64::MIN_POSITIVE);
            if share <= SETTLED_TURN || (turn > 0 && !has_moved) || turn == MOST_TURNS {
                self.is_settled = is_settled && (before == 0.0 || share <= UNSETTLED);
                break;
            }
        }
        self.keep_all();
        self.turn_aside();
    }

    /// What the pressures at the points, as they are now, add across the normals of the candidates.
    pub(super) fn turn_aside(&mut self) {
        for candidate in &mut self.candidates {
            candidate.aside = Vec3::zeros();
        }
        for point in &self.points {
            let spot = &point.spot;
            let corners = point.corners.map(usize::from);
            let (pressure, moved) = self.at_point(point);
            let gap = spot.gap + spot.normal.dot(&moved);
            let force = (pressure - spot.stiffness * gap).max(0.0) * spot.area;
            if force == 0.0 {
                continue;
            }
            // The normal there after the displacement.
            let normal = (spot.normal + spot.curvature * moved).normalize();
            for (&i, share) in corners.iter().zip(&spot.shares) {
                let candidate = &mut self.candidates[i];
                let along = candidate.normal;
                candidate.aside += (normal - along * along.dot(&normal)) * (force * share);
            }
        }
    }

    /// The multiplier at a point, Pa, and its displacement in the iteration, m.
    pub(super) fn at_point(&self, point: &Point) -> (f64, Vec3) {
        let (mut pressure, mut moved) = (0.0, Vec3::zeros());
        for (&i, share) in point.corners.iter().zip(&point.spot.shares) {
            let candidate = &self.candidates[usize::from(i)];
            pressure += share * candidate.pressure / candidate.area;
            moved += candidate.displacement * *share;
        }
        (pressure, moved)
    }

    /// Removes the springs from the compliance along the normals, and from the displacements without
    /// changes of the forces: `(1 − w κ)⁻¹ w`. Returns false if that is not possible.
    fn remove_springs(&mut self) -> bool {
        let n = self.candidates.len();
        if self.candidates.iter().all(|c| c.support == 0.0) {
            return true;
        }
        for r in 0..n {
            for c in 0..n {
                let unit = f64::from(u8::from(r == c));
                self.factor[r * n + c] = unit - self.along[r + n * c] * self.candidates[c].support;
            }
        }
        let scratch = &mut self.scratch;
        if !dense::factor(n, &mut self.factor, &mut scratch.order) {
            return false;
        }
        for j in 0..n {
            dense::solve(
                n,
                &self.factor,
                &scratch.order,
                &mut self.along[n * j..n * (j + 1)],
            );
        }
        dense::solve(n, &self.factor, &scratch.order, &mut scratch.rest[..n]);
        true
    }

    /// Displacements along the normals before pressing forces change, with friction as it is now.
    fn springs_after_friction(&mut self) {
        let n = self.candidates.len();
        for i in 0..n {
            let normal = self.candidates[i].normal;
            let mut sum = self.scratch.moved[i].dot(&normal);
            for j in 0..n {
                let by = self.candidates[j].friction - self.scratch.friction_before[j];
                if by != Vec3::zeros() {
                    sum += normal.dot(&(self.block(i, j) * by));
                }
            }
            self.scratch.rest[i] = sum;
        }
        if self.candidates.iter().any(|c| c.support > 0.0) {
            let scratch = &mut self.scratch;
            dense::solve(n, &self.factor, &scratch.order, &mut scratch.rest[..n]);
        }
    }

    /// Force of a candidate in the linear system: pressing force, and that of its spring, N.
    fn taken(&self, i: usize) -> f64 {
        self.scratch.forces[i] + self.candidates[i].support * self.scratch.slides[i]
    }

    /// Takes over the pressing force of a candidate, and its displacement along the normal.
    fn keep(&mut self, i: usize) {
        let (force, slide) = (self.scratch.forces[i], self.scratch.slides[i]);
        let candidate = &mut self.candidates[i];
        candidate.pressure = force;
        let normal = candidate.normal;
        candidate.displacement += normal * (slide - normal.dot(&candidate.displacement));
    }

    /// With friction: takes over the pressing forces, the change of the forces in the linear system,
    /// and the displacements.
    fn keep_all(&mut self) {
        let n = self.candidates.len();
        for i in 0..n {
            let taken = self.taken(i) - self.scratch.start[i];
            let candidate = &mut self.candidates[i];
            candidate.pressure = self.scratch.forces[i];
            let rubbed = candidate.friction - self.scratch.friction_before[i];
            let change = candidate.normal * taken + rubbed;
            self.change[3 * i..3 * i + 3].copy_from_slice(change.as_slice());
        }
        for i in 0..n {
            let mut sum = self.scratch.moved[i];
            for j in 0..n {
                let change = Vec3::from_column_slice(&self.change[3 * j..3 * j + 3]);
                if change != Vec3::zeros() {
                    sum += self.block(i, j) * change;
                }
            }
            self.candidates[i].displacement = sum;
        }
    }

    /// Displacements along the normals under the forces in `trial`.
    fn slide(&mut self) {
        let n = self.candidates.len();
        let scratch = &mut self.scratch;
        scratch.slides[..n].copy_from_slice(&scratch.rest[..n]);
        for j in 0..n {
            let by = scratch.trial[j] - scratch.start[j];
            if by != 0.0 {
                let column = &self.along[n * j..n * (j + 1)];
                for (slide, w) in scratch.slides[..n].iter_mut().zip(column) {
                    *slide += w * by;
                }
            }
        }
    }

    /// The forces that the law gives for those in `trial`, at the displacements in `slides`; their
    /// error, N; and the stiffness of the law, if asked.
    fn law(&mut self, with_stiffness: bool) -> f64 {
        let n = self.candidates.len();
        let Scratch {
            trial,
            slides,
            laws,
            is_closed,
            stiffness,
            ..
        } = &mut self.scratch;
        laws[..n].fill(0.0);
        stiffness.clear();
        is_closed[..n].fill(false);
        for point in &self.points {
            let (mut pressure, mut gap) = (0.0, point.spot.gap);
            for k in 0..3 {
                let (i, share) = (usize::from(point.corners[k]), point.spot.shares[k]);
                pressure += share * trial[i] / self.candidates[i].area;
                gap += share * point.cosines[k] * slides[i];
            }
            pressure -= point.spot.stiffness * gap;
            if pressure <= 0.0 {
                continue;
            }
            for k in 0..3 {
                let i = usize::from(point.corners[k]);
                let weight = point.spot.shares[k] * point.spot.area;
                let weight = weight * point.cosines[k];
                laws[i] += weight * pressure;
                is_closed[i] = true;
                if with_stiffness {
                    for l in 0..3 {
                        let share = weight * point.spot.shares[l];
                        let spring = share * point.spot.stiffness * point.cosines[l];
                        stiffness.push((point.corners[k], point.corners[l], spring, share));
                    }
                }
            }
        }
        let errors = laws[..n].iter().zip(&trial[..n]);
        errors
            .map(|(law, force)| (law - force).powi(2))
            .sum::<f64>()
            .sqrt()
    }

    /// Finds the pressing forces by Newton's method. Returns whether they satisfy the law.
    fn press(&mut self) -> bool {
        let n = self.candidates.len();
        self.scratch.trial[..n].copy_from_slice(&self.scratch.forces[..n]);
        self.slide();
        let mut error = self.law(true);
        let size = |forces: &[f64]| forces.iter().map(|f| f * f).sum::<f64>().sqrt();
        for _ in 0..MOST_ITERATIONS {
            let scale = size(&self.scratch.trial[..n]).max(size(&self.scratch.laws[..n]));
            if error <= SETTLED * scale {
                self.scratch.forces[..n].copy_from_slice(&self.scratch.trial[..n]);
                return true;
            }
            self.scratch.forces[..n].copy_from_slice(&self.scratch.trial[..n]);
            if !self.newton_step() {
                return false;
            }
            let (mut share, before) = (1.0, error);
            for halving in 0..=MOST_HALVINGS {
                for i in 0..n {
                    self.scratch.trial[i] = self.scratch.forces[i] + share * self.scratch.right[i];
                }
                self.slide();
                error = self.law(true);
                if error < before || halving == MOST_HALVINGS {
                    break;
                }
                share *= 0.5;
            }
        }
        let scale = size(&self.scratch.trial[..n]);
        self.scratch.forces[..n].copy_from_slice(&self.scratch.trial[..n]);
        error <= UNSETTLED * scale
    }

    /// The step of Newton's method from the forces in `forces`, in `right`. Returns false if its
    /// matrix is singular.
    fn newton_step(&mut self) -> bool {
        let n = self.candidates.len();
        let scratch = &mut self.scratch;
        for i in 0..n {
            scratch.right[i] = scratch.laws[i] - scratch.forces[i];
        }
        if !self.factor_newton() {
            return false;
        }
        let scratch = &mut self.scratch;
        let m = scratch.rows.len();
        let (matrix, springs) = self.spread.split_at(m * m);
        for (r, &i) in scratch.rows.iter().enumerate() {
            let mut right = scratch.right[i];
            for (spring, &j) in springs[r * m..(r + 1) * m].iter().zip(&scratch.rows) {
                if *spring == 0.0 {
                    continue;
                }
                // Forces that vanish move the others.
                let along = &self.along[n * j..n * (j + 1)];
                let lost = (0..n).filter(|&k| scratch.row_of[k] == usize::MAX);
                let moved: f64 = lost.map(|k| along[k] * scratch.right[k]).sum();
                right -= spring * moved;
            }
            scratch.solution[r] = right;
        }
        dense::solve(
            m,
            matrix,
            &scratch.order_of_newton,
            &mut scratch.solution[..m],
        );
        for (r, &i) in scratch.rows.iter().enumerate() {
            scratch.right[i] = scratch.solution[r];
        }
        true
    }

    /// Factors the matrix of Newton's method for the law's present stiffness, `1 − M/A + S w`, in the
    /// first rows of `spread`, with the law's springs `S` after it. Returns false if it is singular.
    pub(super) fn factor_newton(&mut self) -> bool {
        let n = self.candidates.len();
        let scratch = &mut self.scratch;
        // Only vertices with a point that presses have unknown forces; the others lose theirs.
        scratch.rows.clear();
        for i in 0..n {
            scratch.row_of[i] = if scratch.is_closed[i] {
                scratch.rows.push(i);
                scratch.rows.len() - 1
            } else {
                usize::MAX
            };
        }
        let m = scratch.rows.len();
        let (matrix, springs) = self.spread.split_at_mut(m * m);
        let springs = &mut springs[..m * m];
        matrix.fill(0.0);
        springs.fill(0.0);
        for r in 0..m {
            matrix[r * m + r] = 1.0;
        }
        // A corner of a point that presses has a row.
        for &(row, column, spring, share) in &scratch.stiffness {
            let (i, j) = (usize::from(row), usize::from(column));
            let (r, c) = (scratch.row_of[i], scratch.row_of[j]);
            matrix[r * m + c] -= share / self.candidates[j].area;
            springs[r * m + c] += spring;
        }
        for r in 0..m {
            for (c, &j) in scratch.rows.iter().enumerate() {
                let spring = springs[r * m + c];
                if spring == 0.0 {
                    continue;
                }
                let along = &self.along[n * j..n * (j + 1)];
                let row = &mut matrix[r * m..(r + 1) * m];
                for (entry, &k) in row.iter_mut().zip(&scratch.rows) {
                    *entry += spring * along[k];
                }
            }
        }
        dense::factor(m, matrix, &mut scratch.order_of_newton)
    }

    /// Stiffness of the pressing vertices against a displacement of their tool, along their
    /// normals, N/m, after [`Self::factor_newton`].
    pub(super) fn tool_stiffness(&mut self, tool: usize) -> Mat3 {
        let mut stiffness = Mat3::zeros();
        let scratch = &mut self.scratch;
        let m = scratch.rows.len();
        let (matrix, springs) = self.spread.split_at(m * m);
        let own = |i: usize| self.candidates[i].tool as usize == tool;
        for axis in 0..3 {
            for r in 0..m {
                let row = springs[r * m..(r + 1) * m].iter().zip(&scratch.rows);
                let pushed = row.filter(|(_, j)| own(**j));
                let by = pushed.map(|(spring, &j)| spring * self.candidates[j].normal[axis]);
                scratch.solution[r] = by.sum();
            }
            let solution = &mut scratch.solution[..m];
            dense::solve(m, matrix, &scratch.order_of_newton, solution);
            for (x, &i) in solution.iter().zip(&scratch.rows).filter(|(_, i)| own(**i)) {
                let column = stiffness.column(axis) + self.candidates[i].normal * *x;
                stiffness.set_column(axis, &column);
            }
        }
        stiffness
    }

    /// Sweeps over the friction of the candidates, for given pressing forces. Returns whether it
    /// changed any.
    fn rub(&mut self, tools: &[PosedTool]) -> bool {
        let n = self.candidates.len();
        let mut has_moved = false;
        for i in 0..n {
            let candidate = self.candidates[i];
            if candidate.is_anchored || candidate.pressure == 0.0 {
                continue;
            }
            let tool = &tools[candidate.tool as usize];
            let before = self
                .tools_before
                .get(candidate.tool as usize)
                .unwrap_or(tool);
            let place = candidate.start + candidate.displacement;
            self.candidates[i].anchor = first_touch(before, tool, &candidate.origin, &place).0;
        }
        for _ in 0..SWEEPS {
            let (mut moved, mut size) = (0.0, 0.0);
            for i in 0..n {
                let candidate = self.candidates[i];
                size += candidate.pressure;
                if candidate.pressure == 0.0 && candidate.friction == Vec3::zeros() {
                    continue;
                }
                let PosedTool { tool, pose } = &tools[candidate.tool as usize];
                let facing = candidate.facing;
                let own = self.block(i, i);
                let across = 0.5 * (own.trace() - facing.dot(&(own * facing)));
                let x = candidate.start + candidate.displacement;
                let slip = x - (pose * nalgebra::Point3::from(candidate.anchor)).coords;
                let slip = candidate.across(&slip);
                let friction = candidate.across(&candidate.friction) - slip / across;
                let most = candidate.most_friction(tool.friction_limit(candidate.is_sliding));
                let norm = friction.norm();
                let friction = if norm > most {
                    friction * (most / norm)
                } else {
                    friction
                };
                let step = friction - candidate.friction;
                if step != Vec3::zeros() {
                    for j in 0..n {
                        let response = self.block(j, i) * step;
                        self.candidates[j].displacement += response;
                    }
                }
                self.candidates[i].friction = friction;
                moved += step.norm();
            }
            has_moved |= moved > SETTLED_TURN * size;
            if moved <= SETTLED_SWEEP * size {
                break;
            }
        }
        has_moved
    }
}
