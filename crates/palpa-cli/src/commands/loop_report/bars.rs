//! Error bars of the force at places along the way of the hand.
//!
//! ```text
//!  during the run: looks at the tissue, 20 a second ─► the deepest of each part of the way
//!  after it:       each of them probed ─► figures
//! ```
//! The way has five parts: along the motion across the skin, or, if it stays at one place, by depth.

use palpa::accuracy::{FEW_VERTICES, Source};
use palpa::live::{LiveBar, LiveScene, Look, Moment, NoBar, Seen, across, probe};
use palpa_rt::{Engine, Reader};
use palpa_scene::Scene;
use palpa_servo::Vec3;
use serde::Serialize;

use crate::cli::Context;
use crate::table::Table;

/// Number of parts of the way, and so of error bars at most.
const N_PARTS: usize = 5;
/// Time between two looks, s.
pub(super) const LOOK_PERIOD: f64 = 0.05;

/// An error bar of the force, or why there is none.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct BarFigures {
    /// When the tool was there.
    pub(super) time_s: f64,
    /// Position of the tool's tip, in the scene's frame.
    pub(super) tip_mm: [f64; 3],
    /// Depth of the tip below the first touch at the place that the scene presses.
    pub(super) depth_mm: f64,
    /// Force on the hand then, along the press.
    pub(super) felt_n: f64,
    /// Force of the static press there on the same mesh.
    pub(super) static_n: Option<f64>,
    /// Half the width of the bar, as a share of the static force.
    half_width: Option<f64>,
    /// Half the width of the bar.
    pub(super) error_bar_n: Option<f64>,
    /// The static force, extrapolated to an infinitely fine mesh.
    extrapolated_n: Option<f64>,
    /// Depth of the static press below the first touch at its own place.
    static_depth_mm: Option<f64>,
    /// Change of the force when prisms near the tool are made finer, as a share of it.
    near: Option<f64>,
    /// The same for triangles around them.
    skin_far: Option<f64>,
    /// The same for deep intervals.
    levels_deep: Option<f64>,
    /// What finer meshes of the same few vertices in contact do not show, as a share of the force.
    contact: Option<f64>,
    /// Why there is no bar.
    problem: Option<String>,
}

/// What was seen at one look.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Sight {
    /// Time since the start, s.
    time: f64,
    /// Position of the tip in the scene's frame, m.
    tip: Vec3,
    /// Depth of the tip below the first touch, m.
    depth: f64,
    /// Force along the press, N.
    felt: f64,
}

/// The parts of the way.
#[derive(Debug, Clone, Copy)]
struct Parts {
    /// Direction of the motion across the skin, in the device's frame, and its length, m; `None` for
    /// a motion at one place.
    across: Option<(Vec3, f64)>,
    /// Height of the device's origin over the first touch, m.
    above: f64,
    /// Depth of the motion, m.
    depth: f64,
}

impl Parts {
    fn depth(&self, position: Vec3) -> f64 {
        -position.z - self.above
    }

    /// Number of the part in which the device is.
    fn part(&self, position: Vec3) -> usize {
        let share = match self.across {
            Some((along, length)) => position.dot(&along) / length + 0.5,
            None => self.depth(position) / self.depth,
        };
        // A value that is not a number counts as the first part.
        ((share * N_PARTS as f64).floor().max(0.0) as usize).min(N_PARTS - 1)
    }
}

/// The deepest look in each part of the way, with what is to be probed there.
#[derive(Debug)]
struct Spots<M>([Option<(Sight, M)>; N_PARTS]);

impl<M> Spots<M> {
    fn new() -> Self {
        Self(std::array::from_fn(|_| None))
    }

    /// Keeps a look if it is the deepest in its part.
    fn offer(&mut self, part: usize, sight: Sight, moment: impl FnOnce() -> M) {
        let spot = &mut self.0[part];
        if (spot.as_ref()).is_none_or(|(deepest, _)| sight.depth > deepest.depth) {
            *spot = Some((sight, moment()));
        }
    }

    /// The looks in the order of time.
    fn in_time(self) -> Vec<(Sight, M)> {
        let mut all: Vec<_> = self.0.into_iter().flatten().collect();
        all.sort_by(|(a, _), (b, _)| a.time.total_cmp(&b.time));
        all
    }
}

/// Chooses places along the way while the engine runs, and probes them when it has ended: probes beside
/// the loop would take cores and caches from the very run that is judged.
#[derive(Debug)]
pub(super) struct Bars<'a> {
    live: &'a LiveScene,
    parts: Parts,
    spots: Spots<Moment>,
}

impl<'a> Bars<'a> {
    pub(super) fn new(scene: &Scene, live: &'a LiveScene) -> Self {
        let motion = &scene.motion;
        let across = (motion.kind.goes_across() && motion.length > 0.0)
            .then(|| (across(motion, &live.scene_from_device), motion.length));
        Self {
            live,
            parts: Parts {
                across,
                above: motion.above,
                depth: motion.depth,
            },
            spots: Spots::new(),
        }
    }

    /// Looks at the tissue.
    pub(super) fn look(&mut self, engine: &mut Engine, looks: &mut Reader<Look>) {
        looks.take();
        let now = engine.snapshot();
        let look = looks.current();
        if let (Some(tool), Some(Seen::Tissue(glance))) = (look.tool, &look.body)
            && now.tick.tick.n_active > 0
            // After a fault the tool sinks in, since the force is held back.
            && now.tick.tick.gain >= 1.0
        {
            let tip = tool.pose.translation.vector;
            let frame = &self.live.scene_from_device;
            let position = frame.inverse_transform_point(&tip.into()).coords;
            let sight = Sight {
                time: now.tick.tick.now,
                tip,
                depth: self.parts.depth(position),
                felt: now.tick.devices[0].force[2],
            };
            (self.spots).offer(self.parts.part(position), sight, || Moment {
                model: std::sync::Arc::clone(glance.model()),
                tool,
            });
        }
    }

    /// Probes the places; an interrupt gives up the rest.
    pub(super) fn probe(self, context: &Context) -> Vec<BarFigures> {
        let spots = self.spots.in_time();
        let bar = context.progress(spots.len(), "error bars");
        let figures = (spots.iter())
            .map(|(sight, moment)| {
                let goes_on = || !context.is_interrupted();
                let found = probe(&self.live.prepared, moment, goes_on);
                bar.inc(1);
                BarFigures::new(sight, found)
            })
            .collect();
        bar.finish_and_clear();
        figures
    }
}

impl BarFigures {
    fn new(sight: &Sight, found: Result<LiveBar, NoBar>) -> Self {
        let (bar, problem) = match found {
            Ok(bar) => (Some(bar), None),
            Err(why) => (None, Some(why.to_string())),
        };
        let bar = bar.as_ref();
        let change = |i: usize| bar.and_then(|bar| bar.probed.changes[i]);
        Self {
            time_s: sight.time,
            tip_mm: (sight.tip * 1e3).into(),
            depth_mm: sight.depth * 1e3,
            felt_n: sight.felt,
            static_n: bar.map(|bar| bar.probed.force_n),
            half_width: bar.map(|bar| bar.half_width),
            error_bar_n: bar.map(|bar| bar.half_width * bar.probed.force_n.abs()),
            extrapolated_n: bar.and_then(|bar| bar.probed.extrapolated_n()),
            static_depth_mm: bar.map(|bar| bar.probed.depth_mm),
            near: change(0),
            skin_far: change(1),
            levels_deep: change(2),
            contact: bar.and_then(|bar| bar.probed.contact()),
            problem,
        }
    }

    /// The largest contribution.
    fn largest(&self) -> Option<String> {
        let changes = [self.near?, self.skin_far?, self.levels_deep?];
        let (source, change) = (Source::ALL.into_iter().zip(changes))
            .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
        if let Some(contact) = self.contact.filter(|&contact| contact > change.abs()) {
            return Some(format!("{FEW_VERTICES} {:.1} %", 100.0 * contact));
        }
        Some(format!("{source} {:+.1} %", 100.0 * change))
    }
}

/// Prints the bars.
pub(super) fn say(bars: &[BarFigures], context: &Context) -> anyhow::Result<()> {
    if bars.is_empty() {
        return context.say("no error bars: the tool was never seen to press");
    }
    let mut table = Table::new([
        "error bars: time s",
        "tip at mm",
        "depth mm",
        "felt N",
        "static N",
        "± of it",
        "halving sizes changes it most by",
    ]);
    for bar in bars {
        let or_none = |text: Option<String>| text.unwrap_or_else(|| "–".to_owned());
        let [x, y, z] = bar.tip_mm;
        let last = match &bar.problem {
            Some(why) => Some(format!("no bar: {why}")),
            None => bar.largest(),
        };
        table.push([
            format!("{:.2}", bar.time_s),
            format!("{x:.1} {y:.1} {z:.1}"),
            format!("{:.2}", bar.static_depth_mm.unwrap_or(bar.depth_mm)),
            format!("{:.3}", bar.felt_n),
            or_none(bar.static_n.map(|force| format!("{force:.3}"))),
            or_none(bar.half_width.map(|half| format!("{:.1} %", 100.0 * half))),
            or_none(last),
        ]);
    }
    context.say(table)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sight(time: f64, depth: f64) -> Sight {
        Sight {
            time,
            tip: Vec3::zeros(),
            depth,
            felt: 1.0,
        }
    }

    #[test]
    fn a_way_across_the_skin_has_parts_along_it_and_a_press_has_them_by_depth() {
        let mut parts = Parts {
            across: Some((Vec3::y(), 20e-3)),
            above: 5e-3,
            depth: 6e-3,
        };
        let at = |y: f64, z: f64| Vec3::new(1.0, y, z);
        let along = [-11e-3, -9e-3, -5e-3, 0.0, 5e-3, 9e-3, 11e-3];
        let found = along.map(|y| parts.part(at(y, -8e-3)));
        assert_eq!(found, [0, 0, 1, 2, 3, 4, 4]);
        parts.across = None;
        let depths = [-1e-3, 0.5e-3, 2e-3, 5.9e-3, 7e-3];
        let found = depths.map(|depth| parts.part(at(0.0, -5e-3 - depth)));
        assert_eq!(found, [0, 0, 1, 4, 4]);
        assert_eq!(parts.part(Vec3::repeat(f64::NAN)), 0);
    }

    #[test]
    fn each_part_keeps_its_deepest_look() {
        let mut spots = Spots::new();
        spots.offer(3, sight(1.0, 2e-3), || "a");
        spots.offer(3, sight(2.0, 3e-3), || "b");
        spots.offer(3, sight(3.0, 2.9e-3), || panic!("less deep"));
        spots.offer(1, sight(4.0, 1e-3), || "c");
        spots.offer(0, sight(0.5, 1e-3), || "d");
        let found: Vec<&str> = spots.in_time().into_iter().map(|(_, what)| what).collect();
        assert_eq!(found, ["d", "b", "c"]);
    }

    #[test]
    fn a_place_without_a_bar_says_why() {
        let bar = BarFigures::new(&sight(1.0, 2e-3), Err(NoBar::NoEquilibrium));
        assert_eq!(bar.problem, Some(NoBar::NoEquilibrium.to_string()));
        assert_eq!(bar.error_bar_n, None);
    }
}
