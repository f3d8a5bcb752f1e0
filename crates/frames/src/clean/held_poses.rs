//! Poses that are repeated: a log of 60 Hz has each pose of a camera of 15 Hz in four rows. The body seems to stand and to jump, which is not its motion, so
//! that the rows between two measured poses are interpolated.
//!
//! Whether a log repeats poses shows in its jumps: those of a body that moves in every row do not follow equal rows. A slow body whose position is
//! rounded repeats its pose too, but goes on by one step.

use crate::clean::preprocess::{Columns, channel_of, over_all};
use crate::clean::untracked_bodies::is_position;
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use teachtree_base::channels::Shape;
use teachtree_base::log_channel::LogChannel;
use teachtree_logs::issue::{Issue, IssueKind};
use teachtree_logs::names;

/// A body at one pose for longer than this rests, s.
const REST_S: f64 = 0.25;
/// A jump of a position is longer than this, m …
const JUMP_M: f64 = 1e-3;
/// … and one of a quaternion, about twice this in rad.
const JUMP_TURN: f64 = 5e-3;
/// A jump is longer than this multiple of the least change of a component as well: the step of rounded values.
const STEPS: f64 = 2.0;
/// Changes below this share of a jump are errors of arithmetic.
const EXACT: f64 = 1e-3;
/// Minimum number of jumps after equal rows.
const FEWEST: usize = 10;
/// Their minimum share of all jumps.
const SHARE: f64 = 0.1;
/// The share of them whose equal rows are all interpolated.
const WHOLE: f64 = 0.9;

/// A position, followed by 0, or a quaternion.
type Pose = [f64; 4];

/// Finds out whether a log repeats the poses of a channel, row by row.
#[derive(Clone, Debug)]
pub struct HoldDetector {
    jump: f64,
    /// The maximum number of equal rows of a body that moves.
    most: usize,
    /// The least change of a component.
    least: f64,
    last: Option<Pose>,
    equal: usize,
    jumps: usize,
    /// The changes, by the number of equal rows before them.
    changes: BTreeMap<usize, usize>,
    /// The jumps after equal rows, by the number of these rows.
    held: BTreeMap<usize, usize>,
}

impl HoldDetector {
    /// For a channel of positions or rotations; `None` of other channels.
    pub fn of(channel: &str, rate_hz: f64) -> Option<Self> {
        let is_rotation = || names::meaning(&format!("{channel}.w")).is_some_and(|it| it.shape == Shape::Rotation);
        let jump = if is_position(channel) {
            JUMP_M
        } else if is_rotation() {
            JUMP_TURN
        } else {
            return None;
        };
        let most = most_rows(rate_hz);
        Some(Self {
            jump,
            most,
            least: f64::INFINITY,
            last: None,
            equal: 0,
            jumps: 0,
            changes: BTreeMap::new(),
            held: BTreeMap::new(),
        })
    }

    /// Takes the next rows, by component.
    pub fn take(&mut self, columns: &[&[f64]]) {
        for row in 0..columns.first().map_or(0, |column| column.len()) {
            let pose = pose(columns, row);
            let last = self.last.unwrap_or(pose);
            let changes = last.iter().zip(&pose).map(|(last, new)| (new - last).abs());
            self.least = changes.filter(|change| *change > EXACT * self.jump).fold(self.least, f64::min);
            let moved = if columns.len() == 4 { turned(&last, &pose) } else { distance(&last, &pose) };
            if moved > self.jump.max(STEPS * self.least) {
                self.jumps += 1;
                if (2..=self.most).contains(&self.equal) {
                    *self.held.entry(self.equal).or_default() += 1;
                }
            }
            if moved > 0.0 && self.equal <= self.most {
                *self.changes.entry(self.equal).or_default() += 1;
            }
            self.equal = if self.last == Some(pose) { self.equal + 1 } else { 1 };
            self.last = Some(pose);
        }
    }

    /// The rows over which the log holds a pose; `None` if it does not.
    pub fn rows(&self) -> Option<usize> {
        let held: usize = self.held.values().sum();
        if held < FEWEST || (held as f64) < SHARE * self.jumps as f64 {
            return None;
        }
        let mut sum = 0;
        let is_whole = |(_, count): &(&usize, &usize)| {
            sum += **count;
            sum as f64 >= WHOLE * held as f64
        };
        self.held.iter().find(is_whole).map(|(rows, _)| *rows)
    }

    /// The mean number of rows from one change to the next one, without longer holds than this number of rows.
    fn mean_rows(&self, most: usize) -> f64 {
        let usual = || self.changes.range(..=most);
        let rows: usize = usual().map(|(rows, count)| rows * count).sum();
        rows as f64 / usual().map(|(_, count)| count).sum::<usize>().max(1) as f64
    }
}

/// A channel whose poses the log repeats.
pub struct HeldChannel {
    /// The rows over which a pose is held.
    pub rows: usize,
    /// The rows that begin with a new pose: the measured ones.
    pub measured: Vec<usize>,
}

/// The interpolation of a channel whose poses are held, row by row.
#[derive(Clone, Debug)]
pub struct HeldPose {
    /// The rows over which a pose is held.
    rows: usize,
    /// The first row of the newest pose, and the pose.
    newest: Option<(usize, Pose)>,
}

/// The rows between two measured poses.
pub struct Ramp {
    from: usize,
    to: usize,
    poses: [Pose; 2],
}

impl HeldPose {
    /// Nothing is known of the pose yet.
    pub const fn new(rows: usize) -> Self {
        Self { rows, newest: None }
    }

    /// The number of later rows on which the pose in a row depends.
    pub const fn lag(&self) -> usize {
        self.rows.saturating_sub(1)
    }

    /// Begins a new stretch.
    pub fn begin(&mut self) {
        self.newest = None;
    }

    /// Takes the pose in a row; the rows before it that are interpolated now.
    pub fn take(&mut self, row: usize, columns: &[&[f64]], at: usize) -> Option<Ramp> {
        let new = pose(columns, at);
        let (since, old) = *self.newest.get_or_insert((row, new));
        if old == new {
            return None;
        }
        self.newest = Some((row, new));
        // The two signs of a quaternion are one rotation.
        let is_opposite = columns.len() == 4 && old.iter().zip(&new).map(|(old, new)| old * new).sum::<f64>() < 0.0;
        let new = if is_opposite { new.map(|part| -part) } else { new };
        let from = since.max(row.saturating_sub(self.rows));
        (row - from > 1).then_some(Ramp { from, to: row, poses: [old, new] })
    }
}

impl Ramp {
    /// The rows whose poses are interpolated.
    pub fn rows(&self) -> Range<usize> {
        self.from + 1..self.to
    }

    /// A component of the pose in one of these rows.
    pub fn value(&self, row: usize, component: usize) -> f64 {
        let [old, new] = self.poses.map(|pose| pose.get(component).copied().unwrap_or_default());
        old + (new - old) * (row - self.from) as f64 / (self.to - self.from) as f64
    }
}

/// The maximum number of rows over which a log with this rate holds a pose.
pub fn most_rows(rate_hz: f64) -> usize {
    (REST_S * rate_hz) as usize
}

/// Interpolates the poses that a log with these stretches repeats; returns the channels.
pub fn interpolate(
    time: &[f64],
    rate_hz: f64,
    stretches: &[Range<usize>],
    columns: &mut Columns,
    issues: &mut Vec<Issue>,
) -> BTreeMap<String, HeldChannel> {
    let channels: BTreeSet<String> = columns.keys().map(|name| channel_of(name).to_string()).collect();
    let mut held = BTreeMap::new();
    for channel in channels {
        let Some(mut detector) = HoldDetector::of(&channel, rate_hz) else { continue };
        let Some(names) = LogChannel::parse(&channel).map(|channel| channel.columns()) else { continue };
        let taken: Option<Vec<Cow<[f64]>>> =
            names.iter().map(|name| columns.get(name.as_str()).map(|(_, values)| values.clone())).collect();
        let Some(taken) = taken else { continue };
        let parts: Vec<&[f64]> = taken.iter().map(|values| values.as_ref()).collect();
        detector.take(&parts);
        let Some(rows) = detector.rows() else { continue };
        let (mut pose, mut measured) = (HeldPose::new(rows), vec![]);
        for stretch in stretches {
            pose.begin();
            for row in stretch.clone() {
                let ramp = pose.take(row, &parts, row);
                measured.extend(pose.newest.filter(|(since, _)| *since == row).map(|_| row));
                let Some(ramp) = ramp else { continue };
                for (component, name) in names.iter().enumerate() {
                    let Some((_, values)) = columns.get_mut(name.as_str()) else { continue };
                    let values = values.to_mut().get_mut(ramp.rows()).unwrap_or_default();
                    values.iter_mut().zip(ramp.rows()).for_each(|(value, row)| *value = ramp.value(row, component));
                }
            }
        }
        let message = format!(
            "it stays the same for up to {rows} rows and then jumps, as if measured at {:.0} Hz; it is interpolated between its changes",
            rate_hz / detector.mean_rows(rows)
        );
        issues.push(over_all(time, IssueKind::HELD_POSE, &channel, message));
        held.insert(channel, HeldChannel { rows, measured });
    }
    held
}

fn pose(columns: &[&[f64]], row: usize) -> Pose {
    [0, 1, 2, 3].map(|component| columns.get(component).and_then(|column| column.get(row)).copied().unwrap_or_default())
}

/// The distance of two quaternions, whose signs do not matter.
fn turned(one: &Pose, other: &Pose) -> f64 {
    distance(one, other).min(distance(one, &other.map(|part| -part)))
}

fn distance(one: &Pose, other: &Pose) -> f64 {
    one.iter().zip(other).map(|(one, other)| (one - other).powi(2)).sum::<f64>().sqrt()
}
