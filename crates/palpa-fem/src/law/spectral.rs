//! Eigenvalues of a symmetric 3 × 3 matrix.

use crate::Mat3;

/// Each sweep squares what is off the diagonal, so that 5 do for any matrix of doubles; more never
/// hurt.
const SWEEPS: usize = 8;

/// Eigenvalues, and eigenvectors as columns, of a symmetric matrix, by Jacobi's rotations: always
/// ends, is exact for a diagonal matrix, and gives orthonormal vectors for equal eigenvalues too.
pub(super) fn eigen(symmetric: &Mat3) -> ([f64; 3], Mat3) {
    let mut a = *symmetric;
    let mut vectors = Mat3::identity();
    for _ in 0..SWEEPS {
        let off = a[(0, 1)].abs() + a[(0, 2)].abs() + a[(1, 2)].abs();
        if off <= 0.1 * f64::EPSILON * a.norm() {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[(p, q)] == 0.0 {
                continue;
            }
            let theta = 0.5 * (a[(q, q)] - a[(p, p)]) / a[(p, q)];
            let theta_sq = theta * theta;
            let tan = theta.signum() / (theta.abs() + (1.0 + theta_sq).sqrt());
            let tan_sq = tan * tan;
            let cos = 1.0 / (1.0 + tan_sq).sqrt();
            let sin = tan * cos;
            let r = 3 - p - q;
            let (app, aqq, apq, arp, arq) = (a[(p, p)], a[(q, q)], a[(p, q)], a[(r, p)], a[(r, q)]);
            a[(p, p)] = app - tan * apq;
            a[(q, q)] = aqq + tan * apq;
            a[(p, q)] = 0.0;
            a[(q, p)] = 0.0;
            a[(r, p)] = cos * arp - sin * arq;
            a[(r, q)] = sin * arp + cos * arq;
            a[(p, r)] = a[(r, p)];
            a[(q, r)] = a[(r, q)];
            for i in 0..3 {
                let (vp, vq) = (vectors[(i, p)], vectors[(i, q)]);
                vectors[(i, p)] = cos * vp - sin * vq;
                vectors[(i, q)] = sin * vp + cos * vq;
            }
        }
    }
    ([a[(0, 0)], a[(1, 1)], a[(2, 2)]], vectors)
}
