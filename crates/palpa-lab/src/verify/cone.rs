//! A cone on a half-space, with a sharp or rounded tip, compared with Sneddon's solution.
//!
//! A smooth rigid tool with the profile f(r) touches a half-space within the radius a. It is
//! pressed in by δ and carries the force F (I. N. Sneddon, Int. J. Engng Sci. 3 (1965) 47–57):
//!
//! ```text
//! δ = a ∫₀ᵃ f′(r) / √(a² − r²) dr,   F = 2 E/(1 − ν²) ∫₀ᵃ r² f′(r) / √(a² − r²) dr
//! ```
//! Here f′ is `m r/b` on the tip, which ends at the radius b, and the slope `m` on the flank. With
//! b = 0 these are `δ = π/2 m a` and `F = 2/π E/(1 − ν²) δ²/m`.

use palpa_fem::shape::{Cone, Tool};

use crate::verify::half_space;
use crate::verify::sector::Finest;
use crate::verify::small_strain::TOUCHED;
use crate::verify::tolerance::SMALL_STRAIN;
use crate::verify::{Findings, Options, Row, VerifyError};

const CASE: &str = "cone";
/// Half of the opening angle, rad. The solution holds for small slopes, so the cone is very blunt.
const HALF_ANGLE: f64 = 1.55;
/// Radius of the shaft, m: its rim is far from the contact.
const SHAFT: f64 = 1.0;
/// Radius at which the tip ends, relative to the contact radius.
const TIPS: [f64; 2] = [1e-3, 0.5];

pub(crate) fn run(_: &Options) -> Result<Findings, VerifyError> {
    let mut findings = Findings::default();
    for nu in [0.45, 0.4999] {
        let stack = half_space::unit(nu, 1.0, Finest::Inside);
        let a = TOUCHED * stack.sector.ring;
        for tip in TIPS {
            let slope = 1.0 / HALF_ANGLE.tan();
            let exact = Sneddon::new(slope, tip * a, a);
            let tip_radius = tip * a / HALF_ANGLE.cos();
            let cone = Cone::new(SHAFT, HALF_ANGLE, tip_radius, 0.0).expect("valid sizes");
            let tool = Tool::new(cone, 0.0).expect("no friction");
            let force = stack.indented(tool, exact.depth, |p| exact.height(p.norm()))?;
            findings.rows.push(Row::ratio(
                CASE,
                format!("nu {nu}: cone with {tip} of the contact on its tip, E 1 Pa: force, N"),
                exact.force / (1.0 - nu * nu),
                force.value,
                SMALL_STRAIN,
                force.nodes,
            ));
        }
    }
    Ok(findings)
}

/// Sneddon's solution for a cone with a rounded tip.
struct Sneddon {
    slope: f64,
    tip: f64,
    /// Depth of the tip, m.
    depth: f64,
    /// Force at `E/(1 − ν²)` = 1 Pa, N.
    force: f64,
}

impl Sneddon {
    /// The solution for a slope of the flank, the radius `tip` at which the tip ends, m, and the
    /// radius `contact` of the contact, m.
    fn new(slope: f64, tip: f64, contact: f64) -> Self {
        let (b, a) = (tip, contact);
        let s = (a * a - b * b).sqrt();
        let angle = (b / a).acos();
        let on_tip = (a * a * (a - s) - (a.powi(3) - s.powi(3)) / 3.0) / b;
        let on_flank = 0.5 * (a * a * angle + b * s);
        Self {
            slope,
            tip,
            depth: a * slope * ((a - s) / b + angle),
            force: 2.0 * slope * (on_tip + on_flank),
        }
    }

    /// Height of the tool over its tip at the radius `r`, m.
    fn height(&self, r: f64) -> f64 {
        if r < self.tip {
            0.5 * self.slope * r * r / self.tip
        } else {
            self.slope * (r - 0.5 * self.tip)
        }
    }
}
