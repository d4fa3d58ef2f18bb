//! Prony series: against the convolution that they stand for.

use palpa_fem::Mat3;
use palpa_fem::law::{Moduli, Prony, PronyTerm, six_of, symmetric_of};

use super::{Chance, assert_close, every_law};

fn series(moduli: Moduli) -> Prony {
    let term = |g, tau| PronyTerm { g, tau };
    Prony::new(
        vec![term(0.3, 0.02), term(0.25, 0.4), term(0.1, 7.0)],
        moduli,
        false,
    )
    .expect("a sound series")
}

/// A point whose stress is one number.
struct Point<'a> {
    prony: &'a Prony,
    history: Vec<[f64; 1]>,
}

impl<'a> Point<'a> {
    fn new(prony: &'a Prony) -> Self {
        Self {
            prony,
            history: vec![[0.0]; prony.n_rows()],
        }
    }

    /// The stress after a step of `dt` to the elastic stress `elastic`.
    fn step(&mut self, dt: f64, elastic: f64) -> f64 {
        let step = self.prony.step(dt);
        let [memory] = step.memory(&self.history);
        let stress = step.scale() * elastic + memory;
        step.advance(&mut self.history, &[elastic]);
        // What the memories say afterwards is the same stress.
        let sum = self.prony.long_term() * elastic
            + self.history[1..].iter().map(|row| row[0]).sum::<f64>();
        assert!((stress - sum).abs() <= 1e-13 * (stress.abs() + elastic.abs()));
        stress
    }
}

#[test]
fn a_sudden_step_relaxes_exactly_whatever_the_steps() {
    for moduli in [Moduli::Instantaneous, Moduli::LongTerm] {
        let prony = series(moduli);
        for n_steps in [1, 7, 300] {
            let mut point = Point::new(&prony);
            assert_close(point.step(0.0, 500.0), 500.0 * prony.instantaneous(), 1e-14);
            let mut chance = Chance::new(n_steps);
            let mut t = 0.0;
            for _ in 0..n_steps {
                let dt = 0.05 * (1.0 + chance.signed());
                t += dt;
                let formula = |g: f64, tau: f64| g * (1.0 - (-t / tau).exp());
                let expected = 500.0
                    * prony.instantaneous()
                    * (1.0 - formula(0.3, 0.02) - formula(0.25, 0.4) - formula(0.1, 7.0));
                assert_close(point.step(dt, 500.0), expected, 1e-12);
                assert_close(prony.relaxation(t), expected / 500.0, 1e-13);
            }
        }
    }
}

/// `F = v {(1 − g) m + g τ [e^{−(t−m)/τ} − e^{−t/τ}]}`, `m = min(t, t_ramp)`, for a force linear in
/// depth.
#[test]
fn ramp_and_hold_is_exact_whatever_the_steps() {
    let (g, tau, t_ramp, speed) = (0.5, 0.1, 0.05, 20.0);
    let prony = Prony::new(vec![PronyTerm { g, tau }], Moduli::Instantaneous, false).unwrap();
    for times in [
        vec![0.05, 1.0],
        vec![0.01, 0.02, 0.05, 0.07, 0.3],
        (1..200).map(|i| 0.005 * f64::from(i)).collect(),
    ] {
        let mut point = Point::new(&prony);
        let mut t_old = 0.0;
        for t in times {
            let m = f64::min(t, t_ramp);
            let expected =
                speed * ((1.0 - g) * m + g * tau * ((-(t - m) / tau).exp() - (-t / tau).exp()));
            assert_close(point.step(t - t_old, speed * m), expected, 1e-12);
            t_old = t;
        }
    }
}

/// The table of a flat punch (radius 5 mm, half-space of 30 kPa, ν = 0.45) pressed 2 mm in 0.05 s,
/// then held.
#[test]
fn ramp_and_hold_of_a_punch() {
    let prony = Prony::new(
        vec![PronyTerm { g: 0.5, tau: 0.1 }],
        Moduli::Instantaneous,
        true,
    )
    .unwrap();
    let stiffness = 30e3 * 2.0 * 5e-3 / (1.0 - 0.45 * 0.45);
    let mut point = Point::new(&prony);
    let mut t_old = 0.0;
    for (t, force) in [
        (0.01, 0.14683078),
        (0.03, 0.42070103),
        (0.05, 0.67220264),
        (0.1, 0.55572505),
        (1.0, 0.37619771),
    ] {
        let depth = 2e-3 * f64::min(t / 0.05, 1.0);
        assert_close(point.step(t - t_old, stiffness * depth), force, 1e-7);
        t_old = t;
    }
}

/// Under a sinusoid the stress settles to the storage and the loss modulus, with an error of second
/// order in the step.
#[test]
fn a_sinusoid_shows_storage_and_loss() {
    for moduli in [Moduli::Instantaneous, Moduli::LongTerm] {
        let prony = Prony::new(
            vec![
                PronyTerm { g: 0.3, tau: 0.1 },
                PronyTerm { g: 0.25, tau: 0.4 },
            ],
            moduli,
            false,
        )
        .unwrap();
        for omega in [0.5, 10.0, 200.0] {
            let [storage, loss] = prony.dynamic(omega);
            let period = 2.0 * std::f64::consts::PI / omega;
            let error = |per_period: u32| {
                let dt = period / f64::from(per_period);
                // Whole periods, until the start is forgotten (e^−20), and one more to project on.
                let n_periods = (20.0 * 0.4 / period).ceil() as u32 + 1;
                let mut point = Point::new(&prony);
                let [mut in_phase, mut ahead] = [0.0; 2];
                for i in 1..=n_periods * per_period {
                    let angle = omega * dt * f64::from(i);
                    let stress = point.step(dt, angle.sin());
                    if i > (n_periods - 1) * per_period {
                        in_phase += 2.0 * stress * angle.sin() / f64::from(per_period);
                        ahead += 2.0 * stress * angle.cos() / f64::from(per_period);
                    }
                }
                ((in_phase - storage).abs() + (ahead - loss).abs()) / storage
            };
            let (coarse, fine) = (error(250), error(500));
            assert!(fine < 5e-5, "ω = {omega}: {fine:e}");
            assert!(
                (coarse / fine - 4.0).abs() < 0.2,
                "ω = {omega}: {coarse:e}, {fine:e}"
            );
        }
    }
}

#[test]
fn no_time_is_elastic_and_all_time_forgets() {
    for moduli in [Moduli::Instantaneous, Moduli::LongTerm] {
        let prony = series(moduli);
        assert_close(prony.step(0.0).scale(), prony.instantaneous(), 1e-15);
        assert_close(prony.step(1e-12).scale(), prony.instantaneous(), 1e-9);
        assert_close(prony.step(f64::INFINITY).scale(), prony.long_term(), 1e-15);
        assert_close(prony.step(1e12).scale(), prony.long_term(), 1e-9);
        assert_close(prony.dynamic(0.0)[0], prony.long_term(), 1e-15);
        assert_close(
            prony.dynamic(f64::INFINITY)[0],
            prony.instantaneous(),
            1e-15,
        );
        assert_eq!(
            [prony.dynamic(0.0)[1], prony.dynamic(f64::INFINITY)[1]],
            [0.0, 0.0]
        );

        let mut point = Point::new(&prony);
        point.step(0.3, 100.0);
        let before = point.step(0.1, 250.0);
        // A sudden step adds the elastic increment to what has relaxed.
        assert_close(
            point.step(0.0, 350.0),
            before + 100.0 * prony.instantaneous(),
            1e-13,
        );
        assert_close(
            point.step(f64::INFINITY, 40.0),
            40.0 * prony.long_term(),
            1e-13,
        );
        assert!(point.history[1..].iter().all(|row| row[0] == 0.0));
    }
}

/// The two ways to state moduli are the same material.
#[test]
fn long_term_moduli_are_instantaneous_ones_of_a_softer_law() {
    let (instantaneous, long_term) = (series(Moduli::Instantaneous), series(Moduli::LongTerm));
    assert_close(instantaneous.long_term(), 0.35, 1e-15);
    assert_close(long_term.instantaneous(), 1.0 / 0.35, 1e-15);
    let (mut a, mut b) = (Point::new(&instantaneous), Point::new(&long_term));
    let mut chance = Chance::new(3);
    for _ in 0..50 {
        let (dt, elastic) = (0.1 * (1.0 + chance.signed()), 100.0 * chance.signed());
        let (found, expected) = (b.step(dt, 0.35 * elastic), a.step(dt, elastic));
        assert!(
            (found - expected).abs() < 1e-12 * 100.0,
            "{found} instead of {expected}"
        );
    }
}

/// Six components go through the same steps as one.
#[test]
fn components_do_not_mix() {
    let prony = series(Moduli::LongTerm);
    let mut six = vec![[0.0; 6]; prony.n_rows()];
    let mut ones = vec![vec![[0.0; 1]; prony.n_rows()]; 6];
    let mut chance = Chance::new(9);
    for _ in 0..20 {
        let step = prony.step(1.0 + chance.signed());
        let stress: [f64; 6] = std::array::from_fn(|_| chance.signed());
        let memory = step.memory(&six);
        step.advance(&mut six, &stress);
        for (k, one) in ones.iter_mut().enumerate() {
            assert_eq!([memory[k]], step.memory(one));
            step.advance(one, &[stress[k]]);
        }
    }
}

/// At a held strain the whole stress of a solid relaxes by the series, and turning the body turns
/// it: second Piola–Kirchhoff stresses stay with the material.
#[test]
fn a_held_and_turning_solid_relaxes() {
    let prony = series(Moduli::Instantaneous);
    let mut chance = Chance::new(21);
    for law in every_law()
        .into_iter()
        .filter(|law| law.kinematics() == palpa_fem::Kinematics::Finite)
    {
        let f = chance.deformation(0.4);
        let mut history = vec![[0.0; 6]; prony.n_rows()];
        let mut t = 0.0;
        for dt in [0.0, 0.01, 0.3, 0.0, 2.0] {
            t += dt;
            let turned = chance.rotation() * f;
            let elastic = law.deviatoric_stress(&turned).1;
            let second = turned.try_inverse().expect("a deformation") * elastic;
            let step = prony.step(dt);
            let found = step.scale() * elastic + turned * symmetric_of(&step.memory(&history));
            step.advance(&mut history, &six_of(&second));
            let expected: Mat3 = prony.relaxation(t) * elastic;
            assert!(
                (found - expected).norm() < 1e-12 * elastic.norm(),
                "{law:?} at {t} s"
            );
        }
    }
}
