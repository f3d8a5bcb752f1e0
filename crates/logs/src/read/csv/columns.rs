//! The columns of a canonical table: names, units, and the type of each.

use crate::issue::Issue;
use crate::names;
use crate::read::first_stamp::count_from_first;
use crate::read::table::{ColumnRequest, Source};
use indexmap::IndexMap;
use teachtree_base::error::InputError;
use teachtree_base::field_names::FieldNames;
use teachtree_base::quantity::Frequency;
use teachtree_base::recording::{Column, Recording};
use teachtree_base::spelling::nearest;
use teachtree_base::units::{Dimension, compound_of_log};

/// A recording with what was dropped while it was read.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadedRecording {
    /// The recording; columns with names that are not canonical are in it too.
    pub recording: Recording,
    /// Rows that were left out.
    pub issues: Vec<Issue>,
    /// The time of each row of the file, also of omitted rows, on the time base of the recording, s.
    pub row_time: Vec<f64>,
    /// What the stamps show at 0 s on that time base, s: 0 if they do not count from 1970.
    pub zero_stamp_s: f64,
}

impl LoadedRecording {
    /// Lets times since 1970 count from the first row.
    pub fn count_from_first(&mut self) {
        self.zero_stamp_s += count_from_first(&mut self.recording.time, &mut self.row_time, &mut self.issues);
    }
}

/// The column of the stamps of a table.
pub enum StampSource {
    /// In a column.
    Column {
        /// The name of the column.
        name: String,
        /// The unit, where the header says none.
        unit: Option<String>,
        /// The factor that converts the numbers of the column to this unit.
        scale: f64,
    },
    /// Nowhere: the rows come at this rate.
    Rate(Frequency),
}

impl StampSource {
    /// As a canonical log has it.
    pub fn canonical() -> Self {
        Self::Column { name: "time".into(), unit: None, scale: 1.0 }
    }
}

/// A column of a canonical table: its name inside the program, its dimension, and what to read of it.
pub type WantedColumn = (String, Dimension, ColumnRequest);

/// The columns of a canonical table, and how it spells their names.
pub fn wanted(source: &Source, clock: &StampSource) -> Result<(Vec<WantedColumn>, FieldNames), InputError> {
    let header = source.header();
    let header_place = source.header_place.clone();
    let place = |name: &str| format!("{header_place} column {name}");
    let unnamed = source.sheets.iter().flat_map(|sheet| &sheet.header).position(String::is_empty);
    if let Some(column) = unnamed {
        return Err(InputError::new(place(&(column + 1).to_string()), "the column has no name"));
    }
    let mut seen: IndexMap<String, Dimension> = IndexMap::new();
    let mut wants = Vec::with_capacity(header.len());
    let mut spelling = FieldNames::default();
    for title in &header {
        let (name, unit) = names::split_unit(title);
        if name.is_empty() {
            return Err(InputError::new(place(&(wants.len() + 1).to_string()), "the column has no name"));
        }
        let (want, dimension) = match clock {
            StampSource::Column { name: time, unit: said, scale } if time == name => {
                want("time", unit.or(said.as_deref())).map(|(want, dimension)| (want.scaled(*scale), dimension))
            }
            StampSource::Rate(_) if name == "time" => Ok((ColumnRequest::Nothing, Dimension::TIME)),
            _ => want(name, unit),
        }
        .map_err(|message| InputError::new(place(name), message))?;
        let inside = spelling.take(name);
        if let Some(first) = seen.get_index_of(&inside) {
            let message = format!("the column occurs twice, as columns {} and {}", first + 1, wants.len() + 1);
            return Err(InputError::new(place(name), message).help("keep one of them, or rename the other"));
        }
        seen.insert(inside, dimension);
        wants.push(want);
    }
    let titles = || seen.keys().map(String::as_str);
    if let StampSource::Column { name: time, .. } = clock
        && !seen.contains_key(time.as_str())
    {
        let near =
            nearest("time", titles()).or_else(|| titles().find(|name| matches!(*name, "t" | "timestamp" | "stamp")));
        let error = InputError::new(&header_place, format!("the log has no column `{time}`"));
        return Err(match near {
            Some(name) => error.help(format!(
                "rename `{name}` to `time [s]`, or describe the log in a binding and name it with --binding"
            )),
            None => error.help("add `time [s]`, or describe the log in a binding and name it with --binding"),
        });
    }
    let named = seen.into_iter().zip(wants);
    Ok((named.map(|((name, dimension), want)| (name, dimension, want)).collect(), spelling))
}

/// Reads the columns of a canonical table.
pub fn columns(source: Source, clock: &StampSource) -> Result<LoadedRecording, InputError> {
    let (wanted, spelling) = wanted(&source, clock)?;
    let wants: Vec<ColumnRequest> = wanted.iter().map(|(.., want)| *want).collect();
    let rate_hz = match clock {
        StampSource::Column { .. } => None,
        StampSource::Rate(rate) => Some(rate.0),
    };
    let table = source.read(&wants, rate_hz)?;
    let mut recording = Recording { time: table.time, spelling, ..Recording::default() };
    for (((name, dimension, want), numbers), texts) in wanted.into_iter().zip(table.numbers).zip(table.texts) {
        match want {
            ColumnRequest::Nothing | ColumnRequest::Time(_) => {}
            ColumnRequest::Number(_) | ColumnRequest::Optional(_) | ColumnRequest::Sniff => {
                recording.columns.insert(name, Column { dimension, values: numbers });
            }
            ColumnRequest::Text => {
                recording.labels.insert(name, texts);
            }
        }
    }
    Ok(LoadedRecording { recording, issues: table.issues, row_time: table.row_time, zero_stamp_s: 0.0 })
}

/// Returns the request for a column with this name and unit, and its dimension.
fn want(name: &str, unit: Option<&str>) -> Result<(ColumnRequest, Dimension), String> {
    if names::is_label(name) {
        return Ok((ColumnRequest::Text, Dimension::NONE));
    }
    let meant =
        if name == "time" { Some(Dimension::TIME) } else { names::meaning(name).map(|meaning| meaning.dimension) };
    let read = unit.map(compound_of_log);
    match (meant, read) {
        (Some(meant), Some(Err(part))) => Err(format!("`{part}` is not a known unit, expected one of {meant}")),
        (Some(meant), Some(Ok((_, found)))) if found != meant => {
            Err(format!("`{name}` is given in `{}`, which is {found}, expected {meant}", unit.unwrap_or_default()))
        }
        (Some(meant), read) => {
            let to_si = read.and_then(Result::ok).map_or(1.0, |(to_si, _)| to_si);
            Ok((if name == "time" { ColumnRequest::Time(to_si) } else { ColumnRequest::Number(to_si) }, meant))
        }
        (None, read) => {
            let (to_si, dimension) = read.and_then(Result::ok).unwrap_or((1.0, Dimension::NONE));
            Ok((ColumnRequest::Optional(to_si), dimension))
        }
    }
}
