//! The points of the skin's triangles at which a tool may press.

use palpa_mesh::Vec3;

use crate::Mat3;
use crate::posed_tool::PosedTool;

/// Parts of a triangle's edges: of triangles that are small beside the tool, and at most.
const LEAST_PARTS: usize = 2;
const MOST_PARTS: usize = 12;
/// Longest edge of two parts, as a share of the tool's size.
const FINE: f64 = 0.35;
/// Size of a tool beside the radius of its tip.
const TIP: f64 = 2.0;

/// A point of the skin near a tool.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spot {
    /// Skin vertices of its triangle.
    pub(crate) vertices: [u32; 3],
    /// Shares of the vertices in the point.
    pub(crate) shares: [f64; 3],
    /// Area that it stands for at rest, m².
    pub(crate) area: f64,
    /// Nearest tool.
    pub(crate) tool: u32,
    /// Gap, m; negative inside the tool.
    pub(crate) gap: f64,
    /// Unit normal of the tool's surface, from the tool to the tissue.
    pub(crate) normal: Vec3,
    /// Curvature of the tool's surface, 1/m.
    pub(crate) curvature: Mat3,
    /// Stiffness `ε` of the skin there, Pa/m.
    pub(crate) stiffness: f64,
}

impl Spot {
    /// The mean of a quantity at the vertices, weighted by their shares.
    pub(crate) fn mean(&self, at: impl Fn(u32) -> f64) -> f64 {
        let parts = self.vertices.iter().zip(&self.shares);
        parts.map(|(&v, share)| share * at(v)).sum()
    }
}

/// How finely triangles are divided for the tools.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fineness {
    /// Longest edge of a triangle with four points, m.
    edge: f64,
}

impl Fineness {
    /// For these tools.
    pub(crate) fn of(tools: &[PosedTool]) -> Self {
        let sizes = tools.iter().map(|posed| {
            let shape = posed.tool.shape();
            shape.footprint_radius().min(TIP * shape.tip_radius())
        });
        Self {
            edge: FINE * sizes.fold(f64::INFINITY, f64::min),
        }
    }

    /// Parts of an edge of a triangle with this longest edge, m.
    fn parts(self, longest: f64) -> usize {
        let times = (longest / self.edge).ceil().max(1.0);
        (LEAST_PARTS * times as usize).clamp(LEAST_PARTS, MOST_PARTS)
    }
}

/// The tool nearest to `x`, and its distance, m, negative inside; `None` if there is no tool.
pub(crate) fn nearest_tool(tools: &[PosedTool], x: &Vec3) -> Option<(usize, f64)> {
    let distance = |PosedTool { tool, pose }: &PosedTool| tool.distance_at(pose, x).distance;
    let all = tools.iter().map(distance).enumerate();
    all.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// The longer of two edges of a triangle, m.
pub(crate) fn edge_of(corners: &[Vec3; 3]) -> f64 {
    let [a, b, c] = corners;
    (a - b).norm().max((c - b).norm())
}

/// The largest gap, m, at which pressures (Pa) at the corners of a triangle keep a point pressed.
pub(crate) fn kept_gap(pressures: [f64; 3], stiffness: [f64; 3]) -> f64 {
    let softest = stiffness.into_iter().fold(f64::INFINITY, f64::min);
    pressures.into_iter().fold(0.0, f64::max) / softest.max(f64::MIN_POSITIVE)
}

/// Visits the points of a triangle: middles of equal parts, given by the shares of its corners, and
/// the number of parts.
fn for_each_point(parts: usize, mut visit: impl FnMut([f64; 3])) {
    let n = parts as f64;
    for i in 0..parts {
        for j in 0..parts - i {
            let mut point = |offset: f64| {
                let (a, b) = ((i as f64 + offset) / n, (j as f64 + offset) / n);
                visit([a, b, 1.0 - a - b]);
            };
            point(1.0 / 3.0);
            if i + j + 1 < parts {
                point(2.0 / 3.0);
            }
        }
    }
}

/// Appends the points of a triangle that are within `reach` (m) of a tool, or all if `is_pressed`.
///
/// `at_rest` and `at` have its corners, m, `stiffness` their `ε`.
pub(crate) fn spots_of(
    vertices: [u32; 3],
    at_rest: &[Vec3; 3],
    at: &[Vec3; 3],
    stiffness: &[f64; 3],
    tools: &[PosedTool],
    (fineness, reach): (Fineness, f64),
    out: &mut Vec<Spot>,
) {
    let longest = longest_edge(at);
    // No point is farther from a corner than the longest edge.
    let Some((_, least)) = nearest_tool(tools, &at[0]) else {
        return;
    };
    if least > reach + longest {
        return;
    }
    let [a, b, c] = at_rest;
    let area = 0.5 * (b - a).cross(&(c - a)).norm();
    let parts = fineness.parts(longest_edge(at_rest));
    let area = area / (parts * parts) as f64;
    for_each_point(parts, |shares| {
        let x = at[0] * shares[0] + at[1] * shares[1] + at[2] * shares[2];
        let Some((tool, gap)) = nearest_tool(tools, &x) else {
            return;
        };
        if gap > reach {
            return;
        }
        let PosedTool { tool: shape, pose } = &tools[tool];
        let distance = shape.distance_at(pose, &x);
        out.push(Spot {
            vertices,
            shares,
            area,
            tool: tool as u32,
            gap: distance.distance,
            normal: distance.normal,
            curvature: distance.curvature,
            stiffness: (0..3).map(|k| shares[k] * stiffness[k]).sum(),
        });
    });
}

fn longest_edge(corners: &[Vec3; 3]) -> f64 {
    let edges = [[0, 1], [1, 2], [2, 0]];
    let lengths = edges.map(|[a, b]| (corners[a] - corners[b]).norm());
    lengths.into_iter().fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_points_of_a_triangle_share_it_evenly() {
        for parts in 1..=MOST_PARTS {
            let (mut n, mut sum) = (0_u16, [0.0; 3]);
            for_each_point(parts, |shares| {
                n += 1;
                for k in 0..3 {
                    assert!(shares[k] > 0.0, "{parts}: {shares:?}");
                    sum[k] += shares[k];
                }
            });
            assert_eq!(usize::from(n), parts * parts);
            for share in sum {
                assert!((share / f64::from(n) - 1.0 / 3.0).abs() < 1e-12, "{parts}");
            }
        }
    }
}
