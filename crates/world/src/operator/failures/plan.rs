//! The failure plan of an operator: which failure occurs for a seed, and in which hand.

use super::super::goals::{Carry, Goal};
use super::super::grips::body;
use super::super::rng::Rng;
use super::super::{Operator, Script};
use serde::Deserialize;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_base::scene::{Role, Scene};
use teachtree_base::short_number::ShortNumber;

/// A failure of a demonstration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Failure {
    /// The object is pressed on the rim beside its socket.
    Jam,
    /// The carried object slides or turns in the hand, and is caught.
    Slip,
    /// The object leaves the hand in the air and falls.
    Drop,
    /// The fingers close beside the object, or the object stays behind when the hand lifts.
    Miss,
    /// The carried object or the empty hand hits a body of the environment.
    Collision,
}

/// Failures on purpose: their kinds and their share.
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FailurePlan {
    /// The kinds of failures. Each failing seed has one of them; all are equally likely.
    pub kinds: Vec<Failure>,
    /// The share of failing seeds, 0 to 1.
    #[serde(default = "all")]
    pub share: f64,
    /// The body that a collision hits.
    #[serde(default)]
    pub obstacle: Option<String>,
}

const fn all() -> f64 {
    1.0
}

impl Failure {
    /// The name in events and scripts.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Jam => "jam",
            Self::Slip => "slip",
            Self::Drop => "drop",
            Self::Miss => "miss",
            Self::Collision => "collision",
        }
    }

    /// Whether a script has a step that the failure requires.
    fn has_place(self, script: &Script) -> bool {
        script.steps.iter().any(|step| match self {
            Self::Jam => matches!(step.goal, Goal::Insert(_)),
            Self::Slip | Self::Drop => matches!(step.goal, Goal::Bring(_)),
            Self::Miss | Self::Collision => matches!(step.goal, Goal::Close(_)),
        })
    }
}

impl FailurePlan {
    /// Rejects a plan without failures, a share out of range, and failures whose step or obstacle is missing.
    pub(in super::super) fn check(&self, operator: &Operator) -> Result<(), InputError> {
        if !(0.0..=1.0).contains(&self.share) {
            let message = format!("found {}, expected 0 to 1", ShortNumber(self.share));
            return Err(InputError::new("failures.share", message));
        }
        if self.kinds.is_empty() {
            return Err(InputError::new(
                "failures.kinds",
                "is empty, expected one of jam, slip, drop, miss, collision",
            ));
        }
        for kind in &self.kinds {
            if !operator.hands.values().any(|script| kind.has_place(script)) {
                let step = match kind {
                    Failure::Jam => "`insert`",
                    Failure::Slip | Failure::Drop => "`bring`",
                    Failure::Miss | Failure::Collision => "`close`",
                };
                let message = format!("`{}` needs a step {step}, which no hand has", kind.name());
                return Err(InputError::new("failures.kinds", message));
            }
        }
        if self.kinds.contains(&Failure::Collision) && self.obstacle.is_none() {
            return Err(InputError::new("failures", "has no `obstacle`, expected the body that `collision` needs"));
        }
        Ok(())
    }

    /// Rejects an obstacle that the scene lacks.
    pub(super) fn check_obstacle(&self, scene: &Scene, operator: &str) -> Result<(), InputError> {
        let Some(obstacle) = &self.obstacle else { return Ok(()) };
        let place = format!("operator `{operator}`, failures.obstacle");
        body(scene, obstacle).map(|_| ()).map_err(|error| InputError { place, ..error })
    }

    /// The failure of a seed, and its hand.
    pub(super) fn draw(&self, operator: &Operator, chance: &mut Rng, seed: u64) -> Option<(Failure, Side)> {
        // The golden ratio times 2^64, a Weyl sequence as for perturbations: consecutive seeds fail in proportion to the share.
        let turned = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        if self.share < 1.0 && (turned as f64) >= self.share * (u64::MAX as f64) {
            return None;
        }
        let failure = *pick(&self.kinds, chance)?;
        let hands = operator.hands.iter().filter(|(_, script)| failure.has_place(script));
        let sides: Vec<Side> = hands.map(|(side, _)| *side).collect();
        Some((failure, *pick(&sides, chance)?))
    }
}

/// The bodies of the environment with which contacts are collisions: the obstacle of the plan, and the walls and bodies of sockets that no script of
/// the operator touches on purpose. The step `press` does not name its body, so the walls of an operator with such a step do not count.
pub(crate) fn obstacles(scene: &Scene, operator: &Operator) -> Vec<usize> {
    let goals = || operator.hands.values().flat_map(|script| &script.steps).map(|step| &step.goal);
    let presses = goals().any(|goal| matches!(goal, Goal::Press(_)));
    let is_intended = |name: &str| {
        goals().any(|goal| match goal {
            Goal::Carry(Carry { until, press, .. }) => {
                until.as_ref().is_some_and(|until| until.contact == name)
                    || press.as_ref().is_some_and(|press| press.against == name)
            }
            _ => false,
        })
    };
    let planned = operator.failures.as_ref().and_then(|plan| plan.obstacle.as_ref());
    let is_obstacle = |name: &String, role: Role| match role {
        Role::Wall | Role::Socket => planned == Some(name) || !(is_intended(name) || presses && role == Role::Wall),
        _ => planned == Some(name),
    };
    let bodies = scene.bodies.iter().enumerate();
    bodies.filter(|(_, (name, body))| is_obstacle(name, body.role)).map(|(index, _)| index).collect()
}

/// Selects an element; all are equally likely.
fn pick<'a, T>(of: &'a [T], chance: &mut Rng) -> Option<&'a T> {
    of.get(((chance.share() * of.len() as f64) as usize).min(of.len().checked_sub(1)?))
}
