//! Carries displacements from one mesh of a body to another.

use palpa_mesh::{LayeredBody, SurfaceIndex, Vec3};

/// The displacements of the nodes of `to`, m, for those of `from`: interpolated between columns by the
/// skin at rest, and along columns by the share of the layer that lies above. Both are meshes of the
/// same layers. `[to.n_nodes()]`
pub(super) fn carried(from: &LayeredBody, moves: &[Vec3], to: &LayeredBody) -> Vec<Vec3> {
    let index = SurfaceIndex::build(&from.skin);
    let places: Vec<Vec<f64>> = (0..from.n_vertices()).map(|v| places(from, v)).collect();
    let mut found = Vec::with_capacity(to.n_nodes());
    for (v, at) in to.skin.points.iter().enumerate() {
        let Some(closest) = index.closest(*at) else {
            return vec![Vec3::zeros(); to.n_nodes()];
        };
        let corners = from.skin.triangles[closest.triangle as usize].map(|corner| corner as usize);
        for place in self::places(to, v) {
            let of_corners = corners.iter().zip(closest.weights);
            let parts = of_corners.map(|(&corner, weight)| {
                let first = from.node(corner, 0);
                let of_column = &moves[first..first + from.n_levels];
                weight * between(&places[corner], of_column, place)
            });
            found.push(parts.sum());
        }
    }
    found
}

/// Where the nodes of a column lie: the number of layers above, and the share of the next one.
/// `[n_levels]`
fn places(body: &LayeredBody, v: usize) -> Vec<f64> {
    let first = body.node(v, 0);
    let column = &body.positions[first..first + body.n_levels];
    let heights: Vec<f64> = (column.windows(2))
        .map(|ends| (ends[1] - ends[0]).norm())
        .collect();
    let layers = &body.interval_layer;
    let mut of_layer = vec![0.0; layers.last().map_or(0, |last| last + 1)];
    for (layer, height) in layers.iter().zip(&heights) {
        of_layer[*layer] += height;
    }
    let mut place = 0.0;
    let mut all = vec![place];
    for (i, (layer, height)) in layers.iter().zip(&heights).enumerate() {
        place += height / of_layer[*layer];
        if layers.get(i + 1) != Some(layer) {
            place = (layer + 1) as f64;
        }
        all.push(place);
    }
    all
}

/// The value at a place between ascending ones.
fn between(places: &[f64], values: &[Vec3], place: f64) -> Vec3 {
    let next = places.partition_point(|p| *p < place);
    match (next.checked_sub(1), values.get(next)) {
        (Some(last), Some(after)) => {
            let share = (place - places[last]) / (places[next] - places[last]);
            values[last].lerp(after, share)
        }
        (None, Some(first)) => *first,
        (_, None) => values.last().copied().unwrap_or_default(),
    }
}

#[cfg(test)]
mod tests {
    use palpa_mesh::Surface;

    use super::*;

    /// Two layers of 1 and 3 mm under a square; each has these numbers of intervals.
    fn body(n: usize, intervals: [usize; 2]) -> LayeredBody {
        let at = |i: usize| 10e-3 * i as f64 / n as f64;
        let points: Vec<Vec3> = (0..=n)
            .flat_map(|i| (0..=n).map(move |j| Vec3::new(at(i), at(j), 0.0)))
            .collect();
        let triangles = (0..n).flat_map(|i| {
            (0..n).flat_map(move |j| {
                let a = (i * (n + 1) + j) as u32;
                let (b, c) = (a + n as u32 + 1, a + 1);
                [[a, b, c], [b, b + 1, c]]
            })
        });
        let [upper, lower] = intervals.map(|n| n as f64);
        let depths: Vec<f64> = std::iter::once(0.0)
            .chain((1..=intervals[0]).map(|i| 1e-3 * i as f64 / upper))
            .chain((1..=intervals[1]).map(|i| 1e-3 + 3e-3 * i as f64 / lower))
            .collect();
        LayeredBody {
            positions: (points.iter())
                .flat_map(|p| depths.iter().map(move |z| p - Vec3::z() * *z))
                .collect(),
            skin: Surface {
                triangles: triangles.collect(),
                points,
            },
            n_levels: depths.len(),
            interval_layer: [vec![0; intervals[0]], vec![1; intervals[1]]].concat(),
            layer_names: vec!["upper".into(), "lower".into()],
            cut_faces: Vec::new(),
        }
    }

    #[test]
    fn a_field_that_is_linear_in_each_layer_is_carried_exactly_between_meshes() {
        let field = |p: &Vec3| Vec3::new(0.2 * p.x - p.y, p.z.max(-1e-3), 0.5 * p.z + 0.1 * p.x);
        let values = |body: &LayeredBody| body.positions.iter().map(field).collect::<Vec<_>>();
        let meshes = [(2, [1, 2]), (5, [2, 3]), (3, [1, 1])].map(|(n, i)| body(n, i));
        for from in &meshes {
            for to in &meshes {
                let found = carried(from, &values(from), to);
                assert_eq!(found.len(), to.n_nodes());
                for (found, expected) in found.iter().zip(values(to)) {
                    assert!((found - expected).norm() < 1e-12, "{found} {expected}");
                }
            }
        }
    }
}
