//! Places objects at their resting poses. An object that the operator drops a little or moves during the release is commanded to the pose at which it came to
//! rest, because falls and knocks are random and not reproducible (the paper, section 2.1: such error is inadvertent). A fall that the rules label was
//! intended: the robot brings the object above its resting place, at the height of the demonstration, and drops it there.

use super::episodes::{BRUSH_S, FELL, apart};
use super::series::{Episode, RESTS_WITHIN_S, Series};
use super::{HandledTask, overlap};
use nalgebra::{Isometry3, Translation3, Vector3};
use teachtree_analysis::{Segment, TaskSpan, UNKNOWN};
use teachtree_base::easing::smooth_step;
use teachtree_base::meaning::Meaning;
use teachtree_base::recording::Recording;

/// Distance (m) and angle (rad) between release and rest above which an object counts as dropped. Drops are left unchanged.
const DROPPED: (f64, f64) = (0.040, 0.6);
/// Maximum height of a drop after which an object that rests upright is placed, m. The placement begins when the object was within the second distance of its
/// release, m.
const LOWERED_M: f64 = 0.150;
const THERE_M: f64 = 0.030;
/// The share of the holding time in which the object is moved to its resting pose.
const SHARE: f64 = 0.5;

/// Minimum further holding time, s, of an object into which another hand inserts something. Otherwise its pose is not changed.
const HELD_ON_S: f64 = 0.3;

/// Times of the recording that affect a placed object, s.
#[derive(Clone, Copy)]
struct PlacementTimes {
    /// The time from which another hand inserts an object into it; objects in it move along only before that.
    entered_s: Option<f64>,
    /// The end of the last motion of the object, s.
    ends_s: f64,
}

/// Marks the brushes among tasks: short tasks without a name, by a hand that has a named task, of an object that another task has just released. That task
/// places the object at its pose after the brush.
pub(super) fn note_brushes(handled: &mut [HandledTask<'_>]) {
    let is_brush = |brush: &HandledTask<'_>| {
        let moved = brush.series.object.first().zip(brush.series.object.last());
        let stays_near = moved.is_some_and(|(first, last)| {
            let (way, turn) = apart(first, last);
            way < DROPPED.0 && turn < DROPPED.1
        });
        let is_taught = |other: &HandledTask<'_>| other.side == brush.side && other.span.task != UNKNOWN;
        let lets_go = |other: &HandledTask<'_>| other.object == brush.object && other.has_let_go(brush.span.start_s);
        is_short(brush.span) && stays_near && handled.iter().any(is_taught) && handled.iter().any(lets_go)
    };
    let brushes: Vec<bool> = handled.iter().map(is_brush).collect();
    handled.iter_mut().zip(brushes).for_each(|(handled, is_brush)| handled.is_brush = is_brush);
}

/// Whether a task has no name and is too short to be intended.
fn is_short(span: &TaskSpan) -> bool {
    let touches = span.segments.iter().filter(|segment| {
        let does = segment.does.unwrap_or_default();
        !does.is_free() && does != Meaning::Open
    });
    span.task == UNKNOWN && touches.map(|segment| segment.end_s - segment.start_s).sum::<f64>() < BRUSH_S
}

impl HandledTask<'_> {
    /// Whether the task grasps its object and releases it at about this time, s of the recording.
    fn has_let_go(&self, time_s: f64) -> bool {
        let does = |segment: &Segment| segment.does.unwrap_or_default();
        let takes = self.span.segments.iter().any(|segment| does(segment) == Meaning::Close);
        let last = self.span.segments.iter().rfind(|segment| !does(segment).is_free());
        let from_s = last.filter(|last| does(last) == Meaning::Open).map(|last| last.start_s);
        takes && from_s.is_some_and(|from_s| (from_s..self.span.end_s + RESTS_WITHIN_S).contains(&time_s))
    }

    /// Whether the other hand handles an object at the same time.
    fn meets(&self, other: &Self) -> bool {
        !other.is_brush && other.side != self.side && overlap(other.span, self.span)
    }

    /// Whether the object of this task was inserted into that of another task.
    fn is_in(&self, other: &Self) -> bool {
        self.entered.as_ref().is_some_and(|entered| entered.body == other.object)
    }
}

/// Moves all objects to their resting poses, and then the objects inside them.
pub(super) fn put_all_down(handled: &mut [HandledTask<'_>], recording: &Recording) {
    for at in 0..handled.len() {
        let this = &handled[at];
        let others = || handled.iter().filter(|other| this.meets(other));
        // A released object may be in the other hand, or on an object that the other hand moves.
        if !others().all(|other| other.is_in(this)) {
            continue;
        }
        let entered_s = others().filter_map(|other| other.entered.as_ref()).map(|entered| entered.since_s);
        // A brush may touch this object, or an object in it.
        let in_it = || handled.iter().filter(|other| other.is_in(this)).map(|other| other.object);
        let brushes = handled.iter().filter(|brush| brush.is_brush);
        let brushes =
            brushes.filter(|brush| brush.object == this.object || in_it().any(|object| object == brush.object));
        let brushed_s = brushes
            .map(|brush| brush.span)
            .filter(|brush| (this.span.start_s..this.span.end_s + RESTS_WITHIN_S).contains(&brush.start_s));
        let ends_s = brushed_s.fold(this.span.end_s, |ends_s, brush| ends_s.max(brush.end_s));
        let times = PlacementTimes { entered_s: entered_s.reduce(f64::max), ends_s };
        let this = &mut handled[at];
        put_down(&mut this.series, recording, this.object, &this.episodes, times);
    }
    for at in 0..handled.len() {
        let this = &handled[at];
        let carries = |other: &usize| this.meets(&handled[*other]) && this.is_in(&handled[*other]);
        let Some(carrier) = (0..handled.len()).rfind(carries) else { continue };
        if let Ok([this, carrier]) = handled.get_disjoint_mut([at, carrier]) {
            carry_along(this, recording, carrier);
        }
    }
}

/// Moves the object at the end of each episode to its resting pose, or above it if the fall is intended.
fn put_down(series: &mut Series, recording: &Recording, object: &str, episodes: &[Episode], times: PlacementTimes) {
    let up = recording.scene.up();
    for (number, episode) in episodes.iter().enumerate() {
        let grasped = episode.pieces.iter().any(|piece| piece.does == Meaning::Close);
        let inserts = episode.pieces.iter().any(|piece| piece.does == Meaning::Insert);
        let held = episode.pieces.iter().filter(|piece| piece.touching && piece.does != Meaning::Open);
        let held: Vec<usize> =
            held.filter(|piece| piece.does != Meaning::Close).flat_map(|piece| piece.samples.iter().copied()).collect();
        let let_go = episode.pieces.last().filter(|piece| piece.does == Meaning::Open);
        let (Some(&first), Some(&last), Some(_)) = (held.first(), held.last(), let_go) else { continue };
        if !grasped {
            continue;
        }
        let touched_again = episodes.iter().skip(number + 1).flat_map(|later| &later.pieces).find(|it| it.touching);
        let rests = touched_again.map_or(series.len() - 1, |piece| piece.samples[0]);
        let rested = touched_again.is_none().then(|| series.at_rest(recording, object, times.ends_s)).flatten();
        let in_hole = inserts && times.entered_s.is_none();
        if let (true, Some(rested), Some(wanted)) = (in_hole || episode.lets_fall, rested, series.wanted.last_mut()) {
            *wanted = rested;
        }
        // An object that is released in a hole falls along the axis of the hole.
        if in_hole {
            continue;
        }
        let (from, rest) = (series.object[last], rested.unwrap_or(series.object[rests]));
        let to = if episode.lets_fall { above(&rest, &from, &up) } else { rest };
        let (way, turn) = apart(&from, &to);
        let farthest = if episode.lets_fall { DROPPED.0 } else { LOWERED_M };
        if (way < FELL.0 && turn < FELL.1) || way > farthest || turn > DROPPED.1 {
            continue;
        }
        let there = |at: &&usize| apart(&series.object[**at], &from).0 < THERE_M;
        let begins = if way > DROPPED.0 {
            held.iter().rev().take_while(there).last().copied().unwrap_or(last)
        } else {
            last - ((last - first) as f64 * SHARE) as usize
        };
        if times.entered_s.is_some_and(|entered_s| entered_s > series.time_s(last) - HELD_ON_S) {
            continue;
        }
        let begins = times.entered_s.map_or(begins, |entered_s| begins.max(series.sample(entered_s)));
        let turned = to.rotation * from.rotation.inverse();
        let moved = to.translation.vector - from.translation.vector;
        for at in held.into_iter().filter(|at| *at >= begins) {
            let share = smooth_step((at - begins) as f64 / (last - begins).max(1) as f64);
            let demonstrated = series.object[at];
            let place = Translation3::from(demonstrated.translation.vector + moved * share);
            series.wanted[at] = Isometry3::from_parts(place, turned.powf(share) * demonstrated.rotation);
        }
        for at in last + 1..series.len().min(rests + 1) {
            let falls = episode.lets_fall && at + 1 < series.len();
            series.wanted[at] = if falls { above(&rest, &series.object[at], &up) } else { rest };
        }
    }
}

/// Returns the pose with the height of `was` from which an object falls to `rest` without rotation. `up` is a unit vector, or zero without gravity.
fn above(rest: &Isometry3<f64>, was: &Isometry3<f64>, up: &Vector3<f64>) -> Isometry3<f64> {
    let height = up.dot(&(was.translation.vector - rest.translation.vector));
    Translation3::from(up * height) * rest
}

/// Moves an inserted object along with the object around it, from the insertion on.
fn carry_along(this: &mut HandledTask<'_>, recording: &Recording, carrier: &HandledTask<'_>) {
    let Some(entered) = &this.entered else { return };
    let Some(demonstrated) = this.series.other(recording, carrier.object) else { return };
    let Some(rests) = carrier.series.wanted.last() else { return };
    let from = this.series.sample(entered.since_s);
    for (at, demonstrated) in demonstrated.iter().enumerate().skip(from) {
        let time_s = this.series.time_s(at);
        let by = if time_s <= carrier.span.end_s {
            let sample = carrier.series.sample(time_s);
            carrier.series.wanted[sample] * carrier.series.object[sample].inverse()
        } else if apart(demonstrated, rests).0 < DROPPED.0 {
            rests * demonstrated.inverse()
        } else {
            // The object is moved again.
            break;
        };
        this.series.wanted[at] = by * this.series.wanted[at];
    }
}
