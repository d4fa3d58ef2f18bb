//! Claims of the method beside its figures: splitting a step into parts converges, and explicit
//! Euler alone is slow and diverges.

use palpa_mesh::Vec3;
use palpa_springs::{
    Corrections, InterfaceBars, Outcome, Solver, SpringError, SpringModel, SpringState, StepParams,
    Workspace, step, steps_to_cross,
};
use serde::Serialize;

use super::{Body, Shape};

fn thesis_model(body: Body) -> Result<SpringModel, SpringError> {
    Shape::thesis(4).model(&body.stiffnesses(), InterfaceBars::default(), Solver::Auto)
}

/// Error of the force for one number of parts.
#[derive(Debug, Clone, Serialize)]
pub struct Convergence {
    /// Parts that each push of 10 mm is split into.
    pub substeps: usize,
    /// Force at 40 mm, in N.
    pub force: f64,
    /// Relative difference to 256 parts.
    pub error: f64,
}

/// A push of 40 mm in 4 steps, each in `n` parts: the error falls in proportion to `1/n`.
///
/// # Errors
/// If the model cannot be built.
pub fn convergence() -> Result<Vec<Convergence>, SpringError> {
    let model = thesis_model(Body::Uniform)?;
    let force = |substeps: usize| {
        let params = StepParams {
            substeps,
            corrections: Corrections::OFF,
            ..StepParams::default()
        };
        let (mut state, mut ws) = (SpringState::new(&model), Workspace::new(&model));
        for _ in 0..4 {
            step(
                &model,
                &mut state,
                &mut ws,
                Vec3::new(0.0, 0.0, -0.01),
                &params,
            );
        }
        state.force.z
    };
    let limit = force(256);
    Ok([1, 4, 16, 64]
        .map(|substeps| {
            let force = force(substeps);
            Convergence {
                substeps,
                force,
                error: (force / limit - 1.0).abs(),
            }
        })
        .to_vec())
}

/// Explicit Euler alone with one step size, on the 64-node patch.
#[derive(Debug, Clone, Serialize)]
pub struct EulerRow {
    /// Step size as a fraction of the largest that is stable at rest.
    pub step_size: f64,
    /// The shortest pull (of the uniform body, in steps of 10 mm up to 160 mm) at which the method
    /// diverges, if any.
    pub diverges_at_mm: Option<f64>,
    /// Whether the combined method stays stable at that pull.
    pub is_borne_by_combined: Option<bool>,
    /// Steps until the base feels 90 % of a push of 1 mm: uniform, hard middle, hard bottom. The
    /// combined method needs 1.
    pub steps_to_cross: [Option<usize>; 3],
}

/// Step sizes of [`euler`], as fractions of the largest that is stable at rest.
pub const EULER_STEP_SIZES: [f64; 4] = [0.25, 0.5, 0.8, 0.95];

/// For one step size, pulls until explicit Euler diverges, and counts the steps until a force has
/// crossed the body.
///
/// # Errors
/// If a model cannot be built.
pub fn euler(step_size: f64) -> Result<EulerRow, SpringError> {
    let uniform = thesis_model(Body::Uniform)?;
    let params = StepParams::euler(&uniform, step_size);
    let diverges_at = (1..=16)
        .map(|i| 0.010 * f64::from(i))
        .find(|&pull| !is_borne(&uniform, pull, &params));
    let [a, b, c] = Body::ALL.map(|body| -> Result<Option<usize>, SpringError> {
        let model = thesis_model(body)?;
        let params = StepParams::euler(&model, step_size);
        let push = Vec3::new(0.0, 0.0, -0.001);
        let crossing = steps_to_cross(&model, push, &params, 0.9, 20_000);
        Ok(crossing.map(|c| c.settled_steps))
    });
    Ok(EulerRow {
        step_size,
        diverges_at_mm: diverges_at.map(|pull| (pull * 1e3).round()),
        is_borne_by_combined: diverges_at
            .map(|pull| is_borne(&uniform, pull, &StepParams::default())),
        steps_to_cross: [a?, b?, c?],
    })
}

/// Steps of the combined method until the base feels 90 % of a push of 1 mm, per body.
///
/// # Errors
/// If a model cannot be built.
pub fn combined_steps_to_cross() -> Result<[Option<usize>; 3], SpringError> {
    let params = StepParams {
        corrections: Corrections::OFF,
        ..StepParams::default()
    };
    let [a, b, c] = Body::ALL.map(|body| -> Result<Option<usize>, SpringError> {
        let push = Vec3::new(0.0, 0.0, -0.001);
        let crossing = steps_to_cross(&thesis_model(body)?, push, &params, 0.9, 20);
        Ok(crossing.map(|c| c.settled_steps))
    });
    Ok([a?, b?, c?])
}

/// Whether the model stays stable while it is pulled outward in 40 steps and held for 500.
fn is_borne(model: &SpringModel, distance: f64, params: &StepParams) -> bool {
    let (mut state, mut ws) = (SpringState::new(model), Workspace::new(model));
    (0..540).all(|i| {
        let part = if i < 40 { distance / 40.0 } else { 0.0 };
        let report = step(
            model,
            &mut state,
            &mut ws,
            Vec3::new(0.0, 0.0, part),
            params,
        );
        report.outcome == Outcome::Converged
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_converge_at_first_order() {
        let errors: Vec<f64> = convergence().unwrap().iter().map(|row| row.error).collect();
        for pair in errors.windows(2) {
            assert!((3.0..7.0).contains(&(pair[0] / pair[1])), "{errors:?}");
        }
    }

    #[test]
    fn euler_at_large_steps_diverges_where_the_combined_method_does_not() {
        let row = euler(0.95).unwrap();
        assert_eq!(row.is_borne_by_combined, Some(true));
        assert!(row.steps_to_cross[0].unwrap() > 10);
        assert_eq!(combined_steps_to_cross().unwrap(), [Some(1); 3]);
    }
}
