//! Materials in CalculiX's terms, in megapascals.
//!
//! All energies of CalculiX are `W_d + Σ (J − 1)²ⁱ/Dᵢ` with `D1 = 2/K`. A test with CalculiX 2.20
//! on one confined element confirmed to 7 digits that each one is the intended law. In CalculiX, a
//! second or third D of 0 means a default value, not a missing term.

use anyhow::bail;
use palpa_fem::law::{Law, Material, OgdenTerm, Volumetric, Yeoh};

use super::{DeckNote, Departure};

/// Largest number of terms of Ogden's energy that CalculiX accepts.
const MOST_OGDEN_TERMS: usize = 3;
/// Value of `D2` or `D3` that makes its term vanish.
const NO_TERM: f64 = 1e20;
const MPA_PER_PA: f64 = 1e-6;

/// A material as written in the deck.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Card {
    /// Name of the material and of its element set.
    pub(super) name: String,
    /// The keyword with parameters, without the asterisk.
    pub(super) keyword: String,
    /// The lines under the keyword, with at most eight numbers each.
    pub(super) lines: Vec<String>,
}

/// The card of a material. Everything that the card cannot express exactly is added to
/// `departures`.
pub(super) fn card(
    number: usize,
    material: &Material,
    departures: &mut Vec<Departure>,
    notes: &mut Vec<DeckNote>,
) -> anyhow::Result<Card> {
    let name = &material.name;
    if material.prestress > 0.0 {
        departures.push(Departure::Tension {
            layer: name.clone(),
            prestress: material.prestress,
        });
    }
    // CalculiX has only time-independent laws for hyperelastic solids, so the card describes the
    // fully relaxed material, as in a very slow press.
    let (mut shear_scale, mut bulk_scale) = (1.0, 1.0);
    if let Some(prony) = &material.prony {
        notes.push(DeckNote::Relaxed {
            tissue: name.clone(),
        });
        shear_scale = prony.long_term();
        if prony.relaxes_volume() {
            bulk_scale = shear_scale;
        }
    }
    let to_mpa = shear_scale * MPA_PER_PA;
    let bulk = material.law.bulk_modulus() * bulk_scale * MPA_PER_PA;
    if matches!(
        material.law.volumetric_energy(),
        Volumetric::Logarithmic { .. }
    ) {
        departures.push(Departure::Volume {
            tissue: name.clone(),
        });
    }
    let volumetric = material.law.volumetric_energy();
    let (keyword, numbers) = match &material.law {
        Law::Linear(_) | Law::StVenantKirchhoff(_) => {
            let shear = material.law.shear_modulus() * to_mpa;
            let young = 9.0 * bulk * shear / (3.0 * bulk + shear);
            let poisson = (3.0 * bulk - 2.0 * shear) / (6.0 * bulk + 2.0 * shear);
            ("ELASTIC".to_owned(), vec![young, poisson])
        }
        Law::NeoHookean(_) => {
            let c10 = 0.5 * material.law.shear_modulus() * to_mpa;
            hyperelastic("NEO HOOKE", &[c10], bulk, 1)
        }
        Law::MooneyRivlin(law) => {
            let constants = law.constants().map(|c| c * to_mpa);
            hyperelastic("MOONEY-RIVLIN", &constants, bulk, 1)
        }
        Law::Yeoh(law) => yeoh(law, to_mpa, bulk),
        Law::Fung(law) => {
            departures.push(Departure::Fung {
                tissue: name.clone(),
                b: law.b(),
            });
            // μ/(2b) (exp(b x) − 1) = μ/2 (x + b x²/2 + b² x³/6 + …)
            let (c10, b) = (0.5 * material.law.shear_modulus(), law.b());
            let law = Yeoh::new([c10, c10 * b / 2.0, c10 * b * b / 6.0], *volumetric)?;
            yeoh(&law, to_mpa, bulk)
        }
        Law::Gent(law) => {
            departures.push(Departure::Gent {
                tissue: name.clone(),
                limit: law.limit(),
            });
            // −μ Jm/2 ln(1 − x/Jm) = μ/2 (x + x²/(2 Jm) + x³/(3 Jm²) + …)
            let (c10, jm) = (0.5 * material.law.shear_modulus(), law.limit());
            let law = Yeoh::new([c10, c10 / (2.0 * jm), c10 / (3.0 * jm * jm)], *volumetric)?;
            yeoh(&law, to_mpa, bulk)
        }
        Law::Ogden(law) if law.terms().len() > MOST_OGDEN_TERMS => bail!(
            "tissue \"{name}\" has {} terms of Ogden's energy, and CalculiX takes {MOST_OGDEN_TERMS}; fit it with fewer",
            law.terms().len()
        ),
        Law::Ogden(law) => ogden(law.terms(), to_mpa, bulk),
    };
    Ok(Card {
        name: format!("M{}_{}", number + 1, plain(name)),
        keyword,
        lines: numbers.chunks(8).map(line).collect(),
    })
}

fn yeoh(law: &Yeoh, to_mpa: f64, bulk: f64) -> (String, Vec<f64>) {
    hyperelastic("YEOH", &law.constants().map(|c| c * to_mpa), bulk, 3)
}

fn ogden(terms: &[OgdenTerm], to_mpa: f64, bulk: f64) -> (String, Vec<f64>) {
    let constants: Vec<f64> = terms
        .iter()
        .flat_map(|t| [t.mu * to_mpa, t.alpha])
        .collect();
    let n = terms.len();
    hyperelastic(&format!("OGDEN, N={n}"), &constants, bulk, n)
}

/// Returns the keyword, and the constants followed by `n_volumetric` numbers D.
fn hyperelastic(
    law: &str,
    constants: &[f64],
    bulk: f64,
    n_volumetric: usize,
) -> (String, Vec<f64>) {
    let mut numbers = constants.to_vec();
    numbers.push(2.0 / bulk);
    numbers.resize(constants.len() + n_volumetric, NO_TERM);
    (format!("HYPERELASTIC, {law}"), numbers)
}

/// Formats numbers with ten digits, so that eight of them fit into the 132 characters of a line.
fn line(numbers: &[f64]) -> String {
    let numbers: Vec<String> = numbers.iter().map(|x| format!("{x:.9e}")).collect();
    numbers.join(",")
}

/// The name with only letters, digits and `_`.
fn plain(name: &str) -> String {
    let plain = name.chars().take(40).map(|c| {
        if c.is_ascii_alphanumeric() {
            c.to_ascii_uppercase()
        } else {
            '_'
        }
    });
    plain.collect()
}
