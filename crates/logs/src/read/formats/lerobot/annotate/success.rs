//! Whether the task of each episode has succeeded, as LeRobot has it: the column `next.success`, for each frame of the state after its action.

use super::{AnnotationTarget, Changes, FrameColumn, Request, Storage, episodes_of};
use crate::read::formats::parquet;
use serde_json::json;
use std::collections::BTreeMap;
use teachtree_base::error::InputError;

/// The column of data files.
pub const COLUMN: &str = "next.success";

pub(super) struct Success;

impl Storage for Success {
    /// Refuses nothing: callers compare a column that is there with the outcomes, by [`AnnotationTarget::success_contradictions`].
    fn refuse_labeled(&self, _set: &AnnotationTarget, _styles: &[&str]) -> Result<(), InputError> {
        Ok(())
    }

    fn add(&self, changes: &mut Changes, _set: &AnnotationTarget, request: &Request) -> Result<(), InputError> {
        changes.frames.push(FrameColumn::Flags(COLUMN.into(), request.successes.clone()));
        changes.features.push((COLUMN.into(), json!({ "dtype": "bool", "shape": [1], "names": null })));
        Ok(())
    }
}

impl AnnotationTarget {
    /// The episodes whose `next.success` contradicts these, which have a value for each frame: an episode is a success if any of its frames is one. `None`
    /// for a set without the column.
    ///
    /// # Errors
    /// When a data file is damaged.
    pub fn success_contradictions(
        &self,
        successes: &BTreeMap<usize, Vec<bool>>,
    ) -> Result<Option<Vec<usize>>, InputError> {
        if self.has(&[COLUMN.into()], &[])?.is_none() {
            return Ok(None);
        }
        let mut known: BTreeMap<usize, bool> = BTreeMap::new();
        for path in &self.files {
            let name = path.display().to_string();
            let wanted = |column: &str| [COLUMN, "episode_index"].contains(&column);
            let memory = parquet::read(self.opened(path)?, &name, wanted)?;
            let Some(values) = memory.columns().get(COLUMN).and_then(|cells| cells.numbers()) else { continue };
            let episodes = episodes_of(memory.columns().get("episode_index"), &name)?;
            for (episode, value) in episodes.into_iter().zip(values) {
                *known.entry(episode).or_default() |= *value > 0.5;
            }
        }
        let contradicts =
            |episode: &usize, rows: &Vec<bool>| known.get(episode).is_some_and(|known| *known != rows.contains(&true));
        Ok(Some(
            successes
                .iter()
                .filter(|(episode, rows)| contradicts(episode, rows))
                .map(|(episode, _)| *episode)
                .collect(),
        ))
    }
}
