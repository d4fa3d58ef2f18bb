//! The whole evaluation as one record; `--json` prints it and `reproduce.json` holds it.

use serde::Serialize;

use super::claims::{Convergence, EulerRow};
use super::continuum::Continuum;
use super::curves::{Curves, SLICE_MM, SweepRow, knee_of, r2, slope_ratio};
use super::speed::{self, SpeedRow};
use super::{Body, fit::Knee};

/// The evaluation. After an interruption it holds the parts completed until then.
#[derive(Debug, Serialize)]
pub struct Report {
    /// Whether the evaluation is complete; false after an interruption.
    pub is_complete: bool,
    /// Figures 4.2 to 4.4.
    pub figures: Option<Figures>,
    /// Convergence with the number of parts of a step.
    pub convergence: Vec<Convergence>,
    /// Explicit Euler alone.
    pub euler: Vec<EulerRow>,
    /// Steps of the combined method until the base feels 90 % of a push: uniform, hard middle, hard
    /// bottom.
    pub combined_steps_to_cross: Option<[Option<usize>; 3]>,
    /// The same bodies as a continuum.
    pub continuum: Option<Continuum>,
    /// Table 4.2.
    pub table: Vec<SpeedRow>,
    /// Description of how the table is measured.
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
    /// Knee of the best fit by two lines. The body has no layers, so this knee comes from the
    /// method.
    pub knee_mm: Option<f64>,
    /// Slope after the knee relative to the slope before it.
    pub slope_change: Option<f64>,
    /// Depth and force on the tool, `[mm, N]`.
    pub curve: Vec<[f64; 2]>,
}

/// Figures 4.3 and 4.4, one hard interval.
#[derive(Debug, Clone, Serialize)]
pub struct LayeredFigure {
    /// Knee of the best fit by two lines.
    pub knee_mm: Option<f64>,
    /// Knee according to the thesis.
    pub thesis_knee_mm: Option<f64>,
    /// Slope after the knee relative to the slope before it.
    pub slope_change: Option<f64>,
    /// `slope_change` relative to that of the uniform body; 1 means no effect of layers.
    pub slope_change_to_uniform: Option<f64>,
    /// Slope relative to the uniform body, in slices of 10 mm from the skin.
    pub slope_ratio: Vec<f64>,
    /// Depth of the middle of each slice.
    pub slope_ratio_depth_mm: Vec<f64>,
    /// Depth and force on the tool, `[mm, N]`.
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
