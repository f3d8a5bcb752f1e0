//! What docs/logs.md and docs/bindings.md promise of logs holds in every format to which it applies: one log with one property, written in each format.

use super::super::ask;
use crate::shared::bags;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use teachtree_base::recording::{Column, Recording};
use teachtree_base::units::Dimension;
use teachtree_frames::{OpenRequest, open};
use teachtree_logs::read::formats;

/// The columns of a log, each with a value a row; the first one is `time`.
type Columns = Vec<(&'static str, Vec<f64>)>;

/// The rate of the log, Hz, and its rows.
const RATE: f64 = 50.0;
const ROWS: usize = 100;

/// A hand above a cube, which it carries.
fn log() -> Columns {
    let rows = || (0..ROWS).map(|row| row as f64);
    let column = |value: &dyn Fn(f64) -> f64| rows().map(value).collect::<Vec<f64>>();
    vec![
        ("time", column(&|row| row / RATE)),
        ("x", column(&|row| 0.1 + 0.002 * row)),
        ("y", column(&|row| 0.2 + 0.001 * row)),
        ("z", column(&|row| 0.3 + 0.0005 * row)),
        ("cx", column(&|row| 0.1 + 0.002 * row)),
        ("cy", column(&|row| 0.25 + 0.001 * row)),
        ("cz", column(&|row| 0.3 + 0.0005 * row)),
        ("width", column(&|row| 0.04 + 0.0001 * row)),
    ]
}

const CHANNELS: &str = "channels: {right.thumb.position: [@x, @y, @z], right.gripper.opening: @width, right.gripper.closed: \"@width [m] < 45 mm\", cube.position: [@cx, @cy, @cz]}\n";
const SCENE: &str = "scene: {bodies: {cube: {role: object, radius: 20 mm}}, hands: {right: {fingers: [thumb]}}}\n";

/// A way to write a log.
struct Writer {
    name: &'static str,
    /// What stands for `@` before the names of columns in a binding.
    prefix: &'static str,
    write: fn(&Columns, &Path) -> PathBuf,
}

const WRITERS: [Writer; 9] = [
    Writer { name: "CSV", prefix: "", write: |log, folder| text(log, folder, "log.csv", ",", ".") },
    Writer { name: "decimal commas", prefix: "", write: |log, folder| text(log, folder, "log.csv", ";", ",") },
    Writer { name: "blanks", prefix: "", write: |log, folder| text(log, folder, "log.txt", " ", ".") },
    Writer { name: "JSON lines", prefix: "", write: json_lines },
    Writer { name: "Parquet", prefix: "", write: parquet },
    Writer { name: "NPY", prefix: "", write: npy },
    Writer { name: "HDF5", prefix: "", write: hdf5 },
    Writer { name: "Zarr", prefix: "", write: zarr },
    Writer { name: "MCAP", prefix: "/log.", write: mcap },
];

fn rows(log: &Columns) -> usize {
    log[0].1.len()
}

fn text(log: &Columns, folder: &Path, name: &str, delimiter: &str, point: &str) -> PathBuf {
    let path = folder.join(name);
    let mut text = log.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(delimiter) + "\n";
    for row in 0..rows(log) {
        let cell = |value: f64| if value.is_nan() { "nan".into() } else { value.to_string().replace('.', point) };
        let cells: Vec<String> = log.iter().map(|(_, values)| cell(values[row])).collect();
        writeln!(text, "{}", cells.join(delimiter)).unwrap();
    }
    std::fs::write(&path, text).unwrap();
    path
}

/// The objects of a log: stamps, s, and JSON. What was not measured is left out.
fn objects(log: &Columns) -> impl Iterator<Item = (f64, String)> {
    (0..rows(log)).map(|row| {
        let measured = log.iter().filter(|(_, values)| !values[row].is_nan());
        let object: serde_json::Map<String, serde_json::Value> =
            measured.map(|(name, values)| ((*name).to_string(), values[row].into())).collect();
        (log[0].1[row], serde_json::Value::Object(object).to_string())
    })
}

fn json_lines(log: &Columns, folder: &Path) -> PathBuf {
    let path = folder.join("log.jsonl");
    std::fs::write(&path, objects(log).map(|(_, object)| object + "\n").collect::<String>()).unwrap();
    path
}

fn parquet(log: &Columns, folder: &Path) -> PathBuf {
    let path = folder.join("log.parquet");
    let columns = log
        .iter()
        .skip(1)
        .map(|(name, values)| ((*name).to_string(), Column { dimension: Dimension::NONE, values: values.clone() }));
    let recording = Recording { time: log[0].1.clone(), columns: columns.collect(), ..Recording::default() };
    formats::write(&recording, &path).unwrap();
    path
}

/// A structured array.
fn npy(log: &Columns, folder: &Path) -> PathBuf {
    let path = folder.join("log.npy");
    let fields: Vec<String> = log.iter().map(|(name, _)| format!("('{name}', '<f8')")).collect();
    let mut header =
        format!("{{'descr': [{}], 'fortran_order': False, 'shape': ({},), }}", fields.join(", "), rows(log));
    while (header.len() + 13) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x02\x00".to_vec();
    bytes.extend((header.len() as u32).to_le_bytes());
    bytes.extend(header.bytes());
    bytes.extend((0..rows(log)).flat_map(|row| log.iter().flat_map(move |(_, values)| values[row].to_le_bytes())));
    std::fs::write(&path, bytes).unwrap();
    path
}

fn hdf5(log: &Columns, folder: &Path) -> PathBuf {
    let path = folder.join("log.hdf5");
    let mut builder = hdf5_pure::FileBuilder::new();
    let mut data = builder.create_group("data");
    let mut demo = data.create_group("demo_0");
    for (name, values) in log {
        demo.create_dataset(name).with_f64_data(values);
    }
    data.add_group(demo.finish());
    builder.add_group(data.finish());
    std::fs::write(&path, builder.finish().unwrap()).unwrap();
    path
}

/// A store of version 2 with one chunk an array.
fn zarr(log: &Columns, folder: &Path) -> PathBuf {
    let path = folder.join("log.zarr");
    std::fs::create_dir(&path).unwrap();
    std::fs::write(path.join(".zgroup"), r#"{"zarr_format": 2}"#).unwrap();
    for (name, values) in log {
        let (array, rows) = (path.join(name), values.len());
        std::fs::create_dir(&array).unwrap();
        let described = format!(
            r#"{{"zarr_format": 2, "shape": [{rows}], "chunks": [{rows}], "dtype": "<f8", "compressor": null, "filters": null, "order": "C", "fill_value": 0.0}}"#
        );
        std::fs::write(array.join(".zarray"), described).unwrap();
        std::fs::write(array.join("0"), values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>())
            .unwrap();
    }
    path
}

/// Messages of JSON whose time of recording is the stamp.
fn mcap(log: &Columns, folder: &Path) -> PathBuf {
    let path = folder.join("log.mcap");
    let messages = objects(log).map(|(time, object)| (time, object.into_bytes())).collect();
    bags::write(&path, None, &[("/log", "json", "", "", messages)]);
    path
}

/// What becomes of a log: the message why it is refused; else its rate, the kinds of its issues, and some values of the cube.
fn outcome(writer: &Writer, log: &Columns, binding: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = (writer.write)(log, folder.path());
    // The stamps of messages need no column.
    let binding = binding.replace('@', writer.prefix);
    let binding_file = folder.path().join("b.yaml");
    std::fs::write(&binding_file, format!("{binding}{SCENE}")).unwrap();
    let request = OpenRequest { log: path, binding: Some(binding_file), ..OpenRequest::default() };
    let opened = match open(&request).and_then(|opened| Ok((opened.frames(&[ask("target")])?, opened))) {
        Ok((frames, opened)) => (frames, opened),
        Err(error) => {
            return format!("error: {}{}", error.message, error.help.map_or(String::new(), |help| format!("; {help}")));
        }
    };
    let (frames, opened) = opened;
    let mut kinds: Vec<&str> = frames.issues.iter().map(|issue| issue.kind.name()).collect();
    kinds.sort_unstable();
    kinds.dedup();
    kinds.retain(|kind| !matches!(*kind, "undetectable" | "learned_closing" | "no_support" | "noisy_position"));
    let values: Vec<String> = ["x", "y", "z"]
        .iter()
        .map(|letter| {
            let column = &opened.recording.columns[&format!("cube.position.{letter}")];
            format!("{:.4}", column.values[10])
        })
        .collect();
    format!(
        "{} rows, {:.0} Hz, cube {}; {}",
        opened.recording.time.len(),
        frames.layout.rate_hz,
        values.join(" "),
        kinds.join(" ")
    )
}

/// A promise: its name, what makes the log, the binding, and what becomes of it; formats in which something else is promised.
struct Promise {
    name: &'static str,
    change: fn(&mut Columns),
    binding: String,
    wanted: &'static str,
    others: &'static [(&'static str, &'static str)],
}

fn column<'a>(log: &'a mut Columns, name: &str) -> &'a mut Vec<f64> {
    &mut log.iter_mut().find(|(known, _)| *known == name).unwrap().1
}

/// Arrays have no order of their own, and the stamps of messages are their first column: a number names another column.
const OTHER: &str = "100 rows, 50 Hz, cube ";

fn take_out(log: &mut Columns, rows: std::ops::Range<usize>) {
    log.iter_mut().for_each(|(_, values)| drop(values.drain(rows.clone())));
}

fn promises() -> Vec<Promise> {
    let whole = "100 rows, 50 Hz, cube 0.1200 0.2600 0.3050; ";
    let of = |name, change, binding: &str, wanted, others| Promise {
        name,
        change,
        binding: binding.to_string(),
        wanted,
        others,
    };
    let swapped = |from: &str, to: &str| CHANNELS.replace(from, to);
    vec![
        of("the log itself", |_| {}, CHANNELS, whole, &[]),
        of("stamps that are equal", |log| column(log, "time")[50] = 49.0 / RATE, CHANNELS, "duplicate_stamp", &[]),
        of(
            "time that decreases",
            |log| column(log, "time")[50] = 10.0 / RATE,
            CHANNELS,
            "error: time runs backwards",
            &[("MCAP", "duplicate_stamp")],
        ),
        of(
            "one stamp for all rows",
            |log| column(log, "time").fill(3.0),
            CHANNELS,
            "error: all 100 rows have the same time stamp",
            &[],
        ),
        of(
            "stamps of too few digits",
            |log| column(log, "time").iter_mut().for_each(|time| *time = time.floor()),
            CHANNELS,
            "if the steps are even, a binding with their `rate` replaces them",
            &[],
        ),
        of(
            "stamps in milliseconds",
            |log| column(log, "time").iter_mut().for_each(|time| *time *= 1e3),
            CHANNELS,
            "if the stamps are in ms, write `time [ms]`",
            &[],
        ),
        of(
            "stamps of 32 bits",
            |log| {
                column(log, "time").iter_mut().for_each(|time| *time = f64::from((100_000.0 + *time) as f32));
            },
            CHANNELS,
            "`rate: 50 Hz` replaces them",
            // Stamps of messages are whole ns.
            &[("MCAP", "`resample: 50 Hz`")],
        ),
        of("a lost row", |log| take_out(log, 50..51), CHANNELS, "missing_row", &[]),
        of("a gap", |log| take_out(log, 50..70), CHANNELS, "gap", &[]),
        of("a value that was not measured", |log| column(log, "cx")[50] = f64::NAN, CHANNELS, "not_a_number", &[]),
        of(
            "a channel that was never measured",
            |log| ["x", "y", "z"].iter().for_each(|name| column(log, name).fill(f64::NAN)),
            &CHANNELS.replace(
                "right.thumb.position: [@x, @y, @z]",
                "right.palm.position: [@x, @y, @z], right.thumb.position: [@cx, @cy, @cz]",
            ),
            "not_a_number",
            &[("JSON lines", "the log has no column `x`"), ("MCAP", "the log has no column `/log.x`")],
        ),
        of(
            "a lost body at zero",
            |log| ["cx", "cy", "cz"].iter().for_each(|name| column(log, name)[40..60].fill(0.0)),
            CHANNELS,
            "not_a_number",
            &[],
        ),
        of(
            "counts of another unit",
            |log| column(log, "width").iter_mut().for_each(|width| *width *= 1e9),
            &swapped("right.gripper.closed: \"@width [m] < 45 mm\", ", ""),
            "they are in another unit, or counts",
            &[],
        ),
        of(
            "a scale, an offset and a unit",
            |log| column(log, "cx").iter_mut().for_each(|x| *x = (*x * 1e3 - 3.0) / 2.0),
            &swapped("[@cx, @cy, @cz]", "[\"@cx * 2 + 3 [mm]\", \"@cy [m]\", @cz]"),
            whole,
            &[],
        ),
        of(
            "a rate in place of stamps",
            |log| column(log, "time").iter_mut().for_each(|time| *time = time.floor()),
            &format!("rate: 50 Hz\n{CHANNELS}"),
            whole,
            &[],
        ),
        of(
            "a number in place of a name",
            |_| {},
            &swapped("[@cx, @cy, @cz]", "[\"5\", \"6\", \"7\"]"),
            whole,
            &[("Zarr", OTHER), ("HDF5", OTHER), ("MCAP", OTHER)],
        ),
        of("a pattern of components", |_| {}, &swapped("[@cx, @cy, @cz]", "@c<xyz>"), whole, &[]),
        of("a mean", |_| {}, &swapped("[@cx, @cy, @cz]", "{mean: [@c<xyz>, @c<xyz>]}"), whole, &[]),
        of("a constant", |_| {}, &swapped("[@cx, @cy, @cz]", "[@cx, \"= 0.26 m\", @cz]"), whole, &[]),
        of(
            "a column that may lack",
            |_| {},
            &swapped("cube.position:", "right.palm.position: \"@palm<xyz>?\", cube.position:"),
            whole,
            &[],
        ),
        of("stamps with an offset", |_| {}, &format!("time_offset: -2 s\n{CHANNELS}"), whole, &[]),
        of("a name that is nearly one", |_| {}, &swapped("@width,", "@widht,"), "width`?", &[]),
        of("resampling", |log| take_out(log, 50..51), &format!("resample: 50 Hz\n{CHANNELS}"), whole, &[]),
    ]
}

#[test]
fn promises_hold_in_each_format() {
    let mut broken = vec![];
    for promise in promises() {
        for writer in &WRITERS {
            let mut log = log();
            (promise.change)(&mut log);
            let found = outcome(writer, &log, &promise.binding);
            let other = promise.others.iter().find(|(name, _)| *name == writer.name);
            let wanted = other.map_or(promise.wanted, |(_, wanted)| wanted);
            if !found.contains(wanted) {
                broken.push(format!("{}, {}: {found}, expected {wanted}", promise.name, writer.name));
            }
        }
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}
