//! Objects without a pose in the log or a place in the scene, as in logs of joints and a gripper: such an object moves with the gripper that holds it, from
//! Grasp to Release, and rests on nothing. Before its first hold it is where it is grasped.

use super::hands::HandTrack;
use super::motion::{HeldPath, slopes, vector};
use crate::clean::preprocess::CleanLog;
use nalgebra::Vector3;
use std::collections::BTreeMap;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::scene::{Body, Role, Scene};

/// Whether neither the log nor the scene says where a body is, and a gripper may hold it. `has` says whether the log has a column.
pub fn is_unplaced(scene: &Scene, has: impl Fn(&str) -> bool, body: usize) -> bool {
    let Some((name, body)) = scene.bodies.get_index(body) else { return false };
    let turns = |socket: &String| has(&format!("{name}.angle.{socket}"));
    let is_measured = ["position.x", "rotation.w"].iter().any(|part| has(&format!("{name}.{part}")))
        || scene.bodies.values().flat_map(|it| it.sockets.keys()).any(turns);
    body.role == Role::Object
        && body.fixed_to.is_none()
        && !is_placed(body)
        && !is_measured
        && Side::BOTH.iter().any(|side| has(&format!("{side}.gripper.closed")))
}

/// Whether the scene says where a body is.
pub fn is_placed(body: &Body) -> bool {
    body.position.iter().any(|length| length.0 != 0.0)
}

/// The motion of the unplaced ones of some objects that a gripper holds at some time. In a window of a log it is not known.
pub fn held_paths(measured: &CleanLog, objects: &[usize], tracks: &[HandTrack]) -> BTreeMap<usize, HeldPath> {
    if measured.window.is_some() {
        return BTreeMap::new();
    }
    let has = |column: &str| measured.scalar(column).is_some();
    let unplaced = objects.iter().copied().filter(|object| is_unplaced(measured.scene, has, *object));
    let hands: Vec<Holder> = tracks.iter().filter_map(|track| Holder::new(measured, track)).collect();
    unplaced.filter_map(|object| Some((object, path(measured, &hands, object)?))).collect()
}

/// A hand with a gripper whose place the log has.
struct Holder<'a> {
    track: &'a HandTrack,
    points: Vec<[&'a [f64]; 3]>,
}

impl<'a> Holder<'a> {
    fn new(measured: &'a CleanLog, track: &'a HandTrack) -> Option<Self> {
        let side = track.side;
        measured.scalar(&format!("{side}.gripper.closed"))?;
        let position = |finger: Finger| measured.vec3(&format!("{side}.{finger}.position"));
        let tips = Finger::ALL.into_iter().filter(|finger| *finger != Finger::Palm);
        let mut points: Vec<[&[f64]; 3]> = tips.filter_map(position).collect();
        if points.is_empty() {
            points.extend(position(Finger::Palm));
        }
        (!points.is_empty()).then_some(Self { track, points })
    }

    fn holds(&self, object: usize, frame: usize) -> bool {
        self.track.touching.get(frame) == Some(&true) && self.track.target.get(frame) == Some(&Some(object))
    }

    /// The mean of the fingertips, or the palm, m.
    fn place(&self, frame: usize) -> Vector3<f64> {
        self.points.iter().map(|point| vector(point, frame)).sum::<Vector3<f64>>() / self.points.len() as f64
    }
}

/// The motion of an object; `None` if nothing holds it.
fn path(measured: &CleanLog, hands: &[Holder], object: usize) -> Option<HeldPath> {
    let mut places: Vec<Option<Vector3<f64>>> = vec![None; measured.len()];
    let mut holder: Option<&Holder> = None;
    let mut last: Option<Vector3<f64>> = None;
    for (frame, slot) in places.iter_mut().enumerate() {
        let is_held = holder.is_some();
        holder = holder
            .filter(|hand| hand.holds(object, frame))
            .or_else(|| hands.iter().find(|hand| hand.holds(object, frame)));
        // A hand that takes over continues from the object's current position.
        *slot = holder.map(|hand| match last.filter(|_| is_held) {
            Some(place) => place + hand.place(frame) - hand.place(frame - 1),
            None => hand.place(frame),
        });
        last = *slot;
    }
    let is_held: Vec<bool> = places.iter().map(Option::is_some).collect();
    let places = filled(&places)?;
    let position = [0, 1, 2].map(|axis| places.iter().map(|place| place[axis]).collect::<Vec<f64>>());
    let mut velocity = slopes(measured, position.each_ref().map(Vec::as_slice));
    for column in &mut velocity {
        column.iter_mut().zip(&is_held).filter(|(_, held)| !**held).for_each(|(value, _)| *value = 0.0);
    }
    Some(HeldPath { position, velocity })
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
