//! Frames and ids in, times and names out: the last step of an analysis, after which it needs no rules.

use super::labeled_span::{LabeledSpan, within};
use super::measures::{self, Measures};
use super::relabeling_rounds::MAX_ROUNDS;
use super::subject::HandledObjects;
use super::tasks::NamedSpan;
use super::{Segment, TaskSpan, TrackId, UNKNOWN};
use std::collections::BTreeMap;
use std::ops::Range;
use teachtree_base::hands::Side;
use teachtree_base::meaning::Meaning;
use teachtree_frames::frames::Frames;
use teachtree_language::rules::{Rules, TaskId};
use teachtree_logs::issue::{Issue, IssueKind};

/// The source of times and names.
pub(super) struct Naming<'a> {
    /// The names.
    pub rules: &'a Rules,
    /// The times.
    pub frames: &'a Frames,
    /// The objects that the hands handle.
    pub handling: &'a HandledObjects<'a>,
}

impl Naming<'_> {
    /// Returns the start of the recording, s.
    pub fn start_s(&self) -> f64 {
        self.frames.time.first().copied().unwrap_or_default()
    }

    /// Returns the end of the recording, s.
    pub fn end_s(&self) -> f64 {
        self.frames.len.checked_sub(1).map_or(0.0, |last| self.frames.end_of(last))
    }

    /// Returns the start of a frame of a stretch, s; for the end of the stretch, the end of its last frame.
    fn time_s(&self, frame: usize, stretch: &Range<usize>) -> f64 {
        match self.frames.time.get(frame) {
            Some(time) if frame < stretch.end => *time,
            _ => frame.checked_sub(1).map_or(0.0, |last| self.frames.end_of(last)),
        }
    }

    /// Returns the start and end time (s) of an interval.
    pub fn span_s(&self, stretch: &Range<usize>) -> (f64, f64) {
        (self.time_s(stretch.start, stretch), self.time_s(stretch.end, stretch))
    }

    /// A segment of a track in a stretch, with what it was among the raw pieces.
    pub fn segment(&self, who: TrackId, piece: &LabeledSpan, raw: &[LabeledSpan], stretch: &Range<usize>) -> Segment {
        let name = |piece: &LabeledSpan| self.rules.label_name(piece.label);
        let by = piece.by.iter().filter_map(|rule| self.rules.relabels.get(*rule)).map(|rule| rule.text.clone());
        let was = if piece.by.is_empty() { &[][..] } else { within(raw, &piece.frames) };
        Segment {
            primitive: name(piece),
            does: self.rules.meaning_for(piece.label, who.side()),
            subject: self.handling.of_segment(who, self.opens(who, piece), &piece.frames, stretch),
            rows: self.frames.rows(&piece.frames),
            frames: piece.frames.clone(),
            start_s: self.time_s(piece.frames.start, stretch),
            end_s: self.time_s(piece.frames.end, stretch),
            was: was.iter().map(name).collect(),
            by: by.collect(),
            confidence: None,
        }
    }

    /// Whether a hand lets go in a segment.
    fn opens(&self, who: TrackId, piece: &LabeledSpan) -> bool {
        self.rules.meaning_for(piece.label, who.side()) == Some(Meaning::Open)
    }

    /// Whether the last action of segments on an object leads to a release that is not among them. A hand that then moves freely may still hold the object.
    fn is_unfinished(&self, segments: &[Segment]) -> bool {
        let is_attached = |object: &String| self.frames.attached.contains(object);
        let is_free = |segment: &&Segment| segment.does.is_some_and(Meaning::is_free);
        segments.iter().rev().find(|segment| !is_free(segment)).is_some_and(|last| {
            last.does != Some(Meaning::Open) && !last.subject.object.as_ref().is_some_and(is_attached)
        })
    }

    /// A task of a hand in a stretch.
    pub fn task(&self, side: Side, named: &NamedSpan, raw: &[LabeledSpan], stretch: &Range<usize>) -> TaskSpan {
        let name = |id: TaskId| self.rules.tasks.get(id.index()).map_or(UNKNOWN, |task| &task.name).to_string();
        let frames = named.pieces.first().map_or(0, |piece| piece.frames.start)
            ..named.pieces.last().map_or(0, |piece| piece.frames.end);
        let task = named.task.and_then(|id| self.rules.tasks.get(id.index()));
        let keys = task.map_or(&[][..], |task| &task.keys);
        let is_key = |piece: &LabeledSpan| keys.iter().any(|key| key.label.covers(piece.label));
        let opens = |piece: &LabeledSpan| self.opens(TrackId::Hand(side), piece);
        let segments: Vec<Segment> =
            named.pieces.iter().map(|piece| self.segment(TrackId::Hand(side), piece, raw, stretch)).collect();
        TaskSpan {
            subject: self.handling.of_task(side, &named.pieces, is_key, opens, stretch),
            rows: self.frames.rows(&frames),
            task: named.task.map_or_else(|| UNKNOWN.to_string(), name),
            failure: task.is_some_and(|task| task.failure),
            attempt: 1,
            start_s: self.time_s(frames.start, stretch),
            end_s: self.time_s(frames.end, stretch),
            frames,
            secondary: named.secondary.iter().map(|id| name(*id)).collect(),
            open_start: named.span.open_start,
            open_end: named.span.open_end && self.is_unfinished(&segments),
            lacks_last: named.span.open_end,
            segments,
            stability: None,
        }
    }

    /// Keys that ask for more than the recording has, by hand and channel.
    pub fn unsupported_keys(&self, measures: &BTreeMap<Side, Measures>) -> Vec<Issue> {
        let mut issues = Vec::new();
        for (side, measures) in measures {
            for channel in [measures::POSITION, measures::SPIN] {
                let tasks: Vec<&str> = (self.rules.tasks.iter())
                    .filter(|task| task.keys.iter().any(|key| measures::asks(key, channel)))
                    .map(|task| task.name.as_str())
                    .collect();
                if !tasks.is_empty() && !measures.has(channel) {
                    issues.push(Issue {
                        kind: IssueKind::MISSING_CHANNEL,
                        start_s: self.start_s(),
                        end_s: self.end_s(),
                        channel: format!("{side}.{channel}"),
                        message: format!(
                            "the recording has no `{channel}`, so keys with a distance or an angle of the target do not hold: {}",
                            tasks.join(", ")
                        ),
                    });
                }
            }
        }
        issues
    }

    /// Rules that were still changing labels when relabeling was stopped.
    pub fn undone(&self, rules: &[usize], stretch: &Range<usize>) -> Option<Issue> {
        let texts =
            rules.iter().filter_map(|rule| self.rules.relabels.get(*rule)).map(|rule| format!("`{}`", rule.text));
        let texts: Vec<String> = texts.collect();
        (!texts.is_empty()).then(|| Issue {
            kind: IssueKind::RELABELING_STOPPED,
            start_s: self.time_s(stretch.start, stretch),
            end_s: self.time_s(stretch.end, stretch),
            channel: String::new(),
            message: format!(
                "relabeling was stopped after {MAX_ROUNDS} rounds, when these rules still changed labels: {}",
                texts.join(", ")
            ),
        })
    }
}
