//! The body: files or a generator, and its cut-out.

use super::{Reader, coordinates, each};
use crate::SceneError;
use crate::error::Site;
use crate::file::{BodyTable, GeneratorKind, GeneratorTable};
use crate::limits;
use crate::scene::{Body, Cutout, Generator, Skin, Target};
use crate::units::Length;

impl Reader<'_> {
    pub(super) fn body(&self, body: BodyTable, pressed: Target) -> Result<Body, SceneError> {
        let at = self.site("body");
        let skin = match (body.surface, body.generator) {
            (Some(surface), None) => Skin::File(self.path(&at.key("surface"), &surface)?),
            (None, Some(table)) if body.bones.is_empty() => {
                Skin::Generated(generator(&at.key("generator"), &table)?)
            }
            (None, Some(_)) => {
                return Err(at
                    .key("bones")
                    .invalid("a generated body brings its own bones; remove `bones`"));
            }
            (Some(_), Some(_)) => {
                return Err(at.key("generator").invalid(
                    "a body is either read or generated; remove `surface` or `generator`",
                ));
            }
            (None, None) => {
                return Err(at.invalid(
                    "the body has no skin; give `surface = \"skin.ply\"` or \
                     `generator = { kind = \"forearm\" }`",
                ));
            }
        };
        let bones_at = at.key("bones");
        if body.bones.len() > limits::MAX_BONES {
            let (n, most) = (body.bones.len(), limits::MAX_BONES);
            return Err(bones_at.invalid(format!(
                "{n} bones are more than the {most} allowed; join them in fewer files"
            )));
        }
        let bones = body
            .bones
            .iter()
            .enumerate()
            .map(|(i, bone)| self.path(&bones_at.index(i), bone))
            .collect::<Result<_, _>>()?;
        Ok(Body {
            skin,
            bones,
            unit: body.unit,
            cutout: cutout(&at, body.cutout_radius, body.cutout_at, pressed)?,
            cut_faces: body.cut_faces,
        })
    }
}

fn cutout(
    at: &Site<'_>,
    radius: Option<Length>,
    middle: Option<[Length; 3]>,
    pressed: Target,
) -> Result<Option<Cutout>, SceneError> {
    let Some(radius) = radius else {
        return match middle {
            None => Ok(None),
            Some(_) => Err(at.key("cutout_at").invalid(
                "a centre without a radius; add `cutout_radius = \"60 mm\"` or remove `cutout_at`",
            )),
        };
    };
    let radius_at = at.key("cutout_radius");
    let radius = radius_at.within(radius, &limits::CUTOUT_RADIUS)?.si();
    let at = match (middle, pressed) {
        (Some(point), _) => Target::Point(coordinates(&at.key("cutout_at"), point)?),
        (None, Target::Middle) => {
            return Err(radius_at.invalid(
                "a cut-out needs a centre; give `cutout_at` here, or `at` or `vertex` in [press]",
            ));
        }
        (None, pressed) => pressed,
    };
    Ok(Some(Cutout { radius, at }))
}

fn generator(at: &Site<'_>, table: &GeneratorTable) -> Result<Generator, SceneError> {
    let spacing_at = at.key("spacing");
    let spacing = spacing_at.within(table.spacing, &limits::SPACING)?.si();
    check_generator_keys(at, table)?;
    let (generator, area, shortest) = match table.kind {
        GeneratorKind::Block => {
            let size = table.size.unwrap_or([0.1, 0.1, 0.04].map(Length::from_si));
            let size = each(&at.key("size"), size, &limits::BLOCK_SIZE)?;
            let generator = Generator::Block { size, spacing };
            (generator, size[0] * size[1], size[0].min(size[1]))
        }
        GeneratorKind::Cylinder => cylinder(at, table, spacing)?,
        GeneratorKind::Forearm => {
            let scale = at
                .key("scale")
                .within(table.scale.unwrap_or(1.0), &limits::SCALE)?;
            // An adult's forearm is about 25 cm long and 25 cm around; the radius of its wrist is
            // 25 mm.
            let area = (0.25 * scale).powi(2);
            (Generator::Forearm { spacing, scale }, area, 0.025 * scale)
        }
    };
    if spacing > shortest {
        return Err(spacing_at.invalid(format!(
            "a spacing of {} is too coarse for this body; take {} at most",
            table.spacing,
            Length::from_si(shortest)
        )));
    }
    let vertices = area / (spacing * spacing);
    if vertices > limits::MAX_VERTICES {
        let finest = (area / limits::MAX_VERTICES).sqrt();
        return Err(spacing_at.invalid(format!(
            "a spacing of {} gives about {vertices:.0} skin vertices, more than the {:.0} allowed; take {:.1} mm or more",
            table.spacing,
            limits::MAX_VERTICES,
            // Rounded up in the first digit that the message shows.
            (finest * 1e4).ceil() / 10.0
        )));
    }
    Ok(generator)
}

/// Refuses keys of another kind of generator.
fn check_generator_keys(at: &Site<'_>, table: &GeneratorTable) -> Result<(), SceneError> {
    let given = [
        ("size", table.size.is_some(), GeneratorKind::Block),
        ("length", table.length.is_some(), GeneratorKind::Cylinder),
        ("radius", table.radius.is_some(), GeneratorKind::Cylinder),
        (
            "bone_radius",
            table.bone_radius.is_some(),
            GeneratorKind::Cylinder,
        ),
        ("scale", table.scale.is_some(), GeneratorKind::Forearm),
    ];
    if let Some((key, ..)) = given
        .iter()
        .find(|&&(_, given, kind)| given && kind != table.kind)
    {
        let keys = given.iter().filter(|&&(.., kind)| kind == table.kind);
        let keys: Vec<_> = keys.map(|(key, ..)| format!("`{key}`")).collect();
        return Err(at.key(key).invalid(
            format!(
                "a {:?} does not take `{key}`; it takes `spacing` and {}",
                table.kind,
                keys.join(", ")
            )
            .to_lowercase(),
        ));
    }
    Ok(())
}

/// A cylinder, the area of its skin (m²), and the largest spacing that it can have (m).
fn cylinder(
    at: &Site<'_>,
    table: &GeneratorTable,
    spacing: f64,
) -> Result<(Generator, f64, f64), SceneError> {
    let length = table.length.unwrap_or(Length::from_si(0.2));
    let length = at.key("length").within(length, &limits::CYLINDER_LENGTH)?;
    let radius = table.radius.unwrap_or(Length::from_si(0.04));
    let radius = at.key("radius").within(radius, &limits::CYLINDER_RADIUS)?;
    let bone_radius = table.bone_radius.unwrap_or(Length::from_si(0.01));
    let bone_at = at.key("bone_radius");
    let bone_radius = bone_at.within(bone_radius, &limits::BONE_RADIUS)?;
    if bone_radius >= radius {
        return Err(bone_at.invalid(format!(
            "a bone of radius {bone_radius} does not fit inside a skin of radius {radius}; \
             make `bone_radius` smaller than `radius`"
        )));
    }
    let girth = std::f64::consts::TAU * radius.si();
    let generator = Generator::Cylinder {
        length: length.si(),
        radius: radius.si(),
        bone_radius: bone_radius.si(),
        spacing,
    };
    let shortest = length.si().min(radius.si());
    Ok((generator, girth * length.si(), shortest))
}
