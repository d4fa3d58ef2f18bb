//! Patch test: on a mesh of distorted prisms, boundary nodes moved by a uniform deformation must
//! give that deformation and its stress inside. A rigid rotation of the whole body must cause no
//! energy and no forces.

use palpa_fem::law::{Linear, NeoHookean};
use palpa_fem::{
    Kinematics, Law, Load, Mat3, Material, Materials, Model, ModelParams, SolveParams, State,
    Supports, Workspace, equilibrate, prism_fields,
};
use palpa_mesh::generate::{Diagonal, Grid, LevelStack, mapped_grid};
use palpa_mesh::{CutFace, LayeredBody, Surface, Vec3};

use crate::verify::press::ALPHA;
use crate::verify::tolerance::PATCH;
use crate::verify::{Findings, Options, Row, VerifyError};

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
        uniform(
            &mut findings,
            CASE,
            &body,
            linear,
            "small strain",
            mesh,
            &small,
        )?;
        uniform(
            &mut findings,
            CASE,
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
    let params = ModelParams::even(ALPHA);
    Ok(Model::build(
        body,
        &materials,
        &Supports::default(),
        params,
    )?)
}

fn uniform(
    findings: &mut Findings,
    case: &'static str,
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
    // Rounding may keep the residual above so small a tolerance, so the test checks the solution
    // instead.
    equilibrate(&model, &mut state, &mut ws, &load, &params);
    let size = gradient.norm() * 0.04;
    let displacement = (0..body.n_nodes())
        .map(|n| (state.displacements[n] - gradient * body.positions[n]).norm() / size)
        .fold(0.0, f64::max);
    let stress = stress_error(&model, &state, &ws, gradient, &exact_stress(&law, gradient));
    let nodes = body.n_nodes() - held.len();
    for (quantity, error) in [
        ("displacement inside", displacement),
        ("first Piola–Kirchhoff stress", stress),
    ] {
        findings.rows.push(Row::with_error(
            case,
            format!("{what}, {mesh}: {quantity}, largest error"),
            [0.0, error],
            error,
            PATCH,
            nodes,
        ));
    }
    Ok(())
}

fn exact_stress(law: &Law, gradient: &Mat3) -> Mat3 {
    law.stress(&(Mat3::identity() + gradient))
}

/// Largest relative error of a prism's first Piola–Kirchhoff stress; at small strain, of its
/// stress.
fn stress_error(
    model: &Model,
    state: &State,
    ws: &Workspace,
    gradient: &Mat3,
    exact: &Mat3,
) -> f64 {
    let f = Mat3::identity() + gradient;
    let is_small = model.materials()[0].law.kinematics() == Kinematics::Small;
    let pull_back = f.try_inverse().expect("not inverted").transpose() * f.determinant();
    prism_fields(model, state, ws)
        .iter()
        .map(|field| {
            let ours = if is_small {
                field.cauchy
            } else {
                field.cauchy * pull_back
            };
            (ours - exact).norm() / exact.norm()
        })
        .fold(0.0, f64::max)
}

/// The patch of the reference folder, with its own 16 wedges and stresses.
pub(crate) fn of_reference(options: &Options) -> Result<Findings, VerifyError> {
    const CASE: &str = "V patch";
    let folder = options
        .reference
        .as_deref()
        .ok_or(VerifyError::NoReference)?;
    let path = folder.join("V_wedge_patch_test.json");
    let fail = |reason: String| VerifyError::Table {
        path: path.clone(),
        reason,
    };
    let text = std::fs::read_to_string(&path).map_err(|e| fail(e.to_string()))?;
    let patch: Patch = serde_json::from_str(&text).map_err(|e| fail(e.to_string()))?;
    let body = patch
        .body()
        .ok_or_else(|| fail("not three layers of nine nodes".to_owned()))?;
    let matrix = |rows: [[f64; 3]; 3]| Mat3::from_fn(|i, j| rows[i][j]);
    let invalid = |e: palpa_fem::law::LawError| fail(e.to_string());
    let linear = Law::from(Linear::from_young(patch.young, patch.nu).map_err(invalid)?);
    let finite = Law::from(NeoHookean::from_young(patch.young, patch.nu).map_err(invalid)?);
    let small = matrix(patch.grad_u_small);
    let large = matrix(patch.f_large) - Mat3::identity();
    let mut findings = Findings::default();
    uniform(
        &mut findings,
        CASE,
        &body,
        linear,
        "small strain",
        "16 wedges",
        &small,
    )?;
    uniform(
        &mut findings,
        CASE,
        &body,
        finite,
        "large strain",
        "16 wedges",
        &large,
    )?;
    for (what, law, gradient, reference) in [
        ("small strain: stress", linear, small, patch.sigma_small),
        (
            "large strain: first Piola–Kirchhoff stress",
            finite,
            large,
            patch.pk1_large,
        ),
    ] {
        let reference = matrix(reference);
        let error = (exact_stress(&law, &gradient) - reference).norm() / reference.norm();
        findings.rows.push(Row::with_error(
            CASE,
            format!("{what} of the law against the reference"),
            [0.0, error],
            error,
            PATCH,
            1,
        ));
    }
    Ok(findings)
}

#[derive(serde::Deserialize)]
struct Patch {
    nodes: Vec<[f64; 3]>,
    /// Nodes of each wedge: lower triangle, then upper.
    wedges: Vec<[usize; 6]>,
    grad_u_small: [[f64; 3]; 3],
    #[serde(rename = "E")]
    young: f64,
    nu: f64,
    sigma_small: [[f64; 3]; 3],
    #[serde(rename = "F_large")]
    f_large: [[f64; 3]; 3],
    #[serde(rename = "PK1_large")]
    pk1_large: [[f64; 3]; 3],
}

impl Patch {
    /// The wedges as a body of two intervals: nodes 18 to 26 are the skin, 0 to 8 the base.
    fn body(&self) -> Option<LayeredBody> {
        if self.nodes.len() != 27 {
            return None;
        }
        let at = |v: usize, l: usize| Vec3::from(self.nodes[9 * (2 - l) + v]);
        let triangles = self
            .wedges
            .iter()
            .filter(|w| w[3] >= 18)
            .map(|w| [w[3], w[4], w[5]].map(|n| n as u32 - 18));
        let skin = Surface {
            points: (0..9).map(|v| at(v, 0)).collect(),
            triangles: triangles.collect(),
        };
        Some(LayeredBody {
            skin,
            positions: (0..9).flat_map(|v| (0..3).map(move |l| at(v, l))).collect(),
            n_levels: 3,
            interval_layer: vec![0, 0],
            layer_names: vec!["tissue".to_owned()],
            cut_faces: vec![CutFace {
                // All nodes except the one in the middle.
                vertices: vec![0, 1, 2, 5, 8, 7, 6, 3],
                normal: Vec3::x(),
                point: at(0, 0),
                is_flat: false,
            }],
        })
    }
}

/// Turns the body by 70° about an oblique axis and moves it; there must be no energy and no force.
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
    // The scale is the force of tissue of this size at a strain of one.
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
