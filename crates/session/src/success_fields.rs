//! Fields of a log that say whether its task succeeded, such as the rewards of an HDF5 file, compared with the outcome.

use teachtree_analysis::Analysis;
use teachtree_analysis::outcome::OutcomeKind;
use teachtree_logs::issue::{Issue, IssueKind};

/// Replaces the issues of an analysis about fields, by name, that contradict its outcome. An unknown outcome contradicts none.
pub fn compare(found: &mut Analysis, fields: &[(&str, bool)]) {
    found.issues.retain(|issue| issue.kind != IssueKind::CONTRADICTED_OUTCOME);
    let result = found.outcome().result;
    let [start_s, end_s] = [found.start_s, found.end_s];
    let contradicts = |is_success: bool| match result {
        OutcomeKind::Success => !is_success,
        OutcomeKind::Failure => is_success,
        OutcomeKind::Unknown => false,
    };
    let contradictions = fields.iter().filter(|(_, is_success)| contradicts(*is_success));
    found.issues.extend(contradictions.map(|(field, _)| Issue {
        kind: IssueKind::CONTRADICTED_OUTCOME,
        start_s,
        end_s,
        channel: (*field).into(),
        message: format!("`{field}` contradicts the outcome of this recording ({result})"),
    }));
}
