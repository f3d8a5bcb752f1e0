//! A log that is still being written, as JSON lines: segments are reported as they close.
//!
//! What the rules read of a frame depends on frames before and after it (targets, velocities, stuck sensors), so the log so far is analyzed
//! again and again: each time that it has grown by [`LOOK_SECS`] and by a share of its length, which bounds the work. A segment is reported
//! when it has been closed for [`SURE_SECS`]. The analysis of the whole log at the end is the one that counts.

use super::analysis::Analysis;
use super::error::Error;
use super::log::Log;
use super::project_file::ProjectSettings;
use super::rules::{Rules, RulesOptions};
use super::tracks::Segment;
use crate::ErrorInternals;
use std::collections::BTreeMap;
use std::io::BufRead;
use teachtree_analysis::TrackId;
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_base::scene::Scene;
use teachtree_base::units::compound;
use teachtree_frames::OpenRequest;
use teachtree_frames::bind::{BindingFile, Pattern, PlaceholderValues};
use teachtree_logs::read::element_names::ElementNames;
use teachtree_logs::read::formats::jsonl::{Line, Lines, push, source};
use teachtree_logs::read::memory_table::{Cells, InMemoryTable};
use teachtree_logs::read::table::Source;

/// The log is analyzed when it has grown by this much, s.
const LOOK_SECS: f64 = 0.25;
/// And by a share of one in this many frames.
const LOOK_SHARE: usize = 32;
/// Minimum time between the end of a reported segment and the end of the log, s: longer than the look-ahead of the rules.
const SURE_SECS: f64 = 1.0;

/// A segment of a log that is still being written, before relabeling.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ClosedSegment {
    /// Whose it is.
    pub track: TrackId,
    /// The primitive.
    pub primitive: String,
    /// The object that it is about, as far as the log goes.
    pub object: Option<String>,
    /// The body that the object is in or against.
    pub partner: Option<String>,
    /// When it starts, s: not before the end of the one that was reported before.
    pub start_s: f64,
    /// When it ends, s.
    pub end_s: f64,
}

/// The callback for closed segments.
pub type OnSegment<'a> = &'a mut dyn FnMut(&ClosedSegment) -> Result<(), Error>;

/// Reads a log from its lines to the end, and reports its segments; returns the analysis of the whole log.
///
/// # Errors
/// [`ErrorKind::Format`], when a line is not a JSON object; as [`Rules::analyze`]; what `on_segment` returns.
pub fn follow(
    lines: impl BufRead,
    request: &OpenRequest,
    settings: &ProjectSettings,
    rules: &RulesOptions,
    on_segment: OnSegment,
) -> Result<Analysis, Error> {
    let format = |error: InputError| Error::new(error, ErrorKind::Format);
    // The rules are the same each time; they are known when the binding, if there is one, has named its hand model.
    let mut loaded: Option<Rules> = None;
    let mut analyze = |source: Source| -> Result<Analysis, Error> {
        let log = Log::open_source_with(source, request, settings)?;
        let rules = match &loaded {
            Some(rules) => rules,
            None => &*loaded.insert(rules.clone().for_log(&log)?),
        };
        rules.analyze(&log)
    };
    let time = match &request.binding {
        Some(binding) => {
            BindingFile::read(binding).map_err(|error| Error::new(error, ErrorKind::Binding))?.binding.time
        }
        None => Pattern::parse("time").map_err(|message| format(InputError::new("time", message)))?,
    };
    let source = read(lines, &time, &mut analyze, on_segment)?;
    analyze(source)
}

fn read(
    bytes: impl BufRead,
    time: &Pattern,
    analyze: &mut dyn FnMut(Source) -> Result<Analysis, Error>,
    on_segment: OnSegment,
) -> Result<Source, Error> {
    let format = |error: InputError| Error::new(error, ErrorKind::Format);
    let mut lines = Lines::new(bytes, "standard input".into());
    let mut log = GrowingLog { rows: InMemoryTable::new("standard input"), scene: None };
    let mut names = ElementNames::default();
    let mut reported = ReportedTimes::default();
    let (mut looked_rows, mut looked_s) = (0, f64::NEG_INFINITY);
    let to_seconds = time.unit.as_deref().and_then(|unit| compound(unit).ok()).map_or(1.0, |(factor, _)| factor);
    let mut cut = None;
    while let Some(line) = lines.line().map_err(format)? {
        let row = match line {
            Line::Scene(scene) => {
                log.scene = Some(*scene);
                continue;
            }
            Line::Row(row) => row,
            Line::Truncated(message) => {
                cut = Some(message);
                continue;
            }
        };
        push(&row, &mut log.rows).map_err(|message| format(lines.error(message)))?;
        names.put(&mut log.rows, |_| true).map_err(format)?;
        let now = log.now(&time.name.fill(PlaceholderValues::default())) * to_seconds;
        if now - looked_s >= LOOK_SECS && log.rows.rows() >= looked_rows + looked_rows / LOOK_SHARE + 2 {
            (looked_rows, looked_s) = (log.rows.rows(), now);
            // A log that cannot be analyzed yet may become valid; the end decides.
            if let Ok(analysis) = analyze(log.clone().source(None)) {
                reported.report(&analysis, on_segment)?;
            }
        }
    }
    Ok(log.source(cut))
}

/// A log so far.
#[derive(Clone)]
struct GrowingLog {
    rows: InMemoryTable,
    scene: Option<Scene>,
}

impl GrowingLog {
    /// The stamp of the last row in the column of this name.
    fn now(&self, time: &str) -> f64 {
        match self.rows.columns().get(time) {
            Some(Cells::Numbers(stamps)) => stamps.last().copied().unwrap_or(f64::NAN),
            _ => f64::NAN,
        }
    }

    fn source(self, cut: Option<String>) -> Source {
        source(self.rows, self.scene, cut)
    }
}

/// Until when each track was reported, s.
#[derive(Default)]
struct ReportedTimes {
    until_s: BTreeMap<TrackId, f64>,
}

impl ReportedTimes {
    fn report(&mut self, analysis: &Analysis, on_segment: OnSegment) -> Result<(), Error> {
        let mut new: Vec<ClosedSegment> = vec![];
        for track in analysis.tracks() {
            let until_s = self.until_s.entry(track.who()).or_insert(f64::NEG_INFINITY);
            let segments: Vec<Segment> = track.raw_segments().collect();
            // The last segment of a track is still going on.
            let closed = segments.split_last().map_or(&[][..], |(_, closed)| closed);
            for segment in closed {
                if segment.end_s() > *until_s && segment.end_s() <= analysis.end_s() - SURE_SECS {
                    new.push(ClosedSegment {
                        track: track.who(),
                        primitive: segment.primitive().to_string(),
                        object: segment.object().map(str::to_string),
                        partner: segment.partner().map(str::to_string),
                        start_s: segment.start_s().max(*until_s),
                        end_s: segment.end_s(),
                    });
                    *until_s = segment.end_s();
                }
            }
        }
        new.sort_by(|a, b| a.end_s.total_cmp(&b.end_s));
        new.iter().try_for_each(on_segment)
    }
}
