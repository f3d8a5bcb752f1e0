//! A binding of a log that is being made: rows, or messages of several topics, are bound as they come.
//!
//! Keys that need the whole log are refused; rows wait for values that are learned from the beginning. Topics are joined ([`TopicJoin`]), shifted
//! ([`Shifter`]) and brought to an even rate ([`Resampler`]) as [`bind`](super::bind) does with the whole log.

use super::apply::{BoundColumns, add_normals};
use super::element_places::PlaceWatch;
use super::frame_tree::FrameTree;
use super::header::Header;
use super::join::{PushOutcome, TopicJoin, Value};
use super::live_frames::{FrameNames, LiveFrames};
use super::live_limits;
use super::resampler::{ResampledRow, Resampler};
use super::shifter::Shifter;
use super::sources::SourceSpikeFilter;
use super::start_trimmer::StartTrimmer;
use super::tare::{FirstRows, TareOffsets};
use super::topic_filter::TopicFilter;
use super::{BindingFile, Columns, Pattern, PlaceholderValues, robots, sensors};
use crate::clean::untracked_bodies::LostBodies;
use crate::open::hand_file_of;
use std::borrow::Cow;
use std::path::Path;
use teachtree_base::error::InputError;
use teachtree_base::recording::{Column, Recording};
use teachtree_base::scene::{Role, Scene};
use teachtree_base::units::Dimension;
use teachtree_logs::issue::Issue;
use teachtree_logs::names;
use teachtree_logs::read::csv::{self, LoadedRecording};
use teachtree_logs::read::date_time::date_time;
use teachtree_logs::read::element_names::ElementNames;
use teachtree_logs::read::memory_table::InMemoryTable;
use teachtree_logs::read::stamp_order::RepeatedStamps;
use teachtree_logs::read::table::{ColumnRequest, Source, Table};

/// The default timeout of topics, s.
pub const WAIT_S: f64 = 1.0;
/// The factor of this timeout at the beginning, for columns that a binding names.
const FIRST_WAIT: f64 = 10.0;
/// The prefix of columns of elements of an array of transforms.
const TRANSFORMS: &str = "transforms.";

/// A binding that takes row by row.
pub struct RowBinder {
    file: BindingFile,
    scene: Scene,
    hand_file: Option<String>,
    join: TopicJoin,
    wait_s: f64,
    /// Topics that cannot be read, with the reason.
    refused: Vec<(String, String)>,
    /// Which columns are what, once all that the binding names have come.
    bound: Option<BoundColumns>,
    /// The names at bound places of arrays.
    place_watch: PlaceWatch,
    /// The spike filter for columns that are computed from others.
    spike_filter: Option<SourceSpikeFilter>,
    /// The names of frames so far, and the rows that wait for transforms between them.
    frame_names: FrameNames,
    frames: LiveFrames,
    /// The findings about the frames, and whether they are reported.
    found_frames: Option<String>,
    has_new_frames: bool,
    /// The shifter for sensors with offsets; a resampler exists then.
    shifter: Option<Shifter>,
    resampler: Option<Resampler>,
    repeated: RepeatedStamps,
    lost_bodies: LostBodies,
    beginning: StartTrimmer,
    /// The readings of channels at rest; rows wait until they are known.
    rest: Option<TareOffsets>,
    waiting: FirstRows,
    /// Whether parts of robots that are not read were reported.
    has_reported_robots: bool,
}

/// The result of a row or message.
#[derive(Default)]
pub struct BoundRows {
    /// Rows with canonical names, SI, `time` in s.
    pub rows: Vec<InMemoryTable>,
    /// The issues.
    pub issues: Vec<Issue>,
    /// The reason why no row can be bound.
    pub fault: Option<InputError>,
}

impl RowBinder {
    /// Reads a binding; `scene` replaces its own. Topics are awaited for `wait_s`.
    ///
    /// # Errors
    /// What the binding says that no row alone can show, at `file:line:column`; a binding without a scene where none is given.
    pub fn open(path: &Path, scene: Option<Scene>, wait_s: f64) -> Result<Self, InputError> {
        let file = BindingFile::read(path)?;
        let binding = &file.binding;
        live_limits::check(&file)?;
        let scene = scene.or_else(|| binding.scene.clone()).ok_or_else(|| {
            InputError::new(path.display().to_string(), "has no `scene`").help("name a scene with --scene")
        })?;
        file.check(&scene)?;
        let hand_file = binding.hand_file.clone().map(|name| hand_file_of(path, name));
        let shifter = Shifter::new(&file)?;
        let resampler = binding.resample.map(|rate| Resampler::new(rate.0, binding.bridge.0));
        let join = TopicJoin::new(wait_s);
        let beginning = StartTrimmer::default();
        let (rest, waiting) = (file.binding.tare.is_none().then(TareOffsets::default), FirstRows::default());
        Ok(Self {
            file,
            scene,
            hand_file,
            join,
            wait_s,
            refused: vec![],
            bound: None,
            place_watch: PlaceWatch::default(),
            spike_filter: None,
            frame_names: FrameNames::default(),
            frames: LiveFrames::default(),
            found_frames: None,
            has_new_frames: false,
            shifter,
            resampler,
            repeated: RepeatedStamps::default(),
            lost_bodies: LostBodies::default(),
            beginning,
            rest,
            waiting,
            has_reported_robots: false,
        })
    }

    /// The bodies and hands.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The hand model that the binding names: beside it, or a shipped one.
    pub fn hand_file(&self) -> Option<&str> {
        self.hand_file.as_deref()
    }

    /// Refuses rows of a log without topics whose stamps have too few digits; `place` is the name of the log.
    ///
    /// # Errors
    /// Many rows share each stamp.
    pub fn check_stamps(&self, place: &str) -> Result<(), InputError> {
        self.repeated.check(place)
    }

    /// The params that the binding sets, each with its value and unit and its place.
    pub fn params(&self) -> impl Iterator<Item = (&str, &str, String)> {
        self.file.binding.params.iter().map(|(name, value)| (&**name, &**value, self.file.place(&["params", name])))
    }

    /// Refuses a binding that messages of topics cannot be bound with.
    ///
    /// # Errors
    /// It does not say what the stamps or the channels are of.
    pub fn check_topics(&self) -> Result<(), InputError> {
        if !self.file.binding.has_stamps_of_log() {
            let message = "messages have stamps of their own, expected no `time`";
            return Err(self.file.error("time", message.into()));
        }
        if self.file.binding.channels.is_empty() {
            let message = "no channel is bound, expected columns such as `/wrench.wrench.force.<xyz>`";
            return Err(self.file.error("channels", message.into()));
        }
        Ok(())
    }

    /// Which topics are read.
    pub fn topics(&self) -> TopicFilter {
        TopicFilter::new(self.patterns().map(|pattern| pattern.name.start().to_string()).collect())
    }

    /// The name of the column that has the stamps of rows.
    pub fn time_column(&self) -> String {
        self.file.binding.time.name.fill(PlaceholderValues::default())
    }

    /// Whether a column is bound or of a transform between frames; canonical where no channel is bound.
    pub fn reads(&self, title: &str) -> bool {
        if self.file.binding.channels.is_empty() {
            return names::is_canonical(title);
        }
        if title.contains(TRANSFORMS) {
            return true;
        }
        let objects = self.scene.bodies.iter().filter(|(_, body)| body.role == Role::Object);
        let objects: Vec<&str> = objects.map(|(name, _)| name.as_str()).collect();
        let name = names::split_known_unit(title).0;
        self.patterns().any(|pattern| [name, title].iter().any(|name| pattern.fits(name, &objects)))
    }

    fn patterns(&self) -> impl Iterator<Item = &Pattern> {
        let joints = self.file.joints().map(|(.., columns)| columns);
        self.file.binding.channels.values().chain(joints).flat_map(Columns::patterns)
    }

    /// A message of a topic cannot be read, because of `why`. If none can, this is why the topic lacks the columns of the binding.
    pub fn unreadable(&mut self, topic: &str, why: &str) {
        if !self.refused.iter().any(|(known, _)| known == topic) {
            self.refused.push((topic.to_string(), why.to_string()));
        }
    }

    /// The messages of a topic cannot be read, because of `why`.
    ///
    /// # Errors
    /// The binding needs the topic.
    pub fn refuse(&mut self, topic: &str, why: &str) -> Result<(), InputError> {
        if self.refused.iter().any(|(known, _)| known == topic) {
            return Ok(());
        }
        self.refused.push((topic.to_string(), why.to_string()));
        let prefix = format!("{topic}.");
        for (key, columns) in &self.file.binding.channels {
            let names_it = |pattern: &&Pattern| !pattern.optional && pattern.name.start().starts_with(&prefix);
            if columns.patterns().iter().any(|pattern| names_it(&pattern)) {
                return Err(self.file.error(key, format!("`{topic}` cannot be read: {why}")));
            }
        }
        Ok(())
    }

    /// Binds the only row of a table.
    ///
    /// # Errors
    /// A column of the binding that no row has contained yet; a value that is not a number.
    pub fn bind(&mut self, row: &InMemoryTable) -> Result<BoundRows, InputError> {
        if self.file.binding.channels.is_empty() {
            return self.bind_canonical(row);
        }
        let mut made = BoundRows::default();
        let has_new_frames = self.frame_names.learn("", row);
        if self.join.learn("", row)? || has_new_frames || self.bound.is_none() {
            self.release(&mut made)?;
            self.find_columns(false)?;
        }
        let stamp = self.stamp(row)?;
        self.repeated.push(stamp);
        self.take("", stamp + self.file.binding.time_offset.0, row, &mut made)?;
        Ok(made)
    }

    /// Binds the message of a topic: the only row of a table, and its stamp, s.
    ///
    /// # Errors
    /// A column that the binding names and no message had within the timeout of topics; a value that is not a number.
    pub fn bind_message(&mut self, topic: &str, time_s: f64, row: &InMemoryTable) -> Result<BoundRows, InputError> {
        let row = &*self.with_names(topic, row)?;
        let mut made = BoundRows::default();
        let has_new_frames = self.frame_names.learn(topic, row);
        if self.join.learn(topic, row)? || has_new_frames {
            self.release(&mut made)?;
            self.bound = None;
        }
        let waits_s = self.join.waits_s();
        self.take(topic, time_s + self.file.binding.time_offset.0, row, &mut made)?;
        if self.bound.is_none() {
            match self.find_columns(waits_s <= self.wait_s) {
                Ok(()) if self.bound.is_some() => self.make(false, &mut made)?,
                Err(error) if waits_s > self.wait_s * FIRST_WAIT => return Err(error),
                _ => self.join.forget_oldest(),
            }
        }
        Ok(made)
    }

    /// The message with the elements of arrays that are bound by their names.
    fn with_names<'a>(&self, topic: &str, row: &'a InMemoryTable) -> Result<Cow<'a, InMemoryTable>, InputError> {
        if !row.columns().keys().any(|title| title.contains('[')) {
            return Ok(Cow::Borrowed(row));
        }
        let mut named = row.clone();
        ElementNames::default().put(&mut named, |title| self.reads(&format!("{topic}.{title}")))?;
        Ok(Cow::Owned(named))
    }

    /// The log has ended: all rows that are left.
    ///
    /// # Errors
    /// As [`bind`](Self::bind).
    pub fn finish(&mut self) -> Result<BoundRows, InputError> {
        if self.bound.is_none() && !self.join.topics().is_empty() {
            self.find_columns(false)?;
        }
        let mut made = self.interrupt()?;
        self.settle(true, &mut made)?;
        Ok(made)
    }

    /// The log was interrupted: all rows that are left. Later ones begin anew.
    ///
    /// # Errors
    /// As [`bind`](Self::bind).
    pub fn interrupt(&mut self) -> Result<BoundRows, InputError> {
        let mut made = BoundRows::default();
        if self.bound.is_none() && !self.join.topics().is_empty() && self.find_columns(false).is_err() {
            self.join.restart();
            return Ok(made);
        }
        self.make(true, &mut made)?;
        self.release(&mut made)?;
        if let Some(bound) = &self.bound {
            self.frames = LiveFrames::new(&bound.frames, self.file.binding.bridge.0);
        }
        if let Some(resampler) = &mut self.resampler {
            let mut rows = vec![];
            for row in self.shifter.iter_mut().flat_map(Shifter::finish) {
                resampler.push(&row, &mut rows)?;
            }
            resampler.finish(&mut rows);
            let bridge = self.file.binding.bridge.0;
            let mut rows: Vec<ResampledRow> =
                rows.into_iter().flat_map(|row| self.beginning.take(row, bridge)).collect();
            rows.extend(self.beginning.finish());
            self.finished(rows, &mut made)?;
        }
        self.join.restart();
        Ok(made)
    }

    /// A row whose columns have the names of channels.
    fn bind_canonical(&mut self, row: &InMemoryTable) -> Result<BoundRows, InputError> {
        let binding = &self.file.binding;
        let clock = binding.stamp_column();
        let LoadedRecording { mut recording, issues, .. } =
            csv::columns(Source::one(&row.place, row.header(), Box::new(row.clone())), &clock)?;
        recording.time.iter_mut().for_each(|stamp| *stamp += binding.time_offset.0);
        self.file.spelling.add(&recording.spelling);
        let mut made = BoundRows { issues, ..BoundRows::default() };
        self.bound_row(recording, &mut made)?;
        Ok(made)
    }

    /// Looks up the columns that the binding names among those that have come; none are known yet where a transform between their frames `may_come`.
    fn find_columns(&mut self, may_come: bool) -> Result<(), InputError> {
        let mut titles = vec![];
        for (name, topic) in self.join.topics() {
            let title = |title: &String| if name.is_empty() { title.clone() } else { format!("{name}.{title}") };
            titles.extend(topic.titles.iter().map(title));
        }
        let sheets = self.join.topics().iter().map(|(name, topic)| (name.clone(), topic.titles.len())).collect();
        let refused = self.refused.iter().filter(|(topic, _)| !self.join.topics().contains_key(topic));
        let header = Header::of(titles, sheets, refused.cloned().collect());
        let is_of_topics = !self.join.topics().contains_key("");
        let mut bound = match is_of_topics {
            true => BoundColumns::of_stamped(&header, &self.file, &self.scene)?,
            false => BoundColumns::of(&header, &self.file, &self.scene)?,
        };
        let names = |at: usize| header.titles.get(at).map_or_else(Vec::new, |title| self.frame_names.of(title));
        bound.find_frames(&FrameTree::new(&header, names), &header, &self.file)?;
        if may_come && bound.frames.is_unconnected {
            return Ok(());
        }
        let mut first = 0;
        let ranges: Vec<std::ops::Range<usize>> = self
            .join
            .topics()
            .values()
            .map(|topic| {
                let range = first..first + topic.titles.len();
                first = range.end;
                range
            })
            .collect();
        let is_wanted = |at: usize, column: usize| {
            let want = ranges.get(at).and_then(|range| bound.wants.get(range.start + column));
            matches!(want, Some(ColumnRequest::Number(_)))
        };
        let used =
            ranges.iter().enumerate().filter(|(at, range)| (0..range.len()).any(|column| is_wanted(*at, column)));
        let used = used.count();
        if used > 1 && self.resampler.is_none() {
            let message = format!("the bound columns are of {used} topics with stamps of their own");
            return Err(self.file.error("channels", message).help("name the common rate, such as `resample: 100 Hz`"));
        }
        self.join.mark(is_wanted);
        self.beginning.is_over |= used <= 1 && self.shifter.is_none();
        self.spike_filter = SourceSpikeFilter::new(&bound.sources, used.max(1));
        self.has_new_frames |= self.found_frames != bound.frames.report;
        self.found_frames.clone_from(&bound.frames.report);
        self.frames = LiveFrames::new(&bound.frames, self.file.binding.bridge.0);
        self.bound = Some(bound);
        Ok(())
    }

    /// The stamp of a row without topics, s.
    fn stamp(&self, row: &InMemoryTable) -> Result<f64, InputError> {
        let titles = self.join.topics().values().flat_map(|topic| &topic.titles);
        let wants = self.bound.iter().flat_map(|bound| &bound.wants);
        let times = titles.zip(wants).filter_map(|(title, want)| match want {
            ColumnRequest::Time(factor) => Some((title, *factor)),
            _ => None,
        });
        let mut sum = None;
        for (title, factor) in times {
            let found = super::join::value(title, row);
            let seconds = match &found {
                Value::Number(number) => number * factor,
                Value::Text(text) => date_time(text).unwrap_or(f64::NAN),
            };
            if !seconds.is_finite() {
                return Err(InputError::new(&row.place, format!("found `{found}` as `{title}`, expected a time")));
            }
            // Seconds and nanoseconds may be in columns of their own.
            sum = Some(sum.unwrap_or(0.0) + seconds);
        }
        sum.ok_or_else(|| InputError::new(&row.place, "no column holds the time"))
    }

    fn take(&mut self, topic: &str, time_s: f64, row: &InMemoryTable, made: &mut BoundRows) -> Result<(), InputError> {
        match self.join.push(topic, time_s, row) {
            PushOutcome::Kept => {}
            PushOutcome::Late(issue) => made.issues.extend(issue),
            PushOutcome::SetBack(issue) => {
                let rest = self.interrupt()?;
                made.rows.extend(rest.rows);
                made.issues.extend(rest.issues);
                made.fault = made.fault.take().or(rest.fault);
                made.issues.push(issue);
                let binding = &self.file.binding;
                self.resampler = binding.resample.map(|rate| Resampler::new(rate.0, binding.bridge.0));
                self.shifter = Shifter::new(&self.file)?;
                self.waiting = FirstRows::default();
                self.join.push(topic, time_s, row);
            }
        }
        if self.bound.is_some() {
            self.make(false, made)?;
        }
        Ok(())
    }

    /// Makes the rows that are whole.
    fn make(&mut self, ends: bool, made: &mut BoundRows) -> Result<(), InputError> {
        made.issues.extend(self.join.settle());
        while let Some((stamp, topics)) = self.join.next(ends) {
            let Some(bound) = &self.bound else { return Ok(()) };
            let (mut numbers, mut names) = (Vec::with_capacity(bound.wants.len()), vec![vec![]; bound.wants.len()]);
            for (mut values, (name, topic)) in topics.into_iter().zip(self.join.topics()) {
                // Earlier messages lack the columns that have come since.
                values.resize(topic.titles.len(), Value::Number(f64::NAN));
                for (value, title) in values.into_iter().zip(&topic.titles) {
                    if let Some(ColumnRequest::Text) = bound.wants.get(numbers.len()) {
                        names.get_mut(numbers.len()).into_iter().for_each(|names| names.push(value.text()));
                    }
                    numbers.push(match (bound.wants.get(numbers.len()), value) {
                        (Some(ColumnRequest::Number(_)), Value::Number(number)) => vec![number],
                        (Some(ColumnRequest::Number(_)), Value::Text(text)) => {
                            let message = format!("found `{text}` as `{title}`, expected a number");
                            return Err(InputError::new(if name.is_empty() { "the row" } else { name }, message));
                        }
                        _ => vec![],
                    });
                }
            }
            made.issues.extend(self.place_watch.look(&bound.places, &[stamp], &names));
            let texts = vec![vec![]; numbers.len()];
            let table = Table { time: vec![stamp], numbers, texts, ..Table::default() };
            let (rows, issues) = match &mut self.spike_filter {
                Some(spike_filter) => spike_filter.push(table),
                None => (vec![table], vec![]),
            };
            made.issues.extend(issues);
            self.apply(rows, made)?;
        }
        Ok(())
    }

    /// Releases the rows that wait for the spike filter and for transforms.
    fn release(&mut self, made: &mut BoundRows) -> Result<(), InputError> {
        if let Some(spike_filter) = &mut self.spike_filter {
            let (rows, issues) = spike_filter.finish();
            made.issues.extend(issues);
            self.apply(rows, made)?;
        }
        self.compose(true, made)
    }

    /// Takes rows without spikes.
    fn apply(&mut self, rows: Vec<Table>, made: &mut BoundRows) -> Result<(), InputError> {
        for row in rows {
            self.frames.push(row);
            self.compose(false, made)?;
        }
        Ok(())
    }

    /// Computes the channels of rows from their columns, once the transforms between frames are known.
    fn compose(&mut self, ends: bool, made: &mut BoundRows) -> Result<(), InputError> {
        while let Some(row) = self.frames.next(ends) {
            let Some(bound) = &self.bound else { return Ok(()) };
            let stamp = row.time.first().copied().unwrap_or_default();
            if std::mem::take(&mut self.has_new_frames) {
                made.issues.extend(bound.frames.issue(&[stamp]));
            }
            let LoadedRecording { recording, issues, .. } =
                bound.apply_row(row, &self.file, self.frames.transforms())?;
            self.frames.forget(stamp);
            made.issues.extend(issues);
            self.bound_row(recording, made)?;
        }
        Ok(())
    }

    /// Takes a recording of one row, at its own stamp.
    fn bound_row(&mut self, mut recording: Recording, made: &mut BoundRows) -> Result<(), InputError> {
        let Some(resampler) = &mut self.resampler else {
            return self.finished_row(recording, made);
        };
        // Before positions are interpolated.
        made.issues.extend(self.lost_bodies.unmeasure(&mut recording));
        let shifted = match &mut self.shifter {
            Some(shifter) => match shifter.push(recording, &self.file) {
                Ok(rows) => rows,
                Err(error) => {
                    made.fault = Some(error);
                    return Ok(());
                }
            },
            None => vec![recording],
        };
        let mut rows = vec![];
        for row in &shifted {
            resampler.push(row, &mut rows)?;
        }
        let bridge = self.file.binding.bridge.0;
        let rows = rows.into_iter().flat_map(|row| self.beginning.take(row, bridge)).collect();
        self.finished(rows, made)
    }

    fn finished(&mut self, rows: Vec<ResampledRow>, made: &mut BoundRows) -> Result<(), InputError> {
        let columns: Vec<(String, Dimension)> = match &self.resampler {
            Some(resampler) if !rows.is_empty() => {
                resampler.columns().iter().map(|(name, dimension)| (name.clone(), *dimension)).collect()
            }
            _ => return Ok(()),
        };
        for (time, values) in rows {
            let cells = columns.iter().zip(values).map(|((name, dimension), value)| {
                (name.clone(), Column { dimension: *dimension, values: vec![value] })
            });
            let recording = Recording { time: vec![time], columns: cells.collect(), ..Recording::default() };
            self.finished_row(recording, made)?;
        }
        Ok(())
    }

    /// Takes a row that is made, when it is known what channels read at rest.
    fn finished_row(&mut self, recording: Recording, made: &mut BoundRows) -> Result<(), InputError> {
        if self.rest.is_some() {
            return self.corrected_row(recording, made);
        }
        self.waiting.push(recording);
        self.settle(false, made)
    }

    /// Learns what channels read at rest, once their interval is over, and takes the rows that wait.
    fn settle(&mut self, ends: bool, made: &mut BoundRows) -> Result<(), InputError> {
        let is_over = self.file.binding.tare.as_ref().is_some_and(|tare| self.waiting.is_over(tare));
        if self.rest.is_some() || !(is_over || ends && !self.waiting.whole().time.is_empty()) {
            return Ok(());
        }
        let waiting = std::mem::take(&mut self.waiting);
        let whole = Recording { scene: self.scene.clone(), ..waiting.whole().clone() };
        match sensors::at_rest(whole, &self.file) {
            Ok(rest) => self.rest = Some(rest),
            Err(error) => {
                made.fault = Some(error);
                return Ok(());
            }
        }
        waiting.each().try_for_each(|row| self.corrected_row(row, made))
    }

    /// Corrects what a row of its own shows, and gives it the form of a table.
    fn corrected_row(&mut self, mut recording: Recording, made: &mut BoundRows) -> Result<(), InputError> {
        let Some(rest) = &self.rest else { return Ok(()) };
        if !std::mem::replace(&mut self.has_reported_robots, true) {
            made.issues.extend(robots::unread_parts(&self.file, &recording.time));
        }
        recording.scene = std::mem::take(&mut self.scene);
        let corrected = sensors::correct_by(rest, &mut recording, &self.file);
        add_normals(&mut recording, &self.file);
        self.scene = std::mem::take(&mut recording.scene);
        made.issues.extend(corrected?.into_iter().map(|issue| issue.spelled(self.file.spelling())));
        let first = |values: &[f64]| values.first().copied().unwrap_or(f64::NAN);
        let mut row = InMemoryTable::new("the log");
        row.begin_row()?;
        row.put("time", first(&recording.time))?;
        for (name, column) in &recording.columns {
            row.put(&self.file.spelling().shown(name), first(&column.values))?;
        }
        made.rows.push(row);
        Ok(())
    }
}
