//! Levels of bodies made by formula: depths and layers, with finer intervals at the top of each
//! layer.

use crate::{CutFace, LayeredBody, Surface, Vec3};

/// One layer of a [`LevelStack`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GradedLayer {
    /// Thickness. m
    pub thickness: f64,
    /// Wanted height of the layer's uppermost interval. m
    pub first_height: f64,
    /// Relative increase of the height from each interval to the next one below (0: all equal).
    pub growth: f64,
}

/// Depths of the levels, the same in every column, from the skin down.
#[derive(Debug, Clone, PartialEq)]
pub struct LevelStack {
    /// Depth of each level below the skin, ascending from 0. m, `[n_levels]`
    pub depths: Vec<f64>,
    /// The layer of each interval, ascending. `[n_levels − 1]`
    pub interval_layer: Vec<usize>,
}

impl LevelStack {
    /// Levels whose intervals grow downwards in each layer, as wanted.
    ///
    /// Every border between layers is a level. The number of intervals in a layer is chosen so that
    /// their heights need the least stretching or shrinking to fill the layer.
    ///
    /// # Panics
    /// Unless thicknesses and heights are positive and finite, growth is not negative, and a layer
    /// needs at most 1,000 intervals.
    pub fn graded(layers: &[GradedLayer]) -> Self {
        let mut stack = Self {
            depths: vec![0.0],
            interval_layer: Vec::new(),
        };
        let mut top = 0.0;
        for (layer, graded) in layers.iter().enumerate() {
            let heights = heights(graded);
            let mut depth = top;
            for height in &heights {
                depth += height;
                stack.depths.push(depth);
                stack.interval_layer.push(layer);
            }
            top += graded.thickness;
            // The sum of the heights equals the thickness only up to rounding. The border must be
            // exact.
            *stack.depths.last_mut().expect("it starts with the skin") = top;
        }
        stack
    }

    /// The same levels with every interval cut in half, for example for a convergence study.
    #[must_use]
    pub fn halved(&self) -> Self {
        let mut depths = vec![self.depths[0]];
        for d in self.depths.windows(2) {
            depths.extend([0.5 * (d[0] + d[1]), d[1]]);
        }
        Self {
            depths,
            interval_layer: self.interval_layer.iter().flat_map(|&l| [l, l]).collect(),
        }
    }

    /// The body with a straight column towards −z below every point of `skin`. Layers are named
    /// `layer 1`, `layer 2`, …
    ///
    /// # Panics
    /// If depths do not ascend from 0, or if `interval_layer` does not hold one layer per interval,
    /// ascending.
    pub(super) fn below(&self, skin: Surface, cut_faces: Vec<CutFace>) -> LayeredBody {
        let depths = &self.depths;
        assert!(
            depths.len() >= 2 && depths[0] == 0.0 && depths.windows(2).all(|d| d[0] < d[1]),
            "depths must ascend from 0, not {depths:?}"
        );
        assert!(
            self.interval_layer.len() + 1 == depths.len() && self.interval_layer.is_sorted(),
            "one layer per interval, ascending, not {:?}",
            self.interval_layer
        );
        let n_layers = self.interval_layer.last().map_or(0, |last| last + 1);
        LayeredBody {
            positions: skin
                .points
                .iter()
                .flat_map(|p| depths.iter().map(move |depth| p - Vec3::z() * *depth))
                .collect(),
            skin,
            n_levels: depths.len(),
            interval_layer: self.interval_layer.clone(),
            layer_names: (1..=n_layers).map(|l| format!("layer {l}")).collect(),
            cut_faces,
        }
    }
}

/// Heights of the intervals of one layer; their sum is its thickness.
fn heights(layer: &GradedLayer) -> Vec<f64> {
    let GradedLayer {
        thickness,
        first_height,
        growth,
    } = *layer;
    assert!(
        [thickness, first_height]
            .iter()
            .all(|x| *x > 0.0 && x.is_finite())
            && growth >= 0.0,
        "a layer needs a positive thickness and height and growth that is not negative, not {layer:?}"
    );
    let mut wanted = vec![first_height];
    let mut sum = first_height;
    while sum < thickness {
        let next = wanted[wanted.len() - 1] * (1.0 + growth);
        // Without or with the next interval: whichever needs less stretching.
        if (sum + next) * sum > thickness * thickness {
            break;
        }
        sum += next;
        wanted.push(next);
        assert!(wanted.len() <= 1000, "{layer:?} needs over 1,000 intervals");
    }
    wanted.iter().map(|h| h * thickness / sum).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layer(thickness: f64, first_height: f64, growth: f64) -> GradedLayer {
        GradedLayer {
            thickness,
            first_height,
            growth,
        }
    }

    #[test]
    fn heights_grow_as_wanted_and_fill_their_layers() {
        let stack = LevelStack::graded(&[
            layer(2e-3, 2e-3, 0.0),
            layer(10e-3, 2e-3, 0.3),
            layer(28e-3, 5e-3, 0.5),
        ]);
        assert_eq!(stack.interval_layer, [0, 1, 1, 1, 1, 2, 2, 2]);
        let heights: Vec<f64> = stack.depths.windows(2).map(|d| d[1] - d[0]).collect();
        for (at, ratio) in [(1, 1.3), (2, 1.3), (3, 1.3), (5, 1.5), (6, 1.5)] {
            assert!(
                (heights[at + 1] / heights[at] - ratio).abs() < 1e-12,
                "{heights:?}"
            );
        }
        for (level, depth) in [(0, 0.0), (1, 2e-3), (5, 12e-3), (8, 40e-3)] {
            assert!((stack.depths[level] - depth).abs() < 1e-15);
        }
        assert!((heights[1] / 2e-3 - 1.0).abs() < 0.25 && (heights[5] / 5e-3 - 1.0).abs() < 0.25);
        let halved = stack.halved();
        assert_eq!(halved.depths.len(), 17);
        assert!((halved.depths[10] - stack.depths[5]).abs() < 1e-15);
        assert_eq!(halved.interval_layer[9..11], [1, 2]);
    }

    #[test]
    fn equal_heights_divide_a_layer() {
        assert_eq!(
            LevelStack::graded(&[layer(1.0, 0.26, 0.0)]).depths,
            [0.0, 0.25, 0.5, 0.75, 1.0]
        );
        assert_eq!(
            LevelStack::graded(&[layer(1.0, 5.0, 0.2)]).depths,
            [0.0, 1.0]
        );
    }
}
