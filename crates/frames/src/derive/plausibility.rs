//! Logs that can be read and cannot be true: forces of contacts and fingers with the wrong sign, positions in another unit.
//!
//! Nothing is changed; each finding names the channel and what may be wrong with it (docs/logs.md).

use super::body_name;
use super::contacts::Contact;
use super::frame_tally::{FrameTally, LASTS, hundredths};
use super::hands::{HandTrack, finger_feels};
use super::held_forces::{NEAR, PULLS, up};
use super::motion::{Motion, every, sampled, vector};
use super::raw_channels::Array;
use super::targets::Derivation;
use crate::clean::preprocess::CleanLog;
use crate::frames::HandLayout;
use nalgebra::Point3;
use std::collections::BTreeMap;
use teachtree_base::contact_threshold;
use teachtree_base::geometry::{Solid, face_normal, surface_distance};
use teachtree_base::hands::{Finger, Side};
use teachtree_base::scene::{Body, Role};
use teachtree_logs::issue::{Issue, IssueKind};

/// A fingertip that touches is not farther than this from every object, m.
const REACH: f64 = 0.100;
/// A force is along a surface's normal when at least this share of it is: less, and it may be friction.
const ALONG: f64 = 0.5;

/// What is found so far, of fingers and of the forces of hands and contacts.
#[derive(Default)]
pub struct Findings {
    far: BTreeMap<(Side, usize), FrameTally>,
    /// Whether a finger that feels nothing was near an object since its gripper closed: it may have lost the object.
    took: BTreeMap<(Side, usize), bool>,
    contacts: BTreeMap<(usize, usize), FrameTally>,
    pushes: BTreeMap<(Side, Finger), FingerPush>,
}

/// What a finger does to the surface that it touches: how much it pulls, N, and of which force.
#[derive(Default)]
struct FingerPush {
    out: FrameTally,
    force: f64,
}

impl FingerPush {
    /// The share of the force that pulls; negative of a finger that pushes.
    fn share(&self) -> f64 {
        if self.force > 0.0 { self.out.sum / self.force } else { 0.0 }
    }
}

/// Finds fingertips that touch while they are far from every object. A gripper with only a flag stays closed after it has lost an object.
pub fn far_touches(
    measured: &CleanLog,
    motions: &[Motion],
    hand: &HandLayout,
    touches: &Array,
    findings: &mut Findings,
) {
    let sized = |body: &Body| !body.parts.is_empty() || body.radius.is_some();
    let objects: Vec<usize> = super::objects(measured.scene);
    let bodies: Vec<(&String, Solid, &Motion)> = objects
        .iter()
        .filter_map(|object| measured.scene.bodies.get_index(*object).zip(motions.get(*object)))
        .filter(|((_, body), _)| sized(body))
        .map(|((name, body), motion)| (name, Solid::new(body), motion))
        .collect();
    if bodies.is_empty() || bodies.len() < objects.len() {
        return;
    }
    // A fingertip this near to the origin of one of them is surely near enough, m.
    let near: Vec<(f64, &Motion)> =
        bodies.iter().map(|(_, body, motion)| ((REACH - body.inset()).max(0.0), *motion)).collect();
    let tips = hand.fingers.iter().zip(touches).enumerate().filter(|(_, (finger, _))| **finger != Finger::Palm);
    for (place, (finger, touches)) in tips {
        let Some(position) = measured.vec3(&format!("{}.{finger}.position", hand.side)) else { continue };
        let found = findings.far.entry((hand.side, place)).or_default();
        let took = findings.took.entry((hand.side, place)).or_default();
        let is_felt = finger_feels(measured, hand.side, *finger);
        for frame in measured.core() {
            if touches.get(frame).is_none_or(|touches| *touches <= 0.5) {
                *took = false;
                continue;
            }
            let tip: Point3<f64> = vector(&position, frame).into();
            let is_near =
                |(near, motion): &(f64, &Motion)| (tip.coords - motion.position(frame)).norm_squared() < near * near;
            if *took || near.iter().any(is_near) {
                *took = !is_felt;
                continue;
            }
            let in_body = |motion: &Motion| motion.pose(frame).inverse_transform_point(&tip);
            let least = bodies
                .iter()
                .map(|(name, body, motion)| (body.distance(&in_body(motion)), name.as_str()))
                .min_by(|a, b| a.0.total_cmp(&b.0));
            match least {
                Some((distance, name)) if distance > REACH => {
                    found.add(measured, frame, distance);
                    if found.of != name {
                        found.of = name.into();
                    }
                }
                _ => *took = !is_felt,
            }
        }
    }
}

/// Finds fingertips of a hand that touched while they were far from every object. While a gripper is closed all of them touch: the nearest one stands for them.
pub fn far_issues(measured: &CleanLog, hand: &HandLayout, findings: &Findings) -> Vec<Issue> {
    let side = hand.side;
    let far = hand.fingers.iter().enumerate().filter_map(|(place, finger)| {
        let found = findings.far.get(&(side, place))?;
        Some((*finger, found, found.mean(measured)?))
    });
    let (felt, closed): (Vec<_>, Vec<_>) = far.partition(|(finger, ..)| finger_feels(measured, side, *finger));
    let nearest = closed.into_iter().min_by(|(.., one), (.., other)| one.total_cmp(other));
    let gripper = nearest.map(|far| {
        let or = format!(
            ", or `{side}.gripper.closed` has the wrong direction, or the hand holds nothing (`hand_gripper.rules` leaves out a hold beyond `grip_reach`)"
        );
        (far, "the gripper is closed", or)
    });
    let fingertips = felt.into_iter().map(|far| {
        let measures_contact = measured.scalar(&format!("{side}.{}.contact", far.0)).is_some();
        let or = if measures_contact { "" } else { ", or its force is not zero at rest (`tare` it in a binding)" };
        (far, "the fingertip touches", or.to_string())
    });
    let issue = |((finger, found, mean), touches, or): ((Finger, &FrameTally, f64), &str, String)| {
        let message = format!(
            "{touches} while it is {} mm from the nearest object, `{}`: one of their positions does not change, or is in another unit or frame{or}",
            (mean * 1e3).round(),
            found.of
        );
        found.issue(IssueKind::IMPLAUSIBLE_POSITION, format!("{side}.{finger}.position"), message)
    };
    gripper.into_iter().chain(fingertips).map(issue).collect()
}

/// Finds supports that pull down what rests on them, by the forces of the log: one from shapes has no sign that could be wrong. It points down where an object
/// rests inside the shape of a bin that is drawn as a solid.
pub fn wrong_signs(derivation: &Derivation, objects: &[usize], findings: &mut Findings) {
    let (measured, contacts) = (derivation.measured, &derivation.contacts);
    let Some(up) = up(measured.scene) else { return };
    let core = measured.core();
    let supports =
        |body: usize| measured.scene.bodies.get_index(body).is_some_and(|(_, body)| body.role == Role::Support);
    for ((object, other), contact) in contacts {
        let names = body_name(measured, *object).zip(body_name(measured, *other));
        let is_logged = names
            .is_some_and(|(a, b)| Contact::is_logged_as(measured, &a, &b) || Contact::is_logged_as(measured, &b, &a));
        if !is_logged || !objects.contains(object) || !supports(*other) {
            continue;
        }
        let found = findings.contacts.entry((*object, *other)).or_default();
        for frame in core.clone().filter(|frame| !derivation.is_touched(*object, *frame)) {
            let force = contact.force(frame);
            if force.norm() > contact_threshold::ON_N {
                found.add(measured, frame, force.dot(&up));
            }
        }
    }
}

/// Determines whether each finger of a hand pushes or pulls the touched object.
pub fn pushes(measured: &CleanLog, motions: &[Motion], fingers: &[Finger], track: &HandTrack, findings: &mut Findings) {
    let (frames, side) = (sampled(measured), track.side);
    for finger in fingers.iter().filter(|finger| **finger != Finger::Palm) {
        let channel = |quantity: &str| measured.vec3(&format!("{side}.{finger}.{quantity}"));
        let (Some(tip), Some(force)) = (channel("position"), channel("force")) else { continue };
        let found = findings.pushes.entry((side, *finger)).or_default();
        for frame in frames.iter().copied().filter(|frame| track.touching.get(*frame) == Some(&true)) {
            let force = vector(&force, frame);
            let Some(target) =
                track.target.get(frame).copied().flatten().filter(|_| force.norm() > contact_threshold::ON_N)
            else {
                continue;
            };
            let Some(((_, body), motion)) = measured.scene.bodies.get_index(target).zip(motions.get(target)) else {
                continue;
            };
            let pose = motion.pose(frame);
            let at = pose.inverse_transform_point(&Point3::from(vector(&tip, frame)));
            if surface_distance(body, &at).abs() > NEAR {
                continue;
            }
            if let Some(normal) = face_normal(body, &at) {
                found.out.add(measured, frame, force.dot(&(pose.rotation * normal)));
                found.force += force.norm();
            }
        }
    }
}

/// Finds single fingers that pull what others of their hand push on.
fn pull_issues(measured: &CleanLog, findings: &Findings) -> Vec<Issue> {
    let mut issues = vec![];
    for ((side, finger), found) in &findings.pushes {
        let of_hand = || findings.pushes.iter().filter(|((its, _), _)| its == side).map(|(_, push)| push);
        let pushed = of_hand().any(|other| other.share() < -ALONG);
        let exchanged = of_hand().filter(|other| other.share() > ALONG).count() > 1;
        let frames = found.out.frames as f64;
        let mean = found.out.sum / frames.max(1.0);
        let lasts = frames * every(measured) as f64 / measured.rate_hz >= LASTS;
        if pushed && lasts && mean > PULLS && found.share() > ALONG {
            let or_other = if exchanged { ", or is it the force of another finger?" } else { "" };
            let message = format!(
                "the finger pulls with {} N on the object that others of its hand push: invert the sign of its force, which is the fingertip's \
                 on the object{or_other}",
                hundredths(mean)
            );
            issues.push(found.out.issue(IssueKind::IMPLAUSIBLE_FORCE, format!("{side}.{finger}.force"), message));
        }
    }
    issues
}

/// Finds forces of contacts and of single fingers whose sign was wrong.
pub fn sign_issues(measured: &CleanLog, findings: &Findings) -> Vec<Issue> {
    let name = |body: usize| measured.scene.bodies.get_index(body).map_or("", |(name, _)| name.as_str());
    let mut issues = vec![];
    for ((object, other), found) in &findings.contacts {
        if let Some(mean) = found.mean(measured).filter(|mean| *mean < -contact_threshold::ON_N) {
            let (a, b) = (name(*object), name(*other));
            let message = format!(
                "`{b}` pulls `{a}` down with {} N while no hand touches it: turn the sign, or the order of the names: \
                 `contact.a.b.force` is the force of b on a",
                hundredths(-mean)
            );
            let logged = if Contact::is_logged_as(measured, a, b) { [a, b] } else { [b, a] };
            let channel = format!("contact.{}.{}.force", logged[0], logged[1]);
            issues.push(found.issue(IssueKind::IMPLAUSIBLE_FORCE, channel, message));
        }
    }
    issues.extend(pull_issues(measured, findings));
    issues
}
