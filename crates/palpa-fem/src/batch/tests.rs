//! The kernel against the element.

use crate::assembly::Assembler;
use crate::assembly::assemble;
use crate::batch::{Batches, From, History, Pressure, Tangent};
use crate::columns::SurfaceGroup;
use crate::law::{
    Fung, Gent, Law, Moduli, MooneyRivlin, NeoHookean, Ogden, OgdenTerm, Prony, PronyTerm,
    StVenantKirchhoff, Volumetric, Yeoh,
};
use crate::model::Model;
use crate::state::Memory;
use crate::system::LinearSystem;
use crate::{Mat3, Material, Materials, ModelParams, Shares, State, Supports};
use palpa_mesh::generate::{Diagonal, Grid, LevelStack, mapped_grid};
use palpa_mesh::{LayeredBody, Vec3};

/// Numbers between −0.5 and 0.5, the same in each run.
struct Noise(fastrand::Rng);

impl Noise {
    fn new(seed: u64) -> Self {
        Self(fastrand::Rng::with_seed(seed))
    }

    fn next(&mut self) -> f64 {
        self.0.f64() - 0.5
    }
}

/// Seven by five cells: an odd number of batches, and one that is not full; three layers of
/// different stiffness.
fn body() -> LayeredBody {
    let levels = LevelStack {
        depths: vec![0.0, 2e-3, 5e-3, 9e-3],
        interval_layer: vec![0, 1, 2],
    };
    let grid = Grid {
        n_cells: [7, 5],
        diagonal: Diagonal::Alternate,
        jitter: Some(3),
    };
    mapped_grid(
        &grid,
        |u, v| Vec3::new(0.02 * u, 0.015 * v, 2e-3 * u * v),
        &levels,
    )
}

/// A body with an odd number of triangles, one of which has no partner.
fn odd_body() -> LayeredBody {
    let whole = body();
    palpa_mesh::Part::new(&whole, |t| t != 20).body
}

fn materials(laws: &[Law; 3], is_viscous: bool) -> Materials {
    Materials::of_layers(
        laws.iter()
            .map(|law| {
                let mut material = Material::new("t", *law);
                if is_viscous {
                    let terms = vec![
                        PronyTerm { g: 0.3, tau: 0.1 },
                        PronyTerm { g: 0.2, tau: 1.0 },
                    ];
                    let prony = Prony::new(terms, Moduli::Instantaneous, true);
                    material.prony = Some(prony.unwrap());
                    material.prestress = 500.0;
                }
                material
            })
            .collect(),
    )
}

fn cases() -> Vec<(&'static str, Materials)> {
    let soft = |young| Law::from(NeoHookean::from_young(young, 0.49).unwrap());
    let neo_hookean = [soft(100e3), soft(5e3), soft(30e3)];
    let hardening = [
        Fung::from_young(50e3, 0.47, 10.0).unwrap().into(),
        Yeoh::from_young(10e3, 0.45, [0.5, 2.0]).unwrap().into(),
        soft(30e3),
    ];
    let term = |mu, alpha| OgdenTerm { mu, alpha };
    let several = [term(4e3, 8.0), term(2e3, -3.5), term(1e3, 0.02)];
    let powers = [
        Ogden::from_young(60e3, 0.45, 12.0).unwrap().into(),
        Ogden::new(&several, Volumetric::Quadratic { bulk: 3e5 })
            .unwrap()
            .into(),
        MooneyRivlin::new(8e3, 3e3, Volumetric::Quadratic { bulk: 4e5 })
            .unwrap()
            .into(),
    ];
    let log = Volumetric::Logarithmic { bulk: 3e5 };
    let strange = [
        StVenantKirchhoff::from_young(50e3, 0.45).unwrap().into(),
        NeoHookean::new(1e4, log).unwrap().into(),
        Gent::from_young(30e3, 0.45, 20.0).unwrap().into(),
    ];
    vec![
        ("neo-Hookean", materials(&neo_hookean, false)),
        ("Fung and Yeoh", materials(&hardening, false)),
        ("powers of stretches", materials(&powers, false)),
        ("one by one", materials(&strange, false)),
        ("viscous", materials(&neo_hookean, true)),
        ("viscous, hardening", materials(&hardening, true)),
        ("viscous, powers", materials(&powers, true)),
    ]
}

/// A strain of the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Strain {
    /// Every prism in another way, by up to a third.
    Irregular,
    /// Stretches that differ by a millionth, and turned by a tenth.
    NearlyEqual,
    /// None.
    Rest,
}

/// Two deformations of a body.
fn deformations(model: &Model, strain: Strain) -> [Vec<Vec3>; 2] {
    let mut noise = Noise::new(11);
    let (stretch, size) = match strain {
        Strain::Irregular => (
            Mat3::new(0.05, 0.1, -0.04, 0.02, 0.06, 0.1, -0.1, 0.03, -0.2),
            3e-4,
        ),
        Strain::NearlyEqual => (
            Mat3::new(1e-3, 0.1, 0.0, -0.1, 1e-3, 0.0, 0.0, 0.0, 6e-3),
            1e-9,
        ),
        Strain::Rest => (Mat3::zeros(), 0.0),
    };
    [0.6, 1.0].map(|share| {
        let shake = |x: &Vec3, noise: &mut Noise| {
            stretch * x * share + Vec3::from_fn(|_, _| size * noise.next())
        };
        let positions = model.body.positions.iter();
        positions.map(|x| shake(x, &mut noise)).collect()
    })
}

/// The duration of the first deformation, and of the second.
const STEPS: [f64; 2] = [0.05, 0.01];

#[test]
fn forces_and_stiffness_are_the_elements_with_their_past() {
    for strain in [Strain::Irregular, Strain::NearlyEqual, Strain::Rest] {
        forces_and_stiffness_are_the_elements(strain);
    }
}

fn forces_and_stiffness_are_the_elements(strain: Strain) {
    for (name, materials) in cases() {
        for (is_fixed, body) in [(true, body()), (false, body()), (true, odd_body())] {
            let supports = if is_fixed {
                Supports::on_base(&body)
            } else {
                Supports::default()
            };
            let params = ModelParams {
                below: Shares {
                    alpha: 0.3,
                    apart: 0.1,
                },
                ..ModelParams::default()
            };
            let model = Model::build(&body, &materials, &supports, params).unwrap();
            let mut memory = Memory::new(&model);
            let mut state = State::new(&model);
            let [first, u] = deformations(&model, strain);
            state.displacements = first;
            memory.begin(&model, &state, STEPS[0]);
            memory.commit(&model, &mut state);
            memory.begin(&model, &state, STEPS[1]);
            let n = model.n_nodes();
            let mut expected = vec![Vec3::zeros(); n];
            let mut expected_blocks = vec![Mat3::zeros(); model.structure.n_blocks()];
            assemble(
                &model,
                &memory,
                &u,
                &mut expected,
                Some(&mut expected_blocks),
            )
            .unwrap();
            let size = expected.iter().map(Vec3::norm).fold(0.0, f64::max);

            let pattern = model.structure.pattern.clone();
            // Made of two parts, as zone and exterior are.
            let mut forces = vec![Vec3::zeros(); n];
            let mut blocks = vec![[0.0_f32; 9]; pattern.n_blocks() + 1];
            let mut history = History::new(&model);
            let mut own = Memory::new(&model);
            let mut fresh = State::new(&model);
            fresh.displacements.clone_from(&state.displacements);
            let mut all = Batches::new(&model, &own, &pattern, &|_| true, Tangent::None);
            own.begin_materials(&model, STEPS[0]);
            all.begin(&model, &mut own, &fresh);
            all.commit(&model, &own, &mut fresh);
            if model.has_memory {
                all.store(&mut history);
            }
            own.begin_materials(&model, STEPS[1]);
            for is_first in [true, false] {
                let keep = |group: &SurfaceGroup| group.triangles[0].is_multiple_of(3) == is_first;
                let mut batches = Batches::new(&model, &own, &pattern, &keep, Tangent::Single);
                batches.load(&history);
                batches.begin(&model, &mut own, &fresh);
                batches.add_forces(&model, &own, &u, &mut forces).unwrap();
                batches
                    .add_stiffness(&model, &own, &u, &mut blocks, Pressure::Own)
                    .unwrap();
            }
            for (force, expected) in forces.iter().zip(&expected) {
                let error = (force - expected).norm();
                assert!(
                    error < 1e-13 * size.max(1.0),
                    "{name}, {strain:?}: {error:e} of {size}"
                );
            }
            let largest = expected_blocks.iter().map(Mat3::norm).fold(0.0, f64::max);
            let (mut worst, mut compared) = (0.0_f64, 0);
            model.structure.for_each_block(|i, _, _| {
                let block = Mat3::from_fn(|r, c| f64::from(blocks[i][r + 3 * c]));
                worst = worst.max((block - expected_blocks[i]).norm());
                compared += 1;
            });
            assert!(compared > 500);
            let mut system = LinearSystem::new(&model.structure, n, None);
            let mut assembler = Assembler::new(&model, &memory, None);
            assembler.begin(&model, &memory);
            assembler
                .stiffness(&model, &memory, &u, &mut forces, &mut system)
                .unwrap();
            let differs = |a: f64, of: f64| assert!(a < 1e-12 * of, "{name}: {a:e} of {of:e}");
            for (force, expected) in forces.iter().zip(&expected) {
                differs((force - expected).norm(), size.max(1.0));
            }
            for (block, expected) in system.blocks.iter().zip(&expected_blocks) {
                differs((block - expected).norm(), largest);
            }
            assert!(
                worst < 3e-6 * largest,
                "{name}, {strain:?}: {worst:e} of {largest:e}"
            );
        }
    }
}

/// A nearly incompressible body that nothing holds.
fn free_body() -> Model {
    let soft = Law::from(NeoHookean::from_young(5e3, 0.49).unwrap());
    let materials = materials(&[soft; 3], false);
    let params = ModelParams::default();
    Model::build(&body(), &materials, &Supports::default(), params).unwrap()
}

/// A small turn of a body about x.
fn turn_of(model: &Model) -> Vec<Vec3> {
    let positions = model.body.positions.iter();
    positions.map(|x| Vec3::x().cross(x)).collect()
}

/// Twice the energy of a small turn by the stiffness at the displacements `u`, with each of these pressures.
fn energies<const N: usize>(model: &Model, u: &[Vec3], pressures: [Pressure<'_>; N]) -> [f64; N] {
    let memory = Memory::new(model);
    let pattern = model.structure.pattern.clone();
    let mut batches = Batches::new(model, &memory, &pattern, &|_| true, Tangent::Single);
    let turn = turn_of(model);
    pressures.map(|pressure| {
        let mut blocks = vec![[0.0_f32; 9]; pattern.n_blocks() + 1];
        batches
            .add_stiffness(model, &memory, u, &mut blocks, pressure)
            .unwrap();
        let mut sum = 0.0;
        model.structure.for_each_block(|i, row, column| {
            let block = Mat3::from_fn(|r, c| f64::from(blocks[i][r + 3 * c]));
            let both = if row == column { 1.0 } else { 2.0 };
            sum += both * turn[row].dot(&(block * turn[column]));
        });
        sum
    })
}

#[test]
fn a_compressed_body_is_stable_without_its_pressure_only() {
    let model = free_body();
    // Every length 5 % too small.
    let positions = model.body.positions.iter();
    let u: Vec<Vec3> = positions.map(|x| x * -0.05).collect();
    let [own, none] = energies(&model, &u, [Pressure::Own, Pressure::None]);
    // Second variation of the volume by a turn about x: 2 J/λ² for each volume at rest, times the pressure.
    let volume = 0.02 * 0.015 * 9e-3;
    let (stretch, bulk) = (0.95_f64, 5e3 / (3.0 * (1.0 - 2.0 * 0.49)));
    let pressure = bulk * (stretch.powi(3) - 1.0);
    let expected = 2.0 * stretch * pressure * volume;
    let difference = own - none;
    assert!(
        (difference / expected - 1.0).abs() < 0.01,
        "{difference:e} {expected:e}"
    );
    assert!(own < 0.0 && none >= -1e-4 * own.abs(), "{own:e} {none:e}");
}

#[test]
fn the_pressure_of_a_predicted_volume_has_no_error_of_the_second_order() {
    let model = free_body();
    // A turn by 0.2, extrapolated from the rest: the volume grows by 0.04, but none was predicted.
    let u: Vec<Vec3> = turn_of(&model).iter().map(|x| x * 0.2).collect();
    let rest = vec![Vec3::zeros(); u.len()];
    let from = |displacements, is_known| {
        Pressure::Predicted(From {
            displacements,
            is_known,
            n_levels: model.body.n_levels,
        })
    };
    let n = model.body.n_vertices();
    let (all, none) = (vec![true; n], vec![false; n]);
    let pressures = [
        Pressure::None,
        Pressure::Own,
        from(&rest, &none),
        from(&rest, &all),
        from(&u, &none),
    ];
    let energies = energies(&model, &u, pressures);
    let of_own = energies[1] - energies[0];
    let of = |k: usize| (energies[k] - energies[0]) / of_own;
    assert!(of(2).abs() < 1e-3, "{}", of(2));
    assert!((of(3) - 1.0).abs() < 1e-6, "{}", of(3));
    assert!((of(4) - 1.0).abs() < 1e-6, "{}", of(4));
}

#[test]
fn prisms_that_are_inside_out_are_found() {
    let body = body();
    for (name, materials) in cases() {
        let supports = Supports::on_base(&body);
        let model = Model::build(&body, &materials, &supports, ModelParams::default()).unwrap();
        let memory = Memory::new(&model);
        let pattern = model.structure.pattern.clone();
        let mut batches = Batches::new(&model, &memory, &pattern, &|_| true, Tangent::Single);
        let mut u = vec![Vec3::zeros(); model.n_nodes()];
        let node = model.body.node(20, 0);
        // Through the level below it.
        u[node] = Vec3::new(0.0, 0.0, -12e-3);
        let mut forces = vec![Vec3::zeros(); model.n_nodes()];
        let found = batches.add_forces(&model, &memory, &u, &mut forces);
        let at = found.expect_err(name).at;
        assert!(
            (at - model.body.positions[node]).norm() < 0.03,
            "{name}: {at}"
        );
        let mut blocks = vec![[0.0_f32; 9]; pattern.n_blocks() + 1];
        assert!(
            batches
                .add_stiffness(&model, &memory, &u, &mut blocks, Pressure::Own)
                .is_err(),
            "{name}"
        );
        u[node] = Vec3::new(f64::NAN, 0.0, 0.0);
        assert!(
            batches
                .add_forces(&model, &memory, &u, &mut forces)
                .is_err(),
            "{name}"
        );
    }
}
