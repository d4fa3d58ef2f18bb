//! The exterior during a step.

use std::sync::Arc;

use super::super::outside::{Follower, Outside};
use super::super::plan::Trouble;
use super::Live;

/// The way in which the exterior follows the zone; see [`super::ExteriorMode`].
#[derive(Debug)]
pub(super) enum ExteriorState {
    /// It is brought to equilibrium in every step.
    Followed {
        follower: Box<Follower>,
        /// Its unbalanced forces, N.
        residual: f64,
    },
    /// It responds linearly about the state of its last factor.
    Linear {
        /// Time by which its memory lags behind, s.
        lag: f64,
        /// As `lag`, for the prisms that are evaluated one by one: their memory is updated when a
        /// job is requested, not when it is done.
        singles_lag: f64,
        /// Whether the body has restarted from rest since then; that state must then not be used.
        is_lost: bool,
    },
}

impl ExteriorState {
    pub(super) fn new(follower: Option<Box<Follower>>) -> Self {
        match follower {
            Some(follower) => Self::Followed {
                follower,
                residual: 0.0,
            },
            None => Self::Linear {
                lag: 0.0,
                singles_lag: 0.0,
                is_lost: false,
            },
        }
    }

    pub(super) fn is_followed(&self) -> bool {
        matches!(self, Self::Followed { .. })
    }

    /// Whether the displacements outside the zone come from the linear response.
    pub(super) fn answers_linearly(&self) -> bool {
        matches!(self, Self::Linear { is_lost: false, .. })
    }

    pub(super) fn follower(&self) -> Option<&Follower> {
        match self {
            Self::Followed { follower, .. } => Some(follower),
            Self::Linear { .. } => None,
        }
    }

    pub(super) fn follower_mut(&mut self) -> Option<&mut Follower> {
        match self {
            Self::Followed { follower, .. } => Some(follower),
            Self::Linear { .. } => None,
        }
    }

    /// Takes over the prisms of the exterior of a new zone. Returns those of the old one.
    pub(super) fn replace_follower(&mut self, new: Option<Box<Follower>>) -> Option<Box<Follower>> {
        match (self, new) {
            (Self::Followed { follower, .. }, Some(new)) => Some(std::mem::replace(follower, new)),
            (_, new) => new,
        }
    }

    /// Unbalanced forces of a followed exterior, N.
    pub(super) fn residual(&self) -> f64 {
        match self {
            Self::Followed { residual, .. } => *residual,
            Self::Linear { .. } => 0.0,
        }
    }

    /// Time by which the memory of a linear exterior lags behind, s.
    pub(super) fn lag(&self) -> f64 {
        match self {
            Self::Followed { .. } => 0.0,
            Self::Linear { lag, .. } => *lag,
        }
    }

    /// Sets the time by which the memory of a linear exterior lags behind, s.
    pub(super) fn set_lag(&mut self, new: f64) {
        if let Self::Linear { lag, .. } = self {
            *lag = new;
        }
    }

    /// Counts the duration of a step, s, for the memory of a linear exterior.
    pub(super) fn age(&mut self, dt: f64) {
        if let Self::Linear {
            lag, singles_lag, ..
        } = self
        {
            *lag += dt;
            *singles_lag += dt;
        }
    }

    /// Time by which the memory of the prisms of a linear exterior that are evaluated one by one lags
    /// behind, s; 0 from now on.
    pub(super) fn take_singles_lag(&mut self) -> f64 {
        match self {
            Self::Followed { .. } => 0.0,
            Self::Linear { singles_lag, .. } => std::mem::take(singles_lag),
        }
    }

    /// Called when the body restarts from rest, where it has been for ever.
    pub(super) fn lose(&mut self) {
        if let Self::Linear {
            lag,
            singles_lag,
            is_lost,
        } = self
        {
            *is_lost = true;
            *lag = f64::INFINITY;
            *singles_lag = f64::INFINITY;
        }
    }

    /// Called with a new factor. Returns whether the old exterior was linearised about a usable
    /// state.
    pub(super) fn renew(&mut self) -> bool {
        match self {
            Self::Followed { .. } => false,
            Self::Linear { is_lost, .. } => !std::mem::take(is_lost),
        }
    }

    /// The factor that determines the displacements outside the zone; `None` if those displacements
    /// are up to date.
    pub(super) fn origin(&self, outside: &Arc<Outside>) -> Option<Arc<Outside>> {
        self.answers_linearly().then(|| Arc::clone(outside))
    }
}

impl Live {
    /// Updates a followed exterior to the ring, once a step: its displacements, then its forces.
    /// Within the step it responds linearly.
    pub(super) fn bring_exterior(&mut self) -> Result<(), Trouble> {
        let ExteriorState::Followed { follower, .. } = &mut self.exterior else {
            return Ok(());
        };
        self.outside.settle(
            &self.model,
            &self.plan,
            None,
            None,
            &mut self.state.displacements,
            &mut self.ws.moves,
            &mut follower.solve,
        );
        self.follow()
    }

    /// Evaluates the forces of a followed exterior at the present displacements.
    pub(super) fn follow(&mut self) -> Result<(), Trouble> {
        if let (ExteriorState::Followed { follower, residual }, Some(outside)) =
            (&mut self.exterior, Arc::get_mut(&mut self.outside))
        {
            *residual = outside.follow(
                &self.model,
                &self.memory,
                &self.plan,
                follower,
                &self.state.displacements,
            )?;
        }
        Ok(())
    }

    /// Updates the displacements outside the zone. Cost: a substitution through the exterior.
    pub fn settle(&mut self) {
        if self.beyond.is_settled {
            return;
        }
        self.beyond.is_settled = !self.exterior.is_followed();
        self.outside.settle(
            &self.model,
            &self.plan,
            None,
            self.beyond.load(),
            &mut self.state.displacements,
            &mut self.ws.moves,
            &mut self.inside.solve,
        );
    }
}
