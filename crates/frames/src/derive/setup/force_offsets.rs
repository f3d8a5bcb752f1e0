//! Offsets of force sensors that change during a recording: the readings in free motion have one level before a time, and another one after.

use super::survey::{HandSamples, Survey};
use nalgebra::Vector3;
use teachtree_base::geometry::Solid;
use teachtree_base::hands::Finger;
use teachtree_base::scene::{Body, Scene};
use teachtree_logs::issue::{Issue, IssueKind};

/// A hand moves freely when its fingertips are this far from every body, m, it touches nothing, and its gripper is open …
const AWAY: f64 = 0.050;
/// … for at least this long, s.
const FREE_SECS: f64 = 0.5;
/// At least as many samples are before and after the change.
const SAMPLES: usize = 12;
/// The least change of a fingertip's sensor, N: twice the force from which a fingertip is in contact by default.
const FINGERTIP: f64 = 2.0 * teachtree_base::contact_threshold::ON_N;
/// The least change of a sensor at the wrist, N: the weight of a tool that is turned by a few degrees.
const WRIST: f64 = 1.0;
/// Nearly all readings are this share of the change from their level, so that the change is six times the standard deviation of the noise.
const STEADY: f64 = 1.0 / 3.0;
const NEARLY_ALL: f64 = 0.95;
/// Readings are compared at rotations of the palm that differ by less than this, rad: the weight of a tool turns with it.
const TURNED: f64 = 0.09;
/// Where no rotation is known, the hand is at one place before and after, m, or the readings change at once, s.
const SAME_PLACE: f64 = 0.1;
const AT_ONCE: f64 = 0.2;

/// The sensors whose offset changes.
pub fn issues(scene: &Scene, survey: &Survey) -> Vec<Issue> {
    let solids: Vec<Solid> = scene.bodies.values().map(Solid::new).collect();
    let has_size = |body: &Body| !body.parts.is_empty() || body.radius.is_some();
    let sized: Vec<usize> =
        scene.bodies.values().enumerate().filter(|(_, body)| has_size(body)).map(|(index, _)| index).collect();
    let mut issues = vec![];
    for hand in survey.hands.iter().filter(|hand| !hand.forces.is_empty()) {
        let free = free(survey, hand, &sized, &solids);
        let sensors = hand.forces.iter().filter_map(|(finger, forces)| changed(survey, hand, *finger, forces, &free));
        issues.extend(sensors);
    }
    issues
}

/// The samples in which a hand moves freely and its palm is turned alike; none where its fingertips are unknown.
fn free(survey: &Survey, hand: &HandSamples, sized: &[usize], solids: &[Solid]) -> Vec<usize> {
    if hand.tips.is_empty() {
        return vec![];
    }
    let is_away = |sample: usize| {
        sized.iter().all(|body| {
            let solid = solids.get(*body);
            let distance = solid.and_then(|solid| survey.distance(std::iter::once(hand), (*body, solid), sample));
            distance.is_some_and(|distance| distance > AWAY)
        })
    };
    let runs = survey.runs(FREE_SECS, |sample| {
        hand.touching.get(sample) == Some(&false) && hand.closed.get(sample) != Some(&true) && is_away(sample)
    });
    let free: Vec<usize> = runs.into_iter().flatten().collect();
    let Some(usual) = free.get(free.len() / 2).and_then(|sample| hand.rotation.get(*sample)) else { return free };
    let alike = |sample: &usize| hand.rotation.get(*sample).is_some_and(|it| it.angle_to(usual) < TURNED);
    free.into_iter().filter(alike).collect()
}

/// A level of readings.
struct Level {
    mean: Vector3<f64>,
    /// Where the hand is in the mean, m.
    place: Vector3<f64>,
}

fn changed(
    survey: &Survey,
    hand: &HandSamples,
    finger: Finger,
    forces: &[Vector3<f64>],
    free: &[usize],
) -> Option<Issue> {
    let readings: Vec<Vector3<f64>> = free.iter().filter_map(|sample| forces.get(*sample).copied()).collect();
    let split = split(&readings)?;
    let (before, after) = (free.get(..split)?, free.get(split..)?);
    let level = |samples: &[usize]| {
        let n = samples.len() as f64;
        let mean = samples.iter().filter_map(|sample| forces.get(*sample)).sum::<Vector3<f64>>() / n;
        let place = samples.iter().filter_map(|sample| hand.place(*sample)).sum::<Vector3<f64>>() / n;
        Level { mean, place }
    };
    let [first, second] = [before, after].map(level);
    let change = (second.mean - first.mean).norm();
    let steady = |samples: &[usize], level: &Level| {
        let near = samples.iter().filter_map(|sample| forces.get(*sample));
        let near = near.filter(|force| (*force - level.mean).norm() < STEADY * change).count();
        near as f64 >= NEARLY_ALL * samples.len() as f64
    };
    let at = |sample: Option<&usize>| survey.time.get(*sample?).copied();
    let (until, from) = (at(before.last())?, at(after.first())?);
    let comparable =
        !hand.rotation.is_empty() || (first.place - second.place).norm() < SAME_PLACE || from - until < AT_ONCE;
    let least = if finger == Finger::Palm { WRIST } else { FINGERTIP };
    if change < least || !steady(before, &first) || !steady(after, &second) || !comparable {
        return None;
    }
    let squares = |samples: &[usize], level: &Level| {
        samples
            .iter()
            .filter_map(|sample| forces.get(*sample))
            .map(|force| (force - level.mean).norm_squared())
            .sum::<f64>()
    };
    let noise = ((squares(before, &first) + squares(after, &second)) / free.len() as f64).sqrt();
    let [x, y, z] = <[f64; 3]>::from(second.mean - first.mean).map(|part| (part * 100.0).round() / 100.0 + 0.0);
    let message = format!(
        "in free motion it reads {:.2} N until {until:.2} s and {:.2} N from {from:.2} s on (noise {noise:.2} N): its offset changes by [{x}, {y}, {z}] N; `tare` \
         subtracts one offset from the whole log, so cut the log there, or correct the column",
        first.mean.norm(),
        second.mean.norm()
    );
    let channel = format!("{}.{finger}.force", hand.side);
    Some(Issue { kind: IssueKind::CHANGED_OFFSET, start_s: until, end_s: from, channel, message })
}

/// Where readings are split into two groups whose means differ most for their number: the index of the first of the second group.
fn split(readings: &[Vector3<f64>]) -> Option<usize> {
    let all: Vector3<f64> = readings.iter().sum();
    let n = readings.len() as f64;
    let mut before = Vector3::zeros();
    let mut best = None;
    for (index, reading) in readings.iter().enumerate() {
        if index >= SAMPLES && index + SAMPLES <= readings.len() {
            let (one, other) = (index as f64, n - index as f64);
            let between = (before / one - (all - before) / other).norm_squared() * one * other / n;
            if best.is_none_or(|(most, _)| between > most) {
                best = Some((between, index));
            }
        }
        before += reading;
    }
    best.map(|(_, index)| index)
}
