//! The reference evaluator: Meaning of a run (grammar/README.md), literally and slowly, over a whole log.
//!
//! It shares only the checked rules and the frames with the compiled evaluator: every operator with memory looks back over the
//! frames themselves, from the last restart on.

mod functions;
mod summary;

use self::functions::{Value, arithmetic, call, each, nothing, numbers, pairs, scalar, truth};
use super::runs::{Leaves, Run, append};
use super::semantics::{changes, internal, per_second, samples, slots, target_of};
use std::cell::RefCell;
use std::collections::{BTreeSet, HashMap};
use std::ops::Range;
use teachtree_base::channels::{Shape, reads_target};
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_frames::frames::{ColumnKey, Frames};
use teachtree_language::ops::TemporalOperator;
use teachtree_language::rules::{
    Arithmetic, Branch, ChannelId, Comparison, Consequent, Constant, Expr, ExprKind, Label, LatchId, Rules, SignalId,
    Tree, TreeScope,
};

/// Evaluates a whole log, stretch by stretch.
///
/// # Errors
/// When the rate of the log cannot honour a duration of the rules.
pub fn evaluate(rules: &Rules, frames: &Frames) -> Result<Vec<Leaves>, InputError> {
    frames.stretches.iter().map(|stretch| Reference::new(rules, frames, stretch.clone()).run()).collect()
}

/// A leaf on a frame; `None` for `separate`.
type LeafOnFrame = Option<Label>;

type Result<T, E = InputError> = std::result::Result<T, E>;

/// A declaration of a hand: whether it is a latch, its position, whose.
type DeclarationKey = (bool, u32, Option<Side>);

/// Values by declaration, hand and frame.
type Cache<Id, T> = HashMap<(Id, Option<Side>, usize), T>;

struct Reference<'a> {
    rules: &'a Rules,
    frames: &'a Frames,
    stretch: Range<usize>,
    /// The leaves so far of each tree: by side, `None` for the one over both hands.
    leaves: HashMap<Option<Side>, Vec<LeafOnFrame>>,
    /// Values of signals and latches that were asked for before.
    signals: RefCell<Cache<SignalId, Value>>,
    latches: RefCell<Cache<LatchId, bool>>,
    /// Likewise of operators with memory, each by its place in the rules: looked up again for each frame of each operator around them, they would take time
    /// with the power of how deep they are nested.
    remembered: RefCell<Cache<*const Expr, Value>>,
    /// The targets that a signal or latch reads.
    targets: RefCell<HashMap<DeclarationKey, BTreeSet<Side>>>,
}

impl<'a> Reference<'a> {
    fn new(rules: &'a Rules, frames: &'a Frames, stretch: Range<usize>) -> Self {
        Self {
            rules,
            frames,
            stretch,
            leaves: HashMap::new(),
            signals: RefCell::default(),
            latches: RefCell::default(),
            remembered: RefCell::default(),
            targets: RefCell::default(),
        }
    }

    fn run(mut self) -> Result<Leaves> {
        let hands: Vec<Side> = self.frames.layout.hands.iter().map(|hand| hand.side).collect();
        let mut trees: Vec<(&Tree, Option<Side>)> = Vec::new();
        if let Some(tree) = self.rules.tree(TreeScope::EachHand) {
            trees.extend(hands.iter().map(|side| (tree, Some(*side))));
        }
        if let (Some(tree), 2) = (self.rules.tree(TreeScope::BothHands), hands.len()) {
            trees.push((tree, None));
        }
        for frame in self.stretch.clone() {
            // Every latch advances on every frame, reached or not.
            for (latch, id) in self.rules.latches.iter().zip(0..) {
                let sides = if latch.per_hand { hands.iter().copied().map(Some).collect() } else { vec![None] };
                for side in sides {
                    self.latch(LatchId(id), side, frame)?;
                }
            }
            let mut now = Vec::new();
            for (tree, side) in &trees {
                now.push((*side, self.decide(&tree.root, *side, frame)?));
            }
            for (side, leaf) in now {
                self.leaves.entry(side).or_default().push(leaf);
            }
        }
        let mut leaves = Leaves { frames: self.stretch.clone(), ..Leaves::default() };
        for (_, side) in &trees {
            let runs = match side {
                Some(side) => leaves.hands.entry(*side).or_default(),
                None => &mut leaves.both,
            };
            for (frame, label) in self.stretch.clone().zip(self.leaves.get(side).into_iter().flatten()) {
                append(runs, Run { start: frame, end: frame + 1, label: *label });
            }
        }
        Ok(leaves)
    }

    /// The leaf of the frame before; the outer `None` at the start.
    fn leaf_before(&self, tree: Option<Side>, frame: usize) -> Option<LeafOnFrame> {
        let at = frame.checked_sub(self.stretch.start + 1)?;
        self.leaves.get(&tree).and_then(|leaves| leaves.get(at)).copied()
    }

    fn decide(&self, branch: &Branch, tree: Option<Side>, frame: usize) -> Result<LeafOnFrame> {
        let last = branch.choices.len().saturating_sub(1);
        for (at, choice) in branch.choices.iter().enumerate() {
            // A branch is exhaustive: when nothing before was taken, its last choice is.
            let taken = match &choice.condition {
                Some(condition) if at < last => self.truth(condition, tree, frame)?,
                _ => true,
            };
            if taken {
                return match &choice.then {
                    Consequent::Primitive(label) => Ok(Some(*label)),
                    Consequent::Separate => Ok(None),
                    Consequent::Stay => Ok(self.leaf_before(tree, frame).flatten()),
                    Consequent::Branch(inner) => self.decide(inner, tree, frame),
                };
            }
        }
        Ok(None)
    }

    fn truth(&self, expr: &Expr, this: Option<Side>, frame: usize) -> Result<bool> {
        Ok(self.value(expr, this, frame)? == Value::Bool(true))
    }

    /// The frame on which the memory of whatever reads these expressions began: the last change of a target that they read, or the
    /// beginning of the stretch.
    fn beginning(&self, exprs: &[&Expr], this: Option<Side>, frame: usize) -> usize {
        let targets = self.targets(exprs, this);
        let targets: Vec<&[f64]> = targets.iter().filter_map(|side| target_of(self.frames, *side)).collect();
        let changed = |frame: usize| targets.iter().any(|target| changes(target, frame));
        (self.stretch.start + 1..=frame).rev().find(|frame| changed(*frame)).unwrap_or(self.stretch.start)
    }

    /// The hands whose targets these expressions read, also through signals and latches.
    fn targets(&self, exprs: &[&Expr], this: Option<Side>) -> BTreeSet<Side> {
        let mut targets = BTreeSet::new();
        for expr in exprs {
            match &expr.kind {
                ExprKind::Channel(channel, hand) => {
                    let name = &self.rules.channels[channel.index()].name;
                    targets.extend(reads_target(name, hand.side(this)));
                }
                ExprKind::Signal(signal, hand) => {
                    let inner = &self.rules.signals[signal.index()].expr;
                    targets.extend(self.targets_of((false, signal.0, hand.side(this)), &[inner]));
                }
                ExprKind::Latch(latch, hand) => {
                    let inner = &self.rules.latches[latch.index()];
                    targets.extend(self.targets_of((true, latch.0, hand.side(this)), &[&inner.set, &inner.clear]));
                }
                _ => targets.extend(self.targets(&expr.arguments(), this)),
            }
        }
        targets
    }

    fn targets_of(&self, declared: DeclarationKey, inner: &[&Expr]) -> BTreeSet<Side> {
        if let Some(targets) = self.targets.borrow().get(&declared) {
            return targets.clone();
        }
        let targets = self.targets(inner, declared.2);
        self.targets.borrow_mut().insert(declared, targets.clone());
        targets
    }

    /// The value of a number that is the same on every frame.
    fn constant(&self, expr: &Expr) -> Option<f64> {
        match &expr.kind {
            ExprKind::Number(number) => Some(*number),
            ExprKind::Param(param) => Some(self.rules.params[param.index()].value),
            ExprKind::Signal(signal, _) => self.constant(&self.rules.signals[signal.index()].expr),
            ExprKind::Negate(number) => self.constant(number).map(|number| -number),
            ExprKind::Arithmetic(operation, a, b) => Some(operation.apply(self.constant(a)?, self.constant(b)?)),
            _ => None,
        }
    }

    fn value(&self, expr: &Expr, this: Option<Side>, frame: usize) -> Result<Value> {
        if let Some(constant) = self.constant(expr) {
            return Ok(Value::Number(constant));
        }
        let arg = |expr: &Expr| self.value(expr, this, frame);
        Ok(match &expr.kind {
            ExprKind::Bool(bool) => Value::Bool(*bool),
            ExprKind::Number(number) => Value::Number(*number),
            ExprKind::Param(param) => Value::Number(self.rules.params[param.index()].value),
            ExprKind::Channel(channel, hand) => self.channel(*channel, hand.side(this), frame),
            ExprKind::Signal(signal, hand) => self.signal(*signal, hand.side(this), frame)?,
            ExprKind::Latch(latch, hand) => Value::Bool(self.latch(*latch, hand.side(this), frame)?),
            ExprKind::From { labels, none } => Value::Bool(match self.leaf_before(this, frame) {
                None => *none && self.runs(this),
                Some(None) => false,
                Some(Some(label)) => labels.iter().any(|pattern| pattern.covers(label)),
            }),
            ExprKind::Pick(array, pick) => {
                let hand = array.ty.axis.and_then(|(_, hand)| hand.side(this));
                let hand = hand.and_then(|side| self.frames.layout.hand(side));
                let fingers = hand.map_or(&[][..], |hand| &hand.fingers);
                let Value::Array(slots) = arg(array)? else { return Ok(nothing(expr.ty.shape)) };
                let picked: Vec<Value> = slots
                    .into_iter()
                    .zip(fingers)
                    .filter(|(_, finger)| pick.picks(**finger))
                    .map(|(slot, _)| slot)
                    .collect();
                match expr.ty.axis {
                    Some(_) => Value::Array(picked),
                    None => picked.into_iter().next().unwrap_or_else(|| nothing(expr.ty.shape)),
                }
            }
            ExprKind::Component(vector, at) => each(&arg(vector)?, &|vector| match vector {
                Value::Vector(vector) => Value::Number(vector.get(usize::from(*at)).copied().unwrap_or(0.0)),
                other => other.clone(),
            }),
            ExprKind::Negate(number) => each(&arg(number)?, &|number| numbers(number, |number| -number)),
            ExprKind::Arithmetic(operation, a, b) => pairs(&arg(a)?, &arg(b)?, &|a, b| arithmetic(*operation, a, b)),
            ExprKind::Compare(comparison, a, b) if a.ty.shape == Shape::Object => pairs(&arg(a)?, &arg(b)?, &|a, b| {
                let same = scalar(a) >= 0.0 && scalar(a).to_bits() == scalar(b).to_bits();
                Value::Bool(same == (*comparison == Comparison::Equal))
            }),
            ExprKind::Compare(comparison, a, b) => {
                pairs(&arg(a)?, &arg(b)?, &|a, b| Value::Bool(comparison.holds(scalar(a), scalar(b))))
            }
            ExprKind::Not(condition) => each(&arg(condition)?, &|condition| Value::Bool(!truth(condition))),
            ExprKind::And(all) => self.fold(all, this, frame, true, |a, b| a && b)?,
            ExprKind::Or(any) => self.fold(any, this, frame, false, |a, b| a || b)?,
            ExprKind::Call(function, args) => {
                let args = args.iter().map(arg).collect::<Result<Vec<Value>>>()?;
                call(*function, &args, expr)
            }
            ExprKind::Hysteresis { .. } | ExprKind::Temporal(..) | ExprKind::Rate(..) | ExprKind::Summary(..) => {
                self.remembered(expr, this, frame)?
            }
        })
    }

    /// Whether a tree is run at all.
    fn runs(&self, tree: Option<Side>) -> bool {
        match tree {
            Some(side) => self.frames.layout.hand(side).is_some() && self.rules.tree(TreeScope::EachHand).is_some(),
            None => self.frames.layout.hands.len() == 2 && self.rules.tree(TreeScope::BothHands).is_some(),
        }
    }

    fn fold(
        &self,
        exprs: &[Expr],
        this: Option<Side>,
        frame: usize,
        start: bool,
        f: impl Fn(bool, bool) -> bool,
    ) -> Result<Value> {
        exprs.iter().try_fold(Value::Bool(start), |all, expr| {
            let one = self.value(expr, this, frame)?;
            Ok(pairs(&all, &one, &|a, b| Value::Bool(f(truth(a), truth(b)))))
        })
    }

    fn channel(&self, channel: ChannelId, side: Option<Side>, frame: usize) -> Value {
        let spec = &self.rules.channels[channel.index()];
        let hand = side.and_then(|side| self.frames.layout.hand(side));
        let slots = spec.axis.map(|_| slots(&self.frames.layout, spec.axis, side));
        if side.is_some() && hand.is_none() {
            return if slots.is_some() { Value::Array(Vec::new()) } else { nothing(spec.shape) };
        }
        let element = |slot: usize| {
            let component = |component: usize| {
                let slot = u32::try_from(slot).unwrap_or(0);
                let component = u32::try_from(component).unwrap_or(0);
                let column = self.frames.column(ColumnKey { channel: channel.0, side, slot, component });
                column.and_then(|column| column.get(frame)).copied().unwrap_or(0.0)
            };
            match spec.shape {
                Shape::Bool => Value::Bool(component(0) > 0.5),
                Shape::Scalar | Shape::Object => Value::Number(component(0)),
                Shape::Vec3 => Value::Vector((0..3).map(component).collect()),
                Shape::Rotation => Value::Vector((0..4).map(component).collect()),
            }
        };
        match slots {
            Some(slots) => Value::Array((0..slots).map(element).collect()),
            None => element(0),
        }
    }

    fn signal(&self, id: SignalId, side: Option<Side>, frame: usize) -> Result<Value> {
        if let Some(value) = self.signals.borrow().get(&(id, side, frame)) {
            return Ok(value.clone());
        }
        let value = self.value(&self.rules.signals[id.index()].expr, side, frame)?;
        self.signals.borrow_mut().insert((id, side, frame), value.clone());
        Ok(value)
    }

    /// Cleared when `clear` holds, else set when `set` holds, else as it was; off before the beginning.
    fn latch(&self, id: LatchId, side: Option<Side>, frame: usize) -> Result<bool> {
        if side.is_some_and(|side| self.frames.layout.hand(side).is_none()) {
            return Ok(false);
        }
        if let Some(bit) = self.latches.borrow().get(&(id, side, frame)) {
            return Ok(*bit);
        }
        let latch = &self.rules.latches[id.index()];
        let bit = if self.truth(&latch.clear, side, frame)? {
            false
        } else if self.truth(&latch.set, side, frame)? {
            true
        } else {
            frame > self.beginning(&[&latch.set, &latch.clear], side, frame) && self.latch(id, side, frame - 1)?
        };
        self.latches.borrow_mut().insert((id, side, frame), bit);
        Ok(bit)
    }

    fn remembered(&self, expr: &Expr, this: Option<Side>, frame: usize) -> Result<Value> {
        let key = (std::ptr::from_ref(expr), this, frame);
        if let Some(value) = self.remembered.borrow().get(&key) {
            return Ok(value.clone());
        }
        let value = self.remember(expr, this, frame)?;
        self.remembered.borrow_mut().insert(key, value.clone());
        Ok(value)
    }

    /// Operators with memory.
    fn remember(&self, expr: &Expr, this: Option<Side>, frame: usize) -> Result<Value> {
        let rate = self.frames.layout.rate_hz;
        match &expr.kind {
            ExprKind::Hysteresis { value, on, off, rising } => {
                let beginning = self.beginning(&[value], this, frame);
                let now = self.value(value, this, frame)?;
                let mut state = each(&now, &|_| Value::Bool(false));
                let [on, off] = [on, off].map(|threshold| threshold.value);
                for past in beginning..=frame {
                    let value = self.value(value, this, past)?;
                    let beyond =
                        |value: f64, threshold: f64| if *rising { value > threshold } else { value < threshold };
                    let back = |value: f64, threshold: f64| if *rising { value < threshold } else { value > threshold };
                    state = pairs(&state, &value, &|state, value| {
                        let value = scalar(value);
                        Value::Bool(beyond(value, on) || truth(state) && !back(value, off))
                    });
                }
                Ok(state)
            }
            ExprKind::Temporal(temporal, condition) => self.over_time(temporal, condition, this, frame),
            ExprKind::Summary(summary, value, samples) => self.summary(*summary, value, samples, this, frame),
            ExprKind::Rate(number, duration) => {
                let n = samples(duration.value, rate)?;
                let now = self.value(number, this, frame)?;
                if frame < self.beginning(&[number], this, frame) + n as usize {
                    return Ok(each(&now, &|number| numbers(number, |_| 0.0)));
                }
                let then = self.value(number, this, frame - n as usize)?;
                let per_second = per_second(rate, n);
                let difference = |now: &Value, then: &Value| arithmetic(Arithmetic::Subtract, now, then);
                Ok(pairs(&now, &then, &|now, then| {
                    arithmetic(Arithmetic::Multiply, &difference(now, then), &Value::Number(per_second))
                }))
            }
            _ => Err(internal("an operator without memory was asked to remember")),
        }
    }

    /// Operators over time on a condition.
    fn over_time(
        &self,
        op: &TemporalOperator<Constant>,
        condition: &Expr,
        this: Option<Side>,
        frame: usize,
    ) -> Result<Value> {
        let frames = |duration: &Constant| Ok(samples(duration.value, self.frames.layout.rate_hz)? as usize);
        let beginning = self.beginning(&[condition], this, frame);
        let now = self.value(condition, this, frame)?;
        // The last `n` frames, as far as they are there.
        let last = |n: usize| (frame + 1).saturating_sub(n).max(beginning)..frame + 1;
        match op {
            TemporalOperator::For(duration) => {
                let n = frames(duration)?;
                if frame + 1 < beginning + n {
                    return Ok(each(&now, &|_| Value::Bool(false)));
                }
                self.over(last(n), condition, this, &now, true, |every, then| every && then)
            }
            TemporalOperator::WithinLast(duration) => {
                self.over(last(frames(duration)?), condition, this, &now, false, |any, then| any || then)
            }
            TemporalOperator::WithinNext(duration) => {
                let next = frame..(frame + frames(duration)?).min(self.stretch.end);
                self.over(next, condition, this, &now, false, |any, then| any || then)
            }
            TemporalOperator::Bridging(duration) => {
                let any = |frames| self.over(frames, condition, this, &now, false, |any, then| any || then);
                let n = frames(duration)?;
                let (before, after) = (any(last(n))?, any(frame..(frame + n).min(self.stretch.end))?);
                Ok(pairs(&before, &after, &|before, after| Value::Bool(truth(before) && truth(after))))
            }
            TemporalOperator::Lasting(duration) => {
                let n = frames(duration)?;
                // The state on a later frame may have begun after this one.
                let same_memory = |at: &usize| self.beginning(&[condition], this, *at) <= frame;
                let ahead = (frame + 1..self.stretch.end).take(n).take_while(same_memory);
                let before = self.unbroken(last(n).rev(), condition, this, &now)?;
                let after = self.unbroken(ahead, condition, this, &now)?;
                let lasts = |before, after| before > 0.0 && before + after >= n as f64;
                Ok(pairs(&before, &after, &|before, after| Value::Bool(lasts(scalar(before), scalar(after)))))
            }
            TemporalOperator::AtLeast { times, within } => {
                let mut begun = each(&now, &|_| Value::Number(0.0));
                for at in last(frames(within)?) {
                    let holds = self.value(condition, this, at)?;
                    let held = match at.checked_sub(1) {
                        // Each frame is evaluated as of that time: the memory of all frames began on one frame.
                        Some(before) if at > beginning => self.value(condition, this, before)?,
                        _ => Value::Bool(false),
                    };
                    let begins = pairs(&holds, &held, &|holds, held| Value::Bool(truth(holds) && !truth(held)));
                    begun = pairs(&begun, &begins, &|begun, begins| {
                        Value::Number(scalar(begun) + if truth(begins) { 1.0 } else { 0.0 })
                    });
                }
                Ok(each(&begun, &|begun| Value::Bool(scalar(begun) >= times.value)))
            }
            TemporalOperator::Rises | TemporalOperator::Falls => {
                let rises = matches!(op, TemporalOperator::Rises);
                if frame == beginning {
                    return Ok(each(&now, &|_| Value::Bool(false)));
                }
                let before = self.value(condition, this, frame - 1)?;
                Ok(pairs(&now, &before, &|now, before| Value::Bool(truth(now) == rises && truth(before) != rises)))
            }
        }
    }

    /// On how many of these frames a condition holds before it does not; `now` has its slots.
    fn unbroken(
        &self,
        frames: impl Iterator<Item = usize>,
        condition: &Expr,
        this: Option<Side>,
        now: &Value,
    ) -> Result<Value> {
        let mut held = each(now, &|_| Value::Number(0.0));
        for (at, so_far) in frames.zip(0_u32..) {
            let then = self.value(condition, this, at)?;
            held = pairs(&held, &then, &|held, then| {
                let holds = truth(then) && scalar(held) == f64::from(so_far);
                Value::Number(scalar(held) + if holds { 1.0 } else { 0.0 })
            });
        }
        Ok(held)
    }

    /// A condition on some frames, put together from `start` on; `now` has its slots.
    fn over(
        &self,
        frames: Range<usize>,
        condition: &Expr,
        this: Option<Side>,
        now: &Value,
        start: bool,
        f: impl Fn(bool, bool) -> bool,
    ) -> Result<Value> {
        let mut result = each(now, &|_| Value::Bool(start));
        for at in frames {
            let then = self.value(condition, this, at)?;
            result = pairs(&result, &then, &|a, b| Value::Bool(f(truth(a), truth(b))));
        }
        Ok(result)
    }
}
