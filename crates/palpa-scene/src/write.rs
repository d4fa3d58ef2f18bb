//! From a scene back to the text of a scene file.

mod motion;
mod tissues;
mod tool;

use std::path::{Path, PathBuf};

pub(crate) use self::tissues::Names;
use self::tissues::tissue;
use crate::Thickness;
use crate::file::{
    AxisName, AxisSpec, BodyTable, DampingTable, DynamicsName, GeneratorKind, GeneratorTable,
    LayerTable, MeshTable, ModelTable, PressTable, ReferenceTable, SceneFile, ThicknessSpec,
    ThicknessTable,
};
use crate::model::{Dynamics, Mesh, Model};
use crate::scene::{Body, Generator, Layer, Press, Reference, Scene, Skin, Target};
use crate::units::{Length, Pressure, Rate, Share, Time, Velocity};

pub(crate) fn to_toml(scene: &Scene, names: Names) -> String {
    let file = SceneFile {
        body: body(scene, &scene.body),
        layer: scene
            .layers
            .iter()
            .map(|l| layer(scene, l, names))
            .collect(),
        lump: scene
            .lumps
            .iter()
            .map(|l| tool::lump(scene, l, names))
            .collect(),
        tool: tool::tool(&scene.tool),
        press: press(&scene.press),
        device: motion::device(scene.device),
        motion: motion::motion(&scene.motion),
        model: model(&scene.model),
        mesh: mesh(&scene.mesh),
        reference: reference(&scene.reference),
    };
    toml::to_string(&file).expect("a scene consists of texts, numbers and tables only")
}

/// The point of a target that is given by a point, as a scene file writes it.
fn point(target: Target) -> Option<[Length; 3]> {
    match target {
        Target::Point(point) => Some(point.map(Length::from_si)),
        Target::Vertex(_) | Target::Middle => None,
    }
}

/// The vertex of a target that is given by a vertex.
fn vertex(target: Target) -> Option<u32> {
    match target {
        Target::Vertex(vertex) => Some(vertex),
        Target::Point(_) | Target::Middle => None,
    }
}

fn press(press: &Press) -> PressTable {
    PressTable {
        at: point(press.target),
        vertex: vertex(press.target),
        direction: press.direction,
        depth: Length::from_si(press.depth),
        speed: (press.speeds.is_empty()).then_some(Velocity::from_si(press.speed)),
        speeds: press
            .speeds
            .iter()
            .copied()
            .map(Velocity::from_si)
            .collect(),
        hold: Time::from_si(press.hold),
        retract: press.retract,
        cycles: press.cycles,
        step: Some(Length::from_si(press.step)),
    }
}

fn model(model: &Model) -> ModelTable {
    let (dynamics, damping) = match model.dynamics {
        Dynamics::QuasiStatic => (DynamicsName::QuasiStatic, None),
        Dynamics::Implicit(damping) => (
            DynamicsName::Implicit,
            Some(DampingTable {
                mass: Rate::from_si(damping.mass),
                stiffness: Time::from_si(damping.stiffness),
            }),
        ),
    };
    ModelTable {
        kind: model.kind,
        alpha: model.alpha,
        dynamics,
        damping,
        tolerance: model.tolerance,
    }
}

fn mesh(mesh: &Mesh) -> MeshTable {
    MeshTable {
        refine: mesh.refine,
        coarsen: mesh.coarsen,
        near_tool: mesh.near_tool.map(Length::from_si),
        near_lumps: mesh.near_lumps.map(Length::from_si),
        growth: mesh.growth,
        level_growth: mesh.level_growth,
        max_vertices: u32::try_from(mesh.max_vertices).unwrap_or(u32::MAX),
        accuracy: mesh.accuracy.map(Share::from_si),
        max_time: mesh.max_time.map(Time::from_si),
        moves: mesh.moves,
    }
}

fn reference(reference: &Reference) -> ReferenceTable {
    ReferenceTable {
        substeps: reference.substeps,
        solver: reference.solver,
        in_plane: reference.in_plane,
        spring_gain: reference.spring_gain,
        shape_gain: reference.shape_gain,
    }
}

/// The path relative to `base_dir`, as a scene file writes it. A path that is not Unicode loses
/// characters; no scene file contains such a path.
fn relative(scene: &Scene, path: &Path) -> PathBuf {
    let path = path.strip_prefix(&scene.base_dir).unwrap_or(path);
    path.to_string_lossy().into_owned().into()
}

fn body(scene: &Scene, body: &Body) -> BodyTable {
    let cutout = body.cutout.as_ref();
    BodyTable {
        surface: match &body.skin {
            Skin::File(path) => Some(relative(scene, path)),
            Skin::Generated(_) => None,
        },
        generator: match body.skin {
            Skin::File(_) => None,
            Skin::Generated(made) => Some(generator(made)),
        },
        bones: body
            .bones
            .iter()
            .map(|bone| relative(scene, bone))
            .collect(),
        unit: body.unit,
        cutout_radius: cutout.map(|cutout| Length::from_si(cutout.radius)),
        // If the scene presses a vertex, this is the default and need not be written.
        cutout_at: cutout.and_then(|cutout| point(cutout.at)),
        cut_faces: body.cut_faces,
    }
}

fn generator(made: Generator) -> GeneratorTable {
    let mut table = GeneratorTable {
        kind: GeneratorKind::Forearm,
        spacing: Length::from_si(0.0),
        size: None,
        length: None,
        radius: None,
        bone_radius: None,
        scale: None,
    };
    match made {
        Generator::Block { size, spacing } => GeneratorTable {
            kind: GeneratorKind::Block,
            spacing: Length::from_si(spacing),
            size: Some(size.map(Length::from_si)),
            ..table
        },
        Generator::Cylinder {
            length,
            radius,
            bone_radius,
            spacing,
        } => GeneratorTable {
            kind: GeneratorKind::Cylinder,
            spacing: Length::from_si(spacing),
            length: Some(Length::from_si(length)),
            radius: Some(Length::from_si(radius)),
            bone_radius: Some(Length::from_si(bone_radius)),
            ..table
        },
        Generator::Forearm { spacing, scale } => {
            table.spacing = Length::from_si(spacing);
            table.scale = Some(scale);
            table
        }
    }
}

fn layer(scene: &Scene, layer: &Layer, names: Names) -> LayerTable {
    LayerTable {
        tissue: tissue(&layer.tissue, names),
        thickness: layer.thickness.as_ref().map(|thickness| match thickness {
            Thickness::Uniform(length) => ThicknessSpec::Uniform(Length::from_si(*length)),
            Thickness::Along { axis, table } => ThicknessSpec::Varying(ThicknessTable {
                axis: Some(direction(*axis)),
                table: Some(table.iter().map(|row| row.map(Length::from_si)).collect()),
                file: None,
            }),
            Thickness::File(path) => ThicknessSpec::Varying(ThicknessTable {
                axis: None,
                table: None,
                file: Some(relative(scene, path)),
            }),
        }),
        thickness_status: layer.thickness_status,
        thickness_source: layer.thickness_source.clone(),
        levels: u32::try_from(layer.levels).unwrap_or(u32::MAX),
        min_thickness: Some(Length::from_si(layer.min_thickness)),
        prestress: Pressure::from_si(layer.prestress),
    }
}

/// The axis by name, if the vector is one.
fn direction(vector: [f64; 3]) -> AxisSpec {
    match vector {
        [1.0, 0.0, 0.0] => AxisSpec::Name(AxisName::X),
        [0.0, 1.0, 0.0] => AxisSpec::Name(AxisName::Y),
        [0.0, 0.0, 1.0] => AxisSpec::Name(AxisName::Z),
        vector => AxisSpec::Vector(vector),
    }
}
