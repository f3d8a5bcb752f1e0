//! Miss: thumb and fingers close without an object between them, or the closed hand leaves an object that stays in place.

use super::super::facts::Facts;
use super::super::series::debounce;
use super::super::world_state::{Tip, WorldState};
use super::{FailureInputs, spans};
use crate::shapes::corners;
use std::ops::Range;
use teachtree_base::hands::Finger;
use teachtree_base::scene::Body;

/// Pads that are closer than the width of the object minus this distance, m, have nothing of it between them.
const NARROWER_M: f64 = 0.003;
/// The hand closes at rest: its palm is slower than this speed, m/s, between `RESTING` ms before and after. Fingers that close on the way do not grasp.
const AT_REST: f64 = 0.040;
const RESTING: usize = 62;
/// Displacements of the hand against the object, m: it has left at `LEFT_M`, and begins to leave at `BEGINS_M`. An object that moves by more than
/// `STAYS_M` is taken along.
const LEFT_M: f64 = 0.015;
const BEGINS_M: f64 = 0.002;
const STAYS_M: f64 = 0.010;
/// Fingers that open by more than this distance, m, release.
const OPENS_M: f64 = 0.005;
/// The hand leaves within this time before and after the last touch, ms.
const AROUND: usize = 500;
/// Interruptions of a contact that are shorter than a period of tremor, ms, are bridged.
const BRIDGE: usize = 130;
/// Minimum duration of a miss, ms.
const SHORTEST: usize = 40;

/// The misses of this hand.
pub(super) fn misses(inputs: &FailureInputs<'_>) -> Vec<Range<usize>> {
    let radius = inputs.scene.hands.values().nth(inputs.hand).map_or(0.0, |hand| hand.tip_radius.0);
    let opening = |moment: &WorldState| moment.opening(inputs.hand, radius).unwrap_or(f64::INFINITY);
    let openings: Vec<f64> = inputs.moments.iter().map(opening).collect();
    let mut misses = closed_on_nothing(inputs, &openings);
    misses.extend(stays_behind(inputs, &openings));
    misses.sort_by_key(|span| span.start);
    misses
}

/// Intervals in which the fingers are closed and touch nothing, after they closed near an object, until they open.
fn closed_on_nothing(inputs: &FailureInputs<'_>, openings: &[f64]) -> Vec<Range<usize>> {
    let widths: Vec<f64> = inputs.scene.bodies.values().map(width).collect();
    let width = |at: usize| widths.get(inputs.facts[at].target).copied().unwrap_or_default();
    let is_empty = |at: usize| inputs.facts[at].fingers == 0 && openings[at] < width(at) - NARROWER_M;
    let empty: Vec<bool> = (0..openings.len()).map(is_empty).collect();
    // Fingers that close after they have lost an object do not miss it: before a miss they were open since the last touch.
    let was_open = |at: usize| {
        let touch = inputs.facts[..at].iter().rposition(|facts| facts.fingers > 0);
        let (since, closed) = touch.map_or((0, width(at)), |last| (last, openings[last]));
        openings[since..at].iter().any(|opening| *opening > closed + OPENS_M)
    };
    let palm = |at: usize| inputs.moments[at].palms[inputs.hand].translation.vector;
    let rests = |at: usize| {
        let (from, to) = (at.saturating_sub(RESTING), (at + RESTING).min(empty.len() - 1));
        (palm(to) - palm(from)).norm() < AT_REST * (to - from) as f64 / 1000.0
    };
    let closes = |at: usize| inputs.facts[at].near && was_open(at) && rests(at);
    // Fingers that meet the object while they close grasp it: where they are, it may be narrower than its bounding box.
    let grasps = |span: &Range<usize>| {
        let narrowest = openings[span.clone()].iter().copied().fold(f64::INFINITY, f64::min);
        let is_met = inputs.facts.get(span.end).is_some_and(|facts| facts.fingers > 0);
        is_met && openings[span.end] < narrowest + OPENS_M
    };
    spans(&empty).filter(|span| span.len() >= SHORTEST && closes(span.start) && !grasps(span)).collect()
}

/// Intervals from when a hand with a weak grip begins to leave its object until the fingers open.
fn stays_behind(inputs: &FailureInputs<'_>, openings: &[f64]) -> Vec<Range<usize>> {
    let [thumb, others] = [true, false].map(|thumb| touches(inputs, thumb));
    let pinches: Vec<bool> = thumb.iter().zip(&others).map(|(thumb, other)| *thumb && *other).collect();
    let touched: Vec<bool> = inputs.facts.iter().map(|facts| facts.fingers > 0).collect();
    let mut misses = Vec::new();
    for span in spans(&touched).filter(|span| span.end < touched.len()) {
        let Some(last) = span.clone().rev().find(|at| pinches[*at]) else { continue };
        let target = inputs.facts[span.start].target;
        let object = |at: usize| inputs.moments[at].bodies[target].pose.translation.vector;
        let middle = |at: usize| inputs.moments[at].middle(inputs.hand).coords - object(at);
        let (from, to) = (last.saturating_sub(AROUND).max(span.start), (last + AROUND).min(openings.len() - 1));
        let moved = |at: usize| (middle(at) - middle(from)).norm();
        let Some(left) = (from..=to).find(|at| moved(*at) > LEFT_M) else { continue };
        let opened = |at: usize| openings[at] > openings[from] + OPENS_M;
        let stays =
            (object(left) - object(from)).norm() <= STAYS_M && inputs.facts[from..last].iter().all(|it| it.carried_by);
        if !stays || (from..=left).any(opened) {
            continue;
        }
        let begins = (from..left).rev().find(|at| moved(*at) < BEGINS_M).unwrap_or(from);
        let end = (left..openings.len()).find(|at| opened(*at)).unwrap_or(openings.len());
        misses.push(begins..end);
    }
    misses
}

/// At each time, whether the thumb touches the object, or with `thumb: false`, whether another finger does. Short interruptions are bridged.
fn touches(inputs: &FailureInputs<'_>, thumb: bool) -> Vec<bool> {
    let is_of = |tip: &Tip| (tip.finger == Finger::Thumb) == thumb;
    let touch = |(facts, moment): (&Facts, &WorldState)| {
        moment.hands[inputs.hand].iter().any(|tip| is_of(tip) && tip.force_on(facts.target).is_some())
    };
    let mut touches: Vec<bool> = inputs.facts.iter().zip(inputs.moments).map(touch).collect();
    debounce(&mut touches, BRIDGE, 0);
    touches
}

/// The shortest edge of the bounding box of a body, m; 0 for a body without a shape.
fn width(body: &Body) -> f64 {
    corners(body).map_or(0.0, |[low, high]| (high - low).min())
}
