//! The reason why a primitive was not given: the path with the smallest [`shortfall`](super::shortfall), among all paths to it on all frames of the question.

use super::reason::{EvalPoint, Reason, Reasons};
use super::shortfall::{Shortfall, ShortfallMeter};
use serde::Serialize;
use std::ops::Range;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_engine::inspect::Inspector;
use teachtree_language::rules::{Choice, Consequent, Label, LeafPath};

/// The nearest path to a primitive.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NearestPath {
    /// The primitive.
    pub primitive: String,
    /// The frame that comes nearest.
    pub time_s: f64,
    /// The choice that would give it, as its author wrote it.
    pub choice: String,
    /// Where it stands.
    pub place: String,
    /// The conditions that prevented the leaf, from the root down; empty if the tree returned the leaf.
    pub missing: Vec<Obstacle>,
}

/// A choice that was taken and should not have been, or the other way round.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Obstacle {
    /// The choice as its author wrote it.
    pub choice: String,
    /// Where it stands.
    pub place: String,
    /// Whether it would have to be taken.
    pub wanted: bool,
    /// Why it was not as wanted.
    pub reason: Reason,
}

type Result<T> = std::result::Result<T, InputError>;

/// The nearest path of a tree to one of `labels` on the frames of `at`; `None` when no leaf gives them.
pub(super) fn why_not(
    inspector: &mut Inspector<'_>,
    side: Option<Side>,
    at: Range<usize>,
    labels: &[Label],
) -> Result<Option<NearestPath>> {
    let Some(tree) = inspector.tree(side) else { return Ok(None) };
    let gives = |choice: &Choice| match choice.then {
        Consequent::Primitive(label) => labels.iter().any(|pattern| pattern.covers(label)),
        _ => false,
    };
    let ways: Vec<LeafPath> = tree.root.paths().into_iter().filter(|way| gives(way.choice)).collect();
    let mut nearest: Option<(Shortfall, usize, &LeafPath)> = None;
    let mut meter = ShortfallMeter { inspector: &mut *inspector, side, at: at.clone() };
    for way in &ways {
        let mut lacking = vec![Shortfall::default(); at.len()];
        for (_, condition, wanted) in &way.asked {
            for (sum, more) in lacking.iter_mut().zip(meter.of(condition, *wanted)?) {
                *sum = sum.plus(more);
            }
        }
        for (frame, lacks) in at.clone().zip(lacking) {
            if nearest.is_none_or(|(least, ..)| lacks < least) {
                nearest = Some((lacks, frame, way));
            }
        }
    }
    let Some((_, frame, way)) = nearest else { return Ok(None) };
    let rules = inspector.rules();
    let place = |choice: &Choice| rules.sources.place(choice.span);
    let mut missing = Vec::new();
    for (choice, condition, wanted) in &way.asked {
        if inspector.holds(condition, side, frame)? != *wanted {
            let reason = Reasons { inspector, opens_counts: true }.reason(condition, EvalPoint::new(side, frame))?;
            missing.push(Obstacle { choice: rules.choice_text(choice), place: place(choice), wanted: *wanted, reason });
        }
    }
    let label = match way.choice.then {
        Consequent::Primitive(label) => rules.label_name(label),
        _ => String::new(),
    };
    Ok(Some(NearestPath {
        primitive: label,
        time_s: inspector.frames().time.get(frame).copied().unwrap_or_default(),
        choice: rules.choice_text(way.choice),
        place: place(way.choice),
        missing,
    }))
}
