//! Turns commands and a mapped grasp into targets of palm and fingertips at each instant of a task.
//!
//! While the object is touched, the palm moves with the object, at the pose of the grasp. Before and after, it follows the middle of the operator's fingertips, with
//! the orientation of the grasp. Fingers close and open along the contact normals with minimum jerk. A task begins with a path from the current palm pose. If the
//! object is not at its demonstrated pose, all motions are relative to the object until the first carrying segment has brought it onto the demonstrated path.

mod forces;
mod lift;
pub(super) mod pace;
pub(super) mod segments;
mod target;

pub use self::forces::PlannedForce;
pub(super) use self::target::FingerPostures;
pub use self::target::Target;

use self::segments::{
    SHORTEST_S, arch, ends_s, fade_time, falls, gone, is_brought, is_carried_later, is_near, precedence_s,
    transfer_time,
};
use super::interpolation::{gentle_s, pose_at, screw_motion, share_of, vector_at, way_of};
use super::resolved_grasp::ResolvedGrasp;
use super::time_scale::Part;
use crate::model::hand::HandModel;
use crate::model::robot::Robot;
use nalgebra::{Isometry3, Point3, Translation3, Vector3};
use teachtree_base::easing::minimum_jerk;
use teachtree_base::hands::Finger;
use teachtree_base::meaning::Meaning;
use teachtree_base::pose::{pose_from_array, slerp};
use teachtree_base::short_number::ShortNumber;
use teachtree_command::{Precedence, Segment, Task};

/// Time in which fingers open, s; shorter where the object is to fall from between them, and not along them.
const OPENING_S: f64 = 0.4;
const DROPPING_S: f64 = 0.15;
/// Minimum duration of closing and squeezing together, s.
const CLOSING_S: f64 = 0.9;
/// Minimum duration of a release with its retreat, s.
const LEAVING_S: f64 = 1.0;
/// Time for which an object rests before an insertion or an intended fall, s.
const STEADIES_S: f64 = 1.0;
/// Largest speed of an insertion into a socket, m/s: hasty operators' hands give way where a robot's jam.
const INSERTS_M_S: f64 = 0.04;
/// Largest acceleration of an object that hangs between two tips, m/s²: it would swing as on a hinge.
const HINGED_M_S2: f64 = 1.5;
/// Largest acceleration of an object between two flat pads, m/s²: it would slip.
const PINCHED_M_S2: f64 = 5.0;
/// Interval at which speeds are checked, s; the largest factor by which a phase is stretched.
const WATCHED_S: f64 = 0.02;
const MOST_STRETCHED: f64 = 20.0;
/// Twice the time between samples of commands, s.
const SAMPLE_S: f64 = 0.02;
/// Largest step of the palm from one phase to the next without a path between them, m and rad.
const JUMP: (f64, f64) = (0.003, 0.05);

/// Time in which fingers change to the shape of the next task's grasp, s.
const RESHAPING_S: f64 = 0.8;

/// Maximum duration of a task, s.
const LONGEST_S: f64 = 600.0;

/// The displacement of an object from its demonstrated pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectOffset {
    /// From the demonstrated pose to the actual one, reference frame.
    pub off: Isometry3<f64>,
    /// The time at which another task has brought it onto the demonstrated path, s of the recording; infinite without one.
    pub until_s: f64,
    /// The demonstrated pose in which a hand first touches it, reference frame, and the time of that touch, s of the recording; minus infinity without one. Until then
    /// it stands there: the robot does not nudge the object on the way to it, as an operator may.
    pub stands: (Isometry3<f64>, f64),
}

/// The plan of a task.
pub struct Plan<'a> {
    task: &'a Task,
    phases: Vec<Phase<'a>>,
    grips: Vec<ResolvedGrasp>,
    from: Isometry3<f64>,
    transfer: f64,
    /// The fingers at the beginning of the path to the task; empty if they begin as in its first grasp.
    pub(super) before: FingerPostures,
    /// Displacement of the middle of the path to the task, reference frame, m.
    lifted: Vector3<f64>,
    /// Intervals (s of the recording) in which another hand inserts something into the object.
    insertions: Vec<[f64; 2]>,
}

#[derive(Clone, Copy)]
struct Phase<'a> {
    segment: &'a Segment,
    grip: usize,
    role: Role,
    start: f64,
    duration: f64,
    /// The displacement of the object from its commanded pose, and the share by which it has faded at the beginning and at the end, 0 to 1.
    anchor: Isometry3<f64>,
    faded: [f64; 2],
    /// Start and end in the recording, s; equal for a part that was not demonstrated.
    demonstrated: [f64; 2],
    /// The pose of the object before its first touch, and the share of the segment at which that touch begins.
    stands: Option<(Isometry3<f64>, f64)>,
    /// Displacement of the middle of a path that was not demonstrated, reference frame, m.
    lifted: Vector3<f64>,
}

impl<'a> Phase<'a> {
    /// Returns a phase for an object at its demonstrated pose.
    fn new(segment: &'a Segment, role: Role, start: f64, duration: f64, demonstrated: [f64; 2]) -> Self {
        let grip = segment.grasp.unwrap_or(0);
        let (anchor, lifted) = (Isometry3::identity(), Vector3::zeros());
        Self { segment, grip, role, start, duration, anchor, faded: [0.0; 2], demonstrated, stands: None, lifted }
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Role {
    Free,
    Close,
    Hold,
    /// The object stays at its pose at the beginning of the segment.
    Steady,
    Leave,
    /// The path from one grasp to the next, which was not demonstrated.
    Over,
}

impl<'a> Plan<'a> {
    /// Plans a task whose object is at `found`. `palm` is the current palm pose; without it, the plan starts at the task's first pose. `insertions` are the
    /// intervals (s of the recording) in which other hands insert something into the object.
    ///
    /// # Errors
    /// A grasp that was not mapped; a task without segments.
    pub fn new(
        task: &'a Task,
        limb: &Robot,
        hand: &HandModel,
        found: ObjectOffset,
        insertions: Vec<[f64; 2]>,
        palm: Option<&Isometry3<f64>>,
        tip_radius: f64,
    ) -> Result<Self, String> {
        let mut grips = Vec::new();
        for grasp in &task.grasps {
            grips.push(ResolvedGrasp::new(grasp, limb, hand, tip_radius)?);
        }
        if grips.is_empty() {
            return Err("has nothing that is touched".into());
        }
        if task.segments.is_empty() {
            return Err("has no segments".into());
        }
        let mut plan = Self {
            task,
            phases: Vec::new(),
            grips,
            from: Isometry3::identity(),
            transfer: 0.0,
            before: FingerPostures::new(),
            lifted: Vector3::zeros(),
            insertions,
        };
        let mut clock = 0.0;
        let mut anchor = found.off;
        // The time for which the hand has held the object since it began to bring it onto the demonstrated path, and the time that this takes, s.
        let mut fading: Option<(f64, f64)> = None;
        for (index, segment) in task.segments.iter().enumerate() {
            let begins = segment.demonstrated_start_s;
            let ends = ends_s(&task.segments, index);
            // After another task has brought the object onto the demonstrated path, the hand approaches it there.
            let touch = task.segments[index..].iter().find(|segment| segment.touching).unwrap_or(segment);
            if touch.demonstrated_start_s > found.until_s - SAMPLE_S {
                anchor = Isometry3::identity();
            }
            let role = match (segment.touching, segment.does) {
                (false, _) => Role::Free,
                (true, Meaning::Close) if !segments::holds_on(&task.segments, index) => Role::Close,
                (true, Meaning::Open) => Role::Leave,
                (true, _) => Role::Hold,
            };
            // A push without a grasp closes on the path, as a touch before the push.
            let first_touch = segment.touching && index > 0 && !task.segments[index - 1].touching;
            if first_touch && role == Role::Hold {
                let closing = Phase::new(segment, Role::Close, clock, CLOSING_S, [begins; 2]);
                plan.phases.push(Phase { anchor, ..closing });
                clock += CLOSING_S;
            }
            let least = match role {
                Role::Close => CLOSING_S,
                Role::Leave => LEAVING_S,
                _ => SHORTEST_S,
            };
            let grip = segment.grasp.unwrap_or(0);
            let inserts = role == Role::Hold && segment.does == Meaning::Insert;
            let drops =
                role == Role::Leave && falls(segment) && index > 0 && task.segments[index - 1].does == Meaning::Carry;
            if inserts || drops {
                let steadying = Phase::new(segment, Role::Steady, clock, STEADIES_S, [begins; 2]);
                plan.phases.push(Phase { anchor, ..steadying });
                clock += STEADIES_S;
            }
            let slow = if inserts { 2.0 * way_of(&segment.object) / INSERTS_M_S } else { 0.0 };
            // An object that is not at its demonstrated pose waits for that.
            let brings = role == Role::Close && is_brought(segment) && is_near(&anchor);
            let pinched = (role == Role::Hold || brings) && plan.grips.get(grip).is_some_and(ResolvedGrasp::is_pinch);
            let most_m_s2 = if hand.has_flat_pads() { PINCHED_M_S2 } else { HINGED_M_S2 };
            let gently = if pinched { gentle_s(&segment.object, segment.duration_s, most_m_s2) } else { 0.0 };
            let mut duration = segment.duration_s.max(least).max(slow).max(gently);
            let mut demonstrated = match segment.precedence {
                Some(precedence) => [precedence_s(&task.segments, index, precedence); 2],
                None => [begins, ends],
            };
            // Motion of the object during the closing is executed after the closing.
            let bring = brings.then_some(duration);
            if bring.is_some() {
                (duration, demonstrated) = (CLOSING_S, [begins; 2]);
            }
            if let Some((since_s, whole_s)) = fading.take_if(|_| role != Role::Hold) {
                anchor = share_of(&anchor, 1.0 - minimum_jerk(since_s / whole_s));
            }
            let mut faded = [0.0; 2];
            let later = fading.is_none() && is_carried_later(&task.segments[index..]);
            if role == Role::Hold && !later {
                let (since_s, whole_s) =
                    *fading.get_or_insert_with(|| (0.0, fade_time(&task.segments[index..], &anchor)));
                faded = [since_s, since_s + duration].map(|time| time / whole_s);
                fading = (faded[1] < 1.0).then_some((since_s + duration, whole_s));
            }
            let (stands, touched_s) = found.stands;
            let stands = (begins < touched_s).then(|| (stands, (touched_s - begins) / (ends - begins)));
            let phase = Phase::new(segment, role, clock, duration, demonstrated);
            plan.phases.push(Phase { anchor, faded, stands, ..phase });
            clock += duration;
            if let Some(duration) = bring {
                let bringing = Phase::new(segment, Role::Hold, clock, duration, [begins, ends]);
                plan.phases.push(Phase { anchor, ..bringing });
                clock += duration;
                continue;
            }
            match role {
                Role::Hold if fading.is_none() && !later => anchor = Isometry3::identity(),
                // The object stays while the hand closes; its motion during the demonstrated grasp is made up for later.
                Role::Close => {
                    if let (Some(first), Some(last)) = (segment.object.first(), segment.object.last()) {
                        anchor = anchor * pose_from_array(first) * pose_from_array(last).inverse();
                    }
                }
                _ => {}
            }
        }
        plan.go_over();
        let first = plan.shown(0.0).palm;
        plan.from = palm.copied().unwrap_or(first);
        if palm.is_some() {
            let way = (first.translation.vector - plan.from.translation.vector).norm();
            let turn = first.rotation.angle_to(&plan.from.rotation);
            plan.transfer = transfer_time(way, turn);
        }
        // Written so that a NaN length is refused too.
        let duration = plan.duration();
        if duration <= LONGEST_S {
            Ok(plan)
        } else {
            Err(format!("takes {:.0} s, expected at most {LONGEST_S} s", ShortNumber(duration)))
        }
    }

    /// Inserts a path between phases of a free hand where the palm would jump: from one grasp to the next.
    fn go_over(&mut self) {
        let free = |role: Role| matches!(role, Role::Free | Role::Leave);
        let mut index = 1;
        while index < self.phases.len() {
            let [before, after] = [index - 1, index];
            let may = free(self.phases[before].role) && matches!(self.phases[after].role, Role::Free | Role::Close);
            let from = self.in_phase(before, self.phases[before].duration).palm;
            let to = self.in_phase(after, 0.0).palm;
            let way = (to.translation.vector - from.translation.vector).norm();
            let turn = to.rotation.angle_to(&from.rotation);
            if may && (way > JUMP.0 || turn > JUMP.1) {
                let duration = transfer_time(way, turn);
                let Phase { segment, start, anchor, stands, .. } = self.phases[after];
                let (mut from_s, mut to_s) = (self.phases[before].demonstrated[1], self.phases[after].demonstrated[0]);
                // It is executed with the path before or after it, if that has precedence.
                match (self.phases[before].segment.precedence, self.phases[after].segment.precedence) {
                    (Some(Precedence::First), _) => to_s = from_s,
                    (_, Some(Precedence::Last)) => from_s = to_s,
                    _ => {}
                }
                let demonstrated = [from_s, to_s];
                let over = Phase::new(segment, Role::Over, start, duration, demonstrated);
                let over = Phase { anchor, stands, ..over };
                self.phases[after..].iter_mut().for_each(|phase| phase.start += duration);
                self.phases.insert(after, over);
                index += 1;
            }
            index += 1;
        }
    }

    /// Stretches each phase from a time on until the arm can follow. `too_fast` returns for consecutive palm poses the factor by which the arm would exceed its speed from
    /// the previous one, within a time, s. Returns the stretched time, s.
    pub fn slow_down(&mut self, from_s: f64, too_fast: &mut dyn FnMut(&Isometry3<f64>, f64) -> f64) -> f64 {
        let mut stretched = vec![1.0_f64; self.phases.len()];
        let mut transfer = 1.0_f64;
        let steps = ((self.duration() - from_s) / WATCHED_S).floor() as usize;
        for step in 0..=steps {
            let time = from_s + step as f64 * WATCHED_S;
            let much = too_fast(&self.at(time).palm, WATCHED_S).clamp(1.0, MOST_STRETCHED);
            // The first pose is the current one of the arm.
            match (step, time < self.transfer) {
                (0, _) => {}
                (_, true) => transfer = transfer.max(much),
                (_, false) => {
                    let at = self.index_at(time - self.transfer);
                    stretched[at] = stretched[at].max(much);
                }
            }
        }
        let begins = self.index_at(from_s - self.transfer);
        let into = ((from_s - self.transfer - self.phases[begins].start) / self.phases[begins].duration).max(0.0);
        let mut clock = 0.0;
        for (phase, much) in self.phases.iter_mut().zip(stretched) {
            phase.start = clock;
            phase.duration *= much;
            clock += phase.duration;
        }
        let transfers = from_s < self.transfer;
        self.transfer *= transfer;
        if transfers { from_s } else { self.transfer + self.phases[begins].start + into * self.phases[begins].duration }
    }

    fn index_at(&self, time: f64) -> usize {
        self.phases.partition_point(|phase| phase.start <= time).saturating_sub(1)
    }

    /// Returns its duration, s.
    pub fn duration(&self) -> f64 {
        self.transfer + self.phases.last().map_or(0.0, |phase| phase.start + phase.duration)
    }

    /// Returns the times of the first touch and of the last release, s.
    pub fn touches(&self) -> (f64, f64) {
        let touching = || self.phases.iter().filter(|phase| !matches!(phase.role, Role::Free | Role::Over));
        let first = touching().next().map_or(0.0, |phase| phase.start);
        let mut holding = touching().filter(|phase| phase.role != Role::Leave);
        let last = holding.next_back().map_or(first, |phase| phase.start + phase.duration + OPENING_S);
        (self.transfer + first, self.transfer + last)
    }

    /// Returns its parts with their demonstrated times, in order.
    pub fn parts(&self) -> Vec<Part> {
        let begins = self.phases.first().map_or(0.0, |phase| phase.demonstrated[0]);
        let transfer = Part { demonstrated: [begins; 2], needs_s: self.transfer };
        let phases = self.phases.iter().map(|phase| Part { demonstrated: phase.demonstrated, needs_s: phase.duration });
        std::iter::once(transfer).chain(phases).collect()
    }

    /// Returns the primitive at a time, s, with its action. The path to the task has those of the operator's approach.
    pub fn primitive(&self, time: f64) -> (&'a str, Meaning) {
        if time < self.transfer {
            let came = self.task.segments.iter().find(|segment| segment.does == Meaning::Free);
            return (came.map_or(Meaning::Free.name(), |segment| &segment.primitive), Meaning::Free);
        }
        let segment = self.phases[self.index_at(time - self.transfer)].segment;
        (&segment.primitive, segment.does)
    }

    /// The grasp at a time, s.
    pub(super) fn grasp(&self, time: f64) -> usize {
        self.phases[self.index_at(time - self.transfer)].grip.min(self.grips.len() - 1)
    }

    /// Returns the position at a time, s, on a free path of its commands: the segment and the share of it, 0 to 1; `None` during a touch, or on a path that was not
    /// demonstrated.
    pub(in crate::planning) fn on_way(&self, time: f64) -> Option<(usize, f64)> {
        let local = time - self.transfer;
        let phase = &self.phases[self.index_at(local)];
        let since_s = (local - phase.start).clamp(0.0, phase.duration);
        let share = match phase.role {
            Role::Free if local >= 0.0 => since_s / phase.duration,
            Role::Leave => gone(since_s, phase.duration),
            _ => return None,
        };
        let segment = self.task.segments.iter().position(|segment| std::ptr::eq(segment, phase.segment))?;
        Some((segment, share))
    }

    /// Whether the hand is open and away from its contacts at a time, s: approaching or retreating.
    pub(in crate::planning) fn is_away(&self, time: f64) -> bool {
        let local = time - self.transfer;
        let phase = &self.phases[self.index_at(local)];
        let leaves = phase.role == Role::Leave && gone(local - phase.start, phase.duration) > 0.0;
        local < 0.0 || matches!(phase.role, Role::Free | Role::Over) || leaves
    }

    /// Whether the hand holds the object at a time, s: it has closed, and has not released.
    pub(in crate::planning) fn holds(&self, time: f64) -> bool {
        matches!(self.phases[self.index_at(time - self.transfer)].role, Role::Hold | Role::Steady)
    }

    /// Returns the share of its target pose at a time (s) that is relative to the body with the hole of the object: 0 far from it, 1 from just above it on.
    pub fn leans(&self, time: f64) -> f64 {
        let Some(over) = self.phases.iter().position(|phase| phase.role == Role::Steady) else { return 0.0 };
        let (from, to) = (self.phases[over.saturating_sub(1)].start, self.phases[over].start);
        minimum_jerk((time - self.transfer - from) / (to - from).max(SHORTEST_S))
    }

    /// The posture of the arm in the commands, as degrees of freedom and their values; empty without one.
    pub(super) fn arm(&self) -> &[(usize, f64)] {
        self.grips.first().map_or(&[], |grip| &grip.arm)
    }

    /// Returns the demonstrated final pose of the object.
    pub fn demonstrated_end(&self) -> Isometry3<f64> {
        let last = self.task.segments.last().and_then(|segment| segment.object.last());
        last.map_or_else(Isometry3::identity, pose_from_array)
    }

    /// Returns the target at a time, s.
    pub fn at(&self, time: f64) -> Target {
        if time >= self.transfer {
            return self.shown(time - self.transfer);
        }
        let share = minimum_jerk(time / self.transfer);
        let first = self.shown(0.0);
        let place = self.from.translation.vector.lerp(&first.palm.translation.vector, share);
        let palm = Isometry3::from_parts(
            Translation3::from(place + self.lifted * arch(share)),
            slerp(&self.from.rotation, &first.palm.rotation, share),
        );
        // In the middle of the path, where it is lifted, the fingers have room to change to the next grasp.
        let takes_s = RESHAPING_S.min(self.transfer);
        let shaped = minimum_jerk((time - (self.transfer - takes_s) / 2.0) / takes_s);
        let before = |finger: Finger| self.before.iter().find(|(which, ..)| *which == finger);
        let tips = first.tips.iter().map(|(finger, tip, force)| {
            let to = first.palm.inverse_transform_point(tip);
            let from = before(*finger).map_or(to, |(.., tip)| *tip);
            (*finger, palm * (from + (to - from) * shaped), *force)
        });
        let idle = first.idle.iter().map(|(finger, to)| {
            let mut angles = before(*finger).map_or(*to, |(_, angles, _)| *angles);
            angles.iter_mut().zip(to).for_each(|(angle, to)| *angle += (to - *angle) * shaped);
            (*finger, angles)
        });
        let (tips, idle) = (tips.collect(), idle.collect());
        Target { palm, tips, idle, object: first.object, free: false, pushed: false }
    }

    /// Returns the commanded target at a time after the beginning of the commands.
    fn shown(&self, time: f64) -> Target {
        let index = self.index_at(time);
        self.in_phase(index, time - self.phases[index].start)
    }

    /// Returns a target between the previous and the next phase: a screw motion of the palm about the object, so that a hand moves around an object that it turned.
    fn over(&self, index: usize, share: f64) -> Target {
        let before = self.in_phase(index - 1, self.phases[index - 1].duration);
        let after = self.in_phase(index + 1, 0.0);
        let share = minimum_jerk(share);
        let palm = before.palm * screw_motion(&(before.palm.inverse() * after.palm), share);
        let palm = Translation3::from(self.phases[index].lifted * arch(share)) * palm;
        let tips = after.tips.iter().map(|(finger, to, _)| {
            let to = after.palm.inverse_transform_point(to);
            let from = before.tips.iter().find(|(other, ..)| other == finger);
            let from = from.map_or(to, |(_, from, _)| before.palm.inverse_transform_point(from));
            (*finger, palm * (from + (to - from) * share), Vector3::zeros())
        });
        Target {
            palm,
            tips: tips.collect(),
            idle: after.idle.clone(),
            object: after.object,
            free: false,
            pushed: false,
        }
    }

    /// Returns the commanded target at a time after the beginning of a phase.
    fn in_phase(&self, index: usize, local: f64) -> Target {
        let phase = &self.phases[index];
        if phase.role == Role::Over {
            return self.over(index, local / phase.duration);
        }
        let (segment, grip) = (phase.segment, &self.grips[phase.grip.min(self.grips.len() - 1)]);
        let local = local.clamp(0.0, phase.duration);
        let share = self.share(phase, local);
        let falls = phase.role == Role::Leave && falls(segment);
        let at = if falls || matches!(phase.role, Role::Close | Role::Steady) { 0.0 } else { share };
        let faded = phase.faded[0] + (phase.faded[1] - phase.faded[0]) * share;
        let anchor = share_of(&phase.anchor, 1.0 - minimum_jerk(faded));
        let stands = phase.stands.filter(|(_, until)| at < *until).map(|(pose, _)| pose);
        let object = anchor * stands.unwrap_or_else(|| pose_at(&segment.object, at));
        let closing = phase.duration / 2.0;
        let (mut offset, opened, force): (Vector3<f64>, f64, f64) = match phase.role {
            Role::Free => {
                let last = segment.hand.last().map_or_else(Vector3::zeros, |it| Vector3::from(*it)) - grip.middle;
                let to_touch = self.leads_to_touch(phase);
                // The end of the path is exactly over the contacts.
                let over = if to_touch { last * minimum_jerk((share - 0.5) / 0.5) } else { Vector3::zeros() };
                (vector_at(&segment.hand, share) - grip.middle - over, 1.0, 0.0)
            }
            Role::Close => {
                (Vector3::zeros(), 1.0 - minimum_jerk(local / closing), minimum_jerk((local - closing) / closing))
            }
            Role::Hold | Role::Steady | Role::Over => (Vector3::zeros(), 0.0, 1.0),
            Role::Leave => {
                let away = gone(local, phase.duration);
                let first = segment.hand.first().map_or_else(Vector3::zeros, |it| Vector3::from(*it));
                let drops = index > 0 && self.phases[index - 1].role == Role::Steady;
                let opening_s = if drops { DROPPING_S } else { OPENING_S };
                let fading = 1.0 - minimum_jerk(local / (0.4 * opening_s));
                let mut hand = vector_at(&segment.hand, away);
                if falls {
                    // The path of the hand is relative to the object, which falls away from it.
                    let fallen = pose_at(&segment.object, 0.0).inverse() * pose_at(&segment.object, away);
                    hand = (fallen * Point3::from(hand)).coords;
                }
                (hand - first, minimum_jerk(local / opening_s), fading)
            }
        };
        if !offset.iter().all(|part| part.is_finite()) {
            offset = Vector3::zeros();
        }
        let palm = object * Translation3::from(offset) * grip.object_from_palm;
        let tips = grip.tips.iter().map(|(finger, closed, open)| {
            let wanted = self.commanded_force(index, at, *finger);
            (*finger, palm * (closed + (open - closed) * opened), object.rotation * wanted * force)
        });
        let pushes = grip.tips.iter().all(|(finger, ..)| *finger != Finger::Thumb);
        let pushed = matches!(phase.role, Role::Hold | Role::Leave) && pushes;
        let free = match phase.role {
            Role::Steady => true,
            Role::Hold if pushes => segment.does.pushes(),
            Role::Hold => segment.does == Meaning::Carry,
            _ => false,
        };
        Target { palm, tips: tips.collect(), idle: grip.idle.clone(), object, free, pushed }
    }

    /// Whether the hand touches the object after this phase.
    fn leads_to_touch(&self, phase: &Phase<'_>) -> bool {
        let next = self.phases.iter().find(|other| other.start > phase.start && other.role != Role::Over);
        next.is_some_and(|next| next.segment.touching)
    }
}
