//! Lines of a live log with one stamp: those about different columns form one row, as in a whole log.
//!
//! Until the second stamp, a line waits for the next one. After that, only a line that lacks a column of earlier lines does, of those that are read, so that
//! whole rows are not delayed.

use super::join::{Value, value};
use indexmap::IndexMap;
use teachtree_base::error::InputError;
use teachtree_logs::names::{split_known_unit, split_unit};
use teachtree_logs::read::memory_table::{Cells, InMemoryTable};
use teachtree_logs::read::stamp_order::{RowMerge, is_of_head};
use teachtree_logs::read::table::{MAX_COLUMNS, number};

/// A line of a live log.
pub struct LiveLine {
    /// Its values, as the only row of a table.
    pub row: InMemoryTable,
    /// Bytes of the line, or of all lines that form the row.
    pub bytes: usize,
    /// Its number, counted from 1; of several lines that of the first one.
    pub number: u64,
}

/// Joins the lines of one stamp.
pub struct StampMerger {
    /// The name of the column with the stamps, and its title in the line before.
    time: String,
    title: Option<String>,
    /// The columns that have had a value, and whether each is read.
    known: IndexMap<String, bool>,
    /// The number of columns that are read.
    read: usize,
    /// The line that waits, with its stamp.
    waiting: Option<(Value, LiveLine)>,
    /// The first line that repeats values of the one that waits.
    repeat: Option<LiveLine>,
    /// The first stamp, until another one comes.
    first: Option<Value>,
    has_begun: bool,
}

impl StampMerger {
    /// Returns a merger before the first line. `time` is the name of the column with the stamps.
    pub fn new(time: String) -> Self {
        let known = IndexMap::new();
        Self { time, title: None, known, read: 0, waiting: None, repeat: None, first: None, has_begun: false }
    }

    /// Takes a line. Returns the rows that no later line adds to. Lines whose values differ in columns that are not `read` still form one row.
    pub fn push(&mut self, line: LiveLine, is_read: impl Fn(&str) -> bool) -> Vec<LiveLine> {
        let has_all = self.learn(&line.row, &is_read);
        let stamp = self.stamp(&line.row);
        if let Some(stamp) = &stamp {
            self.has_begun |= self.first.get_or_insert_with(|| stamp.clone()) != stamp;
        }
        let Some((_, kept)) = self.waiting.as_mut().filter(|(at, _)| stamp.as_ref() == Some(at)) else {
            let mut rows = self.finish();
            match stamp {
                Some(stamp) if !self.has_begun || !has_all => self.waiting = Some((stamp, line)),
                _ => rows.push(line),
            }
            return rows;
        };
        kept.bytes += line.bytes;
        if add(&mut kept.row, &line.row, &is_read).unwrap_or(true) {
            self.repeat.get_or_insert(line);
        }
        let has_all = filled(&kept.row).filter(|title| self.known.get(*title) == Some(&true)).count() == self.read;
        if self.has_begun && has_all { self.finish() } else { vec![] }
    }

    /// Returns the rows that wait.
    pub fn finish(&mut self) -> Vec<LiveLine> {
        let waiting = self.waiting.take().map(|(_, line)| line);
        waiting.into_iter().chain(self.repeat.take()).collect()
    }

    /// Returns the text of the stamp of a row.
    fn stamp(&mut self, row: &InMemoryTable) -> Option<Value> {
        if self.title.as_ref().is_none_or(|title| !row.columns().contains_key(title)) {
            let names = |title: &str| [title, split_unit(title).0, split_known_unit(title).0].map(str::to_string);
            self.title = row.columns().keys().find(|title| names(title).contains(&self.time)).cloned();
        }
        Some(value(self.title.as_ref()?, row)).filter(|stamp| !stamp.is_empty())
    }

    /// Learns the columns of a row. Returns whether it has a value in each column that is read.
    fn learn(&mut self, row: &InMemoryTable, is_read: impl Fn(&str) -> bool) -> bool {
        let mut has = 0;
        for title in filled(row) {
            let is_read = match self.known.get(title) {
                Some(is_read) => *is_read,
                None if self.known.len() < MAX_COLUMNS => {
                    let is_read = is_read(title);
                    self.known.insert(title.clone(), is_read);
                    self.read += usize::from(is_read);
                    is_read
                }
                None => false,
            };
            has += usize::from(is_read);
        }
        has == self.read
    }
}

/// Returns the columns in which the only row of a table has a value.
fn filled(row: &InMemoryTable) -> impl Iterator<Item = &String> {
    row.columns().iter().filter(|(_, cells)| is_filled(cells)).map(|(title, _)| title)
}

/// Fills what the only row of a table lacks from another one. Returns whether the other row repeats values of the columns that are `read`.
///
/// # Errors
/// The row has too many columns.
fn add(kept: &mut InMemoryTable, other: &InMemoryTable, is_read: impl Fn(&str) -> bool) -> Result<bool, InputError> {
    let mut addition = RowMerge::default();
    for title in other.columns().keys() {
        let (mut whole, new) = (value(title, kept), value(title, other));
        let was_empty = whole.is_empty();
        let mut of_column = RowMerge::default();
        whole.add(&new, &mut of_column);
        match whole {
            Value::Number(number) if was_empty && !number.is_nan() => kept.put(title, number)?,
            Value::Text(text) if was_empty => kept.put_text(title, &text)?,
            _ => false,
        };
        if !is_of_head(title) && is_read(title) {
            addition.join(of_column);
        }
    }
    Ok(addition.is_repeat())
}

/// Whether the only row of a column has a value.
fn is_filled(cells: &Cells) -> bool {
    match cells {
        Cells::Texts(texts) => texts.first().is_some_and(|text| {
            // Most texts are numbers, which need not be read for this.
            let has_digit = text.trim_start_matches('-').starts_with(|first: char| first.is_ascii_digit());
            has_digit || !number(text).is_some_and(f64::is_nan)
        }),
        numbers => numbers.numbers().and_then(|values| values.first()).is_some_and(|value| value.is_finite()),
    }
}
