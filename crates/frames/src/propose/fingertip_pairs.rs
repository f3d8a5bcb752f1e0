//! A thumb and an index whose distance has two usual values: a gripper. A relaxed hand may be as narrow as one that holds something, so the reach is that of its
//! holds.

use super::bodies::{Body, edge};
use super::grippers::Gripper;
use super::hands::Hand;
use super::parts::{Part, distance};
use super::quantiles::quantile;
use crate::otsu;
use teachtree_base::hands::{Finger, Side};

/// The least difference of the two values, m.
const OPENS_M: f64 = 0.005;

/// The gripper of a hand with these two fingertips only.
pub fn gripper(side: Side, hand: &Hand, bodies: &[Body]) -> Option<Gripper> {
    let (Some(thumb), Some(index), 2) = (hand.tips.get(&Finger::Thumb), hand.tips.get(&Finger::Index), hand.tips.len())
    else {
        return None;
    };
    let width = |row: usize| Some(distance(thumb.position(row)?, index.position(thumb.row_in(row, index))?));
    let widths: Vec<(usize, f64)> = (0..thumb.rows()).filter_map(|row| Some((row, width(row)?))).collect();
    let [low, high] = otsu::clear_means(widths.iter().map(|(_, width)| *width).collect())?;
    let limit_mm = ((low + high) / 2.0 * 1e3).round();
    let [low_mm, high_mm] = [low, high].map(|width| (width * 1e3).round());
    let of = format!("between: [{side}.thumb, {side}.index]");
    let closed: Vec<usize> = widths.iter().filter(|(_, width)| width * 1e3 < limit_mm).map(|(row, _)| *row).collect();
    (high - low > OPENS_M).then(|| Gripper {
        closed: format!("{{{of}, below: {limit_mm} mm}}"),
        reason: format!("closed about {low_mm} mm, open about {high_mm} mm"),
        alternative: None,
        opening: Some((format!("{{{of}}}"), "the distance of the fingertips".into())),
        held_m: Some(low),
        reach_m: reach_m([thumb, index], &closed, bodies, edge(Some(low)).0),
        closed_at: widths.iter().map(|(row, width)| (thumb.time_s(*row), width * 1e3 < limit_mm)).collect(),
        is_guess: false,
        sheet: thumb.sheet.name.clone(),
    })
}

/// How far the middle of the fingertips is from the bounding balls of cubes with this edge, m, while these move with it at most, and a margin.
fn reach_m([thumb, index]: [&Part; 2], closed: &[usize], bodies: &[Body], edge_m: f64) -> Option<f64> {
    /// What moves faster than this, m/s, goes with the hand if it keeps its distance to a half of its way in this time, s.
    const MOVES_M_S: f64 = 0.03;
    const WAY_SECS: f64 = 0.1;
    const MARGIN_M: f64 = 0.04;
    /// The least reach that the rules take, m, and the usual one.
    const REACH_M: [f64; 2] = [0.05, 0.2];
    let middle = |row: usize| {
        let (one, other) = (thumb.position(row)?, index.position(thumb.row_in(row, index))?);
        Some([0, 1, 2].map(|axis| f64::midpoint(one[axis], other[axis])))
    };
    let step_s = thumb.time_s(1) - thumb.time_s(0);
    let steps = if step_s > 0.0 { (WAY_SECS / step_s).ceil().max(1.0) } else { return None };
    let mut distances = vec![];
    for part in bodies.iter().filter_map(|body| body.positions.first()) {
        for (first, row) in closed.iter().filter_map(|row| Some((row.checked_sub(steps as usize)?, *row))) {
            let at = |row: usize| part.position(thumb.row_in(row, part));
            let (Some(from), Some(to)) = (at(first), at(row)) else { continue };
            let (Some(hand_from), Some(hand)) = (middle(first), middle(row)) else { continue };
            let slips = distance([0, 1, 2].map(|axis| to[axis] - from[axis] + hand_from[axis]), hand);
            if distance(from, to) > MOVES_M_S * steps * step_s && slips < distance(from, to) / 2.0 {
                distances.push(distance(to, hand));
            }
        }
    }
    let farthest = quantile(distances, 0.95)?;
    let ball_m = edge_m * 0.75_f64.sqrt();
    let reach_m = (((farthest - ball_m + MARGIN_M) * 100.0).ceil() / 100.0).max(REACH_M[0]);
    (reach_m < REACH_M[1]).then_some(reach_m)
}
