//! Loops over a block that the compiler turns into vector instructions. They are inlined into [`super::columns::Columns::run`], which is compiled
//! once for every instruction set of the processor family and picks one at run time; no product is fused with a sum, so all give the same bits.

use super::bits::{Bits, WORDS};
use crate::language::rules::Comparison;

/// One side of a comparison.
#[derive(Clone, Copy)]
pub enum Side<'a> {
    /// A number per frame.
    Column(&'a [f64]),
    /// The same on every frame.
    Constant(f64),
}

/// `f(a)`.
#[inline(always)]
pub fn map(a: &[f64], out: &mut [f64], f: impl Fn(f64) -> f64) {
    for (out, a) in out.iter_mut().zip(a) {
        *out = f(*a);
    }
}

/// `f(a, b)`.
#[inline(always)]
pub fn zip(a: &[f64], b: &[f64], out: &mut [f64], f: impl Fn(f64, f64) -> f64) {
    for ((out, a), b) in out.iter_mut().zip(a).zip(b) {
        *out = f(*a, *b);
    }
}

/// `f(x² + y² + z²)`.
#[inline(always)]
pub fn squares([x, y, z]: [&[f64]; 3], out: &mut [f64], f: impl Fn(f64) -> f64) {
    for (((out, x), y), z) in out.iter_mut().zip(x).zip(y).zip(z) {
        *out = f(x * x + y * y + z * z);
    }
}

/// `a op b`, a bit a frame.
#[inline(always)]
pub fn compare(comparison: Comparison, a: &[f64], b: Side<'_>, out: &mut Bits) {
    match comparison {
        Comparison::Less => test(a, b, out, |a, b| a < b),
        Comparison::LessEqual => test(a, b, out, |a, b| a <= b),
        Comparison::Greater => test(a, b, out, |a, b| a > b),
        Comparison::GreaterEqual => test(a, b, out, |a, b| a >= b),
        Comparison::Equal | Comparison::NotEqual => test(a, b, out, |a, b| comparison.holds(a, b)),
    }
}

#[inline(always)]
fn test(a: &[f64], b: Side<'_>, out: &mut Bits, f: impl Fn(f64, f64) -> bool) {
    match b {
        Side::Constant(b) => {
            for (out, a) in out.iter_mut().zip(a.chunks(64)) {
                *out = word(a, a, |a, _| f(a, b));
            }
        }
        Side::Column(b) => {
            for ((out, a), b) in out.iter_mut().zip(a.chunks(64)).zip(b.chunks(64)) {
                *out = word(a, b, &f);
            }
        }
    }
}

/// Up to 64 tests as a word. Each of eight lanes gathers every eighth bit, so that nothing goes from lane to lane but at the end.
#[inline(always)]
fn word(a: &[f64], b: &[f64], f: impl Fn(f64, f64) -> bool) -> u64 {
    let (Ok(a), Ok(b)) = (<&[f64; 64]>::try_from(a), <&[f64; 64]>::try_from(b)) else {
        return a.iter().zip(b).enumerate().fold(0, |word, (at, (a, b))| word | u64::from(f(*a, *b)) << at);
    };
    let mut lanes = [0_u64; 8];
    let mut row = 0;
    while row < 64 {
        let mut lane = 0;
        while lane < 8 {
            lanes[lane] |= u64::from(f(a[row + lane], b[row + lane])) << (row + lane);
            lane += 1;
        }
        row += 8;
    }
    let [a, b, c, d, e, f, g, h] = lanes;
    a | b | c | d | e | f | g | h
}

/// Whether at least `wanted` of these bits are set, frame by frame; at most 255 of them.
#[inline(always)]
pub fn at_least<'a>(conditions: impl Iterator<Item = &'a Bits> + Clone, wanted: u32, out: &mut Bits) {
    for (word, out) in out.iter_mut().enumerate().take(WORDS) {
        // The counts of 64 frames, in binary: one word a digit.
        let mut digits = [0_u64; 8];
        for condition in conditions.clone() {
            let mut carry = condition[word];
            for digit in &mut digits {
                (*digit, carry) = (*digit ^ carry, *digit & carry);
            }
        }
        let (mut more, mut same) = (0, u64::MAX);
        for (place, digit) in digits.iter().enumerate().rev() {
            if wanted >> place & 1 != 0 {
                same &= digit;
            } else {
                more |= same & digit;
                same &= !digit;
            }
        }
        *out = more | same;
    }
}
