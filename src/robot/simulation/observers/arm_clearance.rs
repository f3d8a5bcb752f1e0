//! How near the robot's two arms pass each other. Nothing keeps them apart in the simulation, so a collision of the arms is reported.

use crate::description::shape::SHORT_M;
use crate::robot::control::executor::Executor;
use crate::robot::kinematics::limb_gap::{PlacedShape, limb_gap, placed};
use crate::robot::simulation::observer::{Observer, Step};

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
        let (one, other) = (&one.executor, &other.executor);
        let so_far = self.nearest.as_ref().map_or(f64::INFINITY, |nearest| nearest.gap);
        if let Some(found) = limb_gap(&shapes(one), &shapes(other), so_far) {
            let name = |limb: &Executor, link: usize| limb.robot().tree.links[link].name.clone();
            let links = [name(one, found.links[0]), name(other, found.links[1])];
            self.nearest = Some(MinDistance { gap: found.gap, time_s: step.time_s(), links });
        }
    }
}

fn shapes(limb: &Executor) -> Vec<PlacedShape> {
    placed(&limb.robot().tree, limb.poses())
}
