//! Passes over all batches in the machine's vectors: forces, stiffness, memory.

#![expect(
    clippy::inline_always,
    reason = "compiled in its caller with the machine's instructions"
)]

use palpa_mesh::Vec3;
use palpa_sparse::Block;
use palpa_sparse::fronts::Number;
use pulp::{Simd, WithSimd};

use super::kernel::{
    Constant, LaneGroup, Local, N_BLOCKS, N_NODES, N_POINTS, PressureKind, Row, WIDTH,
};
use super::lane_batch::{LaneBatch, Numbers};
use super::lanes::{Doubles, Lanes, Singles};
use super::places::{add_block, index_of};
use super::{From, Pressure};
use crate::law::Hardening;
use crate::state::Memory;

/// Updates the memories of all batches.
pub(super) struct Remember<'a> {
    pub(super) full: &'a mut [Box<LaneBatch>],
    pub(super) local: &'a mut Local<f64>,
    pub(super) displacements: &'a [Vec3],
    pub(super) memory: &'a Memory,
}

impl WithSimd for Remember<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let zero = [0.0; WIDTH];
        let mut new = Constant {
            stress: [[zero; 6]; N_POINTS],
            pressure: zero,
        };
        for batch in self.full {
            let Some(past) = &mut batch.past else {
                continue;
            };
            let Some(step) = self.memory.step_of(past.material) else {
                continue;
            };
            self.local.gather(&batch.nodes, self.displacements);
            for at in (0..WIDTH).step_by(Doubles::<S>::N) {
                LaneGroup::<Doubles<S>>::new(
                    simd,
                    at,
                    &batch.double.geometry,
                    &past.rest,
                    None,
                    batch.hardening,
                )
                .elastic(self.local, &mut new);
            }
            let (decay, gain) = step.factors();
            let Some((last, rows)) = past.rows.split_first_mut() else {
                continue;
            };
            for (row, (decay, gain)) in rows.iter_mut().zip(decay.iter().zip(&gain)) {
                let into = row.stress.iter_mut().flatten().chain([&mut row.pressure]);
                let old = last.stress.iter().flatten().chain([&last.pressure]);
                let now = new.stress.iter().flatten().chain([&new.pressure]);
                for ((into, old), now) in into.zip(old).zip(now) {
                    for lane in 0..WIDTH {
                        into[lane] = decay * into[lane] + gain * (now[lane] - old[lane]);
                    }
                }
            }
            last.clone_from(&new);
        }
    }
}

impl<E: Number> Local<E> {
    pub(super) fn new() -> Self {
        let zero = [E::default(); WIDTH];
        Self {
            displacements: [[zero; 3]; N_NODES],
            since: [[zero; 3]; N_NODES],
            forces: [[zero; 3]; N_NODES],
            stiffness: [[zero; 9]; N_BLOCKS],
            least: zero,
        }
    }

    #[inline(always)]
    pub(super) fn gather(&mut self, nodes: &[[u32; WIDTH]; N_NODES], displacements: &[Vec3]) {
        put(&mut self.displacements, nodes, |node| displacements[node]);
    }

    /// Fills in the displacements since those that they were extrapolated from: none for prisms whose vertices
    /// are all known.
    #[inline(always)]
    fn gather_since(
        &mut self,
        nodes: &[[u32; WIDTH]; N_NODES],
        displacements: &[Vec3],
        from: &From<'_>,
    ) {
        put(&mut self.since, nodes, |node| {
            displacements[node] - from.displacements[node]
        });
        for lane in 0..WIDTH {
            let mut own = nodes.iter().map(|nodes| nodes[lane] as usize);
            if own.all(|node| from.is_known[node / from.n_levels]) {
                for rows in self.since.iter_mut().flatten() {
                    rows[lane] = E::default();
                }
            }
        }
    }
}

/// Fills in a vector for each node of a batch.
#[inline(always)]
fn put<E: Number>(
    into: &mut [[Row<E>; 3]; N_NODES],
    nodes: &[[u32; WIDTH]; N_NODES],
    vector: impl Fn(usize) -> Vec3,
) {
    for (rows, nodes) in into.iter_mut().zip(nodes) {
        for (lane, &node) in nodes.iter().enumerate() {
            let u = vector(node as usize);
            for c in 0..3 {
                rows[c][lane] = E::nearest(u[c]);
            }
        }
    }
}

/// Evaluates a batch in one precision; see [`LaneGroup::evaluate`]. Returns false if a prism is inside out.
#[inline(always)]
pub(super) fn run<R: Lanes, const TANGENT: bool>(
    token: R::Token,
    numbers: &Numbers<R::Element>,
    hardening: Hardening,
    local: &mut Local<R::Element>,
    pressure: PressureKind,
) -> bool {
    for at in (0..WIDTH).step_by(R::N) {
        let constant = numbers.constant.as_ref();
        LaneGroup::<R>::new(
            token,
            at,
            &numbers.geometry,
            &numbers.stiffness,
            constant,
            hardening,
        )
        .evaluate::<TANGENT>(local, pressure)
        .store(&mut local.least[at..]);
    }
    local.least.iter().all(|&j| j > R::Element::default())
}

/// Adds the forces of all batches, N. The error names a pair of the batch with a prism inside out.
pub(super) struct Forces<'a> {
    pub(super) full: &'a [Box<LaneBatch>],
    pub(super) local: &'a mut Local<f64>,
    pub(super) displacements: &'a [Vec3],
    pub(super) into: &'a mut [Vec3],
}

impl WithSimd for Forces<'_> {
    type Output = Result<(), u32>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        for batch in self.full {
            self.local.gather(&batch.nodes, self.displacements);
            if !run::<Doubles<S>, false>(
                simd,
                &batch.double,
                batch.hardening,
                self.local,
                PressureKind::Own,
            ) {
                return Err(batch.pairs[0]);
            }
            for (rows, nodes) in self.local.forces.iter().zip(&batch.nodes) {
                for (lane, &node) in nodes.iter().enumerate().take(batch.n) {
                    let force = &mut self.into[node as usize];
                    for c in 0..3 {
                        force[c] += rows[c][lane];
                    }
                }
            }
        }
        Ok(())
    }
}

/// Adds the stiffness of all batches, N/m. Errors as in [`Forces`].
pub(super) struct Tangents<'a> {
    pub(super) full: &'a [Box<LaneBatch>],
    pub(super) local: &'a mut Local<f32>,
    pub(super) displacements: &'a [Vec3],
    pub(super) blocks: &'a mut [Block<f32>],
    pub(super) pressure: Pressure<'a>,
}

impl WithSimd for Tangents<'_> {
    type Output = Result<(), u32>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        for batch in self.full {
            let (Some(single), Some(places)) = (&batch.single, &batch.places) else {
                continue;
            };
            self.local.gather(&batch.nodes, self.displacements);
            let kind = match self.pressure {
                Pressure::Own => PressureKind::Own,
                Pressure::None => PressureKind::None,
                Pressure::Predicted(from) => {
                    (self.local).gather_since(&batch.nodes, self.displacements, &from);
                    PressureKind::Predicted
                }
            };
            if !run::<Singles<S>, true>(simd, single, batch.hardening, self.local, kind) {
                return Err(batch.pairs[0]);
            }
            for (rows, places) in self.local.stiffness.iter().zip(places.iter()) {
                for (lane, &place) in places.iter().enumerate().take(batch.n) {
                    let into = &mut self.blocks[index_of(place)];
                    add_block(place, |r, c| rows[3 * r + c][lane], into);
                }
            }
        }
        Ok(())
    }
}
