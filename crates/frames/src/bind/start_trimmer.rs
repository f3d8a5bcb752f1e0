//! The beginning of a live log that is resampled: rows wait until each sensor has begun.

use super::resampler::ResampledRow;

/// Cuts off the beginning at which some sensor is silent still: sensors do not start as one.
#[derive(Default)]
pub(super) struct StartTrimmer {
    /// Whether the start is known, so that rows pass directly.
    pub is_over: bool,
    rows: Vec<ResampledRow>,
    /// The first row in which each column was measured.
    begins: Vec<Option<usize>>,
}

impl StartTrimmer {
    /// Takes a row; returns those that are complete, or will not be within the bridge, s.
    pub fn take(&mut self, row: ResampledRow, bridge: f64) -> Vec<ResampledRow> {
        if self.is_over {
            return vec![row];
        }
        let (time, values) = &row;
        let is_late = time - self.rows.first().map_or(*time, |(start, _)| *start) > bridge;
        self.begins.resize(values.len().max(self.begins.len()), None);
        // Columns that begin later than the bridge are not awaited.
        for (begins, _) in self.begins.iter_mut().zip(values).filter(|(_, value)| !is_late && !value.is_nan()) {
            begins.get_or_insert(self.rows.len());
        }
        self.rows.push(row);
        if is_late || self.begins.iter().all(Option::is_some) { self.finish() } else { vec![] }
    }

    /// Returns the remaining rows.
    pub fn finish(&mut self) -> Vec<ResampledRow> {
        self.is_over = true;
        let from = self.begins.iter().flatten().max().copied().unwrap_or_default();
        let mut rows = std::mem::take(&mut self.rows);
        rows.split_off(from.min(rows.len()))
    }
}
