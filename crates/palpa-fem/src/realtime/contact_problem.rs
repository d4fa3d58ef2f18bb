//! The small contact problem of a moving step: forces on a few skin vertices (the *candidates*),
//! given their compliance.
//!
//! The project solves contact in three places:
//!
//! | who | where | unknowns | friction |
//! | --- | --- | --- | --- |
//! | statics, each Newton iteration | [`crate::statics`], `active_set.rs` | displacements of all nodes; a touching vertex is held on the tool's surface | each touching vertex sticks (held at its anchor) or slides; decided between iterations |
//! | moving step, each iteration at some 100 Hz | here | forces on at most 160 candidates, on their compliance | decided in sweeps over the candidates (`rub`), once an iteration |
//! | servo, each tick at 1 kHz | `palpa-servo`, `solver.rs` and `contact.rs` | forces on at most 60 vertices of the patch, and the coupling's displacement | decided each tick, on the round cone, one vertex after the other |
//!
//! ```text
//! s = s0 + w (f − p0),   p = f − κ s,   0 ≤ g0 + s − s0 ⟂ p ≥ 0
//! ```
//! along the normals. `s` is the displacement of a vertex, m, `p` its pressing force, N, `g` its
//! gap, m, and `f` the force in the linear system, N. Where `κ > 0`, a spring holds the vertex in
//! the linear system: deep under a tool the free body is not stable, and only the tool holds it.
//! The compliance `w`, m/N, includes the spring; `p` excludes the spring's force. Without friction
//! this is the whole problem, and an active set solves it exactly. With friction, `|t| ≤ μ p`, and
//! where `t` reaches that limit it opposes the slip from the anchor. Projected Gauss–Seidel sweeps
//! then start from the frictionless solution.

#![expect(
    clippy::needless_range_loop,
    reason = "candidates index several arrays together"
)]

use palpa_mesh::Vec3;

use super::MOST_CANDIDATES;
use super::candidate::Candidate;
use crate::Mat3;
use crate::posed_tool::PosedTool;

/// Largest number of changes of the active set.
const MOST_CHANGES: usize = 40;
/// Largest number of sweeps with friction.
const SWEEPS: usize = 60;
/// Relative change of the forces in a sweep below which they count as settled.
const SETTLED: f64 = 1e-6;
/// Gaps below this (m) count as zero.
const NO_GAP: f64 = 1e-12;

/// The problem, in memory for [`MOST_CANDIDATES`].
#[derive(Debug)]
pub(super) struct ContactProblem {
    /// Sorted by vertex.
    pub(super) candidates: Vec<Candidate>,
    /// Whether any tool has friction: a candidate then has three unknowns, otherwise one.
    pub(super) has_friction: bool,
    /// Compliance, column by column, m/N: `n × n` along the normals, or `3 n × 3 n` along the axes
    /// with friction.
    pub(super) compliance: Vec<f64>,
    /// Change of the force in the linear system, `f − p0`: along the normals, or along the axes
    /// with friction, N.
    pub(super) change: Vec<f64>,
    /// Compliance along the normals, m/N.
    pub(super) along: Vec<f64>,
    pub(super) factor: Vec<f64>,
    /// Compliance with the supports removed as far as possible, and scratch memory for it.
    pub(super) released: Vec<f64>,
    pub(super) spread: Vec<f64>,
    is_active: [bool; MOST_CANDIDATES],
}

impl ContactProblem {
    pub(super) fn new() -> Self {
        let n = MOST_CANDIDATES;
        Self {
            candidates: Vec::with_capacity(n),
            has_friction: false,
            compliance: vec![0.0; 9 * n * n],
            change: vec![0.0; 3 * n],
            along: vec![0.0; n * n],
            factor: vec![0.0; n * n],
            released: vec![0.0; 9 * n * n],
            spread: vec![0.0; 3 * n * n],
            is_active: [false; MOST_CANDIDATES],
        }
    }

    /// The candidates with a pressing force.
    pub(super) fn pressing(&self) -> impl Iterator<Item = &Candidate> {
        self.candidates.iter().filter(|c| c.pressure > 0.0)
    }

    /// The block of the compliance between two candidates, with friction.
    pub(super) fn block(&self, i: usize, j: usize) -> Mat3 {
        let n = 3 * self.candidates.len();
        Mat3::from_fn(|r, c| self.compliance[3 * i + r + n * (3 * j + c)])
    }

    /// Finds forces and displacements. Cost: proportional to n³ for n pressing vertices; with
    /// friction, also n² for n candidates in each sweep.
    pub(super) fn solve(&mut self, tools: &[PosedTool]) {
        let (n, has_friction) = (self.candidates.len(), self.has_friction);
        self.change.fill(0.0);
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
        let start: [f64; MOST_CANDIDATES] =
            std::array::from_fn(|i| self.candidates.get(i).map_or(0.0, |c| c.pressure));
        self.press(&start);
        if !has_friction {
            return;
        }
        let before: [Vec3; MOST_CANDIDATES] =
            std::array::from_fn(|i| self.candidates.get(i).map_or(Vec3::zeros(), |c| c.friction));
        // The pressures were found along the normals. Their effect across the normals is not yet in
        // the displacements.
        self.respond();
        self.rub(tools, &start, &before);
    }

    /// Normal force in the linear system: the pressure plus the support's share.
    fn taken(candidate: &Candidate) -> f64 {
        candidate.pressure + candidate.support * candidate.displacement.dot(&candidate.normal)
    }

    /// Finds the pressures that leave no gap negative, by an active set.
    fn press(&mut self, start: &[f64; MOST_CANDIDATES]) {
        let n = self.candidates.len();
        let mut rest = [0.0; MOST_CANDIDATES];
        for i in 0..n {
            let candidate = &self.candidates[i];
            self.is_active[i] = candidate.pressure > 0.0;
            rest[i] = candidate.displacement.dot(&candidate.normal);
        }
        // Candidates in the system: those that press, or whose support must be removed.
        let mut rows = [0_usize; MOST_CANDIDATES];
        let mut taken = [0.0; MOST_CANDIDATES];
        let mut slides = rest;
        for _ in 0..MOST_CHANGES {
            let mut m = 0;
            for i in 0..n {
                if self.is_active[i] || self.candidates[i].support > 0.0 {
                    rows[m] = i;
                    m += 1;
                }
            }
            // The forces at the start act until they are changed.
            let mut right = [0.0; MOST_CANDIDATES];
            for (right, &i) in right.iter_mut().zip(&rows[..m]) {
                let released: f64 = (0..n)
                    .filter(|j| !rows[..m].contains(j) && start[*j] != 0.0)
                    .map(|j| self.along[i + n * j] * start[j])
                    .sum();
                let gap = if self.is_active[i] {
                    self.candidates[i].gap
                } else {
                    0.0
                };
                *right = released - rest[i] - gap;
            }
            let candidates = &self.candidates;
            let (is_active, along) = (&self.is_active, &self.along);
            let entry = |r: usize, c: usize| {
                let (i, j) = (rows[r], rows[c]);
                let own = if r == c && !is_active[i] {
                    1.0 / candidates[i].support
                } else {
                    0.0
                };
                along[i + n * j] - own
            };
            // Change from the start for the rows of the system.
            let offset: [f64; MOST_CANDIDATES] = std::array::from_fn(|r| {
                if r < m && !is_active[rows[r]] {
                    start[rows[r]] / candidates[rows[r]].support
                } else {
                    0.0
                }
            });
            for r in 0..m {
                right[r] += offset[r];
            }
            if !factor_symmetric(m, entry, &mut self.factor) {
                return;
            }
            substitute_symmetric(m, &self.factor, &mut right[..m]);
            let mut change = [0.0; MOST_CANDIDATES];
            for j in 0..n {
                change[j] = -start[j];
            }
            for (&i, x) in rows[..m].iter().zip(&right) {
                change[i] = *x;
            }
            for i in 0..n {
                taken[i] = start[i] + change[i];
                let sum: f64 = (0..n).map(|j| self.along[i + n * j] * change[j]).sum();
                slides[i] = rest[i] + sum;
            }
            let mut is_settled = true;
            for i in 0..n {
                let candidate = &self.candidates[i];
                let pressure = taken[i] - candidate.support * slides[i];
                if self.is_active[i] && pressure < 0.0 {
                    self.is_active[i] = false;
                    is_settled = false;
                } else if !self.is_active[i] && candidate.gap + slides[i] < -NO_GAP {
                    self.is_active[i] = true;
                    is_settled = false;
                }
            }
            if is_settled {
                break;
            }
        }
        for i in 0..n {
            let candidate = &mut self.candidates[i];
            candidate.pressure = if self.is_active[i] {
                (taken[i] - candidate.support * slides[i]).max(0.0)
            } else {
                0.0
            };
            candidate.displacement += candidate.normal * (slides[i] - rest[i]);
            self.change[i] = taken[i] - start[i];
        }
    }

    /// Adds the effect of the pressure changes across the normals, which the frictionless solution
    /// leaves out.
    fn respond(&mut self) {
        let n = self.candidates.len();
        for i in 0..n {
            let mut response = Vec3::zeros();
            for j in 0..n {
                response += self.block(i, j) * (self.candidates[j].normal * self.change[j]);
            }
            let normal = self.candidates[i].normal;
            self.candidates[i].displacement += response - normal * normal.dot(&response);
        }
    }

    /// Sweeps with friction; the result is in `change`, along the axes.
    fn rub(
        &mut self,
        tools: &[PosedTool],
        start: &[f64; MOST_CANDIDATES],
        before: &[Vec3; MOST_CANDIDATES],
    ) {
        let n = self.candidates.len();
        let mut taken: [Vec3; MOST_CANDIDATES] = std::array::from_fn(|i| {
            self.candidates
                .get(i)
                .map_or(Vec3::zeros(), |c| c.normal * Self::taken(c) + c.friction)
        });
        for _ in 0..SWEEPS {
            let (mut moved, mut size) = (0.0, 0.0);
            for i in 0..n {
                let candidate = self.candidates[i];
                let PosedTool { tool, pose } = &tools[candidate.tool as usize];
                let normal = candidate.normal;
                let own = self.block(i, i);
                let along = normal.dot(&(own * normal));
                let across = 0.5 * (own.trace() - along);
                let slide = candidate.displacement.dot(&normal);
                let gap = candidate.gap + slide;
                // The force that closes the gap; if that would pull, the force that removes the
                // pressure.
                let present = taken[i].dot(&normal) - candidate.support * slide;
                let share = 1.0 - candidate.support * along;
                let mut push = -gap / along;
                if present + push * share < 0.0 {
                    push = -present / share.max(0.1);
                }
                let pressure = (present + push * share).max(0.0);
                let x = candidate.start + candidate.displacement;
                let slip = x - (pose * nalgebra::Point3::from(candidate.anchor)).coords;
                let slip = slip - normal * normal.dot(&slip);
                let friction = candidate.friction - slip / across;
                let most = tool.friction() * pressure;
                let norm = friction.norm();
                let friction = if norm > most {
                    friction * (most / norm)
                } else {
                    friction
                };
                let step = normal * push + friction - candidate.friction;
                if step != Vec3::zeros() {
                    for j in 0..n {
                        let response = self.block(j, i) * step;
                        self.candidates[j].displacement += response;
                    }
                }
                taken[i] += step;
                self.candidates[i].pressure = pressure;
                self.candidates[i].friction = friction;
                moved += step.norm();
                size += pressure;
            }
            if moved <= SETTLED * size {
                break;
            }
        }
        for i in 0..n {
            let change = taken[i] - self.candidates[i].normal * start[i] - before[i];
            self.change[3 * i..3 * i + 3].copy_from_slice(change.as_slice());
        }
    }
}

/// Factors a dense symmetric matrix as `LDLᵀ`. Returns false if a pivot is nearly zero.
pub(super) fn factor_symmetric(
    n: usize,
    entry: impl Fn(usize, usize) -> f64,
    factor: &mut [f64],
) -> bool {
    const LEAST_PIVOT: f64 = 1e-12;
    // Row r holds L D up to the diagonal, then D.
    for r in 0..n {
        for c in 0..=r {
            let (before, row) = factor.split_at_mut(r * n);
            let mut sum = entry(r, c);
            if c < r {
                let other = &before[c * n..c * n + c];
                for k in 0..c {
                    sum -= row[k] * other[k] / before[k * n + k];
                }
                row[c] = sum;
            } else {
                let size = sum.abs();
                for k in 0..c {
                    sum -= row[k] * row[k] / before[k * n + k];
                }
                if sum.is_nan() || sum.abs() <= LEAST_PIVOT * size {
                    return false;
                }
                row[r] = sum;
            }
        }
    }
    true
}

/// Solves with the factor of [`factor_symmetric`]; the solution replaces the right side.
pub(super) fn substitute_symmetric(n: usize, factor: &[f64], right: &mut [f64]) {
    for r in 0..n {
        let mut sum = right[r];
        for k in 0..r {
            sum -= factor[r * n + k] * right[k];
        }
        right[r] = sum / factor[r * n + r];
    }
    for r in (0..n).rev() {
        for c in r + 1..n {
            right[r] -= factor[c * n + r] / factor[r * n + r] * right[c];
        }
    }
}
