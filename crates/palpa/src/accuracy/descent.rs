//! A press on one mesh, on its way down.

use palpa_mesh::refine::mean_depths;
use palpa_mesh::{LayeredBody, Vec3};

use super::probe::{self, Base};
use super::{DEPTHS, ErrorBars, loading};
use crate::press::tissue::{Deformed, Indentation, Record, Sample};
use crate::skin::Skin;

/// Depths closer than this are the same, as a share of the deepest.
const SAME: f64 = 1e-9;

/// Equilibria on the way down, at the deepest and some smaller depths, on one mesh. They are elastic,
/// without a history.
#[derive(Debug)]
pub struct Descent {
    /// The mesh.
    body: LayeredBody,
    /// The equilibria, the deepest first; at least one.
    pub(super) bases: Vec<Base>,
}

impl Descent {
    /// Finds the equilibria from rest; `None` if there is none at the deepest, if the tool does not
    /// touch there, or if `goes_on`, which is asked before each step, returns false.
    pub fn from_rest(press: &Indentation, goes_on: impl FnMut() -> bool) -> Option<Self> {
        let deepest = press.prepared.scene.press.depth;
        let found = press.elastic_from_rest(&mut press.workspace(), deepest, goes_on);
        let at = |depth: &f64| {
            DEPTHS
                .iter()
                .any(|s| (s * deepest - depth).abs() < SAME * deepest)
        };
        let found = found.into_iter().rev().filter(|(depth, ..)| at(depth));
        let bases = found.filter_map(|(depth, force, deformed)| Base::new(depth, force, deformed));
        Self::new(press, bases.collect()).filter(|found| found.bases[0].depth >= deepest)
    }

    /// Finds the equilibria near those on another mesh of the same body; `None` if none is found at
    /// the deepest, or if `goes_on`, which is asked at each depth, returns false there.
    pub fn near(
        press: &Indentation,
        other: &Self,
        mut goes_on: impl FnMut() -> bool,
    ) -> Option<Self> {
        let mut ws = press.workspace();
        let skin = Skin::new(&other.body.skin);
        let mut near = |base: &Base| {
            if !goes_on() {
                return None;
            }
            let guess = carried(&other.body, &skin, &base.deformed, &press.mesh().body);
            Base::near(press, &mut ws, base.depth, &guess)
        };
        let (deepest, rest) = other.bases.split_first()?;
        let bases = std::iter::once(near(deepest)?).chain(rest.iter().filter_map(near));
        let bases = bases.collect();
        Self::new(press, bases)
    }

    /// Finds the equilibria near the stops of a press down, with nothing moved outside the part that is
    /// probed, as in the probes; `None` if none is found. Nothing is gained for tissue without a
    /// history, where the stops are equilibria already.
    pub fn in_part(press: &Indentation, stops: &Stops) -> Option<Self> {
        Self::new(press, probe::settle_part(press, &stops.0))
    }

    /// Finds the equilibria of the whole body near the stops of a press down; `None` if none is found.
    pub fn at(press: &Indentation, stops: &Stops) -> Option<Self> {
        let mut ws = press.workspace();
        let mut near = |(depth, guess): &(f64, Deformed)| Base::near(press, &mut ws, *depth, guess);
        let bases = stops.0.iter().filter_map(&mut near).collect();
        Self::new(press, bases)
    }

    fn new(press: &Indentation, bases: Vec<Base>) -> Option<Self> {
        (!bases.is_empty()).then(|| Self {
            body: press.mesh().body.clone(),
            bases,
        })
    }

    /// The equilibrium at the deepest only.
    #[must_use]
    pub fn only_deepest(mut self) -> Self {
        self.bases.truncate(1);
        self
    }

    /// Force on the tool at the deepest, N.
    pub fn force_n(&self) -> f64 {
        self.bases[0].force_n
    }

    /// Probes the press. `progress` is called before each probe with its number and the number of
    /// all; if it returns false, the probes are given up, and there is no result.
    pub fn probe(
        &self,
        press: &Indentation,
        mut progress: impl FnMut(usize, usize) -> bool,
    ) -> Option<ErrorBars> {
        probe::run(press, &self.bases, &mut progress)
    }
}

/// Depths (m) and deformed bodies of the first press down of a record, the deepest first: near the
/// equilibria that are probed.
#[derive(Debug)]
pub struct Stops(Vec<(f64, Deformed)>);

impl Stops {
    /// The stops of a record so far; none if no sample with a depth converged.
    ///
    /// # Panics
    /// If the record is not [`Record::with_displacements`].
    pub fn of(record: &Record<'_>) -> Self {
        let loading = loading(&record.samples, 0);
        let deepest = loading.last().map_or(0.0, |s| s.depth_mm);
        let below: Vec<&Sample> = (loading.into_iter())
            .filter(|s| s.depth_mm > SAME * deepest)
            .collect();
        let nearest = |share: &f64| {
            let off = |s: &&&Sample| (s.depth_mm - share * deepest).abs();
            let nearest = below.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
            nearest.map(|s| s.depth_mm)
        };
        let mut depths: Vec<f64> = DEPTHS.iter().filter_map(nearest).collect();
        depths.dedup();
        let stop = |depth_mm: f64| {
            let same = |s: &Sample| (s.depth_mm - depth_mm).abs() < SAME * deepest;
            let index = record.samples.iter().position(same)?;
            let depth = depth_mm * 1e-3;
            let displacements = record.displacements(index);
            Some((depth, record.indentation().deformed(displacements, depth)))
        };
        Self(depths.into_iter().filter_map(stop).collect())
    }
}

/// The deformed body of a mesh with this skin, carried to another mesh of the same body.
fn carried(from: &LayeredBody, skin: &Skin, deformed: &Deformed, to: &LayeredBody) -> Deformed {
    let mut displacements = Vec::with_capacity(to.n_nodes());
    let mut pressures = vec![0.0; to.n_vertices()];
    for (v, p) in to.skin.points.iter().enumerate() {
        let Some(point) = skin.nearest(*p) else {
            displacements.extend(vec![Vec3::zeros(); to.n_levels]);
            continue;
        };
        pressures[v] = point.mean(|v| Vec3::repeat(deformed.pressures[v])).x;
        let mean = |field: &[Vec3], l: usize| point.mean(|v| field[from.node(v, l)]);
        let mut old = vec![0.0; from.n_levels];
        for l in 1..from.n_levels {
            let below = mean(&from.positions, l) - mean(&from.positions, l - 1);
            old[l] = old[l - 1] + below.norm();
        }
        let new = mean_depths(to, &[v as u32]);
        let stretch = old[old.len() - 1] / new[new.len() - 1];
        for at in new.into_iter().map(|at| at * stretch) {
            let below = old.partition_point(|&l| l < at).clamp(1, old.len() - 1);
            let share = (at - old[below - 1]) / (old[below] - old[below - 1]);
            let ends = [below - 1, below].map(|l| mean(&deformed.displacements, l));
            displacements.push(ends[0].lerp(&ends[1], share.clamp(0.0, 1.0)));
        }
    }
    Deformed {
        displacements,
        pressures,
    }
}
