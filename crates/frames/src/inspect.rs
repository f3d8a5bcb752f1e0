//! Looking at a log before anything is known about it: raw columns in, what each of them is like out.

use crate::bind::{Pattern, PlaceholderValues};
use crate::clean::stuck_sensors::LAZY_SECS;
use crate::clean::timebase::GAP_STEPS;
use crate::otsu;
use serde::Serialize;
use teachtree_base::error::InputError;
use teachtree_base::units::{Dimension, compound_of_log};
use teachtree_logs::issue::{Issue, IssueKind};
use teachtree_logs::names;
use teachtree_logs::read::table::{ColumnRequest, Source, Table};

/// A value that is repeated for this long is reported, s.
const REPEATED_SECS: f64 = 1.0;
/// Names that columns of time have.
const TIMES: [&str; 15] = [
    "time",
    "t",
    "ts",
    "timestamp",
    "time_stamp",
    "stamp",
    "secs",
    "sec",
    "seconds",
    "datetime",
    "%time",
    "elapsed",
    "ros_time",
    "zeit",
    "temps",
];
/// Endings of such names that say the unit.
const ENDINGS: [(&str, &str); 5] = [("_ns", "ns"), ("_us", "us"), ("_ms", "ms"), ("_sec", "s"), ("_s", "s")];

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
    /// The version that a data set of LeRobot states, such as `v2.1`.
    #[serde(skip)]
    pub lerobot_version: Option<String>,
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
    /// The first stamp, s; 0 without stamps.
    pub start_s: f64,
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
    pub kind: ValueKind,
    /// The smallest value.
    pub min: f64,
    /// The largest value.
    pub max: f64,
    /// Standard deviation of the noise: from the median of second differences, which neither motion nor contact moves.
    pub noise: f64,
    /// The share of rows without a value.
    pub missing: f64,
    /// Texts that stand in it, the first few different ones.
    pub texts: Vec<String>,
    /// The longest time for which exactly one value is repeated, s, when that is long enough to be reported; rows without stamps are not judged.
    pub repeated_s: f64,
    /// The share of rows in which a value other than zero is repeated for a quarter of a second and longer.
    pub repeated_share: f64,
    /// The means of the two groups that the values fall into, where they do: a gripper is open or closed.
    #[serde(skip)]
    pub groups: Option<[f64; 2]>,
    /// The values of evenly spaced rows, at most [`SAMPLES`]: the same rows for all columns of a sheet.
    #[serde(skip)]
    pub samples: Vec<f64>,
}

/// The most samples of a column.
pub const SAMPLES: usize = 2000;

/// The kind of values of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ValueKind {
    /// Numbers.
    Number,
    /// Only 0 and 1.
    Flag,
    /// One value all along.
    Constant,
    /// No number in any row: text, or nothing.
    Text,
}

/// The column of the stamps: where it is, how a binding calls it, and how many seconds its unit is.
pub(crate) struct StampColumn {
    pub column: usize,
    pub title: String,
    to_seconds: f64,
}

/// Looks at a log; `time` is the column of the stamps, if it is known.
///
/// # Errors
/// When a log of one sheet cannot be read.
pub fn inspect(source: Source, time: Option<&Pattern>, rate_hz: Option<f64>) -> Result<Inspection, InputError> {
    let Source { file, sheets, refused, issues, lerobot_version, .. } = source;
    let alone = sheets.len() == 1;
    let mut found = Inspection { log: file.clone(), sheets: vec![], refused, issues, lerobot_version };
    for sheet in sheets {
        let (name, header) = (sheet.name.clone(), sheet.titles());
        let at = stamps(&header, time);
        let rate = if at.is_none() { rate_hz.or(Some(1.0)) } else { None };
        let want = |index: usize| match &at {
            Some(at) if at.column == index => ColumnRequest::Time(at.to_seconds),
            _ => ColumnRequest::Sniff,
        };
        let wants: Vec<ColumnRequest> = (0..header.len()).map(want).collect();
        let table = Source::many(&file, vec![sheet]).read(&wants, rate);
        match table {
            Ok(table) => {
                found.issues.extend(table.issues.iter().cloned());
                let sheet = report(name, &header, at, rate_hz.is_some(), table);
                found.issues.extend(sheet.columns.iter().filter_map(|column| dead(&sheet, column)));
                found.sheets.push(sheet);
            }
            Err(error) if alone => return Err(error),
            Err(error) => found.refused.push((name, error.message)),
        }
    }
    Ok(found)
}

/// The column of the stamps: the one of this name, else the one that is called as such columns are; the first of a table without names.
pub(crate) fn stamps(header: &[String], time: Option<&Pattern>) -> Option<StampColumn> {
    let factor =
        |unit: Option<&str>| unit.and_then(|unit| compound_of_log(unit).ok()).map_or(1.0, |(factor, _)| factor);
    if let Some(time) = time {
        let wanted = time.name.fill(PlaceholderValues::default());
        let is_it = |title: &String| *title == wanted || names::split_known_unit(title).0 == wanted;
        let column = header.iter().position(is_it)?;
        let unit = names::split_known_unit(header.get(column)?).1;
        return Some(StampColumn { column, title: wanted, to_seconds: factor(time.unit.as_deref().or(unit)) });
    }
    let found = TIMES.iter().find_map(|known| {
        header.iter().enumerate().find_map(|(column, title)| {
            let (name, unit) = names::split_known_unit(title);
            // PlotJuggler's is `__time`, that of Motive `Time (Seconds)`.
            let name = name.trim_start_matches('_').to_lowercase();
            let name = name.strip_suffix(" (seconds)").map_or(name.clone(), str::to_string);
            if name == *known {
                return Some(StampColumn { column, title: title.clone(), to_seconds: factor(unit) });
            }
            let (_, unit) = ENDINGS.iter().find(|(ending, _)| name.strip_suffix(ending) == Some(*known))?;
            Some(StampColumn { column, title: format!("{title} [{unit}]"), to_seconds: factor(Some(unit)) })
        })
    });
    let unnamed = || header.iter().take(2).eq(["1", "2"]);
    found.or_else(|| unnamed().then(|| StampColumn { column: 0, title: "1".into(), to_seconds: 1.0 }))
}

/// The unit in which a stamp counts from 1970, if it is too large for seconds and so is in another: about 1.7e9 s have passed.
fn since_1970(stamp: f64) -> Option<(&'static str, f64)> {
    [(1e17, "ns", 1e-9), (1e14, "us", 1e-6), (1e11, "ms", 1e-3)]
        .into_iter()
        .find_map(|(least, unit, factor)| (stamp > least).then_some((unit, factor)))
}

/// Returns the unit of a column of stamps, s; `first` is its first stamp.
pub(crate) fn seconds_since_1970(at: &StampColumn, first: Option<f64>) -> f64 {
    let is_plain = at.to_seconds == 1.0 && names::split_known_unit(&at.title).1.is_none();
    let large = first.and_then(since_1970).filter(|_| is_plain);
    large.map_or(at.to_seconds, |(_, factor)| factor)
}

fn report(name: String, header: &[String], mut at: Option<StampColumn>, rated: bool, table: Table) -> SheetReport {
    let Table { mut time, numbers, texts, .. } = table;
    if let (Some(at), Some((unit, factor))) = (&mut at, time.first().and_then(|first| since_1970(*first)))
        && at.to_seconds == 1.0
        && names::split_known_unit(&at.title).1.is_none()
    {
        at.title = format!("{} [{unit}]", at.title);
        time.iter_mut().for_each(|stamp| *stamp *= factor);
    }
    let mut steps: Vec<f64> = time.iter().zip(time.iter().skip(1)).map(|(from, to)| to - from).collect();
    steps.sort_by(f64::total_cmp);
    let usual = steps.get(steps.len() / 2).copied().unwrap_or_default();
    let count = |odd: &dyn Fn(f64) -> bool| steps.iter().filter(|step| odd(**step / usual)).count();
    let uneven = count(&|steps| (steps - 1.0).abs() > 0.1) as f64 / steps.len().max(1) as f64;
    let stamps = (at.is_some() || rated) && usual > 0.0;
    let stamped = at.as_ref().map(|at| at.column);
    let columns = header.iter().zip(numbers.iter().zip(texts)).enumerate().filter(|(index, _)| Some(*index) != stamped);
    SheetReport {
        name,
        time: at.map(|at| at.title),
        rows: time.len(),
        start_s: if stamps { time.first().copied().unwrap_or_default() } else { 0.0 },
        duration_s: if stamps { time.last().zip(time.first()).map_or(0.0, |(last, first)| last - first) } else { 0.0 },
        rate_hz: if stamps { 1.0 / usual } else { 0.0 },
        uneven: if stamps { uneven } else { 0.0 },
        gaps: if stamps { count(&|steps| steps > GAP_STEPS) } else { 0 },
        longest_step_s: if stamps { steps.last().copied().unwrap_or_default() } else { 0.0 },
        columns: columns
            .map(|(_, (title, (values, texts)))| column(title, values, texts, if stamps { &time } else { &[] }))
            .collect(),
    }
}

fn column(title: &str, values: &[f64], texts: Vec<String>, time: &[f64]) -> ColumnReport {
    let (name, unit) = names::split_known_unit(title);
    let measured: Vec<f64> = values.iter().copied().filter(|value| !value.is_nan()).collect();
    let (min, max) = measured
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(min, max), value| (min.min(*value), max.max(*value)));
    let flag = |value: &f64| *value == 0.0 || (*value - 1.0).abs() < f64::EPSILON;
    let kind = match (measured.is_empty(), max > min) {
        (true, _) => ValueKind::Text,
        (false, false) => ValueKind::Constant,
        (false, true) if measured.iter().all(flag) => ValueKind::Flag,
        (false, true) => ValueKind::Number,
    };
    ColumnReport {
        name: name.to_string(),
        unit: unit.unwrap_or_default().to_string(),
        kind,
        min: if measured.is_empty() { 0.0 } else { min },
        max: if measured.is_empty() { 0.0 } else { max },
        noise: if kind == ValueKind::Number { noise(&measured) } else { 0.0 },
        missing: (values.len() - measured.len()) as f64 / values.len().max(1) as f64,
        texts,
        repeated_s: if kind == ValueKind::Number { repeated(values, time, REPEATED_SECS).longest_s } else { 0.0 },
        repeated_share: if kind == ValueKind::Number { repeated(values, time, LAZY_SECS).share } else { 0.0 },
        groups: if kind == ValueKind::Number { otsu::clear_means(measured) } else { None },
        samples: values.iter().step_by(values.len().div_ceil(SAMPLES).max(1)).copied().collect(),
    }
}

/// The message about a force that never changes, or repeats itself during most of the log without ever reading zero.
fn dead(sheet: &SheetReport, column: &ColumnReport) -> Option<Issue> {
    const MOST: f64 = 0.5;
    let rests = column.min <= 0.0 && column.max >= 0.0;
    if rests || !is_force(&column.name, &column.unit) {
        return None;
    }
    let message = match column.kind {
        ValueKind::Constant => format!("it stays at exactly {}: a sensor that measures has noise", column.min),
        ValueKind::Number if column.repeated_share > MOST => format!(
            "it repeats one value for {LAZY_SECS} s and longer in {:.0} % of the rows, and never reads zero",
            column.repeated_share * 100.0
        ),
        _ => return None,
    };
    let name = if sheet.name.is_empty() { column.name.clone() } else { format!("{}.{}", sheet.name, column.name) };
    let (start_s, end_s) = (sheet.start_s, sheet.start_s + sheet.duration_s);
    Some(Issue { kind: IssueKind::STUCK_SENSOR, start_s, end_s, channel: name, message })
}

/// Whether a column is a force, as far as its unit and its name show: `f_x`, `Fz`, `wrench.force.x`.
fn is_force(name: &str, unit: &str) -> bool {
    if let (false, Ok((_, dimension))) = (unit.is_empty(), compound_of_log(unit)) {
        return dimension == Dimension::FORCE;
    }
    let name = name.to_lowercase();
    name.split(|c: char| !c.is_alphanumeric()).any(|word| matches!(word, "f" | "fx" | "fy" | "fz" | "force" | "forces"))
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

/// How a column repeats itself.
#[derive(Default)]
struct Repetition {
    /// The longest time for which exactly one value other than zero is repeated, s; 0 when it is short.
    longest_s: f64,
    /// The share of the rows in which one is repeated for so long.
    share: f64,
}

/// How a column repeats itself for `least_s` and longer, s.
fn repeated(values: &[f64], time: &[f64], least_s: f64) -> Repetition {
    let mut found = Repetition::default();
    let mut rows = 0;
    let samples: Vec<(f64, f64)> = values.iter().copied().zip(time.iter().copied()).collect();
    for run in samples.chunk_by(|(one, _), (next, _)| one.to_bits() == next.to_bits()) {
        let [(value, from), .., (_, to)] = run else { continue };
        if to - from >= least_s && *value != 0.0 && !value.is_nan() {
            found.longest_s = found.longest_s.max(to - from);
            rows += run.len();
        }
    }
    found.share = rows as f64 / time.len().max(1) as f64;
    found
}
