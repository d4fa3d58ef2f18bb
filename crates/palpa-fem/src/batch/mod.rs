//! Batches of sixteen pairs of prisms, of one interval and one kind of law, in the form that the
//! kernel needs.
//!
//! | file | what it holds |
//! | --- | --- |
//! | `mod` | [`Batches`]: the prisms of a part of a body, their forces and stiffness |
//! | `lane_batch` | one batch of sixteen pairs, and how it is filled |
//! | `passes` | forces, stiffness and memory of all batches, in the machine's vectors |
//! | `sums` | forces and stiffness in double precision, by several threads |
//! | `single_pair` | a pair whose law is not one of the kernel's |
//! | `places` | where nodes and blocks are |
//! | `history` | memory on its way from zone to zone |

mod elementary;
mod history;
mod kernel;
mod lane_batch;
mod lanes;
mod passes;
mod places;
mod principal;
mod single_pair;
mod sums;
#[cfg(test)]
mod tests;

use palpa_mesh::Vec3;
use palpa_sparse::{Block, ColumnPattern};
use pulp::Arch;
use rayon::prelude::*;

use crate::assembly::{Inverted, phases_at};
use crate::columns::SurfaceGroup;
use crate::element::{GroupResponse, PhaseAt};
use crate::law::Hardening;
use crate::model::Model;
use crate::state::{Memory, State};
use kernel::{Local, N_POINTS, WIDTH};
use lane_batch::LaneBatch;
use passes::{Forces, Remember, Tangents};
use places::{kernel_columns, places};
use single_pair::{SinglePair, group_nodes, inverted};

pub(crate) use history::History;
pub(crate) use sums::{Slots, Sums};

/// Whether batches are for stiffness too, and in which precision.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Tangent {
    None,
    Single,
    Double,
}

/// The pressure of the volume in the stiffness, for prisms that turn and shear. Pairs that are not in lanes have their
/// own always.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Pressure<'a> {
    /// That of the displacements.
    Own,
    /// None: for a stiffness that is nearly always positive definite.
    None,
    /// That of the volume that was predicted. Displacements that are extrapolated do not keep the volume to second
    /// order, and their own pressure is off by as much as the shear modulus.
    Predicted(From<'a>),
}

/// What displacements have been extrapolated from.
#[derive(Debug, Clone, Copy)]
pub(crate) struct From<'a> {
    /// The displacements before, m. `[n_nodes]`
    pub(crate) displacements: &'a [Vec3],
    /// Whether a vertex's were not extrapolated; prisms of such vertices only have their own pressure. `[n_vertices]`
    pub(crate) is_known: &'a [bool],
    /// Number of levels of nodes.
    pub(crate) n_levels: usize,
}

/// The prisms of some part of a body.
#[derive(Debug)]
pub(crate) struct Batches {
    full: Vec<Box<LaneBatch>>,
    others: Vec<SinglePair>,
    local_double: Box<Local<f64>>,
    local_single: Box<Local<f32>>,
    response: GroupResponse,
    /// Scratch of the pairs that are evaluated one by one; empty between calls.
    phases: Vec<PhaseAt<'static>>,
}

/// Half the shear modulus of a group at rest at each point and its bulk modulus, Pa, and its
/// hardening; `None` if the kernel does not have its law.
fn lane(phases: &[PhaseAt<'_>], has_memory: bool) -> Option<([f64; N_POINTS], f64, Hardening)> {
    if has_memory && phases.len() > 1 {
        return None;
    }
    let mut slopes = [0.0; N_POINTS];
    let mut bulk = 0.0;
    let mut common = None;
    for at in phases {
        let (slope, hardening, k) = at.law.hardening()?;
        if *common.get_or_insert(hardening) != hardening {
            return None;
        }
        for (sum, share) in slopes.iter_mut().zip(at.phase.points) {
            *sum += slope * share;
        }
        bulk += k * at.phase.volume;
    }
    common.map(|hardening| (slopes, bulk, hardening))
}

/// The memory of a list, for phases that live for another time. Nothing is allocated.
fn recycled<'a>(phases: &mut Vec<PhaseAt<'_>>) -> Vec<PhaseAt<'a>> {
    phases.clear();
    let none = std::mem::take(phases).into_iter();
    none.map_while(|_| None).collect()
}

impl Batches {
    /// The prisms under the groups that `keep` selects. `tangent` says
    /// whether they can be assembled into blocks of the pattern.
    pub(crate) fn new(
        model: &Model,
        memory: &Memory,
        pattern: &ColumnPattern,
        keep: &dyn Fn(&SurfaceGroup) -> bool,
        tangent: Tangent,
    ) -> Self {
        let mut batches: Vec<Box<LaneBatch>> = Vec::new();
        let mut others = Vec::new();
        let (mut phases, mut most_phases) = (Vec::new(), 0);
        let n_groups = model.n_groups();
        for i in 0..model.body.n_levels - 1 {
            // Batches of this interval that have room.
            let mut open: Vec<usize> = Vec::new();
            for (g, group) in model.structure.groups.iter().enumerate() {
                if !keep(group) {
                    continue;
                }
                let pair = i * n_groups + g;
                phases_at(model, memory, pair, &mut phases);
                let columns = kernel_columns(group);
                let Some((slopes, bulk, hardening)) = lane(&phases, model.has_memory) else {
                    most_phases = most_phases.max(phases.len());
                    others.push(SinglePair {
                        pair: pair as u32,
                        blocks: places(model, pattern, group, i, [0, 1, 2, 3]),
                    });
                    continue;
                };
                let past = model.has_memory.then(|| phases[0].phase.material as usize);
                let with_room = open.iter().find(|&&b| {
                    let batch = &batches[b];
                    batch.hardening == hardening && batch.past.as_ref().map(|p| p.material) == past
                });
                let index = with_room.copied().unwrap_or(batches.len());
                if index == batches.len() {
                    let batch = LaneBatch::empty(model, hardening, tangent, past);
                    batches.push(Box::new(batch));
                    open.push(index);
                }
                batches[index].push(model, pattern, g, i, columns);
                batches[index].stiffen(slopes, bulk, bulk * model.shares(i).apart);
                if batches[index].n == WIDTH {
                    open.retain(|&b| b != index);
                }
            }
        }
        for batch in &mut batches {
            batch.fill();
        }
        Self {
            full: batches,
            others,
            local_double: Box::new(Local::new()),
            local_single: Box::new(Local::new()),
            response: GroupResponse::new(),
            phases: Vec::with_capacity(most_phases),
        }
    }

    /// Starts a step: takes over stiffness and constant stresses of materials with memory. `memory`
    /// must already be set up for the step's duration.
    pub(crate) fn begin(&mut self, model: &Model, memory: &mut Memory, state: &State) {
        if !model.has_memory {
            return;
        }
        self.begin_others(model, memory, state);
        self.begin_lanes(memory);
    }

    /// The pairs that are not in lanes: they are evaluated one by one.
    pub(crate) fn singles(&self) -> impl Iterator<Item = u32> {
        self.others.iter().map(|other| other.pair)
    }

    /// As [`Self::begin`], for the pairs that are not in lanes.
    fn begin_others(&self, model: &Model, memory: &mut Memory, state: &State) {
        for other in &self.others {
            memory.begin_group(model, state, other.pair as usize);
        }
    }

    /// As [`Self::begin`], for the pairs in lanes.
    pub(crate) fn begin_lanes(&mut self, memory: &Memory) {
        for batch in &mut self.full {
            batch.begin(memory);
        }
    }

    /// As [`Self::begin`], where `memory` holds the constant stresses of all pairs.
    pub(crate) fn begin_with(&mut self, model: &Model, memory: &Memory) {
        if model.has_memory {
            let full = self.full.par_iter_mut();
            full.for_each(|batch| batch.begin_with(model, memory));
        }
    }

    /// Ends a step: updates the memory of every point.
    pub(crate) fn commit(&mut self, model: &Model, memory: &Memory, state: &mut State) {
        if !model.has_memory {
            return;
        }
        self.commit_others(model, memory, state);
        self.commit_lanes(memory, &state.displacements);
    }

    /// As [`Self::commit`], for the pairs that are not in lanes.
    fn commit_others(&self, model: &Model, memory: &Memory, state: &mut State) {
        for other in &self.others {
            memory.commit_group(model, state, other.pair as usize);
        }
    }

    /// As [`Self::commit`], for the pairs in lanes.
    pub(crate) fn commit_lanes(&mut self, memory: &Memory, displacements: &[Vec3]) {
        Arch::new().dispatch(Remember {
            full: &mut self.full,
            local: &mut self.local_double,
            displacements,
            memory,
        });
    }

    /// Adds `∂W/∂u` of these prisms, N.
    pub(crate) fn add_forces(
        &mut self,
        model: &Model,
        memory: &Memory,
        displacements: &[Vec3],
        forces: &mut [Vec3],
    ) -> Result<(), Inverted> {
        let pass = Forces {
            full: &self.full,
            local: &mut self.local_double,
            displacements,
            into: forces,
        };
        Arch::new()
            .dispatch(pass)
            .map_err(|pair| inverted(model, pair))?;
        self.for_others(model, memory, displacements, false, |other, response| {
            let (group, nodes) = group_nodes(model, other.pair as usize);
            for (n, &node) in nodes.iter().enumerate().take(group.n_nodes()) {
                forces[node] += response.forces[n];
            }
        })
    }

    /// Adds the stiffness of these prisms to the blocks of the pattern, N/m. An extra block past
    /// the pattern's end receives the blocks of nodes that cannot move.
    pub(crate) fn add_stiffness(
        &mut self,
        model: &Model,
        memory: &Memory,
        displacements: &[Vec3],
        blocks: &mut [Block<f32>],
        pressure: Pressure<'_>,
    ) -> Result<(), Inverted> {
        let pass = Tangents {
            pressure,
            full: &self.full,
            local: &mut self.local_single,
            displacements,
            blocks,
        };
        Arch::new()
            .dispatch(pass)
            .map_err(|pair| inverted(model, pair))?;
        self.for_others(model, memory, displacements, true, |other, response| {
            other.add_blocks(response, blocks);
        })
    }

    /// Evaluates the pairs that are not in lanes, one after the other.
    fn for_others(
        &mut self,
        model: &Model,
        memory: &Memory,
        displacements: &[Vec3],
        with_tangent: bool,
        mut act: impl FnMut(&SinglePair, &GroupResponse),
    ) -> Result<(), Inverted> {
        let (response, mut phases) = (&mut self.response, recycled(&mut self.phases));
        let result = self.others.iter().try_for_each(|other| {
            let phases = &mut phases;
            other.evaluate(model, memory, displacements, phases, response, with_tangent)?;
            act(other, response);
            Ok(())
        });
        self.phases = recycled(&mut phases);
        result
    }
}
