//! The format of a file.

use schemars::JsonSchema;
use serde::Serialize;

use super::{stl, text};

/// A file format for surfaces that can be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Format {
    /// Wavefront OBJ.
    Obj,
    /// STL, ASCII or binary.
    Stl,
    /// PLY, ASCII or binary of either byte order.
    Ply,
    /// Object File Format, ASCII.
    Off,
    /// glTF 2.0, as JSON or as binary GLB.
    Gltf,
}

impl std::fmt::Display for Format {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Obj => "OBJ",
            Self::Stl => "STL",
            Self::Ply => "PLY",
            Self::Off => "OFF",
            Self::Gltf => "glTF",
        })
    }
}

impl Format {
    const ALL: [Self; 5] = [Self::Obj, Self::Stl, Self::Ply, Self::Off, Self::Gltf];

    /// The file extensions of the format, in lower case and without the dot.
    pub fn extensions(self) -> &'static [&'static str] {
        match self {
            Self::Obj => &["obj"],
            Self::Stl => &["stl"],
            Self::Ply => &["ply"],
            Self::Off => &["off"],
            Self::Gltf => &["glb", "gltf"],
        }
    }

    /// The format for an extension; it must be in lower case.
    pub fn of_extension(extension: &str) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|f| f.extensions().contains(&extension))
    }

    /// The format of some content, by its first bytes, else by its extension, else by a look at its
    /// lines.
    pub(super) fn of(bytes: &[u8], extension: Option<&str>) -> Option<Self> {
        Self::of_magic(bytes)
            .or_else(|| extension.and_then(Self::of_extension))
            .or_else(|| looks_like_obj(bytes).then_some(Self::Obj))
    }

    /// The format, if the content has an unmistakable mark.
    fn of_magic(bytes: &[u8]) -> Option<Self> {
        if stl::is_binary(bytes) {
            return Some(Self::Stl);
        }
        let head = text::decode(&bytes[..bytes.len().min(4096)]).0;
        let head = head.trim_start();
        if bytes.starts_with(b"glTF") || (head.starts_with('{') && head.contains('"')) {
            return Some(Self::Gltf);
        }
        let first = head.split_whitespace().next()?;
        match first {
            "ply" => Some(Self::Ply),
            "solid" if head.contains("facet") || head.contains("endsolid") => Some(Self::Stl),
            _ if first.ends_with("OFF") && first.len() <= 6 => Some(Self::Off),
            _ => None,
        }
    }
}

/// Whether a line near the top begins like a vertex of an OBJ file.
fn looks_like_obj(bytes: &[u8]) -> bool {
    let head = text::decode(&bytes[..bytes.len().min(4096)]).0;
    head.lines().any(|line| {
        let mut words = line.split_whitespace();
        words.next() == Some("v") && words.filter(|w| w.parse::<f64>().is_ok()).count() >= 3
    })
}
