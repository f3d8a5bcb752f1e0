//! Dead force sensors: a finger's force that keeps exactly one value while the hand moves is no contact.
//!
//! A working sensor has noise, and a contact force changes when the hand moves. A value that is repeated bit by bit for
//! [`STUCK_SECS`] while the fingertip moves, or while another force changes, was not measured. The whole vector then reads zero, so that a
//! dead sensor is never one long contact.

use super::frames::Issue;
use super::names;
use crate::base::units::Dimension;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::Range;

/// How long a value must be repeated, s.
const STUCK_SECS: f64 = 1.0;
/// Repeated values nearer to zero than this are left alone: a sensor that rounds reads small constants. N.
const STUCK_ABOVE: f64 = 0.05;
/// How far a fingertip must get in that time, m.
const MOVED: f64 = 0.010;
/// Or how much another force must change, N.
const CHANGED: f64 = 0.1;

type Columns<'a> = BTreeMap<&'a str, (Dimension, Cow<'a, [f64]>)>;

/// Puts zeros where a force sensor of a finger is dead, and tells where.
pub fn silence(time: &[f64], columns: &mut Columns) -> Vec<Issue> {
    let channels: Vec<String> = columns
        .keys()
        .filter_map(|name| names::meaning(name))
        .filter(|meaning| {
            meaning.dimension == Dimension::FORCE && meaning.component == 0 && meaning.bodies == [None, None]
        })
        .map(|meaning| meaning.channel.to_string())
        .collect();
    let mut issues = vec![];
    // All are judged before the first is silenced: each is a witness against the others.
    let found: Vec<(String, Vec<Range<usize>>)> = channels
        .iter()
        .map(|channel| (channel.clone(), stuck(time, columns, channel, &channels)))
        .filter(|(_, rows)| !rows.is_empty())
        .collect();
    for (channel, intervals) in found {
        for rows in &intervals {
            let value: Vec<String> = components(columns, &channel)
                .map(|values| values.get(rows.start).map_or_else(String::new, f64::to_string))
                .collect();
            let at = |row: usize| time.get(row).or(time.last()).copied().unwrap_or_default();
            issues.push(Issue {
                kind: "stuck_sensor".into(),
                start_s: at(rows.start),
                end_s: at(rows.end),
                channel: channel.clone(),
                message: format!(
                    "the force stays at exactly ({}) N while the hand moves; it counts as no contact",
                    value.join(", ")
                ),
            });
        }
        for component in ["x", "y", "z"] {
            if let Some((_, values)) = columns.get_mut(format!("{channel}.{component}").as_str()) {
                let values = values.to_mut();
                for rows in &intervals {
                    if let Some(values) = values.get_mut(rows.clone()) {
                        values.fill(0.0);
                    }
                }
            }
        }
    }
    issues
}

fn components<'a>(columns: &'a Columns, channel: &str) -> impl Iterator<Item = &'a [f64]> {
    ["x", "y", "z"]
        .into_iter()
        .filter_map(move |component| columns.get(format!("{channel}.{component}").as_str()))
        .map(|(_, values)| values.as_ref())
}

/// The rows in which the sensor behind a channel is dead; all rows, when it is dead in more than half of them.
fn stuck(time: &[f64], columns: &Columns, channel: &str, forces: &[String]) -> Vec<Range<usize>> {
    let position = channel.strip_suffix(".force").map(|finger| format!("{finger}.position")).unwrap_or_default();
    let range = |values: &[f64], rows: &Range<usize>| {
        let values = values.get(rows.clone()).unwrap_or_default();
        let (low, high) = values
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(*value), high.max(*value)));
        high - low
    };
    let witnessed = |rows: &Range<usize>| {
        components(columns, &position).any(|values| range(values, rows) > MOVED)
            || forces
                .iter()
                .filter(|other| *other != channel)
                .any(|other| components(columns, other).any(|values| range(values, rows) > CHANGED))
    };
    let mut rows: Vec<Range<usize>> =
        components(columns, channel).flat_map(|values| repeats(time, values)).filter(|rows| witnessed(rows)).collect();
    rows.sort_by_key(|rows| rows.start);
    let mut joined: Vec<Range<usize>> = vec![];
    for rows in rows {
        match joined.last_mut() {
            Some(last) if rows.start <= last.end => last.end = last.end.max(rows.end),
            _ => joined.push(rows),
        }
    }
    let dead: usize = joined.iter().map(Range::len).sum();
    if dead * 2 > time.len() {
        joined = Vec::from([0..time.len()]);
    }
    joined
}

/// Runs of rows with exactly the same value, long enough and far enough from zero.
///
/// A value that comes out of an exact zero and returns to one was switched on and off, as a script does: no sensor dies so neatly.
fn repeats(time: &[f64], values: &[f64]) -> Vec<Range<usize>> {
    let mut runs = vec![];
    let mut start = 0;
    for run in values.chunk_by(|value, next| value.to_bits() == next.to_bits()) {
        let rows = start..start + run.len();
        start = rows.end;
        let value = run.first().map_or(0.0, |value| value.abs());
        let lasted = time.get(rows.end - 1).zip(time.get(rows.start)).map_or(0.0, |(to, from)| to - from);
        let zero = |row: Option<usize>| {
            row.and_then(|row| values.get(row)).is_some_and(|value| value.abs() < f64::MIN_POSITIVE)
        };
        let switched = zero(rows.start.checked_sub(1)) && zero(Some(rows.end));
        if lasted >= STUCK_SECS && value >= STUCK_ABOVE && !switched {
            runs.push(rows);
        }
    }
    runs
}
