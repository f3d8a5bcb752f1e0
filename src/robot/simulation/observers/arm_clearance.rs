//! How near the robot's two arms pass each other. Nothing keeps them apart in the simulation, so a collision of the arms is reported.
//!
//! Pairs of shapes that cannot be nearer than the nearest so far are passed over, by balls about them.

use crate::description::shape::{CollisionShape, SHORT_M};
use crate::robot::control::executor::Executor;
use crate::robot::simulation::observer::{Observer, Step};
use nalgebra::Point3;

/// Where two arms with their hands came nearest to each other.
#[derive(Clone, Debug, PartialEq)]
pub struct MinDistance {
    /// The gap between them, m; negative, or zero for boxes, when they were in each other.
    pub gap: f64,
    /// When, s since the beginning.
    pub time_s: f64,
    /// The names of the links.
    pub links: [String; 2],
}

impl MinDistance {
    /// Whether they went through each other.
    pub fn passes_through(&self) -> bool {
        self.gap <= SHORT_M
    }
}

/// One step in so many is looked at: 100 a second.
const LOOKED_AT: usize = 10;

/// Where two arms came nearest to each other so far.
#[derive(Clone, Debug, Default)]
pub(in crate::robot::simulation) struct ArmClearance {
    pub(in crate::robot::simulation) nearest: Option<MinDistance>,
}

impl Observer for ArmClearance {
    fn look(&mut self, step: &Step<'_>) {
        let [one, other] = step.hands else { return };
        if !step.in_group.is_multiple_of(LOOKED_AT) {
            return;
        }
        let (one, other, nearest) = (&one.executor, &other.executor, &mut self.nearest);
        let (ours, theirs) = (solids(one), solids(other));
        for (link, solid, (centre, radius)) in &ours {
            for (link_of_other, solid_of_other, (centre_of_other, radius_of_other)) in &theirs {
                let least = (centre - centre_of_other).norm() - radius - radius_of_other;
                if nearest.as_ref().is_some_and(|nearest| least >= nearest.gap) {
                    continue;
                }
                let gap = solid.gap(solid_of_other);
                if nearest.as_ref().is_none_or(|nearest| gap < nearest.gap) {
                    let name = |limb: &Executor, link: usize| limb.robot().tree.links[link].name.clone();
                    let links = [name(one, *link), name(other, *link_of_other)];
                    *nearest = Some(MinDistance { gap, time_s: step.time_s(), links });
                }
            }
        }
    }
}

/// The shapes of a limb where they are, each with its link and a ball about it. The first link is that on which both limbs stand.
fn solids(limb: &Executor) -> Vec<(usize, CollisionShape, (Point3<f64>, f64))> {
    let links = limb.robot().tree.links.iter().zip(limb.poses()).enumerate().skip(1);
    let moved = links.flat_map(|(index, (link, pose))| link.solids.iter().map(move |solid| (index, solid.moved(pose))));
    let with_ball = |(index, solid): (usize, CollisionShape)| (index, solid, solid.bounding_ball());
    moved.map(with_ball).collect()
}
