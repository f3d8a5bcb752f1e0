//! Links and pipes beside recordings: nothing outside of the folder is written or shown, even if a path changes during a request.

use super::labels::line;
use super::{OPENED, Studio, folder};
use crate::pipes::pipe;
use crate::sets::with_set;
use crate::shared::folders::copy;
use serde_json::{Value, json};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use teachtree_base::error::InputError;
use teachtree_frames::{OpenRequest, open};
use teachtree_logs::allowed_folders::{AllowedFolders, LogFolders};
use teachtree_logs::read::formats;
use teachtree_logs::read::table::ColumnRequest;

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
    let nowhere = "logs/a.labels.csv: is a link to ../planted.csv, which does not exist";
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
        "logs/a.eaf: is a link to ../planted.eaf, which does not exist",
    );
    std::fs::remove_file(path("logs/b.labels.csv")).unwrap();
    refused(studio.change("POST", "api/recording/1/export/elan", &replace), "logs/b.eaf: leads out of logs");
    // Videos, complete and by range.
    for range in ["", "Range: bytes=0-2\r\n"] {
        refused(studio.get_with("video/0/0", range), "logs/a.mp4: leads out of logs");
    }
    refused(studio.get_with("video/1/0", ""), "logs/b.webm: is a link to /nonexistent, which does not exist");
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

/// Reads a log and returns the bits of the values of all its columns.
fn read(log: &Path, folders: &AllowedFolders) -> Result<Vec<u64>, InputError> {
    let mut values = vec![];
    for sheet in formats::open_within(log, folders)?.sheets {
        let wants = vec![ColumnRequest::Optional(1.0); sheet.header.len()];
        let table = sheet.rows.read(&sheet.header, &wants, Some(1.0))?;
        values.extend(table.numbers.iter().flatten().map(|value| value.to_bits()));
    }
    Ok(values)
}

/// Returns the files and folders in a folder and in its subfolders, relative to it.
fn paths_in(folder: &Path, below: &Path) -> Vec<PathBuf> {
    let names = std::fs::read_dir(folder.join(below)).unwrap().map(|entry| below.join(entry.unwrap().file_name()));
    let of = |path: PathBuf| {
        let inner = if folder.join(&path).is_dir() { paths_in(folder, &path) } else { vec![] };
        std::iter::once(path).chain(inner)
    };
    let mut paths: Vec<PathBuf> = names.flat_map(of).collect();
    paths.sort();
    paths
}

/// A link that takes the place of a file or folder after a check of its path: a reader decides by the file that it opened.
#[test]
fn a_reader_opens_no_file_outside_of_its_folders() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for (from, recording) in [
        ("demos/robosuite/lift_demo_1.csv", ""),
        ("tests/fixtures/formats/arrays/isaac.hdf5", "#0"),
        ("tests/fixtures/formats/stores/arrays.npz", ""),
        ("tests/fixtures/formats/stores/table.npy", ""),
        ("tests/fixtures/formats/stores/folder", ""),
        ("tests/fixtures/formats/stores/umi.zarr.zip", "#0"),
        ("tests/fixtures/formats/stores/demos_2_by_3.zarr", "#0"),
        ("tests/fixtures/formats/stores/demos_3_by_3.zarr", "#0"),
        ("tests/fixtures/formats/lerobot_v30", "#0"),
        ("tests/fixtures/formats/rosbag2/cdr_test_0.mcap", ""),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let (logs, away) = (folder.path().join("logs"), folder.path().join("away"));
        std::fs::create_dir(&logs).unwrap();
        let name = Path::new(from).file_name().unwrap().to_str().unwrap();
        match root.join(from).is_dir() {
            true => copy(&root.join(from), &logs.join(name)),
            false => _ = std::fs::copy(root.join(from), logs.join(name)).unwrap(),
        }
        let (log, folders) = (logs.join(format!("{name}{recording}")), AllowedFolders::of(&logs).unwrap());
        let any = AllowedFolders::default();
        let values = read(&log, &folders).unwrap_or_else(|error| panic!("{error}"));
        for path in paths_in(&logs, Path::new("")) {
            let path = logs.join(path);
            std::fs::rename(&path, &away).unwrap();
            symlink(&away, &path).unwrap();
            // By default all folders are allowed.
            assert_eq!(read(&log, &any).unwrap(), values, "{}", path.display());
            match read(&log, &folders) {
                Err(error) => assert!(error.message.contains("leads out of"), "{}: {error}", path.display()),
                // The recording does not need the content of this file.
                Ok(_) => {
                    let content = std::fs::read(&away).unwrap();
                    std::fs::write(&away, "").unwrap();
                    assert_eq!(read(&log, &any).unwrap(), values, "{}", path.display());
                    std::fs::write(&away, content).unwrap();
                }
            }
            std::fs::remove_file(&path).unwrap();
            std::fs::rename(&away, &path).unwrap();
        }
    }
}

/// Scenes and events are in files beside a log.
#[test]
fn files_beside_a_log_are_not_read_outside_of_its_folders() {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/logs");
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::create_dir(path("logs")).unwrap();
    std::fs::copy(fixtures.join("whole.csv"), path("logs/a.csv")).unwrap();
    std::fs::copy(fixtures.join("box.yaml"), path("a.yaml")).unwrap();
    std::fs::write(path("a.events"), "time,event,subjects\n").unwrap();
    let allowed = AllowedFolders::of(&path("logs")).unwrap();
    let opened = |folders: LogFolders| open(&OpenRequest { log: path("logs/a.csv"), folders, ..Default::default() });
    let refused = |words: &str| {
        let folders = LogFolders { log: allowed.clone(), beside: allowed.clone() };
        let error = opened(folders).unwrap_err().to_string();
        assert!(error.contains(words), "{words}: {error}");
    };
    symlink("../a.yaml", path("logs/a.scene.yaml")).unwrap();
    refused("a.scene.yaml: leads out of");
    opened(LogFolders::default()).unwrap();
    std::fs::remove_file(path("logs/a.scene.yaml")).unwrap();
    symlink("nowhere", path("logs/a.scene.yaml")).unwrap();
    refused("a.scene.yaml: is a link to nowhere, which does not exist");
    std::fs::remove_file(path("logs/a.scene.yaml")).unwrap();
    pipe(&path("logs/a.scene.yaml"));
    refused("a.scene.yaml: found a pipe, expected a file");
    std::fs::remove_file(path("logs/a.scene.yaml")).unwrap();
    std::fs::copy(fixtures.join("box.yaml"), path("logs/a.scene.yaml")).unwrap();
    symlink("../a.events", path("logs/a.events.csv")).unwrap();
    refused("a.events.csv: leads out of");
}

/// A link that takes the place of `meta/info.json` after the set was read does not name a video.
#[test]
fn the_videos_of_a_set_are_not_listed_by_a_file_outside() {
    let folder = with_set();
    let path = |name: &str| folder.path().join(name);
    let studio = Studio::start(folder.path(), &["set", "--binding", "b.yaml"]);
    assert_eq!(studio.list()["recordings"][0]["status"], "done");
    let info = json!({
        "codebase_version": "v2.1", "total_episodes": 3, "chunks_size": 1000, "video_path": "LICENSE",
        "features": { "camera": { "dtype": "video" } },
    });
    std::fs::write(path("info.json"), info.to_string()).unwrap();
    std::fs::remove_file(path("set/meta/info.json")).unwrap();
    symlink("../../info.json", path("set/meta/info.json")).unwrap();
    assert_eq!(studio.get_with("video/0/0", "").status, 404);
    let answer = studio.change("POST", "api/recording/0/export/lerobot", &json!({}));
    assert!(answer.json()["error"].as_str().unwrap().contains("info.json: leads out of set"), "{}", answer.json());
    // A file in the set is read.
    std::fs::remove_file(path("set/meta/info.json")).unwrap();
    std::fs::rename(path("info.json"), path("set/meta/info.json")).unwrap();
    assert_eq!(studio.get_with("video/0/0", "").status, 200);
}

/// A recording that fails is read by each request.
#[test]
fn a_recording_that_is_replaced_during_a_request_is_not_read_outside() {
    let folder = with_secrets();
    let path = |name: &str| folder.path().join(name);
    let log = std::fs::read_to_string(path("far.csv")).unwrap();
    let (header, rows) = log.split_once('\n').unwrap();
    let with = |cell: &str| format!("{header}\n{}\n{rows}", vec![cell; header.split(',').count()].join(","));
    std::fs::write(path("secret.csv"), with(SECRET)).unwrap();
    let plain = with("plain");
    std::fs::write(path("logs/a.csv"), &plain).unwrap();
    let studio = Studio::start(folder.path(), &OPENED);
    let list = studio.list();
    assert!(list["recordings"][0]["error"].as_str().unwrap().contains("found `plain`"), "{list}");
    while_changing(&path("logs/a.csv"), "../secret.csv", &plain, || {
        for _ in 0..600 {
            let answer = studio.get_with("api/recording/0", "");
            let text = String::from_utf8(answer.body).unwrap();
            assert!(!text.contains("SECRET"), "{text}");
        }
    });
}
