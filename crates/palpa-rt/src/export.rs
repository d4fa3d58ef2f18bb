//! Export of logs as tables: one file per channel, one column per number.
//!
//! The tables of devices begin with [`LEAD`]: what most readers look for. Depth and place need the
//! skin at rest, which this crate does not know; the caller measures them.

#[cfg(feature = "parquet")]
mod parquet;

use crate::{
    layout::{Record, Value},
    log::{Ending, LogError, Row, Rows},
    record::{DeviceRecord, StepRecord, TickRecord},
    recorder::EventRow,
};
use palpa_servo::MAX_TOOLS;
use std::{
    fs::File,
    io,
    path::{Path, PathBuf},
};

/// The first columns of the table of a device: time since the start of the log, depth of the tool
/// below the skin at rest, size of the commanded force, and the nearest place of the skin at rest in
/// the scene's frame. Depth and place are empty (in Parquet: NaN) where they are not known.
pub const LEAD: [&str; 6] = [
    "time_s",
    "depth_mm",
    "force_n",
    "place_x_mm",
    "place_y_mm",
    "place_z_mm",
];

/// Where a tool is, measured by the skin at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Felt {
    /// Depth below the skin along its normal at `place`, m; negative above the skin.
    pub depth: f64,
    /// The nearest place of the skin at rest, scene's frame, m.
    pub place: [f64; 3],
}

/// Format of table files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Table {
    /// Comma-separated text; real numbers have enough digits to be read back bit for bit.
    Csv,
    /// Apache Parquet, compressed with Snappy. Needs the feature `parquet`.
    #[cfg(feature = "parquet")]
    Parquet,
}

/// Why a log could not be exported.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// The log cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// A table cannot be written.
    #[error("{}: cannot be written: {reason}", path.display())]
    Write {
        /// The table.
        path: PathBuf,
        /// The reason.
        reason: String,
    },
}

/// The exported tables of a log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Exported {
    /// The files: ticks, steps, a table for each device, and events.
    pub files: Vec<PathBuf>,
    /// How the log, and with it the tables, ended.
    pub ending: Ending,
}

/// Writes a log as tables `ticks`, `device0`…, `steps` and `events.csv` (always text) into a
/// folder. The folder is created if needed. The log is read in parts, so memory does not grow with
/// its length. `measure` says where the tool of a device is, or `None` if that is not known.
///
/// # Errors
/// [`ExportError`]
pub fn export(
    log: impl AsRef<Path>,
    folder: impl AsRef<Path>,
    table: Table,
    measure: impl Fn(&DeviceRecord) -> Option<Felt>,
) -> Result<Exported, ExportError> {
    let folder = folder.as_ref();
    let mut rows = Rows::open(log)?;
    std::fs::create_dir_all(folder).map_err(|e| failed(folder, &e))?;
    let mut ticks = Sink::new::<TickRecord>(folder, "ticks", table, &[])?;
    let mut devices: [Option<Sink>; MAX_TOOLS] = Default::default();
    let mut steps = Sink::new::<StepRecord>(folder, "steps", table, &[])?;
    let mut now = f64::NAN;
    let events_path = folder.join("events.csv");
    let mut events = csv::Writer::from_path(&events_path).map_err(|e| failed(&events_path, &e))?;
    (events.write_record(["time", "level", "text"])).map_err(|e| failed(&events_path, &e))?;
    for row in &mut rows {
        match row? {
            Row::Tick(tick) => {
                now = tick.now;
                ticks.add(&[], &tick)?;
            }
            Row::Step(step) => steps.add(&[], &step)?,
            Row::Device(k, device) => {
                let Some(place) = devices.get_mut(k) else {
                    continue;
                };
                let sink = match place {
                    Some(sink) => sink,
                    None => place.insert(Sink::new::<DeviceRecord>(
                        folder,
                        &format!("device{k}"),
                        table,
                        &LEAD,
                    )?),
                };
                let felt = Some(&device).filter(|d| d.is_there).and_then(&measure);
                sink.add(&lead(now, &device, felt), &device)?;
            }
            Row::Event(EventRow { time, level, text }) => {
                let level = format!("{level:?}").to_lowercase();
                (events.write_record([&time.to_string(), &level, &text]))
                    .map_err(|e| failed(&events_path, &e))?;
            }
            Row::Header(_) | Row::Spec(_) | Row::Servo(_) => {}
        }
    }
    events.flush().map_err(|e| failed(&events_path, &e))?;
    let mut files = Vec::new();
    for sink in [ticks, steps]
        .into_iter()
        .chain(devices.into_iter().flatten())
    {
        files.push(sink.finish()?);
    }
    files.push(events_path);
    let ending = rows.ending().clone();
    Ok(Exported { files, ending })
}

/// The values of [`LEAD`].
fn lead(now: f64, device: &DeviceRecord, felt: Option<Felt>) -> [f64; 6] {
    let [x, y, z] = device.force;
    let force = (x * x + y * y + z * z).sqrt();
    let unknown = Felt {
        depth: f64::NAN,
        place: [f64::NAN; 3],
    };
    let Felt { depth, place } = felt.unwrap_or(unknown);
    let [px, py, pz] = place.map(|p| 1e3 * p);
    [now, 1e3 * depth, force, px, py, pz]
}

/// A table being written.
struct Sink {
    path: PathBuf,
    values: Vec<Value>,
    file: TableFile,
}

enum TableFile {
    Csv(Box<csv::Writer<File>>),
    #[cfg(feature = "parquet")]
    Parquet(Box<parquet::ParquetTable>),
}

impl Sink {
    /// `lead` are names of columns before those of the record.
    fn new<R: Record>(
        folder: &Path,
        name: &str,
        table: Table,
        lead: &[&str],
    ) -> Result<Self, ExportError> {
        let (path, file) = match table {
            Table::Csv => {
                let path = folder.join(format!("{name}.csv"));
                let mut writer = csv::Writer::from_path(&path).map_err(|e| failed(&path, &e))?;
                let lead = lead.iter().map(|&name| name.to_owned());
                writer
                    .write_record(lead.chain(R::columns()))
                    .map_err(|e| failed(&path, &e))?;
                (path, TableFile::Csv(Box::new(writer)))
            }
            #[cfg(feature = "parquet")]
            Table::Parquet => {
                let path = folder.join(format!("{name}.parquet"));
                let writer = parquet::ParquetTable::create::<R>(&path, lead)
                    .map_err(|e| failed(&path, &e))?;
                (path, TableFile::Parquet(Box::new(writer)))
            }
        };
        Ok(Self {
            path,
            values: Vec::new(),
            file,
        })
    }

    fn add(&mut self, lead: &[f64], record: &impl Record) -> Result<(), ExportError> {
        self.values.clear();
        self.values.extend(lead.iter().map(|&v| Value::F64(v)));
        record.values(&mut self.values);
        let result = match &mut self.file {
            TableFile::Csv(writer) => {
                let texts = self
                    .values
                    .iter()
                    .enumerate()
                    .map(|(k, value)| match value {
                        Value::F64(v) if k < lead.len() && v.is_nan() => String::new(),
                        Value::F64(v) => v.to_string(),
                        Value::U64(v) => v.to_string(),
                        Value::Bool(v) => v.to_string(),
                    });
                writer.write_record(texts).map_err(|e| e.to_string())
            }
            #[cfg(feature = "parquet")]
            TableFile::Parquet(writer) => writer.add(&self.values).map_err(|e| e.to_string()),
        };
        result.map_err(|reason| failed(&self.path, &reason))
    }

    fn finish(self) -> Result<PathBuf, ExportError> {
        let result = match self.file {
            TableFile::Csv(mut writer) => writer.flush().map_err(|e: io::Error| e.to_string()),
            #[cfg(feature = "parquet")]
            TableFile::Parquet(writer) => writer.finish().map_err(|e| e.to_string()),
        };
        result.map_err(|reason| failed(&self.path, &reason))?;
        Ok(self.path)
    }
}

fn failed(path: &Path, reason: &impl ToString) -> ExportError {
    ExportError::Write {
        path: path.to_owned(),
        reason: reason.to_string(),
    }
}
