//! Logs that were cut off, and logs as tables.

use crate::{
    devices::until,
    engine::{go_on, run},
    toy::Bed,
};
use palpa_rt::{Ending, Engine, Log, ReplayParams, Table, Verdict, export, replay};
use std::{fs, path::Path};

/// Runs until the log has grown so often on disk, as the recorder hands chunks to the system.
fn until_grown(engine: &mut Engine, path: &Path, times: usize) {
    let size = || fs::metadata(path).unwrap().len();
    for _ in 0..times {
        let before = size();
        until("the log grew", || size() > before);
    }
    go_on(engine, 1, 1, 0);
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
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let (_, log) = run(&path, Bed::new(), |engine, _| {
        until_grown(engine, &path, 6);
    });
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
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let (_, log) = run(&path, Bed::new(), |engine, _| {
        until_grown(engine, &path, 6);
    });
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
    let tables = export(&path, folder.path().join("csv"), Table::Csv).unwrap();
    assert_eq!(tables.ending, part.ending);
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

#[test]
fn tables_hold_the_same_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let (_, log) = run(&path, Bed::new(), |engine, _| go_on(engine, 400, 40, 2));
    let files = export(&path, folder.path().join("csv"), Table::Csv)
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
    let files = export(&path, folder.path().join("parquet"), Table::Parquet)
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
