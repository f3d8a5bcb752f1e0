//! The program on damaged files of Parquet.

use crate::program::{all_said, complained, said, teachtree_in};
use crate::shared::recordings::{CUBE, log, recording};
use teachtree_frames::OpenRequest;
use teachtree_frames::open;
use teachtree_frames::streaming::StreamedLog;
use teachtree_logs::read::formats;

/// The decoder panics on some of these.
#[test]
fn a_damaged_file_is_an_error_of_that_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("damaged.parquet");
    formats::write(&log(), &path).unwrap();
    let whole = std::fs::read(&path).unwrap();
    let request = OpenRequest { log: path.clone(), ..OpenRequest::default() };
    let (mut undecodable, mut refused) = (None, 0);
    for at in 4..whole.len() {
        // 0x12 is an encoding that no page of the file has.
        for value in [0x12, 0xff] {
            let mut bytes = whole.clone();
            bytes[at] = value;
            std::fs::write(&path, &bytes).unwrap();
            if let Err(error) = open(&request) {
                refused += 1;
                assert!(error.place.contains("damaged.parquet"), "byte {at}: {error}");
                if error.message.contains("is damaged: its contents cannot be decoded") {
                    undecodable.get_or_insert(bytes);
                }
            }
            // As it is read in windows.
            if let Some(known) = StreamedLog::open(&request).and_then(|flow| flow.look_through(&[])) {
                let _ = known.parts(&mut |_| Ok(()));
            }
        }
    }
    assert!(refused > 100, "{refused}");
    // Other files of a folder go on.
    let undecodable = undecodable.expect("no damage that makes the decoder panic");
    std::fs::write(&path, undecodable).unwrap();
    let sound = recording(
        CUBE,
        100.0,
        300,
        &[
            ("right.thumb.force.x", &|_| 0.0),
            ("right.thumb.force.y", &|_| 0.0),
            ("right.thumb.force.z", &|_| 0.0),
            ("right.thumb.position.x", &|time| time * 0.1),
            ("right.thumb.position.y", &|_| 0.0),
            ("right.thumb.position.z", &|_| 0.5),
            ("cube.position.x", &|_| 0.0),
            ("cube.position.y", &|_| 0.0),
            ("cube.position.z", &|_| 0.06),
        ],
    );
    formats::write(&sound, &folder.path().join("sound.parquet")).unwrap();
    let output = teachtree_in(folder.path(), &["analyze", ".", "--format", "csv"]);
    assert_eq!(output.status.code(), Some(3));
    assert!(said(&output).contains("sound.parquet"), "{}", all_said(&output));
    let complaint = complained(&output);
    assert!(complaint.contains("damaged.parquet: is damaged") && !complaint.contains("panicked"), "{complaint}");
}
