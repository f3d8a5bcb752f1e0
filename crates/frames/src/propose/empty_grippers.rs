//! How far grippers are open on what they hold in a bound log, and how far where they rest closed and empty.

use super::motion::lasts_s;
use super::quantiles::median;
use std::collections::BTreeMap;
use std::ops::Range;
use teachtree_base::hands::Side;
use teachtree_base::recording::Recording;

/// An empty gripper is narrower than one that holds something by more than this share of the way from there to open.
const CLEARLY: f64 = 0.15;
/// The opening below which the rules take a gripper for empty anyway, m: `shut`.
const SHUT_M: f64 = 0.002;
/// A shorter closing is an accident, s.
const LEAST_S: f64 = 0.1;

/// The widths of a gripper, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Widths {
    /// On the thinnest object.
    pub held_m: f64,
    /// Where it rests empty, if it does.
    pub empty_m: Option<f64>,
}

impl Widths {
    /// The middle between empty and held, m, where the rules do not know it.
    pub fn shut_m(&self) -> Option<f64> {
        self.empty_m.filter(|empty_m| *empty_m > SHUT_M / 2.0).map(|empty_m| f64::midpoint(empty_m, self.held_m))
    }
}

/// The widths of the grippers whose openings and flags a bound log has.
pub fn widths(recording: &Recording) -> BTreeMap<Side, Widths> {
    Side::BOTH.into_iter().filter_map(|side| Some((side, of_gripper(recording, side)?))).collect()
}

/// A gripper rests empty where the log begins with it closed, narrower than at any later time but the end of the log.
fn of_gripper(recording: &Recording, side: Side) -> Option<Widths> {
    let column = |part: &str| recording.columns.get(&format!("{side}.gripper.{part}")).map(|column| &column.values);
    let (closed, opening) = (column("closed")?, column("opening")?);
    let width =
        |rows: &Range<usize>| median(opening[rows.clone()].iter().copied().filter(|width| width.is_finite()).collect());
    let open: Vec<f64> =
        closed.iter().zip(opening).filter(|(flag, _)| **flag <= 0.5).map(|(_, width)| *width).collect();
    let open_m = median(open.into_iter().filter(|width| width.is_finite()).collect())?;
    let long = closings(closed).into_iter().filter(|rows| lasts_s(rows.len(), &recording.time) > LEAST_S);
    let widths: Vec<(Range<usize>, f64)> = long.filter_map(|rows| Some((rows.clone(), width(&rows)?))).collect();
    let narrowest = |widths: &[(Range<usize>, f64)]| widths.iter().map(|(_, width)| *width).reduce(f64::min);
    let is_empty = |width: f64, held_m: f64| width + CLEARLY * (open_m - held_m) < held_m;
    let begins = widths.split_first().filter(|((rows, _), _)| rows.start == 0);
    let rest = begins.and_then(|((_, first), later)| {
        let before_end = match later.split_last() {
            Some(((rows, _), before)) if rows.end == closed.len() && !before.is_empty() => before,
            _ => later,
        };
        let held_m = narrowest(later).filter(|held_m| is_empty(*first, *held_m));
        let held_m = held_m.or_else(|| narrowest(before_end).filter(|held_m| is_empty(*first, *held_m)))?;
        Some(Widths { held_m, empty_m: Some(*first) })
    });
    rest.or_else(|| Some(Widths { held_m: narrowest(&widths)?, empty_m: None }))
}

/// The runs of rows in which a flag is set.
fn closings(closed: &[f64]) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = vec![];
    for row in (0..closed.len()).filter(|row| closed[*row] > 0.5) {
        match runs.last_mut() {
            Some(run) if run.end == row => run.end = row + 1,
            _ => runs.push(row..row + 1),
        }
    }
    runs
}
