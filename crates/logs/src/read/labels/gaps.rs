//! Gaps of one or two frames between labels: a file whose ends include their frame has one at each boundary.

use super::Interval;

/// The longest gap that is closed, in steps between rows; stamps are rounded.
const LONGEST: f64 = 2.5;

/// Makes each interval end where the next one of its track and kind starts, if there are at most two frames between them.
pub(super) fn close(intervals: &mut [Interval], row_time: &[f64]) {
    let mut steps: Vec<f64> =
        row_time.windows(2).filter_map(|pair| Some(pair.get(1)? - pair.first()?)).filter(|step| *step > 0.0).collect();
    let middle = steps.len() / 2;
    if steps.is_empty() {
        return;
    }
    let step = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
    let starts: Vec<_> = intervals.iter().skip(1).map(|it| (it.track, it.kind, it.start_s)).collect();
    for (interval, (track, kind, start_s)) in intervals.iter_mut().zip(starts) {
        let is_next = interval.track == track && interval.kind == kind && start_s > interval.end_s;
        if is_next && start_s - interval.end_s < LONGEST * step {
            interval.end_s = start_s;
        }
    }
}
