//! Blocks and a cylinder at large strain (B1 to B5), compared with other codes.

use palpa_fem::law::NeoHookean;
use palpa_fem::lump::{Lump, LumpShape};
use palpa_fem::shape::{Pose, Sphere, Tool};
use palpa_fem::{Material, Materials, Supports};
use palpa_mesh::LayeredBody;
use palpa_mesh::generate::{self, GradedBlock, GradedLayer, LevelStack, graded_block};

use crate::verify::press::Pressed;
use crate::verify::sector::{Finest, Outline, Sector};
use crate::verify::table::Table;
use crate::verify::tolerance::{BLOCK, BLOCK_LUMP, BONDED, BONDED_DEEP, PROFILE};
use crate::verify::{Findings, Options, Row, StudyPoint, VerifyError};

/// Radius of the bonded disc and of the sphere, m.
pub(crate) const RADIUS: f64 = 0.01;
/// Radius within which the mesh under the sphere has equal edges, m.
const SPHERE_RING: f64 = 0.8 * RADIUS;
/// Thickness of the block, m.
const THICKNESS: f64 = 0.04;

/// A mesh that is fine under the tool.
pub(crate) struct BlockMesh {
    /// Edge length under the tool, m.
    pub(crate) spacing: f64,
    /// Growth of the edge length away from the tool, per metre of distance.
    pub(crate) growth: f64,
    /// First height (m) and growth of each layer's levels.
    pub(crate) levels: Vec<(f64, f64)>,
}

fn material(young: f64, nu: f64) -> Material {
    let law = NeoHookean::from_young(young, nu).expect("valid constants");
    Material::new(format!("{:.0} kPa", young / 1e3), law)
}

/// Layers of skin, fat and muscle with Poisson's ratio `nu`: thickness, m, and material.
pub(crate) fn layered(nu: f64) -> Vec<(f64, Material)> {
    vec![
        (0.002, material(100e3, nu)),
        (0.010, material(5e3, nu)),
        (0.028, material(30e3, nu)),
    ]
}

fn homogeneous() -> Vec<(f64, Material)> {
    vec![(THICKNESS, material(30e3, 0.45))]
}

pub(crate) fn block(mesh: &BlockMesh, ring: f64) -> GradedBlock {
    GradedBlock {
        outline: generate::Outline::Square,
        half_width: 0.05,
        centre: [0.0; 2],
        ring_radius: Some(ring),
        spacing: mesh.spacing,
        inner_growth: 0.0,
        growth: mesh.growth,
        jitter: None,
    }
}

fn body(block: &GradedBlock, mesh: &BlockMesh, layers: &[(f64, Material)]) -> LayeredBody {
    let graded: Vec<GradedLayer> = layers
        .iter()
        .zip(&mesh.levels)
        .map(|((thickness, _), &(first_height, growth))| GradedLayer {
            thickness: *thickness,
            first_height,
            growth,
        })
        .collect();
    graded_block(block, &LevelStack::graded(&graded))
}

/// The longest step of a bonded disc, m.
const STEP: f64 = 1e-3;

/// Presses a bonded disc through the depths, in steps of at most `longest`, m. Returns the force at
/// each depth, N.
fn disc_forces(
    pressed: &mut Pressed,
    patch: &[u32],
    depths: &[f64],
    longest: f64,
    mut at_depth: impl FnMut(&Pressed, usize),
) -> Result<Vec<f64>, VerifyError> {
    let mut forces = Vec::new();
    let mut depth = 0.0;
    for (i, &target) in depths.iter().enumerate() {
        let n = ((target - depth) / longest - 1e-9).ceil().max(1.0) as usize;
        let mut force = 0.0;
        for step in 1..=n {
            let next = depth + (target - depth) * step as f64 / n as f64;
            force = pressed.hold_down(patch, next)?;
        }
        depth = target;
        forces.push(force);
        at_depth(pressed, i);
    }
    Ok(forces)
}

/// Presses a bonded disc, the ring of the block, through the depths in steps of at most
/// `longest_step`, m. Returns the force at each depth, N, and the number of nodes that can move.
pub(crate) fn press_disc(
    block: &GradedBlock,
    mesh: &BlockMesh,
    layers: &[(f64, Material)],
    depths: &[f64],
    longest_step: f64,
) -> Result<(Vec<f64>, usize), VerifyError> {
    let body = body(block, mesh, layers);
    let patch = block.patch_vertices(&body);
    let materials = layers.iter().map(|l| l.1.clone()).collect();
    let mut pressed = Pressed::layered(&body, materials)?;
    let forces = disc_forces(&mut pressed, &patch, depths, longest_step, |_, _| {})?;
    Ok((forces, pressed.nodes()))
}

/// Depths, m, up to `deepest` and forces, N, from a reference table of a bonded disc.
pub(crate) fn known_disc_forces(
    options: &Options,
    name: &str,
    deepest: f64,
) -> Result<Vec<(f64, f64)>, VerifyError> {
    let table = Table::read(options, name, &["depth_m", "F_N_extrapolated"])?;
    let known = (0..table.len()).map(|row| {
        (
            table.number(row, "depth_m"),
            table.number(row, "F_N_extrapolated"),
        )
    });
    Ok(known
        .filter(|(depth, force)| *depth <= deepest + 1e-9 && force.is_finite())
        .collect())
}

/// One reference table of a bonded disc: compares forces on several meshes (rows from the finest)
/// and the profile of the surface.
struct DiscPress<'a> {
    case: &'static str,
    label: String,
    table: &'a str,
    profile: &'a str,
    deepest: f64,
    layers: Vec<(f64, Material)>,
    meshes: Vec<BlockMesh>,
}

fn disc(
    options: &Options,
    disc: &DiscPress<'_>,
    findings: &mut Findings,
) -> Result<(), VerifyError> {
    let wanted = known_disc_forces(options, disc.table, disc.deepest)?;
    let depths: Vec<f64> = wanted.iter().map(|w| w.0).collect();
    for (m, mesh) in disc.meshes.iter().enumerate() {
        let is_finest = m + 1 == disc.meshes.len();
        let block = block(mesh, RADIUS);
        let (forces, nodes) = press_disc(&block, mesh, &disc.layers, &depths, STEP)?;
        for (&(depth, reference), force) in wanted.iter().zip(forces) {
            findings.study.push(StudyPoint {
                case: disc.case,
                series: format!("{}{:.0} mm", disc.label, depth * 1e3),
                h: mesh.spacing,
                nodes,
                error: force / reference - 1.0,
            });
            if is_finest {
                findings.rows.push(Row::ratio(
                    disc.case,
                    format!("{}force at {:.0} mm, N", disc.label, depth * 1e3),
                    reference,
                    force,
                    BLOCK,
                    nodes,
                ));
            }
        }
    }
    profiles(options, disc, &depths, findings)
}

/// The skin's profile on an eighth of the block. The mesh is fine at the disc's rim, where the skin
/// falls off steeply.
fn profiles(
    options: &Options,
    disc: &DiscPress<'_>,
    depths: &[f64],
    findings: &mut Findings,
) -> Result<(), VerifyError> {
    let table = Table::read(options, disc.profile, &["depth_m", "X_m", "uz_m"])?;
    let thicknesses: Vec<f64> = disc.layers.iter().map(|l| l.0).collect();
    let rim = 16;
    let sector = Sector::new(
        Outline::Square,
        RADIUS,
        rim,
        Finest::Rim,
        0.05,
        &thicknesses,
    );
    let materials = Materials::of_layers(disc.layers.iter().map(|l| l.1.clone()).collect());
    let mut pressed = Pressed::new(&sector.body, &materials, &sector.supports)?;
    let nodes = pressed.nodes();
    let mut errors = Vec::new();
    disc_forces(&mut pressed, &sector.patch, depths, STEP, |pressed, i| {
        errors.extend(profile_error(pressed, &table, depths[i]));
    })?;
    for (depth, error) in errors {
        findings.rows.push(Row::with_error(
            disc.case,
            format!(
                "{}profile at {:.0} mm: largest error over peak",
                disc.label,
                depth * 1e3
            ),
            [0.0, error],
            error,
            PROFILE,
            nodes,
        ));
    }
    Ok(())
}

/// Largest error of the skin's vertical displacement along y = 0 at a depth of the table, relative
/// to the depth.
fn profile_error(pressed: &Pressed, profile: &Table, depth: f64) -> Option<(f64, f64)> {
    let mut largest: Option<f64> = None;
    for row in 0..profile.len() {
        if (profile.number(row, "depth_m") - depth).abs() > 1e-9 {
            continue;
        }
        let (x, uz) = (profile.number(row, "X_m"), profile.number(row, "uz_m"));
        if let Some(u) = pressed.skin_displacement(x.min(0.05 - 1e-9), 0.0) {
            let error = (u.z - uz).abs() / depth;
            largest = Some(largest.unwrap_or(0.0).max(error));
        }
    }
    largest.map(|error| (depth, error))
}

pub(crate) fn b1(options: &Options) -> Result<Findings, VerifyError> {
    let mut findings = Findings::default();
    let mesh = |spacing: f64, growth: f64, first: f64, level_growth: f64| BlockMesh {
        spacing,
        growth,
        levels: vec![(first, level_growth)],
    };
    disc(
        options,
        &DiscPress {
            case: "B1",
            label: String::new(),
            table: "B1_homogeneous_block.csv",
            profile: "B1_surface_profile_F2.csv",
            deepest: 0.010,
            layers: homogeneous(),
            meshes: vec![
                mesh(10e-3 / 3.0, 0.5, 3e-3, 0.5),
                mesh(10e-3 / 5.0, 0.4, 2e-3, 0.4),
                mesh(10e-3 / 8.0, 0.3, 1.2e-3, 0.25),
            ],
        },
        &mut findings,
    )?;
    Ok(findings)
}

/// Meshes for skin, fat and muscle, from coarse to fine.
fn layered_meshes() -> Vec<BlockMesh> {
    vec![
        BlockMesh {
            spacing: 10e-3 / 3.0,
            growth: 0.5,
            levels: vec![(2e-3, 0.0), (2e-3, 0.2), (5e-3, 0.7)],
        },
        BlockMesh {
            spacing: 10e-3 / 5.0,
            growth: 0.4,
            levels: vec![(1e-3, 0.0), (1.4e-3, 0.2), (3e-3, 0.5)],
        },
        BlockMesh {
            spacing: 10e-3 / 8.0,
            growth: 0.3,
            levels: vec![(0.67e-3, 0.0), (1e-3, 0.1), (2e-3, 0.4)],
        },
    ]
}

pub(crate) fn b2(options: &Options) -> Result<Findings, VerifyError> {
    let mut findings = Findings::default();
    for (nu, name, deepest) in [(0.45, "nu045", 0.014), (0.49, "nu049", 0.012)] {
        disc(
            options,
            &DiscPress {
                case: "B2",
                label: format!("nu {nu}: "),
                table: &format!("B2_layered_block_{name}.csv"),
                profile: &format!("B2_surface_profile_{name}_F2.csv"),
                deepest,
                layers: layered(nu),
                meshes: layered_meshes(),
            },
            &mut findings,
        )?;
    }
    Ok(findings)
}

pub(crate) fn b3c(options: &Options) -> Result<Findings, VerifyError> {
    const CASE: &str = "B3c";
    let table = Table::read(options, "B3c_lump_under_centre.csv", &["depth_m", "ratio"])?;
    let depths: Vec<f64> = (0..table.len())
        .map(|r| table.number(r, "depth_m"))
        .collect();
    let mut findings = Findings::default();
    let meshes = layered_meshes();
    let n_meshes = meshes.len();
    for (m, mesh) in meshes.iter().enumerate() {
        let block = block(mesh, RADIUS);
        let body = body(&block, mesh, &layered(0.45));
        let patch = block.patch_vertices(&body);
        let forces = |with_lump: bool| -> Result<(Vec<f64>, usize), VerifyError> {
            let mut materials: Vec<Material> = layered(0.45).into_iter().map(|l| l.1).collect();
            materials.push(material(300e3, 0.45));
            let mut materials = Materials {
                layers: vec![0, 1, 2],
                materials,
                ..Materials::default()
            };
            if with_lump {
                let sphere = LumpShape::Sphere(Sphere::new(6e-3).expect("valid size"));
                let lump = Lump::new(sphere, Pose::translation(0.0, 0.0, -0.014), 0.0, 3);
                materials.lumps.push(lump.expect("a valid lump"));
            }
            let mut pressed = Pressed::new(&body, &materials, &Supports::on_base(&body))?;
            let forces = disc_forces(&mut pressed, &patch, &depths, STEP, |_, _| {})?;
            Ok((forces, pressed.nodes()))
        };
        let ((with, nodes), (without, _)) = (forces(true)?, forces(false)?);
        for (row, (with, without)) in with.iter().zip(&without).enumerate() {
            let reference = table.number(row, "ratio");
            let ratio = with / without;
            let error = (ratio - 1.0) / (reference - 1.0) - 1.0;
            findings.study.push(StudyPoint {
                case: CASE,
                series: format!("{:.0} mm", depths[row] * 1e3),
                h: mesh.spacing,
                nodes,
                error,
            });
            if m + 1 == n_meshes {
                findings.rows.push(Row::with_error(
                    CASE,
                    format!(
                        "force with lump over without at {:.0} mm (error of what it adds)",
                        depths[row] * 1e3
                    ),
                    [reference, ratio],
                    error,
                    BLOCK_LUMP,
                    nodes,
                ));
            }
        }
    }
    Ok(findings)
}

pub(crate) fn b4(options: &Options) -> Result<Findings, VerifyError> {
    const CASE: &str = "B4";
    let wanted = known_sphere_forces(options)?;
    let depths: Vec<f64> = wanted.iter().map(|w| w.0).collect();
    let profile = Table::read(
        options,
        "B4_hom_surface_profile.csv",
        &["depth_m", "X_m", "uz_m"],
    )?;
    let meshes: Vec<BlockMesh> = [
        (2.0e-3, 0.5, 2e-3, 0.5),
        (1.25e-3, 0.4, 1.25e-3, 0.35),
        (0.8e-3, 0.3, 0.8e-3, 0.25),
    ]
    .into_iter()
    .map(|(spacing, growth, first, level_growth)| BlockMesh {
        spacing,
        growth,
        levels: vec![(first, level_growth)],
    })
    .collect();
    let mut findings = Findings::default();
    for (m, mesh) in meshes.iter().enumerate() {
        let is_finest = m + 1 == meshes.len();
        let block = block(mesh, SPHERE_RING);
        let mut profiles = Vec::new();
        let (forces, nodes) = press_sphere(&block, mesh, [0.0; 2], &depths, |pressed, i| {
            profiles.push(profile_error(pressed, &profile, depths[i]));
        })?;
        for ((&(depth, reference), force), profile) in wanted.iter().zip(forces).zip(profiles) {
            let mm = depth * 1e3;
            findings.study.push(StudyPoint {
                case: CASE,
                series: format!("{mm} mm"),
                h: mesh.spacing,
                nodes,
                error: force / reference - 1.0,
            });
            if !is_finest {
                continue;
            }
            findings.rows.push(Row::ratio(
                CASE,
                format!("force at {mm} mm, N"),
                reference,
                force,
                BLOCK,
                nodes,
            ));
            if let Some((_, error)) = profile {
                findings.rows.push(Row::with_error(
                    CASE,
                    format!("profile at {mm} mm: largest error over peak"),
                    [0.0, error],
                    error,
                    PROFILE,
                    nodes,
                ));
            }
        }
    }
    Ok(findings)
}

/// Presses the frictionless sphere over (x, y) of the homogeneous block through the depths. Returns
/// the force at each depth, N, and the number of nodes that can move.
pub(crate) fn press_sphere(
    block: &GradedBlock,
    mesh: &BlockMesh,
    at: [f64; 2],
    depths: &[f64],
    mut at_depth: impl FnMut(&Pressed, usize),
) -> Result<(Vec<f64>, usize), VerifyError> {
    let tool = Tool::new(Sphere::new(RADIUS).expect("valid size"), 0.0).expect("no friction");
    let body = body(block, mesh, &homogeneous());
    let materials = homogeneous().into_iter().map(|l| l.1).collect();
    let mut pressed = Pressed::layered(&body, materials)?;
    let mut forces = Vec::new();
    for (i, &depth) in depths.iter().enumerate() {
        let report = pressed.press(tool, at, depth)?;
        forces.push(report.tool_forces[0].z);
        at_depth(&pressed, i);
    }
    Ok((forces, pressed.nodes()))
}

/// Reference depths, m, and forces, N, of the sphere: from the block if it was computed, else from
/// the cylinder of equal thickness.
pub(crate) fn known_sphere_forces(options: &Options) -> Result<Vec<(f64, f64)>, VerifyError> {
    const COLUMNS: [&str; 3] = [
        "depth_m",
        "F_N_calculix_block_C3D10",
        "F_N_own_axisym_cyl_R50_h0.65",
    ];
    let table = Table::read(options, "B4_sphere_frictionless_homogeneous.csv", &COLUMNS)?;
    let known = (0..table.len()).map(|row| {
        let [depth, block, cylinder] = COLUMNS.map(|column| table.number(row, column));
        (depth, if block.is_finite() { block } else { cylinder })
    });
    Ok(known.collect())
}

/// The cylinder of radius 20 mm and height 40 mm between bonded plates.
pub(crate) fn b5(options: &Options) -> Result<Findings, VerifyError> {
    const CASE: &str = "B5";
    let table = Table::read(
        options,
        "B5_unconfined_homogeneous_bonded.csv",
        &["depth_m", "F_N_extrapolated"],
    )?;
    let depths: Vec<f64> = (0..table.len())
        .map(|r| table.number(r, "depth_m"))
        .collect();
    let mut findings = Findings::default();
    let sizes = [5e-3, 10e-3 / 3.0, 2e-3];
    for (m, spacing) in sizes.into_iter().enumerate() {
        let block = GradedBlock {
            outline: generate::Outline::Disc,
            half_width: 0.02,
            centre: [0.0; 2],
            ring_radius: None,
            spacing,
            inner_growth: 0.0,
            growth: 0.0,
            jitter: None,
        };
        let n = (THICKNESS / spacing).round() as usize;
        let levels = LevelStack {
            // The levels are finer towards both plates.
            depths: (0..=n)
                .map(|l| {
                    let t = l as f64 / n as f64;
                    THICKNESS * (t - 0.08 * (std::f64::consts::TAU * t).sin())
                })
                .collect(),
            interval_layer: vec![0; n],
        };
        let body = graded_block(&block, &levels);
        let mut pressed = Pressed::layered(&body, vec![material(30e3, 0.45)])?;
        let top: Vec<u32> = (0..body.n_vertices() as u32).collect();
        let forces = disc_forces(&mut pressed, &top, &depths, STEP, |_, _| {})?;
        for (row, force) in forces.into_iter().enumerate() {
            let reference = table.number(row, "F_N_extrapolated");
            let mm = depths[row] * 1e3;
            findings.study.push(StudyPoint {
                case: CASE,
                series: format!("{mm:.0} mm"),
                h: spacing,
                nodes: pressed.nodes(),
                error: force / reference - 1.0,
            });
            if m + 1 == sizes.len() {
                let tolerance = if mm <= 6.0 + 1e-9 {
                    BONDED
                } else {
                    BONDED_DEEP
                };
                findings.rows.push(Row::ratio(
                    CASE,
                    format!("force at {mm:.0} mm, N"),
                    reference,
                    force,
                    tolerance,
                    pressed.nodes(),
                ));
            }
        }
    }
    Ok(findings)
}
