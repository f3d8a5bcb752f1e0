//! The outcome of a recording: whether it is a success, a failure, or unknown, with the reasons.
//!
//! - A success contains a named task that is not a failure, and each failure was mended: a later task brought the same object to the same target.
//! - A failure contains a failed task that was not mended, or lacks an expected task.
//! - If fields of the log say that the recording succeeded, its failed tasks and a task that is cut off do not count against it.
//! - The outcome is unknown if the only failures are falls from opened jaws, which may be intended; if the recording has no named task; if its end or a gap cuts off
//!   a task that no later one completes; if the log lacks the quantities that detect a missing task; if its issues show that it is misread; or if neither the rules
//!   nor an expectation could show a failure.
//!
//! A task that is made of tasks counts instead of its parts.

mod attempts;
mod expected;
mod misread;
mod unmeasured;

pub use attempts::number as number_attempts;
pub use expected::ExpectedTasks;
pub use unmeasured::{Undetectable, UnmeasuredTask, unmeasured};

use super::{Analysis, Fall, Subject, TaskSpan, Track, TrackId, UNKNOWN, UntouchedMotion};
use attempts::repeats;
use serde::Serialize;
use std::fmt;
use std::ops::Range;

/// Whether a recording is a success.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum OutcomeKind {
    /// Its tasks succeeded.
    Success,
    /// A task failed, or an expected one is missing.
    Failure,
    /// The recording does not show it.
    Unknown,
}

impl OutcomeKind {
    /// `success`, as in outputs.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Success => "success",
            Self::Failure => "failure",
            Self::Unknown => "unknown",
        }
    }
}

impl fmt::Display for OutcomeKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The kind of a reason.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ReasonKind {
    /// A task succeeded.
    Succeeded,
    /// A task failed, and a later attempt succeeded.
    Mended,
    /// A task failed or is cut off, and a field of the log says that the recording succeeded.
    Declared,
    /// A task failed, and no later attempt succeeded.
    Failed,
    /// The jaws let an object fall, which may be intended.
    LetFall,
    /// The recording or a gap of it ends within a task, and no later attempt succeeded.
    CutOff,
    /// An expected task is missing.
    Missing,
    /// An expected task is missing, and the recording cannot show it.
    NotMeasured,
    /// No task has a name.
    NoTask,
    /// The rules define no failure, and no task is expected.
    NoCriterion,
    /// A failure that the recording cannot show.
    UnseenFailure,
    /// An issue shows that the log is read wrongly.
    Misread,
}

/// Why a recording has its outcome.
#[derive(Clone, Debug, PartialEq)]
pub struct OutcomeReason {
    /// The kind of the reason.
    pub kind: ReasonKind,
    /// The hand; `None` where it is about the whole recording.
    pub track: Option<TrackId>,
    /// The task that it is about.
    pub task: Option<String>,
    /// The object and the target of the task.
    pub subject: Subject,
    /// Start and end, s; `None` for a reason about the whole recording.
    pub span_s: Option<[f64; 2]>,
    /// In words.
    pub message: String,
}

/// The outcome of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// Whether it is a success.
    pub result: OutcomeKind,
    /// The most attempts at one object and target; 0 without a task.
    pub attempts: usize,
    /// The tasks that the recording should contain; `None` where nothing is expected.
    pub expected: Option<String>,
    /// Whether it contains them; `None` where nothing is expected.
    pub is_as_expected: Option<bool>,
    /// The reasons of the result, in order of time.
    pub reasons: Vec<OutcomeReason>,
}

/// The most reasons of the sentence, and the most that it names in addition.
const MOST: usize = 3;

/// An object that stays farther from the fingertips is moved by something else, m.
const FAR_M: f64 = 0.2;

/// How the reason of an unseen failure begins.
const CANNOT_SHOW: &str = "the log cannot show ";

impl Outcome {
    /// The outcome of an analyzed recording.
    pub fn new(found: &Analysis) -> Self {
        let results = results(found);
        let names: Vec<&str> = names(found);
        let missing = found.expected.missing(&names);
        let is_as_expected = missing.is_empty();
        let mut reasons: Vec<OutcomeReason> = results.iter().map(|result| result.reason(&results, found)).collect();
        reasons.extend(missing.into_iter().map(|missing| {
            let unmeasured = found.unmeasured.iter().find(|it| it.task == missing.name);
            let (kind, message) = match unmeasured {
                Some(it) => {
                    (ReasonKind::NotMeasured, format!("{}, which the log cannot show ({})", missing.message, it.reason))
                }
                None => (ReasonKind::Missing, missing.message),
            };
            OutcomeReason::of_recording(kind, Some(missing.name), message)
        }));
        let has = |kind: ReasonKind| reasons.iter().any(|reason| reason.kind == kind);
        let has_task = has(ReasonKind::Succeeded) || has(ReasonKind::Declared);
        let misread = misread::reasons(found, &results, !is_as_expected);
        let result = if !misread.is_empty() {
            OutcomeKind::Unknown
        } else if has(ReasonKind::Failed) || has(ReasonKind::Missing) {
            OutcomeKind::Failure
        } else if has(ReasonKind::NotMeasured)
            || has(ReasonKind::CutOff)
            || has(ReasonKind::LetFall)
            || !has_task
            || !found.has_criterion()
        {
            OutcomeKind::Unknown
        } else {
            OutcomeKind::Success
        };
        reasons.retain(|reason| reason.kind.supports(result));
        reasons.extend(misread);
        if result == OutcomeKind::Unknown && reasons.is_empty() {
            reasons.push(if has_task { no_criterion() } else { no_task(&found.untouched) });
        }
        reasons.extend(unseen_failures(found).filter(|_| result == OutcomeKind::Success));
        let tasks = found.tracks.iter().flat_map(|track| &track.tasks);
        Self {
            result,
            attempts: tasks.map(|task| task.attempt).max().unwrap_or(0),
            expected: (!found.expected.is_empty()).then(|| found.expected.to_string()),
            is_as_expected: (!found.expected.is_empty()).then_some(is_as_expected),
            reasons,
        }
    }

    /// One line: `success: right peg_in_hole peg (holder) 8.100 – 12.400 s, attempt 2`. It names all failures that the recording cannot show.
    pub fn sentence(&self) -> String {
        let (unseen, others): (Vec<&OutcomeReason>, Vec<&OutcomeReason>) =
            self.reasons.iter().partition(|reason| reason.kind == ReasonKind::UnseenFailure);
        let (shown, more) = others.split_at(MOST.min(others.len()));
        let mut parts: Vec<String> = shown.iter().map(|reason| reason.message.clone()).collect();
        if !unseen.is_empty() {
            let failures = unseen.iter().map(|reason| reason.message.trim_start_matches(CANNOT_SHOW));
            parts.push(format!("{CANNOT_SHOW}{}", failures.collect::<Vec<_>>().join(", ")));
        }
        if !more.is_empty() {
            let names: Vec<&str> = more.iter().map(|reason| reason.name()).collect();
            let what = if names.len() > MOST { "`analyze --format json` lists them".into() } else { names.join(", ") };
            parts.push(format!("{} more: {what}", more.len()));
        }
        format!("{}: {}", self.result, parts.join("; "))
    }
}

impl ReasonKind {
    /// `not_measured`, as in outputs.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Succeeded => "succeeded",
            Self::Mended => "mended",
            Self::Declared => "declared",
            Self::Failed => "failed",
            Self::LetFall => "let_fall",
            Self::CutOff => "cut_off",
            Self::Missing => "missing",
            Self::NotMeasured => "not_measured",
            Self::NoTask => "no_task",
            Self::NoCriterion => "no_criterion",
            Self::UnseenFailure => "unseen_failure",
            Self::Misread => "misread",
        }
    }

    /// Whether it is a reason of this result.
    fn supports(self, result: OutcomeKind) -> bool {
        match self {
            Self::Succeeded | Self::Mended | Self::Declared | Self::UnseenFailure => result == OutcomeKind::Success,
            Self::Failed | Self::Missing => result == OutcomeKind::Failure,
            Self::NotMeasured | Self::LetFall => result != OutcomeKind::Success,
            Self::NoTask | Self::NoCriterion | Self::Misread | Self::CutOff => result == OutcomeKind::Unknown,
        }
    }
}

impl OutcomeReason {
    /// What it is about: a task, or what its message begins with, such as an issue and its channel.
    fn name(&self) -> &str {
        self.task.as_deref().or_else(|| self.message.split(": ").next()).unwrap_or_default()
    }

    /// A reason that is about the whole recording.
    fn of_recording(kind: ReasonKind, task: Option<String>, message: String) -> Self {
        Self { kind, track: None, task, subject: Subject::default(), span_s: None, message }
    }
}

fn no_task(untouched: &[UntouchedMotion]) -> OutcomeReason {
    let motion = untouched.iter().map(|UntouchedMotion { object, way_m, span_s: [start_s, end_s], distance_m }| {
        let way = format!("; {object} moved {:.0} mm at {start_s:.3} – {end_s:.3} s, but no hand touched it", way_m * 1e3);
        match distance_m {
            // No size of the parts explains a motion far from the hands.
            Some(least) if *least > FAR_M => {
                format!("{way}: its surface in the scene stays {:.0} mm or more from the fingertips", least * 1e3)
            }
            Some(least) if *least > 0.0 => format!(
                "{way}: its surface in the scene stays {:.0} mm or more from the fingertips; write its `parts` in their true size",
                least * 1e3
            ),
            _ => format!("{way}; check its `parts` in the scene, and the contacts, forces or gripper of the hand"),
        }
    });
    let message = std::iter::once("no task has a name".to_string()).chain(motion).collect();
    OutcomeReason::of_recording(ReasonKind::NoTask, None, message)
}

fn no_criterion() -> OutcomeReason {
    let message = "the rules define no failure, and no task is expected";
    OutcomeReason::of_recording(ReasonKind::NoCriterion, None, message.into())
}

/// The failures that the recording cannot show.
fn unseen_failures(found: &Analysis) -> impl Iterator<Item = OutcomeReason> {
    found.unmeasured.iter().filter(|it| it.failure).map(|UnmeasuredTask { task, reason, .. }| {
        let message = format!("{CANNOT_SHOW}{task} ({reason})");
        OutcomeReason::of_recording(ReasonKind::UnseenFailure, Some(task.clone()), message)
    })
}

/// Returns the names of the successful tasks and composite tasks, in order of time. Parts of a failure do not count.
fn names(found: &Analysis) -> Vec<&str> {
    let mut names: Vec<(f64, &str)> = Vec::new();
    for track in &found.tracks {
        let is_part_of_failure = |at: usize| track.composites.iter().any(|it| it.failure && it.tasks.contains(&at));
        let tasks = track.tasks.iter().enumerate().filter(|(at, task)| task.is_success() && !is_part_of_failure(*at));
        names.extend(tasks.map(|(_, task)| (task.start_s, task.task.as_str())));
        names.extend(track.composites.iter().filter(|it| !it.failure).map(|it| (it.start_s, it.task.as_str())));
    }
    names.sort_by(|one, other| one.0.total_cmp(&other.0));
    names.into_iter().map(|(_, name)| name).collect()
}

/// The row after the last task that is a success, or after the last task of a recording that only its fields call a success; `None` unless the outcome is a
/// success.
pub(super) fn success_end(found: &Analysis) -> Option<usize> {
    let results = results(found);
    let succeeded = results.iter().filter(|result| !result.failure).map(|result| result.end_row).max();
    let end = succeeded.or_else(|| results.iter().map(|result| result.end_row).max());
    end.filter(|_| Outcome::new(found).result == OutcomeKind::Success)
}

/// A task, or a task that is made of tasks, as the outcome counts it.
struct TaskResult<'a> {
    who: TrackId,
    task: &'a str,
    subject: &'a Subject,
    failure: bool,
    /// What cuts it off while its object is handled.
    cut_off: Option<&'static str>,
    attempt: usize,
    /// The failure is a part of a task that is a success.
    is_part_of_success: bool,
    span_s: [f64; 2],
    frames: Range<usize>,
    /// The row after it.
    end_row: usize,
}

/// The results of all tracks, in order of time.
fn results(found: &Analysis) -> Vec<TaskResult<'_>> {
    let mut results: Vec<TaskResult> = found.tracks.iter().flat_map(|track| of_track(track, found.frames)).collect();
    results.sort_by(|one, other| one.span_s[0].total_cmp(&other.span_s[0]));
    results
}

/// The results of a track of a recording of `frames` frames.
fn of_track(track: &Track, frames: usize) -> Vec<TaskResult<'_>> {
    let cut_off = |task: &TaskSpan| match task.frames.end < frames {
        _ if !task.open_end => None,
        true => Some("a gap of the log"),
        false => Some("the end of the recording"),
    };
    let whole_of = |at: usize| track.composites.iter().find(|composite| composite.tasks.contains(&at));
    let mut results = Vec::new();
    for (at, span) in track.tasks.iter().enumerate().filter(|(_, span)| span.task != UNKNOWN) {
        let whole = whole_of(at);
        let is_part_of_success = span.failure && whole.is_some_and(|whole| !whole.failure);
        if whole.is_none() || is_part_of_success {
            results.push(TaskResult {
                who: track.who,
                task: &span.task,
                subject: &span.subject,
                failure: span.failure,
                cut_off: cut_off(span),
                attempt: span.attempt,
                is_part_of_success,
                span_s: [span.start_s, span.end_s],
                frames: span.frames.clone(),
                end_row: span.rows.end,
            });
        }
    }
    for whole in &track.composites {
        let last = whole.tasks.end.checked_sub(1).and_then(|at| track.tasks.get(at));
        results.extend(last.map(|last| TaskResult {
            who: track.who,
            task: &whole.task,
            subject: &last.subject,
            failure: whole.failure,
            cut_off: cut_off(last),
            attempt: last.attempt,
            is_part_of_success: false,
            span_s: [whole.start_s, whole.end_s],
            frames: last.frames.clone(),
            end_row: whole.rows.end,
        }));
    }
    results
}

impl TaskResult<'_> {
    fn reason(&self, all: &[Self], found: &Analysis) -> OutcomeReason {
        let mends = |later: &Self| {
            !later.failure && later.span_s[0] >= self.span_s[1] && repeats(self.subject, later.subject, true)
        };
        let is_mended = self.is_part_of_success || all.iter().any(mends);
        let fall = found.falls.iter().find(|fall| fall.track == self.who && self.frames.contains(&fall.frame));
        let object = self.subject.object.as_deref().unwrap_or("the object");
        let fell = fall.map_or_else(String::new, |fall| fall_text(fall, object));
        let declared = found.declared.first().map(|field| format!(", but `{field}` says that the recording succeeded"));
        let (kind, end) = match (self.failure, is_mended, declared) {
            (false, false, declared) if self.cut_off.is_some() => {
                let kind = if declared.is_some() { ReasonKind::Declared } else { ReasonKind::CutOff };
                let by = self.cut_off.unwrap_or_default();
                (kind, format!(" is cut off by {by}{}", declared.unwrap_or_default()))
            }
            (false, ..) if self.attempt > 1 => (ReasonKind::Succeeded, format!(", attempt {}", self.attempt)),
            (false, ..) => (ReasonKind::Succeeded, String::new()),
            (true, true, _) => (ReasonKind::Mended, " failed, and a later attempt succeeded".into()),
            (true, false, Some(declared)) => (ReasonKind::Declared, format!(" failed{fell}{declared}")),
            (true, false, None) => match fall.filter(|fall| fall.is_from_open_jaws) {
                Some(fall) => (ReasonKind::LetFall, format!("{fell}{}", intention_text(fall))),
                None => (ReasonKind::Failed, format!(" failed, and no later attempt succeeded{fell}")),
            },
        };
        let [start_s, end_s] = self.span_s;
        let (who, task, suffix) = (self.who, self.task, self.subject.suffix());
        OutcomeReason {
            kind,
            track: Some(who),
            task: Some(task.to_string()),
            subject: self.subject.clone(),
            span_s: Some(self.span_s),
            message: format!("{who} {task}{suffix} {start_s:.3} – {end_s:.3} s{end}"),
        }
    }
}

/// The height of a fall.
fn fall_text(fall: &Fall, object: &str) -> String {
    let from = if fall.is_from_open_jaws { " from the opened jaws" } else { "" };
    format!(": {object} fell {:.0} mm{from} at {:.3} s", fall.height_m * 1e3, fall.start_s)
}

/// What the user does if a fall from opened jaws is intended.
fn intention_text(fall: &Fall) -> String {
    let param = |way_m: f64| format!(": if it is, set `params: {{drop_way: {:.0} mm}}`", way_m * 1e3);
    format!(", which may be intended{}", fall.drop_way_m.map_or_else(String::new, param))
}
