//! Jam: the hand presses an object that fits a socket on the rim of the socket, and the plug point stays outside.

use super::super::series::{debounce, means};
use super::{FailureInputs, spans};
use crate::sockets::SocketSite;
use std::ops::Range;

/// Minimum force along the axis, N, in the mean over `AROUND` ms on both sides, a period of tremor. Operators search with a smaller force.
const JAM_N: f64 = 4.0;
const AROUND: usize = 62;
/// Minimum duration of a jam, ms. Interruptions that are shorter than a period of tremor are bridged, ms.
const SHORTEST: usize = 250;
const BRIDGE: usize = 130;
/// The plug point is at the rim if it is at most this far below it, above it and beside the hole, m.
const DEEP_M: f64 = 0.001;
const ABOVE_M: f64 = 0.005;
const BESIDE_M: f64 = 0.020;

/// The jams of this hand.
pub(super) fn jams(inputs: &FailureInputs<'_>) -> Vec<Range<usize>> {
    let mut jammed = vec![false; inputs.facts.len()];
    for place in inputs.places {
        let pressed = means(&pressed(inputs, place), AROUND);
        let at_rim = (0..jammed.len()).map(|at| is_at_rim(inputs, place, at));
        for ((jammed, pressed), at_rim) in jammed.iter_mut().zip(pressed).zip(at_rim) {
            *jammed |= at_rim && pressed >= JAM_N;
        }
    }
    debounce(&mut jammed, BRIDGE, 0);
    spans(&jammed).filter(|span| span.len() >= SHORTEST).collect()
}

/// The force along the axis with which hand and rim press the object between them, N: the smaller one of both forces.
fn pressed(inputs: &FailureInputs<'_>, place: &SocketSite) -> Vec<f64> {
    let of_moment = inputs.facts.iter().zip(inputs.moments).map(|(facts, moment)| {
        let Some(plug) = place.plug(facts.target, &moment.bodies) else { return 0.0 };
        let rim = moment.force_between(facts.target, place.body).dot(&plug.axis);
        rim.min(-facts.force.dot(&plug.axis)).max(0.0)
    });
    of_moment.collect()
}

fn is_at_rim(inputs: &FailureInputs<'_>, place: &SocketSite, at: usize) -> bool {
    let plug = place.plug(inputs.facts[at].target, &inputs.moments[at].bodies);
    plug.is_some_and(|plug| {
        (-DEEP_M..=ABOVE_M).contains(&plug.height) && plug.beside.norm() <= place.socket.radius.0 + BESIDE_M
    })
}
