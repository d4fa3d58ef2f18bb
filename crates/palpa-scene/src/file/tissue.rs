//! A tissue as it is written.

#![expect(
    clippy::doc_markdown,
    reason = "these comments become the descriptions of the schema, which are plain text"
)]

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::law::LawName;
use crate::units::{Density, Pressure, Stiffness, Time};
use crate::{Moduli, Volume};

/// A tissue by its values: a law with its parameters, or `spring`. The simplest is `young` with `poisson`.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct TissueTable {
    /// What the tissue is called in reports. Default: "given in the scene".
    #[serde(default = "default_name")]
    pub(crate) name: String,
    /// The elastic law, which says what parameters the tissue takes. All laws are alike at small strain. Default:
    /// "neo-hookean".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) law: Option<LawName>,
    /// Young's modulus at small strain, 10 Pa to 1 GPa. Stands in place of `c10`, `shear` or an Ogden term's `mu`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) young: Option<Pressure>,
    /// The shear modulus at small strain, 1 Pa to 1 GPa.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) shear: Option<Pressure>,
    /// Neo-Hooke, Mooney-Rivlin and Yeoh: the factor of I1 − 3, 1 Pa to 1 GPa. The shear modulus is 2 c10, with
    /// Mooney-Rivlin 2 (c10 + c01).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) c10: Option<Pressure>,
    /// Mooney-Rivlin: the factor of I2 − 3, 0 Pa to 1 GPa.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) c01: Option<Pressure>,
    /// Yeoh: the factor of (I1 − 3)², -1 GPa to 1 GPa, such that the energy grows throughout. Default: 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) c20: Option<Pressure>,
    /// Yeoh: the factor of (I1 − 3)³, 0 Pa to 1 GPa. Default: 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) c30: Option<Pressure>,
    /// Ogden: 1 to 6 terms; the shear modulus is the sum of their `mu`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) terms: Option<Vec<OgdenTable>>,
    /// Ogden with `young` or `shear`: the exponent of the one term, of either sign and a size of 0.001 to 100.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) alpha: Option<f64>,
    /// Fung: how fast the tissue stiffens, 0.001 to 1000. The shear stiffness is doubled where I1 − 3 = 0.7/b, at a
    /// stretch of about 1 + 0.5/√b.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) b: Option<f64>,
    /// Poisson's ratio at small strain, 0 to 0.4999. Default: 0.45, customary in limb indentation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) poisson: Option<f64>,
    /// The bulk modulus K in place of `poisson`, 1 Pa to 1000 GPa and such that Poisson's ratio is 0 to 0.4999. D1 of
    /// Abaqus is 2/K.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) bulk: Option<Pressure>,
    /// How the energy of a change of volume grows; the linear and the St. Venant-Kirchhoff law have the quadratic one.
    /// Default: "quadratic".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) volume: Option<Volume>,
    /// How the tissue relaxes while it is held. Default: not at all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) prony: Option<PronyTable>,
    /// The stiffness of every bar of the layer, 1 µN/m to 1 MN/m; for the reference method only, without any law.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) spring: Option<Stiffness>,
    /// Density, 100 kg/m³ to 20000 kg/m³. Default: not known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) density: Option<Density>,
    /// Where the values are from, in words. Default: nothing said.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub(crate) source: String,
}

/// A term of Ogden's energy, 2 mu/alpha² (λ1^alpha + λ2^alpha + λ3^alpha − 3) of the isochoric stretches, as in Abaqus and
/// CalculiX. Others write mu·alpha/2 for what is `mu` here.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct OgdenTable {
    /// What the term adds to the shear modulus, 1 Pa to 1 GPa.
    pub(crate) mu: Pressure,
    /// Its exponent, of either sign and a size of 0.001 to 100.
    pub(crate) alpha: f64,
}

/// Relaxation as a Prony series: held at a strain, the stress falls by the share `g` of each term with its time constant.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct PronyTable {
    /// 1 to 12 terms, whose `g` are 0.99 at most together.
    pub(crate) terms: Vec<PronyTermTable>,
    /// Whether the law's moduli are those at rest, after all relaxation, or at once, before any. Default: "long-term".
    #[serde(default)]
    pub(crate) moduli: Moduli,
    /// Whether the resistance to a change of volume relaxes, too. Default: false.
    #[serde(default)]
    pub(crate) volume: bool,
}

/// A term of a Prony series.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct PronyTermTable {
    /// The share of the stiffness at once that relaxes, 0.001 to 0.99.
    pub(crate) g: f64,
    /// Its time constant, 0.1 ms to 100000 s.
    pub(crate) tau: Time,
}

fn default_name() -> String {
    "given in the scene".to_owned()
}
