//! The scene of a body that grows from a user's surface: layers of a template, and a tool and a press
//! that fit the size of the body.

use std::path::Path;

use palpa_scene::{LengthUnit, Scene};
use palpa_viewer::control::{Template, TemplateInfo, TemplateLayer};
use serde_json::{Value, json};

/// Thickness of all layers together, as a share of the radius of a closed body: columns reach 0.9 radii.
const OF_RADIUS: f64 = 0.7;
/// The same of an open sheet, as a share of its size; at most this, m.
const OF_SHEET: f64 = 0.08;
const MOST_IN_SHEET: f64 = 25e-3;
/// Least and largest thickness of all layers together, m. Deeper tissue is hardly felt.
const DEPTH: std::ops::RangeInclusive<f64> = 1e-3..=0.06;
/// Most of this share of the depth for the layers above the last.
const ABOVE_LAST: f64 = 0.5;
/// The tool's radius as a share of the body's, and its range, m.
const TOOL_SHARE: f64 = 0.4;
const TOOL: (f64, f64) = (2e-3, 10e-3);
/// Depth of the press as a share of the layers, and its largest value, m.
const PRESS_SHARE: f64 = 0.35;
const MOST_PRESS: f64 = 6e-3;

/// The dimensions of a surface that matter for its layers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Dimensions {
    /// From corner to corner of its bounding box.
    pub(super) diagonal: f64,
    /// Radius of the long cylinder with the same volume for its area; `None` for a sheet.
    pub(super) radius: Option<f64>,
    /// Where a closed body is pressed at first; `None` for a sheet, which is pressed in its middle.
    pub(super) press: Option<[f64; 3]>,
}

impl Dimensions {
    /// The same in another unit.
    pub(super) fn scaled(self, factor: f64) -> Self {
        Self {
            diagonal: self.diagonal * factor,
            radius: self.radius.map(|radius| radius * factor),
            press: self.press.map(|p| p.map(|x| x * factor)),
        }
    }

    /// Thickness of all layers together.
    fn depth(self) -> f64 {
        let depth = match self.radius {
            Some(radius) => OF_RADIUS * radius,
            None => (OF_SHEET * self.diagonal).min(MOST_IN_SHEET),
        };
        depth.clamp(*DEPTH.start(), *DEPTH.end())
    }
}

/// A layer of a template: its tissue, whose values are those of the catalogue without their relaxation,
/// and its thickness in a large body, m; the last one takes the rest.
struct Layer {
    name: &'static str,
    tissue: fn() -> Value,
    thickness: f64,
}

fn skin() -> Value {
    json!({ "name": "skin", "young": "210 kPa", "poisson": 0.45 })
}

fn fat() -> Value {
    json!({ "name": "fat", "c10": "0.42 kPa", "bulk": "36 kPa" })
}

fn muscle() -> Value {
    json!({ "name": "muscle", "young": "22 kPa", "poisson": 0.45 })
}

fn silicone() -> Value {
    json!({ "name": "soft silicone", "young": "20 kPa", "poisson": 0.48 })
}

fn layers(template: Template) -> Vec<Layer> {
    let layer = |name, tissue, thickness| Layer {
        name,
        tissue,
        thickness,
    };
    let (skin, fat, muscle) = (
        |thickness| layer("skin", skin, thickness),
        |thickness| layer("fat", fat, thickness),
        layer("muscle", muscle, 0.0),
    );
    match template {
        Template::Limb => vec![skin(1.5e-3), fat(4e-3), muscle],
        Template::Thin => vec![skin(1e-3), fat(1.5e-3), muscle],
        Template::Fat => vec![skin(2e-3), fat(15e-3), muscle],
        Template::Phantom => vec![layer("soft silicone", silicone, 0.0)],
    }
}

/// Thicknesses of a template's layers for a body of this size, m, to a hundredth of a millimetre.
fn thicknesses(layers: &[Layer], size: Dimensions) -> Vec<f64> {
    let depth = size.depth();
    let above: f64 = layers.iter().map(|layer| layer.thickness).sum();
    let scale = if above > 0.0 {
        (ABOVE_LAST * depth / above).min(1.0)
    } else {
        1.0
    };
    let rounded = |x: f64| (x * 1e5).round() / 1e5;
    let mut all: Vec<f64> = (layers.iter())
        .map(|layer| rounded((layer.thickness * scale).max(1e-5)))
        .collect();
    let above: f64 = all
        .split_last()
        .map_or(0.0, |(_, above)| above.iter().sum());
    if let Some(last) = all.last_mut() {
        *last = rounded(depth - above);
    }
    all
}

/// The layers of every template for a body of this size.
pub(super) fn infos(size: Dimensions) -> Vec<TemplateInfo> {
    [
        Template::Limb,
        Template::Thin,
        Template::Fat,
        Template::Phantom,
    ]
    .into_iter()
    .map(|template| {
        let layers = layers(template);
        let thicknesses = thicknesses(&layers, size);
        let layers = layers.iter().zip(thicknesses);
        TemplateInfo {
            template,
            layers: layers
                .map(|(layer, thickness)| TemplateLayer {
                    tissue: layer.name.to_owned(),
                    thickness,
                })
                .collect(),
        }
    })
    .collect()
}

/// A body to be grown.
pub(super) struct Body<'a> {
    /// Name of the skin's file.
    pub(super) skin: &'a str,
    /// Names of the bones' files.
    pub(super) bones: &'a [String],
    /// Unit of the files.
    pub(super) unit: LengthUnit,
    /// Dimensions of the skin, m.
    pub(super) size: Dimensions,
}

impl Body<'_> {
    /// The scene of the body with the layers of a template; its files are in `folder`.
    ///
    /// # Errors
    /// When the names cannot be written in a scene.
    pub(super) fn scene(&self, template: Template, folder: &Path) -> anyhow::Result<Scene> {
        let layers = layers(template);
        let thicknesses = thicknesses(&layers, self.size);
        let total: f64 = thicknesses.iter().sum();
        let n = layers.len();
        let mm = |metres: f64| format!("{} mm", (metres * 1e5).round() / 100.0);
        let table = |(i, (layer, thickness)): (usize, (&Layer, f64))| {
            let mut table = json!({
                "tissue": (layer.tissue)(),
                "thickness_status": "assumed",
                "thickness_source": "of a template, not of this body",
            });
            let is_to_the_bone = i + 1 == n && !self.bones.is_empty();
            if !is_to_the_bone {
                table["thickness"] = mm(thickness).into();
            }
            table
        };
        let layers: Vec<Value> = (layers.iter().zip(thicknesses).enumerate())
            .map(table)
            .collect();
        let radius = self.size.radius.unwrap_or(0.25 * self.size.diagonal);
        let tool = (TOOL_SHARE * radius).clamp(TOOL.0, TOOL.1);
        let depth = (PRESS_SHARE * total).min(MOST_PRESS);
        let mut press = json!({ "depth": mm(depth) });
        if let Some(point) = self.size.press {
            press["at"] = json!(point.map(mm));
        }
        let scene = json!({
            "body": { "surface": self.skin, "bones": self.bones, "unit": self.unit },
            "layer": layers,
            "tool": { "shape": "sphere", "radius": mm(tool) },
            "press": press,
            "mesh": { "moves": true },
            "device": { "preset": "falcon", "grip": "medium" },
            "motion": { "kind": "press", "depth": mm(depth), "speed": "30 mm/s", "hold": "1 s", "length": "20 mm", "along": "x" },
        });
        Ok(Scene::parse(&toml::to_string(&scene)?, folder)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpa_scene::Target;

    fn closed(radius: f64) -> Dimensions {
        Dimensions {
            diagonal: 5.0 * radius,
            radius: Some(radius),
            press: Some([0.0, 0.0, radius]),
        }
    }

    #[test]
    fn every_template_makes_a_scene_for_bodies_of_every_size() {
        let sheet = Dimensions {
            diagonal: 0.3,
            radius: None,
            press: None,
        };
        let sizes = [
            closed(1e-4),
            closed(4e-3),
            closed(35e-3),
            closed(0.5),
            sheet,
        ];
        for size in sizes {
            for info in infos(size) {
                let body = Body {
                    skin: "skin.stl",
                    bones: &[],
                    unit: LengthUnit::Mm,
                    size,
                };
                let scene = body.scene(info.template, Path::new("folder")).unwrap();
                let written: Vec<&str> =
                    (scene.layers.iter().map(|l| l.tissue.name.as_str())).collect();
                let said: Vec<&str> = info.layers.iter().map(|l| l.tissue.as_str()).collect();
                assert_eq!(written, said);
                let sum: f64 = info.layers.iter().map(|l| l.thickness).sum();
                assert!(scene.press.depth < 0.5 * sum, "{size:?} {info:?}");
                assert_eq!(scene.press.target == Target::Middle, size.press.is_none());
                let bones = ["bone.ply".to_owned()];
                let body = Body {
                    bones: &bones,
                    ..body
                };
                let scene = body.scene(info.template, Path::new("folder")).unwrap();
                assert!(scene.layers.last().unwrap().thickness.is_none());
                assert_eq!(scene.body.bones, [Path::new("folder/bone.ply")]);
            }
        }
    }

    #[test]
    fn a_limb_has_the_layers_of_the_gallerys_forearm() {
        let limb = &infos(closed(40e-3))[0];
        let thickness: Vec<f64> = limb.layers.iter().map(|l| l.thickness).collect();
        assert_eq!(thickness, [1.5e-3, 4e-3, 22.5e-3]);
    }
}
