//! The recorder: writes the records of the rings to an MCAP file and computes the statistics that
//! need every tick.
//!
//! Chunks are finished and handed to the system at least every quarter of a second, so a killed
//! process loses no more than that. Memory is bounded by the rings and one chunk.

use crate::{
    clock::rest,
    event::{Event, Happening, Level, RecordKind},
    findings::Board,
    late::LateTick,
    layout::Record,
    machine::Machine,
    record::{DeviceRecord, ServoRecord, SpecRecord, StepRecord, TickRecord},
    servo_loop::TickEntry,
    smoothness::ForceStats,
};
use mcap::{McapError, McapResult, WriteOptions, Writer, records::MessageHeader};
use palpa_servo::{DeviceSpec, MAX_TOOLS, ServoParams};
use rtrb::Consumer;
use serde_json::json;
use std::{
    collections::BTreeMap,
    fs::File,
    io::{BufWriter, Write},
    path::PathBuf,
    sync::atomic::{AtomicBool, Ordering},
    time::{Duration, Instant, SystemTime, UNIX_EPOCH},
};

/// Topics of the channels.
pub(crate) const TOPIC_HEADER: &str = "/header";
pub(crate) const TOPIC_SPEC: &str = "/spec";
pub(crate) const TOPIC_SERVO: &str = "/servo";
pub(crate) const TOPIC_TICK: &str = "/tick";
pub(crate) const TOPIC_DEVICE: &str = "/device/";
pub(crate) const TOPIC_STEP: &str = "/tissue/step";
pub(crate) const TOPIC_EVENT: &str = "/event";

const FLUSH_EVERY: Duration = Duration::from_millis(250);
const DRAIN_EVERY: Duration = Duration::from_millis(10);
/// Largest number of events kept for the report; later ones are in the file only.
const MAX_EVENTS: usize = 10_000;

/// The file of a recording, and its header.
#[derive(Debug, Clone)]
pub struct RecorderParams {
    /// The file. With `None` nothing is recorded, but statistics and events are still kept.
    pub path: Option<PathBuf>,
    /// The scene, as text: with it a replay can build the same body.
    pub scene: String,
    /// Notes by name, for a replay or a reader.
    pub notes: BTreeMap<String, String>,
    /// The machine and the program.
    pub machine: Machine,
}

impl Default for RecorderParams {
    /// No file; the machine as far as this crate knows it.
    fn default() -> Self {
        Self {
            path: None,
            scene: String::new(),
            notes: BTreeMap::new(),
            machine: Machine::here(),
        }
    }
}

/// An event of a log, in words.
#[derive(Debug, Clone, PartialEq)]
pub struct EventRow {
    /// Time, s.
    pub time: f64,
    /// Severity.
    pub level: Level,
    /// Text.
    pub text: String,
}

/// The state of the recorder thread.
pub(crate) struct Recorder {
    pub(crate) ticks: Consumer<TickEntry>,
    pub(crate) steps: Consumer<StepRecord>,
    pub(crate) events: Vec<Consumer<Event>>,
    pub(crate) file: Option<LogFile>,
    pub(crate) forces: Vec<ForceStats>,
    pub(crate) findings: Board,
    pub(crate) counts_lost: Box<dyn FnMut() -> [(RecordKind, u64); 2] + Send>,
    pub(crate) said_lost: [u64; 2],
    pub(crate) last_time: f64,
}

impl Recorder {
    /// Records until `stop` is set, then records the rest of the rings.
    pub(crate) fn run(mut self, stop: &AtomicBool) {
        let mut flushed = Instant::now();
        loop {
            // Read before draining, so that records pushed before the stop are still drained.
            let is_last = stop.load(Ordering::Acquire);
            self.drain();
            if is_last {
                break;
            }
            if flushed.elapsed() >= FLUSH_EVERY {
                self.try_file(LogFile::flush);
                flushed = Instant::now();
            }
            rest(DRAIN_EVERY);
        }
        if let Some(file) = self.file.take()
            && let Err(error) = file.close()
        {
            self.say_failed(&error);
        }
        self.publish();
    }

    fn drain(&mut self) {
        let (mut events, mut late) = (Vec::new(), Vec::new());
        for ring in &mut self.events {
            while let Ok(event) = ring.pop() {
                events.push(event);
            }
        }
        while let Ok(entry) = self.ticks.pop() {
            self.last_time = entry.tick.now;
            late.push(LateTick::from(&entry));
            let n = entry.tick.n_devices as usize;
            for (k, stats) in self.forces.iter_mut().enumerate().take(n) {
                stats.add(&entry, k);
            }
            self.try_file(|file| file.tick(&entry));
        }
        while let Ok(step) = self.steps.pop() {
            self.try_file(|file| file.row(file.steps, step.now, &step));
        }
        self.findings.lock().late.append(&mut late);
        for ((kind, n), said) in (self.counts_lost)().into_iter().zip(&mut self.said_lost) {
            if n > *said {
                events.push(Event {
                    time: self.last_time,
                    what: Happening::RecordsLost(kind, n - *said),
                });
                *said = n;
            }
        }
        events.sort_by(|a, b| a.time.total_cmp(&b.time));
        for event in events {
            self.event(event);
        }
        self.publish();
    }

    fn event(&mut self, event: Event) {
        self.try_file(|file| file.event(&event));
        let mut findings = self.findings.lock();
        if findings.events.len() < MAX_EVENTS {
            findings.events.push(event);
        }
    }

    fn publish(&mut self) {
        let reports = self.forces.iter().map(ForceStats::report).collect();
        self.findings.lock().forces = reports;
    }

    /// Runs `act` on the file, if there is one; after a failure the file is dropped.
    fn try_file(&mut self, act: impl FnOnce(&mut LogFile) -> McapResult<()>) {
        let Some(file) = &mut self.file else { return };
        if let Err(error) = act(file) {
            self.file = None;
            self.say_failed(&error);
        }
    }

    fn say_failed(&self, error: &McapError) {
        let mut findings = self.findings.lock();
        findings.has_file_failed = true;
        findings.events.push(Event {
            time: self.last_time,
            what: Happening::FileFailed(error.to_string()),
        });
    }
}

/// A log being written.
pub(crate) struct LogFile {
    writer: Writer<BufWriter<File>>,
    /// Unix time of the clock's zero, ns.
    origin: u64,
    ticks: u16,
    devices: Vec<u16>,
    steps: u16,
    events: u16,
    sequence: u32,
    buffer: Vec<u8>,
}

impl LogFile {
    /// Creates the file with its header. The header is on disk when this returns.
    pub(crate) fn create(
        params: &RecorderParams,
        path: &PathBuf,
        specs: &[DeviceSpec],
        servo: &ServoParams,
        now: f64,
    ) -> McapResult<Self> {
        let file = BufWriter::new(File::create(path)?);
        let options = WriteOptions::new()
            .compression(None)
            .chunk_size(None)
            // A chunk is put together in memory and written as a whole, so no header must be
            // changed in bytes already written.
            .disable_seeking(true)
            .library(format!("palpa {}", env!("CARGO_PKG_VERSION")));
        let mut writer = options.create(file)?;
        let unix = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .unwrap_or_default()
            .as_nanos() as u64;
        let origin = unix.saturating_sub((now * 1e9) as u64);
        let header_channel = writer.add_channel(0, TOPIC_HEADER, "json", &BTreeMap::new())?;
        let specs_channel = channel::<SpecRecord>(&mut writer, TOPIC_SPEC)?;
        let servo_channel = channel::<ServoRecord>(&mut writer, TOPIC_SERVO)?;
        let ticks = channel::<TickRecord>(&mut writer, TOPIC_TICK)?;
        let devices = (0..specs.len().min(MAX_TOOLS))
            .map(|k| channel::<DeviceRecord>(&mut writer, &format!("{TOPIC_DEVICE}{k}")))
            .collect::<McapResult<_>>()?;
        let steps = channel::<StepRecord>(&mut writer, TOPIC_STEP)?;
        let text = "float64 time\nuint8 level\nstring text\n";
        let schema = writer.add_schema("palpa/Event", "ros1msg", text.as_bytes())?;
        let events = writer.add_channel(schema, TOPIC_EVENT, "ros1", &BTreeMap::new())?;
        let mut log = Self {
            writer,
            origin,
            ticks,
            devices,
            steps,
            events,
            sequence: 0,
            buffer: Vec::with_capacity(1024),
        };
        let header = json!({
            "format": FORMAT,
            "started_unix_ns": origin,
            "machine": params.machine.to_json(),
            "os": std::env::consts::OS,
            "period": servo.period,
            "n_devices": specs.len(),
            "scene": params.scene,
            "notes": params.notes,
        });
        log.buffer = header.to_string().into_bytes();
        log.write(header_channel, now)?;
        for (k, spec) in specs.iter().enumerate() {
            log.row(specs_channel, now, &SpecRecord::new(k, spec))?;
        }
        log.row(servo_channel, now, &ServoRecord::from(servo))?;
        log.flush()?;
        Ok(log)
    }

    fn tick(&mut self, entry: &TickEntry) -> McapResult<()> {
        self.row(self.ticks, entry.tick.now, &entry.tick)?;
        for k in 0..self.devices.len().min(entry.tick.n_devices as usize) {
            self.row(self.devices[k], entry.tick.now, &entry.devices[k])?;
        }
        Ok(())
    }

    fn row(&mut self, channel: u16, time: f64, record: &impl Record) -> McapResult<()> {
        self.buffer.clear();
        record.encode(&mut self.buffer);
        self.write(channel, time)
    }

    fn event(&mut self, event: &Event) -> McapResult<()> {
        let text = event.what.to_string();
        self.buffer.clear();
        self.buffer.extend_from_slice(&event.time.to_le_bytes());
        self.buffer.push(event.what.level() as u8);
        self.buffer
            .extend_from_slice(&(text.len() as u32).to_le_bytes());
        self.buffer.extend_from_slice(text.as_bytes());
        self.write(self.events, event.time)
    }

    fn write(&mut self, channel_id: u16, time: f64) -> McapResult<()> {
        let log_time = self.origin + (time * 1e9) as u64;
        self.sequence = self.sequence.wrapping_add(1);
        let header = MessageHeader {
            channel_id,
            sequence: self.sequence,
            log_time,
            publish_time: log_time,
        };
        self.writer.write_to_known_channel(&header, &self.buffer)
    }

    fn flush(&mut self) -> McapResult<()> {
        self.writer.flush()
    }

    fn close(mut self) -> McapResult<()> {
        self.writer.finish()?;
        // `finish` leaves the last bytes in the buffer; dropping the buffer would hide a write
        // error.
        Ok(self.writer.into_inner().flush()?)
    }
}

/// Version of the layout of logs.
pub(crate) const FORMAT: u64 = 4;

fn channel<R: Record>(writer: &mut Writer<BufWriter<File>>, topic: &str) -> McapResult<u16> {
    let schema = writer.add_schema(R::NAME, "ros1msg", R::schema().as_bytes())?;
    writer.add_channel(schema, topic, "ros1", &BTreeMap::new())
}

impl SpecRecord {
    fn new(device: usize, spec: &DeviceSpec) -> Self {
        Self {
            device: device as u32,
            max_force: spec.max_force,
            max_torque: spec.max_torque,
            max_slew: spec.max_slew,
            max_stiffness: spec.max_stiffness,
            max_damping: spec.max_damping,
        }
    }

    /// The limits in the form of the law.
    pub fn spec(&self) -> DeviceSpec {
        DeviceSpec {
            max_force: self.max_force,
            max_torque: self.max_torque,
            max_slew: self.max_slew,
            max_stiffness: self.max_stiffness,
            max_damping: self.max_damping,
        }
    }
}
