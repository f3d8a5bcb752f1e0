//! Approach and retreat of a hand along its own axis.
//!
//! If the contacts of two hands alternate around an object, both hands cannot approach and retreat on the same side: seen from there, the arc from the thumb of
//! one hand over its palm to its fingers crosses that of the other one, and each would have to be above the other. One of them therefore moves along the axis of
//! its own palm.

use super::plan::segments::left_at;
use super::resolved_grasp::ResolvedGrasp;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use teachtree_base::easing::minimum_jerk;
use teachtree_base::hands::Finger;
use teachtree_base::meaning::Meaning;
use teachtree_base::pose::pose_from_array;
use teachtree_command::{Segment, Task};

/// Distance from the object at which the direction of a demonstrated path is taken, m.
const AWAY_M: f64 = 0.06;
/// Distances from the object up to which a path is fully turned, and beyond which it is unchanged, m.
const TURNED_M: [f64; 2] = [0.10, 0.25];

/// A path of a hand that touches nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Leg {
    /// To the contacts.
    Approach,
    /// From them.
    Retreat,
}

/// Turns the path of a hand to or from a grasp along the hand's own axis near the object. Returns false if there is nothing to turn.
pub(super) fn turn(task: &mut Task, grasp: usize, grip: &ResolvedGrasp, which: Leg) -> bool {
    let Some(axis) = axis(grip) else { return false };
    let places = places(task, grasp, which);
    let way: Vec<Vector3<f64>> =
        places.iter().flat_map(|at| &task.segments[*at].hand).map(|it| Vector3::from(*it)).collect();
    let from_object: Vec<Vector3<f64>> = if which == Leg::Approach { way.into_iter().rev().collect() } else { way };
    let Some(end) = from_object.first().copied() else { return false };
    let far = from_object.iter().map(|at| at - end);
    let shown = far
        .clone()
        .find(|off| off.norm() > AWAY_M)
        .or_else(|| far.clone().next_back())
        .and_then(|off| off.try_normalize(1e-3));
    let Some(turn) = shown.and_then(|shown| UnitQuaternion::rotation_between(&shown, &axis)) else { return false };
    for at in places {
        for hand in &mut task.segments[at].hand {
            let off = Vector3::from(*hand) - end;
            let share = 1.0 - minimum_jerk((off.norm() - TURNED_M[0]) / (TURNED_M[1] - TURNED_M[0]));
            *hand = (end + turn.powf(share) * off).into();
        }
    }
    true
}

/// Where the middle of the fingertips is in each sample of a segment of a way, object frame, m; and where the object is then, reference frame.
pub(super) fn course(segment: &Segment, which: Leg) -> impl Iterator<Item = (Vector3<f64>, Isometry3<f64>)> {
    let last = segment.hand.len().saturating_sub(1).max(1) as f64;
    let samples = segment.hand.iter().zip(&segment.object).enumerate();
    samples.map(move |(at, (hand, object))| match which {
        Leg::Approach => (Vector3::from(*hand), pose_from_array(object)),
        Leg::Retreat => (Vector3::from(*hand), left_at(segment, at as f64 / last)),
    })
}

/// The offsets of the middle of the fingertips on a way, from their place on the object, object frame, m; and the poses of the object.
pub(super) fn offsets(task: &Task, grasp: usize, which: Leg) -> Vec<(Vector3<f64>, Isometry3<f64>)> {
    let segments = places(task, grasp, which).into_iter().map(|at| &task.segments[at]);
    let way: Vec<(Vector3<f64>, Isometry3<f64>)> = segments.flat_map(|segment| course(segment, which)).collect();
    let end = if which == Leg::Approach { way.last() } else { way.first() };
    let end = end.map_or_else(Vector3::zeros, |(end, _)| *end);
    way.into_iter().map(|(at, object)| (at - end, object)).collect()
}

/// The segments of a way.
fn places(task: &Task, grasp: usize, which: Leg) -> Vec<usize> {
    let of = |at: &usize| task.segments[*at].grasp == Some(grasp);
    let all = 0..task.segments.len();
    match which {
        Leg::Approach => {
            let touches = task.segments.iter().position(|segment| segment.touching && segment.grasp == Some(grasp));
            let touches = touches.unwrap_or_default();
            let begins = task.segments[..touches].iter().rposition(|segment| segment.touching).map_or(0, |at| at + 1);
            (begins..touches).collect()
        }
        Leg::Retreat => all.filter(of).filter(|at| task.segments[*at].does == Meaning::Open).collect(),
    }
}

/// From the contacts to the palm, where there is a thumb across the line from it to the fingers; object frame.
fn axis(grip: &ResolvedGrasp) -> Option<Vector3<f64>> {
    let tips = |thumb: bool| {
        let of = grip.tips.iter().filter(move |(finger, ..)| (*finger == Finger::Thumb) == thumb);
        of.map(|(_, closed, _)| closed.coords).collect::<Vec<_>>()
    };
    let (thumb, fingers) = (tips(true), tips(false));
    let mean = |tips: &[Vector3<f64>]| tips.iter().sum::<Vector3<f64>>() / tips.len().max(1) as f64;
    let (middle, across) = match (thumb.first(), fingers.as_slice()) {
        (Some(thumb), [_, ..]) => {
            let fingers = mean(&fingers);
            ((fingers + thumb) / 2.0, (fingers - thumb).try_normalize(1e-3)?)
        }
        // What pushes has nothing across from it.
        (Some(thumb), []) => (*thumb, Vector3::zeros()),
        (None, _) => (mean(&fingers), Vector3::zeros()),
    };
    let back = -middle;
    Some(grip.object_from_palm * (back - across * back.dot(&across)).try_normalize(1e-3)?)
}
