//! Properties of the segments of a task, for plans.

use super::{LEAVING_S, OPENING_S, Phase, Role, SAMPLE_S};
use crate::planning::interpolation::pose_at;
use nalgebra::{Isometry3, Vector3};
use teachtree_base::meaning::Meaning;
use teachtree_base::pose::pose_from_array;
use teachtree_command::{Precedence, Segment};

/// Minimum duration of a phase, s.
pub(super) const SHORTEST_S: f64 = 0.05;
/// Largest speeds of a palm on a path that was not demonstrated, m/s and rad/s, and the shortest time of such a path, s.
pub(super) const TRANSFER_M_S: f64 = 0.25;
const TRANSFER_RAD_S: f64 = 1.0;
const TRANSFER_S: f64 = 0.8;
/// Displacement of an object while a hand closes above which it is executed after the closing, m and rad; a smaller one is made up for later.
const BROUGHT: (f64, f64) = (0.010, 0.087);
/// Downward speed above which a released object falls, m/s: the hand does not follow it, unlike an object that the other hand takes.
const FALLS_M_S: f64 = 0.5;

/// Returns the end time of a segment, s of the recording. Sample times start at zero in each task.
pub(super) fn ends_s(segments: &[Segment], index: usize) -> f64 {
    let ends = segments[index].demonstrated_start_s + segments[index].duration_s;
    let next = segments.get(index + 1).map(|next| next.demonstrated_start_s);
    next.filter(|next| (next - ends).abs() < SAMPLE_S).unwrap_or(ends)
}

/// Returns the time (s of the recording) at which a path with precedence is executed: the start of its first segment or the end of its last one.
pub(super) fn precedence_s(segments: &[Segment], at: usize, precedence: Precedence) -> f64 {
    let same = |segment: &&Segment| segment.precedence == Some(precedence);
    match precedence {
        Precedence::First => segments[..=at].iter().rev().take_while(same).last().map(|it| it.demonstrated_start_s),
        Precedence::Last => {
            segments[at..].iter().take_while(same).last().map(|it| it.demonstrated_start_s + it.duration_s)
        }
    }
    .unwrap_or(segments[at].demonstrated_start_s)
}

/// Whether the object of a segment moves or turns far.
pub(super) fn is_brought(segment: &Segment) -> bool {
    let ends = segment.object.first().zip(segment.object.last());
    ends.is_some_and(|(first, last)| !is_near(&(pose_from_array(first).inverse() * pose_from_array(last))))
}

/// Whether a displacement is small enough that the object stays while a hand closes.
pub(super) fn is_near(off: &Isometry3<f64>) -> bool {
    off.translation.vector.norm() <= BROUGHT.0 && off.rotation.angle() <= BROUGHT.1
}

/// Returns the pose of the object of a release when the hand has covered a share of its retreat, 0 to 1: the hand opens first, and the other hand may move the object
/// at the same time.
pub(in crate::planning) fn left_at(segment: &Segment, gone: f64) -> Isometry3<f64> {
    let lasts_s = segment.duration_s.max(LEAVING_S);
    pose_at(&segment.object, (OPENING_S + gone * (lasts_s - OPENING_S)) / lasts_s)
}

/// Whether a hand that closes in a segment already holds the object with the same grasp, as after a stop on the path: it keeps the grasp.
pub(super) fn holds_on(segments: &[Segment], index: usize) -> bool {
    let before = index.checked_sub(1).map(|before| &segments[before]).filter(|before| before.touching);
    before.is_some_and(|before| before.does != Meaning::Open && before.grasp == segments[index].grasp)
}

/// Whether a hand has closed in a phase of a segment: the rest of the segment has the force at its end.
pub(super) fn has_closed(phases: &[Phase<'_>], segment: &Segment) -> bool {
    let closes = |phase: &Phase<'_>| phase.role == Role::Close && std::ptr::eq(phase.segment, segment);
    segment.does == Meaning::Close && phases.iter().any(closes)
}

/// Whether the object of a segment falls.
pub(super) fn falls(segment: &Segment) -> bool {
    let step_s = segment.duration_s / segment.object.len().saturating_sub(1).max(1) as f64;
    segment.object.windows(2).any(|pair| pair[0][2] - pair[1][2] > FALLS_M_S * step_s)
}

/// Returns the time to bring a displaced object onto the demonstrated path, s. A carried object is brought there soon, since the other hand may approach it there. An
/// object on its support is not dragged before it is carried. An object that is never carried is brought there in the first segment in which it is held, or in more
/// segments if that one is too short.
pub(super) fn fade_time(segments: &[Segment], off: &Isometry3<f64>) -> f64 {
    let needs = transfer_time(off.translation.vector.norm(), off.rotation.angle());
    let mut takes: f64 = 0.0;
    for segment in held(segments) {
        if takes >= needs {
            break;
        }
        let carried = segment.does == Meaning::Carry;
        let lasts = segment.duration_s.max(SHORTEST_S);
        takes += if carried { lasts.min(needs - takes) } else { lasts };
    }
    takes.max(SHORTEST_S)
}

/// Returns the segments in which an object is held until it is released or inserted; during a regrasp it stands still.
fn held(segments: &[Segment]) -> impl Iterator<Item = &Segment> {
    let held = segments.iter().filter(|segment| segment.does != Meaning::Close);
    held.take_while(|segment| segment.touching && !matches!(segment.does, Meaning::Open | Meaning::Insert))
}

/// Whether the held object stays on its support now and is carried later.
pub(super) fn is_carried_later(segments: &[Segment]) -> bool {
    let carried = |segment: &Segment| segment.does == Meaning::Carry;
    segments.first().is_some_and(|now| !carried(now)) && held(segments).any(carried)
}

/// Returns the share of the time of a segment at which the commanded forces are largest, 0 to 1.
pub(super) fn firmest(segment: &Segment) -> f64 {
    let samples = segment.tips.iter().map(|tip| tip.force.len()).min().unwrap_or(0);
    let firmness = |at: usize| segment.tips.iter().map(|tip| Vector3::from(tip.force[at]).norm()).sum::<f64>();
    let at = (0..samples).max_by(|one, other| firmness(*one).total_cmp(&firmness(*other))).unwrap_or(0);
    at as f64 / samples.saturating_sub(1).max(1) as f64
}

/// Returns the duration of a path and a rotation of a palm, s.
pub(super) fn transfer_time(way: f64, turn: f64) -> f64 {
    // The peak speed of minimum jerk is 1.9 times its mean.
    (way / TRANSFER_M_S * 1.9).max(turn / TRANSFER_RAD_S * 1.9).max(TRANSFER_S)
}

/// Returns the share of the retreat of a hand, 0 to 1, at a time after the beginning of a release that takes `duration`, s.
pub(super) fn gone(since_s: f64, duration_s: f64) -> f64 {
    ((since_s - OPENING_S) / (duration_s - OPENING_S)).clamp(0.0, 1.0)
}

/// Returns the relative lift at a share of a path: 0 at its ends, 1 in its middle.
pub(super) fn arch(share: f64) -> f64 {
    4.0 * share * (1.0 - share)
}
