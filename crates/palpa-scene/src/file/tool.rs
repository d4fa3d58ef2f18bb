//! Tools and lumps as they are written.

#![expect(
    clippy::doc_link_with_quotes,
    reason = "these comments become the descriptions of the schema, which are plain text"
)]

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{AxisSpec, TissueSpec};
use crate::shape::ToolShape;
use crate::units::{Angle, Length};

/// What presses. A disc and a node hold the skin; the other shapes press by contact.
#[derive(Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ToolTable {
    /// Its shape. Default: "disc".
    #[serde(default)]
    pub(crate) shape: ToolShape,
    /// Disc, sphere, flat punch and capsule: its radius, 0.1 mm to 200 mm. Cone: that of its shaft. Default: "8 mm".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) radius: Option<Length>,
    /// Fingertip only: the radii of the pad along the finger, across it and in the direction of the press, each 0.1 mm to
    /// 200 mm. Default: ["8 mm", "7 mm", "7 mm"], which curve by 9.1 mm along and 7 mm across; pads of index fingers
    /// have 7-10 mm and 6-8 mm (from memory, after Serina et al. 1998).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) radii: Option<[Length; 3]>,
    /// Capsule only: the length of its straight part, 0.1 mm to 400 mm. Default: "20 mm".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) length: Option<Length>,
    /// Box only: its whole size along, across and in the direction of the press, each 0.2 mm to 400 mm. Default:
    /// ["16 mm", "16 mm", "16 mm"].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) size: Option<[Length; 3]>,
    /// Cone only: the whole angle at its tip, 20 deg to 160 deg. Default: "120 deg".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) opening_angle: Option<Angle>,
    /// Cone only: the radius by which its tip is rounded, 1 µm to 200 mm, no more than `radius`. Default: "3 mm", or
    /// `radius` if that is less.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) tip_radius: Option<Length>,
    /// Flat punch, box and cone: the radius by which the edges are rounded, 1 µm to 200 mm, no more than the radius of
    /// punch or cone or half the box's smallest size. Default: 0.3 of these.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) edge_radius: Option<Length>,
    /// Capsule, box and fingertip: the direction that the tool's length points along, as nearly as it can lying across the
    /// press. Default: as near to x as it goes, or to y where the press is along x.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) axis: Option<AxisSpec>,
    /// All but disc and node: Coulomb's coefficient of friction with the skin, 0 to 5. Default: 0, without friction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) friction: Option<f64>,
}

/// A lump in the layers. It lies below a place of the skin (`depth`, with `below` or where the tool presses) or in a place
/// of the body (`at`); a mesh may also stay where it is.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct LumpTable {
    /// What the lump is called in reports. Default: "lump".
    #[serde(default = "default_name")]
    pub(crate) name: String,
    /// Its shape. Default: "sphere".
    #[serde(default)]
    pub(crate) shape: LumpShapeName,
    /// Sphere and capsule: its radius, 0.1 mm to 200 mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) radius: Option<Length>,
    /// Ellipsoid only: its three radii, each 0.1 mm to 200 mm: along `axis`, across it, and into the depth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) radii: Option<[Length; 3]>,
    /// Capsule only: the length of its straight part, 0.1 mm to 400 mm; from end to end it is two radii longer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) length: Option<Length>,
    /// Mesh only: a closed triangle mesh in the frame and unit of the body.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) file: Option<PathBuf>,
    /// How deep the lump's centre is below the skin at rest, along its inward normal, 0.1 mm to 500 mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) depth: Option<Length>,
    /// With `depth`: the point whose nearest point of the skin the lump is below, each coordinate within 10 m. Default:
    /// where the tool presses (`press.at`, `press.vertex` or the middle of the skin).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) below: Option<[Length; 3]>,
    /// With `depth`, in place of `below`: the skin vertex that the lump is below, by its number, from 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) below_vertex: Option<u32>,
    /// In place of `depth`: where the lump's centre is, each coordinate within 10 m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) at: Option<[Length; 3]>,
    /// Ellipsoid and capsule: the direction of the first radius, or of the length. Default: along the skin, as near to x
    /// as it goes, or to y where the skin looks along x.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) axis: Option<AxisSpec>,
    /// The name of a tissue in the catalogue, or a table with its elasticity.
    pub(crate) tissue: TissueSpec,
    /// The width over which the lump passes into what is round it, with its surface in the middle, 0 m to 50 mm and no more
    /// than twice its smallest radius. Default: "0 m", a sharp edge.
    #[serde(default, skip_serializing_if = "super::is_none")]
    pub(crate) transition: Length,
}

/// The shapes of lumps.
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum LumpShapeName {
    /// A ball.
    #[default]
    Sphere,
    /// An ellipsoid.
    Ellipsoid,
    /// A cylinder with round ends.
    Capsule,
    /// A closed triangle mesh in a file.
    Mesh,
}

fn default_name() -> String {
    "lump".to_owned()
}
