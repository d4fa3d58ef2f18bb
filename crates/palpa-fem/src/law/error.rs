//! Errors in the parameters of a material.

/// The reason why the parameters of a material are refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LawError {
    /// A parameter that must be positive and finite is not.
    #[error("{owner}: {parameter} is {value}{}, but must be positive and finite", spaced(.unit))]
    NotPositive {
        /// The law or part of a material.
        owner: &'static str,
        /// The parameter in words.
        parameter: &'static str,
        /// The value given.
        value: f64,
        /// Unit of the value; empty for a pure number.
        unit: &'static str,
    },
    /// A parameter that may be zero is negative or not finite.
    #[error("{owner}: {parameter} is {value}{}, but must be finite and not negative", spaced(.unit))]
    Negative {
        /// The law or part of a material.
        owner: &'static str,
        /// The parameter in words.
        parameter: &'static str,
        /// The value given.
        value: f64,
        /// Unit of the value; empty for a pure number.
        unit: &'static str,
    },
    /// A Poisson's ratio that is not between −1 and ½.
    #[error(
        "{owner}: Poisson's ratio is {value}, but must lie above -1 and below 0.5; take 0.45 to 0.499 for tissue that \
         hardly changes its volume"
    )]
    Poisson {
        /// The law.
        owner: &'static str,
        /// The value given.
        value: f64,
    },
    /// A share outside 0 to 1.
    #[error("{owner}: {parameter} is {value}, but must lie between 0 and 1")]
    Share {
        /// The law.
        owner: &'static str,
        /// The parameter in words.
        parameter: &'static str,
        /// The value given.
        value: f64,
    },
    /// A Yeoh law whose energy stops growing.
    #[error(
        "Yeoh: with C10 = {c10} Pa, C20 = {c20} Pa and C30 = {c30} Pa the energy stops growing with strain, so that \
         nothing holds the tissue; C30 must not be negative, and a negative C20 must stay above -sqrt(3 C10 C30)"
    )]
    Softens {
        /// First constant, Pa.
        c10: f64,
        /// Second constant, Pa.
        c20: f64,
        /// Third constant, Pa.
        c30: f64,
    },
    /// Too few or too many terms of a sum.
    #[error("{owner}: {count} terms, but there must be 1 to {most}")]
    Terms {
        /// The law or part of a material.
        owner: &'static str,
        /// How many were given.
        count: usize,
        /// How many there may be.
        most: usize,
    },
    /// An exponent of an Ogden law that is too small or too large to compute with.
    #[error(
        "Ogden: the exponent of term {term} is {value}, but its size must be between {least} and {most}"
    )]
    Exponent {
        /// The term, from 1.
        term: usize,
        /// The value given.
        value: f64,
        /// Smallest size.
        least: f64,
        /// Largest size.
        most: f64,
    },
    /// A Prony series whose shares add up to 1 or more, so that no stiffness remains.
    #[error(
        "Prony series: its shares g add up to {sum}, but must stay below 1, so that some stiffness is left in the end"
    )]
    RelaxesAway {
        /// Sum of the shares.
        sum: f64,
    },
}

fn spaced(unit: &str) -> String {
    if unit.is_empty() {
        String::new()
    } else {
        format!(" {unit}")
    }
}

pub(super) fn check_positive(
    owner: &'static str,
    parameter: &'static str,
    value: f64,
    unit: &'static str,
) -> Result<f64, LawError> {
    if value > 0.0 && value.is_finite() {
        Ok(value)
    } else {
        Err(LawError::NotPositive {
            owner,
            parameter,
            value,
            unit,
        })
    }
}

pub(super) fn check_not_negative(
    owner: &'static str,
    parameter: &'static str,
    value: f64,
    unit: &'static str,
) -> Result<f64, LawError> {
    if value >= 0.0 && value.is_finite() {
        Ok(value)
    } else {
        Err(LawError::Negative {
            owner,
            parameter,
            value,
            unit,
        })
    }
}

pub(super) fn check_share(
    owner: &'static str,
    parameter: &'static str,
    value: f64,
) -> Result<f64, LawError> {
    if (0.0..=1.0).contains(&value) {
        Ok(value)
    } else {
        Err(LawError::Share {
            owner,
            parameter,
            value,
        })
    }
}

/// Shear and bulk modulus from Young's modulus (Pa) and Poisson's ratio.
pub(super) fn moduli(
    owner: &'static str,
    young: f64,
    poisson: f64,
) -> Result<(f64, f64), LawError> {
    check_positive(owner, "Young's modulus", young, "Pa")?;
    if !(poisson > -1.0 && poisson < 0.5) {
        return Err(LawError::Poisson {
            owner,
            value: poisson,
        });
    }
    Ok((
        young / (2.0 * (1.0 + poisson)),
        young / (3.0 * (1.0 - 2.0 * poisson)),
    ))
}
