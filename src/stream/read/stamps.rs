//! The order of stamps, checked the same way for tables, bags and live logs: which stamp comes later, which repeats one, and when a clock was set back.

use crate::base::error::InputError;
use crate::base::shown::Shown;
use crate::stream::issue::{Issue, IssueKind};
use std::collections::BTreeMap;

/// How many stamps in order that all come too late show that the clock was set back.
pub const SET_BACK: usize = 10;

/// What a stamp is after those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// Later than all of them.
    Later,
    /// The same as the newest one.
    Equal,
    /// Earlier than that.
    Earlier,
    /// One of so many too early ones in order that the clock was set back; the next stamps are compared with this one.
    SetBack,
}

/// The order of the stamps of one clock.
#[derive(Clone, Copy, Debug)]
pub struct StampOrder {
    /// The newest stamp, s.
    newest_s: f64,
    /// How many stamps in order came too late, one after the other, and the last of them.
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

    /// How many stamps in order came too late, up to the last one.
    pub fn late(&self) -> usize {
        self.late.0
    }

    /// Stamps up to here, s, come too late whatever came before.
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

/// What is said of a clock that was set back.
pub fn set_back(from_s: f64, to_s: f64, then: &str) -> String {
    let [from, to] = [from_s, to_s].map(|time| Shown((time * 1e6).round() / 1e6));
    format!("the clock was set back from {from} s to {to} s; {then}")
}

/// How the stamps of a table go on: one by one, each kept or left out.
#[derive(Default)]
pub(in crate::stream) struct Stamps {
    /// The stamps that were kept, s.
    pub time: Vec<f64>,
    /// The stamps of all rows, s.
    pub row_time: Vec<f64>,
    /// How many rows repeat a stamp, the first of them, and the stamps of the first and the last.
    repeated: Option<(usize, u64, f64, f64)>,
    /// How many stamps were kept; the lists may have been taken away since.
    kept: usize,
    order: StampOrder,
}

impl Stamps {
    /// Takes the stamp of a row; whether the row is kept. One that is not has the stamp of the row before, and either adds to that or is
    /// [`repeated`](Self::repeats).
    ///
    /// # Errors
    /// When time runs backwards, what is to be said about it.
    pub fn push(&mut self, seconds: f64) -> Result<bool, String> {
        let last = self.order.newest_s();
        let order = self.order.push(seconds);
        if matches!(order, Order::Earlier | Order::SetBack) {
            return Err(format!("time runs backwards: {} s after {} s", Shown(seconds), Shown(last)));
        }
        self.row_time.push(seconds);
        if order == Order::Later {
            self.time.push(seconds);
            self.kept += 1;
        }
        Ok(order == Order::Later)
    }

    /// Counts a row that repeats what the row before says, by its number in the file and its stamp, s.
    pub fn repeats(&mut self, row: u64, seconds: f64) {
        let (count, first_row, start, _) = self.repeated.unwrap_or((0, row, seconds, seconds));
        self.repeated = Some((count + 1, first_row, start, seconds));
    }

    /// The stamps since the last time, those that were kept and all of them.
    #[cfg(feature = "parquet")]
    pub fn take(&mut self) -> (Vec<f64>, Vec<f64>) {
        (std::mem::take(&mut self.time), std::mem::take(&mut self.row_time))
    }

    /// The last stamp that was kept, s.
    pub fn last(&self) -> Option<f64> {
        (self.kept > 0).then_some(self.order.newest_s())
    }

    /// The message about stamps that were repeated.
    ///
    /// # Errors
    /// When all rows of `place` have the same stamp.
    pub fn issue(&self, place: &str) -> Result<Option<Issue>, InputError> {
        let Some((count, row, start_s, end_s)) = self.repeated else { return Ok(None) };
        if self.kept == 1 {
            let message = format!("all {} rows have the same time stamp", count + 1);
            return Err(
                InputError::new(place, message).help("stamps need more digits than the step between rows is long")
            );
        }
        let rows = if count == 1 { "row repeats" } else { "rows repeat" };
        let message = format!(
            "{count} {rows} the time stamp of the row before, first in row {row}; the first of equal stamps is kept"
        );
        Ok(Some(Issue { kind: IssueKind::DUPLICATE_STAMP, start_s, end_s, channel: String::new(), message }))
    }
}

/// What a row adds to another one with the same stamp: rows that name different elements are one, as of two drivers that publish on one topic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Addition {
    adds: bool,
    differs: bool,
}

impl Addition {
    /// Puts a number where none was measured.
    pub fn number(&mut self, kept: &mut f64, other: f64) {
        if kept.is_nan() && !other.is_nan() {
            (*kept, self.adds) = (other, true);
        }
        self.differs |= !other.is_nan() && *kept != other;
    }

    /// Puts a text where none is.
    pub fn text(&mut self, kept: &mut String, other: &str) {
        if kept.is_empty() && !other.is_empty() {
            kept.push_str(other);
            self.adds = true;
        }
        self.differs |= !other.is_empty() && kept != other;
    }

    /// What is true of either is true of both.
    pub fn join(&mut self, other: Self) {
        (self.adds, self.differs) = (self.adds || other.adds, self.differs || other.differs);
    }

    /// Whether something of the row is left out, or all of it was there already.
    pub fn is_repeat(self) -> bool {
        self.differs || !self.adds
    }
}

/// Whether a column is of the head of a message, which says nothing of what the message is about.
pub fn is_of_head(column: &str) -> bool {
    column.starts_with("header.")
}

/// Those who write to a topic. Messages that have a column in common are of one of them.
#[derive(Clone, Debug, Default)]
pub struct Writers<T> {
    of_column: BTreeMap<usize, usize>,
    writers: BTreeMap<usize, T>,
}

impl<T: Default> Writers<T> {
    /// The writer of a message with these columns. Writers that turn out to be one are merged.
    pub fn of(&mut self, columns: &[usize], merge: impl Fn(&mut T, T)) -> &mut T {
        let mut known: Vec<usize> = columns.iter().filter_map(|column| self.of_column.get(column)).copied().collect();
        let is_known = known.len() == columns.len();
        known.sort_unstable();
        known.dedup();
        // A writer is called by the first column that it was seen with.
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

    /// The columns of the writer that has this one.
    pub fn columns_with(&self, column: usize) -> impl Iterator<Item = usize> + '_ {
        let own = self.of_column.get(&column).copied();
        self.of_column.iter().filter(move |(_, of)| Some(**of) == own).map(|(column, _)| *column)
    }

    /// All writers.
    pub fn all(&self) -> impl Iterator<Item = &T> {
        self.writers.values()
    }

    /// All writers, to be changed.
    pub fn all_mut(&mut self) -> impl Iterator<Item = &mut T> {
        self.writers.values_mut()
    }

    /// The writers of which a column is meant.
    pub fn with(&self, is_meant: impl Fn(usize) -> bool) -> impl Iterator<Item = &T> {
        let meant: std::collections::BTreeSet<usize> =
            self.of_column.iter().filter(|(column, _)| is_meant(**column)).map(|(_, of)| *of).collect();
        self.writers.iter().filter(move |(own, _)| meant.contains(own)).map(|(_, writer)| writer)
    }
}
