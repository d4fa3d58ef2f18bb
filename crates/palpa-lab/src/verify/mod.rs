//! Verification of the continuum model: problems with known answers, and the errors of the model.
//!
//! Cases by formula need nothing but this crate; the others compare with tables in a reference
//! folder (see [`Options::reference`]). Every figure is a [`Row`]; its tolerance comes from one
//! table ([`tolerance`]).
//!
//! ```
//! use palpa_lab::verify::{Options, cases};
//!
//! let case = cases().iter().find(|case| case.name == "prony").unwrap();
//! let findings = case.run(&Options::default())?;
//! assert!(findings.rows.iter().all(|row| row.pass));
//! # Ok::<(), palpa_lab::verify::VerifyError>(())
//! ```

mod block;
mod columns;
mod cone;
mod contact;
mod economy;
mod friction;
mod half_space;
mod layer;
mod lump_map;
mod patch;
pub mod picture;
mod plane;
mod press;
mod prony;
mod sector;
mod small_lump;
mod small_strain;
mod table;
pub mod tolerance;

use std::path::PathBuf;

use serde::Serialize;

/// One figure beside its reference.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Name of the case.
    pub case: &'static str,
    /// The compared quantity, with its unit.
    pub quantity: String,
    /// The known answer.
    pub reference: f64,
    /// The computed value.
    pub computed: f64,
    /// `computed/reference − 1`, or an error relative to the value that `quantity` names.
    pub rel_error: f64,
    /// The largest absolute value of the error that passes.
    pub tolerance: f64,
    /// Nodes that can move.
    pub nodes: usize,
    /// Whether the error is within the tolerance.
    pub pass: bool,
}

impl Row {
    /// A row that compares two values by their ratio.
    pub fn ratio(
        case: &'static str,
        quantity: impl Into<String>,
        reference: f64,
        computed: f64,
        tolerance: f64,
        nodes: usize,
    ) -> Self {
        let error = computed / reference - 1.0;
        Self::with_error(
            case,
            quantity,
            [reference, computed],
            error,
            tolerance,
            nodes,
        )
    }

    /// A row that compares two values (reference, computed) by a given error.
    pub fn with_error(
        case: &'static str,
        quantity: impl Into<String>,
        [reference, computed]: [f64; 2],
        rel_error: f64,
        tolerance: f64,
        nodes: usize,
    ) -> Self {
        Self {
            case,
            quantity: quantity.into(),
            reference,
            computed,
            rel_error,
            tolerance,
            nodes,
            // A NaN does not pass.
            pass: rel_error.abs() <= tolerance,
        }
    }
}

/// An error on one of several meshes, for pictures of convergence.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StudyPoint {
    /// Name of the case.
    pub case: &'static str,
    /// Name of the curve within the case.
    pub series: String,
    /// Mesh size, m or relative to the coarsest mesh.
    pub h: f64,
    /// Nodes that can move.
    pub nodes: usize,
    /// Relative error, signed.
    pub error: f64,
}

/// Results of a case.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Findings {
    /// Figures beside their references.
    pub rows: Vec<Row>,
    /// Errors on several meshes.
    pub study: Vec<StudyPoint>,
}

/// Options of a run.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// The folder with the reference tables, for the cases that need it.
    pub reference: Option<PathBuf>,
}

/// A problem with a known answer.
#[derive(Debug)]
pub struct Case {
    /// Name of the case.
    pub name: &'static str,
    /// What the case verifies, in one line.
    pub title: &'static str,
    /// Source of the known answer.
    pub source: &'static str,
    /// Whether the case needs the reference folder.
    pub needs_reference: bool,
    run: fn(&Options) -> Result<Findings, VerifyError>,
}

impl Case {
    /// Runs the case.
    ///
    /// # Errors
    /// If a reference table is missing or not as expected, or if a solve does not converge.
    pub fn run(&self, options: &Options) -> Result<Findings, VerifyError> {
        (self.run)(options)
    }
}

/// Why a case could not be run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VerifyError {
    /// The case compares with tables, but no reference folder is given.
    #[error("this case needs the reference tables; name their folder with --reference DIR")]
    NoReference,
    /// A table cannot be read.
    #[error("cannot read \"{path}\": {reason}; give the folder that holds the reference tables")]
    Table {
        /// The file.
        path: PathBuf,
        /// The reason.
        reason: String,
    },
    /// A solve did not converge.
    #[error("{what}: the solver ended with {outcome}")]
    NotConverged {
        /// Which solve.
        what: String,
        /// How the solve ended.
        outcome: String,
    },
    /// A model could not be built.
    #[error("{0}")]
    Model(#[from] palpa_fem::FemError),
}

/// All cases; those by formula come first.
pub fn cases() -> &'static [Case] {
    CASES
}

static CASES: &[Case] = &[
    Case {
        name: "patch",
        title: "uniform strain on distorted wedges, small and large; rigid motions",
        source: "exact",
        needs_reference: false,
        run: patch::run,
    },
    Case {
        name: "columns",
        title: "confined layered and unconfined frictionless columns",
        source: "exact one-dimensional solution of the law (B5)",
        needs_reference: false,
        run: columns::run,
    },
    Case {
        name: "prony",
        title: "relaxation after a step and after a ramp",
        source: "exact convolution (A5)",
        needs_reference: false,
        run: prony::run,
    },
    Case {
        name: "lame",
        title: "thick cylinder under inner pressure, nearly incompressible",
        source: "Lamé, exact",
        needs_reference: false,
        run: plane::lame,
    },
    Case {
        name: "cook",
        title: "Cook's membrane, nearly incompressible, triangles in the plane and across it",
        source: "own Q2-Q1 solution tending to 7.77 (V)",
        needs_reference: false,
        run: plane::cook,
    },
    Case {
        name: "contact",
        title: "complementarity, friction cone, independence of load steps",
        source: "the laws of contact",
        needs_reference: false,
        run: contact::run,
    },
    Case {
        name: "cone",
        title: "cone on a half-space, its tip sharp and rounded",
        source: "exact (Sneddon)",
        needs_reference: false,
        run: cone::run,
    },
    Case {
        name: "mindlin",
        title: "sphere moved sideways on a half-space, partial slip, forth and back",
        source: "Cattaneo, Mindlin and Deresiewicz",
        needs_reference: false,
        run: friction::mindlin,
    },
    Case {
        name: "spence",
        title: "sphere with friction pressed on a half-space",
        source: "Spence's problem, solved on rings to 0.05 %",
        needs_reference: false,
        run: friction::spence,
    },
    Case {
        name: "A1",
        title: "punch, bonded disc, sphere and pressure on a half-space",
        source: "exact (Sneddon, Spence, Hertz, Boussinesq)",
        needs_reference: true,
        run: half_space::run,
    },
    Case {
        name: "A2",
        title: "flat punch and sphere on a layer that is bonded to a rigid base",
        source: "Hayes et al. (1972), solved anew to 1e-14",
        needs_reference: true,
        run: layer::one,
    },
    Case {
        name: "A3",
        title: "flat punch, disc under pressure and sphere on two and three layers",
        source: "Hankel transform, to 1e-10",
        needs_reference: true,
        run: layer::several,
    },
    Case {
        name: "A4",
        title: "a hard ball in a soft block under a pressure that moves across it",
        source: "quadratic tetrahedra, to 0.1 % in the ratio",
        needs_reference: true,
        run: lump_map::run,
    },
    Case {
        name: "small lump",
        title: "a lump inside one coarse prism, and the mesh refined round it",
        source: "own fine mesh",
        needs_reference: false,
        run: small_lump::run,
    },
    Case {
        name: "V patch",
        title: "the reference's own patch of 16 wedges",
        source: "exact (V)",
        needs_reference: true,
        run: patch::of_reference,
    },
    Case {
        name: "B1",
        title: "bonded disc on a homogeneous block, finite strain",
        source: "CalculiX, three families of meshes",
        needs_reference: true,
        run: block::b1,
    },
    Case {
        name: "B2",
        title: "bonded disc on skin, fat and muscle, finite strain",
        source: "CalculiX, three families of meshes",
        needs_reference: true,
        run: block::b2,
    },
    Case {
        name: "B3c",
        title: "a hard lump under the disc",
        source: "CalculiX, one mesh",
        needs_reference: true,
        run: block::b3c,
    },
    Case {
        name: "B4",
        title: "frictionless sphere on a homogeneous block, finite strain",
        source: "CalculiX and an axisymmetric code",
        needs_reference: true,
        run: block::b4,
    },
    Case {
        name: "B5",
        title: "cylinder between bonded plates, finite strain",
        source: "CalculiX, extrapolated, and an axisymmetric code",
        needs_reference: true,
        run: block::b5,
    },
    Case {
        name: "economy",
        title: "how few nodes are enough for B2 and B4, the worst of several meshes",
        source: "CalculiX, as B2 and B4",
        needs_reference: true,
        run: economy::run,
    },
];
