//! Subtasks as LeRobot 0.4.4 to 0.5 has them: `meta/subtasks.parquet`, of which the column `subtask_index` of each frame names a row.

use super::timeline::{Vocabulary, numbers};
use super::{AnnotationTarget, Changes, FrameColumn, Request, Storage};
use serde_json::json;
use std::path::Path;
use teachtree_base::error::InputError;

/// The column of data files.
const COLUMN: &str = "subtask_index";
/// The file of words.
const FILE: &str = "meta/subtasks.parquet";

pub(super) struct Legacy;

impl Storage for Legacy {
    fn refuse_labeled(&self, set: &AnnotationTarget, _styles: &[&str]) -> Result<(), InputError> {
        let found = set.has(&[COLUMN.into()], &[Path::new(FILE)])?;
        found.map_or(Ok(()), |what| Err(set.has_already(&what)))
    }

    /// Adds the column and the file.
    fn add(&self, changes: &mut Changes, set: &AnnotationTarget, request: &Request) -> Result<(), InputError> {
        let mut vocabulary = Vocabulary::default();
        let frames = numbers(request.labels, request.legacy, &set.stamps, &mut |words| vocabulary.number(words));
        changes.frames.push(FrameColumn::Index(COLUMN.into(), frames, 0));
        changes.features.push((COLUMN.into(), json!({ "dtype": "int64", "shape": [1], "names": null })));
        let bytes = vocabulary.table(COLUMN, "subtask").map_err(|error| InputError::new(FILE, error.to_string()))?;
        changes.files.insert(FILE.into(), bytes);
        Ok(())
    }
}
