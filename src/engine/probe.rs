//! The probe: what any expression of the rules is worth on every frame of a stretch, for explanations and coverage.
//!
//! It is made for a log whose leaves are known already, so a run that nobody asks about pays nothing for it; and it computes only what is
//! asked for, whole columns at a time, each signal and latch once. `tests/it/engine.rs` walks the trees by it and compares the leaves.

mod column;
mod operators;

pub use column::{Column, Kept};

use super::open::frames as samples;
use super::runs::{Leaves, Run};
use crate::base::channels::{Axis, Shape, reads_target};
use crate::base::error::InputError;
use crate::base::hands::Side;
use crate::language::rules::{
    Branch, ChannelId, Comparison, Expr, ExprKind, Hand, Label, LatchId, Rules, SignalId, Then, Tree, TreeScope,
};
use crate::stream::frames::{ColumnKey, Frames, Values};
use operators::{arithmetic, bit, call, edge, hysteresis, rate, window};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::rc::Rc;

type Outcome<T> = Result<T, InputError>;

/// Words of memory for expressions that are kept for the next question, 256 MiB: without an end a long log would fill the memory.
const MAX_KEPT: usize = 1 << 25;

/// Something declared, as it is for a hand or for none.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Declared {
    Signal(SignalId, Option<Side>),
    // Latches read signals, never the other way round: they come after them.
    Latch(LatchId, Option<Side>),
}

/// Looks at one stretch of a log.
pub struct Probe<'a> {
    rules: &'a Rules,
    frames: &'a Frames,
    leaves: &'a Leaves,
    known: BTreeMap<Declared, Rc<Column>>,
    /// Expressions that were asked about, by where they lie in the rules, which stand still as long as the probe.
    kept: BTreeMap<(usize, Option<Side>), Rc<Kept>>,
    /// Words of memory that they take.
    words: usize,
    /// The hands whose targets a declaration reads.
    targets: BTreeMap<Declared, BTreeSet<Side>>,
    /// When memory began that reads the targets of these hands, for each frame.
    begins: BTreeMap<BTreeSet<Side>, Rc<Vec<usize>>>,
}

impl<'a> Probe<'a> {
    /// A probe for the stretch that these leaves are of.
    pub fn new(rules: &'a Rules, frames: &'a Frames, leaves: &'a Leaves) -> Self {
        let (known, kept, targets, begins) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
        Self { rules, frames, leaves, known, kept, words: 0, targets, begins }
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

    /// Frames in the stretch.
    fn len(&self) -> usize {
        self.leaves.frames.len()
    }

    /// What an expression is on every frame of the stretch, in a tree or declaration of hand `this` or of none.
    ///
    /// # Errors
    /// When the rate of the log cannot honour a duration in it.
    pub fn column(&mut self, expr: &Expr, this: Option<Side>) -> Outcome<Rc<Column>> {
        self.declare(expr, this)?;
        self.value(expr, this, &(0..self.len()))
    }

    /// Works out what an expression reads that is declared.
    fn declare(&mut self, expr: &Expr, this: Option<Side>) -> Outcome<()> {
        let all = 0..self.len();
        // What is declared, in the order in which it is evaluated, so that no call goes deeper than one expression.
        for declared in self.needed(expr, this) {
            if self.known.contains_key(&declared) {
                continue;
            }
            let rules = self.rules;
            let column = match declared {
                Declared::Signal(id, side) => {
                    let expr = &rules.signals[id.index()].expr;
                    self.remember_targets(declared, &[expr], side);
                    self.value(expr, side, &all)?
                }
                Declared::Latch(id, side) => {
                    let latch = &rules.latches[id.index()];
                    self.remember_targets(declared, &[&latch.set, &latch.clear], side);
                    Rc::new(self.latch(&latch.set, &latch.clear, side)?)
                }
            };
            self.known.insert(declared, column);
        }
        Ok(())
    }

    /// The leaf of a tree on a frame of the log, counted from its beginning; `None` for `separate` and outside.
    pub fn leaf(&self, side: Option<Side>, frame: usize) -> Option<Label> {
        self.run(side, frame)?.label
    }

    /// The run of equal leaves of a tree around a frame of the log.
    pub fn run(&self, side: Option<Side>, frame: usize) -> Option<Run> {
        let runs = self.runs(side);
        let at = runs.partition_point(|run| run.end <= frame);
        runs.get(at).filter(|run| run.start <= frame).copied()
    }

    fn runs(&self, side: Option<Side>) -> &'a [Run] {
        match side {
            Some(side) => self.leaves.hands.get(&side).map_or(&[], Vec::as_slice),
            None => &self.leaves.both,
        }
    }

    /// The tree of a hand, or the one over both.
    pub fn tree(&self, side: Option<Side>) -> Option<&'a Tree> {
        let scope = if side.is_some() { TreeScope::EachHand } else { TreeScope::BothHands };
        self.rules.tree(scope).filter(|_| !self.runs(side).is_empty())
    }

    /// Which choices are taken on a frame of the log, from the root of a tree to its leaf: the position of each in its branch.
    ///
    /// # Errors
    /// As [`Probe::column`].
    pub fn path(&mut self, side: Option<Side>, frame: usize) -> Outcome<Vec<usize>> {
        let mut path = Vec::new();
        let mut branch: Option<&'a Branch> = self.tree(side).map(|tree| &tree.root);
        while let Some(open) = branch {
            let last = open.choices.len().saturating_sub(1);
            let mut taken = last;
            for (at, choice) in open.choices.iter().enumerate().take(last) {
                let holds = match &choice.condition {
                    Some(condition) => self.at(condition, side, frame)?.holds(0, 0),
                    None => true,
                };
                if holds {
                    taken = at;
                    break;
                }
            }
            path.push(taken);
            branch = open.choices.get(taken).and_then(|choice| match &choice.then {
                Then::Branch(below) => Some(below),
                _ => None,
            });
        }
        Ok(path)
    }

    /// What an expression of the rules is on one frame of the log: a column of that frame alone. Of what has memory the whole column is worked out
    /// once, so that many frames may be asked about however long the stretch is.
    ///
    /// # Errors
    /// As [`Probe::column`].
    pub fn at(&mut self, expr: &'a Expr, side: Option<Side>, frame: usize) -> Outcome<Rc<Column>> {
        self.declare(expr, side)?;
        let at = frame.saturating_sub(self.leaves.frames.start);
        self.value(expr, side, &(at..at + 1))
    }

    /// The same as [`Probe::column`] of a condition of the rules, computed once as long as there is room to keep it.
    ///
    /// # Errors
    /// As [`Probe::column`].
    pub fn kept(&mut self, expr: &'a Expr, side: Option<Side>) -> Outcome<Rc<Kept>> {
        self.declare(expr, side)?;
        self.keep(expr, side)
    }

    /// What it reads is declared; it is one of the rules, or a part of one: it is known by where it lies.
    fn keep(&mut self, expr: &Expr, side: Option<Side>) -> Outcome<Rc<Kept>> {
        let place = (std::ptr::from_ref(expr).addr(), side);
        if let Some(column) = self.kept.get(&place) {
            return Ok(Rc::clone(column));
        }
        let kept = Kept::of(&*self.value(expr, side, &(0..self.len()))?);
        let words = kept.words();
        let kept = Rc::new(kept);
        if self.words + words <= MAX_KEPT {
            self.words += words;
            self.kept.insert(place, Rc::clone(&kept));
        }
        Ok(kept)
    }

    /// Whether a single condition holds on a frame of the log.
    ///
    /// # Errors
    /// As [`Probe::column`].
    pub fn holds(&mut self, condition: &Expr, side: Option<Side>, frame: usize) -> Outcome<bool> {
        let at = frame.saturating_sub(self.leaves.frames.start);
        Ok(self.column(condition, side)?.holds(0, at))
    }

    /// The frame of the log on which the memory of what reads an expression began, as it is on a frame: the stretch's first, or the last
    /// change of a target that the expression reads.
    ///
    /// # Errors
    /// As [`Probe::column`].
    pub fn began(&mut self, expr: &Expr, side: Option<Side>, frame: usize) -> Outcome<usize> {
        self.declare(expr, side)?;
        let start = self.leaves.frames.start;
        let begins = self.begins(&[expr], side);
        Ok(start + begins.get(frame.saturating_sub(start)).copied().unwrap_or(0))
    }

    /// What an expression reads, directly or through other declarations, in the order of evaluation.
    fn needed(&self, expr: &Expr, this: Option<Side>) -> BTreeSet<Declared> {
        let mut needed = BTreeSet::new();
        let mut open: Vec<(&Expr, Option<Side>)> = vec![(expr, this)];
        while let Some((expr, this)) = open.pop() {
            expr.walk(&mut |part| {
                let declared = match &part.kind {
                    ExprKind::Signal(id, hand) => Declared::Signal(*id, side(*hand, this)),
                    ExprKind::Latch(id, hand) => Declared::Latch(*id, side(*hand, this)),
                    _ => return,
                };
                if self.known.contains_key(&declared) || !needed.insert(declared) {
                    return;
                }
                match declared {
                    Declared::Signal(id, side) => open.push((&self.rules.signals[id.index()].expr, side)),
                    Declared::Latch(id, side) => {
                        let latch = &self.rules.latches[id.index()];
                        open.extend([(&latch.set, side), (&latch.clear, side)]);
                    }
                }
            });
        }
        needed
    }

    /// The hands whose targets expressions read; what is declared is looked up.
    fn targets(&self, exprs: &[&Expr], this: Option<Side>) -> BTreeSet<Side> {
        let mut targets = BTreeSet::new();
        for expr in exprs {
            expr.walk(&mut |part| match &part.kind {
                ExprKind::Channel(channel, hand) => {
                    targets.extend(reads_target(&self.rules.channels[channel.index()].name, side(*hand, this)));
                }
                ExprKind::Signal(id, hand) => {
                    let known = self.targets.get(&Declared::Signal(*id, side(*hand, this)));
                    targets.extend(known.into_iter().flatten());
                }
                ExprKind::Latch(id, hand) => {
                    let known = self.targets.get(&Declared::Latch(*id, side(*hand, this)));
                    targets.extend(known.into_iter().flatten());
                }
                _ => {}
            });
        }
        targets
    }

    fn remember_targets(&mut self, declared: Declared, exprs: &[&Expr], this: Option<Side>) {
        let targets = self.targets(exprs, this);
        self.targets.insert(declared, targets);
    }

    /// For each frame, the one on which the memory of whatever reads these expressions began.
    fn begins(&mut self, exprs: &[&Expr], this: Option<Side>) -> Rc<Vec<usize>> {
        let targets = self.targets(exprs, this);
        if let Some(begins) = self.begins.get(&targets) {
            return Rc::clone(begins);
        }
        let stretch = self.leaves.frames.clone();
        let column = |side: &Side| {
            let key = ColumnKey { channel: self.frames.channel("target")?, side: Some(*side), slot: 0, component: 0 };
            self.frames.column(key)?.part(stretch.clone())
        };
        let columns: Vec<Values<'_>> = targets.iter().filter_map(column).collect();
        let changes = |column: &Values<'_>, frame: usize| {
            let bits = |frame| column.get(frame).map(f64::to_bits);
            frame > 0 && bits(frame - 1) != bits(frame)
        };
        let mut begin = 0;
        let begins = (0..stretch.len()).map(|frame| {
            if columns.iter().any(|column| changes(column, frame)) {
                begin = frame;
            }
            begin
        });
        let begins: Rc<Vec<usize>> = Rc::new(begins.collect());
        self.begins.insert(targets, Rc::clone(&begins));
        begins
    }

    fn latch(&mut self, set: &Expr, clear: &Expr, this: Option<Side>) -> Outcome<Column> {
        if this.is_some_and(|side| self.frames.layout.hand(side).is_none()) {
            return Ok(Column::constant(&[0.0], self.len()));
        }
        let begins = self.begins(&[set, clear], this);
        let all = 0..self.len();
        let (set, clear) = (self.value(set, this, &all)?, self.value(clear, this, &all)?);
        let mut on = false;
        let step = |frame: usize| {
            let kept = on && begins.get(frame) != Some(&frame);
            on = !clear.holds(0, frame) && (set.holds(0, frame) || kept);
            bit(on)
        };
        Ok(Column::new(1, false, vec![(0..self.len()).map(step).collect()]))
    }

    /// What an expression is on a part of the stretch; the declarations that it reads are known. When that is not all of it, the expression is one of the
    /// rules, or a part of one.
    fn value(&mut self, expr: &Expr, this: Option<Side>, part: &Range<usize>) -> Outcome<Rc<Column>> {
        let len = part.len();
        let remembers = matches!(
            expr.kind,
            ExprKind::Hysteresis { .. } | ExprKind::Window(..) | ExprKind::Rises(_) | ExprKind::Falls(_)
        );
        if remembers && len < self.len() {
            return Ok(Rc::new(self.keep(expr, this)?.part(part)));
        }
        let rate_hz = self.frames.layout.rate_hz;
        let constant = |number: f64| Column::constant(&[number], len);
        Ok(Rc::new(match &expr.kind {
            ExprKind::Bool(value) => constant(bit(*value)),
            ExprKind::Number(number) => constant(*number),
            ExprKind::Param(param) => constant(self.rules.params[param.index()].value),
            ExprKind::Channel(channel, hand) => self.channel(*channel, side(*hand, this), part),
            ExprKind::Signal(id, hand) => return Ok(self.declared(Declared::Signal(*id, side(*hand, this)), part)),
            ExprKind::Latch(id, hand) => return Ok(self.declared(Declared::Latch(*id, side(*hand, this)), part)),
            ExprKind::From { labels, none } => self.from(labels, *none, this, part),
            ExprKind::Pick(array, pick) => {
                let whose = array.ty.axis.and_then(|(_, hand)| side(hand, this));
                let fingers =
                    whose.and_then(|side| self.frames.layout.hand(side)).map_or(&[][..], |hand| &hand.fingers);
                let slots = Rc::unwrap_or_clone(self.value(array, this, part)?).into_slots();
                let mut picked: Vec<Vec<f64>> = slots
                    .into_iter()
                    .zip(fingers)
                    .filter(|(_, finger)| pick.picks(**finger))
                    .map(|(slot, _)| slot)
                    .collect();
                if expr.ty.axis.is_none() {
                    picked.truncate(1);
                    if picked.is_empty() {
                        return Ok(Rc::new(nothing(expr.ty.shape, len)));
                    }
                }
                Column::new(width(expr.ty.shape), expr.ty.axis.is_some(), picked)
            }
            ExprKind::Component(vector, at) => {
                let at = usize::from(*at);
                self.value(vector, this, part)?.each(1, |vector, out| out.push(vector.get(at).copied().unwrap_or(0.0)))
            }
            ExprKind::Negate(number) => {
                let number = self.value(number, this, part)?;
                number.each(number.width(), |number, out| out.extend(number.iter().map(|number| -number)))
            }
            ExprKind::Arithmetic(operation, a, b) => {
                let (a, b) = (self.value(a, this, part)?, self.value(b, this, part)?);
                arithmetic(*operation, &a, &b)
            }
            ExprKind::Compare(comparison, a, b) => {
                let objects = a.ty.shape == Shape::Object;
                let (a, b) = (self.value(a, this, part)?, self.value(b, this, part)?);
                let first = |numbers: &[f64]| numbers.first().copied().unwrap_or(0.0);
                a.with(&b, 1, |a, b, out| {
                    let (a, b) = (first(a), first(b));
                    out.push(bit(if objects {
                        (a >= 0.0 && a.to_bits() == b.to_bits()) == (*comparison == Comparison::Equal)
                    } else {
                        comparison.holds(a, b)
                    }));
                })
            }
            ExprKind::Not(condition) => {
                let not =
                    |holds: &[f64], out: &mut Vec<f64>| out.push(bit(holds.first().is_none_or(|bit| *bit <= 0.5)));
                self.value(condition, this, part)?.each(1, not)
            }
            ExprKind::And(all) => self.joined(all, this, true, part)?,
            ExprKind::Or(any) => self.joined(any, this, false, part)?,
            ExprKind::Call(function, args) => {
                let args = args.iter().map(|arg| self.value(arg, this, part)).collect::<Outcome<Vec<_>>>()?;
                let args: Vec<&Column> = args.iter().map(Rc::as_ref).collect();
                call(*function, &args, len)
            }
            ExprKind::Hysteresis { value, on, off, rising } => {
                let begins = self.begins(&[value], this);
                hysteresis(&*self.value(value, this, part)?, on.value, off.value, *rising, &begins)
            }
            ExprKind::Window(kind, condition, duration) => {
                let begins = self.begins(&[condition], this);
                let n = samples(duration.value, rate_hz)? as usize;
                window(*kind, &*self.value(condition, this, part)?, n, &begins)
            }
            ExprKind::Rate(number, duration) => {
                let begins = self.begins(&[number], this);
                let n = samples(duration.value, rate_hz)?;
                // It looks back so far and no farther.
                let from = part.start.saturating_sub(n as usize);
                let seen = from..part.end;
                let begins: Vec<usize> = begins
                    .get(seen.clone())
                    .unwrap_or_default()
                    .iter()
                    .map(|begin| begin.saturating_sub(from))
                    .collect();
                let rates = rate(&*self.value(number, this, &seen)?, n as usize, f64::from(n) / rate_hz, &begins);
                rates.part(&(part.start - from..part.end - from))
            }
            ExprKind::Rises(condition) | ExprKind::Falls(condition) => {
                let begins = self.begins(&[condition], this);
                edge(&*self.value(condition, this, part)?, matches!(expr.kind, ExprKind::Rises(_)), &begins)
            }
        }))
    }

    fn declared(&self, declared: Declared, part: &Range<usize>) -> Rc<Column> {
        match self.known.get(&declared) {
            Some(column) if part.len() < self.len() => Rc::new(column.part(part)),
            Some(column) => Rc::clone(column),
            None => Rc::new(Column::constant(&[0.0], part.len())),
        }
    }

    /// `and` (`every`) and `or`.
    fn joined(&mut self, exprs: &[Expr], this: Option<Side>, every: bool, part: &Range<usize>) -> Outcome<Column> {
        let mut all = Column::constant(&[bit(every)], part.len());
        for expr in exprs {
            let one = self.value(expr, this, part)?;
            let truth = |numbers: &[f64]| numbers.first().is_some_and(|number| *number > 0.5);
            all = all.with(&one, 1, |a, b, out| {
                let (a, b) = (truth(a), truth(b));
                out.push(bit(if every { a && b } else { a || b }));
            });
        }
        Ok(all)
    }

    fn from(&self, labels: &[Label], none: bool, this: Option<Side>, part: &Range<usize>) -> Column {
        let start = self.leaves.frames.start;
        let runs = self.runs(this);
        let mut column = Vec::with_capacity(part.len());
        if part.start == 0 && !part.is_empty() {
            column.push(bit(none && !runs.is_empty()));
        }
        // The leaf of a frame is read on the next one.
        let first = runs.partition_point(|run| run.end + 1 - start <= part.start);
        for run in runs.iter().skip(first).take_while(|run| run.start + 1 - start < part.end) {
            let held = run.label.is_some_and(|label| labels.iter().any(|pattern| pattern.covers(label)));
            column.resize((run.end + 1 - start).min(part.end) - part.start, bit(held));
        }
        column.resize(part.len(), 0.0);
        Column::new(1, false, vec![column])
    }

    fn channel(&self, channel: ChannelId, side: Option<Side>, part: &Range<usize>) -> Column {
        let spec = &self.rules.channels[channel.index()];
        let hand = side.and_then(|side| self.frames.layout.hand(side));
        let slots = spec.axis.map(|axis| match axis {
            Axis::Fingers => hand.map_or(0, |hand| hand.fingers.len()),
            Axis::Contacts => hand.map_or(0, |hand| hand.contacts.len()),
        });
        let width = width(spec.shape);
        if side.is_some() && hand.is_none() {
            return if slots.is_some() {
                Column::new(width, true, Vec::new())
            } else {
                nothing(spec.shape, part.len())
            };
        }
        let element = |slot: usize| {
            let component = |component: usize| {
                let slot = u32::try_from(slot).unwrap_or(0);
                let component = u32::try_from(component).unwrap_or(0);
                self.frames.column(ColumnKey { channel: channel.0, side, slot, component })
            };
            let columns: Vec<Option<Values<'_>>> = (0..width).map(component).collect();
            let of =
                |frame: usize, column: &Option<Values<'_>>| column.and_then(|column| column.get(frame)).unwrap_or(0.0);
            let start = self.leaves.frames.start;
            (start + part.start..start + part.end)
                .flat_map(|frame| columns.iter().map(move |column| of(frame, column)))
                .collect()
        };
        Column::new(width, slots.is_some(), (0..slots.unwrap_or(1)).map(element).collect())
    }
}

const fn side(hand: Hand, this: Option<Side>) -> Option<Side> {
    match hand {
        Hand::This => this,
        Hand::Named(side) => Some(side),
        Hand::Nobody => None,
    }
}

const fn width(shape: Shape) -> usize {
    shape.components().len()
}

/// What a hand or finger that the log lacks reads as.
fn nothing(shape: Shape, len: usize) -> Column {
    let number = if shape == Shape::Object { -1.0 } else { 0.0 };
    Column::constant(&vec![number; width(shape)], len)
}
