//! Logs that are still being made: rows in one at a time, frames out as soon as no later row can change them.
//!
//! [`SpikeFilter`] takes out samples that cannot be, [`RowGate`] makes an even sequence of frames of the rows; [`Derivation`] derives the channels of the rules, in
//! windows, as [`crate::streaming`] does of a file. What a whole log shows of its sensors comes from a [`Calibration`].

mod calibration;
mod derivation;
mod row_gate;
pub(crate) mod spike_filter;

pub use calibration::Calibration;
pub use derivation::{Derivation, LiveChunk};
pub use row_gate::{GateOutcome, RowGate};
pub use spike_filter::SpikeFilter;

use teachtree_base::error::InputError;
use teachtree_base::field_names::FieldNames;
use teachtree_logs::read::csv::{self, StampSource, WantedColumn};
use teachtree_logs::read::memory_table::{Cells, InMemoryTable};
use teachtree_logs::read::table::Source;

/// The columns of rows with these titles, canonical names with units, and how they are spelled.
///
/// # Errors
/// A title that cannot be read, twice the same, or no `time`.
pub fn wanted<S: AsRef<str>>(titles: &[S]) -> Result<(Vec<WantedColumn>, FieldNames), InputError> {
    let mut header = InMemoryTable::new("the rows");
    for title in titles {
        if header.columns().contains_key(title.as_ref()) {
            let place = format!("the rows column {}", title.as_ref());
            let error = InputError::new(place, "the column occurs twice");
            return Err(error.help("keep one of them, or rename the other"));
        }
        header.push_column(title.as_ref().to_string(), Cells::Numbers(vec![]));
    }
    csv::wanted(&Source::one("the rows", header.header(), Box::new(header)), &StampSource::canonical())
}
