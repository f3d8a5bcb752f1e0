//! The truth about a recording: its own label columns or a label file in, named spans of each track out.
//!
//! Invariants: the spans of a list are in order and apart; time that no span of primitives covers is not scored. Tasks are listed in full:
//! time without a span of a task has no task.

use super::name_map::{KnownNames, MASK, NameMap, SEPARATE};
use crate::{TrackId, UNKNOWN};
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_base::recording::{Event, Recording};
use teachtree_logs::read::labels::{Interval, LabelKind, Labels};

/// The kind of event that begins a task; its first subject is the hand.
const TASK_STARTED: &str = "task_started";

/// The true labels of a recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Truth {
    /// The tracks about which something is known, left, right, both.
    pub tracks: Vec<TrackTruth>,
}

/// The true labels of a track.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackTruth {
    /// Whose it is.
    pub who: TrackId,
    /// The primitives.
    pub primitives: Vec<Span>,
    /// The tasks; `None` when nothing is known about tasks.
    pub tasks: Option<Vec<Span>>,
}

/// A named stretch of time.
#[derive(Clone, Debug, PartialEq)]
pub struct Span {
    /// The names that are right here, at least one.
    pub names: Vec<String>,
    /// Start, s.
    pub start_s: f64,
    /// End, s.
    pub end_s: f64,
}

impl Span {
    /// The displayed name of the alternatives: `Move|Approach`.
    pub fn name(&self) -> String {
        self.names.join("|")
    }
}

const TRACKS: [TrackId; 3] = [TrackId::Hand(Side::Left), TrackId::Hand(Side::Right), TrackId::Both];

impl Truth {
    /// The truth that a recording carries; `None` when it has no labels. Where both hands have a column, its empty cells are `separate`.
    pub fn of_recording(recording: &Recording, map: &NameMap) -> Option<Self> {
        let tracks = TRACKS.into_iter().filter_map(|who| {
            let column = |what: &str| recording.labels.get(&format!("{who}.{what}"));
            let primitives = column("label").map(|texts| spans(&recording.time, texts, &[], empty(who), map));
            let starts = task_starts(&recording.events, who);
            let tasks = column("task").map(|texts| spans(&recording.time, texts, &starts, None, map));
            let known = primitives.as_ref().is_some_and(|spans| !spans.is_empty()) || tasks.is_some();
            known.then(|| TrackTruth { who, primitives: primitives.unwrap_or_default(), tasks })
        });
        Some(Self { tracks: tracks.collect() }).filter(|truth| !truth.tracks.is_empty())
    }

    /// The truth of a label file. Rows that name no track are about `track`.
    ///
    /// # Errors
    /// A row whose track is not known, or whose name is neither in the map nor in the rules.
    pub fn of_labels(
        labels: &Labels,
        track: Option<TrackId>,
        map: &NameMap,
        known: &KnownNames,
    ) -> Result<Self, InputError> {
        let mut tracks: Vec<TrackTruth> = Vec::new();
        for interval in &labels.intervals {
            let place = format!("{} {}", labels.file, interval.place);
            let who = interval.track.or(track).ok_or_else(|| {
                InputError::new(&place, "the row names no track, and the recording has several")
                    .help("add a column `track`, or name one with --track left, right or both")
            })?;
            let names = match map.get(&interval.name) {
                Some(names) => names.to_vec(),
                // Something was handled, in no task of the rules.
                None if interval.kind == LabelKind::Task && interval.name == UNKNOWN => Vec::new(),
                None => vec![
                    checked_name(interval, known)
                        .map_err(|message| known.advise(InputError::new(&place, message), &interval.name))?,
                ],
            };
            let at = tracks.iter().position(|truth| truth.who == who).unwrap_or_else(|| {
                tracks.push(TrackTruth { who, primitives: Vec::new(), tasks: None });
                tracks.len() - 1
            });
            let Some(truth) = tracks.get_mut(at) else { continue };
            let list = match interval.kind {
                LabelKind::Primitive => &mut truth.primitives,
                LabelKind::Task => truth.tasks.get_or_insert_default(),
            };
            if !names.is_empty() {
                list.push(Span { names, start_s: interval.start_s, end_s: interval.end_s });
            }
        }
        tracks.sort_by_key(|truth| truth.who);
        Ok(Self { tracks })
    }
}

/// The meaning of an empty cell: unknown, or no coordination.
fn empty(who: TrackId) -> Option<&'static str> {
    (who == TrackId::Both).then_some(SEPARATE)
}

/// The name of an interval when it is one of ours.
fn checked_name(interval: &Interval, known: &KnownNames) -> Result<String, String> {
    let (names, what) = match interval.kind {
        LabelKind::Primitive => (&known.primitives, "primitive"),
        LabelKind::Task => (&known.tasks, "task"),
    };
    if names.contains(&interval.name) {
        return Ok(interval.name.clone());
    }
    Err(format!(
        "found `{}`, expected a {what} of the rules or a name in the map (`{MASK}` leaves its time out)",
        interval.name
    ))
}

/// The starts of the tasks of a hand, s.
fn task_starts(events: &[Event], who: TrackId) -> Vec<f64> {
    let hand = who.to_string();
    let of_hand = |event: &&Event| event.kind == TASK_STARTED && event.subjects.first() == Some(&hand);
    events.iter().filter(of_hand).map(|event| event.time_s).collect()
}

/// The runs of equal texts, cut at `cuts`. An empty text is `empty`, or no span.
fn spans(time: &[f64], texts: &[String], cuts: &[f64], empty: Option<&str>, map: &NameMap) -> Vec<Span> {
    let rows: Vec<(f64, &str)> = time.iter().copied().zip(texts.iter().map(String::as_str)).collect();
    let goes_on = |one: &(f64, &str), next: &(f64, &str)| {
        one.1 == next.1 && !cuts.iter().any(|cut| one.0 < *cut && *cut <= next.0)
    };
    let last_step = match time {
        [.., one, two] => two - one,
        _ => 0.0,
    };
    let mut spans = Vec::new();
    let mut next_row = 0;
    for run in rows.chunk_by(goes_on) {
        next_row += run.len();
        let Some(&(start_s, text)) = run.first() else { continue };
        let end_s = time.get(next_row).copied().or_else(|| time.last().map(|last| last + last_step));
        let Some(name) = Some(text).filter(|text| !text.is_empty()).or(empty) else { continue };
        let names = map.get(name).map_or_else(|| vec![name.to_string()], <[String]>::to_vec);
        if !names.is_empty() {
            spans.push(Span { names, start_s, end_s: end_s.unwrap_or(start_s) });
        }
    }
    spans
}
