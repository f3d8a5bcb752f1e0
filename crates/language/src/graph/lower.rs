//! Checked rules in, the graph out.

use super::decision::Builder;
use super::{FloatBits, Graph, Latch, Leaf, Op, Target, Tree, Value, ValueId};
use crate::ops::{Samples, TemporalOperator};
use crate::rules::{Branch, Consequent, Constant, Expr, ExprKind, Hand, Label, Rules, SignalId, TreeScope, Type};
use std::collections::{BTreeSet, HashMap};
use teachtree_base::hands::Side;

/// Compiles a rule set. Checked rules cannot fail here.
pub fn lower(rules: &Rules) -> Graph {
    let mut lowering = Lowering::new(rules);
    // In evaluation order, so that however long a chain of signals is, no call goes deeper than one expression.
    for (signal, hand) in needed(rules, tree_conditions(rules)) {
        lowering.signal(signal, hand);
    }
    let latches = lowering.latches();
    let trees = rules
        .trees
        .iter()
        .map(|tree| {
            let this = match tree.scope {
                TreeScope::EachHand => Hand::This,
                TreeScope::BothHands => Hand::Shared,
            };
            let mut builder = Builder::default();
            let root = lowering.branch(&tree.root, this, &mut builder);
            Tree {
                name: tree.name.clone(),
                scope: tree.scope,
                settle_s: tree.settle.as_ref().map_or(0.0, |settle| settle.value),
                decision: builder.finish(root),
            }
        })
        .collect();
    Graph { channels: rules.channels.clone(), values: lowering.values, latches, trees, label_names: label_names(rules) }
}

/// Compiles expressions of a rule set without its trees, each in a tree or declaration of a hand: the graph and their places in it.
pub fn lower_values(rules: &Rules, exprs: &[(&Expr, Hand)]) -> (Graph, Vec<ValueId>) {
    let mut lowering = Lowering::new(rules);
    for (signal, hand) in needed(rules, exprs.iter().copied()) {
        lowering.signal(signal, hand);
    }
    let latches = lowering.latches();
    let values = exprs.iter().map(|(expr, this)| lowering.expr(expr, *this)).collect();
    let graph = Graph {
        channels: rules.channels.clone(),
        values: lowering.values,
        latches,
        trees: Vec::new(),
        label_names: label_names(rules),
    };
    (graph, values)
}

/// The signals that latches and the expressions `read` do, directly or through other signals, and as whose.
fn needed<'r>(rules: &'r Rules, read: impl IntoIterator<Item = (&'r Expr, Hand)>) -> BTreeSet<(SignalId, Hand)> {
    let mut needed = BTreeSet::new();
    for latch in &rules.latches {
        let this = if latch.per_hand { Hand::This } else { Hand::Shared };
        signals_of(&latch.set, this, &mut needed);
        signals_of(&latch.clear, this, &mut needed);
    }
    for (expr, this) in read {
        signals_of(expr, this, &mut needed);
    }
    // A signal reads earlier ones only, so in reverse order each is complete when it is visited.
    for (at, signal) in rules.signals.iter().enumerate().rev() {
        let at = u32::try_from(at).unwrap_or(u32::MAX);
        let users: Vec<Hand> =
            needed.range((SignalId(at), Hand::This)..=(SignalId(at), Hand::Shared)).map(|(_, hand)| *hand).collect();
        for this in users {
            signals_of(&signal.expr, this, &mut needed);
        }
    }
    needed
}

/// The conditions of all trees.
fn tree_conditions(rules: &Rules) -> Vec<(&Expr, Hand)> {
    let mut conditions = Vec::new();
    for tree in &rules.trees {
        let this = if tree.scope == TreeScope::EachHand { Hand::This } else { Hand::Shared };
        let mut branches = vec![&tree.root];
        while let Some(branch) = branches.pop() {
            for choice in &branch.choices {
                conditions.extend(choice.condition.iter().map(|condition| (condition, this)));
                if let Consequent::Branch(inner) = &choice.then {
                    branches.push(inner);
                }
            }
        }
    }
    conditions
}

fn signals_of(expr: &Expr, this: Hand, found: &mut BTreeSet<(SignalId, Hand)>) {
    if let ExprKind::Signal(signal, hand) = &expr.kind {
        found.insert((*signal, hand.seen_from(this)));
    }
    for arg in expr.arguments() {
        signals_of(arg, this, found);
    }
}

fn label_names(rules: &Rules) -> Vec<(Label, String)> {
    let mut names = Vec::new();
    for (primitive, at) in rules.primitives.iter().zip(0..) {
        let primitive_id = crate::rules::PrimitiveId(at);
        let sides = if primitive.sided { Side::BOTH.map(Some).to_vec() } else { vec![None] };
        for side in std::iter::once(None).chain(sides.into_iter().filter(Option::is_some)) {
            let label = Label { primitive: primitive_id, side };
            names.push((label, rules.label_name(label)));
        }
    }
    names
}

struct Lowering<'a> {
    rules: &'a Rules,
    values: Vec<Value>,
    known: HashMap<Value, ValueId>,
    signals: HashMap<(SignalId, Hand), ValueId>,
}

impl<'a> Lowering<'a> {
    fn new(rules: &'a Rules) -> Self {
        Self { rules, values: Vec::new(), known: HashMap::new(), signals: HashMap::new() }
    }

    fn latches(&mut self) -> Vec<Latch> {
        let rules = self.rules;
        let latch = |latch: &crate::rules::Latch| {
            let this = if latch.per_hand { Hand::This } else { Hand::Shared };
            let (set, clear) = (self.expr(&latch.set, this), self.expr(&latch.clear, this));
            Latch { name: latch.name.clone(), per_hand: latch.per_hand, set, clear }
        };
        rules.latches.iter().map(latch).collect()
    }

    fn number(&self, id: ValueId) -> Option<f64> {
        if let Op::Number(number) = self.values[id.index()].op { Some(number.get()) } else { None }
    }

    fn share(&mut self, op: Op, args: Vec<ValueId>, ty: Type) -> ValueId {
        // A constant is computed once.
        let numbers: Option<Vec<f64>> = args.iter().map(|arg| self.number(*arg)).collect();
        let (op, args) = match (&op, numbers.as_deref()) {
            (Op::Arithmetic(operation), Some([a, b])) => (Op::Number(FloatBits::new(operation.apply(*a, *b))), vec![]),
            (Op::Negate, Some([a])) => (Op::Number(FloatBits::new(-a)), vec![]),
            _ => (op, args),
        };
        let value = Value { op, args, ty };
        let next = ValueId(u32::try_from(self.values.len()).unwrap_or(u32::MAX));
        let id = *self.known.entry(value.clone()).or_insert(next);
        if id == next {
            self.values.push(value);
        }
        id
    }

    /// Returns the node of a signal for a hand.
    fn signal(&mut self, id: SignalId, hand: Hand) -> ValueId {
        if let Some(value) = self.signals.get(&(id, hand)) {
            return *value;
        }
        let signal = &self.rules.signals[id.index()];
        let value = self.expr(&signal.expr, hand);
        self.signals.insert((id, hand), value);
        value
    }

    fn expr(&mut self, expr: &Expr, this: Hand) -> ValueId {
        let whose = |hand: Hand| hand.seen_from(this);
        let ty = Type { axis: expr.ty.axis.map(|(axis, hand)| (axis, whose(hand))), ..expr.ty };
        let (op, args): (Op, Vec<&Expr>) = match &expr.kind {
            ExprKind::Bool(bool) => (Op::Bool(*bool), vec![]),
            ExprKind::Number(number) => (Op::Number(FloatBits::new(*number)), vec![]),
            ExprKind::Param(param) => (Op::Number(FloatBits::new(self.rules.params[param.index()].value)), vec![]),
            ExprKind::Channel(channel, hand) => (Op::Channel(*channel, whose(*hand)), vec![]),
            ExprKind::Signal(signal, hand) => return self.signal(*signal, whose(*hand)),
            ExprKind::Latch(latch, hand) => (Op::Latch(*latch, whose(*hand)), vec![]),
            ExprKind::From { labels, none } => (Op::From { tree: this, labels: labels.clone(), none: *none }, vec![]),
            ExprKind::Pick(array, pick) => (Op::Pick(*pick), vec![array]),
            ExprKind::Component(vector, at) => (Op::Component(*at), vec![vector]),
            ExprKind::Negate(number) => (Op::Negate, vec![number]),
            ExprKind::Arithmetic(operation, a, b) => (Op::Arithmetic(*operation), vec![a, b]),
            ExprKind::Compare(comparison, a, b) => (Op::Compare(*comparison), vec![a, b]),
            ExprKind::Not(condition) => (Op::Not, vec![condition]),
            ExprKind::And(conditions) => (Op::And, conditions.iter().collect()),
            ExprKind::Or(conditions) => (Op::Or, conditions.iter().collect()),
            ExprKind::Hysteresis { value, on, off, rising } => {
                let (on, off) = (FloatBits::new(on.value), FloatBits::new(off.value));
                (Op::Hysteresis { on, off, rising: *rising }, vec![value])
            }
            ExprKind::Temporal(temporal, condition) => {
                let condition = self.expr(condition, this);
                return self.over_time(temporal, condition, ty);
            }
            ExprKind::Rate(number, duration) => (Op::Rate(FloatBits::new(duration.value)), vec![number]),
            ExprKind::Summary(summary, value, Samples::Last(duration)) => {
                (Op::Summary(*summary, Some(FloatBits::new(duration.value))), vec![value])
            }
            ExprKind::Summary(summary, value, Samples::Since(condition)) => {
                (Op::Summary(*summary, None), vec![value, condition])
            }
            ExprKind::Call(function, args) => (Op::Call(*function), args.iter().collect()),
        };
        let args = args.into_iter().map(|arg| self.expr(arg, this)).collect();
        self.share(op, args, ty)
    }

    /// An operator over time. `bridging` and `lasting` are written out by the other operators, with which they share values.
    fn over_time(&mut self, temporal: &TemporalOperator<Constant>, condition: ValueId, ty: Type) -> ValueId {
        let Some(temporal) = temporal.map(|constant| Some(FloatBits::new(constant.value))) else {
            // Every constant has its bits.
            return self.share(Op::Bool(false), vec![], ty);
        };
        let mut temporal_of = |temporal, condition| self.share(Op::Temporal(temporal), vec![condition], ty);
        match temporal {
            TemporalOperator::Bridging(duration) => {
                let last = temporal_of(TemporalOperator::WithinLast(duration), condition);
                let next = temporal_of(TemporalOperator::WithinNext(duration), condition);
                self.share(Op::And, vec![last, next], ty)
            }
            TemporalOperator::Lasting(duration) => {
                let held = temporal_of(TemporalOperator::For(duration), condition);
                temporal_of(TemporalOperator::WithinNext(duration), held)
            }
            other => temporal_of(other, condition),
        }
    }

    fn branch(&mut self, branch: &Branch, this: Hand, builder: &mut Builder) -> Target {
        // From the last choice to the first, since a test needs to know where `no` leads. A branch is exhaustive, so its
        // last choice needs no test; a branch without any choice cannot be written.
        let mut otherwise = None;
        for choice in branch.choices.iter().rev() {
            let taken = match &choice.then {
                Consequent::Primitive(label) => Target::Leaf(Leaf::Primitive(*label)),
                Consequent::Stay => Target::Leaf(Leaf::Stay),
                Consequent::Separate => Target::Leaf(Leaf::Separate),
                Consequent::Branch(inner) => self.branch(inner, this, builder),
            };
            otherwise = Some(match (&choice.condition, otherwise) {
                (Some(condition), Some(otherwise)) => self.test(condition, taken, otherwise, this, builder),
                _ => taken,
            });
        }
        otherwise.unwrap_or(Target::Leaf(Leaf::Stay))
    }

    /// Takes a condition apart at its single-valued `and`, `or` and `not`; each operand is lowered once.
    fn test(&mut self, condition: &Expr, yes: Target, no: Target, this: Hand, builder: &mut Builder) -> Target {
        match &condition.kind {
            ExprKind::Not(inner) => self.test(inner, no, yes, this, builder),
            ExprKind::And(all) => all.iter().rev().fold(yes, |yes, one| self.test(one, yes, no, this, builder)),
            ExprKind::Or(any) => any.iter().rev().fold(no, |no, one| self.test(one, yes, no, this, builder)),
            _ => {
                let condition = self.expr(condition, this);
                builder.test(condition, yes, no)
            }
        }
    }
}
