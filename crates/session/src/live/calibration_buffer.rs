//! The rows of a live log until the calibration: they are kept in order, with what was wrong with them.

use teachtree_logs::issue::{Issue, IssueKind};
use teachtree_logs::names::split_unit;
use teachtree_logs::read::memory_table::{Cells, InMemoryTable};
use teachtree_logs::read::stamp_order::{Order, RepeatedStamps, StampOrder, set_back};
use teachtree_logs::read::table::number;

/// The most bytes of lines, and of cells, that are kept to calibrate with.
const MOST_BYTES: usize = 128 << 20;
/// The most issues that wait for the calibration; further ones are counted.
pub(super) const MOST_PENDING: usize = 100;
/// A longer step is a gap, in which nothing is learned, s.
const LONGEST_STEP_S: f64 = 1.0;

/// The rows until the calibration.
pub(super) struct CalibrationBuffer {
    pub rows: InMemoryTable,
    /// The order of the stamps, and the duration of the rows without gaps, s.
    pub order: StampOrder,
    lasts_s: f64,
    /// Rows that repeat a stamp.
    pub repeated: RepeatedStamps,
    /// Bytes of the lines.
    bytes: usize,
    pub issues: Vec<Issue>,
    /// How many more issues there were.
    pub more: usize,
}

impl CalibrationBuffer {
    pub fn new(name: &str) -> Self {
        Self {
            rows: InMemoryTable::new(name),
            order: StampOrder::default(),
            lasts_s: 0.0,
            repeated: RepeatedStamps::default(),
            bytes: 0,
            issues: vec![],
            more: 0,
        }
    }

    pub fn report(&mut self, issue: Issue) {
        if self.issues.len() < MOST_PENDING {
            self.issues.push(issue);
        } else {
            self.more += 1;
        }
    }

    /// Where the newest row is, s.
    pub fn at_s(&self) -> f64 {
        let newest_s = self.order.newest_s();
        if newest_s.is_finite() { newest_s } else { 0.0 }
    }

    /// Keeps a row that comes after the others.
    pub fn keep(&mut self, row: &InMemoryTable, bytes: usize) -> Result<(), String> {
        let stamp_s = stamp_s(row).ok_or("the row has no stamp, expected a number as `time`")?;
        let last_s = self.order.newest_s();
        self.repeated.push(stamp_s);
        match self.order.push(stamp_s) {
            Order::Later => {}
            Order::Equal | Order::Earlier => {
                return Err(format!("the row of {stamp_s} s came after the row of {last_s} s"));
            }
            Order::SetBack => {
                let message = set_back(last_s, stamp_s, "calibration restarts");
                let at_s = last_s;
                self.report(Issue {
                    kind: IssueKind::GAP,
                    start_s: at_s,
                    end_s: at_s,
                    channel: String::new(),
                    message,
                });
                let (issues, more, order) = (std::mem::take(&mut self.issues), self.more, self.order);
                *self = Self { issues, more, order, ..Self::new(&self.rows.place) };
            }
        }
        let step_s = stamp_s - last_s;
        if (0.0..=LONGEST_STEP_S).contains(&step_s) {
            self.lasts_s += step_s;
        }
        self.bytes += bytes;
        self.rows.begin_row().map_err(|error| error.message)?;
        for (name, cells) in row.columns() {
            if let Some(value) = cell(cells) {
                self.rows.put(name, value).map_err(|error| error.message)?;
            }
        }
        Ok(())
    }

    /// Whether there are enough rows, or as many as are kept.
    pub fn is_enough(&self, lasts_s: f64) -> bool {
        let cells = self.rows.rows() * self.rows.columns().len();
        self.rows.rows() > 1 && (self.lasts_s >= lasts_s || self.bytes.max(cells * size_of::<f64>()) >= MOST_BYTES)
    }
}

/// The number in the only row of a column; `None` where it is text.
pub(super) fn cell(cells: &Cells) -> Option<f64> {
    match cells {
        Cells::Texts(texts) => number(texts.first()?),
        numbers => numbers.numbers()?.first().copied(),
    }
}

/// The stamp of the only row, s.
fn stamp_s(row: &InMemoryTable) -> Option<f64> {
    let (title, cells) = row.columns().iter().find(|(title, _)| split_unit(title).0 == "time")?;
    let per_unit = match split_unit(title).1 {
        Some("ms") => 1e-3,
        Some("us") => 1e-6,
        Some("ns") => 1e-9,
        _ => 1.0,
    };
    cell(cells).map(|stamp| stamp * per_unit).filter(|stamp| stamp.is_finite())
}
