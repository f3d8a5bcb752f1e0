//! Logs as their recorders left them: columns without a meaning, and stamps that are neither checked nor sorted. An audit of recordings without a binding
//! reads them; all other commands refuse logs whose stamps are wrong.

use crate::inspect::{seconds_since_1970, stamps};
use std::path::Path;
use teachtree_base::error::InputError;
use teachtree_logs::allowed_folders::AllowedFolders;
use teachtree_logs::names;
use teachtree_logs::read::formats::raw_topics::{RawBag, RawTopic};
use teachtree_logs::read::formats::{self, bag, picture};
use teachtree_logs::read::table::ColumnRequest;

/// A log as its recorder left it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RawLog {
    /// Its tables: one, or one for each topic or file.
    pub tables: Vec<RawTable>,
    /// Tables that cannot be read: name, and why.
    pub refused: Vec<(String, String)>,
    /// What of the log is missing, in words.
    pub missing: Option<String>,
    /// The stamp from which those of a bag count, ns.
    pub origin_ns: Option<i64>,
}

/// A table, its rows in the order of the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RawTable {
    /// Its name; empty if it is the only one.
    pub name: String,
    /// Whether its rows are the messages of a topic of a bag, which come when their sender sends them.
    pub is_topic: bool,
    /// The stamp of each row, s; of bags since their first stamp. Empty if no column has stamps.
    pub stamps_s: Vec<f64>,
    /// Who sent each row, counted from 0; empty if all have one sender.
    pub writers: Vec<usize>,
    /// The numbers in each column, NaN where a row has none. The columns of stamps and texts are left out.
    pub columns: Vec<(String, Vec<f64>)>,
    /// For each camera, a number for each row that only equal pictures share.
    pub pictures: Vec<(String, Vec<u64>)>,
}

impl RawTable {
    /// A column as messages name it.
    pub fn title(&self, column: &str) -> String {
        if self.name.is_empty() { column.into() } else { format!("{}.{column}", self.name) }
    }
}

/// Reads a log whose files must be in `folders`. The pictures of data sets are not read.
///
/// # Errors
/// The log cannot be opened, or none of its tables can be read.
pub fn read(path: &Path, folders: &AllowedFolders) -> Result<RawLog, InputError> {
    if bag::is_bag(path)? {
        let bag = RawBag::read(path, folders, &mut |_, shot| Ok(Ok(picture::digest(&shot.bytes))))?;
        let mut log = of_bag(&bag);
        for table in &mut log.tables {
            let shots = bag.topics.get(&table.name).map_or(&[][..], |topic| topic.pictures.as_slice());
            if !shots.is_empty() {
                let digest = |shot: &Result<u64, String>| shot.as_ref().copied().unwrap_or_default();
                let mut digests: Vec<u64> = shots.iter().map(digest).collect();
                digests.resize(table.stamps_s.len(), 0);
                table.pictures.push((String::new(), digests));
            }
        }
        return Ok(log);
    }
    let source = formats::open_within(path, folders)?;
    let mut log = RawLog { refused: source.refused, ..RawLog::default() };
    let alone = source.sheets.len() == 1;
    for sheet in source.sheets {
        let titles = sheet.titles();
        let wants = vec![ColumnRequest::Optional(1.0); titles.len()];
        // With a rate, rows are counted, so that a table with wrong stamps is read.
        match sheet.rows.read(&sheet.header, &wants, Some(1.0)) {
            Ok(table) => log.tables.push(of_sheet(sheet.name, &titles, table.numbers)),
            Err(error) if alone => return Err(error),
            Err(error) => log.refused.push((sheet.name, error.message)),
        }
    }
    Ok(log)
}

fn of_sheet(name: String, titles: &[String], numbers: Vec<Vec<f64>>) -> RawTable {
    let at = stamps(titles, None);
    let mut table = RawTable { name, ..RawTable::default() };
    for (index, (title, values)) in titles.iter().zip(numbers).enumerate() {
        match &at {
            Some(at) if at.column == index => {
                let factor = seconds_since_1970(at, values.first().copied());
                table.stamps_s = values.into_iter().map(|stamp| stamp * factor).collect();
            }
            _ if values.iter().all(|value| value.is_nan()) => {}
            _ => table.columns.push((names::split_known_unit(title).0.to_string(), values)),
        }
    }
    // Stamps that are dates are texts here.
    if table.stamps_s.iter().any(|stamp| stamp.is_nan()) {
        table.stamps_s.clear();
    }
    table
}

/// The topics of a bag without their pictures.
pub fn of_bag<P>(bag: &RawBag<P>) -> RawLog {
    let readable = bag.topics.values().filter(|topic| topic.refused.is_none());
    let origin = readable.flat_map(|topic| &topic.stamps_ns).min().copied().unwrap_or_default();
    let mut log = RawLog { missing: bag.missing.clone(), origin_ns: Some(origin), ..RawLog::default() };
    for (name, topic) in &bag.topics {
        match &topic.refused {
            Some(why) => log.refused.push((name.clone(), why.clone())),
            None => log.tables.push(of_topic(name.clone(), topic, origin)),
        }
    }
    log
}

/// When a stamp is, s since the origin of a bag.
pub fn seconds_since(origin_ns: i64, stamp_ns: i64) -> f64 {
    stamp_ns.saturating_sub(origin_ns) as f64 * 1e-9
}

fn of_topic<P>(name: String, topic: &RawTopic<P>, origin: i64) -> RawTable {
    let rows = topic.stamps_ns.len();
    let stamps_s = topic.stamps_ns.iter().map(|stamp| seconds_since(origin, *stamp)).collect();
    let mut columns = Vec::new();
    for (title, cells) in topic.rows.columns() {
        let Some(values) = cells.numbers() else { continue };
        let mut values = values.to_vec();
        values.resize(rows, f64::NAN);
        columns.push((names::split_known_unit(title).0.to_string(), values));
    }
    let writers = topic.writers.clone();
    RawTable { name, is_topic: true, stamps_s, writers, columns, pictures: Vec::new() }
}
