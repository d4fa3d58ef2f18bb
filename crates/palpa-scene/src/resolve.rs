//! From the scene file to the scene: checks ranges and combinations, fills in defaults, and looks
//! tissues up in the catalogue.

mod body;
pub(crate) mod law;
mod layers;
mod lumps;
mod model;
mod motion;
mod tissues;
mod tool;

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::error::{Document, Site};
use crate::file::{AxisName, AxisSpec, PressTable, SceneFile};
use crate::limits::{self, Limits};
use crate::scene::{Generator, Press, Scene, Skin, Target};
use crate::units::{Kind, Length, Quantity, Velocity};
use crate::{SceneError, Thickness};

/// Default number of steps down.
const DEFAULT_STEPS: f64 = 16.0;
/// Default speed of the tool, m/s.
const DEFAULT_SPEED: f64 = 10e-3;

pub(crate) fn load(path: &Path) -> Result<Scene, SceneError> {
    let mut bytes = Vec::new();
    // One byte more than allowed distinguishes a file that is too large from one that just fits.
    File::open(path)
        .and_then(|file| file.take(limits::MAX_FILE + 1).read_to_end(&mut bytes))
        .map_err(|source| SceneError::Io {
            path: path.to_owned(),
            source,
        })?;
    let base_dir = path.parent().unwrap_or(Path::new(""));
    match String::from_utf8(bytes) {
        Ok(text) => parse(&text, base_dir, Some(path)),
        Err(error) => {
            let valid = error.utf8_error().valid_up_to();
            let text = String::from_utf8_lossy(&error.as_bytes()[..valid]).into_owned();
            let document = Document {
                text: &text,
                file: Some(path),
            };
            Err(document.not_text(valid))
        }
    }
}

pub(crate) fn parse(text: &str, base_dir: &Path, file: Option<&Path>) -> Result<Scene, SceneError> {
    let document = Document { text, file };
    if text.len() as u64 > limits::MAX_FILE {
        return Err(SceneError::TooLarge {
            place: document.whole(String::new()).into(),
            limit: limits::MAX_FILE,
        });
    }
    let written = toml::Deserializer::parse(text).map_err(|e| document.toml_error(&e, true))?;
    let written: SceneFile =
        serde::Deserialize::deserialize(written).map_err(|e| document.toml_error(&e, false))?;
    let reader = Reader { document, base_dir };
    let press = reader.press(&written.press)?;
    let layers = reader.layers(written.layer)?;
    let tool = reader.tool(&written.tool)?;
    let scene = Scene {
        base_dir: base_dir.to_owned(),
        body: reader.body(written.body, press.target)?,
        layers,
        lumps: reader.lumps(written.lump, press.target)?,
        device: motion::device(&written.device),
        motion: reader.motion(&written.motion, &press)?,
        press,
        model: reader.model(&written.model)?,
        mesh: reader.mesh(&written.mesh, &tool)?,
        tool,
        reference: reader.reference(&written.reference)?,
    };
    reader.depths(&scene)?;
    Ok(scene)
}

struct Reader<'a> {
    document: Document<'a>,
    base_dir: &'a Path,
}

impl<'a> Reader<'a> {
    fn site(&self, key: &'static str) -> Site<'a> {
        self.document.site(key)
    }

    fn path(&self, site: &Site<'_>, path: &Path) -> Result<PathBuf, SceneError> {
        if path.as_os_str().is_empty() {
            return Err(site.invalid("the path is empty; name a file, relative to this scene"));
        }
        Ok(self.base_dir.join(path))
    }

    fn press(&self, press: &PressTable) -> Result<Press, SceneError> {
        let at = self.site("press");
        let target = match (press.at, press.vertex) {
            (None, None) => Target::Middle,
            (Some(point), None) => Target::Point(coordinates(&at.key("at"), point)?),
            (None, Some(vertex)) => Target::Vertex(vertex),
            (Some(_), Some(_)) => {
                return Err(at
                    .key("vertex")
                    .invalid("the place is given twice; remove `at` or `vertex`"));
            }
        };
        let direction = match press.direction {
            None => None,
            Some(vector) => Some(unit_vector(&at.key("direction"), vector)?),
        };
        let speeds = speeds(&at, press)?;
        let cycles = at.key("cycles").within(press.cycles, &limits::CYCLES)?;
        if cycles > 1 && !press.retract {
            return Err(at.key("cycles").invalid(
                "more than one cycle needs the way back; remove `retract = false` or `cycles`",
            ));
        }
        let depth = at.key("depth").within(press.depth, &limits::DEPTH)?;
        let step = match press.step {
            None => depth.si() / DEFAULT_STEPS,
            Some(step) => {
                // A step that divides the depth evenly may miss the limit by rounding.
                let finest = depth.si() / limits::MAX_STEPS;
                if step > depth || step.si() < finest * (1.0 - 1e-9) {
                    return Err(at.key("step").invalid(format!(
                        "a step of {step} does not fit a depth of {depth}; take {} to {depth}",
                        Length::from_si(finest)
                    )));
                }
                step.si()
            }
        };
        Ok(Press {
            target,
            direction,
            depth: depth.si(),
            speed: speeds[0],
            speeds: if press.speeds.is_empty() {
                Vec::new()
            } else {
                speeds
            },
            hold: at.key("hold").within(press.hold, &limits::HOLD)?.si(),
            retract: press.retract,
            cycles,
            step,
        })
    }

    /// Checks body, layers and press together: the layers reach a base, and the press ends above
    /// the base.
    fn depths(&self, scene: &Scene) -> Result<(), SceneError> {
        let at = self.site("layer");
        let last = scene.layers.len() - 1;
        let reaches_down = scene.layers[last].thickness.is_none();
        if reaches_down && matches!(scene.body.skin, Skin::File(_)) && scene.body.bones.is_empty() {
            return Err(at.index(last).invalid(
                "the layer has no thickness and the body no bone to reach down to; give `thickness`, \
                 or `bones` in [body]",
            ));
        }
        let body_depth = match scene.body.skin {
            Skin::Generated(Generator::Block { size, .. }) => Some(size[2]),
            Skin::Generated(Generator::Cylinder {
                radius,
                bone_radius,
                ..
            }) => Some(radius - bone_radius),
            Skin::Generated(Generator::Forearm { .. }) | Skin::File(_) => None,
        };
        let layers: Option<f64> = scene
            .layers
            .iter()
            .filter_map(|layer| layer.thickness.as_ref())
            .map(Thickness::largest)
            .sum();
        // The thicknesses in a file are not known here; growth and press check them later.
        let Some(layers) = layers else { return Ok(()) };
        if let Some(depth) = body_depth {
            let too_thick = if reaches_down {
                layers >= depth
            } else {
                layers > depth * (1.0 + 1e-9)
            };
            if too_thick {
                return Err(at.index(last).invalid(format!(
                    "the layers are {} thick together, the body is {} deep; make the layers thinner or the body deeper",
                    Length::from_si(layers),
                    Length::from_si(depth)
                )));
            }
        }
        let room = if reaches_down {
            body_depth
        } else {
            Some(layers)
        };
        if let Some(room) = room.filter(|&room| scene.press.depth >= room) {
            return Err(self.site("press").key("depth").invalid(format!(
                "a press of {} goes through the body, which is {} deep; give a smaller `depth` in [press]",
                Length::from_si(scene.press.depth),
                Length::from_si(room)
            )));
        }
        Ok(())
    }
}

/// The speed, or the speeds of a sweep, in m/s; at least one.
fn speeds(at: &Site<'_>, press: &PressTable) -> Result<Vec<f64>, SceneError> {
    let within = |at: Site<'_>, speed| Ok(at.within(speed, &limits::SPEED)?.si());
    let (n, most) = (press.speeds.len(), limits::MAX_SPEEDS);
    let sweep_at = at.key("speeds");
    match press.speed {
        Some(_) if n > 0 => {
            Err(sweep_at.invalid("the speed is given twice; remove `speed` or `speeds`"))
        }
        None if n > most => Err(sweep_at.invalid(format!(
            "{n} speeds are more than the {most} allowed; take fewer"
        ))),
        None if n > 0 => (press.speeds.iter().enumerate())
            .map(|(i, &speed)| within(sweep_at.index(i), speed))
            .collect(),
        speed => {
            let speed = speed.unwrap_or(Velocity::from_si(DEFAULT_SPEED));
            Ok(vec![within(at.key("speed"), speed)?])
        }
    }
}

fn coordinates(at: &Site<'_>, point: [Length; 3]) -> Result<[f64; 3], SceneError> {
    each(at, point, &limits::COORDINATE)
}

pub(crate) fn each<K: Kind>(
    at: &Site<'_>,
    values: [Quantity<K>; 3],
    limits: &Limits<Quantity<K>>,
) -> Result<[f64; 3], SceneError> {
    let mut si = [0.0; 3];
    for (i, value) in values.into_iter().enumerate() {
        si[i] = at.index(i).within(value, limits)?.si();
    }
    Ok(si)
}

/// The unit vector given by the name of an axis or by three numbers.
fn direction(at: &Site<'_>, axis: AxisSpec) -> Result<[f64; 3], SceneError> {
    match axis {
        AxisSpec::Name(AxisName::X) => Ok([1.0, 0.0, 0.0]),
        AxisSpec::Name(AxisName::Y) => Ok([0.0, 1.0, 0.0]),
        AxisSpec::Name(AxisName::Z) => Ok([0.0, 0.0, 1.0]),
        AxisSpec::Vector(vector) => unit_vector(at, vector),
    }
}

fn unit_vector(at: &Site<'_>, vector: [f64; 3]) -> Result<[f64; 3], SceneError> {
    // Scaled first, so that the squares neither overflow nor vanish.
    let largest = vector
        .iter()
        .fold(0.0, |largest: f64, x| largest.max(x.abs()));
    if largest <= 0.0 || vector.iter().any(|x| !x.is_finite()) {
        return Err(at.invalid("a direction needs three finite numbers that are not all zero"));
    }
    let scaled = vector.map(|x| x / largest);
    let length = scaled.iter().map(|x| x * x).sum::<f64>().sqrt();
    // A vector that is a unit vector already stays unchanged, bit for bit.
    Ok(if (length * largest - 1.0).abs() < 1e-14 {
        vector
    } else {
        scaled.map(|x| x / length)
    })
}
