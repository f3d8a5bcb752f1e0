//! Compares contact forces with the commanded ones, which come from the operator, within a tolerance.
//!
//! A task keeps its force profile if
//! - the normal force of each fingertip is within [`WITHIN_N`] or [`WITHIN`] of the commanded one for [`MOSTLY`] of the time;
//! - the total force of the hand on the object is within the same tolerance for the same share of the time, where the relative part refers to the sum
//!   of the finger forces;
//! - the mean force of each fingertip is within the same tolerance in each segment of [`LASTS_S`] or more;
//! - no fingertip exceeds the largest commanded force times [`FIRMER`] plus [`WITHIN_N`], or the hand's limit.
//!
//! Forces are compared in the object's frame while the hand has closed and is not letting go. The force that the slip reflex (`grip_force`) adds is reported;
//! it is not part of the commanded force.

use crate::control::behavior::GripForceTotals;
use crate::planning::plan::PlannedForce;
use crate::simulation::hand_agent::HandAgent;
use crate::simulation::observer::{Observer, Step};
use nalgebra::{Isometry3, Vector3};
use std::fmt;
use teachtree_base::hands::Finger;
use teachtree_command::Task;
use teachtree_world::{STEP_S, TipState};

/// Accepted deviation of a force, N, and as a share of the commanded force.
pub const WITHIN_N: f64 = 0.3;
/// The share.
pub const WITHIN: f64 = 0.3;
/// For at least this share of the time.
pub const MOSTLY: f64 = 0.9;
/// The slip reflex may raise a force to this multiple of the largest commanded one.
pub const FIRMER: f64 = 2.5;
/// Minimum duration of a segment for its mean forces to be compared, s.
pub const LASTS_S: f64 = 0.1;
/// A smaller force does not count as commanded, N.
const COMMANDED_N: f64 = 0.05;
/// Minimum relative change of the grip force that is reported. A commanded force that exceeds the hand's limit by less is at the limit.
const CHANGED: f64 = 0.005;
/// Minimum relative lack of exerted force that is reported.
const LESS: f64 = 0.05;

/// The comparison of a task's forces with the commanded ones.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Forces {
    /// Share of the time, over all fingers, with a force within the tolerance.
    pub fingers: f64,
    /// Share of the time with a total force within the tolerance.
    pub total: f64,
    /// The force of the fingertip with the largest excess over its limit (or the smallest margin below it), N.
    pub largest: f64,
    /// The limit of that fingertip, N.
    pub allowed: f64,
    /// Whether all fingertips stayed within their limits.
    pub below: bool,
    /// Mean distance from the commanded forces over time and fingers, N.
    pub error: f64,
    /// The segments in which the hand holds or pushes, in order.
    pub segments: Vec<SegmentForces>,
}

/// The forces in a segment.
#[derive(Clone, Debug, PartialEq)]
pub struct SegmentForces {
    /// Index among the segments of the task.
    pub segment: usize,
    /// The primitive of the segment.
    pub primitive: String,
    /// When the robot began the segment, s since the beginning of the simulation.
    pub start_s: f64,
    /// Duration of the segment, s.
    pub lasts_s: f64,
    /// The participating fingertips.
    pub fingers: Vec<MeanForce>,
    grip: GripSums,
}

/// The mean force of a fingertip over a segment, N.
#[derive(Clone, Debug, PartialEq)]
pub struct MeanForce {
    /// The finger.
    pub finger: Finger,
    /// The demonstrated force; `None` if it was not measured.
    pub demonstrated: Option<f64>,
    /// The commanded force.
    pub commanded: f64,
    /// The exerted force.
    pub exerted: f64,
}

/// A change of the grip force in a segment.
#[derive(Clone, Debug, PartialEq)]
pub struct GripChange {
    /// The name of the segment, see [`Forces::name`].
    pub segment: String,
    /// What changed.
    pub kind: ChangeKind,
    /// Relative change, greater than 0.
    pub by: f64,
}

/// Kinds of changes of the grip force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChangeKind {
    /// The target force was lowered, because the command is above the limit of the hand.
    Lowered,
    /// The slip reflex raised the target force.
    Raised,
    /// The fingers exert less than commanded; the cause is not determined.
    Shortfall,
}

impl Forces {
    /// Whether all of the profile is kept.
    pub fn kept(&self) -> bool {
        self.below && self.fingers >= MOSTLY && self.total >= MOSTLY && self.off().is_none()
    }

    /// Returns the mean force outside the tolerance with the largest deviation, and its segment.
    pub fn off(&self) -> Option<(&SegmentForces, &MeanForce)> {
        let lasting = self.segments.iter().filter(|segment| segment.lasts_s >= LASTS_S);
        let all = lasting.flat_map(|segment| segment.fingers.iter().map(move |mean| (segment, mean)));
        let off = |mean: &MeanForce| (mean.exerted - mean.commanded).abs();
        let too_far = all.filter(|(_, mean)| !is_within(mean.exerted - mean.commanded, mean.commanded));
        too_far.max_by(|(_, one), (_, other)| off(one).total_cmp(&off(other)))
    }

    /// Returns the demonstrated (if measured), commanded and exerted mean force over all segments and fingers, N. `None` if the hand neither holds nor pushes.
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

    /// Returns the name of a segment: its primitive, and its start if several segments have this primitive.
    pub fn name(&self, segment: &SegmentForces) -> String {
        let primitive = &segment.primitive;
        let is_repeated = self.segments.iter().filter(|other| other.primitive == *primitive).nth(1).is_some();
        if is_repeated { format!("{primitive} at {:.1} s", segment.start_s) } else { primitive.clone() }
    }

    /// Returns a message for each part of the profile that is violated.
    pub fn faults(&self) -> Vec<String> {
        let mut faults = Vec::new();
        if !self.below {
            faults.push(format!("{:.2} N where {:.2} N are allowed", self.largest, self.allowed));
        }
        for (what, share) in [("fingers press", self.fingers), ("their total is", self.total)] {
            if share < MOSTLY {
                let (share, mostly) = (share * 100.0, MOSTLY * 100.0);
                faults.push(format!("{what} as commanded for {share:.0} % of the time, expected {mostly:.0} %"));
            }
        }
        if let Some((segment, MeanForce { finger, commanded, exerted, .. })) = self.off() {
            let segment = self.name(segment);
            faults.push(format!(
                "the {finger} exerts {exerted:.2} N in {segment} on average, commanded are {commanded:.2} N"
            ));
        }
        faults
    }

    /// Returns the changes of the grip force in each segment, in order of time.
    pub fn grip_changes(&self) -> Vec<GripChange> {
        let changes = self.segments.iter().flat_map(|segment| {
            let kinds = [
                (ChangeKind::Lowered, segment.grip.lowered(), CHANGED),
                (ChangeKind::Raised, segment.raised(), CHANGED),
                (ChangeKind::Shortfall, segment.less(), LESS),
            ];
            let changes = kinds.into_iter().filter(|(_, by, least)| by >= least);
            changes.map(|(kind, by, _)| GripChange { segment: self.name(segment), kind, by })
        });
        changes.collect()
    }
}

impl SegmentForces {
    /// Returns the relative change of the grip force by the slip reflex.
    pub fn raised(&self) -> f64 {
        self.grip.raised()
    }

    /// Returns by what share the fingers exert less than commanded. 0 for short segments and for a lack that the limit of the hand explains.
    fn less(&self) -> f64 {
        let sum = |of: fn(&MeanForce) -> f64| self.fingers.iter().map(of).sum::<f64>();
        let (commanded, exerted) = (sum(|mean| mean.commanded), sum(|mean| mean.exerted));
        let expected = commanded * (1.0 - self.grip.lowered());
        let lacks = exerted < expected * (1.0 - LESS) && expected - exerted >= COMMANDED_N;
        if lacks && self.lasts_s >= LASTS_S { 1.0 - exerted / commanded } else { 0.0 }
    }
}

/// Formats the change as a message.
impl fmt::Display for GripChange {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (share, segment) = (self.by * 100.0, &self.segment);
        match self.kind {
            ChangeKind::Lowered => {
                write!(to, "grip lowered by {share:.0} % in {segment}: the hand may not press harder")
            }
            ChangeKind::Raised => write!(to, "grip raised by {share:.0} % in {segment}: fingers were about to slip"),
            ChangeKind::Shortfall => write!(to, "fingers exert {share:.0} % less than commanded in {segment}"),
        }
    }
}

/// Whether a deviation is within the tolerance of a commanded force, N.
fn is_within(off: f64, commanded: f64) -> bool {
    off.abs() <= WITHIN_N.max(WITHIN * commanded)
}

/// Sums of the grip force over steps, N.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct GripSums {
    asked: f64,
    within_limits: f64,
    raised: f64,
    /// The missing force in the steps in which a commanded force is above the limit of the hand.
    above_limit: f64,
}

impl GripSums {
    fn add(&mut self, grip: &GripForceTotals, is_above_limit: bool) {
        self.asked += grip.asked;
        self.within_limits += grip.within_limits;
        self.raised += grip.raised;
        if is_above_limit {
            self.above_limit += grip.asked - grip.within_limits;
        }
    }

    fn raised(&self) -> f64 {
        if self.within_limits > 0.0 { self.raised / self.within_limits - 1.0 } else { 0.0 }
    }

    /// Returns the share by which the limit of the hand lowered the grip.
    fn lowered(&self) -> f64 {
        if self.asked > 0.0 { self.above_limit / self.asked } else { 0.0 }
    }
}

/// Whether a commanded force is above the limit of its finger.
fn is_above_limit(hand: &HandAgent<'_>) -> bool {
    hand.planned
        .iter()
        .any(|PlannedForce { finger, commanded, .. }| commanded.norm() > limit(hand, *finger) * (1.0 + CHANGED))
}

/// Returns the limit of a finger, N.
fn limit(hand: &HandAgent<'_>, finger: Finger) -> f64 {
    hand.planner.hand.finger(finger).map_or(f64::INFINITY, |finger| finger.force)
}

/// The forces of each task.
pub(in crate::simulation) struct ForceTolerance {
    tasks: Vec<Tally>,
}

impl ForceTolerance {
    /// Returns the tallies of the tasks before any step.
    pub(in crate::simulation) fn new(tasks: &[Task]) -> Self {
        Self { tasks: tasks.iter().map(Tally::of).collect() }
    }

    /// Returns the force comparison of a task.
    pub(in crate::simulation) fn judge(&self, task: usize) -> Forces {
        self.tasks[task].judge()
    }
}

impl Observer for ForceTolerance {
    fn observe(&mut self, step: &Step<'_>) {
        for (hand, felt) in step.hands.iter().zip(&step.seen.hands) {
            if let Some(doing) = hand.doing {
                let object = &step.seen.bodies[doing.body].pose;
                let tally = &mut self.tasks[doing.task];
                tally.note_largest(hand, &felt.tips, doing.body);
                if let Some(segment) = doing.holds_in.filter(|_| !doing.lost) {
                    tally.compare(&hand.planned, &felt.tips, (doing.body, object));
                    let sums = tally.sums(segment, doing.primitive, step.time_s());
                    sums.note(&hand.planned, &felt.tips, doing.body);
                    if let Some(grip) = hand.grip() {
                        sums.grip.add(&grip, is_above_limit(hand));
                    }
                }
            }
        }
    }
}

/// Gathers forces while a task is performed.
#[derive(Clone, Debug, Default)]
struct Tally {
    fingers: Ratio,
    total: Ratio,
    /// Sum of the distances from the commanded forces, N, and number of forces.
    error: f64,
    compared: f64,
    /// The force and the limit of the worst fingertip, N.
    worst: Option<[f64; 2]>,
    hardest_commanded: f64,
    segments: Vec<SegmentSums>,
}

/// Counts how often a condition was true.
#[derive(Clone, Copy, Debug, Default)]
struct Ratio {
    so: usize,
    of: usize,
}

impl Ratio {
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
struct SegmentSums {
    segment: usize,
    primitive: String,
    start_s: f64,
    steps: f64,
    fingers: Vec<MeanForce>,
    grip: GripSums,
}

impl SegmentSums {
    /// Adds a step with the fingertips on `body`.
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
            start_s: self.start_s,
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

    /// Records the fingertip on `body` with the largest excess over its limit.
    fn note_largest(&mut self, hand: &HandAgent<'_>, tips: &[TipState], body: usize) {
        for tip in tips {
            let exerted = tip.force_on(body).norm();
            let limit = limit(hand, tip.finger).min(self.allowed());
            if self.worst.is_none_or(|[pressed, might]| exerted - limit > pressed - might) {
                self.worst = Some([exerted, limit]);
            }
        }
    }

    /// Compares the forces of the fingertips on a body with the commanded ones.
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

    /// Returns the sums of a segment. They are zero when it is new, and it then begins at the given time.
    fn sums(&mut self, segment: usize, primitive: &str, start_s: f64) -> &mut SegmentSums {
        let at = self.segments.iter().position(|sums| sums.segment == segment).unwrap_or_else(|| {
            let (primitive, grip) = (primitive.into(), GripSums::default());
            self.segments.push(SegmentSums { segment, primitive, start_s, steps: 0.0, fingers: Vec::new(), grip });
            self.segments.len() - 1
        });
        &mut self.segments[at]
    }

    /// Returns the comparison.
    fn judge(&self) -> Forces {
        let [largest, allowed] = self.worst.unwrap_or([0.0, self.allowed()]);
        Forces {
            fingers: self.fingers.value(),
            total: self.total.value(),
            largest,
            allowed,
            below: largest <= allowed,
            error: self.error / f64::max(self.compared, 1.0),
            segments: self.segments.iter().map(SegmentSums::means).collect(),
        }
    }
}
