//! Reading logs back.

use crate::{
    event::Level,
    layout::Record,
    record::{DeviceRecord, ServoRecord, SpecRecord, StepRecord, TickRecord},
    recorder::{
        EventRow, FORMAT, TOPIC_DEVICE, TOPIC_EVENT, TOPIC_HEADER, TOPIC_SERVO, TOPIC_SPEC,
        TOPIC_STEP, TOPIC_TICK,
    },
    servo_loop::TickEntry,
    smoothness::{ForceReport, ForceStats},
};
use mcap::{
    McapError, parse_record,
    records::Record as Mcap,
    sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions},
};
use palpa_servo::{DeviceSpec, MAX_TOOLS, ServoParams};
use std::{
    collections::BTreeMap,
    fmt,
    fs::File,
    io::Read,
    path::{Path, PathBuf},
};

/// Why a log cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LogError {
    /// The file cannot be opened or read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The file is not an MCAP file, or it is damaged before the first record.
    #[error("{}: cannot be read as a log: {reason}; logs are MCAP files as `palpa loop-report` writes them", path.display())]
    Broken {
        /// The file.
        path: PathBuf,
        /// What is damaged.
        reason: String,
    },
}

/// A row of a log.
#[derive(Debug, Clone, PartialEq)]
pub enum Row {
    /// Header of the log.
    Header(Header),
    /// A device and its limits.
    Spec(SpecRecord),
    /// Settings of the law.
    Servo(ServoRecord),
    /// A tick.
    Tick(TickRecord),
    /// A device in the preceding tick.
    Device(usize, DeviceRecord),
    /// A step of the tissue.
    Step(StepRecord),
    /// An event.
    Event(EventRow),
}

/// Header of a log.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Header {
    /// Version of palpa.
    pub palpa: String,
    /// Features of the processor. On a processor with other features, a replay may differ in the
    /// last bits.
    pub cpu: String,
    /// Period of the loop, s.
    pub period: f64,
    /// The scene, as text.
    pub scene: String,
    /// Notes by name.
    pub notes: BTreeMap<String, String>,
}

/// The rows of a log, in the order in which they were written; each is read when requested.
pub struct Rows {
    path: PathBuf,
    file: File,
    reader: LinearReader,
    topics: BTreeMap<u16, Topic>,
    ending: Ending,
    is_over: bool,
}

/// How a log ends.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum Ending {
    /// The log was closed properly.
    Whole,
    /// The log ends with its last complete chunk, as after a crash.
    #[default]
    CutOff,
    /// There is more, but it cannot be read; holds the reason.
    Damaged(String),
}

/// A whole log in memory.
#[derive(Debug, Clone, Default)]
pub struct Log {
    /// Header of the log.
    pub header: Header,
    /// Limits of each device.
    pub specs: Vec<DeviceSpec>,
    /// Settings of the law.
    pub servo: ServoParams,
    /// The ticks with their devices.
    pub ticks: Vec<TickEntry>,
    /// The tissue's steps.
    pub steps: Vec<StepRecord>,
    /// The events.
    pub events: Vec<EventRow>,
    /// How the log ends.
    pub ending: Ending,
}

#[derive(Debug, Clone, Copy)]
enum Topic {
    Header,
    Spec,
    Servo,
    Tick,
    Device(usize),
    Step,
    Event,
    Other,
}

impl Log {
    /// Reads a log into memory: about 0.5 MB per second of recording.
    ///
    /// # Errors
    /// [`LogError`]; a log that ends too early is not an error.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, LogError> {
        let mut log = Self::default();
        let mut rows = Rows::open(path)?;
        for row in &mut rows {
            match row? {
                Row::Header(header) => log.header = header,
                Row::Spec(spec) => log.specs.push(spec.spec()),
                Row::Servo(servo) => log.servo = (&servo).into(),
                Row::Tick(tick) => log.ticks.push(TickEntry {
                    tick,
                    ..TickEntry::default()
                }),
                Row::Device(k, device) => {
                    if let Some(entry) = log.ticks.last_mut().filter(|e| e.tick.tick == device.tick)
                        && let Some(place) = entry.devices.get_mut(k)
                    {
                        *place = device;
                    }
                }
                Row::Step(step) => log.steps.push(step),
                Row::Event(event) => log.events.push(event),
            }
        }
        log.ending = rows.ending;
        Ok(log)
    }

    /// Smoothness and energy of each device's force.
    pub fn forces(&self) -> Vec<ForceReport> {
        (0..self.specs.len())
            .map(|k| {
                let mut stats = ForceStats::new(self.header.period);
                for entry in &self.ticks {
                    stats.add(entry, k);
                }
                stats.report()
            })
            .collect()
    }
}

impl Rows {
    /// Opens a log.
    ///
    /// # Errors
    /// [`LogError::Io`] if there is no such file.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, LogError> {
        let path = path.as_ref().to_owned();
        let file = File::open(&path).map_err(|source| LogError::Io {
            path: path.clone(),
            source,
        })?;
        // A chunk is checked before any of it is used, so an incomplete chunk is left out as a
        // whole.
        let options = LinearReaderOptions::default()
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(1 << 30);
        Ok(Self {
            path,
            file,
            reader: LinearReader::new_with_options(options),
            topics: BTreeMap::new(),
            ending: Ending::CutOff,
            is_over: false,
        })
    }

    /// How the log ends; known after the last row was read.
    pub fn ending(&self) -> &Ending {
        &self.ending
    }

    fn broken(&self, reason: impl Into<String>) -> LogError {
        LogError::Broken {
            path: self.path.clone(),
            reason: reason.into(),
        }
    }

    fn read_on(&mut self) -> Result<Option<Row>, LogError> {
        loop {
            let row = match self.reader.next_event() {
                None => {
                    self.ending = Ending::Whole;
                    return Ok(None);
                }
                Some(Err(McapError::UnexpectedEof)) => return self.end_early(),
                Some(Err(error)) => {
                    if self.topics.is_empty() {
                        return Err(self.broken(error.to_string()));
                    }
                    // The rows before the damage are good.
                    self.ending = Ending::Damaged(error.to_string());
                    return Ok(None);
                }
                Some(Ok(LinearReadEvent::ReadRequest(n))) => {
                    let read = self.file.read(self.reader.insert(n));
                    let n = read.map_err(|source| LogError::Io {
                        path: self.path.clone(),
                        source,
                    })?;
                    self.reader.notify_read(n);
                    continue;
                }
                Some(Ok(LinearReadEvent::Record { data, opcode })) => {
                    let record = parse_record(opcode, data).map_err(|e| e.to_string());
                    row_of(&mut self.topics, record)
                }
            };
            match row {
                Ok(Some(row)) => return Ok(Some(row)),
                Ok(None) => {}
                Err(reason) => return Err(self.broken(reason)),
            }
        }
    }

    fn end_early(&self) -> Result<Option<Row>, LogError> {
        if self.topics.is_empty() {
            return Err(self.broken("it ends before its first channel"));
        }
        Ok(None)
    }
}

impl fmt::Debug for Rows {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Rows")
            .field("path", &self.path)
            .finish_non_exhaustive()
    }
}

impl Iterator for Rows {
    type Item = Result<Row, LogError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.is_over {
            return None;
        }
        let row = self.read_on().transpose();
        self.is_over = !matches!(row, Some(Ok(_)));
        row
    }
}

fn row_of(
    topics: &mut BTreeMap<u16, Topic>,
    record: Result<Mcap<'_>, String>,
) -> Result<Option<Row>, String> {
    match record? {
        Mcap::Channel(channel) => {
            topics.insert(channel.id, topic_of(&channel.topic));
            Ok(None)
        }
        Mcap::Message { header, data } => {
            let topic = *topics.get(&header.channel_id).unwrap_or(&Topic::Other);
            let short = || format!("message {} on {topic:?} is too short", header.sequence);
            Ok(Some(match topic {
                Topic::Header => Row::Header(header_of(&data)?),
                Topic::Spec => Row::Spec(Record::decode(&data).ok_or_else(short)?),
                Topic::Servo => Row::Servo(Record::decode(&data).ok_or_else(short)?),
                Topic::Tick => Row::Tick(Record::decode(&data).ok_or_else(short)?),
                Topic::Device(k) => Row::Device(k, Record::decode(&data).ok_or_else(short)?),
                Topic::Step => Row::Step(Record::decode(&data).ok_or_else(short)?),
                Topic::Event => Row::Event(event_of(&data).ok_or_else(short)?),
                Topic::Other => return Ok(None),
            }))
        }
        _ => Ok(None),
    }
}

fn topic_of(name: &str) -> Topic {
    match name {
        TOPIC_HEADER => Topic::Header,
        TOPIC_SPEC => Topic::Spec,
        TOPIC_SERVO => Topic::Servo,
        TOPIC_TICK => Topic::Tick,
        TOPIC_STEP => Topic::Step,
        TOPIC_EVENT => Topic::Event,
        _ => (name.strip_prefix(TOPIC_DEVICE))
            .and_then(|k| k.parse().ok())
            .filter(|k| *k < MAX_TOOLS)
            .map_or(Topic::Other, Topic::Device),
    }
}

fn header_of(bytes: &[u8]) -> Result<Header, String> {
    let json: serde_json::Value =
        serde_json::from_slice(bytes).map_err(|e| format!("header: {e}"))?;
    let format = json["format"].as_u64().unwrap_or(0);
    if format != FORMAT {
        return Err(format!(
            "header: layout {format}, this version reads {FORMAT}"
        ));
    }
    let text = |key: &str| json[key].as_str().unwrap_or_default().to_owned();
    let notes = json["notes"].as_object().into_iter().flatten();
    Ok(Header {
        palpa: text("palpa"),
        cpu: text("cpu"),
        period: json["period"].as_f64().unwrap_or_default(),
        scene: text("scene"),
        notes: notes
            .map(|(k, v)| (k.clone(), v.as_str().unwrap_or_default().to_owned()))
            .collect(),
    })
}

fn event_of(mut bytes: &[u8]) -> Option<EventRow> {
    use crate::layout::Field;
    let time = f64::get(&mut bytes)?;
    let level = match u8::get(&mut bytes)? {
        0 => Level::Info,
        1 => Level::Warning,
        _ => Level::Error,
    };
    let n = u32::get(&mut bytes)? as usize;
    let text = String::from_utf8_lossy(bytes.get(..n)?).into_owned();
    Some(EventRow { time, level, text })
}
