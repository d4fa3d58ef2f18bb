//! The same layered bodies as a continuum: at which push is a hard layer felt?
//!
//! Neo-Hookean blocks with the thesis's layers, under a bonded disc. The moduli have the ratio of
//! the thesis's springs. One disc is as large as the patch of skin that a node of the thesis stands
//! for, the other is like a fingertip. Elastic forces are proportional to the modulus, so the soft
//! modulus can be chosen freely. With the modulus of the thesis's springs
//! (`docs/theory/spring_stiffness.md`) nothing could be felt.

use palpa_fem::law::NeoHookean;
use palpa_fem::{
    FemError, Load, Material, Materials, Model, ModelParams, Outcome, SolveParams, State, Supports,
    Workspace, advance,
};
use palpa_mesh::generate::{GradedBlock, GradedLayer, LevelStack, Outline, graded_block};
use palpa_mesh::{LayeredBody, Vec3};
use serde::Serialize;

use super::{Body, HARD, LEVEL_SPACING, SOFT};

/// Young's modulus of the soft layers, Pa: the value of soft fat.
const SOFT_YOUNG: f64 = 1e3;
/// Poisson's ratio of all layers.
const POISSON: f64 = 0.45;
/// Share of the pair's mean deviator: the default of a scene.
const ALPHA: f64 = 0.8;
/// Radius of the block, m: twice its depth, so that the free side has little effect.
const HALF_WIDTH: f64 = 0.24;
/// A layer counts as felt if the body is this many times as stiff (force over push) as the uniform
/// one. Differences of stiffness of 4 to 10 % are noticed in the best conditions (Gurari,
/// Okamura & Kuchenbecker 2017, doi 10.1371/journal.pone.0178605), and of 8 to 23 % in older work.
/// The first ratio is for attentive people, the second for everyone.
pub const FELT_RATIOS: [f64; 2] = [1.1, 1.23];

/// A disc and its deepest push.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disc {
    /// Name of the disc.
    pub name: &'static str,
    /// Radius, m.
    pub radius: f64,
    /// The deepest push, mm. Beyond it, the tissue at the disc's edge is squeezed so much that two
    /// meshes differ by more than 5 %.
    pub deepest_mm: usize,
}

/// The discs of the report.
pub fn discs() -> [Disc; 2] {
    [
        Disc {
            name: "a node's patch",
            // The disc has the area of skin that belongs to a node.
            radius: LEVEL_SPACING / std::f64::consts::PI.sqrt(),
            deepest_mm: 35,
        },
        Disc {
            name: "a fingertip",
            radius: 0.010,
            deepest_mm: 25,
        },
    ]
}

/// Resolution of the block. Lengths in radii of the disc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolution {
    /// Edge length under the disc.
    pub spacing: f64,
    /// Growth of the edge length beyond the disc, per length.
    pub growth: f64,
    /// Height of the uppermost interval.
    pub first_height: f64,
}

impl Resolution {
    /// Resolution of the report.
    pub const FULL: Self = Self {
        spacing: 0.334,
        growth: 0.6,
        first_height: 0.35,
    };
    /// Resolution for a quick look.
    pub const COARSE: Self = Self {
        spacing: 0.5,
        growth: 1.0,
        first_height: 0.7,
    };
}

/// The three bodies under each disc.
#[derive(Debug, Clone, Serialize)]
pub struct Continuum {
    /// Young's modulus of the soft layers.
    pub soft_young_pa: f64,
    /// Young's modulus of the hard layer.
    pub hard_young_pa: f64,
    /// Poisson's ratio of all layers.
    pub poisson: f64,
    /// Radius of the block; its side is free.
    pub block_radius_mm: f64,
    /// Stiffness ratios to the uniform body at which a layer is felt: by attentive people, by
    /// everyone.
    pub felt_ratios: [f64; 2],
    /// The discs; after an interruption, those pressed until then.
    pub discs: Vec<PressedDisc>,
}

/// The bodies under one disc.
#[derive(Debug, Clone, Serialize)]
pub struct PressedDisc {
    /// Name of the disc.
    pub name: &'static str,
    /// Radius of the disc.
    pub radius_mm: f64,
    /// Nodes that can move.
    pub nodes: usize,
    /// The bodies: uniform, hard middle, hard bottom.
    pub bodies: Vec<DiscPress>,
}

/// One body, pressed as deep as possible.
#[derive(Debug, Clone, Serialize)]
pub struct DiscPress {
    /// The body.
    pub body: Body,
    /// Push and force on the disc, `[mm, N]`.
    pub curve: Vec<[f64; 2]>,
    /// Why the curve ends.
    pub ended_by: String,
    /// Remaining share of the upper layer's thickness under the disc's middle at the end.
    pub upper_layer_left: f64,
    /// Stiffness (force over push) relative to the uniform body, `[mm, 1]`.
    pub stiffness_ratio: Vec<[f64; 2]>,
    /// Slope of the force relative to the uniform body in each millimetre, `[mm, 1]`. It shows a
    /// layer earlier than the stiffness does, but is noisier.
    pub slope_ratio: Vec<[f64; 2]>,
    /// The push at which the layer is felt, mm, for each of [`FELT_RATIOS`]: 0 if it is felt from
    /// the first touch, `None` if it is not felt within the depth of the press.
    pub felt_from_mm: [Option<f64>; 2],
}

/// Steps of [`Continuum::compute`], for a progress bar.
pub fn n_steps(discs: &[Disc]) -> usize {
    discs.iter().map(|d| d.deepest_mm * Body::ALL.len()).sum()
}

impl Continuum {
    /// Presses the three bodies under each disc, one millimetre per step. `is_stopped` is called
    /// before each step and ends the work if it returns true; an unfinished body is left out.
    ///
    /// # Errors
    /// If a model cannot be built.
    pub fn compute(
        discs: &[Disc],
        resolution: Resolution,
        mut is_stopped: impl FnMut() -> bool,
    ) -> Result<Self, FemError> {
        let mut continuum = Self {
            soft_young_pa: SOFT_YOUNG,
            hard_young_pa: SOFT_YOUNG * HARD / SOFT,
            poisson: POISSON,
            block_radius_mm: HALF_WIDTH * 1e3,
            felt_ratios: FELT_RATIOS,
            discs: Vec::new(),
        };
        for disc in discs {
            let mut pressed_disc = PressedDisc {
                name: disc.name,
                radius_mm: disc.radius * 1e3,
                nodes: 0,
                bodies: Vec::new(),
            };
            let (layered, patch) = block(disc, resolution);
            for body in Body::ALL {
                let model = model(body, &layered)?;
                let Some(mut pressed) = press(body, &model, disc, &patch, &mut is_stopped) else {
                    break;
                };
                pressed_disc.nodes = model.n_free_nodes();
                let uniform = pressed_disc.bodies.first();
                let uniform = uniform.map_or(&pressed.curve, |u: &DiscPress| &u.curve);
                let (stiffness_ratio, slope_ratio) = ratios(&pressed.curve, uniform);
                pressed.felt_from_mm = FELT_RATIOS.map(|felt| felt_from(&stiffness_ratio, felt));
                (pressed.stiffness_ratio, pressed.slope_ratio) = (stiffness_ratio, slope_ratio);
                pressed_disc.bodies.push(pressed);
            }
            if !pressed_disc.bodies.is_empty() {
                continuum.discs.push(pressed_disc);
            }
        }
        Ok(continuum)
    }
}

/// The block for a disc, and the nodes that are bonded to it.
fn block(disc: &Disc, resolution: Resolution) -> (LayeredBody, Vec<usize>) {
    let block = GradedBlock {
        outline: Outline::Disc,
        half_width: HALF_WIDTH,
        centre: [0.0; 2],
        ring_radius: Some(disc.radius),
        spacing: resolution.spacing * disc.radius,
        growth: resolution.growth,
        inner_growth: 0.0,
        jitter: None,
    };
    let layer = |first_height: f64, growth: f64| GradedLayer {
        thickness: LEVEL_SPACING,
        first_height: first_height * LEVEL_SPACING,
        growth,
    };
    let first_height = resolution.first_height * disc.radius / LEVEL_SPACING;
    let levels = LevelStack::graded(&[layer(first_height, 0.2), layer(0.3, 0.1), layer(0.4, 0.5)]);
    let layered = graded_block(&block, &levels);
    let patch = block.patch_vertices(&layered);
    let patch = patch.iter().map(|&v| layered.node(v as usize, 0)).collect();
    (layered, patch)
}

fn model(body: Body, layered: &LayeredBody) -> Result<Model, FemError> {
    let materials = body.stiffnesses().map(|k| {
        let law = NeoHookean::from_young(SOFT_YOUNG * k / SOFT, POISSON).expect("valid constants");
        Material::new("layer", law)
    });
    Model::build(
        layered,
        &Materials::of_layers(materials.to_vec()),
        &Supports::on_base(layered),
        ModelParams::even(ALPHA),
    )
}

/// Presses one body in steps of a millimetre; `None` if it was stopped.
fn press(
    body: Body,
    model: &Model,
    disc: &Disc,
    patch: &[usize],
    is_stopped: &mut impl FnMut() -> bool,
) -> Option<DiscPress> {
    let (mut state, mut ws) = (State::new(model), Workspace::new(model));
    let held = |mm: usize| -> Vec<(usize, Vec3)> {
        let down = Vec3::new(0.0, 0.0, -1e-3 * mm as f64);
        patch.iter().map(|&node| (node, down)).collect()
    };
    let mut pressed = DiscPress {
        body,
        curve: vec![[0.0, 0.0]],
        ended_by: "the deepest push tried".into(),
        upper_layer_left: 1.0,
        stiffness_ratio: Vec::new(),
        slope_ratio: Vec::new(),
        felt_from_mm: [None; 2],
    };
    let layered = model.body();
    let is_upper = |layer: &&usize| **layer == 0;
    let n_upper = layered.interval_layer.iter().filter(is_upper).count();
    for mm in 1..=disc.deepest_mm {
        if is_stopped() {
            return None;
        }
        let (before, after) = (held(mm - 1), held(mm));
        let report = advance(
            model,
            &mut state,
            &mut ws,
            &bonded(&before),
            &bonded(&after),
            &SolveParams::default(),
        );
        if report.outcome != Outcome::Converged {
            pressed.ended_by = ending(report.outcome);
            break;
        }
        pressed.curve.push([mm as f64, report.held_force.z]);
        // The middle of the disc is the first vertex of the block.
        let sunk = |level: usize| state.displacements[layered.node(0, level)].z;
        pressed.upper_layer_left = 1.0 + (sunk(0) - sunk(n_upper)) / LEVEL_SPACING;
    }
    Some(pressed)
}

fn bonded(held: &[(usize, Vec3)]) -> Load<'_> {
    Load {
        held,
        ..Load::default()
    }
}

/// Text for a failed step.
fn ending(outcome: Outcome) -> String {
    let place = |[x, y, z]: [f64; 3]| {
        let (r, depth) = (x.hypot(y) * 1e3, -z * 1e3);
        format!("{r:.0} mm from the middle, {depth:.0} mm deep")
    };
    match outcome {
        Outcome::Inverted { at } => format!("tissue would turn inside out {}", place(at)),
        Outcome::IterationLimit { at } => format!("no equilibrium was found {}", place(at)),
        Outcome::Singular => "the stiffness became singular".into(),
        Outcome::Converged => "nothing".into(),
    }
}

/// Force over push at each millimetre and slope within each millimetre, both relative to the
/// uniform body.
fn ratios(curve: &[[f64; 2]], uniform: &[[f64; 2]]) -> (Vec<[f64; 2]>, Vec<[f64; 2]>) {
    let rise = |w: &[[f64; 2]]| w[1][1] - w[0][1];
    let both = || curve.windows(2).zip(uniform.windows(2));
    (
        both().map(|(c, u)| [c[1][0], c[1][1] / u[1][1]]).collect(),
        both()
            .map(|(c, u)| [f64::midpoint(c[0][0], c[1][0]), rise(c) / rise(u)])
            .collect(),
    )
}

/// The push at which a ratio first reaches `level`; 0 if the first point reaches it.
fn felt_from(ratios: &[[f64; 2]], level: f64) -> Option<f64> {
    let i = ratios.iter().position(|[_, ratio]| *ratio >= level)?;
    let Some(before) = i.checked_sub(1) else {
        return Some(0.0);
    };
    let ([x0, r0], [x1, r1]) = (ratios[before], ratios[i]);
    Some(x0 + (x1 - x0) * (level - r0) / (r1 - r0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_nearer_layer_is_felt_earlier_and_a_wider_disc_feels_deeper() {
        let shallow = discs().map(|disc| Disc {
            deepest_mm: 6,
            ..disc
        });
        let mut n_asked = 0;
        let continuum = Continuum::compute(&shallow, Resolution::COARSE, || {
            n_asked += 1;
            false
        })
        .unwrap();
        assert_eq!(n_asked, n_steps(&shallow));
        let first =
            |disc: usize, body: usize| continuum.discs[disc].bodies[body].stiffness_ratio[0][1];
        for disc in 0..2 {
            let bodies = &continuum.discs[disc].bodies;
            assert!(bodies.iter().all(|b| b.curve.len() == 7), "{bodies:?}");
            assert_eq!(bodies[0].felt_from_mm, [None; 2]);
            assert_eq!(bodies[1].felt_from_mm[0], Some(0.0));
            assert!(first(disc, 1) > first(disc, 2) && first(disc, 2) > 1.02);
        }
        assert!(first(0, 1) > first(1, 1) && first(0, 2) > first(1, 2));
        // The deep layer is felt at once under the wide disc, but not under the small one.
        assert_eq!(continuum.discs[0].bodies[2].felt_from_mm[0], Some(0.0));
        assert_eq!(continuum.discs[1].bodies[2].felt_from_mm[0], None);
    }

    #[test]
    fn what_was_stopped_is_left_out() {
        let mut n_left = 8;
        let discs = discs().map(|disc| Disc {
            deepest_mm: 3,
            ..disc
        });
        let continuum = Continuum::compute(&discs, Resolution::COARSE, || {
            n_left -= 1;
            n_left < 0
        })
        .unwrap();
        assert_eq!(continuum.discs.len(), 1);
        assert_eq!(continuum.discs[0].bodies.len(), 2);
    }

    #[test]
    fn the_push_is_interpolated() {
        let felt = |ratios: [f64; 3]| {
            let points: Vec<[f64; 2]> = (1..).map(f64::from).zip(ratios).map(Into::into).collect();
            felt_from(&points, 1.1)
        };
        assert_eq!(felt([1.2, 1.3, 1.4]), Some(0.0));
        assert_eq!(felt([1.0, 1.05, 1.09]), None);
        let found = felt([1.0, 1.05, 1.15]).unwrap();
        assert!((found - 2.5).abs() < 1e-12, "{found}");
    }
}
