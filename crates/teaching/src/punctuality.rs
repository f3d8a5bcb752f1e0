//! The timing statistics of the servo.

use std::time::Duration;

/// Maximum lateness of a punctual step.
const PUNCTUAL: Duration = Duration::from_millis(1);
/// Width of the bins of lateness, µs, and their number.
const BIN_US: u64 = 10;
const BINS: usize = 2000;

/// The timing statistics of the servo.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Punctuality {
    /// Number of steps.
    pub steps: u64,
    /// Number of steps that began within 1 ms of their time.
    pub punctual: u64,
    /// Skipped time, ms.
    pub given_up_ms: u64,
    /// The maximum lateness, µs.
    pub latest_us: u64,
    /// A histogram of the lateness.
    late: Vec<u64>,
}

impl Punctuality {
    /// Counts a step with this lateness.
    pub(super) fn count(&mut self, late: Duration) {
        let late_us = u64::try_from(late.as_micros()).unwrap_or(u64::MAX);
        self.steps += 1;
        self.punctual += u64::from(late < PUNCTUAL);
        self.latest_us = self.latest_us.max(late_us);
        self.late.resize(BINS, 0);
        let bin = usize::try_from(late_us / BIN_US).unwrap_or(BINS).min(BINS - 1);
        if let Some(count) = self.late.get_mut(bin) {
            *count += 1;
        }
    }

    /// Returns the share of steps within 1 ms of their time; 1 before the first one.
    pub fn share(&self) -> f64 {
        if self.steps == 0 { 1.0 } else { self.punctual as f64 / self.steps as f64 }
    }

    /// Returns the quantile of the lateness for a share of the steps, µs.
    pub fn within_us(&self, share: f64) -> u64 {
        let wanted = (share * self.steps as f64).ceil() as u64;
        let mut count = 0;
        let bin = self.late.iter().position(|late| {
            count += late;
            count >= wanted
        });
        (bin.unwrap_or(0) as u64 + 1) * BIN_US
    }
}
