//! Objects at rest, and the gaps of their shapes there.

use super::median;
use super::survey::Survey;
use crate::derive::convex_gap::{Gap, gaps};
use nalgebra::Isometry3;
use std::ops::Range;
use teachtree_base::scene::{Body, Role, Scene};

/// An object rests when it does not move for this long, s, and no hand touches it.
const RESTS_SECS: f64 = 0.5;
/// Maximum number of examined rests of an object, and of samples of each: a mistake of the setup is in all of them.
const LOOKED_AT: usize = 12;
const SAMPLES: usize = 3;
/// Maximum overlap or gap of shapes at rest, m, that contacts from shapes allow for. A larger one means that the scene is wrong.
pub const SCENE_ERROR: f64 = 5e-3;

/// The objects of a scene that have a shape and whose position the log has.
pub fn objects<'s>(scene: &'s Scene, survey: &'s Survey) -> impl Iterator<Item = usize> + 's {
    let is_shaped = |(_, (body, samples)): &(usize, (&Body, &super::survey::BodySamples))| {
        body.role == Role::Object && !body.parts.is_empty() && samples.is_logged
    };
    scene.bodies.values().zip(&survey.bodies).enumerate().filter(is_shaped).map(|(index, _)| index)
}

/// When an object rests outside of sockets and a condition holds, a few of these times spread evenly over the log.
pub fn rests(survey: &Survey, object: usize, holds: impl Fn(usize) -> bool) -> Vec<Range<usize>> {
    let Some(body) = survey.bodies.get(object) else { return vec![] };
    let is_set = |flags: &[bool], sample: usize| flags.get(sample) == Some(&true);
    let runs = survey.runs(RESTS_SECS, |sample| {
        is_set(&body.is_still, sample)
            && !is_set(&body.is_inserted, sample)
            && !survey.is_touched(object, sample)
            && holds(sample)
    });
    let every = runs.len().div_ceil(LOOKED_AT).max(1);
    runs.into_iter().step_by(every).collect()
}

/// The examined samples of a rest.
pub fn samples(rest: &Range<usize>) -> impl Iterator<Item = usize> + use<> {
    let (start, length) = (rest.start, rest.len());
    (1..=SAMPLES).map(move |part| start + length * part / (SAMPLES + 1))
}

/// The gap between an object and another body during a rest: that of the median width.
pub fn gap(scene: &Scene, survey: &Survey, object: usize, other: usize, rest: &Range<usize>) -> Option<Gap> {
    let found: Vec<Gap> =
        samples(rest).filter_map(|sample| gap_of(scene, survey, object, other, (sample, 0.0))).collect();
    let middle = median(found.iter().map(|gap| gap.width).collect())?;
    found.into_iter().find(|gap| gap.width.total_cmp(&middle).is_eq())
}

/// The least gap between an object and another body at a sample, if the object was lower by some height, m.
pub fn gap_of(
    scene: &Scene,
    survey: &Survey,
    object: usize,
    other: usize,
    (sample, lower): (usize, f64),
) -> Option<Gap> {
    let body = |index: usize| scene.bodies.get_index(index).map(|(_, body)| body);
    let mut at: Isometry3<f64> = *survey.pose(object, sample)?;
    at.translation.vector -= scene.up() * lower;
    let all = gaps((body(object)?, &at), (body(other)?, survey.pose(other, sample)?), 0.0);
    all.into_iter().min_by(|one, other| one.width.total_cmp(&other.width))
}
