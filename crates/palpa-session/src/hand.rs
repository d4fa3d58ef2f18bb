//! The hand of a person at a screen: where the page wants the tool, reached as a hand would.
//!
//! ```text
//!          travel, over the skin or round the body
//!     hover ───────────────────────────────► hover
//!       ▲ │ down, at the speed of a press      │
//!       │ ▼                                    ▼
//!     pressed ── stroke, along the skin ──► pressed
//! ```
//! A place is a point of the skin at rest; the tip is `depth` under it, against the skin's normal.

use nalgebra::{Rotation3, Unit, UnitQuaternion};
use palpa_mesh::{Surface, SurfaceIndex, Vec3};
use palpa_servo::Pose;

/// How high the tip hovers over the skin, m.
pub const HOVER: f64 = 6e-3;
/// Speeds: down and up, along the skin while pressing, and in the air, m/s.
const PRESS_SPEED: f64 = 0.04;
const STROKE_SPEED: f64 = 0.06;
const AIR_SPEED: f64 = 0.35;
/// A place further away than this is gone to through the air, m.
const STRIDE: f64 = 15e-3;
/// Rest over a new place, s, and the longest: the mesh becomes fine there meanwhile.
const SETTLE: f64 = 0.1;
const LONGEST_SETTLE: f64 = 4.0;
/// Within so much of the radius of what is fine a place is pressed.
const FINE: f64 = 0.5;
/// Distance from the skin at which the tool goes round the body, beside its own size, m.
const CLEARANCE: f64 = 12e-3;
/// Deepest press, as a share of the tissue there.
const MOST_OF_TISSUE: f64 = 0.65;

/// The skin at rest, as the hand knows it.
#[derive(Debug)]
pub struct Skin {
    surface: Surface,
    index: SurfaceIndex,
    normals: Vec<Vec3>,
    /// Depth of the tissue under each vertex, m.
    thickness: Vec<f64>,
    middle: Vec3,
    /// The way along which it is longest.
    axis: Vec3,
}

/// A place on the skin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// The point, m.
    pub point: Vec3,
    /// The outward normal there.
    pub normal: Vec3,
    /// Depth of the tissue, m.
    pub thickness: f64,
}

impl Place {
    /// Deepest that a hand presses here, m.
    pub fn deepest(&self) -> f64 {
        MOST_OF_TISSUE * self.thickness
    }
}

impl Skin {
    /// Of a surface with the depth of the tissue under its vertices, m.
    pub fn new(surface: Surface, thickness: Vec<f64>) -> Self {
        let n = surface.points.len().max(1) as f64;
        let middle = surface.points.iter().sum::<Vec3>() / n;
        let spread = surface
            .points
            .iter()
            .map(|p| (p - middle) * (p - middle).transpose())
            .sum::<nalgebra::Matrix3<f64>>();
        let eigen = spread.symmetric_eigen();
        let axis = eigen.eigenvectors.column(eigen.eigenvalues.imax());
        Self {
            index: SurfaceIndex::build(&surface),
            normals: surface.vertex_normals(),
            axis: axis.into(),
            surface,
            thickness,
            middle,
        }
    }

    /// The place nearest to a point.
    pub fn nearest(&self, point: Vec3) -> Option<Place> {
        let closest = self.index.closest(point)?;
        let corners = self.surface.triangles.get(closest.triangle as usize)?;
        let mut normal = Vec3::zeros();
        let mut thickness = 0.0;
        for (&v, share) in corners.iter().zip(closest.weights) {
            normal += self.normals[v as usize] * share;
            thickness += self.thickness[v as usize] * share;
        }
        Some(Place {
            point: closest.point,
            normal: normal.try_normalize(1e-9)?,
            thickness,
        })
    }

    /// Vertices at least so far (m) from where the body was cut: place, area that it stands for (m²), depth of the tissue (m).
    pub fn away_from_rim(&self, distance: f64) -> impl Iterator<Item = (Vec3, f64, f64)> {
        let surface = &self.surface;
        let rim: Vec<Vec3> = (surface.boundary_loops().iter().flatten())
            .map(|&v| surface.points[v as usize])
            .collect();
        let mut areas = vec![0.0; surface.points.len()];
        for (t, corners) in surface.triangles.iter().enumerate() {
            for &v in corners {
                areas[v as usize] += surface.area_vector(t).norm() / 3.0;
            }
        }
        (0..surface.points.len())
            .map(move |v| (surface.points[v], areas[v], self.thickness[v]))
            .filter(move |(p, ..)| rim.iter().all(|q| (p - q).norm() >= distance))
    }

    /// Distance of a point from the skin, m.
    fn distance(&self, point: Vec3) -> f64 {
        self.index
            .closest(point)
            .map_or(f64::INFINITY, |c| (c.point - point).norm())
    }
}

/// Where the hand is to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    /// On the skin.
    pub place: Place,
    /// How deep, m.
    pub depth: f64,
}

/// What the hand is about.
#[derive(Debug, Clone, PartialEq)]
enum Doing {
    /// Over or in the skin at the place.
    There,
    /// On its way through the air: points that are left, the last first.
    Travel(Vec<Vec3>),
    /// Over a new place, for so long, s.
    Settling(f64),
}

/// The hand.
#[derive(Debug)]
pub struct HandDriver {
    place: Place,
    depth: f64,
    /// Where the tip is told to be, m.
    tip: Vec3,
    doing: Doing,
    goal: Option<Goal>,
    /// Direction that the tool's x points along as nearly as the skin lets it.
    along: Vec3,
    /// Size of the tool, to go round the body with, m.
    tool_size: f64,
}

impl HandDriver {
    /// Hovering over a place, with the tool's x along a direction as nearly as the skin lets it.
    pub fn over(place: Place, along: Vec3, tool_size: f64) -> Self {
        Self {
            place,
            depth: -HOVER,
            tip: place.point + place.normal * HOVER,
            doing: Doing::There,
            goal: None,
            along,
            tool_size,
        }
    }

    /// Where it is to go; none lifts it off the skin.
    pub fn set_goal(&mut self, goal: Option<Goal>) {
        self.goal = goal.map(|goal| Goal {
            depth: goal.depth.clamp(-HOVER, goal.place.deepest()),
            ..goal
        });
    }

    /// Deepest that it goes where it is to be, m.
    pub fn deepest(&self) -> f64 {
        self.goal.map_or(self.place, |goal| goal.place).deepest()
    }

    /// The place that it is over or in.
    pub fn place(&self) -> &Place {
        &self.place
    }

    /// Where the tip is told to be, m.
    pub fn tip(&self) -> Vec3 {
        self.tip
    }

    /// Whether it is on its way through the air.
    pub fn is_travelling(&self) -> bool {
        matches!(self.doing, Doing::Travel(_))
    }

    /// Whether it is at rest over the skin.
    pub fn is_lifted(&self) -> bool {
        self.doing == Doing::There && self.depth <= -HOVER
    }

    /// Goes on for `dt` seconds; where the tool is to be, in the scene's frame. `fine` is where the mesh is fine (place and
    /// radius, m), if that moves: a new place is not pressed before.
    pub fn advance(&mut self, skin: &Skin, fine: Option<(Vec3, f64)>, dt: f64) -> Pose {
        match &mut self.doing {
            Doing::Travel(points) => {
                let mut way = AIR_SPEED * dt;
                while let Some(&next) = points.last() {
                    let off = next - self.tip;
                    if off.norm() > way {
                        self.tip += off * (way / off.norm());
                        break;
                    }
                    way -= off.norm();
                    self.tip = next;
                    points.pop();
                }
                if points.is_empty() {
                    self.doing = Doing::Settling(0.0);
                }
            }
            Doing::Settling(waited) => {
                *waited += dt;
                let is_fine = fine.is_none_or(|(middle, radius)| {
                    (self.place.point - middle).norm() < FINE * radius
                });
                if *waited > LONGEST_SETTLE || is_fine && *waited > SETTLE {
                    self.doing = Doing::There;
                }
            }
            Doing::There => self.go_on(skin, dt),
        }
        Pose::from_parts(self.tip.into(), turned_to(&self.place.normal, &self.along))
    }

    fn go_on(&mut self, skin: &Skin, dt: f64) {
        let far = self
            .goal
            .is_some_and(|goal| (goal.place.point - self.place.point).norm() > STRIDE);
        let wanted = match self.goal {
            Some(goal) if !far => goal.depth,
            _ => -HOVER,
        };
        let down = PRESS_SPEED * dt;
        self.depth += (wanted - self.depth).clamp(-down, down);
        if let Some(goal) = self.goal {
            if far && self.depth <= -HOVER + 1e-6 {
                self.travel(skin, goal.place);
                return;
            }
            if !far {
                self.stroke(skin, goal.place, dt);
            }
        }
        self.tip = self.place.point - self.place.normal * self.depth;
    }

    fn stroke(&mut self, skin: &Skin, to: Place, dt: f64) {
        let off = to.point - self.place.point;
        let way = STROKE_SPEED * dt;
        if off.norm() <= way {
            self.place = to;
            return;
        }
        let ahead = self.place.point + off * (way / off.norm());
        if let Some(mut place) = skin.nearest(ahead) {
            // The normal turns towards that of the goal at the pace of the way: no jump where triangles meet.
            let share = way / off.norm();
            let turned = self.place.normal.lerp(&to.normal, share);
            place.normal = turned.try_normalize(1e-6).unwrap_or(to.normal);
            self.place = place;
        }
    }

    fn travel(&mut self, skin: &Skin, to: Place) {
        let clear = CLEARANCE + self.tool_size;
        let out = |place: &Place| place.point + place.normal * clear;
        let (from, over) = (out(&self.place), out(&to));
        let mut points = vec![to.point + to.normal * HOVER, over];
        let is_clear = (1..20).all(|i| {
            let at = from.lerp(&over, f64::from(i) / 20.0);
            skin.distance(at) > 0.5 * clear && is_outside(skin, at)
        });
        if !is_clear {
            points.extend(round_the_body(skin, from, over, clear).into_iter().rev());
        }
        points.push(from);
        self.place = to;
        self.depth = -HOVER;
        self.doing = Doing::Travel(points);
    }
}

fn is_outside(skin: &Skin, at: Vec3) -> bool {
    skin.nearest(at)
        .is_none_or(|place| (at - place.point).dot(&place.normal) > 0.0)
}

/// Points of a way round the body's long axis, at a distance that is clear of all of it.
fn round_the_body(skin: &Skin, from: Vec3, to: Vec3, clear: f64) -> Vec<Vec3> {
    const POINTS: i32 = 12;
    let axis = Unit::new_normalize(skin.axis);
    let split = |p: Vec3| {
        let off = p - skin.middle;
        let along = off.dot(&axis);
        (along, off - axis.into_inner() * along)
    };
    let radius = skin
        .surface
        .points
        .iter()
        .map(|&p| split(p).1.norm())
        .fold(0.0, f64::max)
        + clear;
    let ((along_0, side_0), (along_1, side_1)) = (split(from), split(to));
    let cross = side_0.cross(&side_1).dot(&axis);
    let mut angle = cross.atan2(side_0.dot(&side_1));
    if angle == 0.0 {
        angle = std::f64::consts::PI;
    }
    let start = side_0.try_normalize(1e-9).unwrap_or_else(Vec3::z);
    (0..=POINTS)
        .map(|i| {
            let share = f64::from(i) / f64::from(POINTS);
            let side = Rotation3::from_axis_angle(&axis, share * angle) * start;
            let along = along_0 + (along_1 - along_0) * share;
            skin.middle + axis.into_inner() * along + side * radius
        })
        .collect()
}

/// The frame of a tool whose z points along `normal`, its x as nearly as that lets it along `along`.
fn turned_to(normal: &Vec3, along: &Vec3) -> UnitQuaternion<f64> {
    let flat = |v: &Vec3| (v - normal * normal.dot(v)).try_normalize(0.1);
    let x = flat(along)
        .or_else(|| flat(&Vec3::x()))
        .or_else(|| flat(&Vec3::y()))
        .unwrap_or_else(Vec3::x);
    let axes = nalgebra::Matrix3::from_columns(&[x, normal.cross(&x), *normal]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes))
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpa_mesh::generate::limb;

    const DT: f64 = 1.0 / 60.0;
    const TOOL: f64 = 20e-3;

    /// A limb of radius 40 mm along x.
    fn limb() -> Skin {
        let (surface, _) = limb::cylinder(0.16, 0.04, 0.012, 6e-3);
        let n = surface.points.len();
        Skin::new(surface, vec![28e-3; n])
    }

    fn at(skin: &Skin, x: f64, angle: f64) -> Place {
        let point = Vec3::new(x, 0.05 * angle.sin(), 0.05 * angle.cos());
        skin.nearest(point).unwrap()
    }

    fn hand(skin: &Skin) -> HandDriver {
        HandDriver::over(at(skin, 0.08, 0.0), Vec3::x(), TOOL)
    }

    #[test]
    fn it_presses_to_the_depth_and_lifts() {
        let skin = limb();
        let mut hand = hand(&skin);
        let place = *hand.place();
        hand.set_goal(Some(Goal { place, depth: 5e-3 }));
        let mut before = hand.advance(&skin, None, DT);
        for _ in 0..60 {
            let pose = hand.advance(&skin, None, DT);
            let way = pose.translation.vector - before.translation.vector;
            assert!(way.norm() <= PRESS_SPEED * DT + 1e-9);
            before = pose;
        }
        let wanted = place.point - place.normal * 5e-3;
        assert!((before.translation.vector - wanted).norm() < 1e-9);
        assert!(!hand.is_lifted());
        hand.set_goal(None);
        (0..60).for_each(|_| before = hand.advance(&skin, None, DT));
        assert!(hand.is_lifted());
        assert!((before.rotation * Vec3::z() - place.normal).norm() < 1e-9);
    }

    #[test]
    fn it_never_presses_through_the_tissue() {
        let skin = limb();
        let mut hand = hand(&skin);
        let place = *hand.place();
        hand.set_goal(Some(Goal { place, depth: 1.0 }));
        let mut pose = Pose::identity();
        (0..200).for_each(|_| pose = hand.advance(&skin, None, DT));
        let depth = place.normal.dot(&(place.point - pose.translation.vector));
        assert!((depth - MOST_OF_TISSUE * 28e-3).abs() < 1e-6, "{depth}");
    }

    #[test]
    fn to_the_other_side_it_goes_round_the_body() {
        let skin = limb();
        let mut hand = hand(&skin);
        let place = at(&skin, 0.05, std::f64::consts::PI);
        hand.set_goal(Some(Goal { place, depth: 4e-3 }));
        let mut least = f64::INFINITY;
        let mut pose = Pose::identity();
        for _ in 0..300 {
            pose = hand.advance(&skin, None, DT);
            let off_axis = pose.translation.vector.yz().norm();
            if hand.depth <= 0.0 {
                least = least.min(off_axis);
            }
        }
        assert!(least > 0.0395, "the tip was {least} m off the axis");
        let wanted = place.point - place.normal * 4e-3;
        assert!((pose.translation.vector - wanted).norm() < 1e-9);
    }

    #[test]
    fn a_stroke_stays_at_its_depth_on_a_curved_skin() {
        let skin = limb();
        let mut hand = hand(&skin);
        let place = *hand.place();
        hand.set_goal(Some(Goal { place, depth: 5e-3 }));
        (0..60).for_each(|_| {
            hand.advance(&skin, None, DT);
        });
        for k in 1..=60 {
            let place = at(&skin, 0.08, f64::from(k) * 0.02);
            hand.set_goal(Some(Goal { place, depth: 5e-3 }));
            let tip = hand.advance(&skin, None, DT).translation.vector;
            assert!((tip.yz().norm() - 0.035).abs() < 8e-4, "{tip:?}");
        }
    }
}
