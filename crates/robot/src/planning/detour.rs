//! Leads the approach and the retreat of a hand past the other hand: a robot's hands are wider than an operator's fingertips and need more room.

use super::lift_over::{MOST_M, STEP_M, eased};
use super::rollout::{Occupied, Rollout};
use super::schedule::HandPlans;
use crate::kinematics::arm_distance::PlacedShape;
use nalgebra::Vector3;
use std::collections::BTreeMap;
use teachtree_base::pose::pose_from_array;
use teachtree_command::Task;

/// The direction in which a path is led aside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Aside {
    /// Horizontally away from the other palm.
    Level,
    /// Away from the other palm and upward, by 45°.
    Upward,
}

/// Two hands with their plans.
pub(super) struct Passing<'p, 't> {
    pub(super) rollouts: [&'p Rollout; 2],
    pub(super) plans: [&'p HandPlans<'t>; 2],
    /// Upward unit vector, reference frame; zero without gravity.
    pub(super) up: Vector3<f64>,
}

/// The displacement of a segment: its direction, reference frame, and its length at each sample, m.
struct Needed {
    aside: Vector3<f64>,
    by: Vec<f64>,
}

impl Passing<'_, '_> {
    /// Returns a task with the paths to and from a grasp led aside where they come too near to the other hand or its arm; `None` if they do not.
    pub(super) fn led_past(&self, hand: usize, task: &Task, at: (usize, usize), aside: Aside) -> Option<Task> {
        let needed = self.needed(hand, task, at, aside);
        let mut task = task.clone();
        let mut changed = false;
        let mut segment = 0;
        while segment < task.segments.len() {
            let leaves = task.segments[segment].touching;
            let goes_on =
                |at: &usize| needed.contains_key(at) && (*at == segment || !leaves && !task.segments[*at].touching);
            let way = segment..(segment..).find(|at| !goes_on(at)).unwrap_or(segment);
            segment = way.end.max(segment + 1);
            let Some(aside) = needed.get(&way.start).map(|first| first.aside) else { continue };
            let mut by: Vec<f64> = way.clone().filter_map(|at| needed.get(&at)).flat_map(|it| it.by.clone()).collect();
            if by.iter().all(|by| *by == 0.0) {
                continue;
            }
            let segments = &mut task.segments[way];
            let takes_s: f64 = segments.iter().map(|segment| segment.duration_s).sum();
            let step_s = takes_s / by.len().saturating_sub(1).max(1) as f64;
            if leaves {
                by.reverse();
            }
            by = eased(&by, step_s);
            if leaves {
                by.reverse();
            }
            let samples = segments.iter_mut().flat_map(|segment| segment.hand.iter_mut().zip(&segment.object));
            for ((hand, object), by) in samples.zip(by) {
                let off = pose_from_array(object).inverse_transform_vector(&(aside * by));
                *hand = (Vector3::from(*hand) + off).into();
            }
            changed = true;
        }
        changed.then_some(task)
    }

    /// Returns the displacement of each segment on the paths to and from a grasp.
    fn needed(
        &self,
        hand: usize,
        task: &Task,
        (number, grasp): (usize, usize),
        aside: Aside,
    ) -> BTreeMap<usize, Needed> {
        let model = &self.rollouts[hand].planner.hand;
        let mut needed: BTreeMap<usize, Needed> = BTreeMap::new();
        let mut before: Option<(usize, usize)> = None;
        // A whole path is displaced in one direction.
        let mut direction: Option<Vector3<f64>> = None;
        for steps in self.rollouts[0].together(self.rollouts[1]) {
            let [own, other] = [hand, 1 - hand].map(|hand| self.plans[hand].at(self.rollouts[hand].own_s(steps[hand])));
            let (Some((of, plan, own_s)), Some((_, other, other_s))) = (own, other) else { continue };
            let on_way = plan.on_way(own_s).filter(|_| of == number);
            let on_way = on_way.filter(|(at, _)| task.segments[*at].grasp == Some(grasp));
            let Some((at, share)) = on_way else {
                (before, direction) = (None, None);
                continue;
            };
            let target = plan.at(own_s);
            let ours = target.shapes(model);
            let samples = task.segments[at].hand.len();
            let aside = direction.get_or_insert_with(|| {
                let off = target.palm.translation.vector - other.at(other_s).palm.translation.vector;
                let level = (off - self.up * off.dot(&self.up)).try_normalize(1e-6).unwrap_or(self.up);
                if aside == Aside::Level { level } else { (level + self.up).normalize() }
            });
            let Needed { by, .. } =
                needed.entry(at).or_insert_with(|| Needed { aside: *aside, by: vec![0.0; samples] });
            let theirs = self.rollouts[1 - hand].at(steps[1 - hand]);
            let far = clear_by(&ours, theirs, aside);
            let sample = (share * samples.saturating_sub(1) as f64).round() as usize;
            let from = before.filter(|(segment, _)| *segment == at).map_or(sample, |(_, from)| from.min(sample));
            by.iter_mut().take(sample + 1).skip(from).for_each(|by| *by = by.max(far));
            before = Some((at, sample));
        }
        needed
    }
}

/// Returns the distance by which a hand must be moved to be clear of the other one, m; 0 if no distance suffices.
fn clear_by(ours: &[PlacedShape], theirs: &Occupied, aside: &Vector3<f64>) -> f64 {
    let steps = (0..=(MOST_M / STEP_M) as usize).map(|step| step as f64 * STEP_M);
    { steps }.find(|by| theirs.leaves_room(ours, &(aside * *by))).unwrap_or(0.0)
}
