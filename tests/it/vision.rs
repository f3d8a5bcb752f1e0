//! Hands that are seen and feel nothing: what moves with a hand is held where it rises, and pushed where it stays down.

use crate::program::{said, teachtree_in};
use std::fmt::Write as _;

/// Where the middle of the fingertips, or an object, is at a time, s, m.
type Trajectory<'a> = &'a dyn Fn(f64) -> [f64; 3];

/// From 0 to 1 between two times.
fn ramp(time: f64, from: f64, to: f64) -> f64 {
    ((time - from) / (to - from)).clamp(0.0, 1.0)
}

/// The raw primitives of a hand in 10 s at 100 Hz, of hands whose three fingertips go these ways and are so far apart, m.
fn found(hands: &[(&str, Trajectory)], spread: &dyn Fn(f64) -> f64, object: Trajectory, of: &str) -> Vec<String> {
    let mut log = "time [s]".to_string();
    let fingers = ["thumb", "index", "middle"];
    for (side, _) in hands {
        for finger in fingers {
            ["x", "y", "z"].iter().for_each(|axis| write!(log, ",{side}.{finger}.position.{axis} [m]").unwrap());
        }
    }
    log += ",a.position.x [m],a.position.y [m],a.position.z [m],a.rotation.w,a.rotation.x,a.rotation.y,a.rotation.z\n";
    for row in 0..1000 {
        let time = f64::from(row) * 0.01;
        write!(log, "{time}").unwrap();
        for (_, way) in hands {
            let [x, y, z] = way(time);
            for (dx, dy) in [(1.0, 0.0), (-1.0, 1.0), (0.0, -1.0)] {
                write!(log, ",{},{},{z}", x + dx * spread(time), y + dy * spread(time)).unwrap();
            }
        }
        let [x, y, z] = object(time);
        writeln!(log, ",{x},{y},{z},1,0,0,0").unwrap();
    }
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("log.csv"), log).unwrap();
    let listed: String =
        hands.iter().map(|(side, _)| format!("  {side}: {{fingers: [thumb, index, middle]}}\n")).collect();
    let scene = format!("bodies:\n  a: {{role: object, radius: 40 mm}}\nhands:\n{listed}");
    std::fs::write(folder.path().join("log.scene.yaml"), scene).unwrap();
    let words = ["analyze", "log.csv", "--hand", "hand_vision.rules", "--format", "csv"];
    let table = said(&teachtree_in(folder.path(), &words));
    let cells = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
    cells.filter(|row| row.get(1) == Some(&of) && row.get(2) == Some(&"raw")).map(|row| row[3].to_string()).collect()
}

/// A pan: its handle is 180 mm from its origin.
#[test]
fn what_rises_with_a_hand_is_held_wherever_its_handle_is() {
    let up = |time| 0.15 * ramp(time, 2.0, 3.0) - 0.15 * ramp(time, 6.0, 7.0);
    let hand = |time| {
        let come = ramp(time, 0.5, 1.5) - ramp(time, 8.0, 9.0);
        [0.18 + 0.7 * (1.0 - come), 0.0, 0.05 + up(time)]
    };
    let primitives = found(&[("right", &hand)], &|_| 0.01, &|time| [0.0, 0.0, 0.03 + up(time)], "right");
    assert!(primitives.iter().any(|name| name == "Translate"), "{primitives:?}");
    assert!(!primitives.iter().any(|name| name == "Push"), "{primitives:?}");
}

/// The other hand rests beside it, or what is held stops in the air.
#[test]
fn a_hand_at_rest_beside_what_rises_holds_nothing() {
    let up = |time| 0.10 * ramp(time, 2.0, 3.0) - 0.10 * ramp(time, 6.0, 7.0);
    let right = |time| {
        let come = ramp(time, 0.5, 1.5) - ramp(time, 8.0, 9.0);
        [-0.8 * (1.0 - come), 0.0, 0.02 + up(time)]
    };
    let left = |time| {
        let come = ramp(time, 0.3, 1.3) - ramp(time, 8.0, 9.0);
        [0.17 + 0.63 * (1.0 - come), 0.3 * (1.0 - come), 0.07]
    };
    let hands: [(&str, Trajectory); 2] = [("right", &right), ("left", &left)];
    let object = |time| [0.0, 0.0, 0.02 + up(time)];
    assert!(found(&hands, &|_| 0.01, &object, "right").iter().any(|name| name == "Translate"));
    assert_eq!(found(&hands, &|_| 0.01, &object, "left"), ["Move"]);
}

/// Fingers open evenly, so that their mean stays where it is.
#[test]
fn what_is_put_down_higher_is_let_go_when_the_fingers_open() {
    let up = |time| 0.10 * ramp(time, 2.0, 3.0);
    let hand = |time| {
        let come = ramp(time, 0.5, 1.5) - ramp(time, 8.0, 9.0);
        [-0.8 * (1.0 - come), 0.0, 0.02 + up(time)]
    };
    let spread = |time| 0.01 + 0.08 * ramp(time, 5.0, 5.3);
    let primitives = found(&[("right", &hand)], &spread, &|time| [0.0, 0.0, 0.02 + up(time)], "right");
    let at = |wanted: &str| primitives.iter().rposition(|name| name == wanted);
    assert!(at("Translate").is_some() && at("Translate") < at("Release"), "{primitives:?}");
}
