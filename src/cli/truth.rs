//! What is true of recordings: the options that name it, for the commands that compare results with a truth.

use super::output;
use std::path::{Path, PathBuf};
use teachtree_analysis::TrackId;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_logs::read::{formats, text};
use teachtree_session::Labels;
use teachtree_session::files::{all_logs, label_file};
use teachtree_session::score::{MAX_TEXT, is_of_several};

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
    /// The track of labels that have no column `track`
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
    /// From foreign names to ours: a YAML file, or `S1=Move|Approach,S2=Grasp,S9=mask`
    #[arg(long, value_name = "MAP")]
    pub map: Option<String>,
}

impl TruthArgs {
    /// Refuses one label file for several recordings.
    pub fn check(&self, logs: usize) -> Result<(), InputError> {
        self.labels.iter().try_for_each(|labels| check_labels(labels, logs))
    }

    /// The recordings that these paths stand for, without those that have no label file where `--labels` is a folder of them; how many have none is a
    /// warning.
    ///
    /// # Errors
    /// When there are none, or none has a label file, or several recordings have only one.
    pub fn labeled_logs(&self, paths: &[PathBuf]) -> Result<Vec<PathBuf>, InputError> {
        let logs = all_logs(paths)?;
        self.check(logs.len())?;
        self.labels.iter().try_fold(logs, |logs, labels| labeled(logs, labels))
    }

    /// Where the labels are, as the library takes it.
    pub fn of_session(&self) -> Labels {
        let labels = self.labels.as_ref().map_or_else(Labels::default, Labels::file);
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

/// Those recordings that have a label file in a folder; all where it is no folder of label files.
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
