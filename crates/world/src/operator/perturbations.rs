//! Perturbations of a demonstration: mistakes of the operator and of the recording that are injected on purpose. The seed selects them, and the script
//! gets the steps that they take.
//!
//! INVARIANT (each to its share): a Weyl sequence per perturbation decides for which seeds it occurs. Among any 200 consecutive seeds it occurs for its
//! share of them, give or take three, and perturbations occur together as often as if they were independent.

use super::goals::{Carry, Close, Goal, Open, Reach, Slip, Step};
use super::rng::Rng;
use super::{Operator, Script};
use serde::Deserialize;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::quantity::{Length, Quantity};

/// Streams of chance of the perturbations, one each and hand: after those of hands and sensors.
const STREAM: u64 = 64;
/// How long operators stand still when they hesitate, s.
const HESITATION_S: [f64; 2] = [0.4, 1.2];
/// How far an object is nudged, m.
const NUDGE_M: [f64; 2] = [0.004, 0.010];
/// How far an object slips before it is caught, m.
const SLIP_M: [f64; 2] = [0.003, 0.010];
/// No object slips as far as this and is caught: it drops.
const DROP_M: f64 = 1.0;

/// A perturbation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Perturbation {
    /// The hand stands still for a while.
    Hesitation,
    /// The plug meets the rim of the socket, is lifted and tried again.
    RetryAtRim,
    /// The hand comes near the object, goes back and comes again.
    AbortedApproach,
    /// A finger touches the object and leaves it.
    TouchWithoutGrasp,
    /// The object slips in the air and is caught.
    Slip,
    /// The object falls and is picked up again.
    Drop,
    /// A finger runs into the object before it is grasped.
    Nudge,
    /// The fingers let go, stay where they are and close again.
    Regrasp,
    /// A finger touches another object first.
    SecondObject,
    /// The recording begins late.
    LateStart,
    /// The recording ends early.
    EarlyEnd,
}

/// What a script offers to perturbations.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Occasions {
    /// A grip with which the object is touched but not grasped.
    pub touch: Option<String>,
    /// A grip with which another object is touched.
    pub beside: Option<String>,
    /// Perturbations that cannot happen here: nothing falls from a peg that would not stand up again.
    pub without: Vec<Perturbation>,
}

impl Perturbation {
    /// All of them, in the order in which they are drawn.
    pub const ALL: [Self; 11] = [
        Self::Hesitation,
        Self::RetryAtRim,
        Self::AbortedApproach,
        Self::TouchWithoutGrasp,
        Self::Slip,
        Self::Drop,
        Self::Nudge,
        Self::Regrasp,
        Self::SecondObject,
        Self::LateStart,
        Self::EarlyEnd,
    ];

    /// The name in events and scripts.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hesitation => "hesitation",
            Self::RetryAtRim => "retry_at_rim",
            Self::AbortedApproach => "aborted_approach",
            Self::TouchWithoutGrasp => "touch_without_grasp",
            Self::Slip => "slip",
            Self::Drop => "drop",
            Self::Nudge => "nudge",
            Self::Regrasp => "regrasp",
            Self::SecondObject => "second_object",
            Self::LateStart => "late_start",
            Self::EarlyEnd => "early_end",
        }
    }

    /// Whether it occurs for a seed, when it occurs for this share of them.
    fn occurs(self, seed: u64, share: f64) -> bool {
        // The fractional parts of the square roots of the first primes, times 2^64: steps that fill the circle evenly, none in time with another.
        const STEPS: [u64; 11] = [
            0x6a09_e667_f3bc_c908,
            0xbb67_ae85_84ca_a73b,
            0x3c6e_f372_fe94_f82b,
            0xa54f_f53a_5f1d_36f1,
            0x510e_527f_ade6_82d1,
            0x9b05_688c_2b3e_6c1f,
            0x1f83_d9ab_fb41_bd6b,
            0x5be0_cd19_137e_2179,
            0xcbbb_9d5d_c105_9ed8,
            0x629a_292a_367c_d507,
            0x9159_015a_3070_dd17,
        ];
        let turned = seed.wrapping_mul(STEPS[self as usize]);
        (turned as f64) < share * (u64::MAX as f64)
    }
}

/// At which ends the recording of a seed is cut, and how far into what may be lost, 0 to 1.
pub(crate) fn cuts(operator: &Operator, seed: u64) -> [Option<f64>; 2] {
    let mut chance = Rng::new(seed, STREAM - 1);
    [Perturbation::LateStart, Perturbation::EarlyEnd].map(|perturbation| {
        let depth = chance.share();
        let occurs = perturbation.occurs(seed, operator.variation.perturbations)
            && !operator.occasions.without.contains(&perturbation);
        occurs.then_some(depth)
    })
}

/// The steps of a script with the perturbations of a seed.
pub(super) fn with_perturbations(operator: &Operator, script: &Script, side: Side, seed: u64) -> Vec<Step> {
    let stream = |perturbation: Perturbation| Rng::new(seed, STREAM + 2 * perturbation as u64 + side.index() as u64);
    let mut perturbed =
        PerturbedScript { operator, chance: stream(Perturbation::Hesitation), steps: script.steps.clone() };
    for perturbation in Perturbation::ALL {
        perturbed.chance = stream(perturbation);
        if perturbation.occurs(seed, operator.variation.perturbations)
            && !operator.occasions.without.contains(&perturbation)
        {
            perturbed.add(perturbation);
        }
    }
    perturbed.steps
}

/// A script with the perturbations that one seed draws.
pub(super) struct PerturbedScript<'a> {
    pub(super) operator: &'a Operator,
    pub(super) chance: Rng,
    pub(super) steps: Vec<Step>,
}

impl PerturbedScript<'_> {
    /// Adds the steps of a perturbation, where the script has a place for it.
    fn add(&mut self, perturbation: Perturbation) {
        let wait = Goal::Hold(Quantity(self.chance.between(HESITATION_S)));
        match perturbation {
            Perturbation::Hesitation => {
                let at = 1 + (self.chance.share() * (self.steps.len() as f64 - 1.5)).max(0.0) as usize;
                self.insert(at, perturbation, vec![wait]);
            }
            Perturbation::RetryAtRim => {
                if let Some(at) = self.first(|goal| matches!(goal, Goal::Insert(_))) {
                    let missed = self.steps[at].goal.clone();
                    let up = Carry {
                        along: [0.0, 0.0, 1.0],
                        distance: Quantity(0.012),
                        speed: Quantity(0.08),
                        until: None,
                        press: None,
                    };
                    self.insert(at, perturbation, vec![missed, Goal::Carry(up)]);
                }
            }
            Perturbation::AbortedApproach => {
                if let Some((at, approach)) = self.approach(self.first_grasp()) {
                    let aside = 0.03 * self.chance.either_way();
                    let near =
                        Reach { offset: [aside, 0.0, 0.03].map(Quantity), opened: Quantity(0.025), ..approach.clone() };
                    let away = Reach { offset: [aside, -0.10, 0.15].map(Quantity), ..approach };
                    let again = self.reach_before(at);
                    let steps = [Goal::Reach(near), wait, Goal::Reach(away)].into_iter().chain(again);
                    self.insert(at, perturbation, steps.collect());
                }
            }
            Perturbation::TouchWithoutGrasp => self.touch(perturbation, self.operator.occasions.touch.clone()),
            Perturbation::SecondObject => self.touch(perturbation, self.operator.occasions.beside.clone()),
            Perturbation::Nudge => self.nudge(),
            Perturbation::Regrasp => {
                let first = self.first_grasp();
                let Some((at, (_, approach))) = first.zip(self.approach(first)) else { return };
                let opposed = |grip: &super::Grip| grip.contacts.contains_key(&Finger::Thumb);
                if !self.operator.grips.get(&approach.grip).is_some_and(opposed) {
                    return;
                }
                let again = self.steps[at].goal.clone();
                let off = Goal::Open(Open { by: Quantity(0.006), speed: Quantity(0.06) });
                self.insert(at + 1, perturbation, vec![off, again]);
            }
            Perturbation::Slip => {
                let Some(at) = self.first(|goal| matches!(goal, Goal::Bring(_))) else { return };
                let distance = Quantity(self.chance.between(SLIP_M));
                self.insert(at, perturbation, vec![Goal::Slip(Slip { distance })]);
            }
            Perturbation::Drop => {
                let Some(at) = self.first(|goal| matches!(goal, Goal::Bring(_))) else { return };
                let grasp =
                    self.steps[..at].iter().rposition(|step| !step.added && matches!(step.goal, Goal::Close(_)));
                let Some(approach) = self.approach(grasp) else { return };
                let off = Goal::Open(Open { by: Quantity(0.025), speed: Quantity(0.12) });
                let fallen = [Goal::Slip(Slip { distance: Quantity(DROP_M) }), off];
                // Then it is picked up from where it lies, as before.
                let above = self.reach_before(approach.0);
                let again = self.steps[approach.0..at].iter().filter(|step| !step.added).map(|step| step.goal.clone());
                let steps = fallen.into_iter().chain(above).chain(again).collect();
                self.insert(at, perturbation, steps);
            }
            Perturbation::LateStart | Perturbation::EarlyEnd => {}
        }
    }

    /// A finger on top of something, before the approach.
    fn touch(&mut self, perturbation: Perturbation, grip: Option<String>) {
        let (Some(grip), Some((at, _))) = (grip, self.approach(self.first_grasp())) else { return };
        let above = Reach { grip, opened: Quantity(0.012), offset: [Length::default(); 3], speed: Quantity(0.25) };
        let lay_on = Close { force: Quantity(0.15), speed: Quantity(0.04), unchecked: false };
        let stay = 0.1 + 0.4 * self.chance.share();
        let off = Open { by: Quantity(0.025), speed: Quantity(0.12) };
        let up =
            Carry { along: [0.0, 0.0, 1.0], distance: Quantity(0.06), speed: Quantity(0.2), until: None, press: None };
        let steps =
            [Goal::Reach(above), Goal::Close(lay_on), Goal::Hold(Quantity(stay)), Goal::Open(off), Goal::Carry(up)];
        // Then it begins anew.
        let again = self.reach_before(at);
        self.insert(at, perturbation, steps.into_iter().chain(again).collect());
    }

    /// The thumb runs into the object from its side, and waits until that is understood.
    fn nudge(&mut self) {
        let Some((at, approach)) = self.approach(self.first_grasp()) else { return };
        let Some(thumb) = self.operator.grips.get(&approach.grip).and_then(|grip| grip.contacts.get(&Finger::Thumb))
        else {
            return;
        };
        let further = approach.opened.0 + self.chance.between(NUDGE_M);
        // The thumb stands on that side of the object where its contact is.
        let [x, y, _] = thumb.map(|length| length.0);
        let across = if x.abs() > y.abs() { [-further * x.signum(), 0.0] } else { [0.0, -further * y.signum()] };
        let into = Reach { offset: [across[0], across[1], 0.0].map(Quantity), speed: Quantity(0.15), ..approach };
        let wait = Goal::Hold(Quantity(0.15 + 0.2 * self.chance.share()));
        self.insert(at + 1, Perturbation::Nudge, vec![Goal::Reach(into), wait, self.steps[at].goal.clone()]);
    }

    /// The approach to a grasp, or to a touch of a script that grasps nothing: the last reach before the fingers close in this step.
    pub(super) fn approach(&self, close: Option<usize>) -> Option<(usize, Reach)> {
        let reaches = self.steps.iter().enumerate().take(close?).rev();
        reaches.filter(|(_, step)| !step.added).find_map(|(at, step)| match &step.goal {
            Goal::Reach(reach) => Some((at, reach.clone())),
            _ => None,
        })
    }

    /// The script's last reach before a step: from there it begins anew.
    pub(super) fn reach_before(&self, at: usize) -> Option<Goal> {
        let before = self.steps.iter().take(at).rev().filter(|step| !step.added);
        before.map(|step| &step.goal).find(|goal| matches!(goal, Goal::Reach(_))).cloned()
    }

    /// The first closing that the script itself asks for.
    pub(super) fn first_grasp(&self) -> Option<usize> {
        self.first(|goal| matches!(goal, Goal::Close(_)))
    }

    pub(super) fn first(&self, wanted: impl Fn(&Goal) -> bool) -> Option<usize> {
        self.steps.iter().position(|step| !step.added && wanted(&step.goal))
    }

    /// Puts steps before the step `at`; the first of them is known as the perturbation.
    fn insert(&mut self, at: usize, perturbation: Perturbation, goals: Vec<Goal>) {
        let mut first = Some(perturbation);
        let added = |goal| Step { perturbation: first.take(), ..Step::added(goal) };
        let steps = goals.into_iter().map(added);
        let at = at.min(self.steps.len());
        self.steps.splice(at..at, steps);
    }
}
