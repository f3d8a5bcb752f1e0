//! A hand with tracked fingertips only, and a tool with a force sensor at its wrist, at an object without sensors.

use crate::one_gripper::{along, log, segments, starts};
use teachtree_analysis::Segment;

/// A bottle stands on a table and is lifted from 5 s to 6 s. The middles of the fingertips are 27 mm from it from 3 s to 4 s, 8 mm from 4.2 s to 7 s.
#[test]
fn fingers_beside_a_tall_object_do_not_hold_it() {
    const SCENE: &str = "
bodies:
  bottle: {role: object, parts: [{cylinder: [35 mm, 220 mm]}]}
  table: {role: support, position: [0 mm, 0 mm, -10 mm], parts: [{box: [1 m, 1 m, 20 mm]}]}
hands: {right: {fingers: [thumb, index]}}
";
    let spread = |t: f64| {
        along(
            t,
            &[
                (1.0, 0.3),
                (3.0, 0.062),
                (4.0, 0.062),
                (4.2, 0.043),
                (7.0, 0.043),
                (7.2, 0.062),
                (8.0, 0.062),
                (9.0, 0.3),
            ],
        )
    };
    let height = |t: f64| 0.11 + 0.15 * (along(t, &[(5.0, 0.0), (5.5, 1.0)]) - along(t, &[(6.0, 0.0), (6.5, 1.0)]));
    let log = log(
        SCENE,
        10,
        &[
            ("right.thumb.position.x", &spread),
            ("right.thumb.position.y", &|_| 0.0),
            ("right.thumb.position.z", &height),
            ("right.index.position.x", &|t| -spread(t)),
            ("right.index.position.y", &|_| 0.0),
            ("right.index.position.z", &height),
            ("bottle.position.x", &|_| 0.0),
            ("bottle.position.y", &|_| 0.0),
            ("bottle.position.z", &height),
        ],
    );
    let found = segments(&log, &["contact.rules"], "hand_vision.rules");
    for (primitive, at) in [("Grasp", 4.2), ("Release", 7.0)] {
        let times = starts(&found, primitive);
        assert!(times.len() == 1 && (times[0] - at).abs() < 0.15, "{primitive} {at}: {found:?}");
    }
}

/// A tool touches a block from 2 s to 6 s and moves it by 0.2 m from 2.2 s to 5 s, along a wall or not.
#[test]
fn a_tool_pushes_an_object_where_no_wall_is_beside_it() {
    let x = |t: f64| along(t, &[(2.2, 0.0), (5.0, 0.2)]);
    let tool = |t: f64| x(t) - 0.06 - along(t, &[(0.0, 0.3), (2.0, 0.0), (6.0, 0.0), (7.0, 0.3)]);
    let of = |block: &str, wall_force: f64| {
        let scene = format!(
            "{{bodies: {{block: {{role: object, radius: 50 mm{block}}}, wall: {{role: wall}}}}, hands: {{right: {{fingers: [thumb, palm]}}}}}}"
        );
        let log = log(
            &scene,
            8,
            &[
                ("right.thumb.position.x", &tool),
                ("right.thumb.position.y", &|_| 0.0),
                ("right.thumb.position.z", &|_| 0.05),
                ("right.palm.force.x", &|t| if (2.0..6.0).contains(&t) { 10.0 } else { 0.0 }),
                ("right.palm.force.y", &|_| 0.0),
                ("right.palm.force.z", &|_| 0.0),
                ("block.position.x", &x),
                ("block.position.y", &|_| 0.0),
                ("block.position.z", &|_| 0.05),
                ("contact.block.wall.force.x", &|_| 0.0),
                ("contact.block.wall.force.y", &|_| -wall_force),
                ("contact.block.wall.force.z", &|_| 0.0),
            ],
        );
        segments(&log, &["contact.rules"], "hand_wrist.rules")
    };
    let counts = |found: &[Segment]| ["Push", "Trace"].map(|primitive| starts(found, primitive).len());
    let pushed = of("", 0.0);
    assert_eq!(counts(&pushed), [1, 0], "{pushed:?}");
    assert!((2.2..2.6).contains(&starts(&pushed, "Push")[0]), "{pushed:?}");
    // The tool itself slides along a surface, and a block beside a wall along it.
    for (block, wall_force) in [(", fixed_to: right", 0.0), ("", 5.0)] {
        let traced = of(block, wall_force);
        assert_eq!(counts(&traced), [0, 1], "{traced:?}");
    }
}
