//! Motions that no param was chosen on: descents of 5, 20 and 60 mm/s, hands that come back for another try, and a button without a logged pose.

use crate::program::{all_said, said, teachtree_in};
use serde_json::Value;
use std::fmt::Write as _;

const TABLE: &str = "    table: {role: support, position: [0 m, 0 m, -10 mm], parts: [{box: [2 m, 2 m, 20 mm]}]}\n";
const PART: &str = "    part: {role: object, plug: [0 m, 0 m, -30 mm], parts: [{cylinder: [12 mm, 60 mm]}]}\n";

/// A motion in straight lines: times, s, and heights of the gripper over the table, m; its openings likewise.
struct Motion<'a> {
    heights: &'a [(f64, f64)],
    openings: &'a [(f64, f64)],
    /// When the part moves with the gripper, s.
    carried: std::ops::Range<f64>,
    /// Where the gripper is along x while it does not carry, and after it has carried, m.
    places: [f64; 2],
}

fn at(keys: &[(f64, f64)], time: f64) -> f64 {
    let next = keys.partition_point(|(key, _)| *key <= time);
    match (next.checked_sub(1).map(|before| keys[before]), keys.get(next).copied()) {
        (Some((from, low)), Some((to, high))) => low + (high - low) * (time - from) / (to - from),
        (Some((_, value)), None) | (None, Some((_, value))) => value,
        (None, None) => 0.0,
    }
}

impl Motion<'_> {
    /// The log of a tool point, an opening and the pose of a part at 100 Hz, up to a time, s.
    fn log(&self, until: f64) -> String {
        let mut log = String::from("time,tx,ty,tz,width,ox,oy,oz\n");
        let mut part = (self.places[0], 0.03);
        for row in 0.. {
            let time = f64::from(row) * 0.01;
            if time > until {
                return log;
            }
            let share = ((time - self.carried.start - 1.0) / 2.0).clamp(0.0, 1.0);
            let x = self.places[0] + (self.places[1] - self.places[0]) * share;
            let z = at(self.heights, time);
            if self.carried.contains(&time) {
                part = (x, z);
            }
            let _ = writeln!(log, "{time:.2},{x},0,{z},{},{},0,{}", at(self.openings, time), part.0, part.1);
        }
        log
    }
}

/// Primitive, start and end, s.
type Segments = Vec<(String, f64, f64)>;

/// The segments of each track of a log.
fn tracks(log: &str, channels: &str, bodies: &str) -> Vec<Segments> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("log.csv"), log).unwrap();
    let binding = format!("channels:\n{channels}scene:\n  bodies:\n{bodies}");
    std::fs::write(folder.path().join("b.yaml"), binding).unwrap();
    let output = teachtree_in(folder.path(), &["analyze", "log.csv", "--binding", "b.yaml", "--format", "json"]);
    assert!(output.status.success(), "{}", all_said(&output));
    let analysis: Value = serde_json::from_str(&said(&output)).unwrap();
    let time = |it: &Value, key: &str| it[key].as_f64().unwrap();
    let segments = |track: &Value| {
        let found = track["relabeled"].as_array().unwrap().iter();
        found
            .map(|it| (it["primitive"].as_str().unwrap().to_string(), time(it, "start_s"), time(it, "end_s")))
            .collect()
    };
    analysis["tracks"].as_array().unwrap().iter().map(segments).collect()
}

/// When a primitive begins, s.
fn starts(of: &str, segments: &[(String, f64, f64)]) -> Vec<f64> {
    segments.iter().filter(|it| it.0 == of).map(|it| it.1).collect()
}

const GRIPPER: &str = "  right.tcp.position: t<xyz>
  right.gripper.opening: width
  right.gripper.closed: width < 0.06
  part.position: o<xyz>
";

/// The plug point is 30 mm below the gripper. It passes the rim, 60 mm over the table, at a constant speed, and goes 22 mm deep.
#[test]
fn an_insertion_begins_at_the_rim_at_any_speed() {
    let socket = "    block: {role: socket, position: [200 mm, 0 mm, 60 mm], sockets: {hole: {rim: [0 m, 0 m, 0 m], axis: [0, 0, 1], radius: 12.5 mm, depth: 25 mm}}}\n";
    for speed in [0.005, 0.020, 0.060] {
        let rim = 7.0 + 0.045 / speed;
        let seated = rim + 0.022 / speed;
        let motion = Motion {
            heights: &[
                (0.0, 0.3),
                (2.0, 0.03),
                (3.0, 0.03),
                (4.0, 0.135),
                (7.0, 0.135),
                (seated, 0.068),
                (seated + 1.0, 0.068),
                (seated + 2.0, 0.3),
            ],
            openings: &[(2.2, 0.085), (2.6, 0.026), (seated + 0.5, 0.026), (seated + 1.0, 0.085)],
            carried: 2.6..seated + 0.6,
            places: [0.0, 0.2],
        };
        let found = &tracks(&motion.log(seated + 3.0), GRIPPER, &format!("{PART}{TABLE}{socket}"))[0];
        let begins = starts("Insert", found);
        assert!(begins.len() == 1 && (begins[0] - rim).abs() <= 0.2, "{speed} m/s, rim at {rim} s: {found:?}");
    }
}

/// The gripper closes beside the part, opens, goes up by 30 to 90 mm and comes back, twice, before it takes the part along.
#[test]
fn a_hand_that_comes_back_approaches_again() {
    for up in [0.03, 0.05, 0.09] {
        let z = 0.03 + up;
        let motion = Motion {
            heights: &[
                (0.0, 0.3),
                (2.0, 0.03),
                (4.0, 0.03),
                (5.0, z),
                (5.2, z),
                (6.2, 0.03),
                (8.0, 0.03),
                (9.0, z),
                (9.2, z),
                (10.2, 0.03),
                (12.0, 0.03),
                (13.0, 0.15),
                (16.0, 0.15),
                (17.0, 0.03),
                (18.5, 0.03),
                (20.0, 0.3),
            ],
            openings: &[
                (2.2, 0.085),
                (2.6, 0.026),
                (3.4, 0.026),
                (3.8, 0.085),
                (6.4, 0.085),
                (6.8, 0.026),
                (7.4, 0.026),
                (7.8, 0.085),
                (10.6, 0.085),
                (11.0, 0.026),
                (17.8, 0.026),
                (18.2, 0.085),
            ],
            carried: 12.0..17.9,
            places: [0.0, 0.2],
        };
        let found = &tracks(&motion.log(21.0), GRIPPER, &format!("{PART}{TABLE}"))[0];
        let begins = starts("Approach", found);
        let near = |wanted: f64| begins.iter().any(|at| (at - wanted).abs() <= 0.2);
        assert!(begins.len() == 3 && near(5.2) && near(9.2), "{up} m: {found:?}");
    }
}

/// A tool comes down at 40 mm/s to a button 60 mm above it, presses it for 1 s and goes up, twice. Only the scene says where the button is.
#[test]
fn a_hand_approaches_what_the_scene_places_by_its_distance() {
    let heights =
        [(0.0, 0.4), (5.0, 0.2), (7.0, 0.12), (8.0, 0.12), (9.0, 0.16), (10.0, 0.12), (11.0, 0.12), (13.0, 0.4)];
    let mut log = String::from("time,tx,ty,tz,f\n");
    for row in 0..1300 {
        let time = f64::from(row) * 0.01;
        let z = at(&heights, time);
        let _ = writeln!(log, "{time:.2},0.5,0,{z},{}", if z <= 0.12 { 8.0 } else { 0.0 });
    }
    let channels = "  right.tcp.position: t<xyz>\n  right.wrist.force: ['f [N]', '= 0 N', '= 0 N']\n";
    let button = "    button: {role: object, position: [500 mm, 0 mm, 110 mm], parts: [{cylinder: [15 mm, 20 mm]}]}\n";
    let found = &tracks(&log, channels, button)[0];
    let begins = starts("Approach", found);
    // 50 mm from the bounding ball of the button, whose radius is 18 mm; then where the tool turns back.
    let near = 7.0 - (0.110 + 0.018 + 0.050 - 0.12) / 0.040;
    assert!(begins.len() == 2 && (begins[0] - near).abs() < 0.1 && (begins[1] - 9.0).abs() < 0.15, "{near}: {found:?}");
}

/// Two grippers take a pot 80 mm from its middle on either side, let go, go up by 50 mm and come back before they lift it.
#[test]
fn both_hands_that_come_back_approach_again() {
    let heights = [
        (0.0, 0.3),
        (2.0, 0.03),
        (4.0, 0.03),
        (5.0, 0.08),
        (5.2, 0.08),
        (6.2, 0.03),
        (8.0, 0.03),
        (9.0, 0.15),
        (13.0, 0.15),
    ];
    let openings = [(2.2, 0.085), (2.6, 0.026), (3.4, 0.026), (3.8, 0.085), (6.4, 0.085), (6.8, 0.026)];
    let mut log = String::from("time,lx,ly,lz,lw,rx,ry,rz,rw,ox,oy,oz\n");
    for row in 0..1300 {
        let time = f64::from(row) * 0.01;
        let (z, width) = (at(&heights, time), at(&openings, time));
        let pot = if time < 8.0 { 0.03 } else { z };
        let _ = writeln!(log, "{time:.2},0,0.08,{z},{width},0,-0.08,{z},{width},0,0,{pot}");
    }
    let hand = |side: &str, of: &str| {
        GRIPPER.lines().take(3).fold(String::new(), |text, line| {
            text + &line.replace("right", side).replace("t<", &format!("{of}<")).replace("width", &format!("{of}w"))
                + "\n"
        })
    };
    let channels = format!("{}{}  pot.position: o<xyz>\n", hand("left", "l"), hand("right", "r"));
    let pot = "    pot: {role: object, parts: [{box: [60 mm, 200 mm, 60 mm]}]}\n";
    let found = tracks(&log, &channels, &format!("{pot}{TABLE}"));
    for segments in &found[..2] {
        let begins = starts("Approach", segments);
        assert!(begins.len() == 2 && (begins[1] - 5.2).abs() <= 0.1, "{segments:?}");
    }
}
