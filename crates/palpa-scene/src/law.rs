//! From the numbers that are written of a tissue to its elastic law: which go together, and which are possible.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::limits;
use crate::units::Pressure;
use crate::{Elastic, Energy, Law, OgdenTerm, Resistance, Sourced, Status, Stiffness, Volume};

/// The elastic laws that a tissue can be given.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum LawName {
    /// Small strain, a stiffness that never changes. Takes `young` or `shear`.
    Linear,
    /// The linear law with large rotations; softens under compression, for comparison only. Takes `young` or `shear`.
    StVenantKirchhoff,
    /// C10 (I1 − 3): takes `young`, `shear` or `c10`.
    #[default]
    NeoHookean,
    /// C10 (I1 − 3) + C01 (I2 − 3): takes `young`, `shear` or `c10`, and `c01`.
    MooneyRivlin,
    /// C10 (I1 − 3) + C20 (I1 − 3)² + C30 (I1 − 3)³: takes `young`, `shear` or `c10`, and `c20`, `c30`.
    Yeoh,
    /// Σ 2µ/α² (λ1^α + λ2^α + λ3^α − 3): takes `terms`, or `young` or `shear` with `alpha`.
    Ogden,
    /// µ/(2b) (exp(b (I1 − 3)) − 1), which stiffens as skin does: takes `young` or `shear`, and `b`.
    Fung,
}

/// The numbers that are written of a tissue's elasticity, each within its own range.
#[derive(Debug, Clone, Default)]
pub(crate) struct Parts {
    pub(crate) law: LawName,
    pub(crate) young: Option<Sourced>,
    pub(crate) shear: Option<Sourced>,
    pub(crate) c10: Option<Sourced>,
    pub(crate) c01: Option<Sourced>,
    pub(crate) c20: Option<Sourced>,
    pub(crate) c30: Option<Sourced>,
    pub(crate) terms: Option<Vec<OgdenTerm>>,
    pub(crate) alpha: Option<Sourced>,
    pub(crate) b: Option<Sourced>,
    pub(crate) poisson: Option<Sourced>,
    pub(crate) bulk: Option<Sourced>,
    pub(crate) volume: Option<Volume>,
}

/// Why the numbers of a tissue make no law.
#[derive(Debug)]
pub(crate) struct LawFault {
    /// The key that is to blame, if one is.
    pub(crate) key: Option<&'static str>,
    pub(crate) message: String,
}

fn fault<T>(
    key: impl Into<Option<&'static str>>,
    message: impl Into<String>,
) -> Result<T, LawFault> {
    Err(LawFault {
        key: key.into(),
        message: message.into(),
    })
}

impl LawName {
    /// Its name as a scene writes it, with its article.
    fn named(self) -> &'static str {
        match self {
            Self::Linear => "a linear",
            Self::StVenantKirchhoff => "a st-venant-kirchhoff",
            Self::NeoHookean => "a neo-hookean",
            Self::MooneyRivlin => "a mooney-rivlin",
            Self::Yeoh => "a yeoh",
            Self::Ogden => "an ogden",
            Self::Fung => "a fung",
        }
    }

    /// The keys it takes beside those of the volume.
    fn keys(self) -> &'static [&'static str] {
        match self {
            Self::Linear | Self::StVenantKirchhoff => &["young", "shear"],
            Self::NeoHookean => &["young", "shear", "c10"],
            Self::MooneyRivlin => &["young", "shear", "c10", "c01"],
            Self::Yeoh => &["young", "shear", "c10", "c20", "c30"],
            Self::Ogden => &["terms", "young", "shear", "alpha"],
            Self::Fung => &["young", "shear", "b"],
        }
    }
}

impl Parts {
    /// The law that the numbers give.
    pub(crate) fn law(self) -> Result<Law, LawFault> {
        self.check_keys()?;
        let is_small = matches!(self.law, LawName::Linear | LawName::StVenantKirchhoff);
        if is_small && self.volume == Some(Volume::Logarithmic) {
            return fault(
                "volume",
                format!(
                    "{} law has a quadratic volume; remove `volume`, or use law = \"neo-hookean\"",
                    self.law.named()
                ),
            );
        }
        let resistance = match (self.poisson.clone(), self.bulk.clone()) {
            (Some(poisson), None) => Resistance::Poisson(poisson),
            (None, Some(bulk)) => Resistance::Bulk(bulk),
            (None, None) => Resistance::Poisson(Sourced {
                value: 0.45,
                status: Status::Assumed,
                source: "default, customary in limb indentation".to_owned(),
            }),
            (Some(_), Some(_)) => {
                return fault(
                    "bulk",
                    "the resistance to a change of volume is given twice; remove `poisson` or `bulk`",
                );
            }
        };
        let volume = self.volume.unwrap_or_default();
        let elastic = Elastic {
            energy: self.energy(&resistance)?,
            resistance,
            volume,
        };
        check(&elastic)?;
        Ok(Law::Elastic(elastic))
    }

    fn check_keys(&self) -> Result<(), LawFault> {
        let given = [
            ("young", self.young.is_some()),
            ("shear", self.shear.is_some()),
            ("c10", self.c10.is_some()),
            ("c01", self.c01.is_some()),
            ("c20", self.c20.is_some()),
            ("c30", self.c30.is_some()),
            ("terms", self.terms.is_some()),
            ("alpha", self.alpha.is_some()),
            ("b", self.b.is_some()),
        ];
        let keys = self.law.keys();
        match given
            .iter()
            .find(|(key, given)| *given && !keys.contains(key))
        {
            None => Ok(()),
            Some(&(key, _)) => fault(
                key,
                format!(
                    "{} law does not take `{key}`; it takes `{}` (choose the law with `law`)",
                    self.law.named(),
                    keys.join("`, `")
                ),
            ),
        }
    }

    fn energy(mut self, resistance: &Resistance) -> Result<Energy, LawFault> {
        let zero = || Sourced {
            value: 0.0,
            status: Status::Assumed,
            source: "default".to_owned(),
        };
        Ok(match self.law {
            LawName::Linear => Energy::Linear {
                stiffness: self.stiffness()?,
            },
            LawName::StVenantKirchhoff => Energy::StVenantKirchhoff {
                stiffness: self.stiffness()?,
            },
            LawName::NeoHookean => Energy::NeoHookean {
                stiffness: self.stiffness()?,
            },
            LawName::MooneyRivlin => match self.c01.take() {
                Some(c01) => Energy::MooneyRivlin {
                    stiffness: self.stiffness()?,
                    c01,
                },
                None => return fault(None, "a mooney-rivlin law needs `c01 = \"1 kPa\"`"),
            },
            LawName::Yeoh => Energy::Yeoh {
                c20: self.c20.take().unwrap_or_else(zero),
                c30: self.c30.take().unwrap_or_else(zero),
                stiffness: self.stiffness()?,
            },
            LawName::Ogden => Energy::Ogden {
                terms: self.ogden_terms(resistance)?,
            },
            LawName::Fung => match self.b.take() {
                Some(b) => Energy::Fung {
                    stiffness: self.stiffness()?,
                    b,
                },
                None => {
                    return fault(
                        None,
                        "a fung law needs `b = 10`, which says how fast it stiffens",
                    );
                }
            },
        })
    }

    fn stiffness(self) -> Result<Stiffness, LawFault> {
        match (self.young, self.shear, self.c10) {
            (Some(young), None, None) => Ok(Stiffness::Young(young)),
            (None, Some(shear), None) => Ok(Stiffness::Shear(shear)),
            (None, None, Some(c10)) => Ok(Stiffness::C10(c10)),
            (None, None, None) => fault(
                None,
                "the tissue has no stiffness; give `young = \"12 kPa\"` or `spring = \"90 dyn/cm\"`",
            ),
            (young, _, c10) => {
                let [first, second] = match (young, c10) {
                    (Some(_), None) => ["young", "shear"],
                    (Some(_), Some(_)) => ["young", "c10"],
                    (None, _) => ["shear", "c10"],
                };
                fault(
                    second,
                    format!("the stiffness is given twice; remove `{first}` or `{second}`"),
                )
            }
        }
    }

    /// The terms as given, or the one that a modulus and an exponent make.
    fn ogden_terms(mut self, resistance: &Resistance) -> Result<Vec<OgdenTerm>, LawFault> {
        let is_modulus_given = self.young.is_some() || self.shear.is_some();
        match (self.terms.take(), self.alpha.take()) {
            (Some(terms), None) if !is_modulus_given => Ok(terms),
            (None, Some(alpha)) if is_modulus_given => {
                let stiffness = self.stiffness()?;
                let given = stiffness.sourced().clone();
                // Any law of this stiffness has its shear modulus.
                let likeness = Elastic {
                    energy: Energy::NeoHookean { stiffness },
                    resistance: resistance.clone(),
                    volume: Volume::default(),
                };
                check(&likeness)?;
                let value = likeness.shear();
                Ok(vec![OgdenTerm {
                    mu: Sourced { value, ..given },
                    alpha: alpha.value,
                }])
            }
            _ => fault(
                None,
                "an ogden law takes either `terms = [{ mu = \"4 kPa\", alpha = 10 }]`, or `alpha` with `young` or `shear`",
            ),
        }
    }
}

/// Whether the numbers together give a solid: a Poisson's ratio and a stiffness that a body can have, and an energy that
/// grows with strain throughout.
fn check(elastic: &Elastic) -> Result<(), LawFault> {
    if matches!(elastic.resistance, Resistance::Bulk(_)) {
        check_bulk(elastic)?;
    }
    let (c10, young) = (elastic.c10(), Pressure::from_si(elastic.young()));
    match &elastic.energy {
        Energy::MooneyRivlin { c01, .. } if c10 < 0.0 => {
            return fault(
                "c01",
                format!(
                    "a `c01` of {} is more than the whole stiffness, half a shear modulus of {}; make it smaller",
                    Pressure::from_si(c01.value),
                    rounded(elastic.shear(), f64::round)
                ),
            );
        }
        // The slope C10 + 2 C20 x + 3 C30 x² has a root at x > 0.
        Energy::Yeoh { c20, c30, .. }
            if c20.value < 0.0 && c20.value.powi(2) >= 3.0 * c10 * c30.value =>
        {
            return fault(
                "c20",
                "the energy stops growing at a larger strain; take `c20` of 0 or more, or `c30` above c20²/(3 c10)",
            );
        }
        _ => {}
    }
    if !limits::YOUNG.contains(&young) {
        return fault(
            None,
            format!(
                "the parameters together are a Young's modulus of {}, outside the allowed range {}; check the numbers \
                 and their units",
                rounded(young.si(), f64::round),
                limits::YOUNG
            ),
        );
    }
    Ok(())
}

fn check_bulk(elastic: &Elastic) -> Result<(), LawFault> {
    let poisson = elastic.poisson();
    if limits::POISSON.contains(&poisson) {
        return Ok(());
    }
    let bulk_at = |nu: f64| match elastic.energy.stiffness() {
        Some(Stiffness::Young(e)) => e.value / (3.0 * (1.0 - 2.0 * nu)),
        _ => 2.0 * elastic.shear() * (1.0 + nu) / (3.0 * (1.0 - 2.0 * nu)),
    };
    fault(
        "bulk",
        format!(
            "a bulk modulus of {} beside this stiffness is a Poisson's ratio of {poisson:.7}, outside {}; take {} to {}",
            Pressure::from_si(elastic.bulk()),
            limits::POISSON,
            rounded(bulk_at(limits::POISSON.min), f64::ceil),
            rounded(bulk_at(limits::POISSON.max), f64::floor),
        ),
    )
}

/// To three digits, for messages.
fn rounded(pascals: f64, round: fn(f64) -> f64) -> Pressure {
    let unit = 10f64.powf(pascals.abs().log10().floor() - 2.0);
    let scaled = round(pascals / unit) * unit;
    Pressure::from_si(if scaled.is_finite() { scaled } else { pascals })
}
