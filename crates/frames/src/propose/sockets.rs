//! Sockets of a bound log: holes, and pegs that hollow bodies are put on. Insertions show them, else the name of a body that stands still where another one comes
//! to rest.

use super::insertions::{Insertion, Path};
use super::words;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::collections::BTreeSet;
use teachtree_base::hands::Side;
use teachtree_base::log_channel::{ContactPart, LogChannel};
use teachtree_base::recording::Recording;

/// What moves less than this stands still, m.
const STILL_M: f64 = 0.01;
/// The most sockets that are proposed.
const MAX_SOCKETS: usize = 8;
/// Insertions nearer than this are into one socket, m.
const SAME_M: f64 = 0.015;
/// A socket is part of a body that stands still no farther than this, m.
const BODY_M: f64 = 0.15;
/// The least radius of a socket, m.
const RADIUS_M: f64 = 0.015;
/// The least force of a contact with what stands still, N.
const CONTACT_N: f64 = 0.2;
/// The least change of the force at a wrist that is a contact of what it holds, N, and as a multiple of its usual change.
const MEETS: (f64, f64) = (1.0, 5.0);
/// What is this far from where it was taken hangs freely, m, …
const OFF_M: f64 = 0.02;
/// … and the force from then on for this long is its weight, s.
const HANGS_S: f64 = 0.5;
/// A contact counts until this long before the gripper opens, s: then its weight leaves the wrist.
const RELEASE_S: f64 = 0.15;
/// The maximum distance of a held body from the hand, m.
const HELD_M: f64 = 0.3;
/// Names of bodies that others are put into or on.
const SOCKETS: [&str; 13] =
    ["socket", "hole", "port", "receptacle", "outlet", "slot", "peg", "pin", "pole", "bore", "jack", "female", "nest"];
/// A socket.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundSocket {
    /// The body that it is part of; none if the log has no such body.
    pub of: Option<String>,
    /// The body that was put into it.
    pub object: String,
    /// Its rim in the frame of its body, else in that of the log, m.
    pub rim: [f64; 3],
    /// The direction out of it, unit.
    pub axis: [f64; 3],
    /// Its radius, m.
    pub radius_m: f64,
    /// Its depth, m.
    pub depth_m: f64,
    /// Whether only the name of its body shows it.
    pub is_by_name: bool,
}

/// The sockets, at most [`MAX_SOCKETS`].
pub fn sockets(recording: &Recording) -> Vec<FoundSocket> {
    let bodies: Vec<Body> = recording.scene.bodies.keys().filter_map(|name| Body::new(recording, name)).collect();
    let moving: BTreeSet<&str> = bodies.iter().filter(|body| body.moves).map(|body| body.name).collect();
    let mut found: Vec<(Insertion, FoundSocket)> = vec![];
    for body in bodies.iter().filter(|body| body.moves) {
        let path = body.path(recording, &moving);
        let end = path.at.last().copied();
        let mut insertions: Vec<(Insertion, bool)> = path.insertions().into_iter().map(|it| (it, false)).collect();
        if insertions.is_empty() {
            let mut named =
                bodies.iter().filter(|other| !other.moves && words::has(&words::words(other.name), &SOCKETS));
            let by_name = end.and_then(|end| named.find_map(|other| body.at_rest_in(other, end)));
            insertions.extend(by_name.map(|insertion| (insertion, true)));
        }
        for (insertion, is_by_name) in insertions {
            let is_known = |(known, _): &(Insertion, FoundSocket)| {
                (known.rim - insertion.rim).norm() < SAME_M && known.axis.dot(&insertion.axis) > 0.9
            };
            if found.len() < MAX_SOCKETS && !found.iter().any(is_known) {
                found.push((insertion, socket(&bodies, body.name, insertion, is_by_name)));
            }
        }
    }
    found.into_iter().map(|(_, socket)| socket).collect()
}

/// The socket of an insertion, in the frame of the nearest body that stands still.
fn socket(bodies: &[Body], object: &str, insertion: Insertion, is_by_name: bool) -> FoundSocket {
    let distance = |body: &&Body| (body.start - insertion.rim).norm();
    let fixed = bodies.iter().filter(|body| !body.moves && !words::is_support(body.name) && distance(body) < BODY_M);
    let of = fixed.min_by(|one, other| distance(one).total_cmp(&distance(other)));
    let (rim, axis) = of.map_or((insertion.rim, insertion.axis), |body| {
        let turn = body.turns.first().map_or_else(UnitQuaternion::identity, UnitQuaternion::inverse);
        (turn * (insertion.rim - body.start), turn * insertion.axis)
    });
    FoundSocket {
        of: of.map(|body| body.name.to_string()),
        object: object.to_string(),
        rim: rim.into(),
        axis: straight(axis).into(),
        radius_m: RADIUS_M.max((insertion.beside * 1.2 * 1e3).ceil() / 1e3),
        depth_m: (insertion.depth * 1.1 * 200.0).ceil() / 200.0,
        is_by_name,
    }
}

/// A direction within 2° of an axis of its frame, as that axis: rotations of trackers scatter.
fn straight(direction: Vector3<f64>) -> Vector3<f64> {
    const COSINE: f64 = 0.9994;
    let axis = direction.iamax();
    let mut straight = Vector3::zeros();
    straight[axis] = direction[axis].signum();
    if direction.dot(&straight) > COSINE { straight } else { direction }
}

/// Where a body is first, m.
pub fn start(recording: &Recording, body: &str) -> Option<[f64; 3]> {
    vector(recording, &format!("{body}.position"))?.into_iter().flatten().next().map(Into::into)
}

/// The rows of a vector; none where a component is missing.
pub fn vector(recording: &Recording, channel: &str) -> Option<Vec<Option<Vector3<f64>>>> {
    let column = |axis: &str| recording.columns.get(&format!("{channel}.{axis}")).map(|column| &column.values);
    let (x, y, z) = (column("x")?, column("y")?, column("z")?);
    let rows = x.iter().zip(y).zip(z).map(|((x, y), z)| Vector3::new(*x, *y, *z));
    Some(rows.map(|at| at.iter().all(|part| part.is_finite()).then_some(at)).collect())
}

/// A body with a position.
struct Body<'a> {
    name: &'a str,
    positions: Vec<Option<Vector3<f64>>>,
    /// Where it is first, m.
    start: Vector3<f64>,
    /// How it is turned.
    turns: Vec<UnitQuaternion<f64>>,
    moves: bool,
}

impl<'a> Body<'a> {
    fn new(recording: &Recording, name: &'a str) -> Option<Self> {
        let positions = vector(recording, &format!("{name}.position"))?;
        let start = positions.iter().flatten().next().copied()?;
        let moves = positions.iter().flatten().any(|at| (at - start).norm() > STILL_M);
        let parts = ["w", "x", "y", "z"].map(|part| recording.columns.get(&format!("{name}.rotation.{part}")));
        let turn = |row: usize| {
            let [w, x, y, z] =
                parts.map(|part| part.and_then(|part| part.values.get(row).copied()).unwrap_or(f64::NAN));
            UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-9).unwrap_or_default()
        };
        let turns = (0..positions.len()).map(turn).collect();
        Some(Self { name, positions, start, turns, moves })
    }

    /// Where it is, and where it touches something that stands still.
    fn path(&self, recording: &Recording, moving: &BTreeSet<&str>) -> Path {
        let touching = self.contacts(recording, moving).unwrap_or_else(|| self.meetings(recording));
        let mut path = Path::default();
        let rows = recording.time.iter().zip(&self.positions).zip(&self.turns).zip(touching);
        for (((time, at), turn), is_touching) in rows {
            if let Some(at) = at {
                path.time.push(*time);
                path.at.push(*at);
                path.turns.push(*turn);
                path.is_touching.push(is_touching);
            }
        }
        path
    }

    /// The rows in which it touches something that stands still, by logged contacts; `None` if the log has none of it.
    fn contacts(&self, recording: &Recording, moving: &BTreeSet<&str>) -> Option<Vec<bool>> {
        let mut touching: Option<Vec<bool>> = None;
        let mut add = |rows: Vec<bool>| {
            let all = touching.get_or_insert_with(|| vec![false; rows.len()]);
            all.iter_mut().zip(rows).for_each(|(all, row)| *all |= row);
        };
        let is_it = |one: &str, other: &str| {
            one == self.name && !moving.contains(other) || other == self.name && !moving.contains(one)
        };
        for (name, column) in &recording.columns {
            if let Some(LogChannel::Contact(one, other, ContactPart::Flag)) = LogChannel::parse(name)
                && is_it(one, other)
            {
                add(column.values.iter().map(|value| *value > 0.5).collect());
            }
            let force = name.strip_suffix(".x").and_then(LogChannel::parse);
            if let Some(channel @ LogChannel::Contact(one, other, ContactPart::Force)) = force
                && is_it(one, other)
                && let Some(forces) = vector(recording, &channel.to_string())
            {
                add(forces.iter().map(|force| force.is_some_and(|force| force.norm() > CONTACT_N)).collect());
            }
        }
        touching
    }

    /// The rows in which the force at a wrist changes while a hand holds this body: it meets something.
    fn meetings(&self, recording: &Recording) -> Vec<bool> {
        let mut meets = vec![false; recording.time.len()];
        for side in Side::BOTH {
            let Some(forces) = vector(recording, &format!("{side}.palm.force")) else { continue };
            let tools = ["thumb", "palm"].iter().find_map(|part| vector(recording, &format!("{side}.{part}.position")));
            let closed = recording.columns.get(&format!("{side}.gripper.closed")).map(|column| &column.values);
            let is_held = |row: usize| {
                let is_near = match (tools.as_ref().and_then(|tools| tools[row]), self.positions[row]) {
                    (Some(tool), Some(at)) => (tool - at).norm() < HELD_M,
                    _ => tools.is_none(),
                };
                is_near && closed.is_none_or(|closed| closed[row] > 0.5)
            };
            let mut row = 0;
            while row < meets.len() {
                let end = (row..meets.len()).find(|row| !is_held(*row)).unwrap_or(meets.len());
                if end > row {
                    self.meetings_of_hold(&recording.time, &forces, row..end, &mut meets);
                }
                row = end + 1;
            }
        }
        meets
    }

    /// Marks the rows of one hold in which the force is not that of a body that hangs freely.
    fn meetings_of_hold(
        &self,
        time: &[f64],
        forces: &[Option<Vector3<f64>>],
        hold: std::ops::Range<usize>,
        meets: &mut [bool],
    ) {
        let Some(taken) = self.positions[hold.clone()].iter().flatten().next() else { return };
        let is_off = |row: &usize| self.positions[*row].is_some_and(|at| (at - taken).norm() > OFF_M);
        let Some(off) = hold.clone().find(is_off) else { return };
        let weight: Vec<Vector3<f64>> =
            (off..hold.end).take_while(|row| time[*row] - time[off] <= HANGS_S).filter_map(|row| forces[row]).collect();
        let level = Vector3::from([0, 1, 2].map(|axis| median(weight.iter().map(|force| force[axis]).collect())));
        let change = |row: usize| forces[row].map_or(0.0, |force| (force - level).norm());
        let usual = median((off..hold.end).map(change).collect());
        let threshold = MEETS.0.max(MEETS.1 * usual);
        // At the end of the log nothing is let go.
        let end_s = if hold.end < time.len() { time[hold.end] - RELEASE_S } else { f64::INFINITY };
        for row in (off..hold.end).filter(|row| time[*row] < end_s) {
            meets[row] |= change(row) > threshold;
        }
    }

    /// The end of this body's way as an insertion into a body that is called a socket, if it goes straight to a rest there.
    fn at_rest_in(&self, socket: &Self, end: Vector3<f64>) -> Option<Insertion> {
        const BESIDE_M: f64 = 0.003;
        const USUAL_M: f64 = 0.02;
        if (end - socket.start).norm() > HELD_M || (end - self.start).norm() < OFF_M {
            return None;
        }
        let ways = self.positions.iter().rev().flatten().map(|at| at - end);
        let far = ways.clone().find(|way| way.norm() > USUAL_M)?;
        let axis =
            if far.normalize().z.abs() > 0.94 { Vector3::new(0.0, 0.0, far.z.signum()) } else { far.normalize() };
        let straight = ways.take_while(|way| (way - axis * way.dot(&axis)).norm() < BESIDE_M);
        let length = straight.map(|way| way.dot(&axis)).fold(0.0, f64::max);
        let of_body = (socket.start - end).dot(&axis);
        let beside = (socket.start - end - axis * of_body).norm();
        let depth = if (0.005..length).contains(&of_body) { of_body } else { USUAL_M.min(length) };
        (beside < 0.02 && depth > 0.005).then(|| Insertion { rim: end + axis * depth, axis, depth, beside: BESIDE_M })
    }
}

/// The median; 0 of nothing.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or_default()
}
