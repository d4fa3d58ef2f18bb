//! Forces and stiffness of all batches in double precision, by the threads of rayon's pool. The
//! elements are computed in chunks; while one chunk is computed, the one before is summed up. The
//! order of the sums is fixed, so the result does not depend on the number of threads.

#![expect(
    clippy::inline_always,
    reason = "compiled in its caller with the machine's instructions"
)]

use palpa_mesh::Vec3;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::Batches;
use super::kernel::{Local, N_NODES, PressureKind, WIDTH};
use super::lane_batch::LaneBatch;
use super::lanes::Doubles;
use super::passes::run;
use super::places::{add_block, index_of};
use super::single_pair::{SinglePair, group_nodes, inverted};
use crate::Mat3;
use crate::assembly::Inverted;
use crate::element::GroupResponse;
use crate::model::Model;
use crate::state::Memory;

/// Batches, and single pairs, that are computed before they are summed up.
const BATCHES: usize = 16;
const SINGLES: usize = 64;

/// Scratch memory: results of two chunks.
#[derive(Debug)]
pub(crate) struct Slots {
    batches: [Vec<Local<f64>>; 2],
    singles: [Vec<GroupResponse>; 2],
}

impl Slots {
    pub(crate) fn new() -> Self {
        Self {
            batches: [0, 1].map(|_| (0..BATCHES).map(|_| Local::new()).collect()),
            singles: [Vec::new(), Vec::new()],
        }
    }
}

/// Forces and stiffness that are summed up.
pub(crate) struct Sums<'a> {
    /// `∂W/∂u`, N. `[n_nodes]`
    pub(crate) forces: &'a mut [Vec3],
    /// Stiffness, in the order of [`crate::columns::Structure`], N/m; `None` if it is not wanted.
    pub(crate) blocks: Option<&'a mut [Mat3]>,
}

impl Batches {
    /// Adds `∂W/∂u` of these prisms and, if wanted, their stiffness.
    pub(crate) fn add_to(
        &self,
        model: &Model,
        memory: &Memory,
        displacements: &[Vec3],
        slots: &mut Slots,
        sums: &mut Sums<'_>,
    ) -> Result<(), Inverted> {
        let with_tangent = sums.blocks.is_some();
        // The lists hold boxes, because a batch is large.
        #[expect(clippy::borrowed_box, reason = "an item of the list")]
        let compute = |batch: &Box<LaneBatch>, slot: &mut Local<f64>| {
            let is_good = Arch::new().dispatch(One {
                batch,
                slot,
                displacements,
                with_tangent,
            });
            let pair = || worst_pair(batch, slot);
            is_good.then_some(()).ok_or_else(|| inverted(model, pair()))
        };
        #[expect(clippy::borrowed_box, reason = "an item of the list")]
        let add = |batch: &Box<LaneBatch>, slot: &Local<f64>| add_batch(batch, slot, sums);
        in_chunks(&self.full, &mut slots.batches, BATCHES, compute, add)?;
        if self.others.is_empty() {
            return Ok(());
        }
        for slots in &mut slots.singles {
            slots.resize_with(SINGLES, GroupResponse::new);
        }
        let compute = |pair: &SinglePair, slot: &mut GroupResponse| {
            let mut phases = Vec::with_capacity(4);
            pair.evaluate(
                model,
                memory,
                displacements,
                &mut phases,
                slot,
                with_tangent,
            )
        };
        let add = |pair: &SinglePair, slot: &GroupResponse| {
            let (group, nodes) = group_nodes(model, pair.pair as usize);
            for (n, &node) in nodes.iter().enumerate().take(group.n_nodes()) {
                sums.forces[node] += slot.forces[n];
            }
            if let Some(blocks) = &mut sums.blocks {
                let i = pair.pair as usize / model.n_groups();
                model.structure.scatter(group, i, &slot.stiffness, blocks);
            }
        };
        in_chunks(&self.others, &mut slots.singles, SINGLES, compute, add)
    }
}

/// Computes items into slots by several threads and adds the results in the order of the items.
fn in_chunks<I: Sync, S: Send + Sync>(
    items: &[I],
    [now, next]: &mut [Vec<S>; 2],
    size: usize,
    compute: impl Fn(&I, &mut S) -> Result<(), Inverted> + Sync,
    mut add: impl FnMut(&I, &S) + Send,
) -> Result<(), Inverted> {
    let run = |items: &[I], slots: &mut [S]| {
        let pairs = items.par_iter().zip(slots.par_iter_mut());
        pairs.try_for_each(|(item, slot)| compute(item, slot))
    };
    let mut before: &[I] = &[];
    for chunk in items.chunks(size) {
        let (result, ()) = rayon::join(
            || run(chunk, next),
            || {
                let done = before.iter().zip(&*now);
                done.for_each(|(item, slot)| add(item, slot));
            },
        );
        result?;
        std::mem::swap(now, next);
        before = chunk;
    }
    before
        .iter()
        .zip(&*now)
        .for_each(|(item, slot)| add(item, slot));
    Ok(())
}

/// Computes one batch.
struct One<'a> {
    batch: &'a LaneBatch,
    slot: &'a mut Local<f64>,
    displacements: &'a [Vec3],
    with_tangent: bool,
}

impl WithSimd for One<'_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        let LaneBatch {
            nodes,
            double,
            hardening,
            ..
        } = self.batch;
        self.slot.gather(nodes, self.displacements);
        if self.with_tangent {
            run::<Doubles<S>, true>(simd, double, *hardening, self.slot, PressureKind::Own)
        } else {
            run::<Doubles<S>, false>(simd, double, *hardening, self.slot, PressureKind::Own)
        }
    }
}

/// The pair of a batch with the least volume ratio.
fn worst_pair(batch: &LaneBatch, slot: &Local<f64>) -> u32 {
    let least = (0..batch.n).min_by(|&a, &b| slot.least[a].total_cmp(&slot.least[b]));
    batch.pairs[least.unwrap_or(0)]
}

fn add_batch(batch: &LaneBatch, slot: &Local<f64>, sums: &mut Sums<'_>) {
    for (rows, nodes) in slot.forces.iter().zip(&batch.nodes).take(N_NODES) {
        for (lane, &node) in nodes.iter().enumerate().take(batch.n) {
            let force = &mut sums.forces[node as usize];
            for c in 0..3 {
                force[c] += rows[c][lane];
            }
        }
    }
    let (Some(blocks), Some(places)) = (&mut sums.blocks, &batch.places) else {
        return;
    };
    for (rows, places) in slot.stiffness.iter().zip(places.iter()) {
        for (lane, &place) in places.iter().enumerate().take(batch.n.min(WIDTH)) {
            let Some(into) = blocks.get_mut(index_of(place)) else {
                continue; // a node that cannot move
            };
            add_block(place, |r, c| rows[3 * r + c][lane], into.as_mut_slice());
        }
    }
}
