//! What a proposal says about quantities that a log lacks.

use super::{Column, along, lift, still, table, width};
use std::fs;
use teachtree_frames::inspect::inspect;
use teachtree_frames::propose::{Answers, propose};
use teachtree_logs::read::formats;

/// Rules without failures are for grippers of unknown position only: what lacks a gripper too cannot seem to miss.
#[test]
fn a_hand_without_a_position_is_named_with_a_line_to_edit() {
    let proposal = |columns: &[Column]| {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("log.csv");
        fs::write(&log, table(columns)).unwrap();
        propose(&inspect(formats::open(&log).unwrap(), None, None).unwrap(), &Answers::default())
    };
    let thing: [Column; 4] = [("thing_x", along), ("thing_y", still), ("thing_z", lift), ("gripper_width", width)];
    let without_gripper = proposal(&thing[..3]);
    assert_eq!(without_gripper.rules, None);
    let lacking = without_gripper.lacking.join("\n");
    assert!(
        lacking.contains("such as by `right.tcp.position: thing_<xyz>`, and delete the body `thing` in the scene"),
        "{lacking}"
    );
    assert_eq!(proposal(&thing).rules, Some("contact.rules"));
}
