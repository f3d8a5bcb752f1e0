//! An object that falls after a hand has let it go: it topples off its support, or is meant to fall.

use crate::object_motion::explained;
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

/// How the box goes down.
#[derive(Clone, Copy, Debug)]
enum Motion {
    Falls,
    /// On a lift of this speed, m/s.
    Lowered(f64),
    /// A camera corrects its pose.
    Jumps,
    /// It tilts over an edge, ever faster, and falls.
    Tilts(f64),
}

/// A fall of a box of 50 mm.
#[derive(Clone, Copy, Debug)]
struct Fall {
    /// Time after the hand has let go, s.
    after_s: f64,
    /// The fall, m.
    way_m: f64,
    stand: Stand,
    motion: Motion,
}

/// The analysis of a hand that takes a box from a table, carries it, and lets it go above the table.
fn found(hand: Hand, fall: Fall) -> Analysis {
    const TABLE: &str = "table: {role: support, position: [0 m, 0 m, -10 mm], parts: [{box: [3 m, 3 m, 20 mm]}]}";
    let Fall { after_s, way_m, stand, motion } = fall;
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
    let fallen = |t: f64| {
        let time_s = (t - LETS_GO_S - after_s).max(0.0);
        let fallen_m = match motion {
            Motion::Falls => 4.9 * time_s.powi(2),
            Motion::Lowered(speed) => speed * time_s,
            // From 0.02 rad; at 1 rad it leaves the edge.
            Motion::Tilts(tau_s) => {
                let leaves_s = tau_s * 50.0_f64.ln();
                let angle = 0.02 * (time_s.min(leaves_s) / tau_s).exp_m1();
                let free_s = (time_s - leaves_s).max(0.0);
                0.025 * (1.4 * (1.0 - angle.cos()) + 0.6 * angle.sin()) + free_s * (0.0175 / tau_s + 4.9 * free_s)
            }
            Motion::Jumps if time_s > 0.0 => way_m,
            Motion::Jumps => 0.0,
        };
        fallen_m.min(way_m)
    };
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
    explained(&log(&scene, 9, &signals), hand_model, &[])
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
            let fall = Fall { after_s, way_m, stand, motion: Motion::Falls };
            let analysis = found(hand, fall);
            let track = analysis.track(TrackId::Hand(Side::Right)).unwrap();
            let topples = starts(&track.relabeled, "Topple");
            let context = format!("{hand:?} {fall:?}: {:?}", track.relabeled);
            assert!(topples.len() == 1 && (topples[0] - LETS_GO_S - after_s).abs() < 0.15, "{context}");
            let tasks: Vec<_> =
                track.tasks.iter().map(|task| (task.task.as_str(), task.subject.object.as_deref())).collect();
            assert_eq!(tasks, [("pick_and_place", Some("box")), ("toppled", Some("box"))], "{context}");
            assert_eq!(analysis.outcome().result, OutcomeKind::Failure, "{context}");
            // It did not fall out of the hand, and `drop_way` is not its param.
            assert_eq!(analysis.falls, [], "{context}");
        }
    }
}

/// It stands on a known support until the hand lets it go.
#[test]
fn an_object_that_tilts_off_its_support_as_it_is_let_go_is_a_failure() {
    for hand in [Hand::Gripper, Hand::Fingers] {
        for (tau_s, way_m) in [(0.07, 0.06), (0.12, 0.06), (0.07, 0.15), (0.12, 0.15)] {
            let fall = Fall { after_s: 0.0, way_m, stand: Stand::Shelf, motion: Motion::Tilts(tau_s) };
            let analysis = found(hand, fall);
            let track = analysis.track(TrackId::Hand(Side::Right)).unwrap();
            let tasks: Vec<&str> = track.tasks.iter().map(|task| task.task.as_str()).collect();
            assert_eq!(tasks, ["pick_and_place", "toppled"], "{hand:?} {fall:?}: {:?}", track.relabeled);
            assert_eq!(analysis.outcome().result, OutcomeKind::Failure, "{hand:?} {fall:?}");
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
            let fall = Fall { after_s, way_m, stand, motion: Motion::Falls };
            let found = found(hand, fall);
            let track = found.track(TrackId::Hand(Side::Right)).unwrap();
            assert!(starts(&track.relabeled, "Topple").is_empty(), "{hand:?} {fall:?}: {:?}", track.relabeled);
        }
    }
}

/// A lift takes it down at a constant speed, or a camera that saw it too high sees it again.
#[test]
fn an_object_that_is_lowered_or_measured_anew_does_not_topple() {
    let falls = [(0.3, 0.1, Motion::Lowered(0.2)), (0.3, 0.1, Motion::Lowered(0.3)), (0.65, 0.035, Motion::Jumps)];
    for hand in [Hand::Gripper, Hand::Fingers] {
        for (after_s, way_m, motion) in falls {
            let fall = Fall { after_s, way_m, stand: Stand::Unknown, motion };
            let found = found(hand, fall);
            assert_eq!(found.outcome().result, OutcomeKind::Success, "{hand:?} {fall:?}: {:?}", found.outcome());
        }
    }
}

/// The right hand puts a cup on a tray that the left hand holds in the air. 0.4 s later the left hand lowers the tray fast, or the cup falls off it.
#[test]
fn what_sinks_with_the_tray_of_the_other_hand_does_not_topple() {
    const SCENE: &str = "
bodies:
  cup: {role: object, parts: [{box: [50 mm, 50 mm, 50 mm]}]}
  tray: {role: object, parts: [{box: [80 mm, 80 mm, 20 mm]}]}
  table: {role: support, position: [0 m, 0 m, -10 mm], parts: [{box: [3 m, 3 m, 20 mm]}]}
hands: {right: {fingers: [thumb]}, left: {fingers: [thumb]}}
";
    const SINKS_S: f64 = LETS_GO_S + 0.4;
    for speed in [Some(0.5), Some(0.8), None] {
        let right_x = |t: f64| along(t, &[(3.2, 0.0), (4.4, 0.4)]);
        let right_z = |t: f64| {
            along(t, &[(0.0, 0.4), (1.5, 0.03), (2.2, 0.03), (3.2, 0.35), (4.8, 0.19), (5.2, 0.19), (6.0, 0.5)])
        };
        let right_opening = |t: f64| along(t, &[(1.6, 0.08), (2.0, 0.05), (LETS_GO_S, 0.05), (LETS_GO_S + 0.2, 0.08)]);
        let lowered = |t: f64| speed.map_or(0.0, |speed| (speed * (t - SINKS_S).max(0.0)).min(0.15));
        let left_z = |t: f64| along(t, &[(0.0, 0.3), (1.0, 0.01), (1.8, 0.01), (2.6, 0.16)]) - lowered(t);
        let left_opening = |t: f64| along(t, &[(1.1, 0.08), (1.5, 0.02), (7.0, 0.02), (7.3, 0.08)]);
        let tray_z = |t: f64| if t < 1.8 { 0.01 } else { left_z(t) };
        let falls_s = |t: f64| if speed.is_some() { 0.0 } else { (t - SINKS_S).max(0.0) };
        let cup_x = |t: f64| right_x(t.min(LETS_GO_S)) + 1.2 * falls_s(t).min(0.17);
        let cup_z = |t: f64| match t {
            t if t < 2.2 => 0.025,
            t if t < LETS_GO_S => right_z(t) + 0.005,
            t => tray_z(t) + 0.035 - (4.9 * falls_s(t).powi(2)).min(0.15),
        };
        let signals: [Signal; 16] = [
            ("right.thumb.position.x", &right_x),
            ("right.thumb.position.y", &|_| 0.0),
            ("right.thumb.position.z", &right_z),
            ("right.gripper.closed", &|t| f64::from(u8::from((1.95..LETS_GO_S).contains(&t)))),
            ("right.gripper.opening", &right_opening),
            ("left.thumb.position.x", &|_| 0.4),
            ("left.thumb.position.y", &|_| 0.15),
            ("left.thumb.position.z", &left_z),
            ("left.gripper.closed", &|t| f64::from(u8::from((1.45..7.0).contains(&t)))),
            ("left.gripper.opening", &left_opening),
            ("cup.position.x", &cup_x),
            ("cup.position.y", &|_| 0.0),
            ("cup.position.z", &cup_z),
            ("tray.position.x", &|_| 0.4),
            ("tray.position.y", &|_| 0.0),
            ("tray.position.z", &tray_z),
        ];
        let found = analysis(&log(SCENE, 9, &signals), &["bimanual.rules", "failures.rules"], "hand_gripper.rules");
        let track = found.track(TrackId::Hand(Side::Right)).unwrap();
        let topples = track.tasks.iter().filter(|task| task.task == "toppled").count();
        assert_eq!(topples, usize::from(speed.is_none()), "{speed:?}: {:?}", track.relabeled);
    }
}
