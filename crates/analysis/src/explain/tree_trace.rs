//! The path through a tree on one frame: the choices, the leaf, and the leaf before. Diagrams mark this path.

use super::{AnalyzedRecording, Question, asked};
use crate::TrackId;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_engine::inspect::Inspector;
use teachtree_language::rules::Label;

/// The path through a tree on a frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TreeTrace {
    /// The position of each choice in its branch, from the root to the leaf.
    pub path: Vec<usize>,
    /// The frame.
    pub frame: usize,
    /// The leaf, before settling; none is `separate`.
    pub leaf: Option<Label>,
    /// The leaf of the run before; none at the beginning of a stretch.
    pub before: Option<Option<Label>>,
}

/// Returns the path through the tree of a track on the frame at a time, s; `None` if no tree labels the track.
///
/// # Errors
/// When the recording says nothing at that time, and when its rate cannot honour a duration of the rules.
pub fn tree_trace(analyzed: &AnalyzedRecording, who: TrackId, time_s: f64) -> Result<Option<TreeTrace>, InputError> {
    let question = Question { who, time_s: (time_s, time_s), why_not: None };
    let side: Option<Side> = match who {
        TrackId::Hand(side) => Some(side),
        TrackId::Both => None,
    };
    let Some((leaves, frames)) = asked(analyzed, &question)?.into_iter().next() else { return Ok(None) };
    let mut inspector = Inspector::new(analyzed.rules, analyzed.frames, leaves);
    if inspector.tree(side).is_none() {
        return Ok(None);
    }
    let frame = frames.start;
    let run = inspector.run(side, frame);
    let before = run.and_then(|run| run.start.checked_sub(1)).and_then(|last| inspector.run(side, last));
    Ok(Some(TreeTrace {
        path: inspector.path(side, frame)?,
        frame,
        leaf: run.and_then(|run| run.label),
        before: before.map(|run| run.label),
    }))
}
