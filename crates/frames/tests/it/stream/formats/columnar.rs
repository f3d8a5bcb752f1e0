//! Parquet and the data sets that are made of it.

use super::{bound, fixture, folder, header, values};
use crate::shared::recordings::{CUBE, log, recording};
use std::path::Path;
use teachtree_base::recording::{Column, Recording};
use teachtree_base::units::Dimension;
use teachtree_frames::OpenRequest;
use teachtree_frames::open;
use teachtree_logs::read::formats;

#[test]
fn a_canonical_log_is_read_back_to_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("demonstration.parquet");
    formats::write(&log(), &path).unwrap();
    let opened = open(&OpenRequest { log: path.clone(), ..OpenRequest::default() }).unwrap();
    assert_eq!(opened.recording, log());
    assert!(opened.issues.is_empty());
    // Everything is in the one file.
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    let before = std::fs::read(&path).unwrap();
    formats::write(&log(), &path).unwrap();
    assert_eq!(std::fs::read(&path).unwrap(), before, "the same log gives the same bytes");
}

#[test]
fn values_that_were_not_measured_stay_so() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.parquet");
    let mut log = log();
    log.columns["cube.position.z"].values[2] = f64::NAN;
    formats::write(&log, &path).unwrap();
    let opened = open(&OpenRequest { log: path, ..OpenRequest::default() }).unwrap();
    assert!(opened.recording.columns["cube.position.z"].values[2].is_nan());
}

/// The library allocates memory for a page and for the values of a dictionary before it detects that they are missing.
#[test]
fn a_page_that_declares_more_than_the_file_can_hold_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.parquet");
    formats::write(&log(), &path).unwrap();
    let whole = std::fs::read(&path).unwrap();
    // A header begins with its type and the uncompressed length, each as a field byte and a varint.
    assert!(whole[4..].starts_with(&[0x15]) && whole[6] == 0x15, "{:?}", &whole[4..12]);
    let number = whole[7..].iter().position(|byte| *byte < 0x80).unwrap() + 1;
    let huge = [0xfe, 0xff, 0xff, 0xff, 0x0f];
    let bytes = [&whole[..7], &huge, &whole[7 + number..]].concat();
    std::fs::write(&path, bytes).unwrap();
    let used = allocation_counter::measure(|| {
        let error = open(&OpenRequest { log: path.clone(), ..OpenRequest::default() }).unwrap_err().to_string();
        assert!(error.contains("a page declares 2147483647 uncompressed bytes"), "{error}");
    });
    assert!(used.bytes_max < 100 << 20, "{} bytes at a time", used.bytes_max);
}

#[test]
fn an_episode_of_a_set_with_a_file_each_is_a_log() {
    let set = fixture("lerobot_v21");
    let episode = Path::new(set.to_str().unwrap()).with_file_name("lerobot_v21#2");
    let titles = header(&episode);
    assert_eq!(titles.len(), 57);
    assert_eq!(titles[0], "observation.state.kLeftShoulderPitch");
    assert!(titles.contains(&"time [s]".to_string()) && titles.contains(&"action.kRightHandThumbBend".to_string()));
    let binding = "channels: {right.gripper.closed: action.kRightHandThumbBend < 0.97}\n";
    let (recording, _) = bound(&episode, binding).unwrap();
    assert_eq!(recording.time.len(), 343);
    assert!((recording.time[342] - 342.0 / 30.0).abs() < 1e-4);
    let closed = values(&recording, "right.gripper.closed");
    assert!(closed.contains(&1.0) && closed.contains(&0.0), "{closed:?}");
    let refused = |name: &str| bound(&set.with_file_name(name), binding).unwrap_err();
    insta::assert_snapshot!([refused("lerobot_v21"), refused("lerobot_v21#100"), refused("lerobot_v21#7")].join("\n"));
}

/// A table of numbers as Parquet.
fn table(path: &Path, columns: &[(&str, &[f64])]) {
    let column = |(name, values): &(&str, &[f64])| {
        ((*name).to_string(), Column { dimension: Dimension::NONE, values: values.to_vec() })
    };
    let rows = columns[0].1.len();
    let log = Recording {
        time: (0..rows).map(|row| row as f64).collect(),
        columns: columns.iter().map(column).collect(),
        ..recording(CUBE, 1.0, 0, &[])
    };
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    formats::write(&log, path).unwrap();
}

const INFO: &str = r#"{"codebase_version": "v3.0", "total_episodes": 3, "fps": 10, "chunks_size": 1000,
  "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
  "features": {"observation.state": {"names": {"motors": ["pan", "lift"]}}}}"#;

#[test]
fn an_episode_is_found_in_a_file_with_many() {
    let folder = folder(&[("set/meta/info.json", INFO)]);
    let set = folder.path().join("set");
    table(
        &set.join("meta/episodes/chunk-000/file-000.parquet"),
        &[
            ("episode_index", &[0.0, 1.0, 2.0]),
            ("data/chunk_index", &[0.0, 0.0, 0.0]),
            ("data/file_index", &[0.0, 0.0, 1.0]),
        ],
    );
    table(
        &set.join("data/chunk-000/file-000.parquet"),
        &[
            ("episode_index", &[0.0, 0.0, 1.0, 1.0, 1.0]),
            ("timestamp", &[0.0, 0.1, 0.0, 0.1, 0.2]),
            ("grip", &[1.0, 2.0, 3.0, 4.0, 5.0]),
        ],
    );
    let episode = |name: &str| bound(&folder.path().join(name), "channels: {right.gripper.opening: grip}\n");
    // The stamps of the set count, not those that the table of this test has beside them.
    let (recording, _) = episode("set#1").unwrap();
    assert_eq!(values(&recording, "right.gripper.opening"), [3.0, 4.0, 5.0]);
    let refused = |name: &str| episode(name).unwrap_err();
    insta::assert_snapshot!([refused("set"), refused("set#2"), refused("set#3")].join("\n"));
}

/// Teleoperators of HIL-SERL number the names of their actions.
#[test]
fn names_with_their_places_are_those_of_a_list() {
    let info = INFO.replace(r#"{"motors": ["pan", "lift"]}"#, r#"{"pan": 1, "lift": 0}"#).replace("3,", "1,");
    let folder = folder(&[("set/meta/info.json", &info)]);
    let set = folder.path().join("set");
    table(
        &set.join("meta/episodes/chunk-000/file-000.parquet"),
        &[("episode_index", &[0.0]), ("data/chunk_index", &[0.0]), ("data/file_index", &[0.0])],
    );
    table(
        &set.join("data/chunk-000/file-000.parquet"),
        &[
            ("episode_index", &[0.0, 0.0]),
            ("timestamp", &[0.0, 0.1]),
            ("observation.state[0]", &[1.0, 2.0]),
            ("observation.state[1]", &[3.0, 4.0]),
        ],
    );
    let binding = "channels: {right.gripper.opening: observation.state.pan}\n";
    let (recording, _) = bound(&folder.path().join("set#0"), binding).unwrap();
    assert_eq!(values(&recording, "right.gripper.opening"), [3.0, 4.0]);
}

#[test]
fn data_sets_that_say_nonsense_are_refused() {
    let refused = |from: &str, to: &str| {
        let folder = folder(&[("set/meta/info.json", &INFO.replace(from, to))]);
        table(
            &folder.path().join("set/meta/episodes/chunk-000/file-000.parquet"),
            &[("episode_index", &[0.0, 1.0]), ("data/chunk_index", &[0.0, 0.0]), ("data/file_index", &[-1.0, 0.0])],
        );
        bound(&folder.path().join(if from == "data/chunk" { "set#1" } else { "set#0" }), "").unwrap_err()
    };
    insta::assert_snapshot!(
        [
            refused("v3.0", "v1.6"),
            refused("v3.0\"", "v3.0"),
            refused("\"total_episodes\": 3,", ""),
            refused("", ""),
            refused("v3.0", "v2.1"),
            refused("data/chunk", "../chunk"),
        ]
        .join("\n")
    );
}

/// A few bytes can promise more rows than any machine holds.
#[test]
fn a_log_that_does_not_fit_in_memory_is_refused_before_it_is_read() {
    let rows = 20_000_000;
    let refused = teachtree_logs::read::table::check_size("log.parquet", rows, 5).unwrap_err();
    assert!(refused.message.contains("20000000 rows"), "{refused}");
    assert!(teachtree_logs::read::table::check_size("log.parquet", 4_000_000, 73).is_ok());
}
