//! The program on arrays of NumPy and stores of Zarr.

use crate::program::{all_said, complained, said, teachtree_in};
use crate::shared::files::{SCENE, bound, fixture, folder, values};
use crate::shared::folders::copy;
use std::path::PathBuf;
use teachtree_logs::read::formats;

fn file(name: &str) -> PathBuf {
    fixture("stores").join(name)
}

#[test]
fn episodes_of_a_replay_buffer_are_recordings() {
    let folder = folder(&[]);
    copy(&file("replay_buffer.zarr"), &folder.path().join("replay_buffer.zarr"));
    std::fs::copy(file("umi.zarr.zip"), folder.path().join("umi.zarr.zip")).unwrap();
    let all = |path: &str| {
        let found = formats::all_of(&folder.path().join(path)).unwrap().unwrap();
        found.iter().map(|log| formats::stem(log)).collect::<Vec<_>>()
    };
    assert_eq!(all("replay_buffer.zarr"), [0, 1, 2, 3].map(|at| format!("replay_buffer.zarr_{at}")));
    assert_eq!(all("umi.zarr.zip"), [0, 1, 2, 3].map(|at| format!("umi.zarr_{at}")));
    let some = formats::chosen(&folder.path().join("umi.zarr.zip#2..3")).unwrap().unwrap();
    assert_eq!(some.len(), 2);
    // What an episode is read from: its own chunks only.
    let files = formats::files_of(&folder.path().join("replay_buffer.zarr#0")).unwrap();
    let names: Vec<String> = files.iter().map(|file| file.file_name().unwrap().to_string_lossy().into()).collect();
    assert!(names.contains(&"0.0".into()) && !names.contains(&"1.0".into()), "{names:?}");
    let refused = |log: &str| {
        let error = formats::open(&folder.path().join(log)).err().unwrap().to_string();
        error.replace(&format!("{}/", folder.path().display()), "")
    };
    insta::assert_snapshot!(
        [
            refused("replay_buffer.zarr"),
            refused("replay_buffer.zarr#4"),
            refused("umi.zarr.zip"),
            refused("replay_buffer.zarr#1")
        ]
        .join("\n")
    );
    let binding = "rate: 10 Hz\nchannels: {right.gripper.opening: 'action[1]', cube.position: 'tool.position.<xyz>'}\n";
    let (log, _) = bound(&folder.path().join("replay_buffer.zarr#2"), binding).unwrap();
    assert_eq!((log.time.len(), values(&log, "right.gripper.opening")[0]), (11, 38.375));
    // A folder of both has the episodes of both.
    std::fs::write(folder.path().join("b.yaml"), format!("{binding}{}", SCENE)).unwrap();
    let inspected = teachtree_in(folder.path(), &["inspect", "replay_buffer.zarr#2", "--binding", "b.yaml"]);
    assert!(inspected.status.success(), "{}", all_said(&inspected));
    let elsewhere = tempfile::tempdir().unwrap();
    let out = elsewhere.path().join("out").display().to_string();
    let analyzed = teachtree_in(folder.path(), &["analyze", ".", "--binding", "b.yaml", "--out-dir", &out, "--each"]);
    let failed = complained(&analyzed);
    assert!(failed.contains("8 failed") && failed.contains("umi.zarr.zip#1: the episode has no rows"), "{failed}");
}

#[test]
fn a_recording_of_arrays_is_inspected() {
    let folder = folder(&[]);
    std::fs::copy(file("arrays.npz"), folder.path().join("arrays.npz")).unwrap();
    let inspected = teachtree_in(folder.path(), &["inspect", "arrays.npz"]);
    insta::assert_snapshot!(said(&inspected));
}
