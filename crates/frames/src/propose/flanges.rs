//! Tool points that are flanges by their names, and how far in front of them the gripper holds objects.

use super::hands::Hand;
use super::sockets::{turns, vector};
use super::words;
use nalgebra::Vector3;
use std::collections::BTreeMap;
use teachtree_base::hands::Side;
use teachtree_base::recording::Recording;

/// Names of flanges and last links.
const FLANGES: [&str; 8] = ["flange", "tool0", "wrist3", "wrist_3", "link6", "link7", "link8", "ee_link"];
/// An object moves with the hand if it moves by more than this, m, in this time, s, and the hand differs from that by at most this share of it …
const WAY_M: f64 = 0.01;
const WAY_S: f64 = 0.2;
const SLIPS: f64 = 0.5;
/// … for at least this long, s.
const LEAST_S: f64 = 0.3;
/// Lengths of grippers with their mountings, m.
const LENGTHS_M: std::ops::RangeInclusive<f64> = 0.08..=0.35;
/// The place of what is held varies by at most this, m, and is at most this far from the axis, as a share of its distance along it.
const VARIES_M: f64 = 0.02;
const BESIDE: f64 = 0.5;

/// Whether the name of a hand's tool point is that of a flange.
pub fn is_flange(hand: &Hand) -> bool {
    let Some(tool) = hand.tool.as_ref().filter(|_| hand.rotation.is_some() && hand.tips.is_empty()) else {
        return false;
    };
    let name = tool.words.join("_");
    // `link6_tcp` is in front of the last link.
    let is_of_tool = words::has(&tool.words, &["tcp", "eef", "ee", "endpoint"]);
    FLANGES.iter().any(|flange| name.ends_with(flange) || !is_of_tool && words::has(&tool.words, &[flange]))
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
    let mut held: Vec<Vector3<f64>> = vec![];
    for path in recording.scene.bodies.keys().filter_map(|name| vector(recording, &format!("{name}.position"))) {
        let mut from = 0;
        for (row, turn) in turns.iter().enumerate() {
            while time[row] - time[from] > WAY_S {
                from += 1;
            }
            let ways = || Some((path[row]? - path[from]?, tool[row]? - tool[from]?, path[row]? - tool[row]?));
            let Some((of_body, of_tool, there)) = ways().filter(|_| closed[row] > 0.5 && closed[from] > 0.5) else {
                continue;
            };
            if of_body.norm() > WAY_M && (of_tool - of_body).norm() < SLIPS * of_body.norm() {
                held.push(turn.inverse() * there);
            }
        }
    }
    let step_s = (time.last()? - time.first()?) / time.len() as f64;
    let median = |part: &dyn Fn(&Vector3<f64>) -> f64| {
        let mut parts: Vec<f64> = held.iter().map(part).collect();
        parts.sort_by(f64::total_cmp);
        parts.get(parts.len() / 2).copied()
    };
    let usual = Vector3::new(median(&|at| at.x)?, median(&|at| at.y)?, median(&|at| at.z)?);
    let varies = median(&|at| (at - usual).norm())?;
    let is_ahead = usual.xy().norm() < BESIDE * usual.z && LENGTHS_M.contains(&usual.z);
    (held.len() as f64 * step_s > LEAST_S && varies < VARIES_M && is_ahead).then_some(usual.z)
}
