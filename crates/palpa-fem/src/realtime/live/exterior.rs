//! The body outside the zone, as a step sees it.

use std::sync::Arc;

use palpa_sparse::fronts::SolveScratch;

use super::super::outside::{Follower, Outside};
use super::super::plan::{Plan, Trouble};
use super::Live;

/// How the body outside the zone keeps up with it; see [`super::ExteriorMode`].
#[derive(Debug)]
pub(super) enum ExteriorState {
    /// It is brought to equilibrium in every step.
    Followed {
        follower: Box<Follower>,
        /// Its forces out of balance, N.
        residual: f64,
    },
    /// It answers linearly about the state of its last factor.
    Linear {
        /// Time that its memory is behind, s.
        lag: f64,
        /// Whether the body has begun again at rest since: then that state is not one to go on
        /// from.
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
                is_lost: false,
            },
        }
    }

    pub(super) fn is_followed(&self) -> bool {
        matches!(self, Self::Followed { .. })
    }

    /// Whether the displacements outside the zone are those that its linear answer gives.
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

    /// Takes over the prisms of the exterior of a new zone.
    pub(super) fn replace_follower(&mut self, new: Option<Box<Follower>>) {
        if let (Self::Followed { follower, .. }, Some(new)) = (self, new) {
            *follower = new;
        }
    }

    /// Forces out of balance of a followed exterior, N.
    pub(super) fn residual(&self) -> f64 {
        match self {
            Self::Followed { residual, .. } => *residual,
            Self::Linear { .. } => 0.0,
        }
    }

    /// Time that the memory of a linear exterior is behind, s.
    pub(super) fn lag(&self) -> f64 {
        match self {
            Self::Followed { .. } => 0.0,
            Self::Linear { lag, .. } => *lag,
        }
    }

    /// Says how far behind the memory of a linear exterior is, s.
    pub(super) fn set_lag(&mut self, new: f64) {
        if let Self::Linear { lag, .. } = self {
            *lag = new;
        }
    }

    /// The body begins again at rest.
    pub(super) fn lose(&mut self) {
        if let Self::Linear { is_lost, .. } = self {
            *is_lost = true;
        }
    }

    /// A new factor is there. Returns whether the old one was linear about a state to go on from.
    pub(super) fn renew(&mut self) -> bool {
        match self {
            Self::Followed { .. } => false,
            Self::Linear { is_lost, .. } => !std::mem::take(is_lost),
        }
    }

    /// The factor and zone that the displacements outside the zone follow from; none where those
    /// displacements are up to date.
    pub(super) fn origin(
        &self,
        plan: &Arc<Plan>,
        outside: &Arc<Outside>,
    ) -> Option<(Arc<Plan>, Arc<Outside>)> {
        self.answers_linearly()
            .then(|| (Arc::clone(plan), Arc::clone(outside)))
    }
}

impl Live {
    /// Brings a followed exterior along with the ring: its displacements, then its forces, once a
    /// step. Within the step it answers linearly.
    pub(super) fn bring_exterior(&mut self) -> Result<(), Trouble> {
        let ExteriorState::Followed { follower, .. } = &mut self.exterior else {
            return Ok(());
        };
        self.outside.settle(
            &self.model,
            &self.plan,
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

    /// Brings the displacements outside the zone up to date. Cost: a substitution through the
    /// exterior, and memory.
    pub fn settle(&mut self) {
        self.settle_columns(None);
    }

    /// The same for some columns only.
    pub(super) fn settle_columns(&mut self, only: Option<&[u32]>) {
        let mut scratch = SolveScratch::new(&self.plan.tree);
        self.outside.settle(
            &self.model,
            &self.plan,
            only,
            &mut self.state.displacements,
            &mut self.ws.moves,
            &mut scratch,
        );
    }
}
