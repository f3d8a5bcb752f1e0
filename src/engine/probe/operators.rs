//! Operators with memory, and functions, over columns.

use super::column::Column;
use crate::language::rules::{Arithmetic, Function, Window};

pub const fn bit(value: bool) -> f64 {
    if value { 1.0 } else { 0.0 }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).reduce(|sum, product| sum + product).unwrap_or(0.0)
}

fn norm(vector: &[f64]) -> f64 {
    dot(vector, vector).sqrt()
}

fn first(numbers: &[f64]) -> f64 {
    numbers.first().copied().unwrap_or(0.0)
}

/// `a op b`, component by component; a scalar beside a vector is used for each component.
pub fn arithmetic(operation: Arithmetic, a: &Column, b: &Column) -> Column {
    let width = a.width().max(b.width());
    a.with(b, width, |a, b, out| {
        let component = |numbers: &[f64], at: usize| numbers.get(at).copied().unwrap_or_else(|| first(numbers));
        out.extend((0..width).map(|at| operation.apply(component(a, at), component(b, at))));
    })
}

/// `above on until below off`, and the other way round; `begins` is the frame on which memory began, for each frame.
pub fn hysteresis(value: &Column, on: f64, off: f64, rising: bool, begins: &[usize]) -> Column {
    value.each_slot(1, |slot| {
        let mut state = false;
        let step = |(frame, value): (usize, &f64)| {
            let (beyond, back) = if rising { (*value > on, *value < off) } else { (*value < on, *value > off) };
            let kept = state && begins.get(frame) != Some(&frame) && !back;
            state = beyond || kept;
            bit(state)
        };
        slot.iter().enumerate().map(step).collect()
    })
}

/// `for`, `within last` and `within next` over `n` frames.
pub fn window(window: Window, condition: &Column, n: usize, begins: &[usize]) -> Column {
    condition.each_slot(1, |slot| {
        let held = |frame: usize| slot.get(frame).is_some_and(|value| *value > 0.5);
        match window {
            Window::WithinNext => {
                let mut next = None;
                let mut out: Vec<f64> = (0..slot.len())
                    .rev()
                    .map(|frame| {
                        next = if held(frame) { Some(frame) } else { next };
                        bit(next.is_some_and(|next| next - frame < n))
                    })
                    .collect();
                out.reverse();
                out
            }
            Window::For | Window::WithinLast => {
                let mut run = 0;
                let mut last = None;
                let step = |frame: usize| {
                    let begin = begins.get(frame).copied().unwrap_or(0);
                    run = if !held(frame) { 0 } else { 1 + if frame == begin { 0 } else { run } };
                    last = if held(frame) { Some(frame) } else { last };
                    let recent = last.is_some_and(|last| last >= begin && frame - last < n);
                    bit(if window == Window::For { run >= n } else { recent })
                };
                (0..slot.len()).map(step).collect()
            }
        }
    })
}

/// The difference over `n` frames per second; 0 until `n` frames have passed.
pub fn rate(number: &Column, n: usize, span_s: f64, begins: &[usize]) -> Column {
    let width = number.width();
    number.each_slot(width, |slot| {
        let step = |(at, now): (usize, &f64)| {
            let frame = at / width;
            let begin = begins.get(frame).copied().unwrap_or(0);
            let then = at.checked_sub(n * width).filter(|_| frame >= begin + n).and_then(|at| slot.get(at));
            then.map_or(0.0, |then| (now - then) / span_s)
        };
        slot.iter().enumerate().map(step).collect()
    })
}

/// `rises` and `falls`.
pub fn edge(condition: &Column, rises: bool, begins: &[usize]) -> Column {
    condition.each_slot(1, |slot| {
        let step = |(frame, now): (usize, &f64)| {
            let before = frame.checked_sub(1).and_then(|before| slot.get(before));
            let apart = before.is_some_and(|before| (*before > 0.5) != rises);
            bit((*now > 0.5) == rises && apart && begins.get(frame) != Some(&frame))
        };
        slot.iter().enumerate().map(step).collect()
    })
}

/// A function of the language.
pub fn call(function: Function, args: &[&Column], len: usize) -> Column {
    let nowhere = Column::constant(&[0.0], len);
    let a = args.first().copied().unwrap_or(&nowhere);
    let b = args.get(1).copied();
    match (function, b) {
        (Function::Abs, _) => a.each(a.width(), |a, out| out.extend(a.iter().map(|number| number.abs()))),
        (Function::Norm, _) => a.each(1, |a, out| out.push(norm(a))),
        (Function::Dot, Some(b)) => a.with(b, 1, |a, b, out| out.push(dot(a, b))),
        (Function::Tangential, Some(b)) => a.with(b, 3, |v, n, out| {
            let along = dot(v, n);
            out.extend(v.iter().zip(n).map(|(v, n)| v - n * along));
        }),
        (Function::Sum, _) => a.sum(len),
        (Function::Mean, _) => {
            #[allow(clippy::cast_precision_loss, reason = "a handful of slots")]
            let count = a.slots().max(1) as f64;
            a.sum(len).each(a.width(), |sum, out| out.extend(sum.iter().map(|sum| sum / count)))
        }
        (Function::Min, Some(b)) => a.with(b, 1, |a, b, out| out.push(first(a).min(first(b)))),
        (Function::Max, Some(b)) => a.with(b, 1, |a, b, out| out.push(first(a).max(first(b)))),
        (Function::Min, None) => a.fold(len, |slots| slots.fold(f64::INFINITY, f64::min)),
        (Function::Max, None) => a.fold(len, |slots| slots.fold(f64::NEG_INFINITY, f64::max)),
        (Function::Count, _) => a.fold(len, |slots| slots.map(|slot| bit(slot > 0.5)).sum()),
        (Function::Any, _) => a.fold(len, |slots| slots.map(|slot| bit(slot > 0.5)).fold(0.0, f64::max)),
        (Function::All, _) => a.fold(len, |slots| slots.map(|slot| bit(slot > 0.5)).fold(1.0, f64::min)),
        (Function::SqueezeOf, Some(b)) => {
            let (ours, theirs) = (a.clone().into_slots(), b.clone().into_slots());
            let forces = Column::new(3, true, ours.into_iter().chain(theirs).collect());
            let norms = forces.each(1, |force, out| out.push(norm(force))).sum(len);
            norms.with(&forces.sum(len), 1, |norms, total, out| out.push((first(norms) - norm(total)) / 2.0))
        }
        (Function::Dot | Function::Tangential | Function::SqueezeOf, None) => nowhere,
    }
}
