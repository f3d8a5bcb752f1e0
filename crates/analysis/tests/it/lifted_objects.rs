//! An object that rises with a gripper is carried, whatever the gripper says of its jaws.

use crate::one_gripper::{Signal, along, log, segments};

const BOX: &str = "box: {role: object, parts: [{box: [50 mm, 50 mm, 50 mm]}]}";
const TABLE: &str = "table: {role: support, position: [0 m, 0 m, -10 mm], parts: [{box: [3 m, 3 m, 20 mm]}]}";

/// The primitives, and the start of the Grasp before the object is carried, s. The gripper comes down until 3 s, lifts the object at 4 s by 0.17 m, and puts it
/// down at 8 s. Its flag is set from `flag_s` to 8.5 s; its opening has these values, m, at these times, s.
fn lift(on_table: bool, flag_s: f64, openings: &[(f64, f64)]) -> (Vec<String>, f64) {
    let bodies = if on_table { format!("{BOX}, {TABLE}") } else { BOX.to_string() };
    let scene = format!("{{bodies: {{{bodies}}}, hands: {{right: {{fingers: [thumb, palm]}}}}}}");
    let x = |t: f64| along(t, &[(5.0, 0.0), (7.0, 0.3)]);
    let z = |t: f64| {
        along(t, &[(1.0, 0.3), (3.0, 0.03), (4.0, 0.03), (5.0, 0.2), (7.0, 0.2), (8.0, 0.03), (9.0, 0.03), (10.0, 0.3)])
    };
    let of_box = |t: f64| along(t, &[(4.0, 0.025), (5.0, 0.195), (7.0, 0.195), (8.0, 0.025)]);
    let closed = |t: f64| f64::from(u8::from(t > flag_s && t < 8.5));
    let opening = |t: f64| along(t, openings);
    let mut signals: Vec<Signal> = vec![
        ("right.thumb.position.x", &x),
        ("right.thumb.position.y", &|_| 0.0),
        ("right.thumb.position.z", &z),
        ("right.gripper.closed", &closed),
        ("box.position.x", &x),
        ("box.position.y", &|_| 0.0),
        ("box.position.z", &of_box),
    ];
    if !openings.is_empty() {
        signals.push(("right.gripper.opening", &opening));
    }
    let found = segments(&log(&scene, 11, &signals), &["failures.rules"], "hand_gripper.rules");
    let carry = found.iter().position(|segment| segment.primitive == "Translate");
    let grasp = carry.and_then(|at| found.get(at.checked_sub(1)?)).filter(|segment| segment.primitive == "Grasp");
    let start_s = grasp.map_or(f64::NAN, |segment| segment.start_s);
    (found.into_iter().map(|segment| segment.primitive).collect(), start_s)
}

/// The flag is a command: it is set while the gripper still comes nearer by more than 30 mm. The jaws close up to 0.8 s later, if the log has their opening.
#[test]
fn an_early_flag_does_not_make_a_lift_a_push() {
    let jaws = |closing_s: f64| [(closing_s, 0.08), (3.3, 0.05), (8.5, 0.05), (8.8, 0.08)];
    // The flag is already set with jaws that are ready to take the object.
    let ready = [(0.3, 0.08), (0.6, 0.055), (3.2, 0.055), (3.5, 0.05), (8.5, 0.05), (8.8, 0.08)];
    let cases: [(f64, &[(f64, f64)]); 6] =
        [(2.6, &[]), (2.3, &[]), (2.6, &jaws(2.7)), (2.3, &jaws(2.5)), (2.6, &jaws(2.9)), (0.5, &ready)];
    for ((flag_s, openings), on_table) in cases.into_iter().flat_map(|case| [(case, false), (case, true)]) {
        let (found, grasp_s) = lift(on_table, flag_s, openings);
        let context = format!("{flag_s} s, {openings:?}, on a table: {on_table}: {found:?}, grasp at {grasp_s} s");
        assert!(!found.iter().any(|primitive| primitive == "Push"), "{context}");
        assert!((3.2..3.7).contains(&grasp_s), "{context}");
    }
}

/// The jaws meet but for a card; they open with the flag, or 0.3 s later.
#[test]
fn a_thin_object_that_is_lifted_is_neither_pushed_nor_missed() {
    for (opens_s, on_table) in [(8.5, false), (8.5, true), (8.8, false), (8.8, true)] {
        let openings = [(3.0, 0.08), (3.4, 0.001), (opens_s, 0.001), (opens_s + 0.3, 0.08)];
        let (found, grasp_s) = lift(on_table, 3.3, &openings);
        let context = format!("opens at {opens_s} s, on a table: {on_table}: {found:?}, grasp at {grasp_s} s");
        assert!(!found.iter().any(|primitive| primitive == "Push"), "{context}");
        assert!((3.2..3.7).contains(&grasp_s), "{context}");
        let missed_after = found.iter().skip_while(|primitive| *primitive != "Translate").any(|found| found == "Miss");
        assert!(!missed_after, "{context}");
    }
}
