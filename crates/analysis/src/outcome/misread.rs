//! Issues that make an outcome unknown: the log is read wrongly, so its tasks are not those of the recording.

use super::{OutcomeReason, ReasonKind, Subject, TaskResult};
use crate::Analysis;
use teachtree_base::hands::{Side, TrackId};
use teachtree_logs::issue::{Issue, IssueKind};

/// The kinds of these issues. The log is used unchanged; docs/logs.md lists the causes.
const KINDS: &[IssueKind] = &[
    IssueKind::ASSUMED_INSERTION,
    IssueKind::CHANGED_ELEMENT,
    IssueKind::CONSTANT_FLAG,
    IssueKind::IMPLAUSIBLE_UNIT,
    IssueKind::INCONSISTENT_HOLD,
    IssueKind::MISPLACED_SOCKET,
    IssueKind::MISSING_BODY,
    IssueKind::REVERSED_FLAG,
];

/// The issues that concern the result of a recording. An issue of a hand concerns the tasks of this hand; it concerns a recording without tasks, and one that lacks
/// an expected task, only if no other hand is read correctly.
pub(super) fn reasons(found: &Analysis, results: &[TaskResult], lacks_task: bool) -> Vec<OutcomeReason> {
    let issues: Vec<(Option<TrackId>, &Issue)> =
        found.issues.iter().filter(|issue| KINDS.contains(&issue.kind)).map(|issue| (hand(issue), issue)).collect();
    let mut hands = found.tracks.iter().map(|track| track.who).filter(|who| who.side().is_some());
    let is_misread = |who: TrackId| issues.iter().any(|(hand, _)| hand.is_none_or(|hand| hand == who));
    let all_are_misread = (lacks_task || results.is_empty()) && hands.all(is_misread);
    let concerns =
        |who: &Option<TrackId>| all_are_misread || who.is_none_or(|who| results.iter().any(|result| result.who == who));
    issues.into_iter().filter(|(who, _)| concerns(who)).map(|(who, issue)| reason(who, issue)).collect()
}

/// The hand whose channel an issue names.
fn hand(issue: &Issue) -> Option<TrackId> {
    let (hand, _) = issue.channel.split_once('.')?;
    Side::BOTH.into_iter().find(|side| side.name() == hand).map(TrackId::Hand)
}

fn reason(track: Option<TrackId>, issue: &Issue) -> OutcomeReason {
    let Issue { kind, channel, message, .. } = issue;
    OutcomeReason {
        kind: ReasonKind::Misread,
        track,
        task: None,
        subject: Subject::default(),
        span_s: None,
        message: format!("{kind} {channel}: {message}"),
    }
}
