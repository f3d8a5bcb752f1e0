//! Where the bodies of a bound log rest: at the beginning, and where a hand left them.

use super::quantiles::median;
use super::recorded::{paths, tool, vector};
use nalgebra::Vector3;
use std::collections::BTreeMap;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::recording::Recording;

/// What stays within this rests, m, …
const REST_M: f64 = 0.003;
/// … for this long, s.
const REST_S: f64 = 0.3;
/// What is lower by more than this is below a place, m.
const LOWER_M: f64 = 0.004;
/// What moves less than this never moves, m.
const STILL_M: f64 = 0.01;
/// The maximum distance of a held body from the hand, m.
const HELD_M: f64 = 0.3;
/// The most rests of a body.
const MAX_RESTS: usize = 20;

/// A place where a body rests.
#[derive(Clone, Debug, PartialEq)]
pub struct Rest {
    /// The body.
    pub body: String,
    /// Where it is, m, z up.
    pub at: [f64; 3],
    /// How far beside this place the body is at least while it is lower, m.
    pub clear_m: f64,
    /// Where all other bodies are then, m.
    pub others: BTreeMap<String, [f64; 3]>,
}

/// The rests of all bodies that move. Where nothing shows when a hand holds them, those at the beginning and at the end of the log.
pub fn rests(recording: &Recording) -> Vec<Rest> {
    let paths: BTreeMap<&str, Vec<Option<Vector3<f64>>>> = paths(recording).collect();
    let holders: Vec<Holder> = Side::BOTH.into_iter().filter_map(|side| Holder::of(recording, side)).collect();
    let mut rests = vec![];
    for (name, path) in &paths {
        let Some(start) = path.iter().flatten().next() else { continue };
        if path.iter().flatten().all(|at| (at - start).norm() <= STILL_M) {
            continue;
        }
        let is_held = |row: usize| holders.iter().any(|holder| holder.holds(row, path.get(row).copied().flatten()));
        for rows in still(&recording.time, path, &is_held, holders.is_empty()).into_iter().take(MAX_RESTS) {
            let row = rows.start + rows.len() / 2;
            let Some(at) = path[row].or(path[rows.start]) else { continue };
            let others = paths.iter().filter(|(other, _)| *other != name);
            let place = |path: &[Option<Vector3<f64>>]| path[..=row].iter().rev().flatten().next().copied();
            let others = others.filter_map(|(other, path)| Some(((*other).to_string(), place(path)?.into())));
            let lower = path.iter().flatten().filter(|there| there.z < at.z - LOWER_M);
            let clear_m = lower.map(|there| (there - at).xy().norm()).fold(f64::INFINITY, f64::min);
            rests.push(Rest { body: (*name).to_string(), at: at.into(), clear_m, others: others.collect() });
        }
    }
    rests
}

/// How far beside the middle of its fingers a hand usually holds each body that it carries, horizontally, m.
pub fn held_beside_m(recording: &Recording) -> BTreeMap<String, f64> {
    let holders: Vec<Holder> = Side::BOTH.into_iter().filter_map(|side| Holder::of(recording, side)).collect();
    let beside = |(name, path): (&str, Vec<Option<Vector3<f64>>>)| {
        let start = path.iter().flatten().next().copied()?;
        let carried = path.iter().enumerate().filter(|(_, at)| at.is_some_and(|at| (at - start).norm() > STILL_M));
        let distances =
            carried.flat_map(|(row, at)| holders.iter().filter_map(move |holder| holder.beside_m(row, *at)));
        Some((name.to_string(), median(distances.collect())?))
    };
    paths(recording).filter_map(beside).collect()
}

/// The ranges of rows in which a body is at rest and no hand holds it.
fn still(
    time: &[f64],
    path: &[Option<Vector3<f64>>],
    is_held: &dyn Fn(usize) -> bool,
    are_ends_only: bool,
) -> Vec<std::ops::Range<usize>> {
    let (mut found, mut row) = (vec![], 0);
    while row < path.len() {
        let Some(first) = path[row].filter(|_| !is_held(row)) else {
            row += 1;
            continue;
        };
        let moves = |next: &usize| path[*next].is_some_and(|at| (at - first).norm() > REST_M) || is_held(*next);
        let end = (row..path.len()).find(moves).unwrap_or(path.len());
        let is_end = time[row] - time[0] < REST_S || end == path.len();
        if time[end - 1] - time[row] < REST_S {
            row += 1;
            continue;
        }
        if is_end || !are_ends_only {
            found.push(row..end);
        }
        row = end;
    }
    found
}

/// What shows when a hand holds something.
struct Holder {
    is_closed: Vec<bool>,
    at: Option<Vec<Option<Vector3<f64>>>>,
    /// The finger opposite to the thumb, if the log has it.
    index: Option<Vec<Option<Vector3<f64>>>>,
}

impl Holder {
    fn of(recording: &Recording, side: Side) -> Option<Self> {
        let gripper = recording.columns.get(&format!("{side}.gripper.closed"));
        let begin = format!("{side}.{}.contact", Finger::Thumb);
        let flags = recording.columns.iter().filter(|(name, _)| name.starts_with(&begin)).map(|(_, column)| column);
        let columns: Vec<&[f64]> = gripper.into_iter().chain(flags).map(|column| column.values.as_slice()).collect();
        let is_closed = (0..recording.time.len()).map(|row| columns.iter().any(|values| values[row] > 0.5)).collect();
        let at = tool(recording, side);
        let index = vector(recording, &format!("{side}.{}.position", Finger::Index));
        (!columns.is_empty()).then_some(Self { is_closed, at, index })
    }

    fn holds(&self, row: usize, body: Option<Vector3<f64>>) -> bool {
        let at = self.at.as_ref().and_then(|at| at[row]);
        let is_near = at.zip(body).is_none_or(|(at, body)| (at - body).norm() < HELD_M);
        self.is_closed[row] && is_near
    }

    /// How far beside the middle of the fingers a body is that they hold, horizontally, m.
    fn beside_m(&self, row: usize, body: Option<Vector3<f64>>) -> Option<f64> {
        let at = self.at.as_ref().and_then(|at| at[row])?;
        let middle = self.index.as_ref().and_then(|index| index[row]).map_or(at, |index| (at + index) / 2.0);
        body.filter(|_| self.holds(row, body)).map(|body| (body - middle).xy().norm())
    }
}
