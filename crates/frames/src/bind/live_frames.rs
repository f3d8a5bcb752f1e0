//! Poses in different frames of a live log: a row waits until the transforms at its stamp are known.

use super::frame_composition::FrameComposition;
use super::frame_tree::{MOST_NAMES, names_frame};
use super::sampled_transform::SampledTransform;
use std::collections::{BTreeMap, VecDeque};
use teachtree_logs::names;
use teachtree_logs::read::memory_table::{Cells, InMemoryTable};
use teachtree_logs::read::table::Table;

/// The names of frames that messages have so far.
#[derive(Default)]
pub struct FrameNames(BTreeMap<String, Vec<String>>);

impl FrameNames {
    /// Takes the message of a topic, or a row without a topic; returns whether a name is new.
    pub fn learn(&mut self, topic: &str, row: &InMemoryTable) -> bool {
        let mut is_new = false;
        for (title, cells) in row.columns() {
            let Cells::Texts(texts) = cells else { continue };
            let Some(text) = texts.last().filter(|text| !text.is_empty()) else { continue };
            if !names_frame(names::split_known_unit(title).0) {
                continue;
            }
            let title = if topic.is_empty() { title.clone() } else { format!("{topic}.{title}") };
            let known = self.0.entry(title).or_default();
            if known.len() < MOST_NAMES && !known.contains(text) {
                known.push(text.clone());
                is_new = true;
            }
        }
        is_new
    }

    /// The names in a column, at most [`MOST_NAMES`].
    pub fn of(&self, title: &str) -> Vec<String> {
        self.0.get(title).cloned().unwrap_or_default()
    }
}

/// Rows that wait for transforms, and the samples of these.
#[derive(Default)]
pub struct LiveFrames {
    /// The columns of each transform, and its samples, in the order of the composition.
    columns: Vec<[usize; 7]>,
    transforms: Vec<SampledTransform>,
    waiting: VecDeque<Table>,
    /// The stamp of the newest row, s.
    newest_s: f64,
}

impl LiveFrames {
    /// Returns the state before the first row; transforms are bridged over at least `bridge_s`.
    pub fn new(frames: &FrameComposition, bridge_s: f64) -> Self {
        let columns: Vec<[usize; 7]> = frames.transforms().copied().collect();
        let transforms = columns.iter().map(|_| SampledTransform::new(bridge_s)).collect();
        Self { columns, transforms, ..Self::default() }
    }

    /// Takes a row, which comes after those before.
    pub fn push(&mut self, row: Table) {
        let Some(stamp) = row.time.first().copied() else { return };
        for (transform, columns) in self.transforms.iter_mut().zip(&self.columns) {
            transform.push(stamp, &row.numbers, columns);
        }
        self.newest_s = stamp;
        self.waiting.push_back(row);
    }

    /// The next row whose transforms no later row changes, or any that is left when the log `ends`.
    pub fn next(&mut self, ends: bool) -> Option<Table> {
        let stamp = self.waiting.front()?.time.first().copied()?;
        let is_known = self.transforms.iter().all(|transform| transform.is_known(stamp, self.newest_s));
        if !ends && !is_known {
            return None;
        }
        self.waiting.pop_front()
    }

    /// The transforms, for the row that was taken last.
    pub fn transforms(&self) -> &[SampledTransform] {
        &self.transforms
    }

    /// Forgets the samples that no row after this stamp, s, needs.
    pub fn forget(&mut self, stamp: f64) {
        self.transforms.iter_mut().for_each(|transform| transform.forget(stamp));
    }
}
