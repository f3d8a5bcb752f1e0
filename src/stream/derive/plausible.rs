//! Logs that can be read and cannot be true: forces with the wrong sign, positions in another unit.
//!
//! Nothing is changed; each finding names the channel and what may be wrong with it (docs/logs.md).

use super::contacts::{Contact, Contacts, TOUCH_ON};
use super::hands::HandTrack;
use super::motion::{Motion, vector};
use super::raw::Array;
use crate::base::geometry::surface_distance;
use crate::base::hands::Finger;
use crate::base::scene::{Body, Role};
use crate::stream::frames::{HandLayout, Issue};
use crate::stream::measured::Measured;
use nalgebra::{Point3, Vector3};

/// What cannot be true for this long in all is told, s.
const LASTS: f64 = 0.25;
/// A fingertip that touches is not farther than this from every object, m.
const REACH: f64 = 0.100;
/// Fingers that carry an object do not pull it down by more than this, N.
const PULLS: f64 = 0.1;

/// The frames in which something is found.
#[derive(Default)]
struct Found {
    frames: Vec<usize>,
    sum: f64,
}

impl Found {
    fn add(&mut self, frame: usize, value: f64) {
        self.frames.push(frame);
        self.sum += value;
    }

    /// The mean of what was found, when it lasted long enough to be told.
    fn mean(&self, measured: &Measured) -> Option<f64> {
        let n = self.frames.len() as f64;
        (n > 0.0 && n / measured.rate_hz >= LASTS).then(|| self.sum / n)
    }

    fn issue(&self, measured: &Measured, kind: &str, channel: String, message: String) -> Issue {
        let at = |frame: Option<&usize>| frame.and_then(|frame| measured.time.get(*frame)).copied().unwrap_or_default();
        Issue { kind: kind.into(), start_s: at(self.frames.first()), end_s: at(self.frames.last()), channel, message }
    }
}

/// Tells of fingertips that touch while they are far from every object.
pub fn far_touches(measured: &Measured, motions: &[Motion], hand: &HandLayout, touches: &Array) -> Vec<Issue> {
    let sized = |body: &Body| !body.parts.is_empty() || body.radius.is_some();
    let objects: Vec<usize> = super::objects(measured.scene);
    let bodies: Vec<(&String, &Body, &Motion)> = objects
        .iter()
        .filter_map(|object| measured.scene.bodies.get_index(*object).zip(motions.get(*object)))
        .map(|((name, body), motion)| (name, body, motion))
        .collect();
    if bodies.is_empty() || bodies.iter().any(|(_, body, _)| !sized(body)) {
        return vec![];
    }
    let mut issues = vec![];
    let tips = hand.fingers.iter().zip(touches).filter(|(finger, _)| **finger != Finger::Palm);
    for (finger, touches) in tips {
        let channel = format!("{}.{finger}.position", hand.side);
        let Some(position) = measured.vec3(&channel) else { continue };
        let mut found = Found::default();
        let mut nearest = "";
        for (frame, _) in touches.iter().enumerate().filter(|(_, touches)| **touches > 0.5) {
            let tip: Point3<f64> = vector(&position, frame).into();
            let distance = |body: &Body, motion: &Motion| {
                surface_distance(body, &motion.pose(frame).inverse_transform_point(&tip))
            };
            let least = bodies
                .iter()
                .map(|(name, body, motion)| (distance(body, motion), name.as_str()))
                .min_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((distance, name)) = least.filter(|(distance, _)| *distance > REACH) {
                found.add(frame, distance);
                nearest = name;
            }
        }
        if let Some(mean) = found.mean(measured) {
            let measures_contact = measured.scalar(&format!("{}.{finger}.contact", hand.side)).is_some();
            let or_force =
                if measures_contact { "" } else { ", or its force is not zero at rest (`tare` it in a binding)" };
            let message = format!(
                "the fingertip touches while it is {} mm from the nearest object, `{nearest}`: one of their positions stands still, or is in \
                 another unit or frame{or_force}",
                (mean * 1e3).round()
            );
            issues.push(found.issue(measured, "implausible_position", channel, message));
        }
    }
    issues
}

/// Tells of hands that pull down what they carry, and of supports that pull down what rests on them.
pub fn wrong_signs(measured: &Measured, contacts: &Contacts, tracks: &[HandTrack], objects: &[usize]) -> Vec<Issue> {
    let gravity = Vector3::from(measured.scene.gravity.map(|part| part.0));
    let Some(up) = (-gravity).try_normalize(1e-6) else { return vec![] };
    let name = |body: usize| measured.scene.bodies.get_index(body).map_or("", |(name, _)| name.as_str());
    let touched = |frame: usize, object: usize| {
        tracks.iter().any(|it| it.touching.get(frame) == Some(&true) && it.target.get(frame) == Some(&Some(object)))
    };
    let of = |object: usize| contacts.iter().filter(move |((one, _), _)| *one == object);
    let mut issues = vec![];
    for track in tracks {
        let forces: Vec<[&[f64]; 3]> =
            Finger::ALL.iter().filter_map(|finger| measured.vec3(&format!("{}.{finger}.force", track.side))).collect();
        let mut found = Found::default();
        for (frame, target) in track.target.iter().enumerate() {
            let Some(object) = *target else { continue };
            let in_air = of(object).next().is_some() && of(object).all(|(_, it)| it.force(frame).norm() < TOUCH_ON);
            let alone = tracks.iter().filter(|it| it.target.get(frame) == Some(target)).count() == 1;
            if touched(frame, object) && in_air && alone {
                found.add(frame, forces.iter().map(|force| vector(force, frame)).sum::<Vector3<f64>>().dot(&up));
            }
        }
        if let Some(mean) = found.mean(measured).filter(|mean| *mean < -PULLS) {
            let message = format!(
                "the fingers pull down with {} N what they carry: turn the sign, the force is the fingertip's on the object, z upwards",
                tenths(-mean)
            );
            issues.push(found.issue(measured, "implausible_force", format!("{}.fingers.force", track.side), message));
        }
    }
    for ((object, other), contact) in contacts.iter().filter(|((object, _), _)| objects.contains(object)) {
        let support = measured.scene.bodies.get_index(*other).is_some_and(|(_, body)| body.role == Role::Support);
        let mut found = Found::default();
        for frame in (0..measured.len()).filter(|frame| support && !touched(*frame, *object)) {
            let force = contact.force(frame);
            if force.norm() > TOUCH_ON {
                found.add(frame, force.dot(&up));
            }
        }
        if let Some(mean) = found.mean(measured).filter(|mean| *mean < -TOUCH_ON) {
            let (a, b) = (name(*object), name(*other));
            let message = format!(
                "`{b}` pulls `{a}` down with {} N while no hand touches it: turn the sign, or the order of the names: \
                 `contact.a.b.force` is the force of b on a",
                tenths(-mean)
            );
            let logged = if Contact::is_logged_as(measured, a, b) { [a, b] } else { [b, a] };
            let channel = format!("contact.{}.{}.force", logged[0], logged[1]);
            issues.push(found.issue(measured, "implausible_force", channel, message));
        }
    }
    issues
}

/// A number with two digits behind the point.
fn tenths(value: f64) -> f64 {
    (value * 100.0).round() / 100.0
}
