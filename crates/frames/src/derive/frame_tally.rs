//! Values on the frames in which something is found, added up.

use crate::clean::preprocess::CleanLog;
use teachtree_logs::issue::{Issue, IssueKind};

/// An impossible state is reported from this total duration on, s.
pub const LASTS: f64 = 0.25;

/// The frames in which something is found.
#[derive(Default)]
pub struct FrameTally {
    pub frames: usize,
    pub sum: f64,
    /// The first and the last of them, s.
    span: Option<[f64; 2]>,
    /// The object of the last of these frames.
    pub of: String,
}

impl FrameTally {
    /// Adds the value of a frame.
    pub fn add(&mut self, measured: &CleanLog, frame: usize, value: f64) {
        let at = measured.time.get(frame).copied().unwrap_or_default();
        self.frames += 1;
        self.span = Some([self.span.map_or(at, |[first, _]| first), at]);
        self.sum += value;
    }

    /// The mean of what was found, when it lasted long enough to be reported.
    pub fn mean(&self, measured: &CleanLog) -> Option<f64> {
        let n = self.frames as f64;
        (n > 0.0 && n / measured.rate_hz >= LASTS).then(|| self.sum / n)
    }

    /// An issue over the time in which something was found.
    pub fn issue(&self, kind: IssueKind, channel: String, message: String) -> Issue {
        let [start_s, end_s] = self.span.unwrap_or_default();
        Issue { kind, start_s, end_s, channel, message }
    }
}

/// A number with two digits after the point.
pub fn hundredths(value: f64) -> f64 {
    (value * 100.0).round() / 100.0
}
