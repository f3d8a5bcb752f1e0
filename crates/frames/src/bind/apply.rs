//! Applying a binding: the columns of a foreign table in, a recording with canonical names out.

use super::element_places::{self, BoundPlace, PlaceWatch};
use super::fixture_localization;
use super::frame_composition::FrameComposition;
use super::frame_tree::FrameTree;
use super::header::{BoundColumn, Header, Term};
use super::normals::normals_by_role;
use super::offsets;
use super::pads;
use super::pattern::Columns;
use super::resample::resample;
use super::robots;
use super::rotations;
use super::sampled_transform::SampledTransform;
use super::sensors;
use super::sentinels;
use super::sources::{self, ColumnSource};
use super::{BindingFile, Normals};
use crate::clean::spikes;
use crate::clean::stuck_sensors;
use crate::clean::untracked_bodies;
use indexmap::IndexMap;
use teachtree_base::error::InputError;
use teachtree_base::recording::{Column, Recording};
use teachtree_base::scene::{Role, Scene};
use teachtree_base::units::Dimension;
use teachtree_logs::issue::IssueKind;
use teachtree_logs::names;
use teachtree_logs::read::csv::{self, LoadedRecording, StampSource};
use teachtree_logs::read::first_stamp::count_from_first;
use teachtree_logs::read::table::{ColumnRequest, Source, Table};

/// Refuses a binding that binds no channel of a log without canonical names.
///
/// # Errors
/// It binds none, at `channels` or in the file.
pub fn check_channels(source: &Source, file: &BindingFile) -> Result<(), InputError> {
    let canonical = || source.header().iter().any(|title| names::meaning(names::split_unit(title).0).is_some());
    if !file.binding.channels.is_empty() || source.sheets.len() <= 1 && canonical() {
        return Ok(());
    }
    let message = "no channel is bound, and no column of the log has a canonical name";
    Err(file.error("channels", message.into()).help("`teachtree init LOG` writes a binding with its guesses"))
}

/// Makes a recording of a table as the binding says; `scene` is the one that counts.
///
/// # Errors
/// When the binding names what the table lacks, or the table cannot be read.
pub fn bind(source: Source, file: &BindingFile, scene: Scene) -> Result<LoadedRecording, InputError> {
    let binding = &file.binding;
    let place = source.file.clone();
    check_channels(&source, file)?;
    let (mut read, merged) = if binding.channels.is_empty() {
        let clock = match binding.rate {
            Some(rate) => StampSource::Rate(rate),
            None => binding.stamp_column(),
        };
        let mut read = csv::columns(source, &clock)?;
        shift(&mut read.recording.time, &mut read.row_time, file);
        read.count_from_first();
        (read, 1)
    } else {
        foreign(source, file, &scene)?
    };
    read.issues.extend(robots::unread_parts(file, &read.recording.time));
    read.recording.scene = scene;
    read.recording.spelling.add(file.spelling());
    // Before anything is computed from their neighbors.
    read.issues.extend(spikes::reject(&mut read.recording));
    if binding.resample.is_some() {
        read.issues.extend(untracked_bodies::unmeasure_recording(&mut read.recording));
    }
    let shifted = sensors::shift(&mut read.recording, file)?;
    match binding.resample {
        Some(rate) => {
            let log = read.recording;
            read.recording = resample(log, rate.0, binding.bridge.0)?;
            if merged > 1 || shifted {
                trim(&mut read.recording, binding.bridge.0);
            }
        }
        None if merged > 1 => {
            let message = format!("the bound columns are of {merged} sheets with stamps of their own");
            return Err(
                InputError::new(place, message).help("name the common rate in the binding, such as `resample: 100 Hz`")
            );
        }
        None if shifted => {
            return Err(unshared_stamps(file));
        }
        None => {}
    }
    read.issues.extend(stuck_sensors::silence_uncorrected(&mut read.recording, &binding.trust));
    read.issues.extend(sensors::correct(&mut read.recording, file)?);
    read.issues.extend(fixture_localization::learn(&mut read.recording, file)?);
    add_normals(&mut read.recording, file);
    Ok(read)
}

/// The error about a sensor with a time offset in a log that is not resampled.
pub fn unshared_stamps(file: &BindingFile) -> InputError {
    let message = "a sensor with a time offset has stamps between the others".into();
    file.error("sensors", message).help("name the common rate, such as `resample: 100 Hz`")
}

/// Adds the normals of contacts as the binding says.
pub fn add_normals(recording: &mut Recording, file: &BindingFile) {
    if file.binding.normals == Normals::ByRole {
        normals_by_role(recording);
    }
}

/// Cuts off the ends at which some sensor is silent still or already, up to `bridge`, s: sensors do not start and stop as one.
fn trim(recording: &mut Recording, bridge: f64) {
    let Some((start, end)) = recording.time.first().copied().zip(recording.time.last().copied()) else { return };
    let (mut from, mut to) = (0, recording.time.len());
    for Column { values, .. } in recording.columns.values() {
        let at = |row: usize| recording.time.get(row).copied().unwrap_or_default();
        if let Some(row) = values.iter().position(|value| !value.is_nan())
            && at(row) - start <= bridge
        {
            from = from.max(row);
        }
        if let Some(row) = values.iter().rposition(|value| !value.is_nan())
            && end - at(row) <= bridge
        {
            to = to.min(row + 1);
        }
    }
    if to.saturating_sub(from) < 2 {
        return;
    }
    let values = recording.columns.values_mut().map(|column| &mut column.values);
    for values in values.chain([&mut recording.time]) {
        values.truncate(to);
        values.drain(..from);
    }
    for texts in recording.labels.values_mut() {
        texts.truncate(to);
        texts.drain(..from);
    }
}

/// Adds the time offset of the binding to every stamp.
fn shift(time: &mut [f64], row_time: &mut [f64], file: &BindingFile) {
    time.iter_mut().chain(row_time).for_each(|stamp| *stamp += file.binding.time_offset.0);
}

/// The bound columns, and from how many sheets they are.
fn foreign(source: Source, file: &BindingFile, scene: &Scene) -> Result<(LoadedRecording, usize), InputError> {
    let header = Header::new(&source);
    let mut bound = BoundColumns::of(&header, file, scene)?;
    bound.find_frames(&FrameTree::of(&source, &header), &header, file)?;
    let mut table = source.read(&bound.wants, file.binding.rate.map(|rate| rate.0))?;
    shift(&mut table.time, &mut table.row_time, file);
    let zero_stamp_s = count_from_first(&mut table.time, &mut table.row_time, &mut table.issues);
    if file.binding.sensors.values().any(|sensor| sensor.time_offset.0 != 0.0) {
        // The user has seen to the clocks.
        table.issues.retain(|issue| issue.kind != IssueKind::DIFFERENT_CLOCKS);
    }
    let issues = sentinels::unmeasure(&header.titles, &mut table);
    table.issues.extend(issues);
    table.issues.extend(PlaceWatch::default().look(&bound.places, &table.time, &table.texts));
    let issues = sources::reject(&bound.sources, &mut table);
    table.issues.extend(issues);
    let sheets = table.sheets;
    Ok((LoadedRecording { zero_stamp_s, ..bound.apply(table, file)? }, sheets))
}

/// Which columns of a table become which channels.
pub struct BoundColumns {
    bound: Vec<BoundColumn>,
    /// The column of each label.
    labels: IndexMap<String, usize>,
    /// The request for each column of the table.
    pub wants: Vec<ColumnRequest>,
    /// The rotations whose angles are taken for radians.
    in_radians: Vec<String>,
    /// The columns that other columns are computed from.
    pub sources: Vec<ColumnSource>,
    /// The places in arrays whose elements have names.
    pub places: Vec<BoundPlace>,
    /// The poses in another frame than the common one.
    pub frames: FrameComposition,
}

impl BoundColumns {
    /// Looks up the columns that the binding names.
    ///
    /// # Errors
    /// When the table lacks one, or one has another form than its channel.
    pub fn of(header: &Header, file: &BindingFile, scene: &Scene) -> Result<Self, InputError> {
        let times = if file.binding.rate.is_some() { vec![] } else { header.times(file)? };
        let mut bound = Self::of_stamped(header, file, scene)?;
        for time in times {
            if let Some(want) = time.column.and_then(|column| bound.wants.get_mut(column)) {
                *want = ColumnRequest::Time(time.factor);
            }
        }
        Ok(bound)
    }

    /// Like the above, for rows with known stamps.
    ///
    /// # Errors
    /// As [`of`](Self::of).
    pub fn of_stamped(header: &Header, file: &BindingFile, scene: &Scene) -> Result<Self, InputError> {
        let objects: Vec<&str> =
            scene.bodies.iter().filter(|(_, body)| body.role == Role::Object).map(|(name, _)| name.as_str()).collect();
        let mut wants = vec![ColumnRequest::Nothing; header.titles.len()];
        let mut bound: Vec<BoundColumn> = vec![];
        let mut labels: IndexMap<String, usize> = IndexMap::new();
        for (key, columns) in &file.binding.channels {
            let wrong = |message: String| file.error(key, message);
            if names::is_label(key) {
                labels.insert(key.clone(), header.text_column(columns).map_err(wrong)?);
            } else if !matches!(columns, Columns::OffsetPoint(_) | Columns::Link(_) | Columns::PointDistance(_)) {
                bound.extend(header.channel(key, columns, &objects).map_err(wrong)?);
            }
        }
        for (robot, joint, columns) in file.joints() {
            let name = robots::joint_column(robot, joint);
            let column = header.joint(name, columns, file.dimension_of_joint(robot, joint));
            bound.push(column.map_err(|message| robots::column_error(file, robot, joint, message))?);
        }
        for column in bound.iter().flat_map(|bound| &bound.terms).filter_map(|term| term.column) {
            if let Some(want) = wants.get_mut(column) {
                *want = ColumnRequest::Number(1.0);
            }
        }
        for (key, column) in &labels {
            match wants.get_mut(*column) {
                Some(want) if *want == ColumnRequest::Nothing => *want = ColumnRequest::Text,
                _ => return Err(file.error(key, "its column is bound as numbers too".into())),
            }
        }
        let mut places = element_places::of(&bound, header);
        places.retain(|place| match wants.get_mut(place.name) {
            Some(want @ ColumnRequest::Nothing) => {
                *want = ColumnRequest::Text;
                true
            }
            want => want.is_some_and(|want| *want == ColumnRequest::Text),
        });
        let in_radians = bound
            .iter()
            .filter(|bound| bound.dimension == Dimension::ANGLE && bound.terms.iter().all(Term::is_of_radians))
            .filter_map(|bound| rotations::channel_of_angles(&bound.name))
            .collect();
        let sources = sources::of(&bound, header, file);
        Ok(Self { bound, labels, wants, in_radians, sources, places, frames: FrameComposition::default() })
    }

    /// Looks up the transforms by which bound poses are composed.
    ///
    /// # Errors
    /// When a pose cannot be composed.
    pub fn find_frames(&mut self, tree: &FrameTree, header: &Header, file: &BindingFile) -> Result<(), InputError> {
        self.frames = FrameComposition::of(tree, &tree.poses(&self.bound, header), file, &mut self.wants)?;
        Ok(())
    }

    /// The channels of a whole log.
    ///
    /// # Errors
    /// As [`apply_row`](Self::apply_row).
    pub fn apply(&self, table: Table, file: &BindingFile) -> Result<LoadedRecording, InputError> {
        let transforms = self.frames.sampled(&table.time, &table.numbers, file.binding.bridge.0);
        let reported = self.frames.issue(&table.time);
        let mut read = self.apply_row(table, file, &transforms)?;
        read.issues.extend(reported);
        Ok(read)
    }

    /// The channels of rows; `transforms` are those of the [frames](Self::frames).
    ///
    /// # Errors
    /// When two columns are bound to one channel, or the frame of a point is not bound.
    pub fn apply_row(
        &self,
        table: Table,
        file: &BindingFile,
        transforms: &[SampledTransform],
    ) -> Result<LoadedRecording, InputError> {
        let Table { time, numbers, mut texts, mut issues, row_time, .. } = table;
        let mut recording = Recording { time, ..Recording::default() };
        for bound in &self.bound {
            let values = bound.values(&numbers, recording.time.len());
            if recording.columns.insert(bound.name.clone(), Column { dimension: bound.dimension, values }).is_some() {
                return Err(file.error("channels", format!("`{}` is bound twice", bound.name)));
            }
        }
        issues.extend(self.in_radians.iter().filter_map(|channel| rotations::beyond_a_turn(&recording, channel)));
        rotations::to_quaternions(&mut recording);
        self.frames.compose(&mut recording, transforms);
        issues.extend(robots::place(&mut recording, file)?);
        for (key, columns) in &file.binding.channels {
            if let Columns::OffsetPoint(offset) = columns {
                offsets::place(&mut recording, file, key, offset)?;
            }
        }
        for (key, columns) in &file.binding.channels {
            if let Columns::PointDistance(span) = columns {
                robots::measure(&mut recording, file, key, span)?;
            }
        }
        pads::place(&mut recording, file)?;
        for (name, column) in &self.labels {
            recording.labels.insert(name.clone(), texts.get_mut(*column).map(std::mem::take).unwrap_or_default());
        }
        Ok(LoadedRecording { recording, issues, row_time, zero_stamp_s: 0.0 })
    }
}

impl BoundColumn {
    fn values(&self, numbers: &[Vec<f64>], rows: usize) -> Vec<f64> {
        let mut values: Vec<f64> = vec![0.0; rows];
        for term in &self.terms {
            let Some(column) = term.column else {
                values.iter_mut().for_each(|value| *value += self.weight * term.offset);
                continue;
            };
            for (value, number) in values.iter_mut().zip(numbers.get(column).into_iter().flatten()) {
                let number = term.value(*number);
                // A flag that was not measured makes the whole unmeasured, whichever way it is joined.
                *value = if self.flag && !number.is_nan() && !value.is_nan() {
                    f64::max(*value, f64::from(u8::from(number > 0.5)))
                } else {
                    *value + self.weight * number
                };
            }
        }
        values
    }
}
