//! A lump smaller than a prism: on the coarse mesh, compared with a mesh refined round the lump.

use palpa_fem::law::NeoHookean;
use palpa_fem::lump::{Lump, LumpShape};
use palpa_fem::shape::{Pose, Sphere};
use palpa_fem::{Material, Materials, Supports};
use palpa_mesh::generate::{GradedBlock, LevelStack, Outline, graded_block};
use palpa_mesh::refine::{
    RefineParams, along, near_depth, near_points, parts_for, refine, split_levels,
};
use palpa_mesh::{LayeredBody, Vec3};

use crate::verify::press::Pressed;
use crate::verify::tolerance::SMALL_LUMP;
use crate::verify::{Findings, Options, Row, VerifyError};

const CASE: &str = "small lump";
/// Radius of the bonded disc, m.
const DISC: f64 = 0.021;
/// Radius of the lump, m.
const LUMP: f64 = 0.003;
/// Edge length of the coarse mesh within the disc, m: a lump fits under one triangle.
const EDGE: f64 = 0.0105;
/// Levels of the coarse mesh, m.
const LEVELS: [f64; 5] = [0.0, 0.006, 0.012, 0.024, 0.04];
/// Depths of the lump's middle, m, under the centroid of a triangle at the middle of the disc.
const DEPTHS: [f64; 2] = [0.009, 0.012];
/// Young's modulus of the surroundings and of the lump, Pa.
const YOUNG: [f64; 2] = [10e3, 300e3];
/// Depth to which the disc is pressed, m.
const PRESS: f64 = 1e-3;

/// Force with the lump relative to the force without it, on one mesh; and the number of nodes that
/// can move.
fn ratio(body: &LayeredBody, patch: &[u32], middle: &Vec3) -> Result<(f64, usize), VerifyError> {
    let law = |young| NeoHookean::from_young(young, 0.45).expect("valid constants");
    let force = |has_lump: bool| -> Result<(f64, usize), VerifyError> {
        let mut materials = Materials {
            materials: vec![
                Material::new("soft", law(YOUNG[0])),
                Material::new("lump", law(YOUNG[1])),
            ],
            layers: vec![0],
            ..Materials::default()
        };
        if has_lump {
            let shape = LumpShape::Sphere(Sphere::new(LUMP).expect("valid size"));
            let pose = Pose::translation(middle.x, middle.y, middle.z);
            let lump = Lump::new(shape, pose, 0.0, 1).expect("a valid lump");
            materials.lumps.push(lump);
        }
        let mut pressed = Pressed::new(body, &materials, &Supports::on_base(body))?;
        let force = pressed.hold_down(patch, PRESS)?;
        Ok((force, pressed.nodes()))
    };
    let ((with, nodes), (without, _)) = (force(true)?, force(false)?);
    Ok((with / without, nodes))
}

pub(crate) fn run(_: &Options) -> Result<Findings, VerifyError> {
    let mut findings = Findings::default();
    let block = GradedBlock {
        outline: Outline::Square,
        half_width: 0.08,
        centre: [0.0; 2],
        ring_radius: Some(DISC),
        spacing: EDGE,
        inner_growth: 0.0,
        growth: 0.8,
        jitter: None,
    };
    let stack = LevelStack {
        depths: LEVELS.to_vec(),
        interval_layer: vec![0; LEVELS.len() - 1],
    };
    let coarse = graded_block(&block, &stack);
    for depth in DEPTHS {
        let middle = Vec3::new(0.5 * EDGE, EDGE * 3_f64.sqrt() / 6.0, -depth);
        let refined = |h: f64| -> LayeredBody {
            let above = Vec3::new(middle.x, middle.y, 0.0);
            let size = near_points(&[above], 1.2 * LUMP, h, 1.0);
            let surface = refine(&coarse, &RefineParams::default(), size).body;
            let near = along(LEVELS.to_vec(), near_depth(depth, 1.2 * LUMP, h, 1.0));
            split_levels(&surface, &parts_for(LEVELS.len() - 1, near, 60).0).body
        };
        let held = |body: &LayeredBody| inside(body, &coarse, &block);
        let fine = refined(LUMP / 4.0);
        let (reference, _) = ratio(&fine, &held(&fine), &middle)?;
        for (mesh, body) in [
            ("under one triangle", coarse.clone()),
            ("refined round it", refined(LUMP / 2.0)),
        ] {
            let (ours, nodes) = ratio(&body, &held(&body), &middle)?;
            findings.rows.push(Row::with_error(
                CASE,
                format!(
                    "{:.0} mm deep, {mesh}: force with lump over without (error of what it adds)",
                    depth * 1e3
                ),
                [reference, ours],
                (ours - 1.0) / (reference - 1.0) - 1.0,
                SMALL_LUMP,
                nodes,
            ));
        }
    }
    Ok(findings)
}

/// Skin vertices of a refined body inside the ring of the coarse body, so that the same polygon is
/// held.
fn inside(body: &LayeredBody, coarse: &LayeredBody, block: &GradedBlock) -> Vec<u32> {
    let held = block.patch_vertices(coarse);
    let triangles = coarse
        .skin
        .triangles
        .iter()
        .filter(|t| t.iter().all(|v| held.contains(v)));
    let corners: Vec<[Vec3; 3]> = triangles
        .map(|t| t.map(|v| coarse.skin.points[v as usize]))
        .collect();
    let is_in = |p: &Vec3| {
        corners.iter().any(|[a, b, c]| {
            let side = |x: &Vec3, y: &Vec3| (y - x).xy().perp(&(p - x).xy());
            [side(a, b), side(b, c), side(c, a)]
                .iter()
                .all(|&s| s >= -1e-12)
        })
    };
    (0..body.n_vertices() as u32)
        .filter(|&v| is_in(&body.skin.points[v as usize]))
        .collect()
}
