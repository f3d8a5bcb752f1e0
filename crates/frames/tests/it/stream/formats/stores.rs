//! Arrays of NumPy and stores of Zarr, as numpy 2 and zarr 2 and 3 write them (tools/make_store_fixtures.py).

use super::{bound, fixture, folder, values};
use crate::shared::files::columns;
use crate::shared::folders::{all_files, copy};
use proptest::prelude::*;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use teachtree_frames::inspect::inspect;
use teachtree_logs::read::formats;

fn file(name: &str) -> PathBuf {
    fixture("stores").join(name)
}

/// The columns of each log, as numpy and zarr read them.
fn expected() -> BTreeMap<String, BTreeMap<String, Vec<f64>>> {
    let all: BTreeMap<String, BTreeMap<String, String>> =
        serde_json::from_str(&std::fs::read_to_string(file("expected.json")).unwrap()).unwrap();
    let of = |columns: &BTreeMap<String, String>| {
        let text =
            |text: &str| text.strip_prefix("= ").map_or_else(|| text.to_string(), |title| columns[title].clone());
        let numbers = |said: &String| text(said).split(' ').map(|number| number.parse().unwrap()).collect();
        columns.iter().map(|(title, said)| (title.clone(), numbers(said))).collect()
    };
    all.iter().map(|(log, columns)| (log.clone(), of(columns))).collect()
}

#[test]
fn every_column_is_as_numpy_and_zarr_read_it() {
    let mut compared = 0;
    for (log, wanted) in expected() {
        let source = formats::open(&file(&log)).unwrap_or_else(|error| panic!("{log}: {error}"));
        let found = columns(source);
        for (title, values) in &wanted {
            let column = found.get(title).unwrap_or_else(|| panic!("{log} has no {title}, it has {:?}", found.keys()));
            // What is stored is equal, what is computed of matrices, dates and rates nearly so.
            let near = match title {
                _ if title.contains(".rotation.") => 1e-7,
                _ if title == "stamp" => 1e-6,
                _ if title == "time [s]" => 1e-12,
                _ => 0.0,
            };
            let same = column.len() == values.len() && column.iter().zip(values).all(|(a, b)| (a - b).abs() <= near);
            assert!(same, "{log} {title}: found {column:?}, expected {values:?}");
            compared += 1;
        }
        let known = |title: &String| title.contains(".rotation.") || ["word", "words"].contains(&title.as_str());
        let extra: Vec<_> = found.keys().filter(|title| !wanted.contains_key(*title) && !known(title)).collect();
        assert!(extra.is_empty(), "{log}: {extra:?}");
    }
    assert!(compared > 270, "only {compared} columns were compared");
}

/// What cannot be read does not keep the other arrays from being read, and the reason is given where it is wanted.
#[test]
fn arrays_that_cannot_be_read_are_named_with_the_reason() {
    let refused = |log: &str| {
        let mut refused = formats::open(&file(log)).unwrap().refused;
        refused.sort();
        refused.into_iter().map(|(name, reason)| format!("{log} {name}: {reason}")).collect::<Vec<_>>().join("\n")
    };
    insta::assert_snapshot!(
        [refused("arrays.npz"), refused("codecs_2.zarr.zip"), refused("codecs_3.zarr.zip"), refused("umi.zarr.zip#0")]
            .join("\n")
    );
    let message =
        bound(&file("codecs_3.zarr.zip"), "channels: {right.gripper.opening: 'blosc_blosclz[0]'}\n").unwrap_err();
    assert!(message.contains("blosclz"), "{message}");
}

/// Whatever an index of shards says, reading ends with values or an error.
#[test]
fn damaged_shards_are_refused_or_read() {
    let whole = std::fs::read(file("shards_3.zarr.zip")).unwrap();
    let folder = folder(&[]);
    let path = folder.path().join("a.zarr.zip");
    let mut refused = 0;
    for at in (0..whole.len()).step_by(97) {
        let mut bytes = whole.clone();
        bytes[at] ^= 0x41;
        std::fs::write(&path, &bytes).unwrap();
        let binding = "rate: 10 Hz\nchannels: {right.palm.position: 'usual[<xyz=0 1 2>]', cube.position: 'at_start[<xyz=0 1 2>]'}\n";
        refused += usize::from(bound(&path, binding).is_err());
    }
    assert!(refused > 5, "{refused}");
}

/// A writer omits chunks in which every value is the fill value; in a copy that lost files, the missing chunks had other values.
#[test]
fn missing_chunks_are_reported() {
    let folder = folder(&[]);
    let store = folder.path().join("replay_buffer.zarr");
    copy(&file("replay_buffer.zarr"), &store);
    let binding = "rate: 10 Hz\nchannels: {right.gripper.opening: 'action[1]', cube.position: 'tool.position.<xyz>'}\n";
    let log = folder.path().join("replay_buffer.zarr#2");
    let (whole, issues) = bound(&log, binding).unwrap();
    assert_eq!(issues, []);
    // Episode 2 has rows 7 to 17; the last two are in the third chunk of 8 rows.
    std::fs::remove_file(store.join("data/action/2.0")).unwrap();
    std::fs::remove_file(store.join("data/state/2.0")).unwrap();
    let (cut, issues) = bound(&log, binding).unwrap();
    let said =
        issues.iter().map(|it| format!("{} {} {}–{} s: {}", it.kind, it.channel, it.start_s, it.end_s, it.message));
    insta::assert_snapshot!(said.collect::<Vec<_>>().join("\n"), @"missing_chunk action 0.9–1 s: missing chunks: 1 of 3, first `data/action/2.0`; they read as the fill value 0, which is correct only if the writer omitted them because all values are equal to it");
    assert_eq!(values(&cut, "cube.position.x"), values(&whole, "cube.position.x"));
    std::fs::remove_file(store.join("meta/episode_ends/0")).unwrap();
    insta::assert_snapshot!(bound(&log, binding).unwrap_err(), @"replay_buffer.zarr array meta/episode_ends: lacks chunks with the ends of the episodes");
}

#[test]
fn archives_and_files_that_are_not_arrays_are_refused() {
    let folder = folder(&[
        ("a.npy", "\u{93}NUMPY"),
        ("b.mat", "MATLAB 5.0 MAT-file"),
        ("c.zarr/.zgroup", "{\"zarr_format\": 2}"),
    ]);
    let mut made = vec![0x93];
    made.extend(b"NUMPY\x01\0");
    let with = |length: u16, text: &str| [&made, &length.to_le_bytes()[..], text.as_bytes()].concat();
    let dictionary = |shape: &str| format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}\n");
    let write = |name: &str, bytes: Vec<u8>| std::fs::write(folder.path().join(name), bytes).unwrap();
    let of = |shape: &str| with(dictionary(shape).len() as u16, &dictionary(shape));
    write("huge.npy", of("(1000000000, 7)"));
    write("overflow.npy", of("(4294967296, 4294967296, 16)"));
    write("scalar.npy", of("()"));
    write("deep.npy", with(60_000, &"[".repeat(60_000)));
    write("cut.npy", with(100, "{"));
    write("bad.npy", made.iter().copied().chain([255, 255]).collect());
    write("text.npz", b"PK\x05\x06aaaaaaaaaaaaaaaaaa".to_vec());
    write("log.zip", b"PK\x03\x04".to_vec());
    let refused = |log: &str| {
        let error =
            formats::open(&folder.path().join(log)).err().unwrap_or_else(|| panic!("{log} is read")).to_string();
        error.replace(&format!("{}/", folder.path().display()), "")
    };
    let logs = [
        "a.npy",
        "b.mat",
        "c.zarr",
        "huge.npy",
        "overflow.npy",
        "scalar.npy",
        "deep.npy",
        "cut.npy",
        "bad.npy",
        "text.npz",
        "log.zip",
    ];
    insta::assert_snapshot!(logs.map(refused).join("\n"));
}

/// Reads everything that can be read in a damaged file, or in a folder with one damaged file. The largest allocation that is accepted is
/// 4 times the limit in docs/logs.md, 1100 bytes a byte and 16 MiB.
pub fn damaged(path: &Path) {
    let size = formats::files_of(path)
        .map_or(0, |files| files.iter().map(|file| file.metadata().map_or(0, |it| it.len())).sum::<u64>());
    let most = 4 * (size.max(4096) * 1100 + (16 << 20));
    let recording = |number: &str| PathBuf::from(format!("{}#{number}", path.display()));
    let used = allocation_counter::measure(|| {
        for log in [path.to_path_buf(), recording("0"), recording("2")] {
            match formats::open(&log) {
                Ok(source) => drop(inspect(source, None, None)),
                Err(error) => assert!(!error.message.is_empty()),
            }
        }
    });
    assert!(used.bytes_max <= most, "{}: {} bytes at a time, at most {most}", path.display(), used.bytes_max);
}

proptest! {
    // PROPTEST_CASES=20000 is the long form (docs/measurements/reliability.md).
    #![proptest_config(ProptestConfig { cases: ProptestConfig::default().cases.max(200), ..ProptestConfig::default() })]

    #[test]
    fn no_damage_to_arrays_and_stores_causes_a_panic(
        which in prop::sample::select(vec![
            "arrays.npz", "plain.npz", "table.npy", "matrix.npy", "codecs_2.zarr.zip", "codecs_3.zarr.zip", "umi.zarr.zip", "alone.zarr.zip",
            "replay_buffer.zarr", "demos_2_by_3.zarr", "demos_3_by_3.zarr",
        ]),
        of_folder in any::<prop::sample::Index>(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..12),
        cut in prop::option::weighted(0.2, any::<prop::sample::Index>()),
        digits in any::<bool>(),
    ) {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join(which);
        let target = if file(which).is_dir() {
            copy(&file(which), &log);
            let mut files: Vec<PathBuf> = all_files(&log).into_keys().map(|path| log.join(path)).collect();
            files.sort();
            of_folder.get(&files).clone()
        } else {
            std::fs::copy(file(which), &log).unwrap();
            log.clone()
        };
        let mut bytes = std::fs::read(&target).unwrap();
        let length = bytes.len().max(1);
        // Other digits leave a description what it is, with other sizes.
        let numbers: Vec<usize> = (0..bytes.len()).filter(|at| bytes[*at].is_ascii_digit()).collect();
        for (at, byte) in changes {
            let place = if digits && !numbers.is_empty() { *at.get(&numbers) } else { at.index(length) };
            if let Some(slot) = bytes.get_mut(place) {
                *slot = if digits && !numbers.is_empty() { b'0' + byte % 10 } else { byte };
            }
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(length));
        }
        std::fs::write(&target, bytes).unwrap();
        damaged(&log);
    }
}
