//! The engine: connects threads, mailboxes and rings, then starts, watches and stops them.

mod params;
mod report;

pub use self::params::{EngineParams, StartError};
pub use self::report::{Report, Snapshot};

use crate::{
    clock::{Clock, RealClock},
    event::{RecordKind, Speaker},
    fault::FaultHooks,
    findings::Board,
    late::LateTick,
    mailbox::{Reader, Writer, mailbox},
    record::StepRecord,
    recorder::{LogFile, Recorder, RecorderParams},
    servo_loop::{LoopStats, Now, ServoLoop, TickEntry},
    smoothness::ForceStats,
    threads::{Granted, Wish, lock_memory},
    tissue::{Tissue, empty_patch},
    tissue_thread::{Background, Pause, PoseSample, TissueStats, TissueThread, run_background},
};
use palpa_device::HapticDevice;
use palpa_servo::{DeviceSpec, MAX_TOOLS, Servo, ServoParams, Vec3};
use rtrb::{Producer, RingBuffer};
use std::{
    path::PathBuf,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
        mpsc,
    },
    thread::{self, JoinHandle, Thread},
};

/// Capacity of the rings to the recorder, in ticks and steps: eight seconds at 1 kHz.
const RING: usize = 8192;
const EVENT_RING: usize = 1024;
/// Stack of the tissue's thread, bytes: solvers may put small matrices on it.
const TISSUE_STACK: usize = 16 << 20;
const SMALL_STACK: usize = 2 << 20;

/// A running engine. Dropping it stops it: the forces ramp down, the devices are released, and the
/// log is closed.
#[derive(Debug)]
pub struct Engine {
    clock: RealClock,
    granted: Vec<Granted>,
    memory_locked: Result<(), String>,
    faults: Arc<FaultHooks>,
    loop_stats: Arc<LoopStats>,
    tissue_stats: Arc<TissueStats>,
    findings: Board,
    tick_view: Reader<TickEntry>,
    step_view: Reader<StepRecord>,
    aims: Writer<Option<Vec3>>,
    log: Option<PathBuf>,
    /// The threads in the order of their start: recorder, background, tissue, loop. They are
    /// stopped in reverse order, so that a receiver always outlives its senders.
    threads: Vec<Running>,
    panicked: Vec<&'static str>,
}

#[derive(Debug)]
struct Running {
    name: &'static str,
    stop: Arc<AtomicBool>,
    handle: JoinHandle<()>,
}

/// The writing ends of the recorder's rings, for the other threads.
struct Rings {
    ticks: Producer<TickEntry>,
    steps: Producer<StepRecord>,
    servo: Speaker,
    tissue: Speaker,
}

impl Engine {
    /// Starts all threads.
    ///
    /// # Errors
    /// [`StartError`]; in that case no thread runs.
    pub fn start<T: Tissue + 'static>(
        tissue: T,
        devices: Vec<Box<dyn HapticDevice>>,
        params: &EngineParams,
        recorder: &RecorderParams,
    ) -> Result<Self, StartError> {
        let (mut engine, mut servo_loop) = Self::start_driven(tissue, devices, params, recorder)?;
        let (clock, faults) = (engine.clock.clone(), engine.faults.clone());
        let (period, waits) = (params.period, params.time_waits);
        engine.spawn("palpa-servo", params.servo_wish, SMALL_STACK, move |stop| {
            servo_loop.run(&clock, period, waits, &faults, stop);
        })?;
        Ok(engine)
    }

    /// Starts all threads except the loop's. The caller runs the [`ServoLoop`], for example from a
    /// vendor's callback, with times of [`Engine::now`].
    ///
    /// # Errors
    /// [`StartError`]; in that case no thread runs.
    pub fn start_driven<T: Tissue + 'static>(
        tissue: T,
        devices: Vec<Box<dyn HapticDevice>>,
        params: &EngineParams,
        recorder: &RecorderParams,
    ) -> Result<(Self, ServoLoop), StartError> {
        if devices.is_empty() || devices.len() > MAX_TOOLS {
            return Err(StartError::Devices {
                found: devices.len(),
            });
        }
        if !(params.period > 0.0 && params.period <= 0.1) {
            return Err(StartError::Period {
                period: params.period,
            });
        }
        let specs: Vec<DeviceSpec> = devices.iter().map(HapticDevice::spec).collect();
        let (tick_writer, tick_view) = mailbox([(); 3].map(|()| Box::<TickEntry>::default()));
        let (step_writer, step_view) = mailbox([(); 3].map(|()| Box::<StepRecord>::default()));
        let (aims, aim_reader) = mailbox([(); 3].map(|()| Box::default()));
        let mut engine = Self {
            clock: RealClock::new(params.spin),
            granted: Vec::new(),
            memory_locked: Err("not asked for".to_owned()),
            faults: Arc::default(),
            loop_stats: Arc::default(),
            tissue_stats: Arc::default(),
            findings: Board::default(),
            tick_view,
            step_view,
            aims,
            log: recorder.path.clone(),
            threads: Vec::new(),
            panicked: Vec::new(),
        };
        let servo_params = ServoParams {
            period: params.period,
            ..params.servo
        };
        let rings = engine.start_recorder(params, &servo_params, recorder, &specs)?;
        let background = engine.start_background::<T>(params)?;
        let (patch_writer, patch_reader) = mailbox([(); 3].map(|()| empty_patch()));
        let (pose_writer, pose_reader) = mailbox([(); 3].map(|()| Box::new(PoseSample::none())));
        let tissue = TissueThread {
            tissue,
            clock: engine.clock.clone(),
            params: params.tissue,
            poses: pose_reader,
            aims: aim_reader,
            patches: patch_writer,
            view: step_writer,
            ring: rings.steps,
            speaker: rings.tissue,
            background,
            faults: engine.faults.clone(),
            stats: engine.tissue_stats.clone(),
        };
        engine.spawn("palpa-tissue", params.tissue_wish, TISSUE_STACK, |stop| {
            tissue.run(stop);
        })?;
        let servo_loop = ServoLoop {
            servo: Box::new(Servo::new(&servo_params, &specs)),
            now: Now::new(devices.len()),
            devices,
            patches: patch_reader,
            poses: pose_writer,
            view: tick_writer,
            ring: rings.ticks,
            speaker: rings.servo,
            stats: engine.loop_stats.clone(),
        };
        // Locked last, so that the memory allocated above is included.
        if params.lock_memory {
            engine.memory_locked = lock_memory();
        }
        Ok((engine, servo_loop))
    }

    /// Tells the tissue where the hand of the first tool means to touch it, in the device's frame, m; `None` if that is not
    /// known. Tissue that follows the tool then gets ready for that place before the tool is there.
    pub fn set_aim(&mut self, place: Option<Vec3>) {
        *self.aims.slot() = place;
        self.aims.publish();
    }

    fn start_recorder(
        &mut self,
        params: &EngineParams,
        servo: &ServoParams,
        recorder: &RecorderParams,
        specs: &[DeviceSpec],
    ) -> Result<Rings, StartError> {
        let create = |path: &PathBuf| {
            LogFile::create(recorder, path, specs, servo, self.now()).map_err(|source| {
                StartError::Log {
                    path: path.clone(),
                    source,
                }
            })
        };
        let file = recorder.path.as_ref().map(create).transpose()?;
        let (tick_ring, ticks) = RingBuffer::new(RING);
        let (step_ring, steps) = RingBuffer::new(RING);
        let (servo_speaker, servo_events) = RingBuffer::new(EVENT_RING);
        let (tissue, tissue_events) = RingBuffer::new(EVENT_RING);
        let (loop_stats, tissue_stats) = (self.loop_stats.clone(), self.tissue_stats.clone());
        let recorder = Recorder {
            ticks,
            steps,
            events: vec![servo_events, tissue_events],
            file,
            forces: specs
                .iter()
                .map(|_| ForceStats::new(params.period))
                .collect(),
            findings: self.findings.clone(),
            counts_lost: Box::new(move || {
                [
                    (
                        RecordKind::Ticks,
                        loop_stats.lost_records.load(Ordering::Relaxed),
                    ),
                    (
                        RecordKind::Steps,
                        tissue_stats.lost_records.load(Ordering::Relaxed),
                    ),
                ]
            }),
            said_lost: [0; 2],
            last_time: 0.0,
        };
        self.spawn(
            "palpa-recorder",
            params.recorder_wish,
            SMALL_STACK,
            |stop| recorder.run(stop),
        )?;
        Ok(Rings {
            ticks: tick_ring,
            steps: step_ring,
            servo: Speaker::new(servo_speaker),
            tissue: Speaker::new(tissue),
        })
    }

    fn start_background<T: Tissue>(
        &mut self,
        params: &EngineParams,
    ) -> Result<Background<T>, StartError> {
        let (job_ring, mut jobs) = RingBuffer::new(1);
        let (mut done_ring, done) = RingBuffer::new(1);
        let stats = self.tissue_stats.clone();
        let thread = self.spawn(
            "palpa-background",
            params.background_wish,
            TISSUE_STACK,
            move |stop| {
                run_background::<T>(&mut jobs, &mut done_ring, stop, &stats);
            },
        )?;
        Ok(Background {
            jobs: job_ring,
            done,
            thread,
            is_busy: false,
            pause: Pause::default(),
        })
    }

    /// Seconds since the start.
    pub fn now(&self) -> f64 {
        self.clock.now()
    }

    /// The latest tick and step.
    pub fn snapshot(&mut self) -> Snapshot {
        self.tick_view.take();
        self.step_view.take();
        Snapshot {
            tick: *self.tick_view.current(),
            step: *self.step_view.current(),
        }
    }

    /// Switches that cause faults on purpose.
    pub fn faults(&self) -> &FaultHooks {
        &self.faults
    }

    /// Statistics of the loop.
    pub fn loop_stats(&self) -> &LoopStats {
        &self.loop_stats
    }

    /// Statistics of the tissue.
    pub fn tissue_stats(&self) -> &TissueStats {
        &self.tissue_stats
    }

    /// Scheduling that the system granted to each thread.
    pub fn granted(&self) -> &[Granted] {
        &self.granted
    }

    /// Names of the threads that ended by themselves. Without the tissue's thread there is no force
    /// any more; the engine must be started again.
    pub fn ended(&self) -> Vec<&'static str> {
        let is_over = |running: &&Running| running.handle.is_finished();
        (self.threads.iter().filter(is_over).map(|r| r.name)).collect()
    }

    /// Force and energy of the first device in the last ticks, oldest first: those of two seconds,
    /// but for the last hundredths of a second.
    pub fn late_ticks(&self) -> Vec<LateTick> {
        self.findings.lock().late.to_vec()
    }

    /// Stops the engine: the forces ramp down, the devices are released, the rings are written to
    /// the log, and the log is closed.
    pub fn stop(mut self) -> Report {
        self.shut_down();
        self.report()
    }

    /// Report of the run so far.
    pub fn report(&self) -> Report {
        let findings = self.findings.lock();
        let duration = self.now();
        let steps = self.tissue_stats.wall.count();
        let jobs = self.tissue_stats.background.quantiles();
        Report {
            duration,
            ticks: self.loop_stats.ticks.load(Ordering::Relaxed),
            skipped: self.loop_stats.skipped.load(Ordering::Relaxed),
            tick_cpu: self.loop_stats.cpu.quantiles(),
            lateness: self.loop_stats.lateness.quantiles(),
            tick_cpu_histogram: self.loop_stats.cpu.filled(),
            lateness_histogram: self.loop_stats.lateness.filled(),
            forces: findings.forces.clone(),
            steps,
            step_rate: steps as f64 / duration.max(1e-9),
            step_cpu: self.tissue_stats.cpu.quantiles(),
            step_wall: self.tissue_stats.wall.quantiles(),
            held_back: self.tissue_stats.held_back.load(Ordering::Relaxed),
            jobs,
            jobs_panicked: self.tissue_stats.jobs_panicked.load(Ordering::Relaxed),
            background_cpu_share: jobs.mean * jobs.count as f64 / duration.max(1e-9),
            lost_records: [
                self.loop_stats.lost_records.load(Ordering::Relaxed),
                self.tissue_stats.lost_records.load(Ordering::Relaxed),
            ],
            has_log_failed: findings.has_file_failed,
            panicked: self.panicked.clone(),
            events: findings.events.clone(),
            granted: self.granted.clone(),
            memory_locked: self.memory_locked.clone(),
            log: self.log.clone(),
        }
    }

    fn spawn(
        &mut self,
        name: &'static str,
        wish: Wish,
        stack: usize,
        body: impl FnOnce(&AtomicBool) + Send + 'static,
    ) -> Result<Thread, StartError> {
        let stop = Arc::new(AtomicBool::new(false));
        let its_stop = stop.clone();
        #[expect(
            clippy::disallowed_methods,
            reason = "one answer before the thread does anything else"
        )]
        let (tell, told) = mpsc::channel();
        let builder = thread::Builder::new()
            .name(name.to_owned())
            .stack_size(stack);
        let handle = builder.spawn(move || {
            // Only the thread itself can request this. A send error means that the receiver is gone
            // and does not need the answer.
            let _ = tell.send(wish.ask(name));
            body(&its_stop);
        })?;
        let thread = handle.thread().clone();
        self.threads.push(Running { name, stop, handle });
        self.granted.extend(told.recv());
        Ok(thread)
    }

    fn shut_down(&mut self) {
        while let Some(running) = self.threads.pop() {
            running.stop.store(true, Ordering::Release);
            running.handle.thread().unpark();
            if running.handle.join().is_err() {
                self.panicked.push(running.name);
            }
        }
    }
}

impl Drop for Engine {
    fn drop(&mut self) {
        self.shut_down();
    }
}
