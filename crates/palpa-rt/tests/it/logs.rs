//! Logs that were cut off, and logs as tables.

use crate::{
    devices::until,
    engine::{go_on, run},
    toy::Bed,
};
use mcap::records::MessageHeader;
use palpa_rt::{
    DeviceRecord, Ending, Engine, Felt, LEAD, Log, Machine, ReplayParams, Table, Verdict, export,
    replay,
};
use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};
use tempfile::TempDir;

/// Runs until the log has grown so often on disk, as the recorder hands chunks to the system.
fn until_grown(engine: &mut Engine, path: &Path, times: usize) {
    let size = || fs::metadata(path).unwrap().len();
    for _ in 0..times {
        let before = size();
        until("the log grew", || size() > before);
    }
    go_on(engine, 1, 1, 0);
}

/// A log of several chunks, in a folder that is removed with the first of these.
fn of_some_chunks() -> (TempDir, PathBuf, Log) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let (_, log) = run(&path, Bed::new(), |engine, _| {
        until_grown(engine, &path, 6);
    });
    (folder, path, log)
}

/// For each chunk of a whole log: the byte at which it ends, and the ticks up to there.
fn chunks(log: &[u8]) -> Vec<(usize, usize)> {
    let summary = mcap::Summary::read(log).unwrap().unwrap();
    let mut n_ticks = 0;
    let mut chunks = Vec::new();
    for index in &summary.chunk_indexes {
        n_ticks += (summary.stream_chunk(log, index).unwrap())
            .filter(|message| message.as_ref().unwrap().channel.topic == "/tick")
            .count();
        let end = index.chunk_start_offset + index.chunk_length;
        chunks.push((end as usize, n_ticks));
    }
    chunks
}

#[test]
fn a_log_that_was_cut_off_reads_up_to_its_last_chunk() {
    let (folder, path, log) = of_some_chunks();
    let bytes = fs::read(&path).unwrap();
    let chunks = chunks(&bytes);
    let in_chunks = chunks.last().map(|(_, ticks)| *ticks);
    assert!(
        chunks.len() > 3 && in_chunks == Some(log.ticks.len()),
        "{chunks:?}"
    );
    let cut = folder.path().join("cut.mcap");
    for share in [0.3, 0.5, 0.7, 0.9, 0.999] {
        let length = (bytes.len() as f64 * share) as usize;
        fs::write(&cut, &bytes[..length]).unwrap();
        let part = Log::open(&cut).unwrap();
        assert_ne!(part.ending, Ending::Whole);
        assert_eq!(part.header, log.header);
        let n = part.ticks.len();
        assert_eq!(part.ticks[..], log.ticks[..n]);
        assert_eq!(part.steps[..], log.steps[..part.steps.len()]);
        let whole = chunks.partition_point(|(end, _)| *end <= length);
        let ticks = |k: usize| chunks.get(k).map(|(_, ticks)| *ticks);
        let least = whole.checked_sub(1).and_then(ticks).unwrap_or(0);
        let most = ticks(whole).unwrap_or(log.ticks.len());
        assert!(
            (least..=most).contains(&n),
            "{n} ticks at {share}: {chunks:?}"
        );
        let again = replay(&part, Bed::new(), &ReplayParams::default());
        assert!(
            matches!(again.verdict, Verdict::Same | Verdict::Incomplete),
            "{again:?}"
        );
        assert!(again.first_force.is_none() && again.first_patch.is_none());
    }
    // Cut within the header there is nothing to read; that is an error with a reason.
    fs::write(&cut, &bytes[..20]).unwrap();
    assert!(Log::open(&cut).is_err());
    fs::write(&cut, b"this is no log").unwrap();
    assert!(
        Log::open(&cut)
            .unwrap_err()
            .to_string()
            .contains("cannot be read as a log")
    );
}

#[test]
fn a_damaged_log_says_so_and_reads_up_to_there() {
    let (folder, path, log) = of_some_chunks();
    let mut bytes = fs::read(&path).unwrap();
    // In the middle of a chunk that has others before and after it.
    let chunks = chunks(&bytes);
    let middle = usize::midpoint(chunks[1].0, chunks[2].0);
    for byte in &mut bytes[middle..middle + 40] {
        *byte ^= 0x5a;
    }
    fs::write(&path, &bytes).unwrap();
    let part = Log::open(&path).unwrap();
    assert!(
        matches!(part.ending, Ending::Damaged(_)),
        "{:?}",
        part.ending
    );
    let n = part.ticks.len();
    assert!(n > 0 && n < log.ticks.len(), "{n}");
    assert_eq!(part.ticks[..], log.ticks[..n]);
    let tables = export(&path, folder.path().join("csv"), Table::Csv, |_| None).unwrap();
    assert_eq!(tables.ending, part.ending);
}

/// A wrong length, or a record that is none, in a log that was closed.
#[test]
fn a_log_with_one_wrong_byte_is_damaged_and_not_cut_off() {
    let (_folder, path, log) = of_some_chunks();
    let bytes = fs::read(&path).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let start = summary.chunk_indexes[2].chunk_start_offset as usize;
    let end = start + summary.chunk_indexes[2].chunk_length as usize;
    // Records begin with a byte for their kind and eight for their length. After a chunk comes its index.
    for (at, change) in [(start + 1 + 3, 1), (end + 1, 3)] {
        let mut changed = bytes.clone();
        changed[at] ^= change;
        fs::write(&path, &changed).unwrap();
        let part = Log::open(&path).unwrap();
        let ending = &part.ending;
        assert!(matches!(ending, Ending::Damaged(_)), "{at}: {ending:?}");
        let n = part.ticks.len();
        assert!(n > 0 && n < log.ticks.len(), "{n}");
        assert_eq!(part.ticks[..], log.ticks[..n]);
    }
}

#[test]
fn what_was_flushed_is_there_while_the_engine_runs() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    run(&path, Bed::new(), |engine, _| {
        // As after a kill: the file as it is at this moment, whatever is still in memory. Nothing
        // waits for the end.
        for _ in 0..3 {
            let now = engine.snapshot().tick.tick.tick;
            until("what was done by now is on disk", || {
                let log = Log::open(&path).unwrap();
                assert_ne!(log.ending, Ending::Whole);
                log.ticks.last().is_some_and(|last| last.tick.tick >= now)
            });
        }
    });
}

/// A copy of a log in which `change` alters, or leaves out, messages and the fields of records.
fn rewritten(
    log: &[u8],
    path: &Path,
    fields: impl Fn(&str, String) -> String,
    change: impl Fn(&str, Vec<u8>) -> Option<Vec<u8>>,
) {
    let file = fs::File::create(path).unwrap();
    let mut writer = mcap::WriteOptions::new()
        .compression(None)
        .create(file)
        .unwrap();
    let mut channels = BTreeMap::new();
    for message in mcap::MessageStream::new(log).unwrap() {
        let message = message.unwrap();
        let topic = message.channel.topic.clone();
        let id = *channels.entry(topic.clone()).or_insert_with(|| {
            let schema = message.channel.schema.as_ref().map_or(0, |schema| {
                let text = String::from_utf8(schema.data.to_vec()).unwrap();
                let text = fields(&topic, text);
                (writer.add_schema(&schema.name, &schema.encoding, text.as_bytes())).unwrap()
            });
            let encoding = &message.channel.message_encoding;
            (writer.add_channel(schema, &topic, encoding, &BTreeMap::new())).unwrap()
        });
        let Some(data) = change(&topic, message.data.to_vec()) else {
            continue;
        };
        let header = MessageHeader {
            channel_id: id,
            sequence: message.sequence,
            log_time: message.log_time,
            publish_time: message.publish_time,
        };
        writer.write_to_known_channel(&header, &data).unwrap();
    }
    writer.finish().unwrap();
}

/// A change of the header alone.
fn header(change: impl Fn(&mut serde_json::Value)) -> impl Fn(&str, Vec<u8>) -> Option<Vec<u8>> {
    move |topic, data| {
        if topic != "/header" {
            return Some(data);
        }
        let mut json = serde_json::from_slice(&data).unwrap();
        change(&mut json);
        Some(json.to_string().into_bytes())
    }
}

#[test]
fn logs_of_other_layouts_and_partial_logs_are_refused_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    run(&path, Bed::new(), |engine, _| go_on(engine, 50, 5, 0));
    let bytes = fs::read(&path).unwrap();
    let other = folder.path().join("other.mcap");
    let as_is = |_: &str, text: String| text;
    let refused = || {
        let why = Log::open(&other).unwrap_err().to_string();
        let tables = export(&other, folder.path().join("csv"), Table::Csv, |_| None);
        assert_eq!(tables.unwrap_err().to_string(), why);
        why
    };

    // An older layout has the version in another place.
    let old = header(|json| {
        *json = serde_json::json!({ "format": 2, "palpa": "0.0.9", "cpu": "x86_64 avx" });
    });
    rewritten(&bytes, &other, as_is, old);
    let why = refused();
    assert!(
        why.contains("palpa 0.0.9 wrote it with layout 2 of logs instead of 4"),
        "{why}"
    );
    assert!(why.contains("can neither replay nor export it"), "{why}");
    rewritten(
        &bytes,
        &other,
        as_is,
        header(|json| *json = serde_json::json!({})),
    );
    let why = refused();
    assert!(
        why.contains("palpa of an unknown version wrote it with no number of a layout"),
        "{why}"
    );
    // The same number, but a record has one field less: it is not read with the others shifted.
    let fewer = |topic: &str, text: String| match topic {
        "/tissue/step" => text
            .lines()
            .skip(1)
            .fold(String::new(), |t, line| t + line + "\n"),
        _ => text,
    };
    rewritten(&bytes, &other, fewer, |_, data| Some(data));
    let why = refused();
    assert!(why.contains("other fields in /tissue/step"), "{why}");

    // Parts that are missing.
    for (gone, said) in [
        ("/header", "the header is missing"),
        ("/spec", "the limits of device 0 is missing"),
        ("/servo", "the settings of the law is missing"),
    ] {
        rewritten(&bytes, &other, as_is, |topic, data| {
            (topic != gone).then_some(data)
        });
        let why = refused();
        assert!(why.contains(said), "{why}");
    }
    for (key, said) in [
        ("period", "the period of its header is missing"),
        (
            "n_devices",
            "the number of devices of its header is missing",
        ),
        ("scene", "the scene of its header is missing"),
    ] {
        let without = header(|json| {
            json.as_object_mut().unwrap().remove(key);
        });
        rewritten(&bytes, &other, as_is, without);
        let why = refused();
        assert!(why.contains(said), "{why}");
    }

    // A log that does not tell its machine is replayed, and that is said.
    let without = header(|json| {
        json.as_object_mut().unwrap().remove("machine");
    });
    rewritten(&bytes, &other, as_is, without);
    let log = Log::open(&other).unwrap();
    assert_eq!(log.header.machine, Machine::default());
    let again = replay(&log, Bed::new(), &ReplayParams::default());
    assert_eq!(again.verdict, Verdict::Same);
    let unknown = again.differences.iter().filter(|d| d.logged.is_empty());
    assert_eq!(unknown.count(), 3, "{:?}", again.differences);
    // Written out and read back as it is, it stays what it was.
    rewritten(&bytes, &other, as_is, |_, data| Some(data));
    assert_eq!(
        Log::open(&other).unwrap().header,
        Log::open(&path).unwrap().header
    );
}

#[test]
fn tables_hold_the_same_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let (_, log) = run(&path, Bed::new(), |engine, _| go_on(engine, 400, 40, 2));
    // Not known in the first ticks.
    let measure = |device: &DeviceRecord| {
        (device.tick > 200).then_some(Felt {
            depth: 1e-3 * device.position[2],
            place: [0.0, 0.25, device.position[2]],
        })
    };
    let files = export(&path, folder.path().join("csv"), Table::Csv, measure)
        .unwrap()
        .files;
    let names: Vec<_> = files
        .iter()
        .map(|f| f.file_name().unwrap().to_str().unwrap())
        .collect();
    assert_eq!(
        names,
        ["ticks.csv", "steps.csv", "device0.csv", "events.csv"]
    );
    let mut rows = csv::Reader::from_path(&files[2]).unwrap();
    let column = rows
        .headers()
        .unwrap()
        .iter()
        .position(|h| h == "force_z")
        .unwrap();
    let forces: Vec<f64> = rows
        .records()
        .map(|r| r.unwrap()[column].parse().unwrap())
        .collect();
    let want: Vec<f64> = log.ticks.iter().map(|e| e.devices[0].force[2]).collect();
    assert_eq!(forces, want);
    let mut rows = csv::Reader::from_path(&files[2]).unwrap();
    let names: Vec<String> = rows.headers().unwrap().iter().map(str::to_owned).collect();
    assert_eq!(names[..6], LEAD);
    assert_eq!(names[6], "tick");
    let mut n_measured = 0;
    for (row, entry) in rows.records().map(Result::unwrap).zip(&log.ticks) {
        let lead: Vec<Option<f64>> = row.iter().take(6).map(|c| c.parse().ok()).collect();
        let device = &entry.devices[0];
        let force = device.force.iter().map(|f| f * f).sum::<f64>().sqrt();
        assert_eq!((lead[0], lead[2]), (Some(entry.tick.now), Some(force)));
        if device.is_there && device.tick > 200 {
            let z = device.position[2];
            let wanted = [1e3 * (1e-3 * z), 0.0, 250.0, 1e3 * z].map(Some);
            assert_eq!([lead[1], lead[3], lead[4], lead[5]], wanted);
            n_measured += 1;
        } else {
            assert_eq!([lead[1], lead[3], lead[4], lead[5]], [None; 4]);
        }
    }
    assert!(n_measured > 0);
    let events = fs::read_to_string(&files[3]).unwrap();
    assert!(events.contains("info,haptic loop started"), "{events}");
}

#[cfg(feature = "parquet")]
#[test]
fn parquet_holds_the_same_bits() {
    use parquet::{
        file::reader::{FileReader, SerializedFileReader},
        record::RowAccessor,
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let (_, log) = run(&path, Bed::new(), |engine, _| go_on(engine, 400, 40, 2));
    let files = export(&path, folder.path().join("parquet"), Table::Parquet, |_| {
        None
    })
    .unwrap()
    .files;
    let steps = SerializedFileReader::new(fs::File::open(&files[1]).unwrap()).unwrap();
    let schema = steps.metadata().file_metadata().schema().clone();
    let column = |name: &str| {
        schema
            .get_fields()
            .iter()
            .position(|f| f.name() == name)
            .unwrap()
    };
    let (hash, energy, published) = (column("hash"), column("energy"), column("published"));
    let mut n = 0;
    for (row, want) in steps.get_row_iter(None).unwrap().zip(&log.steps) {
        let row = row.unwrap();
        assert_eq!(row.get_ulong(hash).unwrap(), want.hash);
        assert_eq!(
            row.get_double(energy).unwrap().to_bits(),
            want.energy.to_bits()
        );
        assert_eq!(row.get_bool(published).unwrap(), want.published);
        n += 1;
    }
    assert_eq!(n, log.steps.len());
}
