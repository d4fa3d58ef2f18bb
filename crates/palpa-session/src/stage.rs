//! The body under the hand with its engine, or none.
//!
//! An engine starts on a body at rest and ends with it. When a new one cannot start, the body
//! before comes back.

use std::sync::Arc;
use std::time::Instant;

use anyhow::Context as _;
use nalgebra::Point3;
use palpa::live::{Look, Seen};
use palpa_mesh::Vec3;
use palpa_rt::{RecorderParams, StepRecord, TickEntry};
use palpa_viewer::control::{EngineFigures, Notice};

use crate::hand::{Ground, Hand, HandDriver, Lead, Place};
use crate::publish::Figures;
use crate::remote::Material;
use crate::world::{Running, World};

/// The body that is pressed.
pub(crate) struct Live {
    /// The body.
    pub(crate) world: World,
    /// The engine.
    pub(crate) running: Running,
    /// The hand.
    pub(crate) hand: Hand,
    /// The latest tick.
    pub(crate) entry: TickEntry,
    /// The tissue's last step.
    pub(crate) step: StepRecord,
    /// Number of the engine: no two of a session share it.
    pub(crate) engine: u64,
    figures: Figures,
    /// The engine's time at which the hand moved last, s.
    moved_at: f64,
}

/// Longest time by which the hand moves at once, s.
const LONGEST_MOVE: f64 = 0.1;

impl Live {
    /// Takes the latest data from engine and tissue.
    pub(crate) fn refresh(&mut self) {
        let snapshot = self.running.engine.snapshot();
        (self.entry, self.step) = (snapshot.tick, snapshot.step);
        self.figures.note(&self.entry);
        self.running.looks.take();
    }

    /// The latest look at the body.
    pub(crate) fn look(&self) -> &Look {
        self.running.looks.current()
    }

    /// Moves the hand as far as it comes in the engine's time since the last move. That time stands still while the
    /// engine has no core, and the hand must not run away from its device.
    pub(crate) fn move_hand(&mut self, now: Instant) {
        let dt = (self.entry.tick.now - self.moved_at).clamp(0.0, LONGEST_MOVE);
        self.moved_at = self.entry.tick.now;
        let frame = self.world.scene_from_device;
        let ground = Ground {
            skin: &self.world.skin,
            home: self.world.home,
            scene: &self.world.scene,
            scene_from_device: &frame,
            fine: self.running.looks.current().fine,
            felt: self
                .world
                .ruler
                .in_scene(self.entry.devices[0].tissue_force),
        };
        let pose = self.hand.advance(&ground, dt, now);
        self.running.target.set_pose(&(frame.inverse() * pose));
        let aim = self.hand.aim().map(Point3::from);
        let aim = aim.map(|aim| frame.inverse_transform_point(&aim).coords);
        self.running.engine.set_aim(aim);
    }

    /// The place of the skin under the tool.
    pub(crate) fn place(&self) -> Place {
        let at = Point3::from(self.entry.devices[0].position);
        let tip = (self.world.scene_from_device * at).coords;
        let World { skin, home, .. } = &self.world;
        self.hand.place_under(tip, skin, *home)
    }

    /// The body as the tissue left it last; at rest before the first step.
    pub(crate) fn body(&self) -> Option<Material> {
        Some(match &self.look().body {
            Some(Seen::Tissue(glance)) => {
                Material::Tissue(Arc::clone(glance.model()), glance.settled())
            }
            Some(Seen::Springs(displacements)) => {
                let body = Box::new(self.world.spring_body()?.clone());
                Material::Springs(body, displacements.clone())
            }
            None => match (self.world.first_model(), self.world.spring_body()) {
                (Some(model), _) => {
                    let at_rest = vec![Vec3::zeros(); model.n_nodes()];
                    Material::Tissue(model, at_rest)
                }
                (None, body) => {
                    let body = Box::new(body?.clone());
                    let at_rest = vec![Vec3::zeros(); body.n_nodes()];
                    Material::Springs(body, at_rest)
                }
            },
        })
    }

    /// The engine's figures, and notices of its errors, since the last call.
    pub(crate) fn figures(
        &mut self,
        n_nodes: usize,
        n_frames: u64,
    ) -> (EngineFigures, Vec<Notice>) {
        let report = self.running.engine.report();
        let late = self.running.engine.late_ticks();
        self.figures
            .make(&report, &late, &self.entry, &self.step, n_nodes, n_frames)
    }
}

/// The remains of a body whose engine has ended.
struct Stopped {
    world: World,
    lead: Lead,
    /// The place of the hand.
    point: Vec3,
}

/// A body under the hand, or none.
#[derive(Default)]
pub(crate) struct Stage {
    live: Option<Live>,
    n_engines: u64,
}

impl Stage {
    /// The body under the hand, if there is one.
    pub(crate) fn live(&self) -> Option<&Live> {
        self.live.as_ref()
    }

    /// The body under the hand, mutable.
    pub(crate) fn live_mut(&mut self) -> Option<&mut Live> {
        self.live.as_mut()
    }

    /// The body under the hand.
    ///
    /// # Errors
    /// When there is none.
    pub(crate) fn need(&mut self) -> anyhow::Result<&mut Live> {
        self.live.as_mut().context("there is no body yet")
    }

    /// Puts another body under the hand, at rest. If it is only a changed version of the old one,
    /// it is pressed at the same place.
    ///
    /// # Errors
    /// When the engine cannot start on it. The previous body is then restored, if its engine
    /// starts.
    pub(crate) fn replace(&mut self, world: World) -> anyhow::Result<()> {
        // End the old engine first: two at once would share the processor, and the first steps are
        // the most costly.
        let (before, lead) = match self.stop() {
            Some(Stopped { world, lead, point }) => (Some((world, point)), lead),
            None => (None, Lead::Nobody),
        };
        let same = (before.as_ref())
            .filter(|(old, _)| old.scene.body == world.scene.body)
            .and_then(|(_, point)| world.skin.nearest(*point));
        let unrecorded = RecorderParams::default();
        let mut failed = None;
        for place in same.into_iter().chain([world.home]) {
            match begin(&world, place, &unrecorded) {
                Ok(begun) => {
                    self.put(world, begun, lead);
                    return Ok(());
                }
                Err(error) => failed = Some(error),
            }
        }
        if let Some((old, _)) = before
            && let Ok(begun) = begin(&old, old.home, &unrecorded)
        {
            self.put(old, begun, lead);
        }
        Err(failed.unwrap_or_else(|| anyhow::anyhow!("there is no place to begin")))
    }

    /// Restarts the engine on the same body, at rest, with the hand at home. With a recorder, the
    /// hand begins where a replay of the log does.
    ///
    /// # Errors
    /// When there is no body, or its engine cannot start. If only the start with a recorder fails,
    /// the body is restored without one.
    pub(crate) fn restart(&mut self, recorder: &RecorderParams) -> anyhow::Result<()> {
        let stopped = self.stop().context("there is no body yet")?;
        let Stopped { world, lead, point } = stopped;
        let error = match begin(&world, world.home, recorder) {
            Ok(begun) => {
                self.put(world, begun, lead);
                return Ok(());
            }
            Err(error) => error,
        };
        if recorder.path.is_some() {
            let place = world.skin.nearest(point).unwrap_or(world.home);
            if let Ok(begun) = begin(&world, place, &RecorderParams::default()) {
                self.put(world, begun, lead);
            }
        }
        Err(error)
    }

    /// Ends the engine: forces ramp down, and a log is closed.
    pub(crate) fn end(&mut self) {
        self.stop();
    }

    fn stop(&mut self) -> Option<Stopped> {
        let live = self.live.take()?;
        live.running.engine.stop();
        Some(Stopped {
            world: live.world,
            point: live.hand.place().point,
            lead: live.hand.into_lead(),
        })
    }

    fn put(&mut self, world: World, (running, driver): (Running, HandDriver), lead: Lead) {
        self.n_engines += 1;
        self.live = Some(Live {
            world,
            running,
            hand: Hand::new(driver, lead),
            entry: TickEntry::default(),
            step: StepRecord::default(),
            engine: self.n_engines,
            figures: Figures::new(),
            moved_at: 0.0,
        });
    }
}

/// Starts the engine on a body at rest with the hand over a place; with a recorder, with the tip
/// where a replay begins.
fn begin(
    world: &World,
    place: Place,
    recorder: &RecorderParams,
) -> anyhow::Result<(Running, HandDriver)> {
    let driver = world.hand_over(place);
    let tip = if recorder.path.is_some() {
        world.beginning()
    } else {
        driver.tip()
    };
    Ok((world.start(tip, recorder)?, driver))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gallery;

    fn world() -> World {
        World::build(&gallery::scene("patch_tissue").unwrap()).unwrap()
    }

    #[test]
    fn the_body_comes_back_when_its_recording_cannot_start() {
        let mut stage = Stage::default();
        assert!(stage.need().is_err());
        assert!(stage.restart(&RecorderParams::default()).is_err());
        stage.replace(world()).unwrap();
        let before = stage.need().unwrap().engine;
        let folder = tempfile::tempdir().unwrap();
        let recorder = RecorderParams {
            // A folder cannot be opened as a log file.
            path: Some(folder.path().to_owned()),
            ..RecorderParams::default()
        };
        let error = stage.restart(&recorder).unwrap_err().to_string();
        assert!(error.contains("log"), "{error}");
        let live = stage.need().unwrap();
        assert!(live.engine > before);
        assert!(live.running.engine.ended().is_empty());
        stage.end();
        assert!(stage.live().is_none());
    }

    #[test]
    fn a_changed_body_is_pressed_where_it_was_before_and_the_motion_goes_on() {
        let mut stage = Stage::default();
        stage.replace(world()).unwrap();
        let live = stage.need().unwrap();
        let home = live.world.home;
        live.hand.run_motion(home, Instant::now());
        stage.replace(world()).unwrap();
        let live = stage.need().unwrap();
        assert!(live.hand.is_in_motion());
        assert!((live.hand.place().point - home.point).norm() < 1e-9);
        assert!(live.hand.end_motion() && !live.hand.end_motion());
    }
}
