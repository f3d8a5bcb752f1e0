//! Stamps that count from 1970: the times of a recording count from the first of them, which is easier to read. Stamps from another origin, such as the start of a
//! robot, are used unchanged.

use crate::issue::Issue;

/// Stamps from here on count from 1970, s: this is in 1973.
pub const SINCE_1970_S: f64 = 1e8;

/// Lets times since 1970 count from the first of them, with those of issues and of all rows of the file. Returns what the stamps show at 0 s; 0 of others.
pub fn count_from_first(time: &mut [f64], row_time: &mut [f64], issues: &mut [Issue]) -> f64 {
    let Some(first) = time.first().copied().filter(|first| *first >= SINCE_1970_S) else { return 0.0 };
    time.iter_mut().chain(row_time).for_each(|stamp| *stamp -= first);
    issues.iter_mut().for_each(|issue| issue.count_from(first));
    first
}

/// A time that may be given since 1970, as one of a recording, s; `zero_stamp_s` is what the stamps of its log show at 0 s.
pub fn in_recording(time_s: f64, zero_stamp_s: f64) -> f64 {
    if time_s >= SINCE_1970_S && zero_stamp_s >= SINCE_1970_S { time_s - zero_stamp_s } else { time_s }
}
