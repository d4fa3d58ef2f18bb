//! Vibration of the force while the target of the hand is still.

use super::{FeelParams, is_felt};
use crate::{
    servo_loop::TickEntry,
    smoothness::{BandPass, VIBRATION},
};
use std::collections::VecDeque;

/// Band of slow limit cycles of hand and device, Hz: below it lies the relaxation of tissue.
const SLOW: [f64; 2] = [2.0, 20.0];
/// Window of the RMS, s. Short, so that a pause of the machine spoils few windows.
const WINDOW: f64 = 1.0;
/// Time after the target's stop, and after a ramp, from which each band is judged, s: before, the
/// filters still ring from the motion.
const SETTLE: [f64; 2] = [0.3, 1.0];
/// Least share of the ticks of a window in which the tissue presses. Not all of them: a tool that
/// knocks leaves the skin between two knocks.
const LEAST_TOUCHING: f64 = 0.1;

/// Vibration while the hand's target was still and the tissue pressed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Still {
    /// Time that was judged, s.
    pub seconds: f64,
    /// Largest RMS of the force between 20 and 400 Hz over one second, N.
    pub rms_band: f64,
    /// Largest RMS of the force between 2 and 20 Hz over one second, N; `None` if no pause was long
    /// enough for it.
    pub rms_slow: Option<f64>,
}

/// A running RMS of one band.
struct Band {
    filter: BandPass,
    settle: f64,
    /// Square of the filtered force, N², and whether the tissue pressed.
    window: VecDeque<(f64, bool)>,
    length: usize,
    worst: Option<f64>,
    n_judged: usize,
}

impl Band {
    fn new(band: [f64; 2], settle: f64, period: f64) -> Self {
        Self {
            filter: BandPass::new(band, period),
            settle,
            window: VecDeque::new(),
            length: (WINDOW / period).round().max(1.0) as usize,
            worst: None,
            n_judged: 0,
        }
    }

    /// Adds a tick that began `quiet` s after the last motion or ramp.
    fn add(&mut self, force: [f64; 3], touches: bool, quiet: f64) {
        let square = self.filter.square(force);
        if quiet < self.settle {
            self.window.clear();
            return;
        }
        self.window.push_back((square, touches));
        if self.window.len() > self.length {
            self.window.pop_front();
        }
        let n_touching = self.window.iter().filter(|(_, touches)| *touches).count();
        let is_full = self.window.len() == self.length;
        if is_full && n_touching as f64 >= LEAST_TOUCHING * self.length as f64 {
            let sum: f64 = self.window.iter().map(|(square, _)| square).sum();
            let rms = (sum / self.length as f64).sqrt();
            self.worst = Some(self.worst.map_or(rms, |worst| worst.max(rms)));
            // The first full window judges all of its ticks, the next ones a tick each.
            self.n_judged += if self.n_judged == 0 { self.length } else { 1 };
        }
    }
}

/// The vibration at device `k`; `None` if the target was never still for a second in contact.
pub(super) fn still(ticks: &[TickEntry], k: usize, params: &FeelParams) -> Option<Still> {
    let mut bands = [
        Band::new(VIBRATION, SETTLE[0], params.period),
        Band::new(SLOW, SETTLE[1], params.period),
    ];
    let mut spans = params.still.iter().copied().peekable();
    let mut last_ramp = f64::NEG_INFINITY;
    for entry in ticks {
        let now = entry.tick.now;
        if entry.tick.gain < 1.0 {
            last_ramp = now;
        }
        while spans.next_if(|[_, to]| *to < now).is_some() {}
        let quiet = match spans.peek() {
            Some([from, _]) if *from <= now => now - from.max(last_ramp),
            _ => f64::NEG_INFINITY,
        };
        let touches = is_felt(entry, k);
        for band in &mut bands {
            band.add(entry.devices[k].force, touches, quiet);
        }
    }
    let [fast, slow] = bands;
    Some(Still {
        seconds: fast.n_judged as f64 * params.period,
        rms_band: fast.worst?,
        rms_slow: slow.worst,
    })
}
