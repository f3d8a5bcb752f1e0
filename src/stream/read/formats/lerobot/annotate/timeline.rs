//! Labels over the frames of an episode.

use super::super::super::parquet::language::Row;
use super::ROLE;
use std::collections::BTreeMap;

/// A label: words that hold from a row of an episode on, until the next label of its style.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Label {
    /// The style that LeRobot knows it by: `motion`, `subtask`.
    pub style: &'static str,
    /// The row of the episode, counted from 0.
    pub row: usize,
    /// The row behind the last one of what it names; it may hold longer, as that of a task until the next task.
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

/// Labels as rows of language.
pub(super) fn rows(labels: &[Label], stamps: &[f32]) -> Vec<Row> {
    let mut styles: Vec<&str> = labels.iter().map(|label| label.style).collect();
    styles.sort_unstable();
    styles.dedup();
    let of = |style| of_style(labels, style, stamps.len()).into_iter();
    let row = |Label { style, row, content, .. }: &Label| {
        let (content, style) = (Some(content.clone()), Some((*style).to_string()));
        let timestamp = stamps.get(*row).copied()?;
        Some(Row { role: ROLE.into(), content, style, timestamp, camera: None, tool_calls: None })
    };
    styles.into_iter().flat_map(of).filter_map(row).collect()
}

/// Words by number, in the order in which they were numbered.
#[derive(Default)]
pub(super) struct Vocabulary {
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
}

/// The number of the words of each frame of each episode; frames before the first label have those of no words.
pub(super) fn numbers(
    labels: &BTreeMap<usize, Vec<Label>>,
    style: &str,
    stamps: &BTreeMap<usize, Vec<f32>>,
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
