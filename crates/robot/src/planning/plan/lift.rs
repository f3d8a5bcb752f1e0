//! Lifts paths that were not demonstrated, to a task and from one grasp to the next, over the shapes that the hand would go through.

use super::segments::TRANSFER_M_S;
use super::{Plan, Role};
use crate::kinematics::arm_distance::PlacedShape;
use crate::kinematics::arm_ik::Arm;
use crate::kinematics::surroundings::Surroundings;
use crate::model::hand::HandModel;
use nalgebra::{Isometry3, Vector3};
use teachtree_description::shape::CollisionShape;

/// A path that was not demonstrated is checked in `PARTS` parts, and lifted in multiples of `LIFT_M`, m, at most `LIFTS` times.
const PARTS: usize = 24;
const LIFT_M: f64 = 0.02;
const LIFTS: u32 = 15;
/// Number of starts of the inverse kinematics, and iterations of each, that decide whether an arm reaches such a path.
const REACHED_FROM: (usize, usize) = (16, 60);

impl Plan<'_> {
    /// Lifts the paths that were not demonstrated, to the task and from one grasp to the next, until the hand is clear of all shapes, or else if that at least
    /// halves the number of places at which it meets one. `up` is a unit vector, reference frame; no path is lifted out of the reach of an arm.
    pub(in crate::planning) fn lift(
        &mut self,
        hand: &HandModel,
        up: &Vector3<f64>,
        surroundings: &Surroundings,
        arm: Option<&Arm<'_>>,
    ) {
        let over = (0..self.phases.len()).filter(|index| self.phases[*index].role == Role::Over);
        let ways = over.map(Some).chain((self.transfer > 0.0).then_some(None));
        for way in ways.collect::<Vec<Option<usize>>>() {
            let (from_s, takes_s) = match way {
                Some(index) => (self.transfer + self.phases[index].start, self.phases[index].duration),
                None => (0.0, self.transfer),
            };
            let times: Vec<f64> = (1..PARTS).map(|at| from_s + takes_s * at as f64 / PARTS as f64).collect();
            let shapes = |time: &f64| {
                let target = self.at(*time);
                hand.solids(|finger| target.angles(finger))
            };
            let hands: Vec<Vec<CollisionShape>> = times.iter().map(shapes).collect();
            let palms = |plan: &Self| -> Vec<Isometry3<f64>> { times.iter().map(|time| plan.at(*time).palm).collect() };
            let met = |palms: &[Isometry3<f64>]| {
                let meets = |(palm, hand_shapes): &(&Isometry3<f64>, &Vec<CollisionShape>)| {
                    let placed = hand_shapes.iter().map(|solid| PlacedShape::new(hand.palm, solid.moved(palm)));
                    surroundings.meet_any(&placed.collect::<Vec<PlacedShape>>())
                };
                palms.iter().zip(&hands).filter(meets).count()
            };
            let straight = met(&palms(self));
            let (mut least, mut height) = (straight.div_ceil(2), 0.0);
            for step in (1..=LIFTS).take_while(|_| straight > 0) {
                *self.lifted(way) = up * (f64::from(step) * LIFT_M);
                let palms = palms(self);
                let met = met(&palms);
                if met < least && arm.is_none_or(|arm| reaches(arm, &palms)) {
                    (least, height) = (met, f64::from(step) * LIFT_M);
                }
                if least == 0 {
                    break;
                }
            }
            *self.lifted(way) = up * height;
            let longer = 2.0 * height / TRANSFER_M_S;
            match way {
                None => self.transfer += longer,
                Some(index) => {
                    self.phases[index].duration += longer;
                    self.phases[index + 1..].iter_mut().for_each(|phase| phase.start += longer);
                }
            }
        }
    }

    /// The lift of a phase, or of the path to the task.
    fn lifted(&mut self, way: Option<usize>) -> &mut Vector3<f64> {
        match way {
            Some(index) => &mut self.phases[index].lifted,
            None => &mut self.lifted,
        }
    }
}

/// Whether an arm can move its palm along a path.
fn reaches(arm: &Arm<'_>, palms: &[Isometry3<f64>]) -> bool {
    let (root, q) = (Isometry3::identity(), vec![0.0; arm.tree.dofs.len()]);
    arm.postures_along(&root, palms, &q, REACHED_FROM, &Surroundings::default()).next().is_some()
}
