//! Labels over the frames of an episode.

use super::super::super::parquet::column::{Column, Values};
use super::super::super::parquet::language::Row;
use super::super::super::parquet::rewrite;
use super::ROLE;
use ::parquet::errors::ParquetError;
use serde_json::json;
use std::collections::BTreeMap;

/// A label: words that hold from a row of an episode on, until the next label of its style.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Label {
    /// The style that LeRobot knows it by: `motion`, `subtask`.
    pub style: &'static str,
    /// The row of the episode, counted from 0.
    pub row: usize,
    /// The row after the last one of what it names; it may hold longer, as that of a task until the next task.
    pub end: usize,
    /// The words.
    pub content: String,
}

/// The labels of a style in order, with those that have a frame. Of two labels that begin with the same frame the later one holds, as no frame has the
/// other one.
pub(super) fn of_style<'a>(labels: &'a [Label], style: &str, frames: usize) -> Vec<&'a Label> {
    let mut rows: BTreeMap<usize, &Label> = BTreeMap::new();
    for label in labels.iter().filter(|label| label.style == style && label.row < frames) {
        rows.insert(label.row, label);
    }
    rows.into_values().collect()
}

/// The labels of an episode as rows of language. Of two labels of a style whose frames have one stamp the later one holds, as LeRobot refuses two.
///
/// # Errors
/// When a frame and the one before it differ in their stamps, but not in the 32 bits that a row has for them.
pub(in super::super) fn rows(
    episode: usize,
    labels: &BTreeMap<usize, Vec<Label>>,
    stamps: &[f64],
) -> Result<Vec<Row>, String> {
    let labels = labels.get(&episode).map_or(&[][..], Vec::as_slice);
    let mut styles: Vec<&str> = labels.iter().map(|label| label.style).collect();
    styles.sort_unstable();
    styles.dedup();
    let mut rows: Vec<Row> = Vec::new();
    for Label { style, row, content, .. } in styles.into_iter().flat_map(|style| of_style(labels, style, stamps.len()))
    {
        let Some(stamp) = stamps.get(*row).copied() else { continue };
        let timestamp = not_after(stamp);
        let before = row.checked_sub(1).and_then(|before| stamps.get(before)).filter(|before| **before < stamp);
        if before.is_some_and(|before| *before as f32 >= timestamp) {
            return Err(format!(
                "the stamps of episode {episode} are too large: at {stamp} s, the 32 bits that LeRobot has for the time of a label do not distinguish \
                 frames; expected stamps that count from the start of the episode"
            ));
        }
        let (content, style) = (Some(content.clone()), Some((*style).to_string()));
        rows.pop_if(|last| last.style == style && last.timestamp == timestamp);
        rows.push(Row { role: ROLE.into(), content, style, timestamp, camera: None, tool_calls: None });
    }
    Ok(rows)
}

/// A stamp in 32 bits that is not later: a label holds from its frame on, also where the set has stamps of 64 bits.
fn not_after(stamp: f64) -> f32 {
    let near = stamp as f32;
    if f64::from(near) > stamp { near.next_down() } else { near }
}

/// Words by number, in the order in which they were numbered.
#[derive(Default)]
pub(in super::super) struct Vocabulary {
    /// The words, with those that were known before.
    pub words: Vec<String>,
    known: BTreeMap<String, usize>,
}

impl Vocabulary {
    /// The number of these words.
    pub fn number(&mut self, words: &str) -> usize {
        if let Some(number) = self.known.get(words) {
            return *number;
        }
        self.words.push(words.into());
        self.known.insert(words.into(), self.words.len() - 1);
        self.words.len() - 1
    }

    /// A file of Parquet with the words and their numbers, in columns of these names.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn table(self, number: &str, words: &str) -> Result<Vec<u8>, ParquetError> {
        let count = i64::try_from(self.words.len()).unwrap_or(i64::MAX);
        let columns = [
            Column { name: number.into(), values: Values::Integers((0..count).collect()) },
            Column { name: words.into(), values: Values::Texts(self.words) },
        ];
        // lerobot takes the words from the index of the table, which pandas finds by this.
        let of = |name: &str, pandas: &str, numpy: &str| json!({ "name": name, "field_name": name, "pandas_type": pandas, "numpy_type": numpy, "metadata": null });
        let pandas = json!({
            "index_columns": [words],
            "column_indexes": [{ "name": null, "field_name": null, "pandas_type": "unicode", "numpy_type": "object", "metadata": { "encoding": "UTF-8" } }],
            "columns": [of(number, "int64", "int64"), of(words, "unicode", "object")],
            "attributes": {},
            "creator": { "library": "teachtree", "version": env!("CARGO_PKG_VERSION") },
            "pandas_version": "2.2.3",
        });
        let mut bytes = vec![];
        rewrite::write_new(&columns, vec![("pandas", pandas.to_string())], &mut bytes)?;
        Ok(bytes)
    }
}

/// The number of the words of each frame of each episode; frames before the first label have those of no words.
pub(super) fn numbers(
    labels: &BTreeMap<usize, Vec<Label>>,
    style: &str,
    stamps: &BTreeMap<usize, Vec<f64>>,
    number: &mut dyn FnMut(&str) -> usize,
) -> BTreeMap<usize, Vec<i64>> {
    let mut all = BTreeMap::new();
    for (episode, stamps) in stamps {
        let labels = labels.get(episode).map_or(&[][..], Vec::as_slice);
        let mut frames: Vec<i64> = Vec::with_capacity(stamps.len());
        let mut words = "";
        let mut add = |until: usize, words: &str| {
            if until > frames.len() {
                frames.resize(until, i64::try_from(number(words)).unwrap_or(i64::MAX));
            }
        };
        for label in of_style(labels, style, stamps.len()) {
            add(label.row, words);
            words = &label.content;
        }
        add(stamps.len(), words);
        all.insert(*episode, frames);
    }
    all
}
