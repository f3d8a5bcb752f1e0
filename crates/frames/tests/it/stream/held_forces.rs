//! Downward forces of a hand on what it holds: a wrong sign, or a press on a body that the scene lacks.

use super::ask;
use crate::shared::recordings::recording;
use teachtree_base::recording::Recording;
use teachtree_frames::frames;
use teachtree_world::{shipped, teach};

/// A gripper with a force sensor at its wrist, and a peg of 1 N on a table.
const SCENE: &str = "
bodies:
  peg: {role: object, parts: [{box: [20 mm, 20 mm, 60 mm]}]}
  table: {role: support, position: [0 mm, 0 mm, -25 mm], parts: [{box: [2 m, 2 m, 50 mm]}]}
hands:
  right: {fingers: [thumb, palm]}
";
/// Before the following times, the hand is empty for this long, s, which gives the force at rest.
const EMPTY_SECS: f64 = 8.0;
/// The hand is 200 mm away before, and the gripper is open, s.
const EMPTY_UNTIL: f64 = 1.0;
/// The peg is lifted by 100 mm, moved and lowered by 50 mm before and after; in between it is at one place in the air, s.
const HELD: [f64; 2] = [4.0, 6.0];

/// The recording, with the upward force of the hand as a function of time, of the force that bears the peg and of whether the peg is held at one place.
fn log(force: impl Fn(f64, bool) -> f64) -> Recording {
    let ease = |t: f64, from: f64, to: f64| {
        let share = ((t - from) / (to - from)).clamp(0.0, 1.0);
        share * share * (3.0 - 2.0 * share)
    };
    let (start, end) = (HELD[0], HELD[1]);
    let height = move |t: f64| 0.03 + 0.1 * ease(t, 1.5, 2.5) - 0.05 * (ease(t, 3.0, start) - ease(t, end, end + 1.0));
    let along = move |t: f64| 0.3 * ease(t, 2.5, 3.0);
    let away = |t: f64| if t < EMPTY_UNTIL { 0.2 } else { 0.0 };
    let upward = |t: f64| {
        let bears = if t > 1.6 { 1.0 } else { 0.0 };
        // The press begins after the peg has stopped.
        force(bears, (start + 0.2..end - 0.2).contains(&t)) + 0.02 * (t * 7.3e3).sin()
    };
    let begun = |t: f64| t - EMPTY_SECS;
    recording(
        SCENE,
        100.0,
        1600,
        &[
            ("right.thumb.position.x", &|t| along(begun(t)) - away(begun(t))),
            ("right.thumb.position.y", &|_| 0.0),
            ("right.thumb.position.z", &|t| height(begun(t)) + 0.02),
            ("right.palm.force.x", &|_| 0.0),
            ("right.palm.force.y", &|_| 0.0),
            ("right.palm.force.z", &|t| upward(begun(t))),
            ("right.gripper.closed", &|t| f64::from(u8::from(begun(t) > EMPTY_UNTIL + 0.2))),
            ("peg.position.x", &|t| along(begun(t))),
            ("peg.position.y", &|_| 0.0),
            ("peg.position.z", &|t| height(begun(t))),
        ],
    )
}

/// The issues of forces and missing bodies of a recording.
fn found(recording: &Recording) -> Vec<String> {
    let issues = frames(recording, &[ask("contacts.force")]).unwrap().issues;
    let of_kind = issues.into_iter().filter(|issue| ["implausible_force", "missing_body"].contains(&issue.kind.name()));
    of_kind.map(|issue| format!("{} {}: {}", issue.kind, issue.channel, issue.message)).collect()
}

#[test]
fn a_press_of_a_held_object_on_nothing_names_a_missing_body() {
    assert_eq!(found(&log(|bears, _| bears)), [""; 0]);
    let press = |bears: f64, presses: bool| if presses { bears - 16.0 } else { bears };
    let message = "missing_body right.fingers.force: `peg` stops at [300 mm, 0 mm, 80 mm] while the hand presses it down with 15 N, and it touches no body \
                   of the scene: the scene lacks the body below it, such as a socket";
    assert_eq!(found(&log(press)), [message]);
    // The body is there.
    let mut with_block = log(press);
    let block =
        "bodies: {block: {role: support, position: [300 mm, 0 mm, 25 mm], parts: [{box: [100 mm, 100 mm, 50 mm]}]}}";
    let block: teachtree_base::scene::Scene = teachtree_base::yaml::read(block, "scene").unwrap();
    with_block.scene.bodies.extend(block.bodies);
    assert_eq!(found(&with_block), [""; 0]);
    // Its height is wrong by less than shapes may be.
    with_block.scene.bodies["block"].position[2].0 -= 0.003;
    assert_eq!(found(&with_block), [""; 0]);
}

#[test]
fn a_downward_force_in_free_motion_is_a_wrong_sign() {
    let turned = found(&log(|bears, _| -bears));
    assert!(
        turned.len() == 1
            && turned[0].ends_with("turn the sign, the force is the fingertip's on the object, z upwards"),
        "{turned:?}"
    );
    // A heavy object that stops is not pressed: its force has the wrong sign.
    let heavy = found(&log(|bears, _| -20.0 * bears));
    assert!(heavy.len() == 1 && heavy[0].contains("turn the sign"), "{heavy:?}");
}

#[test]
fn no_simulated_operator_presses_on_a_missing_body() {
    for name in shipped::names() {
        let recording = teach(&shipped::scene(name).unwrap(), &shipped::operator(name).unwrap(), 1).unwrap();
        assert_eq!(found(&recording), [""; 0], "{name}");
    }
    for (operator, scene) in shipped::failing() {
        let recording = teach(&shipped::scene(scene).unwrap(), &shipped::operator(operator).unwrap(), 1).unwrap();
        assert_eq!(found(&recording), [""; 0], "{operator}");
    }
}
