//! The stiffness of the bars of a prism from Young's modulus.
//!
//! Let bars have the directions `c_b` and the volumes `V_b = w_b V`, in a prism of volume `V`. They
//! form the tensor (Cox 1952)
//! ```text
//!     C_ijkl = Σ_b W_b c_i c_j c_k c_l,      W_b = k_b L_b² / V      [Pa]
//! ```
//! which is symmetric in all indices. So Poisson's ratio is ¼ (Cauchy) whatever the weights, and
//! isotropy means `C_11 = C_33 = 6/5 E`, `C_13 = C_44 = 2/5 E`. With `s = (c·axis)²` of a diagonal,
//! the three families of bars of a prism, averaged over the azimuth, give
//! ```text
//!                 C_11 (along the layer)   C_33 (across)   C_13 = C_44
//!     in-level         3/8 W_i                 0              0
//!     vertical         0                       W_v            0
//!     diagonal         3/8 W_d (1−s)²          W_d s²         ½ W_d s (1−s)
//! ```
//! These are three equations for three weights. A flat or tall prism would need a negative weight.
//! There, `C_11` and `C_33` are kept and the shear stiffness `C_44` deviates. Derivation and
//! measured figures: `docs/theory/spring_stiffness.md`.

use palpa_mesh::Vec3;
use palpa_mesh::quality::prism_volume;

/// Least share of the in-level bars in `C_11` and of the vertical bars in `C_33`, so that every bar
/// has some stiffness.
const LEAST_SHARE: f64 = 0.05;

/// Stiffness of the 15 bars of one prism, in N/m, in the order of the triangle's sides (0,1),
/// (1,2), (2,0).
pub(crate) struct PrismBars {
    /// Bars in the upper triangle.
    pub(crate) upper: [f64; 3],
    /// Bars in the lower triangle.
    pub(crate) lower: [f64; 3],
    /// Bars at the three corners.
    pub(crate) vertical: [f64; 3],
    /// Bars in each side face: from the first corner above to the second below, then from the
    /// second above to the first below.
    pub(crate) diagonal: [[f64; 2]; 3],
}

/// Distributes the modulus (Pa) of a prism over its bars. `corners` are the upper triangle, then
/// the lower.
pub(crate) fn prism_bar_stiffness(corners: &[Vec3; 6], modulus: f64) -> PrismBars {
    let [a, b, c, d, e, f] = corners;
    let axis = ((a - d) + (b - e) + (c - f))
        .try_normalize(f64::MIN_POSITIVE)
        .unwrap_or_else(Vec3::z);
    let volume = prism_volume(corners);

    let diagonal = |s: usize| {
        let t = (s + 1) % 3;
        [corners[s] - corners[t + 3], corners[t] - corners[s + 3]]
    };
    let (mut c2, mut s2, mut sc) = (0.0, 0.0, 0.0);
    for bar in (0..3).flat_map(diagonal) {
        let s = bar.dot(&axis).powi(2) / bar.norm_squared();
        s2 += s * s / 6.0;
        c2 += (1.0 - s).powi(2) / 6.0;
        sc += s * (1.0 - s) / 6.0;
    }
    let keep = 1.0 - LEAST_SHARE;
    let w_diagonal = (0.8 / sc).min(keep * 3.2 / c2).min(keep * 1.2 / s2);
    let w_vertical = 1.2 - w_diagonal * s2;
    let w_in_level = 3.2 - w_diagonal * c2;

    let share = |weight: f64, n_bars: f64, bar: Vec3| {
        modulus * weight * volume / (n_bars * bar.norm_squared())
    };
    let side = |s: usize, level: usize| corners[3 * level + (s + 1) % 3] - corners[3 * level + s];
    PrismBars {
        upper: [0, 1, 2].map(|s| share(w_in_level, 6.0, side(s, 0))),
        lower: [0, 1, 2].map(|s| share(w_in_level, 6.0, side(s, 1))),
        vertical: [0, 1, 2].map(|s| share(w_vertical, 3.0, corners[s] - corners[s + 3])),
        diagonal: [0, 1, 2].map(|s| diagonal(s).map(|bar| share(w_diagonal, 6.0, bar))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn prism(side: f64, height: f64) -> [Vec3; 6] {
        let top = [
            Vec3::zeros(),
            Vec3::x() * side,
            Vec3::new(0.5, 0.75_f64.sqrt(), 0.0) * side,
        ];
        let down = Vec3::z() * height;
        [
            top[0],
            top[1],
            top[2],
            top[0] - down,
            top[1] - down,
            top[2] - down,
        ]
    }

    #[test]
    fn volume_of_a_right_prism() {
        let volume = prism_volume(&prism(2.0, 3.0));
        assert!((volume - 3.0 * 3.0_f64.sqrt()).abs() < 1e-12);
    }

    /// Energy of a homogeneous strain: `½ Σ k L² (c·ε c)² / V` over the bars.
    fn energy_density(corners: &[Vec3; 6], strain: nalgebra::Matrix3<f64>) -> f64 {
        let bars = prism_bar_stiffness(corners, 1.0);
        let mut energy = 0.0;
        let mut add = |k: f64, d: Vec3| {
            energy += 0.5 * k * d.dot(&(strain * d)).powi(2) / d.norm_squared();
        };
        for s in 0..3 {
            let t = (s + 1) % 3;
            add(bars.upper[s], corners[t] - corners[s]);
            add(bars.lower[s], corners[t + 3] - corners[s + 3]);
            add(bars.vertical[s], corners[s + 3] - corners[s]);
            add(bars.diagonal[s][0], corners[t + 3] - corners[s]);
            add(bars.diagonal[s][1], corners[s + 3] - corners[t]);
        }
        energy / prism_volume(corners)
    }

    #[test]
    fn a_well_shaped_prism_is_isotropic_and_any_keeps_its_two_moduli() {
        let stretch = |v: Vec3| v * v.transpose();
        for ratio in [0.1, 0.3, 0.6, 0.8, 1.0, 1.15, 2.0, 5.0] {
            let corners = prism(1.0, ratio);
            let c33 = 2.0 * energy_density(&corners, stretch(Vec3::z()));
            let c11 = 2.0 * energy_density(&corners, stretch(Vec3::x()));
            let shear = Vec3::x() * Vec3::z().transpose();
            let c44 = 2.0 * energy_density(&corners, (shear + shear.transpose()) * 0.5);
            assert!((c33 - 1.2).abs() < 1e-12, "{ratio}: C33 = {c33}");
            assert!((c11 - 1.2).abs() < 1e-12, "{ratio}: C11 = {c11}");
            if (0.55..1.2).contains(&ratio) {
                assert!((c44 - 0.4).abs() < 1e-12, "{ratio}: C44 = {c44}");
            } else {
                assert!(c44 > 0.0 && c44 < 0.4, "{ratio}: C44 = {c44}");
            }
        }
    }
}
