//! Two hands in the virtual environment, as the shipped rules see them: the chapter's section 4 (docs/sources.md, E2 and E3).

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use std::fmt::Write as _;
use teachtree_analysis::{Analysis, Segment, TrackId, analyze};
use teachtree_base::hands::Side;
use teachtree_base::quantity::Quantity;
use teachtree_base::recording::Recording;
use teachtree_base::scene::{Body, Scene};
use teachtree_engine::evaluator::evaluate;
use teachtree_frames as stream;
use teachtree_language::graph::lower;
use teachtree_language::{Request, Rules, load};
use teachtree_world as world;

/// Somebody to whom nothing happens that the script does not want.
const SEED: u64 = 4;

fn rules() -> Rules {
    let loaded = load(&Request { files: vec!["bimanual.rules".into()], ..Request::default() });
    loaded.rules.unwrap_or_else(|| panic!("{:?}", loaded.diagnostics))
}

fn taught(name: &str) -> Recording {
    world::teach(&world::scene(name).unwrap(), &world::operator(name).unwrap(), SEED).unwrap()
}

fn analyzed(recording: &Recording) -> Analysis {
    let rules = rules();
    let frames = stream::frames(recording, &teachtree_analysis::channels(&rules)).unwrap();
    analyze(&rules, &frames, &evaluate(&lower(&rules), &frames).unwrap())
}

fn names(segments: &[Segment]) -> String {
    segments.iter().map(|segment| segment.primitive.as_str()).collect::<Vec<_>>().join(" ")
}

/// The lanes and the tasks, to a tenth of a second.
fn printed(analysis: &Analysis) -> String {
    let mut text = String::new();
    for track in &analysis.tracks {
        let _ =
            writeln!(text, "{}\n  raw  {}\n  relabeled {}", track.who, names(&track.segments), names(&track.relabeled));
        for task in &track.tasks {
            let _ =
                writeln!(text, "  {} {:.1} – {:.1} s: {}", task.task, task.start_s, task.end_s, names(&task.segments));
        }
    }
    text
}

fn tasks(analysis: &Analysis, side: Side) -> Vec<&str> {
    analysis.track(TrackId::Hand(side)).unwrap().tasks.iter().map(|task| task.task.as_str()).collect()
}

/// The only task of a hand: its name and its primitives.
fn task(analysis: &Analysis, side: Side) -> (String, String) {
    let [task] = analysis.track(TrackId::Hand(side)).unwrap().tasks.as_slice() else { panic!("{}", printed(analysis)) };
    (task.task.clone(), names(&task.segments))
}

#[test]
fn e2_a_hand_over_is_two_tasks_with_a_pass() {
    let found = analyzed(&taught("hand_over_left_to_right"));
    let gives = task(&found, Side::Left);
    let takes = task(&found, Side::Right);
    assert_eq!((gives.0.as_str(), gives.1.as_str()), ("pick_and_place", "Move Approach Grasp Translate Pass Release"));
    assert_eq!((takes.0.as_str(), takes.1.as_str()), ("pick_and_place", "Move Approach Pass Translate Place Release"));
    insta::assert_snapshot!(printed(&found));
}

#[test]
fn e3_a_ring_is_put_on_a_pole_in_the_air() {
    let found = analyzed(&taught("ring_and_pole"));
    for side in Side::BOTH {
        assert_eq!(tasks(&found, side), ["peg_in_hole"], "{}", printed(&found));
    }
    let both = found.track(TrackId::Both).unwrap();
    // The first touch is a fluctuation.
    assert!(names(&both.segments).starts_with("Translate Fit Translate"), "{}", printed(&found));
    assert!(!names(&both.relabeled).contains("Translate Fit Translate"), "{}", printed(&found));
    insta::assert_snapshot!(printed(&found));
}

#[test]
fn two_hands_with_two_objects_do_nothing_together() {
    let found = analyzed(&taught("independent"));
    for side in Side::BOTH {
        let (name, segments) = task(&found, side);
        assert_eq!(
            (name.as_str(), segments.as_str()),
            ("pick_and_place", "Move Approach Grasp Translate Place Release")
        );
    }
    assert_eq!(found.track(TrackId::Both).unwrap().relabeled, []);
}

/// A machine that is reported to take a share of the weight carries that share, and the other hand the rest.
#[test]
fn two_hands_share_the_weight_as_they_are_reported() {
    for (name, label, share) in [("equal_carry", "EqualGrasp", 0.5), ("main_grasp", "MainGrasp(right)", 0.1)] {
        let operator = world::Operator { variation: world::Variation::default(), ..world::operator(name).unwrap() };
        let recording = world::teach(&world::scene(name).unwrap(), &operator, 0).unwrap();
        let labels = &recording.labels["both.label"];
        let rows: Vec<usize> = (0..labels.len()).filter(|row| labels[*row] == label).collect();
        // The load is taken over at the beginning, and the bar stands at the end.
        let middle = &rows[rows.len() / 2..rows.len() * 3 / 4];
        let carried = |side: &str| {
            let tips =
                ["thumb", "index", "middle"].map(|finger| &recording.columns[&format!("{side}.{finger}.force.z")]);
            let sum = |row: &usize| tips.iter().map(|tip| tip.values[*row]).sum::<f64>();
            middle.iter().map(sum).sum::<f64>() / middle.len() as f64
        };
        let (left, right, weight) = (carried("left"), carried("right"), 0.080 * 9.81);
        assert!((left + right - weight).abs() < 0.05 * weight, "{name}: {left} N and {right} N of {weight} N");
        // Under way, give or take a tenth of the weight.
        assert!((left - share * weight).abs() < 0.1 * weight, "{name}: {left} N of {weight} N");
    }
}

/// A log whose sides are exchanged gives the analysis with the sides exchanged, label for label and time for time.
#[test]
fn a_mirrored_recording_gives_the_mirrored_analysis() {
    for name in ["hand_over_left_to_right", "main_grasp"] {
        let recording = taught(name);
        let (plain, other) = (analyzed(&recording), analyzed(&mirrored(&recording)));
        for who in [TrackId::Hand(Side::Left), TrackId::Hand(Side::Right), TrackId::Both] {
            let exchanged = match who {
                TrackId::Hand(side) => TrackId::Hand(side.other()),
                TrackId::Both => TrackId::Both,
            };
            let (one, other) = (plain.track(who).unwrap(), other.track(exchanged).unwrap());
            assert_eq!(lane(&one.segments, true), lane(&other.segments, false), "{name} {who}");
            assert_eq!(lane(&one.relabeled, true), lane(&other.relabeled, false), "{name} {who}");
            let spans = |track: &teachtree_analysis::Track| {
                track.tasks.iter().map(|task| (task.task.clone(), task.frames.clone())).collect::<Vec<_>>()
            };
            assert_eq!(spans(one), spans(other), "{name} {who}");
        }
    }
}

fn lane(segments: &[Segment], exchange: bool) -> Vec<(String, std::ops::Range<usize>)> {
    let name = |segment: &Segment| if exchange { exchanged(&segment.primitive) } else { segment.primitive.clone() };
    segments.iter().map(|segment| (name(segment), segment.frames.clone())).collect()
}

fn exchanged(text: &str) -> String {
    text.replace("left", "?").replace("right", "left").replace('?', "right")
}

/// The recording as a mirror at the plane x = 0 shows it.
fn mirrored(recording: &Recording) -> Recording {
    let mut mirrored = Recording { scene: scene(&recording.scene), ..recording.clone() };
    mirrored.columns.clear();
    for (name, column) in &recording.columns {
        // Of vectors x changes its sign, of turns y and z.
        let turn = name.contains(".rotation.") || name.contains(".angular_velocity.");
        let sign = match (turn, name.rsplit('.').next().unwrap()) {
            (false, "x") | (true, "y" | "z") => -1.0,
            _ => 1.0,
        };
        let mut column = column.clone();
        column.values.iter_mut().for_each(|value| *value *= sign);
        let hand = ["left.", "right."].iter().any(|hand| name.starts_with(hand));
        mirrored.columns.insert(if hand { exchanged(name) } else { name.clone() }, column);
    }
    mirrored
}

fn scene(scene: &Scene) -> Scene {
    let mut mirrored = scene.clone();
    mirrored.bodies.values_mut().for_each(body);
    mirrored.hands = scene.hands.iter().map(|(side, hand)| (side.other(), hand.clone())).collect();
    mirrored
}

fn body(body: &mut Body) {
    let across = |point: &mut [teachtree_base::quantity::Length; 3]| point[0] = Quantity(-point[0].0);
    across(&mut body.position);
    body.rotation = turned(body.rotation);
    for part in &mut body.parts {
        across(&mut part.at);
        part.turned = turned(part.turned);
    }
    body.plug.iter_mut().for_each(across);
    for socket in body.sockets.values_mut() {
        across(&mut socket.rim);
        socket.axis[0] = -socket.axis[0];
    }
}

fn turned([w, x, y, z]: [f64; 4]) -> [f64; 4] {
    [w, x, -y, -z]
}

/// What [`mirrored`] does to poses is a mirror: the mirrored pose of a mirrored point is the mirrored point.
#[test]
fn the_mirror_is_one() {
    let pose = |[w, x, y, z]: [f64; 4], at: Vector3<f64>| {
        Isometry3::from_parts(Translation3::from(at), UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z)))
    };
    let across = |vector: Vector3<f64>| Vector3::new(-vector.x, vector.y, vector.z);
    let (rotation, at, point) = ([0.5, 0.1, -0.7, 0.3], Vector3::new(0.1, 0.2, 0.3), Vector3::new(0.4, -0.5, 0.6));
    let there = across((pose(rotation, at) * nalgebra::Point3::from(point)).coords);
    let mirrored = (pose(turned(rotation), across(at)) * nalgebra::Point3::from(across(point))).coords;
    assert!((there - mirrored).norm() < 1e-12);
}
