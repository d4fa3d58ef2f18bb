//! Errors of a model.

use palpa_sparse::TooLarge;

/// Why a model cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FemError {
    /// A prism is inverted or has no volume at rest.
    #[error(
        "the prism under triangle {triangle} in interval {interval} is inverted or flat at rest, near ({:.2}, {:.2}, {:.2}) mm; \
         grow the body again or mend its skin there",
        at[0] * 1e3, at[1] * 1e3, at[2] * 1e3
    )]
    InvertedPrism {
        /// Skin triangle.
        triangle: u32,
        /// Interval between levels, from the skin.
        interval: usize,
        /// Its middle, m.
        at: [f64; 3],
    },
    /// The stiffness at rest is not positive definite: the body is unstable under its own tension,
    /// or nothing holds it.
    #[error(
        "the body is not stable at rest, near ({:.2}, {:.2}, {:.2}) mm; fix its base, or take less pre-stress",
        at[0] * 1e3, at[1] * 1e3, at[2] * 1e3
    )]
    NoRest {
        /// The place, m.
        at: [f64; 3],
    },
    /// The number of materials does not match the number of layers.
    #[error(
        "the body has {n_layers} layers, and {n_materials} of them have a material; give one for each"
    )]
    Layers {
        /// Layers of the body.
        n_layers: usize,
        /// Materials given for them.
        n_materials: usize,
    },
    /// A layer or lump names a material that does not exist.
    #[error("material {material} does not exist; there are only {n_materials}")]
    NoSuchMaterial {
        /// The index.
        material: usize,
        /// Number of materials.
        n_materials: usize,
    },
    /// A small-strain material together with others.
    #[error(
        "material \"{linear}\" is linear (small strain) and \"{finite}\" is not; all materials of a body must be \
         linear, or none: give both the same kind of law"
    )]
    MixedKinematics {
        /// Name of a linear material.
        linear: String,
        /// Name of another material.
        finite: String,
    },
    /// A lump whose law measures volume differently from the layer around it.
    #[error(
        "lump material \"{lump}\" and layer material \"{layer}\" measure the change of volume differently; do not mix \
         St. Venant–Kirchhoff with other laws in one place"
    )]
    MixedVolume {
        /// Material of the lump.
        lump: String,
        /// Material of the layer.
        layer: String,
    },
    /// A material with impossible values.
    #[error("material \"{name}\": {source}")]
    Material {
        /// Its name.
        name: String,
        /// The error.
        source: crate::law::LawError,
    },
    /// `alpha` is out of range.
    #[error(
        "alpha is {alpha}, outside 0 to below 1; 0.8 is a good value, and 1 leaves hourglass modes"
    )]
    Alpha {
        /// The value given.
        alpha: f64,
    },
    /// The share of the bulk modulus between the wedges of a pair is out of range.
    #[error(
        "apart is {apart}, outside 0 to 1; 0.1 is enough for soft layers that are squeezed flat"
    )]
    Apart {
        /// The value given.
        apart: f64,
    },
    /// The factor would need too much memory.
    #[error(
        "the factor of {n_dofs} unknowns would take more than 8 GiB; make the mesh coarser, with fewer levels, or cut out a part"
    )]
    TooLarge {
        /// Number of unknowns.
        n_dofs: usize,
    },
}

impl From<TooLarge> for FemError {
    fn from(error: TooLarge) -> Self {
        Self::TooLarge {
            n_dofs: error.n_dofs,
        }
    }
}
