//! The faces of objects that fingertips or bare tools push over a support, in logs without contacts and grippers: what pushes an object keeps its distance behind the
//! origin of the object, along the way.

use super::motion::{LEAST_S, MOVED_M, Positions, goes_with, lasts_s, ways, windows};
use super::quantiles::{median, quantile};
use super::recorded::{has_part, paths, turns, vector};
use crate::clean::contact_level::median_vector;
use nalgebra::{UnitQuaternion, Vector3};
use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::recording::Recording;

/// An object that is this far above or below its first place is carried, m.
const LIFTED_M: f64 = 0.02;
/// What pushes is at most this far behind the origin, m, and at least as far as a thin object is.
const BEHIND_M: std::ops::RangeInclusive<f64> = 0.015..=0.3;
/// Its distance varies by less than this in 90 % of the time, m.
const VARIES_M: f64 = 0.01;
/// It was or will be farther away by this distance, m.
const LEFT_M: f64 = 0.05;

/// A face of an object in the axes of the log, while the object is turned as in the first row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Face {
    /// The direction in which it is pushed, level, unit.
    pub along: [f64; 3],
    /// The place of what pushes it from the origin of the object, m.
    pub tip: [f64; 3],
}

/// The faces of an object.
#[derive(Clone, Debug, PartialEq)]
pub struct PushedShape {
    /// The rotation of the object in the first row.
    pub turn: UnitQuaternion<f64>,
    /// The faces, at most one of each side for each hand.
    pub faces: Vec<Face>,
}

/// The positions of a point in each row, m.
type Path = Vec<Option<Vector3<f64>>>;

/// An object of the log.
struct PushedObject {
    at: Path,
    ways: Path,
    turns: Vec<UnitQuaternion<f64>>,
}

/// The faces of the objects that hands without grippers push and never lift in a bound log.
pub fn pushed_shapes(recording: &Recording) -> BTreeMap<String, PushedShape> {
    let windows = windows(&recording.time);
    let hands = points(recording);
    let shape = |(name, at): (&str, Path)| {
        let turns = turns(recording, name, at.len());
        let turn = *turns.first().filter(|_| !is_lifted(&at))?;
        let pushed = PushedObject { ways: ways(&at, &windows), at, turns };
        let faces: Vec<Face> = hands.iter().flat_map(|tips| pushed.faces(tips, &recording.time, &windows)).collect();
        (!faces.is_empty()).then(|| (name.to_string(), PushedShape { turn, faces }))
    };
    paths(recording).filter_map(shape).collect()
}

/// Whether an object leaves the height of its first place.
fn is_lifted(path: &Positions) -> bool {
    let heights = || path.iter().flatten().map(|at| at.z);
    heights().next().is_some_and(|first| heights().any(|height| (height - first).abs() > LIFTED_M))
}

impl PushedObject {
    /// A vector in the axes of the log, as the object is turned in the first row.
    fn to_first(&self, row: usize, vector: Vector3<f64>) -> Vector3<f64> {
        self.turns[0] * (self.turns[row].inverse() * vector)
    }

    /// The faces that the points of a hand push.
    fn faces(&self, tips: &[Path], time: &[f64], windows: &[usize]) -> Vec<Face> {
        let of_tips: Vec<Path> = tips.iter().map(|tip| ways(tip, windows)).collect();
        // The rows in which a point goes with the object, by the quarter of the direction.
        let mut quarters: BTreeMap<i64, Vec<(usize, Vector3<f64>)>> = BTreeMap::new();
        let mut first_angle = None;
        for row in 0..time.len() {
            let Some(way) = self.ways[row].filter(|way| way.xy().norm() > MOVED_M) else { continue };
            if !of_tips.iter().any(|of_tip| of_tip[row].is_some_and(|of_tip| goes_with(&way, &of_tip))) {
                continue;
            }
            let along = self.to_first(row, Vector3::new(way.x, way.y, 0.0));
            let angle = along.y.atan2(along.x);
            let quarter = ((angle - *first_angle.get_or_insert(angle)) / FRAC_PI_2).round() as i64;
            quarters.entry(quarter.rem_euclid(4)).or_default().push((row, along));
        }
        let long = quarters.values().filter(|rows| lasts_s(rows.len(), time) > LEAST_S);
        long.filter_map(|rows| self.face(tips, rows)).collect()
    }

    /// The face that is pushed in some rows, with the ways of the object there.
    fn face(&self, tips: &[Path], rows: &[(usize, Vector3<f64>)]) -> Option<Face> {
        let along = rows.iter().map(|(_, way)| way).sum::<Vector3<f64>>().try_normalize(1e-9)?;
        let place = |tip: &Positions, row: usize| Some(self.to_first(row, tip[row]? - self.at[row]?));
        let usual = |tip: &Path| {
            let places: Vec<Vector3<f64>> = rows.iter().filter_map(|(row, _)| place(tip, *row)).collect();
            let usual = median_vector(places.iter())?;
            let varies_m = quantile(places.iter().map(|at| (at - usual).dot(&along).abs()).collect(), 0.9)?;
            let is_away = |row| place(tip, row).is_some_and(|at| (at - usual).norm() > LEFT_M);
            (varies_m < VARIES_M && (0..tip.len()).any(is_away)).then_some(usual)
        };
        // A finger in front of the object holds it.
        let foremost = tips.iter().filter_map(usual).max_by(|one, other| one.dot(&along).total_cmp(&other.dot(&along)));
        let tip = foremost.filter(|tip| BEHIND_M.contains(&-tip.dot(&along)))?;
        Some(Face { along: along.into(), tip: tip.into() })
    }
}

/// How far from the origin of each object that moves and is never lifted the nearest fingertip or bare tool usually is then, m.
pub fn reached_m(recording: &Recording) -> BTreeMap<String, f64> {
    let windows = windows(&recording.time);
    let points: Vec<Path> = points(recording).into_iter().flatten().collect();
    let reached = |(name, path): (&str, Path)| {
        let ways = ways(&path, &windows);
        let moves = (0..path.len()).filter(|row| ways[*row].is_some_and(|way| way.norm() > MOVED_M));
        let nearest = moves.filter_map(|row| {
            let distances = points.iter().filter_map(|point| Some((point[row]? - path[row]?).norm()));
            distances.reduce(f64::min)
        });
        Some((name.to_string(), median(nearest.collect())?))
    };
    paths(recording).filter(|(_, path)| !is_lifted(path)).filter_map(reached).collect()
}

/// The fingertips of each hand without a gripper and without a measured contact, or its tool point.
fn points(recording: &Recording) -> Vec<Vec<Path>> {
    let measures = |side: &Side| {
        let begin = format!("{side}.");
        let is_measured =
            |name: &String| name.starts_with(&begin) && (name.contains(".contact") || name.contains(".force"));
        has_part(recording, *side, "gripper") || recording.columns.keys().any(is_measured)
    };
    let tips = |side: Side| {
        let fingers = [Finger::Thumb, Finger::Index, Finger::Middle, Finger::Ring, Finger::Little];
        fingers.iter().filter_map(|finger| vector(recording, &format!("{side}.{finger}.position"))).collect()
    };
    Side::BOTH.into_iter().filter(|side| !measures(side)).map(tips).collect()
}
