//! Bars from Young's modulus: what a block of them shows.

use palpa_mesh::generate::patch::patch;
use palpa_mesh::{LayeredBody, Vec3};
use palpa_springs::{
    Constraints, Corrections, LayerStiffness, SpringModel, SpringParams, StepParams,
};

use crate::pushed;

const MODULUS: f64 = 10.0e3;
const N: usize = 7;
const SPACING: f64 = 0.01;

/// A block of 7 × 7 columns and as many intervals as there are moduli, its columns moved sideways
/// by up to `jitter` spacings (those on the rim along it).
fn block(n_intervals: usize, height: f64, jitter: f64) -> LayeredBody {
    let depths: Vec<f64> = (0..=n_intervals).map(|l| height * l as f64).collect();
    let layers: Vec<usize> = (0..n_intervals).collect();
    let mut body = patch(N, N, SPACING, &depths, &layers);
    for v in 0..body.n_vertices() {
        let (i, j) = (v % N, v / N);
        let [x, y] = [1.7, 2.9].map(|f| jitter * SPACING * (f * v as f64).sin());
        let x = if i == 0 || i == N - 1 { 0.0 } else { x };
        let y = if j == 0 || j == N - 1 { 0.0 } else { y };
        body.skin.points[v] += Vec3::new(x, y, 0.0);
        for l in 0..body.n_levels {
            let node = body.node(v, l);
            body.positions[node] += Vec3::new(x, y, 0.0);
        }
    }
    body
}

/// Presses a block between smooth plates (the upper one holds it sideways) and returns its apparent
/// modulus. Its sides are planes of symmetry (`confined`) or free.
fn apparent_modulus(body: &LayeredBody, moduli: &[f64], confined: bool) -> f64 {
    let mut constraints = Constraints::default();
    for (v, p) in body.skin.points.iter().enumerate() {
        for l in 0..body.n_levels {
            let node = body.node(v, l);
            if l == 0 {
                constraints.operated.push(node);
            }
            if body.is_base(node) {
                constraints.symmetric.push((node, Vec3::z()));
            }
            let far = SPACING * (N as f64 - 1.5);
            for (x, normal) in [(p.x, Vec3::x()), (p.y, Vec3::y())] {
                // One side of each pair always stays, or the free block would slide about.
                if x == 0.0 || (confined && x > far) {
                    constraints.symmetric.push((node, normal));
                }
            }
        }
    }
    let stiffnesses = moduli
        .iter()
        .map(|&modulus| LayerStiffness::Young { modulus });
    let params = SpringParams::new(stiffnesses.collect::<Vec<_>>());
    let model = SpringModel::build(body, &params, &constraints).expect("a model");
    let push = -1e-6 * body.positions[body.n_levels - 1].z;
    let step_params = StepParams {
        corrections: Corrections::OFF,
        ..StepParams::default()
    };
    let (state, _) = pushed(&model, Vec3::new(0.0, 0.0, -push), 1, &step_params);
    let area = (SPACING * (N - 1) as f64).powi(2);
    state.force.z / area / 1e-6
}

/// Confined, the block is stiffer by (1 − ν)/((1 + ν)(1 − 2ν)) = 6/5, as an isotropic body with ν =
/// ¼.
#[test]
fn a_confined_block_shows_six_fifths_of_its_modulus_at_any_shape_of_prism() {
    let mut worst = (0.0_f64, 0.0_f64);
    for height in [0.001, 0.003, 0.007, 0.01, 0.03] {
        let error = |jitter| {
            let body = block(4, height, jitter);
            (apparent_modulus(&body, &[MODULUS; 4], true) / MODULUS / 1.2 - 1.0).abs()
        };
        worst = (worst.0.max(error(0.0)), worst.1.max(error(0.25)));
    }
    assert!(worst.0 < 0.02, "regular: {}", worst.0);
    assert!(worst.1 < 0.03, "irregular: {}", worst.1);
}

/// Layers are springs in series: the harmonic mean of their confined moduli.
#[test]
fn a_confined_layered_block_shows_the_harmonic_mean() {
    let moduli = [20.0e3, 3.0e3, 8.0e3, 300.0e3];
    let expected = 1.2 * 4.0 / moduli.iter().map(|e| 1.0 / e).sum::<f64>();
    let apparent = apparent_modulus(&block(4, 0.007, 0.0), &moduli, true);
    assert!(
        (apparent / expected - 1.0).abs() < 0.01,
        "{apparent} for {expected}"
    );
}

/// With free sides (and a top plate that holds them, which stiffens a low block a little) it is
/// near its modulus while its prisms are about as high as wide; in flat ones the bars hardly feel
/// Poisson's ratio, and 6/5 is the limit.
#[test]
fn a_block_with_free_sides_shows_its_modulus_if_its_prisms_are_not_flat() {
    for (height, n, within) in [
        (0.003, 40, 0.2),
        (0.007, 17, 0.1),
        (0.01, 12, 0.1),
        (0.02, 6, 0.2),
    ] {
        for jitter in [0.0, 0.25] {
            let body = block(n, height, jitter);
            let ratio = apparent_modulus(&body, &vec![MODULUS; n], false) / MODULUS;
            assert!((ratio - 1.0).abs() < within, "height {height}: {ratio}");
        }
    }
}
