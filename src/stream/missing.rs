//! Rows that a logger lost: where the stamps leave room for a few rows, these are put back, as drop-outs of the same length would be bridged.

use super::dropouts::{BRIDGED_SECS, channels, fill, moves};
use super::frames::Issue;
use super::measured::Columns;
use super::names;
use super::timebase::{EVEN_WITHIN, MANY_GAPS, ODD_SHARE, believable_step};
use std::borrow::Cow;
use std::ops::Range;

/// Where rows are missing: in front of which row, and how many.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Hole {
    row: usize,
    rows: usize,
}

/// Whether rows are missing that can be put back.
pub fn any(time: &[f64]) -> bool {
    !holes(time).is_empty()
}

/// Holes of one row, or of up to [`BRIDGED_SECS`], in a log that is otherwise even; none in one with so many that its rate changes.
fn holes(time: &[f64]) -> Vec<Hole> {
    let Ok(step) = believable_step(time) else { return vec![] };
    let longest = (BRIDGED_SECS / step * (1.0 + 1e-6)).floor().max(1.0);
    let hole = |(row, pair): (usize, &[f64])| {
        let steps = (pair.last()? - pair.first()?) / step;
        let whole = steps.round();
        let fits = whole >= 2.0 && whole - 1.0 <= longest && (steps - whole).abs() <= EVEN_WITHIN;
        fits.then(|| Hole { row: row + 1, rows: whole as usize - 1 })
    };
    let holes: Vec<Hole> = time.windows(2).enumerate().filter_map(hole).collect();
    let many = holes.len() >= MANY_GAPS && holes.len() as f64 > ODD_SHARE * (time.len() - 1) as f64;
    if many { vec![] } else { holes }
}

/// Puts missing rows back: poses and velocities on a straight line, forces and flags held. The stamps with them, and what was found.
pub fn put_back<'t>(time: &'t [f64], columns: &mut Columns) -> (Cow<'t, [f64]>, Option<Issue>) {
    let holes = holes(time);
    let (Some(first), Some(last)) = (holes.first(), holes.last()) else { return (Cow::Borrowed(time), None) };
    let longer = |values: &[f64]| {
        let mut all = Vec::with_capacity(values.len() + holes.iter().map(|hole| hole.rows).sum::<usize>());
        let mut from = 0;
        for hole in &holes {
            all.extend_from_slice(values.get(from..hole.row).unwrap_or_default());
            all.extend(std::iter::repeat_n(f64::NAN, hole.rows));
            from = hole.row;
        }
        all.extend_from_slice(values.get(from..).unwrap_or_default());
        all
    };
    let mut added = 0;
    let places: Vec<Range<usize>> = holes
        .iter()
        .map(|hole| {
            let start = hole.row + added;
            added += hole.rows;
            start..start + hole.rows
        })
        .collect();
    let mut stamps = longer(time);
    for place in &places {
        let [from, to] = [place.start - 1, place.end].map(|row| stamps[row]);
        let steps = (place.len() + 1) as f64;
        for (step, row) in place.clone().enumerate() {
            stamps[row] = from + (to - from) * (step + 1) as f64 / steps;
        }
    }
    for names in channels(columns).into_values() {
        let moves = names::meaning(names.first().map_or("", String::as_str))
            .is_some_and(|meaning| moves(meaning.dimension, meaning.shape));
        let mut parts: Vec<Vec<f64>> =
            names.iter().filter_map(|name| columns.get(name.as_str())).map(|(_, values)| longer(values)).collect();
        for place in &places {
            fill(&stamps, &mut parts, place, moves);
        }
        for (name, values) in names.iter().zip(parts) {
            if let Some((_, column)) = columns.get_mut(name.as_str()) {
                *column = Cow::Owned(values);
            }
        }
    }
    let [start_s, end_s] = [first.row - 1, last.row].map(|row| time[row]);
    let were = if added == 1 { "1 row is".into() } else { format!("{added} rows are") };
    let in_places = if holes.len() > 1 { format!(" in {} places", holes.len()) } else { String::new() };
    let message =
        format!("{were} missing{in_places} by the stamps; one row, or up to {} ms, is bridged", BRIDGED_SECS * 1e3);
    let issue = Issue { kind: "missing_row".into(), start_s, end_s, channel: String::new(), message };
    (Cow::Owned(stamps), Some(issue))
}
