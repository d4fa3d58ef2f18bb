//! Small dense systems.

/// A pivot below this share of the largest entry of the matrix counts as zero.
const LEAST_PIVOT: f64 = 1e-12;

/// Factors a dense matrix, row by row, in place, with row exchanges in `order`. Returns false if it is
/// singular.
pub(super) fn factor(n: usize, matrix: &mut [f64], order: &mut [usize]) -> bool {
    let size = matrix[..n * n].iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    for k in 0..n {
        let at = |r: usize| matrix[r * n + k].abs();
        let pivot = (k..n).max_by(|&a, &b| at(a).total_cmp(&at(b))).unwrap_or(k);
        let largest = at(pivot);
        if largest.is_nan() || largest <= LEAST_PIVOT * size {
            return false;
        }
        order[k] = pivot;
        if pivot != k {
            for c in 0..n {
                matrix.swap(k * n + c, pivot * n + c);
            }
        }
        let (above, below) = matrix.split_at_mut((k + 1) * n);
        let row = &above[k * n + k..(k + 1) * n];
        for other in below.chunks_mut(n).take(n - k - 1) {
            let share = other[k] / row[0];
            other[k] = share;
            if share != 0.0 {
                for (x, y) in other[k + 1..].iter_mut().zip(&row[1..]) {
                    *x -= share * y;
                }
            }
        }
    }
    true
}

/// Solves with the factor of [`factor`]; the solution replaces the right side.
pub(super) fn solve(n: usize, matrix: &[f64], order: &[usize], right: &mut [f64]) {
    for (k, &pivot) in order.iter().enumerate().take(n) {
        right.swap(k, pivot);
    }
    for r in 0..n {
        let row = &matrix[r * n..r * n + r];
        let sum: f64 = row.iter().zip(&*right).map(|(a, x)| a * x).sum();
        right[r] -= sum;
    }
    for r in (0..n).rev() {
        let row = &matrix[r * n + r + 1..(r + 1) * n];
        let sum: f64 = row.iter().zip(&right[r + 1..n]).map(|(a, x)| a * x).sum();
        right[r] = (right[r] - sum) / matrix[r * n + r];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_system_with_a_zero_pivot_is_solved_and_a_singular_one_refused() {
        let a = [0.0, 2.0, 1.0, 1.0, 1.0, 0.0, 3.0, 0.0, -1.0];
        let mut matrix = a;
        let (mut order, mut x) = ([0; 3], [1.0, 2.0, 3.0]);
        assert!(factor(3, &mut matrix, &mut order));
        solve(3, &matrix, &order, &mut x);
        for r in 0..3 {
            let sum: f64 = (0..3).map(|c| a[3 * r + c] * x[c]).sum();
            assert!((sum - [1.0, 2.0, 3.0][r]).abs() < 1e-12);
        }
        assert!(!factor(2, &mut [1.0, 2.0, 2.0, 4.0], &mut [0; 2]));
    }
}
