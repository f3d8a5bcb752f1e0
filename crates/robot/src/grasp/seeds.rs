//! Start poses of the search: the palm faces the object, with the fingers on one side and the thumb on the other, at several rolls about that line.

use super::grasp_request::GraspRequest;
use crate::kinematics::joint_positions::MAX_DOFS;
use crate::model::hand::HandModel;
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};
use std::f64::consts::TAU;
use teachtree_base::hands::Finger;

/// Shares of the ranges of a finger's second joint and of those that follow.
const FINGERS: [[f64; 2]; 8] =
    [[0.15, 0.1], [0.25, 0.2], [0.35, 0.25], [0.5, 0.3], [0.6, 0.45], [0.75, 0.3], [0.45, 0.6], [0.8, 0.55]];
/// Shares of the first, second, and further ranges of the thumb.
const THUMBS: [[f64; 3]; 7] = [
    [0.5, 0.1, 0.1],
    [0.5, 0.35, 0.35],
    [0.35, 0.5, 0.4],
    [0.65, 0.5, 0.4],
    [0.5, 0.65, 0.5],
    [0.3, 0.3, 0.3],
    [0.5, 0.2, 0.3],
];
/// Number of postures that are tried: those whose width is nearest to that of the contacts.
const TRIED: usize = 14;
const TRIED_WIDE: usize = 28;
/// Rolls about the line of opposition, in turns, for contacts whose order shows the orientation of the hand, and for others.
const ROLLS: [f64; 7] = [0.0, -0.06, 0.06, -0.13, 0.13, -0.2, 0.2];
const ALL_ROUND: usize = 14;
/// Tilts about the row of fingers, in turns, for fingers that push without an opponent.
const TILTS: [f64; 4] = [0.0, 0.12, -0.12, -0.22];

/// Tips and pads of all fingers in some posture, palm frame.
#[derive(Clone, Debug)]
pub(super) struct HandPosture {
    tips: Vec<Point3<f64>>,
    pads: Vec<Vector3<f64>>,
}

/// The postures of a hand.
pub(super) fn postures(hand: &HandModel) -> Vec<HandPosture> {
    let mut postures = Vec::new();
    for bent in FINGERS {
        for opposed in THUMBS {
            let mut hand_posture = HandPosture { tips: Vec::new(), pads: Vec::new() };
            for finger in &hand.fingers {
                let mut angles = [0.0; MAX_DOFS];
                for (index, ([low, high], angle)) in finger.ranges.iter().zip(&mut angles).enumerate() {
                    let share = match (finger.finger, index) {
                        (Finger::Thumb, index) => opposed[index.min(2)],
                        (_, 0) => 0.5,
                        (_, index) => bent[(index - 1).min(1)],
                    };
                    *angle = low + share * (high - low);
                }
                let posture = finger.posture(&angles);
                hand_posture.tips.push(posture.tip);
                hand_posture.pads.push(posture.pad);
            }
            postures.push(hand_posture);
        }
    }
    postures
}

/// Returns start poses of the palm in the object's frame; with `wide`, more of them in all directions.
pub(super) fn starts(
    hand: &HandModel,
    postures: &[HandPosture],
    request: &GraspRequest<'_>,
    wide: bool,
) -> Vec<Isometry3<f64>> {
    let Some((object, sided)) = object_frame(hand, request) else { return Vec::new() };
    let mut ranked: Vec<(f64, Isometry3<f64>)> = postures
        .iter()
        .filter_map(|hand_posture| {
            let hand = hand_frame(hand, request, hand_posture)?;
            Some(((hand.width - object.width).abs(), hand.frame))
        })
        .collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    let rolls: Vec<f64> =
        if sided && !wide { ROLLS.to_vec() } else { (0..ALL_ROUND).map(|at| at as f64 / ALL_ROUND as f64).collect() };
    let opposed = request.contacts.iter().any(|contact| contact.finger == Finger::Thumb);
    let tilts = if opposed && !wide { &[0.0][..] } else { &TILTS[..] };
    let tried = if wide { TRIED_WIDE } else { TRIED };
    let mut starts = Vec::new();
    for (_, palm_from_hand) in ranked.iter().take(tried) {
        for roll in &rolls {
            for tilt in tilts {
                let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), roll * TAU)
                    * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), tilt * TAU);
                starts.push(object.frame * turn * palm_from_hand.inverse());
            }
        }
    }
    starts
}

/// Returns the pose of the hand, in the middle of its ranges, over the contacts.
pub(super) fn laid_over(hand: &HandModel, request: &GraspRequest<'_>) -> Option<Isometry3<f64>> {
    let (object, _) = object_frame(hand, request)?;
    let mut hand_posture = HandPosture { tips: Vec::new(), pads: Vec::new() };
    for finger in &hand.fingers {
        let mut angles = [0.0; MAX_DOFS];
        for ([low, high], angle) in finger.ranges.iter().zip(&mut angles) {
            *angle = (low + high) / 2.0;
        }
        let posture = finger.posture(&angles);
        hand_posture.tips.push(posture.tip);
        hand_posture.pads.push(posture.pad);
    }
    Some(object.frame * hand_frame(hand, request, &hand_posture)?.frame.inverse())
}

/// A frame that a hand and its contacts share: origin half way between thumb and fingers, x from the thumb to the fingers, y along
/// the row of fingers.
struct Opposition {
    frame: Isometry3<f64>,
    width: f64,
}

/// Returns the frame of the contacts, and whether their order shows the orientation of the hand.
fn object_frame(hand: &HandModel, request: &GraspRequest<'_>) -> Option<(Opposition, bool)> {
    let tips: Vec<(Finger, Point3<f64>, Vector3<f64>)> = request
        .contacts
        .iter()
        .filter_map(|contact| {
            let radius = hand.finger(contact.finger)?.radius;
            Some((contact.finger, contact.point + contact.normal * radius, -contact.normal))
        })
        .collect();
    let sided = tips.iter().filter(|(finger, ..)| *finger != Finger::Thumb).count() > 1;
    Some((frame(&tips, None)?, sided))
}

/// Returns the frame of the same fingers of the hand in a posture.
fn hand_frame(hand: &HandModel, request: &GraspRequest<'_>, hand_posture: &HandPosture) -> Option<Opposition> {
    let tips: Vec<(Finger, Point3<f64>, Vector3<f64>)> = request
        .contacts
        .iter()
        .filter_map(|contact| {
            let index = hand.fingers.iter().position(|finger| finger.finger == contact.finger)?;
            Some((contact.finger, *hand_posture.tips.get(index)?, *hand_posture.pads.get(index)?))
        })
        .collect();
    // A single finger takes the row of all fingers.
    let others: Vec<&Point3<f64>> = hand
        .fingers
        .iter()
        .zip(&hand_posture.tips)
        .filter(|(finger, _)| finger.finger != Finger::Thumb)
        .map(|(_, tip)| tip)
        .collect();
    let row = others.last().zip(others.first()).map(|(last, first)| *last - *first);
    frame(&tips, row)
}

/// The frame of tips with the directions in which they press.
fn frame(tips: &[(Finger, Point3<f64>, Vector3<f64>)], row: Option<Vector3<f64>>) -> Option<Opposition> {
    let thumb = tips.iter().find(|(finger, ..)| *finger == Finger::Thumb);
    let fingers: Vec<_> = tips.iter().filter(|(finger, ..)| *finger != Finger::Thumb).collect();
    let mean = |points: &[Vector3<f64>]| points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
    let points: Vec<Vector3<f64>> = fingers.iter().map(|(_, tip, _)| tip.coords).collect();
    let (origin, along, width) = match (thumb, fingers.is_empty()) {
        (Some((_, tip, _)), false) => {
            let way = mean(&points) - tip.coords;
            (tip.coords + way / 2.0, way, way.norm())
        }
        // Without an opponent, x is opposite to the direction in which the tips press.
        (None, false) => {
            let press = mean(&fingers.iter().map(|(.., press)| *press).collect::<Vec<_>>());
            (mean(&points), -press, 0.0)
        }
        (Some((_, tip, press)), true) => (tip.coords, *press, 0.0),
        (None, true) => return None,
    };
    let x = along.try_normalize(1e-9)?;
    let sideways = match (points.first(), points.last()) {
        (Some(first), Some(last)) if points.len() > 1 => last - first,
        _ => row.unwrap_or_else(|| if x.z.abs() < 0.9 { Vector3::z() } else { Vector3::x() }),
    };
    let y =
        (sideways - x * sideways.dot(&x)).try_normalize(1e-9).or_else(|| x.cross(&Vector3::z()).try_normalize(1e-9));
    let y = y.or_else(|| x.cross(&Vector3::x()).try_normalize(1e-9))?;
    let turn = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, y, x.cross(&y)]));
    Some(Opposition { frame: Isometry3::from_parts(origin.into(), UnitQuaternion::from_rotation_matrix(&turn)), width })
}
