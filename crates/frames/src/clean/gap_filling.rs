//! Rows that a logger lost: where the stamps leave room for a few rows, these are put back, as drop-outs of the same length would be bridged.

use crate::clean::dropouts::{self, BRIDGED_SECS, fill, moves};
use crate::clean::preprocess::channel_of;
use crate::clean::timebase::{self, EVEN_WITHIN, MANY_GAPS, ODD_SHARE, believable_step};
use std::collections::BTreeMap;
use std::ops::Range;
use teachtree_base::recording::Recording;
use teachtree_logs::issue::{Issue, IssueKind};
use teachtree_logs::names;

/// A gap: the index of the row after it, and the number of missing rows.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LostRows {
    row: usize,
    rows: usize,
}

/// Whether rows are missing that can be put back.
pub fn any(time: &[f64]) -> bool {
    !lost(time).is_empty()
}

/// Holes of one row, or of up to [`BRIDGED_SECS`], in a log that is otherwise even; none if they are so frequent that the rate changes.
fn lost(time: &[f64]) -> Vec<LostRows> {
    let Ok(step) = believable_step(time) else { return vec![] };
    let longest = (BRIDGED_SECS / step * (1.0 + 1e-6)).floor().max(1.0);
    let lost_rows = |(row, pair): (usize, &[f64])| {
        let steps = (pair.last()? - pair.first()?) / step;
        let whole = steps.round();
        let fits = whole >= 2.0 && whole - 1.0 <= longest && (steps - whole).abs() <= EVEN_WITHIN;
        fits.then(|| LostRows { row: row + 1, rows: whole as usize - 1 })
    };
    let lost: Vec<LostRows> = time.windows(2).enumerate().filter_map(lost_rows).collect();
    let many = lost.len() >= MANY_GAPS && lost.len() as f64 > ODD_SHARE * (time.len() - 1) as f64;
    // Rounded stamps leave no room for rows.
    if many || lost.is_empty() || timebase::rounded(time).is_some() { vec![] } else { lost }
}

/// Inserts missing rows: poses and velocities are interpolated linearly; forces, flags and texts keep their last value. A channel that was not measured on
/// both sides of the lost rows is not measured in them. Returns the issue.
pub fn fill_gaps(recording: &mut Recording) -> Option<Issue> {
    let lost = lost(&recording.time);
    let (first, last) = (lost.first()?, lost.last()?);
    let [start_s, end_s] = [first.row - 1, last.row].map(|row| recording.time[row]);
    let mut added = 0;
    let places: Vec<Range<usize>> = lost
        .iter()
        .map(|lost_rows| {
            let start = lost_rows.row + added;
            added += lost_rows.rows;
            start..start + lost_rows.rows
        })
        .collect();
    let mut stamps = longer(&recording.time, &lost, |_| f64::NAN);
    for place in &places {
        let (from, to) = (stamps[place.start - 1], stamps[place.end]);
        let steps = (place.len() + 1) as f64;
        for (step, row) in place.clone().enumerate() {
            stamps[row] = from + (to - from) * (step + 1) as f64 / steps;
        }
    }
    let mut channels: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    for (at, name) in recording.columns.keys().enumerate() {
        channels.entry(channel_of(name).to_string()).or_default().push(at);
    }
    for members in channels.into_values() {
        let name = |at: &usize| recording.columns.get_index(*at).map_or("", |(name, _)| name.as_str());
        let moves =
            members.first().and_then(|at| names::meaning(name(at))).is_some_and(|it| moves(it.dimension, it.shape));
        let largest: Vec<f64> = members.iter().map(|at| dropouts::bound(name(at)).0).collect();
        let mut parts: Vec<Vec<f64>> =
            members.iter().map(|at| longer(&recording.columns[*at].values, &lost, |_| f64::NAN)).collect();
        for place in &places {
            let measured = |row: usize| parts.iter().zip(&largest).all(|(part, largest)| part[row].abs() <= *largest);
            if measured(place.start - 1) && measured(place.end) {
                fill(&stamps, &mut parts, place, moves);
            }
        }
        for (at, values) in members.iter().zip(parts) {
            recording.columns[*at].values = values;
        }
    }
    for texts in recording.labels.values_mut() {
        *texts = longer(texts, &lost, Clone::clone);
    }
    recording.time = stamps;
    let were = if added == 1 { "1 row is".into() } else { format!("{added} rows are") };
    let in_places = if lost.len() > 1 { format!(" in {} places", lost.len()) } else { String::new() };
    let message =
        format!("{were} missing{in_places} by the stamps; one row, or up to {} ms, is bridged", BRIDGED_SECS * 1e3);
    Some(Issue { kind: IssueKind::MISSING_ROW, start_s, end_s, channel: String::new(), message })
}

/// Values with room for the missing ones, in which stands what is made of the one before.
fn longer<T: Clone>(values: &[T], lost: &[LostRows], within: impl Fn(&T) -> T) -> Vec<T> {
    let mut all = Vec::with_capacity(values.len() + lost.iter().map(|lost_rows| lost_rows.rows).sum::<usize>());
    let mut from = 0;
    for lost_rows in lost {
        all.extend_from_slice(values.get(from..lost_rows.row).unwrap_or_default());
        if let Some(before) = values.get(lost_rows.row - 1).map(&within) {
            all.extend(std::iter::repeat_n(before, lost_rows.rows));
        }
        from = lost_rows.row;
    }
    all.extend_from_slice(values.get(from..).unwrap_or_default());
    all
}
