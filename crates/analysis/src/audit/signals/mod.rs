//! Audits recordings by their raw columns, without rules: stamps, missing frames, rests, spikes, and cameras whose picture stays the same.
//!
//! Nothing is known of the columns, neither their meaning nor their units. A finding is therefore one that holds for columns of any kind: a sample that is
//! far away from all others and from its neighbors, or a column that stays within its own noise.

mod cameras;
mod rests;
mod samples;
mod spikes;
mod stamps;

pub use rests::rests;

use super::{Facts, Finding, FindingKind};
use teachtree_base::short_number::ShortNumber;
use teachtree_frames::raw_log::{RawLog, RawTable};

/// What a data set says of an episode beside its rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EpisodeDeclaration {
    /// Frames per second.
    pub fps: Option<f64>,
    /// Number of frames.
    pub frames: Option<usize>,
    /// The number of frames that the video of each camera has for the episode.
    pub videos: Vec<(String, u64)>,
}

/// The facts of a recording, and the checks that were left out. Rests count from `rest_s` on, s.
pub fn facts(log: &RawLog, declared: &EpisodeDeclaration, rest_s: f64) -> (Facts, Vec<String>) {
    let stamps = || log.tables.iter().flat_map(|table| table.stamps_s.iter().copied());
    let (start_s, end_s) = stamps().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), at| (a.min(at), b.max(at)));
    let (start_s, end_s) = if start_s <= end_s { (start_s, end_s) } else { (0.0, 0.0) };
    let motion = rests::Motion::of(log);
    let mut findings = Vec::new();
    findings.extend(log.missing.iter().map(|message| Finding::new(FindingKind::CutOff, message.clone())));
    findings.extend(motion.as_ref().map_or(Vec::new(), |motion| motion.rests([start_s, end_s], rest_s)));
    for table in &log.tables {
        findings.extend(stamps::findings(table, declared));
        findings.extend(spikes::findings(table));
        findings.extend(cameras::frozen(table, motion.as_ref()));
    }
    findings.extend(cameras::short_videos(log, declared));
    findings.sort_by_key(|finding| finding.kind);
    (Facts::of_signals([start_s, end_s], findings), unchecked(log, motion.is_some()))
}

/// The checks that were left out, with the reason.
fn unchecked(log: &RawLog, has_motion: bool) -> Vec<String> {
    let mut sentences: Vec<String> = log.refused.iter().map(|(name, why)| format!("{name}: {why}")).collect();
    for table in log.tables.iter().filter(|table| table.stamps_s.is_empty()) {
        let name = if table.name.is_empty() { "the table" } else { &table.name };
        sentences.push(format!("{name}: no column has stamps in numbers, by which gaps and rests are found"));
    }
    if !has_motion {
        sentences.push("rests: no column changes as one that is measured does".into());
    }
    sentences
}

impl Finding {
    /// A finding about a column, with the number that it is about.
    fn of_column(kind: FindingKind, column: String, span_s: Option<[f64; 2]>, value: f64, message: String) -> Self {
        Self { column: Some(column), span_s, value: Some(value), ..Self::new(kind, message) }
    }
}

/// The name of a table in findings about its stamps.
fn stamps_of(table: &RawTable) -> String {
    if table.name.is_empty() { "time".into() } else { table.name.clone() }
}

/// A number with up to four digits behind the point.
fn short(value: f64) -> ShortNumber {
    ShortNumber((value * 1e4).round() / 1e4)
}

/// `1 frame is`, `3 frames are`.
fn frames_are(count: u64) -> String {
    if count == 1 { "1 frame is".into() } else { format!("{count} frames are") }
}
