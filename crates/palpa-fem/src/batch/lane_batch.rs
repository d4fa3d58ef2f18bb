//! One batch: sixteen pairs of one interval and one kind of law, in the form that the kernel needs.

#![expect(
    clippy::inline_always,
    reason = "compiled in its caller with the machine's instructions"
)]

use palpa_sparse::ColumnPattern;
use palpa_sparse::fronts::Number;

use super::Tangent;
use super::kernel::{Constant, Geometry, N_BLOCKS, N_NODES, N_POINTS, Row, Stiffness, WIDTH};
use super::places::places;
use crate::law::{Hardening, Prony, PronyStep, six_of};
use crate::model::Model;
use crate::state::{Memory, in_plane};

/// Numbers of a batch in one precision.
#[derive(Debug)]
pub(super) struct Numbers<E> {
    pub(super) geometry: Geometry<E>,
    pub(super) stiffness: Stiffness<E>,
    pub(super) constant: Option<Constant<E>>,
}

/// Sixteen pairs of one interval and one kind of law.
#[derive(Debug)]
pub(super) struct LaneBatch {
    /// Number of pairs; the other lanes repeat the first.
    pub(super) n: usize,
    pub(super) hardening: Hardening,
    /// Index of the geometry and phases of each pair.
    pub(super) pairs: [u32; WIDTH],
    /// Nodes in the order of the kernel.
    pub(super) nodes: [[u32; WIDTH]; N_NODES],
    pub(super) double: Numbers<f64>,
    /// Viscous memory; `None` in a body without memory.
    pub(super) past: Option<Box<Past>>,
    /// The numbers in single precision, for stiffness in that precision.
    pub(super) single: Option<Box<Numbers<f32>>>,
    /// The places of the blocks, for stiffness.
    pub(super) places: Option<Box<[[u32; WIDTH]; N_BLOCKS]>>,
}

/// Memory of the pairs of a batch, all of one material.
#[derive(Debug)]
pub(super) struct Past {
    pub(super) material: usize,
    pub(super) relaxes_volume: bool,
    /// Stiffness at rest, without the factors of a step.
    pub(super) rest: Stiffness<f64>,
    /// Tension in the plane of the layer, `xx, yy, zz, xy, yz, zx`, Pa.
    pub(super) tension: [Row<f64>; 6],
    /// The last elastic stress, then the memory of each term, Pa; empty in statics.
    pub(super) rows: Vec<Constant<f64>>,
}

impl LaneBatch {
    pub(super) fn empty(
        model: &Model,
        hardening: Hardening,
        tangent: Tangent,
        past: Option<usize>,
    ) -> Self {
        let has_memory = past.is_some();
        Self {
            // Statics keeps the memory in its state.
            past: past.map(|material| {
                let keeps_rows = tangent != Tangent::Double;
                Box::new(Past::new(model, material, keeps_rows))
            }),
            single: (tangent == Tangent::Single).then(|| Box::new(Numbers::new(has_memory))),
            places: (tangent != Tangent::None).then(|| Box::new([[0; WIDTH]; N_BLOCKS])),
            n: 0,
            hardening,
            pairs: [0; WIDTH],
            nodes: [[0; WIDTH]; N_NODES],
            double: Numbers::new(has_memory),
        }
    }

    pub(super) fn push(
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
        if let Some(single) = &mut self.single {
            single.shape(model, pair, lane, columns);
        }
        if let Some(rows) = &mut self.places {
            let places = places(model, pattern, group, interval, columns);
            for (row, place) in rows.iter_mut().zip(places) {
                row[lane] = place;
            }
        }
    }

    /// Sets the stiffness of the last added pair: half the shear moduli, the bulk modulus, and what its
    /// wedges have against each other, Pa.
    pub(super) fn stiffen(&mut self, slopes: [f64; N_POINTS], bulk: f64, apart: f64) {
        let lane = self.n - 1;
        if let Some(past) = &mut self.past {
            past.rest.put(lane, slopes, bulk, apart);
        }
        self.double.stiffness.put(lane, slopes, bulk, apart);
        if let Some(single) = &mut self.single {
            single.stiffness.put(lane, slopes, bulk, apart);
        }
    }

    pub(super) fn begin(&mut self, memory: &Memory) {
        let (Some(past), Some(constant)) = (&self.past, &mut self.double.constant) else {
            return;
        };
        self.double.stiffness = past.rest.scaled(memory.scales[past.material]);
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
        if let Some(single) = &mut self.single {
            single.take_over(&self.double);
        }
    }

    /// As [`Self::begin`], with the stresses of `memory`.
    pub(super) fn begin_with(&mut self, model: &Model, memory: &Memory) {
        let (Some(past), Some(constant)) = (&self.past, &mut self.double.constant) else {
            return;
        };
        self.double.stiffness = past.rest.scaled(memory.scales[past.material]);
        for (lane, &pair) in self.pairs.iter().enumerate() {
            let stresses = &memory.overstress[model.first_phase[pair as usize] as usize];
            for (rows, stress) in constant.stress.iter_mut().zip(&stresses.points) {
                for (row, value) in rows.iter_mut().zip(six_of(stress)) {
                    row[lane] = value;
                }
            }
            constant.pressure[lane] = stresses.volume;
        }
    }

    /// Fills unused lanes with the first pair.
    pub(super) fn fill(&mut self) {
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
            if let Some(single) = &mut self.single {
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
                apart: zero,
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
        let alpha = model.shares(pair / model.n_groups()).alpha;
        geometry.alpha[lane] = E::nearest(if is_pair { alpha } else { 0.0 });
    }

    /// Copies the numbers that a step has changed, in another precision.
    fn take_over(&mut self, from: &Numbers<f64>) {
        let row = |row: &Row<f64>| row.map(E::nearest);
        self.stiffness.slope = std::array::from_fn(|p| row(&from.stiffness.slope[p]));
        self.stiffness.bulk = row(&from.stiffness.bulk);
        self.stiffness.apart = row(&from.stiffness.apart);
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

impl Stiffness<f64> {
    /// This stiffness times the factors of a step, of its deviatoric and its volumetric part. What the
    /// wedges have against each other has no memory.
    fn scaled(&self, [deviatoric, volumetric]: [f64; 2]) -> Self {
        Self {
            slope: self.slope.map(|row| row.map(|x| x * deviatoric)),
            bulk: self.bulk.map(|x| x * volumetric),
            apart: self.apart,
        }
    }
}

impl<E: Number> Stiffness<E> {
    fn put(&mut self, lane: usize, slopes: [f64; N_POINTS], bulk: f64, apart: f64) {
        for (row, slope) in self.slope.iter_mut().zip(slopes) {
            row[lane] = E::nearest(slope);
        }
        self.bulk[lane] = E::nearest(bulk);
        self.apart[lane] = E::nearest(apart);
    }

    fn copy_first(&mut self, lane: usize) {
        for row in self
            .slope
            .iter_mut()
            .chain([&mut self.bulk, &mut self.apart])
        {
            row[lane] = row[0];
        }
    }
}

impl Past {
    fn new(model: &Model, material: usize, keeps_rows: bool) -> Self {
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
                apart: zero,
            },
            tension: [zero; 6],
            rows: vec![empty; prony.filter(|_| keeps_rows).map_or(0, Prony::n_rows)],
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
