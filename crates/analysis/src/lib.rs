//! Leaves in, named tasks out: settled segments, untargeted relabeling, recognition, relabeling of the named tasks
//! (grammar/README.md, Meaning of a run, points 4 to 6).
//!
//! Invariants: the segments of a hand leave no frame of a gap-free stretch out but those in which a body was lost that it involves, and never cross a gap; raw
//! segments are kept as the trees gave them; a segment that rules have changed lists its earlier primitives and the rules that changed it, and the time
//! of a rewritten segment belongs to the surviving label. What comes out is plain data: writing it needs no rules.
//!
//! Settling (`engine::runs::Settler`) and the search for spans (`spans`) take one label at a time, so that segments and spans
//! can be shown as they close; relabeling needs a whole stretch, because its rules look at what comes after.

pub mod agreement;
pub mod audit;
pub mod composites;
pub mod confidence;
pub mod coverage;
pub mod csv;
pub mod difference;
pub mod eaf;
pub mod episodes;
pub mod expect;
pub mod explain;
pub mod fit;
mod interval_labels;
pub mod json;
mod labeled_span;
pub mod margin;
mod measures;
mod naming;
pub mod number;
mod object_motion;
pub mod outcome;
mod relabel;
mod relabeling_rounds;
pub mod score;
mod spans;
pub mod steps;
mod subject;
mod tasks;

pub use composites::CompositeSpan;
pub use confidence::Confidence;
pub use measures::{channels, reads_later};
pub use object_motion::{Fall, UntouchedMotion, explain_by_motion, reads_motion};
pub use relabeling_rounds::MAX_ROUNDS;
pub use subject::Subject;

pub use teachtree_base::hands::TrackId;

use interval_labels::{IntervalLabels, Settling};
use labeled_span::LabeledSpan;
use measures::Measures;
use naming::Naming;
use outcome::{ExpectedTasks, Outcome, UnmeasuredTask};
use std::collections::BTreeMap;
use std::ops::Range;
use subject::HandledObjects;
use tasks::NamedSpan;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_base::meaning::{Meaning, Primitives};
use teachtree_base::short_number::ShortNumber;
use teachtree_engine::runs::Leaves;
use teachtree_engine::semantics::samples;
use teachtree_frames::frames::Frames;
use teachtree_frames::spilled_columns::Series;
use teachtree_language::lints::durations;
use teachtree_language::rules::{Constant, Rules};
use teachtree_logs::issue::Issue;

/// The name of a task in which something was handled, but that has the keys of no task of the rules.
pub const UNKNOWN: &str = "unknown";

/// The analysis of a recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Analysis {
    /// Number of frames.
    pub frames: usize,
    /// Number of rows of the log.
    pub rows: usize,
    /// Frames per second.
    pub rate_hz: f64,
    /// The start of the recording, s.
    pub start_s: f64,
    /// The end of the recording, s.
    pub end_s: f64,
    /// Start and end times (s) of the analyzed gap-free intervals, in order.
    pub stretches: Vec<(f64, f64)>,
    /// The tracks that the recording has: left, right, both.
    pub tracks: Vec<Track>,
    /// The issues of the recording and the limits of the rules.
    pub issues: Vec<Issue>,
    /// The primitives of the rules.
    pub primitives: Primitives,
    /// Whether the rules have tasks that are failures.
    pub has_failures: bool,
    /// The tasks that the recording should contain.
    pub expected: ExpectedTasks,
    /// The fields of the log that say that the recording succeeded; empty if one of them says that it did not.
    pub declared: Vec<String>,
    /// The tasks that the recording cannot show.
    pub unmeasured: Vec<UnmeasuredTask>,
    /// The falls of objects in failed tasks, from [`explain_by_motion`].
    pub falls: Vec<Fall>,
    /// If no task has a name, the object that moved farthest while no hand touched it, from [`explain_by_motion`].
    pub untouched: Vec<UntouchedMotion>,
}

impl Analysis {
    /// The track of a hand or of both.
    pub fn track(&self, who: TrackId) -> Option<&Track> {
        self.tracks.iter().find(|track| track.who == who)
    }

    /// Whether the recording is a success, with the reasons.
    pub fn outcome(&self) -> Outcome {
        Outcome::new(self)
    }

    /// The row of the log, counted from 0, after the last task that is a success. `None` unless the outcome of the recording is a success.
    pub fn success_end(&self) -> Option<usize> {
        outcome::success_end(self)
    }

    /// Whether something can show that the recording is a failure: a task of the rules, or an expectation.
    pub fn has_criterion(&self) -> bool {
        self.has_failures || !self.expected.is_empty()
    }

    /// Returns the owner of the only track. Labels without a track refer to it.
    pub fn only(&self) -> Option<TrackId> {
        match self.tracks.as_slice() {
            [track] => Some(track.who),
            _ => None,
        }
    }
}

/// Segments over the time of the recording. In the track of both hands there are gaps where nothing is coordinated.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// Whose it is.
    pub who: TrackId,
    /// The settled labels as the trees gave them.
    pub segments: Vec<Segment>,
    /// The segments after relabeling.
    pub relabeled: Vec<Segment>,
    /// The tasks, in order of time; none for both hands, whose coordination is part of each hand's task.
    pub tasks: Vec<TaskSpan>,
    /// The tasks that are made of these.
    pub composites: Vec<CompositeSpan>,
}

/// A stretch of time with one primitive.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Segment {
    /// The displayed name of the primitive: `Grasp`, `MainGrasp(left)`.
    pub primitive: String,
    /// The action of the hand, if the rules declare it.
    pub does: Option<Meaning>,
    /// What it is about.
    pub subject: Subject,
    /// The frames `[start, end)`.
    pub frames: Range<usize>,
    /// The rows of the log `[start, end)`, counted from 0.
    pub rows: Range<usize>,
    /// Start, s.
    pub start_s: f64,
    /// End, s: when the next one starts.
    pub end_s: f64,
    /// The raw primitives of this time, in order; empty when no rule changed anything here.
    pub was: Vec<String>,
    /// The rules that changed it, as their authors wrote them, in the order in which they did.
    pub by: Vec<String>,
    /// The confidence of its start, if requested.
    pub confidence: Option<Confidence>,
}

/// A task with its relabeled segments.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TaskSpan {
    /// The name; [`UNKNOWN`] when no task of the rules has its keys here.
    pub task: String,
    /// Whether the rules declare the task as a failure. Another named task is a success; [`UNKNOWN`] is neither.
    pub failure: bool,
    /// Which attempt at its object and target it belongs to, from 1.
    pub attempt: usize,
    /// What it is about.
    pub subject: Subject,
    /// The frames `[start, end)`.
    pub frames: Range<usize>,
    /// The rows of the log `[start, end)`, counted from 0.
    pub rows: Range<usize>,
    /// Start, s.
    pub start_s: f64,
    /// End, s.
    pub end_s: f64,
    /// The other tasks that match here too, by priority.
    pub secondary: Vec<String>,
    /// Whether the beginning was cut off by the start of the recording or a gap.
    pub open_start: bool,
    /// Whether the recording or a gap cut off the end: the hand has not let go of an object that it is not fixed to.
    pub open_end: bool,
    /// Whether the last primitive of the task is missing at the end of its stretch: later frames may extend the task.
    pub lacks_last: bool,
    /// The segments after relabeling.
    pub segments: Vec<Segment>,
    /// The share of the variations in which the task is found under this name, where that was asked for.
    pub stability: Option<f64>,
}

/// Checks that every duration of settling, tasks and relabeling is at least one sample.
///
/// # Errors
/// The first one that is shorter than one sample, at its place in the rules.
pub fn check_rate(rules: &Rules, rate_hz: f64) -> Result<(), InputError> {
    // A tree that does not settle says so with a duration of nothing.
    let durations = durations::of_segments(rules).into_iter().filter(|duration| duration.value > 0.0);
    too_short(rules, durations, rate_hz).map_or(Ok(()), Err)
}

/// Returns an evaluator's error about a rate with the place of the window in the rules. The evaluators know no places: they check only
/// the windows that a log needs.
pub fn placed(error: InputError, rules: &Rules, rate_hz: f64) -> InputError {
    too_short(rules, durations::of_windows(rules).into_iter(), rate_hz).unwrap_or(error)
}

/// Returns the error about a duration that is shorter than a sample at the place of `resample` in a binding, if that sets the rate.
pub fn at_resample(error: InputError, rules: &Rules, rate_hz: f64, place: &str) -> InputError {
    let durations = durations::of_segments(rules).into_iter().chain(durations::of_windows(rules));
    let is_here = |duration: &&Constant| {
        samples(duration.value, rate_hz).is_err() && rules.sources.place(duration.span) == error.place
    };
    let Some(duration) = durations.filter(|it| it.value * rate_hz < 1.0).find(is_here) else { return error };
    let param = duration.params.first().and_then(|id| rules.params.get(id.index()));
    let name = param.map_or_else(|| "a duration".to_string(), |param| format!("`{}`", param.name));
    let (rate, length) = (ShortNumber(rate_hz), ShortNumber(duration.value * 1e3));
    let message = format!("`resample: {rate} Hz` is too slow for {name} of {length} ms at {}", error.place);
    let least = duration.value.recip().ceil();
    InputError::new(place, message).help(format!("use at least `resample: {least} Hz`, or a longer duration"))
}

fn too_short<'a>(rules: &Rules, mut durations: impl Iterator<Item = &'a Constant>, rate_hz: f64) -> Option<InputError> {
    durations.find_map(|duration| {
        let error = samples(duration.value, rate_hz).err()?;
        Some(InputError { place: rules.sources.place(duration.span), ..error })
    })
}

/// Finds the segments and tasks of a recording, from the leaves of each of its gap-free stretches.
pub fn analyze(rules: &Rules, frames: &Frames, leaves: &[Leaves]) -> Analysis {
    analyze_series(rules, frames, frames, leaves)
}

/// Like [`analyze`], for frames whose columns of the channels that [`reads_later`] names are stored elsewhere.
pub fn analyze_series(rules: &Rules, frames: &Frames, series: &dyn Series, leaves: &[Leaves]) -> Analysis {
    let rate_hz = frames.layout.rate_hz;
    let handling = HandledObjects::new(frames, series);
    let show = Naming { rules, frames, handling: &handling };
    let of_hand = |side| leaves.iter().any(|leaves| leaves.hands.contains_key(&side));
    let sides: Vec<Side> = Side::BOTH.into_iter().filter(|side| of_hand(*side)).collect();
    let measures: BTreeMap<Side, Measures> =
        sides.iter().map(|side| (*side, Measures::new(frames, series, *side))).collect();
    let mut hands: BTreeMap<Side, Track> = sides.iter().map(|side| (*side, Track::new(TrackId::Hand(*side)))).collect();
    let mut both = Track::new(TrackId::Both);
    let mut issues = frames.issues.clone();
    issues.extend(show.unsupported_keys(&measures));

    let settling = Settling::new(rules, rate_hz);
    for leaves in leaves {
        let mut stretch = IntervalLabels::new(leaves, &frames.unseen, settling);
        let mut undone = relabeling_rounds::relabel_stretch(rules, &mut stretch, &measures);
        let mut named: BTreeMap<Side, Vec<NamedSpan>> = BTreeMap::new();
        for (side, measures) in &measures {
            let lane = stretch.hands.get(side).map_or(&[][..], Vec::as_slice);
            named.insert(*side, tasks::recognize(rules, lane, measures));
        }
        undone.extend(relabeling_rounds::relabel_tasks(rules, &mut named, &measures));
        issues.extend(show.undone(&undone, &stretch.frames()));

        for (side, track) in &mut hands {
            let tasks = named.remove(side).unwrap_or_default();
            stretch.put_back(*side, tasks.iter().flat_map(|task| &task.pieces));
            let raw = stretch.raw.get(side).map_or(&[][..], Vec::as_slice);
            let relabeled = stretch.hands.get(side).map_or(&[][..], Vec::as_slice);
            let segment = |piece: &LabeledSpan| show.segment(TrackId::Hand(*side), piece, raw, &stretch.frames());
            track.segments.extend(raw.iter().map(segment));
            track.relabeled.extend(relabeled.iter().map(segment));
            let before = track.tasks.len();
            track.tasks.extend(tasks.iter().map(|task| show.task(*side, task, raw, &stretch.frames())));
            let new = track.tasks.get(before..).unwrap_or_default();
            track.composites.extend(composites::of_stretch(rules, new, before));
        }
        let segment = |piece: &LabeledSpan| show.segment(TrackId::Both, piece, &stretch.raw_both, &stretch.frames());
        both.segments.extend(stretch.raw_both.iter().map(segment));
        both.relabeled.extend(stretch.coordination().iter().map(segment));
    }
    let mut tracks: Vec<Track> = hands.into_values().collect();
    if leaves.iter().any(|leaves| !leaves.both.is_empty()) {
        tracks.push(both);
    }
    outcome::number_attempts(&mut tracks);
    let rows = if frames.row_time.is_empty() { frames.len } else { frames.row_time.len() };
    let (start_s, end_s) = (show.start_s(), show.end_s());
    let stretches = leaves.iter().map(|leaves| show.span_s(&leaves.frames)).collect();
    let primitives = rules.by_name();
    let has_failures = rules.tasks.iter().any(|task| task.failure) || rules.composites.iter().any(|task| task.failure);
    Analysis {
        frames: frames.len,
        rows,
        rate_hz,
        start_s,
        end_s,
        stretches,
        tracks,
        issues,
        primitives,
        has_failures,
        ..Analysis::default()
    }
}

impl Track {
    /// A track without segments.
    pub fn new(who: TrackId) -> Self {
        Self { who, segments: Vec::new(), relabeled: Vec::new(), tasks: Vec::new(), composites: Vec::new() }
    }
}
