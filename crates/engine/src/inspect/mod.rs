//! The inspector: which value any expression of the rules had on every frame of a stretch, for explanations and coverage.
//!
//! It is made for a log whose leaves are known already, so a run without questions pays nothing for it. The expressions are evaluated by the columns
//! of the compiled evaluator, `from` as a column too; all conditions of a tree and their parts are evaluated together, when the first one is asked for.

mod column;
mod replay;

pub use column::{Column, ConditionColumn};

use super::runs::{Leaves, Run};
use super::semantics::{changes, internal, target_of};
use replay::{Replay, runs_of};
use std::collections::{BTreeMap, BTreeSet};
use teachtree_base::channels::{Shape, reads_target};
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_frames::frames::Frames;
use teachtree_language::graph::{ValueId, lower_values};
use teachtree_language::rules::{Branch, Consequent, Expr, ExprKind, Hand, Label, Rules, Tree, TreeScope};

type Result<T> = std::result::Result<T, InputError>;

/// An expression in a tree or declaration of a hand, or of none.
type ExprInstance<'e> = (&'e Expr, Option<Side>);

/// The key of an expression of the rules: its address, which is valid while the inspector borrows the rules.
fn address((expr, side): ExprInstance<'_>) -> (usize, Option<Side>) {
    (std::ptr::from_ref(expr).addr(), side)
}

/// Looks at one stretch of a log.
pub struct Inspector<'a> {
    rules: &'a Rules,
    frames: &'a Frames,
    leaves: &'a Leaves,
    replays: Vec<Replay<'a>>,
    /// The run of each expression of the rules that was evaluated, and its place among the outputs.
    known: BTreeMap<(usize, Option<Side>), (usize, usize)>,
    /// The trees whose conditions were evaluated.
    trees: BTreeSet<Option<Side>>,
}

impl<'a> Inspector<'a> {
    /// An inspector of the stretch that these leaves are of.
    pub fn new(rules: &'a Rules, frames: &'a Frames, leaves: &'a Leaves) -> Self {
        let (replays, known, trees) = (Vec::new(), BTreeMap::new(), BTreeSet::new());
        Self { rules, frames, leaves, replays, known, trees }
    }

    /// The rules.
    pub const fn rules(&self) -> &'a Rules {
        self.rules
    }

    /// The log.
    pub const fn frames(&self) -> &'a Frames {
        self.frames
    }

    /// The leaves of the stretch.
    pub const fn leaves(&self) -> &'a Leaves {
        self.leaves
    }

    /// Returns the values of an expression on every frame of the stretch, in a tree or declaration of hand `this` or of none.
    ///
    /// # Errors
    /// When the rate of the log cannot honor a duration in it.
    pub fn column(&mut self, expr: &Expr, this: Option<Side>) -> Result<Column> {
        let all = 0..self.leaves.frames.len();
        match self.find((expr, this))? {
            Some((run, output)) => Ok(self.replay(run)?.column(output, all)),
            None => Ok(self.evaluate(&[(expr, this)])?.column(0, all)),
        }
    }

    /// Returns the value of an expression of the rules on one frame of the log, as a column of this frame.
    ///
    /// # Errors
    /// As [`Inspector::column`].
    pub fn at(&mut self, expr: &'a Expr, side: Option<Side>, frame: usize) -> Result<Column> {
        let (run, output) = self.place((expr, side))?;
        let at = frame.saturating_sub(self.leaves.frames.start);
        Ok(self.replay(run)?.column(output, at..at + 1))
    }

    /// On which frames of the stretch a condition of the rules holds.
    ///
    /// # Errors
    /// As [`Inspector::column`].
    pub fn truth(&mut self, condition: &'a Expr, side: Option<Side>) -> Result<ConditionColumn> {
        let (run, output) = self.place((condition, side))?;
        Ok(self.replay(run)?.truth(output))
    }

    /// On which frames of the stretch many conditions hold, each in a declaration of a hand or of none. They are evaluated together and not kept.
    ///
    /// # Errors
    /// As [`Inspector::column`].
    pub fn truths(&self, conditions: &[(&Expr, Option<Side>)]) -> Result<Vec<ConditionColumn>> {
        let replay = self.evaluate(conditions)?;
        Ok((0..conditions.len()).map(|output| replay.truth(output)).collect())
    }

    /// Returns the values of many expressions on every frame of the stretch, as [`truths`](Self::truths).
    ///
    /// # Errors
    /// As [`Inspector::column`].
    pub fn columns(&self, expressions: &[(&Expr, Option<Side>)]) -> Result<Vec<Column>> {
        let mut replay = self.evaluate(expressions)?;
        let all = 0..self.leaves.frames.len();
        Ok((0..expressions.len()).map(|output| replay.column(output, all.clone())).collect())
    }

    /// Whether a single condition of the rules holds on a frame of the log.
    ///
    /// # Errors
    /// As [`Inspector::column`].
    pub fn holds(&mut self, condition: &'a Expr, side: Option<Side>, frame: usize) -> Result<bool> {
        let at = frame.saturating_sub(self.leaves.frames.start);
        Ok(self.truth(condition, side)?.holds(0, at))
    }

    /// The leaf of a tree on a frame of the log, counted from its beginning; `None` for `separate` and outside.
    pub fn leaf(&self, side: Option<Side>, frame: usize) -> Option<Label> {
        self.run(side, frame)?.label
    }

    /// The run of equal leaves of a tree around a frame of the log.
    pub fn run(&self, side: Option<Side>, frame: usize) -> Option<Run> {
        let runs = runs_of(self.leaves, side);
        let at = runs.partition_point(|run| run.end <= frame);
        runs.get(at).filter(|run| run.start <= frame).copied()
    }

    /// The tree of a hand, or the one over both.
    pub fn tree(&self, side: Option<Side>) -> Option<&'a Tree> {
        let scope = if side.is_some() { TreeScope::EachHand } else { TreeScope::BothHands };
        self.rules.tree(scope).filter(|_| !runs_of(self.leaves, side).is_empty())
    }

    /// Which choices are taken on a frame of the log, from the root of a tree to its leaf: the position of each in its branch.
    ///
    /// # Errors
    /// As [`Inspector::column`].
    pub fn path(&mut self, side: Option<Side>, frame: usize) -> Result<Vec<usize>> {
        let mut path = Vec::new();
        let mut branch: Option<&'a Branch> = self.tree(side).map(|tree| &tree.root);
        while let Some(open) = branch {
            let last = open.choices.len().saturating_sub(1);
            let mut taken = last;
            for (at, choice) in open.choices.iter().enumerate().take(last) {
                let holds = match &choice.condition {
                    Some(condition) => self.holds(condition, side, frame)?,
                    None => true,
                };
                if holds {
                    taken = at;
                    break;
                }
            }
            path.push(taken);
            branch = open.choices.get(taken).and_then(|choice| match &choice.then {
                Consequent::Branch(below) => Some(below),
                _ => None,
            });
        }
        Ok(path)
    }

    /// The frame of the log on which the memory of what reads an expression began, as it is on a frame: the stretch's first, or the last
    /// change of a target that the expression reads.
    pub fn began(&self, expr: &Expr, side: Option<Side>, frame: usize) -> usize {
        let mut sides = BTreeSet::new();
        self.reach(&[(expr, side)], &mut |(part, this)| {
            if let ExprKind::Channel(channel, hand) = &part.kind {
                sides.extend(reads_target(&self.rules.channels[channel.index()].name, hand.side(this)));
            }
        });
        let targets: Vec<&[f64]> = sides.into_iter().filter_map(|side| target_of(self.frames, side)).collect();
        let start = self.leaves.frames.start;
        let changed = |frame: &usize| targets.iter().any(|target| changes(target, *frame));
        (start + 1..=frame).rev().find(changed).unwrap_or(start)
    }

    fn replay(&mut self, run: usize) -> Result<&mut Replay<'a>> {
        self.replays.get_mut(run).ok_or_else(|| internal("an expression was evaluated in no run"))
    }

    /// Returns the evaluation of an expression, if it is a part of the rules. The first request evaluates the tree of its hand.
    fn find(&mut self, asked: ExprInstance<'_>) -> Result<Option<(usize, usize)>> {
        if let Some(place) = self.known.get(&address(asked)) {
            return Ok(Some(*place));
        }
        let side = asked.1;
        if self.trees.insert(side)
            && let Some(tree) = self.tree(side)
        {
            let mut conditions = Vec::new();
            conditions_of(&tree.root, side, &mut conditions);
            self.keep(&conditions)?;
        }
        Ok(self.known.get(&address(asked)).copied())
    }

    /// Returns the evaluation of an expression of the rules.
    fn place(&mut self, asked: ExprInstance<'a>) -> Result<(usize, usize)> {
        if let Some(place) = self.find(asked)? {
            return Ok(place);
        }
        self.keep(&[asked])?;
        let place = self.known.get(&address(asked)).copied();
        place.ok_or_else(|| internal("an expression was not evaluated"))
    }

    /// Evaluates expressions of the rules, and what explanations of them ask for: their conditions and what those compare, also in the signals and latches
    /// that they read.
    fn keep(&mut self, asked: &[ExprInstance<'a>]) -> Result<()> {
        let mut parts: BTreeMap<(usize, Option<Side>), ExprInstance<'a>> = BTreeMap::new();
        let mut add = |part: ExprInstance<'a>| {
            parts.entry(address(part)).or_insert(part);
        };
        asked.iter().for_each(|asked| add(*asked));
        self.reach(asked, &mut |(part, this)| {
            if part.ty.shape == Shape::Bool {
                add((part, this));
            }
            if let ExprKind::Compare(_, a, b) = &part.kind {
                add((a, this));
                add((b, this));
            } else if let ExprKind::Hysteresis { value, .. } = &part.kind {
                add((value, this));
            }
        });
        parts.retain(|address, _| !self.known.contains_key(address));
        let all: Vec<ExprInstance<'a>> = parts.values().copied().collect();
        let replay = self.evaluate(&all)?;
        let run = self.replays.len();
        self.replays.push(replay);
        self.known.extend(parts.into_keys().zip((0..).map(|output| (run, output))));
        Ok(())
    }

    fn evaluate(&self, asked: &[ExprInstance<'_>]) -> Result<Replay<'a>> {
        let whose = |side: Option<Side>| if side.is_some() { Hand::This } else { Hand::Shared };
        let exprs: Vec<(&Expr, Hand)> = asked.iter().map(|(expr, side)| (*expr, whose(*side))).collect();
        let (graph, values) = lower_values(self.rules, &exprs);
        let values: Vec<(ValueId, Option<Side>)> =
            values.into_iter().zip(asked).map(|(value, (_, side))| (value, *side)).collect();
        Replay::new(&graph, &values, self.frames, self.leaves)
    }

    /// Visits every part of some expressions, and of the signals and latches that they read.
    fn reach<'e>(&self, asked: &[ExprInstance<'e>], visit: &mut dyn FnMut(ExprInstance<'e>))
    where
        'a: 'e,
    {
        let rules: &'a Rules = self.rules;
        let mut seen = BTreeSet::new();
        let mut open: Vec<ExprInstance<'e>> = asked.to_vec();
        while let Some((expr, this)) = open.pop() {
            expr.walk(&mut |part| {
                visit((part, this));
                match &part.kind {
                    ExprKind::Signal(id, hand) if seen.insert((false, id.0, hand.side(this))) => {
                        open.push((&rules.signals[id.index()].expr, hand.side(this)));
                    }
                    ExprKind::Latch(id, hand) if seen.insert((true, id.0, hand.side(this))) => {
                        let latch = &rules.latches[id.index()];
                        open.extend([(&latch.set, hand.side(this)), (&latch.clear, hand.side(this))]);
                    }
                    _ => {}
                }
            });
        }
    }
}

/// The conditions of a branch and of those below it.
fn conditions_of<'a>(branch: &'a Branch, side: Option<Side>, all: &mut Vec<ExprInstance<'a>>) {
    for choice in &branch.choices {
        all.extend(choice.condition.iter().map(|condition| (condition, side)));
        if let Consequent::Branch(below) = &choice.then {
            conditions_of(below, side, all);
        }
    }
}
