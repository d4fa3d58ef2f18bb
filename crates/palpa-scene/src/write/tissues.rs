//! From tissues back to their names or tables.

use crate::file::{OgdenTable, PronyTable, PronyTermTable, TissueSpec, TissueTable};
use crate::units::{Density, Pressure, SpringConstant, Time};
use crate::{Elastic, Law, OgdenTerm, Prony, PronyTerm, Tissue, Volume, catalogue};

/// How to write tissues of the catalogue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Names {
    /// By their names.
    OfCatalogue,
    /// In full, like any other tissue.
    None,
}

pub(super) fn tissue(tissue: &Tissue, names: Names) -> TissueSpec {
    if names == Names::OfCatalogue && catalogue().contains(tissue) {
        return TissueSpec::Name(tissue.name.clone());
    }
    let mut table = TissueTable {
        name: tissue.name.clone(),
        prony: tissue.prony.as_ref().map(prony),
        spring: None,
        density: tissue.density.as_ref().map(|d| Density::from_si(d.value)),
        source: tissue.law.stiffness().source.clone(),
        ..TissueTable::default()
    };
    match &tissue.law {
        Law::Elastic(law) => elastic(law, &mut table),
        Law::Spring { constant } => table.spring = Some(SpringConstant::from_si(constant.value)),
    }
    TissueSpec::Inline(table.into())
}

fn elastic(law: &Elastic, table: &mut TissueTable) {
    // A number with a default whose status differs from that of the stiffness is the default
    // itself. It is left out.
    let status = law.energy.given().status;
    table.law = Some(law.energy.law());
    for (spec, number) in law.numbers().given() {
        if number.status == status || spec.default().is_none() {
            table.numbers.set(spec.key, number.value);
        }
    }
    let terms = law.energy.terms();
    table.terms = (!terms.is_empty()).then(|| terms.iter().map(ogden_term).collect());
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
