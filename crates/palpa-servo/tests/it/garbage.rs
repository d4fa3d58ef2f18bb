//! Whatever comes in, a finite force within the device's limits goes out.

use crate::support::{HalfSpace, Loop, RADIUS, SPEC};
use palpa_servo::{Candidate, ContactPatch, DeviceSpec, Mat3, ServoParams, Vec3};
use palpa_testkit::cases;
use proptest::prelude::*;

fn wild() -> BoxedStrategy<f64> {
    prop_oneof![
        4 => -1.0..1.0_f64,
        2 => (-12.0..6.0_f64).prop_map(|e| 10.0_f64.powf(e)),
        1 => Just(0.0),
        1 => prop_oneof![
            Just(f64::NAN),
            Just(f64::INFINITY),
            Just(f64::NEG_INFINITY),
            Just(f64::MAX),
            Just(1e-310)
        ],
    ]
    .boxed()
}

fn tame() -> BoxedStrategy<f64> {
    prop_oneof![-1e-2..1e-2_f64, Just(0.0), -10.0..10.0_f64].boxed()
}

fn candidate(number: BoxedStrategy<f64>) -> impl Strategy<Value = Candidate> {
    (
        0..5_u32,
        0..4_u32,
        prop::array::uniform32(number),
        prop::bool::weighted(0.8),
    )
        .prop_map(|(vertex, tool, x, unit)| {
            let v = |k: usize| Vec3::new(x[k], x[k + 1], x[k + 2]);
            let normal = v(9).try_normalize(1e-9).unwrap_or_else(Vec3::z);
            Candidate {
                vertex,
                tool: tool / 2,
                position: v(0),
                force: v(3),
                surface: v(6),
                normal: if unit { normal } else { v(9) },
                curvature: Mat3::new(
                    x[12], x[13], x[14], x[15], x[16], x[17], x[18], x[19], x[20],
                ),
                anchor: v(21),
            }
        })
}

#[derive(Debug, Clone)]
struct Garbage {
    candidates: Vec<Candidate>,
    compliance: Vec<f64>,
    n: usize,
    n_tools: usize,
    friction: f64,
    is_bonded: bool,
    stiffness: f64,
    times: (f64, f64),
}

fn garbage(number: BoxedStrategy<f64>) -> impl Strategy<Value = Garbage> {
    (
        prop::collection::vec(candidate(number.clone()), 0..6),
        prop::collection::vec(number.clone(), 1..40),
        prop_oneof![9 => 0..7_usize, 1 => Just(60), 1 => Just(usize::MAX)],
        prop_oneof![9 => 0..3_usize, 1 => Just(usize::MAX)],
        number.clone(),
        any::<bool>(),
        number.clone(),
        (number.clone(), number),
    )
        .prop_map(
            |(candidates, compliance, n, n_tools, friction, is_bonded, stiffness, times)| Garbage {
                candidates,
                compliance,
                n,
                n_tools,
                friction,
                is_bonded,
                stiffness,
                times,
            },
        )
}

fn write(garbage: &Garbage, id: u64, patch: &mut ContactPatch) {
    patch.id = id;
    (patch.sampled_at, patch.period) = garbage.times;
    patch.n_contacts = garbage.n;
    patch.n_tools = garbage.n_tools;
    for (own, candidate) in patch.contacts.iter_mut().zip(&garbage.candidates) {
        *own = *candidate;
    }
    for (w, value) in patch
        .compliance
        .iter_mut()
        .zip(garbage.compliance.iter().cycle())
    {
        *w = *value;
    }
    for tool in &mut patch.tools {
        tool.friction = garbage.friction.abs();
        tool.is_bonded = garbage.is_bonded;
        tool.stiffness = Mat3::from_element(garbage.stiffness);
    }
}

fn survive(
    servo: &mut Loop,
    spec: &DeviceSpec,
    steps: &[(Garbage, [f64; 4])],
) -> Result<(), TestCaseError> {
    let mut patch = Box::new(ContactPatch::EMPTY);
    let mut last = servo.command[0].force;
    for (k, (garbage, [x, y, z, dt])) in steps.iter().enumerate() {
        write(garbage, 10_000 + k as u64, &mut patch);
        servo.mail.next = Some(patch.clone());
        if k % 3 == 0 {
            servo.now += dt;
        }
        for _ in 0..3 {
            let report = servo.tick(Some(Vec3::new(*x, *y, *z)));
            let force = servo.command[0].force;
            prop_assert!(force.iter().all(|f| f.is_finite()), "{force} {report:?}");
            prop_assert!(force.norm() <= spec.max_force * (1.0 + 1e-12));
            prop_assert!(servo.command[0].torque.norm() <= spec.max_torque * (1.0 + 1e-12));
            prop_assert!((force - last).norm() <= spec.max_slew * 2e-3 * (1.0 + 1e-9));
            last = force;
        }
        if !servo.now.is_finite() {
            servo.now = 1e3;
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(300)))]

    #[test]
    fn garbage_gives_finite_limited_forces(
        steps in prop::collection::vec((garbage(wild()), prop::array::uniform4(wild())), 1..8)
    ) {
        let spec = DeviceSpec { max_slew: 300.0, ..SPEC };
        let mut servo = Loop::new(&ServoParams::default(), spec);
        survive(&mut servo, &spec, &steps)?;
    }

    // As above, but with numbers that pass the border, into a loop that is up.
    #[test]
    fn plausible_nonsense_gives_finite_limited_forces(
        steps in prop::collection::vec((garbage(tame()), prop::array::uniform4(-1e-3..1e-3_f64)), 1..12)
    ) {
        let spec = DeviceSpec { max_slew: 300.0, max_stiffness: 1000.0, ..SPEC };
        let params = ServoParams { max_speed: 1e3, ..ServoParams::default() };
        let mut servo = Loop::new(&params, spec);
        let bed = HalfSpace { spacing: 2e-3, compliance: 4e-3, friction: 0.5, n: 9 };
        let mut good = Box::new(ContactPatch::EMPTY);
        let at = Vec3::new(0.0, 0.0, RADIUS - 1e-3);
        bed.fill(at, 1, &mut good);
        servo.settle(&good, at, 700);
        let steps: Vec<_> = steps.into_iter().map(|(mut g, x)| {
            g.times = (servo.now, 5e-3);
            (g, x)
        }).collect();
        survive(&mut servo, &spec, &steps)?;
    }
}
