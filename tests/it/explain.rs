//! `explain`: what a user reads.

use crate::program::{self, complained, teachtree};
use serde_json::Value;
use std::process::Output;

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
