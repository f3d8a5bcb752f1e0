//! The distance of conditions from their wanted outcomes, frame by frame. It orders the paths to a primitive.
//!
//! The degree of a condition is 0 where it has the wanted outcome, and at most 1. A comparison is short by the distance of its value from the threshold, as a share of
//! the sum of both. All of several conditions are short by the largest degree, one of several by the smallest. A flag is short by 1.

use std::ops::Range;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_engine::inspect::{Column, Inspector};
use teachtree_language::ops::TemporalOperator;
use teachtree_language::rules::{Comparison, Expr, ExprKind, Function};

type Result<T> = std::result::Result<T, InputError>;

/// The shortfall of a path on a frame, in the order in which paths are compared.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
pub(super) struct Shortfall {
    /// Conditions that measure nothing and are the same in the whole log, such as whether it has a channel.
    fixed: usize,
    /// All conditions that would have to come out differently.
    failing: usize,
    /// The sum of their degrees.
    degrees: f64,
}

impl Shortfall {
    /// The sum of what two conditions lack.
    pub fn plus(self, other: Self) -> Self {
        Self {
            fixed: self.fixed + other.fixed,
            failing: self.failing + other.failing,
            degrees: self.degrees + other.degrees,
        }
    }

    fn least(self, other: Self) -> Self {
        if other < self { other } else { self }
    }
}

/// The degree of a condition, and whether it is one that is the same in the whole log; compared in this order.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
struct Degree {
    is_fixed: bool,
    degree: f64,
}

/// One list per slot, one entry per frame.
type Degrees = Vec<Vec<Degree>>;

/// Measures conditions of a tree of a hand, or of the one over both, on some frames of the log.
pub(super) struct ShortfallMeter<'p, 'a> {
    pub inspector: &'p mut Inspector<'a>,
    pub side: Option<Side>,
    pub at: Range<usize>,
}

impl<'a> ShortfallMeter<'_, 'a> {
    /// Returns the shortfall of a condition from its wanted outcome on each frame. A name counts as one condition.
    pub fn of(&mut self, expr: &'a Expr, wanted: bool) -> Result<Vec<Shortfall>> {
        match &expr.kind {
            ExprKind::Not(inner) => self.of(inner, !wanted),
            ExprKind::And(parts) | ExprKind::Or(parts) => {
                let all = matches!(expr.kind, ExprKind::And(_)) == wanted;
                let mut total: Option<Vec<Shortfall>> = None;
                for part in parts {
                    let one = self.of(part, wanted)?;
                    total = Some(match total {
                        None => one,
                        Some(so_far) => {
                            so_far.into_iter().zip(one).map(|(a, b)| if all { a.plus(b) } else { a.least(b) }).collect()
                        }
                    });
                }
                Ok(total.unwrap_or_else(|| vec![Shortfall::default(); self.at.len()]))
            }
            _ => {
                let start = self.inspector.leaves().frames.start;
                let truth = self.inspector.truth(expr, self.side)?;
                let fails: Vec<bool> = self.at.clone().map(|frame| truth.holds(0, frame - start) != wanted).collect();
                if !fails.contains(&true) {
                    return Ok(vec![Shortfall::default(); fails.len()]);
                }
                let degrees = self.degrees(expr, wanted, self.side)?.into_iter().next().unwrap_or_default();
                let flag = Degree { is_fixed: false, degree: 1.0 };
                let degrees = degrees.into_iter().chain(std::iter::repeat(flag));
                let short = |(fails, Degree { is_fixed, degree }): (bool, Degree)| match fails {
                    true => Shortfall { fixed: usize::from(is_fixed), failing: 1, degrees: degree },
                    false => Shortfall::default(),
                };
                Ok(fails.into_iter().zip(degrees).map(short).collect())
            }
        }
    }

    /// The degrees of a condition, in which names are opened.
    fn degrees(&mut self, expr: &'a Expr, wanted: bool, side: Option<Side>) -> Result<Degrees> {
        let rules = self.inspector.rules();
        match &expr.kind {
            ExprKind::Not(inner) => self.degrees(inner, !wanted, side),
            ExprKind::And(parts) | ExprKind::Or(parts) => {
                let all = matches!(expr.kind, ExprKind::And(_)) == wanted;
                let parts: Result<Vec<Degrees>> = parts.iter().map(|part| self.degrees(part, wanted, side)).collect();
                Ok(parts?.into_iter().reduce(|a, b| joined(a, b, all)).unwrap_or_default())
            }
            ExprKind::Signal(id, hand) => match rules.signals.get(id.index()) {
                Some(signal) => self.degrees(&signal.expr, wanted, hand.side(side)),
                None => self.flag(expr, wanted, side),
            },
            ExprKind::Call(function @ (Function::Any | Function::All), args) => match args.first() {
                Some(array) => {
                    let all = (*function == Function::All) == wanted;
                    let slots = self.degrees(array, wanted, side)?.into_iter().map(|slot| vec![slot]);
                    match slots.reduce(|a, b| joined(a, b, all)) {
                        Some(degrees) => Ok(degrees),
                        None => self.flag(expr, wanted, side),
                    }
                }
                None => self.flag(expr, wanted, side),
            },
            ExprKind::Compare(comparison, a, b) if !matches!(comparison, Comparison::Equal | Comparison::NotEqual) => {
                let threshold = self.inspector.column(b, side)?;
                self.compared(expr, a, wanted, side, |slot, frame| threshold.number(slot, frame))
            }
            ExprKind::Hysteresis { value, on, off, .. } => {
                let threshold = if wanted { on.value } else { off.value };
                self.compared(expr, value, wanted, side, |_, _| threshold)
            }
            ExprKind::Temporal(TemporalOperator::Rises | TemporalOperator::Falls, _) => self.flag(expr, wanted, side),
            ExprKind::Temporal(_, inner) => {
                let column = self.inspector.column(expr, side)?;
                let now = self.degrees(inner, wanted, side)?;
                let degree = |slot: usize, frame: usize, at: usize| {
                    let inner = now.get(slot).and_then(|slot| slot.get(at)).copied().unwrap_or_default();
                    match column.holds(slot, frame) == wanted {
                        true => Degree::default(),
                        // The condition has its wanted outcome, but not for long enough.
                        false if inner.degree == 0.0 => Degree { is_fixed: false, degree: 1.0 },
                        false => inner,
                    }
                };
                Ok(self.each(column.slots(), degree))
            }
            _ => self.flag(expr, wanted, side),
        }
    }

    /// The degrees of a comparison of a number.
    fn compared(
        &mut self,
        expr: &'a Expr,
        value: &'a Expr,
        wanted: bool,
        side: Option<Side>,
        threshold: impl Fn(usize, usize) -> f64,
    ) -> Result<Degrees> {
        let (column, values) = (self.inspector.column(expr, side)?, self.inspector.column(value, side)?);
        let slot_of = |column: &Column, slot: usize| if column.is_array() { slot } else { 0 };
        let degree = |slot: usize, frame: usize, _: usize| {
            if column.holds(slot, frame) == wanted {
                return Degree::default();
            }
            let (value, threshold) = (values.number(slot_of(&values, slot), frame), threshold(slot, frame));
            let share = (value - threshold).abs() / (value.abs() + threshold.abs());
            Degree { is_fixed: false, degree: if share.is_finite() { share } else { 1.0 } }
        };
        Ok(self.each(column.slots(), degree))
    }

    /// The degrees of a condition that measures nothing.
    fn flag(&mut self, expr: &'a Expr, wanted: bool, side: Option<Side>) -> Result<Degrees> {
        let column = self.inspector.column(expr, side)?;
        let frames = self.inspector.leaves().frames.len();
        let is_fixed: Vec<bool> =
            (0..column.slots()).map(|slot| (0..frames).all(|frame| column.holds(slot, frame) != wanted)).collect();
        let degree = |slot: usize, frame: usize, _: usize| match column.holds(slot, frame) == wanted {
            true => Degree::default(),
            false => Degree { is_fixed: is_fixed.get(slot).copied().unwrap_or(false), degree: 1.0 },
        };
        Ok(self.each(column.slots(), degree))
    }

    /// Returns a degree for each slot and frame, by the slot, the frame of the stretch, and its index among the requested frames.
    fn each(&self, slots: usize, degree: impl Fn(usize, usize, usize) -> Degree) -> Degrees {
        let start = self.inspector.leaves().frames.start;
        let of_slot = |slot: usize| {
            self.at.clone().enumerate().map(|(at, frame)| degree(slot, frame - start, at)).collect::<Vec<Degree>>()
        };
        (0..slots).map(of_slot).collect()
    }
}

/// The degrees of all of two conditions, or of one of them. A condition without slots is the same in each slot of the other.
fn joined(a: Degrees, b: Degrees, all: bool) -> Degrees {
    let (a, b) = if a.len() < b.len() { (b, a) } else { (a, b) };
    let of = |slot: usize| if b.len() == 1 { b.first() } else { b.get(slot) };
    let join = |(slot, degrees): (usize, Vec<Degree>)| {
        let others = of(slot).into_iter().flatten().copied();
        let one = |(a, b): (Degree, Degree)| if (a < b) == all { b } else { a };
        degrees.into_iter().zip(others).map(one).collect()
    };
    a.into_iter().enumerate().map(join).collect()
}
