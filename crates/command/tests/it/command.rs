//! Tests of `command`: smoothing against its closed form, and commands of demonstrations.

use crate::demonstrated::{commanded, performed};
use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use teachtree_base::hands::Side;
use teachtree_command::smoothing::{deviation, jerk, smooth, smooth_parts, smooth_within};
use teachtree_command::{Commands, FORCE_HZ, Segment, Task, Tip};
use teachtree_logs::read::csv::parse_scene;
use teachtree_world::Operator;

#[test]
fn a_sine_is_passed_as_the_law_says_and_not_moved_in_time() {
    const RATE: f64 = 100.0;
    for (frequency, cutoff) in [(1.0, 4.0), (4.0, 4.0), (12.0, 4.0)] {
        let n = 3000;
        let sine: Vec<f64> =
            (0..n).map(|at| (std::f64::consts::TAU * frequency * f64::from(at) / RATE).sin()).collect();
        let smoothed = smooth(&sine, RATE, cutoff);
        let power = |f: f64| (2.0 * (std::f64::consts::PI * f / RATE).sin()).powi(6);
        let passed = 1.0 / (1.0 + power(frequency) / power(cutoff));
        // Away from the ends, which are held.
        for at in 500..2500 {
            assert!((smoothed[at] - passed * sine[at]).abs() < 1e-3, "{frequency} Hz at {at}");
        }
    }
}

/// Frequency of the tremor of the simulated operators, Hz.
const TREMOR_HZ: f64 = 10.8;

/// Twice the amplitude of the component of a frequency: its range from the lowest to the highest value.
fn range_at(samples: &[f64], rate_hz: f64, frequency_hz: f64) -> f64 {
    let mean = samples.iter().sum::<f64>() / samples.len() as f64;
    let [sine, cosine] = [f64::sin, f64::cos].map(|wave| {
        let phase = |at: usize| wave(std::f64::consts::TAU * frequency_hz * at as f64 / rate_hz);
        samples.iter().enumerate().map(|(at, value)| (value - mean) * phase(at)).sum::<f64>()
    });
    4.0 * sine.hypot(cosine) / samples.len() as f64
}

/// A force of 1 N with a tremor of 0.87 N from peak to peak: both are known in closed form after the filter.
#[test]
fn smoothing_of_forces_removes_tremor_and_keeps_the_mean() {
    const RATE: f64 = 100.0;
    // 27 periods in 250 samples.
    let force = |at: usize| 1.0 + 0.435 * (std::f64::consts::TAU * TREMOR_HZ * at as f64 / RATE).sin();
    let forces: Vec<[f64; 3]> = (0..1250).map(|at| [force(at), 0.0, -force(at)]).collect();
    let smoothed = smooth_parts(&forces, RATE, FORCE_HZ);
    let power = |f: f64| (2.0 * (std::f64::consts::PI * f / RATE).sin()).powi(6);
    let passed = 0.87 / (1.0 + power(TREMOR_HZ) / power(FORCE_HZ));
    assert!((0.001..0.02).contains(&passed), "{passed} N of 0.87 N");
    let middle: Vec<f64> = smoothed[500..750].iter().map(|force| force[0]).collect();
    let left = range_at(&middle, RATE, TREMOR_HZ);
    assert!((left - passed).abs() < 1e-4, "{left} N, expected {passed} N");
    let mean = middle.iter().sum::<f64>() / middle.len() as f64;
    assert!((mean - 1.0).abs() < 1e-4, "{mean} N");
    assert!(smoothed.iter().all(|force| (force[0] + force[2]).abs() < 1e-9), "components are smoothed alike");
}

#[test]
fn smoothing_holds_the_ends_and_keeps_parabolas() {
    let parabola: Vec<f64> = (0..200).map(|at| 1.0 + 0.1 * f64::from(at) - 0.002 * f64::from(at * at)).collect();
    let smoothed = smooth(&parabola, 100.0, 3.0);
    for (one, other) in parabola.iter().zip(&smoothed) {
        assert!((one - other).abs() < 1e-6, "no jerk, nothing to smooth");
    }
    let step: Vec<[f64; 1]> = (0..200).map(|at| [if at < 100 { 0.0 } else { 1.0 }]).collect();
    let smoothed = smooth_within(&step, 100.0, 3.0, 10.0);
    assert!(smoothed[0][0].abs() < 1e-4 && (smoothed[199][0] - 1.0).abs() < 1e-4);
    assert!(jerk(&smoothed, 100.0) < 0.02 * jerk(&step, 100.0));
    // Not farther away than is allowed, whatever it takes.
    assert!(deviation(&step, &smooth_within(&step, 100.0, 3.0, 0.05)) <= 0.05);
}

#[test]
fn commands_that_are_none_are_refused_at_their_line() {
    let read = |text: &str| Commands::read(text, "commands.json").unwrap_err().to_string();
    assert!(read("{").starts_with("commands.json:1:"), "{}", read("{"));
    let wrong = r#"{"schema": "teachtree.commands/1", "log": 5}"#;
    assert!(read(wrong).contains("found `5`, expected a text"), "{}", read(wrong));
    let other = r#"{"schema": "teachtree.analysis/2", "log": "", "rate_hz": 100, "scene": "", "tasks": []}"#;
    assert!(read(other).contains("expected `teachtree.commands/1`"), "{}", read(other));
    let nothing = r#"{"schema": "teachtree.commands/1", "log": "", "rate_hz": 0, "scene": "", "tasks": []}"#;
    assert!(read(nothing).contains("0 samples a second"), "{}", read(nothing));
}

/// This person lost the bar twice as the right hand lifted it, took it up again on the spot, and went on. The robot comes on the person's way, to where the
/// bar was taken in the end, and lifts it once.
#[test]
fn what_was_lost_as_it_was_lifted_is_lifted_once() {
    let commands = commanded("main_grasp", 24);
    let right: Vec<&Task> = commands.tasks.iter().filter(|task| task.track == Side::Right).collect();
    let [task] = right[..] else { panic!("{:?}", right.iter().map(|task| &task.task).collect::<Vec<_>>()) };
    assert_eq!((task.task.as_str(), task.start_s), ("carry_together", 0.0));
    let dropped = task.left_out.iter().filter(|left| left.why == "dropped");
    assert_eq!(dropped.map(|left| left.primitives[0].as_str()).collect::<Vec<_>>(), ["Grasp", "Grasp"]);
    let [first, second, third, ..] = &task.segments[..] else { panic!("{} segments", task.segments.len()) };
    assert_eq!([first, second, third].map(|it| it.primitive.as_str()), ["Move", "Approach", "Grasp"]);
    // One after the other, and the way leads to where the object is taken.
    assert!((third.start_s - second.start_s - second.duration_s).abs() < 1e-9);
    for axis in 0..3 {
        let (way, taken) = (second.object.last().unwrap()[axis], third.object[0][axis]);
        assert!((way - taken).abs() < 1e-6, "{way} m and {taken} m");
    }
}

/// This person grasps, lets go and grasps again at once, which rules call one approach: the robot does not do it twice.
#[test]
fn a_grasp_that_is_made_again_at_once_is_made_once() {
    let commands = commanded("pick_and_place", 3);
    let [task] = &commands.tasks[..] else { panic!("{} tasks", commands.tasks.len()) };
    assert_eq!(task.left_out.iter().map(|left| left.why.as_str()).collect::<Vec<_>>(), ["failed try"]);
    let approach = task.segments.iter().find(|segment| segment.primitive == "Approach").unwrap();
    // Of the approach of 1.13 s, 0.63 s are before the touch.
    assert!((approach.duration_s - 0.63).abs() < 0.02, "{} s", approach.duration_s);
}

/// This person's left hand comes off the box three times, for a third of a second, while both push it: to the robot that is one push, by the same fingers.
#[test]
fn who_comes_off_for_a_moment_pushes_on() {
    let commands = commanded("push_together", 34);
    let task = commands.tasks.iter().find(|task| task.track == Side::Left).unwrap();
    assert_eq!(task.grasps.len(), 1);
    let mut primitives: Vec<&str> = task.segments.iter().map(|segment| segment.primitive.as_str()).collect();
    primitives.dedup();
    assert_eq!(primitives, ["Move", "Approach", "Push", "Trace", "Release"]);
}

/// This person's right hand brushes the box, and takes part when the left one has pushed it by 86 mm: it is not in the way until then.
#[test]
fn a_brush_is_part_of_the_way() {
    let commands = commanded("push_together", 11);
    let task = commands.tasks.iter().find(|task| task.track == Side::Right).unwrap();
    let pushes = task.segments.iter().filter(|segment| segment.primitive == "Push").count();
    assert_eq!((pushes, task.left_out.len()), (1, 0), "the brush is not a push");
    let touch = task.segments.iter().position(|segment| segment.touching).unwrap();
    let (way, touch) = (&task.segments[touch - 1], &task.segments[touch]);
    assert_eq!((way.primitive.as_str(), touch.primitive.as_str()), ("Approach", "Push"));
    assert!((way.demonstrated_start_s + way.duration_s - touch.demonstrated_start_s).abs() < 0.02);
}

/// This person's box comes off the wall by tenths of a millimeter as it is pushed along it: the robot is to keep it a little into the wall, which is at -200 mm.
#[test]
fn what_is_pushed_along_a_wall_leans_against_it() {
    let commands = commanded("push_and_trace", 36);
    let traces = commands.tasks.iter().flat_map(|task| &task.segments).filter(|segment| segment.primitive == "Trace");
    let settled = (0.3 * commands.rate_hz) as usize;
    let beside: Vec<f64> = traces.flat_map(|segment| segment.object.iter().skip(settled).map(|pose| pose[0])).collect();
    assert!(beside.len() > 100);
    for x in beside {
        assert!((-0.2008..-0.2004).contains(&x), "{x} m");
    }
}

/// This hand stays near the object for six seconds after its release. A finger that held as long as the others still takes part.
#[test]
fn a_hand_that_lingers_has_held_with_all_of_its_fingers() {
    let commands = commanded("independent", 21);
    let right = commands.tasks.iter().find(|task| task.track == Side::Right).unwrap();
    let fingers: Vec<&str> = right.grasps[0].contacts.iter().map(|contact| contact.finger.name()).collect();
    assert_eq!(fingers, ["thumb", "index", "middle"]);
}

/// A peg goes into a hole of what the other hand holds along the axis of that hole, and the commands say whose hole it is.
#[test]
fn a_hole_of_another_object_is_gone_into_along_its_axis() {
    let commands = commanded("hold_and_insert", 21);
    let task = commands.tasks.iter().find(|task| task.task == "peg_in_hole").unwrap();
    let into = task.into.as_ref().unwrap();
    assert_eq!(into.body, "holder");
    let insert = task.segments.iter().find(|segment| segment.primitive == "Insert").unwrap();
    // The end of the peg is 40 mm below its middle, the rim 20 mm above that of the holder; it waits 5 mm above the rim.
    let above = |pose: &[f64; 7]| pose[2] - 0.04 - (into.pose[2] + 0.02);
    assert!((above(&insert.object[0]) - 0.005).abs() < 0.002, "{} m above the rim", above(&insert.object[0]));
    assert!(above(insert.object.last().unwrap()) < -0.03);
    // As near as the hole leaves room, and smoothing may move it.
    for pose in &insert.object {
        let [x, y, _, w, ..] = pose;
        let beside = ((x - into.pose[0]).powi(2) + (y - into.pose[1]).powi(2)).sqrt();
        assert!(beside < 0.001 && w.abs() > 0.9995, "{beside} m beside the axis, turned: {w}");
    }
}

/// Both hands hold what they put together, and this operator searches for the pole for two seconds, with Insert and Fit in turn. The ring still goes down
/// along the axis of the pole, wherever the other hand holds the pole, and without a wait.
#[test]
fn what_both_hands_hold_is_put_together_along_the_axis() {
    let commands = commanded("ring_and_pole", 2);
    let of = |side: Side| commands.tasks.iter().find(|task| task.track == side).unwrap();
    let (cylinder, ring) = (of(Side::Left), of(Side::Right));
    assert!(ring.into.is_none());
    let pose = |[x, y, z, w, i, j, k]: [f64; 7]| {
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
        Isometry3::from_parts(Translation3::new(x, y, z), turn)
    };
    let at = |task: &Task, time: f64| {
        let segment = task.segments.iter().rfind(|segment| segment.demonstrated_start_s <= time).unwrap();
        let sample = ((time - segment.demonstrated_start_s) * commands.rate_hz).round() as usize;
        pose(segment.object[sample.min(segment.object.len() - 1)])
    };
    let inserts: Vec<usize> = (0..ring.segments.len()).filter(|at| ring.segments[*at].primitive == "Insert").collect();
    assert!(inserts.len() > 1 && inserts.iter().any(|at| ring.segments[at + 1].primitive == "Fit"), "{inserts:?}");
    let (mut deepest, mut farthest, mut askew) = (0.0_f64, 0.0_f64, 0.0_f64);
    for segment in inserts.iter().map(|at| &ring.segments[*at]) {
        for sample in 0..segment.object.len() {
            let time = segment.demonstrated_start_s + sample as f64 / commands.rate_hz;
            let (ring, cylinder) = (at(ring, time), at(cylinder, time));
            // The ring's lower face from the top of the pole, seen from the cylinder.
            let from_rim = cylinder.inverse_transform_point(&(ring * Point3::new(0.0, 0.0, -0.012))).coords;
            deepest = deepest.min(from_rim.z - 0.08);
            farthest = farthest.max(from_rim.xy().norm());
            askew = askew.max((ring.rotation * Vector3::z()).angle(&(cylinder.rotation * Vector3::z())));
        }
    }
    assert!(deepest < -0.048, "{deepest} m deep");
    // The ring leaves 1.5 mm of room.
    assert!(farthest < 0.0015, "{farthest} m beside the pole");
    assert!(askew < 3.0_f64.to_radians(), "{askew} rad askew");
}

/// These people's left hand knocks the cylinder, with the ring on it, as it lets go: by 17 mm, and by 14 mm with a brush of the ring. The robot puts both down where
/// they came to rest, and does not knock.
#[test]
fn what_is_knocked_as_it_is_let_go_is_put_down_where_it_comes_to_rest() {
    for seed in [13, 3] {
        let commands = commanded("ring_and_pole", seed);
        assert_eq!(commands.tasks.len(), 2, "{seed}: the brush is left out");
        for task in &commands.tasks {
            let release = task.segments.iter().rfind(|segment| segment.touching).unwrap();
            assert_eq!(release.primitive, "Release");
            let place = |pose: &[f64; 7]| Vector3::new(pose[0], pose[1], pose[2]);
            let [first, last] = [release.object.first(), release.object.last()].map(|pose| place(pose.unwrap()));
            let moved = (last - first).norm();
            assert!(moved < 0.003, "{seed}: `{}` moves by {moved} m as it is let go", task.object);
        }
    }
}

/// Two things are put down beside each other, and a thumb on its way out pushes the jar, which the other hand has just let go: the robot does not, and it is said.
#[test]
fn what_is_moved_beside_the_task_is_said() {
    let read = |ending: &str| {
        let file = format!("tests/fixtures/crowded{ending}");
        std::fs::read_to_string(std::path::Path::new(crate::ROOT).join(file)).unwrap()
    };
    let scene = parse_scene(&read(".yaml"), "crowded.yaml").unwrap();
    let operator = Operator::read(&read(".operator.yaml"), "crowded.operator.yaml").unwrap();
    let said = |seed: u64| {
        let commands = performed(&scene, &operator, seed);
        let left_out = commands.tasks.into_iter().flat_map(|task| task.left_out);
        left_out.filter(|left| left.why.starts_with("moves ")).collect::<Vec<_>>()
    };
    let [moved] = &said(11)[..] else { panic!("one thing is moved") };
    assert_eq!((moved.why.as_str(), &moved.primitives[..]), ("moves `jar`", &["Push".to_string()][..]));
    assert!((5.7..5.8).contains(&moved.start_s) && (6.0..6.2).contains(&moved.end_s), "{moved:?}");
    assert!(said(5).is_empty());
}

/// Operators tremble while they press: the robot presses as hard, and does not tremble.
#[test]
fn tremor_of_operators_is_not_commanded() {
    let commands = commanded("pick_and_press", 7001);
    let segments = commands.tasks.iter().flat_map(|task| &task.segments);
    let [press] = segments.filter(|segment| segment.primitive == "Press").collect::<Vec<_>>()[..] else {
        panic!("one Press")
    };
    let total = |of: fn(&Tip) -> &Vec<[f64; 3]>, axis: usize| -> Vec<f64> {
        let sum = |at: usize| press.tips.iter().filter_map(|tip| Some(of(tip).get(at)?[axis])).sum();
        (0..press.object.len()).map(sum).collect()
    };
    let ranges = |of: fn(&Tip) -> &Vec<[f64; 3]>| {
        [0, 1, 2].map(|axis| range_at(&total(of, axis), commands.rate_hz, TREMOR_HZ)).into_iter().fold(0.0, f64::max)
    };
    let (demonstrated, commanded) = (ranges(|tip| &tip.demonstrated_force), ranges(|tip| &tip.force));
    assert!(demonstrated > 0.3, "the operator trembles by {demonstrated} N");
    assert!(commanded < 0.1, "the robot trembles by {commanded} N");
    let segments = commands.tasks.iter().flat_map(|task| &task.segments);
    let held = |segment: &&Segment| segment.duration_s > 0.5 && segment.touching;
    for (segment, tip) in segments.filter(held).flat_map(|segment| segment.tips.iter().map(move |tip| (segment, tip))) {
        let mean = |forces: &[[f64; 3]]| {
            let sum: Vector3<f64> = forces.iter().map(|force| Vector3::from(*force)).sum();
            sum / forces.len() as f64
        };
        let (demonstrated, commanded) = (mean(&tip.demonstrated_force), mean(&tip.force));
        let moved = (commanded - demonstrated).norm();
        let (name, finger) = (&segment.primitive, tip.finger);
        assert!(moved <= 0.05 * demonstrated.norm(), "{name}, {finger}: {moved} N of {} N", demonstrated.norm());
    }
}
