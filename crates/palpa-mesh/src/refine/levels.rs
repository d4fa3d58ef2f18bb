//! More levels in the columns of a body.

use std::ops::{Add, Mul};

use crate::LayeredBody;
use crate::quality::PrismShape;

/// A body with more levels, and where they come from.
#[derive(Debug, Clone, PartialEq)]
pub struct LevelSplit {
    /// The body, over the same skin.
    pub body: LayeredBody,
    /// For each level, the old level at or above it and the share of the way from there to the next. `[n_levels]`
    pub origins: Vec<(usize, f64)>,
    /// Prisms that are turned over though the prism they are a part of passes the checks of [`crate::quality`]. 0 but
    /// for prisms on the brink.
    pub n_invalid: usize,
    n_old: usize,
}

impl LevelSplit {
    /// Carries a field with one value per node of the old body (`[n_nodes]`) to the new ones, linearly between levels.
    ///
    /// # Panics
    /// If `field` has not one value per old node.
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

/// Divides each interval into that many equal parts in all columns; they stay in the interval's layer.
///
/// # Panics
/// Unless there is a positive number of parts for each interval.
pub fn split_levels(body: &LayeredBody, parts: &[usize]) -> LevelSplit {
    assert!(
        parts.len() + 1 == body.n_levels && parts.iter().all(|&n| n > 0),
        "a positive number of parts for each of {} intervals, not {parts:?}",
        body.n_levels - 1
    );
    let mut origins = Vec::new();
    let mut interval_layer = Vec::new();
    for (i, &n) in parts.iter().enumerate() {
        origins.extend((0..n).map(|k| (i, k as f64 / n as f64)));
        interval_layer.extend(std::iter::repeat_n(body.interval_layer[i], n));
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
        .filter(|&i| parts[origins[i].0] > 1)
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
/// Without vertices.
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

/// Wants intervals of height `h` within `radius` of `depth`, and higher ones outside: by `growth` times the distance
/// beyond. Lengths in metres; for [`parts_for`].
pub fn near_depth(depth: f64, radius: f64, h: f64, growth: f64) -> impl Fn(f64, f64) -> f64 {
    move |top, bottom| {
        let distance = (top - depth).max(depth - bottom).max(0.0);
        h + growth * (distance - radius).max(0.0)
    }
}

/// Into how many parts each interval between levels at `depths` (ascending, m) has to be divided so that none is higher than
/// `wanted` says, given the depths of its top and bottom; and whether that took no more than `max_levels` levels.
/// If not, the parts farthest from what is wanted have been divided first. NaN is no wish.
///
/// ```text
/// let depths = mean_depths(&body, &below_the_tool);
/// let (parts, is_resolved) = parts_for(&depths, near_depth(14e-3, 6e-3, 1e-3, 0.3), 30);
/// let body = split_levels(&body, &parts).body;
/// ```
pub fn parts_for(
    depths: &[f64],
    wanted: impl Fn(f64, f64) -> f64,
    max_levels: usize,
) -> (Vec<usize>, bool) {
    // By how much each interval is too high, when it is not divided.
    let excess: Vec<f64> = depths
        .windows(2)
        .map(|d| (d[1] - d[0]) / wanted(d[0], d[1]))
        .collect();
    let mut parts = vec![1_usize; excess.len()];
    let mut n_levels = depths.len();
    loop {
        let worst = (0..parts.len())
            .map(|i| (i, excess[i] / parts[i] as f64))
            // Rounding must not cost a level.
            .filter(|(_, ratio)| *ratio > 1.0 + 1e-9)
            .max_by(|a, b| a.1.total_cmp(&b.1));
        let Some((i, _)) = worst else {
            return (parts, true);
        };
        if n_levels >= max_levels {
            return (parts, false);
        }
        parts[i] += 1;
        n_levels += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vec3;
    use crate::generate::patch::patch;

    #[test]
    fn intervals_near_the_wanted_depth_are_divided_first() {
        let depths = [0.0, 2e-3, 12e-3, 40e-3];
        let wanted = near_depth(8e-3, 2e-3, 2e-3, 0.5);
        let (parts, is_resolved) = parts_for(&depths, &wanted, 100);
        // 2 mm at up to 4 mm above: 4 mm wanted; 28 mm from 4 mm below on: 3 mm.
        assert_eq!((parts, is_resolved), (vec![1, 5, 10], true));
        let (parts, is_resolved) = parts_for(&depths, &wanted, 8);
        assert_eq!((parts.iter().sum::<usize>(), is_resolved), (7, false));
        assert!(parts_for(&depths, |_, _| f64::NAN, 100).1);
        assert!(!parts_for(&depths, |_, _| 0.0, 100).1);
    }

    #[test]
    fn parts_are_equal_and_keep_their_layer() {
        let body = patch(3, 3, 0.01, &[0.0, 0.01, 0.03], &[0, 1]);
        let split = split_levels(&body, &[1, 4]);
        assert_eq!(split.body.interval_layer, [0, 1, 1, 1, 1]);
        assert_eq!(split.n_invalid, 0);
        let depths = mean_depths(&split.body, &[0, 4]);
        for (depth, expected) in depths.iter().zip([0.0, 0.01, 0.015, 0.02, 0.025, 0.03]) {
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
