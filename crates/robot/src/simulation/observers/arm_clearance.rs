//! The minimum distance of the two arms, and collisions of arms and hands. The simulation has no contact forces on links, so collisions are reported.

use crate::control::executor::Executor;
use crate::kinematics::arm_distance::{PlacedShape, arm_distance, placed};
use crate::kinematics::surroundings::{ArmLinks, own_meetings};
use crate::simulation::hand_agent::HandAgent;
use crate::simulation::observer::{Observer, Step};
use crate::simulation::trace::Limb;
use teachtree_base::scene::Scene;
use teachtree_description::shape::{CollisionShape, SHORT_M, solids};
use teachtree_world::STEP_S;

/// Maximum penetration depth of a simulated link, m. A deeper one counts as a collision. A smaller one can result from collision shapes that are larger than
/// their links.
pub const ACCEPTED_M: f64 = 0.003;

/// The minimum distance of two arms with their hands.
#[derive(Clone, Debug, PartialEq)]
pub struct MinDistance {
    /// The signed distance, m; negative for a penetration.
    pub gap: f64,
    /// The time of the minimum, s since the beginning.
    pub time_s: f64,
    /// The names of the links.
    pub links: [String; 2],
}

impl MinDistance {
    /// Returns the penetration depth, m.
    pub fn depth_m(&self) -> f64 {
        depth(self.gap)
    }

    /// Whether the arms collided.
    pub fn passes_through(&self) -> bool {
        self.gap <= SHORT_M
    }
}

/// A collision of a link of an arm or a hand.
#[derive(Clone, Debug, PartialEq)]
pub struct Collision {
    /// The link of the arm.
    pub link: String,
    /// The body or the other link of the arm.
    pub with: String,
    /// The start of the first contact, s since the beginning.
    pub time_s: f64,
    /// Maximum penetration depth, m.
    pub depth_m: f64,
    /// Total duration, s.
    pub lasts_s: f64,
}

/// Returns the penetration depth of shapes with this signed distance, m.
fn depth(gap: f64) -> f64 {
    0.0 - gap.min(0.0)
}

impl Collision {
    fn is_same(&self, other: &Self) -> bool {
        self.link == other.link && self.with == other.with
    }
}

/// Number of steps from one distance measurement to the next.
const LOOKED_AT: usize = 10;

/// The minimum distance of the arms so far, and the collisions of each.
#[derive(Clone, Debug)]
pub(in crate::simulation) struct ArmClearance {
    pub(in crate::simulation) nearest: Option<MinDistance>,
    pub(in crate::simulation) collisions: Vec<Collision>,
    /// Per task, the maximum penetration depth of the links and the minimum distance of the two arms, m.
    deepest: Vec<f64>,
    gaps: Vec<f64>,
    /// The shapes of the bodies of the scene with their names, frames of the bodies.
    bodies: Vec<(String, Vec<CollisionShape>)>,
    /// The links of the arms, in the order of the hands.
    arms: Vec<ArmLinks>,
}

impl ArmClearance {
    pub(super) fn new(scene: &Scene, limbs: &[Limb], tasks: usize) -> Self {
        let bodies = scene.bodies.iter().map(|(name, body)| (name.clone(), solids(body))).collect();
        let links = |limb: &Limb| {
            let hand = limb.robot.hands.get(&limb.side)?;
            let tips: Vec<_> = hand.fingers.iter().map(|finger| (finger.tip_link, finger.tip_in_link)).collect();
            Some(ArmLinks::with_hand(&limb.robot.tree, hand.palm, &tips))
        };
        let (deepest, gaps) = (vec![0.0; tasks], vec![f64::INFINITY; tasks]);
        let arms = limbs.iter().filter_map(links).collect();
        Self { nearest: None, collisions: Vec::new(), deepest, gaps, bodies, arms }
    }

    /// Returns the maximum penetration depth of the links during a task, m: into the scene, their own arm or the other arm.
    pub(in crate::simulation) fn depth_m(&self, task: usize) -> f64 {
        self.deepest[task].max(depth(self.gaps[task]))
    }

    /// Records the current collisions of an arm, except with the body that its hand manipulates.
    fn meetings(&self, arm: usize, step: &Step<'_>) -> Vec<Collision> {
        let hand = &step.hands[arm];
        let Some(links) = self.arms.get(arm) else { return Vec::new() };
        let placed = links.placed(hand.executor.poses());
        let name = |link: usize| hand.executor.robot().tree.links[link].name.clone();
        let of = |link: &PlacedShape, with: String, other: &CollisionShape| Collision {
            link: name(link.link()),
            with,
            time_s: step.time_s(),
            depth_m: depth(link.shape().gap(other)),
            lasts_s: LOOKED_AT as f64 * STEP_S,
        };
        let handled = hand.doing.map(|doing| doing.body);
        let others = self.bodies.iter().enumerate().filter(|(body, _)| Some(*body) != handled);
        let mut met: Vec<Collision> = Vec::new();
        for (body, (other, solids)) in others {
            let pose = &step.seen.bodies[body].pose;
            for solid in solids.iter().map(|solid| solid.moved(pose)) {
                let links = placed.iter().filter(|(_, link)| link.meets(&solid));
                met.extend(links.map(|(_, link)| of(link, other.clone(), &solid)));
            }
        }
        met.extend(own_meetings(&placed).map(|[link, other]| of(link, name(other.link()), other.shape())));
        // One collision covers all shapes of a link.
        met.sort_by(|a, b| (&a.link, &a.with).cmp(&(&b.link, &b.with)).then(b.depth_m.total_cmp(&a.depth_m)));
        met.dedup_by(|a, b| a.is_same(b));
        met
    }
}

impl Observer for ArmClearance {
    fn observe(&mut self, step: &Step<'_>) {
        if !step.in_group.is_multiple_of(LOOKED_AT) {
            return;
        }
        let doing = |hand: &HandAgent<'_>| hand.doing.map(|doing| doing.task);
        let all: Vec<usize> = step.hands.iter().filter_map(doing).collect();
        for arm in 0..self.arms.len() {
            for met in self.meetings(arm, step) {
                // A collision with an idle arm counts for the tasks of the other arm.
                let own = doing(&step.hands[arm]);
                for task in own.as_ref().map_or(all.as_slice(), std::slice::from_ref) {
                    self.deepest[*task] = self.deepest[*task].max(met.depth_m);
                }
                match self.collisions.iter_mut().find(|known| known.is_same(&met)) {
                    Some(known) => {
                        known.depth_m = known.depth_m.max(met.depth_m);
                        known.lasts_s += met.lasts_s;
                    }
                    None => self.collisions.push(met),
                }
            }
        }
        let [one, other] = step.hands else { return };
        let (one, other) = (&one.executor, &other.executor);
        let so_far = self.nearest.as_ref().map_or(f64::INFINITY, |nearest| nearest.gap);
        let below = all.iter().map(|task| self.gaps[*task]).fold(so_far, f64::max);
        if let Some(found) = arm_distance(&shapes(one), &shapes(other), below) {
            for task in all {
                self.gaps[task] = self.gaps[task].min(found.gap);
            }
            if found.gap >= so_far {
                return;
            }
            let name = |limb: &Executor, link: usize| limb.robot().tree.links[link].name.clone();
            let links = [name(one, found.links[0]), name(other, found.links[1])];
            self.nearest = Some(MinDistance { gap: found.gap, time_s: step.time_s(), links });
        }
    }
}

fn shapes(limb: &Executor) -> Vec<PlacedShape> {
    placed(&limb.robot().tree, limb.poses())
}
