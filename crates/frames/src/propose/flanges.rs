//! Tool points that are flanges by their names, and how far in front of them the gripper holds objects.

use super::hands::Hand;
use super::motion::{CARRIED_M, LEAST_S, goes_with, lasts_s, ways, windows};
use super::quantiles::median;
use super::recorded::{paths, turns, vector};
use super::words;
use crate::clean::contact_level::median_vector;
use nalgebra::Vector3;
use std::collections::BTreeMap;
use teachtree_base::hands::Side;
use teachtree_base::recording::Recording;

/// Lengths of grippers with their mountings, m.
const LENGTHS_M: std::ops::RangeInclusive<f64> = 0.08..=0.35;
/// The place of what is held varies by at most this, m, and is at most this far from the axis, as a share of its distance along it.
const VARIES_M: f64 = 0.02;
const BESIDE: f64 = 0.5;

/// Whether the name of a hand's tool point is that of a flange.
pub fn is_flange(hand: &Hand) -> bool {
    let tool = hand.tool.as_ref().filter(|_| hand.rotation.is_some() && hand.tips.is_empty());
    tool.is_some_and(|tool| words::flange_rank(&tool.words).is_some())
}

/// How far in front of its tool point each gripper of a bound log holds what moves with it, along z of the tool, m.
pub fn lengths_m(recording: &Recording) -> BTreeMap<Side, f64> {
    Side::BOTH.into_iter().filter_map(|side| Some((side, length_m(recording, side)?))).collect()
}

fn length_m(recording: &Recording, side: Side) -> Option<f64> {
    let tool = vector(recording, &format!("{side}.thumb.position"))?;
    let turns = turns(recording, &format!("{side}.palm"), tool.len());
    let closed = &recording.columns.get(&format!("{side}.gripper.closed"))?.values;
    let time = &recording.time;
    let windows = windows(time);
    let of_tool = ways(&tool, &windows);
    let is_closed = |row: usize| closed[row] > 0.5 && closed[windows[row]] > 0.5;
    let mut held: Vec<Vector3<f64>> = vec![];
    for (_, path) in paths(recording) {
        let ways = ways(&path, &windows);
        let carried = (0..time.len()).filter(|row| is_closed(*row));
        held.extend(carried.filter_map(|row| {
            let (of_body, of_tool) = (ways[row]?, of_tool[row]?);
            let is_carried = of_body.norm() > CARRIED_M && goes_with(&of_body, &of_tool);
            Some(turns[row].inverse() * (path[row]? - tool[row]?)).filter(|_| is_carried)
        }));
    }
    let usual = median_vector(held.iter())?;
    let varies = median(held.iter().map(|at| (at - usual).norm()).collect())?;
    let is_ahead = usual.xy().norm() < BESIDE * usual.z && LENGTHS_M.contains(&usual.z);
    (lasts_s(held.len(), time) > LEAST_S && varies < VARIES_M && is_ahead).then_some(usual.z)
}
