//! Where hands hold and move objects in a bound log without fingertips and grippers, such as rigid bodies of a motion capture on the backs of hands. An object stays at one place
//! in the frame of the hand that carries it, or that keeps it while the other hand takes something off it: the hand holds the object from when it is there.

use super::motion::{CARRIED_M, LEAST_S, MOVED_M, goes_with, lasts_s, ways, windows};
use super::quantiles::quantile;
use super::recorded::{has_part, paths, tool, turns};
use crate::clean::contact_level::median_vector;
use nalgebra::{UnitQuaternion, Vector3};
use std::collections::BTreeMap;
use teachtree_base::hands::Side;
use teachtree_base::recording::Recording;

/// An object that moves with the hand and is this far above or below its first place, m, is carried.
const LIFTED_M: f64 = 0.02;
/// An object that moves less in the whole log stands still, m.
const STILL_M: f64 = 0.02;
/// A hand that keeps an object moves by less than this in a window, m, is at most this far from it, m, and stays for at least this time, s.
const RESTS_M: f64 = 0.005;
const REACH_M: f64 = 0.2;
const KEEPS_S: f64 = 1.0;
/// What rests on an object is at most this far beside it, m. A hand whose pose is farther from an object does not touch it there.
const BESIDE_M: f64 = 0.04;
/// The place of a held object scatters by less than this in 90 % of the time, m.
const SCATTER_M: f64 = 0.01;
/// That of an object that is only moved scatters more: it slides along the hand.
const SLIDES_M: f64 = 0.03;
/// The hand holds the object up to this multiple of the scatter from its place, and at least up to this distance, m.
const SCATTERS: f64 = 3.0;
const LEAST_M: f64 = 0.003;
/// A hand that is farther away by this distance has left, m.
const LEFT_M: f64 = 0.05;
/// An object that turns by more than this without being carried is turned in its place, rad.
const TURNS_RAD: f64 = 0.1;

/// What a hand does with an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// It lifts and carries it.
    Carried,
    /// It moves it, but no place is always the same, or the hand does not lift it.
    Moved,
    /// It keeps it in place while the other hand takes something off it.
    Kept,
}

/// A place at which a hand holds or moves an object.
#[derive(Clone, Debug, PartialEq)]
pub struct HoldPoint {
    /// The object; `None` if there are several.
    pub object: Option<String>,
    /// The origin of the object in the frame of the hand while it is held, m.
    pub at: [f64; 3],
    /// The maximum distance from there at which it is held, m.
    pub near_m: f64,
    /// What the hand does with it.
    pub kind: Kind,
    /// Whether the hand also turns the object in its place, leaves it and comes back, as it does with a screw cap.
    pub turns_it: bool,
}

impl HoldPoint {
    /// Whether the pose of the hand is that of its tool point: the object is there.
    pub fn is_at_pose(&self) -> bool {
        Vector3::from(self.at).norm() < LEAST_M
    }
}

/// A body of the log.
struct Body<'a> {
    name: &'a str,
    at: Vec<Option<Vector3<f64>>>,
    ways: Vec<Option<Vector3<f64>>>,
    turns: Vec<UnitQuaternion<f64>>,
    first: Vector3<f64>,
    moves: bool,
}

/// A hand with a rotation.
struct Hand {
    side: Side,
    ways: Vec<Option<Vector3<f64>>>,
    /// The places of the bodies in its frame, m, in their order.
    places: Vec<Vec<Option<Vector3<f64>>>>,
}

/// The rows in which a hand moves or keeps a body, and the place.
#[derive(Clone)]
struct Hold {
    /// The index of the body, of the first one of several.
    body: usize,
    point: HoldPoint,
    rows: Vec<usize>,
}

/// The places at which hands hold objects: one for each hand. Where a hand carries several objects one after the other, or an object moves that no hand carries,
/// the places at which hands move objects.
pub fn hold_points(recording: &Recording) -> BTreeMap<Side, HoldPoint> {
    let windows = windows(&recording.time);
    let bodies: Vec<Body> =
        paths(recording).filter_map(|(name, at)| Body::new(recording, name, at, &windows)).collect();
    let hands: Vec<Hand> =
        Side::BOTH.into_iter().filter_map(|side| Hand::new(recording, side, &bodies, &windows)).collect();
    let moving: Vec<usize> = (0..bodies.len()).filter(|at| bodies[*at].moves).collect();
    let carried = hands.iter().map(|hand| {
        let holds = moving.iter().filter_map(|at| hand.hold(recording, Kind::Carried, &[*at], &bodies));
        (hand.side, holds.collect())
    });
    let carried: Vec<(Side, Vec<Hold>)> = carried.collect();
    let is_carried = |at: &usize| carried.iter().flat_map(|(_, holds)| holds).any(|hold| hold.body == *at);
    let is_together =
        |holds: &Vec<Hold>| nearest(holds).is_none_or(|first| holds.iter().all(|hold| hold.is_with(first)));
    let is_clear = moving.iter().all(is_carried) && carried.iter().all(|(_, holds)| is_together(holds));
    let moved = |hand: &Hand| Some((hand.side, hand.hold(recording, Kind::Moved, &moving, &bodies)?));
    let found: BTreeMap<Side, Hold> = match is_clear {
        true => carried.into_iter().filter_map(|(side, holds)| Some((side, nearest(&holds)?.clone()))).collect(),
        false => return hands.iter().filter_map(moved).map(|(side, hold)| (side, hold.point)).collect(),
    };
    let taken: Vec<&Body> = found.values().map(|hold| &bodies[hold.body]).collect();
    let kept = |hand: &Hand| {
        let bears = |body: &Body| !body.moves && taken.iter().any(|taken| taken.rests_on(body));
        let mut bearing = (0..bodies.len()).filter(|at| bears(&bodies[*at]));
        let hold = bearing.find_map(|at| hand.hold(recording, Kind::Kept, &[at], &bodies))?;
        Some((hand.side, hold.point)).filter(|(side, _)| !found.contains_key(side))
    };
    let kept: Vec<(Side, HoldPoint)> = hands.iter().filter_map(kept).collect();
    found.into_iter().map(|(side, hold)| (side, hold.point)).chain(kept).collect()
}

/// The hold of the object that is nearest to the hand.
fn nearest(holds: &[Hold]) -> Option<&Hold> {
    let far = |hold: &&Hold| Vector3::from(hold.point.at).norm();
    holds.iter().min_by(|one, other| far(one).total_cmp(&far(other)))
}

impl Hold {
    /// Whether two objects are moved together.
    fn is_with(&self, other: &Self) -> bool {
        2 * self.rows.iter().filter(|row| other.rows.binary_search(row).is_ok()).count() > self.rows.len()
    }
}

impl<'a> Body<'a> {
    fn new(recording: &Recording, name: &'a str, at: Vec<Option<Vector3<f64>>>, windows: &[usize]) -> Option<Self> {
        let first = *at.iter().flatten().next()?;
        let moves = at.iter().flatten().any(|at| (at - first).norm() > STILL_M);
        let turns = turns(recording, name, at.len());
        Some(Self { name, ways: ways(&at, windows), turns, at, first, moves })
    }

    /// Whether this body is first on another one.
    fn rests_on(&self, other: &Self) -> bool {
        let way = self.first - other.first;
        way.xy().norm() < BESIDE_M && way.z > 0.0
    }
}

impl Hand {
    fn new(recording: &Recording, side: Side, bodies: &[Body], windows: &[usize]) -> Option<Self> {
        let is_other = |name: &String| name.starts_with(&format!("{side}.")) && name.contains(".contact");
        let has_more = ["gripper", "index"].iter().any(|part| has_part(recording, side, part))
            || recording.columns.contains_key(&format!("{side}.palm.force.x"))
            || recording.columns.keys().any(is_other);
        if has_more || !recording.columns.contains_key(&format!("{side}.palm.rotation.w")) {
            return None;
        }
        let at = tool(recording, side)?;
        let turns = turns(recording, &format!("{side}.palm"), at.len());
        let places = |body: &Body| {
            let rows = body.at.iter().zip(&at).zip(&turns);
            rows.map(|((body, hand), turn)| Some(turn.inverse() * ((*body)? - (*hand)?))).collect()
        };
        let places = bodies.iter().map(places).collect();
        Some(Self { side, ways: ways(&at, windows), places })
    }

    /// The place of bodies that the hand carries, moves or keeps, if this lasts long enough, the place is always the same, and the hand comes there and leaves.
    fn hold(&self, recording: &Recording, kind: Kind, of: &[usize], bodies: &[Body]) -> Option<Hold> {
        let first = *of.first()?;
        let (body, places) = (&bodies[first], &self.places[first]);
        let rows = of.iter().flat_map(|at| (0..recording.time.len()).map(|row| (*at, row)));
        let rows: Vec<(usize, usize)> = rows.filter(|(at, row)| self.is_hold(kind, *at, &bodies[*at], *row)).collect();
        let held: Vec<Vector3<f64>> = rows.iter().filter_map(|(at, row)| self.places[*at][*row]).collect();
        let usual = median_vector(held.iter())?;
        let scatter_m = quantile(held.iter().map(|place| (place - usual).norm()).collect(), 0.9)?;
        let near_m = (SCATTERS * scatter_m).max(LEAST_M);
        let is_away = |place: &Vector3<f64>| (place - usual).norm() > near_m + LEFT_M;
        let mut seen = places.iter().flatten();
        let (least_s, most_m, is_new) = match kind {
            Kind::Carried => (LEAST_S, SCATTER_M, seen.any(is_away)),
            Kind::Moved => (LEAST_S, SLIDES_M, (BESIDE_M..REACH_M).contains(&usual.norm()) && seen.any(is_away)),
            Kind::Kept => {
                let ends = seen.clone().next().zip(seen.next_back());
                (KEEPS_S, SCATTER_M, ends.is_some_and(|(first, last)| is_away(first) && is_away(last)))
            }
        };
        if lasts_s(rows.len(), &recording.time) <= least_s || scatter_m >= most_m || !is_new {
            return None;
        }
        let object = (of.len() == 1).then(|| body.name.to_string());
        let mut point = HoldPoint { object, at: usual.into(), near_m, kind, turns_it: false };
        let rows: Vec<usize> = rows.into_iter().map(|(_, row)| row).collect();
        point.turns_it = kind == Kind::Carried && self.turns(first, body, &point, &rows);
        Some(Hold { body: first, point, rows })
    }

    /// Whether the hand carries, moves or keeps a body in a row.
    fn is_hold(&self, kind: Kind, at: usize, body: &Body, row: usize) -> bool {
        let (Some(of_body), Some(of_hand), Some(there)) = (body.ways[row], self.ways[row], body.at[row]) else {
            return false;
        };
        let is_lifted = (there.z - body.first.z).abs() > LIFTED_M;
        match kind {
            Kind::Carried => is_lifted && of_body.norm() > CARRIED_M && goes_with(&of_body, &of_hand),
            Kind::Moved => of_body.norm() > MOVED_M && goes_with(&of_body, &of_hand),
            Kind::Kept => of_hand.norm() < RESTS_M && self.places[at][row].is_some_and(|place| place.norm() < REACH_M),
        }
    }

    /// Whether the hand comes to the place of a hold and turns the body, and carries it in `rows` of another hold only.
    fn turns(&self, at: usize, body: &Body, hold: &HoldPoint, rows: &[usize]) -> bool {
        let is_there = |row: usize| {
            let place = self.places[at].get(row).copied().flatten();
            place.is_some_and(|place| (place - Vector3::from(hold.at)).norm() < hold.near_m)
        };
        let mut row = 0;
        while let Some(begin) = (row..body.at.len()).find(|row| is_there(*row)) {
            let end = (begin..body.at.len()).find(|row| !is_there(*row)).unwrap_or(body.at.len());
            let is_carried = rows.iter().any(|row| (begin..end).contains(row));
            if !is_carried && body.turns[begin].angle_to(&body.turns[end - 1]) > TURNS_RAD {
                return true;
            }
            row = end;
        }
        false
    }
}
