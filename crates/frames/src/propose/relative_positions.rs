//! Positions relative to a tool, which simulations log beside the positions of objects: `gripper_to_cube`, or elements of an array without names.

use super::parts::{Part, Quantity, distance};
use super::words;

/// How far the length of a relative position is off the distance of the object from the tool, m, …
const EQUAL_M: f64 = 0.003;
/// … in this share of the rows.
const USUAL: f64 = 0.95;
/// Distances that change by less than this show nothing, m.
const LEAST_M: f64 = 0.02;

/// Marks positions that are as long as the distance of another one from a tool, in any frame, and the rotations beside them. Of two that have each other's
/// length, the one that stays where it is until the tool has moved is the position of the object.
pub fn mark(parts: &mut [Part]) {
    let is_tool = |part: &Part| words::tool_rank(&part.words).is_some();
    let positions: Vec<usize> =
        (0..).zip(&*parts).filter(|(_, it)| it.quantity == Quantity::Position).map(|(at, _)| at).collect();
    let (tools, others): (Vec<usize>, Vec<usize>) =
        positions.into_iter().partition(|at| parts.get(*at).is_some_and(is_tool));
    let mut found: Vec<(usize, String)> = vec![];
    for at in &others {
        let Some(part) = parts.get(*at) else { continue };
        let is_object = |other: &&usize| *other != at && found.iter().all(|(known, _)| known != *other);
        let pairs = others.iter().filter(is_object).flat_map(|other| tools.iter().map(move |tool| (*other, *tool)));
        let pair =
            pairs.filter_map(|(other, tool)| Some((parts.get(other)?, parts.get(tool)?))).find(|(other, tool)| {
                let is_mutual = || is_between(other, part, tool);
                is_between(part, other, tool)
                    && (!is_mutual() || moved_at_first(part, tool) > moved_at_first(other, tool))
            });
        found.extend(pair.map(|(other, tool)| {
            (*at, format!("relative: its length is the distance between {} and {}", tool.pattern, other.pattern))
        }));
    }
    for (at, reason) in found {
        leave_out(parts, at, &reason);
    }
}

/// Leaves out a position and the rotation beside it.
pub fn leave_out(parts: &mut [Part], at: usize, reason: &str) {
    let name = parts.get(at).map(|part| part.name.clone()).unwrap_or_default();
    let beside = parts.iter_mut().filter(|part| part.name == name);
    for part in beside.filter(|part| [Quantity::Position, Quantity::Rotation].contains(&part.quantity)) {
        part.quantity = Quantity::Other;
        part.left_out = Some(reason.into());
    }
}

/// Whether a position is as long as the distance of two others.
fn is_between(part: &Part, object: &Part, tool: &Part) -> bool {
    let lengths: Vec<(f64, f64)> = (0..part.rows())
        .filter_map(|row| {
            let far = distance(object.position(part.row_in(row, object))?, tool.position(part.row_in(row, tool))?);
            Some((distance(part.position(row)?, [0.0; 3]), far))
        })
        .collect();
    let equal = lengths.iter().map(|(length, far)| (length - far).abs() < EQUAL_M);
    let (low, high) =
        lengths.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), (_, far)| (low.min(*far), high.max(*far)));
    // Where the object is in the origin, or the part at the tool, a position in the world has this length too.
    let in_origin = (0..part.rows()).filter_map(|row| object.position(part.row_in(row, object)));
    let is_in_origin = is_usual(in_origin.map(|at| distance(at, [0.0; 3]) < EQUAL_M));
    let at_tool = (0..part.rows()).filter_map(|row| part.position(row).zip(tool.position(part.row_in(row, tool))));
    let is_at_tool = is_usual(at_tool.map(|(at, tool)| distance(at, tool) < EQUAL_M));
    high - low > LEAST_M && is_usual(equal) && !is_in_origin && !is_at_tool
}

/// Whether something is so in nearly all rows.
fn is_usual(rows: impl Iterator<Item = bool>) -> bool {
    let (count, yes) = rows.fold((0_usize, 0_usize), |(count, yes), is| (count + 1, yes + usize::from(is)));
    yes as f64 > USUAL * count as f64
}

/// How far a position is from where it began when the tool has moved for the first time, m.
fn moved_at_first(part: &Part, tool: &Part) -> f64 {
    let from_start = |part: &Part, row: usize| Some(distance(part.position(0)?, part.position(row)?));
    let first = (0..tool.rows()).find(|row| from_start(tool, *row).is_some_and(|moved| moved > LEAST_M));
    first.and_then(|row| from_start(part, tool.row_in(row, part))).unwrap_or_default()
}
