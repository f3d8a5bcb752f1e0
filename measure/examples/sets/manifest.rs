//! The file `set.yaml` of a set: where the set comes from, how its recordings are read, what is true of them, and by which methods they are measured.

use super::method::Method;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use teachtree_analysis::TrackId;
use teachtree_base::hands::Side;
use teachtree_base::yaml;

/// A set: its folder, and what is in its `set.yaml`.
pub struct Set {
    /// The name of the folder.
    pub id: String,
    pub folder: PathBuf,
    pub manifest: Manifest,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    pub name: String,
    pub license: String,
    pub address: String,
    /// The commands that download the set.
    pub download: String,
    /// The folder of the download, in the folder of the downloads; a set that is made by its converter has none.
    pub folder: Option<String>,
    /// The Python packages that the converter needs.
    #[serde(default)]
    pub python: Vec<String>,
    /// The binding, beside `set.yaml` or by a path from there.
    pub binding: PathBuf,
    /// What the labels of the converted recordings say, and which measurement they come from.
    pub truth: String,
    /// The track of labels that name none.
    pub track: Option<TrackName>,
    /// From the labels to names of primitives; several are alternatives.
    pub map: BTreeMap<String, Vec<String>>,
    /// Segments of this set mean nothing: only the share of right frames is measured.
    #[serde(default)]
    pub frames_only: bool,
    /// Maximum error of the starts and ends of labels, s. Larger errors than those of right boundaries leave the set out of the calibration.
    #[serde(default)]
    pub label_error: f64,
    /// The figures when the set was measured for the first time, and the commit.
    pub first: String,
    /// What the rules are compared with.
    pub methods: Vec<Method>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TrackName {
    Left,
    Right,
    Both,
}

impl From<TrackName> for TrackId {
    fn from(name: TrackName) -> Self {
        match name {
            TrackName::Left => Self::Hand(Side::Left),
            TrackName::Right => Self::Hand(Side::Right),
            TrackName::Both => Self::Both,
        }
    }
}

impl Set {
    fn read(folder: PathBuf) -> Result<Self, String> {
        let file = folder.join("set.yaml");
        let name = file.display().to_string();
        let text = std::fs::read_to_string(&file).map_err(|error| format!("{name}: {error}"))?;
        let manifest: Manifest = yaml::read(&text, &name).map_err(|error| error.to_string())?;
        manifest.methods.iter().try_for_each(Method::check).map_err(|message| format!("{name}: {message}"))?;
        let id = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Self { id, folder, manifest })
    }

    pub fn binding(&self) -> PathBuf {
        self.folder.join(&self.manifest.binding)
    }

    /// The map of names as `teachtree score --map` takes it.
    pub fn map(&self) -> String {
        let pairs: Vec<String> =
            self.manifest.map.iter().map(|(label, names)| format!("{label}={}", names.join("|"))).collect();
        pairs.join(",")
    }

    /// The first primitive that a label stands for.
    pub fn primitive<'a>(&'a self, label: &'a str) -> &'a str {
        self.manifest.map.get(label).and_then(|names| names.first()).map_or(label, String::as_str)
    }
}

/// All sets in a folder, by the names of their folders.
pub fn read_all(folder: &Path) -> Result<Vec<Set>, String> {
    let entries = std::fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut folders: Vec<PathBuf> =
        entries.filter_map(|entry| Some(entry.ok()?.path())).filter(|path| path.join("set.yaml").is_file()).collect();
    folders.sort();
    if folders.is_empty() {
        return Err(format!("{}: no subfolder has a `set.yaml`", folder.display()));
    }
    folders.into_iter().map(Set::read).collect()
}
