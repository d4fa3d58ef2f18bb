//! Nothing rattles, in no hand, on no tissue.

use palpa_device::{BedParams, DeviceModel, Grip, Path, Trial, Vec3};
use palpa_servo::ServoParams;

/// What is pressed, by name: soft fat, skin over bone, an edge of a lump, all with friction or
/// without.
fn beds() -> [(&'static str, BedParams); 4] {
    let soft = BedParams {
        compliance: 0.012,
        ..BedParams::default()
    };
    [
        ("fat", soft),
        (
            "bone",
            BedParams {
                compliance: 4e-4,
                stiffening: 200.0,
                ..soft
            },
        ),
        (
            "edge",
            BedParams {
                edge: 8.0,
                compliance: 5e-3,
                ..soft
            },
        ),
        (
            "friction",
            BedParams {
                friction: 0.6,
                compliance: 5e-3,
                ..soft
            },
        ),
    ]
}

fn trial(device: DeviceModel, grip: Grip, bed: BedParams, patch_rate: f64) -> Trial {
    let above = Vec3::new(-3e-3, 0.0, bed.radius + 2e-3);
    let path = Path::from(above)
        .hold(0.8)
        .to(above - Vec3::z() * 8e-3, 0.05)
        .to(above + Vec3::new(4e-3, 1e-3, -7e-3), 0.05)
        .hold(3.0);
    Trial {
        device,
        grip,
        bed,
        path,
        patch_rate,
        duration: 4.0,
        servo: ServoParams::default(),
    }
}

#[test]
fn force_is_quiet_and_energy_is_not_made() {
    let mut bad = Vec::new();
    for (name, device) in DeviceModel::ALL {
        for (grip_name, grip) in [
            ("soft", Grip::SOFT),
            ("medium", Grip::MEDIUM),
            ("stiff", Grip::STIFF),
        ] {
            for (bed_name, bed) in beds() {
                let trial = trial(device, grip, bed, 200.0);
                let report = trial.run();
                let last = report.samples.last().expect("samples");
                let tool = &last.report.tools[0];
                let line = format!(
                    "{name:8} {grip_name:6} {bed_name:8} rms {:.4} N  deficit {:.2e} J  steps {:.4} {:.4} N  force {:.2} N  k {:.0} soft {:.2} sweeps {} damping {:.2}",
                    report.rms,
                    report.deficit,
                    report.arrival_step,
                    report.other_step,
                    last.force.norm(),
                    tool.stiffness,
                    tool.softening,
                    report
                        .samples
                        .iter()
                        .map(|s| s.report.sweeps)
                        .max()
                        .unwrap_or(0),
                    report
                        .samples
                        .iter()
                        .map(|s| s.report.tools[0].damping)
                        .fold(0.0, f64::max),
                );
                println!("{line}");
                assert!(last.force.norm() > 0.1, "{line}");
                let is_bumpy = report.arrival_step > 2.0 * report.other_step;
                if report.rms >= 0.02 || report.deficit > trial.servo.energy_budget || is_bumpy {
                    bad.push(line);
                }
            }
        }
    }
    assert!(bad.is_empty(), "{}", bad.join("\n"));
}

#[test]
fn all_rates_of_patches_are_quiet() {
    for rate in [100.0, 300.0, 500.0] {
        for (bed_name, bed) in beds() {
            let report = trial(DeviceModel::FALCON, Grip::MEDIUM, bed, rate).run();
            assert!(report.rms < 0.02, "{rate} {bed_name}: {}", report.rms);
        }
    }
}

#[test]
fn a_trembling_hand_gets_smooth_forces() {
    // A hand that never rests: what comes at a patch is no more than what comes between.
    for (bed_name, bed) in beds() {
        let mut trial = trial(DeviceModel::IDEAL, Grip::MEDIUM, bed, 200.0);
        trial.path = trial.path.trembling(1e-4, 5, 0.0, 6.0);
        let report = trial.run();
        let (arrival, other) = (report.arrival_step, report.other_step);
        println!("{bed_name}: arrival {arrival:.4} N, others {other:.4} N");
        assert!(arrival <= 2.0 * other, "{bed_name}: {arrival} {other}");
    }
}

#[test]
fn the_stable_range_has_an_end_and_damping_and_guard_widen_it() {
    let stiffnesses = [500.0, 2000.0, 8000.0, 32000.0];
    let without = palpa_device::z_width(
        &DeviceModel::IDEAL,
        &Grip::SOFT,
        &stiffnesses,
        &[0.0, 2.0],
        false,
    );
    let with = palpa_device::z_width(&DeviceModel::IDEAL, &Grip::SOFT, &stiffnesses, &[0.0], true);
    for point in without.iter().chain(&with) {
        println!("{point:?}");
    }
    // The trial can fail: that is what makes the others' quiet worth something.
    assert!(without[0].is_stable && !without[3].is_stable);
    let stable =
        |points: &[palpa_device::ZWidthPoint]| points.iter().filter(|p| p.is_stable).count();
    assert!(stable(&without[4..]) >= stable(&without[..4]));
    assert!(stable(&with) >= stable(&without[..4]));
}

#[test]
fn the_stiffness_limits_hold_in_every_hand_without_the_guard() {
    for (name, device) in DeviceModel::ALL {
        for grip in [Grip::SOFT, Grip::MEDIUM, Grip::STIFF] {
            let most = device.spec.max_stiffness;
            let stiffnesses = [
                most,
                1.25 * most,
                1.5 * most,
                2.0 * most,
                4.0 * most,
                8.0 * most,
            ];
            let points = palpa_device::z_width(&device, &grip, &stiffnesses, &[0.0], false);
            let stable = points.iter().take_while(|p| p.is_stable).count();
            println!(
                "{name} in a hand of {:.0} N/m: stable to {:.0} N/m or more, {:.4} N at the limit",
                grip.stiffness,
                stiffnesses[stable.saturating_sub(1)],
                points[0].rms
            );
            assert!(points[0].is_stable, "{name} {grip:?}: {:?}", points[0]);
        }
    }
}

#[test]
fn softened_tissue_is_stepped_where_the_tool_is() {
    // It stiffens so quickly that a step at the device's own place, deeper by the coupling, would
    // be another tissue.
    let bed = BedParams {
        compliance: 2e-3,
        stiffening: 2000.0,
        ..BedParams::default()
    };
    let trial = trial(DeviceModel::IDEAL, Grip::STIFF, bed, 200.0);
    let mut trial = Trial {
        duration: 3.0,
        ..trial
    };
    trial.device.spec.max_stiffness = 500.0;
    let report = trial.run();
    let last = report.samples.last().expect("samples");
    let tool = &last.report.tools[0];
    assert!(tool.softening > 0.3, "{tool:?}");
    let at = last.position + tool.stretch;
    let mut patch = Box::new(palpa_servo::ContactPatch::EMPTY);
    let force = palpa_device::Bed::new(&bed).step(
        &palpa_servo::Pose::translation(at.x, at.y, at.z),
        0.0,
        1e-3,
        &mut patch,
    );
    let error = (last.force - force).norm() / force.norm();
    println!("{error:.4} of {:.2} N", force.norm());
    assert!(error < 0.01, "{error}");
}
