//! Labels that count frames of a video and were read as rows of the log: the rate of the video at which they agree with the analysis.

use super::layout;
use super::truth::{Span, Truth};
use crate::Analysis;

/// Usual frame rates of cameras, Hz.
const RATES_HZ: [f64; 7] = [10.0, 15.0, 24.0, 25.0, 30.0, 50.0, 60.0];
/// Largest share of the labeled time that agrees as rows, and smallest one that agrees as frames.
const AS_ROWS: f64 = 0.4;
const AS_FRAMES: f64 = 0.7;
/// Smallest distance of the two rates, as a ratio. Labels at nearly the same rate agree nearly as well.
const RATIO: f64 = 1.2;

/// Labels that agree with an analysis as frames of a video, and do not as rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VideoFrames {
    /// The rate of the video, Hz.
    pub rate_hz: f64,
    /// Share of the labeled time that agrees as rows of the log, 0 to 1.
    pub as_rows: f64,
    /// Share of the labeled time that agrees as frames of the video, 0 to 1.
    pub as_frames: f64,
}

/// Returns the rate at which the labels of `truth`, read as rows of a log, agree as frames of a video; `None` where they agree as rows, or at no usual rate. The
/// log begins at `first_s`, s, and has `rows_hz` rows a second.
pub fn video_frames(truth: &Truth, analysis: &Analysis, first_s: f64, rows_hz: f64) -> Option<VideoFrames> {
    let as_rows = agreement(truth, analysis, |time_s| time_s)?;
    if as_rows > AS_ROWS {
        return None;
    }
    let differs = |rate_hz: &f64| (rows_hz / rate_hz).max(rate_hz / rows_hz) > RATIO;
    let candidates = RATES_HZ.into_iter().filter(differs).filter_map(|rate_hz| {
        let stretched = |time_s: f64| first_s + (time_s - first_s) * rows_hz / rate_hz;
        agreement(truth, analysis, stretched).map(|as_frames| VideoFrames { rate_hz, as_rows, as_frames })
    });
    candidates.max_by(|one, other| one.as_frames.total_cmp(&other.as_frames)).filter(|best| best.as_frames >= AS_FRAMES)
}

/// Share of the labeled time of primitives, 0 to 1, in which the analysis gives one of the names, with the times of the labels changed.
fn agreement(truth: &Truth, analysis: &Analysis, time: impl Fn(f64) -> f64) -> Option<f64> {
    let (mut labeled_s, mut agreed_s) = (0.0, 0.0);
    for (of_track, track) in truth.tracks.iter().filter_map(|it| Some((it, analysis.track(it.who)?))) {
        let found = layout::segments(track, &track.relabeled, &analysis.stretches);
        for Span { names, start_s, end_s } in &of_track.primitives {
            let (start_s, end_s) = (time(*start_s), time(*end_s));
            labeled_s += end_s - start_s;
            let same = found.iter().filter(|(name, ..)| names.iter().any(|it| it == name));
            agreed_s += same.map(|(_, start, end)| (end.min(end_s) - start.max(start_s)).max(0.0)).sum::<f64>();
        }
    }
    (labeled_s > 0.0).then(|| agreed_s / labeled_s)
}
