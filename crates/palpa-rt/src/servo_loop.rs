//! The 1 kHz loop: reads the devices, runs the law, writes the devices, and records the tick.

mod entry;

pub use self::entry::TickEntry;

use crate::{
    clock::{Clock, thread_cpu},
    event::{Happening, Injection, Speaker},
    fault::FaultHooks,
    histogram::Histogram,
    mailbox::{Reader, Writer},
    record::{DeviceRecord, TickRecord},
    tissue_thread::PoseSample,
};
use palpa_device::HapticDevice;
use palpa_servo::{
    ContactPatch, DeviceState, Faults, ForceCommand, MAX_TOOLS, PatchSource, Pose, Servo,
    TickReport, Vec3,
};
use rtrb::Producer;
use std::{
    fmt,
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
};

/// Largest number of ticks in which the forces ramp down before the devices are released.
const LAST_TICKS: u32 = 200;
/// Where time waits for the loop: the time after the moment at which a tick is due, in periods.
const WAITS_AFTER: f64 = 2.0;
/// Smallest time between two events about missed deadlines, s.
const SAY_EVERY: f64 = 0.1;

/// Statistics of the loop; any thread may read them at any time.
#[derive(Debug, Default)]
pub struct LoopStats {
    /// CPU time of ticks, s.
    pub cpu: Histogram,
    /// Lateness of ticks, s.
    pub lateness: Histogram,
    /// Ticks done.
    pub ticks: AtomicU64,
    /// Ticks skipped because the previous tick took too long or the thread woke up too late.
    pub skipped: AtomicU64,
    /// Ticks not recorded because the ring was full.
    pub lost_records: AtomicU64,
}

/// The 1 kHz loop without its thread. The engine or a vendor's callback decides when a tick begins
/// and calls [`ServoLoop::tick_once`]. Dropping the loop writes zero force to the devices.
pub struct ServoLoop {
    pub(crate) servo: Box<Servo>,
    pub(crate) devices: Vec<Box<dyn HapticDevice>>,
    pub(crate) patches: Reader<ContactPatch>,
    pub(crate) poses: Writer<PoseSample>,
    pub(crate) view: Writer<TickEntry>,
    pub(crate) ring: Producer<TickEntry>,
    pub(crate) speaker: Speaker,
    pub(crate) stats: Arc<LoopStats>,
    pub(crate) now: Now,
}

/// Lets a clock go on when the loop ends, however it ends.
struct GoesOn<'a, C: Clock>(&'a C);

impl<C: Clock> Drop for GoesOn<'_, C> {
    fn drop(&mut self) {
        self.0.stop_at(f64::INFINITY);
    }
}

/// State from tick to tick.
pub(crate) struct Now {
    tick: u64,
    time: f64,
    sample: PoseSample,
    states: [Option<DeviceState>; MAX_TOOLS],
    commands: [ForceCommand; MAX_TOOLS],
    /// Displacement of each tool from its device in the last tick, m.
    stretch: [Vec3; MAX_TOOLS],
    /// Number of ticks for which each device has been away.
    away: [u64; MAX_TOOLS],
    is_written: [bool; MAX_TOOLS],
    faults: Faults,
    skipped: u64,
    longest_gap: f64,
    said_at: f64,
    is_letting_go: bool,
}

impl Now {
    pub(crate) fn new(n_devices: usize) -> Self {
        Self {
            tick: 0,
            time: 0.0,
            sample: PoseSample {
                n_tools: n_devices,
                ..PoseSample::none()
            },
            states: [None; MAX_TOOLS],
            commands: [ForceCommand::ZERO; MAX_TOOLS],
            stretch: [Vec3::zeros(); MAX_TOOLS],
            away: [0; MAX_TOOLS],
            is_written: [true; MAX_TOOLS],
            faults: Faults::NONE,
            skipped: 0,
            longest_gap: 0.0,
            said_at: f64::NEG_INFINITY,
            is_letting_go: false,
        }
    }
}

impl ServoLoop {
    /// Runs one tick. `now` is the moment at which it begins, s; `lateness` is the time since it
    /// was due, s; `skipped` is the number of ticks skipped because of that lateness.
    ///
    /// Does not allocate, wait or panic, whatever the devices and the tissue send. This does not
    /// cover the code of a device's driver.
    #[cfg_attr(feature = "rtsan", rtsan_standalone::nonblocking)]
    pub fn tick_once(&mut self, now: f64, lateness: f64, skipped: u32) {
        let cpu_t0 = thread_cpu();
        self.count(now, lateness, skipped);
        self.read(now);
        self.post_poses(now);
        let n = self.devices.len().min(MAX_TOOLS);
        let mut arrival = Arrival::new(&mut self.patches);
        let (states, commands) = (self.now.states.get(..n), self.now.commands.get_mut(..n));
        let report = match (states, commands) {
            (Some(states), Some(commands)) => self.servo.tick(now, states, &mut arrival, commands),
            _ => TickReport::ZERO,
        };
        let (offered, taken) = (arrival.offered, arrival.taken);
        for (stretch, tool) in self.now.stretch.iter_mut().zip(&report.tools) {
            *stretch = tool.stretch;
        }
        let velocities = &mut self.now.sample.velocities;
        for (velocity, tool) in velocities.iter_mut().zip(&report.tools) {
            *velocity = tool.velocity;
        }
        self.write(now);
        self.notice(now, &report);
        let mut entry = TickEntry {
            tick: TickRecord {
                tick: self.now.tick,
                now,
                lateness,
                skipped,
                offered,
                taken,
                patch: self.patches.current().id,
                n_devices: n as u32,
                ..TickRecord::of(&report)
            },
            devices: [DeviceRecord::default(); MAX_TOOLS],
        };
        self.fill_devices(&mut entry, &report);
        entry.tick.cpu = thread_cpu() - cpu_t0;
        self.stats.cpu.add(entry.tick.cpu);
        *self.view.slot() = entry;
        self.view.publish();
        if self.ring.push(entry).is_err() {
            self.stats.lost_records.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Ticks every `period` seconds until `stop` is set, then ramps down.
    ///
    /// If a tick is so late that the next ones are due already, those are skipped; the loop never
    /// catches up in a burst. If time `waits`, it stands still a little after each moment at which a tick is due,
    /// until that tick begins.
    pub(crate) fn run(
        &mut self,
        clock: &impl Clock,
        period: f64,
        waits: bool,
        faults: &FaultHooks,
        stop: &AtomicBool,
    ) {
        let _goes_on = GoesOn(clock);
        let start = clock.now();
        self.speaker.say(start, Happening::LoopStarted);
        let mut slot = 0_u64;
        let mut rest = LAST_TICKS;
        while rest > 0 {
            if stop.load(Ordering::Relaxed) {
                self.let_go();
                rest = if self.is_at_rest() { 0 } else { rest - 1 };
            }
            slot += 1;
            let due = start + slot as f64 * period;
            if waits {
                clock.stop_at(due + WAITS_AFTER * period);
            }
            clock.wait_until(due);
            if let Some(delay) = faults.take_loop_delay() {
                self.speaker
                    .say(clock.now(), Happening::Injected(Injection::LoopLate));
                // Time goes on: the fault shall be felt.
                clock.stop_at(f64::INFINITY);
                clock.wait_until(due + delay);
            }
            let stood = if waits { clock.take_standstill() } else { 0.0 };
            let now = clock.now();
            // The casts saturate. The values are never negative, because a wait never returns early.
            slot += ((now - due) / period) as u64;
            let lateness = now - due + stood;
            let skipped = (lateness / period) as u64;
            self.tick_once(now, lateness, u32::try_from(skipped).unwrap_or(u32::MAX));
        }
        self.disarm(clock.now());
        let ticks = self.now.tick;
        self.speaker.say(clock.now(), Happening::LoopStopped(ticks));
    }

    /// Stops reading the devices, so that the law ramps all forces down.
    fn let_go(&mut self) {
        self.now.is_letting_go = true;
    }

    fn is_at_rest(&self) -> bool {
        let zero =
            |c: &ForceCommand| c.force.norm_squared() == 0.0 && c.torque.norm_squared() == 0.0;
        self.now.commands.iter().all(zero)
    }

    fn count(&mut self, now: f64, lateness: f64, skipped: u32) {
        let n = &mut self.now;
        n.tick += 1;
        self.stats.ticks.store(n.tick, Ordering::Relaxed);
        let gap = if n.tick > 1 { now - n.time } else { 0.0 };
        n.time = now;
        self.stats.lateness.add(lateness);
        if skipped > 0 {
            self.stats
                .skipped
                .fetch_add(skipped.into(), Ordering::Relaxed);
            n.skipped += u64::from(skipped);
            n.longest_gap = n.longest_gap.max(gap);
        }
        if n.skipped > 0 && now - n.said_at > SAY_EVERY {
            let what = Happening::DeadlineMissed {
                skipped: n.skipped,
                longest: n.longest_gap,
            };
            (n.skipped, n.longest_gap, n.said_at) = (0, 0.0, now);
            self.speaker.say(now, what);
        }
    }

    fn read(&mut self, now: f64) {
        let n = &mut self.now;
        for (k, device) in self.devices.iter_mut().enumerate().take(MAX_TOOLS) {
            let (Some(state), Some(away)) = (n.states.get_mut(k), n.away.get_mut(k)) else {
                continue;
            };
            let read = device.read(now);
            *state = if n.is_letting_go { None } else { read.ok() };
            match read {
                Ok(_) if *away > 0 => {
                    self.speaker
                        .say(now, Happening::DeviceBack(k as u32, *away));
                    *away = 0;
                }
                Ok(_) => {}
                Err(fault) => {
                    if *away == 0 {
                        self.speaker
                            .say(now, Happening::DeviceLost(k as u32, fault));
                    }
                    *away += 1;
                }
            }
        }
    }

    /// Sends the poses of the tools to the tissue. If a device is away or gives an invalid reading,
    /// its tool keeps its last pose.
    fn post_poses(&mut self, now: f64) {
        let n = &mut self.now;
        n.sample.tick = n.tick;
        n.sample.time = now;
        for ((pose, state), stretch) in n.sample.poses.iter_mut().zip(&n.states).zip(&n.stretch) {
            if let Some(state) = state
                && is_finite(&state.pose)
            {
                *pose = state.pose;
                pose.translation.vector += stretch;
            }
        }
        *self.poses.slot() = n.sample;
        self.poses.publish();
    }

    fn write(&mut self, now: f64) {
        let n = &mut self.now;
        for (k, device) in self.devices.iter_mut().enumerate().take(MAX_TOOLS) {
            let (Some(command), Some(is_written)) = (n.commands.get(k), n.is_written.get_mut(k))
            else {
                continue;
            };
            let result = device.write(now, command);
            if let Err(fault) = result
                && *is_written
            {
                self.speaker
                    .say(now, Happening::WriteFailed(k as u32, fault));
            }
            *is_written = result.is_ok();
        }
    }

    fn notice(&mut self, now: f64, report: &TickReport) {
        // Releasing the devices is not a fault, though the law then sees all devices as lost.
        if report.faults != self.now.faults && !self.now.is_letting_go {
            self.now.faults = report.faults;
            self.speaker.say(now, Happening::LawFaults(report.faults));
        }
    }

    fn fill_devices(&self, entry: &mut TickEntry, report: &TickReport) {
        let n = &self.now;
        for (k, (record, tool)) in entry.devices.iter_mut().zip(&report.tools).enumerate() {
            let (Some(state), Some(command)) = (n.states.get(k), n.commands.get(k)) else {
                continue;
            };
            *record = DeviceRecord::of(tool);
            record.tick = n.tick;
            record.set_state(state.as_ref());
            record.force = command.force.into();
            record.torque = command.torque.into();
            record.is_written = n.is_written.get(k).copied().unwrap_or(false);
        }
    }

    /// Writes zero force to all devices, whatever the last command was.
    fn disarm(&mut self, now: f64) {
        for device in &mut self.devices {
            // A lost device cannot get the command; its own watchdog must stop it.
            let _ = device.write(now, &ForceCommand::ZERO);
        }
    }
}

impl Drop for ServoLoop {
    fn drop(&mut self) {
        self.disarm(self.now.time);
    }
}

impl fmt::Debug for ServoLoop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ServoLoop")
            .field("tick", &self.now.tick)
            .finish_non_exhaustive()
    }
}

/// The law's view of the mailbox during one tick. Whether a newer patch is offered is decided when
/// the tick begins, so that the log can record it completely.
struct Arrival<'a> {
    patches: &'a mut Reader<ContactPatch>,
    offered: bool,
    taken: bool,
}

impl<'a> Arrival<'a> {
    fn new(patches: &'a mut Reader<ContactPatch>) -> Self {
        Self {
            offered: patches.is_newer(),
            patches,
            taken: false,
        }
    }
}

impl PatchSource for Arrival<'_> {
    fn current(&self) -> &ContactPatch {
        self.patches.current()
    }

    fn is_newer(&self) -> bool {
        self.offered && !self.taken
    }

    fn take(&mut self) {
        if self.is_newer() {
            self.taken = self.patches.take();
        }
    }
}

fn is_finite(pose: &Pose) -> bool {
    pose.translation.vector.iter().all(|v| v.is_finite())
        && pose.rotation.coords.iter().all(|v| v.is_finite())
}
