//! Series of conditions, one value a millisecond, and the cleaning that needs the future.

use std::ops::Range;

/// Stretches of equal values, in order.
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

/// Bridges gaps shorter than `bridge`, then takes out what is shorter than `blip`; what touches an end of the series stays.
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
