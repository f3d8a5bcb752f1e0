//! An object without a pose in the log, with and without a place in the scene; and one that a gripper loses.

use super::{ask, column};
use crate::shared::recordings::recording;
use proptest::collection::vec;
use proptest::prelude::*;
use std::collections::BTreeMap;
use teachtree_base::channels::ChannelSpec;
use teachtree_base::hands::Side;
use teachtree_base::recording::{Column, Recording};
use teachtree_base::units::Dimension;
use teachtree_frames::frames;
use teachtree_frames::frames::ColumnKey;
use teachtree_frames::live::{Calibration, Derivation, LiveChunk};

const SCENE: &str = "
bodies:
  cube: {role: object, mass: 300 g, parts: [{box: [40 mm, 40 mm, 40 mm]}]}
  table: {role: support, position: [0 m, 0 m, -10 mm], parts: [{box: [2 m, 2 m, 20 mm]}]}
hands:
  right: {fingers: [thumb]}
";

/// Where the tool is along x, m: it holds from 1 s to 3 s, and from 5 s to 6 s elsewhere.
fn place(t: f64) -> f64 {
    match t {
        t if t < 1.0 => 0.3,
        t if t < 3.0 => 0.3 + 0.1 * (t - 1.0),
        t if t < 5.0 => 0.5 + 0.05 * (t - 3.0),
        t => 0.6 + 0.1 * (t - 5.0),
    }
}

fn log(scene: &str) -> Recording {
    let closed = |t: f64| f64::from(u8::from((1.0..3.0).contains(&t) || (5.0..6.0).contains(&t)));
    recording(
        scene,
        100.0,
        700,
        &[
            ("right.thumb.position.x", &place),
            ("right.thumb.position.y", &|_| 0.1),
            ("right.thumb.position.z", &|_| 0.02),
            ("right.gripper.closed", &closed),
        ],
    )
}

#[test]
fn it_moves_with_the_gripper_that_holds_it() {
    let frames = frames(&log(SCENE), &[ask("target.position"), ask("target.velocity")]).unwrap();
    let (x, y) = (column(&frames, "target.position", 0, 0), column(&frames, "target.position", 0, 1));
    for (frame, wanted) in
        [(0, 0.3), (150, 0.35), (299, place(2.99)), (350, place(2.99)), (450, 0.6), (550, 0.65), (699, place(5.99))]
    {
        assert!(
            (x[frame] - wanted).abs() < 1e-9 && (y[frame] - 0.1).abs() < 1e-9,
            "{frame}: {} {}",
            x[frame],
            y[frame]
        );
    }
    let velocity = column(&frames, "target.velocity", 0, 0);
    assert!((velocity[200] - 0.1).abs() < 1e-9, "{}", velocity[200]);
    // Nothing moves it between the holds, although its place differs after them.
    assert!(velocity[..100].iter().chain(&velocity[300..500]).chain(&velocity[600..]).all(|value| *value == 0.0));
}

#[test]
fn it_rests_on_nothing() {
    let of = |scene: &str| {
        let frames = frames(&log(scene), &[ask("target.position"), ask("contacts.force")]).unwrap();
        let told = |kind: &str, text: &str| {
            frames.issues.iter().any(|issue| issue.kind == kind && issue.message.contains(text))
        };
        let moves = told("missing_channel", "moves with the gripper that holds it, and rests on nothing");
        (
            frames.layout.hands[0].contacts.clone(),
            moves,
            told("no_support", "expected") && told("no_support", "`cube.position` in the log"),
        )
    };
    assert_eq!(of(SCENE), (vec![], true, true));
    // On the table, where the scene has it.
    let placed = SCENE.replace("role: object,", "role: object, position: [0.3 m, 0.1 m, 20 mm],");
    assert_eq!(of(&placed), (vec!["table".to_string()], false, false));
}

/// The scene has a place for it; the hand is 20 mm beside it when it closes, and 81 mm when it closes again.
#[test]
fn an_object_with_a_place_is_carried_from_there_by_a_hand_in_reach() {
    let at = |position: &str| {
        let scene = SCENE.replace("role: object,", &format!("role: object, position: {position},"));
        let mut log = log(&scene);
        // A sensor at the wrist bears the weight of the tool, also while the gripper is open.
        let weight = |value: f64| Column { dimension: Dimension::FORCE, values: vec![value; log.time.len()] };
        let force = [("x", 0.0), ("y", 0.0), ("z", -2.0)]
            .map(|(axis, value)| (format!("right.palm.force.{axis}"), weight(value)));
        log.columns.extend(force);
        frames(&log, &[ask("target.position"), ask("target.velocity"), ask("contacts.force")]).unwrap()
    };
    let found = at("[0.32 m, 0.1 m, 20 mm]");
    let x = column(&found, "target.position", 0, 0);
    for (frame, wanted) in [(0, 0.32), (99, 0.32), (150, 0.37), (299, 0.519), (499, 0.519), (550, 0.569), (699, 0.618)]
    {
        assert!((x[frame] - wanted).abs() < 1e-9, "{frame}: {}", x[frame]);
    }
    let velocity = column(&found, "target.velocity", 0, 0);
    assert!((velocity[200] - 0.1).abs() < 1e-9 && velocity[400] == 0.0, "{} {}", velocity[200], velocity[400]);
    // It slides along the table on which the scene has it.
    let force = column(&found, "contacts.force", 0, 2);
    assert!(force[50] > 0.1 && force[200] > 0.1 && force[690] > 0.1, "{} {} {}", force[50], force[200], force[690]);
    let issue = found.issues.iter().find(|issue| issue.kind == "missing_channel" && issue.channel == "cube.position");
    assert!(
        issue.unwrap().message.contains("assumed to start where the scene puts it, and to move with the gripper"),
        "{issue:?}"
    );
    let beyond = at("[0.8 m, 0.1 m, 20 mm]");
    assert!(column(&beyond, "target.position", 0, 0)[..500].iter().all(|x| *x == 0.8));
}

/// It closes 172 mm beside the object.
#[test]
fn an_empty_gripper_does_not_carry_an_object_with_a_place() {
    let log = log(&SCENE.replace("role: object,", "role: object, position: [0.3 m, 0.272 m, 20 mm],"));
    let found = frames(&log, &[ask("target.position")]).unwrap();
    assert!(column(&found, "target.position", 0, 0).iter().all(|x| *x == 0.3));
}

/// Two objects with places: the hand closes on the second one.
#[test]
fn in_a_live_log_places_choose_the_object() {
    let scene = SCENE.replace(
        "  cube: {role: object,",
        "  apple: {role: object, position: [0 m, 0.6 m, 20 mm], parts: [{box: [40 mm, 40 mm, 40 mm]}]}
  cube: {role: object, position: [0.3 m, 0.1 m, 20 mm],",
    );
    let log = log(&scene);
    let found = live(&log, &[ask("target"), ask("target.position")]);
    let of = |channel: u32, component: u32| {
        let key = ColumnKey { channel, side: Some(Side::Right), slot: 0, component };
        found.get(&key).unwrap()
    };
    assert_eq!(*of(0, 0), vec![1.0; log.time.len()]);
    assert_eq!(*of(1, 2), vec![0.02; log.time.len()]);
    assert!((of(1, 0)[299] - place(2.99)).abs() < 1e-9, "{}", of(1, 0)[299]);
}

/// The columns of a log that comes row by row. A step of more than 0.1 s begins a new stretch.
fn live(log: &Recording, channels: &[ChannelSpec]) -> BTreeMap<ColumnKey, Vec<f64>> {
    let (calibration, _) = Calibration::of(log, channels, true).unwrap();
    let columns: Vec<_> = log.columns.iter().map(|(name, column)| (name.clone(), column.dimension)).collect();
    let mut derivation = Derivation::new(log.scene.clone(), channels.to_vec(), calibration, columns);
    let mut found: BTreeMap<ColumnKey, Vec<f64>> = BTreeMap::new();
    for (row, time_s) in log.time.iter().enumerate() {
        let values: Vec<f64> = log.columns.values().map(|column| column.values[row]).collect();
        derivation.push(*time_s, &values);
        let mut take = |chunk: LiveChunk| {
            for (key, values) in &chunk.frames.columns {
                found.entry(*key).or_default().extend(&values[chunk.core.clone()]);
            }
            Ok(())
        };
        let ends = log.time.get(row + 1).is_none_or(|next| next - time_s > 0.1);
        // The newest frames change nothing of those that follow.
        derivation.settle(ends, row % 3 == 0, &mut take).unwrap();
    }
    found
}

/// A time, s, at which both grippers begin to move, with the places along x and whether they are closed.
type Move = (f64, [f64; 2], [bool; 2]);

/// Two grippers over a table with two objects, on which they close more or less precisely. Rows are lost between 4 s and 4.5 s.
fn two_grippers(moves: &[Move], apple: f64) -> Recording {
    let scene = format!(
        "
bodies:
  cube: {{role: object, position: [0.3 m, 0.1 m, 20 mm], mass: 300 g, parts: [{{box: [40 mm, 40 mm, 40 mm]}}]}}
  apple: {{role: object, position: [{apple} m, 0.1 m, 20 mm], parts: [{{ball: 20 mm}}]}}
  table: {{role: support, position: [0 m, 0 m, -10 mm], parts: [{{box: [2 m, 2 m, 20 mm]}}]}}
hands: {{left: {{fingers: [thumb]}}, right: {{fingers: [thumb]}}}}
"
    );
    let at = |t: f64| moves.iter().rposition(|(begins, ..)| *begins <= t).unwrap_or_default();
    let x = |t: f64, hand: usize| {
        let (begins, to, _) = moves[at(t)];
        let from = moves[at(t).saturating_sub(1)].1;
        from[hand] + (to[hand] - from[hand]) * ((t - begins) / 0.5).clamp(0.0, 1.0)
    };
    let closed = |t: f64, hand: usize| f64::from(u8::from(moves[at(t)].2[hand]));
    let mut log = recording(
        &scene,
        100.0,
        800,
        &[
            ("left.thumb.position.x", &|t| x(t, 0)),
            ("left.thumb.position.y", &|_| 0.1),
            ("left.thumb.position.z", &|t| 0.02 + 0.1 * x(t, 0).abs()),
            ("left.gripper.closed", &|t| closed(t, 0)),
            ("right.thumb.position.x", &|t| x(t, 1)),
            ("right.thumb.position.y", &|_| 0.1),
            ("right.thumb.position.z", &|t| 0.02 + 0.1 * (x(t, 1) - 0.3).abs()),
            ("right.gripper.closed", &|t| closed(t, 1)),
        ],
    );
    log.time.drain(400..450);
    log.columns.values_mut().for_each(|column| drop(column.values.drain(400..450)));
    log
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn a_live_log_moves_objects_with_a_place_as_a_whole_log_does(
        steps in vec(([0.0..0.6_f64, 0.0..0.6], [any::<bool>(), any::<bool>()]), 16),
        apple in 0.0..0.6_f64,
    ) {
        let moves: Vec<Move> = steps.iter().enumerate().map(|(at, (to, closed))| (at as f64 * 0.5, *to, *closed)).collect();
        let log = two_grippers(&moves, apple);
        let names = ["target", "target.position", "target.velocity", "contacts.force", "contacts.normal", "contacts.handled"];
        let channels = names.map(ask);
        let whole = frames(&log, &channels).unwrap();
        prop_assert_eq!(whole.stretches.len(), 2);
        let found = live(&log, &channels);
        prop_assert_eq!(found.keys().collect::<Vec<_>>(), whole.columns.keys().collect::<Vec<_>>());
        for (key, column) in &whole.columns {
            // Sums over windows differ in their last bits.
            let is_other = |(live, whole): (&f64, &f64)| live.to_bits() != whole.to_bits() && (live - whole).abs() > 1e-9;
            let differs = found[key].iter().zip(column).position(is_other);
            let (name, values) = (&channels[key.channel as usize].name, differs.map(|at| (found[key][at], column[at])));
            prop_assert!(differs.is_none() && found[key].len() == column.len(), "{name} {key:?} {differs:?} {values:?}");
        }
    }
}

/// The tared sensor at the wrist feels the cube only until 1.2 s: what hangs still does not pull at it.
#[test]
fn a_closed_gripper_does_not_release_an_object_that_its_wrist_no_longer_feels() {
    let mut log = log(SCENE);
    let pull: Vec<f64> = log.time.iter().map(|t| if *t < 1.2 { 8.0 } else { 0.0 }).collect();
    let force = |axis: &str| if axis == "z" { pull.clone() } else { vec![0.0; pull.len()] };
    log.columns.extend(
        ["x", "y", "z"].map(|axis| {
            (format!("right.palm.force.{axis}"), Column { dimension: Dimension::FORCE, values: force(axis) })
        }),
    );
    let found = frames(&log, &[ask("target.position")]).unwrap();
    let x = column(&found, "target.position", 0, 0);
    for (frame, wanted) in [(110, place(1.1)), (250, place(2.5)), (299, place(2.99)), (550, place(5.5))] {
        assert!((x[frame] - wanted).abs() < 1e-9, "{frame}: {}", x[frame]);
    }
}

/// A gripper closes at 1 s and opens at 5 s. The cube falls at 2 s, and the gripper goes up with 0.1 m/s.
#[test]
fn a_gripper_that_has_lost_its_object_does_not_touch_it_from_afar() {
    let implausible = |at: f64| {
        let height = |t: f64| 0.02 + 0.1 * (t - 1.0).clamp(0.0, 4.0);
        let log = recording(
            SCENE,
            100.0,
            700,
            &[
                ("right.thumb.position.x", &|_| 0.0),
                ("right.thumb.position.y", &|_| 0.0),
                ("right.thumb.position.z", &height),
                ("right.gripper.closed", &|t| f64::from(u8::from((1.0..5.0).contains(&t)))),
                ("cube.position.x", &|_| at),
                ("cube.position.y", &|_| 0.0),
                ("cube.position.z", &|t| if t < 2.0 { height(t) } else { 0.02 }),
            ],
        );
        let issues = frames(&log, &[ask("target.position")]).unwrap().issues;
        issues.into_iter().find(|issue| issue.kind == "implausible_position").map(|issue| issue.message)
    };
    assert_eq!(implausible(0.0), None);
    // It was never at the cube.
    let message = implausible(0.5).unwrap();
    assert!(
        message.starts_with("the gripper is closed while it is ") && message.contains("holds nothing"),
        "{message}"
    );
}

/// The flag of a gripper, or of a relaxed hand, is one fact about all of its fingertips.
#[test]
fn a_closed_gripper_far_from_all_objects_is_one_issue() {
    let at = |place: f64| move |_: f64| place;
    let log = recording(
        &SCENE.replace("[thumb]", "[thumb, index]"),
        100.0,
        500,
        &[
            ("right.thumb.position.x", &at(0.56)),
            ("right.thumb.position.y", &at(0.0)),
            ("right.thumb.position.z", &at(0.02)),
            ("right.index.position.x", &at(0.52)),
            ("right.index.position.y", &at(0.0)),
            ("right.index.position.z", &at(0.02)),
            ("right.gripper.closed", &|t| f64::from(u8::from((1.0..3.0).contains(&t)))),
            ("cube.position.x", &at(0.0)),
            ("cube.position.y", &at(0.0)),
            ("cube.position.z", &at(0.02)),
        ],
    );
    let issues = frames(&log, &[ask("target.position")]).unwrap().issues;
    let found: Vec<_> = issues.iter().filter(|issue| issue.kind == "implausible_position").collect();
    let [issue] = found.as_slice() else { panic!("{found:?}") };
    assert_eq!(issue.channel, "right.index.position");
    assert!(issue.message.contains("is 500 mm from"), "{}", issue.message);
    for cause in ["`right.gripper.closed` has the wrong direction", "beyond `grip_reach`"] {
        assert!(issue.message.contains(cause), "{}", issue.message);
    }
}

#[test]
fn a_touch_is_not_far_from_it() {
    let implausible = |scene: &str| {
        let channels = [ask("target.position")];
        frames(&log(scene), &channels).unwrap().issues.iter().any(|issue| issue.kind == "implausible_position")
    };
    assert!(!implausible(SCENE));
    assert!(implausible(&SCENE.replace("role: object,", "role: object, position: [0 m, 0 m, 1 m],")));
}
