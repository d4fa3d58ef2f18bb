//! Laws of the global stiffness `M1`.

use nalgebra::{DVector, SymmetricEigen};
use palpa_mesh::Vec3;
use palpa_springs::{InterfaceBars, Network, SpringError};

use crate::{HARD, SOFT, springs, thesis_body};

/// A network away from its rest shape, so that nothing is aligned with the axes.
fn distorted() -> (Network, Vec<Vec3>) {
    let network =
        Network::from_body(&thesis_body(3, 3), &springs(&[SOFT, HARD])).expect("a network");
    let positions = network
        .positions
        .iter()
        .enumerate()
        .map(|(i, p)| {
            let i = i as f64;
            p + Vec3::new((1.1 * i).sin(), (2.3 * i).cos(), (0.7 * i).sin()) * 0.006
        })
        .collect();
    (network, positions)
}

#[test]
fn bars_are_those_of_the_thesis() {
    // 3 × 3 vertices have 16 edges; 3 levels: 16·3 in level, 9·2 verticals, 16·2·2 diagonals.
    let body = thesis_body(3, 3);
    let network = Network::from_body(&body, &springs(&[SOFT, HARD])).unwrap();
    assert_eq!(network.bars.len(), 48 + 18 + 64);
    let mut pairs: Vec<_> = network
        .bars
        .iter()
        .map(|b| (b.a.min(b.b), b.a.max(b.b)))
        .collect();
    pairs.sort_unstable();
    pairs.dedup();
    assert_eq!(
        pairs.len(),
        network.bars.len(),
        "no pair of nodes is joined twice"
    );
    let level = |node: u32| body.node(0, node as usize % 3);
    for bar in &network.bars {
        let expected = match level(bar.a).min(level(bar.b)) {
            0 => SOFT,
            _ => HARD, // between levels 1 and 2, on the base, and at the interface: of the layer below
        };
        assert!((bar.stiffness - expected).abs() < 1e-15, "{bar:?}");
    }
}

#[test]
fn bars_at_an_interface_follow_the_rule() {
    let body = thesis_body(3, 3);
    for (rule, expected) in [
        (InterfaceBars::Above, SOFT),
        (InterfaceBars::Below, HARD),
        (InterfaceBars::Mean, 0.5 * (SOFT + HARD)),
    ] {
        let mut params = springs(&[SOFT, HARD]);
        params.interface_bars = rule;
        let network = Network::from_body(&body, &params).unwrap();
        let in_level = |l: usize| {
            let bar = network
                .bars
                .iter()
                .find(|bar| bar.a as usize % 3 == l && bar.b as usize % 3 == l);
            bar.unwrap().stiffness
        };
        for (l, expected) in [SOFT, expected, HARD].into_iter().enumerate() {
            assert!(
                (in_level(l) - expected).abs() < 1e-15,
                "{rule:?}, level {l}"
            );
        }
    }
}

#[test]
fn m1_is_symmetric_and_positive_semidefinite_with_the_six_rigid_modes_as_null_space() {
    let (network, positions) = distorted();
    let m1 = network.stiffness_matrix(&positions);
    let scale = m1.amax();
    assert!((&m1 - m1.transpose()).amax() <= 1e-15 * scale);

    let mut modes = Vec::new();
    for axis in [Vec3::x(), Vec3::y(), Vec3::z()] {
        modes.push(positions.iter().map(|_| axis).collect::<Vec<_>>());
        modes.push(positions.iter().map(|p| axis.cross(p) / 0.08).collect());
    }
    for mode in modes {
        let flat: Vec<f64> = mode.iter().flat_map(|u| [u.x, u.y, u.z]).collect();
        let force = &m1 * DVector::from_vec(flat);
        assert!(
            force.amax() < 1e-13 * scale,
            "a rigid motion needs no force"
        );
    }

    let mut eigenvalues = SymmetricEigen::new(m1).eigenvalues.as_slice().to_vec();
    eigenvalues.sort_by(f64::total_cmp);
    assert!(eigenvalues[5].abs() < 1e-12 * scale && eigenvalues[0] > -1e-12 * scale);
    assert!(
        eigenvalues[6] > 1e-5 * scale,
        "exactly six: the next is {}",
        eigenvalues[6]
    );
}

#[test]
fn input_that_makes_no_network_is_named() {
    let body = thesis_body(3, 3);
    let count = Network::from_body(&body, &springs(&[SOFT]));
    assert_eq!(count, Err(SpringError::LayerCount { found: 2, given: 1 }));
    let negative = Network::from_body(&body, &springs(&[SOFT, -1.0]));
    assert_eq!(
        negative,
        Err(SpringError::Stiffness {
            layer: 1,
            value: -1.0
        })
    );
    let mut flat = body.clone();
    flat.positions[1] = flat.positions[0];
    let message = Network::from_body(&flat, &springs(&[SOFT, HARD]))
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("between nodes 0 and 1 is 0 m long"),
        "{message}"
    );
}
