//! Tissues back to their names or tables.

use crate::file::{OgdenTable, PronyTable, PronyTermTable, TissueSpec, TissueTable};
use crate::law::LawName;
use crate::units::{Density, Pressure, Stiffness as SpringStiffness, Time};
use crate::{
    Elastic, Energy, Law, OgdenTerm, Prony, PronyTerm, Resistance, Sourced, Stiffness, Tissue,
    Volume, catalogue,
};

/// How tissues of the catalogue are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Names {
    /// By their names.
    OfCatalogue,
    /// In full, as any other.
    None,
}

pub(super) fn tissue(tissue: &Tissue, names: Names) -> TissueSpec {
    if names == Names::OfCatalogue && catalogue().contains(tissue) {
        return TissueSpec::Name(tissue.name.clone());
    }
    let mut table = TissueTable {
        name: tissue.name.clone(),
        law: None,
        young: None,
        shear: None,
        c10: None,
        c01: None,
        c20: None,
        c30: None,
        terms: None,
        alpha: None,
        b: None,
        poisson: None,
        bulk: None,
        volume: None,
        prony: tissue.prony.as_ref().map(prony),
        spring: None,
        density: tissue.density.as_ref().map(|d| Density::from_si(d.value)),
        source: tissue.law.stiffness().source.clone(),
    };
    match &tissue.law {
        Law::Elastic(law) => elastic(law, &mut table),
        Law::Spring { constant } => table.spring = Some(SpringStiffness::from_si(constant.value)),
    }
    TissueSpec::Inline(table.into())
}

fn elastic(law: &Elastic, table: &mut TissueTable) {
    let pressure = |number: &Sourced| Some(Pressure::from_si(number.value));
    match law.energy.stiffness() {
        Some(Stiffness::Young(young)) => table.young = pressure(young),
        Some(Stiffness::Shear(shear)) => table.shear = pressure(shear),
        Some(Stiffness::C10(c10)) => table.c10 = pressure(c10),
        None => {}
    }
    // A number that is not the stiffness's own is the default, and stays so.
    let status = law.energy.given().status;
    let own = |number: &Sourced| Some(number.clone()).filter(|number| number.status == status);
    table.law = Some(match &law.energy {
        Energy::Linear { .. } => LawName::Linear,
        Energy::StVenantKirchhoff { .. } => LawName::StVenantKirchhoff,
        Energy::NeoHookean { .. } => LawName::NeoHookean,
        Energy::MooneyRivlin { c01, .. } => {
            table.c01 = pressure(c01);
            LawName::MooneyRivlin
        }
        Energy::Yeoh { c20, c30, .. } => {
            table.c20 = own(c20).as_ref().and_then(pressure);
            table.c30 = own(c30).as_ref().and_then(pressure);
            LawName::Yeoh
        }
        Energy::Ogden { terms } => {
            table.terms = Some(terms.iter().map(ogden_term).collect());
            LawName::Ogden
        }
        Energy::Fung { b, .. } => {
            table.b = Some(b.value);
            LawName::Fung
        }
    });
    match &law.resistance {
        Resistance::Poisson(poisson) => table.poisson = own(poisson).map(|poisson| poisson.value),
        Resistance::Bulk(bulk) => table.bulk = pressure(bulk),
    }
    table.volume = (law.volume != Volume::default()).then_some(law.volume);
}

fn ogden_term(term: &OgdenTerm) -> OgdenTable {
    OgdenTable {
        mu: Pressure::from_si(term.mu.value),
        alpha: term.alpha,
    }
}

fn prony(prony: &Prony) -> PronyTable {
    let term = |term: &PronyTerm| PronyTermTable {
        g: term.g,
        tau: Time::from_si(term.tau),
    };
    PronyTable {
        terms: prony.terms.iter().map(term).collect(),
        moduli: prony.moduli,
        volume: prony.relaxes_volume,
    }
}
