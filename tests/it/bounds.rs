//! Memory of readers: how many bytes more a log takes for each byte that its file is longer, at the peak of reading and analyzing it.

use crate::live_log::demonstration;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use teachtree::{Log, Rules};
use teachtree_base::recording::Recording;
use teachtree_logs::read::formats;

/// A demonstration to its end and back again, so often.
fn repeated(times: usize) -> Recording {
    let mut recording = demonstration("push");
    recording.labels.clear();
    recording.events.clear();
    let (rows, step) = (recording.time.len(), recording.time[1] - recording.time[0]);
    let order: Vec<usize> = (0..times).flat_map(|_| (0..rows).chain((0..rows).rev())).collect();
    recording.time = (0..order.len()).map(|row| row as f64 * step).collect();
    for column in recording.columns.values_mut() {
        column.values = order.iter().map(|row| column.values[*row]).collect();
    }
    recording
}

/// Each row with its values in the order of the columns.
fn rows(recording: &Recording) -> impl Iterator<Item = Vec<f64>> {
    let row = |at: usize| recording.columns.values().map(|column| column.values[at]).collect::<Vec<_>>();
    recording.time.iter().enumerate().map(move |(at, time)| [vec![*time], row(at)].concat())
}

fn names(recording: &Recording) -> Vec<&str> {
    std::iter::once("time").chain(recording.columns.keys().map(String::as_str)).collect()
}

fn lines(recording: &Recording) -> Vec<u8> {
    let names = names(recording);
    let mut text = String::new();
    for row in rows(recording) {
        let cells: Vec<String> = names.iter().zip(&row).map(|(name, value)| format!("\"{name}\":{value}")).collect();
        let _ = writeln!(text, "{{{}}}", cells.join(","));
    }
    text.into_bytes()
}

/// An array with named fields.
fn npy(recording: &Recording) -> Vec<u8> {
    let fields: Vec<String> = names(recording).iter().map(|name| format!("('{name}', '<f8')")).collect();
    let (fields, rows_count) = (fields.join(", "), recording.time.len());
    let head = format!("{{'descr': [{fields}], 'fortran_order': False, 'shape': ({rows_count},), }}\n");
    let mut bytes = b"\x93NUMPY\x02\x00".to_vec();
    bytes.extend((head.len() as u32).to_le_bytes());
    bytes.extend(head.bytes());
    bytes.extend(rows(recording).flatten().flat_map(f64::to_le_bytes));
    bytes
}

/// The file of a recording in a format, and how long it is.
fn written(folder: &Path, file: &str, recording: &Recording) -> (PathBuf, u64) {
    let path = folder.join(file);
    match path.extension().and_then(|it| it.to_str()) {
        Some("jsonl") => std::fs::write(&path, lines(recording)).unwrap(),
        Some("npy") => std::fs::write(&path, npy(recording)).unwrap(),
        _ => formats::write(recording, &path).unwrap(),
    }
    let length = path.metadata().unwrap().len();
    (path, length)
}

/// The most bytes that are held at a time while a log is analyzed, after it was read into memory or in windows.
fn peak(path: &Path, scene: &Path, in_memory: bool) -> u64 {
    let used = allocation_counter::measure(|| {
        let is_alone = path.extension().is_some_and(|it| it == "csv" || it == "parquet");
        let options = if is_alone { Log::options() } else { Log::options().scene(scene) };
        let log = options.open(path).unwrap();
        if in_memory {
            log.read().unwrap();
        }
        let analysis = Rules::for_log(&log).unwrap().analyze(&log).unwrap();
        assert!(!analysis.tasks().is_empty());
    });
    used.bytes_max
}

/// The bounds of docs/measurements/reliability.md.
#[test]
fn memory_of_readers_is_a_multiple_of_their_input() {
    let folder = tempfile::tempdir().unwrap();
    let [short, long] = [repeated(2), repeated(6)];
    let (plain, _) = written(folder.path(), "plain.csv", &short);
    let scene = plain.with_file_name("plain.scene.yaml");
    // A file, whether it is read into memory, and the bytes that a byte of it may take.
    let cases = [
        ("log.csv", false, 0.5),
        ("log.csv", true, 8.0),
        ("log.parquet", false, 16.0),
        ("log.parquet", true, 64.0),
        ("log.jsonl", true, 4.0),
        ("log.npy", true, 8.0),
    ];
    let mut beyond = vec![];
    for (file, in_memory, most) in cases {
        let of = |recording: &Recording| {
            let (path, length) = written(folder.path(), file, recording);
            (peak(&path, &scene, in_memory), length)
        };
        let ((low, from), (high, to)) = (of(&short), of(&long));
        let each = (high as f64 - low as f64) / (to - from) as f64;
        let how = if in_memory { "in memory" } else { "in windows" };
        let rows = long.time.len();
        let _ = writeln!(
            std::io::stderr(),
            "{file} {how}: {each:.2} bytes a byte, {:.2} MB at the peak for {:.2} MB of {rows} rows",
            high as f64 / 1e6,
            to as f64 / 1e6
        );
        if each > most {
            beyond.push(format!("{file} {how}: {each:.2} bytes a byte, at most {most}"));
        }
    }
    assert!(beyond.is_empty(), "{beyond:#?}");
}
