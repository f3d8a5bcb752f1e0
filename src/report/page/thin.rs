//! Curves small enough for a page: a value per frame in, a broken line as text out.
//!
//! The line goes through samples and is nowhere farther from a sample than a bound, so that a peak is as high and an edge as steep as it was
//! measured, and what is level or straight costs nothing. Where the bound would have to be coarse to be small, as with plain noise, the least
//! and the greatest sample of even steps are taken instead.
//!
//! As text: for each gap-free piece the number of its knots, then for each knot the frames since the last one and the change of the value in
//! steps, as numbers of seven bits a byte (the changes in zigzag), all in base64. `curves.js` reads it.

use serde_json::{Value, json};
use std::ops::Range;

/// The steps in the range of a curve that is drawn, and how many times as large the whole range counts at most: numbers stay short.
const LEVELS: f64 = 20_000.0;
const TIMES: f64 = 10_000.0;
/// Changes between true and false that are told of one curve.
const MAX_TOGGLES: usize = 4000;
/// The bound that is tried first, and the coarsest, as shares of the range.
const FINEST: f64 = 1.0 / 2000.0;
const COARSEST: f64 = 1.0 / 125.0;

/// How much may be lost, and how much may be kept.
#[derive(Clone, Copy, Debug)]
pub(super) struct Thinning {
    /// How far the line may be from a sample, in the unit of the values; at least the two-thousandth part of the range is allowed.
    pub within: f64,
    /// The range of the values that is drawn, where that is less than all of it: shares are of this one.
    pub drawn: Option<f64>,
    /// How many knots there may be, about.
    pub most: usize,
}

/// A point of the line: a frame and its value.
type Knot = (usize, f64);

/// The curve as JSON: `{"v":number}` when it is the same everywhere, else `{"a":value of step 0,"s":size of a step,"k":knots}`.
pub(super) fn curve(values: &[f64], stretches: &[Range<usize>], thinning: Thinning) -> Value {
    let pieces: Vec<Range<usize>> = stretches.iter().flat_map(|stretch| finite(values, stretch)).collect();
    let samples = || pieces.iter().filter_map(|piece| values.get(piece.clone())).flatten().copied();
    let (least, greatest) = samples().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    let whole = pieces.iter().map(Range::len).sum::<usize>() == stretches.iter().map(Range::len).sum::<usize>();
    if whole && least >= greatest && !pieces.is_empty() {
        return json!({ "v": least + 0.0 });
    }
    let range = if greatest > least { (greatest - least).min(f64::MAX) } else { 1.0 };
    let drawn = thinning.drawn.map_or(range, |drawn| drawn.clamp(range / TIMES, range));
    let lines: Vec<Vec<Knot>> = thin(values, &pieces, drawn, thinning);
    let (base, step) = (if least.is_finite() { least } else { 0.0 }, drawn / LEVELS);
    json!({ "a": base, "s": step, "k": base64(&packed(&lines, base, step)) })
}

/// When something is so, as the frames at which it changes: seven bits a byte, the first from 0, in base64. What flickers without end is
/// taken to be so in between.
pub(super) fn toggles(holds: &[bool]) -> String {
    let before = [false].into_iter().chain(holds.iter().copied());
    let changes = before.zip(holds).enumerate().filter(|(_, (before, now))| before != *now).map(|(frame, _)| frame);
    let mut changes: Vec<usize> = changes.collect();
    let mut pause = 1;
    while changes.len() > MAX_TOGGLES {
        pause *= 2;
        // Every second change is an end; with the beginning after it, it goes where the pause is short.
        let mut kept: Vec<usize> = Vec::new();
        for (at, change) in changes.into_iter().enumerate() {
            match kept.last() {
                Some(end) if at % 2 == 0 && change - end < pause => _ = kept.pop(),
                _ => kept.push(change),
            }
        }
        changes = kept;
    }
    let mut bytes = Vec::new();
    let mut last = 0;
    for change in changes {
        number(&mut bytes, change - last);
        last = change;
    }
    base64(&bytes)
}

/// A number to a millionth, as it is written.
pub(super) fn rounded(value: f64) -> f64 {
    let rounded = (value * 1e6).round() / 1e6;
    if rounded.is_finite() { rounded + 0.0 } else { 0.0 }
}

/// The parts of a stretch in which there are values.
fn finite(values: &[f64], stretch: &Range<usize>) -> Vec<Range<usize>> {
    let mut pieces = Vec::new();
    let mut start = stretch.start;
    let of = values.get(stretch.clone()).unwrap_or(&[]);
    for run in of.chunk_by(|a, b| a.is_finite() == b.is_finite()) {
        if run.first().is_some_and(|value| value.is_finite()) {
            pieces.push(start..start + run.len());
        }
        start += run.len();
    }
    pieces
}

fn thin(values: &[f64], pieces: &[Range<usize>], range: f64, thinning: Thinning) -> Vec<Vec<Knot>> {
    let mut within = thinning.within.max(range * FINEST);
    loop {
        let lines: Vec<Vec<Knot>> = pieces.iter().map(|piece| line(values, piece, within)).collect();
        if lines.iter().map(Vec::len).sum::<usize>() <= thinning.most.max(2 * pieces.len()) {
            return lines;
        }
        within *= 2.0;
        if within > (range * COARSEST).max(thinning.within) {
            let frames: usize = pieces.iter().map(Range::len).sum();
            let step = (2 * frames).div_ceil(thinning.most.max(2));
            return pieces.iter().map(|piece| extremes(values, piece, step)).collect();
        }
    }
}

/// A line through samples that passes every sample `within` a bound. From each knot on, the slopes that do so are a fan, which each sample
/// narrows; the first sample that lies outside it makes the one before it a knot.
fn line(values: &[f64], piece: &Range<usize>, within: f64) -> Vec<Knot> {
    let mut knots = Vec::new();
    let samples = piece.clone().zip(values.get(piece.clone()).unwrap_or(&[]).iter().copied());
    let (mut lowest, mut highest) = (f64::NEG_INFINITY, f64::INFINITY);
    let mut last: Option<Knot> = None;
    for (frame, value) in samples {
        let Some(before) = last.replace((frame, value)) else {
            knots.push((frame, value));
            continue;
        };
        let Some(mut knot) = knots.last().copied() else { continue };
        let slope = |to: f64, knot: Knot| (to - knot.1) / (frame - knot.0) as f64;
        if !(lowest..=highest).contains(&slope(value, knot)) {
            knots.push(before);
            knot = before;
            (lowest, highest) = (f64::NEG_INFINITY, f64::INFINITY);
        }
        lowest = lowest.max(slope(value - within, knot));
        highest = highest.min(slope(value + within, knot));
    }
    knots.extend(last.filter(|last| knots.last().is_some_and(|knot| knot.0 < last.0)));
    knots
}

/// The least and the greatest sample of each `step` frames, as they come.
fn extremes(values: &[f64], piece: &Range<usize>, step: usize) -> Vec<Knot> {
    let mut knots: Vec<Knot> = Vec::new();
    let samples: Vec<Knot> = piece.clone().zip(values.get(piece.clone()).unwrap_or(&[]).iter().copied()).collect();
    for part in samples.chunks(step.max(1)) {
        let by_value = |a: &&Knot, b: &&Knot| a.1.total_cmp(&b.1);
        let least = part.iter().min_by(by_value).copied();
        let greatest = part.iter().max_by(by_value).copied();
        let mut ends: Vec<Knot> = least.into_iter().chain(greatest).collect();
        ends.sort_by_key(|knot| knot.0);
        ends.dedup_by_key(|knot| knot.0);
        knots.extend(ends);
    }
    // The line ends where the piece does.
    knots.extend(samples.last().filter(|last| knots.last().is_some_and(|knot| knot.0 < last.0)));
    knots
}

fn packed(lines: &[Vec<Knot>], base: f64, step: f64) -> Vec<u8> {
    let mut bytes = Vec::new();
    let (mut frame, mut level) = (0, 0);
    for line in lines {
        number(&mut bytes, line.len());
        for (at, value) in line {
            let now = ((value - base) / step).round().clamp(0.0, TIMES * LEVELS) as i64;
            let change = now - level;
            number(&mut bytes, at - frame);
            number(&mut bytes, ((change << 1) ^ (change >> 63)).unsigned_abs() as usize);
            (frame, level) = (*at, now);
        }
    }
    bytes
}

fn number(bytes: &mut Vec<u8>, mut value: usize) {
    while value >= 0x80 {
        bytes.push(0x80 | (value & 0x7f) as u8);
        value >>= 7;
    }
    bytes.push(value as u8);
}

fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let bits = (0..3).fold(0_u32, |bits, at| bits << 8 | u32::from(three.get(at).copied().unwrap_or(0)));
        for place in 0..4 {
            let letter = LETTERS.get((bits >> (18 - 6 * place) & 63) as usize).copied().unwrap_or(b'A');
            text.push(if place <= three.len() { char::from(letter) } else { '=' });
        }
    }
    text
}
