//! Where hands hold objects in a bound log without fingertips and grippers, such as rigid bodies of a motion capture on the backs of hands. An object stays at one place
//! in the frame of the hand that carries it, or that keeps it while the other hand takes something off it: the hand holds the object from when it is there.

use super::motion::{goes_with, ways, windows};
use super::quantiles::quantile;
use super::recorded::{has_part, paths, tool, turns};
use crate::clean::contact_level::median_vector;
use nalgebra::{UnitQuaternion, Vector3};
use std::collections::BTreeMap;
use teachtree_base::hands::Side;
use teachtree_base::recording::Recording;

/// An object that moves by more than this in a window, m, together with the hand, …
const WAY_M: f64 = 0.01;
/// … and is this far above or below its first place, m, is carried, …
const LIFTED_M: f64 = 0.02;
/// … if this lasts at least so long, s.
const LEAST_S: f64 = 0.3;
/// An object that moves less in the whole log stands still, m.
const STILL_M: f64 = 0.02;
/// A hand that keeps an object moves by less than this in a window, m, is at most this far from it, m, and stays at least so long, s.
const RESTS_M: f64 = 0.005;
const REACH_M: f64 = 0.2;
const KEEPS_S: f64 = 1.0;
/// What rests on an object is at most this far beside it, m.
const BESIDE_M: f64 = 0.04;
/// The place of a held object scatters by less than this in 90 % of the time, m.
const SCATTER_M: f64 = 0.01;
/// The hand holds the object up to this multiple of the scatter from its place, and at least up to this distance, m.
const SCATTERS: f64 = 3.0;
const LEAST_M: f64 = 0.003;
/// A hand that is so much farther away has left, m.
const LEFT_M: f64 = 0.05;
/// An object that turns by more than this without being carried is turned in its place, rad.
const TURNS_RAD: f64 = 0.1;

/// A place at which a hand holds an object.
#[derive(Clone, Debug, PartialEq)]
pub struct HoldPoint {
    /// The object.
    pub object: String,
    /// The origin of the object in the frame of the hand while it is held, m.
    pub at: [f64; 3],
    /// How far from there it is held too, m.
    pub near_m: f64,
    /// Whether the hand carries the object; otherwise it keeps it in place for the other hand.
    pub is_carried: bool,
    /// Whether the hand also turns the object in its place, leaves it and comes back, as it does with a screw cap.
    pub turns_it: bool,
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

/// The places at which hands hold objects; none where one of these hands carries several objects, or where an object moves that no hand carries.
pub fn hold_points(recording: &Recording) -> BTreeMap<Side, HoldPoint> {
    let windows = windows(&recording.time);
    let bodies: Vec<Body> =
        paths(recording).filter_map(|(name, at)| Body::new(recording, name, at, &windows)).collect();
    let hands: Vec<Hand> =
        Side::BOTH.into_iter().filter_map(|side| Hand::new(recording, side, &bodies, &windows)).collect();
    let mut found: BTreeMap<Side, (usize, HoldPoint)> = BTreeMap::new();
    for (at, body) in bodies.iter().enumerate().filter(|(_, body)| body.moves) {
        let holds: Vec<(Side, HoldPoint)> =
            hands.iter().filter_map(|hand| Some((hand.side, hand.carried(recording, at, body)?))).collect();
        if holds.is_empty() || holds.iter().any(|(side, _)| found.contains_key(side)) {
            return BTreeMap::new();
        }
        found.extend(holds.into_iter().map(|(side, hold)| (side, (at, hold))));
    }
    let taken: Vec<&Body> = found.values().map(|(at, _)| &bodies[*at]).collect();
    let kept: Vec<(Side, HoldPoint)> = hands
        .iter()
        .filter(|hand| !found.contains_key(&hand.side))
        .filter_map(|hand| {
            let bears = |body: &&Body| taken.iter().any(|taken| taken.rests_on(body));
            let mut bearing = bodies.iter().enumerate().filter(|(_, body)| !body.moves && bears(body));
            Some((hand.side, bearing.find_map(|(at, body)| hand.kept(recording, at, body))?))
        })
        .collect();
    found.into_iter().map(|(side, (_, hold))| (side, hold)).chain(kept).collect()
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

    /// The place of a body that the hand carries.
    fn carried(&self, recording: &Recording, at: usize, body: &Body) -> Option<HoldPoint> {
        let is_carried = |row: &usize| {
            let rows = (body.ways[*row], self.ways[*row], body.at[*row]);
            let (Some(of_body), Some(of_hand), Some(there)) = rows else { return false };
            let is_lifted = (there.z - body.first.z).abs() > LIFTED_M;
            is_lifted && of_body.norm() > WAY_M && goes_with(&of_body, &of_hand)
        };
        let rows: Vec<usize> = (0..recording.time.len()).filter(is_carried).collect();
        let hold = self.hold(recording, at, body, &rows, LEAST_S, true)?;
        Some(HoldPoint { turns_it: self.turns(at, body, &hold, &rows), ..hold })
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

    /// The place of a body that the hand keeps where it is.
    fn kept(&self, recording: &Recording, at: usize, body: &Body) -> Option<HoldPoint> {
        let is_there = |row: &usize| {
            let rests = self.ways[*row].is_some_and(|way| way.norm() < RESTS_M);
            rests && self.places[at][*row].is_some_and(|place| place.norm() < REACH_M)
        };
        let rows: Vec<usize> = (0..recording.time.len()).filter(is_there).collect();
        self.hold(recording, at, body, &rows, KEEPS_S, false)
    }

    /// The place of a body in the rows of a hold, if these last long enough, the place is always the same, and the hand comes there and leaves.
    fn hold(
        &self,
        recording: &Recording,
        at: usize,
        body: &Body,
        rows: &[usize],
        least_s: f64,
        is_carried: bool,
    ) -> Option<HoldPoint> {
        let places = &self.places[at];
        let held: Vec<Vector3<f64>> = rows.iter().filter_map(|row| places[*row]).collect();
        let usual = median_vector(held.iter())?;
        let scatter_m = quantile(held.iter().map(|place| (place - usual).norm()).collect(), 0.9)?;
        let step_s = (recording.time.last()? - recording.time.first()?) / recording.time.len() as f64;
        let near_m = (SCATTERS * scatter_m).max(LEAST_M);
        let is_away = |place: &Vector3<f64>| (place - usual).norm() > near_m + LEFT_M;
        let mut seen = places.iter().flatten();
        let is_new = match is_carried {
            true => seen.any(is_away),
            false => seen.clone().next().is_some_and(is_away) && seen.next_back().is_some_and(is_away),
        };
        (rows.len() as f64 * step_s > least_s && scatter_m < SCATTER_M && is_new).then(|| HoldPoint {
            object: body.name.to_string(),
            at: usual.into(),
            near_m,
            is_carried,
            turns_it: false,
        })
    }
}
