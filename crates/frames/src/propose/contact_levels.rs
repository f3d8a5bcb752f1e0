//! The force at a wrist from which on it is that of contact: a hand without a gripper moves objects, and its force is above this level nearly all of that time. A log
//! without contact has two groups of forces too, of rest and of motion, so a level that no object shows is not written.

use super::motion::{LEAST_S, MOVED_M, lasts_s, ways, windows};
use super::recorded::{has_part, paths, tool, vector};
use crate::clean::contact_level::two_groups;
use nalgebra::Vector3;
use std::collections::BTreeMap;
use teachtree_base::hands::Side;
use teachtree_base::recording::Recording;

/// What moves less in the whole log stands still, m.
const MOVES_M: f64 = 0.02;
/// The share of the time of these motions in which the force is above the level, and of the time in which only the hand moves.
const PUSHED: f64 = 0.9;
const FREE: f64 = 0.2;

/// A level, and the object that shows it.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundLevel {
    /// The force from which on it is contact, N.
    pub begins_n: f64,
    /// The object that moves only while the force is above it.
    pub object: String,
}

/// The levels of the forces at the wrists of hands without gripper and fingertips in a bound log.
pub fn levels(recording: &Recording) -> BTreeMap<Side, FoundLevel> {
    let is_bare = |side: &Side| !["gripper", "index"].iter().any(|part| has_part(recording, *side, part));
    let hands = Side::BOTH.into_iter().filter(is_bare);
    hands.filter_map(|side| Some((side, level(recording, side)?))).collect()
}

fn level(recording: &Recording, side: Side) -> Option<FoundLevel> {
    let forces = vector(recording, &format!("{side}.palm.force"))?;
    let tool = tool(recording, side)?;
    let readings: Vec<Vector3<f64>> = forces.iter().flatten().copied().collect();
    let level = two_groups(&readings)?.level;
    let is_above = |row: usize| Some((forces[row]? - level.rest).norm() > level.begins);
    let share = |rows: &mut dyn Iterator<Item = usize>| {
        let above: Vec<bool> = rows.filter_map(is_above).collect();
        let count = above.iter().filter(|above| **above).count();
        (above.len(), count as f64 / above.len().max(1) as f64)
    };
    let windows = windows(&recording.time);
    let moved = |path: &[Option<Vector3<f64>>]| -> Vec<bool> {
        ways(path, &windows).iter().map(|way| way.is_some_and(|way| way.norm() > MOVED_M)).collect()
    };
    let is_moved = |path: &[Option<Vector3<f64>>]| {
        let first = path.iter().flatten().next();
        first.is_some_and(|first| path.iter().flatten().any(|at| (at - first).norm() > MOVES_M))
    };
    let objects: Vec<(&str, Vec<bool>)> =
        paths(recording).filter(|(_, path)| is_moved(path)).map(|(name, path)| (name, moved(&path))).collect();
    let (pushed, of_pushed) = share(&mut (0..forces.len()).filter(|row| objects.iter().any(|(_, moves)| moves[*row])));
    let hand = moved(&tool);
    let is_free = |row: &usize| hand[*row] && objects.iter().all(|(_, moves)| !moves[*row]);
    let (free, of_free) = share(&mut (0..forces.len()).filter(is_free));
    let is_long = |rows: usize| lasts_s(rows, &recording.time) > LEAST_S;
    let (object, _) = objects.iter().max_by_key(|(_, moves)| moves.iter().filter(|moves| **moves).count())?;
    (is_long(pushed) && is_long(free) && of_pushed > PUSHED && of_free < FREE)
        .then(|| FoundLevel { begins_n: level.begins, object: (*object).to_string() })
}
