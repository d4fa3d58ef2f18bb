//! The place that a scene presses, and the direction.

use anyhow::bail;
use nalgebra::Unit;
use palpa_mesh::{LayeredBody, Surface, Vec3};
use palpa_scene::{Scene, Target, Tool};

use crate::build::{BuiltBody, in_mm, nearest};
use crate::note::{Note, xyz};
use crate::skin::{Rim, Skin, SkinPoint};

/// The mesh size near the tool is the mean of the edges within this many tool radii of the press
/// point.
const NEAR_TOOL: f64 = 2.0;
/// A press direction further than this angle from the inward normal (60°) gives a note.
const OBLIQUE_COS: f64 = 0.5;
/// A point named by the scene that is farther from the skin gives a note, m.
const OFF_SKIN: f64 = 10e-3;
/// A point this far from the rim of the skin is refused, unless it is above the rim within the
/// angle (26°), m.
const OFF_RIM: f64 = 1e-3;
const ABOVE_RIM_COS: f64 = 0.9;
/// A vertex within this distance of the place is at the place, m.
const AT_VERTEX: f64 = 1e-9;
/// The tool's footprint is examined at the middles of this many by this many cells.
const CELLS: usize = 40;

/// The place that is pressed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// The skin vertex nearest to the place.
    pub vertex: usize,
    /// The place at rest, m. If the scene names a point, the point of the skin nearest to it.
    pub at: Vec3,
    /// Unit vector along which the tool moves.
    pub direction: Unit<Vec3>,
    /// Depth of the tissue below the place, m.
    pub tissue_depth: f64,
    /// The vertices of the pressed skin between which the place lies.
    pub point: SkinPoint,
    /// The point that the scene names, m; `None` if it names a vertex or nothing.
    pub asked: Option<Vec3>,
}

impl Place {
    /// The place of `scene`'s press on its body as it was grown. A tool that is a node presses the
    /// nearest vertex.
    ///
    /// # Errors
    /// When the scene's point is beyond the rim, the direction leads out of the body, or the depth
    /// leads through it.
    pub fn find(scene: &Scene, built: &BuiltBody, notes: &mut Vec<Note>) -> anyhow::Result<Self> {
        let body = &built.growth.body;
        if !is_between_vertices(scene) {
            return Self::at_vertex(scene, body, built.press_vertex, notes);
        }
        let skin = Skin::new(&body.skin);
        let Some(point) = skin.nearest(built.press_at) else {
            return Self::at_vertex(scene, body, built.press_vertex, notes);
        };
        let inward = skin.inward(&point);
        let is_on_rim = Rim::of(&body.skin).has(&point);
        if let (Some(asked), true) = (asked(scene), is_on_rim) {
            check_over(asked, point.at, inward)?;
        }
        Self::of(scene, body, point, inward, is_on_rim, notes)
    }

    /// The place of `scene`'s press at a skin vertex of the body.
    ///
    /// # Errors
    /// When the direction leads out of the body, or the depth leads through it.
    pub(crate) fn at_vertex(
        scene: &Scene,
        body: &LayeredBody,
        vertex: usize,
        notes: &mut Vec<Note>,
    ) -> anyhow::Result<Self> {
        let inward = -body.skin.vertex_normals()[vertex];
        let mut on_rim = body.cut_faces.iter().flat_map(|face| &face.vertices);
        let is_on_rim = on_rim.any(|&v| v as usize == vertex);
        let point = SkinPoint::vertex(&body.skin, vertex);
        Self::of(scene, body, point, inward, is_on_rim, notes)
    }

    fn of(
        scene: &Scene,
        body: &LayeredBody,
        point: SkinPoint,
        inward: Vec3,
        is_on_rim: bool,
        notes: &mut Vec<Note>,
    ) -> anyhow::Result<Self> {
        let at = point.at;
        let direction = scene.press.direction.map_or(inward, Vec3::from);
        let Some(direction) = Unit::try_new(direction, f64::MIN_POSITIVE) else {
            bail!(
                "the skin has no normal at ({}) mm; give a press direction",
                in_mm(at)
            );
        };
        let slant = direction.dot(&inward);
        if slant <= 0.0 {
            bail!(
                "the press direction ({:.2}, {:.2}, {:.2}) points out of the skin at ({}) mm; turn it, or leave it out to \
                 press along the inward normal",
                direction.x,
                direction.y,
                direction.z,
                in_mm(at)
            );
        }
        if slant < OBLIQUE_COS {
            notes.push(Note::ObliquePress {
                angle: slant.acos(),
            });
        }
        let tissue_depth = point.column_length(body);
        if scene.press.depth >= tissue_depth {
            bail!(
                "press depth {:.2} mm reaches beyond the body: at ({}) mm the tissue is {:.2} mm deep; press less deep, \
                 or at another place",
                scene.press.depth * 1e3,
                in_mm(at),
                tissue_depth * 1e3,
            );
        }
        if is_on_rim {
            notes.push(Note::PressOnCutFace);
        }
        let asked = asked(scene);
        if let Some(asked) = asked {
            note_asked(scene, asked, &point, &body.skin, notes);
        }
        Ok(Self {
            vertex: nearest(&body.skin, at),
            at,
            direction,
            tissue_depth,
            point,
            asked,
        })
    }

    /// The same place on a body that was refined from the one it was found on.
    #[must_use]
    pub(super) fn on(self, body: &LayeredBody) -> Self {
        let skin = &body.skin;
        let vertex = nearest(skin, self.at);
        let is_at_vertex = (skin.points[vertex] - self.at).norm() < AT_VERTEX;
        let point = match Skin::new(skin).nearest(self.at) {
            Some(point) if !is_at_vertex => point,
            _ => SkinPoint::vertex(skin, vertex),
        };
        Self {
            vertex,
            point,
            ..self
        }
    }

    /// Distance of the point that the scene names from the place, m; `None` if it names none.
    pub fn distance_asked(&self) -> Option<f64> {
        self.asked.map(|asked| (asked - self.at).norm())
    }
}

/// Whether the scene's tool presses a point that need not be a vertex.
pub(super) fn is_between_vertices(scene: &Scene) -> bool {
    matches!(scene.press.target, Target::Point(_)) && !matches!(scene.tool, Tool::Node)
}

fn asked(scene: &Scene) -> Option<Vec3> {
    match scene.press.target {
        Target::Point(point) => Some(point.into()),
        Target::Vertex(_) | Target::Middle => None,
    }
}

/// Refuses a point beyond the rim of the skin or in a cut face. `at` is the nearest point of the
/// skin, on the rim.
fn check_over(asked: Vec3, at: Vec3, inward: Vec3) -> anyhow::Result<()> {
    let off = asked - at;
    let distance = off.norm();
    if distance > OFF_RIM && -off.dot(&inward) < ABOVE_RIM_COS * distance {
        bail!(
            "the point ({}) mm is not over the skin: it is {:.1} mm beyond the rim of the skin or inside a cut face, and \
             the nearest point of the skin is ({}) mm; press a point of the skin",
            in_mm(asked),
            distance * 1e3,
            in_mm(at)
        );
    }
    Ok(())
}

/// Adds a note if the point that the scene names is far from the skin, and if a tool that is a node
/// cannot press there.
fn note_asked(
    scene: &Scene,
    asked: Vec3,
    pressed: &SkinPoint,
    skin: &Surface,
    notes: &mut Vec<Note>,
) {
    let on_skin = Skin::new(skin).nearest(asked).map_or(asked, |p| p.at);
    let distance = (asked - on_skin).norm();
    if distance > OFF_SKIN {
        notes.push(Note::PlaceOffSkin {
            asked: xyz(asked),
            at: xyz(on_skin),
            distance,
        });
    }
    let distance = (pressed.at - on_skin).norm();
    if matches!(scene.tool, Tool::Node) && distance > AT_VERTEX {
        notes.push(Note::NodeBeside { distance });
    }
}

/// Adds a note if the tool's footprint reaches beyond the rim of the skin.
pub(super) fn note_overhang(
    scene: &Scene,
    body: &LayeredBody,
    place: &Place,
    notes: &mut Vec<Note>,
) {
    let share = overhang(scene, &body.skin, place);
    if share > 0.0 {
        notes.push(Note::ToolOverRim { share });
    }
}

/// Share of the tool's footprint that is beyond the rim of the skin, 0 to 1. The footprint is the
/// part of the plane through the place, across the press, that the tool covers at its full depth.
fn overhang(scene: &Scene, skin: &Surface, place: &Place) -> f64 {
    let direction = place.direction.into_inner();
    let (reach, radius) = reach(scene);
    let axes = if let Some(tool) = scene.tool.contact() {
        tool.axes(direction.into()).map(Vec3::from)
    } else {
        let x = direction.cross(&least_along(&direction)).normalize();
        [x, direction.cross(&x), -direction]
    };
    let (index, rim) = (Skin::new(skin), Rim::of(skin));
    let (mut n, mut n_off) = (0, 0);
    for cell in 0..CELLS * CELLS {
        let share = |i: usize| (2.0 * i as f64 + 1.0) / CELLS as f64 - 1.0;
        let [x, y] = [share(cell % CELLS), share(cell / CELLS)];
        let [x, y] = [x * (reach[0] + radius), y * (reach[1] + radius)];
        let [past_x, past_y] = [x.abs() - reach[0], y.abs() - reach[1]].map(|d| d.max(0.0));
        if past_x.hypot(past_y) > radius {
            continue;
        }
        n += 1;
        let q = place.at + axes[0] * x + axes[1] * y;
        let Some(over) = index.nearest(q).filter(|over| rim.has(over)) else {
            continue;
        };
        let inward = index.inward(&over);
        let off = q - over.at;
        let aside = off - inward * off.dot(&inward);
        n_off += usize::from(aside.norm() > AT_VERTEX);
    }
    f64::from(n_off as u32) / f64::from(n.max(1))
}

/// Half the length and width of the line or rectangle that the tool presses with, and the radius
/// around it that the tool reaches at its full depth, m.
pub(super) fn reach(scene: &Scene) -> ([f64; 2], f64) {
    match scene.tool {
        Tool::Disc { radius } => ([0.0; 2], radius),
        Tool::Node => ([0.0; 2], 0.0),
        Tool::Contact(tool) => tool.shape.reach(scene.press.depth),
    }
}

/// The unit vector of the axis that is most nearly across a vector.
fn least_along(v: &Vec3) -> Vec3 {
    let mut axis = Vec3::zeros();
    axis[v.iamin()] = 1.0;
    axis
}

/// Length of the column under a skin vertex, m.
pub fn column_length(body: &LayeredBody, v: usize) -> f64 {
    let p = |l: usize| body.positions[body.node(v, l)];
    (1..body.n_levels).map(|l| (p(l) - p(l - 1)).norm()).sum()
}

/// Mean length of the skin's edges near a place, m; if the tool is smaller than the mesh, of the
/// edges at the nearest vertex.
pub(super) fn mesh_size_near(body: &LayeredBody, at: Vec3, radius: f64) -> f64 {
    let skin = &body.skin;
    let edges: Vec<(f64, f64)> = skin
        .edges()
        .iter()
        .map(|&[a, b]| {
            let (a, b) = (skin.points[a as usize], skin.points[b as usize]);
            ((a - at).norm().min((b - at).norm()), (a - b).norm())
        })
        .collect();
    let nearest = edges.iter().map(|e| e.0).fold(f64::INFINITY, f64::min);
    let reach = (NEAR_TOOL * radius).max(nearest);
    let near: Vec<f64> = edges.iter().filter(|e| e.0 <= reach).map(|e| e.1).collect();
    near.iter().sum::<f64>() / near.len().max(1) as f64
}
