//! How a hand and an object move during short times, which shows whether the hand carries the object.

use super::survey::{HandSamples, Survey};
use nalgebra::Vector3;
use std::ops::Range;

/// How long each of the times is, s: a hand that carries something moves by several times its tremor.
const STEP_SECS: f64 = 0.4;
/// An object that moves by less than this in that time is not judged, m: more than noise of a tracker and tremor.
pub const MOVES: f64 = 0.020;
/// Hand and object move together when their ways differ by less than this share of the longer one: the object turns, and gives way in the hand.
pub const TOGETHER: f64 = 0.3;

/// How a hand and an object have moved from the first to the last of some samples.
pub struct CoMotion {
    pub samples: Range<usize>,
    /// The way of the hand, m.
    pub hand: Vector3<f64>,
    /// The way of the object, m.
    pub object: Vector3<f64>,
}

impl CoMotion {
    /// How much the ways differ, as a share of the longer one; the way of the hand may be changed before.
    pub fn mismatch(&self, change: impl Fn(&Vector3<f64>) -> Vector3<f64>) -> f64 {
        mismatch(&change(&self.hand), &self.object)
    }
}

/// How much two ways differ, as a share of the longer one.
pub fn mismatch(hand: &Vector3<f64>, object: &Vector3<f64>) -> f64 {
    let longer = hand.norm().max(object.norm());
    if longer > 0.0 { (hand - object).norm() / longer } else { 0.0 }
}

/// How many samples a step lasts.
pub fn samples(survey: &Survey) -> usize {
    ((STEP_SECS / survey.step_s).round() as usize).max(1)
}

/// How long a number of steps lasts, s.
pub fn seconds(survey: &Survey, steps: usize) -> f64 {
    steps as f64 * samples(survey) as f64 * survey.step_s
}

/// All steps of a hand and an object, one after the other; none where the log lacks one of their positions.
pub fn steps(survey: &Survey, hand: &HandSamples, body: usize) -> Vec<CoMotion> {
    let length = samples(survey);
    let is_logged = survey.bodies.get(body).is_some_and(|body| body.is_logged);
    let step = |from: usize| {
        let samples = from..from + length + 1;
        let place = |sample: usize| survey.pose(body, sample).map(|pose| pose.translation.vector);
        survey.is_whole(&samples).then_some(())?;
        Some(CoMotion {
            hand: hand.place(from + length)? - hand.place(from)?,
            object: place(from + length)? - place(from)?,
            samples,
        })
    };
    (0..survey.time.len()).step_by(length).filter(|_| is_logged).filter_map(step).collect()
}
