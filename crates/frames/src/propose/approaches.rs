//! How long grippers approach objects that the log has no position of and how long they leave them, in a bound log: the times before a grasp and after a release
//! in which they are near its place.

use super::quantiles::median;
use super::recorded::tool;
use teachtree_base::hands::Side;
use teachtree_base::recording::Recording;

/// A tool within this distance of the place of a grasp approaches it, m: `near_on` of the rules, and the radius of a small object.
const NEAR_M: f64 = 0.06;
/// A closed gripper that goes farther carries something, m.
const CARRIED_M: f64 = 0.03;
/// Jaws that close slower rest, m/s, measured over this time, s.
const RESTS_M_S: f64 = 0.01;
const JAWS_S: f64 = 0.1;

/// The median time from when a tool comes near to when its jaws rest on what it then carries, s; `None` if no gripper carries something.
pub fn approach_s(recording: &Recording) -> Option<f64> {
    let times = Side::BOTH.into_iter().filter_map(|side| of_hand(recording, side)).flatten();
    median(times.map(|times| times.approach_s).collect())
}

/// The median time from when the flag of a gripper ends that has carried something to when its tool has left the place, s; `None` if no tool leaves one.
pub fn retreat_s(recording: &Recording) -> Option<f64> {
    let times = Side::BOTH.into_iter().filter_map(|side| of_hand(recording, side)).flatten();
    median(times.filter_map(|times| times.retreat_s).collect())
}

/// The times near the places where a hold begins and ends, s.
struct Times {
    approach_s: f64,
    /// None where the hand stays, or closes there again.
    retreat_s: Option<f64>,
}

fn of_hand(recording: &Recording, side: Side) -> Option<Vec<Times>> {
    let (time, tool) = (&recording.time, tool(recording, side)?);
    let closed = &recording.columns.get(&format!("{side}.gripper.closed"))?.values;
    let opening = recording.columns.get(&format!("{side}.gripper.opening")).map(|column| &column.values);
    let is_closed = |row: usize| closed[row] > 0.5;
    let closes = |row: usize| {
        let before = time.partition_point(|at| *at < time[row] - JAWS_S);
        opening.is_some_and(|opening| opening[before] - opening[row] > RESTS_M_S * (time[row] - time[before]))
    };
    let (mut found, mut free) = (vec![], 0);
    for row in 1..time.len() {
        if !is_closed(row) || is_closed(row - 1) {
            continue;
        }
        let end = (row..time.len()).find(|row| !is_closed(*row)).unwrap_or(time.len());
        let rest = (row + 1..end).find(|row| !closes(*row));
        let is_far = |at: usize, there: usize, from: f64| {
            tool[at].zip(tool[there]).is_some_and(|(at, there)| (at - there).norm() > from)
        };
        let is_carried = (row..end).any(|at| is_far(at, row, CARRIED_M));
        let far = (free..row).rev().find(|before| is_far(*before, row, NEAR_M));
        let next = (end..time.len()).find(|row| is_closed(*row)).unwrap_or(time.len());
        let left = (end..next).find(|after| is_far(*after, end, NEAR_M));
        found.extend(far.zip(rest).filter(|_| is_carried).map(|(far, rest)| Times {
            approach_s: time[rest] - time[far],
            retreat_s: left.map(|left| time[left] - time[end]),
        }));
        free = end;
    }
    Some(found)
}
