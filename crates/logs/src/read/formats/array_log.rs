//! Recordings that are arrays with a row a sample, in HDF5, NPZ and Zarr: which arrays have the rows of the recording, which are parts with rows of their
//! own, and what their stamps are. Arrays are read when something of them is wanted.

use super::array_attributes::ArrayAttributes;
use super::array_columns::ArrayColumns;
use crate::issue::{Issue, IssueKind};
use crate::read::memory_table::{Cells, InMemoryTable, titled};
use crate::read::table::{ColumnRequest, MAX_COLUMNS, Rows, Sheet, Source, Table, check_size};
use serde_json::Value;
use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::ops::Range;
use teachtree_base::error::InputError;
use teachtree_base::guard::guarded;

/// The highest rate that is believed, Hz.
pub(super) const MAX_RATE_HZ: f64 = 1e5;
/// Names of arrays that are the stamps of their recording.
const TIMES: [&str; 5] = ["time", "timestamp", "timestamps", "t", "ts"];
/// Names of attributes and of arrays of one number that are a rate in Hz.
pub(super) const RATES: [&str; 8] =
    ["fps", "control_freq", "control_hz", "rate", "hz", "rate_hz", "frequency", "sampling_rate"];

/// The values of an array, row by row.
pub(super) trait ArrayValues {
    /// The numbers of the first row, or of all rows.
    ///
    /// # Errors
    /// When they cannot be read.
    fn numbers(&self, first_row: bool) -> Result<Vec<f64>, InputError>;

    /// A text a row.
    ///
    /// # Errors
    /// When they cannot be read.
    fn texts(&self) -> Result<Vec<String>, InputError>;

    /// Returns the rows that the file lacks.
    fn missing(&self) -> Option<MissingRows> {
        None
    }
}

/// Missing rows of an array.
pub(super) struct MissingRows {
    /// The range from the first to the last missing row.
    pub rows: Range<usize>,
    /// The missing part and its replacement.
    pub message: String,
}

impl MissingRows {
    /// Returns the issue about an array. `row_time` has the stamp (s) of each row.
    fn issue(self, array: String, row_time: &[f64]) -> Issue {
        let stamp = |row: usize| row_time.get(row).or(row_time.last()).copied().unwrap_or_default();
        let (start_s, end_s) = (stamp(self.rows.start), stamp(self.rows.end.saturating_sub(1)));
        Issue { kind: IssueKind::MISSING_CHUNK, start_s, end_s, channel: array, message: self.message }
    }
}

/// Columns that are computed of others.
pub(super) trait ComputedColumns {
    /// Their names.
    fn titles(&self) -> Vec<String>;
    /// Their values.
    fn columns(&self) -> Vec<Vec<f64>>;
}

/// An array with a row a sample.
pub(super) struct Array {
    /// Its path below the recording.
    pub name: String,
    /// Its first dimension.
    pub rows: usize,
    /// The dimensions after the first one.
    pub dimensions: Vec<usize>,
    /// Its conversion to columns; `None` for texts.
    spread: Option<ArrayColumns>,
    /// The unit of its numbers, if it says one.
    unit: Option<String>,
    /// Its values, or why they cannot be read.
    values: Result<Box<dyn ArrayValues>, String>,
}

impl Array {
    /// An array of numbers or of texts.
    ///
    /// # Errors
    /// When its first row cannot be read, which distinguishes poses from other matrices.
    pub fn new(
        name: String,
        rows: usize,
        dimensions: &[usize],
        texts: bool,
        attributes: &ArrayAttributes,
        values: Box<dyn ArrayValues>,
    ) -> Result<Self, InputError> {
        let values = attributes.applied(values);
        let matrices = !texts && dimensions.ends_with(&[4, 4]) && rows > 0;
        let first = if matrices { values.numbers(true)? } else { vec![] };
        let spread = if texts { None } else { ArrayColumns::new(&name, dimensions, &first) };
        let unit = attributes.unit.clone();
        Ok(Self { name, rows, dimensions: dimensions.to_vec(), spread, unit, values: Ok(values) })
    }

    /// An array that cannot be read.
    pub fn refused(name: String, rows: usize, dimensions: &[usize], reason: impl Into<String>) -> Self {
        Self { name, rows, dimensions: dimensions.to_vec(), spread: None, unit: None, values: Err(reason.into()) }
    }

    /// Number of values of a row.
    pub fn width(&self) -> usize {
        self.dimensions.iter().product()
    }

    /// Its numbers; `None` if it cannot be read.
    pub fn numbers(&self) -> Option<Result<Vec<f64>, InputError>> {
        self.values.as_ref().ok().map(|values| values.numbers(false))
    }

    /// The titles of its columns, with the unit; a rotation has none.
    fn titles(&self) -> Vec<String> {
        let Some(spread) = &self.spread else { return vec![self.name.clone()] };
        let titles = spread.titles();
        match &self.unit {
            Some(unit) if spread.has_poses() => {
                let in_unit = |title: String| if title.contains(".position.") { titled(&title, unit) } else { title };
                titles.into_iter().map(in_unit).collect()
            }
            Some(unit) => titles.iter().map(|title| titled(title, unit)).collect(),
            None => titles,
        }
    }

    /// Its columns, as long as the recording: what is said once holds all along.
    fn cells(&self, rows: usize) -> Result<Vec<Cells>, InputError> {
        let Ok(values) = &self.values else { return Ok(vec![]) };
        let Some(spread) = &self.spread else {
            let mut texts = values.texts()?;
            if let [text] = texts.as_slice() {
                texts = vec![text.clone(); rows];
            }
            return Ok(vec![Cells::Texts(texts)]);
        };
        let held = |column: Vec<f64>| match column.as_slice() {
            [value] => vec![*value; rows],
            _ => column,
        };
        let columns = spread.columns(&values.numbers(false)?);
        Ok(columns.into_iter().map(|column| Cells::Numbers(held(column))).collect())
    }
}

/// Returns the number of rows of a recording: the stated number, else that of its actions, else that of most of its arrays.
pub(super) fn rows(arrays: &[Array], said: Option<usize>) -> usize {
    let with = |rows: usize| arrays.iter().filter(|array| array.rows == rows).count();
    let actions =
        arrays.iter().find(|array| matches!(array.name.as_str(), "actions" | "action")).map(|array| array.rows);
    let known = said.into_iter().chain(actions).find(|rows| *rows > 0 && with(*rows) > 0);
    let by_count = |a: &&Array, b: &&Array| match with(a.rows).cmp(&with(b.rows)) {
        Ordering::Equal => a.rows.cmp(&b.rows),
        order => order,
    };
    known.or_else(|| arrays.iter().max_by(by_count).map(|array| array.rows)).unwrap_or(0)
}

/// The rate that attributes say, Hz: `attribute` is one of them, texts in JSON being what they say.
pub(super) fn rate(attribute: &dyn Fn(&str) -> Value) -> Option<f64> {
    let object = |key: &str| match attribute(key) {
        Value::String(text) => serde_json::from_str(&text).unwrap_or_default(),
        other => other,
    };
    let (args, info) = (object("env_args"), object("env_info"));
    let number = |of: &Value, path: &[&str]| path.iter().try_fold(of, |of, key| of.get(*key))?.as_f64();
    let simulated = number(&args, &["sim_args", "dt"]).zip(number(&args, &["sim_args", "decimation"]));
    number(&args, &["env_kwargs", "control_freq"])
        .or_else(|| number(&args, &["control_freq"]))
        .or_else(|| number(&info, &["control_freq"]))
        .or_else(|| simulated.map(|(dt, steps)| 1.0 / (dt * steps)))
        .or_else(|| RATES.iter().find_map(|key| attribute(key).as_f64()))
        .filter(|rate| *rate > 0.0 && *rate <= MAX_RATE_HZ)
}

/// A recording whose columns are known and not read yet.
pub(super) struct Recording {
    /// The file and the recording in it, for messages.
    pub place: String,
    /// Its arrays.
    pub arrays: Vec<Array>,
    /// Number of rows.
    pub rows: usize,
    /// Maximum number of bytes of its columns.
    pub most: u64,
    /// The rate, where it is known, Hz.
    pub rate_hz: Option<f64>,
    /// The stamps, where no array has them.
    pub time: Option<Vec<f64>>,
    /// The columns that are computed from its arrays.
    pub computed: Option<Box<dyn ComputedColumns>>,
}

impl Recording {
    /// The recording as a log. Arrays with another number of rows than it has are sheets of their own, such as `rows_1102`.
    ///
    /// # Errors
    /// When no array has a row a sample, or there are too many columns.
    pub fn source(mut self) -> Result<Source, InputError> {
        let Self { place, rows, most, .. } = &self;
        let (place, rows, most) = (place.clone(), *rows, *most);
        let is_time = |array: &Array| TIMES.contains(&array.name.as_str()) && array.rows == rows;
        if self.arrays.iter().any(is_time) {
            self.time = None;
        } else if let (None, Some(rate)) = (&self.time, self.rate_hz) {
            check_size(&place, rows, 1)?;
            self.time = Some((0..rows).map(|row| row as f64 / rate).collect());
        }
        let (mut refused, mut own) = (vec![], vec![]);
        let mut others: BTreeMap<usize, Vec<Array>> = BTreeMap::new();
        for array in self.arrays.drain(..) {
            if let Err(reason) = &array.values {
                refused.push((array.name, reason.clone()));
            } else if array.rows == rows || array.rows == 1 {
                // A single value holds for all rows.
                own.push(array);
            } else if array.rows > 0 {
                others.entry(array.rows).or_default().push(array);
            }
        }
        if rows == 0 || own.is_empty() {
            let error = InputError::new(place, "found no array with a row a sample, expected arrays such as `actions`");
            return Err(match refused.first() {
                Some((name, reason)) => error.help(format!("`{name}` {reason}")),
                None => error,
            });
        }
        self.arrays = own;
        let mut sheets = vec![self.sheet("")];
        for (rows, arrays) in others {
            let place = format!("{place} rows_{rows}");
            let other = Self { place, arrays, rows, most, rate_hz: None, time: None, computed: None };
            sheets.push(other.sheet(&format!("rows_{rows}")));
        }
        let columns: usize = sheets.iter().map(|sheet| sheet.header.len()).sum();
        if columns > MAX_COLUMNS {
            return Err(InputError::new(place, format!("found {columns} columns, at most {MAX_COLUMNS} are read")));
        }
        Ok(Source { refused, ..Source::many(place, sheets) })
    }

    /// A sheet of this name.
    fn sheet(self, name: &str) -> Sheet {
        let time = self.time.iter().map(|_| "time [s]".to_string());
        let computed = self.computed.iter().flat_map(|computed| computed.titles());
        let header = time.chain(self.arrays.iter().flat_map(Array::titles)).chain(computed).collect();
        Sheet::new(name, header, Box::new(self))
    }

    /// Reads the requested columns; the others are empty. Also returns the arrays with missing rows.
    fn memory(self, wants: &[ColumnRequest]) -> Result<(InMemoryTable, Vec<(String, MissingRows)>), InputError> {
        let wanted = wants.iter().filter(|want| **want != ColumnRequest::Nothing).count();
        check_size(&self.place, self.rows, wanted)?;
        // A single value takes memory for all rows, and a damaged file may promise any number of rows.
        if wanted.saturating_mul(self.rows).saturating_mul(8) as u64 > self.most {
            let message = format!("{} columns of {} rows are more data than the file can hold", wanted, self.rows);
            return Err(InputError::new(self.place, message));
        }
        let mut memory = InMemoryTable::new(&self.place);
        let mut missing = vec![];
        let mut wants = wants.iter();
        if let Some(time) = self.time {
            wants.next();
            memory.push_column("time [s]".into(), Cells::Numbers(time));
        }
        for array in self.arrays {
            let titles = array.titles();
            let wanted = wants.by_ref().take(titles.len()).filter(|want| **want != ColumnRequest::Nothing).count() > 0;
            let cells = if wanted { array.cells(self.rows)? } else { vec![] };
            if let (true, Ok(values)) = (wanted, &array.values) {
                missing.extend(values.missing().map(|missing| (array.name.clone(), missing)));
            }
            let mut cells = cells.into_iter();
            for title in titles {
                memory.push_column(title, cells.next().unwrap_or_else(|| Cells::Numbers(vec![])));
            }
        }
        if let Some(computed) = self.computed {
            let wanted = wants.any(|want| *want != ColumnRequest::Nothing);
            let columns = if wanted { computed.columns() } else { vec![] };
            let mut columns = columns.into_iter();
            for title in computed.titles() {
                memory.push_column(title, Cells::Numbers(columns.next().unwrap_or_default()));
            }
        }
        Ok((memory, missing))
    }
}

impl Rows for Recording {
    fn read(
        self: Box<Self>,
        header: &[String],
        wants: &[ColumnRequest],
        rate_hz: Option<f64>,
    ) -> Result<Table, InputError> {
        let place = self.place.clone();
        let (memory, missing) = guarded(&place, || self.memory(wants))?;
        let mut table = Box::new(memory).read(header, wants, rate_hz)?;
        table.issues.extend(missing.into_iter().map(|(array, missing)| missing.issue(array, &table.row_time)));
        Ok(table)
    }
}
