//! Lifts the path of an opened hand to its contacts where it would go through the object or a fixed body. An operator's hand brushes past an object, or pushes it
//! a little; a robot's hand has another shape and comes to other contacts, and would push the object away.

use super::axial_retreat::{Leg, course, offsets};
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

/// A path is lifted in multiples of `STEP_M`, up to `MOST_M`, until the hand is `CLEAR_M` from the shapes that it would go through, m.
pub(super) const STEP_M: f64 = 0.005;
const CLEAR_M: f64 = 0.002;
pub(super) const MOST_M: f64 = 0.15;
/// Speed at which a hand rises and descends, m/s; largest speed and deceleration at the end of the descent, m/s and m/s².
const RISES_M_S: f64 = 0.25;
const STEEP_M_S: f64 = 0.5;
const SLOWS_M_S2: f64 = 3.0;
/// Number of samples before and after a change of speed over which the speed changes.
const EASED: usize = 12;
/// Largest difference in height at which an object counts as being as high as before, m.
const LEVEL_M: f64 = 0.005;
/// Maximum number of places at which a path is checked.
const PLACES: usize = 40;

/// Returns the number of places, of at most [`PLACES`] on each path to and from a grasp, at which the opened hand goes through the object or a fixed body.
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
    let meets = |way: Leg| {
        let places: Vec<(Vector3<f64>, Isometry3<f64>)> = offsets(task, grasp, way);
        let step = places.len().div_ceil(PLACES).max(1);
        let meets = |(offset, pose): &&(Vector3<f64>, Isometry3<f64>)| {
            let fixed = fixed.moved(&pose.inverse());
            Stage { up, object: &object, fixed }.is_nearer(&opened, offset, 0.0)
        };
        places.iter().step_by(step).filter(meets).count()
    };
    meets(Leg::Approach) + meets(Leg::Retreat)
}

/// Lifts the paths of a task to its mapped grasps, and those from them if the object ends at its initial height: it rests, or the other hand takes it over.
pub(super) fn lift(task: &mut Task, hand: &HandModel, grips: &[ResolvedGrasp], object: &Body, scene: &Scene) {
    let world = World::of(task, object, scene);
    for at in 0..task.segments.len() {
        let Some(grip) = task.segments[at].grasp.and_then(|grasp| grips.get(grasp)) else { continue };
        let opened = grip.opened(hand);
        if at > 0 && task.segments[at].touching && !task.segments[at - 1].touching {
            let begins = task.segments[..at].iter().rposition(|segment| segment.touching).map_or(0, |at| at + 1);
            lead_to_contacts(task, at - 1, &grip.middle);
            world.lift(&mut task.segments[begins..at], &opened, &grip.middle, Leg::Approach);
        }
        let segment = &mut task.segments[at..=at];
        if segment[0].touching && segment[0].does == Meaning::Open && keeps_height(&segment[0], &world.up) {
            let first = segment[0].hand.first().map_or_else(Vector3::zeros, |first| Vector3::from(*first));
            world.lift(segment, &opened, &first, Leg::Retreat);
        }
    }
}

/// Whether the object of a segment has the same height at its end as at its beginning.
fn keeps_height(segment: &Segment, up: &Vector3<f64>) -> bool {
    let place = |pose: &PoseArray| pose_from_array(pose).translation.vector;
    let ends = segment.object.first().map(place).zip(segment.object.last().map(place));
    ends.is_some_and(|(first, last)| (last - first).dot(up).abs() < LEVEL_M)
}

/// The shapes of which hands must be clear: the object, in its frame, and fixed bodies, in the reference frame.
struct World {
    up: Vector3<f64>,
    object: Vec<CollisionShape>,
    fixed: Surroundings,
}

impl World {
    /// Returns the object of a task, the fixed bodies of the scene, and the body with the hole of the object.
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

    /// Lifts a path of an opened hand; `from` is the position of the middle of its fingertips at the grasp, object frame.
    fn lift(&self, way: &mut [Segment], opened: &[PlacedShape], from: &Vector3<f64>, which: Leg) {
        let needs = |(place, world_from_object): (Vector3<f64>, Isometry3<f64>)| {
            let up = world_from_object.inverse_transform_vector(&self.up);
            let stage = Stage { up, object: &self.object, fixed: self.fixed.moved(&world_from_object.inverse()) };
            (stage.needed(opened, &(place - from)), up)
        };
        let samples = way.iter().flat_map(|segment| course(segment, which));
        let (mut needed, mut ups): (Vec<f64>, Vec<Vector3<f64>>) = samples.map(needs).unzip();
        let takes_s: f64 = way.iter().map(|segment| segment.duration_s).sum();
        let step_s = takes_s / needed.len().saturating_sub(1).max(1) as f64;
        if which == Leg::Retreat {
            needed.reverse();
            ups.reverse();
        }
        // A hand that is not clear at the object cannot be lifted clear on the path.
        if needed.last().is_none_or(|needed| *needed > 0.0) || needed.iter().all(|needed| *needed == 0.0) {
            return;
        }
        let mut lifted: Vec<Vector3<f64>> =
            eased(&needed, step_s).into_iter().zip(ups).map(|(height, up)| up * height).collect();
        if which == Leg::Retreat {
            lifted.reverse();
        }
        for (place, lifted) in way.iter_mut().flat_map(|segment| &mut segment.hand).zip(lifted) {
            *place = (Vector3::from(*place) + lifted).into();
        }
    }
}

/// Lets a path end exactly over the contacts, as a plan does.
fn lead_to_contacts(task: &mut Task, at: usize, middle: &Vector3<f64>) {
    let hand = &mut task.segments[at].hand;
    let Some(last) = hand.last().map(|last| Vector3::from(*last) - middle) else { return };
    let count = hand.len().saturating_sub(1).max(1) as f64;
    for (index, place) in hand.iter_mut().enumerate() {
        let share = index as f64 / count;
        *place = (Vector3::from(*place) - last * minimum_jerk((share - 0.5) / 0.5)).into();
    }
}

/// The shapes of which a hand must be clear at a time, frame of the object.
struct Stage<'a> {
    up: Vector3<f64>,
    object: &'a [CollisionShape],
    fixed: Surroundings,
}

impl Stage<'_> {
    /// Whether a hand at an offset from its pose at the grasp is nearer than this to a shape, m.
    fn is_nearer(&self, hand: &[PlacedShape], offset: &Vector3<f64>, than: f64) -> bool {
        let others = || self.object.iter().chain(self.fixed.shapes());
        hand.iter().any(|shape| others().any(|other| shape.is_nearer_shifted(offset, other, than)))
    }

    /// Returns the height by which a hand at an offset from its pose at the grasp must be lifted, m.
    fn needed(&self, hand: &[PlacedShape], offset: &Vector3<f64>) -> f64 {
        if !self.is_nearer(hand, offset, 0.0) {
            return 0.0;
        }
        let steps = (1..=(MOST_M / STEP_M) as usize).map(|step| step as f64 * STEP_M);
        { steps }.find(|lifted| !self.is_nearer(hand, &(offset + self.up * *lifted), CLEAR_M)).unwrap_or(0.0)
    }
}

/// Returns the heights by which a path to an object is lifted, m: the needed heights, with a rise before and a descent after them. `step_s` is the sampling time.
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

/// Returns the largest height at a time before the end of the descent, m.
fn left_to_fall(left_s: f64) -> f64 {
    let slows_s = STEEP_M_S / SLOWS_M_S2;
    if left_s < slows_s { SLOWS_M_S2 * left_s * left_s / 2.0 } else { STEEP_M_S * (left_s - slows_s / 2.0) }
}
