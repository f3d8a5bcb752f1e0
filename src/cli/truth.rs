//! What is true of recordings: the options that name it, for the commands that compare results with a truth.

use super::output;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use teachtree_analysis::TrackId;
use teachtree_analysis::score::NameMap;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_logs::read::{formats, text};
use teachtree_session::files::label_file;
use teachtree_session::project_file::ProjectSettings;
use teachtree_session::score::{MAX_TEXT, is_of_several};
use teachtree_session::{Labels, LabelsInternals};

/// Tracks by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum TrackArg {
    /// The left hand
    Left,
    /// The right hand
    Right,
    /// The coordination of both
    Both,
}

impl From<TrackArg> for TrackId {
    fn from(track: TrackArg) -> Self {
        match track {
            TrackArg::Left => Self::Hand(Side::Left),
            TrackArg::Right => Self::Hand(Side::Right),
            TrackArg::Both => Self::Both,
        }
    }
}

/// The track of labels.
#[derive(clap::Args, Clone, Copy, Debug, Default)]
pub struct LabelTrackArg {
    /// The track of labels without a column `track`
    #[arg(long, value_enum, value_name = "TRACK")]
    track: Option<TrackArg>,
}

impl LabelTrackArg {
    pub fn who(self) -> Option<TrackId> {
        self.track.map(TrackId::from)
    }
}

/// Options that name the truth.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct TruthArgs {
    /// True labels instead of those in the logs: a table, also of `analyze --format csv`; a file of ELAN; a LeRobot set with `meta/lerobot_annotations.json`; a folder with a file for each log
    #[arg(long, value_name = "FILE")]
    pub labels: Option<PathBuf>,
    #[command(flatten)]
    pub track: LabelTrackArg,
    /// Mapping of foreign names to names of the rules: a YAML file, or `S1=Move|Approach,S2=Grasp,S9=mask`
    #[arg(long, value_name = "MAP")]
    pub map: Option<String>,
}

impl TruthArgs {
    /// Refuses one label file for several recordings.
    pub fn check(&self, logs: &[PathBuf]) -> Result<(), InputError> {
        let mut counts: BTreeMap<PathBuf, usize> = BTreeMap::new();
        for log in logs {
            self.labels_of(log)?.into_iter().for_each(|labels| *counts.entry(labels).or_default() += 1);
        }
        counts.iter().try_for_each(|(labels, count)| check_labels(labels, *count))
    }

    /// The labels of a log: of these options, else of `teachtree.yaml`.
    ///
    /// # Errors
    /// When that file cannot be read.
    pub fn labels_of(&self, log: &Path) -> Result<Option<PathBuf>, InputError> {
        match &self.labels {
            Some(labels) => Ok(Some(labels.clone())),
            None => Ok(ProjectSettings::of(log)?.labels.map(|labels| labels.value)),
        }
    }

    /// Those of some recordings that have a label file where `--labels` is a folder of them; how many have none is a warning.
    ///
    /// # Errors
    /// When none has a label file, or several recordings have only one.
    pub fn labeled_logs(&self, logs: Vec<PathBuf>) -> Result<Vec<PathBuf>, InputError> {
        self.check(&logs)?;
        let mut by_labels: BTreeMap<Option<PathBuf>, Vec<PathBuf>> = BTreeMap::new();
        for log in &logs {
            by_labels.entry(self.labels_of(log)?).or_default().push(log.clone());
        }
        let mut kept = BTreeSet::new();
        for (labels, logs) in by_labels {
            kept.extend(match labels {
                Some(labels) => labeled(logs, &labels)?,
                None => logs,
            });
        }
        Ok(logs.into_iter().filter(|log| kept.contains(log)).collect())
    }

    /// Where the labels of a log are, as the library takes it.
    ///
    /// # Errors
    /// As [`labels_of`](Self::labels_of).
    pub fn of_log(&self, log: &Path) -> Result<Labels, InputError> {
        Ok(self.of_labels(self.labels_of(log)?.as_deref()))
    }

    /// The names of labels.
    ///
    /// # Errors
    /// A map that cannot be read.
    pub fn names(&self) -> Result<NameMap, InputError> {
        self.of_labels(None).names()
    }

    fn of_labels(&self, labels: Option<&Path>) -> Labels {
        let labels = labels.map_or_else(Labels::default, Labels::file);
        let labels = self.track.who().into_iter().fold(labels, Labels::track);
        self.map.iter().fold(labels, Labels::map)
    }
}

/// Refuses one label file for several recordings.
pub fn check_labels(labels: &Path, logs: usize) -> Result<(), InputError> {
    if logs < 2 || is_of_several(labels) {
        return Ok(());
    }
    Err(InputError::new(labels.display().to_string(), format!("one label file for {logs} recordings"))
        .help("name the folder in which every log has its label file, or a table with a column `log`"))
}

/// Whether a folder of label files has none for a log.
pub fn lacks_labels(labels: &Path, log: &Path) -> bool {
    labels.is_dir() && !formats::is_set(labels) && label_file(labels, log).is_err()
}

/// Those recordings that have a label file in a folder; all where it is not a folder of label files.
///
/// # Errors
/// When none has one.
pub fn labeled(logs: Vec<PathBuf>, labels: &Path) -> Result<Vec<PathBuf>, InputError> {
    let all = logs.len();
    let (without, with): (Vec<PathBuf>, Vec<PathBuf>) = logs.into_iter().partition(|log| lacks_labels(labels, log));
    if let (true, Some(log)) = (with.is_empty(), without.first()) {
        label_file(labels, log)?;
    }
    if !without.is_empty() {
        let (count, folder) = (without.len(), labels.display());
        output::warn(&format!("{count} of {all} recordings have no label file in {folder}: they are left out"));
    }
    Ok(with)
}

/// Reads a text.
pub fn read(path: &Path) -> Result<String, InputError> {
    text::read(path, MAX_TEXT)
}
