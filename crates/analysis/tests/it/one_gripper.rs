//! One gripper with a closed flag and a tool point, and one object.

use teachtree_analysis::{Analysis, Segment, TrackId, analyze};
use teachtree_base::hands::Side;
use teachtree_base::recording::{Column, Recording};
use teachtree_base::yaml;
use teachtree_engine::evaluator::evaluate;
use teachtree_language::graph::lower;
use teachtree_language::{Request, load};
use teachtree_logs::names;

/// A quantity over time.
pub type Signal<'a> = (&'a str, &'a dyn Fn(f64) -> f64);

/// A log of this many seconds at 100 Hz.
pub fn log(scene: &str, seconds: u32, signals: &[Signal]) -> Recording {
    let time: Vec<f64> = (0..100 * seconds).map(|row| f64::from(row) / 100.0).collect();
    let column = |(name, value): &Signal| {
        let dimension = names::meaning(name).unwrap().dimension;
        ((*name).to_string(), Column { dimension, values: time.iter().map(|t| value(*t)).collect() })
    };
    let columns = signals.iter().map(column).collect();
    Recording { columns, scene: yaml::read(scene, "scene").unwrap(), time, ..Recording::default() }
}

/// A value that changes evenly between times, s.
pub fn along(t: f64, points: &[(f64, f64)]) -> f64 {
    let after = points.partition_point(|(at, _)| *at <= t);
    match (after.checked_sub(1).map(|at| points[at]), points.get(after)) {
        (Some((_, value)), None) => value,
        (None, _) => points[0].1,
        (Some((from, before)), Some((to, next))) => before + (next - before) * (t - from) / (to - from),
    }
}

/// The segments of the hand before relabeling, by the rules with this hand model.
pub fn segments(log: &Recording, files: &[&str], hand_model: &str) -> Vec<Segment> {
    analysis(log, files, hand_model).track(TrackId::Hand(Side::Right)).unwrap().segments.clone()
}

/// The analysis by the rules with this hand model.
pub fn analysis(log: &Recording, files: &[&str], hand_model: &str) -> Analysis {
    let request = Request {
        files: files.iter().map(|file| (*file).into()).collect(),
        hand_file: Some(hand_model.into()),
        ..Request::default()
    };
    let rules = load(&request).rules.unwrap();
    let frames = teachtree_frames::frames(log, &teachtree_analysis::channels(&rules)).unwrap();
    analyze(&rules, &frames, &evaluate(&lower(&rules), &frames).unwrap())
}

pub fn starts(segments: &[Segment], primitive: &str) -> Vec<f64> {
    segments.iter().filter(|segment| segment.primitive == primitive).map(|segment| segment.start_s).collect()
}

#[test]
fn the_friction_of_a_hole_is_not_the_weight_of_the_peg() {
    pulled_out(true, [14.0, 6.0]);
}

/// The log has no pose of the peg.
#[test]
fn the_friction_of_a_hole_ends_where_less_resists_the_hand() {
    // The friction of an O-ring is even.
    for friction in [[14.0, 6.0], [10.0, 10.0], [0.0, 0.0]] {
        pulled_out(false, friction);
    }
}

/// A peg is 40 mm deep in a hole. It is pulled out from 3 s to 4.6 s, and meets a table that the scene lacks at 10 s.
/// The friction is that at the bottom of the hole and at its rim, N.
fn pulled_out(has_pose: bool, [bottom, rim]: [f64; 2]) {
    const SCENE: &str = "
bodies:
  peg: {role: object, mass: 150 g, parts: [{box: [20 mm, 20 mm, 100 mm]}], plug: [0 mm, 0 mm, -50 mm]}
  block:
    role: socket
    sockets: {hole: {rim: [0 mm, 0 mm, 60 mm], axis: [0, 0, 1], radius: 15 mm, depth: 40 mm}}
hands: {right: {fingers: [thumb, palm]}}
";
    let carried = |t: f64| along(t, &[(3.0, 0.07), (5.0, 0.12), (6.0, 0.22), (8.0, 0.22), (10.0, 0.05)]);
    let x = |t: f64| along(t, &[(6.0, 0.0), (8.0, 0.2)]);
    let hand = |t: f64| match t {
        t if t < 3.0 => along(t, &[(0.0, 0.3), (1.5, 0.095)]),
        t if t < 11.5 => carried(t) + 0.025,
        t => along(t, &[(11.5, 0.075), (13.0, 0.3)]),
    };
    let force = |t: f64| match t {
        t if !(2.5..11.0).contains(&t) => 0.0,
        t if t < 3.0 => 0.0,
        t if t < 4.6 => 1.5 + along(t, &[(3.0, bottom), (4.6, rim)]),
        t if t < 10.0 => 1.5,
        _ => -10.0,
    };
    let mut log = log(
        SCENE,
        14,
        &[
            ("right.thumb.position.x", &x),
            ("right.thumb.position.y", &|_| 0.0),
            ("right.thumb.position.z", &hand),
            ("right.gripper.closed", &|t| f64::from(u8::from((2.0..11.0).contains(&t)))),
            ("right.palm.force.x", &|_| 0.0),
            ("right.palm.force.y", &|_| 0.0),
            ("right.palm.force.z", &force),
            ("peg.position.x", &x),
            ("peg.position.y", &|_| 0.0),
            ("peg.position.z", &carried),
        ],
    );
    if !has_pose {
        log.columns.retain(|name, _| !name.starts_with("peg."));
    }
    let found = segments(&log, &["contact.rules"], "hand_gripper_wrist.rules");
    assert_eq!(starts(&found, "Pullout").len(), 1, "{found:?}");
    assert!(starts(&found, "Follow").is_empty(), "{found:?}");
    let places = starts(&found, "Place");
    assert!(places.len() == 1 && (places[0] - 10.0).abs() < 0.15, "{found:?}");
}

/// A sponge without a pose is pressed on a table from 5 s to 12 s. From 5.5 s it wipes to and fro by 40 mm, with constant, viscous or both kinds of
/// friction, which lessens at each turn.
#[test]
fn a_wipe_without_a_pose_does_not_leave_a_hole() {
    const SCENE: &str = "
bodies: {sponge: {role: object, parts: [{box: [50 mm, 50 mm, 50 mm]}]}}
hands: {right: {fingers: [thumb, palm]}}
";
    for (constant, viscous, normal) in [(6.0, 0.0, 12.0), (2.0, 90.0, 12.0), (0.0, 150.0, 12.0), (3.0, 50.0, 8.0)] {
        let wipes = |t: f64| (5.5..11.5).contains(&t);
        let angle = |t: f64| std::f64::consts::TAU * (t - 5.5) / 3.0;
        let x = |t: f64| if wipes(t) { 0.04 * angle(t).sin() } else { 0.0 };
        let points = [(1.5, 0.03), (3.0, 0.03), (3.6, 0.06), (4.2, 0.06), (4.8, 0.03), (12.0, 0.03), (12.8, 0.2)];
        let z = |t: f64| if t < 1.5 { along(t, &[(0.0, 0.3), (1.5, 0.03)]) } else { along(t, &points) };
        let across = |t: f64| {
            let speed = 0.04 * std::f64::consts::TAU / 3.0 * angle(t).cos();
            if wipes(t) { constant * (speed / 0.002).tanh() + viscous * speed } else { 0.0 }
        };
        let down = |t: f64| match t {
            t if (4.8..12.0).contains(&t) => -along(t, &[(4.8, 0.0), (5.0, normal), (11.8, normal), (12.0, 0.0)]),
            t if (3.0..14.0).contains(&t) => 2.0,
            _ => 0.0,
        };
        let signals: [Signal; 7] = [
            ("right.thumb.position.x", &x),
            ("right.thumb.position.y", &|_| 0.0),
            ("right.thumb.position.z", &z),
            ("right.gripper.closed", &|t| f64::from(u8::from((2.0..14.0).contains(&t)))),
            ("right.palm.force.x", &across),
            ("right.palm.force.y", &|_| 0.0),
            ("right.palm.force.z", &down),
        ];
        let found = segments(&log(SCENE, 16, &signals), &["contact.rules"], "hand_gripper_wrist.rules");
        let is_wiped = |it: &Segment| it.primitive == "Follow" || it.primitive == "Place";
        let of_wipe: Vec<&Segment> = found.iter().filter(|it| it.start_s < 11.5 && it.end_s > 5.5).collect();
        assert!(of_wipe.iter().all(|it| is_wiped(it)), "{constant} {viscous} {normal}: {found:?}");
        let follows: f64 = of_wipe.iter().filter(|it| it.primitive == "Follow").map(|it| it.end_s - it.start_s).sum();
        assert!(follows > 4.0, "{constant} {viscous} {normal}: {found:?}");
        let ends = starts(&found, "Translate").last().copied();
        assert!(ends.is_some_and(|end_s| (end_s - 12.0).abs() < 0.2), "{constant} {viscous} {normal}: {found:?}");
    }
}

/// A box of 2.5 kg without a pose is lifted by 50 mm within 0.5 s, moved by 50 mm, lowered from 6 s to 6.5 s, and pressed. It weighs less where it slows down.
#[test]
fn a_heavy_load_that_slows_down_does_not_leave_a_hole() {
    const SCENE: &str = "
bodies: {box: {role: object, parts: [{box: [50 mm, 50 mm, 50 mm]}]}}
hands: {right: {fingers: [thumb, palm]}}
";
    let way = |t: f64| {
        let part = (t / 0.5).clamp(0.0, 1.0);
        part.powi(3) * (10.0 + part * (6.0 * part - 15.0))
    };
    let lifted = |t: f64| 0.05 * (way(t - 3.0) - way(t - 6.0));
    let hand = |t: f64| along(t, &[(0.0, 0.3), (1.5, 0.03), (9.0, 0.03), (10.5, 0.3)]) + lifted(t);
    let force = |t: f64| match t {
        t if (3.0..6.48).contains(&t) => {
            let step = 1e-3;
            2.5 * (9.81 + (lifted(t + step) - 2.0 * lifted(t) + lifted(t - step)) / (step * step))
        }
        t if (6.48..8.5).contains(&t) => -8.0,
        _ => 0.0,
    };
    let signals: [Signal; 7] = [
        ("right.thumb.position.x", &|t| 0.05 * way(t - 4.5)),
        ("right.thumb.position.y", &|_| 0.0),
        ("right.thumb.position.z", &hand),
        ("right.gripper.closed", &|t| f64::from(u8::from((2.0..8.5).contains(&t)))),
        ("right.palm.force.x", &|_| 0.0),
        ("right.palm.force.y", &|_| 0.0),
        ("right.palm.force.z", &force),
    ];
    let found = segments(&log(SCENE, 12, &signals), &["contact.rules"], "hand_gripper_wrist.rules");
    let places = starts(&found, "Place");
    assert!(places.len() == 1 && (places[0] - 6.48).abs() < 0.1, "{found:?}");
}

/// A box is lifted by 120 mm, moved by 200 mm within 1 s, and lowered, each of the three with the acceleration of a smooth motion. The log may have its pose.
#[test]
fn the_inertia_of_a_load_is_no_contact() {
    const SCENE: &str = "
bodies:
  box: {role: object, parts: [{box: [50 mm, 50 mm, 50 mm]}]}
  table: {role: support, position: [0 m, 0 m, -10 mm], parts: [{box: [3 m, 3 m, 20 mm]}]}
hands: {right: {fingers: [thumb, palm]}}
";
    const STEP_S: f64 = 0.01;
    let way = |part: f64| {
        let part = part.clamp(0.0, 1.0);
        part.powi(3) * (10.0 + part * (6.0 * part - 15.0))
    };
    for (mass_kg, lifts_s) in [(1.0, 0.5), (1.0, 0.8), (2.5, 0.8), (5.0, 0.5), (5.0, 1.5)] {
        let down_s = 4.0 + 2.0 * lifts_s;
        let lifted = |t: f64| 0.12 * (way((t - 3.0) / lifts_s) - way((t - lifts_s - 4.0) / lifts_s));
        let x = |t: f64| 0.2 * way(t - 3.0 - lifts_s);
        let change = |place: &dyn Fn(f64) -> f64, t: f64| {
            (place(t + STEP_S) - 2.0 * place(t) + place(t - STEP_S)) / (STEP_S * STEP_S)
        };
        let hand = |t: f64| {
            let away = along(t, &[(0.0, 0.3), (1.5, 0.0), (down_s + 2.0, 0.0), (down_s + 3.0, 0.3)]);
            0.03 + away + lifted(t)
        };
        let load = |t: f64| mass_kg * along(t, &[(2.9, 0.0), (3.0, 1.0), (down_s - 0.02, 1.0), (down_s + 0.1, 0.0)]);
        let box_z = |t: f64| 0.025 + lifted(t);
        let (along_x, up) = (|t: f64| load(t) * change(&x, t), |t: f64| load(t) * (9.81 + change(&lifted, t)));
        let signals: [Signal; 10] = [
            ("right.thumb.position.x", &x),
            ("right.thumb.position.y", &|_| 0.0),
            ("right.thumb.position.z", &hand),
            ("right.gripper.closed", &|t| f64::from(u8::from((2.0..down_s + 1.5).contains(&t)))),
            ("right.palm.force.x", &along_x),
            ("right.palm.force.y", &|_| 0.0),
            ("right.palm.force.z", &up),
            ("box.position.x", &x),
            ("box.position.y", &|_| 0.0),
            ("box.position.z", &box_z),
        ];
        for signals in [&signals[..], &signals[..7]] {
            let found = segments(&log(SCENE, 11, signals), &["contact.rules"], "hand_gripper_wrist.rules");
            let places = starts(&found, "Place");
            let context = format!("{mass_kg} kg, {lifts_s} s, {} columns: {found:?}", signals.len());
            assert!(places.len() == 1 && (places[0] - down_s).abs() < 0.2, "{context}");
            assert!(starts(&found, "Follow").is_empty(), "{context}");
        }
    }
}

/// A gripper lifts a peg from the bottom of a hole, or from the block around it: a log without the pose of the peg and without forces is the same.
#[test]
fn a_hole_that_nothing_in_the_log_shows_is_no_success() {
    const SCENE: &str = "
bodies:
  peg: {role: object, PLACE parts: [{box: [20 mm, 20 mm, 100 mm]}], plug: [0 mm, 0 mm, -50 mm]}
  block:
    role: socket
    sockets: {hole: {rim: [0 mm, 0 mm, 60 mm], axis: [0, 0, 1], radius: 15 mm, depth: 40 mm}}
hands: {right: {fingers: [thumb, palm]}}
";
    let z = |t: f64| along(t, &[(0.0, 0.3), (1.5, 0.07), (3.0, 0.07), (5.0, 0.3), (9.0, 0.3)]);
    let x = |t: f64| along(t, &[(5.0, 0.0), (6.0, 0.3), (7.5, 0.3), (8.5, 0.0)]);
    let columns: [Signal; 4] = [
        ("right.thumb.position.x", &x),
        ("right.thumb.position.y", &|_| 0.0),
        ("right.thumb.position.z", &z),
        ("right.gripper.closed", &|t| f64::from(u8::from((2.0..7.0).contains(&t)))),
    ];
    let outcome = |place: &str, more: &[Signal]| {
        let log = log(&SCENE.replace("PLACE", place), 9, &[&columns[..], more].concat());
        let rules = load(&Request {
            files: vec!["contact.rules".into(), "failures.rules".into()],
            hand_file: Some("hand_gripper.rules".into()),
            ..Request::default()
        });
        let rules = rules.rules.unwrap();
        let frames = teachtree_frames::frames(&log, &teachtree_analysis::channels(&rules)).unwrap();
        let found = analyze(&rules, &frames, &evaluate(&lower(&rules), &frames).unwrap());
        let outcome = found.outcome();
        let is_assumed =
            outcome.reasons.iter().any(|reason| reason.message.starts_with("assumed_insertion peg.position: "));
        (outcome.result.name(), is_assumed)
    };
    let forces: [Signal; 3] =
        [("right.palm.force.x", &|_| 0.0), ("right.palm.force.y", &|_| 0.0), ("right.palm.force.z", &|_| 0.1)];
    let of_left: [Signal; 3] =
        [("left.palm.force.x", &|_| 0.0), ("left.palm.force.y", &|_| 0.0), ("left.palm.force.z", &|_| 0.1)];
    assert_eq!(outcome("", &[]), ("unknown", true));
    // The force on the left hand does not show whether the peg is in the hole.
    assert_eq!(outcome("", &of_left), ("unknown", true));
    assert_eq!(outcome("", &forces), ("success", false));
    assert_eq!(outcome("position: [0 mm, 0 mm, 70 mm],", &[]), ("success", false));
}

/// A gripper takes a block at 2 s, carries it by 0.6 m, and opens at 6 s. The log has no pose of the block; the scene may have its place.
#[test]
fn the_place_of_an_object_does_not_make_a_failure_of_its_carry() {
    let x = |t: f64| along(t, &[(3.0, 0.0), (5.0, 0.6)]);
    let height = |t: f64| {
        along(
            t,
            &[(0.0, 0.3), (1.5, 0.025), (2.5, 0.025), (3.0, 0.2), (5.0, 0.2), (5.5, 0.025), (6.5, 0.025), (7.5, 0.3)],
        )
    };
    let of = |place: &str| {
        let scene = format!(
            "{{bodies: {{block: {{role: object, {place} parts: [{{box: [50 mm, 50 mm, 50 mm]}}]}}, table: {{role: support, position: [0 m, 0 m, -10 mm], \
             parts: [{{box: [3 m, 3 m, 20 mm]}}]}}}}, hands: {{right: {{fingers: [thumb]}}}}}}"
        );
        let log = log(
            &scene,
            9,
            &[
                ("right.thumb.position.x", &x),
                ("right.thumb.position.y", &|_| 0.0),
                ("right.thumb.position.z", &height),
                ("right.gripper.closed", &|t| f64::from(u8::from((2.0..6.0).contains(&t)))),
            ],
        );
        let found = segments(&log, &["failures.rules"], "hand_gripper.rules");
        found.into_iter().map(|segment| (segment.primitive, segment.start_s)).collect::<Vec<_>>()
    };
    let begins = |found: &[(String, f64)], primitive: &str, at: f64| {
        let times: Vec<f64> = found.iter().filter(|(name, _)| name == primitive).map(|(_, start_s)| *start_s).collect();
        assert!(times.len() == 1 && (times[0] - at).abs() < 0.25, "{primitive} {at}: {found:?}");
    };
    let (without, with) = (of(""), of("position: [0 m, 0 m, 25 mm],"));
    for found in [&without, &with] {
        begins(found, "Grasp", 2.0);
        begins(found, "Translate", 2.5);
        begins(found, "Release", 6.0);
        assert!(found.iter().all(|(primitive, _)| !["Miss", "Drop"].contains(&primitive.as_str())), "{found:?}");
    }
    // Its place shows when the table carries it again.
    begins(&with, "Place", 5.5);
    assert!(without.iter().all(|(primitive, _)| primitive != "Place"), "{without:?}");
}

/// How a log shows that hand and object are turned.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Turns {
    Unseen,
    Hand,
    Both,
}

/// A gripper holds a cup 100 mm below its tool point, carries it from 2 s on, and tilts it by 0.8 rad from 4 s to 5 s. The cup may slide by 20 mm in the gripper
/// from 6 s to 6.4 s.
fn tilted(turns: Turns, slides: bool) -> Vec<Segment> {
    const SCENE: &str = "{bodies: {cup: {role: object, radius: 60 mm}}, hands: {right: {fingers: [thumb]}}}";
    let tilt = |t: f64| along(t, &[(4.0, 0.0), (5.0, 0.8)]);
    let below = |t: f64| 0.1 + along(t, &[(6.0, 0.0), (6.4, if slides { 0.02 } else { 0.0 })]);
    let x = |t: f64| along(t, &[(2.0, 0.0), (4.0, 0.3)]);
    let z = |t: f64| along(t, &[(2.0, 0.1), (3.0, 0.4), (7.0, 0.4), (8.0, 0.1)]);
    let cup_x = |t: f64| x(t) - below(t) * tilt(t).sin();
    let cup_z = |t: f64| z(t) - below(t) * tilt(t).cos();
    let (w, y) = (|t: f64| (tilt(t) / 2.0).cos(), |t: f64| (tilt(t) / 2.0).sin());
    let closed = |t: f64| f64::from(u8::from((1.0..9.0).contains(&t)));
    let mut signals: Vec<Signal> = vec![
        ("right.thumb.position.x", &x),
        ("right.thumb.position.y", &|_| 0.0),
        ("right.thumb.position.z", &z),
        ("right.gripper.closed", &closed),
        ("cup.position.x", &cup_x),
        ("cup.position.y", &|_| 0.0),
        ("cup.position.z", &cup_z),
    ];
    if turns != Turns::Unseen {
        let hand: [Signal; 4] = [
            ("right.palm.rotation.w", &w),
            ("right.palm.rotation.x", &|_| 0.0),
            ("right.palm.rotation.y", &y),
            ("right.palm.rotation.z", &|_| 0.0),
        ];
        signals.extend(hand);
    }
    if turns == Turns::Both {
        let cup: [Signal; 4] = [
            ("cup.rotation.w", &w),
            ("cup.rotation.x", &|_| 0.0),
            ("cup.rotation.y", &y),
            ("cup.rotation.z", &|_| 0.0),
        ];
        signals.extend(cup);
    }
    segments(&log(SCENE, 11, &signals), &["failures.rules"], "hand_gripper.rules")
}

#[test]
fn a_tilt_of_the_hand_is_not_a_slip() {
    for turns in [Turns::Unseen, Turns::Hand, Turns::Both] {
        let found = tilted(turns, false);
        assert!(starts(&found, "Slip").is_empty() && !starts(&found, "Translate").is_empty(), "{turns:?}: {found:?}");
    }
    for turns in [Turns::Hand, Turns::Both] {
        let found = tilted(turns, true);
        let slips = starts(&found, "Slip");
        assert!(slips.len() == 1 && (slips[0] - 6.0).abs() < 0.3, "{turns:?}: {found:?}");
    }
    // Without a rotation, a slip cannot be distinguished from a tilt.
    assert!(starts(&tilted(Turns::Unseen, true), "Slip").is_empty());
}
