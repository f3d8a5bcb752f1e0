//! Samples of a whole recording: where hands and bodies are, what the hands do, and what their sensors read.
//!
//! A log in windows adds the samples of each window, which are those of the whole log.

use crate::clean::preprocess::CleanLog;
use crate::derive::motion::{every, sampled, vector};
use crate::derive::targets::Derivation;
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use std::ops::Range;
use teachtree_base::geometry::{Solid, unit};
use teachtree_base::hands::{Finger, Side};
use teachtree_base::scene::Scene;

/// A body slower than this does not move, m/s: as slow as objects at rest are for contacts from shapes.
const STILL: f64 = 5e-3;

/// The samples of a recording.
#[derive(Default)]
pub struct Survey {
    /// When each was taken, s.
    pub time: Vec<f64>,
    /// From one to the next, s.
    pub step_s: f64,
    /// When the log starts and ends, s.
    pub span: [f64; 2],
    /// All bodies of the scene.
    pub bodies: Vec<BodySamples>,
    /// The hands of the log.
    pub hands: Vec<HandSamples>,
}

/// A body at each sample.
#[derive(Default)]
pub struct BodySamples {
    /// Whether the log has its position; it is where the scene places it otherwise.
    pub is_logged: bool,
    /// reference_from_body.
    pub poses: Vec<Isometry3<f64>>,
    /// Whether it stands still.
    pub is_still: Vec<bool>,
    /// Whether it is in a socket.
    pub is_inserted: Vec<bool>,
}

/// A hand at each sample.
pub struct HandSamples {
    /// Which hand.
    pub side: Side,
    /// The fingertips whose position the log has, reference frame, m.
    pub tips: Vec<(Finger, Vec<Vector3<f64>>)>,
    /// The palm, reference frame, m; empty where the log lacks it.
    pub palm: Vec<Vector3<f64>>,
    /// reference_from_palm; empty where the log lacks it.
    pub rotation: Vec<UnitQuaternion<f64>>,
    /// The forces of fingers and palm that the log has, N.
    pub forces: Vec<(Finger, Vec<Vector3<f64>>)>,
    /// Whether the gripper is closed, or, where no flag shows that, whether the hand touches anything.
    pub touching: Vec<bool>,
    /// Its target, as an index of the scene.
    pub target: Vec<Option<usize>>,
    /// Whether it holds what it touches: its gripper is closed, or two fingers touch.
    pub grips: Vec<bool>,
    /// Whether its gripper is closed; empty where the log has no such flag.
    pub closed: Vec<bool>,
    /// The opening of its gripper, m; empty where the log lacks it.
    pub opening: Vec<f64>,
}

/// Whether a hand holds what it touches, at each sample. `touches` are the contacts of its fingers.
pub fn grips(measured: &CleanLog, side: Side, touches: &[Vec<f64>]) -> Vec<bool> {
    let is_on = |flag: &[f64], frame: usize| flag.get(frame).is_some_and(|flag| *flag > 0.5);
    let closed = measured.scalar(&format!("{side}.gripper.closed"));
    let grips = |frame: usize| match closed {
        Some(closed) => is_on(closed, frame),
        None => touches.iter().filter(|flag| is_on(flag, frame)).count() > 1,
    };
    sampled(measured).into_iter().map(grips).collect()
}

impl Survey {
    /// Adds the samples of a log, or of a window of it; `grips` has those of each hand.
    pub fn look(&mut self, derivation: &Derivation, grips: &[Vec<bool>]) {
        let (measured, frames) = (derivation.measured, sampled(derivation.measured));
        self.step_s = every(measured) as f64 / measured.rate_hz;
        self.span = measured.span;
        self.time.extend(frames.iter().filter_map(|frame| measured.time.get(*frame)));
        self.bodies.resize_with(measured.scene.bodies.len(), BodySamples::default);
        let bodies = self.bodies.iter_mut().zip(measured.scene.bodies.keys()).zip(derivation.motions).enumerate();
        for (index, ((body, name), motion)) in bodies {
            body.is_logged = measured.vec3(&format!("{name}.position")).is_some();
            body.poses.extend(frames.iter().map(|frame| motion.pose(*frame)));
            body.is_still.extend(frames.iter().map(|frame| motion.velocity(*frame).norm() < STILL));
            let plugged = derivation.plugged.get(&index);
            let in_socket =
                |frame: &usize| plugged.is_some_and(|it| it.socket.get(*frame).copied().flatten().is_some());
            body.is_inserted.extend(frames.iter().map(in_socket));
        }
        for (track, grips) in derivation.tracks.iter().zip(grips) {
            let hand = match self.hands.iter().position(|hand| hand.side == track.side) {
                Some(at) => self.hands.get_mut(at),
                None => {
                    self.hands.push(HandSamples::new(measured, track.side));
                    self.hands.last_mut()
                }
            };
            let Some(hand) = hand else { continue };
            hand.look(measured, &frames);
            // A sensor at the wrist reads weights, too: where a flag shows whether the gripper is closed, that counts.
            let touching = |frame: &usize| track.touching.get(*frame) == Some(&true);
            match hand.closed.get(hand.touching.len()..).filter(|closed| !closed.is_empty()) {
                Some(closed) => hand.touching.extend(closed),
                None => hand.touching.extend(frames.iter().map(touching)),
            }
            hand.target.extend(frames.iter().map(|frame| track.target.get(*frame).copied().flatten()));
            hand.grips.extend(grips);
        }
    }

    /// Whether the samples of a range follow each other without a gap.
    pub fn is_whole(&self, samples: &Range<usize>) -> bool {
        let at = |sample: usize| self.time.get(sample).copied().unwrap_or(f64::INFINITY);
        let steps = samples.len().saturating_sub(1) as f64;
        at(samples.end.saturating_sub(1)) - at(samples.start) < (steps + 0.5) * self.step_s
    }

    /// When the first and the last sample of a range were taken, s.
    pub fn span_of(&self, samples: &Range<usize>) -> [f64; 2] {
        let at = |sample: usize| self.time.get(sample).copied().unwrap_or_default();
        [at(samples.start), at(samples.end.saturating_sub(1))]
    }

    /// The maximal ranges of samples without a gap that have a property, and last at least this long, s.
    pub fn runs(&self, least_s: f64, has: impl Fn(usize) -> bool) -> Vec<Range<usize>> {
        let mut runs: Vec<Range<usize>> = vec![];
        for sample in (0..self.time.len()).filter(|sample| has(*sample)) {
            match runs.last_mut() {
                Some(run) if run.end == sample && self.is_whole(&(sample - 1..sample + 1)) => run.end = sample + 1,
                _ => runs.push(sample..sample + 1),
            }
        }
        runs.retain(|run| run.len() as f64 * self.step_s >= least_s);
        runs
    }

    /// The pose of a body at a sample.
    pub fn pose(&self, body: usize, sample: usize) -> Option<&Isometry3<f64>> {
        self.bodies.get(body)?.poses.get(sample)
    }

    /// Whether a hand touches a body at a sample.
    pub fn is_touched(&self, body: usize, sample: usize) -> bool {
        self.hands.iter().any(|hand| hand.touches(body, sample))
    }

    /// Whether the fingertips of all hands are known at all samples.
    pub fn knows_hands(&self, scene: &Scene) -> bool {
        let is_known = |side: &Side| self.hands.iter().any(|hand| hand.side == *side);
        !self.hands.is_empty()
            && self.hands.iter().all(|hand| !hand.tips.is_empty())
            && scene.hands.keys().all(is_known)
    }

    /// The least distance of the fingertips of some hands from the surface of a body at a sample, m.
    pub fn distance<'a>(
        &self,
        hands: impl Iterator<Item = &'a HandSamples>,
        (body, solid): (usize, &Solid),
        sample: usize,
    ) -> Option<f64> {
        let pose = self.pose(body, sample)?;
        let tips = hands.flat_map(|hand| hand.tips.iter().filter_map(move |(_, tip)| tip.get(sample)));
        tips.map(|tip| solid.distance(&pose.inverse_transform_point(&Point3::from(*tip)))).min_by(f64::total_cmp)
    }
}

impl HandSamples {
    fn new(measured: &CleanLog, side: Side) -> Self {
        let having = |quantity: &str| {
            let has = |finger: &Finger| measured.vec3(&format!("{side}.{finger}.{quantity}")).is_some();
            Finger::ALL.into_iter().filter(has).map(|finger| (finger, vec![])).collect::<Vec<_>>()
        };
        Self {
            side,
            tips: having("position").into_iter().filter(|(finger, _)| *finger != Finger::Palm).collect(),
            palm: vec![],
            rotation: vec![],
            forces: having("force"),
            touching: vec![],
            target: vec![],
            grips: vec![],
            closed: vec![],
            opening: vec![],
        }
    }

    fn look(&mut self, measured: &CleanLog, frames: &[usize]) {
        let side = self.side;
        let read = |finger: Finger, quantity: &str| {
            let columns = measured.vec3(&format!("{side}.{finger}.{quantity}"));
            columns.into_iter().flat_map(move |columns| frames.iter().map(move |frame| vector(&columns, *frame)))
        };
        self.tips.iter_mut().for_each(|(finger, tips)| tips.extend(read(*finger, "position")));
        self.forces.iter_mut().for_each(|(finger, forces)| forces.extend(read(*finger, "force")));
        self.palm.extend(read(Finger::Palm, "position"));
        if let Some(rotation) = measured.rotation(&format!("{side}.palm.rotation")) {
            let parts = |frame: &usize| rotation.map(|column| column.get(*frame).copied().unwrap_or_default());
            self.rotation.extend(frames.iter().map(|frame| unit(parts(frame))));
        }
        let column = |name: &str| {
            let column = measured.scalar(&format!("{side}.gripper.{name}")).unwrap_or_default();
            frames.iter().filter_map(move |frame| column.get(*frame).copied())
        };
        self.closed.extend(column("closed").map(|flag| flag > 0.5));
        self.opening.extend(column("opening"));
    }

    /// Where the hand is at a sample: the mean of its fingertips, else its palm, m.
    pub fn place(&self, sample: usize) -> Option<Vector3<f64>> {
        let tips: Vec<&Vector3<f64>> = self.tips.iter().filter_map(|(_, tip)| tip.get(sample)).collect();
        match tips.len() {
            0 => self.palm.get(sample).copied(),
            count => Some(tips.into_iter().sum::<Vector3<f64>>() / count as f64),
        }
    }

    /// Whether the hand touches a body at a sample.
    pub fn touches(&self, body: usize, sample: usize) -> bool {
        self.touching.get(sample) == Some(&true) && self.target.get(sample) == Some(&Some(body))
    }
}
