//! Curves small enough for a page: a value per frame in, a broken line as text out.
//!
//! The line passes through samples and is nowhere farther from a sample than a bound, so a peak is as high and an edge as steep as it was measured, and
//! what is level or straight costs nothing. Where the line would take too many points, as with noise, a *band* takes the place of each even part: its
//! first, least, greatest and last sample. A page draws no line within a band, since none is known there.
//!
//! As text: for each gap-free piece the number of its items. An item begins with the frames since the last one, doubled, and 1 more for a band; then the
//! change of the value in steps. A band goes on with the frames to its last one, the change to the last value, and how far its least and its greatest value
//! lie beyond the first and the last one. Numbers are written with seven bits a byte (changes in zigzag), all in base64. `curves.js` reads it.

use serde_json::{Value, json};
use std::ops::Range;

/// The steps in the range of a curve that is drawn, and how many times as large the whole range counts at most: numbers stay short.
const LEVELS: f64 = 20_000.0;
const TIMES: f64 = 10_000.0;
/// Changes between true and false that are stored of one condition.
const MAX_TOGGLES: usize = 16_000;
/// The bound, as a share of the range. `curves.js` shows as many digits as it permits.
const BOUND: f64 = 1.0 / 2000.0;
/// The cost of a band, in knots.
const BAND: usize = 4;

/// The limits of a decimation.
#[derive(Clone, Copy, Debug)]
pub struct Decimation {
    /// How far the line may be from a sample, in the unit of the values; at least the two-thousandth part of the range is allowed.
    pub within: f64,
    /// The range of the values that is drawn, where that is less than all of it: shares are of this one.
    pub drawn: Option<f64>,
    /// The kept parts.
    pub keep: DecimationMode,
}

/// The kept parts of a curve.
#[derive(Clone, Copy, Debug)]
pub enum DecimationMode {
    /// A line within the bound if it fits into about this many knots, else bands.
    Knots(usize),
    /// A line within the bound, however long.
    Line,
    /// The samples of the frames that are divisible by a number, and of the first and the last frame of each gap-free piece.
    Every(usize),
}

/// A decimated curve.
pub struct DecimatedCurve {
    /// `{"v":number}` when it is the same everywhere, else `{"a":value of step 0,"s":size of a step,"k":items}`.
    pub json: Value,
    /// Number of knots; a band counts as several.
    pub knots: usize,
    /// The maximum distance of the line from a sample; bands do not count.
    pub off: f64,
}

/// A point of the line: a frame and its value.
type Knot = (usize, f64);

/// The parts of a curve.
#[derive(Clone, Copy, Debug)]
enum Item {
    Knot(Knot),
    /// Frames of which only these are known.
    Band {
        first: Knot,
        last: Knot,
        least: f64,
        greatest: f64,
    },
}

/// Decimates a curve.
pub fn curve(values: &[f64], stretches: &[Range<usize>], decimation: Decimation) -> DecimatedCurve {
    let pieces: Vec<Range<usize>> = stretches.iter().flat_map(|stretch| finite(values, stretch)).collect();
    let samples = || pieces.iter().filter_map(|piece| values.get(piece.clone())).flatten().copied();
    let (least, greatest) = samples().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    let whole = pieces.iter().map(Range::len).sum::<usize>() == stretches.iter().map(Range::len).sum::<usize>();
    if whole && least >= greatest && !pieces.is_empty() {
        return DecimatedCurve { json: json!({ "v": least + 0.0 }), knots: 0, off: 0.0 };
    }
    let range = if greatest > least { (greatest - least).min(f64::MAX) } else { 1.0 };
    let drawn = decimation.drawn.map_or(range, |drawn| drawn.clamp(range / TIMES, range));
    let lines = thin(values, &pieces, decimation.within.max(drawn * BOUND), decimation.keep);
    let (base, step) = (if least.is_finite() { least } else { 0.0 }, drawn / LEVELS);
    let knots = lines.iter().flatten().map(|item| if matches!(item, Item::Knot(_)) { 1 } else { BAND }).sum();
    let off = match decimation.keep {
        DecimationMode::Every(_) => lines.iter().map(|line| farthest(values, line)).fold(0.0, f64::max),
        DecimationMode::Knots(_) | DecimationMode::Line => 0.0,
    };
    DecimatedCurve { json: json!({ "a": base, "s": step, "k": base64(&packed(&lines, base, step)) }), knots, off }
}

/// When a condition holds, as the frames at which it changes: seven bits a byte, the first from 0, in base64. Where it changes too often, pauses up to a
/// number of frames are filled, and the text begins with that number and `~`.
pub fn toggles(holds: &[bool]) -> String {
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
    if pause > 1 { format!("{pause}~{}", base64(&bytes)) } else { base64(&bytes) }
}

/// Formats a number with six decimals.
pub fn rounded(value: f64) -> f64 {
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

fn thin(values: &[f64], pieces: &[Range<usize>], within: f64, keep: DecimationMode) -> Vec<Vec<Item>> {
    let knots = |knots: Vec<Knot>| knots.into_iter().map(Item::Knot).collect::<Vec<Item>>();
    let most = match keep {
        DecimationMode::Every(step) => return pieces.iter().map(|piece| knots(sampled(values, piece, step))).collect(),
        DecimationMode::Line => usize::MAX,
        DecimationMode::Knots(most) => most.max(2 * pieces.len()),
    };
    let lines: Vec<Vec<Knot>> = pieces.iter().map(|piece| line(values, piece, within)).collect();
    if lines.iter().map(Vec::len).sum::<usize>() <= most {
        return lines.into_iter().map(knots).collect();
    }
    let frames: usize = pieces.iter().map(Range::len).sum();
    let step = (BAND * frames).div_ceil(most.max(1));
    pieces.iter().zip(lines).map(|(piece, line)| banded(values, piece, &line, within, step)).collect()
}

/// A line where it takes no more knots than bands of `step` frames would, and such bands elsewhere.
fn banded(values: &[f64], piece: &Range<usize>, knots: &[Knot], within: f64, step: usize) -> Vec<Item> {
    let parts = piece.clone().step_by(step.max(1)).map(|start| start..(start + step.max(1)).min(piece.end));
    let mut knots = knots.iter().peekable();
    let rough: Vec<(Range<usize>, bool)> = parts
        .map(|part| {
            let mut count = 0;
            while knots.next_if(|knot| knot.0 < part.end).is_some() {
                count += 1;
            }
            (part, count > BAND)
        })
        .collect();
    let mut items = Vec::new();
    for run in rough.chunk_by(|a, b| !a.1 && !b.1) {
        let (Some((first, rough)), Some((last, _))) = (run.first(), run.last()) else { continue };
        match band(values, first).filter(|_| *rough) {
            Some(band) => items.push(band),
            None => items.extend(line(values, &(first.start..last.end), within).into_iter().map(Item::Knot)),
        }
    }
    items
}

fn band(values: &[f64], part: &Range<usize>) -> Option<Item> {
    let of = values.get(part.clone())?;
    let (first, last) = ((part.start, *of.first()?), (part.end - 1, *of.last()?));
    let (least, greatest) = of.iter().fold((first.1, first.1), |(a, b), value| (a.min(*value), b.max(*value)));
    Some(Item::Band { first, last, least, greatest })
}

/// The samples of a piece at the frames divisible by `step`, and at its ends.
fn sampled(values: &[f64], piece: &Range<usize>, step: usize) -> Vec<Knot> {
    let ends = [piece.start, piece.end.saturating_sub(1)];
    let kept = piece.clone().filter(|frame| frame % step.max(1) == 0 || ends.contains(frame));
    kept.filter_map(|frame| Some((frame, *values.get(frame)?))).collect()
}

/// Returns the maximum distance of a line of knots from the samples between them.
fn farthest(values: &[f64], items: &[Item]) -> f64 {
    let mut off: f64 = 0.0;
    for pair in items.windows(2) {
        let [Item::Knot(from), Item::Knot(to)] = pair else { continue };
        for (frame, value) in (from.0..to.0).zip(values.get(from.0..to.0).unwrap_or(&[])) {
            let share = (frame - from.0) as f64 / (to.0 - from.0) as f64;
            off = off.max((from.1 + share * (to.1 - from.1) - value).abs());
        }
    }
    off
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

fn packed(lines: &[Vec<Item>], base: f64, step: f64) -> Vec<u8> {
    let level_of = |value: f64| ((value - base) / step).round().clamp(0.0, TIMES * LEVELS) as i64;
    let zigzag = |change: i64| ((change << 1) ^ (change >> 63)).unsigned_abs() as usize;
    let mut bytes = Vec::new();
    let (mut frame, mut level) = (0, 0);
    for line in lines {
        number(&mut bytes, line.len());
        for item in line {
            let (is_band, (at, value)) = match item {
                Item::Knot(knot) => (0, *knot),
                Item::Band { first, .. } => (1, *first),
            };
            let now = level_of(value);
            number(&mut bytes, (at - frame) << 1 | is_band);
            number(&mut bytes, zigzag(now - level));
            (frame, level) = (at, now);
            if let Item::Band { last, least, greatest, .. } = item {
                let end = level_of(last.1);
                number(&mut bytes, last.0 - frame);
                number(&mut bytes, zigzag(end - level));
                number(&mut bytes, (level.min(end) - level_of(*least)).unsigned_abs() as usize);
                number(&mut bytes, (level_of(*greatest) - level.max(end)).unsigned_abs() as usize);
                (frame, level) = (last.0, end);
            }
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
