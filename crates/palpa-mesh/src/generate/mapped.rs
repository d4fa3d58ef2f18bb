//! A grid of triangles mapped into space by a formula: Cook's trapezoid, a quarter of a ring, a
//! plain block.

use super::levels::LevelStack;
use super::random::Random;
use crate::{CutFace, LayeredBody, Surface, Vec3};

/// Which diagonal cuts each cell of a grid into two triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Diagonal {
    /// From the corner with the smallest (u, v) to the corner with the largest.
    Right,
    /// The other diagonal.
    Left,
    /// Alternating, as on a chessboard.
    Alternate,
    /// Random, from this seed.
    Random(u64),
}

/// A grid over the unit square.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Grid {
    /// Number of cells along u and v.
    pub n_cells: [usize; 2],
    /// The diagonals of the cells.
    pub diagonal: Diagonal,
    /// Moves the inner vertices at random, from this seed, by up to a quarter of a cell in u and v.
    pub jitter: Option<u64>,
}

/// The body whose skin is the grid. `map` takes (u, v) in the unit square to a point in space.
/// Columns are straight, towards −z.
///
/// In a grid of m × n cells, vertex (i, j) has the index `j (m + 1) + i` and lies at u = i / m, v =
/// j / n. Cut faces are the sides in the order u = 0, u = 1, v = 0, v = 1. A side that the map
/// leaves straight is a flat cut face. A corner belongs to two faces.
///
/// # Panics
/// If there are no cells or no levels, or if the map turns a triangle over (seen from +z).
pub fn mapped_grid(
    grid: &Grid,
    map: impl Fn(f64, f64) -> Vec3,
    levels: &LevelStack,
) -> LayeredBody {
    let [nu, nv] = grid.n_cells;
    assert!(nu > 0 && nv > 0, "a grid of {nu} × {nv} cells");
    let mut moves = grid.jitter.map(Random::new);
    let mut skin = Surface::default();
    for j in 0..=nv {
        for i in 0..=nu {
            let mut at = [i as f64, j as f64];
            let is_inner = i > 0 && i < nu && j > 0 && j < nv;
            if let Some(random) = moves.as_mut().filter(|_| is_inner) {
                at = at.map(|x| x + 0.25 * random.both_ways());
            }
            skin.points.push(map(at[0] / nu as f64, at[1] / nv as f64));
        }
    }
    let vertex = |i: usize, j: usize| (j * (nu + 1) + i) as u32;
    let mut coins = match grid.diagonal {
        Diagonal::Random(seed) => Some(Random::new(seed)),
        _ => None,
    };
    for j in 0..nv {
        for i in 0..nu {
            let [a, b] = [vertex(i, j), vertex(i + 1, j)];
            let [c, d] = [vertex(i + 1, j + 1), vertex(i, j + 1)];
            let is_right = match grid.diagonal {
                Diagonal::Right => true,
                Diagonal::Left => false,
                Diagonal::Alternate => (i + j) % 2 == 0,
                Diagonal::Random(_) => coins.as_mut().is_some_and(Random::coin),
            };
            skin.triangles.extend(if is_right {
                [[a, b, c], [a, c, d]]
            } else {
                [[a, b, d], [b, c, d]]
            });
        }
    }
    for t in 0..skin.triangles.len() {
        assert!(
            skin.area_vector(t).z > 0.0,
            "the map turns triangle {t} over or flattens it"
        );
    }
    let along_u = |j: usize| (0..=nu).map(|i| vertex(i, j)).collect::<Vec<u32>>();
    let along_v = |i: usize| (0..=nv).map(|j| vertex(i, j)).collect::<Vec<u32>>();
    let cut_faces = vec![
        side(&skin, along_v(0), -1.0),
        side(&skin, along_v(nu), 1.0),
        side(&skin, along_u(0), 1.0),
        side(&skin, along_u(nv), -1.0),
    ];
    levels.below(skin, cut_faces)
}

/// The face below a run of rim vertices. `turn` is 1 if the body lies to the left of the run, as
/// seen from +z.
fn side(skin: &Surface, vertices: Vec<u32>, turn: f64) -> CutFace {
    let points: Vec<Vec3> = vertices.iter().map(|&v| skin.points[v as usize]).collect();
    let along = points[points.len() - 1] - points[0];
    let normal = Vec3::new(along.y, -along.x, 0.0).normalize() * turn;
    let strays = |p: &Vec3| (p - points[0]).dot(&normal).abs() > 1e-12 * along.norm();
    CutFace {
        is_flat: !points.iter().any(strays),
        point: points[points.len() / 2],
        normal,
        vertices,
    }
}
