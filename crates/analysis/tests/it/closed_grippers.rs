//! A gripper that is closed and empty: it pushes a box, or misses it.

use crate::one_gripper::{Signal, along, analysis, log};
use teachtree_analysis::outcome::OutcomeKind;
use teachtree_analysis::{Analysis, Track, TrackId};
use teachtree_base::hands::Side;

const BOX: &str = "box: {role: object, parts: [{box: [50 mm, 50 mm, 50 mm]}]}";
const TABLE: &str = "table: {role: support, position: [0 m, 0 m, -10 mm], parts: [{box: [3 m, 3 m, 20 mm]}]}";

/// What a cell measures beside the poses of the tool point and of the box.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Sensors {
    /// The closed flag.
    Flag,
    /// The flag and the opening.
    Opening,
    /// The flag and the force at the wrist.
    Wrist,
}

/// The times of a motion, s, and the path of the box, m.
#[derive(Clone, Copy)]
struct Motion {
    /// The jaws begin to close; they take 0.5 s.
    closes_s: f64,
    /// The tool point, 25 mm to 35 mm from the side of the box at 3 s, goes this far with the box from 4 s to 6 s.
    pushes_m: f64,
}

/// The analysis of a gripper that comes down beside a box, stays there until 6.5 s, and leaves closed.
fn found(sensors: Sensors, on_table: bool, motion: Motion) -> Analysis {
    let bodies = if on_table { format!("{BOX}, {TABLE}") } else { BOX.to_string() };
    let scene = format!("{{bodies: {{{bodies}}}, hands: {{right: {{fingers: [thumb, palm]}}}}}}");
    let Motion { closes_s, pushes_m } = motion;
    let x = |t: f64| {
        along(
            t,
            &[(1.0, -0.25), (3.0, -0.06), (4.0, -0.035), (6.0, pushes_m - 0.035), (6.5, pushes_m - 0.035), (7.5, -0.2)],
        )
    };
    let z = |t: f64| along(t, &[(1.0, 0.3), (3.0, 0.03), (6.5, 0.03), (7.5, 0.3)]);
    let of_box = |t: f64| along(t, &[(4.0, 0.0), (6.0, pushes_m)]);
    let opening = |t: f64| along(t, &[(closes_s, 0.08), (closes_s + 0.5, 0.0005)]);
    let closed = |t: f64| f64::from(u8::from(t > closes_s + 0.3));
    let force = |t: f64| along(t, &[(3.9, 0.0), (4.0, 8.0), (6.4, 8.0), (6.5, 0.0)]);
    let mut signals: Vec<Signal> = vec![
        ("right.thumb.position.x", &x),
        ("right.thumb.position.y", &|_| 0.0),
        ("right.thumb.position.z", &z),
        ("right.gripper.closed", &closed),
        ("box.position.x", &of_box),
        ("box.position.y", &|_| 0.0),
        ("box.position.z", &|_| 0.025),
    ];
    match sensors {
        Sensors::Flag => {}
        Sensors::Opening => signals.push(("right.gripper.opening", &opening)),
        Sensors::Wrist => {
            let of_force: [Signal; 3] =
                [("right.palm.force.x", &force), ("right.palm.force.y", &|_| 0.0), ("right.palm.force.z", &|_| 0.0)];
            signals.extend(of_force);
        }
    }
    let hand_model = if sensors == Sensors::Wrist { "hand_gripper_wrist.rules" } else { "hand_gripper.rules" };
    analysis(&log(&scene, 9, &signals), &["failures.rules"], hand_model)
}

fn hand(found: &Analysis) -> &Track {
    found.track(TrackId::Hand(Side::Right)).unwrap()
}

fn primitives(of: &Track) -> Vec<&str> {
    of.relabeled.iter().map(|segment| segment.primitive.as_str()).collect()
}

/// It closes far from the box, within its reach, or beside it. The flag alone does not show a push by a gripper that closes beside the box.
#[test]
fn a_closed_empty_gripper_pushes() {
    let cases = [
        (Sensors::Flag, -1.0),
        (Sensors::Flag, 1.5),
        (Sensors::Opening, 1.5),
        (Sensors::Opening, 2.8),
        (Sensors::Wrist, 1.5),
    ];
    for ((sensors, closes_s), on_table) in cases.into_iter().flat_map(|case| [(case, false), (case, true)]) {
        let analysis = found(sensors, on_table, Motion { closes_s, pushes_m: 0.2 });
        let found = hand(&analysis);
        let context = format!("{sensors:?}, closes at {closes_s} s, on a table: {on_table}: {:?}", found.relabeled);
        assert_eq!(primitives(found), ["Move", "Approach", "Push", "Release", "Move"], "{context}");
        assert!((found.relabeled[2].start_s - 4.0).abs() < 0.1, "{context}");
        // The force at the wrist shows that the gripper leaves the box later than the box stops.
        let leaves_s = if sensors == Sensors::Wrist { 6.5 } else { 6.0 };
        assert!((found.relabeled[2].end_s - leaves_s).abs() < 0.1, "{context}");
        let tasks: Vec<&str> = found.tasks.iter().map(|task| task.task.as_str()).collect();
        assert_eq!(tasks, ["push"], "{context}");
    }
}

#[test]
fn a_gripper_that_shuts_beside_a_box_and_only_touches_it_misses() {
    for on_table in [false, true] {
        let found = found(Sensors::Opening, on_table, Motion { closes_s: 3.0, pushes_m: 0.008 });
        assert!(primitives(hand(&found)).contains(&"Miss"), "{:?}", hand(&found).relabeled);
    }
}

/// By its flag, the gripper holds the box until the end, but it leaves the box behind.
#[test]
fn a_task_without_its_release_is_cut_off() {
    let found = found(Sensors::Flag, true, Motion { closes_s: 2.8, pushes_m: 0.2 });
    assert_eq!(primitives(hand(&found)).last(), Some(&"Move"), "{:?}", hand(&found).relabeled);
    assert_eq!(hand(&found).tasks.len(), 1);
    assert!(hand(&found).tasks[0].open_end);
    assert_eq!(found.outcome().result, OutcomeKind::Unknown, "{}", found.outcome().sentence());
}
