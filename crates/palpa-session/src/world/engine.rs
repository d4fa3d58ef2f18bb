//! Starts the engine on a world.

use nalgebra::Point3;
use palpa::live::{Look, Watch, open_device, servo_params};
use palpa_device::LiveTarget;
use palpa_mesh::Vec3;
use palpa_rt::{Engine, EngineParams, Priority, Reader, RecorderParams, TissueParams, Wish};
use palpa_servo::ServoParams;

use super::{Kind, World};
use crate::hand::{HandDriver, Place};

/// Time between two looks at the body, s: the period of a screen.
const LOOK_PERIOD: f64 = 1.0 / 60.0;
/// Least time between two steps of the tissue, s, because the browser needs the processor too.
const STEP_PERIOD: f64 = 2e-3;
/// The same while the body is at rest, s: a hand that comes down is 0.4 mm deeper by then.
const REST_PERIOD: f64 = 10e-3;
/// Age at which a patch is stale, s: a browser that draws without a graphics card takes both of two cores for so long at
/// times. Only a simulated hand may be served for so long by the same local model.
const STALE_AFTER: f64 = 0.25;
/// Requested priority of the threads that compute the force. A browser without a graphics card
/// takes every core it gets; the force has priority if the system grants it.
pub(crate) const BEFORE_THE_BROWSER: Wish = Wish {
    priority: Priority::Nice(-10),
    core: None,
};

/// A running engine with its ends on the session's side.
#[derive(Debug)]
pub(crate) struct Running {
    /// The engine.
    pub(crate) engine: Engine,
    /// The tissue's latest look at the body.
    pub(crate) looks: Reader<Look>,
    /// Commanded pose of the tool, device's frame.
    pub(crate) target: LiveTarget,
}

impl World {
    /// A hand that hovers over `place` with this world's tool.
    pub(crate) fn hand_over(&self, place: Place) -> HandDriver {
        let along = self.scene_from_device.rotation * Vec3::x();
        HandDriver::over(place, along, self.tool_size())
    }

    /// Starts the engine on the body at rest, with the tool's tip at `tip` (scene's frame, m).
    ///
    /// # Errors
    /// When the device cannot be opened, the body cannot be factored, or the system gives no
    /// thread.
    pub(crate) fn start(&self, tip: Vec3, recorder: &RecorderParams) -> anyhow::Result<Running> {
        let in_device = self
            .scene_from_device
            .inverse_transform_point(&Point3::from(tip));
        let target = LiveTarget::new(in_device.coords);
        let device = open_device(&self.scene.device, target.clone())?;
        let params = EngineParams {
            // All devices of a session are simulated yet.
            servo: ServoParams {
                stale_after: STALE_AFTER,
                ..servo_params(&*device)
            },
            time_waits: true,
            tissue: TissueParams {
                min_period: STEP_PERIOD,
                rest_period: REST_PERIOD,
                ..TissueParams::default()
            },
            tissue_wish: BEFORE_THE_BROWSER,
            background_wish: BEFORE_THE_BROWSER,
            ..EngineParams::default()
        };
        let devices = vec![device];
        let (watch, looks) = Watch::new(LOOK_PERIOD);
        let engine = match &self.kind {
            Kind::Tissue(live) => {
                let tissue = live.tissue_at(in_device.coords)?.watched(watch);
                Engine::start(tissue, devices, &params, recorder)?
            }
            Kind::Springs(springs) => {
                let tissue = springs.tissue(tip, Some(watch))?;
                Engine::start(tissue, devices, &params, recorder)?
            }
        };
        Ok(Running {
            engine,
            looks,
            target,
        })
    }
}
