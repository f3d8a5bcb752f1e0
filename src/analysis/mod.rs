//! Leaves in, named tasks out: settled segments, untargeted relabelling, recognition, relabelling of the named tasks
//! (LANGUAGE.md section 3, points 4 to 6).
//!
//! Invariants: the segments of a hand leave no frame of a gap-free stretch out and never cross a gap; raw segments are kept as
//! the trees gave them; a segment that rules have changed says what it was and which rules changed it, and the time
//! of a rewritten segment belongs to the surviving label. What comes out is plain data: writing it needs no rules.

pub mod csv;
pub mod json;
mod lane;
mod measures;
pub mod number;
mod relabel;
mod rounds;
mod spans;
mod stretch;
mod tasks;

pub use measures::CHANNELS;
pub use rounds::MAX_ROUNDS;

use crate::base::hands::Side;
use crate::engine::runs::Leaves;
use crate::language::rules::{Rules, TaskId};
use crate::stream::frames::{Frames, Issue};
use lane::{Piece, within};
use measures::Measures;
use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;
use stretch::{Settling, Stretch};
use tasks::Named;

/// The name of a task in which something was handled, but that has the keys of no task of the rules.
pub const UNKNOWN: &str = "unknown";

/// What was found in a recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Analysis {
    /// Number of frames.
    pub frames: usize,
    /// Frames per second.
    pub rate_hz: f64,
    /// When the recording starts, s.
    pub start_s: f64,
    /// When it ends, s.
    pub end_s: f64,
    /// The tracks that the recording has: left, right, both.
    pub tracks: Vec<Track>,
    /// What was wrong with the recording, and what the rules could not do.
    pub issues: Vec<Issue>,
}

impl Analysis {
    /// The track of a hand or of both.
    pub fn track(&self, who: Who) -> Option<&Track> {
        self.tracks.iter().find(|track| track.who == who)
    }
}

/// Whose a track is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Who {
    /// One hand's.
    Hand(Side),
    /// The coordination of both hands.
    Both,
}

impl fmt::Display for Who {
    /// `left`, `right`, `both`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Hand(side) => side.fmt(f),
            Self::Both => f.write_str("both"),
        }
    }
}

/// Segments over the time of the recording. In the track of both hands there are gaps where nothing is coordinated.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// Whose it is.
    pub who: Who,
    /// The settled labels as the trees gave them.
    pub segments: Vec<Segment>,
    /// The same time after relabelling.
    pub relabelled: Vec<Segment>,
    /// The tasks, in order of time; none for both hands, whose coordination is part of each hand's task.
    pub tasks: Vec<TaskSpan>,
}

/// A stretch of time with one primitive.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    /// The primitive as it is shown: `Grasp`, `MainGrasp(left)`.
    pub primitive: String,
    /// The frames `[start, end)`.
    pub frames: Range<usize>,
    /// Start, s.
    pub start_s: f64,
    /// End, s: when the next one starts.
    pub end_s: f64,
    /// The raw primitives of this time, in order; empty when no rule changed anything here.
    pub was: Vec<String>,
    /// The rules that changed it, as their authors wrote them, in the order in which they did.
    pub by: Vec<String>,
}

/// A task with its relabelled segments.
#[derive(Clone, Debug, PartialEq)]
pub struct TaskSpan {
    /// The name; [`UNKNOWN`] when no task of the rules has its keys here.
    pub task: String,
    /// The frames `[start, end)`.
    pub frames: Range<usize>,
    /// Start, s.
    pub start_s: f64,
    /// End, s.
    pub end_s: f64,
    /// The other tasks that match here too, by priority.
    pub secondary: Vec<String>,
    /// Whether the beginning was cut off by the start of the recording or a gap.
    pub open_start: bool,
    /// Whether the end was cut off.
    pub open_end: bool,
    /// The segments after relabelling.
    pub segments: Vec<Segment>,
}

/// Finds the segments and tasks of a recording, from the leaves of each of its gap-free stretches.
pub fn analyse(rules: &Rules, frames: &Frames, leaves: &[Leaves]) -> Analysis {
    let rate_hz = frames.layout.rate_hz;
    let show = Show { rules, frames };
    let of_hand = |side| leaves.iter().any(|leaves| leaves.hands.contains_key(&side));
    let sides: Vec<Side> = Side::BOTH.into_iter().filter(|side| of_hand(*side)).collect();
    let measures: BTreeMap<Side, Measures> = sides.iter().map(|side| (*side, Measures::new(frames, *side))).collect();
    let mut hands: BTreeMap<Side, Track> = sides.iter().map(|side| (*side, Track::new(Who::Hand(*side)))).collect();
    let mut both = Track::new(Who::Both);
    let mut issues = frames.issues.clone();
    issues.extend(show.what_keys_lack(&measures));

    let settling = Settling::new(rules, rate_hz);
    for leaves in leaves {
        let mut stretch = Stretch::new(leaves, settling);
        let mut undone = rounds::before_recognition(rules, &mut stretch, rate_hz);
        let mut named: BTreeMap<Side, Vec<Named>> = BTreeMap::new();
        for (side, measures) in &measures {
            let lane = stretch.hands.get(side).map_or(&[][..], Vec::as_slice);
            named.insert(*side, tasks::recognise(rules, lane, measures));
        }
        undone.extend(rounds::of_tasks(rules, &mut named, rate_hz));
        issues.extend(show.undone(&undone, &stretch.frames()));

        for (side, track) in &mut hands {
            let tasks = named.remove(side).unwrap_or_default();
            stretch.put_back(*side, tasks.iter().flat_map(|task| &task.pieces));
            let raw = stretch.raw.get(side).map_or(&[][..], Vec::as_slice);
            let relabelled = stretch.hands.get(side).map_or(&[][..], Vec::as_slice);
            let show = |piece: &Piece| show.segment(piece, raw, &stretch.frames());
            track.segments.extend(raw.iter().map(show));
            track.relabelled.extend(relabelled.iter().map(show));
            track
                .tasks
                .extend(tasks.iter().map(|task| self::task(rules, task, task.pieces.iter().map(show).collect())));
        }
        let segment = |piece: &Piece| show.segment(piece, &stretch.raw_both, &stretch.frames());
        both.segments.extend(stretch.raw_both.iter().map(segment));
        both.relabelled.extend(stretch.coordination().iter().map(segment));
    }
    let mut tracks: Vec<Track> = hands.into_values().collect();
    if leaves.iter().any(|leaves| !leaves.both.is_empty()) {
        tracks.push(both);
    }
    Analysis {
        frames: frames.len,
        rate_hz,
        start_s: frames.time.first().copied().unwrap_or_default(),
        end_s: show.end_s(),
        tracks,
        issues,
    }
}

impl Track {
    fn new(who: Who) -> Self {
        Self { who, segments: Vec::new(), relabelled: Vec::new(), tasks: Vec::new() }
    }
}

fn task(rules: &Rules, named: &Named, segments: Vec<Segment>) -> TaskSpan {
    let name = |id: TaskId| rules.tasks.get(id.index()).map_or(UNKNOWN, |task| &task.name).to_string();
    let (first, last) = (segments.first(), segments.last());
    TaskSpan {
        task: named.task.map_or_else(|| UNKNOWN.to_string(), name),
        frames: first.map_or(0, |first| first.frames.start)..last.map_or(0, |last| last.frames.end),
        start_s: first.map_or(0.0, |first| first.start_s),
        end_s: last.map_or(0.0, |last| last.end_s),
        secondary: named.secondary.iter().map(|id| name(*id)).collect(),
        open_start: named.span.open_start,
        open_end: named.span.open_end,
        segments,
    }
}

/// Turns frames and ids into times and names.
struct Show<'a> {
    rules: &'a Rules,
    frames: &'a Frames,
}

impl Show<'_> {
    fn end_s(&self) -> f64 {
        self.frames.len.checked_sub(1).map_or(0.0, |last| self.frames.end_of(last))
    }

    /// When a frame of a stretch starts; for the end of the stretch, when its last frame ends.
    fn time_s(&self, frame: usize, stretch: &Range<usize>) -> f64 {
        match self.frames.time.get(frame) {
            Some(time) if frame < stretch.end => *time,
            _ => frame.checked_sub(1).map_or(0.0, |last| self.frames.end_of(last)),
        }
    }

    fn segment(&self, piece: &Piece, raw: &[Piece], stretch: &Range<usize>) -> Segment {
        let name = |piece: &Piece| self.rules.label_name(piece.label);
        let by = piece.by.iter().filter_map(|rule| self.rules.relabels.get(*rule)).map(|rule| rule.text.clone());
        let was = if piece.by.is_empty() { &[][..] } else { within(raw, &piece.frames) };
        Segment {
            primitive: name(piece),
            frames: piece.frames.clone(),
            start_s: self.time_s(piece.frames.start, stretch),
            end_s: self.time_s(piece.frames.end, stretch),
            was: was.iter().map(name).collect(),
            by: by.collect(),
        }
    }

    /// Keys that ask for more than the recording can tell, by hand and channel.
    fn what_keys_lack(&self, measures: &BTreeMap<Side, Measures>) -> Vec<Issue> {
        let mut issues = Vec::new();
        for (side, measures) in measures {
            for channel in [measures::POSITION, measures::SPIN] {
                let tasks: Vec<&str> = (self.rules.tasks.iter())
                    .filter(|task| task.keys.iter().any(|key| measures::asks(key, channel)))
                    .map(|task| task.name.as_str())
                    .collect();
                if !tasks.is_empty() && !measures.has(channel) {
                    issues.push(Issue {
                        kind: "missing_channel".into(),
                        start_s: self.frames.time.first().copied().unwrap_or_default(),
                        end_s: self.end_s(),
                        channel: format!("{side}.{channel}"),
                        message: format!(
                            "the recording has no `{channel}`, so a key that asks how far the target went or turned does not hold: {}",
                            tasks.join(", ")
                        ),
                    });
                }
            }
        }
        issues
    }

    /// Rules that were still changing labels when relabelling was stopped.
    fn undone(&self, rules: &[usize], stretch: &Range<usize>) -> Option<Issue> {
        let texts =
            rules.iter().filter_map(|rule| self.rules.relabels.get(*rule)).map(|rule| format!("`{}`", rule.text));
        let texts: Vec<String> = texts.collect();
        (!texts.is_empty()).then(|| Issue {
            kind: "relabelling_stopped".into(),
            start_s: self.time_s(stretch.start, stretch),
            end_s: self.time_s(stretch.end, stretch),
            channel: String::new(),
            message: format!(
                "relabelling was stopped after {MAX_ROUNDS} rounds, when these rules still changed labels: {}",
                texts.join(", ")
            ),
        })
    }
}
