//! Outcomes and issues of recordings with which the exit status of `analyze` is 1.

use teachtree_analysis::outcome::OutcomeKind;
use teachtree_base::spelling::nearest;
use teachtree_logs::issue::IssueKind;
use teachtree_session::Analysis;

/// The outcomes and issues that are not accepted.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct FailOnArg {
    /// Outcomes (`failure`, `unknown`) and kinds of issues with which the exit status is 1
    #[arg(long, value_name = "KIND,…", value_delimiter = ',', value_parser = parse)]
    fail_on: Vec<FailOn>,
}

/// An outcome or a kind of issue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FailOn {
    Outcome(OutcomeKind),
    Issue(IssueKind),
}

/// The outcomes that may be named.
const OUTCOMES: [OutcomeKind; 2] = [OutcomeKind::Failure, OutcomeKind::Unknown];

fn parse(text: &str) -> Result<FailOn, String> {
    let outcome = OUTCOMES.into_iter().find(|outcome| outcome.name() == text).map(FailOn::Outcome);
    outcome.or_else(|| IssueKind::from_name(text).map(FailOn::Issue)).ok_or_else(|| {
        let names = OUTCOMES.iter().map(|outcome| outcome.name()).chain(IssueKind::ALL.iter().map(|kind| kind.name()));
        let near = nearest(text, names).map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
        format!("expected `failure`, `unknown` or a kind of issue, such as `implausible_unit`{near}")
    })
}

impl FailOnArg {
    /// Whether the recording has one of them.
    pub fn is_found(&self, analysis: &Analysis) -> bool {
        self.fail_on.iter().any(|kind| match kind {
            FailOn::Outcome(kind) => analysis.outcome().result == *kind,
            FailOn::Issue(kind) => analysis.issues().iter().any(|issue| issue.kind == *kind),
        })
    }
}
