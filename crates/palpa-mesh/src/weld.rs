//! Welding: vertices at the same place become one vertex.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use crate::{Surface, Vec3};

/// A welded surface, and the new index of each old vertex.
#[derive(Debug, Clone, PartialEq)]
pub struct Welded {
    /// The surface with one vertex per place. Triangles keep their order; some may be degenerate
    /// now.
    pub surface: Surface,
    /// The new index of each old vertex. `[n_vertices before]`
    pub new_index: Vec<u32>,
}

/// Merges vertices with exactly the same coordinates. The first of them keeps its place in the
/// order.
///
/// Vertices that are not finite are not merged, because their places are unknown.
pub fn weld_exact(surface: &Surface) -> Welded {
    let mut seen: HashMap<[u64; 3], u32> = HashMap::with_capacity(surface.points.len());
    weld(surface, |p, candidate, _| {
        at_same_place(&mut seen, p, candidate)
    })
}

/// The index of the point with exactly these coordinates. If there is none, records `candidate` for
/// them and returns `None`.
fn at_same_place(seen: &mut HashMap<[u64; 3], u32>, p: &Vec3, candidate: u32) -> Option<u32> {
    match seen.entry(exact_key(p)) {
        Entry::Occupied(entry) => Some(*entry.get()),
        Entry::Vacant(entry) => {
            entry.insert(candidate);
            None
        }
    }
}

/// Largest distance from the origin, in tolerances, at which points are sorted into cells. Beyond
/// it, an `f64` cannot represent neighbouring whole numbers.
const END_OF_GRID: f64 = 9007199254740992.0;

/// Merges each vertex with the first vertex within `tolerance` of it (in the unit of the points).
/// The first vertex stays where it is. So no vertex moves by more than the tolerance, even in a
/// chain of close vertices, and the remaining vertices are further apart than the tolerance.
pub fn weld_within(surface: &Surface, tolerance: f64) -> Welded {
    if tolerance.is_nan() || tolerance <= 0.0 {
        return weld_exact(surface);
    }
    // Cells of two tolerances: all points within the tolerance lie in this cell or one of its 26
    // neighbours, even if the division is off by half a cell.
    let cell_of = |p: &Vec3| p.map(|x| (x / tolerance / 2.0).floor() as i64);
    let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::with_capacity(surface.points.len());
    let mut far: HashMap<[u64; 3], u32> = HashMap::new();
    weld(surface, |p, candidate, kept| {
        // So far out, the tolerance is finer than the spacing of `f64`, and all points would fall
        // into the last cell.
        if p.amax() / tolerance > END_OF_GRID {
            return at_same_place(&mut far, p, candidate);
        }
        let cell = cell_of(p);
        let is_near = |&v: &u32| (kept[v as usize] - p).norm() <= tolerance;
        let near = (0..27)
            .filter_map(|i| {
                let offset = [i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1];
                let key = std::array::from_fn(|k| cell[k].saturating_add(offset[k]));
                cells.get(&key)?.iter().copied().find(is_near)
            })
            .min();
        if near.is_none() {
            cells.entry(cell.into()).or_default().push(candidate);
        }
        near
    })
}

/// Visits the points in order. Keeps a point if
/// `find(point, its index if kept, points kept so far)` returns `None`.
fn weld(surface: &Surface, mut find: impl FnMut(&Vec3, u32, &[Vec3]) -> Option<u32>) -> Welded {
    let mut points: Vec<Vec3> = Vec::new();
    let new_index: Vec<u32> = surface
        .points
        .iter()
        .map(|p| {
            let candidate = points.len() as u32;
            let is_finite = p.iter().all(|x| x.is_finite());
            let known = is_finite.then(|| find(p, candidate, &points)).flatten();
            known.unwrap_or_else(|| {
                points.push(*p);
                candidate
            })
        })
        .collect();
    let triangles = surface
        .triangles
        .iter()
        .map(|t| t.map(|v| new_index[v as usize]))
        .collect();
    Welded {
        surface: Surface { points, triangles },
        new_index,
    }
}

/// The bits of the coordinates; −0 counts as 0.
fn exact_key(p: &Vec3) -> [u64; 3] {
    [p.x, p.y, p.z].map(|x| (x + 0.0).to_bits())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_triangles(gap: f64) -> Surface {
        let at = |x: f64, y: f64| Vec3::new(x, y, 0.0);
        Surface {
            points: vec![
                at(0.0, 0.0),
                at(1.0, 0.0),
                at(0.0, 1.0),
                at(1.0, gap),
                at(1.0, 1.0),
                at(gap, 1.0),
            ],
            triangles: vec![[0, 1, 2], [3, 4, 5]],
        }
    }

    #[test]
    fn the_first_vertex_stays() {
        let welded = weld_exact(&two_triangles(-0.0));
        assert_eq!(welded.new_index, [0, 1, 2, 1, 3, 2]);
        assert_eq!(welded.surface.triangles, [[0, 1, 2], [1, 3, 2]]);
    }

    #[test]
    fn tolerance_reaches_across_cells_and_no_further() {
        let apart = two_triangles(1e-6);
        assert_eq!(weld_exact(&apart).surface.points.len(), 6);
        assert_eq!(weld_within(&apart, 0.9e-6).surface.points.len(), 6);
        assert_eq!(weld_within(&apart, 1.1e-6).surface.points.len(), 4);
    }

    #[test]
    fn what_is_not_finite_stays_apart() {
        let nan = Vec3::new(f64::NAN, 0.0, 0.0);
        let surface = Surface {
            points: vec![nan, nan, nan],
            triangles: vec![[0, 1, 2]],
        };
        assert_eq!(weld_exact(&surface).new_index, [0, 1, 2]);
        assert_eq!(weld_within(&surface, 1.0).new_index, [0, 1, 2]);
    }

    #[test]
    fn far_points_do_not_crowd_into_one_cell() {
        // Comparing these pair by pair would take 10¹⁰ steps.
        let points = (0..100_000).map(|i| Vec3::new(1e300 + 1e290 * f64::from(i), 0.0, 0.0));
        let surface = Surface {
            points: points.collect(),
            triangles: vec![],
        };
        assert_eq!(weld_within(&surface, 1e-6).surface.points.len(), 100_000);
    }
}
