//! The semantics that all evaluators share: the number of samples of a duration, the value of a hand or finger that the log lacks, the number of slots of an
//! array has, the divisor of a rate, and the frames at which a target changes.

use teachtree_base::channels::{Axis, Shape};
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_base::short_number::ShortNumber;
use teachtree_frames::frames::{ColumnKey, Frames, Layout};
use teachtree_language::rules::{LEAST_SAMPLES, MOST_TIMES};

/// The rate at which slow logs are resampled, Hz: every duration of the shipped rules is longer than one sample.
const USUAL_HZ: f64 = 50.0;
/// The longest window, in samples: more than an hour at 1 kHz.
const MAX_WINDOW: f64 = 4e6;

/// A duration in samples of a log, 1 or more: `round(duration_s * rate_hz)`.
///
/// # Errors
/// When it is shorter than one sample, or longer than the program can count.
pub fn samples(duration_s: f64, rate_hz: f64) -> Result<u32, InputError> {
    let samples = duration_s * rate_hz;
    if samples < LEAST_SAMPLES {
        let (duration, period) = (duration_s * 1e3, 1e3 / rate_hz);
        let message =
            format!("a duration of {duration:.3} ms is shorter than one sample ({period:.3} ms at {rate_hz:.1} Hz)");
        let (rate, bridge) = (duration_s.recip().ceil().max(USUAL_HZ), (2.0 * period).ceil());
        let help = format!(
            "give the log a binding with `resample: {rate:.0} Hz` and `bridge: {bridge:.0} ms`, or override the param that sets the duration"
        );
        return Err(InputError::new("rules", message).help(help));
    }
    if samples > MAX_WINDOW {
        let message = format!(
            "a duration of {} s is {:.0} samples at {rate_hz:.1} Hz, expected at most {MAX_WINDOW:.0}",
            ShortNumber(duration_s),
            ShortNumber(samples)
        );
        return Err(InputError::new("rules", message));
    }
    // In range: checked above.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 1 and MAX_WINDOW")]
    let samples = samples.round() as u32;
    Ok(samples.max(1))
}

/// Returns the required number of beginnings of a condition, 1 or more; rounded up.
pub fn times(number: f64) -> u32 {
    // In range: the checker lets no other number pass.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 1 and MOST_TIMES")]
    let times = number.clamp(1.0, MOST_TIMES).ceil() as u32;
    times
}

/// The error for a state of the engine that checked rules cannot lead to.
pub fn internal(what: &str) -> InputError {
    debug_assert!(false, "{what}");
    InputError::new("rules", format!("internal error: {what}")).help("please report this with the rules and the log")
}

/// Notes that a step of a plan met the memory of another kind of step, which no plan leads to; its result stays as it was.
#[cold]
pub fn mismatched() {
    debug_assert!(false, "a step of the plan met the memory of another kind of step");
}

/// Returns the factor from the difference over some samples to a change per second.
pub fn per_second(rate_hz: f64, samples: u32) -> f64 {
    rate_hz / f64::from(samples)
}

/// Returns the components of a value that the log lacks: -1 for an object, false for a condition, 0 for a number.
pub const fn absent(shape: Shape) -> f64 {
    match shape {
        Shape::Object => -1.0,
        Shape::Bool | Shape::Scalar | Shape::Vec3 | Shape::Rotation => 0.0,
    }
}

/// Returns the number of slots of a channel of a hand in a log: 1 for a channel that is not an array, 0 for an array of a hand that the log lacks.
pub fn slots(layout: &Layout, axis: Option<Axis>, side: Option<Side>) -> usize {
    let hand = side.and_then(|side| layout.hand(side));
    match axis {
        None => 1,
        Some(Axis::Fingers) => hand.map_or(0, |hand| hand.fingers.len()),
        Some(Axis::Contacts) => hand.map_or(0, |hand| hand.contacts.len()),
    }
}

/// The column of the target of a hand. Where it changes, whatever reads the target begins anew.
pub fn target_of(frames: &Frames, side: Side) -> Option<&[f64]> {
    frames.column(ColumnKey { channel: frames.channel("target")?, side: Some(side), slot: 0, component: 0 })
}

/// Whether a target is another one than on the frame before, which is a frame of the same stretch. Objects are counted, not measured: they are compared
/// by their bits.
pub fn changes(target: &[f64], frame: usize) -> bool {
    let bits = |frame: usize| target.get(frame).map(|target| target.to_bits());
    frame.checked_sub(1).is_some_and(|before| bits(frame) != bits(before))
}
