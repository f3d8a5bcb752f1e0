//! Fixtures, and logs that are read through a binding.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use teachtree_base::recording::Recording;
use teachtree_frames::bind::{BindingFile, bind};
use teachtree_logs::issue::Issue;
use teachtree_logs::read::csv::LoadedRecording;
use teachtree_logs::read::formats;
use teachtree_logs::read::table::{ColumnRequest, Source};

/// The scene that bindings in these tests have.
pub const SCENE: &str =
    "scene: {bodies: {cube: {role: object, radius: 50 mm}}, hands: {right: {fingers: [thumb, palm]}}}\n";

/// A folder with these files in it.
pub fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
    folder
}

/// A log read through a binding, or the message why not; the place is without the folder.
pub fn bound(log: &Path, binding: &str) -> Result<(Recording, Vec<Issue>), String> {
    read(log, binding).map(|read| (read.recording, read.issues))
}

/// The stamps of a bound log as they are in it, s.
pub fn stamps(log: &Path, binding: &str) -> Result<Vec<f64>, String> {
    read(log, binding).map(|read| read.recording.time.iter().map(|time| time + read.zero_stamp_s).collect())
}

fn read(log: &Path, binding: &str) -> Result<LoadedRecording, String> {
    let file = BindingFile::parse(format!("{binding}{SCENE}"), "binding.yaml".into()).unwrap();
    let scene = file.binding.scene.clone().unwrap();
    let read = formats::open(log).and_then(|source| bind(source, &file, scene));
    let parent = format!("{}/", log.parent().unwrap().display());
    read.map_err(|error| error.to_string().replace(&parent, ""))
}

/// A text bound as a file of this name.
pub fn bound_text(name: &str, text: &str, binding: &str) -> Result<(Recording, Vec<Issue>), String> {
    let folder = folder(&[(name, text)]);
    bound(&folder.path().join(name), binding)
}

/// The values of a column.
pub fn values<'a>(recording: &'a Recording, name: &str) -> &'a [f64] {
    &recording.columns.get(name).unwrap_or_else(|| panic!("no {name} in {:?}", recording.columns.keys())).values
}

/// The titles of a log's columns.
pub fn header(log: &Path) -> Vec<String> {
    formats::open(log).unwrap().header()
}

/// A file of the fixtures.
pub fn fixture(name: &str) -> PathBuf {
    Path::new(crate::ROOT).join("tests/fixtures/formats").join(name)
}

/// All columns of a log but those of text, each as long as its sheet.
pub fn columns(source: Source) -> BTreeMap<String, Vec<f64>> {
    let mut found = BTreeMap::new();
    for sheet in source.sheets {
        let (name, header) = (sheet.name, sheet.header.clone());
        let wants = vec![ColumnRequest::Optional(1.0); header.len()];
        let table = sheet.rows.read(&header, &wants, Some(1.0)).unwrap();
        let title = |title: &String| if name.is_empty() { title.clone() } else { format!("{name}.{title}") };
        found.extend(header.iter().map(title).zip(table.numbers));
    }
    found
}
