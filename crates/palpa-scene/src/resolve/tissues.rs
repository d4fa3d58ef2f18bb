//! Tissues: a name from the catalogue, or a law with its parameters.

use super::law::{LawFault, Parts};
use crate::error::Site;
use crate::file::{OgdenTable, PronyTable, TissueSpec, TissueTable};
use crate::limits::{self, Limits};
use crate::parameters::{Numbers, ParameterSpec};
use crate::units::{Kind, Quantity};
use crate::{Law, OgdenTerm, Prony, PronyTerm, SceneError, Sourced, Status, Tissue, catalogue};

pub(super) fn tissue(at: &Site<'_>, spec: TissueSpec) -> Result<Tissue, SceneError> {
    let name = match spec {
        TissueSpec::Name(name) => name,
        TissueSpec::Inline(table) => return inline(at, *table),
    };
    let mut tissues = catalogue().iter();
    tissues
        .find(|tissue| tissue.name == name)
        .cloned()
        .ok_or_else(|| {
            let names = catalogue().iter().map(|tissue| tissue.name.clone());
            at.unknown("tissue", &name, names.collect())
        })
}

/// The values that the scene gives, and its text about their source.
struct Sources<'a> {
    at: &'a Site<'a>,
    source: &'a str,
}

impl Sources<'_> {
    fn sourced(&self, value: f64) -> Sourced {
        Sourced {
            value,
            status: Status::Given,
            source: self.source.to_owned(),
        }
    }

    fn quantity<K: Kind>(
        &self,
        key: &'static str,
        quantity: Option<Quantity<K>>,
        limits: &Limits<Quantity<K>>,
    ) -> Result<Option<Sourced>, SceneError> {
        let Some(quantity) = quantity else {
            return Ok(None);
        };
        let quantity = self.at.key(key).within(quantity, limits)?;
        Ok(Some(self.sourced(quantity.si())))
    }
}

fn inline(at: &Site<'_>, table: TissueTable) -> Result<Tissue, SceneError> {
    let given = Sources {
        at,
        source: &table.source,
    };
    let density = given.quantity("density", table.density, &limits::DENSITY)?;
    let spring = given.quantity("spring", table.spring, &limits::SPRING)?;
    let mut numbers = Numbers::default();
    for (spec, &value) in table.numbers.given() {
        let value = spec.checked(&at.key(spec.key), value)?;
        numbers.set(spec.key, given.sourced(value));
    }
    let terms = match &table.terms {
        None => None,
        Some(terms) => Some(ogden_terms(&given, terms)?),
    };
    let parts = Parts {
        law: table.law.unwrap_or_default(),
        numbers,
        terms,
        volume: table.volume,
    };
    let law = match spring {
        Some(constant) => {
            check_spring(at, &table)?;
            Law::Spring { constant }
        }
        None => parts.law().map_err(|LawFault { key, message }| match key {
            Some(key) => at.key(key).invalid(message),
            None => at.invalid(message),
        })?,
    };
    let prony = match &table.prony {
        None => None,
        Some(prony) => Some(relaxation(&at.key("prony"), prony, &table.source)?),
    };
    Ok(Tissue {
        law,
        prony,
        density,
        name: table.name,
    })
}

/// Refuses other keys beside `spring`.
fn check_spring(at: &Site<'_>, table: &TissueTable) -> Result<(), SceneError> {
    if table.numbers.get("young").is_some() {
        return Err(at
            .key("spring")
            .invalid("the stiffness is given twice; remove `young` or `spring`"));
    }
    if table.numbers.get("poisson").is_some() {
        return Err(at.key("poisson").invalid(
            "bars of one spring stiffness have no Poisson's ratio to choose; remove `poisson`, or \
             give `young` instead of `spring`",
        ));
    }
    let others = [
        ("law", table.law.is_some()),
        ("terms", table.terms.is_some()),
        ("volume", table.volume.is_some()),
        ("prony", table.prony.is_some()),
    ];
    let others = others.iter().filter(|(_, is_given)| *is_given);
    let numbers = table.numbers.given().map(|(spec, _)| spec.key);
    match { others.map(|(key, _)| *key).chain(numbers) }.next() {
        None => Ok(()),
        Some(key) => Err(at.key(key).invalid(format!(
            "bars of one spring stiffness have no law; remove `{key}`, or give `young` instead of `spring`"
        ))),
    }
}

fn ogden_terms(given: &Sources<'_>, terms: &[OgdenTable]) -> Result<Vec<OgdenTerm>, SceneError> {
    let at = given.at.key("terms");
    check_number(&at, terms.len(), limits::MAX_OGDEN_TERMS)?;
    let exponent = ParameterSpec::of("alpha").expect("an exponent is a parameter");
    (terms.iter().enumerate())
        .map(|(i, term)| {
            let at = at.index(i);
            let mu = at.key("mu").within(term.mu, &limits::SHEAR)?;
            Ok(OgdenTerm {
                mu: given.sourced(mu.si()),
                alpha: exponent.checked(&at.key("alpha"), term.alpha)?,
            })
        })
        .collect()
}

fn relaxation(at: &Site<'_>, prony: &PronyTable, source: &str) -> Result<Prony, SceneError> {
    let at = at.key("terms");
    check_number(&at, prony.terms.len(), limits::MAX_PRONY_TERMS)?;
    let terms = (prony.terms.iter().enumerate())
        .map(|(i, term)| {
            let at = at.index(i);
            Ok(PronyTerm {
                g: at.key("g").within(term.g, &limits::PRONY_G)?,
                tau: at.key("tau").within(term.tau, &limits::PRONY_TAU)?.si(),
            })
        })
        .collect::<Result<Vec<_>, _>>()?;
    let sum: f64 = terms.iter().map(|term| term.g).sum();
    // The sum of decimal numbers may miss the limit by rounding.
    if sum > limits::PRONY_SUM + 1e-9 {
        return Err(at.invalid(format!(
            "the shares `g` add up to {sum:.4}, which leaves too little stiffness after relaxation; make their sum {} \
             at most",
            limits::PRONY_SUM
        )));
    }
    Ok(Prony {
        terms,
        moduli: prony.moduli,
        relaxes_volume: prony.volume,
        status: Status::Given,
        source: source.to_owned(),
    })
}

fn check_number(at: &Site<'_>, n: usize, most: usize) -> Result<(), SceneError> {
    if (1..=most).contains(&n) {
        return Ok(());
    }
    Err(at.invalid(format!("{n} terms; give 1 to {most}")))
}
