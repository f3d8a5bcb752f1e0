//! An analysis against what is true: labels of the log or of a file, and the score.

#[cfg(feature = "parquet")]
pub mod atoms;

use super::analysis::Analysis;
use super::error::Error;
use super::files::label_file;
use crate::{AnalysisInternals, ErrorInternals, LogInternals, RulesInternals};
use std::fmt;
use std::path::{Path, PathBuf};
use teachtree_analysis::json::Meta;
use teachtree_analysis::number::fixed;
use teachtree_analysis::score::{self, KnownNames, NameMap, Stage, Truth};
use teachtree_analysis::{Analysis as AnalysisResult, TrackId};
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_frames::OpenedLog;
use teachtree_logs::read::labels::{self, LabelKind};
use teachtree_logs::read::text;
use teachtree_report as report;

/// Where the true labels of a recording are. The default is the log itself: its columns `right.label`, `left.label`, `both.label`.
///
/// ```
/// use teachtree::{Labels, Side, TrackId};
/// let labels = Labels::file("S2_T1_segments.csv").track(TrackId::Hand(Side::Right)).map("S1=Move|Approach,S2=Grasp,S9=mask");
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Labels {
    file: Option<PathBuf>,
    track: Option<TrackId>,
    map: Option<String>,
}

impl Labels {
    /// Labels in a file (docs/score.md): a table, a file of ELAN, the annotations of a LeRobot set; or a folder with a file for each log: `LOG.labels.csv`,
    /// `LOG_segments.csv`, `LOG.eaf` or `LOG.csv`.
    pub fn file(path: impl Into<PathBuf>) -> Self {
        Self { file: Some(path.into()), ..Self::default() }
    }

    /// The track that labels without a column `track` are about.
    #[must_use]
    pub fn track(mut self, track: TrackId) -> Self {
        self.track = Some(track);
        self
    }

    /// From foreign names to those of the rules: a YAML file, or `S1=Move|Approach,S2=Grasp,S9=mask`.
    #[must_use]
    pub fn map(mut self, map: impl Into<String>) -> Self {
        self.map = Some(map.into());
        self
    }
}

/// The labels of a recording in a file; the names of `known` are what the words in the annotations of a LeRobot set may stand for.
#[cfg_attr(not(feature = "parquet"), expect(unused_variables, reason = "only data sets have words"))]
pub fn read_labels(
    file: &Path,
    opened: &OpenedLog,
    map: &NameMap,
    known: &KnownNames,
) -> Result<labels::Labels, InputError> {
    #[cfg(feature = "parquet")]
    if is_of_set(file) {
        return atoms::read(file, opened, map, known);
    }
    let mut labels = labels::read(file, &opened.log, &opened.row_time)?;
    labels.count_from(opened.zero_stamp_s);
    meets(&labels, &opened.recording.time)?;
    Ok(labels)
}

/// Refuses labels most of which are outside of the time of the recording.
pub fn meets(labels: &labels::Labels, time: &[f64]) -> Result<(), InputError> {
    let (Some(first), Some(last)) = (time.first(), time.last()) else { return Ok(()) };
    let (start_s, end_s) = labels.intervals.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(start_s, end_s), it| {
        (start_s.min(it.start_s), end_s.max(it.end_s))
    });
    let outside = labels.intervals.iter().filter(|it| it.start_s > *last || it.end_s < *first).count();
    if 2 * outside <= labels.intervals.len() {
        return Ok(());
    }
    let [start_s, end_s, first, last] = [start_s, end_s, *first, *last].map(|time_s| fixed(time_s, 3));
    let message = format!("has labels from {start_s} s to {end_s} s, and the recording is from {first} s to {last} s");
    Err(InputError::new(&labels.file, message)
        .help("write the times of the labels on the time base of the recording; milliseconds need the columns `start_ms` and `end_ms`"))
}

fn own_truth(opened: &OpenedLog, map: &NameMap) -> Result<Truth, InputError> {
    Truth::of_recording(&opened.recording, map).ok_or_else(|| {
        let message = "the log has no true labels: it has no `right.label`, `left.label` or `both.label`";
        InputError::new(opened.log.display().to_string(), message)
            .help("name a label file with --labels, or bind a column of the log as `right.label`")
    })
}

/// The largest map, sequences or labels that are read, bytes.
pub const MAX_TEXT: u64 = 256 << 20;

/// Whether one file has the labels of several logs, and says which.
pub fn is_of_several(path: &Path) -> bool {
    path.is_dir() || is_of_set(path) || labels::names_logs(path)
}

/// Whether a file has the labels of all episodes of a LeRobot set.
pub fn is_of_set(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("json"))
}

/// An analysis compared with labels ([`Analysis::score`]). `Display` writes the tables of `teachtree score`.
#[derive(Clone, Debug)]
pub struct Score {
    scores: [score::Score; 1],
    meta: Meta,
    warnings: Vec<String>,
}

impl Score {
    pub(super) fn new(analysis: &Analysis, labels: &Labels) -> Result<Self, Error> {
        let argument = |error| Error::new(error, ErrorKind::Argument);
        let map = labels.names().map_err(argument)?;
        let known = KnownNames::new(analysis.rules().set());
        let opened = analysis.log().opened()?;
        let (truth, warnings) = labels.of(opened, analysis.found(), &map, &known).map_err(argument)?;
        let meta = analysis.meta().clone();
        let rows = score::score(&truth, analysis.found(), Stage::Relabeled, &meta).map_err(argument)?;
        let score = score::Score::new(Stage::Relabeled, rows).or_nothing().map_err(argument)?;
        Ok(Self { scores: [score], meta, warnings })
    }

    /// The score as JSON, schema `teachtree.score/1` (docs/formats.md).
    pub fn json(&self) -> String {
        score::json(&self.scores, &self.meta)
    }

    /// Confusions and boundary errors as a picture, SVG.
    pub fn svg(&self) -> String {
        let [score] = &self.scores;
        report::score::picture(score, &self.meta)
    }

    /// Warnings about the labels: intervals with two labels that differ, rows that are frames of a video.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }
}

impl fmt::Display for Score {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&report::score::text(&self.scores, &self.meta))
    }
}

/// What the other crates of the workspace ask of [`Labels`]; no part of the public interface.
#[doc(hidden)]
pub trait LabelsInternals: Sized {
    /// The map of names.
    fn names(&self) -> Result<NameMap, InputError>;
    /// The truth of a recording, and warnings about the labels; `map` is that of [`names`](Self::names).
    fn of(
        &self,
        opened: &OpenedLog,
        analysis: &AnalysisResult,
        map: &NameMap,
        known: &KnownNames,
    ) -> Result<(Truth, Vec<String>), InputError>;
    /// The truth of a recording in the names of its labels, which no rules need to have, and warnings about the labels; `only` is the track of labels that
    /// name none.
    fn of_any_names(
        &self,
        opened: &OpenedLog,
        only: Option<TrackId>,
        map: &NameMap,
    ) -> Result<(Truth, Vec<String>), InputError>;
}

impl LabelsInternals for Labels {
    fn names(&self) -> Result<NameMap, InputError> {
        let Some(map) = self.map.as_deref() else { return Ok(NameMap::default()) };
        let path = Path::new(map);
        if path.extension().is_some_and(|ending| ending == "yaml" || ending == "yml") {
            NameMap::read(&text::read(path, MAX_TEXT)?, map)
        } else {
            NameMap::of_pairs(map)
        }
    }

    fn of(
        &self,
        opened: &OpenedLog,
        analysis: &AnalysisResult,
        map: &NameMap,
        known: &KnownNames,
    ) -> Result<(Truth, Vec<String>), InputError> {
        map.check(known, self.map.as_deref().unwrap_or_default())?;
        let Some(path) = &self.file else { return Ok((own_truth(opened, map)?, Vec::new())) };
        let labels = read_labels(&label_file(path, &opened.log)?, opened, map, known)?;
        let truth = Truth::of_labels(&labels, self.track.or(analysis.only()), map, known)?;
        let mut warnings = contradictions(&labels);
        warnings.extend(frames_of_video(&labels, &truth, opened, analysis));
        Ok((truth, warnings))
    }

    fn of_any_names(
        &self,
        opened: &OpenedLog,
        only: Option<TrackId>,
        map: &NameMap,
    ) -> Result<(Truth, Vec<String>), InputError> {
        let Some(path) = &self.file else { return Ok((own_truth(opened, map)?, Vec::new())) };
        let labels = read_labels(&label_file(path, &opened.log)?, opened, map, &KnownNames::default())?;
        let names = |kind: LabelKind| {
            let of_kind = labels.intervals.iter().filter(move |interval| interval.kind == kind);
            of_kind.map(|interval| interval.name.clone()).collect()
        };
        let known = KnownNames {
            primitives: names(LabelKind::Primitive),
            tasks: names(LabelKind::Task),
            ..KnownNames::default()
        };
        Ok((Truth::of_labels(&labels, self.track.or(only), map, &known)?, contradictions(&labels)))
    }
}

/// The warning about labels that count frames of a video, and were read as rows of the log.
fn frames_of_video(
    labels: &labels::Labels,
    truth: &Truth,
    opened: &OpenedLog,
    analysis: &AnalysisResult,
) -> Option<String> {
    let (first_s, last_s) = (*opened.row_time.first()?, *opened.row_time.last()?);
    if !labels.in_rows || last_s <= first_s {
        return None;
    }
    let rows_hz = (opened.row_time.len() - 1) as f64 / (last_s - first_s);
    let found = score::video_frames(truth, analysis, first_s, rows_hz)?;
    let percent = |share: f64| fixed(100.0 * share, 0);
    Some(format!(
        "{}: as rows of the log, {} % of the labeled time agrees with the analysis; as frames of a video at {} Hz, {} %; give the labels in seconds, or in rows of the log",
        labels.file,
        percent(found.as_rows),
        fixed(found.rate_hz, 0),
        percent(found.as_frames)
    ))
}

/// The warning about labels that differ at one time.
fn contradictions(labels: &labels::Labels) -> Vec<String> {
    if labels.contradicted_s > 0.0 {
        let time = fixed(labels.contradicted_s, 3);
        return vec![format!("{}: {time} s have two labels that differ; they are not scored", labels.file)];
    }
    Vec::new()
}
