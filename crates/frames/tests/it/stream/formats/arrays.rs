//! Files of arrays: HDF5 as robosuite, robomimic, MimicGen, Isaac Lab, ALOHA and EgoDex write it.

use super::{bound, fixture, folder, values};
use crate::shared::files::columns;
use proptest::prelude::*;
use serde_json::Value;
use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use teachtree_logs::read::formats;

fn file(name: &str) -> PathBuf {
    fixture("arrays").join(name)
}

fn json(name: &str) -> BTreeMap<String, Value> {
    serde_json::from_str(&std::fs::read_to_string(file(name)).unwrap()).unwrap()
}

/// Numbers in a text, since JSON is read rounded.
fn numbers(text: &Value) -> Vec<f64> {
    text.as_str().unwrap().split(' ').map(|number| number.parse().unwrap()).collect()
}

/// `expected.json` is made by h5py, numpy and MuJoCo (tools/make_array_fixtures.py).
#[test]
fn every_column_is_as_h5py_reads_it() {
    let mut compared = 0;
    for (log, wanted) in json("expected.json") {
        let found = columns(formats::open(&file(&log)).unwrap());
        for (title, values) in wanted.as_object().unwrap() {
            let column = found.get(title).unwrap_or_else(|| panic!("{log} has no {title}, it has {:?}", found.keys()));
            let values = numbers(values);
            // What is stored is equal, what is computed of matrices and joints nearly so.
            let near = if title.contains(".rotation.") || title.starts_with("bodies/") { 2e-6 } else { 0.0 };
            let same = column.len() == values.len() && column.iter().zip(&values).all(|(a, b)| (a - b).abs() <= near);
            assert!(same, "{log} {title}: found {column:?}, expected {values:?}");
            compared += 1;
        }
        let extra: Vec<_> = found.keys().filter(|title| wanted.get(*title).is_none()).collect();
        let known = ["time [s]", "words", "fixed"];
        assert!(extra.iter().all(|title| known.contains(&title.as_str())), "{log}: {extra:?}");
    }
    assert!(compared > 350, "only {compared} columns were compared");
}

/// A data set that cannot be read does not keep the others from being read (`floats.hdf5` has some).
#[test]
fn a_type_that_is_not_read_is_named_where_it_is_bound() {
    let refused = |column: &str| {
        bound(&file("floats.hdf5"), &format!("rate: 50 Hz\nchannels: {{right.gripper.opening: {column}}}\n"))
            .unwrap_err()
    };
    assert!(
        refused("long").contains("`long` cannot be read: has floating point numbers of 128 bits, which are not read")
    );
    assert!(refused("stamp").contains("`stamp` cannot be read: has values of a type that is not read"));
    assert!(
        refused("summed").contains("`summed` cannot be read: has a checksum (Fletcher32) before its other filters")
    );
    assert!(refused("ragged").contains("`ragged` cannot be read: has rows of different lengths"));
    let binding = "rate: 50 Hz\nchannels: {right.gripper.opening: 'half[3] [mm]'}\n";
    assert_eq!(values(&bound(&file("floats.hdf5"), binding).unwrap().0, "right.gripper.opening")[1], 1.0);
}

#[test]
fn a_wrong_check_sum_is_told_as_damage() {
    let mut bytes = std::fs::read(fixture("links").join("none_dense.hdf5")).unwrap();
    let at = bytes.windows(4).position(|mark| mark == b"OHDR").unwrap();
    bytes[at + 12] ^= 1;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.hdf5");
    std::fs::write(&path, bytes).unwrap();
    let error = formats::open(&path).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("is damaged: a checksum of its structure is wrong"), "{error}");
}

/// Rewards that are not numbers do not say whether a recording succeeded.
#[test]
fn rewards_of_texts_or_records_say_nothing() {
    type Write = fn(&mut hdf5_pure::DatasetBuilder);
    let writers: [(Write, usize); 4] = [
        (|data| _ = data.with_strings(&["no", "no", "yes"]).unwrap(), 0),
        (|data| _ = data.with_vlen_strings(&["no", "no", "yes"]), 0),
        (|data| _ = data.with_complex64_data(&[(0.0, 0.0), (0.0, 0.0), (1.0, 0.0)]), 0),
        (|data| _ = data.with_f64_data(&[0.0, 0.0, 1.0]), 1),
    ];
    for (write, known) in writers {
        let folder = tempfile::tempdir().unwrap();
        let mut builder = hdf5_pure::FileBuilder::new();
        let mut data = builder.create_group("data");
        let mut demo = data.create_group("demo_0");
        demo.create_dataset("width").with_f64_data(&[0.08, 0.04, 0.02]);
        write(demo.create_dataset("rewards"));
        data.add_group(demo.finish());
        builder.add_group(data.finish());
        let path = folder.path().join("log.hdf5");
        std::fs::write(&path, builder.finish().unwrap()).unwrap();
        assert_eq!(formats::open(&folder.path().join("log.hdf5#demo_0")).unwrap().success_fields.len(), known);
    }
}

/// The recordings that come with robosuite 1.4.1, 5 MB, where the folder `robosuite_hdf5` of `TEACHTREE_DATA` has them as `lift.hdf5`,
/// `wipe.hdf5` and `handover.hdf5`.
#[test]
fn robosuites_own_recordings_are_as_h5py_reads_them() {
    let folder = std::env::var("TEACHTREE_DATA").map(|folder| Path::new(&folder).join("robosuite_hdf5")).ok();
    let Some(folder) = folder.filter(|folder| folder.is_dir()) else {
        let _ = writeln!(std::io::stderr(), "skipped: TEACHTREE_DATA names no folder with `robosuite_hdf5`");
        return;
    };
    let mut recordings: BTreeMap<String, BTreeMap<String, Vec<f64>>> = BTreeMap::new();
    let all = json("robosuite.json");
    for (path, wanted) in &all {
        let parts: Vec<&str> = path.splitn(4, '/').collect();
        let [name, "data", demo, data_set] = parts.as_slice() else { panic!("{path}") };
        let log = format!("{name}#{demo}");
        let found =
            recordings.entry(log.clone()).or_insert_with(|| columns(formats::open(&folder.join(&log)).unwrap()));
        let shape: Vec<usize> =
            wanted[0].as_array().unwrap().iter().map(|size| size.as_u64().unwrap() as usize).collect();
        let mut titles = vec![data_set.to_string()];
        for size in &shape[1..] {
            titles = titles.iter().flat_map(|title| (0..*size).map(move |at| format!("{title}[{at}]"))).collect();
        }
        let (sums, lasts) = (numbers(&wanted[1]), numbers(&wanted[2]));
        assert_eq!((sums.len(), lasts.len()), (titles.len(), titles.len()));
        for ((title, sum), last) in titles.iter().zip(sums).zip(lasts) {
            let column = found.get(title).or_else(|| found.get(&format!("rows_{}.{title}", shape[0])));
            let column = column.unwrap_or_else(|| panic!("{path}: {title} is not among {:?}", found.keys()));
            let total: f64 = column.iter().sum();
            // numpy sums in pairs.
            let size: f64 = column.iter().map(|value| value.abs()).sum();
            assert!((total - sum).abs() <= 1e-12 * size.max(1.0), "{path} {title}: found {total}, expected {sum}");
            assert_eq!(column.last(), Some(&last), "{path} {title}");
        }
    }
    assert_eq!(all.len(), 359, "data sets of numbers and flags");
}

#[test]
fn recordings_of_a_file_are_chosen_by_name_or_number() {
    let refused = |log: &str| {
        formats::open(&file(log)).err().unwrap().to_string().replace(&fixture("").display().to_string(), "")
    };
    let rows = |log: &str| columns(formats::open(&file(log)).unwrap())["rewards"].len();
    assert_eq!((rows("robomimic.hdf5#demo_2"), rows("robomimic.hdf5#2"), rows("robomimic.hdf5#10")), (5, 5, 4));
    insta::assert_snapshot!(
        [
            refused("robomimic.hdf5"),
            refused("robomimic.hdf5#demo_1"),
            refused("robomimic.hdf5#left"),
            refused("aloha.hdf5#0"),
            refused("expected.json#demo_1"),
            refused("missing.hdf5#1"),
        ]
        .join("\n")
    );
}

#[test]
fn rates_come_from_the_file_or_from_the_binding() {
    let stamps = |log: &str| columns(formats::open(&file(log)).unwrap()).get("time [s]").map(|time| time[1]);
    // robomimic's env_args, Isaac Lab's step and decimation, the time within robosuite's states.
    assert_eq!(stamps("robomimic.hdf5#0"), Some(0.05));
    assert_eq!(stamps("isaac.hdf5"), Some(0.05));
    assert!((stamps("robosuite_lift.hdf5").unwrap() - 1.0).abs() < 1e-9);
    assert_eq!(stamps("aloha.hdf5"), None);
    let without = bound(&file("aloha.hdf5"), "channels: {right.gripper.opening: 'action[6]'}\n").unwrap_err();
    insta::assert_snapshot!(without);
    let (log, _) = bound(&file("aloha.hdf5"), "rate: 50 Hz\nchannels: {right.gripper.opening: 'action[6]'}\n").unwrap();
    assert_eq!(log.time, [0.0, 0.02, 0.04, 0.06]);
    assert_eq!(values(&log, "right.gripper.opening"), [6.0, 20.0, 34.0, 48.0]);
}

#[test]
fn poses_are_bound_as_position_and_rotation() {
    let binding = "channels:
  cube.position: datagen_info/object_poses/cube.position.<xyz>
  cube.rotation: datagen_info/object_poses/cube.rotation.<wxyz>
  right.palm.rotation: obs/robot0_eef_quat[<xyzw=0 1 2 3>]
  right.label: words
";
    let (log, issues) = bound(&file("robomimic.hdf5#demo_0"), binding).unwrap();
    assert_eq!(values(&log, "cube.position.x"), [0.0, 0.1, 0.2, 0.30000000000000004, 0.4, 0.5]);
    assert_eq!(log.labels["right.label"][4], "word 4");
    // The rotation passes half a turn, and the quaternion has no jump.
    let w = values(&log, "cube.rotation.w");
    assert!(w.is_sorted_by(|a, b| a > b) && w[5] < 0.0, "{w:?}");
    assert!(issues.is_empty(), "{issues:?}");
}

/// The library allocates memory for consecutive chunks before it detects that some are missing.
#[test]
fn a_chunk_that_is_longer_than_the_file_is_refused_before_it_is_read() {
    let whole = std::fs::read(file("robomimic.hdf5")).unwrap();
    // Leaves of the chunk B-trees. The size of the first chunk follows the header of 24 bytes.
    let leaves: Vec<usize> = (0..whole.len() - 28).filter(|at| whole[*at..].starts_with(b"TREE\x01\x00")).collect();
    assert_eq!(leaves.len(), 9);
    for size in [1_042_375_863_u32, whole.len() as u32] {
        let mut bytes = whole.clone();
        leaves.iter().for_each(|at| bytes[at + 24..at + 28].copy_from_slice(&size.to_le_bytes()));
        damaged(&bytes);
        let folder = folder(&[]);
        let path = folder.path().join("log.hdf5");
        std::fs::write(&path, bytes).unwrap();
        let message = bound(
            &folder.path().join("log.hdf5#demo_0"),
            "rate: 20 Hz\nchannels: {right.gripper.opening: 'actions[6]'}\n",
        );
        let message = message.unwrap_err();
        assert!(message.contains(&format!("a chunk declares {size} bytes at byte")), "{message}");
    }
}

/// A recorder that ended early has made room for rows that it never wrote.
#[test]
fn chunks_that_were_never_written_are_reported() {
    let mut bytes = std::fs::read(file("robomimic.hdf5")).unwrap();
    let leaves: Vec<usize> = (0..bytes.len() - 28).filter(|at| bytes[*at..].starts_with(b"TREE\x01\x00")).collect();
    // How many chunks a leaf lists: the last one of several is gone.
    for at in leaves.into_iter().map(|at| at + 6) {
        bytes[at] = bytes[at].saturating_sub(1).max(1);
    }
    let folder = folder(&[]);
    std::fs::write(folder.path().join("log.hdf5"), bytes).unwrap();
    let binding = "rate: 20 Hz\nchannels: {right.gripper.opening: 'actions[6]'}\n";
    let (whole, issues) = bound(&file("robomimic.hdf5#demo_0"), binding).unwrap();
    assert!(issues.iter().all(|issue| issue.kind != "missing_chunk"), "{issues:?}");
    let (cut, issues) = bound(&folder.path().join("log.hdf5#demo_0"), binding).unwrap();
    let opening = |log| values(log, "right.gripper.opening").to_vec();
    assert_eq!((&opening(&cut)[..4], &opening(&cut)[4..]), (&opening(&whole)[..4], &[0.0; 2][..]));
    let missing: Vec<_> = issues.iter().filter(|issue| issue.kind == "missing_chunk").collect();
    assert!(missing.len() == 1 && missing[0].channel == "actions", "{issues:?}");
    assert!(missing[0].message.starts_with("1 of 3 chunks were never written"), "{issues:?}");
    assert!((missing[0].start_s, missing[0].end_s) == (0.2, 0.25), "{issues:?}");
}

/// Reads everything in a damaged file that can be read.
fn damaged(bytes: &[u8]) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.hdf5");
    std::fs::write(&path, bytes).unwrap();
    super::stores::damaged(&path);
}

proptest! {
    // PROPTEST_CASES=20000 is the long form.
    #![proptest_config(ProptestConfig { cases: ProptestConfig::default().cases.max(200), ..ProptestConfig::default() })]

    #[test]
    fn no_damage_to_hdf5_causes_a_panic(
        which in prop::sample::select(vec!["robomimic.hdf5", "isaac.hdf5", "aloha.hdf5", "robosuite_lift.hdf5"]),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..12),
        cut in prop::option::weighted(0.2, any::<prop::sample::Index>()),
        early in any::<bool>(),
    ) {
        let mut bytes = std::fs::read(file(which)).unwrap();
        let length = bytes.len();
        for (at, byte) in changes {
            let at = if early { at.index(length.min(4096)) } else { at.index(length) };
            bytes[at] = byte;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(length));
        }
        damaged(&bytes);
    }
}
