//! Slip: an object that is held in the air slides or turns between the fingers.

use super::super::series::{debounce, means};
use super::{FailureInputs, spans};
use nalgebra::Vector3;
use std::ops::Range;
use teachtree_base::hands::Finger;

/// Motions are taken between `AROUND` ms before and after, then averaged over `TREMOR` ms on both sides, the longest period of tremor.
const AROUND: usize = 25;
const TREMOR: usize = 62;
/// Minimum speed of an object against the fingers, m/s, or minimum angular speed, rad/s.
const SLIDES: f64 = 0.015;
const TURNS: f64 = 0.5;
/// Minimum distance of a slip, m, or minimum angle, rad. Interruptions that are shorter than `BRIDGE`, ms, are bridged.
const FAR_M: f64 = 0.0025;
const TURNED_RAD: f64 = 0.12;
const BRIDGE: usize = 60;
/// Shares of the distance at which a slip begins and ends.
const BEGINS: f64 = 0.05;
const ENDS: f64 = 0.95;

/// The motion of an object relative to the fingers that hold it, in the frame of the palm.
#[derive(Clone, Copy, Default)]
struct RelativeMotion {
    /// Velocity, m/s.
    velocity: Vector3<f64>,
    /// Angular velocity, rad/s.
    spin: Vector3<f64>,
}

/// The slips of this hand.
pub(super) fn slips(inputs: &FailureInputs<'_>) -> Vec<Range<usize>> {
    let motions: Vec<RelativeMotion> =
        (0..inputs.facts.len()).map(|at| relative_motion(inputs, at).unwrap_or_default()).collect();
    let velocities: Vec<Vector3<f64>> = motions.iter().map(|motion| motion.velocity).collect();
    let spins: Vec<Vector3<f64>> = motions.iter().map(|motion| motion.spin).collect();
    let mut slips: Vec<bool> = smooth(&velocities)
        .zip(smooth(&spins))
        .map(|(velocity, spin)| velocity.norm() > SLIDES || spin.norm() > TURNS)
        .collect();
    debounce(&mut slips, BRIDGE, 0);
    spans(&slips).filter_map(|span| slip(&velocities, &spins, span)).collect()
}

/// The part of an interval in which the object moves against the hand, if it moves far enough.
fn slip(velocities: &[Vector3<f64>], spins: &[Vector3<f64>], span: Range<usize>) -> Option<Range<usize>> {
    let way = |series: &[Vector3<f64>]| series[span.clone()].iter().sum::<Vector3<f64>>() / 1000.0;
    let (far, turned) = (way(velocities).norm() / FAR_M, way(spins).norm() / TURNED_RAD);
    if far.max(turned) < 1.0 {
        return None;
    }
    let series = if far > turned { velocities } else { spins };
    let whole = way(series);
    let mut gone = 0.0;
    let shares: Vec<f64> = series[span.clone()]
        .iter()
        .map(|motion| {
            gone += motion.dot(&whole) / 1000.0 / whole.norm_squared();
            gone
        })
        .collect();
    let half = shares.iter().position(|share| *share > 0.5)?;
    let begins = shares[..half].iter().rposition(|share| *share < BEGINS).unwrap_or(0);
    let ends = shares[half..].iter().position(|share| *share > ENDS).map_or(shares.len(), |at| half + at + 1);
    Some(span.start + begins..span.start + ends)
}

/// The means over a period of tremor.
fn smooth(series: &[Vector3<f64>]) -> impl Iterator<Item = Vector3<f64>> {
    let [x, y, z] = [0, 1, 2].map(|axis| means(&series.iter().map(|value| value[axis]).collect::<Vec<f64>>(), TREMOR));
    x.into_iter().zip(y).zip(z).map(|((x, y), z)| Vector3::new(x, y, z))
}

/// The motion of the object relative to the fingertips that touch it before and after; `None` unless a thumb and another finger of this hand alone hold
/// it.
fn relative_motion(inputs: &FailureInputs<'_>, at: usize) -> Option<RelativeMotion> {
    let FailureInputs { hand, moments, facts, .. } = *inputs;
    let (from, to) = (at.checked_sub(AROUND)?, at + AROUND);
    let [before, now, after] = [moments.get(from)?, moments.get(at)?, moments.get(to)?];
    let target = facts[at].target;
    let mut alone = [before, now, after].into_iter().all(|moment| !moment.is_in_contact(target));
    alone &= (0..now.hands.len()).all(|other| other == hand || !now.is_touched(other, target));
    if !alone || facts[from].target != target || facts[to].target != target {
        return None;
    }
    let tips = before.hands[hand].iter().zip(&after.hands[hand]);
    let held: Vec<_> =
        tips.filter(|(one, other)| one.force_on(target).is_some() && other.force_on(target).is_some()).collect();
    if held.len() < 2 || !held.iter().any(|(tip, _)| tip.finger == Finger::Thumb) {
        return None;
    }
    let count = held.len() as f64;
    let seconds = (to - from) as f64 / 1000.0;
    let middles = [
        held.iter().map(|(tip, _)| tip.position.coords).sum::<Vector3<f64>>() / count,
        held.iter().map(|(_, tip)| tip.position.coords).sum::<Vector3<f64>>() / count,
    ];
    let [one, other] =
        [before, after].map(|moment| (moment.palms[hand].rotation.inverse(), &moment.bodies[target].pose));
    let offsets = [(one, middles[0]), (other, middles[1])]
        .map(|((to_palm, pose), middle)| to_palm * (pose.translation.vector - middle));
    let turned = (other.0 * other.1.rotation) * (one.0 * one.1.rotation).inverse();
    Some(RelativeMotion { velocity: (offsets[1] - offsets[0]) / seconds, spin: turned.scaled_axis() / seconds })
}
