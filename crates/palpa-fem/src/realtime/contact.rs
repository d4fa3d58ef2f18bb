//! The small contact problem of a moving step: forces on a few skin vertices, given how these answer to them.
//!
//! ```text
//! x = x0 + W (λ − λ0),   0 ≤ g(x) ⟂ λ_n ≥ 0,   |λ_t| ≤ μ λ_n, against the slip from the anchor where it reaches that
//! ```
//! Without friction an active set is found exactly; with friction that is where projected Gauss–Seidel sweeps start. Normals
//! follow the vertices over the tool's surface in a few outer passes.

use palpa_mesh::Vec3;

use crate::Mat3;
use crate::contact::PosedTool;

/// Passes in which normals and gaps follow the vertices.
const PASSES: usize = 6;
/// Changes of the active set in one pass.
const MOST_CHANGES: usize = 30;
/// Sweeps of a pass with friction.
const SWEEPS: usize = 30;
/// Change of a force in a pass, as a share of all, that counts as none.
const SETTLED: f64 = 1e-6;

/// A skin vertex near a tool.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    pub(super) vertex: u32,
    pub(super) tool: u32,
    /// Where it would be under `force`, m: `x0`.
    pub(super) position: Vec3,
    /// `λ0`, then `λ`, N.
    pub(super) force: Vec3,
    /// Where friction holds it, in the tool's frame, m.
    pub(super) anchor: Vec3,
    /// Whether it has come to touch only now, so that its anchor is where it touches.
    pub(super) is_new: bool,
    /// From the tool to the tissue, at the end.
    pub(super) normal: Vec3,
    /// m, at the end.
    pub(super) gap: f64,
}

/// Memory for so many candidates.
#[derive(Debug)]
pub(super) struct ContactProblem {
    pub(super) candidates: Vec<Candidate>,
    /// `W`, column by column, `3 n × 3 n`, m/N.
    pub(super) compliance: Vec<f64>,
    /// Positions under the present forces, m.
    pub(super) positions: Vec<Vec3>,
    normals_compliance: Vec<f64>,
    factor: Vec<f64>,
    active: Vec<u32>,
    is_active: Vec<bool>,
    pressures: Vec<f64>,
    rest_gaps: Vec<f64>,
    start: Vec<Vec3>,
}

impl ContactProblem {
    pub(super) fn new(most: usize) -> Self {
        Self {
            candidates: Vec::with_capacity(most),
            compliance: vec![0.0; 9 * most * most],
            positions: vec![Vec3::zeros(); most],
            normals_compliance: vec![0.0; most * most],
            factor: vec![0.0; most * most],
            active: Vec::with_capacity(most),
            is_active: vec![false; most],
            pressures: vec![0.0; most],
            rest_gaps: vec![0.0; most],
            start: vec![Vec3::zeros(); most],
        }
    }

    /// The block of `W` between two candidates.
    fn block(&self, i: usize, j: usize) -> Mat3 {
        let n = 3 * self.candidates.len();
        let at = |r: usize, c: usize| self.compliance[3 * i + r + n * (3 * j + c)];
        Mat3::from_fn(at)
    }

    /// Finds forces and positions. Cost: some n³ of active vertices, and with friction n² of candidates a sweep.
    pub(super) fn solve(&mut self, tools: &[PosedTool]) {
        let n = self.candidates.len();
        for (start, candidate) in self.start.iter_mut().zip(&self.candidates) {
            *start = candidate.force;
        }
        for (active, candidate) in self.is_active.iter_mut().zip(&self.candidates) {
            *active = candidate.force != Vec3::zeros();
        }
        self.place();
        let has_friction = tools.iter().any(|t| t.tool.friction() > 0.0);
        for _ in 0..PASSES {
            let before: f64 = self.candidates.iter().map(|c| c.force.norm()).sum();
            let change = {
                self.measure(tools);
                self.press()
            };
            if change <= SETTLED * before {
                break;
            }
        }
        if has_friction {
            self.measure(tools);
            for i in 0..n {
                let Candidate { tool, normal, gap, is_new, .. } = self.candidates[i];
                if is_new {
                    let surface = self.positions[i] - normal * gap;
                    let pose = &tools[tool as usize].pose;
                    self.candidates[i].anchor = pose.inverse_transform_point(&surface.into()).coords;
                }
            }
            for _ in 0..PASSES {
                let size: f64 = self.candidates.iter().map(|c| c.force.norm()).sum();
                self.measure(tools);
                if self.rub(tools) <= SETTLED * size {
                    break;
                }
            }
        }
        self.measure(tools);
    }

    /// Positions under the present forces.
    fn place(&mut self) {
        for i in 0..self.candidates.len() {
            let mut x = self.candidates[i].position;
            for j in 0..self.candidates.len() {
                let change = self.candidates[j].force - self.start[j];
                if change != Vec3::zeros() {
                    x += self.block(i, j) * change;
                }
            }
            self.positions[i] = x;
        }
    }

    /// Gaps and normals at the present positions.
    fn measure(&mut self, tools: &[PosedTool]) {
        for (candidate, x) in self.candidates.iter_mut().zip(&self.positions) {
            let PosedTool { tool, pose } = &tools[candidate.tool as usize];
            let distance = tool.distance_at(pose, x);
            candidate.gap = distance.distance;
            candidate.normal = distance.normal;
        }
    }

    /// Forces along the present normals that leave no gap negative. Returns how much they changed, N.
    fn press(&mut self) -> f64 {
        let n = self.candidates.len();
        for j in 0..n {
            let normal = self.candidates[j].normal;
            for i in 0..n {
                let value = self.candidates[i].normal.dot(&(self.block(i, j) * normal));
                self.normals_compliance[i + n * j] = value;
            }
        }
        // Gaps if no force acted along the normals.
        for i in 0..n {
            let mut gap = self.candidates[i].gap;
            let normal = self.candidates[i].normal;
            for j in 0..n {
                let force = self.candidates[j].force;
                if force != Vec3::zeros() {
                    gap -= normal.dot(&(self.block(i, j) * force));
                }
            }
            self.rest_gaps[i] = gap;
        }
        for _ in 0..MOST_CHANGES {
            self.active.clear();
            self.active.extend((0..n as u32).filter(|&i| self.is_active[i as usize]));
            if !self.solve_active(n) {
                break;
            }
            let mut is_settled = true;
            for i in 0..n {
                if self.is_active[i] {
                    if self.pressures[i] < 0.0 {
                        self.is_active[i] = false;
                        self.pressures[i] = 0.0;
                        is_settled = false;
                    }
                } else {
                    let gap = self.active.iter().fold(self.rest_gaps[i], |gap, &j| {
                        gap + self.normals_compliance[i + n * j as usize] * self.pressures[j as usize]
                    });
                    if gap < -1e-12 {
                        self.is_active[i] = true;
                        is_settled = false;
                    }
                }
            }
            if is_settled {
                break;
            }
        }
        let mut change = 0.0;
        for i in 0..n {
            let pressure = if self.is_active[i] { self.pressures[i].max(0.0) } else { 0.0 };
            let force = self.candidates[i].normal * pressure;
            change += (force - self.candidates[i].force).norm();
            self.candidates[i].force = force;
        }
        self.place();
        change
    }

    /// Pressures of the active vertices that close their gaps, by a dense Cholesky factor.
    fn solve_active(&mut self, n: usize) -> bool {
        let m = self.active.len();
        self.pressures[..n].fill(0.0);
        let factor = &mut self.factor[..m * m];
        for (c, &j) in self.active.iter().enumerate() {
            for (r, &i) in self.active.iter().enumerate().skip(c) {
                factor[r * m + c] = self.normals_compliance[i as usize + n * j as usize];
            }
        }
        let right = |i: usize| -self.rest_gaps[self.active[i] as usize];
        // Rows, so that all sums run along memory.
        for r in 0..m {
            for c in 0..=r {
                let (before, row) = factor.split_at_mut(r * m);
                let dot: f64 = if c < r {
                    let other = &before[c * m..c * m + c];
                    row[..c].iter().zip(other).map(|(a, b)| a * b).sum()
                } else {
                    row[..c].iter().map(|a| a * a).sum()
                };
                let rest = row[c] - dot;
                if c < r {
                    row[c] = rest / before[c * m + c];
                } else if rest > 0.0 {
                    row[c] = rest.sqrt();
                } else {
                    return false;
                }
            }
        }
        let mut solution = [0.0; super::MOST_CANDIDATES];
        for r in 0..m {
            let row = &factor[r * m..r * m + r];
            let dot: f64 = row.iter().zip(&solution).map(|(a, b)| a * b).sum();
            solution[r] = (right(r) - dot) / factor[r * m + r];
        }
        for r in (0..m).rev() {
            solution[r] /= factor[r * m + r];
            let value = solution[r];
            for (s, a) in solution[..r].iter_mut().zip(&factor[r * m..r * m + r]) {
                *s -= a * value;
            }
        }
        for (&i, value) in self.active.iter().zip(solution) {
            self.pressures[i as usize] = value;
        }
        true
    }

    /// Sweeps with friction. Returns how much the forces changed, N.
    fn rub(&mut self, tools: &[PosedTool]) -> f64 {
        let n = self.candidates.len();
        let mut total = 0.0;
        // Gaps and slips at the positions of the last measurement, from which those of the sweep are linear.
        let mut measured = [Vec3::zeros(); super::MOST_CANDIDATES];
        measured[..n].copy_from_slice(&self.positions[..n]);
        for _ in 0..SWEEPS {
            let mut change = 0.0;
            for i in 0..n {
                let candidate = self.candidates[i];
                let PosedTool { tool, pose } = &tools[candidate.tool as usize];
                let normal = candidate.normal;
                let own = self.block(i, i);
                let gap = candidate.gap + normal.dot(&(self.positions[i] - measured[i]));
                let along = normal.dot(&(own * normal));
                let across = 0.5 * (own.trace() - along);
                let pressure = (candidate.force.dot(&normal) - gap / along).max(0.0);
                let slip = self.positions[i] - (pose * nalgebra::Point3::from(candidate.anchor)).coords;
                let slip = slip - normal * normal.dot(&slip);
                let friction = candidate.force - normal * candidate.force.dot(&normal) - slip / across;
                let most = tool.friction() * pressure;
                let size = friction.norm();
                let friction = if size > most { friction * (most / size) } else { friction };
                let force = normal * pressure + friction;
                let step = force - candidate.force;
                if step != Vec3::zeros() {
                    self.candidates[i].force = force;
                    for j in 0..n {
                        let move_ = self.block(j, i) * step;
                        self.positions[j] += move_;
                    }
                    change += step.norm();
                }
            }
            total += change;
            let size: f64 = self.candidates.iter().map(|c| c.force.norm()).sum();
            if change <= SETTLED * size {
                break;
            }
        }
        total
    }
}
