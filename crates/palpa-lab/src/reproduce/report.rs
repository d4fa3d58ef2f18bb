//! The whole evaluation as one record: what `--json` prints and `reproduce.json` holds.

use serde::Serialize;

use super::claims::{Convergence, EulerRow};
use super::continuum::Continuum;
use super::curves::{Curves, SLICE_MM, SweepRow, knee_of, r2, slope_ratio};
use super::speed::{self, SpeedRow};
use super::{Body, fit::Knee};

/// The evaluation. After an interruption it holds what was done until then.
#[derive(Debug, Serialize)]
pub struct Report {
    /// Whether all of it was done; not after an interruption.
    pub is_complete: bool,
    /// Figures 4.2 to 4.4.
    pub figures: Option<Figures>,
    /// Parts of a step.
    pub convergence: Vec<Convergence>,
    /// Explicit Euler alone.
    pub euler: Vec<EulerRow>,
    /// Steps of the combined method until the base feels 90 % of a push: uniform, hard middle, hard bottom.
    pub combined_steps_to_cross: Option<[Option<usize>; 3]>,
    /// The same bodies as a continuum.
    pub continuum: Option<Continuum>,
    /// Table 4.2.
    pub table: Vec<SpeedRow>,
    /// How the table is measured.
    pub table_method: &'static str,
}

impl Default for Report {
    fn default() -> Self {
        Self {
            is_complete: false,
            figures: None,
            convergence: Vec::new(),
            euler: Vec::new(),
            combined_steps_to_cross: None,
            continuum: None,
            table: Vec::new(),
            table_method: speed::HOW,
        }
    }
}

/// Figures 4.2 to 4.4 in the main reading, and the sweep.
#[derive(Debug, Clone, Serialize)]
pub struct Figures {
    /// Figure 4.2.
    pub uniform: UniformFigure,
    /// Figure 4.3.
    pub middle: LayeredFigure,
    /// Figure 4.4.
    pub bottom: LayeredFigure,
    /// All readings.
    pub sweep: Vec<SweepRow>,
}

/// Figure 4.2, one stiffness everywhere.
#[derive(Debug, Clone, Serialize)]
pub struct UniformFigure {
    /// R² of a line from 0 to 60 mm.
    pub r2_60: Option<f64>,
    /// R² of a line from 0 to 120 mm.
    pub r2_120: Option<f64>,
    /// Where two lines fit best. The body has no layers: this knee is the method's own.
    pub knee_mm: Option<f64>,
    /// Slope after over slope before.
    pub slope_change: Option<f64>,
    /// Force on the tool, `[mm, N]`.
    pub curve: Vec<[f64; 2]>,
}

/// Figures 4.3 and 4.4, one hard interval.
#[derive(Debug, Clone, Serialize)]
pub struct LayeredFigure {
    /// Where two lines fit best.
    pub knee_mm: Option<f64>,
    /// Where the thesis sees the knee.
    pub thesis_knee_mm: Option<f64>,
    /// Slope after over slope before.
    pub slope_change: Option<f64>,
    /// The same over that of the uniform body: 1 is no effect of layers.
    pub slope_change_to_uniform: Option<f64>,
    /// Slope over that of the uniform body, in slices of 10 mm from the skin.
    pub slope_ratio: Vec<f64>,
    /// The middle of each slice.
    pub slope_ratio_depth_mm: Vec<f64>,
    /// Force on the tool, `[mm, N]`.
    pub curve: Vec<[f64; 2]>,
}

impl Figures {
    /// The figures of one reading, over the whole depth.
    pub fn new(main: &Curves, sweep: Vec<SweepRow>) -> Self {
        let [uniform, middle, bottom] = &main.bodies;
        let of_uniform = whole_knee(uniform);
        let layered = |body: Body, curve: &Vec<[f64; 2]>| {
            let knee = whole_knee(curve);
            let slope_ratio = slope_ratio(curve, uniform);
            LayeredFigure {
                knee_mm: knee.map(|k| k.at),
                thesis_knee_mm: body.thesis_knee_mm(),
                slope_change: knee.map(|k| k.slope_change),
                slope_change_to_uniform: knee
                    .zip(of_uniform)
                    .map(|(k, u)| k.slope_change / u.slope_change),
                slope_ratio_depth_mm: (0..slope_ratio.len())
                    .map(|i| (i as f64 + 0.5) * SLICE_MM as f64)
                    .collect(),
                slope_ratio,
                curve: curve.clone(),
            }
        };
        Self {
            uniform: UniformFigure {
                r2_60: r2(uniform, 60),
                r2_120: r2(uniform, 120),
                knee_mm: of_uniform.map(|k| k.at),
                slope_change: of_uniform.map(|k| k.slope_change),
                curve: uniform.clone(),
            },
            middle: layered(Body::Middle, middle),
            bottom: layered(Body::Bottom, bottom),
            sweep,
        }
    }
}

fn whole_knee(curve: &Vec<[f64; 2]>) -> Option<Knee> {
    knee_of(curve, super::curves::DEPTH_MM)
}
