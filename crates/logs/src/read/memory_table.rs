//! Rows in memory: selects the requested columns of a table.

use crate::issue::Issue;
use crate::names;
use crate::read::date_time;
use crate::read::stamp_order::{RowMerge, Stamps, is_of_head};
use crate::read::table::{ColumnRequest, MAX_COLUMNS, Rows, Table, check_size, column_place, number, see, shown};
use indexmap::IndexMap;
use std::sync::Arc;
use teachtree_base::error::InputError;

/// Suffix of the key of a column whose name is already in use.
const AGAIN: char = '\0';

/// The column that numbers the episodes of a data set.
pub const EPISODE: &str = "episode_index";

/// The values of a column.
#[derive(Clone, Debug, PartialEq)]
pub enum Cells {
    /// Numbers; NaN where nothing was measured.
    Numbers(Vec<f64>),
    /// Numbers that another library holds and does not change.
    Shared(SharedNumbers),
    /// Texts; empty where nothing was said.
    Texts(Vec<String>),
}

impl Cells {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        match self {
            Self::Texts(texts) => texts.len(),
            numbers => numbers.numbers().map_or(0, <[f64]>::len),
        }
    }

    /// The numbers, if it holds any.
    pub fn numbers(&self) -> Option<&[f64]> {
        match self {
            Self::Numbers(values) => Some(values),
            Self::Shared(values) => Some(values.get()),
            Self::Texts(_) => None,
        }
    }

    /// Fills the missing values of row `before` from another row.
    fn add(&mut self, row: usize, before: usize, addition: &mut RowMerge) {
        match self.own() {
            Self::Numbers(values) => {
                let Some(value) = values.get(row).copied() else { return };
                values.get_mut(before).into_iter().for_each(|slot| addition.number(slot, value));
            }
            Self::Texts(texts) => {
                let Some(text) = texts.get(row).cloned() else { return };
                texts.get_mut(before).into_iter().for_each(|slot| addition.text(slot, &text));
            }
            Self::Shared(_) => {}
        }
    }

    /// The same values, in memory of its own.
    fn own(&mut self) -> &mut Self {
        if let Self::Shared(values) = self {
            *self = Self::Numbers(values.get().to_vec());
        }
        self
    }
}

/// Numbers in the memory of another library.
#[derive(Clone)]
pub struct SharedNumbers(Arc<dyn AsRef<[f64]> + Send + Sync>);

impl SharedNumbers {
    /// Holds the values until it is dropped.
    pub fn new(values: Arc<dyn AsRef<[f64]> + Send + Sync>) -> Self {
        Self(values)
    }

    fn get(&self) -> &[f64] {
        (*self.0).as_ref()
    }
}

impl PartialEq for SharedNumbers {
    fn eq(&self, other: &Self) -> bool {
        self.get() == other.get()
    }
}

impl std::fmt::Debug for SharedNumbers {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.get().fmt(f)
    }
}

/// Rows in memory, grown row by row: a value that a row does not have is not measured.
#[derive(Clone, Debug, Default)]
pub struct InMemoryTable {
    columns: IndexMap<String, Cells>,
    rows: usize,
    /// Where the rows are, for messages: the file, with the topic where there are several.
    pub place: String,
    /// The rows from which on lines of the file are farther ahead of rows, and by how much.
    lines: Vec<(usize, u64)>,
    /// The column of the values that come next, since rows mostly repeat the order of the row before.
    next: usize,
    /// Issues about the order of the rows.
    pub issues: Vec<Issue>,
}

impl InMemoryTable {
    /// No rows yet.
    pub fn new(place: impl Into<String>) -> Self {
        Self { place: place.into(), ..Self::default() }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// The columns as they are called.
    pub fn header(&self) -> Vec<String> {
        self.columns.keys().map(|name| name.trim_end_matches(AGAIN).to_string()).collect()
    }

    /// The columns by name.
    pub fn columns(&self) -> &IndexMap<String, Cells> {
        &self.columns
    }

    /// Begins a row; values are put into the last row.
    ///
    /// # Errors
    /// When the log would not fit.
    pub fn begin_row(&mut self) -> Result<(), InputError> {
        self.rows += 1;
        self.next = 0;
        check_size(&self.place, self.rows, self.columns.len())
    }

    /// Begins the row that stands in this line of the file, which messages then name.
    ///
    /// # Errors
    /// When the log would not fit.
    pub fn begin_row_at(&mut self, line: u64) -> Result<(), InputError> {
        self.begin_row()?;
        let ahead = line.saturating_sub(self.rows as u64);
        if self.lines.last().map_or(0, |(_, ahead)| *ahead) != ahead {
            self.lines.push((self.rows - 1, ahead));
        }
        Ok(())
    }

    /// Puts a number into the last row; whether the row had no such value. A column keeps the kind of its first value: a text column takes the
    /// number as text.
    ///
    /// # Errors
    /// When there are too many columns.
    pub fn put(&mut self, name: &str, value: f64) -> Result<bool, InputError> {
        let row = self.rows.saturating_sub(1);
        Ok(match self.column(name, || Cells::Numbers(vec![]))?.own() {
            Cells::Numbers(values) => set(values, row, value, || f64::NAN),
            Cells::Texts(values) => set(values, row, value.to_string(), String::new),
            Cells::Shared(_) => false,
        })
    }

    /// Puts a text into the last row; whether the row had no such value. A column of numbers takes what the text says, if that is a number.
    ///
    /// # Errors
    /// When there are too many columns.
    pub fn put_text(&mut self, name: &str, value: &str) -> Result<bool, InputError> {
        let row = self.rows.saturating_sub(1);
        Ok(match self.column(name, || Cells::Texts(vec![]))?.own() {
            Cells::Numbers(values) => set(values, row, number(value).unwrap_or(f64::NAN), || f64::NAN),
            Cells::Texts(values) => set(values, row, value.to_string(), String::new),
            Cells::Shared(_) => false,
        })
    }

    /// Returns the columns with a value in the last row, without those of the message header.
    pub fn filled(&self) -> Vec<usize> {
        let is_filled = |(name, cells): (&String, &Cells)| cells.rows() == self.rows && !is_of_head(name);
        (0..).zip(&self.columns).filter(|(_, column)| is_filled(*column)).map(|(at, _)| at).collect()
    }

    /// Adds a column. It may be shorter than other columns and may share its name with one.
    pub fn push_column(&mut self, mut name: String, cells: Cells) {
        self.rows = self.rows.max(cells.rows());
        while self.columns.contains_key(&name) {
            name.push(AGAIN);
        }
        self.columns.insert(name, cells);
    }

    /// Adds a whole column before the others.
    pub fn push_first(&mut self, name: &str, cells: Cells) {
        self.columns.shift_remove(name);
        self.push_column(name.to_string(), cells);
        self.columns.move_index(self.columns.len() - 1, 0);
    }

    fn column(&mut self, name: &str, empty: impl FnOnce() -> Cells) -> Result<&mut Cells, InputError> {
        let expected = self.columns.get_index(self.next).is_some_and(|(column, _)| column == name);
        let index = if expected { Some(self.next) } else { self.columns.get_index_of(name) };
        let index = match index {
            Some(index) => index,
            None if self.columns.len() >= MAX_COLUMNS => {
                let message = format!("found more than {MAX_COLUMNS} columns, the most that are read");
                return Err(InputError::new(&self.place, message));
            }
            None => self.columns.insert_full(name.to_string(), empty()).0,
        };
        self.next = index + 1;
        let place = &self.place;
        self.columns
            .get_index_mut(index)
            .map(|(_, cells)| cells)
            .ok_or_else(|| InputError::new(place, format!("the column {name} is lost")))
    }

    /// Puts the rows in the order of their stamps, in the column of this name; rows with equal stamps keep their order.
    pub fn sort_by(&mut self, time: &str) {
        let Some(stamps) = self.columns.get(time).and_then(Cells::numbers) else { return };
        if stamps.is_sorted() {
            return;
        }
        let stamps = stamps.to_vec();
        let mut order: Vec<usize> = (0..self.rows).collect();
        let stamp = |row: usize| stamps.get(row).copied().unwrap_or(f64::NAN);
        order.sort_by(|a, b| stamp(*a).total_cmp(&stamp(*b)));
        for cells in self.columns.values_mut() {
            if let Cells::Texts(texts) = cells {
                let mut taken = |row: &usize| texts.get_mut(*row).map(std::mem::take).unwrap_or_default();
                *cells = Cells::Texts(order.iter().map(&mut taken).collect());
            } else if let Some(values) = cells.numbers() {
                *cells =
                    Cells::Numbers(order.iter().map(|row| values.get(*row).copied().unwrap_or(f64::NAN)).collect());
            }
        }
    }
}

/// Sets the value of a row; whether it had none. Rows before it that have none are filled.
fn set<T>(values: &mut Vec<T>, row: usize, value: T, empty: impl Fn() -> T) -> bool {
    while values.len() < row {
        values.push(empty());
    }
    match values.get_mut(row) {
        Some(slot) => {
            *slot = value;
            false
        }
        None => {
            values.push(value);
            true
        }
    }
}

/// The number of a row in messages: its line in the file where that is known, else the rows counted from 1.
fn row_number(lines: &[(usize, u64)], row: usize) -> u64 {
    let before = lines.partition_point(|(first, _)| *first <= row);
    row as u64 + 1 + before.checked_sub(1).and_then(|at| lines.get(at)).map_or(0, |(_, ahead)| *ahead)
}

impl Rows for InMemoryTable {
    fn read(
        self: Box<Self>,
        header: &[String],
        wants: &[ColumnRequest],
        rate_hz: Option<f64>,
    ) -> Result<Table, InputError> {
        let Self { mut columns, rows, place, lines, issues, .. } = *self;
        let number_of = |row: usize| row_number(&lines, row);
        if rows == 0 {
            return Err(InputError::new(place, "the log has no rows"));
        }
        let time_of = |(column, want): (usize, &ColumnRequest)| match want {
            ColumnRequest::Time(to_seconds) => Some((column, *to_seconds)),
            _ => None,
        };
        // Seconds and nanoseconds may be in columns of their own.
        let timed: Vec<(usize, f64)> = wants.iter().enumerate().filter_map(time_of).collect();
        let part = |row: usize, (column, to_seconds): (usize, f64)| -> Result<f64, InputError> {
            let (seconds, found) = match columns.get_index(column) {
                Some((_, Cells::Texts(texts))) => {
                    let text = texts.get(row).map_or("", String::as_str);
                    let seconds = number(text).map(|value| value * to_seconds).or_else(|| date_time::date_time(text));
                    (seconds.unwrap_or(f64::NAN), shown(text))
                }
                Some((_, cells)) => {
                    let value = cells.numbers().and_then(|values| values.get(row)).copied().unwrap_or(f64::NAN);
                    (value * to_seconds, if value.is_nan() { String::new() } else { value.to_string() })
                }
                None => (f64::NAN, String::new()),
            };
            if seconds.is_finite() {
                return Ok(seconds);
            }
            let title = header.get(column).map_or("", String::as_str);
            let place = column_place(&format!("{place} row {}", number_of(row)), title);
            Err(date_time::explained(InputError::new(place, format!("found `{found}`, expected a time")), &found))
        };
        let stamp = |row: usize| -> Result<f64, InputError> {
            if timed.is_empty() {
                return Ok(row as f64 / rate_hz.unwrap_or(1.0));
            }
            timed.iter().try_fold(0.0, |sum, column| Ok(sum + part(row, *column)?))
        };
        let mut stamps = Stamps::default();
        let mut kept = Vec::with_capacity(rows);
        // Rows with the same stamp as the last kept row.
        let mut equal = vec![];
        for row in 0..rows {
            let at = number_of(row);
            let backwards = |message: String| {
                let error = InputError::new(format!("{place} row {at}"), message);
                if columns.contains_key(EPISODE) {
                    return error.help("its rows are of several episodes: name the folder of the data set and one of them, such as `my_set#3`");
                }
                error
            };
            match (stamps.push(stamp(row)?).map_err(backwards)?, kept.last().copied()) {
                (false, Some(before)) => equal.push((row, before)),
                _ => kept.push(row),
            }
        }
        for (row, before) in equal {
            let of_columns = columns.iter_mut().zip(wants).filter(|(_, want)| want.is_column());
            let mut addition = RowMerge::default();
            for ((name, cells), _) in of_columns {
                let mut of_column = RowMerge::default();
                cells.add(row, before, &mut of_column);
                if !is_of_head(name) {
                    addition.join(of_column);
                }
            }
            if addition.is_repeat() {
                stamps.repeats(number_of(row), stamps.row_time[row]);
            }
        }
        let mut table = Table {
            issues: issues.into_iter().chain(stamps.issue(&place)?).collect(),
            time: stamps.time,
            row_time: stamps.row_time,
            ..Table::default()
        };
        for ((title, cells), want) in columns.into_iter().zip(wants) {
            let (mut numbers, mut texts) = (vec![], vec![]);
            match want {
                ColumnRequest::Nothing | ColumnRequest::Time(_) => {}
                ColumnRequest::Number(to_si) => {
                    numbers = measured(cells, rows, &kept, *to_si, Some((&place, &title, &number_of)))?
                }
                ColumnRequest::Optional(to_si) => numbers = measured(cells, rows, &kept, *to_si, None)?,
                ColumnRequest::Sniff => {
                    if let Cells::Texts(all) = &cells {
                        all.iter().filter(|text| number(text).is_none()).for_each(|text| see(&mut texts, text));
                    }
                    numbers = measured(cells, rows, &kept, 1.0, None)?;
                }
                ColumnRequest::Text => texts = said(&cells, &kept),
            }
            table.numbers.push(numbers);
            table.texts.push(texts);
        }
        Ok(table)
    }

    fn distinct_texts(&self, column: usize, most: usize) -> Vec<String> {
        let Some((_, Cells::Texts(texts))) = self.columns.get_index(column) else { return vec![] };
        let mut found: Vec<String> = vec![];
        for text in texts.iter().filter(|text| !text.is_empty()) {
            if !found.contains(text) {
                found.push(text.clone());
            }
            if found.len() >= most {
                break;
            }
        }
        found
    }
}

/// Where a column is, for messages: the file, the title, and the number that a row has there.
type ColumnLocation<'a> = (&'a str, &'a str, &'a dyn Fn(usize) -> u64);

/// The numbers of the rows that are kept. A text that is none is an error when its place is given, and not measured otherwise.
fn measured(
    cells: Cells,
    rows: usize,
    kept: &[usize],
    to_si: f64,
    place: Option<ColumnLocation>,
) -> Result<Vec<f64>, InputError> {
    let in_si = |value: f64| if value.is_finite() { value * to_si } else { f64::NAN };
    let texts = match cells {
        Cells::Numbers(mut values) if kept.len() == rows => {
            values.resize(rows, f64::NAN);
            values.iter_mut().for_each(|value| *value = in_si(*value));
            return Ok(values);
        }
        Cells::Texts(texts) => texts,
        cells => {
            let values = cells.numbers().unwrap_or_default();
            return Ok(kept.iter().map(|row| in_si(values.get(*row).copied().unwrap_or(f64::NAN))).collect());
        }
    };
    let value = |row: &usize| {
        let text = texts.get(*row).map_or("", String::as_str);
        match (number(text), place) {
            (Some(value), _) => Ok(value * to_si),
            (None, None) => Ok(f64::NAN),
            (None, Some((place, title, number_of))) => Err(InputError::new(
                column_place(&format!("{place} row {}", number_of(*row)), title),
                format!("found `{}`, expected a number", shown(text)),
            )),
        }
    };
    kept.iter().map(value).collect()
}

/// The texts of some rows.
fn said(cells: &Cells, rows: &[usize]) -> Vec<String> {
    let text = |row: &usize| match cells {
        Cells::Texts(texts) => texts.get(*row).map_or_else(String::new, |text| text.trim().to_string()),
        numbers => {
            let value = numbers.numbers().and_then(|values| values.get(*row));
            value.filter(|value| !value.is_nan()).map_or_else(String::new, f64::to_string)
        }
    };
    rows.iter().map(text).collect()
}

/// A title with its unit, where the name does not say one already.
pub fn titled(name: &str, unit: &str) -> String {
    match names::split_unit(name) {
        (_, Some(_)) => name.to_string(),
        (name, None) if unit.is_empty() => name.to_string(),
        (name, None) => format!("{name} [{unit}]"),
    }
}
