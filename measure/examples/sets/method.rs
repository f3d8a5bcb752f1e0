//! A method that rules are compared with: a threshold on a channel, tables of intervals that another program made, or other rules.

use super::intervals::{self, LabeledInterval};
use super::manifest::Set;
use super::threshold::Threshold;
use serde::Deserialize;
use std::path::PathBuf;
use teachtree_analysis::{Analysis, TrackId};
use teachtree_logs::read::labels;
use teachtree_session::{AnalysisInternals, Log, LogInternals, Rules};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Method {
    /// The title of its column.
    pub name: String,
    /// What it does, in one line.
    pub about: String,
    pub threshold: Option<Threshold>,
    /// A folder beside `set.yaml`, with a table of labels `LOG.csv` for each recording.
    pub tables: Option<PathBuf>,
    /// Rule files, in place of the shipped ones: paths beside `set.yaml`, or shipped names such as `contact.rules`.
    pub rules: Option<Vec<PathBuf>>,
}

impl Method {
    pub fn check(&self) -> Result<(), String> {
        let kinds = [self.threshold.is_some(), self.tables.is_some(), self.rules.is_some()];
        if kinds.into_iter().filter(|is_given| *is_given).count() == 1 {
            return Ok(());
        }
        Err(format!("method `{}` has none or several of `threshold`, `tables` and `rules`; give one", self.name))
    }

    /// The result of the method for a recording that the shipped rules have analyzed.
    pub fn result(&self, set: &Set, log: &Log, shipped: &Analysis) -> Result<Analysis, String> {
        if let Some(files) = &self.rules {
            let beside = |file: &PathBuf| {
                let own = set.folder.join(file);
                if own.is_file() { own } else { file.clone() }
            };
            let rules = files.iter().fold(Rules::options(), |options, file| options.file(beside(file)));
            let rules = rules.for_log(log).map_err(|error| error.to_string())?;
            return Ok(rules.analyze(log).map_err(|error| error.to_string())?.found().clone());
        }
        let opened = log.opened().map_err(|error| error.to_string())?;
        let intervals = match (&self.threshold, &self.tables) {
            (Some(threshold), _) => threshold.intervals(&opened.recording)?,
            (None, Some(folder)) => {
                let stem = opened.log.file_stem().unwrap_or_default().to_string_lossy();
                let file = set.folder.join(folder).join(format!("{stem}.csv"));
                let read = labels::read(&file, &opened.log, &opened.row_time).map_err(|error| error.to_string())?;
                let track = set.manifest.track.map(TrackId::from);
                let interval = |it: labels::Interval| {
                    let who = it.track.or(track)?;
                    Some(LabeledInterval { who, label: it.name, start_s: it.start_s, end_s: it.end_s })
                };
                read.intervals.into_iter().filter_map(interval).collect()
            }
            (None, None) => Vec::new(),
        };
        Ok(intervals::in_place_of(shipped, &intervals, |label| set.primitive(label)))
    }
}
