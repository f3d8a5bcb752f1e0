//! The tolerance of contact forces: what the operator pressed with, as the commands have it, and as far as a robot may be from it.
//!
//! A task keeps its profile when
//! - each fingertip presses into the surface as it is commanded to, within [`WITHIN_N`] or [`WITHIN`] of that, for [`MOSTLY`] of the time;
//! - the total force of the hand on the object is as near to the commanded one, for as long; of that, the shares count of what the fingers press with;
//! - in each segment of [`LASTS_S`] or more the mean force of each fingertip is as near to the commanded mean;
//! - no fingertip presses harder than the hardest that is commanded, times [`FIRMER`] and [`WITHIN_N`] more, nor than the hand may.
//!
//! Forces are compared with those of the commands while the hand has closed and does not let go, in the frame of the object. What the hand adds of itself, where it
//! feels the object about to slip (`grip_force`), is reported, and is no part of what is commanded.

use crate::base::hands::Finger;
use crate::command::Task;
use crate::robot::planning::plan::PlannedForce;
use crate::robot::simulation::hand_agent::HandAgent;
use crate::robot::simulation::observer::{Observer, Step};
use crate::world::{STEP_S, TipState};
use nalgebra::{Isometry3, Vector3};
use std::fmt;

/// Forces may be this much off, N, or this share of what is commanded.
pub const WITHIN_N: f64 = 0.3;
/// The share.
pub const WITHIN: f64 = 0.3;
/// For at least this share of the time.
pub const MOSTLY: f64 = 0.9;
/// A hand that feels slip may press this many times as hard as the hardest that is commanded.
pub const FIRMER: f64 = 2.5;
/// The means of what is shorter are not compared, s.
pub const LASTS_S: f64 = 0.1;
/// Less than this is not commanded, N.
const COMMANDED_N: f64 = 0.05;
/// A grip that is changed by less than this share is not said to be.
const CHANGED: f64 = 0.005;

/// How a task's forces were beside those of its commands.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Forces {
    /// The share of the time, over all fingers, in which one pressed as commanded.
    pub fingers: f64,
    /// The share of the time in which the total force was as commanded.
    pub total: f64,
    /// How hard the fingertip pressed that did so most above what it might, or least below, N.
    pub largest: f64,
    /// How hard that one might, N.
    pub allowed: f64,
    /// Whether no fingertip pressed harder than it might.
    pub below: bool,
    /// The mean over time and fingers of how far the forces are from the commanded ones, N.
    pub error: f64,
    /// The segments in which the hand holds or pushes, in order.
    pub segments: Vec<SegmentForces>,
}

/// The forces in a segment.
#[derive(Clone, Debug, PartialEq)]
pub struct SegmentForces {
    /// Its index among those of the task.
    pub segment: usize,
    /// Its primitive.
    pub primitive: String,
    /// How long it took, s.
    pub lasts_s: f64,
    /// The fingertips that take part.
    pub fingers: Vec<MeanForce>,
    grip: GripSums,
}

/// The mean force of a fingertip over a segment, N.
#[derive(Clone, Debug, PartialEq)]
pub struct MeanForce {
    /// Which.
    pub finger: Finger,
    /// As it was demonstrated; `None` where that was not measured.
    pub demonstrated: Option<f64>,
    /// As in the commands.
    pub commanded: f64,
    /// As it was exerted.
    pub exerted: f64,
}

/// What the hand made of the strength of its grip in a primitive.
#[derive(Clone, Debug, PartialEq)]
pub struct GripChange {
    /// The primitive.
    pub primitive: String,
    /// By which share it was raised; negative where it was lowered.
    pub by: f64,
}

impl Forces {
    /// Whether all of the profile is kept.
    pub fn kept(&self) -> bool {
        self.below && self.fingers >= MOSTLY && self.total >= MOSTLY && self.off().is_none()
    }

    /// Returns the mean force that is farthest from the commanded one, of those that are too far from it, with its segment.
    pub fn off(&self) -> Option<(&SegmentForces, &MeanForce)> {
        let lasting = self.segments.iter().filter(|segment| segment.lasts_s >= LASTS_S);
        let all = lasting.flat_map(|segment| segment.fingers.iter().map(move |mean| (segment, mean)));
        let off = |mean: &MeanForce| (mean.exerted - mean.commanded).abs();
        let too_far = all.filter(|(_, mean)| !is_within(mean.exerted - mean.commanded, mean.commanded));
        too_far.max_by(|(_, one), (_, other)| off(one).total_cmp(&off(other)))
    }

    /// Returns the mean forces over all segments and fingers, N: as demonstrated, where that was measured, as commanded, and as exerted. `None` where the hand neither
    /// holds nor pushes.
    pub fn means(&self) -> Option<(Option<f64>, f64, f64)> {
        let all = || self.segments.iter().flat_map(|it| it.fingers.iter().map(move |mean| (it.lasts_s, mean)));
        let whole: f64 = all().map(|(lasts_s, _)| lasts_s).sum();
        let mean = |of: &dyn Fn(&MeanForce) -> Option<f64>| -> Option<f64> {
            let sum = all().map(|(lasts_s, mean)| Some(of(mean)? * lasts_s)).sum::<Option<f64>>()?;
            Some(sum / whole)
        };
        let (commanded, exerted) = (mean(&|it| Some(it.commanded))?, mean(&|it| Some(it.exerted))?);
        (whole > 0.0).then(|| (mean(&|it| it.demonstrated), commanded, exerted))
    }

    /// Returns by how much the hand held firmer or less firm than commanded, for each primitive in order of time.
    pub fn grip_changes(&self) -> Vec<GripChange> {
        let mut primitives: Vec<(&str, GripSums)> = Vec::new();
        for segment in &self.segments {
            match primitives.iter_mut().find(|(primitive, _)| *primitive == segment.primitive) {
                Some((_, sums)) => sums.add(&segment.grip),
                None => primitives.push((&segment.primitive, segment.grip)),
            }
        }
        let changes = primitives.into_iter().flat_map(|(primitive, sums)| {
            let changes = [sums.lowered(), sums.raised()].into_iter().filter(|by| by.abs() >= CHANGED);
            changes.map(|by| GripChange { primitive: primitive.into(), by }).collect::<Vec<_>>()
        });
        changes.collect()
    }
}

impl SegmentForces {
    /// Returns the share by which the slip reflex raised the grip.
    pub fn raised(&self) -> f64 {
        self.grip.raised()
    }
}

/// As a message for the user.
impl fmt::Display for GripChange {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (share, primitive) = (self.by.abs() * 100.0, &self.primitive);
        if self.by > 0.0 {
            write!(to, "grip raised by {share:.0} % in {primitive}: fingers were about to slip")
        } else {
            write!(to, "grip lowered by {share:.0} % in {primitive}: the hand may not press harder")
        }
    }
}

/// Whether a force that is off by so much is near enough to a commanded one, N.
fn is_within(off: f64, commanded: f64) -> bool {
    off.abs() <= WITHIN_N.max(WITHIN * commanded)
}

/// The sums of the strength of a grip over steps, N.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct GripSums {
    asked: f64,
    within_limits: f64,
    raised: f64,
}

impl GripSums {
    fn add(&mut self, other: &Self) {
        self.asked += other.asked;
        self.within_limits += other.within_limits;
        self.raised += other.raised;
    }

    fn raised(&self) -> f64 {
        if self.within_limits > 0.0 { self.raised / self.within_limits - 1.0 } else { 0.0 }
    }

    fn lowered(&self) -> f64 {
        if self.asked > 0.0 { self.within_limits / self.asked - 1.0 } else { 0.0 }
    }
}

/// The forces of each task.
pub(in crate::robot::simulation) struct ForceTolerance {
    tasks: Vec<Tally>,
}

impl ForceTolerance {
    /// The forces of tasks before any step.
    pub(in crate::robot::simulation) fn new(tasks: &[Task]) -> Self {
        Self { tasks: tasks.iter().map(Tally::of).collect() }
    }

    /// Returns how the forces of a task were.
    pub(in crate::robot::simulation) fn judge(&self, task: usize) -> Forces {
        self.tasks[task].judge()
    }
}

impl Observer for ForceTolerance {
    fn look(&mut self, step: &Step<'_>) {
        for (hand, felt) in step.hands.iter().zip(&step.seen.hands) {
            if let Some(doing) = hand.doing {
                let object = &step.seen.bodies[doing.body].pose;
                let tally = &mut self.tasks[doing.task];
                tally.note_largest(hand, &felt.tips, doing.body);
                if let Some(segment) = doing.holds_in.filter(|_| !doing.lost) {
                    tally.compare(&hand.planned, &felt.tips, (doing.body, object));
                    let sums = tally.sums(segment, doing.primitive);
                    sums.note(&hand.planned, &felt.tips, doing.body);
                    if let Some(grip) = hand.grip() {
                        let (asked, within_limits, raised) = (grip.asked, grip.within_limits, grip.raised);
                        sums.grip.add(&GripSums { asked, within_limits, raised });
                    }
                }
            }
        }
    }
}

/// Gathers forces while a task is performed.
#[derive(Clone, Debug, Default)]
struct Tally {
    fingers: Share,
    total: Share,
    /// The sum of how far forces are from commanded ones, N, and how many there were.
    error: f64,
    compared: f64,
    /// How hard the worst fingertip pressed, and how hard it might, N.
    worst: Option<[f64; 2]>,
    hardest_commanded: f64,
    segments: Vec<Sums>,
}

/// How often something was so.
#[derive(Clone, Copy, Debug, Default)]
struct Share {
    so: usize,
    of: usize,
}

impl Share {
    fn note(&mut self, so: bool) {
        self.of += 1;
        self.so += usize::from(so);
    }

    fn value(self) -> f64 {
        if self.of == 0 { 1.0 } else { self.so as f64 / self.of as f64 }
    }
}

/// Sums over the steps of a segment, N.
#[derive(Clone, Debug)]
struct Sums {
    segment: usize,
    primitive: String,
    steps: f64,
    fingers: Vec<MeanForce>,
    grip: GripSums,
}

impl Sums {
    /// A step of it, with the fingertips on `body`.
    fn note(&mut self, planned: &[PlannedForce], tips: &[TipState], body: usize) {
        self.steps += 1.0;
        for PlannedForce { finger, commanded, demonstrated } in planned {
            let exerted = tips.iter().find(|tip| tip.finger == *finger).map_or(0.0, |tip| tip.force_on(body).norm());
            let (commanded, demonstrated) = (commanded.norm(), demonstrated.map(|force| force.norm()));
            match self.fingers.iter_mut().find(|sums| sums.finger == *finger) {
                Some(sums) => {
                    sums.demonstrated = sums.demonstrated.zip(demonstrated).map(|(sum, more)| sum + more);
                    sums.commanded += commanded;
                    sums.exerted += exerted;
                }
                None => self.fingers.push(MeanForce { finger: *finger, demonstrated, commanded, exerted }),
            }
        }
    }

    fn means(&self) -> SegmentForces {
        let mean = |sums: &MeanForce| MeanForce {
            finger: sums.finger,
            demonstrated: sums.demonstrated.map(|sum| sum / self.steps),
            commanded: sums.commanded / self.steps,
            exerted: sums.exerted / self.steps,
        };
        SegmentForces {
            segment: self.segment,
            primitive: self.primitive.clone(),
            lasts_s: self.steps * STEP_S,
            fingers: self.fingers.iter().map(mean).collect(),
            grip: self.grip,
        }
    }
}

impl Tally {
    /// The profile of a task.
    fn of(task: &Task) -> Self {
        let tips = task.segments.iter().flat_map(|segment| &segment.tips).flat_map(|tip| &tip.force);
        let hardest_commanded = tips.map(|force| Vector3::from(*force).norm()).fold(0.0, f64::max);
        Self { hardest_commanded, ..Self::default() }
    }

    fn allowed(&self) -> f64 {
        self.hardest_commanded * FIRMER + WITHIN_N
    }

    /// Notes the fingertip on `body` that presses most above what it may.
    fn note_largest(&mut self, hand: &HandAgent<'_>, tips: &[TipState], body: usize) {
        for tip in tips {
            let exerted = tip.force_on(body).norm();
            let limit = hand.planner.hand.finger(tip.finger).map_or(f64::INFINITY, |finger| finger.force);
            let limit = limit.min(self.allowed());
            if self.worst.is_none_or(|[pressed, might]| exerted - limit > pressed - might) {
                self.worst = Some([exerted, limit]);
            }
        }
    }

    /// Compares the fingertips on a body, which is at a pose, with what is commanded.
    fn compare(&mut self, planned: &[PlannedForce], tips: &[TipState], (body, object): (usize, &Isometry3<f64>)) {
        let (mut commanded_total, mut total, mut sum) = (Vector3::zeros(), Vector3::zeros(), 0.0);
        for tip in tips {
            let exerted = object.inverse_transform_vector(&tip.force_on(body));
            total += exerted;
            let commanded = planned.iter().find(|planned| planned.finger == tip.finger).map(|it| it.commanded);
            let Some(commanded) = commanded.filter(|force| force.norm() > COMMANDED_N) else { continue };
            commanded_total += commanded;
            sum += commanded.norm();
            self.error += (exerted - commanded).norm();
            self.compared += 1.0;
            let touch = tip.touches.iter().find(|touch| touch.body == body);
            let inward =
                touch.map_or_else(|| commanded.normalize(), |touch| -object.inverse_transform_vector(&touch.normal));
            let (wanted, pressed) = (commanded.dot(&inward), exerted.dot(&inward));
            self.fingers.note(is_within(pressed - wanted, wanted));
        }
        if sum > COMMANDED_N {
            self.total.note(is_within((total - commanded_total).norm(), sum));
        }
    }

    /// The sums of a segment, which are none where it has just begun.
    fn sums(&mut self, segment: usize, primitive: &str) -> &mut Sums {
        let at = self.segments.iter().position(|sums| sums.segment == segment).unwrap_or_else(|| {
            let (primitive, grip) = (primitive.into(), GripSums::default());
            self.segments.push(Sums { segment, primitive, steps: 0.0, fingers: Vec::new(), grip });
            self.segments.len() - 1
        });
        &mut self.segments[at]
    }

    /// What came of it.
    fn judge(&self) -> Forces {
        let [largest, allowed] = self.worst.unwrap_or([0.0, self.allowed()]);
        Forces {
            fingers: self.fingers.value(),
            total: self.total.value(),
            largest,
            allowed,
            below: largest <= allowed,
            error: self.error / f64::max(self.compared, 1.0),
            segments: self.segments.iter().map(Sums::means).collect(),
        }
    }
}
