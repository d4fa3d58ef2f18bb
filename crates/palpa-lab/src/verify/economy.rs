//! Smallest number of nodes that is enough on blocks graded towards the tool (B2 and B4).
//!
//! On a single mesh the error can be small by luck: coarse intervals are too stiff, wide triangles
//! far from the tool are too soft, and the two errors cancel. Each figure is therefore the largest
//! error over all depths and over several similar meshes (other levels, irregular triangles, the
//! sphere between the vertices). The finer rungs of a ladder must keep the bound of the coarser
//! ones.

use palpa_mesh::generate::GradedBlock;

use crate::verify::block::{
    BlockMesh, RADIUS, block, known_disc_forces, known_sphere_forces, layered, press_disc,
    press_sphere,
};
use crate::verify::tolerance::{ECONOMY, ECONOMY_FINE, ECONOMY_IRREGULAR};
use crate::verify::{Findings, Options, Row, StudyPoint, VerifyError};

const CASE: &str = "economy";
/// Step of the disc, m. Steps of half this length give the same forces in all digits shown.
const STEP: f64 = 2e-3;
/// Radius within which edges under the sphere have equal length, m. The contact radius is 4.4 mm at
/// 2 mm depth and 7.5 mm at 6 mm.
const RING: f64 = 4e-3;
/// Smallest depth at which the sphere touches enough vertices for a comparison, m.
const SPHERE_FROM: f64 = 2e-3;
/// Depth of the first step of the sphere, on the way to [`SPHERE_FROM`], m.
const SPHERE_START: f64 = 1e-3;

/// First height (m) and growth of the levels of each layer.
type LevelHeights = &'static [(f64, f64)];

/// A rung of the ladder: similar meshes and their tolerances.
struct Rung {
    spacing: f64,
    growth: f64,
    inner_growth: f64,
    variants: &'static [Variant],
    /// Tolerances of the regular and of the irregular variants.
    tolerances: [f64; 2],
}

/// The features that differ between the meshes of a rung.
#[derive(Clone, Copy)]
struct Variant {
    levels: LevelHeights,
    /// Seed of an irregular mesh; `None` for a regular one.
    seed: Option<u64>,
    /// Offset of the tool from a vertex, in spacings.
    at: [f64; 2],
}

const fn regular(levels: LevelHeights) -> Variant {
    Variant {
        levels,
        seed: None,
        at: [0.0; 2],
    }
}

const fn irregular(levels: LevelHeights, seed: u64) -> Variant {
    Variant {
        seed: Some(seed),
        ..regular(levels)
    }
}

/// The variant with the sphere off the vertices, and not over the middle of an edge or of a
/// triangle.
const fn beside(variant: Variant) -> Variant {
    Variant {
        at: [0.5, 0.3],
        ..variant
    }
}

/// Levels of skin, fat and muscle.
const LAYERED: [LevelHeights; 3] = [
    &[(2e-3, 0.0), (1e-3, 0.3), (2.5e-3, 0.6)],
    &[(2e-3, 0.0), (1.2e-3, 0.25), (4e-3, 0.6)],
    &[(2e-3, 0.0), (0.65e-3, 0.25), (2.5e-3, 0.6)],
];

/// Meshes under the disc: the rim needs short edges, the middle does not.
static DISC: [Rung; 3] = [
    Rung {
        spacing: RADIUS / 5.0,
        growth: 0.5,
        inner_growth: 0.7,
        variants: &[
            regular(LAYERED[0]),
            regular(LAYERED[1]),
            irregular(LAYERED[0], 1),
            irregular(LAYERED[0], 3),
        ],
        tolerances: [ECONOMY, ECONOMY_IRREGULAR],
    },
    Rung {
        spacing: RADIUS / 7.0,
        growth: 0.4,
        inner_growth: 0.6,
        variants: &[regular(LAYERED[2])],
        tolerances: [ECONOMY, ECONOMY_IRREGULAR],
    },
    Rung {
        spacing: RADIUS / 8.0,
        growth: 0.4,
        inner_growth: 0.6,
        variants: &[regular(LAYERED[2]), irregular(LAYERED[2], 2)],
        tolerances: [ECONOMY, ECONOMY_IRREGULAR],
    },
];

const HOMOGENEOUS: [LevelHeights; 2] = [&[(1e-3, 0.4)], &[(0.6e-3, 0.3)]];

static SPHERE: [Rung; 3] = [
    Rung {
        spacing: 0.95e-3,
        growth: 0.4,
        inner_growth: 0.0,
        variants: &[
            regular(HOMOGENEOUS[0]),
            beside(regular(HOMOGENEOUS[0])),
            irregular(HOMOGENEOUS[0], 1),
            beside(irregular(HOMOGENEOUS[0], 2)),
        ],
        tolerances: [ECONOMY; 2],
    },
    Rung {
        spacing: 0.8e-3,
        growth: 0.4,
        inner_growth: 0.0,
        variants: &[
            beside(regular(HOMOGENEOUS[0])),
            beside(irregular(HOMOGENEOUS[0], 1)),
        ],
        tolerances: [ECONOMY; 2],
    },
    Rung {
        spacing: 0.6e-3,
        growth: 0.25,
        inner_growth: 0.0,
        variants: &[
            beside(regular(HOMOGENEOUS[1])),
            beside(irregular(HOMOGENEOUS[1], 1)),
        ],
        tolerances: [ECONOMY_FINE; 2],
    },
];

/// A pressed block with its known depths, m, and forces, N.
struct EconomyProblem {
    name: String,
    tool: PressedBy,
    known: Vec<(f64, f64)>,
}

/// The tool that presses a block.
enum PressedBy {
    /// The bonded disc; Poisson's ratio of the layers.
    Disc(f64),
    /// The frictionless sphere.
    Sphere,
}

/// The largest error over depths and meshes.
struct Worst {
    reference: f64,
    computed: f64,
    error: f64,
    n_meshes: usize,
    /// Number of nodes of the largest of the meshes.
    nodes: usize,
}

impl EconomyProblem {
    /// Presses one mesh. Returns the force at each known depth, N, and the number of nodes that can
    /// move.
    fn press(&self, rung: &Rung, variant: &Variant) -> Result<(Vec<f64>, usize), VerifyError> {
        let mesh = BlockMesh {
            spacing: rung.spacing,
            growth: rung.growth,
            levels: variant.levels.to_vec(),
        };
        let ring = match self.tool {
            PressedBy::Disc(_) => RADIUS,
            PressedBy::Sphere => RING,
        };
        let block = GradedBlock {
            inner_growth: rung.inner_growth,
            jitter: variant.seed,
            ..block(&mesh, ring)
        };
        let depths: Vec<f64> = self.known.iter().map(|k| k.0).collect();
        match self.tool {
            PressedBy::Disc(nu) => press_disc(&block, &mesh, &layered(nu), &depths, STEP),
            PressedBy::Sphere => {
                let at = variant.at.map(|x| x * rung.spacing);
                press_sphere(&block, &mesh, at, &depths, |_, _| {})
            }
        }
    }

    /// The largest error over the compared depths and over the regular or irregular variants of a
    /// rung; `None` if there is no such variant.
    fn worst(&self, rung: &Rung, is_regular: bool) -> Result<Option<Worst>, VerifyError> {
        let mut worst: Option<Worst> = None;
        let variants = rung.variants.iter();
        for variant in variants.filter(|v| v.seed.is_none() == is_regular) {
            let (forces, nodes) = self.press(rung, variant)?;
            let n_meshes = worst.as_ref().map_or(1, |w| w.n_meshes + 1);
            let nodes = worst.as_ref().map_or(nodes, |w| w.nodes.max(nodes));
            for (&(depth, reference), computed) in self.known.iter().zip(forces) {
                let error = computed / reference - 1.0;
                let is_sphere = matches!(self.tool, PressedBy::Sphere);
                if is_sphere && depth < SPHERE_FROM - 1e-9 {
                    continue;
                }
                if worst.as_ref().is_none_or(|w| error.abs() > w.error.abs()) {
                    worst = Some(Worst {
                        reference,
                        computed,
                        error,
                        n_meshes,
                        nodes,
                    });
                }
            }
            if let Some(worst) = &mut worst {
                (worst.n_meshes, worst.nodes) = (n_meshes, nodes);
            }
        }
        Ok(worst)
    }

    fn climb(&self, ladder: &[Rung], findings: &mut Findings) -> Result<(), VerifyError> {
        for rung in ladder {
            for (kind, is_regular) in ["regular", "irregular"].into_iter().zip([true, false]) {
                let Some(worst) = self.worst(rung, is_regular)? else {
                    continue;
                };
                let plural = if worst.n_meshes == 1 { "" } else { "es" };
                findings.rows.push(Row::ratio(
                    CASE,
                    format!(
                        "{}, {} {kind} mesh{plural}: worst force, N",
                        self.name, worst.n_meshes
                    ),
                    worst.reference,
                    worst.computed,
                    rung.tolerances[usize::from(!is_regular)],
                    worst.nodes,
                ));
                findings.study.push(StudyPoint {
                    case: CASE,
                    series: format!("{}, {kind}", self.name),
                    h: rung.spacing,
                    nodes: worst.nodes,
                    error: worst.error,
                });
            }
        }
        Ok(())
    }
}

pub(crate) fn run(options: &Options) -> Result<Findings, VerifyError> {
    let mut findings = Findings::default();
    for (nu, name, deepest) in [(0.45, "nu045", 0.014), (0.49, "nu049", 0.012)] {
        let problem = EconomyProblem {
            name: format!("disc, nu {nu}"),
            tool: PressedBy::Disc(nu),
            known: known_disc_forces(options, &format!("B2_layered_block_{name}.csv"), deepest)?,
        };
        problem.climb(&DISC, &mut findings)?;
    }
    let mut known = known_sphere_forces(options)?;
    known.retain(|(depth, _)| *depth >= SPHERE_START - 1e-9);
    let problem = EconomyProblem {
        name: "sphere".to_owned(),
        tool: PressedBy::Sphere,
        known,
    };
    problem.climb(&SPHERE, &mut findings)?;
    Ok(findings)
}

#[cfg(test)]
mod tests {
    use super::*;

    const COARSE: [LevelHeights; 2] = [
        &[(2e-3, 0.0), (5e-3, 0.0), (28e-3, 0.0)],
        &[(2e-3, 0.0), (10e-3, 0.0), (28e-3, 0.0)],
    ];
    static RUNG: Rung = Rung {
        spacing: RADIUS / 2.0,
        growth: 1.0,
        inner_growth: 0.0,
        variants: &[
            regular(COARSE[0]),
            regular(COARSE[1]),
            irregular(COARSE[0], 1),
        ],
        tolerances: [ECONOMY, ECONOMY_IRREGULAR],
    };

    #[test]
    fn the_worst_is_over_all_depths_and_all_meshes_of_a_kind() {
        let problem = EconomyProblem {
            name: "disc".to_owned(),
            tool: PressedBy::Disc(0.45),
            known: vec![(1e-3, 0.5), (2e-3, 2.0)],
        };
        let errors: Vec<[f64; 2]> = (RUNG.variants.iter())
            .map(|variant| {
                let (forces, _) = problem.press(&RUNG, variant).unwrap();
                [forces[0] / 0.5 - 1.0, forces[1] / 2.0 - 1.0]
            })
            .collect();
        let largest = |kind: &[[f64; 2]]| {
            let all = kind.iter().flatten();
            all.fold(0.0_f64, |a, &b| if b.abs() > a.abs() { b } else { a })
        };
        let worst = |is_regular| problem.worst(&RUNG, is_regular).unwrap().unwrap();
        let (regular, irregular) = (worst(true), worst(false));
        assert_eq!((regular.n_meshes, irregular.n_meshes), (2, 1));
        assert_eq!(regular.error.to_bits(), largest(&errors[..2]).to_bits());
        assert_eq!(irregular.error.to_bits(), largest(&errors[2..]).to_bits());
        // The second stack has one interval less.
        assert!(regular.nodes > problem.press(&RUNG, &RUNG.variants[1]).unwrap().1);
        let ratio = regular.computed / regular.reference - 1.0;
        assert_eq!(ratio.to_bits(), regular.error.to_bits());
    }

    #[test]
    fn a_sphere_is_not_judged_before_it_touches_enough() {
        static ONE: Rung = Rung {
            variants: &[regular(HOMOGENEOUS[0])],
            spacing: 4e-3,
            growth: 1.0,
            inner_growth: 0.0,
            tolerances: [ECONOMY; 2],
        };
        let problem = EconomyProblem {
            name: "sphere".to_owned(),
            tool: PressedBy::Sphere,
            known: vec![(SPHERE_START, 100.0), (SPHERE_FROM, 0.5)],
        };
        let worst = problem.worst(&ONE, true).unwrap().unwrap();
        assert_eq!(worst.reference.to_bits(), 0.5_f64.to_bits());
        assert!(problem.worst(&ONE, false).unwrap().is_none());
    }
}
