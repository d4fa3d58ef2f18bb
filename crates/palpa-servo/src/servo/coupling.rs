//! The coupling: a spring between device and tool, used where the tissue is stiffer than the device
//! can render stably.

use crate::solver::ToolLoad;
use crate::{DeviceSpec, Mat3, ToolContact};

/// Ratio of the stiffness against a tool to the stiffness estimated from the work of its contact
/// forces: 1.2 for a sphere (Hertz).
const SHAPE: f64 = 1.2;
/// Smallest force from which the stiffness is estimated, N.
const MIN_LOAD: f64 = 1e-3;
/// Time in which the coupling softens, s.
const SOFTEN: f64 = 5e-3;
/// Time in which the coupling stiffens, s. Longer, because stiffening gives energy out.
const STIFFEN: f64 = 0.1;

/// The coupling of one tool.
#[derive(Debug, Clone, Copy)]
pub(super) struct Coupling {
    /// Compliance of the spring, m/N; 0 if the tissue's own stiffness is rendered.
    pub(super) compliance: f64,
    /// Stiffness of the tissue against the tool, N/m; 0 without contact.
    pub(super) stiffness: f64,
    /// Present estimate of [`SHAPE`], 1 to 2.
    shape: f64,
    /// Compliance along the normal of the tissue nearest to the tool, m/N. The coupling adapts to it
    /// before the tool touches anything.
    pub(super) ahead: Option<f64>,
}

impl Coupling {
    pub(super) const NONE: Self = Self {
        compliance: 0.0,
        stiffness: 0.0,
        shape: SHAPE,
        ahead: None,
    };

    /// Updates [`Coupling::shape`] from the stiffness that the tissue sent and the stiffness
    /// estimated from its forces.
    pub(super) fn calibrate(&mut self, contact: Option<&ToolContact>, load: &ToolLoad) {
        let force_sq = load.force.norm_squared();
        let (Some(contact), true) = (contact, force_sq > MIN_LOAD * MIN_LOAD && load.work > 0.0)
        else {
            return;
        };
        let sent = stiffest(&contact.stiffness);
        let shape = if sent > 0.0 && sent.is_finite() {
            (sent * load.work / force_sq).clamp(1.0, 2.0)
        } else {
            SHAPE
        };
        self.shape += 0.2 * (shape - self.shape);
    }

    /// Adapts the spring so that device and tool together are no stiffer than the device can
    /// render.
    pub(super) fn update(&mut self, load: &ToolLoad, spec: Option<&DeviceSpec>, dt: f64) {
        let force_sq = load.force.norm_squared();
        let wanted = match spec {
            Some(spec) if spec.max_stiffness > 0.0 => {
                if force_sq > MIN_LOAD * MIN_LOAD && load.work > 0.0 {
                    self.stiffness = (self.shape * force_sq / load.work).min(1e9);
                    (1.0 / spec.max_stiffness - 1.0 / self.stiffness).max(0.0)
                } else {
                    // Without this, the first touch of something hard would be felt at its full
                    // stiffness.
                    self.stiffness = 0.0;
                    let ahead = self.ahead.unwrap_or(f64::INFINITY).max(0.0);
                    (1.0 / spec.max_stiffness - ahead).max(0.0)
                }
            }
            _ => 0.0,
        };
        let time = if wanted > self.compliance {
            SOFTEN
        } else {
            STIFFEN
        };
        self.compliance += (wanted - self.compliance) * (dt / time).clamp(0.0, 1.0);
        if self.compliance < 1e-9 || !self.compliance.is_finite() {
            self.compliance = 0.0;
        }
    }

    /// Share of the tissue's stiffness that the spring takes away, 0 to 1.
    pub(super) fn softening(&self) -> f64 {
        self.compliance * self.stiffness / (1.0 + self.compliance * self.stiffness)
    }
}

/// Largest stiffness in any direction, N/m, by power iteration.
fn stiffest(stiffness: &Mat3) -> f64 {
    let symmetric = (stiffness + stiffness.transpose()) * 0.5;
    let mut direction = crate::Vec3::new(0.6, 0.5, 0.62);
    let mut value = 0.0;
    for _ in 0..8 {
        let next = symmetric * direction;
        value = next.norm();
        if !value.is_finite() || value <= 0.0 {
            return 0.0;
        }
        direction = next / value;
    }
    value
}
