//! The range of a plot's scale, computed from the values of its curves; a spike of a few frames does not extend it.
//!
//! What is brief and rare may lie outside of the scale, where it would more than double it; plots mark the place and print its largest value.

use std::collections::VecDeque;

/// Rare: this share of the frames of a curve, or one.
const RARE: f64 = 0.002;
/// Brief: no longer than this, or one frame, s.
const BRIEF_S: f64 = 0.05;

/// A little: this share of the length of the scale.
const LITTLE: f64 = 0.25;

/// The range of a plot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    /// The least value that belongs to the scale.
    pub least: f64,
    /// The greatest one.
    pub greatest: f64,
    /// Whether a curve has values outside of it.
    pub left: bool,
}

/// The scale of curves, a value a frame each, that holds all of `also`: thresholds, or zero. `None` when there is no finite value.
pub(super) fn scale<'v>(curves: impl Iterator<Item = &'v [f64]> + Clone, also: &[f64], rate_hz: f64) -> Option<Scale> {
    let (mut whole, mut usual) = (Range::new(also), Range::new(also));
    for curve in curves.clone() {
        let finite = || curve.iter().copied().filter(|value| value.is_finite());
        whole = whole.with(finite());
        let lasting = [lasting(curve, 1.0, rate_hz), lasting(curve, -1.0, rate_hz)];
        usual = usual.with(lasting.into_iter().flatten());
    }
    if whole.least > whole.greatest {
        return None;
    }
    // The scale of another constant curve is its own height; a curve of spikes only is not scaled.
    let length = match usual.greatest - usual.least {
        length if length > 0.0 => length,
        _ => usual.greatest.abs(),
    };
    let mut scale = Scale { least: whole.least, greatest: whole.greatest, left: false };
    let [above, below] =
        [whole.greatest - usual.greatest, usual.least - whole.least].map(|out| length > 0.0 && out > length);
    // A value slightly outside, such as the tip of a peak that lasts, belongs to the scale.
    let (low, high) = (usual.least - LITTLE * length, usual.greatest + LITTLE * length);
    let near = usual.with(curves.flatten().copied().filter(|value| (low..=high).contains(value)));
    if above {
        (scale.greatest, scale.left) = (near.greatest, true);
    }
    if below {
        (scale.least, scale.left) = (near.least, true);
    }
    Some(scale)
}

#[derive(Clone, Copy)]
struct Range {
    least: f64,
    greatest: f64,
}

impl Range {
    fn new(values: &[f64]) -> Self {
        Self { least: f64::INFINITY, greatest: f64::NEG_INFINITY }.with(values.iter().copied())
    }

    fn with(self, values: impl Iterator<Item = f64>) -> Self {
        values.fold(self, |Self { least, greatest }, value| Self {
            least: least.min(value),
            greatest: greatest.max(value),
        })
    }
}

/// The greatest value (`sign` 1) or the least one (-1) of a curve that is exceeded so rarely and so briefly that what exceeds it may be left out.
fn lasting(curve: &[f64], sign: f64, rate_hz: f64) -> Option<f64> {
    let mut values: Vec<f64> = curve.iter().filter(|value| value.is_finite()).map(|value| sign * value).collect();
    let rare = (RARE * values.len() as f64).ceil() as usize;
    let last = values.len().checked_sub(1)?;
    let (_, common, _) = values.select_nth_unstable_by(last - rare.min(last), f64::total_cmp);
    let brief = (BRIEF_S * rate_hz) as usize;
    let held = held(curve.iter().map(|value| sign * value), brief.max(1) + 1);
    Some(sign * common.max(held))
}

/// Returns the greatest value that is reached or exceeded in `frames` consecutive frames.
fn held(values: impl Iterator<Item = f64>, frames: usize) -> f64 {
    // The frames that may yet be the least of their window, values ascending.
    let mut window: VecDeque<(usize, f64)> = VecDeque::new();
    let mut greatest = f64::NEG_INFINITY;
    for (frame, value) in values.enumerate() {
        let value = if value.is_finite() { value } else { f64::NEG_INFINITY };
        while window.back().is_some_and(|(_, back)| *back >= value) {
            window.pop_back();
        }
        window.push_back((frame, value));
        while window.front().is_some_and(|(first, _)| first + frames <= frame) {
            window.pop_front();
        }
        if let Some((_, least)) = window.front().filter(|_| frame + 1 >= frames) {
            greatest = greatest.max(*least);
        }
    }
    greatest
}
