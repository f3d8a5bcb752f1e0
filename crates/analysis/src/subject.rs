//! The subject of segments and tasks: the object that a hand handles, and the partner, a body that the object is in or against.
//!
//! Per frame the log says which object is the hand's target, whether the hand touches it, and which body is the partner
//! (`base::channels::HANDLING`). The object of a segment is the one touched on most of its frames; where the hand touches none, the one
//! that it touches next, else the one nearest to its fingertips at the end. Where the hand opens, it is the one touched as it
//! begins to. The partner is the body that is it for most of the time.

use super::TrackId;
use super::labeled_span::LabeledSpan;
use super::measures::{TARGET, together};
use std::collections::BTreeMap;
use std::ops::Range;
use teachtree_base::channels::{PARTNER, TARGET_INSIDE, TARGET_TOUCHED};
use teachtree_base::hands::Side;
use teachtree_frames::frames::{ColumnKey, Frames};
use teachtree_frames::spilled_columns::Series;

/// The object of a segment or task, and its partner.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Subject {
    /// The object that the hand handles; `None` where the log has no object, or does not say which.
    pub object: Option<String>,
    /// The body that the object is in or against: the body of a socket, the object of the other hand, a wall, an object that carries it.
    pub partner: Option<String>,
}

impl Subject {
    /// ` right_cube`, ` peg (holder)` after a name; nothing without an object.
    pub fn suffix(&self) -> String {
        match (&self.object, &self.partner) {
            (Some(object), Some(partner)) => format!(" {object} ({partner})"),
            (Some(object), None) => format!(" {object}"),
            (None, _) => String::new(),
        }
    }
}

/// Frames on which a hand handles one object in one way.
#[derive(Clone, Debug, PartialEq)]
struct Run<'a> {
    frames: Range<usize>,
    object: Option<&'a str>,
    touched: bool,
    partner: Option<&'a str>,
    /// Whether the object is in a socket of the partner.
    inside: bool,
}

/// The objects that the hands handle over a whole log.
pub(super) struct HandledObjects<'a> {
    hands: BTreeMap<Side, Vec<Run<'a>>>,
}

/// A subject with what speaks for it.
#[derive(Clone, Copy, Debug, Default)]
struct SubjectEvidence<'a> {
    object: Option<&'a str>,
    partner: Option<&'a str>,
    inside: bool,
    touched: bool,
}

impl From<SubjectEvidence<'_>> for Subject {
    fn from(found: SubjectEvidence) -> Self {
        Self { object: found.object.map(str::to_string), partner: found.partner.map(str::to_string) }
    }
}

impl<'a> HandledObjects<'a> {
    /// Reads what the hands handle; nothing is known of a hand without the columns.
    pub fn new(frames: &'a Frames, series: &dyn Series) -> Self {
        let hands = frames.layout.hands.iter().filter_map(|hand| Some((hand.side, runs(frames, series, hand.side)?)));
        Self { hands: hands.collect() }
    }

    /// Returns the subject of a segment of a track in the gap-free stretch `stretch`. A hand that opens may brush past another object.
    pub fn of_segment(&self, who: TrackId, opens: bool, frames: &Range<usize>, stretch: &Range<usize>) -> Subject {
        match who {
            TrackId::Hand(side) => self.found(side, opens, frames, stretch).into(),
            TrackId::Both => {
                let [left, right] = Side::BOTH.map(|side| self.found(side, opens, frames, stretch));
                match (left.object, right.object) {
                    (Some(one), Some(other)) if one != other => {
                        // The object that is in the other one is handled, the other is its partner.
                        let enters = right.inside && right.partner == Some(one);
                        let (object, partner) = if enters { (other, one) } else { (one, other) };
                        Subject { object: Some(object.to_string()), partner: Some(partner.to_string()) }
                    }
                    (one, other) => {
                        let found = SubjectEvidence {
                            object: one.or(other),
                            partner: left.partner.or(right.partner),
                            ..SubjectEvidence::default()
                        };
                        found.into()
                    }
                }
            }
        }
    }

    /// What a task of a hand is about: the object of its key segments that last the longest, and the partner among those of them that have
    /// one. Without a key segment, or with a touch in other segments only, all segments count.
    pub fn of_task(
        &self,
        side: Side,
        pieces: &[LabeledSpan],
        is_key: impl Fn(&LabeledSpan) -> bool,
        opens: impl Fn(&LabeledSpan) -> bool,
        stretch: &Range<usize>,
    ) -> Subject {
        let found = |piece: &LabeledSpan| (self.found(side, opens(piece), &piece.frames, stretch), piece.frames.len());
        let is_touched = |all: &[(SubjectEvidence, usize)]| all.iter().any(|(found, _)| found.touched);
        let mut all: Vec<(SubjectEvidence, usize)> = pieces.iter().filter(|piece| is_key(piece)).map(found).collect();
        if !is_touched(&all) {
            let of_all: Vec<(SubjectEvidence, usize)> = pieces.iter().map(found).collect();
            // What is missed, or falls by itself, is touched in none of them.
            if all.is_empty() || is_touched(&of_all) {
                all = of_all;
            }
        }
        if is_touched(&all) {
            all.retain(|(found, _)| found.touched);
        }
        let object =
            most(all.iter().filter_map(|(found, frames)| Some((found.object?, *frames)))).map(|(name, _)| name);
        all.retain(|(found, _)| found.object == object);
        let partner = most(all.iter().filter_map(|(found, frames)| Some((found.partner?, *frames))));
        SubjectEvidence { object, partner: partner.map(|(name, _)| name), ..SubjectEvidence::default() }.into()
    }

    fn found(&self, side: Side, opens: bool, frames: &Range<usize>, stretch: &Range<usize>) -> SubjectEvidence<'a> {
        let Some(runs) = self.hands.get(&side) else { return SubjectEvidence::default() };
        let within = within(runs, frames);
        let length = |run: &Run| run.frames.end.min(frames.end) - run.frames.start.max(frames.start);
        // The last touch may be that of the frame before.
        let before = frames.start.checked_sub(1).filter(|before| *before >= stretch.start);
        let begins = before.into_iter().chain([frames.start]).filter(|_| opens).filter_map(|frame| at(runs, frame));
        let held = begins.filter(|run| run.touched).find_map(|run| run.object);
        let touched = || within.iter().filter(|run| run.touched && held.is_none_or(|held| run.object == Some(held)));
        let Some((object, lasted)) = most(touched().filter_map(|run| Some((run.object?, length(run))))) else {
            let next = (frames.end < stretch.end).then(|| at(runs, frames.end)).flatten().filter(|run| run.touched);
            let object = held.or_else(|| next.or_else(|| within.last()).and_then(|run| run.object));
            return SubjectEvidence { object, ..SubjectEvidence::default() };
        };
        let own = || touched().filter(|run| run.object == Some(object));
        let partner = most(own().filter_map(|run| Some((run.partner?, length(run)))))
            .filter(|(_, share)| 2 * share >= lasted)
            .map(|(partner, _)| partner);
        let inside = own().filter(|run| run.inside && run.partner == partner).map(length).sum::<usize>();
        SubjectEvidence {
            object: Some(object),
            partner,
            inside: partner.is_some() && 2 * inside >= lasted,
            touched: true,
        }
    }
}

/// The name with the greatest sum, and the sum; of equal ones the first.
fn most<'a>(counted: impl Iterator<Item = (&'a str, usize)>) -> Option<(&'a str, usize)> {
    let mut sums: Vec<(&str, usize)> = Vec::new();
    for (name, count) in counted {
        match sums.iter_mut().find(|(known, _)| *known == name) {
            Some((_, sum)) => *sum += count,
            None => sums.push((name, count)),
        }
    }
    sums.into_iter().rev().max_by_key(|(_, sum)| *sum)
}

/// The runs that share a frame with an interval.
fn within<'r, 'a>(runs: &'r [Run<'a>], frames: &Range<usize>) -> &'r [Run<'a>] {
    let start = runs.partition_point(|run| run.frames.end <= frames.start);
    let end = runs.partition_point(|run| run.frames.start < frames.end);
    runs.get(start..end).unwrap_or(&[])
}

fn at<'r, 'a>(runs: &'r [Run<'a>], frame: usize) -> Option<&'r Run<'a>> {
    within(runs, &(frame..frame + 1)).first()
}

/// Returns the objects that a hand handles, from its columns; `None` without the column of the target.
fn runs<'a>(frames: &'a Frames, series: &dyn Series, side: Side) -> Option<Vec<Run<'a>>> {
    let key = |name: &str| {
        let key = ColumnKey { channel: frames.channel(name)?, side: Some(side), slot: 0, component: 0 };
        series.has(key).then_some(key)
    };
    let target = key(TARGET)?;
    let others = [TARGET_TOUCHED, PARTNER, TARGET_INSIDE].map(key);
    let mut runs: Vec<Run> = Vec::new();
    for chunk in together(&(0..frames.len)) {
        let targets = series.part(target, chunk.clone());
        let [touched, partner, inside] =
            others.map(|key| key.map(|key| series.part(key, chunk.clone())).unwrap_or_default());
        for (at, frame) in chunk.enumerate() {
            let flag = |column: &[f64]| column.get(at).is_some_and(|value| *value > 0.5);
            let run = Run {
                frames: frame..frame + 1,
                object: named(&frames.objects, targets.get(at)),
                touched: flag(&touched),
                partner: named(&frames.bodies, partner.get(at)),
                inside: flag(&inside),
            };
            match runs.last_mut() {
                Some(last)
                    if (last.object, last.touched, last.partner, last.inside)
                        == (run.object, run.touched, run.partner, run.inside) =>
                {
                    last.frames.end = run.frames.end;
                }
                _ => runs.push(run),
            }
        }
    }
    Some(runs)
}

/// The name with the index that a column holds; `None` for -1.
fn named<'a>(names: &'a [String], index: Option<&f64>) -> Option<&'a str> {
    let index = index.filter(|index| **index >= 0.0)?;
    // Bodies are counted in column form; a cast from f64 saturates.
    names.get(*index as usize).map(String::as_str)
}
