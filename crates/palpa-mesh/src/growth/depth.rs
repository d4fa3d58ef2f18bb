//! Depth below the skin: the distance to the nearest point of the skin, which is how the thickness
//! of a layer is measured. A column may lean, so its length is more than the depth it reaches.

use super::columns::{Column, Confinement};
use crate::{Surface, SurfaceIndex, Vec3};

/// Depths are met to this share of themselves.
const TOLERANCE: f64 = 1e-7;
/// A column that leans by more than the angle with this cosine is searched in steps that assume
/// this much gain in depth for its length.
const LEAST_GAIN: f64 = 0.3;
/// Shortest step of a search along a column, as a share of the depth that is looked for. It ends
/// the search where the depth comes near to its target and then falls again.
const LEAST_STEP: f64 = 0.01;
/// Largest number of steps of a search that goes into a crossing.
const MAX_BISECTIONS: usize = 60;
/// Largest number of corrections that bring a point back to its depth.
const MAX_CORRECTIONS: usize = 4;
/// A corrected point may miss its depth by this share of it.
const MET: f64 = 1e-5;

/// The depth of points below a skin.
///
/// An open skin ends at its rims. Beyond a rim, the nearest point is on the rim.
#[derive(Debug)]
pub(super) struct Depth {
    index: SurfaceIndex,
}

/// A place on a column: the arc length from the skin, and the depth. m
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    pub(super) arc: f64,
    pub(super) depth: f64,
}

impl Place {
    /// The start of every column.
    pub(super) const SKIN: Self = Self {
        arc: 0.0,
        depth: 0.0,
    };
}

impl Depth {
    pub(super) fn below(skin: &Surface) -> Self {
        Self {
            index: SurfaceIndex::build(skin),
        }
    }

    /// The index of the skin itself.
    pub(super) fn index(&self) -> &SurfaceIndex {
        &self.index
    }

    /// Depth of a point, m. It has no sign: columns start on the skin and lead inward.
    pub(super) fn at(&self, x: Vec3) -> f64 {
        (x - self.nearest(x)).norm()
    }

    fn nearest(&self, x: Vec3) -> Vec3 {
        self.index.closest(x).map_or(x, |c| c.point)
    }

    /// The first place of a column at the given depth, from a place above it down to the arc length
    /// `end`. If the column does not get there, the `Err` is its deepest place.
    ///
    /// The depth grows by no more than the length of a column. So a step by the missing depth never
    /// passes the place; the steps are longer where the column was seen to lean.
    pub(super) fn reach(
        &self,
        line: &Column,
        from: Place,
        depth: f64,
        end: f64,
    ) -> Result<Place, Place> {
        let is_there = |p: Place| (p.depth - depth).abs() <= TOLERANCE * depth;
        let (mut at, mut deepest, mut gain) = (from, from, 1.0);
        loop {
            if is_there(at) {
                return Ok(at);
            }
            if at.arc >= end {
                return Err(deepest);
            }
            let step = ((depth - at.depth) / gain).max(LEAST_STEP * depth);
            let arc = (at.arc + step).min(end);
            let next = Place {
                arc,
                depth: self.at(line.at(arc)),
            };
            if next.depth > depth && !is_there(next) {
                return Ok(self.between(line, at, next, depth));
            }
            gain = ((next.depth - at.depth) / (next.arc - at.arc)).clamp(LEAST_GAIN, 1.0);
            if next.depth > deepest.depth {
                deepest = next;
            }
            at = next;
        }
    }

    /// The place at the given depth between one above and one below it (false position, after the
    /// Illinois rule).
    fn between(&self, line: &Column, above: Place, below: Place, depth: f64) -> Place {
        let (mut a, mut b) = (above, below);
        let (mut fa, mut fb) = (a.depth - depth, b.depth - depth);
        let mut last = 0;
        for _ in 0..MAX_BISECTIONS {
            let arc = (a.arc * fb - b.arc * fa) / (fb - fa);
            let at = Place {
                arc,
                depth: self.at(line.at(arc)),
            };
            let f = at.depth - depth;
            if f.abs() <= TOLERANCE * depth || b.arc - a.arc <= f64::EPSILON * b.arc {
                return at;
            }
            if f < 0.0 {
                (a, fa) = (at, f);
                if last < 0 {
                    fb *= 0.5;
                }
                last = -1;
            } else {
                (b, fb) = (at, f);
                if last > 0 {
                    fa *= 0.5;
                }
                last = 1;
            }
        }
        a
    }

    /// `x`, moved along the shortest way to the given depth; `None` if it does not get there. The
    /// node of vertex `v` stays in its cut faces.
    pub(super) fn corrected(
        &self,
        x: Vec3,
        v: usize,
        depth: f64,
        confinement: &Confinement,
    ) -> Option<Vec3> {
        let mut x = x;
        for _ in 0..MAX_CORRECTIONS {
            let offset = x - self.nearest(x);
            let missing = depth - offset.norm();
            if missing.abs() <= MET * depth {
                return Some(x);
            }
            let inward = confinement.project(v, offset.try_normalize(0.0)?);
            // In a cut face that crosses the skin obliquely, the way is longer.
            x += inward * (missing / inward.norm_squared().max(LEAST_GAIN));
        }
        ((depth - self.at(x)).abs() <= MET * depth).then_some(x)
    }
}
