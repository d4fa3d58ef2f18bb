//! "Find the lump": what is sent about its levels, rounds and results.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{LumpInfo, Vec3};

/// How hard a round is.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Level {
    /// Large, shallow, stiff lumps on the side of the press point.
    Easy,
    /// Between the two.
    Medium,
    /// Small, deep lumps, little stiffer than the tissue around them.
    Hard,
}

/// What the palpation map shows while lumps are hidden.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MapSight {
    /// Nothing.
    Nothing,
    /// The stiffness, without the comparison with the surroundings.
    Stiffness,
    /// Everything.
    Everything,
}

/// A level: the ranges from which its lumps are drawn, all values equally likely.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LevelInfo {
    /// The level.
    pub level: Level,
    /// Least and largest radius, m.
    pub radius: [f64; 2],
    /// Least and largest thickness of the tissue between the skin and the top of a lump, m.
    pub cover: [f64; 2],
    /// Least and largest Young's modulus, in multiples of that of the layer around the centre.
    pub times: [f64; 2],
    /// Whether lumps may lie on all sides of the body; otherwise on the side of the press point.
    pub is_either_side: bool,
    /// What the palpation map shows while lumps are hidden.
    pub map: MapSight,
}

/// A game of "find the lump": one round or a series of them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct GameInfo {
    /// The seed of the round. With the level, it gives the same round again.
    pub seed: u64,
    /// The level of the round.
    pub level: Level,
    /// Number of hidden lumps.
    pub n_lumps: u32,
    /// Whether lumps may lie on the side that faces away from the press point, and there is one.
    pub is_either_side: bool,
    /// The user's marks, points of the skin, m.
    pub marks: Vec<Vec3>,
    /// Time since the start of the round, s; it stops when the lumps are revealed.
    pub seconds: f64,
    /// The result, once the lumps are revealed.
    pub result: Option<GameResult>,
    /// The series to which the round belongs.
    pub series: SeriesInfo,
}

/// A series of rounds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SeriesInfo {
    /// The seed. The same seed gives the same series again; of a single round it is that of the
    /// round.
    pub seed: u64,
    /// The level of all rounds; null if each round drew its own.
    pub level: Option<Level>,
    /// Number of rounds.
    pub n_rounds: u32,
    /// The rounds whose lumps are revealed, in their order.
    pub rounds: Vec<RoundInfo>,
}

/// A round whose lumps are revealed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RoundInfo {
    /// The seed of the round.
    pub seed: u64,
    /// Its level.
    pub level: Level,
    /// Time from the start to the result, s.
    pub seconds: f64,
    /// The user's marks, points of the skin, m.
    pub marks: Vec<Vec3>,
    /// The result, without the places that were pressed and the paths along the skin.
    pub result: GameResult,
}

/// The result of a round.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct GameResult {
    /// The lumps, each with its mark.
    pub lumps: Vec<FoundLump>,
    /// Number of lumps that were found.
    pub n_found: u32,
    /// Number of marks that belong to no lump.
    pub n_stray_marks: u32,
    /// Largest force used, N.
    pub max_force: f64,
    /// Mean force during contact, N.
    pub mean_force: f64,
    /// Time in contact, s.
    pub contact_seconds: f64,
    /// Number of contacts with the skin, each from touching to lifting.
    pub n_presses: u32,
    /// Share of the skin area under which lumps may be hidden that was pressed, 0 to 1.
    pub covered: f64,
    /// The places that were pressed: point of the skin (x, y, z, m) and largest force there (N).
    pub coverage: Vec<[f64; 4]>,
    /// The score.
    pub score: Score,
}

/// The score of a round: four parts of 0 to 25 points, and a total of 0 to 100.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Score {
    /// The sum of the parts, times lumps found over lumps hidden or marks set, whichever is more.
    pub total: u32,
    /// For the time.
    pub time: u32,
    /// For the largest force.
    pub force: u32,
    /// For the number of presses.
    pub presses: u32,
    /// For the area explored.
    pub area: u32,
}

/// A lump and the mark that belongs to it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FoundLump {
    /// The lump.
    pub lump: LumpInfo,
    /// Its radius, m.
    pub radius: f64,
    /// Depth of its centre below the skin, m.
    pub depth: f64,
    /// Young's modulus in multiples of that of the layer around its centre.
    pub times: f64,
    /// The point of the skin nearest to its centre, m.
    pub over: Vec3,
    /// The outward normal of the skin there.
    pub normal: Vec3,
    /// Its mark, an index into the marks; null without one.
    pub mark: Option<u32>,
    /// Distance from the mark to the point over the lump, along the skin at rest, m; null without a
    /// mark.
    pub error: Option<f64>,
    /// Largest distance that counts as found, m.
    pub tolerance: f64,
    /// Whether the lump was found: the distance is not above `tolerance`.
    pub is_found: bool,
    /// Whether mark and lump lie on opposite sides of the body: the skin faces away from each other.
    pub is_other_side: bool,
    /// The shortest path along the skin from the mark to the point over the lump, m.
    pub path: Vec<Vec3>,
    /// Whether the skin over the lump was pressed.
    pub is_explored: bool,
    /// How much stiffer than its surroundings the skin over the lump was felt, as a share; null if
    /// too little was felt there.
    pub felt: Option<f64>,
}
