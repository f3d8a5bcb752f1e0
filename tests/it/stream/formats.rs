//! Readers: files of every format in, tables and recordings out.

pub mod arrays;
mod columnar;
mod damaged;
mod joined;
mod lines;
mod messages;
mod publishers;
mod stores;
mod text;

use std::path::{Path, PathBuf};
use teachtree_base::recording::Recording;
use teachtree_frames::bind::{BindingFile, bind};
use teachtree_logs::issue::Issue;
use teachtree_logs::read::formats;

/// The scene that bindings in these tests have.
const SCENE: &str =
    "scene: {bodies: {cube: {role: object, radius: 50 mm}}, hands: {right: {fingers: [thumb, palm]}}}\n";

/// A folder with these files in it.
fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
    folder
}

/// A log read through a binding, or the message why not; the place is without the folder.
fn bound(log: &Path, binding: &str) -> Result<(Recording, Vec<Issue>), String> {
    let file = BindingFile::parse(format!("{binding}{SCENE}"), "binding.yaml".into()).unwrap();
    let scene = file.binding.scene.clone().unwrap();
    let read = formats::open(log).and_then(|source| bind(source, &file, scene));
    let parent = format!("{}/", log.parent().unwrap().display());
    read.map(|read| (read.recording, read.issues)).map_err(|error| error.to_string().replace(&parent, ""))
}

/// A text bound as a file of this name.
fn bound_text(name: &str, text: &str, binding: &str) -> Result<(Recording, Vec<Issue>), String> {
    let folder = folder(&[(name, text)]);
    bound(&folder.path().join(name), binding)
}

/// The values of a column.
fn values<'a>(recording: &'a Recording, name: &str) -> &'a [f64] {
    &recording.columns.get(name).unwrap_or_else(|| panic!("no {name} in {:?}", recording.columns.keys())).values
}

/// The titles of a log's columns.
fn header(log: &Path) -> Vec<String> {
    formats::open(log).unwrap().header()
}

/// A file of the fixtures.
fn fixture(name: &str) -> PathBuf {
    Path::new("tests/fixtures/formats").join(name)
}

#[test]
fn what_is_no_log_is_refused() {
    let folder = folder(&[("log.db3", "SQLite format 3"), ("picture.png", "\u{89}PNG"), ("empty/readme.md", "")]);
    let refused = |name: &str| bound(&folder.path().join(name), "").unwrap_err();
    insta::assert_snapshot!(
        [refused("log.db3"), refused("picture.png"), refused("empty"), refused("log.db3#3")].join("\n")
    );
}
