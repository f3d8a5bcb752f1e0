//! Finds recordings that are unsuitable as demonstrations: nothing happens in them, they are cut off, a grasp failed, a common task is missing, the steps are
//! in an unusual order, or they differ from the others. `analyze` reports the content of one recording; an audit reports which recordings of a set to leave
//! out.
//!
//! [`Facts::new`] examines one recording; [`compare`] compares each recording with the majority.

mod compare;
mod failures;
mod issues;
mod motion;
pub mod signals;
mod usual_tasks;

pub use compare::{compare, unchecked};
pub use failures::counts as failure_counts;
pub use usual_tasks::counts as task_counts;

use super::outcome::ReasonKind;
use super::{Analysis, Segment, TaskSpan, Track, TrackId, UNKNOWN};
use motion::Motion;
use serde::Serialize;
use teachtree_base::meaning::Meaning;
use teachtree_base::recording::Recording;
use teachtree_logs::issue::Issue;

/// Minimum number of recordings for which the majority defines the usual beginnings, endings and tasks.
const FEWEST_HALVES: usize = 3;
/// Minimum share of recordings that have two steps in the same order for the opposite order to be reported.
const ORDERED: f64 = 0.8;

/// The kinds of findings about a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FindingKind {
    /// The binding, the scene or a sensor contradicts the recording.
    Setup,
    /// A task failed, and no later attempt succeeded.
    Failure,
    /// No object is handled, or no motion occurs for a long time.
    Idle,
    /// The recording begins or ends in the middle of an action, or a gap interrupts an action.
    CutOff,
    /// A hand closed around an object and let go of it without having moved it.
    FailedGrasp,
    /// The recording lacks a task that is expected, or that most recordings have.
    LacksTask,
    /// Its steps are in another order than those of most.
    OutOfOrder,
    /// The recording has other steps than most, or is much longer or shorter.
    #[serde(rename = "unlike")]
    Outlier,
    /// Frames are missing between others, or at the end of a video.
    MissingFrames,
    /// Steps between stamps differ, or are not those of the rate.
    UnevenStamps,
    /// Rows or messages have one stamp.
    EqualStamps,
    /// Stamps go back.
    StampsBack,
    /// Samples are far away from all others and from their neighbors.
    Spike,
    /// A camera gives the same picture while things move.
    FrozenCamera,
}

impl FindingKind {
    /// All of them.
    pub const ALL: [Self; 14] = [
        Self::Setup,
        Self::Failure,
        Self::Idle,
        Self::CutOff,
        Self::FailedGrasp,
        Self::LacksTask,
        Self::OutOfOrder,
        Self::Outlier,
        Self::MissingFrames,
        Self::UnevenStamps,
        Self::EqualStamps,
        Self::StampsBack,
        Self::Spike,
        Self::FrozenCamera,
    ];

    /// `cut_off`, as in files and options.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Setup => "setup",
            Self::Failure => "failure",
            Self::Idle => "idle",
            Self::CutOff => "cut_off",
            Self::FailedGrasp => "failed_grasp",
            Self::LacksTask => "lacks_task",
            Self::OutOfOrder => "out_of_order",
            Self::Outlier => "unlike",
            Self::MissingFrames => "missing_frames",
            Self::UnevenStamps => "uneven_stamps",
            Self::EqualStamps => "equal_stamps",
            Self::StampsBack => "stamps_back",
            Self::Spike => "spike",
            Self::FrozenCamera => "frozen_camera",
        }
    }

    /// Whether a recording is counted as one with it: `2 with spikes`, but `2 idle`.
    pub const fn is_counted_with(self) -> bool {
        matches!(
            self,
            Self::Setup
                | Self::MissingFrames
                | Self::UnevenStamps
                | Self::EqualStamps
                | Self::StampsBack
                | Self::Spike
                | Self::FrozenCamera
        )
    }

    /// `cut off`, for people.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Setup => "wrong setup",
            Self::Failure => "failed",
            Self::Idle => "idle",
            Self::CutOff => "cut off",
            Self::FailedGrasp => "failed grasp",
            Self::LacksTask => "lacking a task",
            Self::OutOfOrder => "out of order",
            Self::Outlier => "unlike the others",
            Self::MissingFrames => "missing frames",
            Self::UnevenStamps => "uneven stamps",
            Self::EqualStamps => "equal stamps",
            Self::StampsBack => "stamps going back",
            Self::Spike => "spikes",
            Self::FrozenCamera => "frozen camera",
        }
    }
}

/// Something that is wrong with a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// The kind of the finding.
    pub kind: FindingKind,
    /// The hand that it is about.
    pub track: Option<TrackId>,
    /// The column, topic or camera that it is about.
    pub column: Option<String>,
    /// Start and end, s; `None` for a finding about the whole recording.
    pub span_s: Option<[f64; 2]>,
    /// The number that it is about, in the unit that docs/audit.md gives for its kind.
    pub value: Option<f64>,
    /// The finding as text.
    pub message: String,
}

impl Finding {
    /// A finding about a whole recording.
    fn new(kind: FindingKind, message: String) -> Self {
        Self { kind, track: None, column: None, span_s: None, value: None, message }
    }
}

/// A task or primitive with its object, as recordings are compared by it.
#[derive(Clone, Debug, PartialEq)]
struct Step {
    /// The name of the task or primitive without its object.
    what: String,
    /// The name with its object.
    name: String,
    /// A failed task. A later attempt may have succeeded, but other recordings need not contain the failure.
    failure: bool,
    start_s: f64,
    duration_s: f64,
}

/// The action of a hand at the beginning or end of a recording.
#[derive(Clone, Debug, PartialEq)]
struct Edge {
    who: TrackId,
    is_start: bool,
    /// The action by which the edges of recordings are compared: the meaning of the primitive, or its name if it has no meaning.
    does: String,
    finding: Finding,
}

/// A segment as a page draws it: from, to, primitive, meaning.
pub type DrawnSegment = (f64, f64, String, Option<Meaning>);

/// The properties of a recording, and its findings.
#[derive(Clone, Debug, PartialEq)]
pub struct Facts {
    /// The start of the recording, s.
    pub start_s: f64,
    /// The end of the recording, s.
    pub end_s: f64,
    /// The segments of each hand.
    pub lanes: Vec<(TrackId, Vec<DrawnSegment>)>,
    /// The findings, by kind.
    pub findings: Vec<Finding>,
    /// The issues of the log that `analyze` reports; empty without rules.
    pub issues: Vec<Issue>,
    tasks: Vec<Step>,
    primitives: Vec<Step>,
    /// The hands that are in the middle of something at its beginning or end. Whether that is wrong is seen among all recordings.
    edges: Vec<Edge>,
    /// Whether a grasp may have failed, and nothing in the recording can show that its object was carried.
    has_unjudged_grasps: bool,
    /// The names of the tasks that failed without a later success.
    failures: Vec<String>,
    /// Whether tasks are expected of it: then the tasks that most recordings have do not matter.
    has_expectation: bool,
    /// Whether an expected task is missing that the recording cannot show.
    has_unmeasured: bool,
}

impl Facts {
    /// Those of a recording with these findings in its raw columns. Rests count from `rest_s` on, s; `can_carry` is whether the rules can detect in it that
    /// a hand carries an object.
    pub fn new(
        found: &Analysis,
        recording: &Recording,
        of_columns: Vec<Finding>,
        rest_s: f64,
        can_carry: &dyn Fn(TrackId) -> bool,
    ) -> Self {
        let motion = Motion::new(recording);
        let hands: Vec<&Track> = found.tracks.iter().filter(|track| track.who.side().is_some()).collect();
        let drawn = |it: &Segment| (it.start_s, it.end_s, it.primitive.clone(), it.does);
        let outcome = found.outcome();
        let mut findings = idle(found, &hands, &motion, rest_s);
        findings.extend(failures::findings(&outcome));
        findings.extend(issues::findings(&found.issues, &of_columns));
        findings.extend(of_columns);
        let (mut edges, mut has_unjudged_grasps) = (Vec::new(), false);
        for track in &hands {
            findings.extend(gaps(found, track));
            let grasps = failed_grasps(track, &hands, &motion);
            // If no carry can be detected, each grasp of an object without poses would count as failed.
            let (failed, unjudged): (Vec<_>, Vec<_>) =
                grasps.into_iter().partition(|(by_poses, _)| *by_poses || can_carry(track.who));
            findings.extend(failed.into_iter().map(|(_, finding)| finding));
            has_unjudged_grasps |= !unjudged.is_empty();
            edges.extend([true, false].into_iter().filter_map(|is_start| edge(found, recording, track, is_start)));
        }
        let steps = |of: &dyn Fn(&Track) -> Vec<Step>| {
            let mut steps: Vec<Step> = hands.iter().flat_map(|track| of(track)).collect();
            steps.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
            steps
        };
        let step = |what: &str, suffix: String, start_s: f64, end_s: f64| Step {
            what: what.into(),
            name: format!("{what}{suffix}"),
            failure: false,
            start_s,
            duration_s: end_s - start_s,
        };
        let task =
            |it: &TaskSpan| Step { failure: it.failure, ..step(&it.task, it.subject.suffix(), it.start_s, it.end_s) };
        let primitive = |it: &Segment| step(&it.primitive, it.subject.suffix(), it.start_s, it.end_s);
        Self {
            start_s: found.start_s,
            end_s: found.end_s,
            lanes: hands.iter().map(|track| (track.who, track.relabeled.iter().map(drawn).collect())).collect(),
            findings,
            issues: found.issues.clone(),
            tasks: steps(&|track| track.tasks.iter().map(task).collect()),
            primitives: steps(&|track| track.relabeled.iter().filter(|it| is_key(it)).map(primitive).collect()),
            edges,
            has_unjudged_grasps,
            failures: failures::tasks(&outcome),
            has_expectation: outcome.expected.is_some(),
            has_unmeasured: outcome.reasons.iter().any(|reason| reason.kind == ReasonKind::NotMeasured),
        }
    }

    /// Those of a recording that no rules were run on.
    fn of_signals([start_s, end_s]: [f64; 2], findings: Vec<Finding>) -> Self {
        Self {
            start_s,
            end_s,
            lanes: Vec::new(),
            findings,
            issues: Vec::new(),
            tasks: Vec::new(),
            primitives: Vec::new(),
            edges: Vec::new(),
            has_unjudged_grasps: false,
            failures: Vec::new(),
            has_expectation: false,
            has_unmeasured: false,
        }
    }

    /// The issues that are not findings.
    pub fn other_issues(&self) -> impl Iterator<Item = &Issue> {
        self.issues.iter().filter(|issue| !issues::is_finding(issue.kind))
    }

    /// Returns the duration, s.
    pub fn duration_s(&self) -> f64 {
        self.end_s - self.start_s
    }

    /// The share of the recording in which nothing moves, 0 to 1: that of all rests that are findings.
    pub fn idle_share(&self) -> f64 {
        let rests = self.findings.iter().filter(|finding| finding.kind == FindingKind::Idle);
        let idle_s: f64 = rests.filter_map(|finding| finding.span_s).map(|[start, end]| end - start).sum();
        if self.duration_s() > 0.0 { (idle_s / self.duration_s()).min(1.0) } else { 0.0 }
    }

    /// The tasks by which recordings are compared, in order: those that are not failures.
    fn compared_tasks(&self) -> impl Iterator<Item = &Step> {
        self.tasks.iter().filter(|step| !step.failure)
    }

    /// Its tasks with their objects, in order.
    pub fn tasks(&self) -> impl Iterator<Item = &str> {
        self.tasks.iter().map(|step| step.name.as_str())
    }
}

/// Whether a segment is one by which recordings are compared: not what alternates in every demonstration, such as carrying and sliding.
fn is_key(segment: &Segment) -> bool {
    match segment.does {
        Some(does) => !matches!(
            does,
            Meaning::Free
                | Meaning::Approach
                | Meaning::Open
                | Meaning::Carry
                | Meaning::Hold
                | Meaning::Place
                | Meaning::Slide
        ),
        None => false,
    }
}

/// Whether the hand handles something in a segment.
fn handles(segment: &Segment) -> bool {
    segment.does.is_none_or(|does| !does.is_free())
}

/// A segment with its hand and object.
fn named(track: &Track, segment: &Segment) -> String {
    format!("{} {}{}", track.who, segment.primitive, segment.subject.suffix())
}

fn idle(found: &Analysis, hands: &[&Track], motion: &Motion, rest_s: f64) -> Vec<Finding> {
    let whole = found.end_s - found.start_s;
    if !hands.iter().any(|track| track.relabeled.iter().any(handles)) {
        let message = "no hand handles anything".to_string();
        return vec![Finding::new(FindingKind::Idle, message)];
    }
    // A hand that presses acts without motion.
    let presses = |start: f64, end: f64| -> f64 {
        let segments = hands.iter().flat_map(|track| &track.relabeled).filter(|it| it.does == Some(Meaning::Press));
        segments.map(|it| (it.end_s.min(end) - it.start_s.max(start)).max(0.0)).sum()
    };
    let rests = motion.rests(rest_s);
    let rests = rests.into_iter().filter(|[start, end]| presses(*start, *end) < (end - start) / 2.0);
    rests
        .map(|[start, end]| {
            let part = if whole > 0.0 { 100.0 * (end - start) / whole } else { 0.0 };
            let message = format!("nothing moves for {:.1} s ({part:.0} % of the recording)", end - start);
            Finding { span_s: Some([start, end]), ..Finding::new(FindingKind::Idle, message) }
        })
        .collect()
}

/// The edge of a recording in the middle of something.
fn edge(found: &Analysis, recording: &Recording, track: &Track, is_start: bool) -> Option<Edge> {
    let (segment, task) = if is_start {
        (track.relabeled.first().filter(|it| it.frames.start == 0)?, track.tasks.first())
    } else {
        (track.relabeled.last().filter(|it| it.frames.end == found.frames)?, track.tasks.last())
    };
    // An object that the hand never releases is a part of the hand.
    let held = segment.subject.object.as_ref().and_then(|object| recording.scene.bodies.get(object));
    if held.is_some_and(|body| body.fixed_to.is_some()) {
        return None;
    }
    let task = task.filter(|task| if is_start { task.frames.start == 0 } else { task.frames.end == found.frames });
    let is_open = task.is_some_and(|task| if is_start { task.open_start } else { task.open_end });
    // A recording that ends with a release is complete.
    if !is_start && segment.does == Some(Meaning::Open) {
        return None;
    }
    // For a primitive without a meaning, only an open task shows that the action continues.
    if !segment.does.map_or(is_open, |does| !does.is_free()) {
        return None;
    }
    let of = task.filter(|task| task.task != UNKNOWN).map_or(String::new(), |task| format!(", in {}", task.task));
    let verb = if is_start { "begins" } else { "ends" };
    let message = format!("{verb} in the middle of {}{of}", named(track, segment));
    let span_s = Some([segment.start_s, segment.end_s]);
    let does = segment.does.map_or_else(|| segment.primitive.clone(), |does| does.name().into());
    Some(Edge {
        who: track.who,
        is_start,
        does,
        finding: Finding { track: Some(track.who), span_s, ..Finding::new(FindingKind::CutOff, message) },
    })
}

/// The tasks that a gap of the log interrupts.
fn gaps(found: &Analysis, track: &Track) -> Vec<Finding> {
    let is_cut = |task: &&TaskSpan| task.open_end && task.frames.end < found.frames;
    let finding = |task: &TaskSpan| {
        let message = format!("a gap of the log interrupts {} {}{}", track.who, task.task, task.subject.suffix());
        let span_s = Some([task.start_s, task.end_s]);
        Finding { track: Some(track.who), span_s, ..Finding::new(FindingKind::CutOff, message) }
    };
    track.tasks.iter().filter(is_cut).map(finding).collect()
}

/// Actions that prove a grasp, even if the object hardly moved.
const fn proves_grasp(does: Meaning) -> bool {
    matches!(
        does,
        Meaning::Turn
            | Meaning::Insert
            | Meaning::Extract
            | Meaning::Press
            | Meaning::Follow
            | Meaning::Share
            | Meaning::Pass
            | Meaning::Fit
    )
}

/// Grasps that were let go of without the object having moved with the hand, each with whether the poses of the object show it, not the primitives alone.
/// One that is in progress at the start of the recording does not count, because its beginning is unknown.
fn failed_grasps(track: &Track, hands: &[&Track], motion: &Motion) -> Vec<(bool, Finding)> {
    let segments = &track.relabeled;
    let follows = |at: usize| {
        at > 0 && segments.get(at - 1).zip(segments.get(at)).is_some_and(|(a, b)| a.frames.end == b.frames.start)
    };
    let lets_go = |it: &Segment| it.does.is_some_and(|does| does.is_free() || does == Meaning::Open);
    // Whether the hand held nothing before.
    let begins = |at: usize| {
        let before = at.checked_sub(1).filter(|_| follows(at)).and_then(|before| segments.get(before));
        before.is_some_and(|it| lets_go(it) || it.does.is_some_and(Meaning::pushes))
    };
    let mut findings = Vec::new();
    let mut at = 0;
    while let Some(first) = segments.get(at) {
        if first.does != Some(Meaning::Close) || !begins(at) {
            at += 1;
            continue;
        }
        let mut end = at + 1;
        while follows(end) && segments.get(end).is_some_and(|it| !lets_go(it)) {
            end += 1;
        }
        let released = follows(end).then(|| segments.get(end)).flatten();
        let grasp = segments.get(at..end).unwrap_or_default();
        let failed = released.and_then(|it| Some((it, failed_by_poses(grasp, it.start_s, track, hands, motion)?)));
        if let Some((released, by_poses)) = failed {
            let message = format!("{}: let go of without having moved with the hand", named(track, first));
            let span_s = Some([first.start_s, released.start_s]);
            let finding = Finding::new(FindingKind::FailedGrasp, message);
            findings.push((by_poses, Finding { track: Some(track.who), span_s, ..finding }));
        }
        at = end;
    }
    findings
}

/// Whether the poses of the object show that a grasp failed, or the primitives alone; `None` where it did not fail.
fn failed_by_poses(
    grasp: &[Segment],
    released_s: f64,
    track: &Track,
    hands: &[&Track],
    motion: &Motion,
) -> Option<bool> {
    let does = |wanted: &dyn Fn(Meaning) -> bool| grasp.iter().any(|it| it.does.is_some_and(wanted));
    if grasp.iter().any(|it| it.does.is_none()) || does(&proves_grasp) {
        return None;
    }
    // A hand may keep an object in its place while the other one works.
    let other_works = |it: &Segment| {
        let others = hands.iter().filter(|other| other.who != track.who).flat_map(|other| &other.relabeled);
        it.does == Some(Meaning::Hold)
            && others.into_iter().any(|other| handles(other) && other.start_s < it.end_s && other.end_s > it.start_s)
    };
    if grasp.iter().any(other_works) {
        return None;
    }
    let object = grasp.iter().find_map(|it| it.subject.object.as_deref());
    let start_s = grasp.first().map_or(released_s, |it| it.start_s);
    let moved =
        track.who.side().zip(object).and_then(|(side, object)| motion.moved_with(side, object, start_s, released_s));
    let is_moving = |does: Meaning| matches!(does, Meaning::Carry | Meaning::Slide | Meaning::Place) || does.pushes();
    let failed = !moved.unwrap_or_else(|| does(&is_moving));
    failed.then_some(moved.is_some())
}

/// Returns the index of a recording with a finding about the whole recording.
fn finding(at: usize, kind: FindingKind, message: String) -> (usize, Finding) {
    (at, Finding::new(kind, message))
}
