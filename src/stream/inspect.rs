//! Looking at a log before anything is known about it: raw columns in, what each of them is like out.

use super::frames::Issue;
use super::names;
use super::table::{Source, Table, Want};
use super::timebase::GAP_STEPS;
use crate::base::error::InputError;
use serde::Serialize;

/// A value that is repeated for this long is told, s.
const REPEATED_SECS: f64 = 1.0;
/// Names that columns of time have.
const TIMES: [&str; 9] = ["time", "t", "timestamp", "stamp", "time_s", "secs", "seconds", "zeit", "temps"];

/// What a log is like.
#[derive(Clone, Debug, Serialize)]
pub struct Inspection {
    /// The file, as messages call it.
    pub log: String,
    /// Its tables: one, or one a topic or file.
    pub sheets: Vec<SheetReport>,
    /// Sheets that cannot be read: name, and why.
    pub refused: Vec<(String, String)>,
    /// What was found wrong while it was opened.
    pub issues: Vec<Issue>,
}

/// What a table is like.
#[derive(Clone, Debug, Serialize)]
pub struct SheetReport {
    /// Its name; empty when it is the only one.
    pub name: String,
    /// The column of the time stamps; none when no column can be one.
    pub time: Option<String>,
    /// Number of rows.
    pub rows: usize,
    /// From the first stamp to the last, s; 0 without stamps.
    pub duration_s: f64,
    /// One over the usual step, Hz; 0 without stamps.
    pub rate_hz: f64,
    /// The share of steps that are more than a tenth off the usual one.
    pub uneven: f64,
    /// How many steps are longer than one and a half usual ones.
    pub gaps: usize,
    /// The longest step, s.
    pub longest_step_s: f64,
    /// The columns, the time left out.
    pub columns: Vec<ColumnReport>,
}

/// What a column is like, in the unit in which it is logged.
#[derive(Clone, Debug, Serialize)]
pub struct ColumnReport {
    /// The name.
    pub name: String,
    /// Its unit, where the log says one.
    pub unit: String,
    /// The kind of its values.
    pub kind: Kind,
    /// The smallest value.
    pub min: f64,
    /// The largest value.
    pub max: f64,
    /// Standard deviation of the noise: from the median of second differences, which neither motion nor contact moves.
    pub noise: f64,
    /// The share of rows without a value.
    pub missing: f64,
    /// The longest time for which exactly one value is repeated, s, when that is long enough to be told; rows without stamps are not judged.
    pub repeated_s: f64,
}

/// The kind of values of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Numbers.
    Number,
    /// Only 0 and 1.
    Flag,
    /// One value all along.
    Constant,
    /// No number in any row: text, or nothing.
    Text,
}

/// Looks at a log; `time` is the name of the column of the stamps, if it is known.
///
/// # Errors
/// When a log of one sheet cannot be read.
pub fn inspect(source: Source, time: Option<&str>, rate_hz: Option<f64>) -> Result<Inspection, InputError> {
    let Source { file, sheets, refused, issues, .. } = source;
    let alone = sheets.len() == 1;
    let mut found = Inspection { log: file.clone(), sheets: vec![], refused, issues };
    for sheet in sheets {
        let (name, header) = (sheet.name.clone(), sheet.header.clone());
        let at = time_column(&header, time);
        let rate = if at.is_none() { rate_hz.or(Some(1.0)) } else { None };
        let to_seconds =
            |title: &String| names::split_known_unit(title).1.and_then(|unit| crate::base::units::compound(unit).ok());
        let want = |(index, title): (usize, &String)| match at {
            Some(at) if at == index => Want::Time(to_seconds(title).map_or(1.0, |(factor, _)| factor)),
            _ => Want::Perhaps(1.0),
        };
        let wants: Vec<Want> = header.iter().enumerate().map(want).collect();
        let table = Source::many(&file, vec![sheet]).read(&wants, rate);
        match table {
            Ok(table) => {
                found.issues.extend(table.issues.iter().cloned());
                found.sheets.push(report(name, &header, at, at.is_some() || rate_hz.is_some(), table));
            }
            Err(error) if alone => return Err(error),
            Err(error) => found.refused.push((name, error.message)),
        }
    }
    Ok(found)
}

/// The column of the stamps: the one of this name, else the one that is called as such columns are; the first of a table without names.
fn time_column(header: &[String], time: Option<&str>) -> Option<usize> {
    let name = |title: &String| names::split_known_unit(title).0.to_lowercase();
    if let Some(time) = time {
        return header.iter().position(|title| names::split_known_unit(title).0 == time);
    }
    TIMES
        .iter()
        .find_map(|known| header.iter().position(|title| name(title) == *known))
        .or_else(|| (header.len() > 1 && header.first().is_some_and(|title| title == "1")).then_some(0))
}

fn report(name: String, header: &[String], at: Option<usize>, stamped: bool, table: Table) -> SheetReport {
    let Table { time, numbers, .. } = table;
    let mut steps: Vec<f64> = time.iter().zip(time.iter().skip(1)).map(|(from, to)| to - from).collect();
    steps.sort_by(f64::total_cmp);
    let usual = steps.get(steps.len() / 2).copied().unwrap_or_default();
    let count = |odd: &dyn Fn(f64) -> bool| steps.iter().filter(|step| odd(**step / usual)).count();
    let uneven = count(&|steps| (steps - 1.0).abs() > 0.1) as f64 / steps.len().max(1) as f64;
    let stamps = stamped && usual > 0.0;
    let columns = header.iter().zip(&numbers).enumerate().filter(|(index, _)| Some(*index) != at);
    SheetReport {
        name,
        time: at.and_then(|at| header.get(at)).cloned(),
        rows: time.len(),
        duration_s: if stamps { time.last().zip(time.first()).map_or(0.0, |(last, first)| last - first) } else { 0.0 },
        rate_hz: if stamps { 1.0 / usual } else { 0.0 },
        uneven: if stamps { uneven } else { 0.0 },
        gaps: if stamps { count(&|steps| steps > GAP_STEPS) } else { 0 },
        longest_step_s: if stamps { steps.last().copied().unwrap_or_default() } else { 0.0 },
        columns: columns.map(|(_, (title, values))| column(title, values, if stamps { &time } else { &[] })).collect(),
    }
}

fn column(title: &str, values: &[f64], time: &[f64]) -> ColumnReport {
    let (name, unit) = names::split_known_unit(title);
    let measured: Vec<f64> = values.iter().copied().filter(|value| !value.is_nan()).collect();
    let (min, max) = measured
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(min, max), value| (min.min(*value), max.max(*value)));
    let flag = |value: &f64| *value == 0.0 || (*value - 1.0).abs() < f64::EPSILON;
    let kind = match (measured.is_empty(), max > min) {
        (true, _) => Kind::Text,
        (false, false) => Kind::Constant,
        (false, true) if measured.iter().all(flag) => Kind::Flag,
        (false, true) => Kind::Number,
    };
    ColumnReport {
        name: name.to_string(),
        unit: unit.unwrap_or_default().to_string(),
        kind,
        min: if measured.is_empty() { 0.0 } else { min },
        max: if measured.is_empty() { 0.0 } else { max },
        noise: if kind == Kind::Number { noise(&measured) } else { 0.0 },
        missing: (values.len() - measured.len()) as f64 / values.len().max(1) as f64,
        repeated_s: if kind == Kind::Number { repeated(values, time) } else { 0.0 },
    }
}

/// Standard deviation of white noise on a smooth signal: the median of its second differences, which are √6 times as wide.
fn noise(values: &[f64]) -> f64 {
    const MEDIAN_OF_NORMAL: f64 = 0.6745;
    let mut differences: Vec<f64> = values
        .iter()
        .zip(values.iter().skip(1))
        .zip(values.iter().skip(2))
        .map(|((a, b), c)| (a - 2.0 * b + c).abs())
        .collect();
    differences.sort_by(f64::total_cmp);
    differences.get(differences.len() / 2).copied().unwrap_or_default() / MEDIAN_OF_NORMAL / 6.0_f64.sqrt()
}

/// The longest time for which exactly one value other than zero is repeated, s; 0 when it is short.
fn repeated(values: &[f64], time: &[f64]) -> f64 {
    let mut longest: f64 = 0.0;
    let mut since: Option<(f64, u64)> = None;
    for (value, stamp) in values.iter().zip(time) {
        match since {
            Some((start, bits)) if bits == value.to_bits() && *value != 0.0 => longest = longest.max(stamp - start),
            _ => since = Some((*stamp, value.to_bits())),
        }
    }
    if longest >= REPEATED_SECS { longest } else { 0.0 }
}
