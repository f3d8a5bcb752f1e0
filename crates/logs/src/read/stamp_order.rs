//! Checks the order of stamps in tables, bags and live logs: later stamps, repeated stamps, and clocks that were set back.

use crate::issue::{Issue, IssueKind};
use std::collections::BTreeMap;
use teachtree_base::error::InputError;
use teachtree_base::short_number::ShortNumber;

/// Number of increasing stamps in a row, all of them too late, that indicates a clock that was set back.
pub const SET_BACK: usize = 10;

/// This many rows of one stamp, on average, mean that stamps have too few digits.
const ROUNDED: usize = 10;

/// The relation of a stamp to the previous ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// Later than all previous stamps.
    Later,
    /// Equal to the newest stamp.
    Equal,
    /// Earlier than the newest stamp.
    Earlier,
    /// The last of [`SET_BACK`] late stamps in a row: the clock was set back. The next stamps are compared with this one.
    SetBack,
}

/// The order of the stamps of one clock.
#[derive(Clone, Copy, Debug)]
pub struct StampOrder {
    /// The newest stamp, s.
    newest_s: f64,
    /// Number of late but increasing stamps in a row, and the last of them, s.
    late: (usize, f64),
}

impl Default for StampOrder {
    fn default() -> Self {
        Self { newest_s: f64::NEG_INFINITY, late: (0, f64::NEG_INFINITY) }
    }
}

impl StampOrder {
    /// The newest stamp, s; −∞ before the first one.
    pub fn newest_s(&self) -> f64 {
        self.newest_s
    }

    /// Returns the number of late but increasing stamps in a row, including the last one.
    pub fn late(&self) -> usize {
        self.late.0
    }

    /// Marks stamps up to `to_s` (s) as late.
    pub fn raise(&mut self, to_s: f64) {
        self.newest_s = self.newest_s.max(to_s);
    }

    /// Takes the next stamp, s.
    pub fn push(&mut self, seconds: f64) -> Order {
        if seconds > self.newest_s {
            *self = Self { newest_s: seconds, ..Self::default() };
            return Order::Later;
        }
        let (count, before_s) = self.late;
        self.late = (if seconds > before_s { count + 1 } else { 1 }, seconds);
        if self.late.0 >= SET_BACK {
            *self = Self { newest_s: seconds, ..Self::default() };
            return Order::SetBack;
        }
        if seconds < self.newest_s { Order::Earlier } else { Order::Equal }
    }
}

/// The advice about stamps of too few digits.
const MORE_DIGITS: &str = "stamps need enough digits to distinguish consecutive rows";

/// Formats the message about stamps of too few digits: many rows repeat the stamp of one that was kept; `None` for fewer.
fn too_few_digits(repeated: usize, kept: usize) -> Option<String> {
    let rows = repeated + kept;
    (kept > 0 && rows >= ROUNDED * kept).then(|| format!("about {} rows share each time stamp", rows / kept))
}

/// Counts the rows of a live log that repeat the stamp of the row before.
#[derive(Clone, Copy, Debug, Default)]
pub struct RepeatedStamps {
    last_s: Option<f64>,
    repeated: usize,
    kept: usize,
}

impl RepeatedStamps {
    /// Takes the stamp of the next row, s.
    pub fn push(&mut self, seconds: f64) {
        let is_repeated = self.last_s.replace(seconds) == Some(seconds);
        *(if is_repeated { &mut self.repeated } else { &mut self.kept }) += 1;
    }

    /// Refuses stamps of too few digits, whose rate is unknown; `place` is the name of the log.
    ///
    /// # Errors
    /// Many rows share each stamp.
    pub fn check(&self, place: &str) -> Result<(), InputError> {
        let message = too_few_digits(self.repeated, self.kept);
        message.map_or(Ok(()), |message| Err(InputError::new(place, message).help(MORE_DIGITS)))
    }
}

/// Clocks that begin again: their period, s, and what to do.
const PERIODS: [(f64, &str); 5] = [
    (86_400.0, "the clock passes midnight: write the date into the stamps"),
    (43_200.0, "the clock has 12 hours: write AM or PM, or the date, into the stamps"),
    (3_600.0, "the minutes begin again at a full hour: write the hour into the stamps"),
    (4_294.967_296, "a counter of us with 32 bits begins again: add 4294967296 to the stamps from this row on"),
    (4_294_967.296, "a counter of ms with 32 bits begins again: add 4294967296 to the stamps from this row on"),
];

/// Why a clock returns from one stamp to another, s: it shows a period of [`PERIODS`], of which the next row follows.
fn cause_of_return(from_s: f64, to_s: f64) -> Option<&'static str> {
    let is_period = |(period, _): &(f64, &str)| (from_s - to_s - period).abs() < 1.0;
    PERIODS.into_iter().find(is_period).map(|(_, cause)| cause)
}

/// Formats the message about a clock that was set back.
pub fn set_back(from_s: f64, to_s: f64, then: &str) -> String {
    let [from, to] = [from_s, to_s].map(|time| ShortNumber((time * 1e6).round() / 1e6));
    format!("the clock was set back from {from} s to {to} s; {then}")
}

/// The stamps of a table: takes them one by one and keeps or drops each.
#[derive(Default)]
pub(crate) struct Stamps {
    /// The stamps that were kept, s.
    pub time: Vec<f64>,
    /// The stamps of all rows, s.
    pub row_time: Vec<f64>,
    /// Number of rows that repeat a stamp, the first of these rows, and the stamps of the first and the last one.
    repeated: Option<(usize, u64, f64, f64)>,
    /// Number of kept stamps, including those already taken.
    kept: usize,
    order: StampOrder,
}

impl Stamps {
    /// Takes the stamp of a row and returns whether the row is kept. A row that is not kept has the stamp of the previous row: it is
    /// either merged into that row or counted as [`repeated`](Self::repeats).
    ///
    /// # Errors
    /// Time runs backwards. The message describes where.
    pub fn push(&mut self, seconds: f64) -> Result<bool, String> {
        let last = self.order.newest_s();
        let order = self.order.push(seconds);
        if matches!(order, Order::Earlier | Order::SetBack) {
            let cause = cause_of_return(last, seconds).map_or(String::new(), |cause| format!("; {cause}"));
            return Err(format!(
                "time runs backwards: {} s after {} s{cause}",
                ShortNumber(seconds),
                ShortNumber(last)
            ));
        }
        self.row_time.push(seconds);
        if order == Order::Later {
            self.time.push(seconds);
            self.kept += 1;
        }
        Ok(order == Order::Later)
    }

    /// Counts a row that repeats the previous row, by its number in the file and its stamp, s.
    pub fn repeats(&mut self, row: u64, seconds: f64) {
        let (count, first_row, start, _) = self.repeated.unwrap_or((0, row, seconds, seconds));
        self.repeated = Some((count + 1, first_row, start, seconds));
    }

    /// Takes the stamps since the last call: the kept ones and all.
    #[cfg(feature = "parquet")]
    pub fn take(&mut self) -> (Vec<f64>, Vec<f64>) {
        (std::mem::take(&mut self.time), std::mem::take(&mut self.row_time))
    }

    /// Returns the last kept stamp, s.
    pub fn last(&self) -> Option<f64> {
        (self.kept > 0).then_some(self.order.newest_s())
    }

    /// Returns the issue about repeated stamps.
    ///
    /// # Errors
    /// All rows of `place` have the same stamp, or many rows share each stamp.
    pub fn issue(&self, place: &str) -> Result<Option<Issue>, InputError> {
        let Some((count, row, start_s, end_s)) = self.repeated else { return Ok(None) };
        if self.kept == 1 {
            let message = format!("all {} rows have the same time stamp", count + 1);
            return Err(InputError::new(place, message).help(MORE_DIGITS));
        }
        if let Some(message) = too_few_digits(count, self.kept) {
            return Err(InputError::new(place, message)
                .help(format!("{MORE_DIGITS}; if the steps are even, a binding with their `rate` replaces them")));
        }
        let rows = if count == 1 { "row repeats" } else { "rows repeat" };
        let message = format!(
            "{count} {rows} the time stamp of the row before, first in row {row}; the first of equal stamps is kept"
        );
        Ok(Some(Issue { kind: IssueKind::DUPLICATE_STAMP, start_s, end_s, channel: String::new(), message }))
    }
}

/// The result of merging two rows with the same stamp. Rows with different elements, such as those of two drivers on one topic, form one row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RowMerge {
    adds: bool,
    differs: bool,
    /// Whether the other row has a value.
    has_values: bool,
}

impl RowMerge {
    /// Merges a number; it replaces a value that was not measured.
    pub fn number(&mut self, kept: &mut f64, other: f64) {
        if kept.is_nan() && !other.is_nan() {
            (*kept, self.adds) = (other, true);
        }
        self.differs |= !other.is_nan() && *kept != other;
        self.has_values |= !other.is_nan();
    }

    /// Merges a text; it replaces an empty one.
    pub fn text(&mut self, kept: &mut String, other: &str) {
        if kept.is_empty() && !other.is_empty() {
            kept.push_str(other);
            self.adds = true;
        }
        self.differs |= !other.is_empty() && kept != other;
        self.has_values |= !other.is_empty();
    }

    /// Notes that a value replaced one that was not measured.
    pub fn fill(&mut self) {
        (self.adds, self.has_values) = (true, true);
    }

    /// Combines the results of two merges.
    pub fn join(&mut self, other: Self) {
        self.adds |= other.adds;
        self.differs |= other.differs;
        self.has_values |= other.has_values;
    }

    /// Whether the row differs from the kept one or has only values that the kept one has. A row without values, such as the message of a driver that publishes
    /// other elements than those that are read, repeats nothing.
    pub fn is_repeat(self) -> bool {
        self.differs || self.has_values && !self.adds
    }
}

/// Whether a column belongs to the header of a message, which does not identify the element.
pub fn is_of_head(column: &str) -> bool {
    column.starts_with("header.")
}

/// The writers of a topic. Messages with a common column come from the same writer.
#[derive(Clone, Debug, Default)]
pub struct Writers<T> {
    of_column: BTreeMap<usize, usize>,
    writers: BTreeMap<usize, T>,
}

impl<T: Default> Writers<T> {
    /// Returns the writer of a message with these columns. Merges writers that the columns show to be the same.
    pub fn of(&mut self, columns: &[usize], merge: impl Fn(&mut T, T)) -> &mut T {
        let mut known: Vec<usize> = columns.iter().filter_map(|column| self.of_column.get(column)).copied().collect();
        let is_known = known.len() == columns.len();
        known.sort_unstable();
        known.dedup();
        // The key of a writer is the first column of its first message.
        let own = known.first().or(columns.first()).copied().unwrap_or(usize::MAX);
        if known.len() > 1 {
            self.of_column.values_mut().filter(|of| known.contains(of)).for_each(|of| *of = own);
        }
        if !is_known {
            self.of_column.extend(columns.iter().map(|column| (*column, own)));
        }
        let others: Vec<T> = known.iter().skip(1).filter_map(|other| self.writers.remove(other)).collect();
        let writer = self.writers.entry(own).or_default();
        others.into_iter().for_each(|other| merge(writer, other));
        writer
    }

    /// Returns the columns of the writer of this column.
    pub fn columns_with(&self, column: usize) -> impl Iterator<Item = usize> + '_ {
        let own = self.of_column.get(&column).copied();
        self.of_column.iter().filter(move |(_, of)| Some(**of) == own).map(|(column, _)| *column)
    }

    /// Returns all writers.
    pub fn all(&self) -> impl Iterator<Item = &T> {
        self.writers.values()
    }

    /// Returns all writers, mutably.
    pub fn all_mut(&mut self) -> impl Iterator<Item = &mut T> {
        self.writers.values_mut()
    }

    /// Returns the writers with a column that `is_meant` selects.
    pub fn with(&self, is_meant: impl Fn(usize) -> bool) -> impl Iterator<Item = &T> {
        let meant: std::collections::BTreeSet<usize> =
            self.of_column.iter().filter(|(column, _)| is_meant(**column)).map(|(_, of)| *of).collect();
        self.writers.iter().filter(move |(own, _)| meant.contains(own)).map(|(_, writer)| writer)
    }
}
