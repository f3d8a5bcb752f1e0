//! Annotations as GR00T reads them from sets of version 2: columns of whole numbers that name rows of `meta/tasks.jsonl`, and their list in
//! `meta/modality.json`.

use super::files::printed;
use super::timeline::{Vocabulary, numbers};
use super::{AnnotationTarget, Changes, FrameColumn, Request, RequiredVersion, Storage};
use crate::read::text;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::path::Path;
use teachtree_base::error::InputError;
use teachtree_base::json as read_json;

/// The file of words, and that of the groups of columns.
const TASKS: &str = "meta/tasks.jsonl";
const MODALITY: &str = "meta/modality.json";
/// The key of `info.json` with the number of words.
pub(super) const TASKS_COUNT: &str = "total_tasks";
/// The largest file that is read, bytes.
const MAX_BYTES: u64 = 256 << 20;
/// The largest number of a task.
const MAX_TASKS: u64 = 1 << 32;
/// The author of the annotations.
const SOURCE: &str = "teachtree";
/// The group of annotations in `modality.json`.
const GROUP: &str = "annotation";

/// The column of a style.
fn column(style: &str) -> String {
    format!("{GROUP}.{SOURCE}.{style}")
}

pub(super) struct Gr00t;

impl Storage for Gr00t {
    fn required_version(&self, is_v2: bool) -> Option<RequiredVersion> {
        (!is_v2).then_some(RequiredVersion {
            name: "v2.0 or v2.1",
            why: "which GR00T reads",
            help: "`convert_v3_to_v2.py` of Isaac-GR00T makes one of it",
        })
    }

    fn refuse_labeled(&self, set: &AnnotationTarget, styles: &[&str]) -> Result<(), InputError> {
        let columns: Vec<String> = styles.iter().map(|style| column(style)).collect();
        set.has(&columns, &[])?.map_or(Ok(()), |what| Err(set.has_already(&what)))
    }

    /// Adds a column for each style, new rows of `tasks.jsonl`, and the columns to `modality.json`.
    fn add(&self, changes: &mut Changes, set: &AnnotationTarget, request: &Request) -> Result<(), InputError> {
        let path = set.folder.join(TASKS);
        let mut tasks = text::read(&path, MAX_BYTES)?;
        let known = known(&tasks, &path.display().to_string())?;
        let first = known.values().max().map_or(0, |last| last + 1);
        let mut new = Vocabulary::default();
        let mut number = |words: &str| known.get(words).copied().unwrap_or_else(|| first + new.number(words));
        for style in request.styles {
            let frames = numbers(request.labels, style, &set.stamps, &mut number);
            changes.frames.push(FrameColumn::Index(column(style), frames, 0));
            changes.features.push((column(style), json!({ "dtype": "int64", "shape": [1], "names": null })));
        }
        if !tasks.is_empty() && !tasks.ends_with('\n') {
            tasks.push('\n');
        }
        for (words, at) in new.words.iter().zip(first..) {
            tasks.push_str(&format!("{{\"task_index\": {at}, \"task\": {}}}\n", Value::from(words.as_str())));
        }
        if !new.words.is_empty() {
            changes.tasks = Some(known.len() + new.words.len());
            changes.files.insert(TASKS.into(), tasks.into_bytes());
        }
        changes.files.insert(MODALITY.into(), modality(&set.folder, request.styles)?);
        Ok(())
    }
}

/// The words that there are, with their numbers.
fn known(tasks: &str, place: &str) -> Result<BTreeMap<String, usize>, InputError> {
    let mut known = BTreeMap::new();
    for (line, row) in tasks.lines().zip(1..).filter(|(line, _)| !line.trim().is_empty()) {
        let place = format!("{place}:{row}");
        let task: Value = read_json::read(line, &place)?;
        let number = task.get("task_index").and_then(Value::as_u64).filter(|number| *number < MAX_TASKS);
        let number = number.and_then(|number| usize::try_from(number).ok());
        let words = task.get("task").and_then(Value::as_str);
        let (Some(number), Some(words)) = (number, words) else {
            return Err(InputError::new(
                place,
                "expected a `task_index` and a `task`, such as `{\"task_index\": 0, \"task\": \"…\"}`",
            ));
        };
        known.entry(words.to_string()).or_insert(number);
    }
    Ok(known)
}

/// `modality.json` with the annotations. A set that has none gets one that still lacks its states and actions.
fn modality(folder: &Path, styles: &[&str]) -> Result<Vec<u8>, InputError> {
    let path = folder.join(MODALITY);
    let place = path.display().to_string();
    let mut whole: Value = if path.exists() {
        read_json::read(&text::read(&path, MAX_BYTES)?, &place)?
    } else {
        Value::Object(Map::new())
    };
    let group = whole.as_object_mut().map(|whole| whole.entry(GROUP).or_insert_with(|| json!({})));
    let group = group.and_then(Value::as_object_mut);
    let group =
        group.ok_or_else(|| InputError::new(&place, format!("expected an object, with an object `{GROUP}`")))?;
    for style in styles {
        group.insert(format!("{SOURCE}.{style}"), json!({}));
    }
    printed(&whole, &place)
}
