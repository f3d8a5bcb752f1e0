//! Numbers over time, literally.
//!
//! Sums are rounded after each addition, so it is a part of the definition in which order samples are added: those since a condition began from the first
//! to the last; the last `n` in two parts, with frames counted from the beginning of the memory and cut into pieces of `n`: the part that lies in an earlier
//! piece from its last sample to its first, the other one from its first to its last, and then both together.

use super::{Reference, Result, Value, arithmetic, each, numbers, pairs, scalar, truth};
use crate::semantics::samples;
use teachtree_base::hands::Side;
use teachtree_language::ops::{Samples, Summary};
use teachtree_language::rules::{Arithmetic, Constant, Expr};

impl Reference<'_> {
    pub(super) fn summary(
        &self,
        summary: Summary,
        value: &Expr,
        of: &Samples<Constant, Box<Expr>>,
        this: Option<Side>,
        frame: usize,
    ) -> Result<Value> {
        match of {
            Samples::Last(duration) => {
                let n = samples(duration.value, self.frames.layout.rate_hz)? as usize;
                let beginning = self.beginning(&[value], this, frame);
                let first = (frame + 1).saturating_sub(n).max(beginning);
                let piece = beginning + (frame - beginning) / n * n;
                let sample = |at: usize| self.sample(value, this, at);
                if summary == Summary::Earliest {
                    return sample(first);
                }
                let now = self.together(summary, (piece..=frame).map(sample))?;
                let before =
                    if first < piece { self.together(summary, (first..piece).rev().map(sample))? } else { None };
                let all = match (before, now) {
                    (Some(before), Some(now)) => self.joined(summary, &before, &now),
                    (_, Some(now)) => now,
                    (_, None) => sample(frame)?,
                };
                Ok(self.result(summary, &all, frame + 1 - first))
            }
            Samples::Since(condition) => self.since(summary, value, condition, this, frame),
        }
    }

    /// Slot by slot: the condition may have begun on different frames.
    fn since(
        &self,
        summary: Summary,
        value: &Expr,
        condition: &Expr,
        this: Option<Side>,
        frame: usize,
    ) -> Result<Value> {
        let beginning = self.beginning(&[value, condition], this, frame);
        let mut slots = Vec::new();
        let now = pairs(&self.sample(value, this, frame)?, &self.value(condition, this, frame)?, &|now, _| now.clone());
        let count = if let Value::Array(slots) = &now { slots.len() } else { 1 };
        for slot in 0..count {
            let holds = |at: usize| Ok::<bool, _>(truth(&in_slot(&self.value(condition, this, at)?, slot)));
            let mut begin = None;
            for at in (beginning..=frame).rev() {
                if holds(at)? && (at == beginning || !holds(at - 1)?) {
                    begin = Some(at);
                    break;
                }
            }
            let sample = |at: usize| Ok(in_slot(&self.sample(value, this, at)?, slot));
            slots.push(match begin {
                None if summary == Summary::Integral => numbers(&in_slot(&now, slot), |_| 0.0),
                None => in_slot(&now, slot),
                Some(begin) if summary == Summary::Earliest => sample(begin)?,
                Some(begin) => {
                    let all = self.together(summary, (begin..=frame).map(sample))?;
                    all.map_or_else(|| in_slot(&now, slot), |all| self.result(summary, &all, frame + 1 - begin))
                }
            });
        }
        Ok(match now {
            Value::Array(_) => Value::Array(slots),
            _ => slots.pop().unwrap_or(now),
        })
    }

    /// A number on a frame; of a condition 1 where it holds, 0 elsewhere.
    fn sample(&self, expr: &Expr, this: Option<Side>, frame: usize) -> Result<Value> {
        Ok(each(&self.value(expr, this, frame)?, &|value| match value {
            Value::Bool(holds) => Value::Number(if *holds { 1.0 } else { 0.0 }),
            other => other.clone(),
        }))
    }

    fn together(&self, summary: Summary, samples: impl Iterator<Item = Result<Value>>) -> Result<Option<Value>> {
        let mut all: Option<Value> = None;
        for sample in samples {
            let sample = sample?;
            all = Some(match all {
                Some(all) => self.joined(summary, &all, &sample),
                None => sample,
            });
        }
        Ok(all)
    }

    fn joined(&self, summary: Summary, one: &Value, other: &Value) -> Value {
        pairs(one, other, &|one, other| match summary {
            Summary::Mean | Summary::Integral => arithmetic(Arithmetic::Add, one, other),
            Summary::Min => Value::Number(scalar(one).min(scalar(other))),
            Summary::Max => Value::Number(scalar(one).max(scalar(other))),
            Summary::Earliest => one.clone(),
        })
    }

    fn result(&self, summary: Summary, all: &Value, count: usize) -> Value {
        #[allow(clippy::cast_precision_loss, reason = "no log has 2^53 frames")]
        let divisor = match summary {
            Summary::Mean => count as f64,
            Summary::Integral => self.frames.layout.rate_hz,
            Summary::Min | Summary::Max | Summary::Earliest => return all.clone(),
        };
        let divisor = Value::Number(divisor);
        each(all, &|all| arithmetic(Arithmetic::Divide, all, &divisor))
    }
}

/// A slot of an array; a single value is that of every slot.
fn in_slot(value: &Value, slot: usize) -> Value {
    match value {
        Value::Array(slots) => slots.get(slot).cloned().unwrap_or(Value::Number(0.0)),
        one => one.clone(),
    }
}
