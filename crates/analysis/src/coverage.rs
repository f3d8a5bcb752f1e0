//! Coverage of the trees by recordings: which choices are taken, and which conditions are evaluated to true and to false.

use std::collections::BTreeMap;
use teachtree_base::diagnostic::Span;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_engine::inspect::Inspector;
use teachtree_engine::runs::Leaves;
use teachtree_frames::frames::Frames;
use teachtree_language::rules::{Branch, Choice, Consequent, Expr, ExprKind, Rules};

/// Where something stands: file, first byte, one past the last; and its text, which names the hand where a choice is meant for each of them.
type SourceKey = (String, u32, u32, String);

/// The coverage of any number of recordings.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Coverage {
    choices: BTreeMap<SourceKey, OutcomeCoverage>,
    conditions: BTreeMap<SourceKey, OutcomeCoverage>,
}

/// The outcomes of a choice or a condition.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct OutcomeCoverage {
    text: String,
    shown: String,
    yes: bool,
    no: bool,
}

/// Something that no recording shows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Gap {
    /// `never taken`, `never true`, `never false`.
    pub what: &'static str,
    /// The choice or condition as its author wrote it.
    pub text: String,
    /// Where it stands.
    pub place: String,
}

impl Coverage {
    /// Adds what a recording shows.
    ///
    /// # Errors
    /// When the rate of the log cannot honour a duration of the rules.
    pub fn add(&mut self, rules: &Rules, frames: &Frames, leaves: &[Leaves]) -> Result<(), InputError> {
        for leaves in leaves {
            let mut inspector = Inspector::new(rules, frames, leaves);
            let sides = leaves.hands.keys().copied().map(Some).chain([None]);
            for side in sides.collect::<Vec<_>>() {
                if let Some(tree) = inspector.tree(side) {
                    let all: Vec<usize> = (0..leaves.frames.len()).collect();
                    self.branch(&mut inspector, &tree.root, side, all)?;
                }
            }
        }
        Ok(())
    }

    /// Returns the coverage of the files whose names `is_counted` accepts.
    #[must_use]
    pub fn of_files(mut self, is_counted: impl Fn(&str) -> bool) -> Self {
        self.choices.retain(|(file, ..), _| is_counted(file));
        self.conditions.retain(|(file, ..), _| is_counted(file));
        self
    }

    /// Returns the number of covered outcomes and of all outcomes: a choice has one, a condition has two.
    pub fn seen(&self) -> (usize, usize) {
        let taken = self.choices.values().filter(|seen| seen.yes).count();
        let outcomes: usize = self.conditions.values().map(|seen| usize::from(seen.yes) + usize::from(seen.no)).sum();
        (taken + outcomes, self.choices.len() + 2 * self.conditions.len())
    }

    /// The share that was seen, 0 to 100; 100 when there is nothing to see.
    pub fn percent(&self) -> f64 {
        let (seen, of) = self.seen();
        if of == 0 { 100.0 } else { 100.0 * seen as f64 / of as f64 }
    }

    /// Returns the uncovered outcomes, by file and place.
    pub fn gaps(&self) -> Vec<Gap> {
        let gap = |what, seen: &OutcomeCoverage| Gap { what, text: seen.text.clone(), place: seen.shown.clone() };
        let untaken =
            self.choices.iter().filter(|(_, seen)| !seen.yes).map(|(at, seen)| (at, gap("never taken", seen)));
        let never_true =
            self.conditions.iter().filter(|(_, seen)| !seen.yes).map(|(at, seen)| (at, gap("never true", seen)));
        let never_false =
            self.conditions.iter().filter(|(_, seen)| !seen.no).map(|(at, seen)| (at, gap("never false", seen)));
        let mut gaps: Vec<_> = untaken.chain(never_true).chain(never_false).collect();
        gaps.sort_by_key(|(place, gap)| ((*place).clone(), gap.what));
        gaps.into_iter().map(|(_, gap)| gap).collect()
    }

    /// Follows the frames that reach a branch, counted from the beginning of the stretch.
    fn branch<'a>(
        &mut self,
        inspector: &mut Inspector<'a>,
        branch: &'a Branch,
        side: Option<Side>,
        mut reach: Vec<usize>,
    ) -> Result<(), InputError> {
        let last = branch.choices.len().saturating_sub(1);
        for (at, choice) in branch.choices.iter().enumerate() {
            let (taken, rest) = match &choice.condition {
                Some(condition) => {
                    self.condition(inspector, condition, side, &reach)?;
                    let truth = inspector.truth(condition, side)?;
                    // The last choice of a branch is taken whenever the others are not.
                    reach.into_iter().partition(|frame| at == last || truth.holds(0, *frame))
                }
                None => (reach, Vec::new()),
            };
            self.choice(inspector.rules(), choice, !taken.is_empty());
            if let Consequent::Branch(below) = &choice.then {
                self.branch(inspector, below, side, taken)?;
            }
            reach = rest;
        }
        Ok(())
    }

    fn choice(&mut self, rules: &Rules, choice: &Choice, taken: bool) {
        let seen = seen(&mut self.choices, rules, choice.span, rules.choice_text(choice));
        seen.yes |= taken;
    }

    /// Records the outcome of each part of a condition that is not an `and`, `or` or `not`.
    fn condition<'a>(
        &mut self,
        inspector: &mut Inspector<'a>,
        expr: &'a Expr,
        side: Option<Side>,
        reach: &[usize],
    ) -> Result<(), InputError> {
        match &expr.kind {
            ExprKind::Not(inner) => self.condition(inspector, inner, side, reach),
            ExprKind::And(parts) | ExprKind::Or(parts) => {
                parts.iter().try_for_each(|part| self.condition(inspector, part, side, reach))
            }
            _ => {
                let truth = inspector.truth(expr, side)?;
                let rules = inspector.rules();
                let seen = seen(&mut self.conditions, rules, expr.span, rules.text_of(expr));
                seen.yes |= reach.iter().any(|frame| truth.holds(0, *frame));
                seen.no |= reach.iter().any(|frame| !truth.holds(0, *frame));
                Ok(())
            }
        }
    }
}

fn seen<'a>(
    all: &'a mut BTreeMap<SourceKey, OutcomeCoverage>,
    rules: &Rules,
    span: Span,
    text: String,
) -> &'a mut OutcomeCoverage {
    let file = rules.sources.files.get(span.file as usize).map_or("", |file| file.name.as_str());
    all.entry((file.to_string(), span.start, span.end, text.clone())).or_insert_with(|| OutcomeCoverage {
        text,
        shown: rules.sources.place(span),
        ..OutcomeCoverage::default()
    })
}
