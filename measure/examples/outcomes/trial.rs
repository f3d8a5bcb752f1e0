//! A trial: one seed of a failing operator, recorded with its failure and without, and the failures that the rules find in both with each sensor set.

use crate::sensors::SensorSet;
use std::ops::Range;
use std::path::PathBuf;
use teachtree::{Analysis, Observability, TrackId};
use teachtree_base::hands::Side;
use teachtree_base::recording::Recording;
use teachtree_world::{self as world, Failure, FailurePlan, Operator};

/// A failure is found if one of its kind is labeled within this time of it, s.
const NEAR_S: f64 = 0.5;

/// The jaws of a gripper are shut below this opening, m.
const SHUT_M: f64 = 0.002;
/// They have lost their object if they shut within this time after it, s.
const SHUTS_S: f64 = 1.0;

/// The primitives of failures.
pub const PRIMITIVES: [&str; 7] = ["Jam", "Slip", "Drop", "Topple", "Miss", "Collision", "Bump"];

/// One seed of an operator.
pub struct Trial {
    pub operator: &'static str,
    seed: u64,
    /// The primitive of its failure.
    pub primitive: &'static str,
    /// Whether the scene has two hands.
    pub two_hands: bool,
    /// Whether the attempt with the failure succeeds, for example an insertion after a jam.
    pub mended: bool,
    /// Whether the ground truth contains the failure.
    pub occurred: bool,
    /// Whether the ground truth of the recording without the failure contains no failures.
    pub succeeds: bool,
    /// Results by sensor set.
    pub results: Vec<SensorResult>,
}

/// The failures that the rules find with one sensor set.
pub struct SensorResult {
    /// Why the rules cannot detect the failure in such a log; `None` if they can.
    pub undetectable: Option<String>,
    /// Whether the failure is found, if it occurred.
    pub found: Option<bool>,
    /// The failures that are found in the recording without the failure, if that succeeds.
    pub false_ones: Option<Vec<FoundFailure>>,
}

/// A failure in an analysis.
pub struct FoundFailure {
    pub track: TrackId,
    pub primitive: &'static str,
    /// Its time, s.
    pub time: Range<f64>,
}

/// A recording of an operator, and the intervals of a failure in its ground truth, s, by hand.
struct LabeledRecording {
    recording: Recording,
    truth: Vec<(Side, Range<f64>)>,
}

impl Trial {
    /// Records the operator with and without its failure, and analyzes both recordings with all sensor sets.
    ///
    /// # Errors
    /// An operator that cannot be performed, and a log that the rules reject.
    pub fn run(
        operator: &'static str,
        scene: &str,
        seed: u64,
        sets: &[&SensorSet],
        rules: &[PathBuf],
    ) -> Result<Self, String> {
        let message = |error: teachtree_base::error::InputError| error.to_string();
        let scene = world::scene(scene).map_err(message)?;
        let failing = world::operator(operator).map_err(message)?;
        let plan = failing.failures.as_ref().ok_or("does not fail")?;
        let kind = plan.kinds.first().copied().ok_or("does not fail")?;
        let sound = Operator { failures: Some(FailurePlan { share: 0.0, ..plan.clone() }), ..failing.clone() };
        let recording = world::teach(&scene, &failing, seed).map_err(message)?;
        let primitive = primitive(kind, &recording);
        let failed = LabeledRecording { truth: injected(&recording, primitive), recording };
        let recording = world::teach(&scene, &sound, seed).map_err(message)?;
        let succeeds = PRIMITIVES.iter().all(|primitive| intervals(&recording, primitive).is_empty());
        let sound = Some(recording).filter(|_| succeeds);
        let occurred = !failed.truth.is_empty();
        let results = sets.iter().map(|set| {
            let false_ones = sound.as_ref().map(|sound| failures_by(set, sound, &failing, rules));
            Ok(SensorResult { false_ones: false_ones.transpose()?, ..failed.result(set, &failing, primitive, rules)? })
        });
        Ok(Self {
            operator,
            seed,
            primitive,
            two_hands: scene.hands.len() > 1,
            mended: primitive == "Jam" && occurred && !has_task(&failed.recording, "failed_insertion"),
            occurred,
            succeeds,
            results: results.collect::<Result<_, String>>()?,
        })
    }

    /// A line for each failure that is not found, and for each false one.
    pub fn errors(&self, sets: &[&SensorSet]) -> Vec<String> {
        let Self { operator, seed, primitive, .. } = self;
        let mut lines = Vec::new();
        if !self.occurred {
            lines.push(format!("{operator} {seed}: no {primitive} in the ground truth"));
        }
        for (result, set) in self.results.iter().zip(sets) {
            let set = set.name;
            if result.found == Some(false) && result.undetectable.is_none() {
                lines.push(format!("{operator} {seed}, {set}: {primitive} not found"));
            }
            for FoundFailure { primitive, time, .. } in result.false_ones.iter().flatten() {
                lines.push(format!("{operator} {seed}, {set}: false {primitive} at {:.2} s", time.start));
            }
        }
        lines
    }
}

impl LabeledRecording {
    fn result(
        &self,
        set: &SensorSet,
        operator: &Operator,
        primitive: &str,
        rules: &[PathBuf],
    ) -> Result<SensorResult, String> {
        let log = set.log(&self.recording, operator)?;
        let rules = set.rules(&log, rules)?;
        let analysis = rules.analyze(&log).map_err(|error| error.to_string())?;
        let observability = rules.observability(&log).map_err(|error| error.to_string())?;
        let hand = self.truth.first().map_or(Side::Right, |(side, _)| *side);
        let undetectable = match set.object_poses || self.shows_without_poses(primitive) {
            true => undetectable(&observability, hand, primitive),
            false => Some("the jaws do not shut, and the poses of objects are unknown".into()),
        };
        let is_found = |(side, time): &(Side, Range<f64>)| {
            failures(&analysis).any(|found| {
                (found.track == TrackId::Hand(*side) || found.track == TrackId::Both)
                    && found.primitive == primitive
                    && found.time.start < time.end + NEAR_S
                    && time.start - NEAR_S < found.time.end
            })
        };
        let found = (!self.truth.is_empty()).then(|| self.truth.iter().any(is_found));
        Ok(SensorResult { undetectable, found, false_ones: None })
    }

    /// Whether a gripper shows the failure although the poses of objects are unknown: its jaws shut where it misses an object, and soon after it has
    /// dropped one.
    fn shows_without_poses(&self, primitive: &str) -> bool {
        let is_shut = |(side, time): &(Side, Range<f64>)| {
            let opening = self.recording.columns.get(&format!("{side}.gripper.opening"));
            let mut rows = self.recording.time.iter().zip(opening.into_iter().flat_map(|opening| &opening.values));
            rows.any(|(at, opening)| *at >= time.start && *at < time.end + SHUTS_S && *opening < SHUT_M)
        };
        !["Drop", "Miss"].contains(&primitive) || self.truth.is_empty() || self.truth.iter().any(is_shut)
    }
}

/// Why the rules cannot detect a primitive of a hand; `None` if they can.
fn undetectable(observability: &Observability, hand: Side, primitive: &str) -> Option<String> {
    let Some(track) = observability.tracks.iter().find(|track| track.track == TrackId::Hand(hand)) else {
        return Some(format!("the log lacks the {hand} hand"));
    };
    if track.detectable.iter().any(|name| name == primitive) {
        return None;
    }
    let mut reasons = track.undetectable.iter();
    let reason = reasons.find(|reason| reason.primitives.iter().any(|name| name == primitive));
    Some(reason.map_or_else(|| "the rules lack this primitive".into(), |found| found.reason.clone()))
}

/// The failures that the rules find in a recording with a sensor set.
fn failures_by(
    set: &SensorSet,
    recording: &Recording,
    operator: &Operator,
    rules: &[PathBuf],
) -> Result<Vec<FoundFailure>, String> {
    let log = set.log(recording, operator)?;
    let analysis = set.rules(&log, rules)?.analyze(&log).map_err(|error| error.to_string())?;
    Ok(failures(&analysis).collect())
}

/// The failures of an analysis.
fn failures(analysis: &Analysis) -> impl Iterator<Item = FoundFailure> {
    analysis.segments().into_iter().filter_map(|segment| {
        let primitive = PRIMITIVES.iter().find(|name| **name == segment.primitive())?;
        Some(FoundFailure { track: segment.track(), primitive, time: segment.start_s()..segment.end_s() })
    })
}

/// The intervals of a primitive in the ground truth after the failure began, s, by hand: an operator may also slip by accident before it fails on purpose.
fn injected(recording: &Recording, primitive: &str) -> Vec<(Side, Range<f64>)> {
    let began = recording.events.iter().find(|event| event.kind == "failure_started");
    let mut found = intervals(recording, primitive);
    found.retain(|(_, time)| began.is_none_or(|event| time.end > event.time_s));
    found
}

/// The intervals of a primitive in the ground truth, s, by hand.
fn intervals(recording: &Recording, primitive: &str) -> Vec<(Side, Range<f64>)> {
    let mut found = Vec::new();
    for side in recording.scene.hands.keys() {
        let Some(labels) = recording.labels.get(&format!("{side}.label")) else { continue };
        let mut start = 0;
        for run in labels.chunk_by(|one, next| one == next) {
            let end = start + run.len();
            if run.first().is_some_and(|label| label == primitive) {
                let at = |row: usize| recording.time.get(row.min(labels.len() - 1)).copied().unwrap_or_default();
                found.push((*side, at(start)..at(end)));
            }
            start = end;
        }
    }
    found
}

/// Whether the ground truth contains a task.
fn has_task(recording: &Recording, task: &str) -> bool {
    let tasks = recording.labels.iter().filter(|(name, _)| name.ends_with(".task"));
    tasks.flat_map(|(_, tasks)| tasks).any(|found| found == task)
}

/// The primitive of a failure; an empty hand collides by another one.
fn primitive(failure: Failure, recording: &Recording) -> &'static str {
    match failure {
        Failure::Jam => "Jam",
        // An object that is not caught is dropped.
        Failure::Slip if injected(recording, "Slip").is_empty() && !injected(recording, "Drop").is_empty() => "Drop",
        Failure::Slip => "Slip",
        Failure::Drop => "Drop",
        Failure::Miss => "Miss",
        Failure::Collision if !injected(recording, "Bump").is_empty() => "Bump",
        Failure::Collision => "Collision",
    }
}
