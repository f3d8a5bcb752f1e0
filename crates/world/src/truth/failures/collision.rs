//! Collision: an object that is carried through the air hits an obstacle. Bump: a fingertip of an empty hand does.

use super::super::series::debounce;
use super::{FailureInputs, spans};
use std::ops::Range;

/// Minimum peak of the force, N, in the mean over `PEAK` ms: an impact of a single step does not count.
const PEAK_N: f64 = 0.5;
const PEAK: usize = 10;
/// Interruptions of a contact that are shorter than a period of tremor, ms, are bridged.
const BRIDGE: usize = 130;
/// Contacts of an insertion do not count. The plug is inserted below this height above the rim, m, and within this distance from the axis, over the
/// radius of the socket.
const INSERTING_M: f64 = 0.010;
const INSERTING: f64 = 2.5;

/// The collisions of this hand while it carries an object, or while it does not.
pub(super) fn collisions(inputs: &FailureInputs<'_>, is_carrying: bool) -> Vec<Range<usize>> {
    let mut collisions: Vec<Range<usize>> =
        inputs.obstacles.iter().flat_map(|obstacle| with_obstacle(inputs, *obstacle)).collect();
    collisions.retain(|span| is_carried(inputs, span.start) == is_carrying);
    collisions.sort_by_key(|span| span.start);
    collisions
}

/// Whether the hand carries its object: an object that stands on a support is not carried.
fn is_carried(inputs: &FailureInputs<'_>, at: usize) -> bool {
    inputs.facts.get(at).is_some_and(|facts| facts.fingers > 0 && !facts.carried_by)
}

/// The collisions with one obstacle.
fn with_obstacle(inputs: &FailureInputs<'_>, body: usize) -> Vec<Range<usize>> {
    let forces: Vec<f64> = (0..inputs.facts.len()).map(|at| force(inputs, body, at)).collect();
    let mut touching: Vec<bool> = forces.iter().map(|force| *force > 0.0).collect();
    debounce(&mut touching, BRIDGE, 0);
    let peak = |span: &Range<usize>| {
        let sums = forces[span.clone()].windows(PEAK).map(|window| window.iter().sum::<f64>());
        sums.fold(0.0, f64::max) / PEAK as f64
    };
    spans(&touching).filter(|span| peak(span) >= PEAK_N).collect()
}

/// The force on an obstacle by the carried object and the fingertips, N; 0 during an insertion into this body.
fn force(inputs: &FailureInputs<'_>, body: usize, at: usize) -> f64 {
    let FailureInputs { hand, moments, facts, places, .. } = *inputs;
    let (moment, facts) = (&moments[at], &facts[at]);
    let tips = moment.hands[hand].iter().filter_map(|tip| tip.force_on(body)).map(|force| force.norm()).sum::<f64>();
    let inserts = places.iter().filter(|place| place.body == body).any(|place| {
        let plug = place.plug(facts.target, &moment.bodies);
        plug.is_some_and(|plug| {
            plug.height < INSERTING_M
                && plug.beside.norm() < INSERTING * place.socket.radius.0
                && plug.height > -place.socket.depth.0
        })
    });
    if inserts {
        return 0.0;
    }
    tips + if is_carried(inputs, at) { moment.force_between(facts.target, body).norm() } else { 0.0 }
}
