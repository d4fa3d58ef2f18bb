//! Error bars of the force under the hand: when they are computed, and which one a page sees.
//!
//! ```text
//!  the tool presses ──► it stays ──► palpa-probe ──► known bars
//!                                                       │ near the tool, on the same mesh
//!                                                       └──► figures for pages
//! ```

use palpa::accuracy::Source;
use palpa::live::{LiveBar, Moment, NoBar, Prober, Seen};
use palpa_mesh::Vec3;
use palpa_rt::Granted;
use palpa_viewer::control::{BarProblem, ErrorBar};

use crate::stage::Live;

/// A tool that moves less than the first value, m, for the second, s, stays: a hand that feels its way leaves the cores
/// to the steps and the pictures.
const STAYS: f64 = 0.4e-3;
const STAY: f64 = 0.8;
/// Rest between the end of one computation and the beginning of the next, s.
const REST: f64 = 0.5;
/// A bar holds where the tool is this near to its place, as a share of the contact radius, and as
/// deep, as a share of the bar's depth.
const SAME_PLACE: f64 = 0.5;
const SAME_DEPTH: f64 = 0.3;
/// A new bar is computed beyond this share of those.
const ANEW: f64 = 0.5;
/// Largest number of bars that are kept.
const MOST_KEPT: usize = 16;

/// A place and depth at which the tool presses a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Press {
    /// Number of the engine and of its mesh.
    mesh: (u64, u64),
    /// The tool's tip, m.
    tip: Vec3,
    /// The place of the skin, and the outward normal there.
    over: (Vec3, Vec3),
    /// Contact radius of the tool, m.
    radius: f64,
}

impl Press {
    /// Depth as a page shows it, m.
    fn depth(&self) -> f64 {
        self.over.1.dot(&(self.over.0 - self.tip))
    }

    /// How far this press is from one with a bar: 1 is the border of the region in which it holds.
    fn distance(&self, known: &Self) -> f64 {
        if self.mesh != known.mesh {
            return f64::INFINITY;
        }
        let off = self.tip - known.tip;
        let down = off.dot(&known.over.1);
        let aside = (off - known.over.1 * down).norm();
        let place = aside / (SAME_PLACE * known.radius);
        place.max(down.abs() / (SAME_DEPTH * known.depth()))
    }
}

/// Decides when and where a bar is computed, and keeps the results. Beside a hand that moves none is:
/// the steps need the cores then.
#[derive(Debug, Default)]
struct Policy {
    /// Where the tool came to rest, if it presses.
    stays_at: Option<Press>,
    /// Time for which it has been there, s.
    stays: f64,
    /// Time until the next computation may begin, s.
    rest: f64,
    /// The press that is being computed.
    under_way: Option<Press>,
    /// The results, newest first.
    known: Vec<(Press, Result<LiveBar, NoBar>)>,
}

impl Policy {
    /// Moves on by `dt` seconds. Returns the press for which a bar is to be computed now.
    fn advance(&mut self, press: Option<Press>, dt: f64) -> Option<Press> {
        self.rest -= dt;
        let Some(press) = press else {
            self.stays_at = None;
            return None;
        };
        self.known.retain(|(known, _)| known.mesh.0 == press.mesh.0);
        let is_there = |at: &Press| at.mesh == press.mesh && (at.tip - press.tip).norm() < STAYS;
        if self.stays_at.as_ref().is_some_and(is_there) {
            self.stays += dt;
        } else {
            (self.stays_at, self.stays) = (Some(press), 0.0);
        }
        let is_due = self.stays >= STAY;
        let is_known = (self.known.iter()).any(|(known, _)| press.distance(known) < ANEW);
        if !is_due || is_known || self.under_way.is_some() || self.rest > 0.0 {
            return None;
        }
        self.under_way = Some(press);
        Some(press)
    }

    /// Whether the computation under way is for another engine than this one, or for a place that a
    /// pressing tool has left.
    fn is_stale(&self, engine: u64, press: Option<&Press>) -> bool {
        self.under_way.is_some_and(|at| {
            at.mesh.0 != engine || press.is_some_and(|press| press.distance(&at) >= 1.0)
        })
    }

    /// Takes the result of the computation under way.
    fn finish(&mut self, found: Result<LiveBar, NoBar>) {
        self.rest = REST;
        let Some(press) = self.under_way.take() else {
            return;
        };
        if found == Err(NoBar::Interrupted) {
            return;
        }
        self.known.insert(0, (press, found));
        self.known.truncate(MOST_KEPT);
    }

    /// The bar that holds for a press.
    fn of(&self, press: Option<&Press>) -> ErrorBar {
        let Some(press) = press else {
            return ErrorBar::None;
        };
        let nearest = (self.known.iter())
            .map(|(known, found)| (press.distance(known), known, found))
            .filter(|(distance, ..)| *distance < 1.0)
            .min_by(|a, b| a.0.total_cmp(&b.0));
        match nearest {
            None => ErrorBar::Unknown,
            Some((_, known, Ok(bar))) => shown(known, bar),
            Some((_, known, Err(why))) => ErrorBar::Failed {
                depth: known.depth(),
                why: match why {
                    NoBar::TooLarge { n_nodes, .. } => BarProblem::TooLarge {
                        n_nodes: *n_nodes as u32,
                    },
                    NoBar::NotTouching => BarProblem::NotTouching,
                    NoBar::NoEquilibrium | NoBar::ProbeFailed { .. } => BarProblem::NoEquilibrium,
                    NoBar::Interrupted | NoBar::Refused { .. } | NoBar::Panicked => {
                        BarProblem::Other {
                            text: why.to_string(),
                        }
                    }
                },
            },
        }
    }
}

fn shown(press: &Press, bar: &LiveBar) -> ErrorBar {
    let change = |source: Source| {
        let changes = Source::ALL.into_iter().zip(bar.probed.changes);
        let mut of_source = changes.filter(|(at, _)| *at == source);
        of_source.find_map(|(_, change)| change).unwrap_or(0.0)
    };
    ErrorBar::Known {
        half_width: bar.half_width,
        force: bar.probed.force_n,
        extrapolated: bar.probed.extrapolated_n(),
        depth: press.depth(),
        point: press.over.0.into(),
        near: change(Source::Near),
        skin_far: change(Source::SkinFar),
        levels_deep: change(Source::LevelsDeep),
        contact: bar.probed.contact().unwrap_or(0.0),
    }
}

/// The error bars of a session.
#[derive(Debug)]
pub(crate) struct Bars {
    prober: Prober,
    policy: Policy,
    press: Option<Press>,
}

impl Bars {
    /// Starts the thread of the probes.
    ///
    /// # Errors
    /// When the system gives no thread.
    pub(crate) fn start() -> anyhow::Result<Self> {
        Ok(Self {
            prober: Prober::start()?,
            policy: Policy::default(),
            press: None,
        })
    }

    /// Moves on by `dt` seconds. `live` is the body if it may be probed.
    pub(crate) fn advance(&mut self, live: Option<&Live>, dt: f64) {
        if let Some(found) = self.prober.take() {
            self.policy.finish(found);
        }
        let seen = live.and_then(|live| Some((live, seen(live)?)));
        self.press = seen.as_ref().map(|(_, (press, _))| *press);
        let press = self.press.as_ref();
        if live.is_none_or(|live| self.policy.is_stale(live.engine, press)) {
            self.prober.give_up();
        }
        let due = self.policy.advance(self.press, dt);
        if let (Some(_), Some((live, (_, moment)))) = (due, seen)
            && let Some(prepared) = live.world.prepared()
        {
            self.prober.begin(prepared, moment);
        }
    }

    /// The scheduling that the system granted to the thread of the probes.
    pub(crate) fn granted(&self) -> &Granted {
        self.prober.granted()
    }

    /// The bar where the tool presses now.
    pub(crate) fn present(&self) -> ErrorBar {
        self.policy.of(self.press.as_ref())
    }
}

/// Where the tool presses a body of finite elements, and what to probe there.
fn seen(live: &Live) -> Option<(Press, Moment)> {
    let look = live.look();
    let (Some(tool), Some(Seen::Tissue(glance))) = (look.tool, &look.body) else {
        return None;
    };
    let place = live.place();
    let press = Press {
        mesh: (live.engine, look.mesh),
        tip: tool.pose.translation.vector,
        over: (place.point, place.normal),
        radius: live.world.scene.tool.contact_radius(),
    };
    let moment = Moment {
        model: glance.model().clone(),
        tool,
    };
    (live.entry.tick.n_active > 0 && press.depth() > 0.0).then_some((press, moment))
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpa::accuracy::Probed;

    const DT: f64 = 0.01;

    /// A press at `x` (m) along the skin.
    fn press(x: f64, depth: f64) -> Press {
        Press {
            mesh: (1, 1),
            tip: Vec3::new(x, 0.0, -depth),
            over: (Vec3::new(x, 0.0, 0.0), Vec3::z()),
            radius: 8e-3,
        }
    }

    fn bar() -> LiveBar {
        LiveBar {
            at: Vec3::zeros(),
            direction: -Vec3::z(),
            n_nodes: 1000,
            half_width: 0.04,
            probed: Probed {
                depth_mm: 5.0,
                force_n: 2.0,
                changes: [Some(-0.01), Some(0.006), Some(-0.004)],
                is_stand_in: [false; 3],
                n_touching: None,
                is_bonded: false,
            },
        }
    }

    /// Time until a computation begins, s; `None` if none does in ten seconds.
    fn begins(policy: &mut Policy, at: impl Fn(f64) -> Option<Press>) -> Option<f64> {
        (1..=1000)
            .map(|i| f64::from(i) * DT)
            .find(|&time| policy.advance(at(time), DT).is_some())
    }

    fn is_known(bar: &ErrorBar) -> bool {
        matches!(bar, ErrorBar::Known { .. })
    }

    #[test]
    fn a_tool_that_stays_is_probed_once_and_its_bar_holds_nearby() {
        let mut policy = Policy::default();
        let at = press(0.0, 5e-3);
        assert_eq!(policy.of(None), ErrorBar::None);
        assert_eq!(policy.of(Some(&at)), ErrorBar::Unknown);
        let time = begins(&mut policy, |_| Some(at)).unwrap();
        assert!((time - STAY).abs() < 2.5 * DT, "{time}");
        // One at a time.
        assert_eq!(begins(&mut policy, |_| Some(at)), None);
        policy.finish(Ok(bar()));
        let ErrorBar::Known {
            half_width,
            depth,
            near,
            skin_far,
            levels_deep,
            ..
        } = policy.of(Some(&at))
        else {
            panic!("{policy:?}")
        };
        let expected = bar();
        let shown = [near, skin_far, levels_deep].map(Some);
        assert_eq!(shown, expected.probed.changes);
        assert!((half_width - expected.half_width).abs() < 1e-12);
        assert!((depth - 5e-3).abs() < 1e-12);
        assert_eq!(begins(&mut policy, |_| Some(at)), None, "it is known");
        // It holds within half a contact radius and 30 % of the depth.
        for (x, depth, holds) in [
            (3.9e-3, 5e-3, true),
            (4.1e-3, 5e-3, false),
            (0.0, 6.4e-3, true),
            (0.0, 6.6e-3, false),
            (0.0, 3.4e-3, false),
        ] {
            let bar = policy.of(Some(&press(x, depth)));
            assert_eq!(is_known(&bar), holds, "{x} {depth}");
            assert!(holds || bar == ErrorBar::Unknown);
        }
        // Of another mesh nothing is known, and a lifted tool has no bar.
        let other = Press { mesh: (1, 2), ..at };
        assert_eq!(policy.of(Some(&other)), ErrorBar::Unknown);
        assert_eq!(policy.of(None), ErrorBar::None);
        // It is still there when the tool comes back.
        assert_eq!(begins(&mut policy, |_| None), None);
        assert!(is_known(&policy.of(Some(&at))));
    }

    #[test]
    fn beside_a_tool_that_moves_nothing_is_computed() {
        let mut policy = Policy::default();
        // 20 mm/s.
        let at = |time: f64| Some(press(0.02 * time, 5e-3));
        assert_eq!(begins(&mut policy, at), None);
        // It stays, and moves on before the bar is known.
        let stays = press(0.0, 5e-3);
        begins(&mut policy, |_| Some(stays)).unwrap();
        for (x, is_stale) in [(0.0, false), (3e-3, false), (4.1e-3, true)] {
            assert_eq!(policy.is_stale(1, Some(&press(x, 5e-3))), is_stale, "{x}");
        }
        assert!(!policy.is_stale(1, None), "a lifted tool may come back");
        policy.finish(Err(NoBar::Interrupted));
        // There is a rest before the next.
        let time = begins(&mut policy, |_| Some(stays)).unwrap();
        assert!((time - REST).abs() < 2.5 * DT, "{time}");
    }

    #[test]
    fn bars_of_another_body_are_dropped_and_given_up() {
        let mut policy = Policy::default();
        let old = press(0.0, 5e-3);
        let new = Press {
            mesh: (2, 1),
            ..old
        };
        begins(&mut policy, |_| Some(old)).unwrap();
        assert!(!policy.is_stale(1, None) && policy.is_stale(2, None));
        policy.finish(Err(NoBar::Interrupted));
        assert!(!policy.is_stale(2, None));
        assert_eq!(policy.of(Some(&old)), ErrorBar::Unknown);
        begins(&mut policy, |_| Some(old)).unwrap();
        policy.finish(Ok(bar()));
        policy.advance(Some(new), DT);
        assert_eq!(policy.of(Some(&old)), ErrorBar::Unknown);
    }

    #[test]
    fn a_place_without_a_bar_says_why_and_is_not_tried_again() {
        let mut policy = Policy::default();
        let at = press(0.0, 5e-3);
        begins(&mut policy, |_| Some(at)).unwrap();
        policy.finish(Err(NoBar::NoEquilibrium));
        let ErrorBar::Failed { why, depth } = policy.of(Some(&at)) else {
            panic!("{policy:?}")
        };
        assert_eq!(why, BarProblem::NoEquilibrium);
        assert!((depth - 5e-3).abs() < 1e-12);
        assert_eq!(begins(&mut policy, |_| Some(at)), None);
    }

    #[test]
    fn no_more_bars_are_kept_than_are_of_use() {
        let mut policy = Policy::default();
        for k in 0..2 * MOST_KEPT {
            let at = press(0.1 * k as f64, 5e-3);
            begins(&mut policy, |_| Some(at)).unwrap();
            policy.finish(Ok(bar()));
            assert!(is_known(&policy.of(Some(&at))));
        }
        assert_eq!(policy.known.len(), MOST_KEPT);
    }
}
