//! Bodies that are lost for longer than drop-outs are bridged: the frames of the hands that involve the body are left out, those of other hands stay.
//!
//! A hand involves a body that is fixed to it, that it touches by a flag, or that is within [`NEAR`] of one of its fingers on the straight line between the
//! places where it was lost and found again. Where all hands do, the rows become a gap. Elsewhere the pose is interpolated, and stays in the first and last
//! place at the ends of a log.

use crate::clean::dropouts::{fill, interval, moves, unmeasured};
use crate::clean::preprocess::Columns;
use nalgebra::Vector3;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::Range;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::log_channel::{BodyPart, FingerPart, LogChannel};
use teachtree_base::scene::{Body, Scene};
use teachtree_logs::issue::Issue;

/// A body farther than this from a finger, from its bounding ball, has no part in what the hand does, m.
const NEAR: f64 = 0.150;

/// Rows in which a body was lost that some hands involve.
#[derive(Clone, Debug, PartialEq)]
pub struct LostBody {
    /// The rows.
    pub rows: Range<usize>,
    /// The hands.
    pub sides: Vec<Side>,
}

/// Interpolates the poses of lost bodies that not all hands involve, and returns where; each interval is an issue.
pub fn interpolate(time: &[f64], scene: &Scene, columns: &mut Columns, issues: &mut Vec<Issue>) -> Vec<LostBody> {
    let hands: Vec<Side> = Side::BOTH.into_iter().filter(|side| is_measured(scene, columns, *side)).collect();
    let mut lost = vec![];
    for (name, body) in &scene.bodies {
        let channels: Vec<LogChannel> = BodyPart::ALL.into_iter().map(|part| LogChannel::Body(name, part)).collect();
        let channels: Vec<(LogChannel, Vec<Vec<f64>>)> =
            channels.into_iter().filter_map(|channel| Some((channel, values(columns, &channel)?))).collect();
        let all: Vec<&[f64]> = channels.iter().flat_map(|(_, parts)| parts).map(Vec::as_slice).collect();
        if all.is_empty() {
            continue;
        }
        let place = values(columns, &LogChannel::Body(name, BodyPart::Position));
        for rows in unmeasured(time.len(), &all) {
            let body = LostInterval { time, name, body, place: place.as_deref(), rows: rows.clone() };
            let sides: Vec<Side> = hands.iter().copied().filter(|side| body.involves(columns, *side)).collect();
            if sides.len() == hands.len() {
                continue;
            }
            for (channel, _) in &channels {
                put_between(time, columns, channel, &rows);
            }
            let left_out: Vec<String> =
                sides.iter().map(|side| format!("the frames of the {side} hand are left out")).collect();
            let treated = if left_out.is_empty() { "no hand is near it".to_string() } else { left_out.join(", ") };
            let message = format!(
                "{} samples were not measured; {treated}, and the pose is interpolated for the others",
                rows.len()
            );
            issues.push(Issue { message, ..interval(time, name, &rows) });
            lost.push(LostBody { rows, sides });
        }
    }
    lost
}

/// The frames in which a hand involves a lost body, by hand, in order and apart; `rows` are the rows of the frames.
pub fn frames(lost: &[LostBody], rows: &[usize]) -> BTreeMap<Side, Vec<Range<usize>>> {
    let frame = |row: usize| rows.partition_point(|it| *it < row);
    let mut frames: BTreeMap<Side, Vec<Range<usize>>> = BTreeMap::new();
    for LostBody { rows, sides } in lost {
        for side in sides {
            frames.entry(*side).or_default().push(frame(rows.start)..frame(rows.end));
        }
    }
    for intervals in frames.values_mut() {
        intervals.sort_by_key(|frames| frames.start);
        intervals.dedup_by(|next, last| {
            let meets = next.start <= last.end;
            if meets {
                last.end = last.end.max(next.end);
            }
            meets
        });
        intervals.retain(|frames| !frames.is_empty());
    }
    frames
}

/// Whether the log measures a hand of the scene.
fn is_measured(scene: &Scene, columns: &Columns, side: Side) -> bool {
    let mut columns = columns.keys();
    (scene.hands.is_empty() || scene.hands.contains_key(&side))
        && columns.any(|column| column.split('.').next() == Some(side.name()))
}

/// The columns of a channel, where the log has all of them.
fn values(columns: &Columns, channel: &LogChannel) -> Option<Vec<Vec<f64>>> {
    channel.columns().iter().map(|name| columns.get(name.as_str()).map(|(_, values)| values.to_vec())).collect()
}

/// Fills rows of a channel from those before and after.
fn put_between(time: &[f64], columns: &mut Columns, channel: &LogChannel, rows: &Range<usize>) {
    let Some(mut parts) = values(columns, channel) else { return };
    let is_known =
        |row: usize, parts: &[Vec<f64>]| parts.iter().all(|part| part.get(row).is_some_and(|it| !it.is_nan()));
    let (before, after) = (rows.start.checked_sub(1), Some(rows.end).filter(|row| *row < time.len()));
    let (before, after) = (before.filter(|row| is_known(*row, &parts)), after.filter(|row| is_known(*row, &parts)));
    match (before, after) {
        (Some(_), Some(_)) => fill(time, &mut parts, rows, moves(channel.dimension(), channel.shape())),
        (Some(known), None) | (None, Some(known)) => {
            for part in &mut parts {
                let value = part.get(known).copied().unwrap_or_default();
                part.get_mut(rows.clone()).unwrap_or_default().fill(value);
            }
        }
        (None, None) => return,
    }
    for (name, part) in channel.columns().iter().zip(parts) {
        if let Some((_, column)) = columns.get_mut(name.as_str()) {
            *column = Cow::Owned(part);
        }
    }
}

/// A body in the rows in which it was lost.
struct LostInterval<'a> {
    time: &'a [f64],
    name: &'a str,
    body: &'a Body,
    /// Its position, where the log has it.
    place: Option<&'a [Vec<f64>]>,
    rows: Range<usize>,
}

impl LostInterval<'_> {
    /// Whether a hand involves the body; a hand whose fingers have no position may.
    fn involves(&self, columns: &Columns, side: Side) -> bool {
        if self.body.fixed_to == Some(side) {
            return true;
        }
        let touches = Finger::ALL.into_iter().any(|finger| {
            let flags = columns.get(LogChannel::Touch(side, finger, self.name).to_string().as_str());
            flags.is_some_and(|(_, flags)| flags.get(self.rows.clone()).unwrap_or_default().contains(&1.0))
        });
        let fingers: Vec<Vec<Vec<f64>>> = Finger::ALL
            .into_iter()
            .filter_map(|finger| values(columns, &LogChannel::Finger(side, finger, FingerPart::Position)))
            .collect();
        let reach = self.body.bounding_radius() + NEAR;
        let around = self.rows.start.saturating_sub(1)..(self.rows.end + 1).min(self.time.len());
        let is_near = |finger: &Vec<Vec<f64>>| {
            around.clone().any(|row| match (vector(finger, row), self.place_at(row)) {
                (Some(finger), Some(body)) => (finger - body).norm() < reach,
                // A finger that is lost too is not known to be elsewhere.
                _ => true,
            })
        };
        touches || fingers.is_empty() || fingers.iter().any(is_near)
    }

    /// Returns the position of the body at a row, interpolated while it is lost.
    fn place_at(&self, row: usize) -> Option<Vector3<f64>> {
        let place = self.place?;
        if let Some(known) = vector(place, row) {
            return Some(known);
        }
        let before = self.rows.start.checked_sub(1).and_then(|row| Some((row, vector(place, row)?)));
        let after = vector(place, self.rows.end).map(|it| (self.rows.end, it));
        match (before, after) {
            (Some((from, one)), Some((to, other))) => {
                let at = |row: usize| self.time.get(row).copied().unwrap_or_default();
                Some(one + (other - one) * ((at(row) - at(from)) / (at(to) - at(from))))
            }
            (known, other) => known.or(other).map(|(_, place)| place),
        }
    }
}

/// A vector at a row, where it was measured.
fn vector(columns: &[Vec<f64>], row: usize) -> Option<Vector3<f64>> {
    let [x, y, z] = columns else { return None };
    let found = Vector3::new(*x.get(row)?, *y.get(row)?, *z.get(row)?);
    (!found.iter().any(|part| part.is_nan())).then_some(found)
}
