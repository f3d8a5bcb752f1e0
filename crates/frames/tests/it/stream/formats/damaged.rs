//! No damage to a file causes a panic: every mutation is read or refused.

use super::{bound, fixture};
use proptest::prelude::*;
use std::path::PathBuf;
use teachtree_frames::inspect::inspect;
use teachtree_logs::read::formats;

/// Whole files of each kind, small.
fn wholes() -> Vec<(&'static str, Vec<u8>)> {
    let mut wholes = vec![
        ("log.tsv", b"FREQUENCY\t50\nNO_OF_\nMARKER_NAMES\ta\tb\n1\t2\t3\t4\t5\t6\n7\t8\t9\t1\t2\t3\n".to_vec()),
        ("capture.tsv", b"NO_OF_FRAMES\t2\nFREQUENCY\t50\nMARKER_NAMES\ta\nFrame\tTime\ta X\ta Y\ta Z\n1\t0\t4\t5\t6\n2\t0.1\t1\t2\t3\n".to_vec()),
        ("log.dat", b"# t x y z\n0 1 2 3\n0.1 1 2 3\n".to_vec()),
        ("log.csv", b"time;a [mm];\"b;c\"\n0,1;2;x\n0,2;3;y\n".to_vec()),
        ("log.jsonl", b"{\"scene\":{\"bodies\":{}}}\n{\"time\":0,\"a\":[1,2,{\"b\":true}]}\n{\"time\":1}\n".to_vec()),
        ("log.bag", [b"#ROSBAG V2.0\n".as_slice(), &[8, 0, 0, 0, 4, 0, 0, 0, b'o', b'p', b'=', 7, 0, 0, 0, 0]].concat()),
    ];
    wholes.push(("log.mcap", std::fs::read(fixture("rosbag2/cdr_test_0.mcap")).unwrap()));
    let set = fixture("lerobot_v21/data/chunk-000/episode_000002.parquet");
    wholes.push(("log.parquet", std::fs::read(set).unwrap()));
    wholes
}

fn read(folder: &tempfile::TempDir, name: &str, bytes: &[u8]) {
    let path: PathBuf = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    if let Ok(source) = formats::open(&path) {
        let _ = inspect(source, None, None);
    }
    for binding in [
        "",
        "rate: 10 Hz\n",
        "channels: {right.gripper.opening: a}\n",
        "channels: {right.gripper.opening: /test_topic.int8_value}\n",
    ] {
        if let Err(message) = bound(&path, binding) {
            assert!(!message.is_empty());
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(192))]

    #[test]
    fn files_that_were_cut(which in any::<prop::sample::Index>(), at in any::<prop::sample::Index>()) {
        let wholes = wholes();
        let (name, bytes) = which.get(&wholes);
        let folder = tempfile::tempdir().unwrap();
        read(&folder, name, &bytes[..at.index(bytes.len())]);
    }

    #[test]
    fn files_with_other_bytes(
        which in any::<prop::sample::Index>(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        // What matters most in files that say how they are built stands at their ends.
        near_ends in any::<bool>(),
    ) {
        let wholes = wholes();
        let (name, bytes) = which.get(&wholes);
        let mut bytes = bytes.clone();
        let length = bytes.len();
        for (at, byte) in changes {
            let at = if near_ends { length - 1 - at.index(length.min(2500)) } else { at.index(length) };
            bytes[at] = byte;
        }
        let folder = tempfile::tempdir().unwrap();
        read(&folder, name, &bytes);
    }
}
