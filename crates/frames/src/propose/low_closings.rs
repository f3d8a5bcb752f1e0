//! Which end of a gripper is the closed one in a bound log without a pose of what it holds: it closes where the tool is low for the first time, and opens where it is low
//! again after it was high.

use super::recorded::tool;
use std::collections::BTreeMap;
use teachtree_base::hands::Side;
use teachtree_base::recording::Recording;

/// Why a gripper is closed at the other end than usual.
pub const REASON: &str = "it closes where the tool is low for the first time, and opens where it is low again; no object shows it, and if the log begins with a held object it is the other end";
/// A tool within this share of its rise above its lowest place is low, …
const LOW: f64 = 0.2;
/// … if it rises by at least this, m.
const RISES_M: f64 = 0.08;
/// Between two changes of the gripper the tool rises by at least this share.
const HIGH: f64 = 0.4;

/// The grippers whose flag changes where the tool is low: whether it is set after the first such change. Nothing is said of a gripper with a single one.
pub fn sets_flag(recording: &Recording) -> BTreeMap<Side, bool> {
    Side::BOTH.into_iter().filter_map(|side| Some((side, of_gripper(recording, side)?))).collect()
}

fn of_gripper(recording: &Recording, side: Side) -> Option<bool> {
    let flag = &recording.columns.get(&format!("{side}.gripper.closed"))?.values;
    let heights: Vec<f64> = tool(recording, side)?.iter().map(|at| at.map_or(f64::NAN, |at| at.z)).collect();
    let known = || heights.iter().copied().filter(|height| height.is_finite());
    let [low, high] = [known().reduce(f64::min)?, known().reduce(f64::max)?];
    let share = |row: usize| (heights[row] - low) / (high - low);
    let is_set = |row: usize| flag[row] > 0.5;
    let changes: Vec<usize> =
        (1..flag.len()).filter(|row| is_set(*row) != is_set(row - 1) && share(*row) < LOW).collect();
    let [first, second, ..] = changes[..] else { return None };
    let rises = |rows: std::ops::Range<usize>| rows.into_iter().any(|row| share(row) > HIGH);
    // Before the first one, the tool comes down with the gripper as it was at the beginning.
    let comes_down = rises(0..first) && (1..first).all(|row| is_set(row) == is_set(0));
    (high - low > RISES_M && comes_down && rises(first..second)).then(|| is_set(first))
}
