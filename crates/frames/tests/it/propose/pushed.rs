//! Proposed shapes of objects that fingertips push.

use super::{Column, placed_scene};

/// The way of the box, m: it is pushed from 0.3 to 0.6 of the log.
fn way(passed: f64) -> f64 {
    0.25 * ((passed - 0.3) / 0.3).clamp(0.0, 1.0)
}

/// How far the fingertip is behind the origin of the box, m: it comes and leaves.
fn behind(passed: f64) -> f64 {
    0.112 + (0.25 - passed).max(0.0) + (passed - 0.65).max(0.0)
}

/// The line of the box in the scene for its columns and those of two fingertips.
fn box_of(columns: [fn(f64) -> f64; 9]) -> String {
    let names = [
        "box_x",
        "box_y",
        "box_z",
        "index_tip_x",
        "index_tip_y",
        "index_tip_z",
        "thumb_tip_x",
        "thumb_tip_y",
        "thumb_tip_z",
    ];
    let columns: Vec<Column> = names.into_iter().zip(columns).collect();
    let scene = placed_scene(&columns);
    scene.lines().find(|line| line.starts_with("  box: ")).unwrap_or(&scene).to_string()
}

#[test]
fn the_distance_of_a_fingertip_that_pushes_a_box_shows_its_face() {
    let index: fn(f64) -> f64 = |passed| way(passed) - behind(passed);
    let thumb: fn(f64) -> f64 = |passed| way(passed) - behind(passed) - 0.045;
    let found = box_of([way, |_| 0.1, |_| 0.06, index, |_| 0.1, |_| 0.04, thumb, |_| 0.06, |_| 0.04]);
    // The fingertip is 6 mm behind the face, 112 mm from the origin.
    assert!(found.contains("parts: [{box: [212 mm, 212 mm, 40 mm], at: [0 mm, 0 mm, -10 mm]}]"), "{found}");
    assert!(found.contains("the log has no markers of it: only the distance of what pushes it is measured"), "{found}");
    assert!(!found.contains("its markers show"), "{found}");
    // Askew by 30 degrees.
    let found = box_of([
        |passed| 0.866 * way(passed),
        |passed| 0.1 + 0.5 * way(passed),
        |_| 0.06,
        |passed| 0.866 * (way(passed) - behind(passed)),
        |passed| 0.1 + 0.5 * (way(passed) - behind(passed)),
        |_| 0.06,
        |passed| 0.866 * (way(passed) - behind(passed)) - 0.04,
        |passed| 0.1 + 0.5 * (way(passed) - behind(passed)),
        |_| 0.06,
    ]);
    assert!(
        found.contains("{box: [212 mm, 212 mm, 20 mm], at: [0 mm, 0 mm, 0 mm], turned: [0.9659, 0, 0, 0.2588]}"),
        "{found}"
    );
}

#[test]
fn a_finger_on_each_side_of_a_box_does_not_push_it() {
    let index: fn(f64) -> f64 = |passed| way(passed) - behind(passed);
    let thumb: fn(f64) -> f64 = |passed| way(passed) + behind(passed);
    let found = box_of([way, |_| 0.1, |_| 0.06, index, |_| 0.1, |_| 0.06, thumb, |_| 0.1, |_| 0.06]);
    assert!(!found.contains("what pushes it"), "{found}");
}

#[test]
fn a_box_that_moves_without_a_fingertip_needs_a_size() {
    let remark = "nothing touches box with this size while it moves: write its size";
    let far: fn(f64) -> f64 = |passed| 0.5 * passed - 0.8;
    let found = box_of([way, |_| 0.1, |_| 0.06, far, |_| 0.1, |_| 0.06, far, |_| 0.2, |_| 0.06]);
    assert!(found.contains(remark), "{found}");
    let found = box_of([way, |_| 0.1, |_| 0.06, way, |_| 0.12, |_| 0.06, way, |_| 0.2, |_| 0.06]);
    assert!(!found.contains(remark), "{found}");
    // What rises is lifted, so a hand holds it, whatever its size.
    let found = box_of([way, |_| 0.1, |passed| 0.06 + way(passed), far, |_| 0.1, |_| 0.06, far, |_| 0.2, |_| 0.06]);
    assert!(!found.contains(remark), "{found}");
}
