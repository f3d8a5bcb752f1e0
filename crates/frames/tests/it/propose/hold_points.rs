//! Proposed places at which hands without fingertips and grippers hold objects.

use super::{Column, channel, placed, table};
use std::fs;
use teachtree_base::yaml;
use teachtree_frames::bind::{BindingFile, bind};
use teachtree_logs::read::formats;

/// The part of a way that has been covered, from 0 to 1.
fn part(passed: f64, begin: f64, end: f64) -> f64 {
    let part = ((passed - begin) / (end - begin)).clamp(0.0, 1.0);
    part * part * (3.0 - 2.0 * part)
}

/// The hand is at the cup from 0.3 to 0.8 of the log, and carries it from 0.4 to 0.7.
fn hand_x(passed: f64) -> f64 {
    0.1 * (part(passed, 0.1, 0.3) - 1.0) + 0.3 * part(passed, 0.45, 0.65) - 0.1 * part(passed, 0.8, 0.9)
}

fn hand_z(passed: f64) -> f64 {
    0.1 + raised(passed)
}

fn raised(passed: f64) -> f64 {
    0.15 * (part(passed, 0.4, 0.5) - part(passed, 0.6, 0.7))
}

/// The hand turns about the vertical while it carries the cup.
fn yaw(passed: f64) -> f64 {
    0.6 * part(passed, 0.45, 0.6) - 0.4 * part(passed, 0.8, 0.9)
}

/// The cup is 100 mm ahead of the hand and 30 mm beside it while it is held.
fn cup_x(passed: f64) -> f64 {
    let passed = passed.clamp(0.3, 0.8);
    hand_x(passed) + 0.1 * yaw(passed).cos() - 0.03 * yaw(passed).sin()
}

fn cup_y(passed: f64) -> f64 {
    let passed = passed.clamp(0.3, 0.8);
    0.1 * yaw(passed).sin() + 0.03 * yaw(passed).cos()
}

fn cup_z(passed: f64) -> f64 {
    0.1 + raised(passed)
}

const HAND: [Column; 7] = [
    ("hand_x", hand_x),
    ("hand_y", |_| 0.0),
    ("hand_z", hand_z),
    ("hand_qw", |passed| (yaw(passed) / 2.0).cos()),
    ("hand_qx", |_| 0.0),
    ("hand_qy", |_| 0.0),
    ("hand_qz", |passed| (yaw(passed) / 2.0).sin()),
];
const CUP: [Column; 3] = [("cup_x", cup_x), ("cup_y", cup_y), ("cup_z", cup_z)];

/// When the proposed flag of a closed hand is set and when it ends, s.
fn closed_s(columns: &[Column]) -> [f64; 2] {
    let proposal = placed(columns);
    let file = BindingFile::parse(proposal.binding, "binding".into()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    fs::write(&path, table(columns)).unwrap();
    let scene = yaml::read(&proposal.scene, "scene").unwrap();
    let recording = bind(formats::open(&path).unwrap(), &file, scene).unwrap().recording;
    let closed = &recording.columns["right.gripper.closed"].values;
    let first = closed.iter().position(|value| *value > 0.5).unwrap();
    let last = closed.iter().rposition(|value| *value > 0.5).unwrap();
    assert!(closed[first..=last].iter().all(|value| *value > 0.5));
    [recording.time[first], recording.time[last]]
}

#[test]
fn a_hand_holds_what_it_carries_from_when_they_stop_moving_against_each_other() {
    let columns = [&HAND[..], &CUP].concat();
    let proposal = placed(&columns);
    let found = &proposal.binding;
    assert_eq!(channel(found, "right.palm.position"), Some("hand_<xyz>"), "{found}");
    assert_eq!(channel(found, "right.palm.rotation"), Some("hand_q<wxyz>"), "{found}");
    assert_eq!(channel(found, "right.tcp.position"), Some("{at: [100 mm, 30 mm, 0 mm], of: right.palm}"), "{found}");
    let closed = Some("{between: [right.tcp, cup], below: 3 mm}");
    assert_eq!(channel(found, "right.gripper.closed"), closed, "{found}");
    assert_eq!(proposal.lacking, Vec::<String>::new());
    let [begin_s, end_s] = closed_s(&columns);
    assert!((2.7..=3.0).contains(&begin_s) && (8.0..8.3).contains(&end_s), "{begin_s} {end_s}");
}

#[test]
fn a_hand_pushes_an_object_with_a_point_beside_it() {
    let mut columns = [&HAND[..], &CUP].concat();
    for column in &mut columns {
        if column.0.ends_with("_z") {
            column.1 = |_| 0.1;
        }
    }
    let found = placed(&columns).binding;
    assert_eq!(channel(&found, "right.gripper.closed"), None, "{found}");
    // 25 mm nearer to the hand than the origin of the cup.
    assert_eq!(channel(&found, "right.tcp.position"), Some("{at: [76 mm, 23 mm, 0 mm], of: right.palm}"), "{found}");
}

#[test]
fn of_bodies_that_move_together_the_hand_holds_the_nearest() {
    // The lid rests on the cup.
    let lid: [Column; 3] = [("lid_x", cup_x), ("lid_y", cup_y), ("lid_z", |passed| cup_z(passed) + 0.06)];
    let found = placed(&[&HAND[..], &CUP, &lid].concat()).binding;
    let closed = Some("{between: [right.tcp, cup], below: 3 mm}");
    assert_eq!(channel(&found, "right.gripper.closed"), closed, "{found}");
    // What another hand moves, or falls, shows that holds of this log are not all known.
    let ball: [Column; 3] = [("ball_x", |passed| 0.8 - passed / 2.0), ("ball_y", |_| 0.5), ("ball_z", |_| 0.1)];
    let found = placed(&[&HAND[..], &CUP, &ball].concat()).binding;
    assert_eq!(channel(&found, "right.gripper.closed"), None, "{found}");
}

#[test]
fn a_hand_that_carries_one_object_after_the_other_has_no_single_place_for_them() {
    // The can is lifted in the first half of the carriage, the cup in the second one.
    const LIFTED: fn(f64) -> f64 = |passed| raised(passed.min(0.52));
    let can: [Column; 3] = [
        ("can_x", |passed| cup_x(passed.min(0.52))),
        ("can_y", |passed| cup_y(passed.min(0.52))),
        ("can_z", |passed| 0.1 + LIFTED(passed)),
    ];
    let cup: [Column; 3] = [
        ("cup_x", |passed| cup_x(passed.max(0.53))),
        ("cup_y", |passed| cup_y(passed.max(0.53))),
        ("cup_z", |passed| cup_z(passed.max(0.53))),
    ];
    let found = placed(&[&HAND[..], &cup, &can].concat()).binding;
    assert_eq!(channel(&found, "right.gripper.closed"), None, "{found}");
    // A point beside them shows when it comes near.
    assert_eq!(channel(&found, "right.tcp.position"), Some("{at: [76 mm, 23 mm, 0 mm], of: right.palm}"), "{found}");
    assert!(found.contains("where an object is while the hand moves it"), "{found}");
}

/// The left hand keeps the cup in place while the right one takes the lid off it.
#[test]
fn a_hand_keeps_what_the_other_one_takes_something_off() {
    let of_right = HAND.map(|(name, value)| (["right_", name].concat(), value));
    let left: [Column; 7] = [
        ("left_hand_x", |passed| 0.08 + 0.2 * (1.0 - part(passed, 0.05, 0.2) + part(passed, 0.85, 0.95))),
        ("left_hand_y", |_| 0.12),
        ("left_hand_z", |_| 0.05),
        ("left_hand_qw", |_| 1.0),
        ("left_hand_qx", |_| 0.0),
        ("left_hand_qy", |_| 0.0),
        ("left_hand_qz", |_| 0.0),
    ];
    let lid: [Column; 3] = [("lid_x", cup_x), ("lid_y", cup_y), ("lid_z", cup_z)];
    let jar: [Column; 3] = [("jar_x", |_| 0.1), ("jar_y", |_| 0.03), ("jar_z", |_| 0.04)];
    let mut columns: Vec<Column> = of_right.iter().map(|(name, value)| (name.as_str(), *value)).collect();
    columns.extend([&left[..], &lid, &jar].concat());
    let proposal = placed(&columns);
    let found = &proposal.binding;
    // The end of a hold that moves nothing would be a Miss.
    assert_eq!(channel(found, "left.tcp.position"), Some("{at: [20 mm, -90 mm, -10 mm], of: left.palm}"), "{found}");
    assert_eq!(channel(found, "left.gripper.closed"), Some("\"= 0\""), "{found}");
    assert!(
        found.contains("if it holds jar while it stays there, `{between: [left.tcp, jar], below: 3 mm}`"),
        "{found}"
    );
    assert_eq!(channel(found, "right.gripper.closed"), Some("{between: [right.tcp, lid], below: 3 mm}"), "{found}");
    assert!(proposal.scene.contains("\n  jar: {role: object,"), "{}", proposal.scene);
    // A hand beside a jar on which nothing rests keeps nothing.
    for column in &mut columns {
        if column.0 == "jar_z" {
            column.1 = |_| 0.4;
        }
    }
    let found = placed(&columns).binding;
    assert_eq!(channel(&found, "left.tcp.position"), Some("left_hand_<xyz>"), "{found}");
    assert_eq!(channel(&found, "left.gripper.closed"), Some("\"= 0\""), "{found}");
}

#[test]
fn a_hand_that_turns_an_object_and_comes_back_has_not_missed_it() {
    /// The hand turns the lid, rises without it, and comes back before it takes it off.
    const AWAY: fn(f64) -> f64 = |passed| 0.06 * (part(passed, 0.34, 0.35) - part(passed, 0.37, 0.38));
    const TURNED: fn(f64) -> f64 = |passed| part(passed, 0.31, 0.33);
    let mut columns = [&HAND[..], &CUP].concat();
    columns[2].1 = |passed| hand_z(passed) + AWAY(passed);
    let rotation: [Column; 4] = [
        ("cup_qw", |passed| (TURNED(passed) / 2.0).cos()),
        ("cup_qx", |_| 0.0),
        ("cup_qy", |_| 0.0),
        ("cup_qz", |passed| (TURNED(passed) / 2.0).sin()),
    ];
    columns.extend(rotation);
    let found = placed(&columns).binding;
    assert!(found.contains("\nparams: {miss_again: 5 s}"), "{found}");
    // A hand that does not turn it may have missed it.
    columns.truncate(columns.len() - 4);
    let found = placed(&columns).binding;
    assert!(channel(&found, "right.gripper.closed").is_some() && !found.contains("miss_again"), "{found}");
}
