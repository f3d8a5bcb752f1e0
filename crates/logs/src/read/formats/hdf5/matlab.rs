//! Arrays that MATLAB wrote (MAT-file 7.3): HDF5 with the dimensions in reverse order, and an attribute `MATLAB_class`.

use ::hdf5_pure::{Dataset, Error};

/// The classes of numbers.
const NUMBERS: [&str; 11] =
    ["double", "single", "logical", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64"];

/// Reads MATLAB's data sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The dimensions are in the order of this program: another program wrote it, or it is a list of matrices, in which MATLAB has the sample last.
    Other,
    /// Numbers, whose dimensions are to be reversed.
    Numbers,
    /// Texts, cells, functions and arrays without elements.
    Unread,
}

impl Kind {
    /// Reads the attributes of a data set.
    pub fn of(dataset: &Dataset, stored: &[usize]) -> Result<Self, Error> {
        let attrs = dataset.attrs()?;
        let class = attrs.get("MATLAB_class").and_then(|class| class.as_str());
        Ok(match class.map(|class| class.trim_end_matches('\0')) {
            None => Self::Other,
            Some(class) if NUMBERS.contains(&class) && !attrs.contains_key("MATLAB_empty") => match stored {
                [_, 4, 4] => Self::Other,
                _ => Self::Numbers,
            },
            Some(_) => Self::Unread,
        })
    }
}

/// Whether a group at the root holds what MATLAB refers to from elsewhere.
pub fn is_internal(group: &str) -> bool {
    matches!(group, "#refs#" | "#subsystem#")
}

/// The dimensions in MATLAB: those of the file in reverse order. A vector has one dimension, also if it is a row of MATLAB.
pub fn shape(stored: &[usize]) -> Vec<usize> {
    match stored {
        [1, length] | [length, 1] => vec![*length],
        _ => stored.iter().rev().copied().collect(),
    }
}

/// Values in the order of the reversed dimensions, the last one fastest.
pub fn reversed(values: &[f64], stored: &[usize]) -> Vec<f64> {
    let Some((across, rest)) = stored.split_first().filter(|(_, rest)| !rest.is_empty()) else {
        return values.to_vec();
    };
    let length = rest.iter().product::<usize>();
    let parts: Vec<Vec<f64>> =
        values.chunks_exact(length.max(1)).take(*across).map(|part| reversed(part, rest)).collect();
    (0..length).flat_map(|at| parts.iter().filter_map(move |part| part.get(at).copied())).collect()
}
