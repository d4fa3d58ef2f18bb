//! The hand that holds the tool: its leader and its goals.
//!
//! ```text
//!          a page says where            the scene's motion is started
//!  Nobody ─────────────────► Page    ──────────────────────────────► Homing ──► Moving ──► Nobody
//!     ▲ silent for 3 s, or lifts │                                over the motion's start
//!     └──────────────────────────┘
//! ```
//! [`skin`] knows the places of the skin, [`driver`] the path between them.

mod driver;
mod skin;

use std::time::{Duration, Instant};

use anyhow::{Context as _, bail};
use nalgebra::Point3;
use palpa::live::once_from;
use palpa_device::Path;
use palpa_mesh::Vec3;
use palpa_scene::Scene;
use palpa_servo::Pose;
use palpa_viewer::control;

pub(crate) use driver::{Goal, HOVER, HandDriver};
pub(crate) use skin::{Place, Skin};

/// A page that presses sends the hand's place at least this often. After a longer silence the hand
/// lifts. A page that draws in software on a busy machine may be silent for more than a second.
const SILENCE: Duration = Duration::from_secs(3);
/// The hand first goes to the start of the scene's motion, and waits there for a fine mesh; after this time
/// the motion starts anyway.
const HOMING: Duration = Duration::from_secs(5);
/// Distance from the start of the motion at which the hand has arrived, m.
const ARRIVED: f64 = 1e-4;
/// The scene's motion starts where the mesh is fine: within this share of the radius of its fine part.
const FINE: f64 = 0.5;
/// Largest force that a page may ask to be held, N: more than any device here gives.
const MOST_FORCE: f64 = 100.0;
/// Largest coordinate that a page may send, m: no body is larger.
const FAR: f64 = 100.0;

/// The leader of the hand.
#[derive(Debug, Default)]
pub(crate) enum Lead {
    /// No leader: the hand lifts, or is lifted.
    #[default]
    Nobody,
    /// A page.
    Page {
        /// When the page last sent a place.
        heard: Instant,
    },
    /// The scene's motion, while the hand is on its way to the start.
    Homing {
        /// Time of the request.
        since: Instant,
    },
    /// The scene's motion.
    Moving {
        /// Path of the tip in the device's frame.
        path: Path,
        /// Time along the path, s.
        time: f64,
    },
}

impl Lead {
    fn is_motion(&self) -> bool {
        matches!(self, Self::Homing { .. } | Self::Moving { .. })
    }
}

/// The surroundings in which a hand moves.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ground<'a> {
    /// The skin at rest.
    pub(crate) skin: &'a Skin,
    /// The place that the scene presses, start of its motion.
    pub(crate) home: Place,
    /// The scene, for its motion.
    pub(crate) scene: &'a Scene,
    /// Pose of the device's frame in the scene.
    pub(crate) scene_from_device: &'a Pose,
    /// The fine part of the mesh (centre and radius, m), where it moves with the hand.
    pub(crate) fine: Option<(Vec3, f64)>,
    /// Force of the tissue on the tool, N.
    pub(crate) felt: Vec3,
}

/// The hand.
#[derive(Debug)]
pub(crate) struct Hand {
    driver: HandDriver,
    lead: Lead,
}

impl Hand {
    /// A hand that `driver` moves and `lead` leads.
    pub(crate) fn new(driver: HandDriver, lead: Lead) -> Self {
        Self { driver, lead }
    }

    /// A page leads the hand to `goal`.
    ///
    /// # Errors
    /// While the scene's motion runs.
    pub(crate) fn put(&mut self, goal: Goal, now: Instant) -> anyhow::Result<()> {
        if self.lead.is_motion() {
            bail!("the motion of the scene is running; stop it before you move the hand");
        }
        self.driver.set_goal(Some(goal));
        self.lead = Lead::Page { heard: now };
        Ok(())
    }

    /// Lifts the tool off the skin. A running motion of the scene goes on.
    pub(crate) fn lift(&mut self) {
        if !self.lead.is_motion() {
            self.lead = Lead::Nobody;
        }
        self.driver.set_goal(None);
    }

    /// Starts the scene's motion. First the hand goes to a point over `home`.
    pub(crate) fn run_motion(&mut self, home: Place, now: Instant) {
        let goal = Goal::at_depth(home, -HOVER);
        self.driver.set_goal(Some(goal));
        self.lead = Lead::Homing { since: now };
    }

    /// Ends the scene's motion and leaves the goal as it is. Returns whether a motion ran.
    pub(crate) fn end_motion(&mut self) -> bool {
        let is_motion = self.is_in_motion();
        if is_motion {
            self.lead = Lead::Nobody;
        }
        is_motion
    }

    /// Whether the scene's motion runs, or the hand is on the way to its start.
    pub(crate) fn is_in_motion(&self) -> bool {
        self.lead.is_motion()
    }

    /// Deepest press at the hand's goal, m.
    pub(crate) fn deepest(&self) -> f64 {
        self.driver.deepest()
    }

    /// The place of the skin that the hand hovers over or presses.
    pub(crate) fn place(&self) -> &Place {
        self.driver.place()
    }

    /// The place of the skin where the hand means to press, if it stays with it; `None` on the path of the scene's motion.
    pub(crate) fn aim(&self) -> Option<Vec3> {
        match self.lead {
            Lead::Moving { .. } => None,
            _ => self.driver.aim(),
        }
    }

    /// The place from which the depth of a tip is measured: the hand's own, or the nearest on the
    /// skin while the hand travels or the scene's motion leads it.
    pub(crate) fn place_under(&self, tip: Vec3, skin: &Skin, home: Place) -> Place {
        if matches!(self.lead, Lead::Moving { .. }) || self.driver.is_travelling() {
            skin.nearest(tip).unwrap_or(home)
        } else {
            *self.driver.place()
        }
    }

    /// The leader that continues after a restart of the engine.
    pub(crate) fn into_lead(self) -> Lead {
        self.lead
    }

    /// Moves the hand by `dt` seconds. Returns the commanded pose of the tool in the scene's frame.
    pub(crate) fn advance(&mut self, ground: &Ground<'_>, dt: f64, now: Instant) -> Pose {
        let frame = ground.scene_from_device;
        match &mut self.lead {
            Lead::Nobody => {}
            Lead::Page { heard } => {
                if now.saturating_duration_since(*heard) > SILENCE {
                    self.lift();
                }
            }
            Lead::Homing { since } => {
                let since = *since;
                let pose = self.driver.advance(ground.skin, dt, ground.felt);
                let off = |from: Vec3| (ground.home.point - from).norm();
                let is_home = off(self.driver.place().point) < ARRIVED && self.driver.is_lifted();
                let is_fine = (ground.fine).is_none_or(|(middle, r)| off(middle) < FINE * r);
                if is_home && is_fine || now.saturating_duration_since(since) > HOMING {
                    let at = frame.inverse_transform_point(&Point3::from(self.driver.tip()));
                    let path = once_from(at.coords, ground.scene, frame);
                    self.lead = Lead::Moving { path, time: 0.0 };
                }
                return pose;
            }
            Lead::Moving { path, time } => {
                *time += dt;
                let at = path.at(*time);
                if *time > path.duration() {
                    self.lead = Lead::Nobody;
                    self.driver.set_goal(None);
                }
                return frame * Pose::translation(at.x, at.y, at.z);
            }
        }
        self.driver.advance(ground.skin, dt, ground.felt)
    }
}

/// The goal of a page's request: the place of the skin nearest to its point, at most
/// `greatest_depth` (m) deep.
///
/// # Errors
/// When a number is not finite or out of range.
pub(crate) fn goal_of(
    hand: &control::Hand,
    skin: &Skin,
    greatest_depth: f64,
) -> anyhow::Result<Goal> {
    let point = in_range(hand.point, "point")?;
    let normal = in_range(hand.normal, "normal")?;
    if !hand.depth.is_finite() {
        bail!("the depth is not a number");
    }
    if hand
        .force
        .is_some_and(|force| !(0.0..=MOST_FORCE).contains(&force))
    {
        bail!("the force must lie between 0 and {MOST_FORCE} N");
    }
    let place = skin.nearest(point).context("there is no skin")?;
    let normal = normal.try_normalize(1e-6).unwrap_or(place.normal);
    // A page's normal far from the skin's own is wrong: use the skin's own.
    let normal = if normal.dot(&place.normal) > 0.5 {
        normal
    } else {
        place.normal
    };
    Ok(Goal {
        place: Place { normal, ..place },
        depth: hand.depth.min(greatest_depth),
        force: hand.force,
    })
}

/// A vector that a page sent, m; `what` names it in the error.
///
/// # Errors
/// When a coordinate is not finite, or larger than any body.
pub(crate) fn in_range(v: [f64; 3], what: &str) -> anyhow::Result<Vec3> {
    if v.iter().all(|x| x.abs() < FAR) {
        Ok(v.into())
    } else {
        bail!("the {what} is out of range: its coordinates must lie between -{FAR} and {FAR}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpa_mesh::generate::limb;

    const DT: f64 = 1.0 / 60.0;

    struct Bench {
        skin: Skin,
        scene: Scene,
        frame: Pose,
        home: Place,
        hand: Hand,
        now: Instant,
    }

    impl Bench {
        /// A hand over a limb of radius 40 mm along x; `start` metres along it.
        fn new(start: f64) -> Self {
            let (surface, _) = limb::cylinder(0.16, 0.04, 0.012, 6e-3);
            let n = surface.points.len();
            let skin = Skin::new(surface, vec![28e-3; n]);
            let over = |x| skin.nearest(Vec3::new(x, 0.0, 0.05)).unwrap();
            let (home, place) = (over(0.08), over(start));
            let scene = Scene::embedded();
            let tip = home.point + home.normal * scene.motion.above;
            Self {
                hand: Hand::new(HandDriver::over(place, Vec3::x(), 10e-3), Lead::Nobody),
                frame: Pose::translation(tip.x, tip.y, tip.z),
                now: Instant::now(),
                skin,
                scene,
                home,
            }
        }

        fn run(&mut self, seconds: f64) -> Pose {
            let mut pose = Pose::identity();
            for _ in 0..(seconds / DT).round() as usize {
                self.now += Duration::from_secs_f64(DT);
                let ground = Ground {
                    skin: &self.skin,
                    home: self.home,
                    scene: &self.scene,
                    scene_from_device: &self.frame,
                    fine: None,
                    felt: Vec3::zeros(),
                };
                pose = self.hand.advance(&ground, DT, self.now);
            }
            pose
        }

        fn depth(&self, pose: &Pose) -> f64 {
            let place = self.hand.place();
            place.normal.dot(&(place.point - pose.translation.vector))
        }
    }

    #[test]
    fn the_hand_lifts_when_its_page_falls_silent() {
        let mut bench = Bench::new(0.08);
        let goal = Goal::at_depth(bench.home, 5e-3);
        bench.hand.put(goal, bench.now).unwrap();
        let pressed = bench.run(2.9);
        assert!((bench.depth(&pressed) - 5e-3).abs() < 1e-9);
        // Heard again: it stays for as long again.
        bench.hand.put(goal, bench.now).unwrap();
        let pressed = bench.run(2.9);
        assert!((bench.depth(&pressed) - 5e-3).abs() < 1e-9);
        let lifted = bench.run(1.0);
        assert!((bench.depth(&lifted) + HOVER).abs() < 1e-9);
    }

    #[test]
    fn a_motion_starts_once_the_hand_is_home_and_ends_lifted() {
        let mut bench = Bench::new(0.03);
        bench.hand.run_motion(bench.home, bench.now);
        assert!(bench.hand.is_in_motion());
        bench.run(0.1);
        assert!(matches!(bench.hand.lead, Lead::Homing { .. }));
        let mut n_steps = 0;
        while matches!(bench.hand.lead, Lead::Homing { .. }) {
            bench.run(0.05);
            n_steps += 1;
            assert!(n_steps < 200, "the hand never comes home");
        }
        let Lead::Moving { path, time } = &bench.hand.lead else {
            panic!("{:?}", bench.hand.lead)
        };
        let rest = path.duration() - time;
        let goal = Goal::at_depth(bench.home, 1e-3);
        let refused = bench.hand.put(goal, bench.now).unwrap_err().to_string();
        assert!(
            refused.contains("motion of the scene is running"),
            "{refused}"
        );
        bench.run(rest + 1.0);
        assert!(!bench.hand.is_in_motion());
        let pose = bench.run(1.0);
        assert!((bench.depth(&pose) + HOVER).abs() < 1e-9);
    }

    #[test]
    fn a_motion_starts_anyway_when_the_hand_is_held_up() {
        let mut bench = Bench::new(0.03);
        bench.hand.run_motion(bench.home, bench.now);
        // Without its goal the hand never comes home.
        bench.hand.lift();
        bench.run(4.9);
        assert!(matches!(bench.hand.lead, Lead::Homing { .. }));
        bench.run(0.2);
        assert!(matches!(bench.hand.lead, Lead::Moving { .. }));
    }

    #[test]
    fn a_page_cannot_lead_the_hand_out_of_range_or_into_the_body() {
        let bench = Bench::new(0.08);
        let mut asked = control::Hand {
            point: bench.home.point.into(),
            normal: (-bench.home.normal).into(),
            depth: 1.0,
            force: None,
        };
        let goal = goal_of(&asked, &bench.skin, 6e-3).unwrap();
        assert!((goal.depth - 6e-3).abs() < 1e-12);
        assert!(goal.place.normal.dot(&bench.home.normal) > 0.99);
        asked.force = Some(-1.0);
        let error = goal_of(&asked, &bench.skin, 6e-3).unwrap_err().to_string();
        assert!(error.contains("force must lie between 0"), "{error}");
        asked.force = None;
        asked.point[1] = 1e308;
        let error = goal_of(&asked, &bench.skin, 6e-3).unwrap_err().to_string();
        assert!(error.contains("point is out of range"), "{error}");
        asked.point[1] = f64::NAN;
        assert!(goal_of(&asked, &bench.skin, 6e-3).is_err());
    }
}
