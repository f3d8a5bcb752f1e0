//! `explain`: the inspector against the evaluators, and what a user reads.

use crate::engine::random;
use crate::program::{self, complained, teachtree};
use proptest::prelude::*;
use serde_json::Value;
use std::process::Output;
use teachtree_base::hands::Side;
use teachtree_engine::evaluator::evaluate;
use teachtree_engine::inspect::Inspector;
use teachtree_engine::runs::Leaves;
use teachtree_language::graph::lower;
use teachtree_language::rules::{Branch, Consequent, Label, Rules, TreeScope};

/// The leaf at the end of a path.
fn at_end(branch: &Branch, path: &[usize], before: Option<Label>) -> Option<Label> {
    match &branch.choices[path[0]].then {
        Consequent::Primitive(label) => Some(*label),
        Consequent::Separate => None,
        Consequent::Stay => before,
        Consequent::Branch(below) => at_end(below, &path[1..], before),
    }
}

fn paths_lead_to_leaves(
    rules: &Rules,
    leaves: &Leaves,
    inspector: &mut Inspector,
    side: Option<Side>,
) -> Result<(), TestCaseError> {
    let scope = if side.is_some() { TreeScope::EachHand } else { TreeScope::BothHands };
    let Some(tree) = rules.tree(scope).filter(|_| inspector.tree(side).is_some()) else { return Ok(()) };
    for frame in leaves.frames.clone() {
        let before = if frame > leaves.frames.start { inspector.leaf(side, frame - 1) } else { None };
        let path = inspector.path(side, frame).unwrap();
        prop_assert_eq!(
            at_end(&tree.root, &path, before),
            inspector.leaf(side, frame),
            "frame {} of {:?}",
            frame,
            side
        );
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 48, ..ProptestConfig::default() })]

    /// The way that the inspector finds through a tree ends, on every frame, in the leaf that the evaluator gave.
    #[test]
    fn explained_paths_end_in_the_leaves_of_the_evaluator(seed in any::<u64>(), depth in 1_u32..4) {
        let (rules, frames) = random::case(seed, depth);
        for leaves in evaluate(&lower(&rules), &frames).unwrap() {
            let mut inspector = Inspector::new(&rules, &frames, &leaves);
            for side in [Some(Side::Left), Some(Side::Right), None] {
                paths_lead_to_leaves(&rules, &leaves, &mut inspector, side)?;
            }
        }
    }
}

fn explain(args: &[&str]) -> Output {
    let log = "demos/robosuite/SawyerLift_demo_1.csv";
    teachtree(&[&["explain", log, "--binding", "demos/robosuite/sawyer_lift.binding.yaml"], args].concat())
}

fn said(args: &[&str]) -> String {
    let output = explain(args);
    assert!(output.status.success(), "{}", complained(&output));
    program::said(&output)
}

#[test]
fn a_frame_is_explained_from_the_root_to_the_task() {
    insta::assert_snapshot!(said(&["--at", "10.92s"]));
}

#[test]
fn why_not_says_what_was_missing_where_it_was_nearest() {
    let text = said(&["--at", "10.9s..11.1s", "--why-not", "Place"]);
    let printed = &text[text.find("  not Place").unwrap()..];
    insta::assert_snapshot!(printed[..printed.find("\nright at").map_or(printed.len(), |end| end + 1)]);
}

#[test]
fn an_interval_is_explained_wherever_the_choices_change() {
    let text = said(&["--at", "10.9s..11.1s"]);
    let heads: Vec<&str> = text.lines().filter(|line| line.starts_with("right at")).collect();
    assert!(heads.len() >= 2, "{heads:?}");
    assert!(heads[0].contains(": Turn cube (from 10.874 s)"), "{heads:?}");
    assert!(heads.iter().any(|head| head.contains(": Translate cube (from ")), "{heads:?}");
}

#[test]
fn programs_read_values_and_margins() {
    let document: Value = serde_json::from_str(&said(&["--at", "10.92s", "--format", "json"])).unwrap();
    assert_eq!(document["schema"], "teachtree.explain/1");
    let one = &document["explanations"][0];
    assert_eq!((one["leaf"].as_str(), one["track"].as_str()), (Some("Turn"), Some("right")));
    let path = one["path"].as_array().unwrap();
    let taken = path.iter().find(|step| step["taken"] == true).unwrap();
    assert_eq!(taken["choice"], "turning and (supported or walled) => Turn");
    let turning = &taken["reason"]["because"][0]["because"][0]["fact"];
    let number = |key: &str| turning[key].as_f64().unwrap();
    assert!((number("margin") - (number("value") - number("off"))).abs() < 1e-6, "{turning}");
    assert_eq!(turning["unit"], "rad/s");
}

#[test]
fn questions_that_nothing_answers_are_bad_input() {
    for (args, wanted) in [
        (&["--at", "3s"][..], "the recording goes from 7.904 s to 11.684 s"),
        (&["--at", "9s", "--why-not", "Dance"], "the rules have no primitive `Dance`"),
        (&["--at", "9s", "--track", "left"], "there is no tree that labels `left`"),
        (&["--at", "9 N"], "expected a time"),
        (&["--at", "9s..8s"], "ends before it begins"),
    ] {
        let output = explain(args);
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        let printed = String::from_utf8(output.stderr).unwrap();
        assert!(printed.contains(wanted), "{args:?}: {printed}");
    }
}
