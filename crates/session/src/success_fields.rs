//! Fields of a log that say whether its task succeeded, such as the rewards of an HDF5 file. The outcome follows a success, and is compared with the fields.

use teachtree_analysis::Analysis;
use teachtree_analysis::outcome::OutcomeKind;
use teachtree_logs::issue::{Issue, IssueKind};

/// Gives an analysis the fields, by name, that say that the recording succeeded, unless they disagree, and replaces its issues about fields that contradict
/// its outcome. An unknown outcome contradicts none.
pub fn compare(found: &mut Analysis, fields: &[(&str, bool)]) {
    let agrees = fields.iter().all(|(_, is_success)| *is_success);
    found.declared = fields.iter().filter(|_| agrees).map(|(field, _)| (*field).into()).collect();
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
