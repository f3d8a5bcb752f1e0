//! What is true of recordings: the options that name it, and reading it; for the commands that compare results with a truth.

use crate::analysis::number::fixed;
use crate::analysis::score::{Known, NameMap, Truth};
use crate::analysis::{Analysis, Who};
use crate::base::error::InputError;
use crate::base::hands::Side;
use crate::session::files::LABEL_ENDINGS;
use crate::stream::Opened;
use crate::stream::read::formats;
use crate::stream::read::labels;
use crate::stream::read::text;
use std::path::{Path, PathBuf};

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

impl From<TrackArg> for Who {
    fn from(track: TrackArg) -> Self {
        match track {
            TrackArg::Left => Self::Hand(Side::Left),
            TrackArg::Right => Self::Hand(Side::Right),
            TrackArg::Both => Self::Both,
        }
    }
}

/// Options that say what is true.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct TruthArgs {
    /// True labels instead of those in the logs; a folder for `LOG.labels.csv` or `LOG_segments.csv` of each log
    #[arg(long, value_name = "FILE")]
    pub labels: Option<PathBuf>,
    /// Whom labels without a column `track` are about
    #[arg(long, value_enum, value_name = "TRACK")]
    pub track: Option<TrackArg>,
    /// From foreign names to ours: a YAML file, or `S1=Move|Approach,S2=Grasp,S9=mask`
    #[arg(long, value_name = "MAP")]
    pub map: Option<String>,
}

impl TruthArgs {
    /// Refuses one label file for several recordings.
    pub fn check(&self, logs: usize) -> Result<(), InputError> {
        match self.labels.as_ref().filter(|labels| logs > 1 && !labels.is_dir()) {
            None => Ok(()),
            Some(labels) => {
                let message = format!("one label file for {logs} recordings");
                Err(InputError::new(labels.display().to_string(), message)
                    .help("name the folder in which every log has its label file"))
            }
        }
    }

    /// The map of names.
    pub fn names(&self) -> Result<NameMap, InputError> {
        let Some(map) = self.map.as_deref() else { return Ok(NameMap::default()) };
        let path = Path::new(map);
        if path.extension().is_some_and(|ending| ending == "yaml" || ending == "yml") {
            NameMap::read(&read(path)?, map)
        } else {
            NameMap::of_pairs(map)
        }
    }

    /// The truth of a recording, and what is to be said about it.
    pub fn of(
        &self,
        opened: &Opened,
        analysis: &Analysis,
        map: &NameMap,
        known: &Known,
    ) -> Result<(Truth, Vec<String>), InputError> {
        map.check(known, self.map.as_deref().unwrap_or_default())?;
        let Some(path) = &self.labels else { return Ok((own_truth(opened, map)?, Vec::new())) };
        let only = match analysis.tracks.as_slice() {
            [track] => Some(track.who),
            _ => None,
        };
        let labels = labels::read(&label_file(path, &opened.log)?, &opened.row_time)?;
        let mut warnings = Vec::new();
        if labels.contradicted_s > 0.0 {
            let time = fixed(labels.contradicted_s, 3);
            warnings.push(format!("{}: {time} s have two labels that differ; they are not scored", labels.file));
        }
        Ok((Truth::of_labels(&labels, self.track.map(Who::from).or(only), map, known)?, warnings))
    }
}

fn own_truth(opened: &Opened, map: &NameMap) -> Result<Truth, InputError> {
    Truth::of_recording(&opened.recording, map).ok_or_else(|| {
        let message = "the log does not say what is true: it has no `right.label`, `left.label` or `both.label`";
        InputError::new(opened.log.display().to_string(), message)
            .help("name a label file with --labels, or bind a column of the log as `right.label`")
    })
}

/// The largest map, sequences or labels that are read, bytes.
const MAX_TEXT: u64 = 256 << 20;

/// Reads a text.
pub fn read(path: &Path) -> Result<String, InputError> {
    text::read(path, MAX_TEXT)
}

/// The label file of a log: the one that is named, or the log's own in the folder that is named.
fn label_file(path: &Path, log: &Path) -> Result<PathBuf, InputError> {
    if !path.is_dir() {
        return Ok(path.into());
    }
    let stem = formats::stem(log);
    let places = LABEL_ENDINGS.map(|ending| path.join(format!("{stem}{ending}")));
    places.iter().find(|place| place.is_file()).cloned().ok_or_else(|| {
        let [one, other] = places.each_ref().map(|place| place.display());
        InputError::new(
            log.display().to_string(),
            format!("the log has no label file: found neither {one} nor {other}"),
        )
    })
}
