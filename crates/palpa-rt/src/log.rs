//! Reading logs back.

use crate::{
    event::Level,
    layout::Record,
    machine::Machine,
    record::{DeviceRecord, ServoRecord, SpecRecord, StepRecord, TickRecord},
    recorder::{
        EventRow, FORMAT, TOPIC_DEVICE, TOPIC_EVENT, TOPIC_HEADER, TOPIC_SERVO, TOPIC_SPEC,
        TOPIC_STEP, TOPIC_TICK,
    },
    servo_loop::TickEntry,
    smoothness::{ForceReport, ForceStats},
};
use mcap::{
    MAGIC, McapError, parse_record,
    records::Record as Mcap,
    sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions},
};
use palpa_servo::{DeviceSpec, MAX_TOOLS, ServoParams};
use std::{
    collections::BTreeMap,
    fmt,
    fs::File,
    io::{Read, Seek, SeekFrom},
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
    /// The log was written in a layout that this version does not read.
    #[error(
        "{}: {palpa} wrote it with {layout}; this version (palpa {}) can neither replay nor export it, the \
         version that wrote it can",
        path.display(),
        env!("CARGO_PKG_VERSION")
    )]
    Layout {
        /// The file.
        path: PathBuf,
        /// The difference, in words.
        layout: String,
        /// The version of Palpa that wrote it, as far as the log says.
        palpa: String,
    },
    /// A part with which every log begins is missing.
    #[error("{}: {what} is missing at its beginning, so it can be neither replayed nor exported", path.display())]
    Partial {
        /// The file.
        path: PathBuf,
        /// The missing part.
        what: String,
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
    /// The machine and the program that made the log. On another, a replay may differ.
    pub machine: Machine,
    /// Period of the loop, s.
    pub period: f64,
    /// Number of devices.
    pub n_devices: usize,
    /// The scene, as text.
    pub scene: String,
    /// Notes by name.
    pub notes: BTreeMap<String, String>,
}

impl Header {
    /// Reads the header of a log, and nothing else of it.
    ///
    /// # Errors
    /// [`LogError`]
    pub fn read(path: impl AsRef<Path>) -> Result<Self, LogError> {
        for row in Rows::open(path)? {
            if let Row::Header(header) = row? {
                return Ok(header);
            }
        }
        Ok(Self::default())
    }
}

/// The rows of a log, in the order in which they were written; each is read when requested.
pub struct Rows {
    path: PathBuf,
    file: File,
    reader: LinearReader,
    start: Start,
    ending: Ending,
    is_over: bool,
}

/// The beginning of a log, as far as it was read.
#[derive(Default)]
struct Start {
    schemas: BTreeMap<u16, (String, Vec<u8>)>,
    topics: BTreeMap<u16, Topic>,
    /// A record whose fields are not those of this version.
    foreign: Option<String>,
    /// The version of Palpa that wrote the log, in words.
    palpa: String,
    /// Number of devices, once the header was read.
    n_devices: Option<usize>,
    n_specs: usize,
    has_servo: bool,
}

/// Why a row cannot be given.
enum Refusal {
    Broken(String),
    Layout { layout: String, palpa: String },
    Partial(String),
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
            start: Start::default(),
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

    fn refused(&self, refusal: Refusal) -> LogError {
        let path = self.path.clone();
        match refusal {
            Refusal::Broken(reason) => self.broken(reason),
            Refusal::Layout { layout, palpa } => LogError::Layout {
                path,
                layout,
                palpa,
            },
            Refusal::Partial(what) => LogError::Partial { path, what },
        }
    }

    fn read_on(&mut self) -> Result<Option<Row>, LogError> {
        loop {
            let row = match self.reader.next_event() {
                None => {
                    self.ending = Ending::Whole;
                    return Ok(None);
                }
                Some(Err(error)) => {
                    let is_early = matches!(error, McapError::UnexpectedEof);
                    // A log that was closed is not cut off: a length in it is wrong.
                    return if is_early && (self.start.topics.is_empty() || !self.is_closed()) {
                        self.end_early()
                    } else {
                        self.end_damaged(&error)
                    };
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
                    match parse_record(opcode, data) {
                        Ok(record) => self.start.row(record),
                        Err(error) => return self.end_damaged(&error),
                    }
                }
            };
            match row {
                Ok(Some(row)) => return Ok(Some(row)),
                Ok(None) => {}
                Err(refusal) => return Err(self.refused(refusal)),
            }
        }
    }

    /// The rows before the damage are good.
    fn end_damaged(&mut self, error: &McapError) -> Result<Option<Row>, LogError> {
        if self.start.topics.is_empty() {
            return Err(self.broken(error.to_string()));
        }
        self.ending = Ending::Damaged(error.to_string());
        Ok(None)
    }

    /// Whether the file ends as one that was closed.
    fn is_closed(&self) -> bool {
        let mut last = [0; MAGIC.len()];
        let mut file = &self.file;
        let read = file.metadata().and_then(|about| {
            let from = about.len().saturating_sub(MAGIC.len() as u64);
            file.seek(SeekFrom::Start(from))?;
            file.read_exact(&mut last)
        });
        read.is_ok_and(|()| last == *MAGIC)
    }

    fn end_early(&self) -> Result<Option<Row>, LogError> {
        if self.start.topics.is_empty() {
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

impl Start {
    fn row(&mut self, record: Mcap<'_>) -> Result<Option<Row>, Refusal> {
        match record {
            Mcap::Schema { header, data } => {
                self.schemas
                    .insert(header.id, (header.name, data.into_owned()));
                Ok(None)
            }
            Mcap::Channel(channel) => {
                let topic = topic_of(&channel.topic);
                let of_log = self.schemas.get(&channel.schema_id);
                if let Some((name, fields)) = schema_of(topic)
                    && of_log.is_none_or(|(n, f)| n != name || *f != fields.as_bytes())
                {
                    self.foreign.get_or_insert(channel.topic);
                }
                self.topics.insert(channel.id, topic);
                Ok(None)
            }
            Mcap::Message { header, data } => {
                let topic = *self.topics.get(&header.channel_id).unwrap_or(&Topic::Other);
                let short = || {
                    let number = header.sequence;
                    Refusal::Broken(format!("message {number} on {topic:?} is too short"))
                };
                self.check(topic)?;
                Ok(Some(match topic {
                    Topic::Header => Row::Header(self.header(&data)?),
                    Topic::Spec => {
                        self.n_specs += 1;
                        Row::Spec(Record::decode(&data).ok_or_else(short)?)
                    }
                    Topic::Servo => {
                        self.has_servo = true;
                        Row::Servo(Record::decode(&data).ok_or_else(short)?)
                    }
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

    /// Refuses a row before the parts that it needs.
    fn check(&self, topic: Topic) -> Result<(), Refusal> {
        let missing = |what: &str| Err(Refusal::Partial(what.to_owned()));
        if matches!(topic, Topic::Header | Topic::Other) {
            return Ok(());
        }
        let Some(n_devices) = self.n_devices else {
            return missing("the header");
        };
        if let Some(topic) = &self.foreign {
            return Err(Refusal::Layout {
                layout: format!("other fields in {topic}"),
                palpa: self.palpa.clone(),
            });
        }
        if matches!(topic, Topic::Spec | Topic::Servo) {
            return Ok(());
        }
        if self.n_specs < n_devices {
            return missing(&format!("the limits of device {}", self.n_specs));
        }
        if !self.has_servo {
            return missing("the settings of the law");
        }
        Ok(())
    }

    fn header(&mut self, bytes: &[u8]) -> Result<Header, Refusal> {
        let json: serde_json::Value = serde_json::from_slice(bytes)
            .map_err(|e| Refusal::Broken(format!("its header: {e}")))?;
        let machine = Machine::from_json(&json["machine"]);
        // Older layouts have the version outside of the machine.
        let version = match machine.palpa.as_str() {
            "" => json["palpa"].as_str().unwrap_or("of an unknown version"),
            version => version,
        };
        self.palpa = format!("palpa {version}");
        let layout = match json["format"].as_u64() {
            Some(FORMAT) => None,
            Some(format) => Some(format!("layout {format} of logs instead of {FORMAT}")),
            None => Some(format!("no number of a layout instead of {FORMAT}")),
        };
        if let Some(layout) = layout {
            return Err(Refusal::Layout {
                layout,
                palpa: self.palpa.clone(),
            });
        }
        let missing = |key: &str| Refusal::Partial(format!("{key} of its header"));
        let period = (json["period"].as_f64())
            .filter(|period| *period > 0.0)
            .ok_or_else(|| missing("the period"))?;
        let n_devices = (json["n_devices"].as_u64())
            .filter(|n| *n <= MAX_TOOLS as u64)
            .ok_or_else(|| missing("the number of devices"))? as usize;
        let scene = (json["scene"].as_str()).ok_or_else(|| missing("the scene"))?;
        self.n_devices = Some(n_devices);
        let notes = json["notes"].as_object().into_iter().flatten();
        Ok(Header {
            machine,
            period,
            n_devices,
            scene: scene.to_owned(),
            notes: notes
                .map(|(k, v)| (k.clone(), v.as_str().unwrap_or_default().to_owned()))
                .collect(),
        })
    }
}

/// Name and fields of the records on a topic, in this version.
fn schema_of(topic: Topic) -> Option<(&'static str, String)> {
    fn of<R: Record>() -> (&'static str, String) {
        (R::NAME, R::schema())
    }
    match topic {
        Topic::Spec => Some(of::<SpecRecord>()),
        Topic::Servo => Some(of::<ServoRecord>()),
        Topic::Tick => Some(of::<TickRecord>()),
        Topic::Device(_) => Some(of::<DeviceRecord>()),
        Topic::Step => Some(of::<StepRecord>()),
        Topic::Header | Topic::Event | Topic::Other => None,
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
