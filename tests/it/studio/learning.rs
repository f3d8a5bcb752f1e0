//! A new primitive that is marked, learned, checked and saved in the studio: the same as `learn --new`.

use super::page::{no_complaints, opened, until, visited};
use super::{OPENED, Studio, folder};
use crate::program::{complained, teachtree_in};
use serde_json::{Value, json};
use std::path::Path;

/// When the gripper holds the cube above the table in the recordings of [`folder`], s.
const MARKED: (f64, f64) = (23.0, 24.0);

fn mark(studio: &Studio, at: usize, name: &str, new: Option<&str>) -> u16 {
    let line = json!({ "track": "right", "kind": "primitive", "label": name, "start_s": MARKED.0, "end_s": MARKED.1, "pinned": true });
    let version = studio.get(&format!("api/recording/{at}/labels"))["version"].clone();
    let sent = json!({ "base": version, "lines": [line], "new": new });
    studio.change("PUT", &format!("api/recording/{at}/labels"), &sent).status
}

fn outcome(studio: &Studio) -> Value {
    let mut answer = Value::Null;
    until(|| {
        answer = studio.get("api/learn");
        answer["running"] == false
    });
    answer["outcome"].clone()
}

fn learned_by_the_command(folder: &Path) -> Value {
    let args = ["learn", "logs", "--binding", "lift.yaml", "--labels", "logs", "--new", "Hover", "--format", "json"];
    let output = teachtree_in(folder, &args);
    serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{}", complained(&output)))
}

#[test]
fn what_is_learned_is_that_of_the_command() {
    let folder = folder();
    let studio = Studio::start(folder.path(), &OPENED);
    studio.list();
    assert_eq!(mark(&studio, 0, "Hover", None), 422, "a name that is not declared as new");
    assert_eq!(mark(&studio, 0, "hover", Some("hover")), 422, "the name of no primitive");
    assert_eq!(mark(&studio, 0, "Hover", Some("Hover")), 200);
    assert_eq!(studio.list()["recordings"][0]["new"], json!(["Hover"]));
    assert_eq!(studio.list()["recordings"][0]["score_error"], Value::Null);
    let learn = |name: &str| studio.change("POST", "api/recording/0/learn", &json!({ "primitive": name }));
    assert_eq!(learn("no primitive").status, 422);
    assert_eq!(learn("Hover").status, 200);
    assert!(outcome(&studio)["error"].as_str().unwrap().contains("expected 3 or more"));
    let save = |file: &str| studio.change("POST", "api/recording/0/learn/save", &json!({ "file": file }));
    assert_eq!(save("hover.rules").status, 422, "nothing is learned");
    for at in [1, 2] {
        assert_eq!(mark(&studio, at, "Hover", Some("Hover")), 200);
    }
    assert_eq!(learn("Hover").status, 200);
    let found = outcome(&studio);
    assert_eq!(found["proved"], true, "{found}");
    let command = learned_by_the_command(folder.path());
    assert_eq!(found["rules"], command["rules"], "{found}");
    assert!(found["summary"].as_str().unwrap().contains("learned from  3 of 3 intervals found"), "{found}");
    for (file, status) in [("../hover.rules", 422), ("hover.txt", 422), ("hover.rules", 200), ("hover.rules", 422)] {
        assert_eq!(save(file).status, status, "{file}");
    }
    let text = std::fs::read_to_string(folder.path().join("hover.rules")).unwrap();
    assert_eq!(text, found["rules"].as_str().unwrap());
    let checked = teachtree_in(folder.path(), &["check", "hover.rules"]);
    assert_eq!(checked.status.code(), Some(0), "{}", complained(&checked));
}

#[test]
fn a_primitive_is_marked_learned_and_saved_on_the_page() {
    let folder = folder();
    let Some((mut browser, studio)) = visited(folder.path(), &OPENED) else { return };
    for (at, name) in ["a", "b", "c7"].iter().enumerate() {
        browser.click(&format!("[data-at='{at}']"));
        opened(&mut browser, name);
        if at == 0 {
            browser.click("#new-primitive summary");
            browser.click("#new-name");
            "Hover".chars().for_each(|letter| browser.key(&letter.to_string()));
        }
        assert_eq!(browser.eval("document.querySelector('#begin-learn').disabled"), true);
        for (time, button) in [(MARKED.0, "#new-start"), (MARKED.1, "#new-end")] {
            browser.eval(&format!("import('./bench.js').then((bench) => bench.setTime({time}))"));
            browser.wait(&format!("document.querySelector('#clock').textContent === '{time:.3} s'"));
            browser.click(button);
        }
        until(|| studio.list()["recordings"][at]["new"] == json!(["Hover"]));
    }
    browser.wait("!document.querySelector('#begin-learn').disabled");
    browser.click("#begin-learn");
    browser.wait("!document.querySelector('#learned').hidden");
    let text = browser.text("#learn-rules");
    assert!(text.contains("primitive Hover is "), "{text}");
    assert!(browser.text("#learn-summary").contains("proved: it only adds to the rules"));
    browser.eval("document.querySelector('#save-learned').scrollIntoView({ block: 'center' })");
    assert_eq!(browser.eval("document.querySelector('#learn-file').value"), "hover.rules");
    browser.click("#save-learned");
    browser.wait("document.querySelector('#learn-state').textContent === 'written to hover.rules'");
    assert_eq!(std::fs::read_to_string(folder.path().join("hover.rules")).unwrap().trim(), text.trim());
    no_complaints(&browser);
}
