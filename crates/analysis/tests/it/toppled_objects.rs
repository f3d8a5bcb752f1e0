//! An object that falls after a hand has let it go: it topples off its support, or is meant to fall.

use crate::one_gripper::{Signal, along, analysis, log, starts};
use teachtree_analysis::outcome::OutcomeKind;
use teachtree_analysis::{Analysis, TrackId};
use teachtree_base::hands::Side;

/// When the hand lets go, s.
const LETS_GO_S: f64 = 5.0;

/// How the hand is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Hand {
    /// A gripper with its flag and opening.
    Gripper,
    /// The contact flags of thumb and index finger.
    Fingers,
}

/// What carries the box until it falls.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Stand {
    /// A body that the scene lacks.
    Unknown,
    Shelf,
    /// Another object.
    Object,
}

/// A fall of a box of 50 mm.
#[derive(Clone, Copy, Debug)]
struct Fall {
    /// Time after the hand has let go, s.
    after_s: f64,
    /// The fall, m.
    way_m: f64,
    stand: Stand,
}

/// The analysis of a hand that takes a box from a table, carries it, and lets it go above the table.
fn found(hand: Hand, fall: Fall) -> Analysis {
    const TABLE: &str = "table: {role: support, position: [0 m, 0 m, -10 mm], parts: [{box: [3 m, 3 m, 20 mm]}]}";
    let Fall { after_s, way_m, stand } = fall;
    let place = format!("[300 mm, 0 mm, {} mm]", way_m.mul_add(1e3, -10.0));
    let carrier = match stand {
        Stand::Unknown => String::new(),
        Stand::Shelf => {
            format!(", shelf: {{role: support, position: {place}, parts: [{{box: [80 mm, 80 mm, 20 mm]}}]}}")
        }
        Stand::Object => {
            format!(", block: {{role: object, position: {place}, parts: [{{box: [80 mm, 80 mm, 20 mm]}}]}}")
        }
    };
    let fingers = if hand == Hand::Gripper { "thumb" } else { "thumb, index" };
    let scene = format!(
        "{{bodies: {{box: {{role: object, parts: [{{box: [50 mm, 50 mm, 50 mm]}}]}}, {TABLE}{carrier}}}, hands: {{right: {{fingers: [{fingers}]}}}}}}"
    );
    let lifted = |t: f64| along(t, &[(2.6, 0.0), (3.2, 0.4), (4.0, 0.4), (4.6, way_m)]);
    let x = |t: f64| along(t, &[(2.6, 0.0), (4.0, 0.3), (6.0, 0.3), (7.0, 0.0)]);
    let z = |t: f64| match t {
        t if t < 2.6 => along(t, &[(0.0, 0.3), (1.5, 0.03)]),
        t if t < LETS_GO_S + 0.3 => 0.03 + lifted(t),
        t => along(t, &[(LETS_GO_S + 0.3, 0.03 + way_m), (LETS_GO_S + 1.2, 0.5)]),
    };
    let box_x = |t: f64| x(t.min(LETS_GO_S));
    let fallen = |t: f64| (4.9 * (t - LETS_GO_S - after_s).max(0.0).powi(2)).min(way_m);
    let box_z = |t: f64| 0.025 + lifted(t) - fallen(t);
    let spread = |t: f64| along(t, &[(1.8, 0.04), (2.2, 0.025), (LETS_GO_S, 0.025), (LETS_GO_S + 0.3, 0.04)]);
    let is_held = |t: f64| f64::from(u8::from((2.1..LETS_GO_S).contains(&t)));
    let is_closed = |t: f64| f64::from(u8::from((2.1..LETS_GO_S + 0.05).contains(&t)));
    let (opening, left, right) = (|t: f64| 2.0 * spread(t), |t: f64| -spread(t), spread);
    let mut signals: Vec<Signal> = vec![
        ("right.thumb.position.x", &x),
        ("right.thumb.position.z", &z),
        ("box.position.x", &box_x),
        ("box.position.y", &|_| 0.0),
        ("box.position.z", &box_z),
    ];
    let of_hand: &[Signal] = match hand {
        Hand::Gripper => &[
            ("right.thumb.position.y", &|_| 0.0),
            ("right.gripper.closed", &is_closed),
            ("right.gripper.opening", &opening),
        ],
        Hand::Fingers => &[
            ("right.thumb.position.y", &left),
            ("right.thumb.contact", &is_held),
            ("right.index.position.x", &x),
            ("right.index.position.y", &right),
            ("right.index.position.z", &z),
            ("right.index.contact", &is_held),
        ],
    };
    signals.extend(of_hand);
    let block_z = |_: f64| way_m - 0.01;
    if stand == Stand::Object {
        let of_block: [Signal; 3] =
            [("block.position.x", &|_| 0.3), ("block.position.y", &|_| 0.0), ("block.position.z", &block_z)];
        signals.extend(of_block);
    }
    let hand_model = if hand == Hand::Gripper { "hand_gripper.rules" } else { "hand_flags.rules" };
    analysis(&log(&scene, 9, &signals), &["failures.rules"], hand_model)
}

/// It falls after it stood for some time, while the hand is still at it or later. The task whose object falls ends with the release.
#[test]
fn an_object_that_topples_off_its_support_is_a_failure() {
    let falls = [
        (0.25, 0.1, Stand::Shelf),
        (0.25, 0.07, Stand::Object),
        (0.8, 0.05, Stand::Shelf),
        (0.5, 0.1, Stand::Unknown),
        (0.8, 0.3, Stand::Unknown),
        (1.2, 0.1, Stand::Shelf),
    ];
    for hand in [Hand::Gripper, Hand::Fingers] {
        for (after_s, way_m, stand) in falls {
            let fall = Fall { after_s, way_m, stand };
            let analysis = found(hand, fall);
            let track = analysis.track(TrackId::Hand(Side::Right)).unwrap();
            let topples = starts(&track.relabeled, "Topple");
            let context = format!("{hand:?} {fall:?}: {:?}", track.relabeled);
            assert!(topples.len() == 1 && (topples[0] - LETS_GO_S - after_s).abs() < 0.15, "{context}");
            let tasks: Vec<_> =
                track.tasks.iter().map(|task| (task.task.as_str(), task.subject.object.as_deref())).collect();
            assert_eq!(tasks, [("pick_and_place", Some("box")), ("toppled", Some("box"))], "{context}");
            assert_eq!(analysis.outcome().result, OutcomeKind::Failure, "{context}");
        }
    }
}

/// It falls at once, or as the jaws open, and then stands; or it sinks by less than `topple_way`.
#[test]
fn an_object_that_is_let_go_above_a_bin_does_not_topple() {
    let falls = [(0.0, 0.04), (0.0, 0.1), (0.0, 0.3), (0.1, 0.1), (0.1, 0.3)];
    let falls = falls.map(|(after_s, way_m)| (after_s, way_m, Stand::Unknown));
    for hand in [Hand::Gripper, Hand::Fingers] {
        for (after_s, way_m, stand) in falls.into_iter().chain([(0.5, 0.025, Stand::Shelf)]) {
            let fall = Fall { after_s, way_m, stand };
            let found = found(hand, fall);
            let track = found.track(TrackId::Hand(Side::Right)).unwrap();
            assert!(starts(&track.relabeled, "Topple").is_empty(), "{hand:?} {fall:?}: {:?}", track.relabeled);
        }
    }
}
