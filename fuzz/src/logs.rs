//! Logs of every format: opened, inspected, and analyzed by the shipped rules.

use crate::{Tree, file, repository};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use teachtree_frames::inspect::inspect;
use teachtree_logs::read::formats;
use teachtree::{Calibration, Column, Live, Log, Rules, RulesOptions, Scene};

/// How many recordings of a file are read.
const RECORDINGS: usize = 3;

/// Looks at everything in a log, and analyzes it.
fn look(path: &Path) {
    let all = formats::all_of(path).ok().flatten().unwrap_or_default();
    for log in std::iter::once(path.to_path_buf()).chain(all.into_iter().take(RECORDINGS)) {
        if let Ok(source) = formats::open(&log) {
            let _ = inspect(source, None, None);
        }
        if let Ok(log) = Log::open(&log) {
            analyze(&log);
        }
    }
}

fn analyze(log: &Log) {
    if let Ok(rules) = Rules::for_log(log)
        && let Ok(analysis) = rules.analyze(log)
    {
        analysis.json();
    }
}

/// A table of text.
pub fn csv(data: &[u8]) {
    look(&file("log.csv", data));
}

/// A table of Qualisys, with its binding.
pub fn qualisys(data: &[u8]) {
    let log = file("log.tsv", data);
    look(&log);
    let binding = repository().join("demos/bindings/dfki_hand.binding.yaml");
    if let Ok(log) = Log::options().binding(binding).open(log) {
        analyze(&log);
    }
}

/// Lines of JSON: as a file, and as a log that is still being written.
pub fn jsonl(data: &[u8]) {
    look(&file("log.jsonl", data));
    let _ = Log::options().follow(data, &RulesOptions::default(), &mut |_| Ok(()));
}

/// A bag of ROS 2.
pub fn mcap(data: &[u8]) {
    look(&file("log.mcap", data));
}

/// A bag of ROS 1.
pub fn rosbag(data: &[u8]) {
    look(&file("log.bag", data));
}

/// A table of Parquet.
pub fn parquet(data: &[u8]) {
    look(&file("log.parquet", data));
}

/// A file of a LeRobot data set.
pub fn lerobot(data: &[u8]) {
    static SET: LazyLock<Tree> = LazyLock::new(|| Tree::of("tests/fixtures/formats/lerobot_v30"));
    SET.with(data, look);
}

/// A file of HDF5.
pub fn hdf5(data: &[u8]) {
    look(&file("log.hdf5", data));
}

/// An array of NumPy, an archive of them, or a store of Zarr in an archive.
pub fn arrays(data: &[u8]) {
    look(&file(if data.starts_with(b"PK") { "log.npz" } else { "log.npy" }, data));
}

/// A file of a store of Zarr.
pub fn zarr(data: &[u8]) {
    static STORE: LazyLock<Tree> = LazyLock::new(|| Tree::of("tests/fixtures/formats/stores/demos_3_by_3.zarr"));
    STORE.with(data, look);
}

/// A recording, and what live rules need to know of it.
struct LiveInputs {
    titles: Vec<String>,
    rows: Vec<Vec<f64>>,
    scene: Scene,
    rules: Rules,
    calibration: Calibration,
}

static PLAIN: LazyLock<LiveInputs> = LazyLock::new(|| {
    let folder: PathBuf = repository().join("tests/fixtures/logs");
    let text = std::fs::read_to_string(folder.join("steady_grip.csv")).expect("a fixture");
    let mut lines = text.lines();
    let titles = lines.next().expect("titles").split(',').map(str::to_string).collect();
    let row = |line: &str| line.split(',').map(|cell| cell.parse().expect("a number")).collect();
    let scene = folder.join("box.yaml");
    let log = Log::options().scene(&scene).open(folder.join("steady_grip.csv")).expect("a log");
    let rules = Rules::for_log(&log).expect("rules");
    let calibration = Calibration::of(&log, &rules).expect("a calibration");
    LiveInputs { titles, rows: lines.map(row).collect(), scene: Scene::open(scene).expect("a scene"), rules, calibration }
});

/// Pushes rows until one is refused.
fn push(mut live: Live, rows: &[Vec<f64>]) {
    if rows.iter().all(|row| live.push(row).is_ok()) {
        let _ = live.finish();
    }
}

/// Rows of a log while it is being made, with wrong values, and the whole log with them.
pub fn rows(data: &[u8]) {
    // Each 11 bytes change a value: row, column, how, and a number.
    let mut rows = PLAIN.rows.clone();
    for change in data.chunks_exact(11) {
        let (at, column) = (usize::from(change[0]) % rows.len(), usize::from(change[1]) % PLAIN.titles.len());
        let number = f64::from_le_bytes(change[3..].try_into().unwrap_or_default());
        match change[2] % 8 {
            0 => rows[at][column] = number,
            1 => rows[at][column] *= 1000.0,
            2 => rows[at][column] = f64::NAN,
            3 => rows.iter_mut().skip(at).for_each(|row| row[column] += number),
            4 => rows.iter_mut().skip(at).for_each(|row| row[column] = number),
            5 if rows.len() > 2 => _ = rows.remove(at),
            6 => rows.insert(at, rows[at].clone()),
            _ => rows[at][0] += number,
        }
    }
    let live = Live::new(&PLAIN.rules, &PLAIN.titles, &PLAIN.scene, &PLAIN.calibration);
    push(live.expect("the columns are those of the calibration"), &rows);
    let columns = PLAIN.titles.iter().enumerate().map(|(at, title)| {
        let (name, unit) = title.split_once(" [").expect("a unit");
        Column::new(name, unit.trim_end_matches(']'), rows.iter().map(|row| row[at]).collect::<Vec<_>>())
    });
    if let Ok(log) = Log::from_columns("rows", columns, &PLAIN.scene)
        && let Ok(analysis) = PLAIN.rules.analyze(&log)
    {
        analysis.json();
    }
}

/// A file of what was learned of sensors: written as it can be read again, and used for rows.
pub fn calibration(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let Ok(read) = Calibration::parse("fuzz.json", text) else { return };
    if let Ok(written) = read.text() {
        Calibration::parse("written.json", &written).expect("what was written can be read");
    }
    if let Ok(live) = Live::new(&PLAIN.rules, &PLAIN.titles, &PLAIN.scene, &read) {
        push(live, &PLAIN.rows);
    }
}
