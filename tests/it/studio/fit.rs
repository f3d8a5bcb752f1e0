//! Params fitted from the page: the same as `fit`, in the background, taken and written only when asked.

use super::labels::line;
use super::page::{no_complaints, opened, until, visited};
use super::{Studio, folder};
use crate::program::{complained, teachtree_in};
use serde_json::{Value, json};
use std::path::Path;

const OPENED: [&str; 6] = ["logs", "--binding", "lift.yaml", "--each", "--rules", "contact.rules"];

/// A folder with four recordings, in which Approach begins where `near_on` is 30 mm by their labels, and rules in which only that param and the threshold
/// beside it have a range; with `all` all params keep theirs.
pub fn with_labels(all: bool) -> tempfile::TempDir {
    let folder = folder();
    std::fs::copy(folder.path().join("logs/a.csv"), folder.path().join("logs/d.csv")).unwrap();
    let rules = Path::new(env!("CARGO_MANIFEST_DIR")).join("rules");
    for name in ["contact.rules", "single_hand.rules", "stream.rules"] {
        let text = std::fs::read_to_string(rules.join(name)).unwrap();
        let lines = text.lines().map(|line| match line.split_once(" in ") {
            Some((head, _)) if !all && line.starts_with("param ") && !line.starts_with("param near_o") => head,
            _ => line,
        });
        std::fs::write(folder.path().join(name), lines.collect::<Vec<_>>().join("\n") + "\n").unwrap();
    }
    for name in ["a", "b", "c7", "d"] {
        let table =
            "track,kind,label,start_s,end_s\nright,primitive,Move,12,13.5\nright,primitive,Approach,13.5,20.7\n";
        std::fs::write(folder.path().join(format!("logs/{name}.labels.csv")), table).unwrap();
    }
    folder
}

fn outcome(studio: &Studio) -> Value {
    let mut answer = Value::Null;
    until(|| {
        answer = studio.get("api/fit");
        answer["running"] == false
    });
    answer["outcome"].clone()
}

#[test]
fn a_fit_is_that_of_the_command() {
    let folder = with_labels(false);
    let studio = Studio::start(folder.path(), &OPENED);
    assert_eq!(studio.get("api/fit"), json!({ "running": false, "part": 0.0, "outcome": null }));
    assert_eq!(studio.change("POST", "api/recording/0/fit", &json!({})).status, 200);
    let found = outcome(&studio);
    let args = ["fit", "logs", "--binding", "lift.yaml", "--labels", "logs", "--rules", "contact.rules", "--anyway"];
    let output = teachtree_in(folder.path(), &[&args[..], &["--format", "json"]].concat());
    let fitted: Value = serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{}", complained(&output)));
    assert_eq!(found["diff"], fitted["patch"], "{found}");
    assert_eq!(found["borne_out"], fitted["verdict"] == "gain");
    let near = found["values"]["near_on"].as_f64().unwrap();
    assert!((20.0..40.0).contains(&near), "{found}");
    let diff = found["diff"].as_str().unwrap();
    assert!(diff.contains("-param near_on") && diff.contains("+param near_on"), "{diff}");
    // No file and no param is changed by it.
    assert_eq!(studio.list()["params"], json!({}));
}

#[test]
fn a_fit_is_stopped_and_says_what_it_lacks() {
    let folder = with_labels(true);
    let studio = Studio::start(folder.path(), &OPENED);
    studio.list();
    studio.change("POST", "api/recording/0/fit", &json!({}));
    assert_eq!(studio.get("api/fit")["running"], true);
    studio.change("POST", "api/fit/stop", &json!({}));
    assert_eq!(outcome(&studio), json!({ "error": "stopped" }));
    for name in ["a", "b", "c7", "d"] {
        std::fs::remove_file(folder.path().join(format!("logs/{name}.labels.csv"))).unwrap();
    }
    studio.change("POST", "api/recording/0/fit", &json!({}));
    assert!(outcome(&studio)["error"].as_str().unwrap().contains("has labels"));
    // It can be begun again.
    let lines = json!([line("Move", 12.0, 13.5), line("Approach", 13.5, 20.7)]);
    studio.change("PUT", "api/recording/0/labels", &json!({ "base": "", "lines": lines }));
    studio.change("POST", "api/recording/0/fit", &json!({}));
    assert_eq!(studio.get("api/fit")["running"], true);
    studio.change("POST", "api/fit/stop", &json!({}));
    outcome(&studio);
}

#[test]
fn values_of_a_fit_are_taken_and_written_on_the_page() {
    let folder = with_labels(false);
    let Some((mut browser, studio)) = visited(folder.path(), &OPENED) else { return };
    let before = std::fs::read_to_string(folder.path().join("single_hand.rules")).unwrap();
    browser.click("[data-at='0']");
    opened(&mut browser, "a");
    browser.click("#tune summary");
    browser.click("#begin-fit");
    browser.wait("!document.querySelector('#take-fit').hidden");
    let diff = browser.text("#fit-diff");
    assert!(diff.contains("+param near_on"), "{diff}");
    assert_eq!(std::fs::read_to_string(folder.path().join("single_hand.rules")).unwrap(), before);
    browser.eval("document.querySelector('#take-fit').scrollIntoView({ block: 'center' })");
    browser.click("#take-fit");
    browser.wait("[...document.querySelectorAll(\"[data-pick^='segment 0 relabeled'] title\")].some((title) => title.textContent.includes('13.500 s'))");
    assert!(studio.list()["params"]["near_on"].is_string());
    browser.wait("!document.querySelector('#write-params').disabled");
    browser.click("#write-params");
    let near = |text: &str| text.lines().find(|line| line.starts_with("param near_on")).unwrap().to_string();
    let now = || std::fs::read_to_string(folder.path().join("single_hand.rules")).unwrap();
    until(|| near(&now()) != near(&before));
    assert!(diff.contains(&format!("+{}", near(&now()))), "{diff} {}", near(&now()));
    no_complaints(&browser);
}
