//! Exact solution for the contact of one vertex with its tool, with all other forces held fixed.
//!
//! In the frame of the contact (normal, two tangents), with `A` the vertex's own compliance:
//!
//! ```text
//! 0 ≤ r_n ⟂ g ≥ 0                                   pressed, never pulled
//! min ½ r_tᵀ A_tt r_t + s0ᵀ r_t,  |r_t| ≤ μ r_n     sticks inside the cone, slides against the slip on it
//! ```
//! The optimality conditions of the minimum are Coulomb's law on the round cone, for the slip `s =
//! s0 + A_tt r_t` since the anchor.

use crate::{Mat3, Pose, Vec3};
use nalgebra::{Matrix2, Vector2};

/// Smallest compliance of a vertex, m/N. It bounds the force if a patch has zero compliance.
const MIN_COMPLIANCE: f64 = 1e-8;
/// Most Newton steps for the multiplier of the friction cone. Started from below, they converge
/// monotonically and quadratically.
const CONE_STEPS: usize = 8;
/// Relative error of the length at which the Newton steps end; then the force is scaled onto the
/// cone.
const CONE_TOLERANCE: f64 = 1e-6;

/// A contact, linearised at the last position of its vertex: `gap = n · y + h`, where `y` is the
/// position of the vertex relative to the tool.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Contact {
    /// Columns: normal and two tangents, in world axes.
    frame: Mat3,
    /// The vertex's own compliance in that frame, m/N.
    own: Mat3,
    gap_offset: f64,
    anchor: Vec3,
    friction: f64,
    is_bonded: bool,
}

/// The change of a contact in a sweep.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Change {
    /// Change of its force, N.
    pub(crate) force: Vec3,
    /// Whether the vertex slides.
    pub(crate) is_sliding: bool,
}

/// Input for the linearisation of a contact.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ContactInput<'a> {
    pub(crate) candidate: &'a crate::Candidate,
    /// Pose of the device's hand-piece.
    pub(crate) pose: &'a Pose,
    /// Position of the vertex, m, relative to the displacement of the tool by its coupling.
    pub(crate) position: &'a Vec3,
    /// Anchor of the vertex, in the tool's frame, m.
    pub(crate) anchor: &'a Vec3,
    /// The vertex's own compliance plus that of the coupling, m/N.
    pub(crate) own: &'a Mat3,
    pub(crate) friction: f64,
    pub(crate) is_bonded: bool,
}

impl Contact {
    pub(crate) const NONE: Self = Self {
        frame: Mat3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
        own: Mat3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
        gap_offset: 1.0,
        anchor: Vec3::new(0.0, 0.0, 0.0),
        friction: 0.0,
        is_bonded: false,
    };

    pub(crate) fn linearised(input: &ContactInput) -> Self {
        let candidate = input.candidate;
        let d = input
            .pose
            .inverse_transform_point(&(*input.position).into())
            .coords
            - candidate.surface;
        let bend = candidate.curvature * d;
        let gap = candidate.normal.dot(&d) + 0.5 * d.dot(&bend);
        // Far from the nearest point, the curvature may reverse the gradient. Then the normal is
        // used instead.
        let gradient = candidate.normal + bend;
        let slope = gradient.norm();
        let (gradient, slope) = if slope > 0.2 && gradient.dot(&candidate.normal) > 0.0 {
            (gradient / slope, slope)
        } else {
            (candidate.normal, 1.0)
        };
        let normal = input.pose.rotation * gradient;
        let frame = frame_about(&normal);
        let gap_offset = gap / slope - normal.dot(input.position);
        let mut own = frame.transpose() * input.own * frame;
        own = (own + own.transpose()) * 0.5;
        own.m11 = own.m11.max(MIN_COMPLIANCE);
        own.m22 = own.m22.max(MIN_COMPLIANCE);
        own.m33 = own.m33.max(MIN_COMPLIANCE);
        Self {
            frame,
            own,
            gap_offset,
            anchor: (input.pose * nalgebra::Point3::from(*input.anchor)).coords,
            friction: input.friction,
            is_bonded: input.is_bonded,
        }
    }

    /// Change from the present force to the force that satisfies the contact conditions, with all
    /// other forces held fixed.
    ///
    /// `position` is relative to the displacement of the tool by its coupling.
    pub(crate) fn relax(&self, position: &Vec3, force: &Vec3) -> Change {
        if self.is_bonded {
            let slip = self.frame.transpose() * (position - self.anchor);
            let change = solve_spd3(&self.own, &-slip);
            return Change {
                force: self.frame * change,
                is_sliding: false,
            };
        }
        let normal = self.frame.column(0);
        let gap = normal.dot(position) + self.gap_offset;
        if gap >= 0.0 && *force == Vec3::zeros() {
            return Change {
                force: Vec3::zeros(),
                is_sliding: false,
            };
        }
        let slip = self.frame.transpose() * (position - self.anchor);
        let old = self.frame.transpose() * force;
        let pressed = (old.x - gap / self.own.m11).max(0.0);
        let by = pressed - old.x;
        let radius = self.friction * pressed;
        let (tangential, is_sliding) = if radius > 0.0 {
            let own = Matrix2::new(self.own.m22, self.own.m23, self.own.m32, self.own.m33);
            let held = Vector2::new(old.y, old.z);
            let slip = Vector2::new(slip.y + self.own.m21 * by, slip.z + self.own.m31 * by);
            least_in_disc(&own, &(slip - own * held), radius)
        } else {
            (Vector2::zeros(), pressed > 0.0)
        };
        let new = Vec3::new(pressed, tangential.x, tangential.y);
        Change {
            force: self.frame * (new - old),
            is_sliding,
        }
    }
}

/// An orthonormal frame whose first column is the unit normal. It is continuous except at one
/// direction (Duff et al. 2017, "Building an orthonormal basis, revisited").
fn frame_about(n: &Vec3) -> Mat3 {
    let sign = if n.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    Mat3::from_columns(&[
        *n,
        Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
        Vec3::new(b, sign + n.y * n.y * a, -n.y),
    ])
}

/// The minimum of `½ rᵀ A r + bᵀ r` over `|r| ≤ radius`, and whether it lies on the boundary.
fn least_in_disc(a: &Matrix2<f64>, b: &Vector2<f64>, radius: f64) -> (Vector2<f64>, bool) {
    let solve = |shift: f64| {
        let (p, q, s) = (a.m11 + shift, a.m12, a.m22 + shift);
        let det = (p * s - q * q).max(1e-12 * p * s);
        Vector2::new((q * b.y - s * b.x) / det, (q * b.x - p * b.y) / det)
    };
    let mut r = solve(0.0);
    if r.norm_squared() <= radius * radius {
        return (r, false);
    }
    // (A + λ) r = −b with |r| = radius: Newton on 1/|r|, which is nearly linear in λ.
    let mut shift = 0.0;
    for _ in 0..CONE_STEPS {
        let length = r.norm();
        // Only the direction is used, and its error is of second order in the error of the length.
        if length <= radius * (1.0 + CONE_TOLERANCE) {
            break;
        }
        let (p, q, s) = (a.m11 + shift, a.m12, a.m22 + shift);
        let det = (p * s - q * q).max(1e-12 * p * s);
        let curve = (s * r.x * r.x - 2.0 * q * r.x * r.y + p * r.y * r.y) / det;
        if curve.is_nan() || curve <= 0.0 {
            break;
        }
        let step = length * length / curve * (length / radius - 1.0);
        shift = (shift + step).max(0.0);
        r = solve(shift);
    }
    let length = r.norm();
    if length > 0.0 && length.is_finite() {
        (r * (radius / length), true)
    } else {
        (Vector2::zeros(), true)
    }
}

/// Solves `A x = b` for a symmetric positive definite `A`. Pivots below [`MIN_COMPLIANCE`] are
/// raised to it.
fn solve_spd3(a: &Mat3, b: &Vec3) -> Vec3 {
    let d1 = a.m11.max(MIN_COMPLIANCE);
    let (l21, l31) = (a.m21 / d1, a.m31 / d1);
    let d2 = (a.m22 - l21 * a.m21).max(MIN_COMPLIANCE);
    let l32 = (a.m32 - l31 * a.m21) / d2;
    let d3 = (a.m33 - l31 * a.m31 - l32 * l32 * d2).max(MIN_COMPLIANCE);
    let y1 = b.x;
    let y2 = b.y - l21 * y1;
    let y3 = b.z - l31 * y1 - l32 * y2;
    let x3 = y3 / d3;
    let x2 = y2 / d2 - l32 * x3;
    Vec3::new(y1 / d1 - l21 * x2 - l31 * x3, x2, x3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_disc_is_met_from_inside_and_on_its_border() {
        let a = Matrix2::new(2.0, 0.3, 0.3, 0.5);
        let b = Vector2::new(-1.0, 0.4);
        let (free, slides) = least_in_disc(&a, &b, 10.0);
        assert!(!slides && (a * free + b).norm() < 1e-12);
        for radius in [1e-3, 0.1, 0.5, 0.99 * free.norm()] {
            let (r, slides) = least_in_disc(&a, &b, radius);
            let slip = a * r + b;
            assert!(slides && (r.norm() - radius).abs() < 1e-12 * radius.max(1.0));
            // The friction force opposes the slip.
            assert!((slip.x * r.y - slip.y * r.x).abs() < 1e-4 * slip.norm() * radius);
            assert!(slip.dot(&r) < 0.0);
        }
    }

    #[test]
    fn frames_are_orthonormal_and_right_handed() {
        for n in [
            Vec3::z(),
            -Vec3::z(),
            Vec3::x(),
            Vec3::new(0.6, -0.8, -0.0),
            Vec3::new(1.0, 2.0, -3.0).normalize(),
        ] {
            let frame = frame_about(&n);
            assert!((frame.transpose() * frame - Mat3::identity()).norm() < 1e-14);
            assert!((frame.determinant() - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn three_by_three_is_solved() {
        let a = Mat3::new(4.0, 1.0, -0.5, 1.0, 3.0, 0.2, -0.5, 0.2, 2.0);
        let b = Vec3::new(1.0, -2.0, 0.5);
        assert!((a * solve_spd3(&a, &b) - b).norm() < 1e-13);
    }
}
