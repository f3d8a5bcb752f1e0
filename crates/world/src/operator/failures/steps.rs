//! The steps of each failure. Forces, times and positions are random; every number is ours.

use super::super::goals::{Bring, Carry, Close, Collide, Goal, Insert, Jam, Reach, Slip, StopContact};
use super::{FailingScript, Failure, hold, open, up, waits_for};
use crate::shapes::corners;
use nalgebra::Vector3;
use std::ops::Range;
use teachtree_base::hands::Finger;
use teachtree_base::quantity::Quantity;
use teachtree_base::scene::Socket;

/// Force, N, and duration, s, of a jam. `MAX_FORCE_N` is the limit of hands with `force_scale: 1`.
const JAM_N: [f64; 2] = [5.0, 30.0];
const JAM_S: [f64; 2] = [0.3, 3.0];
const MAX_FORCE_N: f64 = 5.5;
/// Distance of the plug point from the axis, over the radius of the socket.
const BESIDE: [f64; 2] = [0.8, 1.5];
/// Distance by which an object slips before it is caught, m. An object cannot slip by `LOST_M`: it is lost.
const SLIP_M: [f64; 2] = [0.004, 0.015];
const LOST_M: f64 = 1.0;
/// Place of a slip or drop on the path of the object, as a share of the path.
const ON_THE_WAY: [f64; 2] = [0.2, 0.9];
/// Additional height from which an object is dropped, m: `HIGHER_M` if it is left, `STANDING_M` if it is picked up again and should land upright.
const HIGHER_M: [f64; 2] = [0.02, 0.08];
const STANDING_M: [f64; 2] = [0.015, 0.03];
/// An object lands upright if its height is at most this multiple of its width.
const UPRIGHT: f64 = 1.5;
/// Distance from the object at which fingers close on nothing, m.
const CLEAR_M: [f64; 2] = [0.003, 0.02];
/// Force of a grip that is too weak to lift, N. Fingers overshoot it by half.
const WEAK_N: f64 = 0.08;
/// Height to which the hand rises after a miss, m.
const RISE_M: [f64; 2] = [0.06, 0.1];
/// Distance that the hand moves after a collision, m, time until the retreat, s, and speed, m/s.
const OVERSHOOT_M: [f64; 2] = [0.005, 0.014];
const PAUSE_S: [f64; 2] = [0.05, 0.3];
const COLLIDING: [f64; 2] = [0.1, 0.3];
/// Share of the lift before an object collides.
const LOW: [f64; 2] = [0.25, 0.5];

/// Goals, each with the failure that begins with it.
type Goals = Vec<(Goal, Option<Failure>)>;

fn plain(goals: impl IntoIterator<Item = Goal>) -> Goals {
    goals.into_iter().map(|goal| (goal, None)).collect()
}

impl FailingScript<'_> {
    /// Adds the steps of a failure, if the script allows it.
    pub(super) fn add(&mut self, failure: Failure) {
        // A failure is left out if the script lacks a part of it, for example the reach before the grasp.
        let _ = match failure {
            Failure::Jam => self.jam(),
            Failure::Slip => self.slip(),
            Failure::Drop => self.drop_at_transfer().or_else(|| self.drop_in_the_air()),
            Failure::Miss => self.miss(),
            Failure::Collision => self.collide(),
        };
    }

    /// The plug is pressed beside the hole. Then it is inserted, or put back to its start; there it is left, or grasped for a second attempt.
    fn jam(&mut self) -> Option<()> {
        let at = self.script.first(|goal| matches!(goal, Goal::Insert(_)))?;
        let Goal::Insert(Insert { socket, .. }) = self.script.steps[at].goal.clone() else { return None };
        let radius = self.socket(&socket)?.radius.0;
        let scale = self.script.operator.force_scale;
        let force = self.between([JAM_N[0], JAM_N[1].min(MAX_FORCE_N * scale).max(JAM_N[0])]) / scale;
        let beside = radius * self.between(BESIDE);
        let time = self.between(JAM_S);
        let (beside, force, time) = (Quantity(beside), Quantity(force), Quantity(time));
        let jam = Goal::Jam(Jam { socket, beside, force, time, speed: Quantity(0.03) });
        let mut goals = vec![(jam, Some(Failure::Jam)), (up(0.030, 0.08), None)];
        let fate = self.script.chance.share();
        let opening = self.opening(at)?;
        if fate < 0.4 {
            self.replace(at..at, goals);
        } else if fate < 0.7 && !self.is_awaited(at..opening) {
            goals.extend(plain(self.put_back(at)?));
            self.replace(at..opening, goals);
        } else {
            goals.extend(plain(self.put_back(at)?));
            goals.push((self.script.steps[opening].goal.clone(), None));
            let again = self.approach_before(at)?..at;
            goals.extend(plain(self.script.reach_before(again.start)));
            goals.extend(self.again(again));
            self.replace(at..at, goals);
        }
        Some(())
    }

    /// The object slips after the lift or on its path, and is caught.
    fn slip(&mut self) -> Option<()> {
        let at = self.script.first(|goal| matches!(goal, Goal::Bring(_)))?;
        let distance = Quantity(self.between(SLIP_M));
        let mut goals = plain(self.part_of_way(at));
        goals.push((Goal::Slip(Slip { distance }), Some(Failure::Slip)));
        self.replace(at..at, goals);
        Some(())
    }

    /// The object slips out of the fingers, or they open, after the lift or on the path. Then it is picked up again if it lands upright, or left.
    fn drop_in_the_air(&mut self) -> Option<()> {
        let at = self.script.first(|goal| matches!(goal, Goal::Bring(_)))?;
        let approach = self.approach_before(at)?;
        let opening = self.opening(at)?;
        let left = !self.lands_upright(approach)? || self.gives_up();
        if left && self.is_awaited(at..opening) {
            return None;
        }
        let mut goals = plain(self.part_of_way(at));
        goals.push((up(self.between(if left { HIGHER_M } else { STANDING_M }), 0.1), None));
        if self.script.chance.share() < 0.7 {
            let empty = Close { force: Quantity(0.3), speed: Quantity(0.1), unchecked: true };
            goals.push((Goal::Slip(Slip { distance: Quantity(LOST_M) }), Some(Failure::Drop)));
            goals.extend(plain([Goal::Close(empty), hold(self.between([0.1, 0.4])), open(0.04, 0.12)]));
        } else {
            goals.push((open(0.025, 0.3), Some(Failure::Drop)));
        }
        goals.push((hold(self.between([0.2, 0.6])), None));
        if left {
            goals.push((up(0.05, 0.15), None));
            self.replace(at..opening, goals);
        } else {
            goals.extend(plain(self.script.reach_before(approach)));
            goals.extend(self.again(approach..at));
            self.replace(at..at, goals);
        }
        Some(())
    }

    /// A hand that holds the object out for the other hand opens before the other hand has arrived.
    fn drop_at_transfer(&mut self) -> Option<()> {
        let bring = self.script.first(|goal| matches!(goal, Goal::Bring(_)))?;
        let opening = self.opening(bring)?;
        let own = &self.script.steps[bring..opening];
        let waiting = bring + own.iter().position(|step| matches!(step.goal, Goal::Wait(_)))?;
        let held_out = self.script.steps[waiting].phase.clone()?;
        let coming = self.others().find_map(|script| {
            script.steps.iter().position(|step| waits_for(step, &held_out))?;
            let close = script.steps.iter().position(|step| matches!(step.goal, Goal::Close(_)))?;
            let before = script.steps[..close].iter().rev();
            before.filter(|step| matches!(step.goal, Goal::Reach(_))).find_map(|step| step.phase.clone())
        })?;
        self.script.steps[waiting].goal = Goal::Wait(coming);
        let pause = hold(self.between([0.05, 0.5]));
        self.script.steps[opening].failure = Some(Failure::Drop);
        self.replace(waiting + 1..opening, vec![(pause, None)]);
        Some(())
    }

    /// The fingers close beside or above the object, or the grip is too weak. Then the hand grasps the object, or leaves.
    fn miss(&mut self) -> Option<()> {
        let close = self.script.first_grasp()?;
        let (at, approach) = self.script.approach(Some(close))?;
        let Goal::Close(grasp) = self.script.steps[close].goal.clone() else { return None };
        let place = self.script.chance.share();
        let stays_behind = place < 0.4;
        let (reach, grasp) = if stays_behind {
            let gently = Close { force: Quantity(WEAK_N), speed: Quantity(0.010), unchecked: true };
            (Reach { opened: Quantity(0.008), ..approach.clone() }, gently)
        } else {
            let offset = self.clear_of_object(&approach.grip, place > 0.8)?.map(Quantity);
            (Reach { offset, ..approach.clone() }, Close { unchecked: true, ..grasp })
        };
        let mut goals = plain([Goal::Reach(reach)]);
        goals.push((Goal::Close(grasp), Some(Failure::Miss)));
        goals.push((hold(self.between([0.1, 0.4])), None));
        if stays_behind || self.script.chance.share() < 0.5 {
            goals.push((up(self.between(RISE_M), 0.12), None));
            goals.push((hold(self.between([0.1, 0.6])), None));
        }
        goals.push((open(0.03, 0.12), None));
        let end = self.script.steps.len();
        if self.gives_up() && !self.is_awaited(at..end) {
            goals.push((up(0.08, 0.2), None));
            self.replace(at..end, goals);
        } else {
            goals.extend(plain(self.script.reach_before(at)));
            self.replace(at..at, goals);
        }
        Some(())
    }

    /// The object is not lifted high enough and hits the obstacle, or the empty hand hits the obstacle on its way to the object.
    fn collide(&mut self) -> Option<()> {
        let close = self.script.first_grasp()?;
        let with = self.plan.obstacle.clone()?;
        let (overshoot, pause) = (Quantity(self.between(OVERSHOOT_M)), Quantity(self.between(PAUSE_S)));
        let (back, speed) = (Quantity(self.between([0.015, 0.03])), Quantity(self.between(COLLIDING)));
        let collide = (Goal::Collide(Collide { with, overshoot, pause, back, speed }), Some(Failure::Collision));
        let bring = self.script.first(|goal| matches!(goal, Goal::Bring(_)));
        let lift = bring.and_then(|bring| Some((bring, self.lift(close..bring)?)));
        match lift {
            Some((bring, (at, carry))) if self.script.chance.share() < 0.6 => {
                let low = carry.distance.0 * self.between(LOW);
                let rest = up(carry.distance.0 - low, carry.speed.0);
                self.replace(bring..bring, vec![collide, (rest, None)]);
                if let Goal::Carry(carry) = &mut self.script.steps[at].goal {
                    carry.distance = Quantity(low);
                }
            }
            _ => {
                let (at, _) = self.script.approach(Some(close))?;
                let again = plain(self.script.reach_before(at));
                let goals = std::iter::once(collide).chain(again).collect();
                self.replace(at..at, goals);
            }
        }
        Some(())
    }

    /// The last lift in a range of steps: its index and motion.
    fn lift(&self, range: Range<usize>) -> Option<(usize, Carry)> {
        let steps = self.script.steps.iter().enumerate().take(range.end).skip(range.start);
        let mut lifts = steps.filter(|(_, step)| !step.added).filter_map(|(at, step)| match &step.goal {
            Goal::Carry(carry) if carry.along[2] > 0.0 && carry.until.is_none() => Some((at, carry.clone())),
            _ => None,
        });
        lifts.next_back()
    }

    /// The index of the reach that leads to the last grasp before a step.
    fn approach_before(&self, at: usize) -> Option<usize> {
        let steps = &self.script.steps[..at];
        let grasp = steps.iter().rposition(|step| !step.added && matches!(step.goal, Goal::Close(_)));
        self.script.approach(grasp).map(|(at, _)| at)
    }

    /// Goals that put the object back to its start.
    fn put_back(&self, at: usize) -> Option<[Goal; 3]> {
        let (_, approach) = self.script.approach(Some(at))?;
        let [x, y, z] = self.object(&approach.grip)?.position;
        let to = [x, y, Quantity(z.0 + 0.015)];
        let until = Some(StopContact { contact: self.support()?.clone(), within: Quantity(0.0) });
        let (distance, speed) = (Quantity(0.06), Quantity(0.06));
        let down = Carry { along: [0.0, 0.0, -1.0], distance, speed, until, press: None };
        Some([Goal::Bring(Bring { to, speed: Quantity(0.22) }), Goal::Carry(down), hold(0.25)])
    }

    /// Whether the object of a reach lands upright after a short fall: it is not much higher than wide.
    fn lands_upright(&self, reach: usize) -> Option<bool> {
        let Goal::Reach(reach) = &self.script.steps.get(reach)?.goal else { return None };
        let [low, high] = corners(self.object(&reach.grip)?)?;
        let edges = high - low;
        Some(edges.z <= UPRIGHT * edges.x.min(edges.y))
    }

    /// The first part of the path on which a step brings the object, from the start of the object; in half of the cases `None`.
    fn part_of_way(&mut self, at: usize) -> Option<Goal> {
        let Goal::Bring(bring) = self.script.steps.get(at)?.goal.clone() else { return None };
        let (moves, share) = (self.script.chance.share() < 0.5, self.between(ON_THE_WAY));
        let grasp = self.approach_before(at)?;
        // The path of an object that another hand has brought does not begin at its start.
        let passed = self.script.steps[..at].iter().any(|step| matches!(step.goal, Goal::Wait(_)));
        let (_, approach) = self.script.approach(Some(grasp + 1))?;
        let from = self.object(&approach.grip)?.position.map(|part| part.0);
        let to = bring.to.map(|part| part.0);
        let part = |axis: usize| from[axis] + (to[axis] - from[axis]) * share;
        let to = [part(0), part(1), to[2]].map(Quantity);
        (moves && !passed).then_some(Goal::Bring(Bring { to, ..bring }))
    }

    /// An offset of a grip at which the fingers close on nothing, m: above the object, or beside it, perpendicular to the closing direction.
    fn clear_of_object(&mut self, grip: &str, above: bool) -> Option<[f64; 3]> {
        let clear = self.between(CLEAR_M);
        let right = self.script.chance.share() < 0.5;
        let [low, high] = corners(self.object(grip)?)?;
        let grip = self.script.operator.grips.get(grip)?;
        let tip_radius = self.scene.hands.get(&self.side)?.tip_radius.0;
        let at = |finger: &[_; 3]| Vector3::from(finger.map(|part: teachtree_base::quantity::Length| part.0));
        let thumb = at(grip.contacts.get(&Finger::Thumb)?);
        let others = grip.contacts.iter().filter(|(finger, _)| **finger != Finger::Thumb).map(|(_, point)| at(point));
        let opposing = others.sum::<Vector3<f64>>() / grip.contacts.len().saturating_sub(1).max(1) as f64;
        let closing = opposing - thumb;
        let across = Vector3::new(-closing.y, closing.x, 0.0).try_normalize(1e-6)?;
        let spread = |along: Vector3<f64>| grip.contacts.values().map(move |point| at(point).dot(&along));
        if above {
            let lowest = spread(Vector3::z()).fold(f64::INFINITY, f64::min);
            return Some([0.0, 0.0, high.z - lowest + tip_radius + clear]);
        }
        let widest = spread(across).map(f64::abs).fold(0.0, f64::max);
        let half = low.coords.abs().sup(&high.coords.abs());
        let distance = half.dot(&across.abs()) + widest + tip_radius + clear;
        Some((across * if right { distance } else { -distance }).into())
    }

    /// The socket of this name.
    fn socket(&self, name: &str) -> Option<&Socket> {
        self.scene.bodies.values().find_map(|body| body.sockets.get(name))
    }

    /// A random number between these two, log-uniform.
    fn between(&mut self, ends: [f64; 2]) -> f64 {
        self.script.chance.between(ends)
    }
}
