//! Lifts the way of an opened hand to its contacts where it would go through the object or a fixed body. An operator's hand brushes past an object, or pushes it a
//! little, where a robot's hand, which is another one and comes to other contacts, would push it away.

use super::own_axis::{Way, course, offsets};
use super::resolved_grasp::ResolvedGrasp;
use crate::kinematics::arm_distance::PlacedShape;
use crate::kinematics::surroundings::{SUNK_M, Surroundings};
use crate::model::hand::HandModel;
use nalgebra::{Isometry3, Translation3, Vector3};
use teachtree_base::easing::minimum_jerk;
use teachtree_base::meaning::Meaning;
use teachtree_base::pose::{PoseArray, pose_from_array};
use teachtree_base::scene::{Body, Role, Scene};
use teachtree_command::{Segment, Task};
use teachtree_description::shape::{CollisionShape, solids};

/// A hand is lifted by a multiple of this, until it is so far from what it would go through, up to so far, m.
pub(super) const STEP_M: f64 = 0.005;
const CLEAR_M: f64 = 0.002;
pub(super) const MOST_M: f64 = 0.15;
/// It rises and comes down at this speed, m/s; on the last of the way it comes down at the second one, m/s, and slows down by the third, m/s².
const RISES_M_S: f64 = 0.25;
const STEEP_M_S: f64 = 0.5;
const SLOWS_M_S2: f64 = 3.0;
/// Its speed changes over so many samples before and after.
const EASED: usize = 12;
/// An object is as high as before where its height differs by less than this, m.
const LEVEL_M: f64 = 0.005;
/// Ways are looked at in at most so many places.
const LOOKED_AT: usize = 40;

/// At how many of at most [`LOOKED_AT`] places on the ways to a grasp and from it the opened hand goes through the object or a fixed body.
pub(super) fn goes_through(
    task: &Task,
    grasp: usize,
    hand: &HandModel,
    grip: &ResolvedGrasp,
    object: &Body,
    scene: &Scene,
) -> usize {
    let World { up, object, fixed } = World::of(task, object, scene);
    let opened = grip.opened(hand);
    let meets = |way: Way| {
        let places: Vec<(Vector3<f64>, Isometry3<f64>)> = offsets(task, grasp, way);
        let step = places.len().div_ceil(LOOKED_AT).max(1);
        let meets = |(offset, pose): &&(Vector3<f64>, Isometry3<f64>)| {
            let fixed = fixed.moved(&pose.inverse());
            Stage { up, object: &object, fixed }.is_nearer(&opened, offset, 0.0)
        };
        places.iter().step_by(step).filter(meets).count()
    };
    meets(Way::There) + meets(Way::Away)
}

/// Lifts the ways of a task to its mapped grasps, and from them where the object is as high in the end as before: it stands, or the other hand moves it on.
pub(super) fn lift(task: &mut Task, hand: &HandModel, grips: &[ResolvedGrasp], object: &Body, scene: &Scene) {
    let world = World::of(task, object, scene);
    for at in 0..task.segments.len() {
        let Some(grip) = task.segments[at].grasp.and_then(|grasp| grips.get(grasp)) else { continue };
        let opened = grip.opened(hand);
        if at > 0 && task.segments[at].touching && !task.segments[at - 1].touching {
            let begins = task.segments[..at].iter().rposition(|segment| segment.touching).map_or(0, |at| at + 1);
            lead_to_contacts(task, at - 1, &grip.middle);
            world.lift(&mut task.segments[begins..at], &opened, &grip.middle, Way::There);
        }
        let segment = &mut task.segments[at..=at];
        if segment[0].touching && segment[0].does == Meaning::Open && keeps_height(&segment[0], &world.up) {
            let first = segment[0].hand.first().map_or_else(Vector3::zeros, |first| Vector3::from(*first));
            world.lift(segment, &opened, &first, Way::Away);
        }
    }
}

/// Whether the object of a segment is as high at its end as at its beginning.
fn keeps_height(segment: &Segment, up: &Vector3<f64>) -> bool {
    let place = |pose: &PoseArray| pose_from_array(pose).translation.vector;
    let ends = segment.object.first().map(place).zip(segment.object.last().map(place));
    ends.is_some_and(|(first, last)| (last - first).dot(up).abs() < LEVEL_M)
}

/// What hands must be clear of: the object, its frame, and fixed bodies, reference frame.
struct World {
    up: Vector3<f64>,
    object: Vec<CollisionShape>,
    fixed: Surroundings,
}

impl World {
    /// The object of a task, the fixed bodies of a scene, and the body into whose hole the object goes.
    fn of(task: &Task, object: &Body, scene: &Scene) -> Self {
        let up = scene.up();
        let into =
            task.into.as_ref().and_then(|into| Some((scene.bodies.get(&into.body)?, pose_from_array(&into.pose))));
        let into = into.filter(|(body, _)| body.role == Role::Object).into_iter().flat_map(|(body, pose)| {
            let sunk = Translation3::from(-up * SUNK_M) * pose;
            solids(body).into_iter().map(move |solid| solid.moved(&sunk))
        });
        Self { up, object: solids(object), fixed: Surroundings::sunk(scene, SUNK_M).with(into) }
    }

    /// Lifts a way, on which an opened hand is `offset` from its place on the object where it is at `from`, object frame.
    fn lift(&self, way: &mut [Segment], opened: &[PlacedShape], from: &Vector3<f64>, which: Way) {
        let needs = |(place, world_from_object): (Vector3<f64>, Isometry3<f64>)| {
            let up = world_from_object.inverse_transform_vector(&self.up);
            let stage = Stage { up, object: &self.object, fixed: self.fixed.moved(&world_from_object.inverse()) };
            (stage.needed(opened, &(place - from)), up)
        };
        let samples = way.iter().flat_map(|segment| course(segment, which));
        let (mut needed, mut ups): (Vec<f64>, Vec<Vector3<f64>>) = samples.map(needs).unzip();
        let takes_s: f64 = way.iter().map(|segment| segment.duration_s).sum();
        let step_s = takes_s / needed.len().saturating_sub(1).max(1) as f64;
        if which == Way::Away {
            needed.reverse();
            ups.reverse();
        }
        // What is not clear at the object cannot be on the way.
        if needed.last().is_none_or(|needed| *needed > 0.0) || needed.iter().all(|needed| *needed == 0.0) {
            return;
        }
        let mut lifted: Vec<Vector3<f64>> =
            eased(&needed, step_s).into_iter().zip(ups).map(|(height, up)| up * height).collect();
        if which == Way::Away {
            lifted.reverse();
        }
        for (place, lifted) in way.iter_mut().flat_map(|segment| &mut segment.hand).zip(lifted) {
            *place = (Vector3::from(*place) + lifted).into();
        }
    }
}

/// Lets a way end exactly over the contacts, as a plan would.
fn lead_to_contacts(task: &mut Task, at: usize, middle: &Vector3<f64>) {
    let hand = &mut task.segments[at].hand;
    let Some(last) = hand.last().map(|last| Vector3::from(*last) - middle) else { return };
    let count = hand.len().saturating_sub(1).max(1) as f64;
    for (index, place) in hand.iter_mut().enumerate() {
        let share = index as f64 / count;
        *place = (Vector3::from(*place) - last * minimum_jerk((share - 0.5) / 0.5)).into();
    }
}

/// What a hand must be clear of at a time, frame of the object.
struct Stage<'a> {
    up: Vector3<f64>,
    object: &'a [CollisionShape],
    fixed: Surroundings,
}

impl Stage<'_> {
    /// Whether a hand at an offset from its place on the object is nearer than this to anything, m.
    fn is_nearer(&self, hand: &[PlacedShape], offset: &Vector3<f64>, than: f64) -> bool {
        let others = || self.object.iter().chain(self.fixed.shapes());
        hand.iter().map(|shape| shape.shifted(offset)).any(|shape| others().any(|other| shape.is_nearer(other, than)))
    }

    /// By how much a hand at an offset from its place on the object is to be lifted, m.
    fn needed(&self, hand: &[PlacedShape], offset: &Vector3<f64>) -> f64 {
        if !self.is_nearer(hand, offset, 0.0) {
            return 0.0;
        }
        let steps = (1..=(MOST_M / STEP_M) as usize).map(|step| step as f64 * STEP_M);
        { steps }.find(|lifted| !self.is_nearer(hand, &(offset + self.up * *lifted), CLEAR_M)).unwrap_or(0.0)
    }
}

/// The heights by which a way to an object is lifted, m: what is needed, with a rise before it and a descent after it. `step_s` is the time from one to the next.
pub(super) fn eased(needed: &[f64], step_s: f64) -> Vec<f64> {
    let mut heights = needed.to_vec();
    for at in 1..heights.len() {
        heights[at] = heights[at].max(heights[at - 1] - RISES_M_S * step_s);
    }
    for at in (1..heights.len()).rev() {
        heights[at - 1] = heights[at - 1].max(heights[at] - RISES_M_S * step_s);
    }
    let about = |at: usize| at.saturating_sub(EASED)..(at + EASED + 1).min(needed.len());
    let widest: Vec<f64> =
        (0..heights.len()).map(|at| heights[about(at)].iter().copied().fold(0.0, f64::max)).collect();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let last = needed.len().saturating_sub(1);
    let height = |at: usize| mean(&widest[about(at)]).min(left_to_fall((last - at) as f64 * step_s));
    (0..needed.len()).map(height).collect()
}

/// How high a hand may be so long before it has come down, m.
fn left_to_fall(left_s: f64) -> f64 {
    let slows_s = STEEP_M_S / SLOWS_M_S2;
    if left_s < slows_s { SLOWS_M_S2 * left_s * left_s / 2.0 } else { STEEP_M_S * (left_s - slows_s / 2.0) }
}
