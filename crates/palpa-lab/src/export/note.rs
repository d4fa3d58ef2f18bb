//! Notes on a deck.

use std::fmt;

/// A note on a deck, for the user. `Display` gives the English text.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum DeckNote {
    /// The deck has the nearest feature that CalculiX has.
    Departure(Departure),
    /// A tissue relaxes. The deck has it fully relaxed, as in a very slow press.
    Relaxed {
        /// Name of the tissue.
        tissue: String,
    },
    /// A lump holds the middle of no prism, so the deck is without it.
    LumpMissing {
        /// Name of the lump's tissue.
        tissue: String,
    },
}

/// A feature that CalculiX cannot express. `Display` gives the English text.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Departure {
    /// The tension of a layer at rest is left out.
    Tension {
        /// Name of the layer's tissue.
        layer: String,
        /// The tension, Pa.
        prestress: f64,
    },
    /// The energy of the volume is `K/2 (ln J)²` in the scene and `K/2 (J − 1)²` in the deck.
    Volume {
        /// Name of the tissue.
        tissue: String,
    },
    /// Fung's exponential is the first three terms of its series.
    Fung {
        /// Name of the tissue.
        tissue: String,
        /// The factor `b` in the exponent, a pure number.
        b: f64,
    },
    /// Gent's logarithm is the first three terms of its series, which have no limit of stretch.
    Gent {
        /// Name of the tissue.
        tissue: String,
        /// Gent's limit `J_m` of `Ī₁ − 3`, a pure number.
        limit: f64,
    },
}

impl fmt::Display for DeckNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Departure(departure) => departure.fmt(f),
            Self::Relaxed { tissue } => write!(
                f,
                "tissue \"{tissue}\" relaxes; the deck has it at rest, as pressed very slowly"
            ),
            Self::LumpMissing { tissue } => write!(
                f,
                "a lump of tissue \"{tissue}\" holds the middle of no prism, so the deck is without it; make levels and skin \
                 finer there"
            ),
        }
    }
}

impl fmt::Display for Departure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tension { layer, .. } => {
                write!(f, "the tension at rest of layer \"{layer}\" is left out")
            }
            Self::Volume { tissue } => write!(
                f,
                "tissue \"{tissue}\" has K/2 (ln J)² for its volume, and the deck K/2 (J − 1)²"
            ),
            Self::Fung { tissue, .. } => write!(
                f,
                "tissue \"{tissue}\" has Fung's exponential, and the deck the first three terms of its series"
            ),
            Self::Gent { tissue, .. } => write!(
                f,
                "tissue \"{tissue}\" has Gent's logarithm with its limit of stretch, and the deck the first three terms of \
                 its series, without limit"
            ),
        }
    }
}
