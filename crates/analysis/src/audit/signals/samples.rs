//! The samples of a column: its numbers with their stamps, and their noise where it is known.

use teachtree_frames::raw_log::RawTable;

/// Columns that number the rows of data sets, or say what no sensor measures.
const BOOKKEEPING: [&str; 7] =
    ["frame_index", "episode_index", "index", "task_index", "next.done", "next.reward", "next.success"];
/// The share of equal steps from which on a column counts something: rows, messages, time.
const COUNTING: f64 = 0.95;

/// The measured numbers of a column in the order of their stamps.
#[derive(Clone, Debug, Default)]
pub(super) struct Samples {
    /// The column as messages name it.
    pub title: String,
    /// s.
    pub time: Vec<f64>,
    /// In the unit of the column.
    pub values: Vec<f64>,
}

impl Samples {
    /// The columns of a table that a sensor or a controller may have written.
    pub fn of(table: &RawTable) -> impl Iterator<Item = Self> {
        let is_measured = |name: &str| !BOOKKEEPING.contains(&name);
        let columns = table.columns.iter().filter(move |(name, _)| is_measured(name));
        columns.map(|(name, values)| Self::column(table, name, values)).filter(|samples| !samples.counts())
    }

    fn column(table: &RawTable, name: &str, values: &[f64]) -> Self {
        let mut samples: Vec<(f64, f64)> =
            table.stamps_s.iter().copied().zip(values.iter().copied()).filter(|(_, value)| !value.is_nan()).collect();
        // Messages of several senders come as they are sent; the order of the file shows a clock that goes back.
        if table.writers.iter().any(|writer| *writer > 0) {
            samples.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        }
        let (time, values) = samples.into_iter().unzip();
        Self { title: table.title(name), time, values }
    }

    fn steps(&self) -> impl Iterator<Item = f64> {
        self.values.iter().zip(self.values.iter().skip(1)).map(|(from, to)| to - from)
    }

    /// Whether the column counts something: nearly all of its steps are equal, and not zero.
    fn counts(&self) -> bool {
        let mut steps: Vec<f64> = self.steps().collect();
        steps.sort_by(f64::total_cmp);
        let Some(usual) = steps.get(steps.len() / 2).copied() else { return false };
        let equal = steps.iter().filter(|step| (**step - usual).abs() <= usual.abs() * 1e-6).count();
        usual != 0.0 && equal as f64 >= COUNTING * steps.len() as f64
    }

    /// The share of steps that are not zero.
    pub fn changing(&self) -> f64 {
        let count = self.steps().filter(|step| *step != 0.0).count();
        count as f64 / self.values.len().saturating_sub(1).max(1) as f64
    }

    /// The smallest step that is not zero.
    pub fn quantum(&self) -> f64 {
        let least = self.steps().map(f64::abs).filter(|step| *step > 0.0).fold(f64::INFINITY, f64::min);
        if least.is_finite() { least } else { 0.0 }
    }

    /// Returns the distance of each inner sample from the mean of its neighbors.
    pub fn bends(&self) -> Vec<f64> {
        let inner = self.values.iter().zip(self.values.iter().skip(1)).zip(self.values.iter().skip(2));
        inner.map(|((before, value), after)| (value - 0.5 * (before + after)).abs()).collect()
    }
}

/// The number below which this share of all numbers is.
pub(super) fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = (share * sorted.len() as f64) as usize;
    sorted.get(at.min(sorted.len().saturating_sub(1))).copied().unwrap_or_default()
}
