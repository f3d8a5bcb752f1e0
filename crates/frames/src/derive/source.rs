//! Where a channel's values come from while a hand has one target: columns of a body, or one value that stays.

use std::ops::Range;

/// Values of `N` components over the whole log.
#[derive(Clone, Copy)]
pub enum Source<'a, const N: usize> {
    /// They never change.
    Same([f64; N]),
    /// A column for each component.
    Columns([&'a [f64]; N]),
}

impl<const N: usize> Source<'_, N> {
    /// All zero.
    pub const ZERO: Self = Self::Same([0.0; N]);

    /// Puts the values of some frames after those that are there, a column for each component.
    pub fn append(&self, frames: Range<usize>, columns: &mut [Vec<f64>; N]) {
        match self {
            Self::Same(values) => {
                columns
                    .iter_mut()
                    .zip(values)
                    .for_each(|(column, value)| column.resize(column.len() + frames.len(), *value));
            }
            Self::Columns(parts) => {
                for (column, part) in columns.iter_mut().zip(parts) {
                    column.extend_from_slice(part.get(frames.clone()).unwrap_or_default());
                }
            }
        }
    }
}

impl<'a, const N: usize, C: AsRef<[f64]>> From<&'a [C; N]> for Source<'a, N> {
    fn from(columns: &'a [C; N]) -> Self {
        Self::Columns(columns.each_ref().map(AsRef::as_ref))
    }
}

impl<'a> Source<'a, 1> {
    /// One column.
    pub const fn column(column: &'a [f64]) -> Self {
        Self::Columns([column])
    }
}
