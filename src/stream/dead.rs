//! Dead force sensors: a finger's force that keeps exactly one value while the hand moves is no contact.
//!
//! A working sensor has noise, and a contact force changes when the hand moves. A force that is repeated bit by bit for
//! [`STUCK_SECS`] while the fingertip moves, or while another force changes, was not measured; nor was a single component
//! that is repeated while the others change. The whole vector then reads zero, so that a dead sensor is never one long contact.

use super::frames::Issue;
use super::names;
use crate::base::units::Dimension;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::Range;

/// How long a value must be repeated, s.
const STUCK_SECS: f64 = 1.0;
/// A channel with such a run is dead all along when most of its samples are repeated for this long, s: a sensor that updates now and then.
const LAZY_SECS: f64 = 0.25;
/// Repeated values nearer to zero than this are left alone: a sensor that rounds reads small constants. N.
const STUCK_ABOVE: f64 = 0.05;
/// How far a fingertip must get in that time, m.
const MOVED: f64 = 0.010;
/// Or how much another force must change, N.
const CHANGED: f64 = 0.1;
/// How much the other components must change for one to be stuck alone, as a share of its value: a steady grip, rounded, repeats itself too.
const CHANGED_SHARE: f64 = 0.05;

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
    let found: Vec<(String, Vec<Stuck>)> = channels
        .iter()
        .map(|channel| (channel.clone(), stuck(time, columns, channel, &channels)))
        .filter(|(_, intervals)| !intervals.is_empty())
        .collect();
    for (channel, intervals) in found {
        for Stuck { rows, value_at } in &intervals {
            let value: Vec<String> = components(columns, &channel)
                .map(|values| values.get(*value_at).map_or_else(String::new, f64::to_string))
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
                for Stuck { rows, .. } in &intervals {
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

/// An interval in which a sensor is dead, and a row that shows the value it keeps.
struct Stuck {
    rows: Range<usize>,
    value_at: usize,
}

/// The rows in which the sensor behind a channel is dead; all rows, when it is dead in more than half of them.
fn stuck(time: &[f64], columns: &Columns, channel: &str, forces: &[String]) -> Vec<Stuck> {
    let parts: Vec<&[f64]> = components(columns, channel).collect();
    let [x, y, z] = parts.as_slice() else { return vec![] };
    let position = channel.strip_suffix(".force").map(|finger| format!("{finger}.position")).unwrap_or_default();
    let others = || forces.iter().filter(|other| *other != channel).flat_map(|other| components(columns, other));
    let moves = |rows: &Range<usize>| {
        components(columns, &position).any(|values| range(values, rows) > MOVED)
            || others().any(|values| range(values, rows) > CHANGED)
    };
    let mut found: Vec<Range<usize>> = repeats(time, [x, y, z], STUCK_SECS).into_iter().filter(moves).collect();
    for values in [x, y, z] {
        let alone = |rows: &Range<usize>| {
            let value = values.get(rows.start).map_or(0.0, |value| value.abs());
            parts.iter().any(|part| range(part, rows) > CHANGED.max(CHANGED_SHARE * value))
        };
        found.extend(repeats(time, [values], STUCK_SECS).into_iter().filter(alone));
    }
    found.sort_by_key(|rows| rows.start);
    let longest = found.iter().max_by_key(|rows| rows.len()).map_or(0, |rows| rows.start);
    let mut joined: Vec<Stuck> = vec![];
    for rows in found {
        match joined.last_mut() {
            Some(last) if rows.start <= last.rows.end => last.rows.end = last.rows.end.max(rows.end),
            _ => joined.push(Stuck { value_at: rows.start, rows }),
        }
    }
    let stuck: usize = joined.iter().map(|stuck| stuck.rows.len()).sum();
    let lazy: usize = repeats(time, [x, y, z], LAZY_SECS).iter().map(Range::len).sum();
    if !joined.is_empty() && stuck.max(lazy) * 2 > time.len() {
        joined = vec![Stuck { rows: 0..time.len(), value_at: longest }];
    }
    joined
}

/// How far values are apart within some rows.
fn range(values: &[f64], rows: &Range<usize>) -> f64 {
    let values = values.get(rows.clone()).unwrap_or_default();
    let (low, high) = values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(*value), high.max(*value)));
    high - low
}

/// Runs of rows in which all the columns keep exactly one value, for at least `secs` and far enough from zero.
///
/// A force that comes out of an exact zero and returns to one was switched on and off, as a script does: no sensor dies so neatly.
fn repeats<const N: usize>(time: &[f64], columns: [&[f64]; N], secs: f64) -> Vec<Range<usize>> {
    let at = |row: usize| columns.map(|column| column.get(row).copied().unwrap_or(f64::NAN));
    let norm = |row: usize| at(row).iter().map(|value| value * value).sum::<f64>().sqrt();
    let mut runs = vec![];
    let mut start = 0;
    for row in 0..time.len() {
        let next = row + 1;
        if next < time.len() && at(row).map(f64::to_bits) == at(next).map(f64::to_bits) {
            continue;
        }
        let lasted = time.get(row).zip(time.get(start)).map_or(0.0, |(to, from)| to - from);
        let switched =
            start > 0 && next < time.len() && norm(start - 1) < f64::MIN_POSITIVE && norm(next) < f64::MIN_POSITIVE;
        if lasted >= secs && norm(start) >= STUCK_ABOVE && !switched {
            runs.push(start..next);
        }
        start = next;
    }
    runs
}
