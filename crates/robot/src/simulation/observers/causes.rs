//! Causes of failed tasks: why an object is not at its commanded pose, when, and which hand is involved.
//!
//! Each cause is something that a real robot could measure on itself or see of the object. A condition that lasts less than [`LASTS_S`] is not a cause. Each
//! cause is reported once, with the time at which it began and its largest extent. A failed task has at least the cause that the object left its path.

use super::judge::{WITHIN_M, WITHIN_RAD};
use crate::control::behavior::{HOLDS_N, SearchResult, holds};
use crate::model::robot::Robot;
use crate::planning::plan::Target;
use crate::simulation::cause::{Cause, CausePlace, FailureCause};
use crate::simulation::hand_agent::{ActiveSegment, HandAgent};
use crate::simulation::observer::{Observer, Step};
use crate::{FingerModel, JointKind, Link};
use nalgebra::{Point3, Vector3};
use teachtree_base::hands::{Finger, Side};
use teachtree_base::scene::Scene;
use teachtree_world::{Observation, TipState};

/// The minimum duration of a cause, s.
const LASTS_S: f64 = 0.1;
/// The minimum duration of an object without contact, s: the object falls by 10 mm in this time.
const FALLS_S: f64 = 0.045;
/// A joint within this distance of its limit is at the limit, rad or m.
const AT_LIMIT: f64 = 1e-3;
/// The minimum error of a palm or fingertip that is off its path, m and rad.
const OFF_WAY: (f64, f64) = (2e-3, 2e-2);
/// The minimum missing torque that is reported, as a share of the motor's torque.
const LACKS: f64 = 0.05;
/// A fingertip that exerts less than this share of its commanded force does not press.
const PRESSES: f64 = 0.5;
/// A contact that moves farther along the surface has slipped, m. A fingertip ball that rolls moves less.
const SLIPS_M: f64 = 5e-3;

/// The causes of each task so far.
pub(in crate::simulation) struct Causes {
    tasks: Vec<TaskWatch>,
    /// Names of the bodies of the scene.
    bodies: Vec<String>,
}

impl Causes {
    /// Returns the empty causes of `tasks` tasks in a scene.
    pub(in crate::simulation) fn new(scene: &Scene, tasks: usize) -> Self {
        let bodies = scene.bodies.keys().cloned().collect();
        Self { tasks: (0..tasks).map(|_| TaskWatch::default()).collect(), bodies }
    }

    /// Returns the causes of a task, in order of time.
    pub(in crate::simulation) fn of(&self, task: usize) -> Vec<Cause> {
        let watch = &self.tasks[task];
        let left = watch.present.iter().filter(|cause| matches!(cause.why, FailureCause::LeftWay(..)));
        let mut causes: Vec<Cause> = watch.causes.iter().chain(left).cloned().collect();
        causes.sort_by(|one, other| one.time_s.total_cmp(&other.time_s));
        causes
    }
}

impl Observer for Causes {
    fn observe(&mut self, step: &Step<'_>) {
        for (hand, felt) in step.hands.iter().zip(&step.seen.hands) {
            let Some(doing) = hand.at_work() else { continue };
            let watch = &mut self.tasks[doing.task];
            let mut present = at_limits(hand, &felt.tips, doing.body);
            present.extend(weak_motors(hand));
            present.extend(watch.contacts(&hand.target, &felt.tips, &doing, step.seen));
            if let Some(SearchResult::NotWithin(within)) = hand.searched(doing.task) {
                present.push(FailureCause::HoleMissed(within));
            }
            let [is, should] = [step.seen.bodies[doing.body].pose, hand.target.object];
            let off = (is.translation.vector - should.translation.vector).norm();
            let turned = is.rotation.angle_to(&should.rotation);
            if off > WITHIN_M || turned > WITHIN_RAD {
                present.push(FailureCause::LeftWay(off, turned));
            }
            let placed = |why: &FailureCause| place(why, hand, doing.body, step.seen, &self.bodies);
            watch.note((step.time_s(), hand.planner.side, doing.primitive), &present, &placed);
        }
    }
}

/// The state of a task.
#[derive(Default)]
struct TaskWatch {
    causes: Vec<Cause>,
    /// The current conditions, each with the time at which it began.
    present: Vec<Cause>,
    /// The first contact point of each holding fingertip, frame of the object, m.
    held: Vec<(Finger, Point3<f64>)>,
}

impl TaskWatch {
    /// Records the current conditions with their places. A condition that has lasted long enough becomes a cause.
    fn note(
        &mut self,
        (time_s, side, primitive): (f64, Side, &str),
        now: &[FailureCause],
        placed: &dyn Fn(&FailureCause) -> CausePlace,
    ) {
        self.present.retain(|cause| now.iter().any(|why| why.is_same(&cause.why)));
        for why in now {
            match self.present.iter_mut().find(|cause| cause.why.is_same(why)) {
                Some(cause) => cause.why.worsen(why),
                None => self.present.push(Cause {
                    time_s,
                    side,
                    primitive: primitive.into(),
                    why: why.clone(),
                    place: placed(why),
                }),
            }
        }
        let lasts = |cause: &&Cause| time_s - cause.time_s >= lasts_s(&cause.why);
        // An object off its path may return to it until the end.
        let for_good = |cause: &&Cause| !matches!(cause.why, FailureCause::LeftWay(..));
        for cause in self.present.iter().filter(lasts).filter(for_good) {
            match self.causes.iter_mut().find(|known| known.why.is_same(&cause.why)) {
                Some(known) => known.why.worsen(&cause.why),
                None => self.causes.push(cause.clone()),
            }
        }
    }

    /// Returns contacts that slip or are lost, and a dropped object.
    fn contacts(
        &mut self,
        target: &Target,
        tips: &[TipState],
        doing: &ActiveSegment<'_>,
        seen: &Observation,
    ) -> Vec<FailureCause> {
        let object = seen.bodies[doing.body].pose;
        let asked = |finger: Finger| {
            let tip = target.tips.iter().find(|(other, ..)| *other == finger);
            tip.map_or(0.0, |(.., force)| force.norm())
        };
        self.held.retain(|(finger, _)| asked(*finger) > HOLDS_N);
        let mut present = Vec::new();
        for tip in tips.iter().filter(|tip| asked(tip.finger) > HOLDS_N) {
            let at = object.inverse_transform_point(&tip.position);
            let touch = tip.touches.iter().find(|touch| touch.body == doing.body);
            match (touch, self.held.iter().find(|(finger, _)| *finger == tip.finger)) {
                (Some(touch), None) if touch.force.norm() > PRESSES * asked(tip.finger) => {
                    self.held.push((tip.finger, at))
                }
                (Some(touch), Some((_, first))) => {
                    let way = at - first;
                    let normal = object.inverse_transform_vector(&touch.normal);
                    let along = (way - normal * way.dot(&normal)).norm();
                    present.extend((along > SLIPS_M).then_some(FailureCause::ContactSlipped(tip.finger, along)));
                }
                (None, Some(_)) => present.push(FailureCause::ContactLost(tip.finger)),
                _ => {}
            }
        }
        let bears = |bodies: [usize; 2], force: Vector3<f64>| bodies.contains(&doing.body) && force != Vector3::zeros();
        let touched =
            seen.hands.iter().flat_map(|hand| &hand.tips).any(|tip| tip.force_on(doing.body) != Vector3::zeros());
        let borne = seen.contacts.iter().any(|contact| bears([contact.body, contact.other], contact.force));
        if holds(target) && !self.held.is_empty() && !touched && !borne {
            present.push(FailureCause::Dropped);
        }
        present
    }
}

/// Returns the link of a cause and the contact: the object, or the body with the largest force on the object.
fn place(why: &FailureCause, hand: &HandAgent<'_>, object: usize, seen: &Observation, bodies: &[String]) -> CausePlace {
    let tree = &hand.executor.robot().tree;
    let body = |body: usize| bodies.get(body).cloned();
    let tip = |finger: Finger| Some(tree.links.get(hand.planner.hand.finger(finger)?.tip_link)?.name.clone());
    let moved = |name: &str| {
        let moves = |link: &&Link| link.joint.as_ref().is_some_and(|joint| tree.dofs[joint.dof].name == name);
        tree.links.iter().find(moves).map(|link| link.name.clone())
    };
    match why {
        FailureCause::ContactSlipped(finger, _) | FailureCause::ContactLost(finger) => {
            CausePlace { link: tip(*finger), contact: body(object) }
        }
        FailureCause::JointAtLimit(joint, finger, ..) => {
            CausePlace { link: moved(joint), contact: finger.and_then(|_| body(object)) }
        }
        FailureCause::TorqueMissing(joint, ..) => CausePlace { link: moved(joint), contact: None },
        FailureCause::Dropped => CausePlace::default(),
        FailureCause::HoleMissed(_) | FailureCause::LeftWay(..) => {
            let of_object = seen.contacts.iter().filter(|contact| [contact.body, contact.other].contains(&object));
            let pressed = of_object.filter(|contact| contact.force != Vector3::zeros());
            let hardest = pressed.max_by(|a, b| a.force.norm().total_cmp(&b.force.norm()));
            let other = hardest.map(|contact| if contact.body == object { contact.other } else { contact.body });
            CausePlace { link: None, contact: other.and_then(body) }
        }
    }
}

/// Returns the minimum duration of a cause, s.
fn lasts_s(why: &FailureCause) -> f64 {
    if matches!(why, FailureCause::Dropped) { FALLS_S } else { LASTS_S }
}

/// Returns the joints whose limits keep the palm, or a fingertip that should press, off its path.
fn at_limits(hand: &HandAgent<'_>, tips: &[TipState], body: usize) -> Vec<FailureCause> {
    let (executor, model) = (&hand.executor, &hand.planner.hand);
    let dofs = &executor.robot().tree.dofs;
    let at_limit = |dof: usize, value: f64| dofs[dof].range.iter().any(|limit| (value - limit).abs() < AT_LIMIT);
    let mut present = Vec::new();
    let missed = executor.missed();
    if missed.m > OFF_WAY.0 || missed.rad > OFF_WAY.1 {
        let wanted = executor.wanted();
        let those = model.arm.iter().filter(|&&dof| at_limit(dof, wanted[dof]));
        present
            .extend(those.map(|&dof| FailureCause::JointAtLimit(dofs[dof].name.clone(), None, missed.m, missed.rad)));
    }
    for (finger, place, force) in &hand.target.tips {
        let (Some(tip), Some(model)) = (tips.iter().find(|tip| tip.finger == *finger), model.finger(*finger)) else {
            continue;
        };
        let off = (tip.position - place).norm();
        let presses = tip.force_on(body).norm() >= PRESSES * force.norm();
        if force.norm() > HOLDS_N && !presses && off > OFF_WAY.0 {
            let those = model.dofs.iter().filter(|&&dof| at_limit(dof, executor.motion.q[dof]));
            present
                .extend(those.map(|&dof| FailureCause::JointAtLimit(dofs[dof].name.clone(), Some(*finger), off, 0.0)));
        }
    }
    present
}

/// Returns the motors whose commanded torque exceeds their limit.
fn weak_motors(hand: &HandAgent<'_>) -> Vec<FailureCause> {
    let robot = hand.executor.robot();
    let fingers = hand.planner.hand.fingers.iter().flat_map(|finger: &FingerModel| &finger.dofs);
    let mut dofs: Vec<usize> = hand.planner.hand.arm.iter().chain(fingers).copied().collect();
    // Jaws share a motor.
    dofs.sort_unstable();
    dofs.dedup();
    let lacking = dofs.into_iter().map(|dof| (dof, hand.executor.lacking(dof)));
    let weak = lacking.filter(|(dof, lacking)| *lacking > LACKS * robot.tree.dofs[*dof].torque);
    weak.map(|(dof, lacking)| FailureCause::TorqueMissing(robot.tree.dofs[dof].name.clone(), lacking, kind(robot, dof)))
        .collect()
}

/// Returns whether a degree of freedom is revolute or prismatic.
fn kind(robot: &Robot, dof: usize) -> JointKind {
    let mut joints = robot.tree.links.iter().filter_map(|link| link.joint.as_ref());
    joints.find(|joint| joint.dof == dof).map_or(JointKind::Revolute, |joint| joint.kind)
}
