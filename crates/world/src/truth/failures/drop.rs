//! Drop: an object leaves the hand in the air. The fall begins when the fingers bear little of the weight, and ends when the object meets a body.

use super::{FailureInputs, spans};
use std::ops::Range;
use teachtree_base::scene::Role;

/// An object falls when the fingers bear less than this share of its weight.
const BORNE: f64 = 0.3;
/// Minimum duration of a fall, ms, and its minimum depth, m: an object that is released just above its place is put down.
const SHORTEST: usize = 25;
const DEEP_M: f64 = 0.003;
/// Fingers that touch a falling object for less than this time, ms, do not catch it.
const BRUSH: usize = 60;

/// The falls of objects that leave this hand.
pub(super) fn drops(inputs: &FailureInputs<'_>) -> Vec<Range<usize>> {
    let objects = inputs.scene.bodies.values().enumerate().filter(|(_, body)| body.role == Role::Object);
    let weights =
        objects.map(|(object, body)| (object, body.mass.map_or(0.0, |mass| mass.0) * inputs.scene.gravity().norm()));
    let mut drops: Vec<Range<usize>> = weights.flat_map(|(object, weight)| of_object(inputs, object, weight)).collect();
    drops.sort_by_key(|span| span.start);
    drops
}

fn of_object(inputs: &FailureInputs<'_>, object: usize, weight: f64) -> Vec<Range<usize>> {
    let FailureInputs { hand, moments, scene, .. } = *inputs;
    let falls: Vec<bool> = moments
        .iter()
        .map(|moment| {
            let tips = moment.hands.iter().flatten().filter_map(|tip| tip.force_on(object));
            !moment.is_in_contact(object) && tips.map(|force| force.dot(&scene.up())).sum::<f64>() < BORNE * weight
        })
        .collect();
    let untouched: Vec<bool> =
        moments.iter().map(|moment| !(0..moment.hands.len()).any(|hand| moment.is_touched(hand, object))).collect();
    let was_held = |start: usize| start.checked_sub(1).is_some_and(|at| moments[at].is_touched(hand, object));
    let meets = |at: usize| moments.get(at).is_some_and(|moment| moment.is_in_contact(object));
    let mut drops: Vec<Range<usize>> = Vec::new();
    for span in spans(&falls).filter(|span| was_held(span.start)) {
        match drops.last_mut() {
            Some(last) if span.start - last.end < BRUSH && !(last.end..span.start).any(meets) => last.end = span.end,
            _ => drops.push(span),
        }
    }
    let height = |at: usize| moments[at].bodies[object].pose.translation.vector.dot(&scene.up());
    // An object that is caught has slipped.
    let lost =
        |span: &Range<usize>| meets(span.end) || spans(&untouched[span.clone()]).any(|free| free.len() >= SHORTEST);
    drops.retain(|span| span.len() >= SHORTEST && height(span.start) - height(span.end - 1) >= DEEP_M && lost(span));
    drops
}
