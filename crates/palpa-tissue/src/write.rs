//! From the scene back to the text of a scene file.

use std::path::{Path, PathBuf};

use crate::file::{
    AxisName, AxisSpec, BodyTable, GeneratorKind, GeneratorTable, LayerTable, PressTable,
    ReferenceTable, SceneFile, ThicknessSpec, ThicknessTable, TissueSpec, TissueTable, ToolShape,
    ToolTable,
};
use crate::scene::{Body, Generator, Layer, Scene, Skin, Target, Tool};
use crate::units::{Density, Length, Pressure, Stiffness, Time, Velocity};
use crate::{Law, Thickness, Tissue, catalogue};

pub(crate) fn to_toml(scene: &Scene) -> String {
    let at = |target| match target {
        Target::Point(point) => Some(point.map(Length::from_si)),
        Target::Vertex(_) | Target::Middle => None,
    };
    let file = SceneFile {
        body: body(scene, &scene.body),
        layer: scene.layers.iter().map(|l| layer(scene, l)).collect(),
        tool: match scene.tool {
            Tool::Disc { radius } => ToolTable {
                shape: ToolShape::Disc,
                radius: Some(Length::from_si(radius)),
            },
            Tool::Node => ToolTable {
                shape: ToolShape::Node,
                radius: None,
            },
        },
        press: PressTable {
            at: at(scene.press.target),
            vertex: match scene.press.target {
                Target::Vertex(vertex) => Some(vertex),
                Target::Point(_) | Target::Middle => None,
            },
            direction: scene.press.direction,
            depth: Length::from_si(scene.press.depth),
            speed: Velocity::from_si(scene.press.speed),
            hold: Time::from_si(scene.press.hold),
            retract: scene.press.retract,
            step: Some(Length::from_si(scene.press.step)),
        },
        reference: ReferenceTable {
            substeps: scene.reference.substeps,
            solver: scene.reference.solver,
            in_plane: scene.reference.in_plane,
            spring_gain: scene.reference.spring_gain,
            shape_gain: scene.reference.shape_gain,
        },
    };
    toml::to_string(&file).expect("a scene consists of texts, numbers and tables only")
}

/// The path as a scene in `base_dir` writes it; one that is not Unicode, which no scene file gives, loses characters.
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
        cutout_at: cutout.and_then(|cutout| match cutout.at {
            Target::Point(point) => Some(point.map(Length::from_si)),
            // The place that is pressed, which needs no second mention.
            Target::Vertex(_) | Target::Middle => None,
        }),
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

fn layer(scene: &Scene, layer: &Layer) -> LayerTable {
    LayerTable {
        tissue: tissue(&layer.tissue),
        thickness: layer.thickness.as_ref().map(|thickness| match thickness {
            Thickness::Uniform(length) => ThicknessSpec::Uniform(Length::from_si(*length)),
            Thickness::Along { axis, table } => ThicknessSpec::Varying(ThicknessTable {
                axis: Some(match axis {
                    [1.0, 0.0, 0.0] => AxisSpec::Name(AxisName::X),
                    [0.0, 1.0, 0.0] => AxisSpec::Name(AxisName::Y),
                    [0.0, 0.0, 1.0] => AxisSpec::Name(AxisName::Z),
                    vector => AxisSpec::Vector(*vector),
                }),
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
    }
}

fn tissue(tissue: &Tissue) -> TissueSpec {
    if catalogue().contains(tissue) {
        return TissueSpec::Name(tissue.name.clone());
    }
    let mut table = TissueTable {
        name: tissue.name.clone(),
        young: None,
        poisson: None,
        spring: None,
        density: tissue.density.as_ref().map(|d| Density::from_si(d.value)),
        source: String::new(),
    };
    match &tissue.law {
        Law::Elastic { young, poisson } => {
            table.young = Some(Pressure::from_si(young.value));
            // A ratio that is not the scene's own is the default, and stays so.
            table.poisson = (poisson.status == young.status).then_some(poisson.value);
            table.source.clone_from(&young.source);
        }
        Law::Spring { constant } => {
            table.spring = Some(Stiffness::from_si(constant.value));
            table.source.clone_from(&constant.source);
        }
    }
    TissueSpec::Inline(table)
}
