//! Logs that are larger than memory: a path in, frames in windows out, and no more of the log in memory than its stamps and one window.
//!
//! Some things are known only when the whole log was seen: its rate and its gaps, and what its sensors read at rest. So the stamps are read
//! first, then the columns that show rest, and then all of it is read and derived window by window. What comes out is the same, bit by
//! bit, as of a log that is in memory.
//!
//! That is for plain logs: canonical, one table, every sample measured, no sensor that may be dead, contacts in the log. Others need all
//! their rows at once ([`crate::open()`]).

use crate::clean::closed_grippers;
use crate::clean::dropouts;
use crate::clean::gap_filling;
use crate::clean::held_poses::HoldDetector;
use crate::clean::preprocess::{CleanLog, Columns, Window, span, whole_vectors};
use crate::clean::spikes::SpikeDetector;
use crate::clean::stuck_sensors::RepeatDetector;
use crate::clean::timebase::{Timebase, timebase};
use crate::clean::unknown_columns::{self, UnknownColumn};
use crate::clean::untracked_bodies::{self, UntrackedBodyDetector};
use crate::derive::pose_noise;
use crate::derive::{self, ANCHOR, Findings, fingertip_bias};
use crate::frames::{Frames, Layout};
use crate::hand_models::{self, HandModel};
use crate::open::OpenRequest;
use std::borrow::Cow;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::PathBuf;
use teachtree_base::channels::ChannelSpec;
use teachtree_base::error::InputError;
use teachtree_base::field_names::FieldNames;
use teachtree_base::hands::Side;
use teachtree_base::log_channel::LogChannel;
use teachtree_base::recording::Recording;
use teachtree_base::scene::{Role, Scene};
use teachtree_base::units::Dimension;
use teachtree_logs::allowed_folders::AllowedFolders;
use teachtree_logs::issue::Issue;
use teachtree_logs::names;
use teachtree_logs::read::csv::{self, StampSource, WantedColumn};
use teachtree_logs::read::first_stamp::count_from_first;
use teachtree_logs::read::formats;
use teachtree_logs::read::table::{Blocks, ColumnRequest, Table};

/// How many frames are derived at once: few enough to stay near the processor.
const WINDOW: usize = 32 * ANCHOR;

/// A log that can be read again and again, as far as its head shows.
pub struct StreamedLog {
    log: PathBuf,
    /// The folders that the log must be in.
    folders: AllowedFolders,
    scene: Scene,
    /// The columns, and what is read of them.
    columns: Vec<WantedColumn>,
    /// How the log spells its channels, for messages.
    spelling: FieldNames,
}

/// What is known of a log once it was looked through.
pub struct FirstPass {
    flow: StreamedLog,
    channels: Vec<ChannelSpec>,
    /// Time of each frame, s.
    pub time: Vec<f64>,
    /// What the stamps of the log show at 0 s.
    pub zero_stamp_s: f64,
    /// Frames per second.
    pub rate_hz: f64,
    /// Gap-free stretches of frames.
    pub stretches: Vec<Range<usize>>,
    issues: Vec<Issue>,
    /// What is known of the force sensors.
    sensors: fingertip_bias::Sensors,
}

/// Frames of one stretch.
pub struct Chunk<'a> {
    /// The columns; some of their frames belong to the parts before and after.
    pub frames: &'a Frames,
    /// The frames that count.
    pub core: Range<usize>,
    /// Whether the stretch ends with them.
    pub ends: bool,
}

impl StreamedLog {
    /// Opens a log; `None` when it has to be in memory to be read, or cannot be read.
    pub fn open(request: &OpenRequest) -> Option<Self> {
        // What comes through a pipe comes once.
        if request.binding.is_some() || !request.log.is_file() {
            return None;
        }
        let mut source = formats::open_within(&request.log, &request.folders.log).ok()?;
        let scene = match (&request.scene, source.scene.take()) {
            (Some(scene), _) => csv::read_scene(scene).ok()?,
            (None, Some(own)) => own,
            (None, None) => csv::scene_beside(&request.log, &request.folders.beside).ok()?,
        };
        let [sheet] = source.sheets.as_slice() else { return None };
        if !sheet.rows.comes_in_blocks() {
            return None;
        }
        let (columns, spelling) = csv::wanted(&source, &StampSource::canonical()).ok()?;
        // When a gripper is closed shows in the whole log.
        let is_learned =
            |side| closed_grippers::is_learned(side, columns.iter().map(|(name, ..): &WantedColumn| name.as_str()));
        if Side::BOTH.into_iter().any(is_learned) {
            return None;
        }
        Some(Self { log: request.log.clone(), folders: request.folders.log.clone(), scene, columns, spelling })
    }

    /// The hands that the log measures, left first.
    pub fn hands(&self) -> Vec<Side> {
        derive::sides(&self.scene, self.measured())
    }

    /// The hand model for the quantities of the log, and the reason for it.
    pub fn hand_model(&self) -> HandModel {
        hand_models::of_columns(&self.scene, self.measured(), &self.spelling)
    }

    /// The names of the columns with numbers.
    fn measured(&self) -> impl Iterator<Item = &str> + Clone {
        let is_measured =
            |(.., want): &&WantedColumn| matches!(want, ColumnRequest::Number(_) | ColumnRequest::Optional(_));
        self.columns.iter().filter(is_measured).map(|(name, ..)| name.as_str())
    }

    /// Reads the log once more.
    fn blocks(&self) -> Option<Box<dyn Blocks>> {
        self.blocks_of(|_| true)
    }

    /// Reads the stamps once more, and the columns that are asked for by name.
    fn blocks_of(&self, asked: impl Fn(&str) -> bool) -> Option<Box<dyn Blocks>> {
        let want = |(name, _, want): &WantedColumn| match want {
            ColumnRequest::Time(_) => *want,
            _ if asked(name) => *want,
            _ => ColumnRequest::Nothing,
        };
        let wants: Vec<ColumnRequest> = self.columns.iter().map(want).collect();
        let header = formats::open_within(&self.log, &self.folders).ok()?;
        let issues = header.issues.is_empty();
        let [sheet] = <[_; 1]>::try_from(header.sheets).ok()?;
        sheet.rows.blocks(&sheet.header, &wants, None).ok()?.filter(|_| issues)
    }

    /// Looks a log through for rules with these channels; `None` when its form is not plain. Whether its values are shows when they are derived.
    pub fn look_through(mut self, channels: &[ChannelSpec]) -> Option<FirstPass> {
        let mut unknown = vec![];
        for (name, _, want) in &mut self.columns {
            match (UnknownColumn::of(name, &self.scene), &want) {
                (_, ColumnRequest::Time(_)) => {}
                (_, ColumnRequest::Text) => *want = ColumnRequest::Nothing,
                (Some(unknown_column), _) if !derive::asks(channels, name) => {
                    unknown.push((name.clone(), unknown_column.owned()));
                    *want = ColumnRequest::Nothing;
                }
                _ => {}
            }
        }
        let none = |(name, dimension, _): &'_ (String, Dimension, ColumnRequest)| (name.clone(), *dimension);
        let names: Vec<(String, Dimension)> = self.read_columns().map(none).collect();
        let empty: Columns =
            names.iter().map(|(name, dimension)| (name.as_str(), (*dimension, Cow::Owned(vec![])))).collect();
        whole_vectors(&empty).ok()?;
        let contacts_known = derive::contacts_are_logged(&self.scene, |name| names.iter().any(|(it, _)| it == name));
        if !contacts_known {
            return None;
        }
        let mut time = vec![];
        let mut blocks = self.blocks_of(|_| false)?;
        while let Some(block) = blocks.next().ok()? {
            if block.time.len() != block.row_time.len() {
                return None;
            }
            time.extend(block.time);
        }
        if gap_filling::any(&time) {
            return None;
        }
        let zero_stamp_s = count_from_first(&mut time, &mut [], &mut []);
        let listed: Vec<(&str, UnknownColumn)> =
            unknown.iter().map(|(name, why)| (name.as_str(), why.borrowed())).collect();
        let ends = Recording { time: span(&time).to_vec(), scene: self.scene.clone(), ..Recording::default() };
        let mut issues = unknown_columns::ignored(&ends, &listed);
        let Timebase { rate_hz, rows: _, stretches } = timebase(&time, &vec![true; time.len()], &mut issues).ok()?;
        let sensors = self.sensors(&time, rate_hz, channels)?;
        Some(FirstPass {
            flow: self,
            channels: channels.to_vec(),
            time,
            zero_stamp_s,
            rate_hz,
            stretches,
            issues,
            sensors,
        })
    }

    /// The learned data of the force sensors of a log with these stamps, for rules with these channels.
    fn sensors(&self, time: &[f64], rate_hz: f64, channels: &[ChannelSpec]) -> Option<fingertip_bias::Sensors> {
        let pairs: Vec<[usize; 2]> = fingertip_bias::samples(time.len()).collect();
        let mut blocks = self.blocks_of(|name| fingertip_bias::asks(&self.scene, name))?;
        let (all, picked) = blocks.pick(pairs.as_flattened()).ok()?;
        let looked_at = 2 * pairs.len();
        let named = self.read_columns().zip(self.of_read(&picked));
        let columns = named
            .map(|((name, dimension, _), values)| (name.as_str(), (*dimension, Cow::Borrowed(values.as_slice()))))
            .collect();
        let measured = CleanLog {
            scene: &self.scene,
            time: pairs.as_flattened().iter().filter_map(|row| time.get(*row).copied()).collect(),
            rate_hz,
            stretches: std::iter::once(0..looked_at).collect(),
            unseen: BTreeMap::new(),
            issues: vec![],
            noise: BTreeMap::new(),
            levels: BTreeMap::new(),
            fingertips: BTreeMap::new(),
            positions: BTreeMap::new(),
            held: BTreeMap::new(),
            span: [0.0; 2],
            window: None,
            columns,
        };
        // The rows that were picked lie side by side.
        let pairs: Vec<[usize; 2]> = (0..looked_at).step_by(2).map(|row| [row, row + 1]).collect();
        (all == time.len())
            .then(|| fingertip_bias::sensors(&measured, &pairs, fingertip_bias::Fingertips::of(channels)))
    }

    /// The columns that are read, the time left out.
    fn read_columns(&self) -> impl Iterator<Item = &WantedColumn> {
        self.columns.iter().filter(|(.., want)| !matches!(want, ColumnRequest::Nothing | ColumnRequest::Time(_)))
    }

    /// Of the columns of a table those of [`read_columns`](Self::read_columns).
    fn of_read<'a>(&self, numbers: &'a [Vec<f64>]) -> impl Iterator<Item = &'a Vec<f64>> {
        let wants = self.columns.iter().map(|(.., want)| *want);
        let read = numbers
            .iter()
            .zip(wants)
            .filter(|(_, want)| !matches!(want, ColumnRequest::Nothing | ColumnRequest::Time(_)));
        read.map(|(values, _)| values)
    }
}

impl FirstPass {
    /// The names of the objects that `target` may be, of all bodies, and of the bodies that are fixed to a hand.
    pub fn names(&self) -> (Vec<String>, Vec<String>, Vec<String>) {
        derive::names(&self.flow.scene)
    }

    /// Derives the frames, part by part in order; what was found wrong with the log.
    ///
    /// # Errors
    /// What `each` says; when the log is not plain, or cannot be read any more; as [`crate::frames()`].
    pub fn parts(
        &self,
        each: &mut dyn FnMut(Chunk) -> Result<(), InputError>,
    ) -> Result<(Layout, Vec<Issue>), InputError> {
        let spelling = &self.flow.spelling;
        let (layout, issues) = self.derived(each).map_err(|error| spelling.of_error(error))?;
        Ok((layout, issues.into_iter().map(|issue| issue.spelled(spelling)).collect()))
    }

    fn derived(
        &self,
        each: &mut dyn FnMut(Chunk) -> Result<(), InputError>,
    ) -> Result<(Layout, Vec<Issue>), InputError> {
        let wrong = |message: &str| InputError::new(self.flow.log.display().to_string(), message);
        let gone = || wrong("cannot be read once more");
        let not_plain = || wrong("has to be in memory to be read");
        let mut blocks = self.flow.blocks().ok_or_else(gone)?;
        let mut plain = FastPath::new(&self.flow, self.rate_hz);
        let mut row_issues = vec![];
        let around = derive::padding(self.rate_hz);
        let mut held = RowBuffer { first: 0, columns: self.flow.read_columns().map(|_| vec![]).collect() };
        let mut findings = Findings::default();
        let mut last = None;
        let mut before = BTreeMap::new();
        for stretch in &self.stretches {
            let mut start = stretch.start;
            while start < stretch.end {
                let core = start..(start + WINDOW).min(stretch.end);
                let seen = core.start.saturating_sub(around).max(stretch.start)..(core.end + around).min(stretch.end);
                // A log may report faults of its rows after the last one.
                let is_last = core.end == self.time.len();
                while is_last || held.end() < seen.end {
                    let mut block = match blocks.next()? {
                        Some(block) => block,
                        None if is_last && held.end() == self.time.len() => break,
                        None => return Err(gone()),
                    };
                    block.time.iter_mut().for_each(|stamp| *stamp -= self.zero_stamp_s);
                    block.issues.iter_mut().for_each(|issue| issue.count_from(self.zero_stamp_s));
                    if !plain.look(&block, &self.flow) {
                        return Err(not_plain());
                    }
                    held.take(self.flow.of_read(&block.numbers));
                    row_issues.append(&mut block.issues);
                }
                held.forget(seen.start);
                let after = RefCell::new(BTreeMap::new());
                // Logs with such objects are in memory.
                let (places, holds) = (RefCell::new(BTreeMap::new()), RefCell::new(BTreeMap::new()));
                let within = core.start - seen.start..core.end - seen.start;
                let window = Window {
                    core: within.clone(),
                    averaged: within.clone(),
                    is_first: start == stretch.start,
                    before: &before,
                    after: &after,
                    kept: within.end,
                    averaged_before: &before,
                    averaged_after: &after,
                    averaged_kept: within.end,
                    touches: &BTreeMap::new(),
                    places_before: &BTreeMap::new(),
                    places_after: &places,
                    holds_before: &BTreeMap::new(),
                    holds_after: &holds,
                };
                let mut measured = CleanLog {
                    scene: &self.flow.scene,
                    time: self.time.get(seen.clone()).unwrap_or_default().to_vec(),
                    rate_hz: self.rate_hz,
                    stretches: std::iter::once(0..seen.len()).collect(),
                    unseen: BTreeMap::new(),
                    issues: self.issues.clone(),
                    noise: BTreeMap::new(),
                    levels: BTreeMap::new(),
                    fingertips: BTreeMap::new(),
                    positions: BTreeMap::new(),
                    held: BTreeMap::new(),
                    span: span(&self.time),
                    window: Some(window),
                    columns: held.columns(&self.flow, seen.len()),
                };
                let corrected = fingertip_bias::correct(&mut measured, &self.sensors);
                let frames = derive::derived_frames(&measured, &self.channels, &mut findings)?;
                each(Chunk { frames: &frames, core: within, ends: core.end == stretch.end })?;
                if is_last {
                    plain.finish(core.end).then_some(()).ok_or_else(not_plain)?;
                    let mut issues = std::mem::take(&mut row_issues);
                    issues.extend(self.issues.iter().cloned().chain(corrected));
                    issues.extend(findings.issues(&measured, &frames.layout));
                    issues.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
                    last = Some((frames.layout, issues));
                }
                drop(measured);
                before = after.into_inner();
                start = core.end;
            }
        }
        last.ok_or_else(gone)
    }
}

/// The rows that are in memory.
struct RowBuffer {
    /// The first of them in the log.
    first: usize,
    columns: Vec<Vec<f64>>,
}

impl RowBuffer {
    fn end(&self) -> usize {
        self.first + self.columns.first().map_or(0, Vec::len)
    }

    fn take<'a>(&mut self, values: impl Iterator<Item = &'a Vec<f64>>) {
        self.columns.iter_mut().zip(values).for_each(|(column, values)| column.extend_from_slice(values));
    }

    fn forget(&mut self, before: usize) {
        let gone = before.saturating_sub(self.first);
        self.columns.iter_mut().for_each(|column| drop(column.drain(..gone.min(column.len()))));
        self.first += gone;
    }

    /// The first rows by name.
    fn columns<'a>(&'a self, flow: &'a StreamedLog, rows: usize) -> Columns<'a> {
        let named = flow.read_columns().zip(&self.columns);
        named
            .map(|((name, dimension, _), values)| {
                (name.as_str(), (*dimension, Cow::Borrowed(values.get(..rows).unwrap_or_default())))
            })
            .collect()
    }
}

/// The position of an object, and its noise so far.
struct PositionColumns {
    columns: [usize; 3],
    estimates: [pose_noise::NoiseEstimator; 3],
    has_velocity: bool,
}

/// Whether every sample of a log was measured and can be, and no sensor may be dead.
struct FastPath {
    /// The largest value of each column, and whether it is a flag.
    bounds: Vec<(f64, bool)>,
    /// The columns of each rotation.
    rotations: Vec<[usize; 4]>,
    repeats: Vec<([usize; 3], RepeatDetector)>,
    spikes: Vec<(Vec<usize>, SpikeDetector)>,
    /// The columns of each position.
    positions: Vec<([usize; 3], UntrackedBodyDetector)>,
    /// The columns of each pose, which must not be held.
    holds: Vec<(Vec<usize>, HoldDetector)>,
    /// The columns of each object's position, whose noise must not count.
    noises: Vec<PositionColumns>,
    rate_hz: f64,
}

impl FastPath {
    fn new(flow: &StreamedLog, rate_hz: f64) -> Self {
        let names: Vec<&str> = flow.read_columns().map(|(name, ..)| name.as_str()).collect();
        let place = |name: String| names.iter().position(|it| *it == name);
        let bounds = names.iter().map(|name| dropouts::bound(name)).collect();
        let of_channel = |letters: [&str; 4], channel: &str| -> Option<[usize; 4]> {
            let [w, x, y, z] = letters.map(|letter| place(format!("{channel}.{letter}")));
            Some([w?, x?, y?, z?])
        };
        let first = |name: &&str| {
            names::meaning(name).filter(|meaning| meaning.component == 0).map(|it| it.channel.to_string())
        };
        let channels: Vec<String> = names.iter().filter_map(first).collect();
        let rotations = channels.iter().filter_map(|channel| of_channel(["w", "x", "y", "z"], channel)).collect();
        let repeated = channels.iter().filter_map(|channel| {
            let repeats = RepeatDetector::of(channel)?;
            let [x, y, z] = ["x", "y", "z"].map(|letter| place(format!("{channel}.{letter}")));
            Some(([x?, y?, z?], repeats))
        });
        let spikes = channels.iter().filter_map(|channel| {
            let parts: Option<_> = LogChannel::parse(channel)?.columns().into_iter().map(place).collect();
            Some((parts?, SpikeDetector::of(channel)?))
        });
        let positions =
            channels.iter().filter(|channel| untracked_bodies::is_position(channel)).filter_map(|channel| {
                let [x, y, z] = ["x", "y", "z"].map(|letter| place(format!("{channel}.{letter}")));
                Some(([x?, y?, z?], UntrackedBodyDetector::default()))
            });
        let positions = positions.collect();
        let holds = channels.iter().filter_map(|channel| {
            let parts: Option<_> = LogChannel::parse(channel)?.columns().into_iter().map(place).collect();
            Some((parts?, HoldDetector::of(channel, rate_hz)?))
        });
        let holds = holds.collect();
        let objects = flow.scene.bodies.iter().filter(|(_, body)| body.role == Role::Object);
        let noises = objects.filter_map(|(name, _)| {
            let has_velocity = place(format!("{name}.velocity.x")).is_some();
            let [x, y, z] = ["x", "y", "z"].map(|letter| place(format!("{name}.position.{letter}")));
            Some(PositionColumns { columns: [x?, y?, z?], estimates: Default::default(), has_velocity })
        });
        let noises = noises.collect();
        let (repeats, spikes) = (repeated.collect(), spikes.collect());
        Self { bounds, rotations, repeats, spikes, positions, holds, noises, rate_hz }
    }

    /// Looks at a block; whether it is plain.
    fn look(&mut self, block: &Table, flow: &StreamedLog) -> bool {
        let values: Vec<&[f64]> = flow.of_read(&block.numbers).map(Vec::as_slice).collect();
        let bounded = values.iter().zip(&self.bounds).all(|(values, (largest, flag))| {
            values.len() == block.time.len()
                && values.iter().all(|value| value.abs() <= *largest)
                && (!flag || values.iter().all(|value| *value == 0.0 || *value == 1.0))
        });
        let column = |at: usize| values.get(at).copied().unwrap_or_default();
        for PositionColumns { columns, estimates, .. } in &mut self.noises {
            columns.iter().zip(estimates).for_each(|(at, estimate)| estimate.take(column(*at)));
        }
        for (parts, holds) in &mut self.holds {
            holds.take(&parts.iter().map(|at| column(*at)).collect::<Vec<_>>());
        }
        bounded
            && self.positions.iter_mut().all(|(parts, lost)| lost.look(parts.map(column)))
            && self.rotations.iter().all(|parts| dropouts::are_rotations(parts.map(column)))
            && self.repeats.iter_mut().all(|(parts, repeats)| repeats.look(&block.time, parts.map(column)))
            && self.spikes.iter_mut().all(|(parts, spikes)| {
                spikes.look(&block.time, &parts.iter().map(|at| column(*at)).collect::<Vec<_>>())
            })
    }

    fn finish(&self, rows: usize) -> bool {
        rows > 1
            && self.repeats.iter().all(|(_, repeats)| repeats.finish(rows))
            && self.spikes.iter().all(|(_, spikes)| spikes.finish())
            && self.holds.iter().all(|(_, holds)| holds.rows().is_none())
            && self.noises.iter().all(|PositionColumns { estimates, has_velocity, .. }| {
                pose_noise::of_columns(estimates.clone(), self.rate_hz, 1, *has_velocity).is_none()
            })
    }
}
