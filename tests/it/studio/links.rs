//! Links and pipes beside recordings: nothing outside of the folder is written or shown, even if a path changes during a request.

use super::labels::line;
use super::{OPENED, Studio, folder};
use crate::pipes::pipe;
use crate::sets::with_set;
use serde_json::{Value, json};
use std::os::unix::fs::symlink;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

const SECRET: &str = "TOP SECRET";

/// Returns a folder with recordings. A secret, labels of other people and a recording are beside it.
fn with_secrets() -> tempfile::TempDir {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("secret.txt"), SECRET).unwrap();
    let labels = "track,kind,label,start_s,end_s,pinned,by,at\nright,primitive,Move,12,14,pinned,SECRET,\n";
    std::fs::write(path("others.csv"), labels).unwrap();
    std::fs::copy(path("logs/a.csv"), path("far.csv")).unwrap();
    folder
}

fn labels() -> Value {
    json!({ "base": "", "lines": [line("Move", 12.0, 13.5)] })
}

#[test]
fn links_out_of_the_folder_are_neither_written_nor_shown() {
    let folder = with_secrets();
    let path = |name: &str| folder.path().join(name);
    for (to, link) in [
        ("../planted.csv", "logs/a.labels.csv"),
        ("../planted.eaf", "logs/a.eaf"),
        ("../secret.txt", "logs/a.mp4"),
        ("../others.csv", "logs/b.labels.csv"),
        ("../secret.txt", "logs/b.eaf"),
        ("/nonexistent", "logs/b.webm"),
        ("../far.csv", "logs/d.csv"),
    ] {
        symlink(to, path(link)).unwrap();
    }
    let studio = Studio::start(folder.path(), &OPENED);
    let list = studio.list();
    let refused = |answer: super::Answer, words: &str| {
        let text = String::from_utf8(answer.body).unwrap();
        assert_eq!(answer.status, 422, "{text}");
        assert!(text.contains(words) && !text.contains("SECRET"), "{words}: {text}");
    };
    // The recording itself.
    let row = &list["recordings"][3];
    assert_eq!((&row["name"], &row["status"]), (&json!("d"), &json!("failed")));
    assert!(row["error"].as_str().unwrap().contains("logs/d.csv: leads out of logs"), "{row}");
    // Labels, read and written.
    let nowhere = "logs/a.labels.csv: is a link to ../planted.csv, which is not there";
    refused(studio.get_with("api/recording/0/labels", ""), nowhere);
    refused(studio.change("PUT", "api/recording/0/labels", &labels()), nowhere);
    let others = "logs/b.labels.csv: leads out of logs";
    refused(studio.get_with("api/recording/1/labels", ""), others);
    refused(studio.change("PUT", "api/recording/1/labels", &labels()), others);
    refused(studio.change("PUT", "api/recording/1/labels", &json!({ "base": "", "lines": [] })), others);
    assert!(list["recordings"][1]["score_error"].as_str().unwrap().contains(others), "{list}");
    // Exports.
    let replace = json!({ "replace": true });
    refused(
        studio.change("POST", "api/recording/0/export/elan", &replace),
        "logs/a.eaf: is a link to ../planted.eaf, which is not there",
    );
    std::fs::remove_file(path("logs/b.labels.csv")).unwrap();
    refused(studio.change("POST", "api/recording/1/export/elan", &replace), "logs/b.eaf: leads out of logs");
    // Videos, complete and by range.
    for range in ["", "Range: bytes=0-2\r\n"] {
        refused(studio.get_with("video/0/0", range), "logs/a.mp4: leads out of logs");
    }
    refused(studio.get_with("video/1/0", ""), "logs/b.webm: is a link to /nonexistent, which is not there");
    assert!(!path("planted.csv").exists() && !path("planted.eaf").exists());
    assert_eq!(std::fs::read_to_string(path("secret.txt")).unwrap(), SECRET);
    assert!(std::fs::read_to_string(path("others.csv")).unwrap().contains("SECRET"));
}

#[test]
fn links_within_the_folder_are_followed() {
    let folder = with_secrets();
    let path = |name: &str| folder.path().join(name);
    std::fs::create_dir(path("logs/kept")).unwrap();
    std::fs::write(path("logs/kept/a.csv_"), "track,kind,label,start_s,end_s,pinned,by,at\n").unwrap();
    std::fs::write(path("logs/kept/film"), "a film").unwrap();
    symlink("kept/a.csv_", path("logs/a.labels.csv")).unwrap();
    symlink("kept/film", path("logs/a.mp4")).unwrap();
    let studio = Studio::start(folder.path(), &OPENED);
    assert_eq!(studio.get_with("video/0/0", "").body, b"a film");
    let base = studio.get("api/recording/0/labels")["version"].clone();
    let sent = json!({ "base": base, "lines": [line("Move", 12.0, 13.5)] });
    let saved = studio.change("PUT", "api/recording/0/labels", &sent);
    assert_eq!(saved.status, 200, "{}", saved.json());
    assert!(path("logs/a.labels.csv").is_symlink());
    assert!(std::fs::read_to_string(path("logs/kept/a.csv_")).unwrap().contains("mika"));
    // The command line may name a link.
    drop(studio);
    symlink("../far.csv", path("logs/d.csv")).unwrap();
    let studio = Studio::start(folder.path(), &["logs/d.csv", "--binding", "lift.yaml"]);
    assert_eq!(studio.list()["recordings"][0]["status"], "done");
    let saved = studio.change("PUT", "api/recording/0/labels", &labels());
    assert_eq!(saved.status, 200, "{}", saved.json());
    assert!(path("logs/d.labels.csv").is_file());
}

#[test]
fn pipes_are_refused_and_not_waited_for() {
    let folder = with_secrets();
    let path = |name: &str| folder.path().join(name);
    for name in ["logs/a.labels.csv", "logs/a.mp4", "logs/a.eaf"] {
        pipe(&path(name));
    }
    let studio = Studio::start(folder.path(), &OPENED);
    studio.list();
    for (answer, name) in [
        (studio.get_with("api/recording/0/labels", ""), "a.labels.csv"),
        (studio.change("PUT", "api/recording/0/labels", &labels()), "a.labels.csv"),
        (studio.get_with("video/0/0", ""), "a.mp4"),
    ] {
        let text = String::from_utf8(answer.body).unwrap();
        assert_eq!(answer.status, 422, "{text}");
        assert!(text.contains(&format!("{name}: ")) && text.contains("a pipe, expected a file"), "{text}");
    }
}

/// The annotations of a data set, and the declared video of an episode.
#[test]
fn a_data_set_is_confined_to_its_folder() {
    let folder = with_set();
    let path = |name: &str| folder.path().join(name);
    symlink("../../planted.json", path("set/meta/lerobot_annotations.json")).unwrap();
    let studio = Studio::start(folder.path(), &["set", "--binding", "b.yaml"]);
    let list = studio.list();
    assert_eq!(list["recordings"][0]["status"], "done", "{list}");
    let answer = studio.change("POST", "api/recording/0/export/lerobot", &json!({ "replace": true }));
    assert_eq!(answer.status, 422, "{}", answer.json());
    assert!(answer.json()["error"].as_str().unwrap().contains("lerobot_annotations.json: is a link to"));
    assert!(!path("planted.json").exists());
    drop(studio);
    let data = "set/data/chunk-000/file-000.parquet";
    std::fs::rename(path(data), path("far.parquet")).unwrap();
    symlink(path("far.parquet"), path(data)).unwrap();
    let studio = Studio::start(folder.path(), &["set", "--binding", "b.yaml"]);
    let list = studio.list();
    let error = list["recordings"][0]["error"].as_str().unwrap_or_else(|| panic!("{list}"));
    assert!(error.contains(&format!("{data}: leads out of set")), "{error}");
}

/// Signals the end of an action on drop, also if the action fails.
struct EndSignal<'a>(&'a AtomicBool);

impl Drop for EndSignal<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Replaces a path alternately by a link to `to` and by a regular file while `done` runs.
fn while_changing(place: &Path, to: &str, plain: &str, done: impl FnOnce()) {
    let (ended, beside) = (AtomicBool::new(false), place.with_extension("next"));
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !ended.load(Ordering::Relaxed) {
                symlink(to, &beside).unwrap();
                std::fs::rename(&beside, place).unwrap();
                std::fs::write(&beside, plain).unwrap();
                std::fs::rename(&beside, place).unwrap();
            }
        });
        let _ended = EndSignal(&ended);
        done();
    });
}

#[test]
fn a_link_that_appears_during_a_request_is_not_followed() {
    let folder = with_secrets();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("logs/a.mp4"), "a film").unwrap();
    let studio = Studio::start(folder.path(), &OPENED);
    studio.list();
    while_changing(&path("logs/a.mp4"), "../secret.txt", "a film", || {
        for _ in 0..400 {
            let answer = studio.get_with("video/0/0", "");
            let text = String::from_utf8(answer.body).unwrap();
            assert!(!text.contains("SECRET"), "{text}");
            assert!(matches!(answer.status, 200 | 422), "{text}");
        }
    });
    let table = "track,kind,label,start_s,end_s,pinned,by,at\n";
    for to in ["../planted.csv", "../others.csv"] {
        let before = std::fs::read_to_string(path("others.csv")).unwrap();
        while_changing(&path("logs/b.labels.csv"), to, table, || {
            let mut base = json!("");
            for turn in 0..200 {
                let lines = if turn % 3 == 0 { json!([]) } else { json!([line("Move", 12.0, 13.5)]) };
                let answer = studio.change("PUT", "api/recording/1/labels", &json!({ "base": base, "lines": lines }));
                let said = answer.json();
                assert!(!said.to_string().contains("SECRET"), "{said}");
                // The current version, also after a conflict.
                base = said.get("version").cloned().unwrap_or(base);
            }
        });
        assert!(!path("planted.csv").exists());
        assert_eq!(std::fs::read_to_string(path("others.csv")).unwrap(), before);
    }
}
