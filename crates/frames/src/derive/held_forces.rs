//! The vertical forces of a hand on what it holds: a wrong sign, and a press on a body that the scene lacks.
//!
//! In both cases a downward force acts on a held object that touches nothing. Free motion distinguishes them: there, a force with the right sign supports the object.

use super::contacts::Contact;
use super::convex_gap::gaps;
use super::frame_tally::{FrameTally, LASTS, hundredths};
use super::motion::{Motion, every, sampled, vector};
use super::setup::SCENE_ERROR;
use super::targets::Derivation;
use crate::clean::preprocess::CleanLog;
use nalgebra::{Point3, Vector3};
use std::collections::BTreeMap;
use teachtree_base::contact_threshold;
use teachtree_base::geometry::surface_distance;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::scene::{Body, Scene};
use teachtree_logs::issue::{Issue, IssueKind};

/// A fingertip that is farther from the surface than this does not push on it, m.
pub const NEAR: f64 = 0.030;
/// Fingers that carry an object do not pull it down by more than this, N.
pub const PULLS: f64 = 0.1;
/// An object that is slower than this is stopped, m/s; `jam_speed` of failures.rules.
const STOPPED: f64 = 0.008;
/// An object that is faster than this is in motion, m/s.
const MOVES: f64 = 0.020;
/// A press is a downward force above this, N; `jam_off` of failures.rules.
const PRESSES: f64 = 4.0;

/// The vertical forces of the hands of a log.
#[derive(Default)]
pub struct HeldForces(BTreeMap<Side, HandForces>);

/// The upward force of a hand, N.
#[derive(Default)]
struct HandForces {
    /// While it touches an object in the air.
    carries: FrameTally,
    /// Those frames of `carries` on which the object is stopped and the force points down.
    presses: FrameTally,
    /// The largest downward force of `presses`, N, and the origin of the object then, m.
    hardest: Option<(f64, Vector3<f64>)>,
    /// While its target moves in the air.
    moves: FrameTally,
    /// While it is empty.
    empty: FrameTally,
}

/// The unit vector against gravity; `None` in a scene without gravity.
pub fn up(scene: &Scene) -> Option<Vector3<f64>> {
    (-Vector3::from(scene.gravity.map(|part| part.0))).try_normalize(1e-6)
}

impl HeldForces {
    /// Adds the forces of a log or of a window of it.
    pub fn add(&mut self, derivation: &Derivation, objects: &[usize]) {
        let (measured, tracks) = (derivation.measured, derivation.tracks);
        let Some(up) = up(measured.scene) else { return };
        for track in tracks {
            let channels = Finger::ALL.iter().map(|finger| format!("{}.{finger}.force", track.side));
            let forces: Vec<[&[f64]; 3]> = channels.filter_map(|channel| measured.vec3(&channel)).collect();
            let upward = |frame: usize| forces.iter().map(|force| vector(force, frame)).sum::<Vector3<f64>>().dot(&up);
            let found = self.0.entry(track.side).or_default();
            for (frames, target) in &track.runs {
                let Some(held) = target.and_then(|object| InAir::new(derivation, object)) else { continue };
                let frames = frames.start.max(measured.core().start)..frames.end.min(measured.core().end);
                let alone = |frame: usize| tracks.iter().filter(|it| it.target.get(frame) == Some(target)).count() == 1;
                for frame in frames.filter(|frame| alone(*frame) && held.is_in_air(*frame)) {
                    found.add_held(&held, frame, upward(frame));
                }
            }
            let empty = EmptyHandDetector::new(measured, derivation.motions, track.side, objects);
            for frame in sampled(measured).into_iter().filter(|frame| empty.detects(*frame)) {
                found.empty.add(measured, frame, upward(frame));
            }
        }
    }

    /// Returns the issues of all hands, once the whole log was added.
    pub fn issues(&self, measured: &CleanLog) -> Vec<Issue> {
        let of_hand = |(side, forces): (&Side, &HandForces)| {
            let channel = format!("{side}.fingers.force");
            forces.missing_body(measured, &channel).or_else(|| forces.wrong_sign(measured, channel))
        };
        self.0.iter().filter_map(of_hand).collect()
    }
}

impl HandForces {
    fn add_held(&mut self, held: &InAir, frame: usize, upward: f64) {
        let measured = held.derivation.measured;
        let speed = held.motion.velocity(frame).norm();
        if speed > MOVES {
            self.moves.add(measured, frame, upward);
        }
        if !held.derivation.is_touched(held.object, frame) {
            return;
        }
        self.carries.add(measured, frame, upward);
        if speed < STOPPED && upward < -PRESSES && held.is_clear(frame) {
            self.presses.add(measured, frame, upward);
            if self.hardest.is_none_or(|(force, _)| upward < force) {
                self.hardest = Some((upward, held.motion.position(frame)));
                self.presses.of.clone_from(held.name);
            }
        }
    }

    /// The mean force of the empty hand, if the log shows it.
    fn at_rest(&self, measured: &CleanLog) -> Option<f64> {
        let lasts = self.empty.frames as f64 * every(measured) as f64 / measured.rate_hz >= LASTS;
        lasts.then(|| self.empty.sum / (self.empty.frames as f64).max(1.0))
    }

    /// A press on nothing of a hand whose force has the right sign in free motion.
    fn missing_body(&self, measured: &CleanLog, channel: &str) -> Option<Issue> {
        let at_rest = self.at_rest(measured).unwrap_or_default();
        let bears = self.moves.mean(measured)? - at_rest > -PULLS;
        let press = self.presses.mean(measured).filter(|mean| bears && mean - at_rest < -PRESSES)?;
        // Without a negative zero.
        let at = self.hardest?.1.map(|part| (part * 1e3).round() + 0.0);
        let message = format!(
            "`{}` stops at [{} mm, {} mm, {} mm] while the hand presses it down with {} N, and it touches no body of the scene: the scene lacks \
             the body below it, such as a socket",
            self.presses.of,
            at.x,
            at.y,
            at.z,
            hundredths(at_rest - press)
        );
        Some(self.presses.issue(IssueKind::MISSING_BODY, channel.into(), message))
    }

    /// A hand that pulls down what it carries.
    fn wrong_sign(&self, measured: &CleanLog, channel: String) -> Option<Issue> {
        let mean = self.carries.mean(measured).filter(|mean| *mean < -PULLS)?;
        let pulls = format!("the fingers pull the carried object down with {} N", hundredths(-mean));
        let message = match self.at_rest(measured) {
            None => format!(
                "{pulls}: `tare` the force in a binding if it is not zero at rest; otherwise turn its sign, it is the fingertip's on the object, z \
                 upwards"
            ),
            Some(at_rest) if at_rest.abs() > PULLS => {
                let way = if at_rest < 0.0 { "downwards" } else { "upwards" };
                format!(
                    "{pulls}, and the force reads {} N {way} while the hand holds nothing: `tare` it in a binding first; turn its sign only if the \
                     fingers still pull down then",
                    hundredths(at_rest.abs())
                )
            }
            Some(_) => format!("{pulls}: turn the sign, the force is the fingertip's on the object, z upwards"),
        };
        Some(self.carries.issue(IssueKind::IMPLAUSIBLE_FORCE, channel, message))
    }
}

/// An object with known contacts, for the frames on which it touches no body.
struct InAir<'a> {
    derivation: &'a Derivation<'a>,
    object: usize,
    name: &'a String,
    motion: &'a Motion<'a>,
    contacts: Vec<&'a Contact<'a>>,
}

impl<'a> InAir<'a> {
    fn new(derivation: &'a Derivation<'a>, object: usize) -> Option<Self> {
        let of_object = derivation.contacts.iter().filter(|((one, _), _)| *one == object);
        let contacts: Vec<&Contact> = of_object.map(|(_, contact)| contact).collect();
        let (name, _) = derivation.measured.scene.bodies.get_index(object).filter(|_| !contacts.is_empty())?;
        Some(Self { derivation, object, name, motion: derivation.motions.get(object)?, contacts })
    }

    /// Whether it touches nothing. An object in a socket with clearance touches nothing, although the hand pushes it in.
    fn is_in_air(&self, frame: usize) -> bool {
        self.contacts.iter().all(|contact| contact.force(frame).norm() < contact_threshold::ON_N)
            && !self.derivation.is_at_socket(self.object, frame)
    }

    /// Whether no body of the scene is as near as shapes may be wrong.
    fn is_clear(&self, frame: usize) -> bool {
        let bodies = self.derivation.measured.scene.bodies.values().zip(self.derivation.motions).enumerate();
        let at = self.motion.pose(frame);
        let Some((_, (own, _))) = bodies.clone().nth(self.object) else { return false };
        let is_near = |(body, motion): (&Body, &Motion)| {
            gaps((own, &at), (body, &motion.pose(frame)), SCENE_ERROR).iter().any(|gap| gap.width < SCENE_ERROR)
        };
        !bodies.into_iter().any(|(index, other)| index != self.object && is_near(other))
    }
}

/// Detects frames on which a hand certainly holds nothing: its gripper is open and its fingertips are far from every object, as far as the log
/// contains these values.
struct EmptyHandDetector<'a> {
    closed: Option<&'a [f64]>,
    tips: Vec<[&'a [f64]; 3]>,
    objects: Vec<(&'a Body, &'a Motion<'a>)>,
}

impl<'a> EmptyHandDetector<'a> {
    fn new(measured: &'a CleanLog<'a>, motions: &'a [Motion<'a>], side: Side, objects: &[usize]) -> Self {
        let tips = Finger::ALL.iter().filter(|finger| **finger != Finger::Palm);
        let body = |object: &usize| Some((measured.scene.bodies.get_index(*object)?.1, motions.get(*object)?));
        let bodies: Vec<(&Body, &Motion)> = objects.iter().filter_map(body).collect();
        let holds_always = bodies.iter().any(|(body, _)| body.fixed_to == Some(side));
        let tips = tips.filter_map(|finger| measured.vec3(&format!("{side}.{finger}.position")));
        Self {
            closed: measured.scalar(&format!("{side}.gripper.closed")).filter(|_| !holds_always),
            tips: if holds_always { vec![] } else { tips.collect() },
            objects: bodies,
        }
    }

    fn detects(&self, frame: usize) -> bool {
        let open = self.closed.map(|closed| closed.get(frame).is_some_and(|closed| *closed < 0.5));
        let is_far = |tip: &[&[f64]; 3]| {
            let tip = Point3::from(vector(tip, frame));
            let distance = |(body, motion): &(&Body, &Motion)| {
                surface_distance(body, &motion.pose(frame).inverse_transform_point(&tip))
            };
            self.objects.iter().all(|object| distance(object) > NEAR)
        };
        let far = (!self.tips.is_empty()).then(|| self.tips.iter().all(is_far));
        match (open, far) {
            (None, None) => false,
            (open, far) => open.unwrap_or(true) && far.unwrap_or(true),
        }
    }
}
