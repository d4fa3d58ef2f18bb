//! The law of contact that statics, the moving step and the haptic loop share.
//!
//! Contact is integrated over the skin: each triangle has points at which the tool presses,
//!
//! ```text
//! p = max(0, λ − ε g),    F_i = ∫ φ_i p,    λ_i = F_i / A_i
//! ```
//! with the gap `g` (m, negative inside the tool), the pressure `λ` interpolated from the vertices
//! (Pa), and the stiffness `ε` of the skin's own column (Pa/m). In equilibrium `λ` is the pressure
//! itself, so the gap under the tool is zero but for waves shorter than a triangle. At the border of
//! the contact, points come to press one after the other, and a triangle gives way gradually.
//! Friction acts on vertices: it holds a vertex at its *anchor*, the point of the tool where it first
//! touched, up to `μ F_i`. Where it slides, friction opposes the slip.
//!
//! | file | what happens there |
//! | --- | --- |
//! | `skin` | stiffness `ε` of each column |
//! | `spots` | the points of a triangle, their gaps and normals |
//! | `touch` | the state of a vertex: pressure, friction, anchor |

mod skin;
mod spots;
mod touch;

pub(crate) use skin::SkinStiffness;
pub(crate) use spots::{Fineness, Spot, edge_of, kept_gap, nearest_tool, spots_of};
pub use touch::Touch;
pub(crate) use touch::{anchor_at, first_touch};
