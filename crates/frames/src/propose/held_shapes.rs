//! The shapes of objects that fingertips carry, in logs without contacts and grippers: as wide as the thumb and the opposite finger hold them.

use super::motion::{CARRIED_M, LEAST_S, Positions, goes_with, ways, windows};
use super::quantiles::median;
use super::recorded::{has_part, paths, turns, vector};
use crate::clean::contact_level::median_vector;
use nalgebra::{UnitQuaternion, Vector3};
use std::collections::{BTreeMap, BTreeSet};
use teachtree_base::hands::{Finger, Side};
use teachtree_base::recording::Recording;

/// What is tracked of a fingertip is this far from its skin, m.
const SKIN_M: f64 = 0.01;
/// The origin of what is held is at most this far from the middle of the fingertips, m.
const BETWEEN_M: f64 = 0.12;
/// The least radius, m.
const THIN_M: f64 = 0.005;
/// Fingertips are opposite to each other beside an object, not above and below it, if this share of their distance is horizontal.
const BESIDE: f64 = 0.7;

/// An upright cylinder in the frame of its body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldShape {
    /// The direction that is up while the body rests, unit.
    pub up: [f64; 3],
    /// The middle of the fingertips that hold it, m.
    pub middle: [f64; 3],
    /// Its radius, m.
    pub radius_m: f64,
    /// The lowest and the highest fingertip along `up`, m.
    pub heights_m: [f64; 2],
}

/// The shapes of the bodies that fingertips carry in a bound log.
pub fn held_shapes(recording: &Recording) -> BTreeMap<String, HeldShape> {
    let windows = windows(&recording.time);
    let mut found = BTreeMap::new();
    for side in Side::BOTH.into_iter().filter(|side| !has_part(recording, *side, "gripper")) {
        let tip = |finger: Finger| vector(recording, &format!("{side}.{finger}.position"));
        let Some(thumb) = tip(Finger::Thumb) else { continue };
        let others = [Finger::Index, Finger::Middle, Finger::Ring, Finger::Little].into_iter();
        let others: Vec<Vec<Option<Vector3<f64>>>> = others.filter_map(tip).collect();
        let hold = |(name, at): (&str, Vec<Option<Vector3<f64>>>)| -> Option<(String, Hold)> {
            let body = BodyPath { turns: turns(recording, name, at.len()), at };
            let holds = others.iter().filter_map(|other| body.held(&recording.time, &windows, &thumb, other));
            Some((name.to_string(), holds.min_by(|one, other| one.shape.radius_m.total_cmp(&other.shape.radius_m))?))
        };
        let holds: Vec<(String, Hold)> = paths(recording).filter_map(hold).collect();
        // Of bodies that move together, the fingertips hold the one between them; others rest on it, or bear it.
        let is_held = |hold: &Hold| {
            let nearer = |(_, other): &(String, Hold)| other.off_m() < hold.off_m() && other.is_with(hold);
            hold.off_m() < BETWEEN_M && !holds.iter().any(nearer)
        };
        found.extend(holds.iter().filter(|(_, hold)| is_held(hold)).map(|(name, hold)| (name.clone(), hold.shape)));
    }
    found
}

/// A shape, and the rows in which fingertips carry it.
struct Hold {
    shape: HeldShape,
    rows: BTreeSet<usize>,
}

impl Hold {
    /// The distance of the body's origin from the middle of the fingertips, m.
    fn off_m(&self) -> f64 {
        Vector3::from(self.shape.middle).norm()
    }

    /// Whether both are carried at the same time.
    fn is_with(&self, other: &Self) -> bool {
        2 * self.rows.intersection(&other.rows).count() > self.rows.len().min(other.rows.len())
    }
}

/// Where a body is, and how it is turned.
struct BodyPath {
    at: Vec<Option<Vector3<f64>>>,
    turns: Vec<UnitQuaternion<f64>>,
}

impl BodyPath {
    /// The shape that a thumb and another finger hold.
    fn held(&self, time: &[f64], windows: &[usize], thumb: &Positions, other: &Positions) -> Option<Hold> {
        let up = self.turns.first()?.inverse() * Vector3::z();
        let (mut widths, mut beside, mut lows, mut highs) = (vec![], vec![], vec![], vec![]);
        let (mut middles, mut carried_s, mut rows) = (vec![], 0.0, BTreeSet::new());
        let of_all = [&self.at[..], thumb, other].map(|path| ways(path, windows));
        for row in 1..time.len() {
            let [Some(of_body), Some(of_thumb), Some(of_other)] = [0, 1, 2].map(|of| of_all[of][row]) else { continue };
            let (Some(at), Some(one), Some(two)) = (self.at[row], thumb[row], other[row]) else { continue };
            if of_body.norm() < CARRIED_M || !goes_with(&of_body, &of_thumb) || !goes_with(&of_body, &of_other) {
                continue;
            }
            carried_s += time[row] - time[row - 1];
            rows.insert(row);
            let seen = |tip: Vector3<f64>| self.turns[row].inverse() * (tip - at);
            let (one, two) = (seen(one), seen(two));
            let (across, heights) = (one - two, [one.dot(&up), two.dot(&up)]);
            let level = (across - up * across.dot(&up)).norm();
            widths.push(level);
            beside.push(level / across.norm().max(f64::MIN_POSITIVE));
            lows.push(heights[0].min(heights[1]));
            highs.push(heights[0].max(heights[1]));
            middles.push((one + two) / 2.0);
        }
        let middle = median_vector(middles.iter())?.into();
        let is_held = carried_s > LEAST_S && median(beside)? > BESIDE;
        let radius_m = (median(widths)? / 2.0 - SKIN_M).max(THIN_M);
        let shape = HeldShape { up: up.into(), middle, radius_m, heights_m: [median(lows)?, median(highs)?] };
        is_held.then_some(Hold { shape, rows })
    }
}
