//! Series of conditions, one value a millisecond, and the cleaning that needs the future.

use std::ops::Range;

/// Returns the intervals of equal values, in order.
pub(super) fn runs<T: PartialEq>(series: &[T]) -> Vec<Range<usize>> {
    let mut start = 0;
    let chunks = series.chunk_by(|one, next| one == next);
    chunks
        .map(|chunk| {
            let run = start..start + chunk.len();
            start = run.end;
            run
        })
        .collect()
}

/// Bridges gaps shorter than `bridge`, then removes intervals shorter than `blip`. Intervals at the ends of the series stay.
pub(super) fn debounce(series: &mut [bool], bridge: usize, blip: usize) {
    for (value, shortest) in [(false, bridge), (true, blip)] {
        for run in runs(series) {
            let inner = run.start > 0 && run.end < series.len();
            if inner && series[run.start] == value && run.len() < shortest {
                series[run].fill(!value);
            }
        }
    }
}

/// Returns the moving average over `around` values before and after each value; the window is truncated at both ends.
pub(super) fn means(series: &[f64], around: usize) -> Vec<f64> {
    let mut sums = vec![0.0];
    let mut sum = 0.0;
    sums.extend(series.iter().map(|value| {
        sum += value;
        sum
    }));
    let mean = |at: usize| {
        let (from, to) = (at.saturating_sub(around), (at + around + 1).min(series.len()));
        (sums[to] - sums[from]) / (to - from) as f64
    };
    (0..series.len()).map(mean).collect()
}

/// Returns the strokes of a series and whether each rises. A stroke runs from one extremum to the next; the reversal after each extremum is at least
/// `least`.
pub(super) fn strokes(values: &[f64], least: f64) -> Vec<(Range<usize>, bool)> {
    let mut strokes = Vec::new();
    // The lowest and the highest value since the last extremum, and which of them is the extremum at which the current stroke starts.
    let (mut low, mut high, mut grows) = (0, 0, None);
    for (at, &value) in values.iter().enumerate() {
        if value < values[low] {
            low = at;
        }
        if value > values[high] {
            high = at;
        }
        if grows != Some(true) && value - values[low] >= least {
            if grows == Some(false) {
                strokes.push((high..low, false));
            }
            (high, grows) = (at, Some(true));
        } else if grows != Some(false) && values[high] - value >= least {
            if grows == Some(true) {
                strokes.push((low..high, true));
            }
            (low, grows) = (at, Some(false));
        }
    }
    strokes.extend(grows.map(|grows| if grows { (low..high, true) } else { (high..low, false) }));
    strokes
}
