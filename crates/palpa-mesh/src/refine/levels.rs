//! Additional levels in the columns of a body.

use std::ops::{Add, Mul};

use crate::LayeredBody;
use crate::quality::PrismShape;

/// A body with more levels, and the origin of each level.
#[derive(Debug, Clone, PartialEq)]
pub struct LevelSplit {
    /// The body, over the same skin.
    pub body: LayeredBody,
    /// The origin of each level: the old level at or above it, and the share of the way from there
    /// to the next old level. `[n_levels]`
    pub origins: Vec<(usize, f64)>,
    /// Number of prisms that are turned over although the old prism around them passes the checks
    /// of [`crate::quality`]. It is 0 except for prisms on the brink.
    pub n_invalid: usize,
    n_old: usize,
}

impl LevelSplit {
    /// Carries a field with one value per node of the old body (`[n_nodes]`) to the new nodes,
    /// linearly between levels.
    ///
    /// # Panics
    /// If `field` does not have one value per old node.
    pub fn interpolate<T>(&self, field: &[T]) -> Vec<T>
    where
        T: Copy + Mul<f64, Output = T> + Add<Output = T>,
    {
        assert_eq!(
            field.len(),
            self.body.n_vertices() * self.n_old,
            "one value per node"
        );
        interpolate(&self.origins, field, self.n_old)
    }
}

fn interpolate<T>(origins: &[(usize, f64)], field: &[T], n_old: usize) -> Vec<T>
where
    T: Copy + Mul<f64, Output = T> + Add<Output = T>,
{
    field
        .chunks_exact(n_old)
        .flat_map(|column| {
            origins.iter().map(|&(level, share)| {
                if share == 0.0 {
                    column[level]
                } else {
                    column[level] * (1.0 - share) + column[level + 1] * share
                }
            })
        })
        .collect()
}

/// Divides each interval in all columns. `parts` holds the heights of each interval's parts, as
/// shares of the interval. The parts stay in the interval's layer.
///
/// # Panics
/// Unless there are parts for each interval, with positive heights that add up to 1.
pub fn split_levels(body: &LayeredBody, parts: &[Vec<f64>]) -> LevelSplit {
    let is_whole = |heights: &Vec<f64>| {
        heights.iter().all(|&height| height > 0.0)
            && (heights.iter().sum::<f64>() - 1.0).abs() < 1e-9
    };
    assert!(
        parts.len() + 1 == body.n_levels && parts.iter().all(is_whole),
        "shares of each of {} intervals, not {parts:?}",
        body.n_levels - 1
    );
    let mut origins = Vec::new();
    let mut interval_layer = Vec::new();
    for (i, heights) in parts.iter().enumerate() {
        let mut share = 0.0;
        for height in heights {
            origins.push((i, share));
            interval_layer.push(body.interval_layer[i]);
            share += height;
        }
    }
    origins.push((body.n_levels - 1, 0.0));
    let split = LayeredBody {
        skin: body.skin.clone(),
        positions: interpolate(&origins, &body.positions, body.n_levels),
        n_levels: origins.len(),
        interval_layer,
        layer_names: body.layer_names.clone(),
        cut_faces: body.cut_faces.clone(),
    };
    let is_valid = |body: &LayeredBody, t: usize, i: usize| {
        PrismShape::of(&body.prism(t, i).map(|n| body.positions[n])).is_valid()
    };
    let n_invalid = (0..split.n_levels - 1)
        .filter(|&i| parts[origins[i].0].len() > 1)
        .flat_map(|i| (0..split.skin.triangles.len()).map(move |t| (t, i)))
        .filter(|&(t, i)| !is_valid(&split, t, i) && is_valid(body, t, origins[i].0))
        .count();
    LevelSplit {
        body: split,
        origins,
        n_invalid,
        n_old: body.n_levels,
    }
}

/// Mean depth of each level below the skin, along the columns of these vertices. m, `[n_levels]`
///
/// # Panics
/// If there are no vertices.
pub fn mean_depths(body: &LayeredBody, vertices: &[u32]) -> Vec<f64> {
    assert!(!vertices.is_empty(), "depths of no columns");
    let mut depths = vec![0.0; body.n_levels];
    for &v in vertices {
        let mut depth = 0.0;
        let first = body.node(v as usize, 0);
        let column = &body.positions[first..first + body.n_levels];
        for (mean, step) in depths[1..].iter_mut().zip(column.windows(2)) {
            depth += (step[1] - step[0]).norm();
            *mean += depth / vertices.len() as f64;
        }
    }
    depths
}

/// A function of the depths of an interval's top and bottom that returns the wanted height. The
/// height is `h` within `radius` of `depth`; outside, it grows by `growth` times the distance
/// beyond. Lengths in metres. For use with [`along`].
pub fn near_depth(depth: f64, radius: f64, h: f64, growth: f64) -> impl Fn(f64, f64) -> f64 {
    move |top, bottom| {
        let distance = (top - depth).max(depth - bottom).max(0.0);
        h + growth * (distance - radius).max(0.0)
    }
}

/// Wanted heights (m) along a column with levels at `depths` (ascending, m), for use with
/// [`parts_for`].
pub fn along(
    depths: Vec<f64>,
    wanted: impl Fn(f64, f64) -> f64,
) -> impl Fn(usize, f64, f64) -> f64 {
    move |i, from, to| {
        let (top, height) = (depths[i], depths[i + 1] - depths[i]);
        wanted(top + height * from, top + height * to) / height
    }
}

/// Divides each of `n` intervals so that no part is higher than `wanted` allows. Because the number
/// of parts is whole, heights may differ by a few per cent. `wanted` takes an interval and the
/// begin and end of a part, as shares of the interval; it returns the greatest height, also as a
/// share. NaN means no limit. The returned flag says whether at most `max_levels` levels were
/// enough. If not, all parts are higher than wanted by the same factor.
///
/// ```text
/// let wanted = along(mean_depths(&body, &below_the_tool), near_depth(14e-3, 6e-3, 1e-3, 0.3));
/// let (parts, is_resolved) = parts_for(body.n_levels - 1, wanted, 30);
/// let body = split_levels(&body, &parts).body;
/// ```
pub fn parts_for(
    n: usize,
    wanted: impl Fn(usize, f64, f64) -> f64,
    max_levels: usize,
) -> (Vec<Vec<f64>>, bool) {
    /// Factor by which heights grow from one try to the next, until there are few enough levels,
    /// and its limit.
    const COARSER: f64 = 1.05;
    const COARSEST: f64 = 1e6;
    let least = 1.0 / max_levels as f64;
    let (mut factor, mut is_resolved) = (1.0, true);
    loop {
        let parts: Vec<Vec<f64>> = (0..n)
            .map(|i| {
                divide(|from, to| match factor * wanted(i, from, to) {
                    height if height.is_nan() => f64::INFINITY,
                    height => height.max(least),
                })
            })
            .collect();
        let n_levels = 1 + parts.iter().map(Vec::len).sum::<usize>();
        // If a part is limited by `least`, there are already too many levels.
        if n_levels <= max_levels {
            return (parts, is_resolved);
        }
        if factor > COARSEST {
            return (vec![vec![1.0]; n], false);
        }
        factor *= COARSER;
        is_resolved = false;
    }
}

/// Heights of parts that fill the range from 0 to 1. No part is higher than wanted between its
/// begin and end.
fn divide(wanted: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    /// Rounding must not add a level.
    const ROUNDING: f64 = 1e-9;
    const HALVINGS: usize = 40;
    let mut heights = Vec::new();
    let mut from = 0.0;
    while from < 1.0 - ROUNDING {
        let is_too_high = |height: f64| wanted(from, (from + height).min(1.0)) < height;
        if !is_too_high(1.0) {
            heights.push(1.0);
            break;
        }
        let (mut good, mut bad) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let middle = f64::midpoint(good, bad);
            if is_too_high(middle) {
                bad = middle;
            } else {
                good = middle;
            }
        }
        heights.push(good);
        from += good;
    }
    // The last part reaches beyond the end, so all parts are lowered by the same factor.
    let sum: f64 = heights.iter().sum();
    heights.iter().map(|height| height / sum).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vec3;
    use crate::generate::patch::patch;

    #[test]
    fn parts_are_lowest_near_the_wanted_depth() {
        let depths = vec![0.0, 2e-3, 12e-3, 40e-3];
        let near = || near_depth(8e-3, 2e-3, 2e-3, 0.5);
        let wanted = along(depths.clone(), near());
        let (parts, is_resolved) = parts_for(3, &wanted, 100);
        // The top interval is 2 mm high and at least 4 mm outside the radius, where 4 mm are
        // wanted: one part. Then parts of 2 mm. From 2 mm outside the radius on: 3 mm, 4.5 mm, 6.75
        // mm, 10.1 mm, and a rest.
        let n: Vec<usize> = parts.iter().map(Vec::len).collect();
        assert_eq!((n, is_resolved), (vec![1, 5, 5], true));
        assert!(parts[2].windows(2).all(|pair| pair[1] > 1.2 * pair[0]));
        for (i, heights) in parts.iter().enumerate() {
            let mut from = 0.0;
            for height in heights {
                let most = wanted(i, from, from + height);
                assert!(*height <= most * 1.1, "{i}: {from} {height} {most}");
                from += height;
            }
            assert!((from - 1.0).abs() < 1e-12);
        }
        let (parts, is_resolved) = parts_for(3, &wanted, 8);
        assert!(parts.iter().map(Vec::len).sum::<usize>() < 8 && !is_resolved);
        assert_eq!(
            parts_for(3, |_, _, _| f64::NAN, 100),
            (vec![vec![1.0]; 3], true)
        );
        assert!(!parts_for(3, |_, _, _| 0.0, 100).1);
        assert!(!parts_for(3, |_, _, _| -1.0, 3).1);
    }

    #[test]
    fn parts_keep_their_layer() {
        let body = patch(3, 3, 0.01, &[0.0, 0.01, 0.03], &[0, 1]);
        let split = split_levels(&body, &[vec![1.0], vec![0.25, 0.25, 0.5]]);
        assert_eq!(split.body.interval_layer, [0, 1, 1, 1]);
        assert_eq!(split.n_invalid, 0);
        let depths = mean_depths(&split.body, &[0, 4]);
        for (depth, expected) in depths.iter().zip([0.0, 0.01, 0.015, 0.02, 0.03]) {
            assert!((depth - expected).abs() < 1e-15, "{depths:?}");
        }
        let z: Vec<f64> = body.positions.iter().map(|p| p.z).collect();
        for (z, p) in split.interpolate(&z).iter().zip(&split.body.positions) {
            assert!((z - p.z).abs() < 1e-17);
        }
        let positions: Vec<Vec3> = split.interpolate(&body.positions);
        assert_eq!(positions, split.body.positions);
    }
}
