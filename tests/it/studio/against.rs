//! Two rule sets side by side: what the server counts is what `diff` counts, and the page shows it.

use super::labels::line;
use super::page::{no_complaints, opened, visited};
use super::{OPENED, Studio, folder};
use crate::program::{all_said, teachtree_in};
use serde_json::json;
use std::path::Path;

/// A folder with recordings, and other rules.
fn with_other_rules() -> tempfile::TempDir {
    let folder = folder();
    add_other_rules(folder.path());
    folder
}

/// Adds `near/`: the shipped rules with a `near_on` of 30 mm in the place of 50 mm, by which Approach begins five frames later.
pub fn add_other_rules(folder: &Path) {
    let rules = Path::new(env!("CARGO_MANIFEST_DIR")).join("rules");
    std::fs::create_dir(folder.join("near")).unwrap();
    for name in ["contact.rules", "single_hand.rules", "stream.rules"] {
        let text = std::fs::read_to_string(rules.join(name)).unwrap();
        let changed = text.lines().map(|line| match line.starts_with("param near_on") {
            true => line.replace("50 mm", "30 mm"),
            false => line.to_string(),
        });
        let text = changed.collect::<Vec<_>>().join("\n") + "\n";
        std::fs::write(folder.join("near").join(name), text).unwrap();
    }
}

const AGAINST: [&str; 6] = ["logs", "--binding", "lift.yaml", "--each", "--against", "near/contact.rules"];

#[test]
fn two_rule_sets_are_counted_as_by_diff() {
    let folder = with_other_rules();
    let studio = Studio::start(folder.path(), &AGAINST);
    let lines = json!([line("Move", 12.0, 13.5), line("Approach", 13.5, 20.7)]);
    let saved = studio.change("PUT", "api/recording/0/labels", &json!({ "base": "", "lines": lines }));
    assert_eq!(saved.status, 200);
    let list = studio.list();
    let against = list["recordings"][0]["against"].clone();
    assert_eq!(
        against,
        json!({ "frames": 5, "of_frames": 242, "segments": 2, "of_segments": 4, "own": list["recordings"][0]["score"]["accuracy"],
            "accuracy": 1.0, "unknown": {} }),
        "{against}"
    );
    assert!(against["own"].as_f64().unwrap() < 1.0);
    assert_eq!(list["recordings"][1]["against"]["accuracy"], json!(null));
    let shown = studio.get("api/recording/0")["against"].clone();
    assert_eq!((&shown["tracks"][0]["relabeled"][1][1], &shown["rules"]), (&json!(13.5), &json!("near/contact.rules")));
    // With the same value the rules do not differ.
    studio.change("POST", "api/recording/0/params", &json!({ "near_on": 30.0 }));
    assert_eq!(studio.list()["recordings"][1]["against"]["frames"], 0);
    let args = ["diff", "contact.rules", "near/contact.rules", "logs/a.csv", "--binding", "lift.yaml"];
    let printed = all_said(&teachtree_in(folder.path(), &args));
    assert!(printed.contains("  right 13.250 – 13.500 s: Approach becomes Move\n"), "{printed}");
    assert!(printed.ends_with("  5 of 242 frames (2.1 %) and 2 of 4 segments differ\n"), "{printed}");
    let printed = all_said(&teachtree_in(folder.path(), &[&args[..], &["--labels", "logs"]].concat()));
    let better = "  of 8.7 s with labels 97.1 % and 100.0 % agree: near/contact.rules agrees better\n";
    assert!(printed.ends_with(better), "{printed}");
}

/// A primitive that only one of the rule sets has is none that labels speak against.
#[test]
fn a_primitive_that_the_labels_do_not_know_is_not_compared() {
    let folder = folder();
    let lift =
        "use \"contact.rules\"\nprimitive Lift does carry\nextend single_hand before carried { grasped => Lift }\n";
    std::fs::write(folder.path().join("lift.rules"), lift).unwrap();
    let rules = ["--rules", "lift.rules", "--against", "contact.rules"];
    let studio = Studio::start(folder.path(), &[&OPENED[..], &rules].concat());
    let lines = json!([line("Move", 12.0, 13.25), line("Approach", 13.25, 20.7), line("Translate", 22.6, 24.0)]);
    let body = json!({ "base": "", "lines": lines });
    let saved = studio.change("PUT", "api/recording/0/labels", &body);
    // The other primitives of the label file are those of the rules.
    assert_eq!(saved.status, 200, "{}", saved.json());
    let against = studio.list()["recordings"][0]["against"].clone();
    assert!(against["frames"].as_u64().unwrap() > 10 && against["own"] == against["accuracy"], "{against}");
    assert!(against["unknown"]["Lift"].as_f64().unwrap() > 0.5, "{against}");
    let args = ["diff", "lift.rules", "contact.rules", "logs/a.csv", "--binding", "lift.yaml", "--labels", "logs"];
    let printed = all_said(&teachtree_in(folder.path(), &args));
    assert!(printed.contains("  no label names Lift: ") && printed.ends_with("both agree alike\n"), "{printed}");
}

#[test]
fn other_rules_that_do_not_run_are_said_so() {
    let folder = folder();
    std::fs::write(folder.path().join("bad.rules"), "signal x = nothing_of_the_kind\n").unwrap();
    let studio = Studio::start(folder.path(), &[&OPENED[..], &["--against", "bad.rules"]].concat());
    let row = studio.list()["recordings"][0].clone();
    assert_eq!(row["status"], "done");
    assert!(row["against"]["error"].as_str().unwrap().contains("nothing_of_the_kind"), "{row}");
}

#[test]
fn lanes_of_two_rule_sets_stand_side_by_side() {
    let folder = with_other_rules();
    let Some((mut browser, _studio)) = visited(folder.path(), &AGAINST) else { return };
    browser.wait("document.querySelector(\"[data-at='0']\").textContent.includes('5 frames, 2 segments differ')");
    browser.click("[data-at='0']");
    opened(&mut browser, "a");
    assert_eq!(browser.text("#against-words"), "5 of 242 frames and 2 of 4 segments differ from near/contact.rules");
    let bars =
        "[...document.querySelectorAll('#lanes .bar.other > title')].map((title) => title.textContent).join('|')";
    let bars = browser.eval(bars);
    assert!(bars.as_str().unwrap().contains("Approach, by near/contact.rules\n13.500 s"), "{bars}");
    let marks = "[...document.querySelectorAll('#lanes rect.differs > title')].map((title) => title.textContent)";
    assert_eq!(browser.eval(marks), json!(["Approach here, Move there"]));
    // To the difference by its key and by its button.
    let at_difference = "document.querySelector('#clock').textContent === '13.250 s'";
    browser.key("d");
    browser.wait(at_difference);
    for _ in 0..8 {
        browser.key("ArrowRight");
    }
    browser.wait("parseFloat(document.querySelector('#clock').textContent) > 13.4");
    browser.click("#previous-difference");
    browser.wait(at_difference);
    no_complaints(&browser);
}
