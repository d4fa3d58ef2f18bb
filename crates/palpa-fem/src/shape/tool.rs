//! A tool: a shape with a surface that grips, moved rigidly.

use palpa_mesh::Vec3;

use super::{Distance, Shape, ShapeError};

/// Where a rigid thing stands: turns and shifts points of its own frame into the world's.
pub type Pose = nalgebra::Isometry3<f64>;

/// A rigid tool that presses on the skin: a shape with its friction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tool {
    shape: Shape,
    friction: f64,
    kinetic: f64,
}

impl Tool {
    /// A tool of this shape whose surface has this Coulomb coefficient of friction against skin.
    ///
    /// # Errors
    /// When the coefficient is negative or not finite.
    pub fn new(shape: impl Into<Shape>, friction: f64) -> Result<Self, ShapeError> {
        if !(friction >= 0.0 && friction.is_finite()) {
            return Err(ShapeError::Friction { value: friction });
        }
        Ok(Self {
            shape: shape.into(),
            friction,
            kinetic: friction,
        })
    }

    /// The same tool with another coefficient of friction where it slides, at most that where it
    /// sticks.
    ///
    /// # Errors
    /// When the coefficient is negative, not finite, or larger.
    pub fn with_kinetic_friction(self, kinetic: f64) -> Result<Self, ShapeError> {
        if !(kinetic >= 0.0 && kinetic <= self.friction) {
            return Err(ShapeError::KineticFriction {
                value: kinetic,
                most: self.friction,
            });
        }
        Ok(Self { kinetic, ..self })
    }

    /// Its shape.
    pub fn shape(&self) -> &Shape {
        &self.shape
    }

    /// Its coefficient of friction, 0 or more: that of a vertex that sticks.
    pub fn friction(&self) -> f64 {
        self.friction
    }

    /// Its coefficient of friction where it slides.
    pub fn kinetic_friction(&self) -> f64 {
        self.kinetic
    }

    /// The coefficient that bounds friction on a vertex that slides, or sticks.
    pub(crate) fn friction_limit(&self, is_sliding: bool) -> f64 {
        if is_sliding {
            self.kinetic
        } else {
            self.friction
        }
    }

    /// The distance of the point `p_world` from the tool at `pose`; normal and curvature are in
    /// world axes, too.
    pub fn distance_at(&self, pose: &Pose, p_world: &Vec3) -> Distance {
        let p_local = pose
            .rotation
            .inverse_transform_vector(&(p_world - pose.translation.vector));
        let local = self.shape.distance(&p_local);
        let r = pose.rotation.to_rotation_matrix();
        Distance {
            distance: local.distance,
            normal: r * local.normal,
            curvature: r.matrix() * local.curvature * r.matrix().transpose(),
        }
    }
}
