//! Remarks on a result for the user: typed, with names and numbers.
//!
//! [`Display`](fmt::Display) gives the English text that the command prints and that files contain.
//! The viewer's page gets the same notes as JSON and has its own texts, one for each of its
//! languages.
//!
//! To add a note: add a variant here with its numbers in SI units, its English text in `fmt` below,
//! and its texts in both languages in `web/src/i18n/notes.ts`. Then run
//! `PALPA_BLESS=1 cargo test -p palpa` and, in `web/`, `npm run generate`: without the texts the
//! page does not compile.

use std::fmt;

use palpa_fem::Outcome;
use palpa_mesh::Vec3;
use palpa_mesh::read::ReadNote;
use palpa_mesh::refine::ImprintError;
use palpa_scene::Tool;
use palpa_scene::units::Share;
use schemars::JsonSchema;
use serde::Serialize;

/// A remark for the user. Lengths in m, angles in rad, points `[x, y, z]` in m.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Note {
    /// The reader of a surface file changed or left out something.
    FileRead {
        /// Name of the file.
        file: String,
        /// What the reader did.
        note: ReadNote,
    },
    /// A surface is larger or smaller than any body part.
    UnusualSize {
        /// Name of the file.
        file: String,
        /// Diagonal of its bounding box, m.
        size: f64,
    },
    /// A surface was repaired before it was used.
    Repaired {
        /// Name of the file.
        file: String,
        /// Vertices that were welded to others.
        n_welded: usize,
        /// Triangles without area that were dropped.
        n_degenerate: usize,
        /// Duplicate triangles that were dropped.
        n_duplicate: usize,
        /// Unused vertices that were dropped.
        n_unused: usize,
        /// Triangles that were turned outward.
        n_flipped: usize,
    },
    /// The skin was coarsened where its triangles are smaller than wanted.
    SkinCoarsened {
        /// Number of vertices of the given skin.
        n_given: usize,
        /// Number of vertices of the coarse skin.
        n_vertices: usize,
        /// Largest distance of the coarse skin from the given one, m.
        deviation: f64,
    },
    /// Triangles of the body's base pass through each other.
    BaseOverlaps {
        /// Number of pairs of triangles.
        n_pairs: usize,
    },
    /// Layers are thinner than asked under most of the skin, because there is too little room for
    /// them.
    LayersThinned {
        /// Share of the skin's area below which layers are thinner, 0 to 1.
        share: f64,
        /// Under half of that area, the layer that is thinned most has at most this share of its
        /// thickness, 0 to 1.
        median: f64,
        /// The same share at the worst place.
        least: f64,
        /// The skin above the worst place, m.
        at: [f64; 3],
    },
    /// Layers are thicker or thinner than asked although there is room for them, because the mesh
    /// would not be valid otherwise.
    LayersMoved {
        /// Share of the skin's area below which a layer is more than 1 % off, 0 to 1.
        share: f64,
        /// Name of the layer that is furthest off, as a share of its thickness.
        layer: String,
        /// The thickness that it asks for, m.
        asked: f64,
        /// Its thickness at the worst place, m.
        thickness: f64,
        /// The skin above the worst place, m.
        at: [f64; 3],
    },
    /// The rim of a cut-out is near enough to influence the force.
    CutoutNear {
        /// Radius of the cut-out, m.
        radius: f64,
        /// Radius from which the rim has no influence, m.
        enough: f64,
    },
    /// The tool goes down at an angle to the skin's normal.
    ObliquePress {
        /// Angle to the inward normal of the skin, rad.
        angle: f64,
    },
    /// The place that is pressed is on the rim of a cut face.
    PressOnCutFace,
    /// The point that the scene presses is far from the skin.
    PlaceOffSkin {
        /// The point, m.
        asked: [f64; 3],
        /// The point of the skin nearest to it, m.
        at: [f64; 3],
        /// Distance between them, m.
        distance: f64,
    },
    /// A tool that holds a single vertex cannot press at the point of the scene.
    NodeBeside {
        /// Distance of the vertex from the nearest point of the skin, m.
        distance: f64,
    },
    /// The tool reaches beyond the rim of the skin.
    ToolOverRim {
        /// Share of the tool's footprint at full depth that is beyond the rim, 0 to 1.
        share: f64,
    },
    /// The skin could not be refined as far as wanted.
    SkinTooCoarse {
        /// Number of triangles that are larger than wanted.
        n_triangles: usize,
        /// The limit on skin vertices that was reached.
        max_vertices: usize,
    },
    /// Levels could not be split as far as wanted.
    LevelsTooHigh {
        /// The limit on levels that was reached.
        max_levels: usize,
    },
    /// The mesh is not refined around a lump that has no size of its own.
    LumpNotRefined {
        /// Name of the lump.
        lump: String,
    },
    /// A lump lies partly outside the tissue.
    LumpPartlyOutside {
        /// Name of the lump.
        lump: String,
        /// Share of its volume that lies in the tissue, 0 to 1.
        share: f64,
        /// Its middle, m.
        at: [f64; 3],
    },
    /// The edge of a bonded disc could not be cut into the skin's mesh.
    DiscNotImprinted {
        /// The reason.
        why: ImprintError,
    },
    /// The skin that a bonded disc holds if its edge is not part of the mesh.
    DiscPatch {
        /// Number of vertices under the disc.
        n_vertices: usize,
        /// Radius of the disc, m.
        radius: f64,
        /// Place of the disc, m.
        at: [f64; 3],
        /// Radius of the circle with the held area, m.
        effective_radius: f64,
    },
    /// A cut face that is not flat cannot be a plane of symmetry.
    CutFaceNotFlat {
        /// A point of the face, m.
        at: [f64; 3],
    },
    /// Several speeds were given, but nothing depends on the speed.
    SpeedsAlike,
    /// Many triangles of the skin have no partner to be paired with.
    SingleTriangles {
        /// Number of triangles without a partner.
        n: usize,
        /// Number of all triangles.
        n_all: usize,
    },
    /// The mesh under the tool is coarse for the size of the contact.
    CoarseUnderTool {
        /// Mean length of the skin's edges near the tool, m.
        edge: f64,
        /// Radius of the tool's pressing part, m.
        radius: f64,
    },
    /// The mesh under the tool is coarse for its rounded edge.
    CoarseAtEdge {
        /// Mean length of the skin's edges near the tool, m.
        edge: f64,
        /// Radius of the tool's rounded edge, m.
        edge_radius: f64,
    },
    /// Sizes near the tool are larger than the accuracy of the scene asks for, so that steps keep up with
    /// a hand.
    AccuracyTooFine {
        /// Error of the force that the scene asks for, as a share of it.
        accuracy: f64,
        /// By how much smaller than the default ones sizes would be for it, as a share.
        asked: f64,
        /// By how much smaller they are.
        made: f64,
    },
    /// Free cut faces release the tension of a layer.
    TensionLost {
        /// Name of the layer's tissue.
        layer: String,
    },
    /// Few vertices lie under the disc of the reference method.
    FewUnderDisc {
        /// Number of vertices under the disc.
        n_vertices: usize,
        /// Radius of the disc, m.
        radius: f64,
        /// Mean length of the skin's edges near the tool, m.
        edge: f64,
    },
    /// The reference method leaves out the tension of layers: bars have none at rest.
    TensionLeftOut,
    /// The reference method runs the first speed only: bars have no time dependence.
    FirstSpeedOnly,
    /// Levels are too flat or too tall for bars to represent a Young's modulus.
    BarAspects {
        /// The layers with such levels.
        layers: Vec<LayerAspect>,
        /// Smallest ratio at which bars represent it.
        least: f64,
        /// Largest ratio at which bars represent it.
        most: f64,
    },
    /// The motion leaves the skin.
    MotionOffSkin {
        /// Distance along the motion at which it leaves the skin, m.
        far: f64,
        /// Length of the motion, m.
        length: f64,
    },
    /// A bonded tool was replaced by one that touches.
    ToolReplaced {
        /// The scene's tool.
        tool: Tool,
        /// The tool used instead.
        by: Tool,
    },
    /// The mesh under the tool is coarser than for a scripted press.
    CoarserForTouch {
        /// Length of the skin's edges under the tool, m.
        edge: f64,
    },
    /// A step of a press failed.
    StepFailed {
        /// Speed of the run, m/s.
        speed: f64,
        /// Depth that the step should have reached, m.
        depth: f64,
        /// The reason, and the place in the body.
        outcome: Outcome,
    },
    /// Prisms have a corner that is turned inside out.
    TurnedPrisms {
        /// Number of prisms.
        n: usize,
        /// Depth at which it happened, m.
        depth: f64,
        /// The middle of the worst prism, m.
        at: [f64; 3],
    },
    /// Few vertices touch the tool.
    FewTouching {
        /// Largest number of vertices in contact.
        n_vertices: usize,
        /// Radius of the circle with the largest contact area, m.
        radius: f64,
        /// Mean length of the skin's edges near the tool, m.
        edge: f64,
    },
}

/// The shape of a layer's levels.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct LayerAspect {
    /// Name of the layer.
    pub name: String,
    /// Height of its levels over the length of the skin's edges near the tool.
    pub aspect: f64,
}

impl Note {
    /// Whether the note reveals that there is a lump, or its place.
    pub fn is_about_lumps(&self) -> bool {
        // A lump alone can make skin or levels too coarse.
        matches!(
            self,
            Self::LumpNotRefined { .. }
                | Self::LumpPartlyOutside { .. }
                | Self::SkinTooCoarse { .. }
                | Self::LevelsTooHigh { .. }
        )
    }
}

/// The JSON Schema (2020-12) of [`Note`].
pub fn note_schema() -> serde_json::Value {
    schemars::schema_for!(Note).to_value()
}

/// A point as an array, for a note.
pub(crate) fn xyz(p: Vec3) -> [f64; 3] {
    p.into()
}

/// Shows a point in millimetres.
struct Mm([f64; 3]);

impl fmt::Display for Mm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&crate::build::in_mm(self.0.into()))
    }
}

impl fmt::Display for Note {
    #[expect(clippy::too_many_lines, reason = "one arm a note")]
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mm = |length: &f64| length * 1e3;
        match self {
            Self::FileRead { file, note } => write!(f, "{file}: {note}"),
            Self::UnusualSize { file, size } => write!(
                f,
                "{file} measures {size:.4} m from corner to corner, which no body part does; check `unit` in the \
                 scene's [body]"
            ),
            Self::Repaired {
                file,
                n_welded,
                n_degenerate,
                n_duplicate,
                n_unused,
                n_flipped,
            } => {
                let counts = [
                    (n_welded, "vertices welded"),
                    (n_degenerate, "triangles without area dropped"),
                    (n_duplicate, "double triangles dropped"),
                    (n_unused, "unused vertices dropped"),
                    (n_flipped, "triangles turned outward"),
                ];
                let done: Vec<String> = (counts.iter())
                    .filter(|(n, _)| **n > 0)
                    .map(|(n, what)| format!("{n} {what}"))
                    .collect();
                write!(f, "{file}: repaired on the way in: {}", done.join(", "))
            }
            Self::SkinCoarsened {
                n_given,
                n_vertices,
                deviation,
            } => write!(
                f,
                "the skin was coarsened from {n_given} to {n_vertices} vertices where it is finer than wanted; it is at most \
                 {:.2} mm from the given skin; [mesh] coarsen = false keeps all vertices",
                mm(deviation)
            ),
            Self::BaseOverlaps { n_pairs } => write!(
                f,
                "the base of the body passes through itself ({n_pairs} pairs of triangles): look at section.png or the VTU \
                 before you trust forces near there"
            ),
            Self::LayersThinned {
                share,
                median,
                least,
                at,
            } => write!(
                f,
                "layers are thinner than asked under {:.0} % of the skin's area, because there is too little room for them: \
                 usually {:.0} % of the asked thickness, at worst {:.0} %, under the skin at ({}) mm. Forces are those of \
                 the thinner layers; give the layers less thickness, or check the unit of the surfaces and the place of \
                 the bones",
                100.0 * share,
                100.0 * median,
                100.0 * least,
                Mm(*at)
            ),
            Self::LayersMoved {
                share,
                layer,
                asked,
                thickness,
                at,
            } => write!(
                f,
                "layers are more than 1 % thicker or thinner than asked under {:.2} % of the skin's area, to keep the mesh \
                 valid; worst under the skin at ({}) mm: layer \"{layer}\" is {:.2} mm instead of {:.2} mm thick; smooth \
                 or remesh the skin there, or use thinner layers",
                100.0 * share,
                Mm(*at),
                mm(thickness),
                mm(asked)
            ),
            Self::CutoutNear { radius, enough } => write!(
                f,
                "the cut-out's radius of {:.0} mm is less than the tool's radius plus twice the tissue's depth ({:.0} mm): the \
                 free rim may be felt; choose a larger cutout_radius",
                mm(radius),
                mm(enough)
            ),
            Self::ObliquePress { angle } => write!(
                f,
                "the press direction is {:.0}° from the skin's inward normal: the tool drags more than it presses",
                angle.to_degrees()
            ),
            Self::PressOnCutFace => f.write_str(
                "the press point lies on a cut face of the body; the force there is that of a free edge",
            ),
            Self::PlaceOffSkin {
                asked,
                at,
                distance,
            } => write!(
                f,
                "the point ({}) mm is {:.1} mm from the skin; the tool presses the nearest point of the skin, ({}) mm",
                Mm(*asked),
                mm(distance),
                Mm(*at)
            ),
            Self::NodeBeside { distance } => write!(
                f,
                "the tool holds a single vertex, and the nearest one is {:.3} mm beside the press point; a disc or a tool \
                 that touches presses at the point itself",
                distance * 1e3
            ),
            Self::ToolOverRim { share } => write!(
                f,
                "{:.0} % of the tool's footprint is beyond the rim of the skin, where no tissue resists: press farther inside, \
                 or keep more of the body",
                (100.0 * share).max(1.0)
            ),
            Self::SkinTooCoarse {
                n_triangles,
                max_vertices,
            } => write!(
                f,
                "{n_triangles} skin triangles are larger than wanted near the tool or a lump, because [mesh] max_vertices = \
                 {max_vertices} was reached"
            ),
            Self::LevelsTooHigh { max_levels } => write!(
                f,
                "levels are thicker than wanted under the tool or round a lump, because the limit of {max_levels} \
                 levels was reached"
            ),
            Self::LumpNotRefined { lump } => write!(
                f,
                "the mesh is not refined round the lump \"{lump}\", because its size is not known; set [mesh] near_lumps"
            ),
            Self::LumpPartlyOutside { lump, share, at } => write!(
                f,
                "{:.0} % of the lump \"{lump}\" at ({}) mm lies in the tissue; the rest, outside the skin or in the bone, does \
                 not count",
                100.0 * share,
                Mm(*at)
            ),
            Self::DiscNotImprinted { why } => write!(
                f,
                "the edge of the disc could not be cut into the mesh, so the disc holds the vertices under it instead: \
                 {why}"
            ),
            Self::DiscPatch {
                n_vertices,
                radius,
                at,
                effective_radius,
            } => write!(
                f,
                "{n_vertices} skin vertices lie under the disc of radius {:.1} mm at ({}) mm; they hold a patch of radius \
                 {:.1} mm",
                mm(radius),
                Mm(*at),
                mm(effective_radius)
            ),
            Self::CutFaceNotFlat { at } => write!(
                f,
                "the cut face at ({}) mm is not flat, so it cannot be a plane of symmetry; it was left free",
                Mm(*at)
            ),
            Self::SpeedsAlike => f.write_str(
                "no tissue relaxes and nothing has mass here: every speed gives the same force",
            ),
            Self::SingleTriangles { n, n_all } => write!(
                f,
                "{n} of {n_all} skin triangles have no partner; the prisms under them are too stiff where tissue keeps its \
                 volume"
            ),
            Self::CoarseUnderTool { edge, radius } => write!(
                f,
                "skin edges near the tool are {:.1} mm long, more than half its contact radius of {:.1} mm: the force \
                 depends on the mesh; refine it with [mesh] near_tool",
                mm(edge),
                mm(radius)
            ),
            Self::CoarseAtEdge { edge, edge_radius } => write!(
                f,
                "skin edges near the tool are {:.1} mm long, more than its edge's radius of {:.1} mm: vertices find the \
                 rounded edge or miss it, so there can be several equilibria and the force depends on the steps; make the \
                 edge rounder, or refine the mesh with [mesh] near_tool",
                mm(edge),
                mm(edge_radius)
            ),
            Self::AccuracyTooFine {
                accuracy,
                asked,
                made,
            } => write!(
                f,
                "in real time, edges and levels near the tool are {:.0} % smaller for an accuracy of {} than by \
                 default, not {:.0} %: finer ones make steps late, which costs more force than they gain. Expect more \
                 error than asked for; `palpa press` keeps the accuracy",
                100.0 * made,
                Share::from_si(*accuracy),
                100.0 * asked,
            ),
            Self::TensionLost { layer } => write!(
                f,
                "the cut faces are free, so most of the tension of \"{layer}\" is lost (for example, 30 kPa in the skin \
                 of a block 60 mm wide fall to 3 kPa in its middle); set cut_faces = \"fixed\" or \"symmetric\" in \
                 [body] to keep it"
            ),
            Self::FewUnderDisc {
                n_vertices,
                radius,
                edge,
            } => write!(
                f,
                "only {n_vertices} skin vertices lie under the tool of radius {:.1} mm, with edges of {:.1} mm there: the force \
                 depends on the mesh; take a finer skin or a larger tool",
                mm(radius),
                mm(edge)
            ),
            Self::TensionLeftOut => {
                f.write_str("bars are without tension at rest; `prestress` was left out")
            }
            Self::FirstSpeedOnly => f.write_str(
                "forces of bars do not depend on time, so every speed gives the same force; only the first of `speeds` \
                 was run",
            ),
            Self::BarAspects {
                layers,
                least,
                most,
            } => {
                let unsound: Vec<String> = (layers.iter())
                    .map(|layer| format!("{} {:.2}", layer.name, layer.aspect))
                    .collect();
                write!(
                    f,
                    "height of levels over length of skin edges near the tool: {}; outside {least} to {most} bars are too stiff \
                     across or too soft in shear, and the force depends on the number of levels",
                    unsound.join(", ")
                )
            }
            Self::MotionOffSkin { far, length } => write!(
                f,
                "{:.0} mm along its motion the tool is off the skin, where nothing is felt; shorten [motion] length = \"{:.0} mm\"",
                mm(far),
                mm(length)
            ),
            Self::ToolReplaced { tool, by } => {
                write!(f, "a hand presses by contact: the scene's {tool} was replaced by a {by}")
            }
            Self::CoarserForTouch { edge } => write!(
                f,
                "the skin's edges under the tool are {:.1} mm long, so that the body can follow a hand; [mesh] near_tool makes \
                 them finer",
                mm(edge)
            ),
            Self::StepFailed {
                speed,
                depth,
                outcome,
            } => write!(
                f,
                "at {} mm/s the step to {:.2} mm FAILED: {}; results end before it. Press less deep, refine the mesh there, or \
                 make [model] alpha smaller",
                tidy(mm(speed)),
                mm(depth),
                in_words(outcome)
            ),
            Self::TurnedPrisms { n, depth, at } => write!(
                f,
                "{n} prisms have a corner turned inside out at a depth of {:.2} mm, the worst near ({}) mm; the stress \
                 there is not reliable, and the force may be off: press less deep, or make the mesh finer there with \
                 [mesh] near_tool or near_lumps",
                mm(depth),
                Mm(*at)
            ),
            Self::FewTouching {
                n_vertices,
                radius,
                edge,
            } => write!(
                f,
                "at most {n_vertices} skin vertices touch the tool (contact radius {:.1} mm, skin edges {:.1} mm), so \
                 the force depends on the mesh; press deeper, or refine the mesh with [mesh] near_tool",
                mm(radius),
                mm(edge)
            ),
        }
    }
}

/// Removes the digits that come from binary fractions.
fn tidy(x: f64) -> f64 {
    (x * 1e9).round() / 1e9
}

/// The outcome of a step, in words.
pub fn in_words(outcome: &Outcome) -> String {
    let near = |at: &[f64; 3]| Mm(*at).to_string();
    match outcome {
        Outcome::Converged => "converged".to_owned(),
        Outcome::IterationLimit { at } => {
            format!(
                "no equilibrium was found, the largest imbalance is near ({}) mm",
                near(at)
            )
        }
        Outcome::Inverted { at } => {
            format!(
                "the tissue would be turned inside out near ({}) mm",
                near(at)
            )
        }
        Outcome::Singular => "the tissue has lost its stiffness".to_owned(),
    }
}
