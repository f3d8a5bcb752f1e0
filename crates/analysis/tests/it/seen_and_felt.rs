//! A hand of which only the fingertips are seen, at an object without sensors.

use crate::one_gripper::{along, log, segments, starts};

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
