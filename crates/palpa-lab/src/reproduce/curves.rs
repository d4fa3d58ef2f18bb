//! Figures 4.2 to 4.4: force against the depth of the push for the three bodies, for every reading
//! of the text.

use palpa_mesh::Vec3;
use palpa_springs::{
    Corrections, InterfaceBars, Outcome, Solver, SpringError, SpringState, StepParams, Workspace,
    step,
};
use serde::Serialize;

use super::fit::{Knee, knee, line};
use super::{Body, Shape};

/// Depth of the curves, mm, with one point per millimetre.
pub const DEPTH_MM: usize = 120;
/// Thickness of the slices in which slopes are compared, mm.
pub const SLICE_MM: usize = 10;
/// Parts of each millimetre. With them the error of the path is well below the differences compared
/// here (`claims::convergence`).
const SUBSTEPS: usize = 4;

/// One reading of the details that the text leaves open.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Columns along each side of the patch: 3 or 4.
    pub n: usize,
    /// Distance between columns, m.
    pub lateral_spacing: f64,
    /// Material of in-level bars between two layers.
    pub interface_bars: InterfaceBars,
    /// Whether steps end with the spring correction (3.21).
    pub is_corrected: bool,
}

/// The reading of the main figures: the spacing of the levels in all directions, and in-level bars
/// of the layer below.
pub const MAIN: Reading = Reading {
    n: 4,
    lateral_spacing: 0.040,
    interface_bars: InterfaceBars::Below,
    is_corrected: true,
};

/// All readings: both patches, four spacings, three rules for in-level bars, with and without
/// correction.
pub fn readings() -> Vec<Reading> {
    let mut all = Vec::new();
    for n in [3, 4] {
        for lateral_spacing in [0.010, 0.020, 0.040, 0.080] {
            for interface_bars in [
                InterfaceBars::Above,
                InterfaceBars::Below,
                InterfaceBars::Mean,
            ] {
                for is_corrected in [true, false] {
                    all.push(Reading {
                        n,
                        lateral_spacing,
                        interface_bars,
                        is_corrected,
                    });
                }
            }
        }
    }
    all
}

/// A force curve: depth and force, `[mm, N]`, starting at rest.
pub type ForceCurve = Vec<[f64; 2]>;

/// Pushes the held node straight down, one millimetre per step.
///
/// The curve ends early if the method diverges.
///
/// # Errors
/// If the model cannot be built.
pub fn curve(body: Body, reading: &Reading) -> Result<ForceCurve, SpringError> {
    let shape = Shape {
        lateral_spacing: reading.lateral_spacing,
        ..Shape::thesis(reading.n)
    };
    let model = shape.model(&body.stiffnesses(), reading.interface_bars, Solver::Auto)?;
    let params = StepParams {
        substeps: SUBSTEPS,
        corrections: if reading.is_corrected {
            Corrections::default()
        } else {
            Corrections::OFF
        },
        ..StepParams::default()
    };
    let (mut state, mut ws) = (SpringState::new(&model), Workspace::new(&model));
    let mut curve = vec![[0.0, 0.0]];
    for mm in 1..=DEPTH_MM {
        let down = Vec3::new(0.0, 0.0, -1.0e-3);
        let report = step(&model, &mut state, &mut ws, down, &params);
        if matches!(
            report.outcome,
            Outcome::Diverged { .. } | Outcome::NotFinite
        ) {
            break;
        }
        curve.push([mm as f64, report.force.z]);
    }
    Ok(curve)
}

/// The part of a curve down to a depth, or `None` if it ends before.
fn down_to(curve: &ForceCurve, depth_mm: usize) -> Option<&[[f64; 2]]> {
    curve.get(..=depth_mm)
}

/// R² of the straight line down to a depth.
pub fn r2(curve: &ForceCurve, depth_mm: usize) -> Option<f64> {
    line(down_to(curve, depth_mm)?).map(|l| l.r2)
}

/// The knee down to a depth.
pub fn knee_of(curve: &ForceCurve, depth_mm: usize) -> Option<Knee> {
    knee(down_to(curve, depth_mm)?)
}

/// Slope of each slice of [`SLICE_MM`], in N/mm.
fn slopes(curve: &ForceCurve) -> Vec<f64> {
    curve
        .windows(SLICE_MM + 1)
        .step_by(SLICE_MM)
        .map(|slice| (slice[SLICE_MM][1] - slice[0][1]) / SLICE_MM as f64)
        .collect()
}

/// Slope of a layered curve relative to the uniform one, slice by slice.
pub fn slope_ratio(layered: &ForceCurve, uniform: &ForceCurve) -> Vec<f64> {
    let pairs = slopes(layered).into_iter().zip(slopes(uniform));
    pairs.map(|(l, u)| l / u).collect()
}

/// The three curves of one reading, in the order of [`Body::ALL`].
#[derive(Debug, Clone)]
pub struct Curves {
    /// The reading of these curves.
    pub reading: Reading,
    /// The curves: uniform, hard middle, hard bottom.
    pub bodies: [ForceCurve; 3],
}

impl Curves {
    /// Computes the three curves.
    ///
    /// # Errors
    /// If a model cannot be built.
    pub fn compute(reading: Reading) -> Result<Self, SpringError> {
        let [uniform, middle, bottom] = Body::ALL.map(|body| curve(body, &reading));
        Ok(Self {
            reading,
            bodies: [uniform?, middle?, bottom?],
        })
    }

    /// The row of the sweep for these curves in one depth range.
    pub fn row(&self, depth_mm: usize) -> SweepRow {
        let [uniform, middle, bottom] = &self.bodies;
        let knees = [uniform, middle, bottom].map(|c| knee_of(c, depth_mm));
        let at = |i: usize| knees[i].map(|k: Knee| k.at);
        let change = |i: usize| knees[i].map(|k: Knee| k.slope_change);
        SweepRow {
            columns: self.reading.n,
            lateral_spacing_mm: self.reading.lateral_spacing * 1e3,
            interface_bars: match self.reading.interface_bars {
                InterfaceBars::Above => "above",
                InterfaceBars::Below => "below",
                InterfaceBars::Mean => "mean",
            },
            is_corrected: self.reading.is_corrected,
            depth_mm,
            uniform_r2: r2(uniform, depth_mm),
            uniform_knee_mm: at(0),
            uniform_slope_change: change(0),
            middle_knee_mm: at(1),
            middle_slope_change: change(1),
            bottom_knee_mm: at(2),
            bottom_slope_change: change(2),
        }
    }
}

/// One line of the sweep. Values are missing where a curve ended early.
#[derive(Debug, Clone, Serialize)]
pub struct SweepRow {
    /// Columns along each side.
    pub columns: usize,
    /// Distance between columns.
    pub lateral_spacing_mm: f64,
    /// Material of in-level bars between layers: above, below or mean.
    pub interface_bars: &'static str,
    /// Whether (3.21) is applied.
    pub is_corrected: bool,
    /// Depth range of the fits.
    pub depth_mm: usize,
    /// R² of a line through the uniform body's curve.
    pub uniform_r2: Option<f64>,
    /// Knee of the uniform body, which is not an effect of layers.
    pub uniform_knee_mm: Option<f64>,
    /// Slope after the knee relative to the slope before it.
    pub uniform_slope_change: Option<f64>,
    /// Knee with the hard middle, mm; 40 in the thesis.
    pub middle_knee_mm: Option<f64>,
    /// Slope after the knee relative to the slope before it.
    pub middle_slope_change: Option<f64>,
    /// Knee with the hard bottom, mm; 80 in the thesis.
    pub bottom_knee_mm: Option<f64>,
    /// Slope after the knee relative to the slope before it.
    pub bottom_slope_change: Option<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_uniform_body_is_proportional_and_layers_are_felt_from_the_first_millimetre() {
        let curves = Curves::compute(MAIN).unwrap();
        let [uniform, middle, bottom] = &curves.bodies;
        assert_eq!(uniform.len(), DEPTH_MM + 1);
        assert!(r2(uniform, 60).unwrap() > 0.99, "figure 4.2");
        assert!(r2(uniform, 120).unwrap() > 0.97);
        // A deep hard layer is felt at once, not only when the node reaches its depth; a nearer
        // layer is felt more.
        let first = [middle, bottom].map(|curve| slope_ratio(curve, uniform)[0]);
        assert!(
            first[0] > 1.3 && first[1] > 1.1 && first[0] > first[1],
            "{first:?}"
        );
        // The curve of the uniform body bends about as much as the layered ones, so its knee comes
        // from the method.
        let row = curves.row(DEPTH_MM);
        assert!(row.uniform_slope_change.unwrap() > 1.5);
        // As in a first trial of the method, both layered bodies have knees at 50 to 70 mm.
        for knee in [row.middle_knee_mm, row.bottom_knee_mm] {
            assert!((50.0..70.0).contains(&knee.unwrap()), "{row:?}");
        }
    }

    #[test]
    fn a_curve_that_ends_early_has_no_fit_beyond_its_end() {
        let short: ForceCurve = (0..=70).map(|i| [f64::from(i), f64::from(i)]).collect();
        assert!(r2(&short, 60).is_some());
        assert_eq!(r2(&short, 90), None);
        assert_eq!(slopes(&short).len(), 7);
    }
}
