//! Lines of a live log: JSON objects or CSV, told from each other by the first line. The first seconds are kept to calibrate with, then each line is a row.

use super::{Calibration, Live, LiveEvent};
use crate::base::error::{ErrorKind, InputError};
use crate::base::scene::Scene as Bodies;
use crate::session::error::Error;
use crate::session::log::{Log, Scene};
use crate::session::rules::RulesOptions;
use crate::stream::OpenRequest;
use crate::stream::issue::{Issue, IssueKind};
use crate::stream::names::split_unit;
use crate::stream::read::formats::jsonl::{Line, Lines, push};
use crate::stream::read::sheet::{Cells, InMemoryTable};
use crate::stream::read::table::Source;

/// The most lines in a row that are no rows: then it is no log.
const MOST_BAD: usize = 1000;
/// The most rows that are kept to calibrate with.
const MOST_ROWS: usize = 1 << 20;

/// What a live log is made of.
pub struct FeedOptions {
    /// The name of the source in messages.
    pub name: String,
    /// The rules.
    pub rules: RulesOptions,
    /// The bodies, where no file and no line of the log has them.
    pub scene: Option<Scene>,
    /// For how long rows are kept to calibrate with, s.
    pub calibrate_s: f64,
    /// A recording to calibrate with instead.
    pub calibration: Option<Log>,
}

/// A live log, line by line.
pub struct Feed {
    options: FeedOptions,
    scene: Option<Bodies>,
    line: u64,
    bad: usize,
    /// The columns, as they are called; those of JSON objects are known with the calibration.
    header: Option<Vec<String>>,
    is_csv: bool,
    /// Rows until the calibration.
    rows: InMemoryTable,
    live: Option<Live>,
}

impl Feed {
    /// Nothing was read yet.
    pub fn new(options: FeedOptions) -> Self {
        let rows = InMemoryTable::new(&options.name);
        Self { options, scene: None, line: 0, bad: 0, header: None, is_csv: false, rows, live: None }
    }

    /// Takes a line. A line that is no row is an issue.
    ///
    /// # Errors
    /// Too many lines in a row are no rows; the calibration fails; as [`Live::push`].
    pub fn line(&mut self, line: &[u8]) -> Result<Vec<LiveEvent>, Error> {
        self.line += 1;
        if line.iter().all(u8::is_ascii_whitespace) {
            return Ok(vec![]);
        }
        let is_first = self.header.is_none() && self.rows.rows() == 0 && self.scene.is_none();
        if is_first && !line.trim_ascii_start().starts_with(b"{") {
            self.is_csv = true;
            self.header = Some(cells(line).map_err(|message| self.error(message))?);
            return Ok(vec![]);
        }
        let before = self.rows.rows();
        let read = if self.is_csv { self.csv(line) } else { self.json(line) };
        if let Err(message) = read {
            self.bad += 1;
            if self.bad > MOST_BAD {
                return Err(self.error(format!("more than {MOST_BAD} lines in a row are no rows; {message}")));
            }
            return Ok(self.unreadable(message));
        }
        self.bad = 0;
        if self.live.is_some() {
            let row = self.row();
            return match &mut self.live {
                Some(live) if self.rows.rows() > 0 => {
                    self.rows = InMemoryTable::new(&self.options.name);
                    live.push(&row)
                }
                _ => Ok(vec![]),
            };
        }
        if self.rows.rows() > before && self.is_calibrated() { self.calibrate() } else { Ok(vec![]) }
    }

    /// The log has ended.
    ///
    /// # Errors
    /// As [`line`](Self::line).
    pub fn finish(mut self) -> Result<Vec<LiveEvent>, Error> {
        let mut events = if self.live.is_none() { self.calibrate()? } else { vec![] };
        if let Some(live) = self.live {
            events.extend(live.finish()?);
        }
        Ok(events)
    }

    /// Reports that lines were lost before they were read.
    pub fn lost(&mut self, lines: u64) -> Vec<LiveEvent> {
        let message = format!("{lines} lines came faster than they could be analyzed, and are left out");
        self.issue(IssueKind::MISSING_ROW, message)
    }

    fn error(&self, message: impl Into<String>) -> Error {
        let place = format!("{} row {}", self.options.name, self.line);
        Error::new(InputError::new(place, message), ErrorKind::Format)
    }

    fn unreadable(&mut self, message: String) -> Vec<LiveEvent> {
        let message = format!("line {} is left out: {message}", self.line);
        self.issue(IssueKind::UNREADABLE_ROW, message)
    }

    fn issue(&mut self, kind: IssueKind, message: String) -> Vec<LiveEvent> {
        let Some(live) = &mut self.live else { return vec![] };
        let at = live.newest_s();
        live.report(Issue { kind, start_s: at, end_s: at, channel: String::new(), message })
    }

    /// Puts an object into the table.
    fn json(&mut self, line: &[u8]) -> Result<(), String> {
        // The line has no end when it is the last one, or came alone.
        let mut whole = line.to_vec();
        whole.push(b'\n');
        let mut lines = Lines::new(whole.as_slice(), self.options.name.clone());
        match lines.line().map_err(|error| error.message)? {
            Some(Line::Row(row)) => push(&row, &mut self.rows),
            Some(Line::Scene(scene)) if self.live.is_none() && self.rows.rows() == 0 => {
                self.scene = Some(*scene);
                Ok(())
            }
            Some(Line::Scene(_)) => Err("found a `scene`, expected it in the first line only".into()),
            Some(Line::Cut(message)) => Err(message),
            None => Ok(()),
        }
    }

    /// Puts a line of a table into the table.
    fn csv(&mut self, line: &[u8]) -> Result<(), String> {
        let cells = cells(line)?;
        let header = self.header.as_deref().unwrap_or_default();
        if cells.len() != header.len() {
            return Err(format!("found {} cells, expected {}", cells.len(), header.len()));
        }
        // What is no number was not measured; the columns of labels are text.
        let values = cells.iter().map(|cell| cell.trim().parse().unwrap_or(f64::NAN));
        self.rows.begin_row().map_err(|error| error.message)?;
        for (name, value) in header.iter().zip(values) {
            self.rows.put(name, value).map_err(|error| error.message)?;
        }
        Ok(())
    }

    /// The values of the newest row in the order of the header.
    fn row(&self) -> Vec<f64> {
        let header = self.header.as_deref().unwrap_or_default();
        header.iter().map(|name| newest(&self.rows, name)).collect()
    }

    /// Whether enough rows are there.
    fn is_calibrated(&self) -> bool {
        let time = self.rows.columns().iter().find(|(title, _)| split_unit(title).0 == "time");
        let Some((title, Cells::Numbers(stamps))) = time else { return self.rows.rows() > 1 };
        let per_unit = match split_unit(title).1 {
            Some("ms") => 1e-3,
            Some("us") => 1e-6,
            Some("ns") => 1e-9,
            _ => 1.0,
        };
        let long = stamps
            .last()
            .zip(stamps.first())
            .is_some_and(|(last, first)| (last - first) * per_unit >= self.options.calibrate_s);
        let known = self.options.calibration.is_some() && self.rows.rows() > 1;
        known || long || self.rows.rows() >= MOST_ROWS
    }

    /// Learns from the rows so far, and takes them.
    fn calibrate(&mut self) -> Result<Vec<LiveEvent>, Error> {
        let rows = std::mem::replace(&mut self.rows, InMemoryTable::new(&self.options.name));
        let header = rows.header();
        let scene = self.scene.clone().or_else(|| self.options.scene.as_ref().map(|scene| scene.inner().clone()));
        let of = |table: InMemoryTable| Source {
            scene: Some(scene.clone().unwrap_or_default()),
            ..Source::one(&self.options.name, table.header(), Box::new(table))
        };
        let request = OpenRequest { log: self.options.name.clone().into(), ..OpenRequest::default() };
        let log = Log::open_source(of(rows.clone()), &request)?;
        let rules = self.options.rules.clone().for_log(&log)?;
        let calibration = match &self.options.calibration {
            Some(recording) => Calibration::of(recording, &rules)?,
            None => Calibration::of_part(&log, &rules, false)?,
        };
        let scene = Scene::of(scene.unwrap_or_default());
        let mut live = Live::new(&rules, &header, &scene, &calibration)?;
        let mut events = vec![];
        for issue in calibration.issues() {
            events.extend(live.report(issue.clone()));
        }
        let columns: Vec<&Cells> = rows.columns().values().collect();
        for row in 0..rows.rows() {
            let values: Vec<f64> = columns.iter().map(|cells| at(cells, row)).collect();
            events.extend(live.push(&values)?);
        }
        (self.header, self.live) = (Some(header), Some(live));
        Ok(events)
    }
}

fn at(cells: &Cells, row: usize) -> f64 {
    match cells {
        Cells::Numbers(values) => values.get(row).copied().unwrap_or(f64::NAN),
        Cells::Texts(_) => f64::NAN,
    }
}

fn newest(rows: &InMemoryTable, name: &str) -> f64 {
    match (rows.columns().get(name), rows.rows().checked_sub(1)) {
        (Some(cells), Some(row)) => at(cells, row),
        _ => f64::NAN,
    }
}

/// The cells of a line.
fn cells(line: &[u8]) -> Result<Vec<String>, String> {
    let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(line);
    let mut record = csv::StringRecord::new();
    reader.read_record(&mut record).map_err(|error| error.to_string())?;
    Ok(record.iter().map(|cell| cell.trim().to_string()).collect())
}
