//! Objects that do not turn with the hand that grips them, and would if the components of a quaternion were in another order.

use super::median;
use super::rests::objects;
use super::survey::{HandSamples, Survey};
use crate::derive::quaternion_order::{ORDERS, Order};
use nalgebra::{Quaternion, UnitQuaternion};
use std::ops::Range;
use teachtree_base::geometry::unit;
use teachtree_base::scene::Scene;
use teachtree_logs::issue::{Issue, IssueKind};

/// Shortest hold, s.
const HOLD_SECS: f64 = 0.4;
/// Smallest turn of hand or object that is compared, rad.
const TURNS: f64 = 20.0 * std::f64::consts::PI / 180.0;
/// Median difference of turns that are not common, and of common ones, rad. An object gives way in the hand.
const APART: f64 = 15.0 * std::f64::consts::PI / 180.0;
const TOGETHER: f64 = 5.0 * std::f64::consts::PI / 180.0;
/// Minimum number of samples with turns that are compared.
const SAMPLES: usize = 10;

/// The rotations of a hand and an object that turn together only in another order of components.
pub fn issues(scene: &Scene, survey: &Survey) -> Vec<Issue> {
    let pairs = survey.hands.iter().flat_map(|hand| objects(scene, survey).map(move |object| (hand, object)));
    pairs.filter_map(|(hand, object)| apart(scene, survey, hand, object)).collect()
}

fn apart(scene: &Scene, survey: &Survey, hand: &HandSamples, object: usize) -> Option<Issue> {
    let is_held = |sample: usize| hand.grips.get(sample) == Some(&true) && hand.touches(object, sample);
    let holds = survey.runs(HOLD_SECS, is_held);
    let of_hand = |sample: usize| hand.rotation.get(sample).copied();
    let of_object = |sample: usize| Some(survey.pose(object, sample)?.rotation);
    let turns = |order: [Option<&Order>; 2]| turns(&holds, [&of_hand, &of_object], order);
    let as_read = turns([None, None]);
    let differ =
        |turns: &[[UnitQuaternion<f64>; 2]]| median(turns.iter().map(|[hand, object]| hand.angle_to(object)).collect());
    let apart = differ(&as_read).filter(|apart| as_read.len() >= SAMPLES && *apart > APART)?;
    let (name, _) = scene.bodies.get_index(object)?;
    let channels = [format!("{}.palm.rotation", hand.side), format!("{name}.rotation")];
    let explanations = (0..channels.len()).flat_map(|of| ORDERS.iter().map(move |order| (of, order)));
    let explained = explanations.filter_map(|(of, order)| {
        let orders = if of == 0 { [Some(order), None] } else { [None, Some(order)] };
        let turns = turns(orders);
        differ(&turns).filter(|differ| turns.len() >= SAMPLES && *differ < TOGETHER).map(|differ| (of, order, differ))
    });
    let (of, order, differ) = explained.min_by(|(.., one), (.., other)| one.total_cmp(other))?;
    let channel = channels.get(of)?;
    let span = survey.span_of(&(holds.first()?.start..holds.last()?.end));
    Some(Issue {
        kind: IssueKind::IMPLAUSIBLE_ROTATION,
        start_s: span[0],
        end_s: span[1],
        channel: channel.clone(),
        message: format!(
            "while the {} hand grips `{name}`, their turns differ by {:.0}°, and by {:.0}° if {}",
            hand.side,
            apart.to_degrees(),
            differ.to_degrees(),
            order.advice(channel)
        ),
    })
}

/// The turns of a hand and an object since the beginning of each hold, reference frame, where one of them turns by more than [`TURNS`].
fn turns(
    holds: &[Range<usize>],
    rotations: [&dyn Fn(usize) -> Option<UnitQuaternion<f64>>; 2],
    orders: [Option<&Order>; 2],
) -> Vec<[UnitQuaternion<f64>; 2]> {
    let [hand, object] = rotations;
    let [of_hand, of_object] = orders;
    let turn = |rotation: &dyn Fn(usize) -> Option<UnitQuaternion<f64>>, order, start, sample| {
        Some(reordered(rotation(sample)?, order) * reordered(rotation(start)?, order).inverse())
    };
    let samples = holds.iter().flat_map(|hold| hold.clone().map(|sample| (hold.start, sample)));
    let both = samples.filter_map(|(start, sample)| {
        Some([turn(hand, of_hand, start, sample)?, turn(object, of_object, start, sample)?])
    });
    both.filter(|turns| turns.iter().any(|turn| turn.angle() > TURNS)).collect()
}

fn reordered(read: UnitQuaternion<f64>, order: Option<&Order>) -> UnitQuaternion<f64> {
    let Some(order) = order else { return read };
    let Quaternion { coords } = *read.quaternion();
    unit(order.of([coords.w, coords.x, coords.y, coords.z]))
}
