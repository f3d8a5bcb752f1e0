//! What a proposal says about quantities that a log lacks.

use super::{Column, along, lift, still, table};
use std::fs;
use teachtree_frames::inspect::inspect;
use teachtree_frames::propose::{Answers, propose};
use teachtree_logs::read::formats;

/// The sentences about a log with these columns.
fn lacking(columns: &[Column]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log.csv");
    fs::write(&log, table(columns)).unwrap();
    propose(&inspect(formats::open(&log).unwrap(), None, None).unwrap(), &Answers::default()).lacking.join("\n")
}

#[test]
fn a_hand_without_a_position_is_named_with_a_line_to_edit() {
    let lacking = lacking(&[("thing_x", along), ("thing_y", still), ("thing_z", lift)]);
    assert!(
        lacking.contains("such as by `right.tcp.position: thing_<xyz>`, and delete the body `thing` in the scene"),
        "{lacking}"
    );
}

#[test]
fn fingertips_of_a_tracked_hand_are_named_with_their_lines() {
    let hand: [Column; 6] = [
        ("RightHand_x", along),
        ("RightHand_y", still),
        ("RightHand_z", lift),
        ("cup_x", still),
        ("cup_y", still),
        ("cup_z", lift),
    ];
    let turned: [Column; 4] =
        [("RightHand_qw", |_| 0.8), ("RightHand_qx", |_| 0.6), ("RightHand_qy", |_| 0.0), ("RightHand_qz", |_| 0.0)];
    let line = "`right.thumb.position: {at: [0 mm, 30 mm, 90 mm], of: right.palm}`";
    let of_both = lacking(&[&hand[..], &turned].concat());
    assert!(of_both.contains(line) && of_both.contains("bind them as `right.palm.position`"), "{of_both}");
    // Points in the frame of a hand need its rotation.
    let of_position = lacking(&hand);
    assert!(of_position.contains("no column shows when a hand holds something"), "{of_position}");
    assert!(of_position.contains("Grasp begins after 10 mm of lift (`raised_by`)"), "{of_position}");
    assert!(!of_position.contains(line), "{of_position}");
}
