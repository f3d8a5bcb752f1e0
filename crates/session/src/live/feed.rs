//! Lines of a live log: JSON objects or CSV, distinguished by the first line. The first seconds are kept for the calibration; then each line is a row.

use super::calibration_buffer::{CalibrationBuffer, MOST_PENDING, cell};
use super::lacking::undetectable;
use super::{Calibration, Live, LiveEvent};
use crate::error::Error;
use crate::log::{Log, Scene};
use crate::rules::RulesOptions;
use crate::{ErrorInternals, LogInternals, SceneInternals};
use std::collections::{BTreeMap, BTreeSet};
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_frames::OpenRequest;
use teachtree_frames::bind::{BoundRows, LiveLine, RowBinder, StampMerger};
use teachtree_logs::issue::{Issue, IssueKind};
use teachtree_logs::names::{is_canonical, split_unit};
use teachtree_logs::read::element_names::ElementNames;
use teachtree_logs::read::formats::delimited_text;
use teachtree_logs::read::formats::jsonl::{Line, Lines, push};
use teachtree_logs::read::memory_table::{Cells, InMemoryTable};
use teachtree_logs::read::table::Source;

/// Maximum number of consecutive lines that are not rows; an input with more is not a log.
const MOST_BAD: usize = 1000;
/// The text by which a line with a scene is found.
const SCENE_KEY: &[u8] = b"\"scene\"";

/// The options of a live log.
pub struct FeedOptions {
    /// The name of the source in messages.
    pub name: String,
    /// The rules.
    pub rules: RulesOptions,
    /// The scene that overrides that of the log.
    pub scene: Option<Scene>,
    /// The scene file beside the log, for a log without a scene, or why it cannot be read.
    pub beside: Option<Result<Scene, Error>>,
    /// The binder that converts foreign rows to channels.
    pub binder: Option<RowBinder>,
    /// The duration of the calibration, s.
    pub calibrate_s: f64,
    /// A known calibration that replaces it.
    pub calibration: Option<CalibrationSource>,
    /// Whether labels have their confidence.
    pub confidence: bool,
}

/// The source of a calibration.
pub enum CalibrationSource {
    /// A recording with the same sensors.
    Recording(Log),
    /// A calibration file.
    File(Box<Calibration>),
}

/// A live log, line by line.
pub struct Feed {
    options: FeedOptions,
    /// Whether the binding fits a row so far.
    is_bound: bool,
    /// Messages about bound rows that were reported.
    said: BTreeSet<String>,
    /// The scene of the first line.
    scene: Option<Scene>,
    /// Why the scene of the first line cannot be read.
    wrong_scene: Option<Error>,
    line: u64,
    /// The lines that wait for others with their stamp.
    same_stamp: StampMerger,
    /// The stamp of the first message of a topic, ns.
    origin_ns: Option<i64>,
    bad: usize,
    form: LineFormat,
    state: State,
}

/// The format of lines.
enum LineFormat {
    /// No line has determined the format.
    Unknown,
    Json,
    /// Cells in the order of these columns.
    Csv(Vec<String>),
}

enum State {
    Calibrating(Box<CalibrationBuffer>),
    /// The columns of rows, and the analysis that takes them.
    Running(Vec<String>, Box<Live>),
}

impl Feed {
    /// Returns a feed before its first line.
    pub fn new(mut options: FeedOptions) -> Self {
        let state = State::Calibrating(Box::new(CalibrationBuffer::new(&options.name)));
        if let Some(binder) = &options.binder {
            options.scene = Some(Scene::of(binder.scene().clone()));
            options.rules = options.rules.or_of_binding(binder.hand_file(), binder.params());
        }
        let (is_bound, said) = (options.binder.is_none(), BTreeSet::new());
        let same_stamp = StampMerger::new(options.binder.as_ref().map_or("time".into(), RowBinder::time_column));
        Self {
            options,
            is_bound,
            said,
            scene: None,
            wrong_scene: None,
            line: 0,
            same_stamp,
            origin_ns: None,
            bad: 0,
            form: LineFormat::Unknown,
            state,
        }
    }

    /// Takes a line. A line that is not a row is an issue.
    ///
    /// # Errors
    /// Too many lines in a row are not rows; there is no scene; the calibration fails; as [`Live::push`].
    pub fn line(&mut self, line: &[u8]) -> Result<Vec<LiveEvent>, Error> {
        self.line += 1;
        // A byte order mark.
        let line = if self.line == 1 { line.strip_prefix(b"\xef\xbb\xbf").unwrap_or(line) } else { line };
        if line.iter().all(u8::is_ascii_whitespace) {
            return Ok(vec![]);
        }
        if matches!(self.form, LineFormat::Unknown) && !line.trim_ascii_start().starts_with(b"{") {
            let titles = header(line, self.options.binder.as_ref());
            self.form = LineFormat::Csv(titles.map_err(|message| self.error(message))?);
            return Ok(vec![]);
        }
        match self.row(line) {
            Ok(Some(row)) => {
                self.find_scene()?;
                let line = LiveLine { row, bytes: line.len(), number: self.line };
                let binder = self.options.binder.as_ref();
                let is_read = |title: &str| binder.map_or_else(|| is_canonical(title), |binder| binder.reads(title));
                let rows = self.same_stamp.push(line, is_read);
                self.rows(rows)
            }
            Ok(None) => Ok(vec![]),
            Err(message) => self.read("line", self.line, Err(LineError::Line(message))),
        }
    }

    /// Takes rows to which no later line adds.
    fn rows(&mut self, rows: Vec<LiveLine>) -> Result<Vec<LiveEvent>, Error> {
        let mut events = vec![];
        for LiveLine { row, bytes, number } in rows {
            let read = match &mut self.options.binder {
                None => self.take(&row, bytes),
                Some(binder) => match binder.bind(&row) {
                    Ok(bound) => {
                        self.is_bound = true;
                        self.take_bound(bound)
                    }
                    Err(error) => Err(self.not_bound(error)),
                },
            };
            events.extend(self.read("line", number, read)?);
        }
        Ok(events)
    }

    /// Takes the message of a topic: its stamp, ns, from which on times count if it is the first one, and the only row of a table. A message that cannot be
    /// bound is an issue.
    ///
    /// # Errors
    /// As [`line`](Self::line).
    pub fn message(&mut self, topic: &str, stamp_ns: i64, row: &InMemoryTable) -> Result<Vec<LiveEvent>, Error> {
        self.line += 1;
        let origin_ns = *self.origin_ns.get_or_insert(stamp_ns);
        let time_s = stamp_ns.saturating_sub(origin_ns) as f64 * 1e-9;
        let Some(binder) = &mut self.options.binder else { return Ok(vec![]) };
        let read = match binder.bind_message(topic, time_s, row) {
            Ok(bound) => {
                self.is_bound |= !bound.rows.is_empty();
                self.take_bound(bound)
            }
            Err(error) => Err(self.not_bound(error)),
        };
        self.read("message", self.line, read)
    }

    /// Reports a message of a topic that cannot be read.
    ///
    /// # Errors
    /// Too many consecutive messages cannot be read.
    pub fn unreadable(&mut self, topic: &str, why: &str) -> Result<Vec<LiveEvent>, Error> {
        self.line += 1;
        self.options.binder.iter_mut().for_each(|binder| binder.unreadable(topic, why));
        self.read("message", self.line, Err(LineError::Line(format!("{topic}: {why}"))))
    }

    /// Reports a topic whose messages cannot be read.
    ///
    /// # Errors
    /// The binding needs the topic.
    pub fn refused(&mut self, topic: &str, why: &str) -> Result<Vec<LiveEvent>, Error> {
        let Some(binder) = &mut self.options.binder else { return Ok(vec![]) };
        binder.refuse(topic, why).map_err(|error| Error::new(error, ErrorKind::Binding))?;
        Ok(vec![])
    }

    /// Reports an interruption of the source: all segments and tasks end, and the analysis restarts with the next row.
    ///
    /// # Errors
    /// As [`line`](Self::line).
    pub fn interrupted(&mut self, message: String) -> Result<Vec<LiveEvent>, Error> {
        let rows = self.same_stamp.finish();
        let mut events = self.rows(rows)?;
        let rest = self.options.binder.as_mut().map(RowBinder::interrupt);
        events.extend(self.rest(rest)?);
        events.extend(self.issue(IssueKind::DISCONNECTED, message));
        if let State::Running(_, live) = &mut self.state {
            events.extend(live.interrupt()?);
        }
        Ok(events)
    }

    /// Reports that the source is available again.
    pub fn connected(&mut self, message: String) -> Vec<LiveEvent> {
        self.issue(IssueKind::DISCONNECTED, message)
    }

    /// Reads a line or message and reports its issues with its number.
    fn read(
        &mut self,
        what: &str,
        number: u64,
        read: Result<Vec<LiveEvent>, LineError>,
    ) -> Result<Vec<LiveEvent>, Error> {
        match read {
            Ok(events) => {
                self.bad = 0;
                Ok(events)
            }
            Err(LineError::Log(error)) => Err(error),
            Err(LineError::Line(message)) => {
                self.bad += 1;
                if self.bad > MOST_BAD {
                    return Err(self.error(format!("more than {MOST_BAD} {what}s in a row are not rows; {message}")));
                }
                Ok(self.issue(IssueKind::UNREADABLE_ROW, format!("{what} {number} is left out: {message}")))
            }
        }
    }

    /// Takes the rows that wait for others.
    fn rest(&mut self, rest: Option<Result<BoundRows, InputError>>) -> Result<Vec<LiveEvent>, Error> {
        let Some(rest) = rest else { return Ok(vec![]) };
        let rest = rest.map_err(|error| Error::new(error, ErrorKind::Binding))?;
        let read = self.take_bound(rest);
        self.read("row", self.line, read)
    }

    /// Ends the log.
    ///
    /// # Errors
    /// As [`line`](Self::line).
    pub fn finish(mut self) -> Result<Vec<LiveEvent>, Error> {
        let rows = self.same_stamp.finish();
        let mut events = self.rows(rows)?;
        let rest = self.options.binder.as_mut().map(RowBinder::finish);
        events.extend(self.rest(rest)?);
        if matches!(self.state, State::Calibrating(_)) {
            events.extend(self.calibrate()?);
        }
        if let State::Running(_, live) = self.state {
            events.extend(live.finish()?);
        }
        Ok(events)
    }

    /// Reports that lines were lost before they were read.
    pub fn lost(&mut self, lines: u64) -> Vec<LiveEvent> {
        let message = format!("{lines} rows came faster than they could be analyzed, and are left out");
        self.issue(IssueKind::OVERRUN, message)
    }

    /// Reports a line that is longer than the source accepts.
    pub fn too_long(&mut self, most: u64) -> Vec<LiveEvent> {
        self.line += 1;
        let message = format!("line {} is left out: it is longer than {most} bytes", self.line);
        self.issue(IssueKind::UNREADABLE_ROW, message)
    }

    /// Switches the labels of the newest frames on, or off while rows arrive faster than they can be analyzed.
    pub fn label(&mut self, is_on: bool) -> Vec<LiveEvent> {
        let State::Running(_, live) = &mut self.state else { return vec![] };
        live.label_newest(is_on);
        let message = if is_on {
            "labels of the newest frames are reported again"
        } else {
            "rows come almost faster than they can be analyzed; labels of the newest frames are left out"
        };
        self.issue(IssueKind::OVERRUN, message.into())
    }

    fn error(&self, message: impl Into<String>) -> Error {
        let place = format!("{} row {}", self.options.name, self.line);
        Error::new(InputError::new(place, message), ErrorKind::Format)
    }

    fn issue(&mut self, kind: IssueKind, message: String) -> Vec<LiveEvent> {
        let at = match &self.state {
            State::Calibrating(beginning) => beginning.at_s(),
            State::Running(_, live) => live.newest_s(),
        };
        self.report(Issue { kind, start_s: at, end_s: at, channel: String::new(), message })
    }

    fn report(&mut self, issue: Issue) -> Vec<LiveEvent> {
        match &mut self.state {
            State::Calibrating(beginning) => {
                beginning.report(issue);
                vec![]
            }
            State::Running(_, live) => live.report(issue),
        }
    }

    /// Returns a line as a table of one row; `None` for the scene.
    fn row(&mut self, line: &[u8]) -> Result<Option<InMemoryTable>, String> {
        let mut row = InMemoryTable::new(&self.options.name);
        if let LineFormat::Csv(header) = &self.form {
            let cells = delimited_text::cells(line)?;
            if cells.len() != header.len() {
                return Err(format!("found {} cells, expected {}", cells.len(), header.len()));
            }
            row.begin_row().map_err(|error| error.message)?;
            for (name, cell) in header.iter().zip(cells) {
                row.put_text(name, &cell).map_err(|error| error.message)?;
            }
            return Ok(Some(row));
        }
        let is_first = matches!(std::mem::replace(&mut self.form, LineFormat::Json), LineFormat::Unknown);
        // The last line, or a single one, may lack a line end.
        let mut whole = line.to_vec();
        whole.push(b'\n');
        let mut lines = Lines::new(whole.as_slice(), self.options.name.clone());
        let read = lines.line().map_err(|error| {
            if is_first && line.windows(SCENE_KEY.len()).any(|part| part == SCENE_KEY) {
                let place = format!("{} row {}", self.options.name, self.line);
                self.wrong_scene = Some(Error::new(InputError::new(place, &error.message), ErrorKind::Scene));
            }
            error.message
        });
        match read? {
            Some(Line::Row(object)) => {
                push(&object, &mut row)?;
                if let Some(binder) = &self.options.binder {
                    let named = ElementNames::default().put(&mut row, |title| binder.reads(title));
                    named.map_err(|error| error.message)?;
                }
                Ok(Some(row))
            }
            Some(Line::Scene(scene)) if is_first => {
                self.scene = Some(Scene::of(*scene));
                Ok(None)
            }
            Some(Line::Scene(_)) => Err("found a `scene`, expected it in the first line only".into()),
            Some(Line::Truncated(message)) => Err(message),
            None => Ok(None),
        }
    }

    /// Takes rows with the names of channels. Reports each issue of the binding once.
    fn take_bound(&mut self, bound: BoundRows) -> Result<Vec<LiveEvent>, LineError> {
        let mut events = vec![];
        for issue in bound.issues {
            let is_new = self.said.len() < MOST_PENDING && self.said.insert(issue.message.clone());
            // Issues with a time are reported each time.
            if is_new || issue.kind == IssueKind::GAP || issue.kind == IssueKind::DUPLICATE_STAMP {
                events.extend(self.report(issue));
            }
        }
        if let Some(error) = bound.fault {
            return Err(LineError::Log(Error::new(error, ErrorKind::Binding)));
        }
        for row in &bound.rows {
            let bytes = row.columns().len() * size_of::<f64>();
            events.extend(self.take(row, bytes)?);
        }
        Ok(events)
    }

    /// Returns the error of a row that was not bound. An error before the first bound row is a mistake of the binding.
    fn not_bound(&self, error: InputError) -> LineError {
        if self.is_bound {
            LineError::Line(error.message)
        } else {
            LineError::Log(Error::new(error, ErrorKind::Binding))
        }
    }

    /// Returns the given scene, else that of the first line, else the one beside the log.
    fn find_scene(&self) -> Result<&Scene, Error> {
        let Self { options, scene, .. } = self;
        match (options.scene.as_ref().or(scene.as_ref()), &options.beside, &self.wrong_scene) {
            (Some(scene), ..) | (None, Some(Ok(scene)), _) => Ok(scene),
            (None, _, Some(error)) | (None, Some(Err(error)), None) => Err(error.clone()),
            (None, None, None) => {
                let help = "name the scene with --scene, or send it in the first line: {\"scene\": {…}}";
                Err(Error::new(InputError::new(&options.name, "carries no scene").help(help), ErrorKind::Scene))
            }
        }
    }

    fn take(&mut self, row: &InMemoryTable, bytes: usize) -> Result<Vec<LiveEvent>, LineError> {
        match &mut self.state {
            State::Calibrating(beginning) => {
                beginning.keep(row, bytes).map_err(LineError::Line)?;
                let lasts_s = if self.options.calibration.is_some() { 0.0 } else { self.options.calibrate_s };
                if beginning.is_enough(lasts_s) { self.calibrate().map_err(LineError::Log) } else { Ok(vec![]) }
            }
            State::Running(header, live) => {
                let value = |name: &String| row.columns().get(name).and_then(cell).unwrap_or(f64::NAN);
                let values: Vec<f64> = header.iter().map(value).collect();
                live.push(&values).map_err(LineError::Log)
            }
        }
    }

    /// Calibrates from the rows so far, and analyzes them.
    fn calibrate(&mut self) -> Result<Vec<LiveEvent>, Error> {
        let State::Calibrating(beginning) = &mut self.state else { return Ok(vec![]) };
        let beginning = std::mem::replace(&mut **beginning, CalibrationBuffer::new(&self.options.name));
        if beginning.rows.rows() == 0 {
            let first = beginning.issues.first().map_or(String::new(), |issue| format!("; {}", issue.message));
            let error = InputError::new(&self.options.name, format!("found no rows{first}"));
            return Err(Error::new(error, ErrorKind::Format));
        }
        let name = &self.options.name;
        let of_binder = self.options.binder.as_ref().map_or(Ok(()), |binder| binder.check_stamps(name));
        of_binder.and(beginning.repeated.check(name)).map_err(|error| Error::new(error, ErrorKind::Format))?;
        let (rows, scene) = (beginning.rows, self.find_scene()?.clone());
        let header = rows.header();
        let source = Source {
            scene: Some(scene.inner().clone()),
            ..Source::one(&self.options.name, rows.header(), Box::new(rows.clone()))
        };
        let request = OpenRequest { log: self.options.name.clone().into(), ..OpenRequest::default() };
        let log = Log::open_source(source, &request)?;
        let rules = self.options.rules.clone().for_log(&log)?;
        let calibration = match &self.options.calibration {
            Some(CalibrationSource::File(calibration)) => (**calibration).clone(),
            Some(CalibrationSource::Recording(recording)) => Calibration::of(recording, &rules)?,
            None => Calibration::of(&log, &rules)?,
        };
        let live = Live::new(&rules, &header, &scene, &calibration)?;
        let mut live = if self.options.confidence { live.with_confidence() } else { live };
        let mut events: Vec<LiveEvent> =
            self.origin_ns.into_iter().flat_map(|origin_ns| live.begin(origin_ns)).collect();
        let columns: Vec<&Cells> = rows.columns().values().collect();
        let values = |row: usize| columns.iter().map(|cells| at(cells, row)).collect::<Vec<f64>>();
        live.start(&values(0));
        // Issues of a given recording do not concern this log.
        let learned = calibration.issues().iter().filter(|_| self.options.calibration.is_none());
        for issue in undetectable(&log, &rules).iter().chain(learned).chain(&beginning.issues) {
            events.extend(live.report(issue.clone()));
        }
        if beginning.more > 0 {
            let (start_s, message) =
                (beginning.order.newest_s(), format!("{} more lines are left out", beginning.more));
            let channel = String::new();
            let issue = Issue { kind: IssueKind::UNREADABLE_ROW, start_s, end_s: start_s, channel, message };
            events.extend(live.report(issue));
        }
        for row in 0..rows.rows() {
            events.extend(live.push(&values(row))?);
        }
        self.state = State::Running(header, Box::new(live));
        Ok(events)
    }
}

/// The first cell of an export of the program Motive.
const MOTIVE: &str = "Format Version";

/// Why a line was not taken.
enum LineError {
    /// The line is not a row.
    Line(String),
    /// The log cannot be analyzed.
    Log(Error),
}

fn at(cells: &Cells, row: usize) -> f64 {
    cells.numbers().and_then(|values| values.get(row)).copied().unwrap_or(f64::NAN)
}

/// Returns the titles of a table.
fn header(line: &[u8], binder: Option<&RowBinder>) -> Result<Vec<String>, String> {
    let header = delimited_text::cells(line)?;
    if header.first().is_some_and(|title| title == MOTIVE) {
        return Err("found an export of Motive, whose titles are in several lines, expected titles in the first line; use `analyze`".into());
    }
    let mut seen = BTreeMap::new();
    for (at, title) in header.iter().enumerate() {
        if let Some(first) = seen.insert(title, at) {
            return Err(format!("the column `{title}` occurs twice, as columns {} and {}", first + 1, at + 1));
        }
    }
    // A binding names the column of the stamps.
    if binder.is_none() && !header.iter().any(|title| split_unit(title).0 == "time") {
        return Err("expected a JSON object, or titles of columns with `time` among them".into());
    }
    Ok(header)
}
