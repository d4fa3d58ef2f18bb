//! From the numbers of a tissue to its elastic law: checks which numbers go together and which
//! values are possible.

use crate::law::LawName;
use crate::limits;
use crate::parameters::{Missing, Numbers, ParameterSpec};
use crate::units::Pressure;
use crate::{Elastic, Energy, Law, OgdenTerm, Resistance, Sourced, Stiffness, Volume};

/// The numbers that a scene gives for a tissue's elasticity, each within its own range.
#[derive(Debug, Clone, Default)]
pub(crate) struct Parts {
    pub(crate) law: LawName,
    pub(crate) numbers: Numbers<Sourced>,
    pub(crate) terms: Option<Vec<OgdenTerm>>,
    pub(crate) volume: Option<Volume>,
}

/// The reason why the numbers of a tissue do not give a valid law.
#[derive(Debug)]
pub(crate) struct LawFault {
    /// The key that is wrong, if it is a single one.
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

impl Parts {
    /// The law given by the numbers.
    pub(crate) fn law(mut self) -> Result<Law, LawFault> {
        self.check_keys()?;
        if self.law.is_quadratic() && self.volume == Some(Volume::Logarithmic) {
            return fault(
                "volume",
                format!(
                    "{} law has a quadratic volume; remove `volume`, or use law = \"neo-hookean\"",
                    self.law.named()
                ),
            );
        }
        let resistance = self.resistance()?;
        let volume = self.volume.unwrap_or_default();
        let terms = self.terms.take();
        let elastic = Elastic {
            energy: self.law.energy(
                || self.stiffness(),
                |key| self.number(key),
                || self.ogden_terms(terms, &resistance),
            )?,
            resistance,
            volume,
        };
        check(&elastic)?;
        Ok(Law::Elastic(elastic))
    }

    fn check_keys(&self) -> Result<(), LawFault> {
        let keys: Vec<_> = self.law.keys().collect();
        let numbers = self.numbers.given().map(|(spec, _)| spec.key);
        let all = numbers.chain(self.terms.is_some().then_some("terms"));
        let is_taken = |key: &&str| keys.contains(key) || ["poisson", "bulk"].contains(key);
        match { all }.find(|key| !is_taken(key)) {
            None => Ok(()),
            Some(key) => fault(
                key,
                format!(
                    "{} law does not take `{key}`; it takes `{}` (choose the law with `law`)",
                    self.law.named(),
                    keys.join("`, `")
                ),
            ),
        }
    }

    /// The parameter with this key, as given or its default.
    fn number(&self, key: &str) -> Result<Sourced, LawFault> {
        if let Some(number) = self.numbers.get(key) {
            return Ok(number.clone());
        }
        let spec = ParameterSpec::of(key);
        if let Some(default) = spec.and_then(ParameterSpec::default) {
            return Ok(default);
        }
        let wanted = match spec.map(|spec| &spec.missing) {
            Some(Missing::Refused(wanted)) => (*wanted).to_owned(),
            _ => format!("`{key}`"),
        };
        fault(None, format!("{} law needs {wanted}", self.law.named()))
    }

    fn resistance(&self) -> Result<Resistance, LawFault> {
        match (self.numbers.get("poisson"), self.numbers.get("bulk")) {
            (None, Some(bulk)) => Ok(Resistance::Bulk(bulk.clone())),
            (_, None) => Ok(Resistance::Poisson(self.number("poisson")?)),
            (Some(_), Some(_)) => fault(
                "bulk",
                "the resistance to a change of volume is given twice; remove `poisson` or `bulk`",
            ),
        }
    }

    fn stiffness(&self) -> Result<Stiffness, LawFault> {
        let given = ["young", "shear", "c10"].map(|key| self.numbers.get(key).cloned());
        match given {
            [Some(young), None, None] => Ok(Stiffness::Young(young)),
            [None, Some(shear), None] => Ok(Stiffness::Shear(shear)),
            [None, None, Some(c10)] => Ok(Stiffness::C10(c10)),
            [None, None, None] => fault(
                None,
                "the tissue has no stiffness; give `young = \"12 kPa\"` or `spring = \"90 dyn/cm\"`",
            ),
            [young, _, c10] => {
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

    /// The terms as given, or the single term given by a modulus and an exponent.
    fn ogden_terms(
        &self,
        terms: Option<Vec<OgdenTerm>>,
        resistance: &Resistance,
    ) -> Result<Vec<OgdenTerm>, LawFault> {
        let is_modulus_given = ["young", "shear"]
            .iter()
            .any(|key| self.numbers.get(key).is_some());
        match (terms, self.numbers.get("alpha")) {
            (Some(terms), None) if !is_modulus_given => Ok(terms),
            (None, Some(alpha)) if is_modulus_given => {
                let stiffness = self.stiffness()?;
                let given = stiffness.sourced().clone();
                // Any law with this stiffness has the same shear modulus.
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

/// Checks that the numbers together give a solid: possible values of stiffness and Poisson's ratio,
/// and an energy that grows with strain everywhere.
fn check(elastic: &Elastic) -> Result<(), LawFault> {
    if matches!(elastic.resistance, Resistance::Bulk(_)) {
        check_bulk(elastic)?;
    }
    let (c10, young) = (elastic.c10(), Pressure::from_si(elastic.young()));
    if let Some((key, message)) = elastic.energy.fault(c10, elastic.shear()) {
        return fault(key, message);
    }
    if !limits::YOUNG.contains(&young) {
        return fault(
            None,
            format!(
                "the parameters together are a Young's modulus of {}, outside the allowed range {}; check the numbers \
                 and their units",
                Pressure::rounded(young.si(), f64::round),
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
            "with this stiffness, a bulk modulus of {} gives a Poisson's ratio of {poisson:.7}, outside {}; give a bulk \
             modulus of {} to {}",
            Pressure::from_si(elastic.bulk()),
            limits::POISSON,
            Pressure::rounded(bulk_at(limits::POISSON.min), f64::ceil),
            Pressure::rounded(bulk_at(limits::POISSON.max), f64::floor),
        ),
    )
}
