//! Converts a scene to the input of the continuum model: materials, lumps, supports, tool.

use anyhow::{Context as _, bail};
use nalgebra::{Rotation3, UnitQuaternion};
use palpa_fem::law::{
    Fung, Gent, Law, LawError, Linear, Material, Moduli, MooneyRivlin, NeoHookean, Ogden,
    OgdenTerm, Prony, PronyTerm, StVenantKirchhoff, Volumetric, Yeoh,
};
use palpa_fem::lump::{ClosedMesh, Lump, LumpShape};
use palpa_fem::shape::{
    Capsule, Cone, Ellipsoid, FlatPunch, Pose, RoundedBox, Shape, ShapeError, Sphere, Tool,
};
use palpa_fem::{Mat3, Supports};
use palpa_mesh::{LayeredBody, Surface, Vec3};
use palpa_scene::{
    ContactShape, ContactTool, CutFaces, Elastic, Energy, LumpPlace, Scene, Tissue, Volume,
};

use crate::build::{BuiltBody, in_mm, mended, read_in_metres};
use crate::note::{Note, xyz};
use crate::press::lump::share_inside;
use crate::skin::Skin;

/// Least share of a lump's volume that must lie in the tissue; less is an error. A share between
/// this and `FULL_SHARE` gives a note.
const LEAST_SHARE: f64 = 0.01;
const FULL_SHARE: f64 = 0.95;

/// Materials of the layers, then of the lumps, each in the order of the scene.
///
/// # Errors
/// When a tissue is given by a spring stiffness, which a continuum does not have, or its law is not
/// valid.
pub fn materials(scene: &Scene) -> anyhow::Result<Vec<Material>> {
    let layers = scene.layers.iter().map(|l| (&l.tissue, l.prestress));
    let lumps = scene.lumps.iter().map(|l| (&l.tissue, 0.0));
    layers
        .chain(lumps)
        .map(|(tissue, prestress)| material(tissue, prestress))
        .collect()
}

/// The material of a tissue under tension `prestress` in its plane, Pa.
///
/// # Errors
/// When the tissue is given by a spring stiffness, or its law is not valid.
pub fn material(tissue: &Tissue, prestress: f64) -> anyhow::Result<Material> {
    let in_tissue = || format!("tissue \"{}\"", tissue.name);
    let elastic = tissue.elastic().with_context(|| {
        format!(
            "tissue \"{}\" is given by the stiffness of springs, which only the reference method has; give it `young` \
             and `poisson`, or press with the reference method",
            tissue.name
        )
    })?;
    let mut material = Material::new(&tissue.name, law(elastic).with_context(in_tissue)?);
    material.prestress = prestress;
    if let Some(density) = &tissue.density {
        material.density = density.value;
    }
    if let Some(prony) = &tissue.prony {
        let terms = prony.terms.iter().map(|t| PronyTerm { g: t.g, tau: t.tau });
        let moduli = match prony.moduli {
            palpa_scene::Moduli::LongTerm => Moduli::LongTerm,
            palpa_scene::Moduli::Instantaneous => Moduli::Instantaneous,
        };
        let prony = Prony::new(terms.collect(), moduli, prony.relaxes_volume);
        material.prony = Some(prony.with_context(in_tissue)?);
    }
    material.check().with_context(in_tissue)?;
    Ok(material)
}

fn law(elastic: &Elastic) -> Result<Law, LawError> {
    let (shear, bulk) = (elastic.shear(), elastic.bulk());
    let volume = match elastic.volume {
        Volume::Quadratic => Volumetric::Quadratic { bulk },
        Volume::Logarithmic => Volumetric::Logarithmic { bulk },
    };
    Ok(match &elastic.energy {
        Energy::Linear { .. } => Linear::new(shear, bulk)?.into(),
        Energy::StVenantKirchhoff { .. } => StVenantKirchhoff::new(shear, bulk)?.into(),
        Energy::NeoHookean { .. } => NeoHookean::new(shear, volume)?.into(),
        Energy::MooneyRivlin { c01, .. } => {
            MooneyRivlin::new(elastic.c10(), c01.value, volume)?.into()
        }
        Energy::Yeoh { c20, c30, .. } => {
            Yeoh::new([elastic.c10(), c20.value, c30.value], volume)?.into()
        }
        Energy::Ogden { terms } => {
            let terms = terms.iter().map(|t| OgdenTerm {
                mu: t.mu.value,
                alpha: t.alpha,
            });
            Ogden::new(&terms.collect::<Vec<_>>(), volume)?.into()
        }
        Energy::Fung { b, .. } => Fung::new(shear, b.value, volume)?.into(),
        Energy::Gent { jm, .. } => Gent::new(shear, jm.value, volume)?.into(),
    })
}

/// The scene's lumps in their places under the body's skin. A lump that is a mesh comes with its
/// surface there, m. The material of the i-th lump follows those of the layers in [`materials`].
///
/// # Errors
/// When a mesh cannot be read or is not closed, or a lump lies outside the body.
///
/// # Panics
/// When `built` is the body of another scene.
pub fn lumps(
    scene: &Scene,
    built: &BuiltBody,
    notes: &mut Vec<Note>,
) -> anyhow::Result<Vec<(Lump, Option<Surface>)>> {
    if scene.lumps.is_empty() {
        return Ok(Vec::new());
    }
    let skin = Skin::new(&built.growth.body.skin);
    // A skin without triangles grows no body.
    let nearest = |p: Vec3| match skin.nearest(p) {
        Some(point) => (point.at, skin.inward(&point)),
        None => (p, -Vec3::z()),
    };
    let mut lumps = Vec::new();
    for (i, lump) in scene.lumps.iter().enumerate() {
        let of_lump = || format!("lump \"{}\"", lump.name);
        let (shape, drawn) = lump_shape(scene, &lump.shape, notes).with_context(of_lump)?;
        let (middle, inward) = match (&lump.place, &shape) {
            (LumpPlace::Below { depth, .. }, _) => {
                let place = built.lump_places[i].expect("a lump below the skin has a place there");
                let (on_skin, inward) = nearest(place);
                (on_skin + inward * *depth, inward)
            }
            (LumpPlace::At(at), _) => (Vec3::from(*at), nearest(Vec3::from(*at)).1),
            (LumpPlace::AsRead, LumpShape::Mesh(mesh)) => (mesh.centroid(), Vec3::zeros()),
            (LumpPlace::AsRead, _) => unreachable!("only a mesh is placed as it was read"),
        };
        // A mesh keeps the orientation of its file.
        let rotation = match &shape {
            LumpShape::Mesh(_) => UnitQuaternion::identity(),
            _ => turned_to(lump.axes(inward.into())),
        };
        let pose = Pose::from_parts(middle.into(), rotation);
        let material = scene.layers.len() + i;
        let made = Lump::new(shape, pose, lump.transition, material).with_context(of_lump)?;
        check_place(&made, &lump.name, &built.growth.body, notes)?;
        // A mesh is moved so that its centroid lies at the lump's place.
        let drawn = drawn.map(|mut surface| {
            if let LumpShape::Mesh(mesh) = made.shape() {
                let shift = made.pose().translation.vector - mesh.centroid();
                surface.points.iter_mut().for_each(|p| *p += shift);
            }
            surface
        });
        lumps.push((made, drawn));
    }
    Ok(lumps)
}

/// Checks that a lump lies in the tissue.
fn check_place(
    lump: &Lump,
    name: &str,
    body: &LayeredBody,
    notes: &mut Vec<Note>,
) -> anyhow::Result<()> {
    let share = share_inside(body, lump);
    let (middle, _) = lump.bounding_sphere();
    if share < LEAST_SHARE {
        let (lo, hi) = (body.positions.iter()).fold(
            (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY)),
            |(lo, hi), p| (lo.inf(p), hi.sup(p)),
        );
        bail!(
            "the lump \"{name}\" lies outside the tissue: its middle is at ({}) mm, and the tissue is between ({}) and ({}) mm, \
             round the bones; move it with `at`, or with `below` and `depth`, or check the `unit` of its file",
            in_mm(middle),
            in_mm(lo),
            in_mm(hi)
        );
    }
    if share < FULL_SHARE {
        notes.push(Note::LumpPartlyOutside {
            lump: name.to_owned(),
            share,
            at: xyz(middle),
        });
    }
    Ok(())
}

fn lump_shape(
    scene: &Scene,
    shape: &palpa_scene::LumpShape,
    notes: &mut Vec<Note>,
) -> anyhow::Result<(LumpShape, Option<Surface>)> {
    use palpa_scene::LumpShape as Given;
    let shape = match shape {
        Given::Sphere { radius } => LumpShape::Sphere(Sphere::new(*radius)?),
        Given::Ellipsoid { radii } => LumpShape::Ellipsoid(Ellipsoid::new(Vec3::from(*radii))?),
        Given::Capsule { radius, length } => LumpShape::Capsule(Capsule::new(*radius, *length)?),
        Given::Mesh(path) => {
            let surface = mended(&read_in_metres(path, scene.body.unit, notes)?, path, notes);
            let mesh = ClosedMesh::new(&surface).with_context(|| path.display().to_string())?;
            return Ok((LumpShape::Mesh(mesh), Some(surface)));
        }
    };
    Ok((shape, None))
}

/// The rotation to a frame given by its three axes.
fn turned_to(axes: [[f64; 3]; 3]) -> UnitQuaternion<f64> {
    let columns = Mat3::from_columns(&axes.map(Vec3::from));
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(columns))
}

/// The supports of the body: its base, and its cut faces as the scene says. Faces that cannot be
/// held that way are left free, with a note.
pub fn supports(cut_faces: CutFaces, body: &LayeredBody, notes: &mut Vec<Note>) -> Supports {
    let mut supports = Supports::on_base(body);
    for face in &body.cut_faces {
        let columns = face.vertices.iter().map(|&v| v as usize);
        let nodes = columns.flat_map(|v| (0..body.n_levels).map(move |l| body.node(v, l)));
        match cut_faces {
            CutFaces::Free => {}
            CutFaces::Fixed => supports.fixed.extend(nodes),
            CutFaces::Symmetric if face.is_flat => {
                supports
                    .planes
                    .extend(nodes.map(|node| (node, face.normal)));
            }
            CutFaces::Symmetric => notes.push(Note::CutFaceNotFlat {
                at: xyz(face.point),
            }),
        }
    }
    supports.fixed.sort_unstable();
    supports.fixed.dedup();
    supports
}

/// The rigid tool of a scene, and its pose with the tip at `tip` when it moves along the unit
/// vector `direction`.
///
/// # Errors
/// When the sizes do not give a valid shape.
pub fn tool(given: &ContactTool, direction: Vec3, tip: Vec3) -> anyhow::Result<(Tool, Pose)> {
    let shape = tool_shape(&given.shape)?;
    let pose = Pose::from_parts(tip.into(), turned_to(given.axes(direction.into())));
    Ok((Tool::new(shape, given.friction)?, pose))
}

fn tool_shape(shape: &ContactShape) -> Result<Shape, ShapeError> {
    Ok(match *shape {
        ContactShape::Sphere { radius } => Sphere::new(radius)?.into(),
        ContactShape::FlatPunch {
            radius,
            edge_radius,
        } => FlatPunch::new(radius, edge_radius)?.into(),
        ContactShape::Capsule { radius, length } => Capsule::new(radius, length)?.into(),
        ContactShape::Box { size, edge_radius } => {
            RoundedBox::new(0.5 * Vec3::from(size), edge_radius)?.into()
        }
        ContactShape::Fingertip { radii } => Ellipsoid::new(Vec3::from(radii))?.into(),
        ContactShape::Cone {
            radius,
            opening_angle,
            tip_radius,
            edge_radius,
        } => Cone::new(radius, 0.5 * opening_angle, tip_radius, edge_radius)?.into(),
    })
}
