//! The events of a live log.

use crate::{Composite, Segment, Task};
use std::fmt;
use teachtree_analysis::confidence::percent;
use teachtree_analysis::json;
use teachtree_analysis::{CompositeSpan, Segment as Stretch, TaskSpan, TrackId};
use teachtree_logs::issue::Issue;
use teachtree_logs::read::date_time;

/// Nanoseconds in a second.
const NANOS: i64 = 1_000_000_000;

/// Something new about a live log.
///
/// - `label`: the primitive of a track at the newest frame, if the log ended there.
/// - `segment`: a segment that has closed, as the trees returned it; `is_final`: after relabeling, as in the analysis of the whole log.
/// - `task`: a task that has closed; `is_final`: as in the analysis of the whole log.
/// - `composite`: a task that is made of tasks, as in the analysis of the whole log.
/// - `issue`: a problem of the log.
/// - `clock`: the time of 0 s, for a log whose messages have the time of day.
#[derive(Clone, Debug, PartialEq)]
pub struct LiveEvent {
    sequence: u64,
    inner: Inner,
}

#[derive(Clone, Debug, PartialEq)]
pub enum Inner {
    Label { who: TrackId, primitive: Option<String>, time_s: f64, confidence: Option<f64> },
    Segment { who: TrackId, segment: Stretch, is_final: bool },
    Task { who: TrackId, task: TaskSpan, is_final: bool },
    Composite { who: TrackId, found: CompositeSpan },
    Issue(Issue),
    Clock { origin_ns: i64 },
}

impl LiveEvent {
    pub(super) const fn new(sequence: u64, inner: Inner) -> Self {
        Self { sequence, inner }
    }

    /// The number of the event: 0, 1, 2, …
    pub const fn sequence(&self) -> u64 {
        self.sequence
    }

    /// Returns the kind of the event: `label`, `segment`, `task`, `composite`, `issue`, `clock`.
    pub const fn name(&self) -> &'static str {
        match &self.inner {
            Inner::Label { .. } => "label",
            Inner::Segment { .. } => "segment",
            Inner::Task { .. } => "task",
            Inner::Composite { .. } => "composite",
            Inner::Issue(_) => "issue",
            Inner::Clock { .. } => "clock",
        }
    }

    /// Whether no later row can change it.
    pub const fn is_final(&self) -> bool {
        match &self.inner {
            Inner::Label { .. } => false,
            Inner::Segment { is_final, .. } | Inner::Task { is_final, .. } => *is_final,
            Inner::Composite { .. } | Inner::Issue(_) | Inner::Clock { .. } => true,
        }
    }

    /// Returns the track of a `label`, the primitive (`None`: no coordination of both hands), and the stamp of the frame, s.
    pub fn label(&self) -> Option<(TrackId, Option<&str>, f64)> {
        match &self.inner {
            Inner::Label { who, primitive, time_s, .. } => Some((*who, primitive.as_deref(), *time_s)),
            _ => None,
        }
    }

    /// Returns the confidence of a `label`, if [`Live::with_confidence`](crate::Live::with_confidence) was called: the share of labels
    /// that had stood as long and were confirmed by the final segments of the measured recordings, at most 0.88 (docs/live.md).
    pub const fn confidence(&self) -> Option<f64> {
        match &self.inner {
            Inner::Label { confidence, .. } => *confidence,
            _ => None,
        }
    }

    /// Returns the segment, without indices of frames and rows.
    pub fn segment(&self) -> Option<Segment<'_>> {
        match &self.inner {
            Inner::Segment { who, segment, .. } => Some(Segment::of(*who, segment)),
            _ => None,
        }
    }

    /// Returns the task, without indices of frames and rows.
    pub fn task(&self) -> Option<Task<'_>> {
        match &self.inner {
            Inner::Task { who, task, .. } => Some(Task::of(*who, task)),
            _ => None,
        }
    }

    /// Returns the composite task, without indices of frames, rows and tasks.
    pub fn composite(&self) -> Option<Composite<'_>> {
        match &self.inner {
            Inner::Composite { who, found } => Some(Composite::of(*who, found)),
            _ => None,
        }
    }

    /// Returns the issue.
    pub const fn issue(&self) -> Option<&Issue> {
        match &self.inner {
            Inner::Issue(issue) => Some(issue),
            _ => None,
        }
    }

    /// Returns the time of 0 s of a `clock`, ns since 1970.
    pub const fn origin_ns(&self) -> Option<i64> {
        match &self.inner {
            Inner::Clock { origin_ns } => Some(*origin_ns),
            _ => None,
        }
    }

    /// Returns the event as JSON on one line, schema `teachtree.live/1` (docs/formats.md).
    pub fn json(&self) -> String {
        let (sequence, is_final) = (self.sequence, self.is_final());
        match &self.inner {
            Inner::Label { who, primitive, time_s, confidence } => {
                json::live_label(sequence, *who, primitive.as_deref(), *time_s, *confidence)
            }
            Inner::Segment { who, segment, .. } => json::live_segment(sequence, *who, segment, is_final),
            Inner::Task { who, task, .. } => json::live_task(sequence, *who, task, is_final),
            Inner::Composite { who, found } => json::live_composite(sequence, *who, found),
            Inner::Issue(issue) => json::live_issue(sequence, issue),
            Inner::Clock { origin_ns } => json::live_clock(sequence, *origin_ns),
        }
    }
}

impl fmt::Display for LiveEvent {
    /// One line: `12.340 s  right Grasp`, with its confidence `12.340 s  right Grasp  74 %`; `right Grasp cube, 1.250 – 1.500 s`; the task; the issue.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.inner {
            Inner::Label { who, primitive, time_s, confidence } => {
                write!(f, "{time_s:.3} s  {who} {}", primitive.as_deref().unwrap_or("–"))?;
                confidence.map_or(Ok(()), |share| write!(f, "  {}", percent(share)))
            }
            Inner::Segment { who, segment, .. } => write!(f, "{}", Segment::of(*who, segment)),
            Inner::Task { who, task, .. } => write!(f, "{}", Task::of(*who, task)),
            Inner::Composite { who, found } => write!(
                f,
                "{who} {}, {:.3} – {:.3} s, {}",
                found.task,
                found.start_s,
                found.end_s,
                teachtree_report::parts(found)
            ),
            Inner::Issue(Issue { kind, channel, message, .. }) if channel.is_empty() => write!(f, "{kind}: {message}"),
            Inner::Issue(Issue { kind, channel, message, .. }) => write!(f, "{kind} {channel}: {message}"),
            Inner::Clock { origin_ns } => {
                let (seconds, rest) = (origin_ns.div_euclid(NANOS), origin_ns.rem_euclid(NANOS));
                write!(f, "0 s is {}.{rest:09}", date_time::written(seconds as f64))
            }
        }
    }
}
