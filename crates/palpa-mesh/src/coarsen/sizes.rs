//! How coarse a skin may be, and where.

use super::{CoarsenLimits, Coarsened, coarsen};
use crate::refine::near_points;
use crate::{Surface, Vec3};

/// How coarse a skin may be, and where. Lengths in m.
#[derive(Debug, Clone, PartialEq)]
pub struct Coarsening {
    /// Points near which edges are short; without any, the length of edges has no limit.
    pub fine: Vec<Vec3>,
    /// Radius around these points in which the longest edge is `edge`.
    pub radius: f64,
    /// Longest edge within the radius.
    pub edge: f64,
    /// Increase of the longest edge with the distance beyond the radius, as a share of it.
    pub growth: f64,
    /// Largest distance of the coarse skin from the given one within the radius.
    pub deviation: f64,
    /// Increase of that distance with the distance beyond the radius, as a share of it.
    pub deviation_growth: f64,
    /// Largest distance of the coarse skin from the given one anywhere.
    pub most_deviation: f64,
    /// Largest distance of the coarse skin from the given one, as a share of the thickness of the
    /// tissue below.
    pub thickness_share: f64,
    /// Places whose nearest vertex stays.
    pub kept: Vec<Vec3>,
}

impl Coarsening {
    /// Coarsens a skin. `thickness` is that of the tissue below a point of it, m.
    pub(crate) fn apply(&self, skin: &Surface, thickness: impl Fn(Vec3) -> f64) -> Coarsened {
        let longest = near_points(&self.fine, self.radius, self.edge, self.growth);
        let near = near_points(
            &self.fine,
            self.radius,
            self.deviation,
            self.deviation_growth,
        );
        let tolerance: Vec<f64> = (skin.points.iter())
            .map(|&p| {
                near(0, &[p; 3])
                    .min(self.most_deviation)
                    .min(self.thickness_share * thickness(p))
            })
            .collect();
        let mut is_kept = vec![false; skin.points.len()];
        for place in &self.kept {
            let far = |v: usize| (skin.points[v] - place).norm_squared();
            let nearest = (0..skin.points.len()).min_by(|&a, &b| far(a).total_cmp(&far(b)));
            if let Some(v) = nearest {
                is_kept[v] = true;
            }
        }
        let limits = CoarsenLimits {
            is_kept: &is_kept,
            tolerance: &tolerance,
            longest: |corners: &[Vec3; 3]| longest(0, corners),
        };
        coarsen(skin, &limits)
    }
}
