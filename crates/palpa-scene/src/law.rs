//! The elastic laws that a scene can name.
//!
//! To add a law: its name in [`LawName`], its parameters in [`Energy`] and [`LawName::keys`], and
//! an arm in each `match` of this file that the compiler asks for. A number that no law has yet is
//! declared in `parameters.rs`. The law itself is one file of `palpa-fem/src/law`, whose head lists
//! the other places. Reading, checking, writing, schema and reports follow from these.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::parameters::Numbers;
use crate::units::Pressure;
use crate::{Sourced, Stiffness};

/// The elastic laws for a tissue.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum LawName {
    /// Small strain with constant stiffness. Takes `young` or `shear`.
    Linear,
    /// The linear law with large rotations; it softens under compression, and serves for comparison
    /// only. Takes `young` or `shear`.
    StVenantKirchhoff,
    /// C10 (I1 − 3). Takes `young`, `shear` or `c10`.
    #[default]
    NeoHookean,
    /// C10 (I1 − 3) + C01 (I2 − 3). Takes `young`, `shear` or `c10`, and `c01`.
    MooneyRivlin,
    /// C10 (I1 − 3) + C20 (I1 − 3)² + C30 (I1 − 3)³. Takes `young`, `shear` or `c10`, and `c20`,
    /// `c30`.
    Yeoh,
    /// Σ 2µ/α² (λ1^α + λ2^α + λ3^α − 3). Takes `terms`, or `young` or `shear` with `alpha`.
    Ogden,
    /// µ/(2b) (exp(b (I1 − 3)) − 1). Stiffens as skin does. Takes `young` or `shear`, and `b`.
    Fung,
    /// −µ jm/2 ln(1 − (I1 − 3)/jm). Has a limit of stretch. Takes `young` or `shear`, and `jm`.
    Gent,
}

/// The deviatoric part of a strain energy. `Ī1`, `Ī2` are the isochoric invariants, `λ̄` the
/// isochoric stretches.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Energy {
    /// `µ dev ε : dev ε` of the small strain `ε`, with constant stiffness.
    Linear {
        /// Determines `µ`.
        stiffness: Stiffness,
    },
    /// `µ dev E : dev E` of the Green–Lagrange strain `E`; it softens under compression, and serves
    /// for comparison only.
    StVenantKirchhoff {
        /// Determines `µ`.
        stiffness: Stiffness,
    },
    /// `C10 (Ī1 − 3)`, `µ = 2 C10`.
    NeoHookean {
        /// Determines `C10`.
        stiffness: Stiffness,
    },
    /// `C10 (Ī1 − 3) + C01 (Ī2 − 3)`, `µ = 2 (C10 + C01)`.
    MooneyRivlin {
        /// Determines `C10`.
        stiffness: Stiffness,
        /// `C01` in pascals, 0 or more.
        c01: Sourced,
    },
    /// `C10 (Ī1 − 3) + C20 (Ī1 − 3)² + C30 (Ī1 − 3)³`, `µ = 2 C10`.
    Yeoh {
        /// Determines `C10`.
        stiffness: Stiffness,
        /// `C20` in pascals.
        c20: Sourced,
        /// `C30` in pascals, 0 or more.
        c30: Sourced,
    },
    /// `Σ 2µᵢ/αᵢ² (λ̄1^αᵢ + λ̄2^αᵢ + λ̄3^αᵢ − 3)`, `µ = Σ µᵢ`, as in Abaqus and CalculiX.
    Ogden {
        /// 1 to 6 terms.
        terms: Vec<OgdenTerm>,
    },
    /// `µ/(2b) (exp(b (Ī1 − 3)) − 1)`: stiffens as skin does when its fibres straighten.
    Fung {
        /// Determines `µ`.
        stiffness: Stiffness,
        /// Rate of stiffening, above 0.
        b: Sourced,
    },
    /// `−µ Jm/2 ln(1 − (Ī1 − 3)/Jm)`: the stretch has the limit `Ī1 − 3 = Jm`.
    Gent {
        /// Determines `µ`.
        stiffness: Stiffness,
        /// The limit `Jm`, above 0.
        jm: Sourced,
    },
}

/// A term of Ogden's energy.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OgdenTerm {
    /// Its share `µᵢ` of the shear modulus, in pascals.
    pub mu: Sourced,
    /// Its exponent `αᵢ`, not 0.
    pub alpha: f64,
}

impl LawName {
    /// Name with the article, the alternative keys for the stiffness, and the other keys.
    /// `terms` is a list and not a parameter; `alpha` is its short form.
    fn words(
        self,
    ) -> (
        &'static str,
        &'static [&'static str],
        &'static [&'static str],
    ) {
        match self {
            Self::Linear => ("a linear", &["young", "shear"], &[]),
            Self::StVenantKirchhoff => ("a st-venant-kirchhoff", &["young", "shear"], &[]),
            Self::NeoHookean => ("a neo-hookean", &["young", "shear", "c10"], &[]),
            Self::MooneyRivlin => ("a mooney-rivlin", &["young", "shear", "c10"], &["c01"]),
            Self::Yeoh => ("a yeoh", &["young", "shear", "c10"], &["c20", "c30"]),
            Self::Ogden => ("an ogden", &["terms", "young", "shear"], &["alpha"]),
            Self::Fung => ("a fung", &["young", "shear"], &["b"]),
            Self::Gent => ("a gent", &["young", "shear"], &["jm"]),
        }
    }

    /// Its name as a scene writes it.
    pub(crate) fn name(self) -> &'static str {
        let named = self.named();
        named.split_once(' ').map_or(named, |(_, name)| name)
    }

    /// Its name with the article: `a fung`.
    pub(crate) fn named(self) -> &'static str {
        self.words().0
    }

    /// All its keys except those of the volume.
    pub(crate) fn keys(self) -> impl Iterator<Item = &'static str> {
        let (_, stiffness, own) = self.words();
        stiffness.iter().chain(own).copied()
    }

    /// Whether its volumetric energy is always quadratic.
    pub(crate) fn is_quadratic(self) -> bool {
        matches!(self, Self::Linear | Self::StVenantKirchhoff)
    }

    /// The energy with this stiffness. `own` gives the other parameters by their keys; for Ogden's
    /// law, `terms` are used.
    pub(crate) fn energy<E>(
        self,
        stiffness: impl FnOnce() -> Result<Stiffness, E>,
        own: impl Fn(&str) -> Result<Sourced, E>,
        terms: impl FnOnce() -> Result<Vec<OgdenTerm>, E>,
    ) -> Result<Energy, E> {
        Ok(match self {
            Self::Linear => Energy::Linear {
                stiffness: stiffness()?,
            },
            Self::StVenantKirchhoff => Energy::StVenantKirchhoff {
                stiffness: stiffness()?,
            },
            Self::NeoHookean => Energy::NeoHookean {
                stiffness: stiffness()?,
            },
            Self::MooneyRivlin => Energy::MooneyRivlin {
                c01: own("c01")?,
                stiffness: stiffness()?,
            },
            Self::Yeoh => Energy::Yeoh {
                c20: own("c20")?,
                c30: own("c30")?,
                stiffness: stiffness()?,
            },
            Self::Ogden => Energy::Ogden { terms: terms()? },
            Self::Fung => Energy::Fung {
                b: own("b")?,
                stiffness: stiffness()?,
            },
            Self::Gent => Energy::Gent {
                jm: own("jm")?,
                stiffness: stiffness()?,
            },
        })
    }
}

impl Energy {
    /// The law's name in a scene.
    pub(crate) fn law(&self) -> LawName {
        match self {
            Self::Linear { .. } => LawName::Linear,
            Self::StVenantKirchhoff { .. } => LawName::StVenantKirchhoff,
            Self::NeoHookean { .. } => LawName::NeoHookean,
            Self::MooneyRivlin { .. } => LawName::MooneyRivlin,
            Self::Yeoh { .. } => LawName::Yeoh,
            Self::Ogden { .. } => LawName::Ogden,
            Self::Fung { .. } => LawName::Fung,
            Self::Gent { .. } => LawName::Gent,
        }
    }

    /// Its name as a scene writes it.
    pub fn name(&self) -> &'static str {
        self.law().name()
    }

    /// The stiffness as it was given; `None` for Ogden's energy, whose terms determine it.
    pub fn stiffness(&self) -> Option<&Stiffness> {
        match self {
            Self::Linear { stiffness }
            | Self::StVenantKirchhoff { stiffness }
            | Self::NeoHookean { stiffness }
            | Self::MooneyRivlin { stiffness, .. }
            | Self::Yeoh { stiffness, .. }
            | Self::Fung { stiffness, .. }
            | Self::Gent { stiffness, .. } => Some(stiffness),
            Self::Ogden { .. } => None,
        }
    }

    /// The terms of Ogden's energy; empty for all others.
    pub fn terms(&self) -> &[OgdenTerm] {
        match self {
            Self::Ogden { terms } => terms,
            _ => &[],
        }
    }

    /// The parameters other than stiffness and terms, by their keys.
    pub(crate) fn own(&self) -> Numbers<&Sourced> {
        let mut numbers = Numbers::default();
        match self {
            Self::MooneyRivlin { c01, .. } => numbers.set("c01", c01),
            Self::Yeoh { c20, c30, .. } => {
                numbers.set("c20", c20);
                numbers.set("c30", c30);
            }
            Self::Fung { b, .. } => numbers.set("b", b),
            Self::Gent { jm, .. } => numbers.set("jm", jm),
            Self::Linear { .. }
            | Self::StVenantKirchhoff { .. }
            | Self::NeoHookean { .. }
            | Self::Ogden { .. } => {}
        }
        numbers
    }

    /// The contribution of the second invariant to half the shear modulus, in pascals.
    pub(crate) fn c01(&self) -> f64 {
        match self {
            Self::MooneyRivlin { c01, .. } => c01.value,
            _ => 0.0,
        }
    }

    /// The key of a parameter that makes the energy decrease with strain, given this `C10` in
    /// pascals, and the reason.
    pub(crate) fn fault(&self, c10: f64, shear: f64) -> Option<(&'static str, String)> {
        match self {
            Self::MooneyRivlin { c01, .. } if c10 < 0.0 => Some((
                "c01",
                format!(
                    "a `c01` of {} is more than the whole stiffness, half a shear modulus of {}; make it smaller",
                    Pressure::from_si(c01.value),
                    Pressure::rounded(shear, f64::round)
                ),
            )),
            // The slope C10 + 2 C20 x + 3 C30 x² has a root at x > 0.
            Self::Yeoh { c20, c30, .. }
                if c20.value < 0.0 && c20.value.powi(2) >= 3.0 * c10 * c30.value =>
            {
                Some((
                    "c20",
                    "the energy stops growing at a larger strain; take `c20` of 0 or more, or `c30` above c20²/(3 c10)"
                        .to_owned(),
                ))
            }
            _ => None,
        }
    }
}
