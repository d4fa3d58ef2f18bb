//! A sphere is pressed on a half-space and moved sideways at constant depth.
//!
//! ```text
//! first:        T(d) = μN (1 − (1 − d/d₁)^1.5),   d₁ = 3 μN (2 − ν)/(16 G a)
//! from a turn:  T = T₀ ∓ 2 T(|d − d₀|/2)
//! ```
//! A disc of radius `c = a (1 − T/μN)^⅓` sticks and the ring around it slips; at d₁ all slips. After
//! a turn at (d₀, T₀) the traction changes by the solution for twice the friction (C. Cattaneo,
//! Rend. Accad. Lincei 27 (1938); R. D. Mindlin, J. Appl. Mech. 16 (1949) 259–268; R. D. Mindlin &
//! H. Deresiewicz, J. Appl. Mech. 20 (1953) 327–344; K. L. Johnson, *Contact Mechanics* (1985),
//! sections 7.2 and 7.4).
//!
//! The theory leaves out that pressure and shear change each other, which they do not at ν = ½, and
//! the small traction across the movement. Single precision of the moving step bounds ν: at 0.499 it
//! finds no stable rest for a body that is hundreds of times as wide as the contact.

use palpa_mesh::Vec3;

use crate::verify::sector::Outline;
use crate::verify::tolerance::{PARTIAL_SLIP, SMALL_STRAIN, STICKING};
use crate::verify::{Findings, Options, Row, VerifyError};

use super::{CONTACT, DEPTH, HalfSpace, YOUNG, hertz};

const CASE: &str = "mindlin";
/// Nearly ½: the skin hardly slides while it is pressed.
const NU: f64 = 0.49;
const FRICTION: f64 = 0.3;
/// Edges per radius of the disc.
const EDGES: usize = 5;
/// Load steps of the press.
const PRESS: usize = 2;
/// Where the movement turns, as a share of d₁: forth to here, back to the same on the other side, and
/// forth until all slips.
const TURN: f64 = 0.8;
/// Distance between the places, as a share of d₁.
const APART: f64 = 0.4;
/// Steps of the moving step between two places.
const STEPS: usize = 10;

/// The loop of tangential force over displacement.
struct Mindlin {
    /// Force at which all slips, N.
    limit: f64,
    /// Displacement at which all slips, m.
    slip: f64,
}

impl Mindlin {
    fn new() -> Self {
        let limit = FRICTION * hertz(NU);
        let shear = YOUNG / (2.0 + 2.0 * NU);
        Self {
            limit,
            slip: 3.0 * limit * (2.0 - NU) / (16.0 * shear * CONTACT),
        }
    }

    /// Force on the first way, as a share of the limit, at a displacement as a share of d₁.
    fn first(d: f64) -> f64 {
        1.0 - (1.0 - d.min(1.0)).powf(1.5)
    }

    /// Displacement and force along the loop, as shares of d₁ and of the limit.
    fn along() -> Vec<[f64; 2]> {
        let n = n_first();
        let mut all: Vec<[f64; 2]> = Vec::new();
        for i in 1..=n {
            let d = APART * i as f64;
            all.push([d, Self::first(d)]);
        }
        let top = Self::first(TURN);
        for i in 1..=2 * n {
            let way = APART * i as f64;
            all.push([TURN - way, top - 2.0 * Self::first(0.5 * way)]);
        }
        for i in 1..=2 * n + 2 {
            let way = APART * i as f64;
            let d = way - TURN;
            // Past the first turn the loop is closed, and the first way goes on.
            let force = if d <= TURN {
                2.0 * Self::first(0.5 * way) - top
            } else {
                Self::first(d)
            };
            all.push([d, force]);
        }
        all
    }
}

pub(crate) fn run(_: &Options) -> Result<Findings, VerifyError> {
    let mut findings = Findings::default();
    let half_space = HalfSpace::new(Outline::Half, EDGES, NU);
    let known = Mindlin::new();
    let way = Mindlin::along();
    let down = (1..=PRESS).map(|i| [0.0, DEPTH * i as f64 / PRESS as f64]);
    let places: Vec<[f64; 2]> = (down)
        .chain(way.iter().map(|[d, _]| [d * known.slip, DEPTH]))
        .collect();
    let (felt, nodes) = half_space.statically(FRICTION, &places)?;
    for ([d, share], felt) in way.iter().zip(&felt[PRESS..]).take(n_first()) {
        let known = (1.0 - share).cbrt();
        findings.rows.push(Row::with_error(
            CASE,
            format!(
                "moved in statics to {d:.1} of full slip: disc that sticks, of the contact's radius"
            ),
            [known, felt.sticks],
            felt.sticks - known,
            STICKING,
            nodes,
        ));
    }
    let forces: Vec<Vec3> = felt.iter().map(|felt| felt.force).collect();
    let moving = half_space.in_motion(FRICTION, &places, STEPS)?;
    for (how, forces) in [("in statics", forces), ("in motion", moving)] {
        findings.rows.push(Row::ratio(
            CASE,
            format!("pressed {how}: force, N"),
            hertz(NU),
            forces[PRESS - 1].z,
            SMALL_STRAIN,
            nodes,
        ));
        let mut from = 0.0;
        for ([d, share], force) in way.iter().zip(&forces[PRESS..]) {
            let reference = share * known.limit;
            let forth = if *d > from { "forth" } else { "back" };
            from = *d;
            findings.rows.push(Row::with_error(
                CASE,
                format!("moved {how} {forth} to {d:.1} of full slip: force across, N (error: share of μN)"),
                [reference, -force.x],
                (-force.x - reference) / known.limit,
                PARTIAL_SLIP,
                nodes,
            ));
        }
    }
    Ok(findings)
}

/// Number of places before the first turn.
fn n_first() -> usize {
    (TURN / APART).round() as usize
}
