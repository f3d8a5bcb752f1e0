//! What an outcome says about objects that fall, and about those that move untouched.

use crate::one_gripper::{Signal, along, log};
use crate::slips::noise;
use teachtree_analysis::outcome::{ExpectedTasks, OutcomeKind, ReasonKind};
use teachtree_analysis::{Analysis, analyze, explain_by_motion};
use teachtree_base::recording::Recording;
use teachtree_engine::evaluator::evaluate;
use teachtree_language::graph::lower;
use teachtree_language::{Request, load};

/// When the box falls, s.
const FALLS_S: f64 = 5.05;

/// The analysis with the motion of the objects, by the rules with this hand model and these params.
pub fn explained(log: &Recording, hand_model: &str, params: &[(&str, &str)]) -> Analysis {
    let request = Request {
        files: vec!["failures.rules".into()],
        hand_file: Some(hand_model.into()),
        overrides: params.iter().map(|(name, value)| ((*name).into(), (*value).into())).collect(),
        ..Request::default()
    };
    let rules = load(&request).rules.unwrap();
    let frames = teachtree_frames::frames(log, &teachtree_analysis::channels(&rules)).unwrap();
    let mut found = analyze(&rules, &frames, &evaluate(&lower(&rules), &frames).unwrap());
    explain_by_motion(&mut found, &rules, &frames, &frames);
    found
}

/// A gripper at rest holds a box above a table. The box falls by `way_m`, after the gripper was opened if `opens`.
fn dropped(way_m: f64, opens: bool) -> Recording {
    const SCENE: &str = "
bodies:
  box: {role: object, parts: [{box: [50 mm, 50 mm, 50 mm]}]}
  table: {role: support, position: [0 m, 0 m, -10 mm], parts: [{box: [3 m, 3 m, 20 mm]}]}
hands: {right: {fingers: [thumb]}}
";
    let lifted = |t: f64| along(t, &[(2.6, 0.0), (3.2, 0.4), (4.0, 0.4), (4.6, way_m)]);
    let x = |t: f64| along(t, &[(2.6, 0.0), (4.0, 0.3)]);
    let z = |t: f64| match t {
        t if t < 2.6 => along(t, &[(0.0, 0.3), (1.5, 0.03)]),
        t if t < 7.0 => 0.03 + lifted(t),
        t => along(t, &[(7.0, 0.03 + way_m), (8.0, 0.5)]),
    };
    let box_z = |t: f64| 0.025 + lifted(t) - (4.9 * (t - FALLS_S).max(0.0).powi(2)).min(way_m);
    let opened_s = if opens { 5.0 } else { 6.5 };
    let closed = |t: f64| f64::from(u8::from((2.1..opened_s).contains(&t)));
    let opening = |t: f64| along(t, &[(1.8, 0.08), (2.2, 0.05), (opened_s, 0.05), (opened_s + 0.3, 0.08)]);
    let signals: [Signal; 8] = [
        ("right.thumb.position.x", &x),
        ("right.thumb.position.y", &|_| 0.0),
        ("right.thumb.position.z", &z),
        ("right.gripper.closed", &closed),
        ("right.gripper.opening", &opening),
        ("box.position.x", &x),
        ("box.position.y", &|_| 0.0),
        ("box.position.z", &box_z),
    ];
    log(SCENE, 9, &signals)
}

/// A gripper carries a box against a wall and lowers it at this speed, m/s. It opens when the box is this high above the table, m.
fn lowered(speed: f64, height_m: f64) -> Recording {
    const SCENE: &str = "
bodies:
  box: {role: object, parts: [{box: [50 mm, 50 mm, 50 mm]}]}
  table: {role: support, position: [0 m, 0 m, -10 mm], parts: [{box: [3 m, 3 m, 20 mm]}]}
  wall: {role: wall, position: [350 mm, 0 mm, 200 mm], parts: [{box: [110 mm, 400 mm, 400 mm]}]}
hands: {right: {fingers: [thumb]}}
";
    let down_s = 5.2 + 0.3 / speed;
    let opened_s = down_s - height_m / speed;
    let lifted = |t: f64| along(t, &[(2.6, 0.0), (3.0, 0.3), (5.2, 0.3), (down_s, 0.0)]);
    let x = |t: f64| along(t, &[(3.0, 0.0), (4.0, 0.27), (4.1, 0.27), (4.6, 0.15)]);
    let z = |t: f64| match t {
        t if t < 2.6 => along(t, &[(0.0, 0.3), (1.5, 0.03)]),
        t if t < down_s + 0.4 => 0.03 + lifted(t),
        t => along(t, &[(down_s + 0.4, 0.03), (down_s + 1.6, 0.4)]),
    };
    let box_z = |t: f64| 0.025 + lifted(t);
    let closed = |t: f64| f64::from(u8::from((2.1..opened_s).contains(&t)));
    let opening = |t: f64| along(t, &[(1.8, 0.08), (2.2, 0.05), (opened_s, 0.05), (opened_s + 0.25, 0.08)]);
    let signals: [Signal; 8] = [
        ("right.thumb.position.x", &x),
        ("right.thumb.position.y", &|_| 0.0),
        ("right.thumb.position.z", &z),
        ("right.gripper.closed", &closed),
        ("right.gripper.opening", &opening),
        ("box.position.x", &x),
        ("box.position.y", &|_| 0.0),
        ("box.position.z", &box_z),
    ];
    log(SCENE, 10, &signals)
}

/// In a failed task a hand may lower its object, which does not fall then.
#[test]
fn an_object_that_a_hand_lowers_does_not_fall() {
    for (speed, height_m) in [(0.2, 0.006), (0.1, 0.003), (0.15, 0.01)] {
        let found = explained(&lowered(speed, height_m), "hand_gripper.rules", &[]);
        let said = found.outcome().sentence();
        assert!(said.starts_with("failure: right collided box") && !said.contains("fell"), "{said}");
        assert_eq!(found.falls, []);
    }
}

#[test]
fn the_outcome_names_a_fall_and_what_makes_it_a_release() {
    let message = |found: &Analysis| found.outcome().sentence();
    let opened = dropped(0.06, true);
    let found = explained(&opened, "hand_gripper.rules", &[]);
    let said = message(&found);
    // An early release looks the same as one above a bin.
    let outcome = found.outcome();
    assert_eq!((outcome.result, outcome.reasons[0].kind), (OutcomeKind::Unknown, ReasonKind::LetFall), "{said}");
    assert!(said.contains(" s: box fell 60 mm from the opened jaws at 5.0"), "{said}");
    assert!(said.ends_with(", which may be intended: if it is, set `params: {drop_way: 70 mm}`"), "{said}");
    // It is also named where an expected task is missing.
    let expected = ExpectedTasks::parse("pick_and_place x 3").unwrap();
    let missing = Analysis { expected, ..explained(&opened, "hand_gripper.rules", &[]) }.outcome();
    assert_eq!(missing.result, OutcomeKind::Failure);
    assert!(missing.reasons.iter().any(|reason| reason.kind == ReasonKind::LetFall), "{}", missing.sentence());
    // The advice is right.
    let advised = explained(&opened, "hand_gripper.rules", &[("drop_way", "70 mm")]);
    assert_eq!(advised.outcome().result, OutcomeKind::Success, "{}", message(&advised));
    assert_eq!(advised.falls, []);
    // What falls out of closed jaws is lost, whatever the param is.
    for params in [&[][..], &[("drop_way", "70 mm")], &[("drop_way", "300 mm")]] {
        let found = explained(&dropped(0.06, false), "hand_gripper.rules", params);
        let lost = message(&found);
        assert_eq!(found.outcome().result, OutcomeKind::Failure, "{params:?}: {lost}");
        assert!(lost.contains(": box fell 60 mm at 5.0") && !lost.contains("jaws"), "{params:?}: {lost}");
    }
    let high = dropped(0.5, true);
    let said = message(&explained(&high, "hand_gripper.rules", &[]));
    assert!(said.contains("fell 500 mm from the opened jaws") && said.ends_with("{drop_way: 290 mm}`"), "{said}");
    let advised = explained(&high, "hand_gripper.rules", &[("drop_way", "290 mm")]);
    assert_eq!(advised.outcome().result, OutcomeKind::Success, "{}", message(&advised));
}

/// The fingers of the right hand push a crate over a table; the scene has a box of this width along the push. The left hand may rest 0.6 m away.
fn pushed(width_mm: u32, has_left: bool) -> Recording {
    let left = if has_left { ", left: {fingers: [thumb, index]}" } else { "" };
    let scene = format!(
        "
bodies:
  crate: {{role: object, parts: [{{box: [{width_mm} mm, 140 mm, 120 mm]}}]}}
  table: {{role: support, position: [0 m, 0 m, -10 mm], parts: [{{box: [3 m, 3 m, 20 mm]}}]}}
hands: {{right: {{fingers: [thumb, index]}}{left}}}
"
    );
    let way = |t: f64| along(t, &[(3.0, 0.0), (6.0, 0.25)]);
    let thumb_x = |t: f64| match t {
        t if t < 3.0 => along(t, &[(1.0, -0.5), (2.8, -0.16)]),
        t if t < 6.5 => -0.16 + way(t),
        t => along(t, &[(6.5, 0.09), (8.0, -0.5)]),
    };
    let index_x = |t: f64| thumb_x(t) + 0.05;
    let left_x = |t: f64| 0.1 + 0.02 * t.sin();
    let signals: [Signal; 15] = [
        ("right.thumb.position.x", &thumb_x),
        ("right.thumb.position.y", &|_| 0.03),
        ("right.thumb.position.z", &|_| 0.06),
        ("right.index.position.x", &index_x),
        ("right.index.position.y", &|_| -0.02),
        ("right.index.position.z", &|_| 0.06),
        ("crate.position.x", &way),
        ("crate.position.y", &|_| 0.0),
        ("crate.position.z", &|_| 0.06),
        ("left.thumb.position.x", &left_x),
        ("left.thumb.position.y", &|_| 0.7),
        ("left.thumb.position.z", &|_| 0.06),
        ("left.index.position.x", &left_x),
        ("left.index.position.y", &|_| 0.68),
        ("left.index.position.z", &|_| 0.06),
    ];
    log(&scene, 10, if has_left { &signals } else { &signals[..9] })
}

#[test]
fn an_outcome_without_tasks_names_what_moved_untouched() {
    let found = explained(&pushed(60, false), "hand_vision.rules", &[]);
    let [motion] = &found.untouched[..] else { panic!("{:?}", found.untouched) };
    let [start_s, end_s] = motion.span_s;
    assert!((start_s - 3.0).abs() < 0.1 && (end_s - 6.0).abs() < 0.1, "{motion:?}");
    let said = found.outcome().sentence();
    assert!(said.starts_with("unknown: no task has a name; crate moved 250 mm at 3."), "{said}");
    let advice = "but no hand touched it: its surface in the scene stays 80 mm or more from the fingertips; write its `parts` in their true size";
    assert!(said.ends_with(advice), "{said}");
    // So does the same log with a hand that is farther away.
    let two_hands = explained(&pushed(60, true), "hand_vision.rules", &[]).outcome().sentence();
    assert!(two_hands.ends_with(advice), "{two_hands}");
    // No size explains what moves far from the hand.
    let mut far = pushed(60, false);
    for finger in ["thumb", "index"] {
        let column = far.columns.get_mut(&format!("right.{finger}.position.y")).unwrap();
        column.values.iter_mut().for_each(|y| *y += 0.7);
    }
    let far = explained(&far, "hand_vision.rules", &[]).outcome().sentence();
    assert!(far.contains("crate moved 250 mm") && far.ends_with("mm or more from the fingertips"), "{far}");
    // With the true size it is a push.
    let true_size = explained(&pushed(200, false), "hand_vision.rules", &[]);
    assert_eq!(true_size.outcome().result, OutcomeKind::Success, "{}", true_size.outcome().sentence());
    assert_eq!(true_size.untouched, []);
}

/// The noise of a tracker does not move an object, nor does a jump that it takes back. A hand closes far away.
#[test]
fn what_a_tracker_scatters_has_not_moved() {
    const SCENE: &str = "
bodies:
  box: {role: object, parts: [{box: [50 mm, 50 mm, 50 mm]}]}
  table: {role: support, position: [0 m, 0 m, -10 mm], parts: [{box: [3 m, 3 m, 20 mm]}]}
hands: {right: {fingers: [thumb]}}
";
    let untouched = |deviation_m: f64, jump_m: f64, jump_s: f64, way_m: f64| {
        let scatter = |t: f64, axis: f64| deviation_m * noise((t * 100.0).round(), axis);
        let x = |t: f64| along(t, &[(0.0, -0.5), (2.0, -0.25), (3.0, -0.25), (6.0, -0.5)]);
        let jumped = |t: f64| if (4.0..4.0 + jump_s).contains(&t) { jump_m } else { 0.0 };
        let box_x = |t: f64| along(t, &[(4.0, 0.0), (5.0, way_m)]) + jumped(t) + scatter(t, 1.0);
        let signals: [Signal; 8] = [
            ("right.thumb.position.x", &x),
            ("right.thumb.position.y", &|_| 0.0),
            ("right.thumb.position.z", &|_| 0.05),
            ("right.gripper.closed", &|t| f64::from(u8::from((2.1..3.0).contains(&t)))),
            ("right.gripper.opening", &|t| along(t, &[(1.8, 0.08), (2.2, 0.05), (3.0, 0.05), (3.3, 0.08)])),
            ("box.position.x", &box_x),
            ("box.position.y", &|t| scatter(t, 2.0)),
            ("box.position.z", &|t| 0.025 + scatter(t, 3.0)),
        ];
        explained(&log(SCENE, 8, &signals), "hand_gripper.rules", &[]).untouched
    };
    for deviation_m in [0.0, 2e-3, 8e-3] {
        for (jump_m, jump_s) in [(0.0, 0.0), (0.05, 0.01), (0.05, 0.05), (0.05, 0.3), (0.2, 0.6)] {
            let found = untouched(deviation_m, jump_m, jump_s, 0.0);
            assert_eq!(found, [], "{deviation_m} {jump_m} {jump_s}");
        }
        let moved = untouched(deviation_m, 0.0, 0.0, 0.1);
        let [motion] = &moved[..] else { panic!("{deviation_m}: {moved:?}") };
        let [start_s, end_s] = motion.span_s;
        assert!((motion.way_m - 0.1).abs() < 0.02 && start_s > 3.5 && end_s < 6.0, "{deviation_m}: {motion:?}");
    }
}
