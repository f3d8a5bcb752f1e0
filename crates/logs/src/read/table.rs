//! What every format becomes: tables of named raw columns with times. What the columns mean is not known here.
//!
//! Most logs are one sheet. A bag has a sheet a topic and a folder a sheet a file, each with stamps of its own; a column of such a
//! sheet is called `<sheet>.<column>`. Sheets that are read together are laid on the union of their stamps, numbers being unmeasured
//! and texts held between the samples of their sheet, so that resampling finds every sample where it was taken.

use crate::issue::{Issue, IssueKind};
use crate::names;
use crate::read::topic_clocks::{TopicClock, different_clocks};
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_base::recording::Event;
use teachtree_base::scene::Scene;

/// The most columns that a sheet may have.
pub const MAX_COLUMNS: usize = 10_000;
/// How many different texts of a column are seen by `ColumnRequest::Sniff`.
pub const SEEN: usize = 4;
/// The longest cell that is read, in bytes.
pub const MAX_CELL: usize = 64 * 1024;
/// The most numbers of 8 bytes that a log in memory may take, its cells and what is derived of them (4 GiB): formats that compress may promise
/// more than any machine holds.
pub const MAX_NUMBERS: usize = 1 << 29;
/// How many numbers are derived for a row, about: targets, velocities and contacts of one hand.
const DERIVED: usize = 40;
/// The most rows of a log that is read block by block, of which the stamps alone are in memory: three days at 1 kHz.
pub const MAX_ROWS: usize = 1 << 28;

/// Refuses a table that does not fit in memory.
///
/// # Errors
/// When it has more than [`MAX_NUMBERS`].
pub fn check_size(place: &str, rows: usize, columns: usize) -> Result<(), InputError> {
    check_cells(place, rows, rows.saturating_mul(columns))
}

/// Refuses a table that does not fit in memory.
///
/// # Errors
/// When it has more than [`MAX_NUMBERS`].
pub fn check_cells(place: &str, rows: usize, cells: usize) -> Result<(), InputError> {
    if cells.saturating_add(rows.saturating_mul(DERIVED)) <= MAX_NUMBERS {
        return Ok(());
    }
    let message = format!(
        "found {cells} cells in {rows} rows or more, expected at most {MAX_NUMBERS} in memory, {DERIVED} of them a row for derived values"
    );
    Err(InputError::new(place, message)
        .help("cut the log into parts; a plain log of any length is read in windows (docs/logs.md)"))
}

/// Refuses a table of which not even the stamps fit in memory.
///
/// # Errors
/// When it has more than [`MAX_ROWS`].
pub fn check_rows(place: &str, rows: usize) -> Result<(), InputError> {
    if rows <= MAX_ROWS {
        return Ok(());
    }
    Err(InputError::new(place, format!("found more than {MAX_ROWS} rows, the most that are read"))
        .help("cut the log into parts"))
}

/// The advice about a log in which no column is known to have the stamps.
pub const NAME_TIME: &str =
    "name it in a binding as `time: <column>`, or write `rate: 100 Hz` if the rows are evenly spaced";

/// A log whose columns are known.
pub struct Source {
    /// The name of the file in messages.
    pub file: String,
    /// Where the columns are named, for messages: `log.csv row 1`.
    pub header_place: String,
    /// The tables.
    pub sheets: Vec<Sheet>,
    /// The scene that the log itself carries.
    pub scene: Option<Scene>,
    /// The events that the log itself carries.
    pub events: Vec<Event>,
    /// What was dropped while the log was opened.
    pub issues: Vec<Issue>,
    /// Sheets that are in the file and cannot be read, by name, with the reason.
    pub refused: Vec<(String, String)>,
    /// The clock of a bag, whose stamps count from its first one here.
    pub clock: Option<BagClock>,
    /// Whether the recording is a success, by each field of the log that says so.
    pub success_fields: Vec<(&'static str, bool)>,
    /// The version of its format that a data set of LeRobot states, such as `v2.1`.
    pub lerobot_version: Option<String>,
}

/// How the times of a bag's log come from the clocks of the bag.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BagClock {
    /// The stamp at t = 0, ns: the earliest one of the bag.
    pub origin_ns: i64,
    /// The delay between stamp and recording, ns: the median over all messages with a stamp in their header; 0 without such messages.
    pub recorded_after_ns: i64,
}

/// A table with stamps of its own.
pub struct Sheet {
    /// Stands before the names of the columns; empty when there is one sheet only.
    pub name: String,
    /// The columns as the log calls them, with unit where it says one: `force.x [mN]`.
    pub header: Vec<String>,
    /// The rows.
    pub rows: Box<dyn Rows>,
    /// How long after its stamp a message of the topic was recorded, s, in the median. `None` of other sheets, and of messages that hold for the whole log.
    pub recorded_after_s: Option<f64>,
}

impl Sheet {
    /// A sheet that is not a topic.
    pub fn new(name: impl Into<String>, header: Vec<String>, rows: Box<dyn Rows>) -> Self {
        Self { name: name.into(), header, rows, recorded_after_s: None }
    }

    /// The columns as the log calls them; one without a name is called by its place.
    pub fn titles(&self) -> Vec<String> {
        let title = |(place, title): (usize, &String)| match title.as_str() {
            "" => (place + 1).to_string(),
            title => title.to_string(),
        };
        self.header.iter().enumerate().map(title).collect()
    }
}

/// Rows that are not read yet.
pub trait Rows {
    /// Reads the rows, taking of each column what is wanted of it. A stamp is the sum of the columns of `ColumnRequest::Time`; where
    /// none is wanted, stamps count the rows at `rate_hz`.
    ///
    /// # Errors
    /// At the first row that cannot be read as it should: its place, what was found, what was wanted.
    fn read(
        self: Box<Self>,
        header: &[String],
        wants: &[ColumnRequest],
        rate_hz: Option<f64>,
    ) -> Result<Table, InputError>;

    /// The same block by block, so that no more than a block is in memory; `None` of rows that are there already.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    fn blocks(
        self: Box<Self>,
        _header: &[String],
        _wants: &[ColumnRequest],
        _rate_hz: Option<f64>,
    ) -> Result<Option<Box<dyn Blocks>>, InputError> {
        Ok(None)
    }

    /// The first different texts of a column, at most `most`; of rows that are not in memory none are known.
    fn distinct_texts(&self, _column: usize, _most: usize) -> Vec<String> {
        vec![]
    }

    /// Whether [`blocks`](Self::blocks) gives any.
    fn comes_in_blocks(&self) -> bool {
        false
    }
}

/// Rows that are read block by block.
pub trait Blocks {
    /// The next rows, as [`Rows::read`] gives all of them; `None` after the last ones.
    ///
    /// # Errors
    /// As [`Rows::read`].
    fn next(&mut self) -> Result<Option<Table>, InputError>;

    /// The numbers of some rows only, in order; each may be asked for several times. With them, how many rows there are in all.
    ///
    /// # Errors
    /// As [`Rows::read`].
    fn pick(&mut self, rows: &[usize]) -> Result<(usize, Vec<Vec<f64>>), InputError> {
        let (mut start, mut next) = (0, 0);
        let mut picked: Vec<Vec<f64>> = Vec::new();
        while let Some(block) = self.next()? {
            picked.resize(block.numbers.len(), vec![]);
            let end = start + block.time.len();
            let here = rows.get(next..).unwrap_or_default();
            let here = here.get(..here.partition_point(|row| *row < end)).unwrap_or_default();
            for (column, values) in picked.iter_mut().zip(&block.numbers).filter(|(_, values)| !values.is_empty()) {
                column.extend(here.iter().map(|row| values.get(row - start).copied().unwrap_or(f64::NAN)));
            }
            next += here.len();
            start = end;
        }
        Ok((start, picked))
    }
}

/// What to make of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ColumnRequest {
    /// Leave it out.
    Nothing,
    /// The time stamps; the factor makes them seconds.
    Time(f64),
    /// Numbers; the factor makes them SI. An empty cell is NaN, a text is an error.
    Number(f64),
    /// Numbers of an optional column: a text is NaN.
    Optional(f64),
    /// Numbers, and beside them the first [`SEEN`] different texts: to see what a column is like.
    Sniff,
    /// Text.
    Text,
}

impl ColumnRequest {
    /// The factor that makes its numbers SI, of what is numbers.
    pub fn to_si(self) -> Option<f64> {
        match self {
            Self::Time(to_si) | Self::Number(to_si) | Self::Optional(to_si) => Some(to_si),
            Self::Sniff => Some(1.0),
            Self::Nothing | Self::Text => None,
        }
    }

    /// The same with stamps multiplied by a factor.
    pub(crate) fn scaled(self, factor: f64) -> Self {
        if let Self::Time(to_seconds) = self { Self::Time(to_seconds * factor) } else { self }
    }

    /// Whether it makes a column of a table.
    pub(crate) fn is_column(self) -> bool {
        matches!(self, Self::Number(_) | Self::Optional(_) | Self::Sniff | Self::Text)
    }
}

/// The rows of a table.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// Time stamps, s, strictly rising.
    pub time: Vec<f64>,
    /// The stamp of each row of the file, s, also of those that repeat one: what a row number in another file means.
    pub row_time: Vec<f64>,
    /// One entry a column of the header; empty unless a number was wanted.
    pub numbers: Vec<Vec<f64>>,
    /// One entry a column of the header; empty unless text was wanted, and then one a row, or the different ones of a `ColumnRequest::Sniff`.
    pub texts: Vec<Vec<String>>,
    /// What was dropped.
    pub issues: Vec<Issue>,
    /// How many sheets with stamps of their own it was laid together from.
    pub sheets: usize,
}

impl Table {
    /// No rows, and room for columns.
    pub(crate) fn empty(columns: usize) -> Self {
        Self { numbers: vec![vec![]; columns], texts: vec![vec![]; columns], ..Self::default() }
    }
}

impl Source {
    /// A log of one sheet.
    pub fn one(file: impl Into<String>, header: Vec<String>, rows: Box<dyn Rows>) -> Self {
        Self::many(file, vec![Sheet::new("", header, rows)])
    }

    /// A log of these sheets.
    pub fn many(file: impl Into<String>, sheets: Vec<Sheet>) -> Self {
        let file = file.into();
        Self {
            header_place: file.clone(),
            file,
            sheets,
            scene: None,
            events: vec![],
            issues: vec![],
            refused: vec![],
            clock: None,
            success_fields: vec![],
            lerobot_version: None,
        }
    }

    /// The columns of all sheets under their full names, units included.
    pub fn header(&self) -> Vec<String> {
        let title = |sheet: &Sheet, title: String| match sheet.name.as_str() {
            "" => title,
            name => format!("{name}.{title}"),
        };
        self.sheets
            .iter()
            .flat_map(|sheet| sheet.titles().into_iter().map(move |column| title(sheet, column)))
            .collect()
    }

    /// Reads the sheets of which something is wanted; `wants` goes along with [`Source::header`].
    ///
    /// # Errors
    /// At the first row that cannot be read as it should, or when a sheet has no time.
    pub fn read(self, wants: &[ColumnRequest], rate_hz: Option<f64>) -> Result<Table, InputError> {
        let width: usize = self.sheets.iter().map(|sheet| sheet.header.len()).sum();
        let alone = self.sheets.len() == 1;
        let mut parts = vec![];
        let mut clocks = vec![];
        let mut first = 0;
        for sheet in self.sheets {
            let columns = first..first + sheet.header.len();
            first = columns.end;
            let wants = wants.get(columns.clone()).unwrap_or_default();
            if !alone && !wants.iter().any(|want| want.is_column()) {
                continue;
            }
            if rate_hz.is_none() && !wants.iter().any(|want| matches!(want, ColumnRequest::Time(_))) {
                let place = if alone { self.file } else { format!("{} sheet {}", self.file, sheet.name) };
                return Err(InputError::new(place, "no column holds the time").help(NAME_TIME));
            }
            let table = sheet.rows.read(&sheet.header, wants, rate_hz);
            let mut table = table.map_err(|error| error.or_kind(ErrorKind::Format))?;
            // Row numbers do not distinguish the rows of several sheets.
            let of_rows = |issue: &&mut Issue| issue.kind == IssueKind::DUPLICATE_STAMP && issue.channel.is_empty();
            table.issues.iter_mut().filter(of_rows).for_each(|issue| issue.channel.clone_from(&sheet.name));
            let interval = table.time.first().copied().zip(table.time.last().copied());
            clocks.extend(sheet.recorded_after_s.zip(interval).map(|(after_s, interval)| TopicClock {
                topic: sheet.name,
                after_s,
                interval,
            }));
            parts.push((columns.start, table));
        }
        let mut table = match <[(usize, Table); 1]>::try_from(parts) {
            Ok([(start, table)]) => spread(table, start, width),
            Err(parts) => merged(parts, width, &self.file)?,
        };
        table.issues.splice(0..0, self.issues);
        table.issues.extend(different_clocks(&clocks));
        Ok(table)
    }
}

/// A table of some columns as one of all columns.
fn spread(table: Table, start: usize, width: usize) -> Table {
    let mut numbers = vec![vec![]; width];
    let mut texts = vec![vec![]; width];
    for (slot, column) in numbers.iter_mut().skip(start).zip(table.numbers) {
        *slot = column;
    }
    for (slot, column) in texts.iter_mut().skip(start).zip(table.texts) {
        *slot = column;
    }
    Table { numbers, texts, sheets: 1, ..table }
}

/// Tables on the union of their stamps.
fn merged(parts: Vec<(usize, Table)>, width: usize, file: &str) -> Result<Table, InputError> {
    // What was said once only, such as a transform that never changes, holds all along.
    let is_held = |table: &Table| table.time.len() == 1;
    let stamps: Vec<&[f64]> =
        parts.iter().filter(|(_, table)| !is_held(table)).map(|(_, table)| table.time.as_slice()).collect();
    let time = union(&stamps);
    if time.is_empty() {
        return Err(InputError::new(file, "each of the bound parts has a single row: a log has at least two"));
    }
    let columns = parts.iter().flat_map(|(_, table)| &table.numbers).filter(|column| !column.is_empty()).count();
    check_size(file, time.len(), columns)
        .map_err(|error| InputError { message: format!("placed on one time base: {}", error.message), ..error })?;
    let sheets = stamps.len();
    let mut whole = Table { numbers: vec![vec![]; width], texts: vec![vec![]; width], sheets, ..Table::default() };
    for (start, table) in parts {
        let held_all_along = is_held(&table);
        let Table { time: own, numbers, texts, issues, .. } = table;
        let own = if held_all_along { time.get(..1).unwrap_or_default().to_vec() } else { own };
        for (slot, column) in whole.numbers.iter_mut().skip(start).zip(numbers) {
            if !column.is_empty() {
                *slot = match column.as_slice() {
                    [value] if held_all_along => vec![*value; time.len()],
                    column => placed(&time, &own, column),
                };
            }
        }
        for (slot, column) in whole.texts.iter_mut().skip(start).zip(texts) {
            if !column.is_empty() {
                *slot = held(&time, &own, &column);
            }
        }
        whole.issues.extend(issues);
    }
    Ok(Table { row_time: time.clone(), time, ..whole })
}

/// All stamps, in order, each once.
pub fn union(stamps: &[&[f64]]) -> Vec<f64> {
    let mut time: Vec<f64> = stamps.concat();
    time.sort_by(f64::total_cmp);
    time.dedup();
    time
}

/// A column at the stamps of its own among others: not measured elsewhere. Both lists rise strictly.
pub fn placed(time: &[f64], own: &[f64], column: &[f64]) -> Vec<f64> {
    let mut samples = own.iter().zip(column).peekable();
    let value = |stamp: &f64| samples.next_if(|(at, _)| *at <= stamp).map_or(f64::NAN, |(_, value)| *value);
    time.iter().map(value).collect()
}

/// A text at every stamp: the last one, nothing before the first.
fn held(time: &[f64], own: &[f64], column: &[String]) -> Vec<String> {
    let mut samples = own.iter().zip(column).peekable();
    let mut last = String::new();
    let mut texts = Vec::with_capacity(time.len());
    for stamp in time {
        if let Some((_, text)) = samples.next_if(|(at, _)| *at <= stamp) {
            last.clone_from(text);
        }
        texts.push(last.clone());
    }
    texts
}

/// The place of a column in messages, by its name without unit.
pub(crate) fn column_place(place: &str, title: &str) -> String {
    let (name, _) = names::split_unit(title);
    format!("{place} column {name}")
}

/// Texts of values that were not measured, in small letters; those with brackets and signs are of spreadsheets and of C libraries.
const UNMEASURED: [&str; 23] = [
    "",
    "-",
    "--",
    ".",
    "na",
    "n/a",
    "<na>",
    "#n/a",
    "#na",
    "#num!",
    "#div/0!",
    "#value!",
    "#ref!",
    "null",
    "none",
    "nil",
    "nan(ind)",
    "-nan(ind)",
    "1.#qnan",
    "-1.#qnan",
    "1.#ind",
    "-1.#ind",
    "nat",
];

/// The number that a text says: NaN for an empty one, for `nan` and its like, and for an infinity; true is 1 and false 0.
pub fn number(text: &str) -> Option<f64> {
    let text = text.trim();
    if let Ok(value) = text.parse::<f64>() {
        return Some(if value.is_finite() { value } else { f64::NAN });
    }
    let is = |word: &&str| text.eq_ignore_ascii_case(word);
    match text {
        text if text.eq_ignore_ascii_case("true") => Some(1.0),
        text if text.eq_ignore_ascii_case("false") => Some(0.0),
        _ if UNMEASURED.iter().any(is) || ["1.#inf", "-1.#inf"].iter().any(is) => Some(f64::NAN),
        _ => None,
    }
}

/// Puts a text among those that were seen in a column, if it is none of them and there is room.
pub(crate) fn see(seen: &mut Vec<String>, text: &str) {
    let text = text.trim();
    if seen.len() < SEEN && !text.is_empty() && !seen.iter().any(|known| known == text) {
        seen.push(shown(text));
    }
}

/// The beginning of a text, for a message.
pub fn shown(text: &str) -> String {
    let mut head: String = text.chars().take(40).collect();
    if head.len() < text.len() {
        head.push('…');
    }
    head
}
