//! The probes: the same press on finer meshes of the part near the tool.

use palpa_fem::pairing::Pair;
use palpa_fem::{
    Load, Model, Outcome, PosedTool, SolveParams, State, Workspace, assume_pressures, equilibrate,
};
use palpa_mesh::refine::{LevelSplit, RefineParams, Refined, mean_depths, refine, split_levels};
use palpa_mesh::{LayeredBody, Part, Vec3};

use super::{ErrorBars, N_SOURCES, Probed, STAND_IN, Source};
use crate::build::nearest;
use crate::continuum;
use crate::prepare::element_params;
use crate::press::mesh::NEAR;
use crate::press::tissue::{Deformed, Indentation};

/// The part that is probed reaches this far beyond the tool: a multiple of the tissue's depth, and of
/// the tool's reach.
const PART_DEPTHS: f64 = 1.0;
const PART_REACHES: f64 = 2.0;
/// Shares of that distance that are tried until a probe is not too large.
const SMALLER_PARTS: [f64; 3] = [1.0, 0.7, 0.5];
/// Tolerance of the force balance: far below the errors that are looked for.
pub(super) const TOLERANCE: f64 = 1e-4;

/// An equilibrium of a press.
#[derive(Debug)]
pub(super) struct Base {
    /// Depth of the tool, m.
    pub(super) depth: f64,
    pub(super) force_n: f64,
    pub(super) deformed: Deformed,
}

impl Base {
    /// The equilibrium at a depth, m, near a guess; `None` if none is found.
    pub(super) fn near(
        press: &Indentation,
        ws: &mut Workspace,
        depth: f64,
        guess: &Deformed,
    ) -> Option<Self> {
        let (force_n, deformed) = press.elastic(ws, depth, guess)?;
        Self::new(depth, force_n, deformed)
    }

    /// `None` if the tool does not touch yet: then there is no force that a change could be relative
    /// to.
    pub(super) fn new(depth: f64, force_n: f64, deformed: Deformed) -> Option<Self> {
        (force_n != 0.0).then_some(Self {
            depth,
            force_n,
            deformed,
        })
    }
}

/// Probes a press in these equilibria, the deepest first. `progress` as in
/// [`Descent::probe`](super::Descent::probe).
pub(super) fn run(
    press: &Indentation,
    bases: &[Base],
    progress: &mut dyn FnMut(usize, usize) -> bool,
) -> Option<ErrorBars> {
    let mut probed: Vec<Probed> = (bases.iter())
        .map(|base| Probed {
            depth_mm: base.depth * 1e3,
            force_n: base.force_n,
            changes: [None; N_SOURCES],
            is_stand_in: [false; N_SOURCES],
            n_touching: press.is_round().then(|| base.deformed.n_touching()),
            is_bonded: press.is_bonded(),
        })
        .collect();
    let mut n_nodes = 0;
    let mut is_too_large = false;
    let mut moves: [Vec<f64>; N_SOURCES] =
        std::array::from_fn(|_| vec![0.0; press.model.n_nodes()]);
    for (i, source) in Source::ALL.into_iter().enumerate() {
        if !progress(i, Source::ALL.len()) {
            return None;
        }
        let (part, mut probe) = match built(press, source) {
            Built::Probe(part, probe) => (part, probe),
            Built::NothingToDivide => {
                for probed in &mut probed {
                    probed.changes[i] = Some(0.0);
                }
                continue;
            }
            // It has no result, like one without equilibrium.
            Built::TooLarge => {
                is_too_large = true;
                continue;
            }
        };
        n_nodes = n_nodes.max(probe.model.n_nodes());
        // From the least depth on, so that each probe starts with the correction of the one before.
        for (probed, base) in probed.iter_mut().zip(bases).rev() {
            if !progress(i, Source::ALL.len()) {
                return None;
            }
            let found = probe.force(press, base.depth, &part, &base.deformed);
            probed.changes[i] = found.map(|found| (found - base.force_n) / base.force_n);
            if found.is_some() && base.depth >= bases[0].depth {
                probe.mark_moves(press, &part, &mut moves[i]);
            }
        }
    }
    stand_in(&mut probed);
    Some(ErrorBars {
        probed,
        load_step: None,
        n_nodes,
        is_too_large,
        moves,
    })
}

/// The equilibria near these deformed bodies, each with its depth, m, with nothing moved outside the
/// part that is probed.
pub(super) fn settle_part(press: &Indentation, stops: &[(f64, Deformed)]) -> Vec<Base> {
    let part = part(press, 1.0);
    let whole = &press.mesh().body;
    let same: Carry = Box::new(<[Vec3]>::to_vec);
    let Ok(mut probe) = Probe::build(press, &part, &part.body, same) else {
        return Vec::new();
    };
    let mut settle = |(depth, guess): &(f64, Deformed)| {
        let force_n = probe.force(press, *depth, &part, guess)?;
        let mut deformed = guess.clone();
        let moves = probe.corrections.last()?.displacements.iter();
        let nodes = (part.vertices.iter())
            .flat_map(|&v| (0..whole.n_levels).map(move |l| whole.node(v as usize, l)));
        for (node, step) in nodes.zip(moves) {
            deformed.displacements[node] += step;
        }
        Base::new(*depth, force_n, deformed)
    };
    // From the least depth on, like probes.
    let mut bases: Vec<Base> = stops.iter().rev().filter_map(&mut settle).collect();
    bases.reverse();
    bases
}

/// Where a probe found no equilibrium, twice the change at the next smaller depth stands in.
fn stand_in(probed: &mut [Probed]) {
    for i in 0..N_SOURCES {
        let mut last = None;
        for probed in probed.iter_mut().rev() {
            if probed.changes[i].is_none() {
                probed.changes[i] = last.map(|change: f64| STAND_IN * change);
                probed.is_stand_in[i] = last.is_some();
            }
            last = probed.changes[i];
        }
    }
}

/// What becomes of a probe.
enum Built {
    Probe(Box<Part>, Box<Probe>),
    NothingToDivide,
    TooLarge,
}

/// The probe of a source, on the largest part on which it is not too large.
fn built(press: &Indentation, source: Source) -> Built {
    for share in SMALLER_PARTS {
        let part = part(press, share);
        let Some((body, carry)) = divided(press, &part, source) else {
            return Built::NothingToDivide;
        };
        if let Ok(probe) = Probe::build(press, &part, &body, carry) {
            return Built::Probe(part.into(), probe.into());
        }
    }
    Built::TooLarge
}

/// The part of the body that is probed, as far as this share of the usual distance from the tool.
fn part(press: &Indentation, share: f64) -> Part {
    let body = &press.mesh().body;
    let (points, reach) = press.footprint();
    let usual = (PART_DEPTHS * press.place().tissue_depth).max(PART_REACHES * reach);
    let radius = reach + share * usual;
    let skin = &body.skin;
    let mut is_kept: Vec<bool> = (0..skin.triangles.len())
        .map(|t| (skin.corners(t).iter()).any(|p| distance(&points, p) <= radius))
        .collect();
    // No pair is cut: a triangle that is left alone is stiffer.
    for pair in &press.model.pairing().pairs {
        let [a, b] = pair.triangles.map(|t| t as usize);
        let any = is_kept[a] || is_kept[b];
        (is_kept[a], is_kept[b]) = (any, any);
    }
    Part::new(body, |t| is_kept[t])
}

fn distance(points: &[Vec3], p: &Vec3) -> f64 {
    let distances = points.iter().map(|at| (p - at).norm());
    distances.fold(f64::INFINITY, f64::min)
}

/// A finer mesh of the part.
struct Probe {
    model: Model,
    workspace: Workspace,
    /// Carries displacements of the part to the probe.
    carry: Carry,
    /// Nodes that move as in the press.
    border: Vec<usize>,
    /// Nodes that are bonded to the tool.
    bonded: Vec<usize>,
    /// What the probes so far changed, by ascending depth.
    corrections: Vec<Correction>,
}

/// The difference between a probe's displacements and those of the press.
struct Correction {
    /// Depth of the tool, m.
    depth: f64,
    /// Differences, m. `[n_nodes]`
    displacements: Vec<Vec3>,
}

impl Probe {
    /// A probe with another mesh of the part. `carry` carries displacements of the part to it.
    fn build(
        press: &Indentation,
        part: &Part,
        body: &LayeredBody,
        carry: Carry,
    ) -> anyhow::Result<Self> {
        // Marked are the vertices that lie between marked vertices only.
        let per_vertex = |marks: &[bool]| carried_marks(&carry, marks, part, body, 1.0 - 1e-9);
        let mut rim = vec![false; body.n_vertices()];
        for v in body.skin.boundary_loops().into_iter().flatten() {
            rim[v as usize] = true;
        }
        let is_border = per_vertex(&part.is_border);
        let columns = |v: usize| (0..body.n_levels).map(move |l| (v, l));
        let border = (0..body.n_vertices())
            .filter(|&v| is_border[v] && rim[v])
            .flat_map(columns)
            .map(|(v, l)| body.node(v, l))
            .collect();
        let bonded_whole = press.bonded_vertices();
        let mut bonded = Vec::new();
        if !bonded_whole.is_empty() {
            let mut marks = vec![false; press.mesh().body.n_vertices()];
            for v in bonded_whole {
                marks[v] = true;
            }
            let marks = per_vertex(&part.take(&marks, 1));
            bonded.extend(
                (0..body.n_vertices())
                    .filter(|&v| marks[v])
                    .map(|v| body.node(v, 0)),
            );
        }
        let prepared = &press.prepared;
        let supports = continuum::supports(prepared.scene.body.cut_faces, body, &mut Vec::new());
        let params = element_params(&prepared.scene);
        let pairs = pairs_in(press, part);
        let model = Model::build_like(body, &prepared.materials, &supports, params, &pairs)?;
        Ok(Self {
            workspace: Workspace::new(&model),
            model,
            carry,
            border,
            bonded,
            corrections: Vec::new(),
        })
    }

    /// The force at a depth, N, with the deformed body of the press there; `None` if no equilibrium
    /// is found.
    fn force(
        &mut self,
        press: &Indentation,
        depth: f64,
        part: &Part,
        deformed: &Deformed,
    ) -> Option<f64> {
        let n_levels = part.body.n_levels;
        let guess = (self.carry)(&part.take(&deformed.displacements, n_levels));
        let way = press.place().direction.into_inner() * depth;
        let rest = (self.carry)(&part.take(press.rest_displacements(), n_levels));
        let held: Vec<(usize, Vec3)> = (self.border.iter().map(|&node| (node, guess[node])))
            .chain(self.bonded.iter().map(|&node| (node, rest[node] + way)))
            .collect();
        let tools: Vec<PosedTool> = press.tool_at(depth).into_iter().collect();
        let load = Load {
            tools: &tools,
            held: &held,
            ..Load::default()
        };
        let pressures = part.take(&deformed.pressures, 1);
        let pressures = carried_field(&self.carry, &pressures, part, self.model.body());
        let params = SolveParams {
            tolerance: TOLERANCE,
            ..press.near_params()
        };
        let starts = [self.expected_correction(depth), Some(Vec::new())];
        for correction in starts.into_iter().flatten() {
            let mut state = State::new(&self.model);
            state.displacements.clone_from(&guess);
            for (u, more) in state.displacements.iter_mut().zip(&correction) {
                *u += more;
            }
            for &(node, u) in &held {
                state.displacements[node] = u;
            }
            assume_pressures(&self.model, &mut state, &tools, &pressures);
            let report = equilibrate(&self.model, &mut state, &mut self.workspace, &load, &params);
            if report.outcome == Outcome::Converged {
                let displacements = state.displacements.iter().zip(&guess);
                self.corrections.push(Correction {
                    depth,
                    displacements: displacements.map(|(u, guess)| u - guess).collect(),
                });
                return Some(press.force_of(&report, &self.bonded, &self.workspace));
            }
        }
        None
    }

    /// Marks how far the nodes of the press move in the last correction, m.
    fn mark_moves(&self, press: &Indentation, part: &Part, moves: &mut [f64]) {
        let Some(last) = self.corrections.last() else {
            return;
        };
        let (old, new) = (&part.body, self.model.body());
        let (n_levels, n_vertices) = (old.n_levels, old.n_vertices());
        // The first vertices are those of the part. A level of the part is carried to a whole number.
        let levels: Vec<Vec3> = (0..n_vertices)
            .flat_map(|_| (0..n_levels).map(|l| Vec3::repeat(l as f64)))
            .collect();
        let levels = (self.carry)(&levels);
        for (v, &whole) in part.vertices.iter().enumerate() {
            for node in (0..new.n_levels).map(|l| new.node(v, l)) {
                let level = levels[node].x;
                if level.fract() == 0.0 {
                    let at = press.mesh().body.node(whole as usize, level as usize);
                    moves[at] = last.displacements[node].norm();
                }
            }
        }
    }

    /// The difference to the press that is expected at a depth, m, from the two depths before;
    /// `None` at the first.
    fn expected_correction(&self, depth: f64) -> Option<Vec<Vec3>> {
        let [before @ .., last] = &self.corrections[..] else {
            return None;
        };
        let before = before.last();
        let before_depth = before.map_or(0.0, |before| before.depth);
        let share = (depth - last.depth) / (last.depth - before_depth);
        let more = |i: usize, u: &Vec3| {
            let earlier = before.map_or(Vec3::zeros(), |before| before.displacements[i]);
            u + (u - earlier) * share
        };
        Some(
            (last.displacements.iter().enumerate())
                .map(|(i, u)| more(i, u))
                .collect(),
        )
    }
}

/// The corners of the press's pairs of triangles, by the vertices of the part, which are the first
/// vertices of every probe too.
fn pairs_in(press: &Indentation, part: &Part) -> Vec<[u32; 4]> {
    let mut new = vec![None; press.mesh().body.n_vertices()];
    for (i, &v) in (0_u32..).zip(&part.vertices) {
        new[v as usize] = Some(i);
    }
    let corners = |pair: &Pair| {
        let [a, i, j, b] = pair.corners.map(|v| new[v as usize]);
        Some([a?, i?, j?, b?])
    };
    let pairs = press.model.pairing().pairs.iter();
    pairs.filter_map(corners).collect()
}

/// Marks of the part's vertices, carried to a finer mesh of it: a vertex is marked if more than
/// `share` of the vertices between which it lies are.
fn carried_marks(
    carry: &Carry,
    marks: &[bool],
    part: &Part,
    body: &LayeredBody,
    share: f64,
) -> Vec<bool> {
    let marks: Vec<f64> = marks.iter().map(|&mark| f64::from(mark)).collect();
    let carried = carried_field(carry, &marks, part, body);
    carried.into_iter().map(|x| x > share).collect()
}

/// A field on the part's vertices, carried to a finer mesh of it.
fn carried_field(carry: &Carry, field: &[f64], part: &Part, body: &LayeredBody) -> Vec<f64> {
    let on_nodes = |&x: &f64| vec![Vec3::repeat(x); part.body.n_levels];
    let carried = carry(&field.iter().flat_map(on_nodes).collect::<Vec<Vec3>>());
    let at = |v: usize| carried[body.node(v, 0)].x;
    (0..body.n_vertices()).map(at).collect()
}

type Carry = Box<dyn Fn(&[Vec3]) -> Vec<Vec3>>;

/// The part with some triangles or intervals divided in two, and how displacements are carried to
/// it; `None` if there is nothing to divide.
fn divided(press: &Indentation, part: &Part, source: Source) -> Option<(LayeredBody, Carry)> {
    match source {
        Source::Near => {
            let refined = finer_triangles(press, &part.body, true);
            let on = refined.as_ref().map_or(&part.body, |refined| &refined.body);
            match (finer_intervals(press, on, true), refined) {
                (None, None) => None,
                (None, Some(refined)) => Some(carried_by(refined)),
                (Some(split), None) => Some(split_by(split)),
                (Some(split), Some(refined)) => {
                    let ((body, outer), (_, inner)) = (split_by(split), carried_by(refined));
                    Some((body, Box::new(move |field| outer(&inner(field)))))
                }
            }
        }
        Source::SkinFar => finer_triangles(press, &part.body, false).map(carried_by),
        Source::LevelsDeep => finer_intervals(press, &part.body, false).map(split_by),
    }
}

fn carried_by(refined: Refined) -> (LayeredBody, Carry) {
    let body = refined.body.clone();
    (body, Box::new(move |field| refined.interpolate(field)))
}

fn split_by(split: LevelSplit) -> (LayeredBody, Carry) {
    let body = split.body.clone();
    (body, Box::new(move |field| split.interpolate(field)))
}

/// Triangles near the tool, or those around, divided in two along each edge.
fn finer_triangles(press: &Indentation, body: &LayeredBody, near: bool) -> Option<Refined> {
    let (points, reach) = press.footprint();
    let lengths: Vec<f64> = (0..body.skin.triangles.len())
        .map(|t| {
            let corners = body.skin.corners(t);
            let centre = corners.iter().sum::<Vec3>() / 3.0;
            if (distance(&points, &centre) <= NEAR * reach) == near {
                let sides = (0..3).map(|i| (corners[i] - corners[(i + 1) % 3]).norm());
                0.99 * sides.fold(0.0, f64::max)
            } else {
                f64::INFINITY
            }
        })
        .collect();
    let params = RefineParams {
        max_depth: 1,
        ..RefineParams::default()
    };
    let is_any = lengths.iter().any(|l| l.is_finite());
    is_any.then(|| refine(body, &params, |t, _| lengths[t as usize]))
}

/// Intervals near the skin, or deeper ones, divided in two.
fn finer_intervals(press: &Indentation, body: &LayeredBody, near: bool) -> Option<LevelSplit> {
    let middle = nearest(&body.skin, press.place().at) as u32;
    let depths = mean_depths(body, &[middle]);
    let border = NEAR * press.prepared.scene.tool.contact_radius();
    let parts: Vec<Vec<f64>> = (depths.windows(2))
        .map(|ends| {
            if (0.5 * (ends[0] + ends[1]) <= border) == near {
                vec![0.5; 2]
            } else {
                vec![1.0]
            }
        })
        .collect();
    let is_any = parts.iter().any(|heights| heights.len() > 1);
    is_any.then(|| split_levels(body, &parts))
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::Arc;

    use palpa_scene::Scene;

    use super::*;
    use crate::Prepared;
    use crate::accuracy::{Descent, Stops};
    use crate::press::tissue::Record;

    /// A press of a block, or of a cylinder, on which the part is smaller than the body.
    fn press(body: &str, tool: &str) -> Indentation {
        let text = format!(
            r#"
            [body]
            generator = {{ kind = {body} }}
            [[layer]]
            tissue = {{ name = "gel", young = "10 kPa", poisson = 0.45, prony = {{ terms = [{{ g = 0.3, tau = "0.2 s" }}] }} }}
            levels = 3
            [tool]
            {tool}
            [mesh]
            near_tool = "2 mm"
            [press]
            depth = "2 mm"
            step = "1 mm"
            hold = "0 s"
            retract = false
            "#
        );
        let scene = Scene::parse(&text, Path::new(".")).unwrap();
        Indentation::build(Arc::new(Prepared::build(&scene).unwrap())).unwrap()
    }

    const BLOCK: &str = r#""block", size = ["120 mm", "120 mm", "16 mm"], spacing = "10 mm""#;
    const CYLINDER: &str = r#""cylinder", length = "160 mm", radius = "40 mm", bone_radius = "12 mm", spacing = "8 mm""#;

    #[test]
    fn the_part_alone_has_the_force_of_the_press() {
        for body in [BLOCK, CYLINDER] {
            for tool in ["shape = \"disc\"", "shape = \"sphere\"\nradius = \"8 mm\""] {
                let press = press(body, tool);
                let part = part(&press, 1.0);
                assert!(part.body.n_vertices() < press.mesh().body.n_vertices());
                assert!(part.is_border.contains(&true));
                let mut record = Record::with_displacements(&press);
                let mut run = press.start(0);
                while let Some(sample) = run.advance() {
                    record.push(&run, sample);
                }
                let stops = Stops::of(&record);
                let whole = Descent::at(&press, &stops).unwrap();
                // Nothing is left to do where the whole body is in equilibrium.
                let deepest = &whole.bases[0];
                let stop = (deepest.depth, deepest.deformed.clone());
                let alone = &settle_part(&press, &[stop])[0];
                let off = |force: f64| (force / deepest.force_n - 1.0).abs();
                assert!(deepest.force_n > 0.01);
                assert!(
                    off(alone.force_n) < 1e-5,
                    "{body}, {tool}: {}",
                    off(alone.force_n)
                );
                // With the border of the relaxed body, it differs by much less than it has relaxed.
                let in_part = Descent::in_part(&press, &stops).unwrap();
                let relaxed = off(record.samples.last().unwrap().force_n);
                assert!(relaxed > 0.05, "{relaxed}");
                assert!(
                    off(in_part.force_n()) < 0.2 * relaxed,
                    "{body}, {tool}: {}",
                    off(in_part.force_n())
                );
            }
        }
    }

    #[test]
    fn twice_the_change_at_the_next_smaller_depth_stands_in_for_a_probe_without_equilibrium() {
        let probed = |depth_mm: f64, near: Option<f64>, deep: Option<f64>| Probed {
            depth_mm,
            force_n: 1.0,
            changes: [near, Some(0.0), deep],
            is_stand_in: [false; N_SOURCES],
            n_touching: None,
            is_bonded: true,
        };
        let mut all = [
            probed(4.0, None, Some(0.1)),
            probed(2.0, None, None),
            probed(1.0, Some(-0.02), None),
        ];
        stand_in(&mut all);
        assert_eq!(all[0].changes, [Some(-0.08), Some(0.0), Some(0.1)]);
        assert_eq!(all[0].is_stand_in, [true, false, false]);
        assert_eq!(all[1].is_stand_in, [true, false, false]);
        assert_eq!(all[1].changes[2], None);
        assert_eq!(all[2].is_stand_in, [false; N_SOURCES]);
    }

    #[test]
    fn sources_divide_all_of_the_part_and_nothing_twice() {
        let press = press(BLOCK, "shape = \"disc\"");
        let part = part(&press, 1.0);
        let (n_prisms, n_levels) = (part.body.n_prisms(), part.body.n_levels);
        let mut finer = 0;
        for source in [Source::Near, Source::LevelsDeep] {
            finer += divided(&press, &part, source).map_or(0, |(body, _)| body.n_levels - n_levels);
        }
        assert_eq!(finer, n_levels - 1);
        for source in Source::ALL {
            let (body, carry) = divided(&press, &part, source).unwrap();
            assert!(body.n_prisms() > n_prisms);
            // Positions are carried to positions: the geometry is the same.
            let carried = carry(&part.body.positions);
            let off = carried
                .iter()
                .zip(&body.positions)
                .map(|(a, b)| (a - b).norm());
            assert!(off.fold(0.0, f64::max) < 1e-12);
        }
    }
}
