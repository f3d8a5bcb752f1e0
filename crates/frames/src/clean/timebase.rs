//! The even time base: rows in, gap-free stretches of frames out.
//!
//! Durations in rules become numbers of samples, so the step must be even. A step longer than [`GAP_STEPS`] ends a stretch. A few odd
//! steps are reported; if they are more than [`ODD_SHARE`], the log is refused with the advice to resample. A log is also refused if its gaps
//! are so frequent that its rate changes, or if its rate is implausible for a hand: its stamps are in another unit.

use std::ops::Range;
use teachtree_base::error::InputError;
use teachtree_base::short_number::ShortNumber;
use teachtree_logs::issue::{Issue, IssueKind};

/// A step this many times the usual one is a gap: at least one sample is missing.
pub const GAP_STEPS: f64 = 1.5;
/// Relative tolerance of an even step.
pub const EVEN_WITHIN: f64 = 0.10;
/// The share of steps that may be odd without being gaps.
pub const ODD_SHARE: f64 = 0.01;

/// A stamp that is nearer to one of 32 bits was rounded to it, as a share of the distance of two such stamps.
const ROUNDED_WITHIN: f64 = 1e-2;

/// Minimum number of gaps at which their share of the steps is checked; fewer gaps are accepted in a log of any length.
pub(crate) const MANY_GAPS: usize = 10;
/// The shortest and the longest step that is believed, s.
const STEPS: Range<f64> = 1e-4..1.0;

/// Units of stamps that are not in s, with how many s they are, and the step of a usual log, s.
const UNITS: [(&str, f64); 3] = [("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)];
const USUAL_S: f64 = 0.01;
/// A gap that is longer is not worth bridging, s: what is made up in it would pass for what was done.
const BRIDGED_S: f64 = 1.0;

/// Which rows become frames.
#[derive(Clone, Debug, PartialEq)]
pub struct Timebase {
    /// Frames per second.
    pub rate_hz: f64,
    /// The row of each frame.
    pub rows: Vec<usize>,
    /// Gap-free stretches of frames.
    pub stretches: Vec<Range<usize>>,
}

/// Finds the rate and the stretches; `keep` marks the rows that may become frames.
///
/// # Errors
/// When time does not rise, when fewer than two rows are kept, or when the steps are too uneven.
pub fn timebase(time: &[f64], keep: &[bool], issues: &mut Vec<Issue>) -> Result<Timebase, InputError> {
    rising(time)?;
    let step = believable_step(time)?;
    let rows: Vec<usize> = keep.iter().enumerate().filter_map(|(row, keep)| keep.then_some(row)).collect();
    if rows.is_empty() {
        return Err(InputError::new("the log", "in no row is every channel measured"));
    }
    let mut stretches = vec![];
    let mut start = 0;
    let (mut odd, mut even_steps, mut even_time) = (vec![], 0_usize, 0.0);
    let mut gaps = vec![];
    for (frame, (row, next)) in rows.iter().zip(rows.iter().skip(1)).enumerate() {
        let (from, to) = (at(time, *row), at(time, *next));
        let steps = (to - from) / step;
        if steps > GAP_STEPS {
            stretches.push(start..frame + 1);
            start = frame + 1;
            // Rows that were left out for another reason have an issue of their own.
            if next - row == 1 {
                let message = format!(
                    "no samples for {} ms, the usual step is {} ms; everything restarts after the gap{}",
                    ShortNumber(ms(to - from)),
                    ms(step),
                    advice(to - from, step)
                );
                gaps.push(Issue { kind: IssueKind::GAP, start_s: from, end_s: to, channel: String::new(), message });
            }
        } else if (steps - 1.0).abs() > EVEN_WITHIN {
            odd.push((from, to));
        } else {
            even_steps += 1;
            even_time += to - from;
        }
    }
    stretches.push(start..rows.len());
    let steps = rows.len() - 1;
    if gaps.len() >= MANY_GAPS && gaps.len() as f64 > ODD_SHARE * steps as f64 {
        let first_s = gaps.first().map_or(0.0, |gap| gap.start_s);
        let message = format!(
            "the rate changes: {} of {steps} steps are longer than {GAP_STEPS} times the usual {} ms, first at {} s",
            gaps.len(),
            ms(step),
            ShortNumber(first_s)
        );
        if let Some(error) = rounded(time) {
            return Err(error);
        }
        let mean_hz = (1.0 / step).round().max(1.0);
        return Err(InputError::new("the log", message).help(format!(
            "give a binding with `resample: {mean_hz} Hz`; it bridges steps up to 100 ms, `bridge` sets another length"
        )));
    }
    issues.append(&mut gaps);
    if let (Some((start_s, _)), Some((_, end_s))) = (odd.first(), odd.last()) {
        let share = odd.len() as f64 / (odd.len() + even_steps) as f64;
        let found = format!(
            "{} of {} steps differ from the usual {} ms by more than {} %",
            odd.len(),
            odd.len() + even_steps,
            ms(step),
            EVEN_WITHIN * 100.0
        );
        if share > ODD_SHARE {
            if let Some(error) = rounded(time) {
                return Err(error);
            }
            let steps = odd.iter().map(|(from, to)| to - from).sum::<f64>() + even_time;
            let mean_hz = ((odd.len() + even_steps) as f64 / steps).round().max(1.0);
            return Err(InputError::new(
                "the log",
                format!("the sampling is uneven: {found}, first at {} s", ShortNumber(*start_s)),
            )
            .help(format!("give a binding with `resample: {mean_hz} Hz`")));
        }
        issues.push(Issue {
            kind: IssueKind::UNEVEN_STEP,
            start_s: *start_s,
            end_s: *end_s,
            channel: String::new(),
            message: format!("{found}; they are taken as even"),
        });
    }
    let mean = if even_steps == 0 { step } else { even_time / even_steps as f64 };
    // Stamps are rounded when they are written: 0.0333, 0.0667. A millihertz more or less is not measured.
    let rate_hz = if mean < 1.0 { (1000.0 / mean).round() / 1000.0 } else { 1.0 / mean };
    Ok(Timebase { rate_hz, rows, stretches })
}

/// The error about uneven stamps that were rounded to 32 bits: all of them are, and their distance is a large part of a step.
pub fn rounded(time: &[f64]) -> Option<InputError> {
    let (first, last) = (*time.first()?, *time.last()?);
    let digit = |stamp: f64| f64::from((stamp as f32).abs().next_up()) - f64::from((stamp as f32).abs());
    let is_rounded = |stamp: &f64| (stamp - f64::from(*stamp as f32)).abs() <= ROUNDED_WITHIN * digit(*stamp);
    let step = (last - first) / time.len().saturating_sub(1).max(1) as f64;
    if digit(last) < EVEN_WITHIN * step || !time.iter().all(is_rounded) {
        return None;
    }
    let message = format!(
        "the stamps are numbers of 32 bits, which at {} s are {} ms apart",
        ShortNumber(last.round()),
        ShortNumber(ms(digit(last)))
    );
    let help = format!(
        "write them with 64 bits, or counted from the start; if the steps are even, a binding with `rate: {} Hz` replaces them",
        step.recip().round()
    );
    Some(InputError::new("the log", message).help(help))
}

/// Returns the key of a binding that would bridge a gap.
fn advice(gap: f64, step: f64) -> String {
    if gap > BRIDGED_S {
        return String::new();
    }
    let (rate, bridge) = ((1.0 / step).round().max(1.0), (gap * 1e3).floor() + 1.0);
    format!("; a binding with `resample: {rate} Hz` and `bridge: {bridge} ms` bridges it")
}

/// The median step, s.
///
/// # Errors
/// When there are fewer than two rows.
pub fn usual_step(time: &[f64]) -> Result<f64, InputError> {
    let mut steps: Vec<f64> = time.iter().zip(time.iter().skip(1)).map(|(from, to)| to - from).collect();
    let middle = steps.len() / 2;
    if steps.is_empty() {
        return Err(InputError::new(
            "the log",
            format!("the log has {} row, at least 2 are needed to know its rate", time.len()),
        ));
    }
    Ok(*steps.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Refuses stamps of rows that are to be resampled if they must be in another unit. Topics that are stamped together have rows in bursts: there the mean step counts.
///
/// # Errors
/// As [`believable_step`].
pub fn check_bursts(time: &[f64]) -> Result<(), InputError> {
    /// A burst has at most this number of rows.
    const ROWS: usize = 20;
    let steps = time.len().saturating_sub(1);
    let long = time.windows(2).filter(|pair| STEPS.contains(&(pair[1] - pair[0]))).count();
    let mean = time.first().zip(time.last()).map_or(0.0, |(first, last)| (last - first) / steps.max(1) as f64);
    if STEPS.contains(&mean) && long * ROWS >= steps.max(1) {
        return Ok(());
    }
    believable_step(time).map(|_| ())
}

/// The median step, s, of a log that may be of a hand.
///
/// # Errors
/// When there are fewer than two rows, or the step is so short or so long that the stamps must be in another unit.
pub fn believable_step(time: &[f64]) -> Result<f64, InputError> {
    let step = usual_step(time)?;
    if step <= 0.0 || (STEPS.start * (1.0 - 1e-6)..=STEPS.end * (1.0 - 1e-6)).contains(&step) {
        return Ok(step);
    }
    let long = step > STEPS.start;
    // Below a nanosecond nothing would be left of it.
    let found = if long {
        format!("{} s", ShortNumber(ms(step) / 1e3))
    } else if ms(step) > 0.0 {
        format!("{} ms", ms(step))
    } else {
        format!("{:.0e} ms", step * 1e3)
    };
    let message = format!(
        "there is one row every {found}, expected at least {} ms and less than {} ms",
        ms(STEPS.start),
        ms(STEPS.end)
    );
    if let Some(help) = days(time, step) {
        return Err(InputError::new("the log", message).help(help));
    }
    // Among the possible units, the one with the rate nearest to 100 Hz: 16 666 667 is in ns, not in us.
    let in_it = |per: f64| if long { step * per } else { step / per };
    let unusual = |per: f64| (in_it(per) / USUAL_S).ln().abs();
    let units = UNITS.into_iter().filter(|(_, per)| STEPS.contains(&in_it(*per)));
    let error = InputError::new("the log", message);
    let Some((unit, _)) = units.min_by(|(_, a), (_, b)| unusual(*a).total_cmp(&unusual(*b))) else {
        return Err(error);
    };
    let help = if long {
        format!(
            "if the stamps are in {unit}, write `time [{unit}]` in the header or in a binding; without a unit they are in s"
        )
    } else {
        // The steps are too short by a power of 1000: stamps declared in `us` may be in ms.
        let names: Vec<&str> = ["s"].into_iter().chain(UNITS.map(|(name, _)| name)).collect();
        let thousands = names.iter().position(|name| *name == unit).unwrap_or_default();
        let pairs = names.iter().skip(thousands).zip(&names);
        let pairs: Vec<String> = pairs.map(|(called, is)| format!("`{called}`, write `time [{is}]`")).collect();
        format!(
            "if the header or a binding names the unit {}; resample a log of more than {} kHz to a lower rate first",
            pairs.join("; if "),
            1e-3 / STEPS.start
        )
    };
    Err(error.help(help))
}

/// The numbers of days in this century: since 1900, as spreadsheets count them, and since the year 0, as MATLAB does.
const DAYS: [Range<f64>; 2] = [36_500.0..73_100.0, 730_000.0..767_100.0];
const SECONDS_PER_DAY: f64 = 86_400.0;

/// The advice about stamps in days.
fn days(time: &[f64], step: f64) -> Option<String> {
    let first = time.first()?;
    let are_days = DAYS.iter().any(|days| days.contains(first)) && STEPS.contains(&(step * SECONDS_PER_DAY));
    are_days.then(|| {
        "the stamps are days, as spreadsheets and MATLAB's `datenum` count them: bind `time: <column> * 86400 [s]`"
            .into()
    })
}

/// Checks that time is finite and rises from row to row.
fn rising(time: &[f64]) -> Result<(), InputError> {
    if let Some(row) = time.iter().position(|stamp| !stamp.is_finite()) {
        return Err(InputError::new("the log", format!("sample {} has no time", row + 1)));
    }
    match time.iter().zip(time.iter().skip(1)).position(|(from, to)| to <= from) {
        Some(row) => Err(InputError::new(
            "the log",
            format!("time does not rise from sample {} to the next, at {} s", row + 1, ShortNumber(at(time, row))),
        )),
        None => Ok(()),
    }
}

fn at(time: &[f64], row: usize) -> f64 {
    time.get(row).copied().unwrap_or(f64::NAN)
}

/// Milliseconds for a message.
fn ms(seconds: f64) -> f64 {
    (seconds * 1e6).round() / 1e3
}
