//! GMRES, for systems whose factor is only approximate: friction makes the system unsymmetric, or
//! the factor is an older one.

use palpa_mesh::Vec3;

/// The result of a solve.
#[derive(Debug)]
pub(crate) struct Solution {
    /// `x`.
    pub(crate) vector: Vec<Vec3>,
    /// Norm of the residual, relative to that of the right side.
    pub(crate) residual: f64,
}

fn dot(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

fn norm(a: &[Vec3]) -> f64 {
    dot(a, a).sqrt()
}

/// Solves `A x = b` (Saad & Schultz 1986). `apply(r, z, y)` sets `z = M⁻¹ r` with an approximation
/// M of A, and adds `A z` to `y`. Keeping all `z` saves a last `M⁻¹` (Saad 1993). Stops when the
/// relative residual is `tolerance`, when the basis has `most` vectors, or when it would still be
/// above `accepted` with these at the present rate.
pub(crate) fn gmres(
    b: &[Vec3],
    tolerance: f64,
    accepted: f64,
    most: usize,
    mut apply: impl FnMut(&[Vec3], &mut [Vec3], &mut [Vec3]),
) -> Solution {
    let size = norm(b);
    let mut solution = vec![Vec3::zeros(); b.len()];
    if size == 0.0 {
        return Solution {
            vector: solution,
            residual: 0.0,
        };
    }
    let mut basis: Vec<Vec<Vec3>> = vec![b.iter().map(|x| x / size).collect()];
    let mut directions: Vec<Vec<Vec3>> = Vec::new();
    // Columns of the triangular factor, rotations (cosine, sine), and the rotated right side.
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let mut rotations: Vec<(f64, f64)> = Vec::new();
    let mut right = vec![size];
    while columns.len() < most {
        let j = columns.len();
        let mut direction = vec![Vec3::zeros(); b.len()];
        let mut next = vec![Vec3::zeros(); b.len()];
        apply(&basis[j], &mut direction, &mut next);
        directions.push(direction);
        let mut column = Vec::with_capacity(j + 2);
        for vector in &basis {
            let share = dot(&next, vector);
            for (x, v) in next.iter_mut().zip(vector) {
                *x -= v * share;
            }
            column.push(share);
        }
        let rest = norm(&next);
        for (i, &(c, s)) in rotations.iter().enumerate() {
            let (x, y) = (column[i], column[i + 1]);
            column[i] = c * x + s * y;
            column[i + 1] = c * y - s * x;
        }
        let length = column[j].hypot(rest);
        if length == 0.0 || !length.is_finite() {
            break;
        }
        let (c, s) = (column[j] / length, rest / length);
        column[j] = length;
        rotations.push((c, s));
        right.push(-s * right[j]);
        right[j] *= c;
        columns.push(column);
        let residual = right[j + 1].abs() / size;
        // Extrapolates the convergence so far to `most` vectors.
        let is_too_slow =
            3 * (j + 1) >= most && residual.powf(most as f64 / (j + 1) as f64) > accepted;
        if residual <= tolerance || is_too_slow || rest <= f64::EPSILON * length {
            break;
        }
        for x in &mut next {
            *x /= rest;
        }
        basis.push(next);
    }
    // Back substitution.
    let n = columns.len();
    let mut weights = vec![0.0; n];
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|j| columns[j][i] * weights[j]).sum();
        weights[i] = (right[i] - known) / columns[i][i];
    }
    for (direction, weight) in directions.iter().zip(weights) {
        for (x, v) in solution.iter_mut().zip(direction) {
            *x += v * weight;
        }
    }
    Solution {
        vector: solution,
        residual: right[n].abs() / size,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unsymmetric_system_is_solved() {
        // A = I + a bᵀ: exact after two vectors.
        let a: Vec<Vec3> = (0..5).map(|i| Vec3::new(f64::from(i), 1.0, -0.5)).collect();
        let c: Vec<Vec3> = (0..5)
            .map(|i| Vec3::new(0.1, 0.2, 0.05 * f64::from(i)))
            .collect();
        let b: Vec<Vec3> = (0..5).map(|i| Vec3::new(1.0, f64::from(i), 2.0)).collect();
        let apply = |x: &[Vec3]| -> Vec<Vec3> {
            let share = dot(&c, x);
            x.iter().zip(&a).map(|(x, a)| x + a * share).collect()
        };
        // M = 2 I.
        let halved = |x: &[Vec3], half: &mut [Vec3], out: &mut [Vec3]| {
            for (half, x) in half.iter_mut().zip(x) {
                *half = x / 2.0;
            }
            out.copy_from_slice(&apply(half));
        };
        let Solution {
            vector: x,
            residual,
        } = gmres(&b, 1e-12, 1e-12, 40, halved);
        assert!(residual < 1e-12);
        let one = gmres(&b, 1e-12, 1e-12, 1, halved);
        let error: f64 = apply(&x).iter().zip(&b).map(|(x, b)| (x - b).norm()).sum();
        assert!(error < 1e-10, "{error}");
        let left: f64 = apply(&one.vector)
            .iter()
            .zip(&b)
            .map(|(x, b)| (x - b).norm_squared())
            .sum();
        assert!((left.sqrt() / norm(&b) - one.residual).abs() < 1e-12);
    }
}
