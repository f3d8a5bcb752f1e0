//! Positions that a log has twice: robosuite writes the position of each object in columns of its own, and all objects in one array.

use super::parts::{Part, Quantity, distance};
use super::relative_positions::leave_out;
use super::words;
use std::collections::BTreeMap;

/// Positions that are nearer than this in all rows are one, m: single precision rounds a position within reach of an arm by less.
const EQUAL_M: f64 = 1e-6;

/// Leaves out copies of positions and the rotations beside them. The position from the shorter array is kept, which has the name of its body.
pub fn leave_out_copies(parts: &mut [Part]) {
    let positions: Vec<usize> = (0..)
        .zip(&*parts)
        .filter(|(_, part)| part.quantity == Quantity::Position && is_of_object(part))
        .map(|(at, _)| at)
        .collect();
    let mut sorted: Vec<(usize, usize)> =
        positions.into_iter().filter_map(|at| Some((elements(parts.get(at)?), at))).collect();
    sorted.sort_unstable();
    let mut kept: Vec<usize> = vec![];
    let mut copies: BTreeMap<usize, usize> = BTreeMap::new();
    for (_, at) in sorted {
        let Some(part) = parts.get(at) else { continue };
        match kept.iter().find(|known| parts.get(**known).is_some_and(|known| is_copy(part, known))) {
            Some(original) => copies.extend([(at, *original)]),
            None => kept.push(at),
        }
    }
    for (copy, original) in copies {
        let Some(original) = parts.get(original) else { continue };
        let (reason, body, name) =
            (format!("a copy of {}", original.pattern), words::body(&original.name), original.name.clone());
        let is_rotation = |part: &&mut Part| part.quantity == Quantity::Rotation;
        let has_rotation = parts.iter_mut().filter(is_rotation).any(|part| words::body(&part.name) == body);
        let copied = parts.get(copy).map(|part| part.name.clone());
        if !has_rotation
            && let Some(rotation) =
                parts.iter_mut().filter(is_rotation).find(|part| Some(&part.name) == copied.as_ref())
        {
            rotation.name = name;
        }
        leave_out(parts, copy, &reason);
    }
}

/// Whether it is neither a tool nor a fingertip: the best name of those is bound.
fn is_of_object(part: &Part) -> bool {
    words::tool_rank(&part.words).is_none() && words::finger(&part.words).is_none()
}

/// Number of elements of the array that contains a position.
fn elements(part: &Part) -> usize {
    let array = |name: &str| name.rsplit_once('[').map(|(array, _)| array.to_string());
    let Some(own) = part.members.first().and_then(|column| array(&column.name)) else { return part.members.len() };
    part.sheet.columns.iter().filter(|column| array(&column.name).as_ref() == Some(&own)).count()
}

/// Whether two positions are equal in all rows. All at the origin, they are values that nothing was written to.
fn is_copy(part: &Part, known: &Part) -> bool {
    let mut is_placed = false;
    let mut pairs = (0..part.rows()).map(|row| (part.position(row), known.position(row)));
    let is_equal = pairs.all(|pair| match pair {
        (Some(one), Some(other)) => {
            is_placed |= one != [0.0; 3];
            distance(one, other) < EQUAL_M
        }
        (one, other) => one.is_none() && other.is_none(),
    });
    std::ptr::eq(part.sheet, known.sheet) && is_equal && is_placed
}
