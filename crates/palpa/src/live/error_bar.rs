//! The error bar of the live mesh: how far the force of the loop may be from that of an infinitely
//! fine mesh.
//!
//! ```text
//!  moment: mesh and pose of the tool ─► the same place, direction and depth, pressed statically ─► probes
//! ```
//! The mesh is the one that the loop uses at that moment, with its triangles and levels; the press
//! and its probes are those of [`accuracy`](crate::accuracy).

use std::fmt;
use std::sync::Arc;

use nalgebra::Unit;
use palpa_fem::{Model, PosedTool};
use palpa_mesh::Vec3;
use palpa_scene::{Target, Tool};

use crate::Prepared;
use crate::accuracy::{Descent, Probed, Source};
use crate::build::nearest;
use crate::error::one_paragraph;
use crate::press::Place;
use crate::press::tissue::Indentation;
use crate::skin::{Skin, SkinPoint};

/// Meshes with more nodes are not probed: probes would take gigabytes, and longer than anybody
/// presses.
const MOST_NODES: usize = 30_000;
/// The tool's way meets the skin to this accuracy, m, and the largest number of steps to find it.
const ON_SKIN: f64 = 1e-7;
const MOST_STEPS: usize = 30;

/// The tool and the mesh of the loop at one moment.
#[derive(Debug, Clone)]
pub struct Moment {
    /// The finite elements that the loop uses.
    pub model: Arc<Model>,
    /// The tool with its pose, in the scene's frame.
    pub tool: PosedTool,
}

/// The error bar of the live mesh at a place and depth.
#[derive(Debug, Clone, PartialEq)]
pub struct LiveBar {
    /// The place of the skin at rest on the way of the tool, m.
    pub at: Vec3,
    /// Unit vector along which the tool presses.
    pub direction: Vec3,
    /// Number of nodes of the mesh.
    pub n_nodes: usize,
    /// Half the width of the bar, as a share of the force.
    pub half_width: f64,
    /// Depth below the first touch, static force, and contributions.
    pub probed: Probed,
}

/// Why there is no error bar. `Display` has the English words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum NoBar {
    /// The tool is not pressed into the skin.
    NotTouching,
    /// The mesh is too large to be probed beside the loop.
    TooLarge {
        /// Number of its nodes.
        n_nodes: usize,
        /// Largest number of nodes.
        most_nodes: usize,
    },
    /// No equilibrium of the tool at this place and depth was found.
    NoEquilibrium,
    /// A probe found no equilibrium, or would be too large.
    ProbeFailed {
        /// The probe.
        probe: Source,
    },
    /// The probes were given up, since their result was not needed any more.
    Interrupted,
    /// The press could not be set up.
    Refused {
        /// The reason, in English.
        reason: String,
    },
    /// A bug in Palpa.
    Panicked,
}

impl fmt::Display for NoBar {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotTouching => f.write_str("the tool does not touch the skin"),
            Self::TooLarge {
                n_nodes,
                most_nodes,
            } => write!(
                f,
                "the mesh has {n_nodes} nodes; at most {most_nodes} are probed beside the loop"
            ),
            Self::NoEquilibrium => {
                f.write_str("no static equilibrium was found at this place and depth")
            }
            Self::ProbeFailed { probe } => {
                write!(f, "the probe with finer {probe} found no equilibrium")
            }
            Self::Interrupted => f.write_str("interrupted"),
            Self::Refused { reason } => f.write_str(reason),
            Self::Panicked => f.write_str("the probes failed because of a bug in Palpa"),
        }
    }
}

/// Presses the live mesh of a prepared scene statically where the tool is, and probes it.
/// `goes_on` is asked before each solve; if it returns false, the rest is given up.
///
/// The press comes straight from rest: lag, inertia, relaxation and earlier slip of the loop are
/// not in it.
///
/// # Errors
/// [`NoBar`] if there is no such bar.
pub fn probe(
    prepared: &Prepared,
    moment: &Moment,
    goes_on: impl Fn() -> bool,
) -> Result<LiveBar, NoBar> {
    let n_nodes = moment.model.n_nodes();
    if n_nodes > MOST_NODES {
        return Err(NoBar::TooLarge {
            n_nodes,
            most_nodes: MOST_NODES,
        });
    }
    if !goes_on() {
        return Err(NoBar::Interrupted);
    }
    let prepared = pressed_there(prepared, moment)?;
    let place = *prepared.place();
    let press = Indentation::build(Arc::new(prepared)).map_err(|error| refused(&error))?;
    if !goes_on() {
        return Err(NoBar::Interrupted);
    }
    let mut is_given_up = false;
    let descent = Descent::from_rest(&press, || {
        is_given_up = !goes_on();
        !is_given_up
    });
    if is_given_up {
        return Err(NoBar::Interrupted);
    }
    let descent = descent.ok_or(NoBar::NoEquilibrium)?;
    let bars = descent.probe(&press, |_, _| goes_on());
    let probed = bars.ok_or(NoBar::Interrupted)?.deepest().clone();
    let failed = (Source::ALL.into_iter().zip(probed.changes)).find(|(_, change)| change.is_none());
    if let Some((probe, _)) = failed {
        return Err(NoBar::ProbeFailed { probe });
    }
    Ok(LiveBar {
        at: place.at,
        direction: place.direction.into_inner(),
        n_nodes,
        half_width: probed.half_width().ok_or(NoBar::NoEquilibrium)?,
        probed,
    })
}

fn refused(error: &anyhow::Error) -> NoBar {
    NoBar::Refused {
        reason: one_paragraph(error),
    }
}

/// The scene on the live mesh, pressed straight to where the tool is.
fn pressed_there(prepared: &Prepared, moment: &Moment) -> Result<Prepared, NoBar> {
    let body = moment.model.body();
    let pose = &moment.tool.pose;
    let tip = pose.translation.vector;
    // In its own frame the tip is the origin, and z points out of the tissue.
    let direction = -(pose.rotation * Vec3::z());
    let skin = Skin::new(&body.skin);
    let point = meet(&skin, tip, direction).ok_or(NoBar::NotTouching)?;
    let place = Place {
        vertex: nearest(&body.skin, point.at),
        at: point.at,
        direction: Unit::new_normalize(direction),
        tissue_depth: point.column_length(body),
        point,
        asked: None,
    };
    let mut scene = prepared.scene.clone();
    let Tool::Contact(tool) = &mut scene.tool else {
        return Err(NoBar::NotTouching);
    };
    tool.axis = Some((pose.rotation * Vec3::x()).into());
    let tool = *tool;
    scene.press.target = Target::Point(place.at.into());
    scene.press.direction = Some(direction.into());
    scene.press.speeds.clear();
    let mut there = prepared.on_mesh(scene, &moment.model, place);
    let rest = if there.is_tense() {
        Some(there.rest().map_err(|error| refused(&error))?)
    } else {
        None
    };
    let approach = there.approach(&tool, rest.as_ref());
    let approach = approach.map_err(|error| refused(&error))?;
    let touch = approach.at(0.0).pose.translation.vector;
    let depth = (tip - touch).dot(&direction);
    if depth <= 0.0 {
        return Err(NoBar::NotTouching);
    }
    if depth >= place.tissue_depth {
        return Err(NoBar::NoEquilibrium);
    }
    there.scene.press.depth = depth;
    there.scene.press.step = depth;
    Ok(there)
}

/// The point of the skin at which the straight way of a tip enters the body.
fn meet(skin: &Skin<'_>, tip: Vec3, direction: Vec3) -> Option<SkinPoint> {
    let mut on_way = tip;
    let mut point = skin.nearest(on_way)?;
    for _ in 0..MOST_STEPS {
        // The skin near the point is its tangent plane.
        let normal = skin.inward(&point);
        let slant = normal.dot(&direction);
        if slant <= 0.0 {
            return None;
        }
        on_way += direction * ((point.at - on_way).dot(&normal) / slant);
        point = skin.nearest(on_way)?;
        if (point.at - on_way).norm() < ON_SKIN {
            break;
        }
    }
    Some(point)
}
