//! The simulated device and hand against closed forms.

use nalgebra::UnitQuaternion;
use palpa_device::{
    DeviceModel, Fault, FaultSwitch, Faulty, Grip, HapticDevice, LiveTarget, Path, Scripted,
    SimulatedDevice, Vec3,
};
use palpa_servo::{ForceCommand, Pose};

fn force(z: f64) -> ForceCommand {
    ForceCommand {
        force: Vec3::new(0.0, 0.0, z),
        ..ForceCommand::ZERO
    }
}

#[test]
fn a_step_of_force_swings_as_a_damped_oscillator() {
    let grip = Grip {
        mass: 0.05,
        damping: 1.0,
        stiffness: 400.0,
    };
    let mut device = SimulatedDevice::new(DeviceModel::IDEAL, grip, Path::from(Vec3::zeros()));
    device.read(0.0).expect("a reading");
    device.write(0.0, &force(1.0)).expect("taken");
    let (m, b, k) = (0.1, 1.0, 400.0_f64);
    let decay = b / (2.0 * m);
    let omega = (k / m - decay * decay).sqrt();
    for tick in 1..500 {
        let t = f64::from(tick) * 1e-3;
        let x = device.read(t).expect("a reading").pose.translation.vector.z;
        let exact = (1.0
            - (-decay * t).exp() * ((omega * t).cos() + decay / omega * (omega * t).sin()))
            / k;
        assert!((x - exact).abs() < 1e-3 / k, "{t} {x} {exact}");
    }
}

#[test]
fn dry_friction_holds_and_lets_go() {
    let mut device =
        SimulatedDevice::new(DeviceModel::FALCON, Grip::SOFT, Path::from(Vec3::zeros()));
    for (z, moves) in [(0.14, false), (0.5, true)] {
        for tick in 0..300 {
            let now = f64::from(tick) * 1e-3 + if moves { 1.0 } else { 0.0 };
            device.read(now).expect("a reading");
            device.write(now, &force(z)).expect("taken");
        }
        assert_eq!(device.position().z != 0.0, moves);
    }
    // At rest anywhere that friction can hold.
    assert!((device.position().z - 0.5 / 200.0).abs() <= 0.15 / 200.0);
}

#[test]
fn readings_come_late_and_in_steps() {
    let path = Path::from(Vec3::zeros()).to(Vec3::new(0.0, 0.0, 0.02), 0.1);
    let mut device = SimulatedDevice::new(DeviceModel::FALCON, Grip::STIFF, path);
    let mut before = Vec3::zeros();
    for tick in 0..300 {
        let z = device
            .read(f64::from(tick) * 1e-3)
            .expect("a reading")
            .pose
            .translation
            .vector
            .z;
        let counts = z / 4.5e-5;
        assert!((counts - counts.round()).abs() < 1e-9);
        assert!(
            (z - before.z).abs() <= 0.5 * 4.5e-5 + 1e-12,
            "not a tick late"
        );
        before = device.position();
    }
    assert!(before.z > 0.015);
}

#[test]
fn too_much_force_is_cut_and_nan_is_none() {
    let mut device =
        SimulatedDevice::new(DeviceModel::TOUCH, Grip::SOFT, Path::from(Vec3::zeros()));
    device.read(0.0).expect("a reading");
    device.write(0.0, &force(50.0)).expect("taken");
    device.read(0.01).expect("a reading");
    assert!((device.acting_force().z - 3.3).abs() < 1e-12);
    device.write(0.01, &force(f64::NAN)).expect("taken");
    device.read(0.02).expect("a reading");
    assert_eq!(device.acting_force(), Vec3::zeros());
}

#[test]
fn a_live_hand_goes_where_it_is_set() {
    let target = LiveTarget::new(Vec3::zeros());
    let mut device = SimulatedDevice::live(DeviceModel::INVERSE3, Grip::MEDIUM, target.clone());
    device.read(0.0).expect("a reading");
    target.set(Vec3::new(0.01, -0.02, 0.03));
    target.set(Vec3::new(f64::NAN, 0.0, 0.0));
    device.read(0.2).expect("a reading");
    device.read(0.4).expect("a reading");
    assert!((device.position() - target.get()).norm() < 0.05 / 400.0 + 1e-4);
}

#[test]
fn a_live_hand_turns_and_neither_jumps_nor_overshoots() {
    let target = LiveTarget::new(Vec3::zeros());
    let mut device = SimulatedDevice::live(DeviceModel::IDEAL, Grip::STIFF, target.clone());
    device.read(0.0).expect("a reading");
    let turn = UnitQuaternion::from_euler_angles(0.0, 0.5, 0.0);
    target.set_pose(&Pose::from_parts(Vec3::new(0.02, 0.0, 0.0).into(), turn));
    let mut before = Pose::identity();
    for tick in 1..400 {
        let pose = device.read(f64::from(tick) * 1e-3).expect("a reading").pose;
        let way = (pose.translation.vector - before.translation.vector).norm();
        assert!(way < 1e-3, "{way} m in a tick");
        assert!(pose.translation.x < 0.0205);
        assert!(pose.rotation.angle_to(&before.rotation) < 0.05);
        before = pose;
    }
    assert!(before.rotation.angle_to(&turn) < 1e-3);
    assert!((before.translation.x - 0.02).abs() < 1e-4);
}

#[test]
fn the_same_run_is_the_same_to_the_bit() {
    let run = || {
        let path = Path::drag(Vec3::zeros(), -Vec3::z(), 0.01, Vec3::x() * 0.02, 0.1, 2)
            .trembling(1e-4, 7, 0.0, 2.0);
        let mut device = SimulatedDevice::new(DeviceModel::TOUCH, Grip::MEDIUM, path);
        for tick in 0..1000 {
            let now = f64::from(tick) * 1e-3;
            let z = device
                .read(now)
                .expect("a reading")
                .pose
                .translation
                .vector
                .z;
            device.write(now, &force(-200.0 * z)).expect("taken");
        }
        device.position()
    };
    assert_eq!(run(), run());
}

#[test]
fn scripts_and_faults_do_as_they_are_told() {
    let path = Path::from(Vec3::zeros()).to(Vec3::z(), 1.0);
    let mut scripted = Scripted::new(path.clone(), DeviceModel::IDEAL.spec);
    scripted.read(5.0).expect("a reading");
    let state = scripted.read(5.7).expect("a reading");
    assert!((state.pose.translation.vector - path.at(0.7)).norm() < 1e-12);
    let unplugged = FaultSwitch::default();
    let mut faulty = Faulty::new(scripted)
        .with_switch(&unplugged, Fault::Unplug)
        .with(6.0, 6.1, Fault::Unplug)
        .with(6.1, 6.2, Fault::NotANumber)
        .with(6.2, 6.3, Fault::Jump(Vec3::x()));
    assert!(faulty.read(6.05).is_err() && faulty.write(6.05, &force(1.0)).is_err());
    assert_eq!(faulty.inner().command(), ForceCommand::ZERO);
    assert!(
        faulty
            .read(6.15)
            .expect("a reading")
            .pose
            .translation
            .vector
            .x
            .is_nan()
    );
    assert!(
        (faulty
            .read(6.25)
            .expect("a reading")
            .pose
            .translation
            .vector
            .x
            - 1.0)
            .abs()
            < 1e-12
    );
    assert!(faulty.read(6.35).is_ok());
    unplugged.set(true);
    assert!(faulty.read(6.4).is_err());
    unplugged.set(false);
    assert!(faulty.read(6.45).is_ok());
}
