//! Rule files in the editor of the page: what runs, what is refused, and what is written.

use super::page::{no_complaints, opened, until, visited};
use super::{OPENED, Studio, folder};
use crate::browser::Browser;
use serde_json::{Value, json};
use std::path::Path;

/// A folder with recordings and rules of one's own.
fn with_rules() -> tempfile::TempDir {
    let folder = folder();
    let rules = Path::new(env!("CARGO_MANIFEST_DIR")).join("rules");
    for name in ["contact.rules", "single_hand.rules", "stream.rules"] {
        std::fs::copy(rules.join(name), folder.path().join(name)).unwrap();
    }
    std::fs::write(folder.path().join("mine.rules"), MINE).unwrap();
    folder
}

const MINE: &str = "use \"contact.rules\"\n// How high it was carried.\nparam high = 30 mm in 10 mm .. 90 mm\n";
/// A primitive in the place of Translate.
const LIFT: &str = "primitive Lift is Translate\nextend single_hand before carried { grasped => Lift }\n";
const WITH_MINE: [&str; 6] = ["logs", "--binding", "lift.yaml", "--each", "--rules", "mine.rules"];

fn sent(version: &Value, text: &str) -> Value {
    json!({ "version": version, "files": { "mine.rules": text } })
}

#[test]
fn texts_run_before_they_are_written_and_are_written_whole() {
    let folder = with_rules();
    let file = folder.path().join("mine.rules");
    let studio = Studio::start(folder.path(), &WITH_MINE);
    let shown = studio.get("api/recording/0/rules");
    let own: Vec<(&str, bool)> = shown["files"]
        .as_array()
        .unwrap()
        .iter()
        .map(|file| (file["name"].as_str().unwrap(), file["own"].as_bool().unwrap()))
        .collect();
    assert!(own.contains(&("mine.rules", true)) && own.contains(&("single_hand.rules", true)), "{own:?}");
    let put = |version: &Value, text: &str| studio.change("PUT", "api/recording/0/rules", &sent(version, text));
    // A mistake: the finding has its place, and the rules of before run on.
    let wrong = put(&shown["version"], &format!("{MINE}signal x = hihg > 1\n"));
    assert_eq!((wrong.status, &wrong.json()["sound"]), (200, &json!(false)));
    let finding = wrong.json()["findings"][0].clone();
    assert_eq!(
        (&finding["severity"], &finding["file"], &finding["line"], &finding["column"]),
        (&json!("error"), &json!("mine.rules"), &json!(4), &json!(12)),
        "{finding}"
    );
    assert!(
        finding["code"].as_str().unwrap().starts_with('E') && finding["help"].to_string().contains("high"),
        "{finding}"
    );
    assert_eq!(studio.list()["recordings"][0]["status"], "done");
    // What is right runs over the open recording at once, over the others in the background, and is not written.
    let right = put(&shown["version"], &format!("{MINE}{LIFT}"));
    let labels = |lanes: &Value| lanes["tracks"][0]["relabeled"].to_string();
    assert!(labels(&right.json()["lanes"]).contains("Lift"), "{}", right.json());
    assert_eq!(studio.list()["waiting"], 0);
    assert!(labels(&studio.get("api/recording/1")["data"]).contains("Lift"));
    assert_eq!(std::fs::read_to_string(&file).unwrap(), MINE);
    // Another window that has not seen this is refused, with what is there.
    let late = put(&shown["version"], MINE);
    assert_eq!((late.status, &late.json()["version"]), (409, &right.json()["version"]));
    assert!(late.json()["files"]["mine.rules"].as_str().unwrap().contains("Lift"));
    // A file that was changed on disk since is not written over, nor is any other one.
    let save = || studio.change("POST", "api/recording/0/params/save", &json!({}));
    let theirs = format!("{MINE}// of another program\n");
    std::fs::write(&file, &theirs).unwrap();
    let refused = save();
    assert_eq!(refused.status, 422);
    assert!(refused.json()["error"].as_str().unwrap().contains("was changed since"), "{}", refused.json());
    assert_eq!(std::fs::read_to_string(&file).unwrap(), theirs);
    std::fs::write(&file, MINE).unwrap();
    let written = save();
    assert_eq!(written.json()["files"], json!(["mine.rules"]), "{}", written.json());
    assert_eq!(std::fs::read_to_string(&file).unwrap(), format!("{MINE}{LIFT}"));
    assert!(labels(&studio.get("api/recording/0")["data"]).contains("Lift"));
}

#[test]
fn params_that_were_turned_are_written_into_texts_that_were_changed() {
    let folder = with_rules();
    let studio = Studio::start(folder.path(), &WITH_MINE);
    let version = studio.get("api/recording/0/rules")["version"].clone();
    let more = "param low = 20 mm in 10 mm .. 90 mm\n";
    assert_eq!(studio.change("PUT", "api/recording/0/rules", &sent(&version, &format!("{MINE}{more}"))).status, 200);
    let turned = studio.change("POST", "api/recording/0/params", &json!({ "low": 25.0 }));
    assert_eq!(turned.status, 200, "{}", turned.json());
    studio.change("POST", "api/recording/0/params/save", &json!({}));
    let text = std::fs::read_to_string(folder.path().join("mine.rules")).unwrap();
    assert_eq!(text, format!("{MINE}{}", more.replace("20 mm in", "25 mm in")));
}

#[test]
fn shipped_and_unknown_files_are_not_changed() {
    let folder = folder();
    let studio = Studio::start(folder.path(), &OPENED);
    let shown = studio.get("api/recording/0/rules");
    assert!(shown["files"].as_array().unwrap().iter().all(|file| file["own"] == false), "{shown}");
    for (name, message) in [
        ("rules/single_hand.rules", "comes with the program"),
        ("../lift.yaml", "is not a file of the rules"),
        ("lift.yaml", "is not a file of the rules"),
    ] {
        let body = json!({ "version": shown["version"], "files": { name: "// nothing\n" } });
        let refused = studio.change("PUT", "api/recording/0/rules", &body);
        assert_eq!(refused.status, 422, "{name}");
        assert!(refused.json()["error"].as_str().unwrap().contains(message), "{name}: {}", refused.json());
    }
}

#[test]
fn names_are_explained_and_completed() {
    let folder = with_rules();
    let studio = Studio::start(folder.path(), &WITH_MINE);
    let text = format!("{MINE}signal rising = targ\nsignal tall = target.position.z > high\n");
    let place = |line: u32, character: u32| json!({ "files": { "mine.rules": text }, "file": "mine.rules", "line": line, "character": character });
    let about = studio.change("POST", "api/recording/0/rules/hover", &place(4, 35)).json();
    let about = about["text"].as_str().unwrap();
    assert!(about.contains("param high = 30 mm") && about.contains("How high it was carried."), "{about}");
    let fits = studio.change("POST", "api/recording/0/rules/complete", &place(3, 20)).json();
    let fits = fits["proposals"].as_array().unwrap();
    let found = fits.iter().find(|one| one["label"] == "target.position").unwrap_or_else(|| panic!("{fits:?}"));
    assert_eq!(found["replaces"], 4);
    assert!(fits.iter().all(|one| one["label"].as_str().unwrap().starts_with("targ")), "{fits:?}");
    // Where nothing is, nothing is said.
    assert_eq!(studio.change("POST", "api/recording/0/rules/hover", &place(90, 3)).status, 200);
}

/// Types letters as a keyboard does.
fn typed(browser: &mut crate::browser::Browser, text: &str) {
    for letter in text.chars() {
        browser.key(&letter.to_string());
    }
}

/// Opens the editor with the rule file of one's own.
fn show_mine(browser: &mut Browser) {
    browser.click("#editor summary");
    browser.wait("document.querySelector('#editor-file').options.length > 2");
    browser.eval("(() => { const list = document.querySelector('#editor-file'); list.value = 'mine.rules'; list.dispatchEvent(new Event('change')); })()");
}

#[test]
fn rules_are_typed_corrected_and_written_on_the_page() {
    let folder = with_rules();
    let Some((mut browser, _studio)) = visited(folder.path(), &WITH_MINE) else { return };
    browser.click("[data-at='0']");
    opened(&mut browser, "a");
    show_mine(&mut browser);
    browser.wait("document.querySelector('#editor-text').value.startsWith('use \"contact.rules\"')");
    assert_eq!(browser.eval("document.querySelectorAll('#editor-numbers span').length"), 4);
    browser.eval("(() => { const area = document.querySelector('#editor-text'); area.focus(); area.setSelectionRange(area.value.length, area.value.length); })()");
    // A mistake is marked, and its finding leads to it.
    typed(&mut browser, "signal x = hihg > 1 mm");
    browser.wait("document.querySelector('#findings .error') !== null && document.querySelector('#editor-state').textContent.includes('error')");
    assert_eq!(browser.text("#editor-numbers .error"), "4");
    assert_eq!(browser.eval("document.querySelector('#write-rules').disabled"), true);
    browser.click("#findings button");
    browser.wait("document.activeElement.id === 'editor-text' && document.querySelector('#editor-text').selectionStart === document.querySelector('#editor-text').value.indexOf('hihg')");
    // It is deleted by hand, and written rightly by what is proposed.
    for _ in 0..2 {
        browser.key("ArrowRight");
    }
    browser.eval("(() => { const area = document.querySelector('#editor-text'), at = area.value.indexOf('hihg'); area.setSelectionRange(at, at + 4); document.execCommand('insertText', false, 'hig'); })()");
    browser.eval("document.querySelector('#editor-text').dispatchEvent(new KeyboardEvent('keydown', { key: ' ', ctrlKey: true, bubbles: true, cancelable: true }))");
    browser.wait("!document.querySelector('#proposals').hidden");
    assert_eq!(browser.text("#proposals [aria-selected=true] b"), "high");
    browser.key("Enter");
    browser.wait("document.querySelector('#editor-text').value.includes('= high > 1 mm')");
    browser.wait("document.querySelector('#findings .error') === null && document.querySelector('#editor-state').textContent.startsWith('analyzed in')");
    // What is known of the name at the caret.
    browser.wait("document.querySelector('#editor-about').textContent.includes('param high = 30 mm')");
    // What is right runs at once, and is written when asked.
    browser.eval("(() => { const area = document.querySelector('#editor-text'), at = area.value.indexOf('signal x'); area.setSelectionRange(at, area.value.length); })()");
    browser.eval(&format!("document.execCommand('insertText', false, {})", json!(LIFT)));
    browser.wait("[...document.querySelectorAll(\"[data-pick^='segment 0 relabeled'] title\")].some((title) => title.textContent.startsWith('Lift'))");
    let file = folder.path().join("mine.rules");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), MINE);
    browser.wait("!document.querySelector('#write-rules').disabled");
    browser.click("#write-rules");
    until(|| std::fs::read_to_string(&file).unwrap() == format!("{MINE}{LIFT}"));
    browser.wait("document.querySelector('#editor-state').textContent === 'written: mine.rules'");
    for width in [390, 900, 1440] {
        browser.resize(width, 900);
        browser.wait("document.documentElement.scrollWidth <= window.innerWidth");
    }
    no_complaints(&browser);
}

const LABELS: &str = "track,kind,label,start_s,end_s,pinned,by,at\nright,primitive,Approach,14,15,pinned,mika,\n";

#[test]
fn a_recording_opens_while_its_rules_have_errors() {
    let folder = with_rules();
    let file = folder.path().join("mine.rules");
    std::fs::write(&file, format!("{MINE}signal x = hihg > 1 mm\n")).unwrap();
    std::fs::write(folder.path().join("logs/a.labels.csv"), LABELS).unwrap();
    let studio = Studio::start(folder.path(), &WITH_MINE);
    let row = studio.list()["recordings"][0].clone();
    assert_eq!(row["status"], "failed");
    assert!(row["error"].as_str().unwrap().contains("mine.rules:4:12"), "{row}");
    assert_eq!(row["labels"], 1, "{row}");
    let shown = studio.get("api/recording/0");
    assert!(shown["failed"].as_str().unwrap().contains("mine.rules:4:12"), "{}", shown["failed"]);
    assert!(shown["rules"].as_array().unwrap().contains(&json!("mine.rules")), "{}", shown["rules"]);
    let track = &shown["data"]["tracks"][0];
    assert_eq!((&track["who"], &track["relabeled"]), (&json!("right"), &json!([])));
    assert!(shown["data"]["signals"].as_array().unwrap().len() > 3 && shown["data"]["replay"]["why"].is_null());
    // What is declared is known: labels can be corrected.
    assert!(shown["names"]["primitive"].as_array().unwrap().contains(&json!("Grasp")), "{}", shown["names"]);
    let mut lines = shown["labels"]["lines"].clone();
    lines[0]["label"] = json!("Grasp");
    let body = json!({ "base": shown["labels"]["version"], "lines": lines });
    assert_eq!(studio.change("PUT", "api/recording/0/labels", &body).status, 200);
    // Nothing is written of rules that do not run.
    assert_eq!(studio.change("POST", "api/recording/0/params/save", &json!({})).status, 422);
    let texts = studio.get("api/recording/0/rules");
    assert_eq!((&texts["findings"][0]["file"], &texts["findings"][0]["line"]), (&json!("mine.rules"), &json!(4)));
    // A text that is mended brings the lanes, and is written.
    let mended = studio.change("PUT", "api/recording/0/rules", &sent(&texts["version"], &format!("{MINE}{LIFT}")));
    assert!(mended.json()["lanes"]["tracks"][0]["relabeled"].to_string().contains("Lift"), "{}", mended.json());
    assert_eq!(studio.change("POST", "api/recording/0/params/save", &json!({})).json()["files"], json!(["mine.rules"]));
    assert_eq!(std::fs::read_to_string(&file).unwrap(), format!("{MINE}{LIFT}"));
    let shown = studio.get("api/recording/0");
    assert!(shown["failed"].is_null() && shown["data"]["tracks"][0]["relabeled"].to_string().contains("Lift"));
    assert_eq!(studio.list()["recordings"][0]["status"], "done");
}

#[test]
fn errors_of_the_rule_files_are_shown_and_mended_on_the_page() {
    let folder = with_rules();
    std::fs::write(folder.path().join("mine.rules"), format!("{MINE}signal x = hihg > 1 mm\n")).unwrap();
    std::fs::write(folder.path().join("logs/a.labels.csv"), LABELS).unwrap();
    let Some((mut browser, _studio)) = visited(folder.path(), &WITH_MINE) else { return };
    browser.click("[data-at='0']");
    browser.wait(
        "document.querySelector('#title').textContent === 'a' && document.querySelector('#findings .error') !== null",
    );
    assert!(browser.text("#message").contains("mine.rules:4:12"), "{}", browser.text("#message"));
    assert_eq!(browser.eval("document.querySelector('#editor').open"), true);
    assert_eq!(browser.eval("document.querySelector('#editor-file').value"), "mine.rules");
    assert_eq!(browser.text("#editor-numbers .error"), "4");
    assert!(browser.text("#editor-state").contains("lanes are shown after"), "{}", browser.text("#editor-state"));
    assert!(browser.eval("document.querySelectorAll('.panel canvas').length").as_u64().unwrap() > 0);
    assert_eq!(browser.eval("document.querySelectorAll('#lanes .pinned').length"), 1);
    assert_eq!(browser.eval("document.querySelectorAll(\"[data-pick^='segment']\").length"), 0);
    // Another recording shows the same, and the first one again.
    browser.eval("document.activeElement.blur()");
    browser.key("j");
    browser.wait(
        "document.querySelector('#title').textContent === 'b' && document.querySelector('#findings .error') !== null",
    );
    browser.key("k");
    browser.wait("document.querySelector('#title').textContent === 'a'");
    browser.eval("(() => { const area = document.querySelector('#editor-text'), at = area.value.indexOf('hihg'); area.focus(); area.setSelectionRange(at, at + 4); document.execCommand('insertText', false, 'high'); })()");
    browser.wait("document.querySelectorAll(\"[data-pick^='segment 0 relabeled']\").length > 3");
    browser.wait("document.querySelector('#message').hidden && document.querySelector('#findings .error') === null");
    browser.wait("!document.querySelector('#write-rules').disabled && !document.querySelector('#tune').hidden");
    no_complaints(&browser);
}

#[test]
fn a_file_that_is_newly_used_is_edited_at_once() {
    let folder = with_rules();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    // It has a mistake, which can be mended before anything is written.
    let wrong = LIFT.replace("extend single_hand", "extend single_hnad");
    write("lift.rules", &wrong);
    let studio = Studio::start(folder.path(), &WITH_MINE);
    let version = studio.get("api/recording/0/rules")["version"].clone();
    let uses = format!("use \"lift.rules\"\n{MINE}");
    let put = |files: Value| {
        studio.change("PUT", "api/recording/0/rules", &json!({ "version": version, "files": files })).json()
    };
    let unused = put(json!({ "lift.rules": LIFT }));
    assert!(unused["error"].as_str().unwrap().contains("is not a file of the rules"), "{unused}");
    let found = put(json!({ "mine.rules": uses }));
    assert_eq!(found["findings"][0]["file"], "lift.rules", "{found}");
    assert_eq!(
        (&found["more"][0]["name"], &found["more"][0]["base"]),
        (&json!("lift.rules"), &json!(wrong)),
        "{found}"
    );
    assert_eq!(found["more"][0]["own"], true);
    let mended = put(json!({ "mine.rules": uses, "lift.rules": LIFT }));
    assert!(mended["lanes"]["tracks"][0]["relabeled"].to_string().contains("Lift"), "{mended}");
    assert_eq!((read("mine.rules"), read("lift.rules")), (MINE.to_string(), wrong.clone()));
    // Both are written, unless another program changed one of them.
    let save = || studio.change("POST", "api/recording/0/params/save", &json!({}));
    write("lift.rules", "// of another program\n");
    assert_eq!(save().status, 422);
    assert_eq!(read("mine.rules"), MINE);
    write("lift.rules", &wrong);
    assert_eq!(save().status, 200);
    assert_eq!((read("mine.rules"), read("lift.rules")), (uses, LIFT.to_string()));
}

#[test]
fn a_file_that_is_newly_used_is_in_the_list_of_the_page() {
    let folder = with_rules();
    std::fs::write(folder.path().join("lift.rules"), LIFT.replace("extend single_hand", "extend single_hnad")).unwrap();
    let Some((mut browser, _studio)) = visited(folder.path(), &WITH_MINE) else { return };
    browser.click("[data-at='0']");
    opened(&mut browser, "a");
    show_mine(&mut browser);
    browser.eval("(() => { const area = document.querySelector('#editor-text'); area.focus(); area.setSelectionRange(0, 0); document.execCommand('insertText', false, 'use \"lift.rules\"\\n'); })()");
    browser.wait("[...document.querySelector('#editor-file').options].some((one) => one.value === 'lift.rules')");
    // The finding leads into the new file, which is mended there.
    browser.click("#findings button");
    browser.wait("document.querySelector('#editor-file').value === 'lift.rules' && !document.querySelector('#editor-text').readOnly");
    browser.eval("(() => { const area = document.querySelector('#editor-text'), at = area.value.indexOf('hnad'); area.focus(); area.setSelectionRange(at, at + 4); document.execCommand('insertText', false, 'hand'); })()");
    browser.wait("[...document.querySelectorAll(\"[data-pick^='segment 0 relabeled'] title\")].some((title) => title.textContent.startsWith('Lift'))");
    browser.wait("!document.querySelector('#write-rules').disabled");
    browser.click("#write-rules");
    let file = folder.path().join("lift.rules");
    until(|| std::fs::read_to_string(&file).unwrap() == LIFT);
    no_complaints(&browser);
}
