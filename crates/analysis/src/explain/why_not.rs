//! Why a primitive was not given: of all paths to it, on all frames asked about, the one that lacks least.

use super::reason::{EvalPoint, Reason, Reasons};
use serde::Serialize;
use std::ops::Range;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_engine::inspect::Inspector;
use teachtree_language::rules::{Choice, Consequent, Expr, ExprKind, Label, LeafPath};

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
    /// What stood in the way, from the root down; empty when the leaf was given.
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
    let mut nearest: Option<(usize, usize, &LeafPath)> = None;
    for way in &ways {
        let mut lacking = vec![0; at.len()];
        for (_, condition, wanted) in &way.asked {
            for (count, more) in lacking.iter_mut().zip(lacks(inspector, condition, *wanted, side, &at)?) {
                *count += more;
            }
        }
        for (frame, count) in at.clone().zip(lacking) {
            if nearest.is_none_or(|(least, ..)| count < least) {
                nearest = Some((count, frame, way));
            }
        }
    }
    let Some((_, frame, way)) = nearest else { return Ok(None) };
    let rules = inspector.rules();
    let place = |choice: &Choice| rules.sources.place(choice.span);
    let mut missing = Vec::new();
    for (choice, condition, wanted) in &way.asked {
        if inspector.holds(condition, side, frame)? != *wanted {
            let reason = Reasons { inspector }.reason(condition, EvalPoint::new(side, frame))?;
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

/// How many parts of a condition would have to come out differently, on each frame.
fn lacks<'a>(
    inspector: &mut Inspector<'a>,
    expr: &'a Expr,
    wanted: bool,
    side: Option<Side>,
    at: &Range<usize>,
) -> Result<Vec<usize>> {
    match &expr.kind {
        ExprKind::Not(inner) => lacks(inspector, inner, !wanted, side, at),
        ExprKind::And(parts) | ExprKind::Or(parts) => {
            let all = matches!(expr.kind, ExprKind::And(_)) == wanted;
            let mut total: Option<Vec<usize>> = None;
            for part in parts {
                let one = lacks(inspector, part, wanted, side, at)?;
                total = Some(match total {
                    None => one,
                    Some(so_far) => {
                        so_far.into_iter().zip(one).map(|(a, b)| if all { a + b } else { a.min(b) }).collect()
                    }
                });
            }
            Ok(total.unwrap_or_else(|| vec![0; at.len()]))
        }
        _ => {
            let start = inspector.leaves().frames.start;
            let truth = inspector.truth(expr, side)?;
            Ok(at.clone().map(|frame| usize::from(truth.holds(0, frame - start) != wanted)).collect())
        }
    }
}
