//! Jaws that open while the closed flag is still set: the flag ends far from where the jaws are shut.

use crate::one_gripper::{Signal, along, log, segments};

const SCENE: &str =
    "{bodies: {box: {role: object, parts: [{box: [50 mm, 50 mm, 50 mm]}]}}, hands: {right: {fingers: [thumb, palm]}}}";

/// The primitives before 2.5 s of a gripper at a box, whose opening has these values, m, at these times, s. The flag is set below 40 mm.
fn before(openings: &[(f64, f64)]) -> Vec<String> {
    let opening = |t: f64| along(t, openings);
    let closed = |t: f64| f64::from(u8::from(opening(t) < 0.04));
    let signals: [Signal; 8] = [
        ("right.thumb.position.x", &|_| 0.0),
        ("right.thumb.position.y", &|_| 0.0),
        ("right.thumb.position.z", &|_| 0.03),
        ("right.gripper.closed", &closed),
        ("right.gripper.opening", &opening),
        ("box.position.x", &|_| 0.0),
        ("box.position.y", &|_| 0.0),
        ("box.position.z", &|_| 0.025),
    ];
    let found = segments(&log(SCENE, 5, &signals), &["contact.rules"], "hand_gripper.rules");
    found.into_iter().take_while(|segment| segment.start_s < 2.5).map(|segment| segment.primitive).collect()
}

#[test]
fn jaws_that_open_do_not_begin_to_hold() {
    let has_grasp = |openings: &[(f64, f64)]| before(openings).iter().any(|primitive| primitive == "Grasp");
    // From where they are shut, without and with a pause.
    let opening: [&[(f64, f64)]; 2] =
        [&[(0.5, 0.001), (2.0, 0.08)], &[(0.5, 0.001), (1.0, 0.02), (1.4, 0.02), (2.0, 0.08)]];
    for openings in opening {
        assert!(!has_grasp(openings), "{openings:?}: {:?}", before(openings));
    }
    // They rest at an object before they open, or close on it after they have opened in part.
    let holding: [&[(f64, f64)]; 2] =
        [&[(0.5, 0.02), (2.0, 0.08)], &[(0.2, 0.001), (0.6, 0.03), (1.0, 0.03), (1.2, 0.02), (2.4, 0.02), (2.6, 0.08)]];
    for openings in holding {
        assert!(has_grasp(openings), "{openings:?}: {:?}", before(openings));
    }
}
