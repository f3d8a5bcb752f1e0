//! Two rule sets side by side: how much their results differ, and which of them agrees better with labels. The same as `diff --labels`.

use super::score;
use serde_json::{Value, json};
use std::sync::Arc;
use teachtree_analysis::difference::{Extent, changes, extent};
use teachtree_analysis::score::Comparison;
use teachtree_logs::allowed_folders::AllowedFolders;
use teachtree_report::page;
use teachtree_session::Analysis;
use teachtree_session::AnalysisInternals;

/// The result of the other rules, or the error.
pub type OtherAnalysis = Result<Arc<Analysis>, String>;

/// How the rules of a recording and the others differ.
#[derive(Clone)]
pub enum RuleComparison {
    /// Both ran.
    Both {
        /// How much the results differ.
        extent: Extent,
        /// How well the rules and the others agree with labels; `None` without labels.
        labels: Option<Comparison>,
    },
    /// Why the other rules did not run.
    Failed(String),
}

impl RuleComparison {
    /// Returns the list's entry for the result `now` of the rules and the result of the other rules. Labels are read from `folders`.
    pub fn of(now: &Analysis, other: &OtherAnalysis, folders: &AllowedFolders) -> Self {
        let other = match other {
            Ok(other) => other,
            Err(error) => return Self::Failed(error.clone()),
        };
        let (one, two) = (now.found(), other.found());
        let extent = extent(one, two, &changes(one, two));
        // Labels that cannot be read are in the row already.
        let labels = score::compared(now, other, folders).ok().flatten();
        Self::Both { extent, labels }
    }

    /// The value of a row of the list.
    pub fn json(&self) -> Value {
        match self {
            Self::Both { extent, labels } => {
                let [own, other] = labels.as_ref().map_or([None; 2], |labels| labels.accuracy);
                let unknown = labels.as_ref().map(|labels| &labels.unknown);
                json!({ "frames": extent.frames, "of_frames": extent.of_frames, "segments": extent.segments,
                    "of_segments": extent.of_segments, "own": own, "accuracy": other, "unknown": unknown })
            }
            Self::Failed(error) => json!({ "error": error }),
        }
    }
}

/// The lanes of the other rules, which are called `name`; `null` where there are none.
pub fn lanes(other: Option<&OtherAnalysis>, name: Option<&str>) -> Value {
    match other {
        None => Value::Null,
        Some(Err(error)) => json!({ "error": error }),
        Some(Ok(other)) => {
            let mut lanes = page::tracks(other.found());
            if let Some(fields) = lanes.as_object_mut() {
                fields.insert("rules".into(), json!(name));
            }
            lanes
        }
    }
}
