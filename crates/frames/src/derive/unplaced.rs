//! Objects without a pose in the log, as in logs of joints and a gripper: such an object moves with the gripper that holds it, from Grasp to Release.
//!
//! An object with a place in the scene starts there, and only a gripper that closes in reach of it holds it. An object without one rests on nothing; before its
//! first hold it is where it is grasped, so that a window of a log does not contain its place.

use super::hands::{HandTrack, finger_feels};
use super::motion::{HeldPath, slopes, vector};
use crate::clean::preprocess::{CleanLog, Hold};
use nalgebra::Vector3;
use std::collections::BTreeMap;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::scene::{Body, Role, Scene};

/// A gripper that closes farther than this from the bounding ball of an object with a place does not take it, m. Nothing else shows that it holds the object,
/// so that this is the least value of `grip_reach` in hand_gripper.rules.
const REACH: f64 = 0.050;

/// Whether neither the log nor the scene says where a body is, while a gripper may hold it.
pub fn is_unplaced(measured: &CleanLog, body: usize) -> bool {
    !has_place(measured.scene, body) && is_unseen(measured.scene, |column| measured.scalar(column).is_some(), body)
}

/// Whether the path of an object in each window of a log continues that of the window before: the scene has its place, and a gripper may carry it off. `has`
/// says whether the log has a column.
pub fn continues_path(scene: &Scene, has: impl Fn(&str) -> bool, body: usize) -> bool {
    has_place(scene, body) && is_unseen(scene, has, body)
}

fn has_place(scene: &Scene, body: usize) -> bool {
    scene.bodies.get_index(body).is_some_and(|(_, body)| is_placed(body))
}

/// Whether the log does not say where an object is, and a gripper may carry it. `has` says whether the log has a column.
pub fn is_unseen(scene: &Scene, has: impl Fn(&str) -> bool, body: usize) -> bool {
    let Some((name, body)) = scene.bodies.get_index(body) else { return false };
    let turns = |socket: &String| has(&format!("{name}.angle.{socket}"));
    let is_measured = ["position.x", "rotation.w"].iter().any(|part| has(&format!("{name}.{part}")))
        || scene.bodies.values().flat_map(|it| it.sockets.keys()).any(turns);
    body.role == Role::Object
        && body.fixed_to.is_none()
        && !is_measured
        && Side::BOTH.iter().any(|side| has(&format!("{side}.gripper.closed")))
}

/// Whether the scene says where a body is.
pub fn is_placed(body: &Body) -> bool {
    body.position.iter().any(|length| length.0 != 0.0)
}

/// Whether only the flag of a gripper shows when it holds an object that the log lacks. A sensor at the wrist does not: it feels nothing while the held object
/// hangs still, and the weight of an open gripper.
pub fn is_held_by_flag(measured: &CleanLog, side: Side, objects: &[usize]) -> bool {
    let has = |column: &str| measured.scalar(column).is_some();
    let mut tips = Finger::ALL.into_iter().filter(|finger| *finger != Finger::Palm);
    has(&format!("{side}.gripper.closed"))
        && !tips.any(|finger| finger_feels(measured, side, finger))
        && objects.iter().any(|object| is_unseen(measured.scene, has, *object))
}

/// The motion of those of some objects that the log does not show: of one with a place, and, in a whole log, of one that a gripper holds at some time.
pub fn held_paths(measured: &CleanLog, objects: &[usize], tracks: &[HandTrack]) -> BTreeMap<usize, HeldPath> {
    let has = |column: &str| measured.scalar(column).is_some();
    let unseen = objects.iter().copied().filter(|object| is_unseen(measured.scene, has, *object));
    let hands: Vec<Holder> = tracks.iter().filter_map(|track| Holder::new(measured, track)).collect();
    unseen.filter_map(|object| Some((object, path(measured, &hands, object)?))).collect()
}

/// A hand with a gripper whose place the log has.
struct Holder<'a> {
    track: &'a HandTrack,
    /// The flag of its gripper: a sensor at the wrist also feels what an open gripper weighs.
    closed: &'a [f64],
    points: Vec<[&'a [f64]; 3]>,
}

impl<'a> Holder<'a> {
    fn new(measured: &'a CleanLog, track: &'a HandTrack) -> Option<Self> {
        let side = track.side;
        let closed = measured.scalar(&format!("{side}.gripper.closed"))?;
        let position = |finger: Finger| measured.vec3(&format!("{side}.{finger}.position"));
        let tips = Finger::ALL.into_iter().filter(|finger| *finger != Finger::Palm);
        let mut points: Vec<[&[f64]; 3]> = tips.filter_map(position).collect();
        if points.is_empty() {
            points.extend(position(Finger::Palm));
        }
        (!points.is_empty()).then_some(Self { track, closed, points })
    }

    fn holds(&self, object: usize, frame: usize) -> bool {
        self.closed.get(frame).is_some_and(|closed| *closed > 0.5)
            && self.track.touching.get(frame) == Some(&true)
            && self.track.target.get(frame) == Some(&Some(object))
    }

    /// The mean of the fingertips, or the palm, m.
    fn place(&self, frame: usize) -> Vector3<f64> {
        self.points.iter().map(|point| vector(point, frame)).sum::<Vector3<f64>>() / self.points.len() as f64
    }
}

/// The motion of an object; `None` if it has no place and nothing holds it.
fn path(measured: &CleanLog, hands: &[Holder], object: usize) -> Option<HeldPath> {
    let (_, body) = measured.scene.bodies.get_index(object)?;
    let start = is_placed(body).then(|| Vector3::from(body.position.map(|length| length.0)));
    let reach = start.map(|_| body.bounding_radius() + REACH);
    let (mut hold, mut places) = match (&measured.window, start) {
        (None, _) => (None, vec![]),
        (Some(window), Some(_)) => {
            let places = window.places_before.get(&object).cloned().unwrap_or_default();
            (window.holds_before.get(&object).cloned(), places.into_iter().map(Some).collect())
        }
        (Some(_), None) => return None,
    };
    let core = measured.core();
    // Before the core only the places count.
    let mut is_held = vec![false; core.start];
    places.resize(core.start, start);
    let keep = |frame: usize, hold: &Option<Hold>| match (&measured.window, hold) {
        (Some(window), Some(hold)) if frame == window.kept => {
            window.holds_after.borrow_mut().insert(object, hold.clone());
        }
        _ => {}
    };
    for frame in core.clone() {
        keep(frame, &hold);
        let hold = hold.get_or_insert_with(|| Hold::of_place(hands.len(), start));
        let place = step(hold, hands, object, frame, reach);
        is_held.push(place.is_some());
        places.push(place.or(hold.place));
    }
    keep(core.end, &hold);
    if let Some(window) = &measured.window {
        let known = places.get(core.start..window.kept).unwrap_or_default().iter().copied().flatten();
        window.places_after.borrow_mut().insert(object, known.collect());
    }
    let places = if start.is_some() { places.into_iter().flatten().collect() } else { filled(&places)? };
    let position = [0, 1, 2].map(|axis| places.iter().map(|place| place[axis]).collect::<Vec<f64>>());
    let mut velocity = slopes(measured, position.each_ref().map(Vec::as_slice));
    for column in &mut velocity {
        column.iter_mut().zip(&is_held).filter(|(_, held)| !**held).for_each(|(value, _)| *value = 0.0);
    }
    Some(HeldPath { position, velocity })
}

/// Continues a hold by a frame; the place of the object while a hand has it. `reach`: the maximum distance from the place at which a hand takes it, m.
fn step(hold: &mut Hold, hands: &[Holder], object: usize, frame: usize, reach: Option<f64>) -> Option<Vector3<f64>> {
    let before = hold.hands.clone();
    for (hand, state) in hands.iter().zip(&mut hold.hands) {
        let (holds, at) = (hand.holds(object, frame), hand.place(frame));
        let reaches = || match (reach, hold.place) {
            (Some(reach), Some(place)) => (at - place).norm() < reach,
            _ => true,
        };
        state.has_it = holds && (state.has_it || !state.closed && reaches());
        (state.closed, state.at) = (holds, at);
    }
    let was = hold.holder;
    let has = |hand: &usize| hold.hands.get(*hand).is_some_and(|hand| hand.has_it);
    let holder = was.filter(has).or_else(|| (0..hands.len()).find(has));
    // A hand that takes over continues from the object's current position.
    let place = holder.and_then(|hand| hold.hands.get(hand).zip(before.get(hand))).map(|(now, before)| {
        match hold.place.filter(|_| reach.is_some() || was.is_some()) {
            Some(place) if was.is_some() => place + now.at - before.at,
            Some(place) => place,
            None => now.at,
        }
    });
    // Only an object with a place stays where it is let go.
    hold.place = place.or(hold.place.filter(|_| reach.is_some()));
    hold.holder = holder;
    place
}

/// Places with those between holds: half of the time where it was released, and half of it where it is grasped next. `None` without a hold.
fn filled(places: &[Option<Vector3<f64>>]) -> Option<Vec<Vector3<f64>>> {
    let mut out = Vec::with_capacity(places.len());
    let mut before: Option<Vector3<f64>> = None;
    for gap in places.chunk_by(|one, next| one.is_some() == next.is_some()) {
        if gap.first().is_some_and(Option::is_some) {
            out.extend(gap.iter().flatten());
            before = out.last().copied();
            continue;
        }
        let after = places.get(out.len() + gap.len()).copied().flatten();
        let (from, to) = (before.or(after)?, after.or(before)?);
        let half = gap.len() / 2;
        out.extend(std::iter::repeat_n(from, half));
        out.extend(std::iter::repeat_n(to, gap.len() - half));
    }
    Some(out)
}
