//! Refines the body where it is pressed and around lumps, and finds the skin under a bonded disc.

use nalgebra::Unit;
use palpa_fem::lump::{Lump, LumpShape};
use palpa_mesh::refine::{
    Circle, RefineParams, Refined, Slide, along, imprint_circle, mean_depths, near_depth,
    near_points, parts_for, refine, slide_vertices, split_levels,
};
use palpa_mesh::{Coarsening, LayeredBody, Surface, SurfaceIndex, Vec3};
use palpa_scene::{Scene, Target, Tool};

use super::place::{is_between_vertices, mesh_size_near, note_overhang, reach};
use super::{Place, nodes_under_disc};
use crate::build::{BuiltBody, Pressed, nearest};
use crate::note::{Note, xyz};
use crate::skin::Skin;

/// Largest number of levels that splitting may lead to: the cost grows with the cube of the number.
const MOST_LEVELS: usize = 24;
/// Relative tolerance of the radius of the circle with the patch's area, compared to the disc's,
/// and the number of attempts.
const RADIUS_TOLERANCE: f64 = 1e-4;
const TRIES: usize = 5;
/// Columns converge towards a bone. For a lump near the bone, the skin above is therefore refined
/// over a wider area and less finely, by up to this factor.
const MOST_CONVERGENCE: f64 = 4.0;

/// Halving leaves triangles whose longest edge is between half and the whole of the requested
/// length. With this multiple of the wanted length as the request, the mean edge has the wanted
/// length.
const SLACK: f64 = 1.4;

/// Largest distance of a coarsened skin from the given one: under the tool, m; its increase beyond, as a
/// share of the distance; and away from the tool, m.
const DEVIATION: f64 = 0.05e-3;
const DEVIATION_GROWTH: f64 = 0.03;
const DEVIATION_AWAY: f64 = 1e-3;
/// The same where the tool may press anywhere, m.
const DEVIATION_ANYWHERE: f64 = 0.15e-3;
/// The same anywhere, as a share of the thickness of the tissue.
const DEVIATION_OF_THICKNESS: f64 = 0.02;

/// An interval that is too high by less than this factor is not split: a new level would run
/// through the whole body.
const SPARED: f64 = 1.05;

/// Factor on a part of an interval, so that rounding does not add another part.
const ROUNDED: f64 = 1.001;

/// Arguments: index of an interval, and two places in it as shares of its height. Returns the
/// largest wanted height between them, m.
type LevelWish = Box<dyn Fn(usize, f64, f64) -> f64>;

/// Triangles within this multiple of the tool's reach are near it, and intervals above this multiple
/// of its contact radius near the skin.
pub(crate) const NEAR: f64 = 1.5;

/// A wanted size that grows with the distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Graded {
    /// Size at distance 0, m.
    pub h: f64,
    /// Increase of the size with the distance, as a share of the distance.
    pub growth: f64,
    /// Distance from which on things are far, m.
    pub border: f64,
    /// Factor on near sizes.
    pub near: f64,
    /// Factor on far sizes.
    pub far: f64,
}

impl Graded {
    fn even(h: f64, growth: f64) -> Self {
        Self {
            h,
            growth,
            border: f64::INFINITY,
            near: 1.0,
            far: 1.0,
        }
    }

    /// The same with another size at distance 0.
    fn looser(self, factor: f64) -> Self {
        Self {
            h: factor * self.h,
            ..self
        }
    }

    /// The size at a distance. All in m.
    pub fn at(&self, distance: f64) -> f64 {
        let factor = if distance < self.border {
            self.near
        } else {
            self.far
        };
        factor * (self.h + self.growth * distance)
    }
}

/// Growth of the heights of intervals under a flat tool with a rounded edge, relative to that of the
/// skin's edges: errors near such a tool are small, those of the intervals below it are not.
const FLAT_GROWTH: f64 = 0.5;

/// Sizes of the mesh near the tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sizes {
    /// Lengths of the skin's edges, by distance from the part of the skin that the tool reaches.
    pub skin: Graded,
    /// Heights of the intervals between levels, by depth.
    pub levels: Graded,
    /// Whether triangles that are a little too large are divided into two instead of four
    /// ([`RefineParams::divides_in_two`]).
    pub divides_in_two: bool,
    /// Least number of intervals of a layer that is softer than what lies under it, where the tool is
    /// near it. It is squeezed out sideways, fastest in its middle, which two intervals make 7 % too
    /// stiff and three 2 %, however thin the layer is.
    pub in_squeezed: usize,
    /// Whether all intervals are then divided in two.
    pub halves_levels: bool,
}

impl Sizes {
    /// The sizes that the scene asks for; `None` for a tool that needs no refinement.
    pub fn of(scene: &Scene) -> Option<Self> {
        let h = scene.mesh.near_tool_of(&scene.tool)?;
        Some(Self::graded(scene, h))
    }

    /// Sizes of `h` (m) at the tool that grow as the scene says.
    pub fn graded(scene: &Scene, h: f64) -> Self {
        let mesh = &scene.mesh;
        Self::growing(scene, h, mesh.growth_of_edges(), mesh.growth_of_levels())
    }

    /// Sizes of `h` (m) at the tool that grow by `growth` with the distance.
    pub fn even(scene: &Scene, h: f64, growth: f64) -> Self {
        Self::growing(scene, h, growth, growth)
    }

    fn growing(scene: &Scene, h: f64, growth: f64, of_levels: f64) -> Self {
        let graded = Graded::even(h, growth);
        let (_, radius) = reach(scene);
        let below = if scene.tool.is_flat() {
            FLAT_GROWTH
        } else {
            1.0
        };
        Self {
            skin: Graded {
                border: (NEAR - 1.0) * radius,
                ..graded
            },
            levels: Graded {
                border: NEAR * scene.tool.contact_radius(),
                growth: below * of_levels,
                ..graded
            },
            divides_in_two: false,
            in_squeezed: 1,
            halves_levels: false,
        }
    }
}

/// A body that is refined for a press.
#[derive(Debug, Clone)]
pub struct PressedBody {
    /// The refined body. Its first vertices are those of the body before refinement.
    pub body: LayeredBody,
    /// The place that is pressed. If the mesh may be refined, it is a vertex.
    pub place: Place,
    /// For each vertex, the thickness of the layers relative to the thickness that the scene asks
    /// for. `[n_vertices]`
    pub thinning: Vec<f64>,
    /// Stand-off of the base from the bone, m; empty without bones. `[n_vertices]`
    pub stand_off: Vec<f64>,
    /// The skin that is bonded to a disc, if the tool is one.
    pub patch: Option<Patch>,
    /// The sizes that were asked for near the tool.
    pub sizes: Option<Sizes>,
    /// Mean length of the skin's edges near the tool. m
    pub mesh_size: f64,
    /// Whether the mesh is as fine everywhere as it should be.
    pub is_resolved: bool,
}

/// The skin that is bonded to a disc.
#[derive(Debug, Clone)]
pub struct Patch {
    /// Its skin vertices, ascending.
    pub vertices: Vec<usize>,
    /// For each vertex, the area of the patch that it stands for, m².
    pub areas: Vec<f64>,
    /// Radius of the circle with the patch's area, seen along the press, m.
    pub radius: f64,
}

impl PressedBody {
    /// Refines the scene's body as its `[mesh]` says, with these sizes near the tool. `way` holds
    /// distances from the place along the motion, m, at which the body is refined too.
    ///
    /// # Errors
    /// When the direction or the depth does not fit the place.
    pub fn build(
        scene: &Scene,
        built: &BuiltBody,
        lumps: &[Lump],
        sizes: Option<Sizes>,
        way: &[f64],
        notes: &mut Vec<Note>,
    ) -> anyhow::Result<Self> {
        let grown = &built.growth.body;
        // The place is checked first, before any work.
        let mut remarks = Vec::new();
        let coarse = Place::find(scene, built, &mut remarks)?;
        let mut refined = refine_near(scene, built, &coarse, lumps, sizes, way, notes);
        let is_between = is_between_vertices(scene);
        let mut place = if is_between {
            bring_vertex(scene, &mut refined, coarse.at);
            coarse.on(&refined.body)
        } else {
            remarks.clear();
            let vertex = match scene.press.target {
                Target::Point(_) => nearest(&refined.body.skin, built.press_at),
                Target::Vertex(_) | Target::Middle => built.press_vertex,
            };
            Place::at_vertex(scene, &refined.body, vertex, &mut remarks)?
        };
        notes.append(&mut remarks);
        note_overhang(scene, grown, &place, notes);
        let patch = match scene.tool {
            Tool::Disc { radius } => Some(bond(scene, &mut refined, &place, radius, notes)),
            _ => None,
        };
        if is_between {
            // The imprint of a disc divides triangles.
            place = place.on(&refined.body);
        }
        let thinning = refined.interpolate(&built.growth.thinning);
        let stand_off = refined.interpolate(&built.growth.stand_off);
        let is_fine = refined.n_too_large == 0;
        if !is_fine {
            notes.push(Note::SkinTooCoarse {
                n_triangles: refined.n_too_large,
                max_vertices: scene.mesh.max_vertices,
            });
        }
        let (body, is_split) = split_near(scene, refined.body, &place, lumps, sizes);
        if !is_split {
            notes.push(Note::LevelsTooHigh {
                max_levels: MOST_LEVELS,
            });
        }
        Ok(Self {
            mesh_size: mesh_size_near(&body, place.at, scene.tool.contact_radius()),
            body,
            place,
            thinning,
            stand_off,
            patch,
            sizes,
            is_resolved: is_fine && is_split,
        })
    }

    /// A body that was refined before, as the loop in real time does. Its thinning and stand-off
    /// are not known: those lists are empty.
    pub(crate) fn refined_before(scene: &Scene, body: LayeredBody, place: Place) -> Self {
        Self {
            mesh_size: mesh_size_near(&body, place.at, scene.tool.contact_radius()),
            body,
            place,
            thinning: Vec::new(),
            stand_off: Vec::new(),
            patch: None,
            sizes: Sizes::of(scene),
            is_resolved: true,
        }
    }
}

/// Moves the vertex nearest to a point of the skin to the point, and the mesh under the tool with
/// it: the force then hardly depends on where the vertices were. If the move would make poor
/// elements, the mesh stays, and the tool presses between vertices.
fn bring_vertex(scene: &Scene, refined: &mut Refined, at: Vec3) {
    if !scene.mesh.refine {
        return;
    }
    let (half, radius) = reach(scene);
    let slide = Slide {
        vertex: nearest(&refined.body.skin, at) as u32,
        to: at,
        radius: radius + half[0].hypot(half[1]),
    };
    if let Some(slid) = slide_vertices(&refined.body, &slide) {
        *refined = slid.after(refined);
    }
}

/// A length, m, for a triangle of the skin: its index and corners.
type TriangleSize = Box<dyn Fn(u32, &[Vec3; 3]) -> f64>;

/// A region of the skin that should be fine: `size` is the length of edges by the distance beyond
/// `radius` (m) of the points.
#[derive(Debug, Clone)]
struct Fine {
    points: Vec<Vec3>,
    radius: f64,
    size: Graded,
    /// Whether only the rim of the radius is the region: under a bonded disc, stresses are largest
    /// there.
    is_rim: bool,
}

impl Fine {
    /// Distance of a triangle from the region, m.
    fn distance(&self) -> TriangleSize {
        let (radius, border) = (self.radius, self.size.border);
        let points = self.points.clone();
        if !self.is_rim {
            return Box::new(near_points(&points, radius, 0.0, 1.0));
        }
        Box::new(move |_, corners| {
            let centre = corners.iter().sum::<Vec3>() / 3.0;
            let far = |to: &Vec3| corners.iter().map(|p| (p - to).norm()).fold(0.0, f64::max);
            let middle = points[0];
            let beyond = (centre - middle).norm() - radius;
            let distance = (beyond.abs() - far(&centre)).max(0.0);
            // The middle of the disc is near the tool too.
            if beyond < 0.0 {
                distance.min(0.999 * border)
            } else {
                distance
            }
        })
    }
}

/// Adds columns near the tool and above lumps.
fn refine_near(
    scene: &Scene,
    built: &BuiltBody,
    place: &Place,
    lumps: &[Lump],
    sizes: Option<Sizes>,
    way: &[f64],
    notes: &mut Vec<Note>,
) -> Refined {
    let body = &built.growth.body;
    let mut fine = Vec::new();
    if let Some(sizes) = sizes {
        let pressed = (built.press_at, place.direction);
        let (points, radius) = along_way(scene, &body.skin, pressed, sizes.skin.at(0.0), way);
        fine.push(Fine {
            is_rim: scene.tool.is_bonded() && points.len() == 1,
            points,
            radius,
            size: sizes.skin,
        });
    }
    fine.extend(over_lumps(scene, body, lumps, notes));
    refined(scene, body, &fine, sizes)
}

/// Points of the skin that the tool presses at a place and along its way, `h` apart or less, and the
/// radius around them that it reaches, m. `pressed` is the place and the direction of the press.
fn along_way(
    scene: &Scene,
    skin: &Surface,
    (at, direction): (Vec3, Unit<Vec3>),
    h: f64,
    way: &[f64],
) -> (Vec<Vec3>, f64) {
    let (mut points, radius) = footprint(scene, at, &direction, h);
    let along = along_skin(scene, &direction);
    let index = SurfaceIndex::build(skin);
    for &far in way.iter().filter(|far| **far != 0.0) {
        points.extend(index.closest(at + along * far).map(|closest| closest.point));
    }
    (points, radius)
}

/// How the skin from which the scene's body grows is coarsened: to the triangles that refinement would
/// leave as they are. `at` is the place that the scene presses; `None` if it cannot be pressed there.
pub(crate) fn coarsening(
    scene: &Scene,
    skin: &Surface,
    at: Vec3,
    pressed: Pressed<'_>,
) -> Option<Coarsening> {
    let mut coarsening = Coarsening {
        fine: Vec::new(),
        radius: 0.0,
        edge: 0.0,
        growth: 0.0,
        deviation: DEVIATION,
        deviation_growth: DEVIATION_GROWTH,
        most_deviation: DEVIATION_ANYWHERE,
        thickness_share: DEVIATION_OF_THICKNESS,
        kept: vec![at],
    };
    if let (Pressed::Along(way), Some(sizes)) = (pressed, Sizes::of(scene)) {
        let skin_index = Skin::new(skin);
        let point = skin_index.nearest(at)?;
        let inward = skin_index.inward(&point);
        let direction = Unit::try_new(scene.press.direction.map_or(inward, Vec3::from), 0.0)?;
        let size = sizes.skin.looser(SLACK);
        let pressed = (point.at, direction);
        (coarsening.fine, coarsening.radius) =
            along_way(scene, skin, pressed, sizes.skin.at(0.0), way);
        (coarsening.edge, coarsening.growth) = (size.h, size.growth);
        coarsening.most_deviation = DEVIATION_AWAY;
    }
    Some(coarsening)
}

/// The body refined as requested, if the scene allows refinement.
fn refined(scene: &Scene, body: &LayeredBody, fine: &[Fine], sizes: Option<Sizes>) -> Refined {
    let params = RefineParams {
        max_vertices: scene.mesh.max_vertices,
        divides_in_two: sizes.is_some_and(|sizes| sizes.divides_in_two),
        ..RefineParams::default()
    };
    let wish = |fine: &Fine| {
        let beyond = fine.distance();
        let size = fine.size.looser(SLACK);
        move |t: u32, corners: &[Vec3; 3]| size.at(beyond(t, corners))
    };
    let fine = fine.iter().filter(|_| scene.mesh.refine);
    let wishes: Vec<_> = fine.map(wish).collect();
    refine(body, &params, move |t, corners| {
        wishes
            .iter()
            .map(|wish| wish(t, corners))
            .fold(f64::INFINITY, f64::min)
    })
}

/// Adds the regions of the skin above lumps.
fn over_lumps(
    scene: &Scene,
    body: &LayeredBody,
    lumps: &[Lump],
    notes: &mut Vec<Note>,
) -> Vec<Fine> {
    if lumps.is_empty() || !scene.mesh.refine {
        return Vec::new();
    }
    let shadows = Shadows::new(body);
    let mut fine = Vec::new();
    for (lump, given) in lumps.iter().zip(&scene.lumps) {
        let Some(h) = scene.mesh.near_lump_of(given) else {
            notes.push(Note::LumpNotRefined {
                lump: given.name.clone(),
            });
            continue;
        };
        let (points, radius) = backbone(lump);
        for point in points {
            let shadow = shadows.of(point);
            let wide = shadow.convergence;
            fine.push(Fine {
                points: vec![shadow.on_skin],
                radius: radius * wide,
                size: Graded::even(h * wide, scene.mesh.growth_of_edges()),
                is_rim: false,
            });
        }
    }
    fine
}

/// A body that can be refined around any place of its skin. Its levels are those for the scene's
/// own place.
#[derive(Debug)]
pub struct CoarseBody {
    /// The body as it was grown, with the split levels.
    pub body: LayeredBody,
    /// Regions that are always fine.
    fine: Vec<Fine>,
    /// Sizes near the tool; `None` for a tool that needs no refinement.
    sizes: Option<Sizes>,
}

impl CoarseBody {
    /// Builds the coarse body of a scene, with these sizes near the tool.
    ///
    /// # Errors
    /// When the direction or the depth does not fit the place.
    pub fn build(
        scene: &Scene,
        built: &BuiltBody,
        lumps: &[Lump],
        sizes: Option<Sizes>,
    ) -> anyhow::Result<Self> {
        let grown = &built.growth.body;
        // The notes are dropped: those of the first pressed body say the same.
        let mut notes = Vec::new();
        let place = Place::find(scene, built, &mut notes)?;
        let (body, _) = split_near(scene, grown.clone(), &place, lumps, sizes);
        Ok(Self {
            fine: over_lumps(scene, &body, lumps, &mut notes),
            sizes,
            body,
        })
    }

    /// The body refined within `radius` of a point of the skin, m.
    pub fn fine_round(&self, scene: &Scene, point: Vec3, radius: f64) -> LayeredBody {
        let mut fine = self.fine.clone();
        fine.extend(self.sizes.map(|sizes| Fine {
            points: vec![point],
            radius,
            size: sizes.skin,
            is_rim: false,
        }));
        refined(scene, &self.body, &fine, self.sizes).body
    }
}

/// Points of the skin that the tool presses on, `h` apart or less, and the radius around them that
/// it reaches, m.
pub(super) fn footprint(
    scene: &Scene,
    at: Vec3,
    direction: &Unit<Vec3>,
    h: f64,
) -> (Vec<Vec3>, f64) {
    let (reach, radius) = reach(scene);
    let mut points = vec![at];
    if let Some(tool) = scene.tool.contact() {
        let axes = tool.axes(direction.into_inner().into()).map(Vec3::from);
        let steps = reach.map(|r| (r / h).ceil() as i32);
        for i in -steps[0]..=steps[0] {
            for j in -steps[1]..=steps[1] {
                let along = reach[0] * f64::from(i) / f64::from(steps[0].max(1));
                let across = reach[1] * f64::from(j) / f64::from(steps[1].max(1));
                points.push(at + axes[0] * along + axes[1] * across);
            }
        }
    }
    (points, radius)
}

/// Unit vector along which the scene's hand moves across the skin, if the skin is pressed in
/// `direction`.
pub fn along_skin(scene: &Scene, direction: &Unit<Vec3>) -> Vec3 {
    let first = scene.tool.contact().map_or(Vec3::x(), |tool| {
        Vec3::from(tool.axes(direction.into_inner().into())[0])
    });
    let along = scene.motion.along.map_or(first, Vec3::from);
    let flat = along - direction.into_inner() * along.dot(direction);
    flat.try_normalize(1e-6).unwrap_or(first)
}

/// Points along the axis of a lump, and the radius of balls around them that together contain it,
/// m.
fn backbone(lump: &Lump) -> (Vec<Vec3>, f64) {
    let (middle, bound) = lump.bounding_sphere();
    let (half_length, radius) = match lump.shape() {
        LumpShape::Capsule(shape) => (shape.length() / 2.0, shape.radius()),
        LumpShape::Ellipsoid(shape) => {
            // The first axis is usually the long one; the radius covers the other two.
            let across = shape.radii().y.max(shape.radii().z);
            ((shape.radii().x - across).max(0.0), across)
        }
        LumpShape::Sphere(_) | LumpShape::Mesh(_) => (0.0, bound),
    };
    let axis = lump.pose().rotation * Vec3::x();
    let n = (half_length / radius).ceil() as i32;
    let at = |i: i32| middle + axis * (half_length * f64::from(i) / f64::from(n.max(1)));
    ((-n..=n).map(at).collect(), radius + lump.transition() / 2.0)
}

/// Finds the skin above a point inside the body.
struct Shadows<'a> {
    body: &'a LayeredBody,
    levels: Vec<(Surface, SurfaceIndex)>,
}

/// The skin above a point inside the body.
struct Shadow {
    on_skin: Vec3,
    /// The triangle of the skin whose columns contain the point.
    triangle: usize,
    /// Width of the columns at the skin relative to their width at the point.
    convergence: f64,
}

impl<'a> Shadows<'a> {
    fn new(body: &'a LayeredBody) -> Self {
        let levels = (0..body.n_levels)
            .map(|l| {
                let surface = Surface {
                    points: (0..body.n_vertices())
                        .map(|v| body.positions[body.node(v, l)])
                        .collect(),
                    triangles: body.skin.triangles.clone(),
                };
                let index = SurfaceIndex::build(&surface);
                (surface, index)
            })
            .collect();
        Self { body, levels }
    }

    fn of(&self, place: Vec3) -> Shadow {
        let nearest = self
            .levels
            .iter()
            .filter_map(|(surface, index)| {
                let closest = index.closest(place)?;
                let distance = (closest.point - place).norm();
                Some((distance, surface, closest))
            })
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, level, closest)) = nearest else {
            return Shadow {
                on_skin: place,
                triangle: 0,
                convergence: 1.0,
            };
        };
        let t = closest.triangle as usize;
        let on_skin = (self.body.skin.corners(t).iter().zip(closest.weights))
            .map(|(p, weight)| p * weight)
            .sum();
        let areas = [&self.body.skin, level].map(|s| s.area_vector(t).norm());
        Shadow {
            on_skin,
            triangle: t,
            convergence: (areas[0] / areas[1]).sqrt().clamp(1.0, MOST_CONVERGENCE),
        }
    }
}

/// Splits levels under the tool and around lumps. Returns whether they are now as low as wanted.
fn split_near(
    scene: &Scene,
    body: LayeredBody,
    place: &Place,
    lumps: &[Lump],
    sizes: Option<Sizes>,
) -> (LayeredBody, bool) {
    if !scene.mesh.refine {
        return (body, true);
    }
    let mut wishes: Vec<LevelWish> = Vec::new();
    let n = body.n_levels - 1;
    let mut most = vec![f64::INFINITY; n];
    let mut wish = |depths: Vec<f64>, depth: f64, radius: f64, size: Graded| {
        let beyond = near_depth(depth, radius, 0.0, 1.0);
        let size = size.looser(SPARED);
        let wanted = move |top, bottom| size.at(beyond(top, bottom));
        wishes.push(Box::new(along(depths, wanted)));
    };
    if let Some(sizes) = sizes {
        let depths = mean_depths(&body, &[place.vertex as u32]);
        most = shares_of_squeezed(scene, &body, &depths, sizes);
        wish(depths, 0.0, 0.0, sizes.levels);
    }
    if !lumps.is_empty() {
        let shadows = Shadows::new(&body);
        for (lump, given) in lumps.iter().zip(&scene.lumps) {
            let Some(h) = scene.mesh.near_lump_of(given) else {
                continue;
            };
            let (points, radius) = backbone(lump);
            for point in points {
                let shadow = shadows.of(point);
                let depths = mean_depths(&body, &body.skin.triangles[shadow.triangle]);
                let depth = (point - shadow.on_skin).norm();
                let size = Graded::even(h, scene.mesh.growth_of_levels());
                wish(depths, depth, radius, size);
            }
        }
    }
    let wanted = |i: usize, from: f64, to: f64| {
        (wishes.iter())
            .map(|wish| wish(i, from, to))
            .fold(most[i], f64::min)
    };
    let (mut parts, is_met) = parts_for(n, wanted, MOST_LEVELS);
    if sizes.is_some_and(|sizes| sizes.halves_levels) {
        for heights in &mut parts {
            *heights = heights.iter().flat_map(|h| [0.5 * h; 2]).collect();
        }
    }
    if parts.iter().all(|heights| heights.len() == 1) {
        return (body, is_met);
    }
    (split_levels(&body, &parts).body, is_met)
}

/// Young's modulus of a layer, Pa, if there is such a layer and its tissue has one.
pub(crate) fn young_of(scene: &Scene, layer: usize) -> Option<f64> {
    scene.layers.get(layer).and_then(|l| l.tissue.young())
}

/// For each interval, the largest share of it that a part may be, so that layers near the tool that are
/// softer than what lies under them have as many intervals as wanted. `depths` are those of the levels, m.
fn shares_of_squeezed(scene: &Scene, body: &LayeredBody, depths: &[f64], sizes: Sizes) -> Vec<f64> {
    let layers = &body.interval_layer;
    let share = |&layer: &usize| {
        let is_of = |of: &&usize| **of == layer;
        let top = layers.iter().position(|of| *of == layer).unwrap_or(0);
        // Under the lowest layer is bone.
        let is_softer = match (young_of(scene, layer), young_of(scene, layer + 1)) {
            (Some(own), Some(under)) => own < under,
            (Some(_), None) => true,
            (None, _) => false,
        };
        if depths[top] < sizes.levels.border && is_softer {
            let n_parts = sizes
                .in_squeezed
                .div_ceil(layers.iter().filter(is_of).count());
            ROUNDED / n_parts as f64
        } else {
            f64::INFINITY
        }
    };
    layers.iter().map(share).collect()
}

/// The skin that a disc holds. If the body may be refined, the disc's edge becomes a ring of
/// vertices. They lie on a circle that gives the patch the disc's area.
fn bond(
    scene: &Scene,
    refined: &mut Refined,
    place: &Place,
    radius: f64,
    notes: &mut Vec<Note>,
) -> Patch {
    if scene.mesh.refine {
        match imprinted(refined, place, radius) {
            Ok((imprint, triangles, effective)) => {
                *refined = imprint;
                let corners = triangles
                    .iter()
                    .flat_map(|&t| refined.body.skin.triangles[t as usize]);
                let mut vertices: Vec<usize> = corners.map(|v| v as usize).collect();
                vertices.sort_unstable();
                vertices.dedup();
                return Patch {
                    areas: areas_of(&refined.body, &triangles, vertices.iter().copied()),
                    vertices,
                    radius: effective,
                };
            }
            Err(why) => notes.push(Note::DiscNotImprinted { why }),
        }
    }
    let body = &refined.body;
    let nodes = nodes_under_disc(body, place.vertex, place.at, &place.direction, radius);
    let mut is_in = vec![false; body.n_vertices()];
    for &node in &nodes {
        is_in[node / body.n_levels] = true;
    }
    let triangles: Vec<u32> = (0..body.skin.triangles.len() as u32)
        .filter(|&t| {
            let corners = body.skin.triangles[t as usize];
            corners.iter().all(|&v| is_in[v as usize])
        })
        .collect();
    let area = seen_area(body, &triangles, &place.direction);
    let patch = Patch {
        // Hanging vertices and isolated vertices have no area.
        areas: areas_of(
            body,
            &triangles,
            nodes.iter().map(|node| node / body.n_levels),
        ),
        vertices: nodes.iter().map(|node| node / body.n_levels).collect(),
        radius: (area / std::f64::consts::PI).sqrt(),
    };
    notes.push(Note::DiscPatch {
        n_vertices: nodes.len(),
        radius,
        at: xyz(place.at),
        effective_radius: patch.radius,
    });
    patch
}

/// The refined body with the disc's edge in its skin, the triangles inside the edge, and the radius
/// of the circle with their area.
fn imprinted(
    refined: &Refined,
    place: &Place,
    radius: f64,
) -> Result<(Refined, Vec<u32>, f64), palpa_mesh::refine::ImprintError> {
    let mut circle = Circle {
        point: place.at,
        direction: place.direction.into_inner(),
        radius,
    };
    let mut tries = 0;
    loop {
        let imprint = imprint_circle(&refined.body, &circle)?;
        tries += 1;
        let ratio = radius / imprint.effective_radius;
        if (ratio - 1.0).abs() < RADIUS_TOLERANCE || tries == TRIES {
            let triangles = imprint.inside;
            return Ok((
                imprint.refined.after(refined),
                triangles,
                imprint.effective_radius,
            ));
        }
        circle.radius *= ratio;
    }
}

/// The area of the triangles that each vertex stands for, m².
fn areas_of(
    body: &LayeredBody,
    triangles: &[u32],
    vertices: impl Iterator<Item = usize>,
) -> Vec<f64> {
    let mut areas = vec![0.0; body.n_vertices()];
    for &t in triangles {
        let share = body.skin.area_vector(t as usize).norm() / 3.0;
        for v in body.skin.triangles[t as usize] {
            areas[v as usize] += share;
        }
    }
    vertices.map(|v| areas[v]).collect()
}

fn seen_area(body: &LayeredBody, triangles: &[u32], direction: &Unit<Vec3>) -> f64 {
    let seen = |&t: &u32| body.skin.area_vector(t as usize).dot(direction).abs();
    // Adding zero turns -0 (an empty sum) into 0.
    triangles.iter().map(seen).sum::<f64>() + 0.0
}
