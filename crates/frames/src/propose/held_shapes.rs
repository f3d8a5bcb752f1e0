//! The shapes of objects that fingertips carry, in logs without contacts and grippers: as wide as the thumb and the opposite finger hold them.

use super::sockets::{turns, vector};
use nalgebra::{UnitQuaternion, Vector3};
use std::collections::{BTreeMap, BTreeSet};
use teachtree_base::hands::{Finger, Side};
use teachtree_base::recording::Recording;

/// What moves by more than this, m, in this time, s, is carried, if the fingertips differ from its way by at most this share of it …
const WAY_M: f64 = 0.01;
const WAY_S: f64 = 0.2;
const SLIPS: f64 = 0.5;
/// … for at least this long, s.
const LEAST_S: f64 = 0.3;
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
    let has = |side: Side, part: &str| {
        let begin = format!("{side}.{part}");
        recording.columns.keys().any(|name| name.starts_with(&begin))
    };
    let mut found = BTreeMap::new();
    for side in Side::BOTH.into_iter().filter(|side| !has(*side, "gripper.")) {
        let tip = |finger: Finger| vector(recording, &format!("{side}.{finger}.position"));
        let Some(thumb) = tip(Finger::Thumb) else { continue };
        let others = [Finger::Index, Finger::Middle, Finger::Ring, Finger::Little].into_iter();
        let others: Vec<Vec<Option<Vector3<f64>>>> = others.filter_map(tip).collect();
        let hold = |name: &String| -> Option<(String, Hold)> {
            let body = BodyPath::new(recording, name)?;
            let holds = others.iter().filter_map(|other| body.held(&recording.time, &thumb, other));
            Some((name.clone(), holds.min_by(|one, other| one.shape.radius_m.total_cmp(&other.shape.radius_m))?))
        };
        let holds: Vec<(String, Hold)> = recording.scene.bodies.keys().filter_map(hold).collect();
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
    fn new(recording: &Recording, name: &str) -> Option<Self> {
        let at = vector(recording, &format!("{name}.position"))?;
        let turns = turns(recording, name, at.len());
        Some(Self { at, turns })
    }

    /// The shape that a thumb and another finger hold.
    fn held(&self, time: &[f64], thumb: &[Option<Vector3<f64>>], other: &[Option<Vector3<f64>>]) -> Option<Hold> {
        let up = self.turns.first()?.inverse() * Vector3::z();
        let (mut widths, mut beside, mut lows, mut highs) = (vec![], vec![], vec![], vec![]);
        let mut middles: [Vec<f64>; 3] = Default::default();
        let (mut from, mut carried_s, mut rows) = (0, 0.0, BTreeSet::new());
        for row in 1..time.len() {
            while time[row] - time[from] > WAY_S {
                from += 1;
            }
            let way = |path: &[Option<Vector3<f64>>]| Some(path[row]? - path[from]?);
            let (Some(of_body), Some(of_thumb), Some(of_other)) = (way(&self.at), way(thumb), way(other)) else {
                continue;
            };
            let slips = (of_thumb - of_body).norm().max((of_other - of_body).norm());
            let (Some(at), Some(one), Some(two)) = (self.at[row], thumb[row], other[row]) else { continue };
            if of_body.norm() < WAY_M || slips > SLIPS * of_body.norm() {
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
            let middle = (one + two) / 2.0;
            middles.iter_mut().zip(middle.iter()).for_each(|(all, part)| all.push(*part));
        }
        let middle = middles.map(median);
        let is_held = carried_s > LEAST_S && median(beside) > BESIDE;
        let radius_m = (median(widths) / 2.0 - SKIN_M).max(THIN_M);
        let shape = HeldShape { up: up.into(), middle, radius_m, heights_m: [median(lows), median(highs)] };
        is_held.then_some(Hold { shape, rows })
    }
}

/// The median; 0 of nothing.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or_default()
}
