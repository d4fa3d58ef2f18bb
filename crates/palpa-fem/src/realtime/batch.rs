//! Pairs of prisms in batches of sixteen, of one interval and one kind of law, as the kernel takes them.
//!
//! Pairs whose law is not one of the kernel's are evaluated one by one.

#![expect(
    clippy::inline_always,
    reason = "what runs in the machine's vectors must be compiled with their instructions, in their caller"
)]

use palpa_mesh::Vec3;
use palpa_sparse::fronts::Number;
use palpa_sparse::{Block, ColumnPattern};
use pulp::{Arch, Simd, WithSimd};

use super::kernel::{
    Constant, Geometry, Local, N_BLOCKS, N_NODES, N_POINTS, Row, Stiffness, WIDTH, elastic,
    evaluate,
};
use super::lanes::{Doubles, Lanes, Singles};
use crate::assembly::{Inverted, phases_at};
use crate::columns::SurfaceGroup;
use crate::element::{GroupResponse, PhaseAt};
use crate::law::{Hardening, Prony, PronyStep, six_of};
use crate::model::Model;
use crate::state::{Memory, State, in_plane};

/// Set in the place of a block that is to be added turned.
const TURNED: u32 = 1 << 31;

/// Numbers of a batch in one precision.
#[derive(Debug)]
struct Numbers<E> {
    geometry: Geometry<E>,
    stiffness: Stiffness<E>,
    constant: Option<Constant<E>>,
}

#[derive(Debug)]
struct Batch {
    /// Pairs that are really there; the other lanes repeat the first.
    n: usize,
    hardening: Hardening,
    /// Index of the geometry and phases of each pair.
    pairs: [u32; WIDTH],
    /// Nodes in the order of the kernel.
    nodes: [[u32; WIDTH]; N_NODES],
    double: Numbers<f64>,
    /// Of a body that has a memory.
    past: Option<Box<Past>>,
    /// For tangents: in single precision, and where they go.
    tangent: Option<(Numbers<f32>, [[u32; WIDTH]; N_BLOCKS])>,
}

/// What the pairs of a batch, all of one material, remember.
#[derive(Debug)]
struct Past {
    material: usize,
    relaxes_volume: bool,
    /// Without the factors of a step.
    rest: Stiffness<f64>,
    /// Tension in the plane of the layer, `xx, yy, zz, xy, yz, zx`, Pa.
    tension: [Row<f64>; 6],
    /// The last elastic stress, then the memory of each term, Pa.
    rows: Vec<Constant<f64>>,
}

/// Memories of all pairs of a body, on their way from zone to zone.
#[derive(Debug, Clone)]
pub(super) struct History {
    n_rows: usize,
    /// `[pair][row][six stresses at six points, pressure]`, Pa
    numbers: Vec<f64>,
    is_known: Vec<bool>,
}

/// Numbers of a row of a pair.
const ROW: usize = 6 * N_POINTS + 1;

impl History {
    pub(super) fn new(model: &Model) -> Self {
        let rows = |m: &crate::Material| m.prony.as_ref().map_or(0, crate::law::Prony::n_rows);
        let n_rows = model.materials.iter().map(rows).max().unwrap_or(0);
        let n_pairs = if model.has_memory {
            model.geometries.len()
        } else {
            0
        };
        Self {
            n_rows,
            numbers: vec![0.0; n_pairs * n_rows * ROW],
            is_known: vec![false; n_pairs],
        }
    }

    /// Takes over what the pairs of another body remember in which this pair's two wedges are, and which of their two.
    pub(super) fn carry(&mut self, pair: usize, from: &Self, old: [(usize, usize); 2]) {
        if !old.iter().all(|&(old, _)| from.is_known[old]) {
            return;
        }
        self.is_known[pair] = true;
        for row in 0..self.n_rows {
            let into = self.row(pair, row);
            let into = &mut self.numbers[into];
            let [a, b] = old.map(|(old, _)| &from.numbers[from.row(old, row)]);
            let mean = |i: usize| 0.5 * (a[i] + b[i]);
            // The means of a pair at its two depths, and its pressure.
            (0..12).chain([ROW - 1]).for_each(|i| into[i] = mean(i));
            for ((k, (_, half)), old) in old.into_iter().enumerate().zip([a, b]) {
                into[12 * (k + 1)..12 * (k + 2)]
                    .copy_from_slice(&old[12 * (half + 1)..12 * (half + 2)]);
            }
        }
    }

    fn row(&self, pair: usize, row: usize) -> std::ops::Range<usize> {
        let first = (pair * self.n_rows + row) * ROW;
        first..first + ROW
    }
}

/// A pair whose law is not the kernel's.
#[derive(Debug)]
struct Other {
    pair: u32,
    blocks: [u32; N_BLOCKS],
}

/// The prisms of some part of a body.
#[derive(Debug)]
pub(super) struct Batches {
    full: Vec<Box<Batch>>,
    others: Vec<Other>,
    local_double: Box<Local<f64>>,
    local_single: Box<Local<f32>>,
    response: GroupResponse,
}

/// Local columns in the order of the kernel: the first wedge's own, the two that are shared, the second's own.
fn kernel_columns(group: &SurfaceGroup) -> [usize; 4] {
    let [first, second] = group.shape.wedges.map(|w| w.map(usize::from));
    if group.shape.n_wedges == 1 {
        return [first[0], first[1], first[2], first[0]];
    }
    let shared: Vec<usize> = first.into_iter().filter(|c| second.contains(c)).collect();
    let own = |wedge: [usize; 3], other: [usize; 3]| {
        wedge
            .into_iter()
            .find(|c| !other.contains(c))
            .unwrap_or(wedge[0])
    };
    [own(first, second), shared[0], shared[1], own(second, first)]
}

/// Half the shear modulus at rest and bulk modulus of a group, per point and for its volume, and how it hardens; none if its law is not the
/// kernel's.
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

impl Batches {
    /// The prisms under the groups that `keep` names. With tangents they can be assembled into blocks of the pattern.
    pub(super) fn new(
        model: &Model,
        memory: &Memory,
        pattern: &ColumnPattern,
        keep: &dyn Fn(&SurfaceGroup) -> bool,
        with_tangent: bool,
    ) -> Self {
        let mut batches: Vec<Box<Batch>> = Vec::new();
        let mut others = Vec::new();
        let mut phases = Vec::new();
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
                    others.push(Other {
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
                    let batch = Batch::empty(model, hardening, with_tangent, past);
                    batches.push(Box::new(batch));
                    open.push(index);
                }
                batches[index].push(model, pattern, g, i, columns);
                batches[index].stiffen(slopes, bulk);
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
        }
    }

    /// Takes over what a step's duration (`memory` has begun with) and the past make of materials that have a memory.
    pub(super) fn begin(&mut self, model: &Model, memory: &mut Memory, state: &State) {
        if !model.has_memory {
            return;
        }
        self.begin_others(model, memory, state);
        self.begin_lanes(memory);
    }

    /// The same for the pairs that are not in lanes.
    pub(super) fn begin_others(&self, model: &Model, memory: &mut Memory, state: &State) {
        for other in &self.others {
            memory.begin_group(model, state, other.pair as usize);
        }
    }

    /// The same for the pairs in lanes.
    pub(super) fn begin_lanes(&mut self, memory: &Memory) {
        for batch in &mut self.full {
            batch.begin(memory);
        }
    }

    /// Ends a step: every point remembers.
    pub(super) fn commit(&mut self, model: &Model, memory: &Memory, state: &mut State) {
        if !model.has_memory {
            return;
        }
        self.commit_others(model, memory, state);
        self.commit_lanes(memory, &state.displacements);
    }

    /// The same for the pairs that are not in lanes.
    pub(super) fn commit_others(&self, model: &Model, memory: &Memory, state: &mut State) {
        for other in &self.others {
            memory.commit_group(model, state, other.pair as usize);
        }
    }

    /// The same for those that are.
    pub(super) fn commit_lanes(&mut self, memory: &Memory, displacements: &[Vec3]) {
        Arch::new().dispatch(Remember {
            full: &mut self.full,
            local: &mut self.local_double,
            displacements,
            memory,
        });
    }

    /// Puts down what the pairs remember.
    pub(super) fn store(&self, history: &mut History) {
        for batch in &self.full {
            let Some(past) = &batch.past else { continue };
            for (lane, &pair) in batch.pairs.iter().enumerate().take(batch.n) {
                history.is_known[pair as usize] = true;
                for (r, row) in past.rows.iter().enumerate() {
                    let range = history.row(pair as usize, r);
                    let numbers = row.stress.iter().flatten().chain([&row.pressure]);
                    for (into, from) in history.numbers[range].iter_mut().zip(numbers) {
                        *into = from[lane];
                    }
                }
            }
        }
    }

    /// Takes up what is known of these pairs.
    pub(super) fn load(&mut self, history: &History) {
        for batch in &mut self.full {
            let Some(past) = &mut batch.past else {
                continue;
            };
            for (lane, &pair) in batch.pairs.iter().enumerate() {
                if !history.is_known[pair as usize] {
                    continue;
                }
                for (r, row) in past.rows.iter_mut().enumerate() {
                    let range = history.row(pair as usize, r);
                    let numbers = row.stress.iter_mut().flatten().chain([&mut row.pressure]);
                    for (into, from) in numbers.zip(&history.numbers[range]) {
                        into[lane] = *from;
                    }
                }
            }
        }
    }

    /// Adds `∂W/∂u` of these prisms, N.
    pub(super) fn add_forces(
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
        let mut phases = Vec::new();
        for other in &self.others {
            let pair = other.pair as usize;
            one_by_one(
                model,
                memory,
                pair,
                displacements,
                &mut phases,
                &mut self.response,
                false,
            )?;
            let (group, nodes) = group_nodes(model, pair);
            for (n, &node) in nodes.iter().enumerate().take(group.n_nodes()) {
                forces[node] += self.response.forces[n];
            }
        }
        Ok(())
    }

    /// Adds the stiffness of these prisms to the blocks of the pattern, one of which, past its end, is for what has no
    /// place. N/m
    pub(super) fn add_stiffness(
        &mut self,
        model: &Model,
        memory: &Memory,
        displacements: &[Vec3],
        blocks: &mut [Block<f32>],
    ) -> Result<(), Inverted> {
        let pass = Tangents {
            full: &self.full,
            local: &mut self.local_single,
            displacements,
            blocks,
        };
        Arch::new()
            .dispatch(pass)
            .map_err(|pair| inverted(model, pair))?;
        let mut phases = Vec::new();
        for other in &self.others {
            let pair = other.pair as usize;
            one_by_one(
                model,
                memory,
                pair,
                displacements,
                &mut phases,
                &mut self.response,
                true,
            )?;
            for (place, block) in other.blocks.iter().zip(&self.response.stiffness) {
                let into = &mut blocks[(place & !TURNED) as usize];
                for r in 0..3 {
                    for c in 0..3 {
                        let at = if place & TURNED == 0 {
                            r + 3 * c
                        } else {
                            c + 3 * r
                        };
                        into[at] += block[(r, c)] as f32;
                    }
                }
            }
        }
        Ok(())
    }
}

fn group_nodes(model: &Model, pair: usize) -> (&SurfaceGroup, [usize; N_NODES]) {
    let (i, g) = (pair / model.n_groups(), pair % model.n_groups());
    (&model.structure.groups[g], model.group_nodes(g, i))
}

fn one_by_one<'a>(
    model: &'a Model,
    memory: &'a Memory,
    pair: usize,
    displacements: &[Vec3],
    phases: &mut Vec<PhaseAt<'a>>,
    response: &mut GroupResponse,
    with_tangent: bool,
) -> Result<(), Inverted> {
    phases_at(model, memory, pair, phases);
    let (group, nodes) = group_nodes(model, pair);
    crate::element::evaluate(
        group.shape,
        &model.geometries[pair],
        &nodes.map(|n| displacements[n]),
        phases,
        model.params.alpha,
        with_tangent,
        response,
    );
    if response.energy.is_finite() {
        Ok(())
    } else {
        Err(inverted(model, pair as u32))
    }
}

fn inverted(model: &Model, pair: u32) -> Inverted {
    let (_, nodes) = group_nodes(model, pair as usize);
    Inverted {
        at: nodes.iter().map(|&n| model.body.positions[n]).sum::<Vec3>() / N_NODES as f64,
    }
}

/// Where the blocks between the nodes of a group go, given the local column of each of the kernel's.
fn places(
    model: &Model,
    pattern: &ColumnPattern,
    group: &SurfaceGroup,
    interval: usize,
    columns: [usize; 4],
) -> [u32; N_BLOCKS] {
    let nowhere = pattern.n_blocks() as u32;
    let n_free = model.structure.n_free_levels;
    let mut places = [nowhere; N_BLOCKS];
    for a in 0..N_NODES {
        for b in 0..=a {
            let (ca, cb) = (a / 2, b / 2);
            // In a single prism the fourth column is there for the form.
            if ca.max(cb) >= group.n_columns() {
                continue;
            }
            let (la, lb) = (interval + a % 2, interval + b % 2);
            if la.max(lb) >= n_free {
                continue;
            }
            let va = group.vertices[columns[ca]] as usize;
            let vb = group.vertices[columns[cb]] as usize;
            places[a * (a + 1) / 2 + b] = if va == vb {
                (pattern.own(va) + 2 * lb + la - lb) as u32
            } else {
                let (row, column, k, l) = if va > vb {
                    (va, vb, la, lb)
                } else {
                    (vb, va, lb, la)
                };
                let Some(pair) = pattern.find(row, column) else {
                    continue;
                };
                let place = (pattern.between(pair) + 3 * l + k + 1 - l) as u32;
                if va > vb { place } else { place | TURNED }
            };
        }
    }
    places
}

impl Batch {
    fn empty(model: &Model, hardening: Hardening, with_tangent: bool, past: Option<usize>) -> Self {
        let has_memory = past.is_some();
        Self {
            past: past.map(|material| Box::new(Past::new(model, material))),
            n: 0,
            hardening,
            pairs: [0; WIDTH],
            nodes: [[0; WIDTH]; N_NODES],
            double: Numbers::new(has_memory),
            tangent: with_tangent.then(|| (Numbers::new(has_memory), [[0; WIDTH]; N_BLOCKS])),
        }
    }

    fn push(
        &mut self,
        model: &Model,
        pattern: &ColumnPattern,
        g: usize,
        interval: usize,
        columns: [usize; 4],
    ) {
        let lane = self.n;
        self.n += 1;
        let group = &model.structure.groups[g];
        let pair = interval * model.n_groups() + g;
        self.pairs[lane] = pair as u32;
        for (n, nodes) in self.nodes.iter_mut().enumerate() {
            let vertex = group.vertices[columns[n / 2]] as usize;
            nodes[lane] = model.body.node(vertex, interval + n % 2) as u32;
        }
        self.double.shape(model, pair, lane, columns);
        if let Some(past) = &mut self.past {
            let tension = in_plane(model, pair) * model.materials[past.material].prestress;
            for (row, value) in past.tension.iter_mut().zip(six_of(&tension)) {
                row[lane] = value;
            }
        }
        if let Some((single, blocks)) = &mut self.tangent {
            single.shape(model, pair, lane, columns);
            let places = places(model, pattern, group, interval, columns);
            for (row, place) in blocks.iter_mut().zip(places) {
                row[lane] = place;
            }
        }
    }

    /// Gives the pair that was pushed last its stiffness.
    fn stiffen(&mut self, slopes: [f64; N_POINTS], bulk: f64) {
        let lane = self.n - 1;
        if let Some(past) = &mut self.past {
            past.rest.put(lane, slopes, bulk);
        }
        self.double.stiffness.put(lane, slopes, bulk);
        if let Some((single, _)) = &mut self.tangent {
            single.stiffness.put(lane, slopes, bulk);
        }
    }

    fn begin(&mut self, memory: &Memory) {
        let (Some(past), Some(constant)) = (&self.past, &mut self.double.constant) else {
            return;
        };
        let scale = memory.scales[past.material];
        for (row, rest) in self.double.stiffness.slope.iter_mut().zip(&past.rest.slope) {
            *row = rest.map(|x| x * scale[0]);
        }
        self.double.stiffness.bulk = past.rest.bulk.map(|x| x * scale[1]);
        let factors = memory.step_of(past.material).map(PronyStep::factors);
        for point in 0..N_POINTS {
            for k in 0..6 {
                let mut sum = past.tension[k];
                if let Some((decay, gain)) = &factors {
                    past.add_memory(|row| &row.stress[point][k], decay, gain, &mut sum);
                }
                constant.stress[point][k] = sum;
            }
        }
        constant.pressure = [0.0; WIDTH];
        if let Some((decay, gain)) = factors.filter(|_| past.relaxes_volume) {
            past.add_memory(|row| &row.pressure, &decay, &gain, &mut constant.pressure);
        }
        if let Some((single, _)) = &mut self.tangent {
            single.take_over(&self.double);
        }
    }

    /// Fills lanes that have no pair with the first.
    fn fill(&mut self) {
        for lane in self.n..WIDTH {
            self.pairs[lane] = self.pairs[0];
            for nodes in &mut self.nodes {
                nodes[lane] = nodes[0];
            }
            self.double.copy_first(lane);
            if let Some(past) = &mut self.past {
                past.rest.copy_first(lane);
                for row in &mut past.tension {
                    row[lane] = row[0];
                }
            }
            if let Some((single, _)) = &mut self.tangent {
                single.copy_first(lane);
            }
        }
    }
}

impl<E: Number> Numbers<E> {
    fn new(has_memory: bool) -> Self {
        let zero = [E::default(); WIDTH];
        Self {
            geometry: Geometry {
                gradients: [[[[zero; 3]; 6]; 2]; 2],
                volumes: [[zero; 2]; 2],
                thickness: [zero; 3],
                thickness_gradient: [zero; 3],
                alpha: zero,
            },
            stiffness: Stiffness {
                slope: [zero; N_POINTS],
                bulk: zero,
            },
            constant: has_memory.then_some(Constant {
                stress: [[zero; 6]; N_POINTS],
                pressure: zero,
            }),
        }
    }

    fn shape(&mut self, model: &Model, pair: usize, lane: usize, columns: [usize; 4]) {
        let group = &model.structure.groups[pair % model.n_groups()];
        let from = &model.geometries[pair];
        let geometry = &mut self.geometry;
        let is_pair = group.shape.n_wedges == 2;
        for w in 0..2 {
            for n in 0..6 {
                let column = columns[w + n / 2] as u8;
                let wedge = group.shape.wedges[w];
                let corner = wedge.iter().position(|&c| c == column).unwrap_or(0) + 3 * (n % 2);
                for q in 0..2 {
                    for c in 0..3 {
                        geometry.gradients[w][q][n][c][lane] =
                            E::nearest(from.wedges[w].gradients[q][corner][c]);
                    }
                }
            }
            for q in 0..2 {
                geometry.volumes[w][q][lane] = E::nearest(from.wedges[w].volumes[q]);
            }
        }
        for c in 0..3 {
            geometry.thickness[c][lane] = E::nearest(from.thickness[c]);
            geometry.thickness_gradient[c][lane] = E::nearest(from.thickness_gradient[c]);
        }
        geometry.alpha[lane] = E::nearest(if is_pair { model.params.alpha } else { 0.0 });
    }

    /// Takes over what a step has changed, in another precision.
    fn take_over(&mut self, from: &Numbers<f64>) {
        let row = |row: &Row<f64>| row.map(E::nearest);
        self.stiffness.slope = std::array::from_fn(|p| row(&from.stiffness.slope[p]));
        self.stiffness.bulk = row(&from.stiffness.bulk);
        if let (Some(constant), Some(from)) = (&mut self.constant, &from.constant) {
            for (rows, from) in constant
                .stress
                .iter_mut()
                .flatten()
                .zip(from.stress.iter().flatten())
            {
                *rows = row(from);
            }
            constant.pressure = row(&from.pressure);
        }
    }

    fn copy_first(&mut self, lane: usize) {
        let copy = |row: &mut Row<E>| row[lane] = row[0];
        let geometry = &mut self.geometry;
        geometry
            .gradients
            .iter_mut()
            .flatten()
            .flatten()
            .flatten()
            .for_each(copy);
        geometry.volumes.iter_mut().flatten().for_each(copy);
        geometry.thickness.iter_mut().for_each(copy);
        geometry.thickness_gradient.iter_mut().for_each(copy);
        copy(&mut geometry.alpha);
        self.stiffness.copy_first(lane);
    }
}

impl<E: Number> Stiffness<E> {
    fn put(&mut self, lane: usize, slopes: [f64; N_POINTS], bulk: f64) {
        for (row, slope) in self.slope.iter_mut().zip(slopes) {
            row[lane] = E::nearest(slope);
        }
        self.bulk[lane] = E::nearest(bulk);
    }

    fn copy_first(&mut self, lane: usize) {
        for row in self.slope.iter_mut().chain([&mut self.bulk]) {
            row[lane] = row[0];
        }
    }
}

impl Past {
    fn new(model: &Model, material: usize) -> Self {
        let zero = [0.0; WIDTH];
        let prony = model.materials[material].prony.as_ref();
        let empty = Constant {
            stress: [[zero; 6]; N_POINTS],
            pressure: zero,
        };
        Self {
            material,
            relaxes_volume: prony.is_some_and(Prony::relaxes_volume),
            rest: Stiffness {
                slope: [zero; N_POINTS],
                bulk: zero,
            },
            tension: [zero; 6],
            rows: vec![empty; prony.map_or(0, Prony::n_rows)],
        }
    }

    /// Adds `Σ decay · memory − gain · last`.
    #[inline(always)]
    fn add_memory<'a>(
        &'a self,
        of: impl Fn(&'a Constant<f64>) -> &'a Row<f64>,
        decay: &[f64],
        gain: &[f64],
        sum: &mut Row<f64>,
    ) {
        let Some((last, rows)) = self.rows.split_first() else {
            return;
        };
        let last = of(last);
        for (row, (decay, gain)) in rows.iter().zip(decay.iter().zip(gain)) {
            let row = of(row);
            for lane in 0..WIDTH {
                sum[lane] += decay * row[lane] - gain * last[lane];
            }
        }
    }
}

/// Moves the memories of all batches on.
struct Remember<'a> {
    full: &'a mut [Box<Batch>],
    local: &'a mut Local<f64>,
    displacements: &'a [Vec3],
    memory: &'a Memory,
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
                elastic::<Doubles<S>>(
                    simd,
                    at,
                    &batch.double.geometry,
                    &past.rest,
                    batch.hardening,
                    self.local,
                    &mut new,
                );
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
    fn new() -> Self {
        let zero = [E::default(); WIDTH];
        Self {
            displacements: [[zero; 3]; N_NODES],
            forces: [[zero; 3]; N_NODES],
            stiffness: [[zero; 9]; N_BLOCKS],
        }
    }

    #[inline(always)]
    fn gather(&mut self, nodes: &[[u32; WIDTH]; N_NODES], displacements: &[Vec3]) {
        for (rows, nodes) in self.displacements.iter_mut().zip(nodes) {
            for (lane, &node) in nodes.iter().enumerate() {
                let u = &displacements[node as usize];
                for c in 0..3 {
                    rows[c][lane] = E::nearest(u[c]);
                }
            }
        }
    }
}

/// A batch in one precision; returns whether all its points are the right way out.
#[inline(always)]
fn run<R: Lanes, const TANGENT: bool>(
    token: R::Token,
    numbers: &Numbers<R::Element>,
    hardening: Hardening,
    local: &mut Local<R::Element>,
) -> bool {
    let mut least = [R::Element::nearest(1.0); WIDTH];
    for at in (0..WIDTH).step_by(R::N) {
        let constant = numbers.constant.as_ref();
        evaluate::<R, TANGENT>(
            token,
            at,
            &numbers.geometry,
            &numbers.stiffness,
            constant,
            hardening,
            local,
        )
        .store(&mut least[at..]);
    }
    least.iter().all(|&j| j > R::Element::default())
}

struct Forces<'a> {
    full: &'a [Box<Batch>],
    local: &'a mut Local<f64>,
    displacements: &'a [Vec3],
    into: &'a mut [Vec3],
}

impl WithSimd for Forces<'_> {
    type Output = Result<(), u32>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        for batch in self.full {
            self.local.gather(&batch.nodes, self.displacements);
            if !run::<Doubles<S>, false>(simd, &batch.double, batch.hardening, self.local) {
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

struct Tangents<'a> {
    full: &'a [Box<Batch>],
    local: &'a mut Local<f32>,
    displacements: &'a [Vec3],
    blocks: &'a mut [Block<f32>],
}

impl WithSimd for Tangents<'_> {
    type Output = Result<(), u32>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        for batch in self.full {
            let Some((single, places)) = &batch.tangent else {
                continue;
            };
            self.local.gather(&batch.nodes, self.displacements);
            if !run::<Singles<S>, true>(simd, single, batch.hardening, self.local) {
                return Err(batch.pairs[0]);
            }
            for (rows, places) in self.local.stiffness.iter().zip(places) {
                for (lane, &place) in places.iter().enumerate().take(batch.n) {
                    let into = &mut self.blocks[(place & !TURNED) as usize];
                    // Rows hold entry (r, c) at 3 r + c, blocks at r + 3 c.
                    for r in 0..3 {
                        for c in 0..3 {
                            let at = if place & TURNED == 0 {
                                r + 3 * c
                            } else {
                                c + 3 * r
                            };
                            into[at] += rows[3 * r + c][lane];
                        }
                    }
                }
            }
        }
        Ok(())
    }
}
