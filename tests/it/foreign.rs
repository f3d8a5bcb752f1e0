//! Recordings as other laboratories would make them, with a truth that is evident: what a gripper, a stick or a tracked hand does, and nothing else.

use nalgebra::Vector3;
use std::fmt::Write;
use teachtree::{Log, Rules};

/// Noise of a position, m, that is the same each time: about as large as given.
fn noise(row: usize, axis: usize, size: f64) -> f64 {
    let scrambled = (row * 3 + axis).wrapping_mul(2_654_435_761) >> 7;
    size * ((scrambled % 2001) as f64 / 1000.0 - 1.0)
}

/// A row of a log with points whose noise is about as large as given, m.
fn write_row(log: &mut String, row: usize, begins: &str, points: &[Vector3<f64>], size: f64) {
    log.push_str(begins);
    for (at, value) in points.iter().flat_map(|point| point.iter()).enumerate() {
        let _ = write!(log, ",{}", value + noise(row, at, size));
    }
    log.push('\n');
}

/// The primitives of a hand with the times at which they begin, s.
fn found(log: &str, binding: &str, hand: &str) -> Vec<(String, f64)> {
    let folder = tempfile::tempdir().unwrap();
    let [log_file, binding_file] = ["log.csv", "log.yaml"].map(|name| folder.path().join(name));
    std::fs::write(&log_file, log).unwrap();
    std::fs::write(&binding_file, binding).unwrap();
    let log = Log::options().binding(&binding_file).open(&log_file).unwrap();
    let analysis = Rules::for_log(&log).unwrap().analyze(&log).unwrap();
    let segments = analysis.segments().into_iter().filter(|segment| segment.track().to_string() == hand);
    segments.map(|segment| (segment.primitive().to_string(), segment.start_s())).collect()
}

/// A stick pushes a block at its side from 3 s on, so that it turns by `degrees` about its middle within `takes_s` and stays where it is.
fn turned_by_a_stick(degrees: f64, takes_s: f64) -> Vec<(String, f64)> {
    let mut log = String::from("t,sx,sy,bx,by,yaw\n");
    for row in 0..480 {
        let time = f64::from(row) / 60.0;
        let share = ((time - 3.0) / takes_s).clamp(0.0, 1.0);
        let yaw = degrees.to_radians() * share;
        // The stick comes from the side, stays at its place on the block's face, and goes back.
        let away = 0.3 * (1.0 - time / 3.0).max(0.0) + 0.2 * (time - 3.0 - takes_s).max(0.0);
        let at = nalgebra::Rotation2::new(yaw) * nalgebra::Vector2::new(0.08, -0.1 - away);
        let _ = writeln!(log, "{time},{},{},{},{},{}", at.x, at.y, 0.0, 0.0, yaw.to_degrees());
    }
    let binding = r#"hand_file: hand_vision.rules
time: t [s]
channels:
  right.thumb.position: ["sx [m]", "sy [m]", "= 0 mm"]
  block.position: ["bx [m]", "by [m]", "= 0 mm"]
  block.rotation: ["= 0 rad", "= 0 rad", "yaw [deg]"]
scene:
  bodies:
    block: {role: object, parts: [{box: [200 mm, 200 mm, 80 mm]}]}
    table: {role: support, position: [0 mm, 0 mm, -50 mm], parts: [{box: [2 m, 2 m, 20 mm]}]}
  hands: {right: {fingers: [thumb]}}
"#;
    found(&log, binding, "right")
}

#[test]
fn a_block_that_only_turns_is_pushed() {
    let found = turned_by_a_stick(60.0, 2.5);
    let (_, start_s) = found.iter().find(|(primitive, _)| primitive == "Push").unwrap();
    assert!((start_s - 3.0).abs() < 0.2, "{found:?}");
}

#[test]
fn a_block_that_turns_a_little_was_brushed() {
    // Half its radius from the middle it goes 11 mm.
    let found = turned_by_a_stick(9.0, 0.6);
    assert!(found.iter().all(|(primitive, _)| primitive != "Push"), "{found:?}");
}

/// Thumb and index finger hold a pan by its handle, 150 mm from its origin; it is lifted at 3 s, still in the air for two seconds, carried, and put down at 9 s.
#[test]
fn what_is_still_in_the_air_is_held() {
    let mut log = String::from("t,px,py,pz,ix,iy,iz,ox,oy,oz\n");
    for row in 0..720 {
        let time = row as f64 / 60.0;
        let eased = |from: f64, to: f64| {
            let share = ((time - from) / (to - from)).clamp(0.0, 1.0);
            share * share * (3.0 - 2.0 * share)
        };
        let pan = Vector3::new(0.4 * eased(6.0, 8.0), 0.0, 0.1 * (eased(3.0, 4.0) - eased(8.0, 9.0)));
        let away = 0.3 * (1.0 - eased(1.0, 2.5) + eased(9.5, 11.0));
        let handle = pan + Vector3::new(0.15, 0.0, 0.0);
        let points = [handle + Vector3::new(0.0, -0.01 - away, 0.0), handle + Vector3::new(0.0, 0.01 + away, 0.0), pan];
        write_row(&mut log, row, &time.to_string(), &points, 5e-4);
    }
    let binding = "hand_file: hand_vision.rules
time: t [s]
channels:
  right.thumb.position: p<xyz> [m]
  right.index.position: i<xyz> [m]
  pan.position: o<xyz> [m]
scene: {bodies: {pan: {role: object, radius: 50 mm}, table: {role: support}}}
";
    let found = found(&log, binding, "right");
    let carried = found.iter().position(|(primitive, _)| primitive == "Translate").unwrap();
    let (_, start_s) = &found[carried];
    assert!((start_s - 3.2).abs() < 0.5, "{found:?}");
    let end_s = found.get(carried + 1).map_or(12.0, |(_, start_s)| *start_s);
    assert!(end_s > 8.3, "it is carried until it is put down: {found:?}");
}

/// The right gripper carries a bar in the air; the left one closes on it at 6 s and the right one opens at 6.5 s, 150 mm from the bar's middle each.
#[test]
fn who_was_given_an_object_carries_it_at_once() {
    let mut log = String::from("t,rc,lc,rx,ry,rz,lx,ly,lz,bx,by,bz\n");
    for row in 0..600 {
        let time = row as f64 / 50.0;
        let share = |from: f64, to: f64| ((time - from) / (to - from)).clamp(0.0, 1.0);
        let bar = Vector3::new(-0.4 * share(7.5, 9.5), 0.0, 0.3 * share(2.5, 5.0) - 0.3 * share(9.5, 11.0));
        let right = bar + Vector3::new(0.15 + 0.3 * (1.0 - share(0.0, 1.5) + share(6.5, 7.5)), 0.0, 0.0);
        let left = bar + Vector3::new(-0.15 - 0.3 * (1.0 - share(4.5, 6.0) + share(11.2, 12.0)), 0.0, 0.0);
        let closed = [(2.0..6.5).contains(&time), (6.0..11.2).contains(&time)].map(u8::from);
        write_row(&mut log, row, &format!("{time},{},{}", closed[0], closed[1]), &[right, left, bar], 2e-4);
    }
    let binding = "hand_file: hand_gripper.rules
time: t [s]
channels:
  right.gripper.closed: rc
  left.gripper.closed: lc
  right.palm.position: r<xyz> [m]
  left.palm.position: l<xyz> [m]
  right.thumb.position: r<xyz> [m]
  left.thumb.position: l<xyz> [m]
  bar.position: b<xyz> [m]
scene:
  bodies:
    bar: {role: object, parts: [{box: [400 mm, 40 mm, 40 mm]}]}
    table: {role: support, position: [0 mm, 0 mm, -30 mm], parts: [{box: [2 m, 2 m, 20 mm]}]}
";
    let found = found(&log, binding, "left");
    let pass = found.iter().position(|(primitive, _)| primitive == "Pass").unwrap();
    assert!((found[pass].1 - 6.0).abs() < 0.2, "{found:?}");
    assert_eq!(found[pass + 1].0, "Translate", "{found:?}");
}
