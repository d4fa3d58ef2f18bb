//! Constraints: which nodes may move, and in which directions.

use nalgebra::Matrix3;
use palpa_mesh::{LayeredBody, Vec3};

use crate::error::SpringError;

/// How nodes are held. A node that is in none of the lists is free.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Constraints {
    /// Nodes that do not move: the rigid base and other fixed nodes.
    pub fixed: Vec<usize>,
    /// Nodes that the device holds. All of them move by the displacement of a step. The thesis has
    /// one such node.
    pub operated: Vec<usize>,
    /// Nodes that stay in a plane, each with the normal of its plane. A node may be listed up to
    /// three times, for a corner of planes. If the node is also fixed or operated, the plane is
    /// ignored.
    pub symmetric: Vec<(usize, Vec3)>,
}

impl Constraints {
    /// The constraints of the thesis: the deepest level fixed, and some nodes held by the device.
    pub fn hold(body: &LayeredBody, operated: impl Into<Vec<usize>>) -> Self {
        Self {
            fixed: (0..body.n_nodes()).filter(|&n| body.is_base(n)).collect(),
            operated: operated.into(),
            symmetric: Vec::new(),
        }
    }
}

/// How a node may move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Role {
    Free,
    Fixed,
    Operated,
}

/// The free directions of a node: the first `n_free` columns of an orthonormal frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Freedom {
    pub(crate) role: Role,
    pub(crate) n_free: usize,
    pub(crate) frame: Matrix3<f64>,
}

impl Freedom {
    /// `v` in the axes of the frame; the first `n_free` entries are in the free directions.
    #[inline]
    pub(crate) fn local(&self, v: &Vec3) -> Vec3 {
        if self.n_free == 3 {
            *v
        } else {
            self.frame.tr_mul(v)
        }
    }

    /// The part of `v` that lies in the node's free directions.
    #[inline]
    pub(crate) fn project(&self, v: &Vec3) -> Vec3 {
        match self.n_free {
            3 => *v,
            0 => Vec3::zeros(),
            n => {
                let free = self.frame.columns(0, n);
                free * free.tr_mul(v)
            }
        }
    }
}

/// Combines the constraints into the free directions of every node.
pub(crate) fn freedoms(
    n_nodes: usize,
    constraints: &Constraints,
) -> Result<Vec<Freedom>, SpringError> {
    let free = Freedom {
        role: Role::Free,
        n_free: 3,
        frame: Matrix3::identity(),
    };
    let mut freedoms = vec![free; n_nodes];
    let check = |what: &'static str, node: usize| {
        (node < n_nodes)
            .then_some(node)
            .ok_or(SpringError::NodeRange {
                what,
                node,
                last: n_nodes.saturating_sub(1),
            })
    };

    for &(node, normal) in &constraints.symmetric {
        let freedom = &mut freedoms[check("a plane of symmetry", node)?];
        let normal = Some(normal)
            .filter(|n| n.iter().all(|x| x.is_finite()))
            .and_then(|n| n.try_normalize(f64::MIN_POSITIVE))
            .ok_or(SpringError::Normal { node })?;
        *freedom = without_direction(freedom, normal);
    }
    for &node in &constraints.fixed {
        freedoms[check("a fixed node", node)?] = Freedom {
            role: Role::Fixed,
            n_free: 0,
            ..free
        };
    }
    for &node in &constraints.operated {
        let freedom = &mut freedoms[check("an operated node", node)?];
        if freedom.role == Role::Fixed {
            return Err(SpringError::OperatedAndFixed { node });
        }
        *freedom = Freedom {
            role: Role::Operated,
            n_free: 0,
            ..free
        };
    }
    if constraints.operated.is_empty() {
        return Err(SpringError::NothingOperated);
    }
    Ok(freedoms)
}

/// Removes one direction from a node's freedom.
fn without_direction(freedom: &Freedom, normal: Vec3) -> Freedom {
    // Planes whose directions differ by less than this count as one plane.
    const SAME_PLANE: f64 = 1e-6;
    let taken = freedom.project(&normal);
    let Some(taken) = taken.try_normalize(SAME_PLANE) else {
        return *freedom;
    };
    // Gram–Schmidt: first the remaining free directions, then the ones taken away.
    let n_free = freedom.n_free - 1;
    let mut columns: Vec<Vec3> = Vec::with_capacity(3);
    let old = (0..3).map(|i| freedom.frame.column(i).into_owned());
    let left = (0..freedom.n_free).map(|i| {
        let d = freedom.frame.column(i).into_owned();
        d - taken * taken.dot(&d)
    });
    let mut candidates: Vec<Vec3> = left.collect();
    // The longest vector first, so that the basis is well conditioned.
    candidates.sort_by(|a, b| b.norm_squared().total_cmp(&a.norm_squared()));
    for d in candidates {
        if columns.len() == n_free {
            break;
        }
        let rest = columns.iter().fold(d, |d, c| d - *c * c.dot(&d));
        columns.extend(rest.try_normalize(SAME_PLANE));
    }
    columns.push(taken);
    columns.extend(old.skip(freedom.n_free));
    Freedom {
        role: Role::Free,
        n_free,
        frame: Matrix3::from_columns(&columns),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn freedom_of(normals: &[Vec3]) -> Freedom {
        let constraints = Constraints {
            operated: vec![1],
            symmetric: normals.iter().map(|n| (0, *n)).collect(),
            ..Constraints::default()
        };
        freedoms(2, &constraints).unwrap()[0]
    }

    #[test]
    fn planes_take_directions_away() {
        let normals = [
            Vec3::new(1.0, 2.0, -0.5),
            Vec3::new(0.0, 1.0, 0.3),
            Vec3::new(-1.0, 0.1, 4.0),
        ];
        for n in 0..=3 {
            let freedom = freedom_of(&normals[..n]);
            assert_eq!(freedom.n_free, 3 - n);
            let gram = freedom.frame.tr_mul(&freedom.frame);
            assert!((gram - Matrix3::identity()).norm() < 1e-12);
            for normal in &normals[..n] {
                for i in 0..freedom.n_free {
                    assert!(freedom.frame.column(i).dot(normal).abs() < 1e-12);
                }
            }
        }
        let twice = freedom_of(&[normals[0], normals[0] * -3.0]);
        assert_eq!(twice.n_free, 2, "the same plane twice is one plane");
    }

    #[test]
    fn contradictions_are_refused() {
        let both = Constraints {
            fixed: vec![1],
            operated: vec![1],
            ..Constraints::default()
        };
        assert_eq!(
            freedoms(2, &both),
            Err(SpringError::OperatedAndFixed { node: 1 })
        );
        assert_eq!(
            freedoms(2, &Constraints::default()),
            Err(SpringError::NothingOperated)
        );
        let flat = Constraints {
            operated: vec![0],
            symmetric: vec![(1, Vec3::new(f64::NAN, 0.0, 0.0))],
            ..Constraints::default()
        };
        assert_eq!(freedoms(2, &flat), Err(SpringError::Normal { node: 1 }));
    }
}
