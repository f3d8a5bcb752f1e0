//! Selects the commanded segments of a task: attempts with an effect, without aborted approaches and pauses.
//!
//! An *attempt* lies between two free motions: Move and Approach, contact, Release. An attempt that only grasped and released, or that released in the air
//! before another attempt, was a mistake and is omitted (the paper, section 2.1). A Move and an Approach before another Move are omitted too. Events with their
//! own primitive were intended: a second grasp with a different name, and a fall in a task that succeeds.

use super::RATE_HZ;
use super::schema::Omission;
use super::series::{Episode, EpisodeSegment, FingerSeries, Series};
use nalgebra::{Isometry3, Vector3};
use teachtree_analysis::{Segment, TaskSpan};
use teachtree_base::meaning::Meaning;

/// Maximum speed (m/s) and minimum duration (s) of a pause of a free hand.
const PAUSE_M_S: f64 = 0.01;
const PAUSE_S: f64 = 0.3;
/// Maximum displacement of an object that was only held, m.
pub(super) const STAYS_M: f64 = 0.01;
/// Maximum displacement of fingertips in a pause, m.
const PAUSE_M: f64 = 0.005;
/// Maximum distance (m) and angle (rad) between the pose at release and the pose at rest of an object that did not fall.
pub(super) const FELL: (f64, f64) = (0.002, 0.035);
/// Maximum distance between two contact positions of a hand that has not left in between, m.
const ON_THE_SPOT_M: f64 = 0.02;
/// Maximum loss of contact within one push, s; and the maximum duration of a brush, a push that moves no object, s.
const COMES_OFF_S: f64 = 0.5;
pub(super) const BRUSH_S: f64 = 0.35;

/// Returns the distance (m) and the angle (rad) between two poses.
pub(super) fn apart(one: &Isometry3<f64>, other: &Isometry3<f64>) -> (f64, f64) {
    let way = one.translation.vector - other.translation.vector;
    (way.norm(), one.rotation.angle_to(&other.rotation))
}

/// Returns the action of the hand in a segment. Primitives without a declared action were refused before.
fn does(segment: &Segment) -> Meaning {
    segment.does.unwrap_or_default()
}

fn is_free(segment: &Segment) -> bool {
    does(segment).is_free()
}

fn lets_go(segment: &Segment) -> bool {
    does(segment) == Meaning::Open
}

/// Returns the commanded attempts of a task, and the omissions. A hand that `waits` for the other one has no pauses.
pub(super) fn episodes(span: &TaskSpan, series: &Series, waits: bool) -> (Vec<Episode>, Vec<Omission>) {
    let mut tries: Vec<Vec<&Segment>> = Vec::new();
    for segment in &span.segments {
        let begins = match tries.last().and_then(|one| one.last()) {
            None => true,
            Some(before) => {
                let touched = !is_free(before);
                is_free(segment) && touched || lets_go(before) && !lets_go(segment)
            }
        };
        match tries.last_mut() {
            Some(one) if !begins => one.push(segment),
            _ => tries.push(vec![segment]),
        }
    }
    let is_meant = |segments: &[&Segment]| !span.failure && lets_fall(segments, series);
    let mut left_out = Vec::new();
    let mut kept: Vec<Vec<&Segment>> = Vec::new();
    // A brush is not joined with the next push.
    tries.dedup_by(|next, one| {
        let joined = !brushes(one, series) && loses_contact(one, next);
        if joined {
            one.append(next);
        }
        joined
    });
    let count = tries.len();
    // An attempt without an approach takes over that of the attempt before.
    let stays_there = |one: &Vec<&Segment>| one.first().is_some_and(|segment| does(segment) != Meaning::Free);
    let on_the_spot: Vec<bool> = tries.iter().skip(1).map(stays_there).chain([false]).collect();
    let mut came: Vec<&Segment> = Vec::new();
    // The object's pose at the first touch of each attempt, and before the omitted brushes.
    let touched: Vec<Option<Vector3<f64>>> = tries.iter().map(|one| first_touch(one, series)).collect();
    let mut before_brushes: Option<Vector3<f64>> = None;
    let grasped: Vec<Option<&str>> = tries.iter().map(|one| first_grasp(one)).collect();
    for (number, mut segments) in tries.into_iter().enumerate() {
        segments.splice(..0, came.drain(..));
        let touches: Vec<Meaning> =
            segments.iter().map(|segment| does(segment)).filter(|it| !it.is_free() && *it != Meaning::Open).collect();
        // While the other hand holds the object too, a grasp has another name.
        let grasps = |meaning: &Meaning| matches!(meaning, Meaning::Close | Meaning::Share);
        let alone = touches.iter().all(|meaning| *meaning == Meaning::Close);
        let next = grasped.get(number + 1).copied().flatten();
        let regrasped = grasped[number].zip(next).is_some_and(|(grasp, regrasp)| grasp != regrasp);
        let only_grasped =
            !regrasped && (alone || touches.iter().all(grasps) && number + 1 < count && stays(&segments, series));
        let dropped = touches.last() == Some(&Meaning::Carry) && number + 1 < count && !is_meant(&segments);
        let stood = before_brushes.take().or(touched[number]);
        // The other hand may move the object.
        let stands = stood
            .zip(touched.get(number + 1).copied().flatten())
            .is_some_and(|(from, to)| (to - from).norm() <= STAYS_M);
        let brushed = on_the_spot[number] && brushes(&segments, series) && (waits || stands);
        if brushed {
            before_brushes = stood;
        }
        if touches.is_empty() && number + 1 == count && !kept.is_empty() {
            // The retreat after the last release.
            kept.push(segments);
        } else if only_grasped || dropped || brushed {
            let why = match (touches.is_empty(), dropped) {
                (true, _) => "aborted approach",
                (_, true) => "dropped",
                _ => "failed try",
            };
            if on_the_spot[number] && !dropped {
                let touch = segments.iter().position(|segment| !is_free(segment));
                came.extend(segments.drain(..touch.unwrap_or_default()));
            }
            left_out.push(leave(&segments, why));
        } else {
            let last_move = segments.iter().take_while(|segment| is_free(segment)).count();
            let from = segments[..last_move].iter().rposition(|segment| does(segment) == Meaning::Free).unwrap_or(0);
            if from > 0 {
                left_out.push(leave(&segments[..from], "aborted approach"));
            }
            kept.push(segments[from..].to_vec());
        }
    }
    let mut episodes = Vec::new();
    for segments in kept {
        let mut pieces: Vec<EpisodeSegment> = Vec::with_capacity(segments.len());
        for (number, segment) in segments.iter().enumerate() {
            let touches_next = segments.get(number + 1).is_some_and(|next| !is_free(next));
            let Some(mut piece) = piece(segment, series, waits, touches_next, &mut left_out) else { continue };
            // Between two parts of one push, the fingers stay at the object.
            let goes_on = segments.get(number + 1).is_some_and(|next| !lets_go(next));
            if let Some(pushing) = pieces.last().filter(|_| piece.does == Meaning::Open && goes_on) {
                (piece.primitive, piece.does) = (pushing.primitive.clone(), pushing.does);
            }
            // Consecutive releases with different names are one motion.
            match pieces.last_mut().filter(|last| last.does == Meaning::Open && piece.does == Meaning::Open) {
                Some(last) => last.samples.append(&mut piece.samples),
                None => pieces.push(piece),
            }
        }
        episodes.push(Episode { pieces, lets_fall: is_meant(&segments) });
    }
    episodes.retain(|episode| !episode.pieces.is_empty());
    (episodes, left_out)
}

fn pushes(segment: &Segment) -> bool {
    does(segment).pushes()
}

/// Returns the name of the grasp at the start of an attempt.
fn first_grasp<'a>(one: &[&'a Segment]) -> Option<&'a str> {
    let touch = one.iter().find(|segment| !is_free(segment))?;
    (does(touch) == Meaning::Close).then_some(touch.primitive.as_str())
}

/// Whether an attempt ends with a fall that the rules label: the primitive of the release differs from the primitive after the fall.
fn lets_fall(one: &[&Segment], series: &Series) -> bool {
    let touching = one.iter().rev().skip_while(|segment| is_free(segment));
    let opens: Vec<&&Segment> = touching.take_while(|segment| lets_go(segment)).collect();
    let (Some(last), Some(first)) = (opens.first(), opens.last()) else { return false };
    let Some(after) = opens.iter().rev().find(|segment| segment.primitive != first.primitive) else { return false };
    let [begins, fallen, ends] =
        [first.start_s, after.start_s, last.end_s].map(|time| &series.object[series.sample(time)]);
    let (way, turn) = apart(begins, fallen);
    (way > FELL.0 || turn > FELL.1) && way > apart(fallen, ends).0
}

/// Returns the position of the object at the first touch of an attempt, m.
fn first_touch(one: &[&Segment], series: &Series) -> Option<Vector3<f64>> {
    let touch = one.iter().find(|segment| !is_free(segment))?;
    Some(series.object[series.sample(touch.start_s)].translation.vector)
}

/// Whether an attempt is a short push that does not move the object.
fn brushes(one: &[&Segment], series: &Series) -> bool {
    let touches: Vec<&Segment> = one.iter().filter(|segment| !is_free(segment) && !lets_go(segment)).copied().collect();
    let lasts: f64 = touches.iter().map(|segment| segment.end_s - segment.start_s).sum();
    let pushes_only = !touches.is_empty() && touches.iter().all(|segment| pushes(segment));
    pushes_only && lasts < BRUSH_S && stays(&touches, series)
}

/// Whether the hand lost contact briefly during a push that the next attempt continues.
fn loses_contact(one: &[&Segment], next: &[&Segment]) -> bool {
    let [.., before, release] = one else { return false };
    let briefly = lets_go(release) && release.end_s - release.start_s < COMES_OFF_S;
    briefly && pushes(before) && next.first().is_some_and(|segment| pushes(segment))
}

/// Whether the object does not move in the touching ones of these segments.
fn stays(segments: &[&Segment], series: &Series) -> bool {
    let touching = segments.iter().filter(|segment| !is_free(segment));
    let mut ends = touching
        .flat_map(|segment| [segment.start_s, segment.end_s])
        .map(|time| series.object[series.sample(time)].translation.vector);
    let Some(first) = ends.next() else { return true };
    ends.all(|place| (place - first).norm() <= STAYS_M)
}

fn leave(segments: &[&Segment], why: &str) -> Omission {
    Omission {
        primitives: segments.iter().map(|segment| segment.primitive.clone()).collect(),
        start_s: segments.first().map_or(0.0, |segment| segment.start_s),
        end_s: segments.last().map_or(0.0, |segment| segment.end_s),
        why: why.into(),
    }
}

fn piece(
    segment: &Segment,
    series: &Series,
    waits: bool,
    touches_next: bool,
    left_out: &mut Vec<Omission>,
) -> Option<EpisodeSegment> {
    let (start, end) = (series.sample(segment.start_s), series.sample(segment.end_s));
    let mut samples: Vec<usize> = (start..=end).collect();
    if is_free(segment) && touches_next {
        samples = without_failed_try(samples, segment, series, left_out);
    }
    if is_free(segment) && !waits {
        samples = without_pauses(samples, segment, series, left_out);
    }
    let touching = !is_free(segment);
    (!samples.is_empty()).then(|| EpisodeSegment {
        primitive: segment.primitive.clone(),
        does: does(segment),
        samples,
        touching,
    })
}

/// Ends a free motion at a brief touch, if the hand later touches at the same place: rules label such a touch as a part of the approach, but it was a failed
/// attempt.
fn without_failed_try(
    mut samples: Vec<usize>,
    segment: &Segment,
    series: &Series,
    left_out: &mut Vec<Omission>,
) -> Vec<usize> {
    let touches = |at: usize| series.fingers.iter().any(|finger| finger.touches[at]);
    // A touch at the beginning is that of the released object.
    let Some(free) = samples.iter().position(|at| !touches(*at)) else { return samples };
    let Some(touch) = samples.iter().skip(free).position(|at| touches(*at)).map(|after| free + after) else {
        return samples;
    };
    let loses_contact = samples.iter().skip(touch).any(|at| !touches(*at));
    let (from, to) = (samples[touch], samples[samples.len() - 1]);
    let way = |finger: &FingerSeries| (finger.tip_in_world[to] - finger.tip_in_world[from]).norm();
    if !loses_contact || series.fingers.iter().any(|finger| way(finger) > ON_THE_SPOT_M) {
        return samples;
    }
    let time = |at: usize| series.start_s + at as f64 / RATE_HZ;
    left_out.push(Omission {
        primitives: vec![segment.primitive.clone()],
        start_s: time(from),
        end_s: time(to),
        why: "failed try".into(),
    });
    samples.truncate(touch + 1);
    samples
}

/// Removes long pauses from the samples of a free motion.
fn without_pauses(samples: Vec<usize>, segment: &Segment, series: &Series, left_out: &mut Vec<Omission>) -> Vec<usize> {
    let slow = |at: usize| {
        series.fingers.iter().all(|finger| {
            let (before, after) = (at.saturating_sub(3), (at + 3).min(series.len() - 1));
            let way = finger.tip_in_world[after] - finger.tip_in_world[before];
            way.norm() * RATE_HZ / (after - before).max(1) as f64 <= PAUSE_M_S
        })
    };
    // A slow motion is not a pause.
    let stays = |first: usize, last: usize| {
        series.fingers.iter().all(|finger| (finger.tip_in_world[last] - finger.tip_in_world[first]).norm() <= PAUSE_M)
    };
    let mut kept = Vec::with_capacity(samples.len());
    let mut still: Vec<usize> = Vec::new();
    let longest = (PAUSE_S * RATE_HZ) as usize;
    let time = |at: usize| series.start_s + at as f64 / RATE_HZ;
    let mut flush = |still: &mut Vec<usize>, kept: &mut Vec<usize>| {
        let ends =
            still.first().zip(still.last()).filter(|(first, last)| still.len() > longest && stays(**first, **last));
        if let Some((first, last)) = ends {
            left_out.push(Omission {
                primitives: vec![segment.primitive.clone()],
                start_s: time(*first),
                end_s: time(*last),
                why: "pause".into(),
            });
            // The ends stay, so that the next segment begins at the same pose.
            kept.extend([*first, *last]);
        } else {
            kept.append(still);
        }
        still.clear();
    };
    for at in samples {
        if slow(at) {
            still.push(at);
        } else {
            flush(&mut still, &mut kept);
            kept.push(at);
        }
    }
    flush(&mut still, &mut kept);
    kept
}
