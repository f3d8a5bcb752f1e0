//! Cuts recordings into episodes: by the tasks that were found in them, or from rest to rest.

use crate::{Analysis, TaskSpan, UNKNOWN};

/// The shortest episode between two rests, s.
const SHORTEST_S: f64 = 1.0;

/// A part of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct EpisodeSpan {
    /// The start, s.
    pub start_s: f64,
    /// Until when, s.
    pub end_s: f64,
    /// Whether its task succeeded; `None` where that is not known.
    pub is_success: Option<bool>,
    /// The time of its success, s.
    pub succeeded_s: f64,
}

impl EpisodeSpan {
    /// An episode without a known task, from its start to its end, s.
    pub fn new([start_s, end_s]: [f64; 2]) -> Self {
        Self { start_s, end_s, is_success: None, succeeded_s: end_s }
    }
}

/// The episodes between rests, which are in order, in a recording from `start_s` to `end_s`. Each begins and ends up to `margin_s` within a rest.
pub fn between_rests(rests: &[[f64; 2]], [start_s, end_s]: [f64; 2], margin_s: f64) -> Vec<EpisodeSpan> {
    let starts = std::iter::once(start_s).chain(rests.iter().map(|[_, end]| *end));
    let ends = rests.iter().map(|[start, _]| *start).chain([end_s]);
    let moving = starts.zip(ends).filter(|(from, to)| to - from >= SHORTEST_S);
    let spans: Vec<EpisodeSpan> = moving.map(|(from, to)| EpisodeSpan::new([from, to])).collect();
    with_margins(spans, [start_s, end_s], margin_s)
}

/// The episodes of tasks. Tasks of two hands that overlap are one episode; it succeeds if none of them is a failure.
pub fn of_tasks(found: &Analysis, margin_s: f64) -> Vec<EpisodeSpan> {
    let is_known = |task: &&TaskSpan| task.task != UNKNOWN;
    let mut tasks: Vec<&TaskSpan> = found.tracks.iter().flat_map(|track| &track.tasks).filter(is_known).collect();
    tasks.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
    let mut spans: Vec<EpisodeSpan> = Vec::new();
    for task in tasks {
        match spans.last_mut().filter(|last| task.start_s < last.end_s) {
            Some(last) => {
                last.end_s = last.end_s.max(task.end_s);
                last.succeeded_s = last.end_s;
                last.is_success = last.is_success.map(|is_success| is_success && !task.failure);
            }
            None => spans
                .push(EpisodeSpan { is_success: Some(!task.failure), ..EpisodeSpan::new([task.start_s, task.end_s]) }),
        }
    }
    with_margins(spans, [found.start_s, found.end_s], margin_s)
}

/// Adds time before and after each part, at most half of that between two of them.
fn with_margins(mut spans: Vec<EpisodeSpan>, [start_s, end_s]: [f64; 2], margin_s: f64) -> Vec<EpisodeSpan> {
    let ends: Vec<f64> = spans.iter().map(|span| span.end_s).collect();
    let starts: Vec<f64> = spans.iter().map(|span| span.start_s).collect();
    for (at, span) in spans.iter_mut().enumerate() {
        let middle = |end: Option<&f64>, start: Option<&f64>| end.zip(start).map(|(end, start)| 0.5 * (end + start));
        let earliest = middle(at.checked_sub(1).and_then(|before| ends.get(before)), starts.get(at));
        let latest = middle(ends.get(at), starts.get(at + 1));
        span.start_s = (span.start_s - margin_s).max(earliest.unwrap_or(start_s)).max(start_s);
        span.end_s = (span.end_s + margin_s).min(latest.unwrap_or(end_s)).min(end_s);
    }
    spans
}
