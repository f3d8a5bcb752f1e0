//! Positions in another unit than they are read in, such as millimeters that are read as meters.
//!
//! A hand or an object that is too fast and too far for any arm is in a smaller unit. Where a hand carries an object, one of them may move a thousand times
//! as far as the other one, in the same direction. A gripper whose usual openings are all tiny, or huge, is in another unit, and so is a hand that hardly moves
//! while its fingers are nowhere apart, or while it grasps and releases an object without leaving it.

use super::co_motion::{CoMotion, MOVES, TOGETHER, steps};
use super::median;
use super::survey::{HandSamples, Survey};
use crate::otsu;
use nalgebra::Vector3;
use std::ops::Range;
use teachtree_base::scene::{Role, Scene};
use teachtree_logs::issue::{Issue, IssueKind};

/// A hand or an object is in another unit if a twentieth of its motion is faster than this, m/s: twice as fast as people throw, and ten times as fast as
/// arms move.
const TOO_FAST: f64 = 20.0;
/// And it travels farther than this, m: beyond the reach of arms; a log with a jump from one recording to the next one does not.
const TOO_FAR: f64 = 20.0;
/// What is slower than this does not count as motion, m/s.
const MOVING: f64 = 1.0;
/// Minimum number of samples that are faster than `TOO_FAST`.
const FAST_SAMPLES: usize = 5;
/// In at least as many steps hand and object move together in different units, and in this share of those in which the object is fast.
const STEPS: usize = 3;
const SHARE: f64 = 0.6;
/// An object is fast in steps that are at least this share of its longest step.
const FAST: f64 = 0.1;
/// A gripper whose usual openings are smaller than the first length, or exceed the second one, is in another unit, m.
const OPENINGS: Range<f64> = 1e-3..1.0;
/// Fingers are farther apart at some time, and a hand that opens is farther from the middle of the object, m.
const APART: f64 = 2e-3;
/// A hand that moves by a length in this range, m, moves by 20 mm to 5 m if a unit that is a thousand times as large was meant.
const TINY: Range<f64> = 20e-6..5e-3;
/// The units that are confused, in m.
const UNITS: [(&str, f64); 2] = [("mm", 1e-3), ("cm", 1e-2)];

/// What moves, with its channel.
struct Track<'a> {
    channel: String,
    places: Box<dyn Fn(usize) -> Option<Vector3<f64>> + 'a>,
}

/// The positions whose unit is another one.
pub fn issues(scene: &Scene, survey: &Survey) -> Vec<Issue> {
    let tracks = tracks(scene, survey);
    let fast: Vec<Issue> = tracks.iter().filter_map(|track| too_fast(survey, track)).collect();
    if !fast.is_empty() {
        return fast;
    }
    let mut issues: Vec<Issue> = survey.hands.iter().filter_map(|hand| opening(survey, hand)).collect();
    let objects = objects(scene, survey);
    issues.extend(survey.hands.iter().filter_map(|hand| too_small(scene, survey, hand, &objects)));
    let pairs = survey.hands.iter().flat_map(|hand| objects.iter().map(move |object| (hand, *object)));
    for issue in pairs.filter_map(|(hand, object)| {
        other_scale(scene, survey, hand, object).or_else(|| out_of_reach(scene, survey, hand, object))
    }) {
        if !issues.iter().any(|other| other.channel == issue.channel) {
            issues.push(issue);
        }
    }
    issues
}

/// The objects whose position the log has.
fn objects(scene: &Scene, survey: &Survey) -> Vec<usize> {
    let bodies = scene.bodies.values().zip(&survey.bodies).enumerate();
    bodies
        .filter(|(_, (body, samples))| body.role == Role::Object && samples.is_logged)
        .map(|(index, _)| index)
        .collect()
}

/// Everything whose position the log has.
fn tracks<'a>(scene: &Scene, survey: &'a Survey) -> Vec<Track<'a>> {
    let hands = survey.hands.iter().flat_map(|hand| {
        let tips = hand.tips.iter().map(|(finger, places)| (finger.name(), places));
        let palm = (!hand.palm.is_empty()).then_some(("palm", &hand.palm));
        tips.chain(palm).map(move |(name, places)| Track {
            channel: format!("{}.{name}.position", hand.side),
            places: Box::new(move |sample| places.get(sample).copied()),
        })
    });
    let bodies = scene.bodies.keys().zip(&survey.bodies).filter(|(_, body)| body.is_logged);
    let bodies = bodies.map(|(name, body)| Track {
        channel: format!("{name}.position"),
        places: Box::new(move |sample| body.poses.get(sample).map(|pose| pose.translation.vector)),
    });
    hands.chain(bodies).collect()
}

/// How far something travels between the 5th and the 95th percentile of its positions, m.
fn extent(survey: &Survey, places: impl Fn(usize) -> Option<Vector3<f64>>) -> f64 {
    let places: Vec<Vector3<f64>> = (0..survey.time.len()).filter_map(places).collect();
    let range = |axis: usize| {
        let mut values: Vec<f64> = places.iter().map(|place| place[axis]).collect();
        values.sort_by(f64::total_cmp);
        let at = |share: usize| values.get(values.len() * share / 100).copied().unwrap_or_default();
        at(95) - at(5)
    };
    if places.is_empty() { 0.0 } else { Vector3::from_fn(|axis, _| range(axis)).norm() }
}

/// The units in which the travel of a hand reads like this many meters, and one of them.
fn units_of(extent: f64) -> (&'static str, &'static str) {
    match extent {
        ..100.0 => ("mm or cm", "mm"),
        ..5000.0 => ("mm", "mm"),
        _ => ("um", "um"),
    }
}

fn over_all(survey: &Survey, channel: String, message: String) -> Issue {
    let [start_s, end_s] = survey.span;
    Issue { kind: IssueKind::IMPLAUSIBLE_UNIT, start_s, end_s, channel, message }
}

fn too_fast(survey: &Survey, track: &Track) -> Option<Issue> {
    let speed = |sample: usize| {
        let seconds = survey.time.get(sample + 1)? - survey.time.get(sample)?;
        Some(((track.places)(sample + 1)? - (track.places)(sample)?).norm() / seconds)
    };
    let speeds = (0..survey.time.len()).filter(|sample| survey.is_whole(&(*sample..sample + 2))).filter_map(speed);
    let mut speeds: Vec<f64> = speeds.filter(|speed| *speed > MOVING).collect();
    speeds.sort_by(f64::total_cmp);
    let fast = *speeds.get(speeds.len() * 95 / 100)?;
    let many = speeds.iter().filter(|speed| **speed > TOO_FAST).count() >= FAST_SAMPLES;
    let extent = extent(survey, &track.places);
    let (units, unit) = units_of(extent);
    (fast > TOO_FAST && many && extent > TOO_FAR).then(|| {
        let message = format!(
            "it moves by {extent:.0} m, at up to {fast:.0} m/s: it is probably in {units} and read in a larger unit; write the unit after its columns, such as \
             ` [{unit}]`"
        );
        over_all(survey, track.channel.clone(), message)
    })
}

/// A gripper whose usual openings, open and closed, are impossible for a gripper.
fn opening(survey: &Survey, hand: &HandSamples) -> Option<Issue> {
    let openings = hand.opening.iter().copied().filter(|opening| opening.is_finite()).collect();
    let [closed, open] = otsu::clear_means(openings)?;
    let (unit, read) = match open {
        _ if OPENINGS.contains(&open) => return None,
        ..1.0 => ("m", "mm or cm"),
        _ => ("mm", "a larger unit"),
    };
    let message = format!(
        "its usual openings are {} mm and {} mm: it is probably in {unit} and read in {read}; write the unit after its column, ` [{unit}]`",
        in_mm(closed),
        in_mm(open)
    );
    Some(over_all(survey, format!("{}.gripper.opening", hand.side), message))
}

/// A hand that moves by less than fingers are thick, although its fingers or its gripper show that it handles something.
fn too_small(scene: &Scene, survey: &Survey, hand: &HandSamples, objects: &[usize]) -> Option<Issue> {
    let moves_by = extent(survey, |sample| hand.place(sample));
    if !TINY.contains(&moves_by) {
        return None;
    }
    let (_, thumb) = hand.tips.first()?;
    let apart =
        hand.tips.iter().skip(1).flat_map(|(_, tips)| thumb.iter().zip(tips).map(|(one, other)| (one - other).norm()));
    let widest = apart.fold(0.0, f64::max);
    let opens_and_closes = hand.closed.contains(&true) && hand.closed.contains(&false);
    let found = if (TINY.start..APART).contains(&widest) {
        format!("its fingertips are at most {} mm apart", in_mm(widest))
    } else {
        let objects = objects.iter().filter(|object| {
            let body = scene.bodies.get_index(**object).map(|(_, body)| body);
            opens_and_closes && hand.tips.len() == 1 && body.is_some_and(|body| body.fixed_to.is_none())
        });
        objects.into_iter().find_map(|object| {
            let place = |sample: usize| survey.pose(*object, sample).map(|pose| pose.translation.vector);
            let distance = |sample: usize| Some((hand.place(sample)? - place(sample)?).norm());
            let farthest = (0..survey.time.len()).filter_map(distance).fold(0.0, f64::max);
            let is_tiny = farthest < APART && TINY.contains(&extent(survey, place));
            let name = name_of(scene, *object);
            is_tiny.then(|| {
                format!(
                    "its gripper opens and closes, and it is never farther than {} mm from the middle of `{name}`",
                    in_mm(farthest)
                )
            })
        })?
    };
    let message = format!(
        "{found}, and it moves by {} mm: it is probably in m and read in mm or cm; write the unit after its columns, ` [m]`",
        in_mm(moves_by)
    );
    Some(over_all(survey, channel_of(hand), message))
}

/// A length in mm, with as many digits as it takes to see small ones.
fn in_mm(length: f64) -> String {
    let decimals = if length.abs() < 1e-3 { 3 } else { 0 };
    format!("{:.decimals$}", length * 1e3)
}

/// The channel of the positions of a hand in messages.
fn channel_of(hand: &HandSamples) -> String {
    let finger = hand.tips.first().map_or("palm", |(finger, _)| finger.name());
    format!("{}.{finger}.position", hand.side)
}

fn name_of(scene: &Scene, body: usize) -> &str {
    scene.bodies.get_index(body).map_or("", |(name, _)| name.as_str())
}

/// A hand and an object that move together, one of them a thousand times as far as the other one.
fn other_scale(scene: &Scene, survey: &Survey, hand: &HandSamples, object: usize) -> Option<Issue> {
    let steps = steps(survey, hand, object);
    let longest = steps.iter().map(|step| step.object.norm()).fold(0.0, f64::max);
    let moves =
        |step: &&CoMotion| step.object.norm() > FAST * longest && step.hand.norm().max(step.object.norm()) > MOVES;
    let moved: Vec<&CoMotion> = steps.iter().filter(moves).collect();
    let together = |scale: f64| moved.iter().filter(|step| step.mismatch(|hand| hand * scale) < TOGETHER).count();
    if together(1.0) > 0 {
        return None;
    }
    let scales = UNITS.into_iter().flat_map(|(unit, size)| [(unit, size), (unit, 1.0 / size)]);
    let (unit, scale, count) =
        scales.map(|(unit, scale)| (unit, scale, together(scale))).max_by_key(|(.., count)| *count)?;
    if count < STEPS || (count as f64) < SHARE * moved.len() as f64 {
        return None;
    }
    let of_hand = extent(survey, |sample| hand.place(sample));
    let of_object = extent(survey, |sample| survey.pose(object, sample).map(|pose| pose.translation.vector));
    let (hand_channel, object_channel) = (channel_of(hand), format!("{}.position", name_of(scene, object)));
    // The larger one is in a small unit and read as m, or the smaller one is in m and read in a small unit.
    let (larger, smaller, large) =
        if scale < 1.0 { (hand_channel, object_channel, of_hand) } else { (object_channel, hand_channel, of_object) };
    let times = if scale < 1.0 { 1.0 / scale } else { scale };
    let lengths = format!("{:.4} m and {:.4} m", of_hand.max(of_object), of_hand.min(of_object));
    let (channel, message) = if large > TOO_FAR / 4.0 {
        let message = format!(
            "it moves {times} times as far as `{smaller}`, with which it moves ({lengths}): it is probably in {unit} and read as m; write the unit \
             after its columns, ` [{unit}]`"
        );
        (larger, message)
    } else {
        let message = format!(
            "`{larger}` moves {times} times as far, and together with it ({lengths}): this position is probably in m and read in {unit}; write the \
             unit after its columns, ` [m]`"
        );
        (smaller, message)
    };
    Some(over_all(survey, channel, message))
}

/// An object that no arm can reach from where the hand is, and that it could reach if one of them was in millimeters.
fn out_of_reach(scene: &Scene, survey: &Survey, hand: &HandSamples, object: usize) -> Option<Issue> {
    let pairs = || {
        (0..survey.time.len())
            .filter_map(|sample| Some((hand.place(sample)?, survey.pose(object, sample)?.translation.vector)))
    };
    let nearest = |of_hand: f64, of_object: f64| {
        pairs().map(|(hand, object)| (hand * of_hand - object * of_object).norm()).fold(f64::INFINITY, f64::min)
    };
    let distance = nearest(1.0, 1.0);
    let [(unit, size), _] = UNITS;
    let norm = |values: Vec<f64>| median(values).unwrap_or_default();
    let hand_is_farther =
        norm(pairs().map(|(hand, _)| hand.norm()).collect()) > norm(pairs().map(|(_, object)| object.norm()).collect());
    let scaled = if hand_is_farther { nearest(size, 1.0) } else { nearest(1.0, size) };
    (distance.is_finite() && distance > TOO_FAR && scaled < TOO_FAR / 10.0).then(|| {
        let (channel, other) = (channel_of(hand), format!("{}.position", name_of(scene, object)));
        let (channel, other) = if hand_is_farther { (channel, other) } else { (other, channel) };
        let message = format!(
            "it is never nearer than {distance:.0} m to `{other}`: it is probably in {unit} and read in a larger unit; write the unit after its \
             columns, such as ` [{unit}]`"
        );
        over_all(survey, channel, message)
    })
}
