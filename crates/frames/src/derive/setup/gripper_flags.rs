//! Gripper flags that are reversed: objects are carried while the gripper is open, or it is closed at its widest opening.

use super::co_motion::{self, MOVES, TOGETHER, steps};
use super::mm;
use super::survey::{HandSamples, Survey};
use teachtree_base::scene::{Role, Scene};
use teachtree_logs::issue::{Issue, IssueKind};

/// An object this far above its lowest place is lifted, m: an open gripper may push an object, and not lift it.
const LIFTED: f64 = 0.015;
/// At least as many steps carry an object while the gripper is open …
const STEPS: usize = 3;
/// … and this many times as many as while it is closed.
const TIMES: usize = 10;
/// A gripper that is `closed` is wider than one that is open by at least this, m: more than objects give way.
const WIDER: f64 = 0.010;
/// At least this share of the samples has either value of the flag.
const SHARE: f64 = 0.05;

/// The gripper flags that are reversed.
pub fn issues(scene: &Scene, survey: &Survey) -> Vec<Issue> {
    survey.hands.iter().filter_map(|hand| reversed(scene, survey, hand)).collect()
}

fn reversed(scene: &Scene, survey: &Survey, hand: &HandSamples) -> Option<Issue> {
    let closed = hand.closed.iter().filter(|closed| **closed).count() as f64 / hand.closed.len().max(1) as f64;
    if !(SHARE..=1.0 - SHARE).contains(&closed) {
        return None;
    }
    let reason = carries_open(scene, survey, hand).or_else(|| closed_is_wider(hand))?;
    let [start_s, end_s] = survey.span;
    let channel = format!("{}.gripper.closed", hand.side);
    let message =
        format!("{reason}: the column or the threshold of the flag is wrong, or the flag is reversed: turn it");
    Some(Issue { kind: IssueKind::REVERSED_FLAG, start_s, end_s, channel, message })
}

/// Says for how long objects are carried with the gripper open, where that is nearly always so.
fn carries_open(scene: &Scene, survey: &Survey, hand: &HandSamples) -> Option<String> {
    let is_object = |index: &usize| {
        scene.bodies.get_index(*index).is_some_and(|(_, body)| body.role == Role::Object && body.fixed_to.is_none())
    };
    let (mut while_open, mut while_closed, mut carried) = (0, 0, "");
    for object in (0..scene.bodies.len()).filter(is_object) {
        let height = |sample: usize| survey.pose(object, sample).map(|pose| pose.translation.vector.z);
        let lowest = (0..survey.time.len()).filter_map(height).fold(f64::INFINITY, f64::min);
        for step in steps(survey, hand, object) {
            let lifted = height(step.samples.start).is_some_and(|height| height > lowest + LIFTED);
            if !lifted || step.object.norm() < MOVES || step.mismatch(|hand| *hand) > TOGETHER {
                continue;
            }
            let flags = hand.closed.get(step.samples.clone()).unwrap_or_default();
            let of_step = flags.iter().filter(|closed| **closed).count();
            if of_step == 0 {
                while_open += 1;
                carried = scene.bodies.get_index(object).map_or("", |(name, _)| name.as_str());
            } else if of_step == flags.len() {
                while_closed += 1;
            }
        }
    }
    (while_open >= STEPS && while_open >= TIMES * while_closed).then(|| {
        format!(
            "`{carried}` is lifted and carried with the hand for {:.1} s while the gripper is open, and for {:.1} s while it is closed",
            co_motion::seconds(survey, while_open),
            co_motion::seconds(survey, while_closed)
        )
    })
}

/// Says how wide the gripper is where it is wider when it is closed: by its opening, or by the distance of two fingertips.
fn closed_is_wider(hand: &HandSamples) -> Option<String> {
    let apart = match hand.tips.as_slice() {
        _ if !hand.opening.is_empty() => hand.opening.clone(),
        [(_, one), (_, other)] => one.iter().zip(other).map(|(one, other)| (one - other).norm()).collect(),
        _ => return None,
    };
    let mean = |closed: bool| {
        let of_flag = || apart.iter().zip(&hand.closed).filter(|(_, flag)| **flag == closed).map(|(apart, _)| apart);
        of_flag().sum::<f64>() / of_flag().count().max(1) as f64
    };
    let [closed, open] = [mean(true), mean(false)];
    (closed > open + WIDER).then(|| {
        format!("the gripper is closed at an opening of {} mm, and open at {} mm, in the mean", mm(closed), mm(open))
    })
}
