//! Runs Palpa in real time: threads, clock, hand-over, recorder, replay and statistics.
//!
//! ```text
//!  palpa-servo       1 kHz: devices → law → devices            ServoLoop
//!     │ poses  ▲ patches                                       mailbox: wait-free, latest wins
//!  palpa-tissue      as fast as it can: Tissue::step
//!     │ jobs   ▲ done                                          rings of one
//!  palpa-background  low priority: Tissue::run
//!
//!  palpa-recorder    ticks, steps, events ◄── rings ── all     MCAP file, statistics
//! ```
//! A slow thread never blocks a fast one: a mailbox keeps the latest value only, and a full ring
//! counts the records that it loses. A log holds all inputs of both layers, so [`replay`] can run
//! them again in one thread and compare the results bit for bit.
//!
//! # Example
//! A tissue without resistance, under a hand that stands still:
//! ```
//! use palpa_device::{DeviceFault, HapticDevice};
//! use palpa_rt::{Engine, EngineParams, RecorderParams, Tissue, TissueInput, TissueStep};
//! use palpa_servo::{ContactPatch, DeviceSpec, DeviceState, ForceCommand, Pose, Vec3};
//!
//! struct Air;
//! impl Tissue for Air {
//!     type Job = ();
//!     type Done = ();
//!     fn step(&mut self, input: &TissueInput, patch: &mut ContactPatch) -> TissueStep {
//!         patch.n_tools = input.n_tools;
//!         patch.n_contacts = 0;
//!         TissueStep::default()
//!     }
//!     fn take_job(&mut self) -> Option<()> { None }
//!     fn run((): ()) {}
//!     fn install(&mut self, (): ()) {}
//!     fn job_failed(&mut self) {}
//! }
//!
//! struct Still;
//! impl HapticDevice for Still {
//!     fn spec(&self) -> DeviceSpec {
//!         DeviceSpec { max_force: 3.0, max_torque: 0.0, max_slew: 1e3, max_stiffness: 2e3, max_damping: 5.0 }
//!     }
//!     fn read(&mut self, now: f64) -> Result<DeviceState, DeviceFault> {
//!         Ok(DeviceState { time: now, pose: Pose::identity(), velocity: Vec3::zeros(), buttons: 0 })
//!     }
//!     fn write(&mut self, _: f64, _: &ForceCommand) -> Result<(), DeviceFault> { Ok(()) }
//! }
//!
//! let params = EngineParams { lock_memory: false, ..EngineParams::default() };
//! let mut engine = Engine::start(Air, vec![Box::new(Still)], &params, &RecorderParams::default())?;
//! while engine.snapshot().tick.tick.patch == 0 {}
//! let report = engine.stop();
//! assert!(report.ticks > 0 && report.forces[0].max_force == 0.0);
//! # Ok::<(), palpa_rt::StartError>(())
//! ```
//!
//! # How the hand-over and the loop are checked
//! - Loom runs all interleavings of the mailbox:
//!   `RUSTFLAGS="--cfg loom" cargo test -p palpa-rt --release --lib --target-dir target/loom proof`
//! - The real-time sanitizer watches the loop's body:
//!   ```text
//!   RTSAN_ENABLE=1 \
//!   RTSAN_LIB_PATH=$(rustc --print sysroot)/lib/rustlib/x86_64-unknown-linux-gnu/lib/librustc-stable_rt.rtsan.a \
//!   cargo test -p palpa-rt --features rtsan --target-dir target/rtsan --test it realtime
//!   ```
//! - Ordinary tests run the loop's body under an allocator that aborts, and the mailbox under load.

mod clock;
mod fault;
mod histogram;
mod mailbox;
mod threads;
#[macro_use]
mod layout;
mod record;

mod engine;
mod event;
mod export;
mod feel;
mod findings;
mod late;
mod log;
mod machine;
mod recorder;
mod replay;
mod servo_loop;
mod smoothness;
mod tissue;
mod tissue_thread;

pub use clock::{Clock, ManualClock, RealClock, thread_cpu};
pub use engine::{Engine, EngineParams, Report, Snapshot, StartError};
pub use event::{Event, Happening, Injection, Level, RecordKind};
pub use export::{ExportError, Exported, Felt, LEAD, Table, export};
pub use fault::FaultHooks;
pub use feel::{Dips, FeelParams, FeelReport, Still};
pub use histogram::{Histogram, Quantiles};
pub use late::LateTick;
pub use layout::{Field, Record, Value};
pub use log::{Ending, Header, Log, LogError, Row, Rows};
pub use machine::{Difference, Effect, Machine};
pub use mailbox::{Reader, Writer, mailbox};
pub use record::{DeviceRecord, ServoRecord, SpecRecord, StepRecord, TickRecord};
pub use recorder::{EventRow, RecorderParams};
pub use replay::{ForceDifference, ReplayParams, ReplayReport, Verdict, replay, replay_watched};
pub use servo_loop::{LoopStats, ServoLoop, TickEntry};
pub use smoothness::{ForceReport, ForceStats};
pub use threads::{Granted, Priority, Wish, lock_memory};
pub use tissue::{
    StepStatus, Tissue, TissueInput, TissueStep, ahead, empty_patch, patch_hash, stamp,
};
pub use tissue_thread::{REST_STEPS, TissueParams, TissueStats};
