//! What a run in real time guarantees, and the guarantees that a run broke.

use std::fmt;

use super::figures::{Figures, ForceFigures};

/// Guarantee of the project: largest thread-CPU time of a tick at its p99.9, s.
const MOST_TICK: f64 = 200e-6;
/// Guarantee of the project: largest change of force where a patch arrives, N.
pub(super) const MOST_ARRIVAL: f64 = 0.02;
/// Guarantee of the project: largest RMS of the force between 20 and 400 Hz, hand still, N.
pub(super) const MOST_RMS: f64 = 0.02;
/// Largest share of the steps with contact in which the tissue may be behind the tool, and of all
/// steps that may fail.
const MOST_BEHIND: f64 = 0.01;
/// Largest share of ticks without a force because the tissue was late: as many as one hiccup of the
/// machine causes.
const MOST_STALE: f64 = 1e-3;

/// A guarantee that a run broke. `Display` says what happened and what to do.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Broken {
    /// A tick takes longer than [`MOST_TICK`].
    SlowTick {
        /// p99.9 of a tick's CPU time, µs.
        p999_us: f64,
    },
    /// The tissue was behind the tool more often than [`MOST_BEHIND`].
    Behind {
        /// Share of the steps with contact.
        share: f64,
    },
    /// Ticks had no force more often than [`MOST_STALE`].
    Stale {
        /// Share of the ticks.
        share: f64,
        /// Steps that failed.
        held_back: u64,
        steps_per_s: f64,
        nodes: usize,
    },
    /// Steps failed more often than [`MOST_BEHIND`].
    FailedSteps { failed: u64, steps: u64 },
    /// The hand moves faster than steps are short enough for.
    FastHand {
        hand_mm_per_s: f64,
        /// Speed for which steps are short enough.
        steps_mm_per_s: f64,
    },
    /// The tool never touched.
    NothingFelt,
    /// A patch itself changes the force by more than [`MOST_ARRIVAL`].
    PatchJump {
        /// Change of the force without that which the device's own displacement causes, N.
        alone_n: f64,
    },
    /// The force changes more than usual where a patch arrives.
    UnusualArrival {
        /// Change of the force, N.
        arrival_n: f64,
        /// p99.9 of the change of force at other ticks, N.
        other_p999_n: f64,
    },
    /// The force trembles by more than [`MOST_RMS`] under a still hand.
    RoughForce {
        /// RMS of the force between 20 and 400 Hz, N.
        rms_n: f64,
    },
    /// The loop gave out energy.
    Energy { deficit_mj: f64, budget_mj: f64 },
}

/// The guarantees that a run broke. Lateness of the machine itself does not count.
pub(super) fn broken(figures: &Figures) -> Vec<Broken> {
    let mut broken = Vec::new();
    let p999_us = figures.tick_cpu_us.p999;
    if p999_us > MOST_TICK * 1e6 {
        broken.push(Broken::SlowTick { p999_us });
    }
    let t = &figures.tissue;
    if t.behind_share > MOST_BEHIND {
        broken.push(Broken::Behind {
            share: t.behind_share,
        });
    }
    if t.stale_share > MOST_STALE {
        broken.push(Broken::Stale {
            share: t.stale_share,
            held_back: t.held_back,
            steps_per_s: t.steps_per_s,
            nodes: figures.nodes,
        });
    }
    if t.held_back as f64 > MOST_BEHIND * t.steps as f64 {
        broken.push(Broken::FailedSteps {
            failed: t.held_back,
            steps: t.steps,
        });
    }
    // Zones that arrive too late are reported above.
    if t.motion_mm_per_s > t.fastest_by_steps_mm_per_s {
        broken.push(Broken::FastHand {
            hand_mm_per_s: t.motion_mm_per_s,
            steps_mm_per_s: t.fastest_by_steps_mm_per_s,
        });
    }
    for device in &figures.devices {
        broken.extend(broken_by_force(device));
    }
    broken
}

/// The guarantees that the force at one device broke.
fn broken_by_force(d: &ForceFigures) -> Vec<Broken> {
    let mut broken = Vec::new();
    if d.max_force_n == 0.0 {
        broken.push(Broken::NothingFelt);
    }
    // The change caused by the device itself is excluded: steps of 45 µm from tick to tick change
    // the force by 0.02 N everywhere.
    if d.arrival_alone_max_n > MOST_ARRIVAL {
        broken.push(Broken::PatchJump {
            alone_n: d.arrival_alone_max_n,
        });
    }
    if d.arrival_max_n > d.most_arrival_n() {
        broken.push(Broken::UnusualArrival {
            arrival_n: d.arrival_max_n,
            other_p999_n: d.other_p999_n,
        });
    }
    if let Some(rms_n) = d.rms_still_n
        && rms_n > MOST_RMS
    {
        broken.push(Broken::RoughForce { rms_n });
    }
    if d.energy_deficit_mj > d.energy_budget_mj {
        broken.push(Broken::Energy {
            deficit_mj: d.energy_deficit_mj,
            budget_mj: d.energy_budget_mj,
        });
    }
    broken
}

impl fmt::Display for Broken {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::SlowTick { p999_us } => write!(
                f,
                "p99.9 of a tick's CPU time is {p999_us:.0} µs, more than {:.0}",
                MOST_TICK * 1e6
            ),
            Self::Behind { share } => write!(
                f,
                "in {:.1} % of the steps with contact the tissue was behind the tool, because zones or meshes came too \
                 late: the forces of these steps are wrong; close other programs, move more slowly, or make the mesh \
                 coarser with [mesh] near_tool",
                100.0 * share
            ),
            Self::Stale {
                share,
                held_back,
                steps_per_s,
                nodes,
            } => write!(
                f,
                "{:.1} % of the ticks had no force, since no fresh patch came ({held_back} steps failed, \
                 {steps_per_s:.0} steps/s on {nodes} nodes)",
                100.0 * share
            ),
            Self::FailedSteps { failed, steps } => write!(
                f,
                "{failed} of {steps} steps of the tissue failed and were not felt; press less deep, or make the mesh \
                 finer there"
            ),
            Self::FastHand {
                hand_mm_per_s,
                steps_mm_per_s,
            } => write!(
                f,
                "the hand goes at {hand_mm_per_s:.0} mm/s, and steps are short enough for {steps_mm_per_s:.0} mm/s: move \
                 more slowly, or make the mesh coarser with [mesh] near_tool"
            ),
            Self::NothingFelt => f.write_str(
                "nothing was felt: the tool did not touch the skin during the run; check [motion] in the scene, or run \
                 longer with --seconds",
            ),
            Self::PatchJump { alone_n } => write!(
                f,
                "when a patch arrives, the force changes by {alone_n:.4} N beyond the change that the device's \
                 displacement causes; {MOST_ARRIVAL} N are allowed"
            ),
            Self::UnusualArrival {
                arrival_n,
                other_p999_n,
            } => write!(
                f,
                "force changes by {arrival_n:.4} N where a patch arrives, more than twice the p99.9 of other ticks, \
                 {other_p999_n:.4}"
            ),
            Self::RoughForce { rms_n } => write!(
                f,
                "force between 20 and 400 Hz is {rms_n:.4} N with the hand still, more than {MOST_RMS}"
            ),
            Self::Energy {
                deficit_mj,
                budget_mj,
            } => write!(
                f,
                "the loop gave out {deficit_mj:.2} mJ more energy than it took in; {budget_mj:.2} mJ are allowed"
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Figures that keep every guarantee, each at its limit.
    fn good() -> Figures {
        let mut figures = Figures::default();
        figures.tick_cpu_us.p999 = 200.0;
        let t = &mut figures.tissue;
        (t.behind_share, t.stale_share) = (0.01, 0.001);
        (t.held_back, t.steps) = (5, 500);
        (t.motion_mm_per_s, t.fastest_by_steps_mm_per_s) = (60.0, 60.0);
        let mut device = ForceFigures::default();
        (device.max_force_n, device.rms_still_n) = (1.0, Some(0.02));
        device.arrival_alone_max_n = 0.02;
        (device.arrival_max_n, device.other_p999_n) = (0.06, 0.03);
        (device.energy_deficit_mj, device.energy_budget_mj) = (1.5, 1.5);
        figures.devices.push(device);
        figures
    }

    #[test]
    fn figures_at_their_limits_are_good() {
        assert_eq!(broken(&good()), []);
    }

    #[test]
    fn each_guarantee_is_broken_beyond_its_limit() {
        let mut figures = good();
        figures.tick_cpu_us.p999 = 201.0;
        assert_eq!(broken(&figures), [Broken::SlowTick { p999_us: 201.0 }]);

        let mut figures = good();
        figures.tissue.behind_share = 0.011;
        assert_eq!(broken(&figures), [Broken::Behind { share: 0.011 }]);

        let mut figures = good();
        figures.tissue.held_back = 6;
        let failed = Broken::FailedSteps {
            failed: 6,
            steps: 500,
        };
        assert_eq!(broken(&figures), [failed]);

        let mut figures = good();
        figures.tissue.stale_share = 0.002;
        assert!(matches!(
            broken(&figures)[..],
            [Broken::Stale { share: 0.002, .. }]
        ));

        let mut figures = good();
        figures.tissue.motion_mm_per_s = 61.0;
        assert!(matches!(broken(&figures)[..], [Broken::FastHand { .. }]));
    }

    #[test]
    fn each_guarantee_of_the_force_is_broken_beyond_its_limit() {
        let with = |change: fn(&mut ForceFigures)| {
            let mut figures = good();
            change(&mut figures.devices[0]);
            broken(&figures)
        };
        assert_eq!(with(|d| d.max_force_n = 0.0), [Broken::NothingFelt]);
        assert_eq!(
            with(|d| d.arrival_alone_max_n = 0.021),
            [Broken::PatchJump { alone_n: 0.021 }]
        );
        assert!(matches!(
            with(|d| d.arrival_max_n = 0.061)[..],
            [Broken::UnusualArrival { .. }]
        ));
        assert_eq!(
            with(|d| d.rms_still_n = Some(0.021)),
            [Broken::RoughForce { rms_n: 0.021 }]
        );
        assert_eq!(with(|d| d.rms_still_n = None), []);
        let energy = with(|d| d.energy_deficit_mj = 1.6);
        assert_eq!(
            energy[0].to_string(),
            "the loop gave out 1.60 mJ more energy than it took in; 1.50 mJ are allowed"
        );
        assert_eq!(energy.len(), 1);
    }
}
