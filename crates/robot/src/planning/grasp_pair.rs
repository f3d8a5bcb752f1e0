//! Pairs of candidate grasps, one of each hand, in the order in which they are checked.

use super::rollout::{Occupied, too_near};
use crate::kinematics::surroundings::Surroundings;
use crate::parallel;
use std::cmp::Ordering;
use std::collections::BTreeMap;

/// Maximum number of pairs that are kept, in total and with the same grasp; number of grasps of the first hand that are compared in parallel.
const PAIRS: usize = 256;
const PAIRS_PER_GRASP: usize = 16;
const AT_ONCE: usize = 8;
/// All pairs are compared at every tenth step, and the best of them at more steps: the intervals, and the numbers of pairs with the same grasp that are kept.
const EVERY: [usize; 3] = [10, 4, 1];
const SHORTLIST: [usize; 3] = [256, 64, 64];
/// Missing distance that is added for each step at which a hand with its arm penetrates a fixed body, m.
const THROUGH_M: f64 = 0.01;

/// A choice of a grasp of one hand.
pub(super) struct Candidate<'a> {
    /// The hand, without its arm, at each sampled step.
    pub(super) stands: &'a [Occupied],
    /// Missing distance that is added for penetrations on its paths, m.
    pub(super) through: f64,
    pub(super) measure: f64,
}

/// Returns the best pairs of the candidates of both hands, with a missing distance of at most `present`, m; each candidate is in few of them.
pub(super) fn best_pairs(candidates: &[Vec<Candidate<'_>>; 2], present: f64) -> Vec<GraspPair> {
    let ones: Vec<usize> = (0..candidates[0].len()).collect();
    let mut best: Vec<GraspPair> = Vec::new();
    for ones in ones.chunks(AT_ONCE) {
        let most = best.get(PAIRS - 1).map_or(present, |worst| worst.left);
        best.extend(parallel::each(ones, |one| pairs_of(candidates, *one, most)).into_iter().flatten());
        best = of_many_kinds(best, PAIRS_PER_GRASP);
        best.truncate(PAIRS);
    }
    best
}

/// Returns the best pairs with one candidate of the first hand, with a missing distance of at most `most`, m. All pairs are compared at some of the steps, and the
/// best of them at more and at all steps.
fn pairs_of(candidates: &[Vec<Candidate<'_>>; 2], one: usize, most: f64) -> Vec<GraspPair> {
    let ours = &candidates[0][one];
    let pair = |other: usize, every: usize, most: f64| {
        let theirs = &candidates[1][other];
        let (through, measure) = (ours.through + theirs.through, ours.measure * theirs.measure);
        let stands = ours.stands.iter().zip(theirs.stands).step_by(every);
        let left = too_near(stands, most - through)? + through;
        Some(GraspPair { choices: [one, other], left, through, measure, postures: [0; 2] })
    };
    let mut others: Vec<usize> = (0..candidates[1].len()).collect();
    let mut shortlist: Vec<GraspPair> = Vec::new();
    for (every, kept) in EVERY.into_iter().zip(SHORTLIST) {
        shortlist.clear();
        let mut worst = most;
        for other in others.drain(..) {
            shortlist.extend(pair(other, every, worst));
            if shortlist.len() == 2 * kept {
                shortlist.sort_by(GraspPair::order);
                shortlist.truncate(kept);
                worst = shortlist.last().map_or(worst, |last| last.left);
            }
        }
        shortlist.sort_by(GraspPair::order);
        shortlist.truncate(kept);
        others.extend(shortlist.iter().map(|short| short.choices[1]));
    }
    shortlist
}

/// A hand with its arm in one posture at the steps at which pairs are compared.
pub(super) struct LimbSteps {
    steps: Vec<Occupied>,
    /// Missing distance that is added for penetrations of fixed bodies, m.
    through: f64,
}

impl LimbSteps {
    /// Returns the steps of a limb among fixed bodies.
    pub(super) fn new(steps: Vec<Occupied>, fixed: &Surroundings) -> Self {
        let through = steps.iter().filter(|step| fixed.meet_any(step.limb.iter())).count() as f64 * THROUGH_M;
        Self { steps, through }
    }
}

/// Two choices, by their indices in the lists.
#[derive(Clone, Copy)]
pub(super) struct GraspPair {
    pub(super) choices: [usize; 2],
    /// Missing distance summed over the sampled steps, m, and the part of it that is due to paths.
    pub(super) left: f64,
    pub(super) through: f64,
    pub(super) measure: f64,
    /// The start postures of their arms, by their indices in the list.
    pub(super) postures: [usize; 2],
}

impl GraspPair {
    /// Returns the pair with its arms in their best postures, one of each list; `None` if no posture of one of them can follow.
    pub(super) fn in_best_postures(&self, ours: &[Option<LimbSteps>], theirs: &[Option<LimbSteps>]) -> Option<Self> {
        let mut best = Self { left: f64::INFINITY, ..*self };
        for (one, ours) in ours.iter().enumerate().filter_map(|(at, it)| Some((at, it.as_ref()?))) {
            for (other, theirs) in theirs.iter().enumerate().filter_map(|(at, it)| Some((at, it.as_ref()?))) {
                let through = ours.through + theirs.through;
                let left = too_near(ours.steps.iter().zip(&theirs.steps), best.left - through);
                if let Some(left) = left.map(|left| left + through).filter(|left| *left < best.left) {
                    (best.left, best.postures) = (left, [one, other]);
                }
            }
        }
        best.left.is_finite().then_some(Self { left: best.left + self.through, ..best })
    }

    /// The order in which pairs are checked: by missing distance, then by measure.
    pub(super) fn order(&self, other: &Self) -> Ordering {
        self.left.total_cmp(&other.left).then(other.measure.total_cmp(&self.measure))
    }
}

/// Returns pairs in their order, with each choice in at most `alike` of them.
pub(super) fn of_many_kinds(mut pairs: Vec<GraspPair>, alike: usize) -> Vec<GraspPair> {
    pairs.sort_by(GraspPair::order);
    let mut used: BTreeMap<(usize, usize), usize> = BTreeMap::new();
    pairs.retain(|pair| {
        let own = [0, 1].map(|hand| (hand, pair.choices[hand]));
        let may = own.iter().all(|choice| used.get(choice).is_none_or(|used| *used < alike));
        if may {
            own.into_iter().for_each(|choice| *used.entry(choice).or_default() += 1);
        }
        may
    });
    pairs
}
