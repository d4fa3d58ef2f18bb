//! Devices opened from their description.

use palpa_device::{
    DeviceFault, DeviceModel, DeviceSetup, Driver, Fault, FaultSwitch, Faulty, Grip, HandTarget,
    HapticDevice, LiveTarget, Path, SimulatedDevice, Vec3,
};
use palpa_servo::{ForceCommand, Pose};

fn open(target: impl Into<HandTarget>) -> Box<dyn HapticDevice> {
    let setup = DeviceSetup {
        driver: Driver::Simulated,
        model: DeviceModel::FALCON,
        grip: Grip::STIFF,
        target: target.into(),
    };
    setup.open().expect("a simulated device always opens")
}

/// Pushes against two devices in the same way and compares their readings bit for bit.
fn check_alike(one: &mut dyn HapticDevice, other: &mut dyn HapticDevice, ticks: u32) {
    for tick in 0..ticks {
        let now = f64::from(tick) * 1e-3;
        let command = ForceCommand {
            force: Vec3::new(0.1, 0.0, f64::from(tick % 70) * 0.05),
            ..ForceCommand::ZERO
        };
        let read = [one.read(now), other.read(now)].map(|r| r.expect("a reading").pose);
        let bits = |pose: &Pose| pose.to_homogeneous().map(f64::to_bits);
        assert_eq!(bits(&read[0]), bits(&read[1]), "tick {tick}");
        one.write(now, &command).expect("taken");
        other.write(now, &command).expect("taken");
    }
}

#[test]
fn a_path_and_a_live_target_open_the_simulated_device_with_their_figures() {
    let path = Path::press(Vec3::zeros(), -Vec3::z(), 0.01, 0.05, 1.0).trembling(1e-4, 7, 0.0, 1.0);
    let mut opened = open(path.clone());
    assert_eq!(opened.spec(), DeviceModel::FALCON.spec);
    assert!((opened.resolution() - DeviceModel::FALCON.resolution).abs() < 1e-18);
    let mut named = SimulatedDevice::new(DeviceModel::FALCON, Grip::STIFF, path);
    check_alike(&mut opened, &mut named, 900);
    assert!(named.position().z < -5e-3);

    let target = LiveTarget::new(Vec3::zeros());
    let mut opened = open(target.clone());
    let mut named = SimulatedDevice::live(DeviceModel::FALCON, Grip::STIFF, target.clone());
    target.set(Vec3::new(0.01, 0.0, -0.02));
    check_alike(&mut opened, &mut named, 400);
    assert!((named.position() - target.get()).norm() < 0.02);
}

#[test]
fn an_opened_device_can_fail_on_purpose() {
    let switch = FaultSwitch::default();
    let mut device =
        Faulty::new(open(Path::from(Vec3::zeros()))).with_switch(&switch, Fault::Unplug);
    assert_eq!(device.spec(), DeviceModel::FALCON.spec);
    assert!(device.resolution() > 0.0);
    assert!(device.read(0.0).is_ok());
    switch.set(true);
    assert_eq!(device.read(1e-3), Err(DeviceFault::Unplugged));
    switch.set(false);
    assert!(device.read(2e-3).is_ok());
}
