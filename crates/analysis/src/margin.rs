//! The margin of a boundary: the distances of the deciding quantity from its threshold before and after, in units of its noise.

use std::ops::Range;
use teachtree_base::channels::Shape;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_engine::inspect::{Column, Inspector};
use teachtree_engine::semantics::samples;
use teachtree_language::ops::TemporalOperator;
use teachtree_language::rules::{Branch, Consequent, Constant, Expr, ExprKind, Function, Hand};

/// Half-width of the interval around a boundary in which a quantity is examined, s.
const AROUND_SECS: f64 = 0.1;
/// Signals and latches that are opened one within the other.
const MAX_DEPTH: usize = 12;
/// Frames of a window in which a turn is looked for.
const MAX_WINDOW: usize = 4096;
/// Maximum number of fingers or bodies of an array.
const MAX_SLOTS: usize = 256;
/// Standard deviation of a normal distribution over its median absolute deviation; the second difference of white noise has √6 of its deviation.
const DEVIATIONS: f64 = 1.4826;

type Result<T> = std::result::Result<T, InputError>;

/// The margin of the boundary before a frame of the log in the track of a hand, or of both. `None` where no measured quantity with noise decides, as with
/// flags.
///
/// # Errors
/// When the rate cannot honor a duration of the rules.
pub fn margin<'a>(inspector: &mut Inspector<'a>, side: Option<Side>, frame: usize) -> Result<Option<f64>> {
    let stretch = inspector.leaves().frames.clone();
    if inspector.tree(side).is_none() || !stretch.contains(&frame) || frame == stretch.start {
        return Ok(None);
    }
    let (before, after) = (inspector.path(side, frame - 1)?, inspector.path(side, frame)?);
    let mut branch: Option<&'a Branch> = inspector.tree(side).map(|tree| &tree.root);
    let mut least = None;
    for (was, is) in before.into_iter().zip(after) {
        let Some(open) = branch else { break };
        for condition in open.choices.iter().take(was.max(is) + 1).filter_map(|choice| choice.condition.as_ref()) {
            smaller(&mut least, Crossing { inspector, frame, depth: 0 }.of(condition, side)?);
        }
        branch = match open.choices.get(is).map(|choice| &choice.then) {
            Some(Consequent::Branch(below)) if was == is => Some(below),
            _ => None,
        };
    }
    Ok(least)
}

/// The conditions that an expression counts.
fn counted(expr: &Expr) -> Option<&[Expr]> {
    match &expr.kind {
        ExprKind::Call(Function::Count, conditions) => Some(conditions),
        _ => None,
    }
}

fn smaller(least: &mut Option<f64>, other: Option<f64>) {
    *least = match (*least, other) {
        (Some(one), Some(other)) => Some(one.min(other)),
        (one, other) => one.or(other),
    };
}

/// The frame on which a condition turned.
struct Crossing<'p, 'a> {
    inspector: &'p mut Inspector<'a>,
    frame: usize,
    depth: usize,
}

impl<'a> Crossing<'_, 'a> {
    /// The least margin of the comparisons that made a condition turn on this frame; `None` when it did not turn, or flags turned it.
    fn of(&mut self, expr: &'a Expr, this: Option<Side>) -> Result<Option<f64>> {
        if self.depth > MAX_DEPTH || expr.ty.shape != Shape::Bool || self.turns(expr, this)?.is_empty() {
            return Ok(None);
        }
        let rules = self.inspector.rules();
        let whose = |hand: &Hand| hand.side(this);
        match &expr.kind {
            ExprKind::And(parts) | ExprKind::Or(parts) | ExprKind::Call(_, parts) => self.least(parts.iter(), this),
            ExprKind::Not(inner) | ExprKind::Pick(inner, _) => self.of(inner, this),
            ExprKind::Signal(id, hand) => self.deeper(&rules.signals[id.index()].expr, whose(hand)),
            ExprKind::Latch(id, hand) => {
                let latch = &rules.latches[id.index()];
                let set = self.deeper(&latch.set, whose(hand))?;
                let clear = self.deeper(&latch.clear, whose(hand))?;
                Ok(set.or(clear))
            }
            ExprKind::Temporal(operator, inner) => match self.nearest(inner, operator, this)? {
                Some(frame) => Crossing { inspector: self.inspector, frame, depth: self.depth + 1 }.of(inner, this),
                None => Ok(None),
            },
            // A number of conditions that hold changes with one of them.
            ExprKind::Compare(_, one, other) if counted(one).or_else(|| counted(other)).is_some() => {
                let conditions = counted(one).or_else(|| counted(other)).unwrap_or_default();
                self.least(conditions.iter(), this)
            }
            ExprKind::Compare(_, one, other) => {
                let (one, other) = (self.inspector.column(one, this)?, self.inspector.column(other, this)?);
                let slots = if one.is_array() { one.slots() } else { other.slots() };
                let difference = |slot: usize, at: usize| {
                    let of = |column: &Column| column.number(if column.is_array() { slot } else { 0 }, at);
                    of(&one) - of(&other)
                };
                let turned = self.turns(expr, this)?;
                Ok(self.clear(turned, slots, 0.0, &difference))
            }
            ExprKind::Hysteresis { value, on, off, .. } => {
                let column = self.inspector.column(value, this)?;
                let slots = column.slots();
                let turned = self.turns(expr, this)?;
                let on_now = turned.iter().any(|(_, holds)| *holds);
                let threshold = if on_now { on.value } else { off.value };
                Ok(self.clear(turned, slots, threshold, &|slot, at| column.number(slot, at)))
            }
            _ => Ok(None),
        }
    }

    fn deeper(&mut self, expr: &'a Expr, this: Option<Side>) -> Result<Option<f64>> {
        Crossing { inspector: self.inspector, frame: self.frame, depth: self.depth + 1 }.of(expr, this)
    }

    fn least(&mut self, parts: impl Iterator<Item = &'a Expr>, this: Option<Side>) -> Result<Option<f64>> {
        let mut least = None;
        for part in parts {
            smaller(&mut least, self.deeper(part, this)?);
        }
        Ok(least)
    }

    /// The frame, counted from the beginning of the stretch.
    fn at(&self) -> usize {
        self.frame.saturating_sub(self.inspector.leaves().frames.start)
    }

    /// The slots of a condition that turned on this frame, and how each is now.
    fn turns(&mut self, expr: &'a Expr, this: Option<Side>) -> Result<Vec<(usize, bool)>> {
        let at = self.at();
        let truth = self.inspector.truth(expr, this)?;
        let slots = if truth.is_array() { MAX_SLOTS } else { 1 };
        let turned = (0..slots).map(|slot| (slot, truth.holds(slot, at)));
        Ok(turned.filter(|(slot, holds)| at > 0 && truth.holds(*slot, at - 1) != *holds).collect())
    }

    /// The nearest frame within the window of an operator over time on which its condition turned.
    fn nearest(
        &mut self,
        inner: &'a Expr,
        operator: &TemporalOperator<Constant>,
        this: Option<Side>,
    ) -> Result<Option<usize>> {
        let rate_hz = self.inspector.frames().layout.rate_hz;
        let duration = operator.constants().last().map(|duration| samples(duration.value, rate_hz));
        let window = duration.transpose()?.unwrap_or(1) as usize;
        let frames = self.inspector.leaves().frames.clone();
        let truth = self.inspector.truth(inner, this)?;
        let slots = if truth.is_array() { MAX_SLOTS } else { 1 };
        let turned = |frame: &usize| {
            let at = frame.saturating_sub(frames.start);
            at > 0
                && frames.contains(frame)
                && (0..slots).any(|slot| truth.holds(slot, at) != truth.holds(slot, at - 1))
        };
        let near = (0..=window.min(MAX_WINDOW)).flat_map(|by| [self.frame.checked_sub(by), self.frame.checked_add(by)]);
        Ok(near.flatten().find(turned))
    }

    /// Returns the margin with which a quantity crosses a threshold: the smaller of its distances before and after, divided by its noise.
    fn clear(
        &self,
        turned: Vec<(usize, bool)>,
        slots: usize,
        threshold: f64,
        value: &dyn Fn(usize, usize) -> f64,
    ) -> Option<f64> {
        let frames = self.inspector.leaves().frames.len();
        let reach = ((AROUND_SECS * self.inspector.frames().layout.rate_hz).round() as usize).max(1);
        let at = self.at();
        let far = |range: Range<usize>, slot: usize| {
            range.map(|at| (value(slot, at) - threshold).abs()).filter(|far| far.is_finite()).fold(0.0, f64::max)
        };
        let mut least = None;
        for (slot, _) in turned.into_iter().filter(|(slot, _)| *slot < slots.max(1)) {
            let before = far(at.saturating_sub(reach)..at, slot);
            let after = far(at..(at + reach).min(frames), slot);
            let noise = noise((0..frames).map(|at| value(slot, at)));
            smaller(&mut least, (noise > 0.0).then(|| before.min(after) / noise));
        }
        least
    }
}

/// The standard deviation of the noise, from the median of second differences; 0 for a value that is exact.
fn noise(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    let mut seconds: Vec<f64> = values
        .iter()
        .zip(values.iter().skip(1))
        .zip(values.iter().skip(2))
        .map(|((one, two), three)| (one - 2.0 * two + three).abs())
        .collect();
    if seconds.is_empty() {
        return 0.0;
    }
    let middle = seconds.len() / 2;
    let (_, median, _) = seconds.select_nth_unstable_by(middle, f64::total_cmp);
    DEVIATIONS * *median / 6.0_f64.sqrt()
}
