//! The tables of tools and lumps in a scene file.

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

/// The tool. A disc and a node are bonded to the skin; all other shapes press by contact.
#[derive(Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ToolTable {
    /// Shape of the tool. Default: "disc".
    #[serde(default)]
    pub(crate) shape: ToolShape,
    /// Disc, sphere, flat punch and capsule: the radius, 0.1 mm to 200 mm. Cone: the radius of its
    /// shaft. Default: "8 mm".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) radius: Option<Length>,
    /// Fingertip only: the radii of the pad along the finger, across it and in the direction of the
    /// press, each 0.1 mm to 200 mm. Default: ["8 mm", "7 mm", "7 mm"], with radii of curvature of
    /// 9.1 mm along and 7 mm across the finger. The pads of index fingers have 7-10 mm and 6-8 mm
    /// (from memory, after Serina et al. 1998).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) radii: Option<[Length; 3]>,
    /// Capsule only: the length of the straight part, 0.1 mm to 400 mm. Default: "20 mm".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) length: Option<Length>,
    /// Box only: the full size along, across and in the direction of the press, each 0.2 mm to 400
    /// mm. Default: ["16 mm", "16 mm", "16 mm"].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) size: Option<[Length; 3]>,
    /// Cone only: the full angle at the tip, 20 deg to 160 deg. Default: "120 deg".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) opening_angle: Option<Angle>,
    /// Cone only: the radius of the rounded tip, 1 µm to 200 mm, no more than `radius`. Default: "3
    /// mm", or `radius` if that is less.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) tip_radius: Option<Length>,
    /// Flat punch, box and cone: the radius of the rounded edges, 1 µm to 200 mm. It is limited to
    /// the radius of the punch or cone, or to half the smallest size of the box. Default: 0.3 of
    /// these.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) edge_radius: Option<Length>,
    /// Capsule, box and fingertip: the direction of the tool's length. Only the part across the
    /// press counts. Default: as near to x as possible, or to y if the press is along x.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) axis: Option<AxisSpec>,
    /// All shapes except disc and node: Coulomb's coefficient of friction with the skin, 0 to 5.
    /// Default: 0, without friction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) friction: Option<f64>,
}

/// A lump in the layers. It lies either below a place of the skin (`depth`, with `below` or where
/// the tool presses), or at a point of the body (`at`). A mesh may also keep the position in its
/// file.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct LumpTable {
    /// Name of the lump in reports. Default: "lump".
    #[serde(default = "default_name")]
    pub(crate) name: String,
    /// Shape of the lump. Default: "sphere".
    #[serde(default)]
    pub(crate) shape: LumpShapeName,
    /// Sphere and capsule: the radius, 0.1 mm to 200 mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) radius: Option<Length>,
    /// Ellipsoid only: the three radii, each 0.1 mm to 200 mm: along `axis`, across it, and into
    /// the depth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) radii: Option<[Length; 3]>,
    /// Capsule only: the length of the straight part, 0.1 mm to 400 mm. The total length is two
    /// radii more.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) length: Option<Length>,
    /// Mesh only: a closed triangle mesh in the frame and unit of the body.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) file: Option<PathBuf>,
    /// Depth of the lump's centre below the skin at rest, along the inward normal, 0.1 mm to 500
    /// mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) depth: Option<Length>,
    /// With `depth`: the lump lies below the point of the skin nearest to this point, each
    /// coordinate within 10 m. Default: where the tool presses (`press.at`, `press.vertex` or the
    /// middle of the skin).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) below: Option<[Length; 3]>,
    /// With `depth`, instead of `below`: number of the skin vertex that the lump lies below, from
    /// 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) below_vertex: Option<u32>,
    /// Instead of `depth`: the centre of the lump, each coordinate within 10 m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) at: Option<[Length; 3]>,
    /// Ellipsoid and capsule: the direction of the first radius, or of the length. Default: along
    /// the skin, as near to x as possible, or to y if the skin's normal is along x.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) axis: Option<AxisSpec>,
    /// Name of a tissue in the catalogue, or a table with its values.
    pub(crate) tissue: TissueSpec,
    /// Width of the transition between the lump's tissue and the tissue around it, centred on the
    /// lump's surface, 0 m to 50 mm and no more than twice the smallest radius. Default: "0 m", a
    /// sharp edge.
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
