//! The probes: the same press on finer meshes of the part near the tool.

use palpa_fem::{
    Load, Model, ModelParams, Outcome, PosedTool, SolveParams, State, Workspace, advance,
    equilibrate,
};
use palpa_mesh::refine::{RefineParams, mean_depths, refine, split_levels};
use palpa_mesh::{LayeredBody, Part, Vec3};

use super::{ErrorBars, Probed, Source};
use crate::continuum;
use crate::press::tissue::{Indentation, Record};

/// The part that is probed reaches this far beyond the tool: a multiple of the tissue's depth, and of
/// the tool's reach.
const PART_DEPTHS: f64 = 1.0;
const PART_REACHES: f64 = 2.0;
/// Triangles within this multiple of the tool's reach are near it, and intervals above this multiple
/// of its contact radius near the skin.
const NEAR: f64 = 1.5;
/// Tolerance of the force balance: far below the errors that are looked for.
const TOLERANCE: f64 = 1e-4;

/// Probes the samples with these indices, the deepest first.
pub(super) fn run(
    record: &Record<'_>,
    samples: &[usize],
    progress: &mut dyn FnMut(usize, usize) -> bool,
) -> Option<ErrorBars> {
    let press = record.indentation();
    let n_all = Source::ALL.len();
    let mut bases = Vec::new();
    let mut own = press.elastic_workspace();
    for &index in samples {
        let depth = record.samples[index].depth_mm * 1e-3;
        let Some(start) = record.displacements(index) else {
            continue;
        };
        // A tool that does not touch yet has no force that a change could be relative to.
        let found = press.elastic(&mut own, depth, start);
        let Some((force, displacements)) = found.filter(|(force, _)| *force != 0.0) else {
            continue;
        };
        bases.push((depth, force, displacements));
    }
    drop(own);
    let mut probed: Vec<Probed> = (bases.iter())
        .map(|(depth, force, _)| Probed {
            depth_mm: depth * 1e3,
            force_n: *force,
            changes: [None; 4],
        })
        .collect();
    let part = part(press);
    let mut n_nodes = 0;
    for (i, source) in Source::ALL.into_iter().enumerate() {
        if !progress(i, n_all) {
            return None;
        }
        let Some((body, carry)) = divided(press, &part, source) else {
            // Nothing to divide.
            for probed in &mut probed {
                probed.changes[i] = Some(0.0);
            }
            continue;
        };
        // A probe that is too large has no result, like one without equilibrium.
        let Ok(mut probe) = Probe::build(press, &part, &body, carry) else {
            continue;
        };
        n_nodes = n_nodes.max(probe.model.n_nodes());
        for (probed, (depth, force, displacements)) in probed.iter_mut().zip(&bases) {
            let found = probe.force(press, *depth, &part, displacements);
            probed.changes[i] = found.map(|found| (found - force) / force);
        }
    }
    Some(ErrorBars { probed, n_nodes })
}

/// The part of the body that is probed.
fn part(press: &Indentation) -> Part {
    let body = &press.mesh().body;
    let (points, reach) = press.footprint();
    let radius = reach + (PART_DEPTHS * press.place().tissue_depth).max(PART_REACHES * reach);
    let skin = &body.skin;
    Part::new(body, |t| {
        (skin.corners(t).iter()).any(|p| distance(&points, p) <= radius)
    })
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
}

impl Probe {
    /// A probe with another mesh of the part. `carry` carries displacements of the part to it.
    fn build(
        press: &Indentation,
        part: &Part,
        body: &LayeredBody,
        carry: Carry,
    ) -> anyhow::Result<Self> {
        let per_vertex = |marks: &[bool]| -> Vec<bool> {
            // A vertex is marked if all vertices between which it lies are.
            let n = part.body.n_levels;
            let marks: Vec<Vec3> = (marks.iter())
                .flat_map(|&m| vec![Vec3::repeat(f64::from(u8::from(m))); n])
                .collect();
            let carried = carry(&marks);
            (0..body.n_vertices())
                .map(|v| carried[body.node(v, 0)].x > 1.0 - 1e-9)
                .collect()
        };
        let rim = rim(body);
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
        let params = ModelParams {
            alpha: prepared.scene.model.alpha,
        };
        let model = Model::build(body, &prepared.materials, &supports, params)?;
        let (points, radius) = press.region();
        Ok(Self {
            workspace: Workspace::round(&model, &points, radius),
            model,
            carry,
            border,
            bonded,
        })
    }

    /// The force at a depth, N, with the displacements of the press there; `None` if no equilibrium
    /// is found.
    fn force(
        &mut self,
        press: &Indentation,
        depth: f64,
        part: &Part,
        displacements: &[Vec3],
    ) -> Option<f64> {
        let n_levels = part.body.n_levels;
        let guess = (self.carry)(&part.take(displacements, n_levels));
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
        let mut state = State::new(&self.model);
        state.displacements = guess;
        let params = SolveParams {
            tolerance: TOLERANCE,
            ..press.solve_params()
        };
        let ws = &mut self.workspace;
        let report = equilibrate(&self.model, &mut state, ws, &load, &params);
        if report.outcome == Outcome::Converged {
            return Some(press.force_of(&report, &self.bonded, ws));
        }
        // From rest, in as many steps as needed.
        let first: Vec<PosedTool> = press.tool_at(0.0).into_iter().collect();
        let before = Load {
            tools: &first,
            ..Load::default()
        };
        let mut state = State::new(&self.model);
        let report = advance(&self.model, &mut state, ws, &before, &load, &params);
        (report.outcome == Outcome::Converged).then(|| press.force_of(&report, &self.bonded, ws))
    }
}

type Carry = Box<dyn Fn(&[Vec3]) -> Vec<Vec3>>;

/// The part with some triangles or intervals divided in two, and how displacements are carried to
/// it.
fn divided(press: &Indentation, part: &Part, source: Source) -> Option<(LayeredBody, Carry)> {
    let body = &part.body;
    let (points, reach) = press.footprint();
    match source {
        Source::SkinNear | Source::SkinFar => {
            let lengths: Vec<f64> = (0..body.skin.triangles.len())
                .map(|t| {
                    let corners = body.skin.corners(t);
                    let centre = corners.iter().sum::<Vec3>() / 3.0;
                    let is_near = distance(&points, &centre) <= NEAR * reach;
                    if is_near == (source == Source::SkinNear) {
                        let sides = (0..3).map(|i| (corners[i] - corners[(i + 1) % 3]).norm());
                        0.99 * sides.fold(0.0, f64::max)
                    } else {
                        f64::INFINITY
                    }
                })
                .collect();
            if lengths.iter().all(|l| l.is_infinite()) {
                return None;
            }
            let params = RefineParams {
                max_depth: 1,
                ..RefineParams::default()
            };
            let refined = refine(body, &params, |t, _| lengths[t as usize]);
            let finer = refined.body.clone();
            Some((finer, Box::new(move |field| refined.interpolate(field))))
        }
        Source::LevelsNear | Source::LevelsDeep => {
            let middle = nearest(&body.skin.points, press.place().at);
            let depths = mean_depths(body, &[middle]);
            let border = NEAR * press.prepared.scene.tool.contact_radius();
            let parts: Vec<Vec<f64>> = (depths.windows(2))
                .map(|ends| {
                    let is_near = 0.5 * (ends[0] + ends[1]) <= border;
                    if is_near == (source == Source::LevelsNear) {
                        vec![0.5; 2]
                    } else {
                        vec![1.0]
                    }
                })
                .collect();
            if parts.iter().all(|heights| heights.len() == 1) {
                return None;
            }
            let split = split_levels(body, &parts);
            let finer = split.body.clone();
            Some((finer, Box::new(move |field| split.interpolate(field))))
        }
    }
}

fn nearest(points: &[Vec3], at: Vec3) -> u32 {
    let distance = |v: &u32| (points[*v as usize] - at).norm_squared();
    let all = 0..points.len() as u32;
    all.min_by(|a, b| distance(a).total_cmp(&distance(b)))
        .unwrap_or(0)
}

/// Whether a vertex is on the rim of a body's skin. `[n_vertices]`
fn rim(body: &LayeredBody) -> Vec<bool> {
    let mut edges: Vec<[u32; 2]> = (body.skin.triangles.iter())
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    edges.sort_unstable();
    let mut is_rim = vec![false; body.n_vertices()];
    for same in edges.chunk_by(|a, b| a == b).filter(|same| same.len() == 1) {
        for &v in &same[0] {
            is_rim[v as usize] = true;
        }
    }
    is_rim
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::Arc;

    use palpa_scene::Scene;

    use super::*;
    use crate::Prepared;

    /// A press of a block on which the part is smaller than the body.
    fn press(tool: &str) -> Indentation {
        let text = format!(
            r#"
            [body]
            generator = {{ kind = "block", size = ["120 mm", "120 mm", "16 mm"], spacing = "10 mm" }}
            [[layer]]
            tissue = {{ name = "gel", young = "10 kPa", poisson = 0.45 }}
            levels = 3
            [tool]
            {tool}
            [press]
            at = ["3 mm", "2 mm", "0 mm"]
            depth = "2 mm"
            step = "1 mm"
            hold = "0 s"
            retract = false
            "#
        );
        let scene = Scene::parse(&text, Path::new(".")).unwrap();
        Indentation::build(Arc::new(Prepared::build(&scene).unwrap())).unwrap()
    }

    #[test]
    fn the_part_alone_has_the_force_of_the_press() {
        for tool in ["shape = \"disc\"", "shape = \"sphere\"\nradius = \"8 mm\""] {
            let press = press(tool);
            let part = part(&press);
            assert!(part.body.n_vertices() < press.mesh().body.n_vertices());
            assert!(part.is_border.contains(&true));
            let mut record = Record::new(&press);
            let mut run = press.start(0);
            while let Some(sample) = run.advance() {
                record.push(&run, sample);
            }
            let last = record.samples.len() - 1;
            let displacements = record.displacements(last).unwrap();
            let carry: Carry = Box::new(<[Vec3]>::to_vec);
            let mut probe = Probe::build(&press, &part, &part.body.clone(), carry).unwrap();
            let force = probe.force(&press, 2e-3, &part, displacements).unwrap();
            let expected = record.samples[last].force_n;
            assert!(expected > 0.01);
            // The triangles of the part are paired anew, which changes the force a little.
            assert!(
                (force - expected).abs() < 5e-4 * expected,
                "{tool}: {force} and {expected}"
            );
        }
    }

    #[test]
    fn sources_divide_all_of_the_part_and_nothing_twice() {
        let press = press("shape = \"disc\"");
        let part = part(&press);
        let n_prisms = part.body.n_prisms();
        let n_levels = part.body.n_levels;
        let mut finer = 0;
        for source in [Source::LevelsNear, Source::LevelsDeep] {
            finer += divided(&press, &part, source).map_or(0, |(body, _)| body.n_levels - n_levels);
        }
        assert_eq!(finer, n_levels - 1);
        for source in [Source::SkinNear, Source::SkinFar] {
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
