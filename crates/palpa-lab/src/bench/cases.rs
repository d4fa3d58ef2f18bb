//! The cases of the benchmark: bodies, tools and modes.

use std::sync::{Arc, LazyLock};

use palpa_fem::law::{Law, Moduli, NeoHookean, Ogden, Prony, PronyTerm};
use palpa_fem::{FemError, Material, Materials, Model, ModelParams, Supports};
use palpa_mesh::generate::{
    self, Diagonal, GradedBlock, GradedLayer, Grid, LevelStack, Outline, mapped_grid,
};
use palpa_mesh::growth::Thickness;
use palpa_mesh::{GrowthParams, LayerSpec, LayeredBody, Vec3, grow};

use super::refined::Problem;
use super::ride::Ride;
use super::row::Mode;

/// Side and thickness of the blocks, m.
const SIDE: f64 = 0.1;
/// Thickness, m, and Young's modulus, Pa, of skin, fat and muscle.
const LAYERS: [(f64, f64); 3] = [(2e-3, 100e3), (10e-3, 5e3), (28e-3, 30e3)];
/// Young's modulus, Pa, and thickness, m, of the block of one tissue.
const ONE_TISSUE: (f64, f64) = (30e3, 40e-3);
/// Poisson's ratio of all tissues.
const POISSON: f64 = 0.45;
/// Exponent of the hardening tissue.
const OGDEN_EXPONENT: f64 = 8.0;
/// Prony terms (share, time in s) of the relaxing tissue: half of the stiffness relaxes, one part
/// fast and one slowly.
pub(super) const RELAXING: [(f64, f64); 2] = [(0.3, 0.1), (0.2, 1.0)];

/// Length of the limb, its radius, and the radius of its bone, m.
const LIMB: [f64; 3] = [0.2, 0.04, 0.012];

/// The tissue of all layers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tissue {
    /// Neo-Hookean.
    Elastic,
    /// Neo-Hookean, relaxing.
    Relaxing,
    /// Hardening: Ogden.
    Ogden,
}

/// The shape and its mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BenchShape {
    /// The layered block with equal columns and one interval per layer.
    Block {
        /// Columns along each side.
        columns: usize,
    },
    /// The layered block, fine where it is pressed.
    Graded(BenchGrading),
    /// A block of one tissue, fine where it is pressed.
    OneTissue(BenchGrading),
    /// A limb around its bone.
    Limb {
        /// Length of the skin's edges, m.
        spacing: f64,
        /// Intervals of each layer.
        intervals: usize,
    },
}

/// A mesh that is graded towards a tool in its middle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BenchGrading {
    /// Edge length inside the ring, m.
    pub spacing: f64,
    /// Radius of the ring, m.
    pub ring: f64,
    /// Growth of the edge length outside the ring, per metre of distance.
    pub growth: f64,
    /// First height (m) and growth of each layer's levels. A block of one tissue uses the first
    /// entry only.
    pub levels: [(f64, f64); 3],
    /// Position of the middle, m.
    pub centre: [f64; 2],
    /// Offset of the tool from the middle, in spacings.
    pub beside: [f64; 2],
}

/// One line of the table to measure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Run {
    /// Part of the stiffness that a step recomputes.
    pub mode: Mode,
    /// Radius of the zone, m.
    pub zone_radius: f64,
    /// Indentation after which the exterior is factored anew, m; `None` for the default.
    pub stale: Option<f64>,
    /// Required steps per second.
    pub target: Option<f64>,
}

/// A body, the path of a tool, and the modes to measure.
#[derive(Debug, Clone, PartialEq)]
pub struct BenchCase {
    /// Name on the command line.
    pub name: &'static str,
    /// The body.
    pub shape: BenchShape,
    /// The tissue of the layers.
    pub tissue: Tissue,
    /// Radius of the sphere, m.
    pub radius: f64,
    /// Depth of the press and length of the stroke, m.
    pub way: [f64; 2],
    /// The same problem on a refined mesh.
    pub problem: Problem,
    /// Every `every`-th place is compared with the converged body.
    pub every: usize,
    /// The lines of the table.
    pub runs: Vec<Run>,
    /// Whether the case is small enough for `--quick`.
    pub is_quick: bool,
}

fn law(tissue: Tissue, young: f64) -> Law {
    match tissue {
        Tissue::Ogden => Ogden::from_young(young, POISSON, OGDEN_EXPONENT)
            .expect("valid constants")
            .into(),
        _ => NeoHookean::from_young(young, POISSON)
            .expect("valid constants")
            .into(),
    }
}

fn material(tissue: Tissue, young: f64) -> Material {
    let mut material = Material::new(format!("{:.0} kPa", young / 1e3), law(tissue, young));
    if tissue == Tissue::Relaxing {
        let terms = RELAXING.map(|(g, tau)| PronyTerm { g, tau }).to_vec();
        let prony = Prony::new(terms, Moduli::Instantaneous, true);
        material.prony = Some(prony.expect("valid terms"));
    }
    material
}

impl BenchGrading {
    fn body(&self, layers: &[(f64, f64)]) -> LayeredBody {
        let block = GradedBlock {
            outline: Outline::Square,
            half_width: 0.5 * SIDE,
            centre: self.centre,
            ring_radius: Some(self.ring),
            spacing: self.spacing,
            inner_growth: 0.0,
            growth: self.growth,
            jitter: None,
        };
        let graded: Vec<GradedLayer> = layers
            .iter()
            .zip(self.levels)
            .map(|(layer, (first_height, growth))| GradedLayer {
                thickness: layer.0,
                first_height,
                growth,
            })
            .collect();
        generate::graded_block(&block, &LevelStack::graded(&graded))
    }
}

impl BenchShape {
    fn body(&self) -> LayeredBody {
        match *self {
            Self::Block { columns } => {
                let levels = LevelStack {
                    depths: vec![0.0, 2e-3, 12e-3, 40e-3],
                    interval_layer: vec![0, 1, 2],
                };
                let grid = Grid {
                    n_cells: [columns - 1; 2],
                    diagonal: Diagonal::Alternate,
                    jitter: None,
                };
                let at = |x: f64| SIDE * (x - 0.5);
                mapped_grid(&grid, |u, v| Vec3::new(at(u), at(v), 0.0), &levels)
            }
            Self::Graded(grading) => grading.body(&LAYERS),
            Self::OneTissue(grading) => grading.body(&[(ONE_TISSUE.1, ONE_TISSUE.0)]),
            Self::Limb { spacing, intervals } => {
                let [length, radius, bone_radius] = LIMB;
                let (skin, bone) = generate::cylinder(length, radius, bone_radius, spacing);
                let names = ["skin", "fat", "muscle"];
                let layers = (names.iter().zip(LAYERS).enumerate())
                    .map(|(i, (name, layer))| LayerSpec {
                        name: (*name).to_owned(),
                        thickness: (i < 2).then_some(Thickness::Constant(layer.0)),
                        n_levels: intervals,
                        min_thickness: 0.2e-3,
                    })
                    .collect();
                let params = GrowthParams {
                    layers,
                    cut_out: None,
                    coarsening: None,
                    max_nodes: palpa_mesh::growth::MAX_NODES,
                };
                grow(&skin, &[bone], &params)
                    .expect("a limb made by formula can be grown")
                    .body
            }
        }
    }

    /// Edge length under the tool, m.
    pub fn h_contact(&self) -> f64 {
        match *self {
            Self::Block { columns } => SIDE / (columns - 1) as f64,
            Self::Graded(grading) | Self::OneTissue(grading) => grading.spacing,
            Self::Limb { spacing, .. } => spacing,
        }
    }
}

impl BenchCase {
    /// The body with its materials, on its bone.
    ///
    /// # Errors
    /// If the body cannot be computed with.
    pub fn model(&self) -> Result<Arc<Model>, FemError> {
        self.model_of(&self.shape)
    }

    /// The model of the same case on another mesh.
    ///
    /// # Errors
    /// If the body cannot be computed with.
    pub fn model_of(&self, shape: &BenchShape) -> Result<Arc<Model>, FemError> {
        let body = shape.body();
        let youngs: Vec<f64> = match shape {
            BenchShape::OneTissue(_) => vec![ONE_TISSUE.0],
            _ => LAYERS.map(|l| l.1).to_vec(),
        };
        let materials = youngs
            .into_iter()
            .map(|young| material(self.tissue, young))
            .collect();
        let model = Model::build(
            &body,
            &Materials::of_layers(materials),
            &Supports::on_base(&body),
            ModelParams::default(),
        )?;
        Ok(Arc::new(model))
    }

    /// The path of the tool at each of four places of a graded mesh; none on other meshes.
    pub fn rides_at_four_places(&self) -> Vec<Ride> {
        let (BenchShape::Graded(grading) | BenchShape::OneTissue(grading)) = self.shape else {
            return Vec::new();
        };
        let ride = self.ride();
        let at = |beside: [f64; 2]| {
            let [x, y] = [0, 1].map(|i| grading.centre[i] + beside[i] * grading.spacing);
            Vec3::new(x, y, 0.0)
        };
        FOUR_PLACES
            .map(|beside| Ride {
                at: at(beside),
                ..ride
            })
            .to_vec()
    }

    /// The path of the tool.
    pub fn ride(&self) -> Ride {
        let at = match self.shape {
            BenchShape::Block { .. } => Vec3::new(-0.5 * self.way[1], 0.0, 0.0),
            BenchShape::Graded(grading) | BenchShape::OneTissue(grading) => {
                let [x, y] =
                    [0, 1].map(|i| grading.centre[i] + grading.beside[i] * grading.spacing);
                Vec3::new(x, y, 0.0)
            }
            BenchShape::Limb { .. } => Vec3::new(0.5 * (LIMB[0] - self.way[1]), 0.0, LIMB[1]),
        };
        Ride {
            at,
            radius: self.radius,
            depth: self.way[0],
            stroke: self.way[1],
        }
    }
}

/// Radii of the two spheres, m.
const LARGE: f64 = 10e-3;
const SMALL: f64 = 5e-3;

fn run(mode: Mode, zone_radius: f64, target: Option<f64>) -> Run {
    Run {
        mode,
        zone_radius,
        stale: None,
        target,
    }
}

/// A block of equal columns, with the modes to run and their targets.
fn block(name: &'static str, columns: usize, runs: Vec<Run>) -> BenchCase {
    BenchCase {
        name,
        shape: BenchShape::Block { columns },
        tissue: Tissue::Elastic,
        radius: LARGE,
        way: [5e-3, 20e-3],
        problem: Problem::Layers,
        every: 1,
        runs,
        is_quick: false,
    }
}

/// A case on a mesh that is graded towards the tool, pressed straight down.
fn graded(name: &'static str, shape: BenchShape, problem: Problem, depth: f64) -> BenchCase {
    let runs = vec![
        run(Mode::Full, 15e-3, None),
        run(Mode::Zone, 12e-3, None),
        run(Mode::Zone, 8e-3, Some(500.0)),
    ];
    BenchCase {
        shape,
        way: [depth, 0.0],
        problem,
        ..block(name, 0, runs)
    }
}

/// Meshes that are the fastest at their error, found by a search over edge length, ring, growth and
/// levels. The error is the largest of four positions of the sphere over a triangle: on a vertex,
/// on the middle of an edge, near the triangle's middle, and half-way to it. `beside` is the
/// position of that largest error.
fn grading(
    [ring, n_on_radius]: [f64; 2],
    growth: f64,
    levels: [(f64, f64); 3],
    beside: [f64; 2],
) -> BenchGrading {
    BenchGrading {
        spacing: ring / n_on_radius,
        ring,
        growth,
        levels,
        centre: [0.0; 2],
        beside,
    }
}

fn one_tissue(name: &'static str, grading: BenchGrading) -> BenchCase {
    graded(
        name,
        BenchShape::OneTissue(grading),
        Problem::OneTissue,
        6e-3,
    )
}

fn layers(name: &'static str, grading: BenchGrading) -> BenchCase {
    graded(name, BenchShape::Graded(grading), Problem::Layers, 5e-3)
}

/// Offsets from a vertex to a point near the middle of a triangle and half-way to it, in spacings.
const INSIDE: [f64; 2] = [0.5, 0.3];
const HALF_WAY: [f64; 2] = [0.25, 0.15];

/// A vertex, the middle of an edge, near the middle of a triangle, and half-way to it.
const FOUR_PLACES: [[f64; 2]; 4] = [[0.0, 0.0], [0.5, 0.0], INSIDE, HALF_WAY];

static CASES: LazyLock<Vec<BenchCase>> = LazyLock::new(|| {
    use Mode::{Full, Whole, Zone};
    let usual = 15e-3;
    vec![
        BenchCase {
            is_quick: true,
            ..block(
                "324",
                9,
                vec![run(Full, usual, None), run(Zone, usual, None)],
            )
        },
        block(
            "1k",
            16,
            vec![
                run(Full, usual, None),
                run(Whole, usual, Some(1000.0)),
                run(Zone, usual, None),
            ],
        ),
        block(
            "4k",
            32,
            vec![
                run(Full, usual, None),
                run(Whole, usual, Some(250.0)),
                run(Zone, usual, Some(500.0)),
            ],
        ),
        BenchCase {
            every: 3,
            ..block(
                "16k",
                64,
                vec![
                    run(Full, usual, None),
                    run(Whole, usual, Some(40.0)),
                    run(Zone, usual, Some(130.0)),
                ],
            )
        },
        BenchCase {
            every: 8,
            radius: SMALL,
            problem: Problem::LayersSmall,
            ..block(
                "64k",
                128,
                vec![run(Whole, 10e-3, Some(10.0)), run(Zone, 10e-3, Some(60.0))],
            )
        },
        BenchCase {
            tissue: Tissue::Relaxing,
            ..block("4k-prony", 32, vec![run(Zone, usual, None)])
        },
        BenchCase {
            tissue: Tissue::Ogden,
            problem: Problem::Ogden,
            ..block("4k-ogden", 32, vec![run(Zone, usual, None)])
        },
        BenchCase {
            shape: BenchShape::Limb {
                spacing: 7.3e-3,
                intervals: 1,
            },
            problem: Problem::Limb,
            ..block(
                "limb",
                0,
                vec![run(Whole, usual, None), run(Zone, usual, None)],
            )
        },
        one_tissue(
            "sphere",
            grading([6.8e-3, 3.0], 1.3, [(2.5e-3, 0.8); 3], INSIDE),
        ),
        one_tissue(
            "sphere-fine",
            grading([7.4e-3, 4.0], 1.5, [(3e-3, 0.5); 3], HALF_WAY),
        ),
        layers(
            "layers",
            grading(
                [6e-3, 3.0],
                0.8,
                [(2e-3, 0.0), (5e-3, 0.0), (14e-3, 0.0)],
                HALF_WAY,
            ),
        ),
        layers(
            "layers-fine",
            grading(
                [6e-3, 3.0],
                0.9,
                [(2e-3, 0.0), (3.3e-3, 0.0), (9e-3, 0.8)],
                HALF_WAY,
            ),
        ),
    ]
});

/// All cases, in the order of the table.
pub fn cases() -> &'static [BenchCase] {
    &CASES
}
