//! The scene's device, and the path of the hand that holds it.

use palpa_device::{
    DeviceFault, DeviceModel, DeviceSetup, Driver, Grip, HandTarget, HapticDevice, Path,
};
use palpa_scene::{Device, DeviceKind, DevicePreset, Motion, MotionKind, Scene};
use palpa_servo::{Pose, ServoParams, Vec3};

/// Rest over the skin between two motions, s.
const PAUSE: f64 = 0.3;
/// Rest at the beginning, s, while the force ramps up.
const BEGIN: f64 = 0.7;
/// At the end the hand presses and stands still for this long, s, so that a force that does not
/// settle becomes visible.
const STILL: f64 = 3.5;
/// Circles of a palpation: radius in m, and circles per second.
const CIRCLE: f64 = 2e-3;
const CIRCLES: f64 = 2.0;
/// Seed of the hand's tremor.
const SEED: u64 = 7;

/// Smallest sensor step that the law assumes, m; simulated sensors can be exact.
const LEAST_RESOLUTION: f64 = 1e-6;

/// Opens the device that a scene asks for. `target` is the motion of a simulated hand in the
/// device's frame; a person's hand does not need it.
///
/// # Errors
/// If a real device is not connected or does not answer. A simulated one always opens.
pub fn open_device(
    device: &Device,
    target: impl Into<HandTarget>,
) -> Result<Box<dyn HapticDevice>, DeviceFault> {
    let setup = DeviceSetup {
        driver: match device.kind {
            DeviceKind::Simulated => Driver::Simulated,
        },
        model: device_model(device.preset),
        grip: grip(device.grip),
        target: target.into(),
    };
    setup.open()
}

/// Parameters of the 1 kHz law for a device.
pub fn servo_params(device: &dyn HapticDevice) -> ServoParams {
    ServoParams {
        resolution: device.resolution().max(LEAST_RESOLUTION),
        ..ServoParams::default()
    }
}

/// Data of the scene's device.
pub fn device_model(preset: DevicePreset) -> DeviceModel {
    match preset {
        DevicePreset::Falcon => DeviceModel::FALCON,
        DevicePreset::Touch => DeviceModel::TOUCH,
        DevicePreset::Inverse3 => DeviceModel::INVERSE3,
        DevicePreset::Ideal => DeviceModel::IDEAL,
    }
}

/// Data of the hand that holds the device.
pub fn grip(grip: palpa_scene::Grip) -> Grip {
    match grip {
        palpa_scene::Grip::Soft => Grip::SOFT,
        palpa_scene::Grip::Medium => Grip::MEDIUM,
        palpa_scene::Grip::Stiff => Grip::STIFF,
    }
}

/// Path of the hand in the device's frame: the scene's motion, repeated for `seconds`, and at the
/// end a press held still.
pub fn path(scene: &Scene, scene_from_device: &Pose, seconds: f64) -> Path {
    let motion = &scene.motion;
    let across = across(motion, scene_from_device);
    let mut path = Path::from(start(motion, &across)).hold(BEGIN);
    let press_time = 1.875 * (motion.above + motion.depth) / motion.speed;
    let until = seconds - STILL - press_time;
    let mut length = 0.0;
    while path.duration() + length < until {
        let began = path.duration();
        path = once(path, motion, &across).hold(PAUSE);
        length = path.duration() - began;
    }
    let down = Vec3::z() * -(motion.above + motion.depth);
    let end = path.end();
    let rest = (until - 0.5 - path.duration()).max(0.0);
    path = path.hold(rest);
    path = path
        .to(Vec3::new(0.0, 0.0, end.z), motion.speed)
        .to(down, motion.speed)
        .hold(STILL + 10.0);
    if motion.tremor > 0.0 {
        let still_from = seconds - STILL;
        path = path.trembling(motion.tremor, SEED, 0.0, still_from);
    }
    path
}

/// One performance of the scene's motion: from the hand's position `at` (device's frame, m) to the
/// start of the motion, and back there at the end.
pub fn once_from(at: Vec3, scene: &Scene, scene_from_device: &Pose) -> Path {
    let across = across(&scene.motion, scene_from_device);
    let begin = start(&scene.motion, &across);
    let path = Path::from(at).to(begin, scene.motion.speed).hold(PAUSE);
    once(path, &scene.motion, &across)
}

/// Unit vector in the device's plane along which the hand moves across the skin.
pub fn across(motion: &Motion, scene_from_device: &Pose) -> Vec3 {
    let along = motion.along.map_or(Vec3::x(), |along| {
        scene_from_device
            .rotation
            .inverse_transform_vector(&Vec3::from(along))
    });
    Vec3::new(along.x, along.y, 0.0)
        .try_normalize(1e-6)
        .unwrap_or_else(Vec3::x)
}

/// Start of the hand, in the device's frame, m.
pub(super) fn beginning(scene: &Scene, scene_from_device: &Pose) -> Vec3 {
    start(&scene.motion, &across(&scene.motion, scene_from_device))
}

fn start(motion: &Motion, across: &Vec3) -> Vec3 {
    if motion.kind.goes_across() {
        across * (-0.5 * motion.length)
    } else {
        Vec3::zeros()
    }
}

/// Appends the motion once, and the way back over the skin.
fn once(mut path: Path, motion: &Motion, across: &Vec3) -> Path {
    let (from, speed) = (start(motion, across), motion.speed);
    let down = Vec3::z() * -(motion.above + motion.depth);
    let to = from + across * motion.length;
    match motion.kind {
        MotionKind::Press => path.to(down, speed).hold(motion.hold).to(from, speed),
        MotionKind::Stroke => path
            .to(from + down, speed)
            .to(to + down, speed)
            .to(to, speed)
            .to(from, speed),
        MotionKind::Drag => {
            path = path.to(from + down, speed);
            for _ in 0..motion.times {
                path = path.to(to + down, speed).to(from + down, speed);
            }
            path.to(from, speed)
        }
        MotionKind::Tap => {
            for _ in 0..motion.times {
                path = path.to(down, speed).to(from, speed).hold(0.1);
            }
            path
        }
        MotionKind::Palpate => {
            let side = Vec3::z().cross(across);
            for k in 0..motion.times {
                let share = f64::from(k) / f64::from(motion.times.max(2) - 1);
                let over = from + (to - from) * share;
                path = path.to(over, speed).to(over + down, speed);
                let (began, ends) = (path.duration(), path.duration() + motion.hold);
                let quarter = std::f64::consts::FRAC_PI_2;
                path = path
                    .hold(motion.hold)
                    .with_wave(across * CIRCLE, CIRCLES, 0.0, began, ends)
                    .with_wave(side * CIRCLE, CIRCLES, quarter, began, ends)
                    .to(over, speed);
            }
            path.to(from, speed)
        }
    }
}
