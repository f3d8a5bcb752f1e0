//! Comparisons with constants that are cheaper than they are written, and say exactly the same: no root of a norm, no number for a count.

use super::Instantiation;
use crate::compiled::plan::{BitId, Condition, Number, NumberId};
use std::ops::RangeInclusive;
use teachtree_language::graph::FloatBits;
use teachtree_language::rules::Comparison;

/// The largest number of conditions that is counted in binary digits.
const COUNTED: usize = 255;
/// Between these, the square of a number has all its digits.
const SQUARES: RangeInclusive<f64> = 1e-150..=1e150;

impl Instantiation<'_> {
    /// `a op b`.
    pub(super) fn compare(&mut self, comparison: Comparison, a: NumberId, b: NumberId) -> BitId {
        let ([a, b], delay) = self.together([a, b]);
        let number = |id: NumberId| self.plan.numbers[id.index()].0.clone();
        let (towards, number, constant) = match (number(a), number(b)) {
            (Number::Constant(_), Number::Constant(_)) => return self.bit(Condition::Compare(comparison, a, b), delay),
            (number, Number::Constant(constant)) => (comparison, number, constant.get()),
            (Number::Constant(constant), number) => (comparison.swapped(), number, constant.get()),
            _ => return self.bit(Condition::Compare(comparison, a, b), delay),
        };
        let simpler = match number {
            Number::Norm(vector) => squared(towards, constant).map(|threshold| {
                self.bit(Condition::NormSquaredCmp(towards, vector, FloatBits::new(threshold)), delay)
            }),
            Number::Count(conditions) if conditions.len() <= COUNTED => {
                self.counted(towards, &conditions, constant, delay)
            }
            _ => None,
        };
        simpler.unwrap_or_else(|| self.bit(Condition::Compare(comparison, a, b), delay))
    }

    /// Returns the comparison of a count of conditions with a constant.
    fn counted(&mut self, comparison: Comparison, conditions: &[BitId], constant: f64, delay: u32) -> Option<BitId> {
        let at_least = match comparison {
            Comparison::GreaterEqual | Comparison::Less => constant.ceil(),
            Comparison::Greater | Comparison::LessEqual => constant.floor() + 1.0,
            Comparison::Equal | Comparison::NotEqual => return None,
        };
        if at_least.is_nan() {
            return None;
        }
        let wanted = at_least.clamp(0.0, conditions.len() as f64 + 1.0) as usize;
        let enough = match wanted {
            0 => Condition::Constant(true),
            1 => Condition::Or(conditions.to_vec()),
            all if all == conditions.len() => Condition::And(conditions.to_vec()),
            more if more > conditions.len() => Condition::Constant(false),
            some => Condition::AtLeast(conditions.to_vec(), u32::try_from(some).ok()?),
        };
        let enough = self.bit(enough, delay);
        let is = matches!(comparison, Comparison::GreaterEqual | Comparison::Greater);
        Some(if is { enough } else { self.bit(Condition::Not(enough), delay) })
    }
}

/// The threshold on the square that compares as this one on the root: roots are rounded, so it is the last or the first number whose root does.
fn squared(comparison: Comparison, threshold: f64) -> Option<f64> {
    if threshold != 0.0 && !SQUARES.contains(&threshold) {
        return None;
    }
    let mut square = threshold * threshold;
    match comparison {
        // The largest square whose root is not above.
        Comparison::Greater | Comparison::LessEqual => {
            while square.sqrt() > threshold {
                square = square.next_down();
            }
            while square.next_up().sqrt() <= threshold {
                square = square.next_up();
            }
        }
        // The smallest square whose root is not below.
        Comparison::GreaterEqual | Comparison::Less => {
            while square.sqrt() < threshold {
                square = square.next_up();
            }
            while square > 0.0 && square.next_down().sqrt() >= threshold {
                square = square.next_down();
            }
        }
        Comparison::Equal | Comparison::NotEqual => return None,
    }
    Some(square)
}
