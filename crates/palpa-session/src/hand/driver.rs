//! The hand's path to its goal, at the speeds of a person's hand.
//!
//! ```text
//!          glide close over the skin, or travel round the body
//!     hover ───────────────────────────────► hover
//!       ▲ │ down: fast in the air, then at     │
//!       │ ▼ the speed of a press               ▼
//!     pressed ── stroke, along the skin ──► pressed
//! ```
//! A place is a point of the skin at rest. The tool's tip is `depth` below it, along the inward
//! normal. A goal may have a force: then the hand presses deeper or less deep until the tissue pushes
//! back with it.

use nalgebra::{Rotation3, Unit, UnitQuaternion};
use palpa_mesh::Vec3;
use palpa_servo::Pose;

use super::skin::{Place, Skin};

/// Height of the tip above the skin while it hovers, m.
pub(crate) const HOVER: f64 = 6e-3;
/// The same on the way between two places that are pressed, m.
const LOW: f64 = 2e-3;
/// Speeds, m/s: into the skin, along it while pressing, and in the air.
const PRESS_SPEED: f64 = 0.025;
const STROKE_SPEED: f64 = 0.06;
const AIR_SPEED: f64 = 0.4;
/// Speed towards the skin and away from it in the air, m/s, and the height above it at which the hand slows
/// down to the speed of a press, m.
const FALL_SPEED: f64 = 0.3;
const SLOW_BELOW: f64 = 0.5e-3;
/// Distance above which the hand lifts to go to a place, m.
const STRIDE: f64 = 15e-3;
/// A lifted hand glides close over the skin to places that are nearer than this, m, and whose normals differ by
/// less than 60 degrees; to others it travels through the air.
const GLIDE: f64 = 0.1;
/// Largest step of a glide, m: the skin is followed in steps.
const GLIDE_STEP: f64 = 4e-3;
/// The pace at which the hand goes to the depth that it expects to give the wanted force, 1/s. The force that
/// it feels is 20 to 60 ms old.
const FORCE_PACE: f64 = 4.0;
/// Largest speed on the way to a force, m/s: what the hand feels late, it has passed by then.
const FORCE_SPEED: f64 = 0.015;
/// Least stiffness with which the hand reckons, N/m: softer contacts are approached more slowly.
const LEAST_STIFFNESS: f64 = 60.0;
/// Distance between skin and tool on the path around the body, m; the tool's size is added.
const CLEARANCE: f64 = 12e-3;

/// A goal that stays within this distance, m, for this time, s, is meant. On its way there, a pointer passes other
/// places.
const MEANT: f64 = 3e-3;
const MEANT_TIME: f64 = 0.03;

/// The goal of the hand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Goal {
    /// The place on the skin.
    pub(crate) place: Place,
    /// Depth of the tip below the place, m; negative above the skin. With a force, the greatest depth.
    pub(crate) depth: f64,
    /// Force to be held, N, in place of a depth.
    pub(crate) force: Option<f64>,
}

impl Goal {
    /// Goes to a depth.
    pub(crate) fn at_depth(place: Place, depth: f64) -> Self {
        Self {
            place,
            depth,
            force: None,
        }
    }
}

/// The hand's state on its path.
#[derive(Debug, Clone, PartialEq)]
enum Doing {
    /// At the place, over the skin or pressing.
    There,
    /// Travelling through the air, with the remaining points; the next one is last.
    Travel(Vec<Vec3>),
}

/// The hand on its way to a goal.
#[derive(Debug)]
pub(crate) struct HandDriver {
    place: Place,
    depth: f64,
    /// Commanded place of the tip, scene's frame, m.
    tip: Vec3,
    doing: Doing,
    goal: Option<Goal>,
    /// A place that the goal has stayed near, m, and for how long, s.
    meant: (Vec3, f64),
    /// Preferred direction of the tool's x axis.
    along: Vec3,
    /// Size of the tool, m; this much more distance is kept on the path around the body.
    tool_size: f64,
}

impl HandDriver {
    /// A hand that hovers over `place`; `along` is the preferred direction of the tool's x axis.
    pub(crate) fn over(place: Place, along: Vec3, tool_size: f64) -> Self {
        Self {
            place,
            depth: -HOVER,
            tip: place.point + place.normal * HOVER,
            doing: Doing::There,
            goal: None,
            meant: (place.point, 0.0),
            along,
            tool_size,
        }
    }

    /// Sets the goal; its depth is limited to the tissue there. `None` lifts the hand off the skin.
    pub(crate) fn set_goal(&mut self, goal: Option<Goal>) {
        self.goal = goal.map(|goal| Goal {
            depth: goal.depth.clamp(-HOVER, goal.place.deepest()),
            ..goal
        });
        if let Some(Goal { place, .. }) = self.goal
            && (place.point - self.meant.0).norm() > MEANT
        {
            self.meant = (place.point, 0.0);
        }
    }

    /// The place of the goal, once it has stayed there for a moment.
    pub(crate) fn aim(&self) -> Option<Vec3> {
        let place = self.goal?.place.point;
        (self.meant.1 >= MEANT_TIME).then_some(place)
    }

    /// Deepest press at the goal, or at the present place without a goal, m.
    pub(crate) fn deepest(&self) -> f64 {
        self.goal.map_or(self.place, |goal| goal.place).deepest()
    }

    /// The place that the hand hovers over or presses.
    pub(crate) fn place(&self) -> &Place {
        &self.place
    }

    /// Commanded place of the tip, scene's frame, m.
    pub(crate) fn tip(&self) -> Vec3 {
        self.tip
    }

    /// Whether the hand travels through the air.
    pub(crate) fn is_travelling(&self) -> bool {
        matches!(self.doing, Doing::Travel(_))
    }

    /// Whether the hand hovers without moving.
    pub(crate) fn is_lifted(&self) -> bool {
        self.doing == Doing::There && self.depth <= -HOVER
    }

    /// Moves the hand by `dt` seconds. `felt` is the force of the tissue on the tool, N, in the scene's
    /// frame. Returns the commanded pose of the tool in the scene's frame.
    pub(crate) fn advance(&mut self, skin: &Skin, dt: f64, felt: Vec3) -> Pose {
        self.meant.1 += dt;
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
                    self.doing = Doing::There;
                }
            }
            Doing::There => self.go_on(skin, dt, felt.dot(&self.place.normal)),
        }
        Pose::from_parts(self.tip.into(), turned_to(&self.place.normal, &self.along))
    }

    fn go_on(&mut self, skin: &Skin, dt: f64, felt: f64) {
        let far = self
            .goal
            .is_some_and(|goal| (goal.place.point - self.place.point).norm() > STRIDE);
        let wanted = match self.goal {
            Some(goal) if !far => match goal.force {
                Some(force) => self.depth_for(force, felt, dt).min(goal.depth),
                None => goal.depth,
            },
            // On the way to another place it stays low.
            Some(_) => self.depth.clamp(-HOVER, -LOW),
            None => -HOVER,
        };
        self.depth = approached(self.depth, wanted, dt);
        if let Some(goal) = self.goal {
            let is_lifted = self.depth <= -LOW + 1e-6;
            if far && is_lifted && !self.can_glide(&goal.place) {
                if self.depth <= -HOVER + 1e-6 {
                    self.travel(skin, goal.place);
                    return;
                }
                self.depth = approached(self.depth, -HOVER, dt);
            } else if !far || is_lifted {
                self.follow(skin, goal.place, dt);
            }
        }
        self.tip = self.place.point - self.place.normal * self.depth;
    }

    /// The next depth on the way to a force, N, while the tissue pushes back with `felt`, N.
    fn depth_for(&self, force: f64, felt: f64, dt: f64) -> f64 {
        if self.depth < 0.0 {
            return 0.0;
        }
        let stiffness = (felt / self.depth.max(1e-6)).max(LEAST_STIFFNESS);
        let speed = (FORCE_PACE * (force - felt) / stiffness).clamp(-FORCE_SPEED, FORCE_SPEED);
        (self.depth + speed * dt).max(0.0)
    }

    /// Whether the hand can go to a place close over the skin.
    fn can_glide(&self, to: &Place) -> bool {
        (to.point - self.place.point).norm() < GLIDE && to.normal.dot(&self.place.normal) > 0.5
    }

    /// Moves along the skin towards a place: as a stroke, or faster in the air.
    fn follow(&mut self, skin: &Skin, to: Place, dt: f64) {
        let mut way = dt
            * if self.depth < 0.0 {
                AIR_SPEED
            } else {
                STROKE_SPEED
            };
        while way > 0.0 {
            let off = to.point - self.place.point;
            let step = way.min(GLIDE_STEP);
            if off.norm() <= step {
                self.place = to;
                return;
            }
            way -= step;
            let share = step / off.norm();
            let Some(mut place) = skin.nearest(self.place.point + off * share) else {
                return;
            };
            // The normal turns towards the goal's normal at the pace of the movement, so that it
            // does not jump at edges of triangles.
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

/// A depth that moves from one to another for `dt` seconds, m. It falls to a little above the skin, and goes on at the
/// speed of a press.
fn approached(from: f64, to: f64, dt: f64) -> f64 {
    if to < from {
        let speed = if from > 0.0 { PRESS_SPEED } else { FALL_SPEED };
        return (from - speed * dt).max(to);
    }
    let fallen = (from + FALL_SPEED * dt).min(to.min(from.max(-SLOW_BELOW)));
    let left = dt - (fallen - from) / FALL_SPEED;
    (fallen + PRESS_SPEED * left).min(to)
}

fn is_outside(skin: &Skin, at: Vec3) -> bool {
    skin.nearest(at)
        .is_none_or(|place| (at - place.point).dot(&place.normal) > 0.0)
}

/// Points of an arc around the body's long axis, at least `clear` (m) from every vertex of the
/// skin.
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

/// Orientation of a tool whose z axis is `normal` and whose x axis is nearest to `along`.
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
    use super::super::skin::MOST_OF_TISSUE;
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
        hand.set_goal(Some(Goal::at_depth(place, 5e-3)));
        let mut before = hand.advance(&skin, DT, Vec3::zeros());
        for _ in 0..60 {
            let pose = hand.advance(&skin, DT, Vec3::zeros());
            let way = pose.translation.vector - before.translation.vector;
            // Fast in the air, and at the speed of a press from a little above the skin.
            let above = place.normal.dot(&(before.translation.vector - place.point));
            let speed = if above > SLOW_BELOW + 1e-9 {
                FALL_SPEED
            } else {
                PRESS_SPEED
            };
            assert!(way.norm() <= speed * DT + 1e-9, "{way:?} at {above} m");
            before = pose;
        }
        let wanted = place.point - place.normal * 5e-3;
        assert!((before.translation.vector - wanted).norm() < 1e-9);
        assert!(!hand.is_lifted());
        hand.set_goal(None);
        (0..60).for_each(|_| before = hand.advance(&skin, DT, Vec3::zeros()));
        assert!(hand.is_lifted());
        assert!((before.rotation * Vec3::z() - place.normal).norm() < 1e-9);
    }

    #[test]
    fn it_aims_at_a_goal_that_stays_and_at_none_that_passes() {
        let skin = limb();
        let mut hand = hand(&skin);
        assert_eq!(hand.aim(), None);
        // The pointer runs along the limb, and stops.
        let goal = |x: f64| Some(Goal::at_depth(at(&skin, x, 0.0), -HOVER));
        for k in 0..20 {
            hand.set_goal(goal(0.04 + 4e-3 * f64::from(k)));
            hand.advance(&skin, DT, Vec3::zeros());
            assert_eq!(hand.aim(), None, "{k}");
        }
        // It jumps to another place: that is known before the hand is there.
        let last = at(&skin, 0.06, 0.0).point;
        hand.set_goal(goal(0.06));
        (0..3).for_each(|_| _ = hand.advance(&skin, DT, Vec3::zeros()));
        assert_eq!(hand.aim(), Some(last));
        assert!((hand.tip() - last).norm() > 10e-3);
        // A pointer that trembles keeps it.
        hand.set_goal(goal(0.0605));
        assert!(hand.aim().is_some_and(|aim| (aim - last).norm() < 1e-3));
        hand.set_goal(None);
        assert_eq!(hand.aim(), None);
    }

    #[test]
    fn it_never_presses_through_the_tissue() {
        let skin = limb();
        let mut hand = hand(&skin);
        let place = *hand.place();
        hand.set_goal(Some(Goal::at_depth(place, 1.0)));
        let mut pose = Pose::identity();
        (0..200).for_each(|_| pose = hand.advance(&skin, DT, Vec3::zeros()));
        let depth = place.normal.dot(&(place.point - pose.translation.vector));
        assert!((depth - MOST_OF_TISSUE * 28e-3).abs() < 1e-6, "{depth}");
    }

    #[test]
    fn to_the_other_side_it_goes_round_the_body() {
        let skin = limb();
        let mut hand = hand(&skin);
        let place = at(&skin, 0.05, std::f64::consts::PI);
        hand.set_goal(Some(Goal::at_depth(place, 4e-3)));
        let mut least = f64::INFINITY;
        let mut pose = Pose::identity();
        for _ in 0..300 {
            pose = hand.advance(&skin, DT, Vec3::zeros());
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
        hand.set_goal(Some(Goal::at_depth(place, 5e-3)));
        (0..60).for_each(|_| {
            hand.advance(&skin, DT, Vec3::zeros());
        });
        for k in 1..=60 {
            let place = at(&skin, 0.08, f64::from(k) * 0.02);
            hand.set_goal(Some(Goal::at_depth(place, 5e-3)));
            let tip = hand.advance(&skin, DT, Vec3::zeros()).translation.vector;
            assert!((tip.yz().norm() - 0.035).abs() < 8e-4, "{tip:?}");
        }
    }

    #[test]
    fn it_holds_a_force_that_it_feels_late() {
        let skin = limb();
        // Soft and stiff tissue that stiffens, felt three steps late.
        for stiffness in [120.0, 900.0] {
            let mut hand = hand(&skin);
            let place = *hand.place();
            let force = 1.5;
            hand.set_goal(Some(Goal {
                place,
                depth: 20e-3,
                force: Some(force),
            }));
            let push = |depth: f64| stiffness * depth.max(0.0) * (1.0 + 20.0 * depth.max(0.0));
            let mut past = [0.0; 4];
            let mut largest: f64 = 0.0;
            for _ in 0..180 {
                hand.advance(&skin, DT, place.normal * past[0]);
                past.rotate_left(1);
                past[3] = push(hand.depth);
                largest = largest.max(past[3]);
            }
            assert!(
                (push(hand.depth) - force).abs() < 0.01 * force,
                "{stiffness}"
            );
            assert!(largest < 1.1 * force, "{largest} N with {stiffness} N/m");
        }
        // Where the tissue is too soft for the force, it goes to the greatest depth.
        let mut hand = hand(&skin);
        let place = *hand.place();
        hand.set_goal(Some(Goal {
            place,
            depth: 4e-3,
            force: Some(50.0),
        }));
        for _ in 0..180 {
            let felt = place.normal * 100.0 * hand.depth.max(0.0);
            hand.advance(&skin, DT, felt);
        }
        assert!((hand.depth - 4e-3).abs() < 1e-9);
    }
}
