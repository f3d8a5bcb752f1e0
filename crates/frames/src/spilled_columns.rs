//! Columns that can be looked into long after they were made: those of frames in memory, or spilled down in a file that has no name.

use crate::frames::{ColumnKey, Frames};
use std::borrow::Cow;
use std::cell::Cell;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::ops::Range;
use teachtree_base::error::InputError;

/// Columns over all frames of a log.
pub trait Series {
    /// Whether there is such a column.
    fn has(&self, key: ColumnKey) -> bool;

    /// Some values of it; fewer where it ends.
    fn part(&self, key: ColumnKey, frames: Range<usize>) -> Cow<'_, [f64]>;
}

impl Series for Frames {
    fn has(&self, key: ColumnKey) -> bool {
        self.columns.contains_key(&key)
    }

    fn part(&self, key: ColumnKey, frames: Range<usize>) -> Cow<'_, [f64]> {
        Cow::Borrowed(self.column(key).and_then(|column| column.get(frames)).unwrap_or(&[]))
    }
}

/// How many bytes a value takes.
const WIDTH: usize = size_of::<f64>();

/// Columns in files that are gone with the program.
#[derive(Default)]
pub struct SpilledColumns {
    files: BTreeMap<ColumnKey, File>,
    failed: Cell<bool>,
}

impl SpilledColumns {
    /// Puts values after those of a column that are there.
    ///
    /// # Errors
    /// When the folder of temporary files has no room.
    pub fn push(&mut self, key: ColumnKey, values: &[f64]) -> Result<(), InputError> {
        let failed = |error: std::io::Error| {
            InputError::new(std::env::temp_dir().display().to_string(), format!("cannot be written: {error}"))
        };
        let file = match self.files.entry(key) {
            std::collections::btree_map::Entry::Occupied(there) => there.into_mut(),
            std::collections::btree_map::Entry::Vacant(place) => place.insert(tempfile::tempfile().map_err(failed)?),
        };
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        file.write_all(&bytes).map_err(failed)
    }

    /// Whether something that was spilled down could not be read any more.
    pub fn failed(&self) -> bool {
        self.failed.get()
    }

    fn read(&self, mut file: &File, frames: Range<usize>) -> std::io::Result<Vec<f64>> {
        let mut bytes = vec![0; frames.len() * WIDTH];
        file.seek(SeekFrom::Start((frames.start * WIDTH) as u64))?;
        file.read_exact(&mut bytes)?;
        let (values, _) = bytes.as_chunks::<WIDTH>();
        Ok(values.iter().map(|value| f64::from_le_bytes(*value)).collect())
    }
}

impl Series for SpilledColumns {
    fn has(&self, key: ColumnKey) -> bool {
        self.files.contains_key(&key)
    }

    fn part(&self, key: ColumnKey, frames: Range<usize>) -> Cow<'_, [f64]> {
        let Some(file) = self.files.get(&key) else { return Cow::Borrowed(&[]) };
        let read = self.read(file, frames);
        self.failed.set(self.failed.get() || read.is_err());
        Cow::Owned(read.unwrap_or_default())
    }
}
