//! A hold that only a weight shows: the force at a wrist has one of two levels, and stays at the second one while the tool is lifted and carried. A tool that is
//! pressed onto a surface would stay near it.

use super::grippers::Gripper;
use super::hands::Hand;
use super::parts::distance;
use super::quantiles::median;
use teachtree_base::units::symbol;

/// The least weight, N.
const LEAST_N: f64 = 0.5;
/// The least height and the least way over which it is carried, m.
const CARRIED_M: f64 = 0.05;
/// How far the force is from the vertical weight while that is carried, as a share of it, …
const VARIES: f64 = 0.15;
/// … in this share of the samples.
const USUAL: f64 = 0.9;

/// The gripper of a hand whose log has none: closed while the wrist carries a weight.
pub fn gripper(hand: &Hand) -> Option<Gripper> {
    let (force, tool) = (hand.force.as_ref()?, hand.tool.as_ref()?);
    if !hand.tips.is_empty() {
        return None;
    }
    let column = force.members.get(2)?;
    let [low, high] = column.groups?;
    let first = column.samples.iter().copied().find(|value| value.is_finite())?;
    let is_low_loaded = (first - high).abs() < (first - low).abs();
    let weight = (high - low) * force.scale();
    let limit: f64 = format!("{:.2e}", (low + high) / 2.0).parse().ok()?;
    let is_loaded = |value: f64| if is_low_loaded { value < limit } else { value > limit };
    let rows: Vec<usize> = (0..force.rows()).filter(|row| is_loaded(column.samples[*row])).collect();
    let at_rest: Vec<[f64; 3]> = (0..force.rows())
        .filter(|row| !is_loaded(column.samples[*row]))
        .filter_map(|row| force.position(row))
        .collect();
    let rest = |axis: usize| median(at_rest.iter().map(|force| force[axis]).collect()).unwrap_or_default();
    let sign = if is_low_loaded { -1.0 } else { 1.0 };
    let hanging = [rest(0), rest(1), rest(2) + sign * weight];
    let is_steady =
        |row: &&usize| force.position(**row).is_some_and(|force| distance(force, hanging) < VARIES * weight);
    let steady = rows.iter().filter(is_steady).count();
    let places: Vec<[f64; 3]> = rows.iter().filter_map(|row| tool.position(force.row_in(*row, tool))).collect();
    let range = |axis: usize| {
        let values = places.iter().map(|place| place[axis]);
        values.clone().fold(f64::NEG_INFINITY, f64::max) - values.fold(f64::INFINITY, f64::min)
    };
    let is_carried = range(2) > CARRIED_M && range(0).hypot(range(1)) > CARRIED_M;
    if weight < LEAST_N || (steady as f64) < USUAL * rows.len() as f64 || !is_carried {
        return None;
    }
    let name = match force.sheet.name.as_str() {
        "" => column.name.clone(),
        sheet => format!("{sheet}.{}", column.name),
    };
    let side = if is_low_loaded { "<" } else { ">" };
    Some(Gripper {
        closed: format!("{name} {side} {limit} {}", symbol(&force.unit)).trim_end().to_string(),
        reason: "the wrist carries a weight there; the log has no gripper".into(),
        alternative: None,
        opening: None,
        held_m: None,
        reach_m: None,
        closed_at: (0..force.rows()).map(|row| (force.time_s(row), is_loaded(column.samples[row]))).collect(),
        is_guess: false,
        sheet: force.sheet.name.clone(),
    })
}
