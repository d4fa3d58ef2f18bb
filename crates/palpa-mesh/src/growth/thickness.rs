//! Thickness of a layer as a function of the skin point.

use rstar::{RTree, primitives::GeomWithData};

use crate::Vec3;

/// Thickness of a layer at any point of the skin, in metres.
#[derive(Debug, Clone)]
pub enum Thickness {
    /// The same everywhere.
    Constant(f64),
    /// A table along an axis: linear between its rows, constant beyond them.
    AlongAxis {
        /// Direction along which positions are measured (of any length except zero).
        axis: Vec3,
        /// Rows `(position along the axis, thickness)` with ascending positions; at least one row.
        /// m
        table: Vec<[f64; 2]>,
    },
    /// Measured at scattered points. Between them, the inverse-distance weighted mean of the
    /// nearest four.
    Scattered(ScatteredThickness),
}

/// Samples of a thickness at points. Built once, then evaluated at every vertex.
#[derive(Debug, Clone)]
pub struct ScatteredThickness {
    tree: RTree<GeomWithData<[f64; 3], f64>>,
}

/// Number of samples that are averaged at one point.
const N_NEAREST: usize = 4;

impl ScatteredThickness {
    /// Prepares samples `(point, thickness)`. Returns `None` if there are none, or if one is not
    /// finite.
    pub fn build(samples: &[(Vec3, f64)]) -> Option<Self> {
        let is_finite = |(p, d): &(Vec3, f64)| d.is_finite() && p.iter().all(|x| x.is_finite());
        if samples.is_empty() || !samples.iter().all(is_finite) {
            return None;
        }
        let points = samples
            .iter()
            .map(|&(p, d)| GeomWithData::new(p.into(), d))
            .collect();
        Some(Self {
            tree: RTree::bulk_load(points),
        })
    }

    fn at(&self, p: Vec3) -> f64 {
        let (mut sum, mut weights) = (0.0, 0.0);
        for (sample, distance_sq) in self
            .tree
            .nearest_neighbor_iter_with_distance_2(p.into())
            .take(N_NEAREST)
        {
            if distance_sq == 0.0 {
                return sample.data;
            }
            sum += sample.data / distance_sq;
            weights += 1.0 / distance_sq;
        }
        sum / weights
    }
}

impl Thickness {
    /// Thickness below the skin point `p`, in metres.
    pub fn at(&self, p: Vec3) -> f64 {
        match self {
            Self::Constant(d) => *d,
            Self::AlongAxis { axis, table } => interpolate(table, p.dot(&axis.normalize())),
            Self::Scattered(samples) => samples.at(p),
        }
    }
}

/// Interpolates linearly in a table of ascending `[x, y]` rows; constant beyond its ends.
fn interpolate(table: &[[f64; 2]], x: f64) -> f64 {
    let above = table.partition_point(|row| row[0] <= x);
    match (above.checked_sub(1).map(|i| table[i]), table.get(above)) {
        (Some([x0, y0]), Some(&[x1, y1])) => y0 + (y1 - y0) * (x - x0) / (x1 - x0),
        (Some([_, y]), None) | (None, Some(&[_, y])) => y,
        (None, None) => f64::NAN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_linear_inside_and_constant_beyond() {
        let field = Thickness::AlongAxis {
            axis: Vec3::new(2.0, 0.0, 0.0),
            table: vec![[0.1, 0.001], [0.2, 0.003]],
        };
        for (x, want) in [
            (0.0, 0.001),
            (0.1, 0.001),
            (0.15, 0.002),
            (0.2, 0.003),
            (9.0, 0.003),
        ] {
            assert!(
                (field.at(Vec3::new(x, 5.0, 5.0)) - want).abs() < 1e-15,
                "at {x}"
            );
        }
    }

    #[test]
    fn samples_are_met_and_mixed_within_their_range() {
        let samples: Vec<(Vec3, f64)> = (0..10)
            .map(|i| (Vec3::new(f64::from(i), 0.0, 0.0), f64::from(i)))
            .collect();
        let field = Thickness::Scattered(ScatteredThickness::build(&samples).unwrap());
        assert!((field.at(Vec3::new(3.0, 0.0, 0.0)) - 3.0).abs() < 1e-15);
        let between = field.at(Vec3::new(3.5, 0.0, 0.0));
        assert!((between - 3.5).abs() < 1e-12, "{between}");
        assert!(ScatteredThickness::build(&[]).is_none());
    }
}
