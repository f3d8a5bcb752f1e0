//! Findings of the issues that `analyze` reports of a recording.

use super::{Finding, FindingKind};
use teachtree_logs::issue::{Issue, IssueKind};

/// Returns an issue as a finding; `None` if it changes no label, or only reports a learned value.
fn kind(kind: IssueKind) -> Option<FindingKind> {
    Some(match kind {
        kind if kind.is_of_setup() => FindingKind::Setup,
        IssueKind::GAP | IssueKind::MISSING_ROW => FindingKind::MissingFrames,
        IssueKind::DUPLICATE_STAMP => FindingKind::EqualStamps,
        IssueKind::UNEVEN_STEP => FindingKind::UnevenStamps,
        IssueKind::IMPOSSIBLE_JUMP => FindingKind::Spike,
        IssueKind::TRUNCATED | IssueKind::MISSING_CHUNK => FindingKind::CutOff,
        _ => return None,
    })
}

/// The findings of issues. One about stamps or samples is left out if the raw columns show it, with its number, too.
pub(super) fn findings(issues: &[Issue], of_columns: &[Finding]) -> Vec<Finding> {
    let finding = |issue: &Issue| {
        let kind = kind(issue.kind).filter(|kind| !of_columns.iter().any(|found| found.kind == *kind))?;
        let column = (!issue.channel.is_empty()).then(|| issue.channel.clone());
        let message = format!("{}: {}", issue.kind, issue.message);
        Some(Finding { column, span_s: Some([issue.start_s, issue.end_s]), ..Finding::new(kind, message) })
    };
    issues.iter().filter_map(finding).collect()
}

/// Whether an issue is among the findings.
pub(super) fn is_finding(issue: IssueKind) -> bool {
    kind(issue).is_some()
}
