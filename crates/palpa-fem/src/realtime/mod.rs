//! Real-time steps: the same element and laws, fast enough for a hand.
//!
//! A step follows the tools by one Newton iteration, or by two where forces are far out of balance.
//! The stiffness of a *zone* around the tools is computed anew in every step, in single precision.
//! Forces and displacements are in double precision. So the stiffness determines how fast a step
//! converges, but not the result. The stiffness of the rest of the body, the *exterior*, is an
//! earlier one; the background renews it ([`Rebuild`]). Contact is a small problem of its own on
//! the compliance of a few vertices (`contact_problem.rs`); the haptic loop gets the same
//! compliance.
//!
//! ```text
//! crate::batch (elements in lanes) ─► inside (zone) ───────────────────┐
//!                             └─────► outside (exterior) ───────────────┤─► live ─► local ─► haptic loop
//! plan (which columns are in the zone) ─────────────────────────────────┤
//! candidate ─► contact_problem ─────────────────────────────────────────┘
//! ```

mod candidate;
mod contact_problem;
mod dense;

mod inside;

mod live;
mod local;
mod outside;
mod plan;

pub use live::{
    ExteriorMode, FineBodies, Glance, Live, LiveParams, LiveReport, Rebuild, Rebuilt, RoamDone,
    RoamJob, Roaming, StepOutcome,
};
pub use local::{LocalContact, LocalModel, LocalTool};

/// Largest number of contact candidates.
pub const MOST_CANDIDATES: usize = 400;
/// Largest number of contact candidates outside the zone.
const MOST_FAR: usize = 24;
/// Points of the skin that there is memory for.
const MOST_POINTS: usize = 8192;
