//! What an outcome says about objects that fall, and about those that move untouched.

use crate::one_gripper::{Signal, along, log};
use teachtree_analysis::outcome::OutcomeKind;
use teachtree_analysis::{Analysis, analyze, explain_by_motion};
use teachtree_base::recording::Recording;
use teachtree_engine::evaluator::evaluate;
use teachtree_language::graph::lower;
use teachtree_language::{Request, load};

/// When the box falls, s.
const FALLS_S: f64 = 5.05;

/// The analysis with the motion of the objects, by the rules with this hand model and these params.
fn explained(log: &Recording, hand_model: &str, params: &[(&str, &str)]) -> Analysis {
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

#[test]
fn the_outcome_names_a_fall_and_what_makes_it_a_release() {
    let message = |found: &Analysis| found.outcome().sentence();
    let opened = dropped(0.06, true);
    let found = explained(&opened, "hand_gripper.rules", &[]);
    assert_eq!(found.outcome().result, OutcomeKind::Failure, "{}", message(&found));
    let said = message(&found);
    assert!(said.contains("no later attempt succeeded: box fell 60 mm from the opened jaws at 5.0"), "{said}");
    assert!(said.ends_with("if that is intended, set `params: {drop_way: 70 mm}`"), "{said}");
    // The advice is right.
    let advised = explained(&opened, "hand_gripper.rules", &[("drop_way", "70 mm")]);
    assert_eq!(advised.outcome().result, OutcomeKind::Success, "{}", message(&advised));
    assert_eq!(advised.falls, []);
    // What falls out of closed jaws is lost, and what falls too fast exceeds every value of the param.
    let lost = message(&explained(&dropped(0.06, false), "hand_gripper.rules", &[]));
    assert!(lost.contains(": box fell 60 mm at 5.0") && !lost.contains("jaws"), "{lost}");
    let high = message(&explained(&dropped(0.5, true), "hand_gripper.rules", &[]));
    assert!(high.contains("fell 500 mm from the opened jaws") && !high.contains("drop_way"), "{high}");
}

/// Two fingers push a crate over a table; the scene has a box of this width along the push.
fn pushed(width_mm: u32) -> Recording {
    let scene = format!(
        "
bodies:
  crate: {{role: object, parts: [{{box: [{width_mm} mm, 140 mm, 120 mm]}}]}}
  table: {{role: support, position: [0 m, 0 m, -10 mm], parts: [{{box: [3 m, 3 m, 20 mm]}}]}}
hands: {{right: {{fingers: [thumb, index]}}}}
"
    );
    let way = |t: f64| along(t, &[(3.0, 0.0), (6.0, 0.25)]);
    let thumb_x = |t: f64| match t {
        t if t < 3.0 => along(t, &[(1.0, -0.5), (2.8, -0.16)]),
        t if t < 6.5 => -0.16 + way(t),
        t => along(t, &[(6.5, 0.09), (8.0, -0.5)]),
    };
    let index_x = |t: f64| thumb_x(t) + 0.05;
    let signals: [Signal; 9] = [
        ("right.thumb.position.x", &thumb_x),
        ("right.thumb.position.y", &|_| 0.03),
        ("right.thumb.position.z", &|_| 0.06),
        ("right.index.position.x", &index_x),
        ("right.index.position.y", &|_| -0.02),
        ("right.index.position.z", &|_| 0.06),
        ("crate.position.x", &way),
        ("crate.position.y", &|_| 0.0),
        ("crate.position.z", &|_| 0.06),
    ];
    log(&scene, 10, &signals)
}

#[test]
fn an_outcome_without_tasks_names_what_moved_untouched() {
    let found = explained(&pushed(60), "hand_vision.rules", &[]);
    let [motion] = &found.untouched[..] else { panic!("{:?}", found.untouched) };
    let [start_s, end_s] = motion.span_s;
    assert!((start_s - 3.0).abs() < 0.1 && (end_s - 6.0).abs() < 0.1, "{motion:?}");
    let said = found.outcome().sentence();
    assert!(said.starts_with("unknown: no task has a name; crate moved 250 mm at 3."), "{said}");
    let advice = "but no hand touched it: its surface in the scene stays 80 mm or more from the fingertips; write its `parts` in their true size";
    assert!(said.ends_with(advice), "{said}");
    // With the true size it is a push.
    let true_size = explained(&pushed(200), "hand_vision.rules", &[]);
    assert_eq!(true_size.outcome().result, OutcomeKind::Success, "{}", true_size.outcome().sentence());
    assert_eq!(true_size.untouched, []);
}
