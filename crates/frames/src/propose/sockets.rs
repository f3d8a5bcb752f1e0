//! Sockets of a bound log: holes, and pegs that hollow bodies are put on. Insertions show them, else a body that stands still where another one comes to rest, by
//! its name or by its place.

use super::insertions::{Insertion, Path};
use super::quantiles::median;
use super::recorded::{tool, turns, vector};
use super::words;
use crate::clean::contact_level::median_vector;
use nalgebra::{UnitQuaternion, Vector3};
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
/// … and the force from then on for this long is its weight, s, …
const HANGS_S: f64 = 0.5;
/// … unless it is then held for this long this far from where it was taken and from where it is released, m: it may be drawn out of something.
const FREE_M: f64 = 0.06;
/// A contact counts until this long before the gripper opens, s: then its weight leaves the wrist.
const RELEASE_S: f64 = 0.15;
/// The maximum distance of a held body from the hand, m.
const HELD_M: f64 = 0.3;
/// The maximum distance of what is in a hole from the axis of its body, m, unless the name of the body is that of a socket. It is farther below the origin.
const ALIGNED_M: f64 = 0.005;
/// Names of bodies that others are put into or on.
const SOCKETS: [&str; 13] =
    ["socket", "hole", "port", "receptacle", "outlet", "slot", "peg", "pin", "pole", "bore", "jack", "female", "nest"];
/// Names of bodies with room for others.
const CONTAINERS: [&str; 12] =
    ["basket", "bowl", "box", "bucket", "cabinet", "container", "crate", "cup", "drawer", "glass", "pan", "pot"];

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
    /// What shows it.
    pub evidence: Evidence,
}

/// What shows that there is a socket.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Evidence {
    /// A body moves straight on from a contact, or out of one.
    Contact,
    /// The name of a body where another one begins or ends.
    Name,
    /// A body begins or ends on the axis of another one, below its origin, which it passes on its vertical way.
    Inside,
    /// A body begins or ends above another one, on its axis: it may rest on it or in it.
    Above,
}

/// The sockets, at most [`MAX_SOCKETS`], those with the best evidence: of several at one rim one.
pub fn sockets(recording: &Recording) -> Vec<FoundSocket> {
    let bodies: Vec<Body> = recording.scene.bodies.keys().filter_map(|name| Body::new(recording, name)).collect();
    let moving: BTreeSet<&str> = bodies.iter().filter(|body| body.moves).map(|body| body.name).collect();
    let mut shown: Vec<(&Body, Insertion, Evidence)> = vec![];
    for body in bodies.iter().filter(|body| body.moves) {
        let path = body.path(recording, &moving);
        let mut insertions: Vec<(Insertion, Evidence)> =
            path.insertions().into_iter().map(|insertion| (insertion, Evidence::Contact)).collect();
        if insertions.is_empty() {
            let ends = [true, false].into_iter().flat_map(|is_end| bodies.iter().map(move |other| (other, is_end)));
            let at_rest = ends.filter(|(other, _)| other.is_fixture());
            let at_rest = at_rest.filter_map(|(other, is_end)| body.at_rest_in(other, is_end));
            insertions.extend(at_rest.min_by_key(|(_, evidence)| *evidence));
        }
        shown.extend(insertions.into_iter().map(|(insertion, evidence)| (body, insertion, evidence)));
    }
    shown.sort_by_key(|(.., evidence)| *evidence);
    let mut found: Vec<(&Body, Insertion, Evidence)> = vec![];
    for (body, insertion, evidence) in shown {
        let is_known = |(_, known, _): &(&Body, Insertion, Evidence)| {
            (known.rim - insertion.rim).norm() < SAME_M && known.axis.dot(&insertion.axis) > 0.9
        };
        if found.len() < MAX_SOCKETS && !found.iter().any(is_known) {
            found.push((body, insertion, evidence));
        }
    }
    found.into_iter().map(|(body, insertion, evidence)| socket(&bodies, body.name, insertion, evidence)).collect()
}

/// The socket of an insertion, in the frame of the nearest body that stands still.
fn socket(bodies: &[Body], object: &str, insertion: Insertion, evidence: Evidence) -> FoundSocket {
    let distance = |body: &&Body| (body.start - insertion.rim).norm();
    let fixed = bodies.iter().filter(|body| body.is_fixture() && distance(body) < BODY_M);
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
        evidence,
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
        let turns = turns(recording, name, positions.len());
        Some(Self { name, positions, start, turns, moves })
    }

    /// Whether its name is that of a socket.
    fn is_named(&self) -> bool {
        words::has(&words::words(self.name), &SOCKETS)
    }

    /// Whether it stands still and its name is not that of a support.
    fn is_fixture(&self) -> bool {
        !self.moves && (self.is_named() || !words::is_support(self.name))
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
            let tools = tool(recording, side);
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
        let Some(taken) = self.positions[hold.clone()].iter().flatten().next().copied() else { return };
        let is_off = |row: &usize| self.positions[*row].is_some_and(|at| (at - taken).norm() > OFF_M);
        let Some(off) = hold.clone().find(is_off) else { return };
        // What is held in the first row may be fixed to the hand.
        let is_taken = hold.start > 0;
        let level = self.weight(time, forces, off..hold.end, Some(taken).filter(|_| is_taken));
        let change = |row: usize| forces[row].map_or(Vector3::zeros(), |force| force - level);
        let usual = median((off..hold.end).map(|row| change(row).norm()).collect()).unwrap_or_default();
        let threshold = MEETS.0.max(MEETS.1 * usual);
        // At the end of the log nothing is let go.
        let end_s = if hold.end < time.len() { time[hold.end] - RELEASE_S } else { f64::INFINITY };
        for row in (off..hold.end).filter(|row| time[*row] < end_s) {
            meets[row] |= change(row).norm() > threshold;
        }
        // What is drawn out needs more force than its weight, what is lifted off a table less.
        let way = self.positions[off].filter(|_| is_taken).map_or(Vector3::zeros(), |at| (at - taken).normalize());
        for (row, meets) in meets.iter_mut().enumerate().take(off).skip(hold.start) {
            *meets |= change(row).dot(&way) > threshold;
        }
    }

    /// The force of this body's weight in the rows of a hold since it left the place where it was taken: that at the beginning, or as soon as it is far from
    /// where it was `taken` and from where it is released.
    fn weight(
        &self,
        time: &[f64],
        forces: &[Option<Vector3<f64>>],
        rows: std::ops::Range<usize>,
        taken: Option<Vector3<f64>>,
    ) -> Vector3<f64> {
        let released = self.positions[rows.clone()].iter().rev().flatten().next().copied();
        let is_off = |at: Vector3<f64>, from: Vector3<f64>| (at - from).norm() > FREE_M;
        let is_far = |at| taken.zip(released).is_some_and(|(from, to)| is_off(at, from) && is_off(at, to));
        let free: Vec<usize> = rows.clone().filter(|row| self.positions[*row].is_some_and(is_far)).collect();
        let is_long = free.first().zip(free.last()).is_some_and(|(first, last)| time[*last] - time[*first] >= HANGS_S);
        let hanging = if is_long { free } else { rows.collect() };
        let begin_s = hanging.first().map_or(f64::NAN, |row| time[*row]);
        let hanging = hanging.into_iter().take_while(|row| time[*row] - begin_s <= HANGS_S);
        let weight: Vec<Vector3<f64>> = hanging.filter_map(|row| forces[row]).collect();
        median_vector(weight.iter()).unwrap_or_default()
    }

    /// The end of this body's way as an insertion into another one, if it goes straight to a rest there; the beginning of the way if `is_end` is false.
    fn at_rest_in(&self, socket: &Self, is_end: bool) -> Option<(Insertion, Evidence)> {
        const BESIDE_M: f64 = 0.003;
        const NAMED_M: f64 = 0.02;
        /// The origin of a plug is this far from that of a socket whose rim its tip reaches, m.
        const REACHED_M: f64 = 0.15;
        const USUAL_M: f64 = 0.02;
        let mut ways: Vec<Vector3<f64>> = self.positions.iter().flatten().copied().collect();
        if is_end {
            ways.reverse();
        }
        let (end, home) = (*ways.first()?, *ways.last()?);
        let farthest = if socket.is_named() { REACHED_M } else { HELD_M };
        if (end - socket.start).norm() > farthest || (end - home).norm() < OFF_M {
            return None;
        }
        let ways = ways.into_iter().map(|at| at - end);
        let far = ways.clone().find(|way| way.norm() > USUAL_M)?;
        let axis =
            if far.normalize().z.abs() > 0.94 { Vector3::new(0.0, 0.0, far.z.signum()) } else { far.normalize() };
        let straight = ways.take_while(|way| (way - axis * way.dot(&axis)).norm() < BESIDE_M);
        let length = straight.map(|way| way.dot(&axis)).fold(0.0, f64::max);
        let of_body = (socket.start - end).dot(&axis);
        let beside = (socket.start - end - axis * of_body).norm();
        let is_passed = (ALIGNED_M..length).contains(&of_body);
        let depth = if is_passed { of_body } else { USUAL_M.min(length) };
        let is_container = words::has(&words::words(socket.name), &CONTAINERS);
        let evidence = match () {
            () if socket.is_named() => Evidence::Name,
            () if is_passed && axis.z > 0.94 && !is_container => Evidence::Inside,
            () => Evidence::Above,
        };
        let widest = if socket.is_named() { NAMED_M } else { ALIGNED_M };
        let insertion = Insertion { rim: end + axis * depth, axis, depth, beside: BESIDE_M };
        (beside < widest && depth > 0.005).then_some((insertion, evidence))
    }
}
