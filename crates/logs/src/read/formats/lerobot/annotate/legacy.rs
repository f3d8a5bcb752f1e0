//! Subtasks as LeRobot 0.4.4 to 0.5 has them: `meta/subtasks.parquet`, of which the column `subtask_index` of each frame names a row.

use super::super::super::parquet::column::{Column, Values};
use super::super::super::parquet::rewrite;
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
        let count = i64::try_from(vocabulary.words.len()).unwrap_or(i64::MAX);
        let columns = [
            Column { name: COLUMN.into(), values: Values::Integers((0..count).collect()) },
            Column { name: "subtask".into(), values: Values::Texts(vocabulary.words) },
        ];
        let mut bytes = vec![];
        // lerobot takes the words from the index of the table, which pandas finds by this.
        let of = |name: &str, pandas: &str, numpy: &str| json!({ "name": name, "field_name": name, "pandas_type": pandas, "numpy_type": numpy, "metadata": null });
        let pandas = json!({
            "index_columns": ["subtask"],
            "column_indexes": [{ "name": null, "field_name": null, "pandas_type": "unicode", "numpy_type": "object", "metadata": { "encoding": "UTF-8" } }],
            "columns": [of(COLUMN, "int64", "int64"), of("subtask", "unicode", "object")],
            "attributes": {},
            "creator": { "library": "teachtree", "version": env!("CARGO_PKG_VERSION") },
            "pandas_version": "2.2.3",
        });
        rewrite::write_new(&columns, vec![("pandas", pandas.to_string())], &mut bytes)
            .map_err(|error| InputError::new(FILE, error.to_string()))?;
        changes.files.insert(FILE.into(), bytes);
        Ok(())
    }
}
