//! Topics of a bag with stamps of different clocks, such as those of two computers: the recorder, which has one clock, shows the difference.

use crate::issue::{Issue, IssueKind};
use teachtree_base::short_number::ShortNumber;

/// A message that is recorded this long after its stamp, s, more than those of another topic, is one of a slow sensor or of another clock.
const SLOW_S: f64 = 0.5;
/// A message that is recorded before its stamp, s, more than those of another topic, has another clock.
const EARLY_S: f64 = 0.1;

/// The clock of a topic.
pub(super) struct TopicClock {
    pub topic: String,
    /// How long after their stamps its messages were recorded, s.
    pub after_s: f64,
    /// The first and the last stamp, s.
    pub interval: (f64, f64),
}

/// Reports the topics whose clock differs from that of the topic nearest to the clock of the recorder.
pub(super) fn different_clocks(topics: &[TopicClock]) -> Vec<Issue> {
    let nearest = topics.iter().min_by(|one, other| one.after_s.abs().total_cmp(&other.after_s.abs()));
    let Some(nearest) = nearest else { return vec![] };
    let issue = |TopicClock { topic, after_s, interval: (start_s, end_s) }: &TopicClock| {
        let by_s = after_s - nearest.after_s;
        if (-EARLY_S..=SLOW_S).contains(&by_s) {
            return None;
        }
        let by_s = rounded(by_s);
        let cause = if by_s < 0.0 { "the clocks differ" } else { "the clocks differ, or the sensor is slow" };
        let message = format!(
            "messages are recorded {}, those of `{}` {}: {cause}; if the clocks differ, `time_offset: {} s` in `sensors` of the binding corrects the channels of this topic",
            delay(*after_s),
            nearest.topic,
            delay(nearest.after_s),
            ShortNumber(by_s)
        );
        let (start_s, end_s) = (*start_s, *end_s);
        Some(Issue { kind: IssueKind::DIFFERENT_CLOCKS, start_s, end_s, channel: topic.clone(), message })
    };
    topics.iter().filter_map(issue).collect()
}

/// Formats the time from the stamp of a message to its recording.
fn delay(after_s: f64) -> String {
    let after_s = rounded(after_s);
    let side = if after_s < 0.0 { "before" } else { "after" };
    format!("{} s {side} their stamps", ShortNumber(after_s.abs()))
}

/// A time in whole ms, s.
fn rounded(seconds: f64) -> f64 {
    (seconds * 1e3).round() / 1e3
}
