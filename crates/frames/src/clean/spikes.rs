//! Samples that cannot be: out and back within one or two of them, faster than anything moves, turns or presses.
//!
//! A marker that is taken for another, a bit that tips on the way: one such sample would be a fingertip elsewhere, a blow or a turn. It is
//! made unmeasured where a log is opened, before anything is computed from its neighbors, and goes the way of every other drop-out. So are the
//! first one or two of a log and the last ones, where a device sends zeros before it sees anything. What changes amid a log and stays is not such a
//! sample, nor is a blow that lasts: those were measured.
//!
//! A velocity may change at once, in an impact, and a low limit is wanted for it: one sample in 1 kHz of a few m/s is enough to move an average. So
//! the velocity of a body is compared with the change of its pose: it is out only when the pose does not move so between the rows about it.

use crate::clean::dropouts::{self, LARGEST, NO_ROTATION};
use crate::clean::unknown_columns::UnknownColumn;
use nalgebra::Vector3;
use std::f64::consts::TAU;
use std::ops::Range;
use teachtree_base::channels::Shape;
use teachtree_base::geometry::unit;
use teachtree_base::log_channel::{BodyPart, LogChannel};
use teachtree_base::recording::Recording;
use teachtree_base::short_number::ShortNumber;
use teachtree_base::units::Dimension;
use teachtree_logs::issue::{Issue, IssueKind};
use teachtree_logs::names;

/// The most samples in a row that are taken out.
pub(crate) const LASTS: usize = 2;

/// Minimum distance of an outlier.
#[derive(Clone, Copy, Debug)]
struct Limits {
    /// At least: m, rad, N, m/s or rad/s.
    least: f64,
    /// And more than this times a power of the time between them, s.
    rate: f64,
    power: i32,
    /// The sample after may be farther from the one before by this share of the jump: hands go on meanwhile.
    agrees: f64,
}

impl Limits {
    const fn new(least: f64, rate: f64, power: i32, agrees: f64) -> Self {
        Self { least, rate, power, agrees }
    }

    /// Whether nothing gets so far in this time, s.
    fn exceeded(self, distance: f64, secs: f64) -> bool {
        distance >= self.least && distance > self.rate * secs.powi(self.power)
    }
}

/// A position, m, by an acceleration in m/s²: no hand and nothing in it has half as much.
const PLACE: Limits = Limits::new(0.020, 500.0, 2, 0.2);
/// A rotation, rad, by an acceleration in rad/s².
const TURN: Limits = Limits::new(std::f64::consts::FRAC_PI_3, 5000.0, 2, 0.2);
/// The force of a fingertip, N, and N/s²: a blow takes milliseconds, and between samples that are farther apart it may come and go.
const PRESS: Limits = Limits::new(100.0, 1e8, 2, 0.2);
/// The force between two bodies: the impact of stiff ones is ten times as hard.
const BEAR: Limits = Limits::new(1000.0, 1e9, 2, 0.2);
/// A velocity, m/s, when the pose contradicts it: the acceleration, m/s², is what a hand changes it by between samples.
const SPEED: Limits = Limits::new(0.1, 10.0, 1, 0.5);
/// An angular velocity, rad/s and rad/s², likewise. A body that rattles in a socket turns to and fro with 2 rad/s.
const SPIN: Limits = Limits::new(1.0, 300.0, 1, 0.5);
/// A velocity of a body whose position the log lacks: nothing is hit so hard twice within two samples.
const LONE_SPEED: Limits = Limits::new(1.0, 500.0, 1, 0.5);
/// An angular velocity of a body whose rotation the log lacks.
const LONE_SPIN: Limits = Limits::new(20.0, 5000.0, 1, 0.5);

/// Minimum ratio of an abnormal quaternion's length to the usual length, or its inverse. Averaged or interpolated quaternions are a little short.
const OTHER_LENGTH: f64 = 1.25;

/// Whether a quaternion of this length is not a rotation where others have the usual one.
pub(crate) fn is_other_length(length: f64, usual: f64) -> bool {
    length > usual * OTHER_LENGTH || length < usual / OTHER_LENGTH
}

/// Number of rows that are checked together.
const CHUNK: usize = 1024;

/// The quantity of a checked channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Quantity {
    Position,
    Rotation,
    FingerForce,
    ContactForce,
    Velocity,
    AngularVelocity,
    /// A scalar angle, length or force.
    Angle,
    Length,
    Force,
}

impl Quantity {
    /// Fingertips, palms, bodies and the forces between bodies are checked.
    fn of(shape: Shape, dimension: Dimension, bodies: [Option<&str>; 2]) -> Option<Self> {
        match (shape, dimension) {
            (Shape::Vec3, Dimension::LENGTH) => Some(Self::Position),
            (Shape::Vec3, Dimension::FORCE) if bodies == [None, None] => Some(Self::FingerForce),
            (Shape::Vec3, Dimension::FORCE) => Some(Self::ContactForce),
            (Shape::Vec3, Dimension::SPEED) => Some(Self::Velocity),
            (Shape::Vec3, Dimension::ANGULAR_SPEED) => Some(Self::AngularVelocity),
            (Shape::Rotation, _) => Some(Self::Rotation),
            _ => None,
        }
    }

    const fn limits(self) -> Limits {
        match self {
            Self::Position | Self::Length => PLACE,
            Self::Rotation | Self::Angle => TURN,
            Self::FingerForce | Self::Force => PRESS,
            Self::ContactForce => BEAR,
            Self::Velocity => SPEED,
            Self::AngularVelocity => SPIN,
        }
    }

    /// A component of a sample that is calm changes by less.
    fn calm(self) -> f64 {
        match self {
            // The change of a unit quaternion is 0.5 at least, and its components are four; lengths differ a little.
            Self::Rotation => 0.1,
            // Each of three components may have its part in a jump.
            kind => kind.limits().least / 2.0,
        }
    }

    /// Returns a sample; `None` for a missing or impossible value, which does not count as a neighbor.
    fn sample(self, row: usize, time: f64, mut value: [f64; 4]) -> Option<Sample> {
        if !value.iter().all(|value| value.abs() <= LARGEST) {
            return None;
        }
        if self == Self::Rotation {
            let length = value.iter().map(|component| component * component).sum::<f64>().sqrt();
            if length < NO_ROTATION {
                return None;
            }
            value.iter_mut().for_each(|component| *component /= length);
        }
        Some(Sample { row, time, value })
    }

    /// Whether it is the change of a pose.
    pub(crate) const fn is_rate(self) -> bool {
        matches!(self, Self::Velocity | Self::AngularVelocity)
    }

    /// Returns the distance of samples, in the unit of its [`Limits`].
    fn distance(self, a: &Sample, b: &Sample) -> f64 {
        let pairs = || a.value.iter().zip(&b.value);
        match self {
            Self::Rotation => {
                // Either sign of a quaternion is the same rotation.
                let [along, against] =
                    [1.0, -1.0].map(|sign: f64| pairs().map(|(a, b)| (a - sign * b) * (a - sign * b)).sum::<f64>());
                4.0 * (along.min(against).sqrt() / 2.0).min(1.0).asin()
            }
            Self::Angle => {
                // Angles that differ by a full turn are equal.
                let distance = (a.value[0] - b.value[0]).rem_euclid(TAU);
                distance.min(TAU - distance)
            }
            _ => pairs().map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt(),
        }
    }

    /// Whether nothing gets from one sample to the next.
    fn is_impossible_step(self, a: &Sample, b: &Sample) -> bool {
        self.limits().exceeded(self.distance(a, b), b.time - a.time)
    }

    /// The distance of samples that jump away and back.
    fn jump(self, before: &Sample, out: &[Sample], after: &Sample) -> Option<f64> {
        let (first, last) = (out.first()?, out.last()?);
        let far = |sample: &Sample| self.distance(before, sample).min(self.distance(sample, after));
        let least = out.iter().map(far).fold(f64::INFINITY, f64::min);
        let is_one = self.is_impossible_step(before, first) && self.is_impossible_step(last, after);
        let limits = self.limits();
        (is_one && least >= limits.least && self.distance(before, after) <= limits.agrees * least).then_some(least)
    }
}

/// A sample of a channel; the fourth component of a vector is zero.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub row: usize,
    time: f64,
    value: [f64; 4],
}

impl Sample {
    /// Returns the jump with its row relative to another row.
    pub fn counted_from(self, first: usize) -> Self {
        Self { row: self.row.saturating_sub(first), ..self }
    }
}

/// Looks at the samples of a channel one after the other, with no more than four in mind: the last one that was good, those that may be out,
/// and the one after them.
#[derive(Clone, Debug)]
pub struct SpikeDetector {
    pub(crate) kind: Quantity,
    recent: Vec<Sample>,
    rows: usize,
    /// The first samples but those in mind; `None` once they are known to be good, or reported.
    first: Option<Vec<Sample>>,
    /// Whether the sample before those in mind is as near to the first of them as it has to be.
    settled: bool,
}

/// Samples that cannot be.
pub(crate) struct Spike {
    pub samples: Vec<Sample>,
    jump: f64,
}

impl Spike {
    /// Returns the same jump for other samples.
    pub fn with(&self, samples: Vec<Sample>) -> Self {
        Self { samples, jump: self.jump }
    }
}

impl SpikeDetector {
    /// The detector of a channel; `None` if the channel is not checked.
    pub fn of(channel: &str) -> Option<Self> {
        let channel = LogChannel::parse(channel)?;
        Quantity::of(channel.shape(), channel.dimension(), channel.bodies()).map(Self::new)
    }

    /// Creates an empty detector for a quantity.
    pub(crate) fn new(kind: Quantity) -> Self {
        Self { kind, recent: vec![], rows: 0, first: Some(vec![]), settled: false }
    }

    /// Looks at more rows of a channel's components; whether none of them is out.
    pub fn look(&mut self, time: &[f64], parts: &[&[f64]]) -> bool {
        self.find(time, parts).is_empty()
    }

    /// The same, and which are.
    fn find(&mut self, time: &[f64], parts: &[&[f64]]) -> Vec<Spike> {
        let mut found = vec![];
        for start in (0..time.len()).step_by(CHUNK) {
            let rows = start..(start + CHUNK).min(time.len());
            let time = time.get(rows.clone()).unwrap_or_default();
            let parts: Vec<&[f64]> = parts.iter().map(|part| part.get(rows.clone()).unwrap_or_default()).collect();
            // Almost all of a log is calm, and that is soon seen.
            let mut first = 0;
            if self.is_calm(&parts, rows.len()) {
                first = rows.len() - 1;
                self.recent.clear();
                (self.first, self.settled) = (None, true);
            }
            for (at, time) in time.iter().enumerate().skip(first) {
                found.extend(self.sample(self.rows + at, *time, &parts, at).and_then(|sample| self.take(sample)));
            }
            self.rows += rows.len();
        }
        found
    }

    /// Whether the last checked rows are within limits if the log ends with them.
    pub fn finish(&self) -> bool {
        self.at_the_end().is_none()
    }

    /// Looks at the sample of one row: the components, of which a vector has three and a fourth that is zero. Which samples are out.
    pub(crate) fn push(&mut self, row: usize, time: f64, value: [f64; 4]) -> Option<Spike> {
        let sample = self.kind.sample(row, time, value)?;
        // Almost all samples are calm, and that is soon seen.
        if let (None, [before]) = (&self.first, self.recent.as_mut_slice())
            && before.value.iter().zip(&sample.value).all(|(was, is)| (is - was).abs() < self.kind.calm())
        {
            *before = sample;
            self.settled = true;
            return None;
        }
        self.take(sample)
    }

    /// The first row of which later ones decide whether it is out.
    pub(crate) fn undecided(&self) -> Option<usize> {
        let sample = match &self.first {
            Some(first) => first.first().or(self.recent.first()),
            None => self.recent.get(1),
        };
        sample.map(|sample| sample.row)
    }

    /// Begins anew, amid a log.
    pub(crate) fn restart(&mut self) {
        self.recent.clear();
        (self.first, self.settled) = (None, false);
    }

    /// The last samples, when nothing comes after their jump that would bear them out.
    pub(crate) fn at_the_end(&self) -> Option<Spike> {
        let (before, out) = self.recent.split_first()?;
        let next = out.first()?;
        let is_out = self.first.is_none() && self.settled && self.kind.is_impossible_step(before, next);
        is_out.then(|| Spike { samples: out.to_vec(), jump: self.kind.distance(before, next) })
    }

    /// Whether no component changes so much from row to row that a sample could be out, and all are measured.
    fn is_calm(&self, parts: &[&[f64]], rows: usize) -> bool {
        let before = match self.recent.as_slice() {
            [] => None,
            [before] => Some(before),
            _ => return false,
        };
        let most = self.kind.calm();
        let is_calm = |(component, part): (usize, &&[f64])| {
            let Some(first) = part.first().filter(|first| part.len() == rows && first.abs() < LARGEST / 2.0) else {
                return false;
            };
            let was = before.and_then(|before| before.value.get(component)).unwrap_or(first);
            let pairs = part.iter().zip(part.iter().skip(1));
            (first - was).abs() < most && pairs.fold(true, |calm, (one, next)| calm & ((next - one).abs() < most))
        };
        let are_rotations = || match parts {
            [w, x, y, z] => dropouts::are_rotations([w, x, y, z]),
            _ => true,
        };
        parts.iter().enumerate().all(is_calm) && are_rotations()
    }

    /// A sample of some components.
    fn sample(&self, row: usize, time: f64, parts: &[&[f64]], at: usize) -> Option<Sample> {
        let mut value = [0.0; 4];
        for (component, part) in value.iter_mut().zip(parts) {
            *component = part.get(at).copied()?;
        }
        self.kind.sample(row, time, value)
    }

    fn take(&mut self, sample: Sample) -> Option<Spike> {
        self.recent.push(sample);
        while let [before, next, ..] = self.recent.as_slice() {
            let mut began_out = None;
            if self.kind.is_impossible_step(before, next) {
                let last = self.recent.len() - 1;
                let out = self.recent.get(1..last).unwrap_or_default();
                if let Some(jump) = self.kind.jump(before, out, &sample) {
                    let samples = out.to_vec();
                    self.recent.drain(..last);
                    (self.first, self.settled) = (None, true);
                    return Some(Spike { samples, jump });
                }
                if out.len() < LASTS {
                    return None;
                }
                began_out = self.at_the_beginning();
            }
            self.pass();
            if began_out.is_some() {
                self.first = None;
                return began_out;
            }
        }
        None
    }

    /// The samples up to a jump, when they are the first ones and what comes after it stays.
    fn at_the_beginning(&self) -> Option<Spike> {
        let ([before, after @ ..], Some(first)) = (self.recent.as_slice(), &self.first) else { return None };
        let stays = after.windows(2).all(|pair| matches!(pair, [a, b] if !self.kind.is_impossible_step(a, b)));
        let samples: Vec<Sample> = first.iter().chain([before]).copied().collect();
        let jump = self.kind.distance(before, after.first()?);
        (stays && samples.len() <= LASTS).then_some(Spike { samples, jump })
    }

    /// Advances by a sample.
    fn pass(&mut self) {
        let passed = self.recent.remove(0);
        self.settled = self.recent.first().is_some_and(|next| !self.kind.is_impossible_step(&passed, next));
        self.first = self.first.take().filter(|first| first.len() < LASTS).map(|mut first| {
            first.push(passed);
            first
        });
    }
}

/// Makes unmeasured what is out in a recording; an issue for each channel that has such samples.
pub fn reject(recording: &mut Recording) -> Vec<Issue> {
    let first = |name: &String| {
        names::meaning(name).filter(|meaning| meaning.component == 0).map(|meaning| meaning.channel.to_string())
    };
    // Columns that the scene does not know have no reader.
    let known = recording.columns.keys().filter(|name| UnknownColumn::of(name, &recording.scene).is_none());
    let looked_at =
        known.filter_map(first).filter_map(|channel| SpikeDetector::of(&channel).map(|detector| (channel, detector)));
    // Poses come first: a velocity is compared with what is left of them.
    let (rates, others): (Vec<_>, Vec<_>) = looked_at.partition(|(_, detector)| detector.kind.is_rate());
    let mut issues = reject_lengths(recording, &others);
    for (channel, detector) in others.into_iter().chain(rates) {
        let Some(columns) = LogChannel::parse(&channel).map(|channel| channel.columns()) else { continue };
        let parts: Vec<&[f64]> = columns
            .iter()
            .filter_map(|name| recording.columns.get(name))
            .map(|column| column.values.as_slice())
            .filter(|values| values.len() == recording.time.len())
            .collect();
        if parts.len() < columns.len() {
            continue;
        }
        let Some((rows, issue)) = find_out(recording, &channel, detector.kind, &parts) else { continue };
        issues.push(issue);
        unmeasure(recording, &columns, rows.iter().copied());
    }
    issues
}

/// Returns the rows of spikes in a channel's components, and the issue that reports them. Forces and speeds are checked against the other channels of
/// the recording.
pub(crate) fn find_out(
    recording: &Recording,
    channel: &str,
    kind: Quantity,
    parts: &[&[f64]],
) -> Option<(Vec<usize>, Issue)> {
    let mut detector = SpikeDetector::new(kind);
    let mut found = detector.find(&recording.time, parts);
    found.extend(detector.at_the_end());
    if kind.is_rate() {
        found.retain(|out| is_contradicted(recording, channel, kind, out));
    }
    let worst = found.iter().reduce(|worst, out| if out.jump > worst.jump { out } else { worst })?;
    let samples: Vec<Sample> = found.iter().flat_map(|out| &out.samples).copied().collect();
    let issue = issue(channel, kind, &samples, worst)?;
    Some((samples.iter().map(|sample| sample.row).collect(), issue))
}

/// Makes rows of some columns unmeasured.
fn unmeasure(recording: &mut Recording, columns: &[String], rows: impl Iterator<Item = usize> + Clone) {
    for name in columns {
        let Some(column) = recording.columns.get_mut(name) else { continue };
        for row in rows.clone() {
            if let Some(value) = column.values.get_mut(row) {
                *value = f64::NAN;
            }
        }
    }
}

/// Makes unmeasured the quaternions that are far longer or shorter than those of their channel: one component is wrong, and the direction with it. At a few
/// rows a second anything may turn so far, so that no jump shows it.
fn reject_lengths(recording: &mut Recording, channels: &[(String, SpikeDetector)]) -> Vec<Issue> {
    let mut issues = vec![];
    for (channel, _) in channels.iter().filter(|(_, detector)| detector.kind == Quantity::Rotation) {
        let Some(columns) = LogChannel::parse(channel).map(|channel| channel.columns()) else { continue };
        let parts: Vec<&[f64]> =
            columns.iter().filter_map(|name| recording.columns.get(name)).map(|it| it.values.as_slice()).collect();
        if parts.len() < columns.len() {
            continue;
        }
        let Some((rows, issue)) = find_other_lengths(&recording.time, channel, &parts) else { continue };
        issues.push(issue);
        unmeasure(recording, &columns, rows.iter().copied());
    }
    issues
}

/// Returns the rows in which a quaternion's length differs much from the usual one, and the issue that reports them.
pub(crate) fn find_other_lengths(time: &[f64], channel: &str, parts: &[&[f64]]) -> Option<(Vec<usize>, Issue)> {
    let length = |row: usize| parts.iter().map(|part| part.get(row).map_or(0.0, |it| it * it)).sum::<f64>().sqrt();
    // A zero quaternion was not measured; another check handles it.
    let lengths: Vec<(usize, f64)> =
        (0..time.len()).map(|row| (row, length(row))).filter(|(_, length)| *length >= NO_ROTATION).collect();
    let mut sorted: Vec<f64> = lengths.iter().map(|(_, length)| *length).collect();
    sorted.sort_by(f64::total_cmp);
    let usual = sorted.get(sorted.len() / 2).copied()?;
    let out: Vec<(usize, f64)> = lengths.into_iter().filter(|(_, length)| is_other_length(*length, usual)).collect();
    let ((first, length), (last, _)) = (out.first()?, out.last()?);
    // Lengths that vary throughout are another fault, which the check of the usual length reports.
    if out.len() > sorted.len() / 10 {
        return None;
    }
    let span = [first, last].map(|row| time.get(*row).copied().unwrap_or_default());
    let issue = of_other_length(channel, out.len(), span, [*length, usual]);
    Some((out.iter().map(|(row, _)| *row).collect(), issue))
}

/// Formats the issue of quaternions of another length: their number, start and end, the length of the first one, and the usual length.
pub(crate) fn of_other_length(
    channel: &str,
    count: usize,
    [start_s, end_s]: [f64; 2],
    [length, usual]: [f64; 2],
) -> Issue {
    let samples = if count == 1 {
        "1 sample is not a rotation: it".into()
    } else {
        format!("{count} samples are not rotations: the first")
    };
    let rounded = |value: f64| ShortNumber((value * 1e3).round() / 1e3);
    let message = format!(
        "{samples} is {} long at {} s, others are {}; treated as not measured",
        rounded(length),
        ShortNumber(start_s),
        rounded(usual)
    );
    Issue { kind: IssueKind::IMPLAUSIBLE_ROTATION, start_s, end_s, channel: channel.into(), message }
}

/// Whether a pose moves otherwise than its rate says: the rate is outside what the pose changes by between the rows about it.
pub(crate) fn is_contradicted(recording: &Recording, channel: &str, kind: Quantity, out: &Spike) -> bool {
    let (Some(first), Some(last)) = (out.samples.first(), out.samples.last()) else { return false };
    let rows = first.row.saturating_sub(1)..(last.row + 2).min(recording.time.len());
    let secs = (recording.time[rows.end - 1] - recording.time[rows.start]) / (rows.len() - 1).max(1) as f64;
    let changes: Vec<Vector3<f64>> = changes(recording, channel, kind, rows).unwrap_or_default();
    let Some(some) = changes.first() else {
        let alone = if kind == Quantity::AngularVelocity { LONE_SPIN } else { LONE_SPEED };
        return alone.exceeded(out.jump, secs);
    };
    let low = changes.iter().fold(*some, |low, change| low.inf(change));
    let high = changes.iter().fold(*some, |high, change| high.sup(change));
    out.samples.iter().all(|sample| {
        let [x, y, z, _] = sample.value;
        let rate = Vector3::new(x, y, z);
        kind.limits().exceeded((rate - rate.sup(&low).inf(&high)).norm(), secs)
    })
}

/// Returns the rate of change of a pose from row to row, per second; `None` if the log lacks it. Rows without a measured pose are left out.
fn changes(recording: &Recording, channel: &str, kind: Quantity, rows: Range<usize>) -> Option<Vec<Vector3<f64>>> {
    let LogChannel::Body(body, _) = LogChannel::parse(channel)? else { return None };
    let pose =
        LogChannel::Body(body, if kind == Quantity::AngularVelocity { BodyPart::Rotation } else { BodyPart::Position });
    let columns = pose.columns();
    let column = |name: &String| recording.columns.get(name).map(|column| &column.values);
    let parts: Vec<&Vec<f64>> = columns.iter().map(column).collect::<Option<_>>()?;
    let sample = |row: usize| {
        let values = parts.iter().map(|part| part.get(row).copied().filter(|value| value.abs() <= LARGEST));
        values.collect::<Option<Vec<f64>>>().map(|values| (recording.time[row], values))
    };
    let samples: Vec<(f64, Vec<f64>)> = rows.filter_map(sample).collect();
    let change = |pair: &[(f64, Vec<f64>)]| {
        let [(from_s, from), (to_s, to)] = pair else { return None };
        let change = match (from.as_slice(), to.as_slice()) {
            ([a, b, c], [x, y, z]) => Vector3::new(x - a, y - b, z - c),
            ([a, b, c, d], [w, x, y, z]) => (unit([*w, *x, *y, *z]) * unit([*a, *b, *c, *d]).inverse()).scaled_axis(),
            _ => return None,
        };
        Some(change / (to_s - from_s))
    };
    Some(samples.windows(2).filter_map(change).collect())
}

/// Formats the issue of outliers.
pub(crate) fn issue(channel: &str, kind: Quantity, samples: &[Sample], worst: &Spike) -> Option<Issue> {
    let (first, last, shown) = (samples.first()?, samples.last()?, worst.samples.first()?);
    let rounded = |value: f64| ShortNumber((value * 1e4).round() / 1e4);
    let [a, b, c, d] = shown.value.map(rounded);
    let (jump, value) = match kind {
        Quantity::Position => (format!("{} mm", ShortNumber((worst.jump * 1e3).round())), format!("({a}, {b}, {c}) m")),
        Quantity::FingerForce | Quantity::ContactForce => {
            (format!("{} N", ShortNumber(worst.jump.round())), format!("({a}, {b}, {c}) N"))
        }
        Quantity::Velocity => (format!("{} m/s", rounded(worst.jump)), format!("({a}, {b}, {c}) m/s")),
        Quantity::AngularVelocity => (format!("{} rad/s", rounded(worst.jump)), format!("({a}, {b}, {c}) rad/s")),
        Quantity::Rotation => {
            (format!("{}°", ShortNumber(worst.jump.to_degrees().round())), format!("({a}, {b}, {c}, {d})"))
        }
        Quantity::Angle => (format!("{}°", ShortNumber(worst.jump.to_degrees().round())), format!("{a} rad")),
        Quantity::Length => (format!("{} mm", ShortNumber((worst.jump * 1e3).round())), format!("{a} m")),
        Quantity::Force => (format!("{} N", ShortNumber(worst.jump.round())), format!("{a} N")),
    };
    let at_s = rounded(shown.time);
    let (cannot, are) = match samples.len() {
        1 => (format!("1 sample is impossible: {value} at {at_s} s"), "it is"),
        many => (format!("{many} samples are impossible: the farthest, {value} at {at_s} s,"), "they are"),
    };
    let message = format!("{cannot} is {jump} from the samples around it; {are} treated as not measured");
    let (kind, channel) = (IssueKind::IMPOSSIBLE_JUMP, channel.into());
    Some(Issue { kind, start_s: first.time, end_s: last.time, channel, message })
}
