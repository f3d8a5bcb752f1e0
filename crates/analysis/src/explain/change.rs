//! The changes at a boundary: compares the frame before it with its first frame, down to the changed conditions.

use super::fact::Fact;
use super::reason::Reason;
use super::{AnalyzedRecording, Explanation, TaskReason, block};
use crate::TrackId;
use serde::Serialize;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_engine::inspect::Inspector;

/// Why a label gave way to another one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Change {
    /// The last frame of the old label; none where the recording, or what follows a gap, begins.
    pub before: Option<Explanation>,
    /// The first frame of the new one.
    pub after: Explanation,
    /// The choice that decided; none where the way through the tree is the same, or begins.
    pub decided: Option<DecidingChoice>,
}

/// The first choice on the way from the root that was taken on one of the frames only.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DecidingChoice {
    /// As its author wrote it.
    pub choice: String,
    /// Where it stands.
    pub place: String,
    /// Whether it is taken now.
    pub taken: bool,
    /// The conditions of it that changed.
    pub changed: Vec<ConditionChange>,
}

/// A condition that holds on one of the frames only.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ConditionChange {
    /// As its author wrote it.
    pub condition: String,
    /// The finger or body that it is about, within `any` and `all`.
    pub slot: Option<String>,
    /// The value before the boundary.
    pub before: ConditionState,
    /// The value after the boundary.
    pub after: ConditionState,
    /// The parts of it that changed, where it measures nothing itself.
    pub below: Vec<ConditionChange>,
}

/// A condition on one frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ConditionState {
    /// Whether it holds.
    pub holds: bool,
    /// The measured fact.
    pub fact: Option<Fact>,
}

/// Explains the boundary before a frame. `None` when no tree speaks for the track.
///
/// # Errors
/// When the rate cannot honour a duration of the rules.
pub fn change<'a>(
    analyzed: &AnalyzedRecording<'a>,
    inspector: &mut Inspector<'a>,
    who: TrackId,
    frame: usize,
) -> Result<Option<Change>, InputError> {
    let stretch = inspector.leaves().frames.clone();
    if inspector.tree(who.side()).is_none() || !stretch.contains(&frame) {
        return Ok(None);
    }
    let after = block(analyzed, inspector, who, frame)?;
    let before = match frame.checked_sub(1).filter(|before| stretch.contains(before)) {
        Some(before) => Some(block(analyzed, inspector, who, before)?),
        None => None,
    };
    let decided = before.as_ref().and_then(|before| decided(before, &after));
    Ok(Some(Change { before, after, decided }))
}

/// Explains the name of the task around a frame of a hand; `None` outside of tasks.
pub fn task(analyzed: &AnalyzedRecording, inspector: &Inspector, side: Side, frame: usize) -> Option<TaskReason> {
    super::task::of(analyzed, inspector.leaves(), side, frame)
}

fn decided(before: &Explanation, after: &Explanation) -> Option<DecidingChoice> {
    let (was, is) = before.path.iter().zip(&after.path).find(|(was, is)| was.taken != is.taken)?;
    let changed = match (&was.reason, &is.reason) {
        (Some(was), Some(is)) => vec![compare(was, is)],
        _ => Vec::new(),
    };
    Some(DecidingChoice { choice: is.choice.clone(), place: is.place.clone(), taken: is.taken, changed })
}

/// Two reasons of one condition, with those of its parts that changed too. What decides differs with the outcome: parts that are a reason
/// on one frame only did not change, or are covered by the one that did.
fn compare(was: &Reason, is: &Reason) -> ConditionChange {
    let same = |a: &Reason, b: &Reason| a.condition == b.condition && a.slot == b.slot;
    let pairs = is.because.iter().filter_map(|is| Some((was.because.iter().find(|was| same(was, is))?, is)));
    let below = pairs.filter(|(was, is)| was.holds != is.holds).map(|(was, is)| compare(was, is));
    let state = |reason: &Reason| ConditionState { holds: reason.holds, fact: reason.fact.clone() };
    ConditionChange {
        condition: is.condition.clone(),
        slot: is.slot.clone(),
        before: state(was),
        after: state(is),
        below: below.collect(),
    }
}
