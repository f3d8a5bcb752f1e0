//! Audits recordings by their raw columns, without rules: stamps, missing frames, rests, spikes, and frozen cameras.
//!
//! Neither the meaning nor the units of the columns are known. A finding is therefore one that holds for columns of any kind: a sample that is
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

/// Maximum distance of a finding from a recording on the same clock, s: rows before and after the analyzed ones.
const CLOCK: f64 = 1.0;

/// The metadata of an episode in a data set.
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
    let (mut findings, mut unchecked) = (of_columns(log, declared, motion.as_ref()), unchecked(log));
    match &motion {
        Some(motion) => findings.extend(motion.rests([start_s, end_s], rest_s)),
        None => unchecked.push("rests: no column changes as a measurement does".into()),
    }
    findings.sort_by_key(|finding| finding.kind);
    (Facts::of_signals([start_s, end_s], findings), unchecked)
}

/// The findings in the columns of a recording that rules also run on, and the checks that were left out. Its rests are judged by its channels.
///
/// `zero_s` is what the stamps show at the zero of the rules, s; `None` if they are on different clocks. A finding has no span if it would lie outside of the
/// recording, `span_s`.
pub fn findings(
    log: &RawLog,
    declared: &EpisodeDeclaration,
    zero_s: Option<f64>,
    span_s: [f64; 2],
) -> (Vec<Finding>, Vec<String>) {
    let on_time = |[start, end]: [f64; 2]| {
        let zero_s = zero_s?;
        let span = [start - zero_s, end - zero_s];
        (span[0] > span_s[0] - CLOCK && span[1] < span_s[1] + CLOCK).then_some(span)
    };
    let found = of_columns(log, declared, rests::Motion::of(log).as_ref()).into_iter();
    (found.map(|it| Finding { span_s: it.span_s.and_then(on_time), ..it }).collect(), unchecked(log))
}

/// All findings but rests.
fn of_columns(log: &RawLog, declared: &EpisodeDeclaration, motion: Option<&rests::Motion>) -> Vec<Finding> {
    let missing = log.missing.iter().map(|message| Finding::new(FindingKind::CutOff, message.clone()));
    let mut findings: Vec<Finding> = missing.collect();
    for table in &log.tables {
        findings.extend(stamps::findings(table, declared));
        findings.extend(spikes::findings(table));
        findings.extend(cameras::frozen(table, motion));
    }
    findings.extend(cameras::short_videos(log, declared));
    findings
}

/// The tables that are not checked, with the reason.
fn unchecked(log: &RawLog) -> Vec<String> {
    let mut sentences: Vec<String> = log.refused.iter().map(|(name, why)| format!("{name}: {why}")).collect();
    for table in log.tables.iter().filter(|table| table.stamps_s.is_empty()) {
        let name = if table.name.is_empty() { "the table" } else { &table.name };
        sentences.push(format!("{name}: no column has numeric stamps, which the search for gaps and rests requires"));
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

/// A number with up to four decimals.
fn short(value: f64) -> ShortNumber {
    ShortNumber((value * 1e4).round() / 1e4)
}

/// `1 frame is`, `3 frames are`.
fn frames_are(count: u64) -> String {
    if count == 1 { "1 frame is".into() } else { format!("{count} frames are") }
}
