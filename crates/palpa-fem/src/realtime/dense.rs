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
        right[r] -= dot(row, &right[..r]);
    }
    for r in (0..n).rev() {
        let row = &matrix[r * n + r + 1..(r + 1) * n];
        right[r] = (right[r] - dot(row, &right[r + 1..n])) / matrix[r * n + r];
    }
}

/// Factors a dense symmetric matrix as `LDLᵀ`. `row` is memory for a row. Returns false if a pivot is
/// nearly zero.
pub(super) fn factor_symmetric(
    n: usize,
    entry: impl Fn(usize, usize) -> f64,
    factor: &mut [f64],
    row: &mut [f64],
) -> bool {
    // Row r of the factor holds L D up to the diagonal, then D; `row` holds L.
    for r in 0..n {
        let (before, own) = factor.split_at_mut(r * n);
        let (own, row) = (&mut own[..=r], &mut row[..r]);
        for c in 0..r {
            let other = &before[c * n..=c * n + c];
            let sum = entry(r, c) - dot(&row[..c], &other[..c]);
            own[c] = sum;
            row[c] = sum / other[c];
        }
        let whole = entry(r, r);
        let pivot = whole - dot(row, &own[..r]);
        if pivot.is_nan() || pivot.abs() <= LEAST_PIVOT * whole.abs() {
            return false;
        }
        own[r] = pivot;
    }
    true
}

/// Solves with the factor of [`factor_symmetric`]; the solution replaces the right side.
pub(super) fn solve_symmetric(n: usize, factor: &[f64], right: &mut [f64]) {
    for r in 0..n {
        let row = &factor[r * n..=r * n + r];
        right[r] = (right[r] - dot(&row[..r], &right[..r])) / row[r];
    }
    for r in 0..n {
        right[r] *= factor[r * n + r];
    }
    for r in (0..n).rev() {
        let row = &factor[r * n..=r * n + r];
        let x = right[r] / row[r];
        right[r] = x;
        for (other, entry) in right.iter_mut().zip(&row[..r]) {
            *other -= entry * x;
        }
    }
}

/// The product of two vectors.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Sums of their own, so that they are computed side by side.
    let mut sums = [0.0; 8];
    let (a, b) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = (a.remainder().iter().zip(b.remainder()))
        .map(|(a, b)| a * b)
        .sum();
    for (a, b) in a.zip(b) {
        for k in 0..8 {
            sums[k] += a[k] * b[k];
        }
    }
    sums.iter().sum::<f64>() + rest
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

    #[test]
    fn an_indefinite_symmetric_system_is_solved_and_a_singular_one_refused() {
        const N: usize = 21;
        let a = |r: usize, c: usize| {
            let apart = r.abs_diff(c) as f64;
            let own = if r == 2 { -3.0 } else { 4.0 };
            if r == c {
                own
            } else {
                (apart * 0.9).cos() / (1.0 + apart)
            }
        };
        let expected: [f64; N] = std::array::from_fn(|i| (i as f64).sin());
        let mut x: [f64; N] = std::array::from_fn(|r| (0..N).map(|c| a(r, c) * expected[c]).sum());
        let (mut factor, mut row) = ([0.0; N * N], [0.0; N]);
        assert!(factor_symmetric(N, a, &mut factor, &mut row));
        solve_symmetric(N, &factor, &mut x);
        for (x, expected) in x.iter().zip(expected) {
            assert!((x - expected).abs() < 1e-12, "{x} is not {expected}");
        }
        assert!(!factor_symmetric(
            2,
            |_, _| 1.0,
            &mut [0.0; 4],
            &mut [0.0; 2]
        ));
    }
}
