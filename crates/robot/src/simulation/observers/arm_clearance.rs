//! The minimum distances of arms, links and bodies, and collisions of arms and hands. The simulation has no contact forces on links, so collisions are
//! reported.

use crate::control::executor::Executor;
use crate::kinematics::arm_distance::{PlacedShape, PlacedShapes, arm_distance, placed};
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

/// The minimum distance of a link to another link or to a body.
#[derive(Clone, Debug, PartialEq)]
pub struct MinDistance {
    /// The signed distance, m; negative for a penetration.
    pub gap: f64,
    /// The time of the minimum, s since the beginning.
    pub time_s: f64,
    /// The names of the two links, or of the link and the body.
    pub links: [String; 2],
}

/// The least gaps over the whole motion; `None` where there is nothing of the kind. Of a link with a fingertip only the center of its ball counts against bodies.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MinDistances {
    /// Between the two arms with their hands.
    pub arms: Option<MinDistance>,
    /// Between an arm or a hand and a body that the hand does not handle.
    pub scene: Option<MinDistance>,
    /// Between an arm or a hand and the body that the hand handles, without the links that have a fingertip.
    pub handled: Option<MinDistance>,
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
const MEASURED_EVERY: usize = 10;

/// The minimum distances so far, and the collisions of each arm.
#[derive(Clone, Debug)]
pub(in crate::simulation) struct ArmClearance {
    pub(in crate::simulation) nearest: MinDistances,
    pub(in crate::simulation) collisions: Vec<Collision>,
    /// Per task, the maximum penetration depth of the links and the minimum distance of the two arms, m.
    deepest: Vec<f64>,
    gaps: Vec<f64>,
    /// The shapes of the bodies of the scene with their names, frames of the bodies.
    bodies: Vec<(String, Vec<CollisionShape>)>,
    /// The links of the arms, in the order of the hands, and which of them have a fingertip.
    arms: Vec<(ArmLinks, Vec<usize>)>,
}

impl ArmClearance {
    pub(super) fn new(scene: &Scene, limbs: &[Limb], tasks: usize) -> Self {
        let bodies = scene.bodies.iter().map(|(name, body)| (name.clone(), solids(body))).collect();
        let links = |limb: &Limb| {
            let hand = limb.robot.hands.get(&limb.side)?;
            let tips: Vec<_> = hand.fingers.iter().map(|finger| (finger.tip_link, finger.tip_in_link)).collect();
            let links = ArmLinks::with_hand(&limb.robot.tree, hand.palm, &tips);
            Some((links, tips.into_iter().map(|(link, _)| link).collect()))
        };
        let (deepest, gaps) = (vec![0.0; tasks], vec![f64::INFINITY; tasks]);
        let arms = limbs.iter().filter_map(links).collect();
        Self { nearest: MinDistances::default(), collisions: Vec::new(), deepest, gaps, bodies, arms }
    }

    /// Returns the maximum penetration depth of the links during a task, m: into bodies, their own arm or the other arm.
    pub(in crate::simulation) fn depth_m(&self, task: usize) -> f64 {
        self.deepest[task].max(depth(self.gaps[task]))
    }

    /// Returns the current collisions of an arm, and updates the minimum distances between its links and bodies.
    fn meetings(&mut self, arm: usize, step: &Step<'_>) -> Vec<Collision> {
        let Self { nearest, bodies, arms, .. } = self;
        let hand = &step.hands[arm];
        let Some((links, tips)) = arms.get(arm) else { return Vec::new() };
        let placed = links.placed(hand.executor.poses());
        let name = |link: usize| hand.executor.robot().tree.links[link].name.clone();
        let time_s = step.time_s();
        let of = |link: &PlacedShape, with: String, gap: f64| Collision {
            link: name(link.link()),
            with,
            time_s,
            depth_m: depth(gap),
            lasts_s: MEASURED_EVERY as f64 * STEP_S,
        };
        let handled = hand.doing.map(|doing| doing.body);
        let mut met: Vec<Collision> = Vec::new();
        for (body, (other, solids)) in bodies.iter().enumerate() {
            let is_handled = Some(body) == handled;
            let least = if is_handled { &mut nearest.handled } else { &mut nearest.scene };
            let pose = &step.seen.bodies[body].pose;
            for solid in solids.iter().map(|solid| solid.moved(pose)) {
                // Fingertips touch what the hand handles.
                for (_, link) in placed.iter().filter(|(_, link)| !(is_handled && tips.contains(&link.link()))) {
                    let so_far = least.as_ref().map_or(f64::INFINITY, |least| least.gap);
                    let Some(gap) = link.gap_below(&solid, so_far.max(SHORT_M)) else { continue };
                    if gap < so_far {
                        *least = Some(MinDistance { gap, time_s, links: [name(link.link()), other.clone()] });
                    }
                    if gap < SHORT_M {
                        met.push(of(link, other.clone(), gap));
                    }
                }
            }
        }
        let own = own_meetings(&placed);
        met.extend(own.map(|[link, other]| of(link, name(other.link()), link.shape().gap(other.shape()))));
        // One collision covers all shapes of a link.
        met.sort_by(|a, b| (&a.link, &a.with).cmp(&(&b.link, &b.with)).then(b.depth_m.total_cmp(&a.depth_m)));
        met.dedup_by(|a, b| a.is_same(b));
        met
    }
}

impl Observer for ArmClearance {
    fn observe(&mut self, step: &Step<'_>) {
        if !step.in_group.is_multiple_of(MEASURED_EVERY) {
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
        let so_far = self.nearest.arms.as_ref().map_or(f64::INFINITY, |nearest| nearest.gap);
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
            self.nearest.arms = Some(MinDistance { gap: found.gap, time_s: step.time_s(), links });
        }
    }
}

fn shapes(limb: &Executor) -> PlacedShapes {
    placed(&limb.robot().tree, limb.poses())
}
