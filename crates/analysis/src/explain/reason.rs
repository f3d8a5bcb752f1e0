//! Why a condition holds or does not: its deciding parts, each with what was measured, what was asked and how much lies between.

use super::fact::{Element, Fact, Wait};
use teachtree_base::channels::{Axis, Fallback, Shape};
use teachtree_base::diagnostic::Span;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;

use serde::Serialize;
use teachtree_engine::inspect::Inspector;
use teachtree_engine::semantics::samples;
use teachtree_frames::frames::{ColumnKey, HandLayout};
use teachtree_language::ops::TemporalOperator;
use teachtree_language::rules::{Comparison, Constant, Expr, ExprKind, Function, Hand, Rules, folded};

/// Signals and latches that are opened one within the other; what lies deeper is said by name.
const MAX_DEPTH: usize = 6;

/// A condition on a frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Reason {
    /// The condition as its author wrote it.
    pub condition: String,
    /// The finger or body that it is about, within `any` and `all`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slot: Option<String>,
    /// The time, s, if the condition is explained at another frame: the one that interrupts a condition which must hold for some time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_s: Option<f64>,
    /// Whether it holds.
    pub holds: bool,
    /// The measured fact of a condition that measures.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fact: Option<Fact>,
    /// The channels in a condition that measures, or is one, that have their default in the whole log, as where it lacks them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub defaults: Vec<String>,
    /// The parts that decide: those that hold or do not hold, whichever is the reason.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub because: Vec<Reason>,
}

type Result<T> = std::result::Result<T, InputError>;

/// Finds reasons on one stretch.
pub(super) struct Reasons<'p, 'a> {
    pub inspector: &'p mut Inspector<'a>,
    /// Whether a count that is too small is explained by what is counted.
    pub opens_counts: bool,
}

/// The context in which a condition is evaluated.
#[derive(Clone, Copy)]
pub(super) struct EvalPoint {
    /// The hand of the tree or declaration.
    pub this: Option<Side>,
    /// The frame of the log.
    pub frame: usize,
    /// The slot, within an array.
    pub slot: usize,
    depth: usize,
}

impl EvalPoint {
    /// A tree's condition on a frame.
    pub const fn new(this: Option<Side>, frame: usize) -> Self {
        Self { this, frame, slot: 0, depth: 0 }
    }
}

impl<'a> Reasons<'_, 'a> {
    /// A condition as text: comments and outer parentheses gone, blanks folded.
    pub fn text(&self, expr: &'a Expr) -> String {
        unwrapped(&self.inspector.rules().text_of(expr)).to_string()
    }

    /// Why a condition holds or does not.
    pub fn reason(&mut self, expr: &'a Expr, spot: EvalPoint) -> Result<Reason> {
        let holds = self.holds(expr, spot)?;
        let (fact, because) = self.decided(expr, spot, holds)?;
        let defaults = self.defaults(expr, spot);
        Ok(Reason { condition: self.text(expr), slot: None, at_s: None, holds, fact, defaults, because })
    }

    fn defaults(&self, expr: &Expr, spot: EvalPoint) -> Vec<String> {
        let mut found: Vec<String> = Vec::new();
        if !matches!(expr.kind, ExprKind::Compare(..) | ExprKind::Hysteresis { .. } | ExprKind::Channel(..)) {
            return found;
        }
        let frames = self.inspector.frames();
        expr.walk(&mut |part| {
            let ExprKind::Channel(id, hand) = &part.kind else { return };
            let spec = &self.inspector.rules().channels[id.index()];
            let Fallback::Constant(default) = spec.absent else { return };
            let side = if spec.per_hand { hand.side(spot.this) } else { None };
            let is_of = |key: &&ColumnKey| Some(key.channel) == frames.channel(&spec.name) && key.side == side;
            let mut columns = frames.columns.iter().filter(|(key, _)| is_of(key)).map(|(_, values)| values).peekable();
            let has_column = columns.peek().is_some();
            if has_column && columns.flatten().all(|value| *value == default) && !found.contains(&spec.name) {
                found.push(spec.name.clone());
            }
        });
        found
    }

    fn holds(&mut self, expr: &'a Expr, spot: EvalPoint) -> Result<bool> {
        Ok(self.number(expr, spot)? > 0.5)
    }

    fn number(&mut self, expr: &'a Expr, spot: EvalPoint) -> Result<f64> {
        let column = self.inspector.at(expr, spot.this, spot.frame)?;
        let slot = if column.is_array() { spot.slot } else { 0 };
        Ok(column.number(slot, 0))
    }

    fn start(&self) -> usize {
        self.inspector.leaves().frames.start
    }

    fn time(&self, frame: usize) -> f64 {
        self.inspector.frames().time.get(frame).copied().unwrap_or_default()
    }

    fn decided(&mut self, expr: &'a Expr, spot: EvalPoint, holds: bool) -> Result<(Option<Fact>, Vec<Reason>)> {
        let rules = self.inspector.rules();
        let whose = |hand: Hand| hand.side(spot.this);
        let deeper = EvalPoint { depth: spot.depth + 1, ..spot };
        Ok(match &expr.kind {
            ExprKind::And(parts) => (None, self.parts(parts, spot, holds, true)?),
            ExprKind::Or(parts) => (None, self.parts(parts, spot, holds, false)?),
            ExprKind::Not(inner) => (None, vec![self.bare(inner, spot)?]),
            ExprKind::Signal(id, hand) if spot.depth < MAX_DEPTH => {
                let signal = &rules.signals[id.index()];
                let spot = EvalPoint { this: whose(*hand), ..deeper };
                (None, vec![self.bare(&signal.expr, spot)?])
            }
            ExprKind::Latch(id, hand) => {
                let since = self.since(expr, spot, holds)?;
                let fact = Fact::Latch { on: holds, since_s: since.map(|frame| self.time(frame)) };
                let latch = &rules.latches[id.index()];
                let spot = EvalPoint { this: whose(*hand), ..deeper };
                let because = match since {
                    _ if spot.depth > MAX_DEPTH => Vec::new(),
                    // The condition that set it, at that frame.
                    Some(frame) if holds => vec![self.bare(&latch.set, EvalPoint { frame, ..spot })?],
                    None if holds => vec![self.bare(&latch.set, EvalPoint { frame: self.start(), ..spot })?],
                    _ if self.holds(&latch.clear, spot)? => vec![self.bare(&latch.clear, spot)?],
                    _ => vec![self.bare(&latch.set, spot)?],
                };
                (Some(fact), because)
            }
            ExprKind::From { .. } => {
                let tree = self.inspector.tree(spot.this).is_some();
                let before = if tree && spot.frame > self.start() {
                    match self.inspector.leaf(spot.this, spot.frame - 1) {
                        Some(label) => rules.label_name(label),
                        None => "separate".to_string(),
                    }
                } else {
                    "none".to_string()
                };
                (Some(Fact::Before { leaf: before }), Vec::new())
            }
            ExprKind::Compare(comparison, a, b) => {
                let because = match counted(*comparison, a) {
                    Some(array) if self.opens_counts && !holds => self.slots(array, spot, false, false)?.1,
                    _ => Vec::new(),
                };
                (Some(self.compared(*comparison, a, b, spot)?), because)
            }
            ExprKind::Hysteresis { value, on, off, rising } => {
                let measured = self.number(value, spot)?;
                let threshold = if holds { off.value } else { on.value };
                let margin = if *rising { measured - threshold } else { threshold - measured };
                let since_s = self.since(expr, spot, holds)?.map(|frame| self.time(frame));
                let (value, on, off) = (measured, on.value, off.value);
                let dimension = expr_dimension(expr);
                let fact =
                    Fact::Threshold { value, on, off, rising: *rising, margin, since_s, unit: dimension.si_unit() };
                (Some(fact), Vec::new())
            }
            ExprKind::Temporal(TemporalOperator::Rises | TemporalOperator::Falls, _) => (None, Vec::new()),
            ExprKind::Temporal(temporal, inner) => {
                let fact = self.over_time(temporal, inner, spot)?;
                let now = self.holds(inner, spot)?;
                // A condition that holds now is a reason only when it has the same sign.
                let because = match now == holds {
                    true => vec![self.bare(inner, spot)?],
                    false => self.elsewhere(temporal, inner, spot)?.into_iter().collect(),
                };
                (Some(fact), because)
            }
            ExprKind::Pick(array, _) => match self.picked(expr, array, spot) {
                Some(slot) => (None, self.bare_parts(array, EvalPoint { slot, ..spot }, holds)?),
                None => (Some(Fact::Absent), Vec::new()),
            },
            ExprKind::Call(function @ (Function::Any | Function::All), args) => match args.first() {
                Some(array) => self.slots(array, spot, holds, *function == Function::All)?,
                None => (None, Vec::new()),
            },
            _ => (None, Vec::new()),
        })
    }

    /// A part without the `not` around it, which says the same the other way round.
    fn bare(&mut self, expr: &'a Expr, spot: EvalPoint) -> Result<Reason> {
        match &expr.kind {
            ExprKind::Not(inner) => self.bare(inner, spot),
            _ => self.reason(expr, spot),
        }
    }

    fn bare_parts(&mut self, expr: &'a Expr, spot: EvalPoint, holds: bool) -> Result<Vec<Reason>> {
        Ok(self.decided(expr, spot, holds)?.1)
    }

    /// The parts of `and` (`every`) or `or` that decide.
    fn parts(&mut self, parts: &'a [Expr], spot: EvalPoint, holds: bool, every: bool) -> Result<Vec<Reason>> {
        let mut because = Vec::new();
        for part in parts {
            // All parts of a true `and` and of a false `or`; a sufficient subset for the others.
            if holds == every || self.holds(part, spot)? == holds {
                because.push(self.bare(part, spot)?);
            }
        }
        Ok(because)
    }

    /// `any` and `all` of an array: the slots that decide, or the one that comes nearest.
    fn slots(
        &mut self,
        array: &'a Expr,
        spot: EvalPoint,
        holds: bool,
        all: bool,
    ) -> Result<(Option<Fact>, Vec<Reason>)> {
        let column = self.inspector.at(array, spot.this, spot.frame)?;
        let held: Vec<usize> = (0..column.slots()).filter(|slot| column.holds(*slot, 0)).collect();
        let named =
            |reasons: &Self, slots: &[usize]| slots.iter().map(|slot| reasons.slot_name(array, *slot, spot)).collect();
        let fact = Fact::Slots { holding: named(self, &held), of: column.slots() };
        if spot.depth >= MAX_DEPTH {
            return Ok((Some(fact), Vec::new()));
        }
        let mut because = Vec::new();
        for slot in (0..column.slots()).filter(|slot| held.contains(slot) != all || holds == all) {
            let mut reason = self.bare(array, EvalPoint { slot, depth: spot.depth + 1, ..spot })?;
            reason.slot = Some(self.slot_name(array, slot, spot));
            because.push(reason);
        }
        if !holds && !all {
            // None holds: the slot with the fewest failing conditions is the evidence.
            because.sort_by_key(Reason::failing);
            because.truncate(1);
        } else if holds != all {
            because.truncate(2);
        } else {
            because.clear();
        }
        Ok((Some(fact), because))
    }

    pub fn slot_name(&self, array: &Expr, slot: usize, spot: EvalPoint) -> String {
        let Some((axis, hand)) = array.ty.axis else { return String::new() };
        let side = hand.side(spot.this);
        let layout = side.and_then(|side| self.inspector.frames().layout.hand(side));
        let name = layout.and_then(|layout| slots(array, axis, layout).into_iter().nth(slot));
        name.unwrap_or_else(|| format!("slot {}", slot + 1))
    }

    /// The slot of an array that a single pick or the slot of a pick is.
    fn picked(&self, expr: &'a Expr, array: &'a Expr, spot: EvalPoint) -> Option<usize> {
        let ExprKind::Pick(_, pick) = &expr.kind else { return None };
        let (_, hand) = array.ty.axis?;
        let side = hand.side(spot.this)?;
        let fingers = &self.inspector.frames().layout.hand(side)?.fingers;
        let mut slots = fingers.iter().enumerate().filter(|(_, finger)| pick.picks(**finger)).map(|(slot, _)| slot);
        slots.nth(if expr.ty.axis.is_some() { spot.slot } else { 0 })
    }

    fn compared(&mut self, comparison: Comparison, a: &'a Expr, b: &'a Expr, spot: EvalPoint) -> Result<Fact> {
        let (value, threshold) = (self.number(a, spot)?, self.number(b, spot)?);
        if a.ty.shape == Shape::Object {
            let objects = &self.inspector.frames().objects;
            // Objects are numbered in column form.
            let name = |number: f64| {
                let at = if number >= 0.0 { Some(number as usize) } else { None };
                at.and_then(|at| objects.get(at)).map_or("none", String::as_str).to_string()
            };
            return Ok(Fact::Objects { one: name(value), other: name(threshold) });
        }
        let margin = match comparison {
            Comparison::Less | Comparison::LessEqual => Some(threshold - value),
            Comparison::Greater | Comparison::GreaterEqual => Some(value - threshold),
            Comparison::Equal | Comparison::NotEqual => None,
        };
        let holding = match &a.kind {
            ExprKind::Call(Function::Count, args) => match args.first() {
                Some(array) => {
                    let column = self.inspector.at(array, spot.this, spot.frame)?;
                    let held = (0..column.slots()).filter(|slot| column.holds(*slot, 0));
                    held.map(|slot| self.slot_name(array, slot, spot)).collect()
                }
                None => Vec::new(),
            },
            _ => Vec::new(),
        };
        let unit = a.ty.dimension.si_unit();
        Ok(Fact::Compared { value, comparison: sign(comparison), threshold, margin, unit, holding })
    }

    /// Returns the fact of an operator over time: the held part of its window, the time at which its condition held, or its number of beginnings.
    fn over_time(&mut self, op: &TemporalOperator<Constant>, inner: &'a Expr, spot: EvalPoint) -> Result<Fact> {
        let rate_hz = self.inspector.frames().layout.rate_hz;
        let begin = self.inspector.began(inner, spot.this, spot.frame) - self.start();
        let truth = self.inspector.truth(inner, spot.this)?;
        let slot = if truth.is_array() { spot.slot } else { 0 };
        let at = spot.frame - self.start();
        let end = self.inspector.leaves().frames.len();
        #[allow(clippy::cast_precision_loss, reason = "frames of a log")]
        let seconds = |frames: usize| frames as f64 / rate_hz;
        let window = |duration: &Constant| Ok::<usize, InputError>(samples(duration.value, rate_hz)? as usize);
        let holds = |frame: &usize| truth.holds(slot, *frame);
        let (wait, wanted) = match op {
            TemporalOperator::For(duration) => {
                let wanted = window(duration)?;
                (Wait::Held(seconds((begin..=at).rev().take(wanted).take_while(holds).count())), wanted)
            }
            TemporalOperator::WithinLast(duration) => {
                let last = (begin..=at).rev().find(holds);
                (Wait::Ago(last.map(|last| seconds(at - last))), window(duration)?)
            }
            TemporalOperator::WithinNext(duration) => {
                let next = (at..end).find(holds);
                (Wait::Ahead(next.map(|next| seconds(next - at))), window(duration)?)
            }
            TemporalOperator::Bridging(duration) => {
                let last = (begin..=at).rev().find(holds);
                let next = (at..end).find(holds);
                let (ago, ahead) = (last.map(|last| seconds(at - last)), next.map(|next| seconds(next - at)));
                (Wait::Around { ago, ahead }, window(duration)?)
            }
            TemporalOperator::Lasting(duration) => {
                let wanted = window(duration)?;
                let before = (begin..=at).rev().take_while(holds).take(wanted).count();
                let until = self.same_memory(inner, spot, (at + wanted).min(end));
                let after = (at + 1..until).take_while(holds).count();
                (Wait::Held(seconds(if before > 0 { wanted.min(before + after) } else { 0 })), wanted)
            }
            TemporalOperator::AtLeast { times, within } => {
                let wanted = window(within)?;
                let begins = |frame: &usize| holds(frame) && (*frame == begin || !holds(&(frame - 1)));
                let begun = (begin..=at).rev().take(wanted).filter(begins).count();
                (Wait::Begun { times: begun, wanted: times.value }, wanted)
            }
            TemporalOperator::Rises | TemporalOperator::Falls => (Wait::Held(0.0), 1),
        };
        Ok(Fact::Window { wait, wanted_s: seconds(wanted) })
    }

    /// Why a window differs from its condition now: the nearest frame that interrupts what must hold for long enough, or that is within the window of what must
    /// hold once, and the reason there.
    fn elsewhere(
        &mut self,
        op: &TemporalOperator<Constant>,
        inner: &'a Expr,
        spot: EvalPoint,
    ) -> Result<Option<Reason>> {
        let (looks_back, looks_ahead, wanted) = match op {
            TemporalOperator::For(_) => (true, false, false),
            TemporalOperator::Lasting(_) => (true, true, false),
            TemporalOperator::WithinLast(_) => (true, false, true),
            TemporalOperator::WithinNext(_) => (false, true, true),
            _ => return Ok(None),
        };
        let begin = self.inspector.began(inner, spot.this, spot.frame);
        let truth = self.inspector.truth(inner, spot.this)?;
        let slot = if truth.is_array() { spot.slot } else { 0 };
        let start = self.start();
        let end = start + self.inspector.leaves().frames.len();
        let is_it = |frame: &usize| truth.holds(slot, frame - start) == wanted;
        let before = (begin..spot.frame).rev().find(is_it).filter(|_| looks_back);
        let after = (spot.frame + 1..end).find(is_it).filter(|_| looks_ahead);
        let Some(frame) = before.into_iter().chain(after).min_by_key(|frame| frame.abs_diff(spot.frame)) else {
            return Ok(None);
        };
        let reason = self.bare(inner, EvalPoint { frame, ..spot })?;
        Ok(Some(Reason { at_s: Some(self.time(frame)), ..reason }))
    }

    /// The end, `until` at most, of the frames from this one on before which the memory of an expression does not begin again. Frames of the stretch.
    fn same_memory(&self, expr: &'a Expr, spot: EvalPoint, until: usize) -> usize {
        let start = self.start();
        let mut until = start + until;
        while until > spot.frame + 1 {
            let began = self.inspector.began(expr, spot.this, until - 1);
            if began <= spot.frame {
                break;
            }
            until = began;
        }
        until - start
    }

    /// Returns the frame of a condition's last change; `None` if it has not changed since the beginning of the stretch.
    fn since(&mut self, expr: &'a Expr, spot: EvalPoint, holds: bool) -> Result<Option<usize>> {
        let column = self.inspector.truth(expr, spot.this)?;
        let slot = if column.is_array() { spot.slot } else { 0 };
        let start = self.start();
        let differs = column.last_otherwise(slot, spot.frame - start, holds);
        Ok(differs.map(|frame| start + frame + 1))
    }
}

impl Reason {
    /// Returns the number of facts below that do not hold.
    pub fn failing(&self) -> usize {
        let below: usize = self.because.iter().map(Self::failing).sum();
        below + usize::from(self.because.is_empty() && !self.holds)
    }
}

/// The array of a condition that enough of its elements hold.
fn counted(comparison: Comparison, value: &Expr) -> Option<&Expr> {
    match &value.kind {
        ExprKind::Call(Function::Count, args)
            if matches!(comparison, Comparison::Greater | Comparison::GreaterEqual) =>
        {
            args.first()
        }
        _ => None,
    }
}

/// The dimension of what a hysteresis compares.
fn expr_dimension(expr: &Expr) -> teachtree_base::units::Dimension {
    match &expr.kind {
        ExprKind::Hysteresis { value, .. } => value.ty.dimension,
        _ => expr.ty.dimension,
    }
}

/// The names of the slots of an array over an axis of a hand.
pub fn slots(array: &Expr, axis: Axis, hand: &HandLayout) -> Vec<String> {
    match axis {
        Axis::Fingers => picked_fingers(array, &hand.fingers).iter().map(ToString::to_string).collect(),
        Axis::Contacts => hand.contacts.clone(),
    }
}

/// The fingers that an array runs over: a pick within it leaves some out.
fn picked_fingers(array: &Expr, fingers: &[Element]) -> Vec<Element> {
    let mut pick = None;
    array.walk(&mut |part| {
        if let ExprKind::Pick(_, found) = &part.kind
            && part.ty.axis.is_some()
        {
            pick = Some(*found);
        }
    });
    fingers.iter().copied().filter(|finger| pick.is_none_or(|pick| pick.picks(*finger))).collect()
}

const fn sign(comparison: Comparison) -> &'static str {
    match comparison {
        Comparison::Less => "<",
        Comparison::LessEqual => "<=",
        Comparison::Greater => ">",
        Comparison::GreaterEqual => ">=",
        Comparison::Equal => "==",
        Comparison::NotEqual => "!=",
    }
}

/// An expression of the rules as its author wrote it: on one line, without comments and outer parentheses.
pub fn text(rules: &Rules, span: Span) -> String {
    unwrapped(&folded(rules.sources.text(span))).to_string()
}

/// Text without the parentheses around all of it.
fn unwrapped(text: &str) -> &str {
    let Some(inner) = text.strip_prefix('(').and_then(|text| text.strip_suffix(')')) else { return text };
    let mut open = 0_usize;
    for c in inner.chars() {
        match c {
            '(' => open += 1,
            // The first parenthesis is closed before the end: they are not one pair.
            ')' if open == 0 => return text,
            ')' => open -= 1,
            _ => {}
        }
    }
    unwrapped(inner)
}
