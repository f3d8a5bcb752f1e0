//! Dead sensors: a force that is repeated bit by bit while the hand moves was not measured.
//!
//! A force that is constant proves nothing by itself: a simulated grip is, and so is a steady grip that a coarse sensor rounds. A whole
//! vector that is repeated for [`STUCK_SECS`] while the fingertip moves, or while another force changes, is dead
//!
//! - all along, when the sensor repeats itself during most of the log and never reads zero: it has no rest;
//! - in that interval, when the sensor is lively otherwise: its noise is far finer than what it repeats.
//!
//! A dead force reads zero, so that it is never one long contact. A component that repeats itself during most of the log and has no rest is only reported, and
//! so is a fingertip that stands still while the others of its hand travel.

use crate::clean::preprocess::Columns;
use std::borrow::Cow;
use std::ops::Range;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::log_channel::{FingerPart, LogChannel};
use teachtree_base::recording::Recording;
use teachtree_base::units::Dimension;
use teachtree_logs::issue::{Issue, IssueKind};
use teachtree_logs::names;

/// Minimum duration of a repeated value, s.
const STUCK_SECS: f64 = 1.0;
/// A sensor without rest is dead all along when most of its samples are repeated for this long, s: it updates now and then.
pub(crate) const LAZY_SECS: f64 = 0.25;
/// A force nearer to zero than this is rest, N.
const REST: f64 = 0.05;
/// Minimum displacement of a fingertip in that time, m.
const MOVED: f64 = 0.010;
/// Or how much another force must change, N.
const CHANGED: f64 = 0.1;
/// Minimum displacement of the other fingertips while one stands still, m.
const TRAVELLED: f64 = 0.050;
/// The fewest changes that show whether a sensor is alive.
const CHANGES: usize = 10;
/// Noise turns round at two of three changes, a ramp at none: the least share of turns.
const TURNS: f64 = 0.25;
/// Minimum ratio of a usual change to the finest change; a sensor with a smaller ratio rounds.
const FINER: f64 = 5.0;

/// The fewest samples outside of long runs that show whether a sensor repeats itself, and how few of them a smooth sensor repeats.
const LIVELY: usize = 100;
const REPEATED: f64 = 0.02;

/// A vector over the log.
type Vector<'a> = [&'a [f64]; 3];

/// Like the above, for a recording before the correction of its sensors: a tared dead sensor would read zero, as at rest.
pub fn silence_uncorrected(recording: &mut Recording, trust: &[String]) -> Vec<Issue> {
    let mut columns: Columns = recording
        .columns
        .iter()
        .map(|(name, column)| (name.as_str(), (column.dimension, Cow::Borrowed(column.values.as_slice()))))
        .collect();
    let issues = silence(&recording.time, &mut columns, trust);
    let silenced: Vec<(String, Vec<f64>)> = columns
        .into_iter()
        .filter_map(|(name, (_, values))| match values {
            Cow::Owned(values) => Some((name.to_string(), values)),
            Cow::Borrowed(_) => None,
        })
        .collect();
    for (name, values) in silenced {
        if let Some(column) = recording.columns.get_mut(&name) {
            column.values = values;
        }
    }
    issues
}

/// Puts zeros where a force sensor of a finger is dead, and returns where; those in `trust` are left alone.
pub fn silence(time: &[f64], columns: &mut Columns, trust: &[String]) -> Vec<Issue> {
    let channels: Vec<String> = columns
        .keys()
        .filter_map(|name| names::meaning(name))
        .filter(|meaning| {
            meaning.dimension == Dimension::FORCE && meaning.component == 0 && meaning.bodies == [None, None]
        })
        .map(|meaning| meaning.channel.to_string())
        .collect();
    let mut issues = vec![];
    // All are judged before the first is silenced: each is a witness against the others.
    let found: Vec<(&String, Vec<Range<usize>>)> = channels
        .iter()
        .filter(|channel| !trust.contains(channel))
        .map(|channel| (channel, stuck(time, columns, channel, &channels)))
        .collect();
    for (channel, intervals) in found {
        for rows in &intervals {
            let message = format!(
                "the force stays at exactly {} while the hand moves; it reads zero here; `trust: [{channel}]` in a binding keeps it",
                value(columns, channel, longest(time, columns, channel, rows), "N")
            );
            issues.push(Issue { message, ..interval(time, channel, rows) });
        }
        if intervals.is_empty() {
            issues.extend(frozen_components(time, columns, channel));
        }
        for component in ["x", "y", "z"] {
            if let (false, Some((_, values))) =
                (intervals.is_empty(), columns.get_mut(format!("{channel}.{component}").as_str()))
            {
                let values = values.to_mut();
                for rows in &intervals {
                    values.get_mut(rows.clone()).unwrap_or_default().fill(0.0);
                }
            }
        }
    }
    issues
}

/// Returns an issue for the components of a force that repeat themselves during most of the log and have no rest.
fn frozen_components(time: &[f64], columns: &Columns, channel: &str) -> Option<Issue> {
    let force = vector(columns, channel)?;
    let frozen: Vec<&str> = ["x", "y", "z"]
        .into_iter()
        .zip(force)
        .filter(|(_, values)| {
            let mut repeats = ComponentRepeats::default();
            repeats.look(time, values);
            repeats.is_frozen(time.len())
        })
        .map(|(component, _)| component)
        .collect();
    let message = format!(
        "one value of {} is repeated for {LAZY_SECS} s and longer in most of the log, which never reads zero; it is read as it is, but a sensor that measures has \
         noise",
        frozen.join(" and of ")
    );
    (!frozen.is_empty()).then(|| Issue { message, ..interval(time, channel, &(0..time.len())) })
}

/// Minimum number of rows of a log in which repeated values are reported.
const FEWEST: usize = 20;

/// The repetitions of a component of a force.
#[derive(Clone, Debug)]
struct ComponentRepeats {
    /// The current value, its start, s, and its number of rows.
    value: f64,
    since: f64,
    rows: usize,
    /// The stamp of the last row, s.
    last: f64,
    /// How many rows have repeated a value for long.
    lazy: usize,
    /// The least and the largest value.
    range: [f64; 2],
}

impl Default for ComponentRepeats {
    fn default() -> Self {
        let range = [f64::INFINITY, f64::NEG_INFINITY];
        Self { value: f64::NAN, since: f64::NAN, rows: 0, last: f64::NAN, lazy: 0, range }
    }
}

impl ComponentRepeats {
    fn look(&mut self, time: &[f64], values: &[f64]) {
        for (time, value) in time.iter().zip(values) {
            if value.to_bits() != self.value.to_bits() {
                self.lazy += self.repeated();
                (self.value, self.since, self.rows) = (*value, *time, 0);
            }
            self.rows += 1;
            self.last = *time;
            self.range = [self.range[0].min(*value), self.range[1].max(*value)];
        }
    }

    /// How many rows have had the value so far, where it lasts for long.
    fn repeated(&self) -> usize {
        if self.last - self.since >= LAZY_SECS && !self.value.is_nan() { self.rows } else { 0 }
    }

    /// Whether a value is repeated in most of the rows, and none of them is zero or on the other side of it.
    fn is_frozen(&self, rows: usize) -> bool {
        let [least, largest] = self.range;
        rows >= FEWEST && (self.lazy + self.repeated()) * 2 > rows && (least > 0.0 || largest < 0.0)
    }
}

/// Detects a vector that may be of a dead sensor, as far as it alone shows while it comes in blocks: a sensor that is dead is
/// among those that may be.
pub struct RepeatDetector {
    is_force: bool,
    /// The value so far and when it began, s.
    value: [f64; 3],
    since: f64,
    /// When the last row was, s, and how many have had the value.
    last: f64,
    rows: usize,
    /// How many rows have repeated a value for long.
    lazy: usize,
    rests: bool,
    components: [ComponentRepeats; 3],
}

impl RepeatDetector {
    /// Of a channel that may be dead or frozen: the force or the place of a finger.
    pub fn of(channel: &str) -> Option<Self> {
        let column = format!("{channel}.x");
        let meaning = names::meaning(&column).map(|meaning| (meaning.dimension, meaning.bodies));
        let is_force = meaning == Some((Dimension::FORCE, [None, None]));
        let is_tip = meaning == Some((Dimension::LENGTH, [None, None])) && !channel.contains(".palm.");
        let (value, since, last) = ([f64::NAN; 3], f64::NAN, f64::NAN);
        let components = Default::default();
        (is_force || is_tip).then_some(Self {
            is_force,
            value,
            since,
            last,
            rows: 0,
            lazy: 0,
            rests: false,
            components,
        })
    }

    /// Looks at more rows; whether they surely are of a sensor that lives.
    pub fn look(&mut self, time: &[f64], [x, y, z]: Vector) -> bool {
        if self.is_force {
            self.components.iter_mut().zip([x, y, z]).for_each(|(component, values)| component.look(time, values));
        }
        for (((time, x), y), z) in time.iter().zip(x).zip(y).zip(z) {
            let [was_x, was_y, was_z] = self.value;
            let same =
                was_x.to_bits() == x.to_bits() && was_y.to_bits() == y.to_bits() && was_z.to_bits() == z.to_bits();
            if !same {
                self.end();
                (self.value, self.since, self.rows) = ([*x, *y, *z], *time, 0);
                self.rests |= self.is_force && !self.rests && x * x + y * y + z * z < REST * REST / 2.0;
            }
            self.rows += 1;
            self.last = *time;
            if same && time - self.since >= STUCK_SECS && !(self.is_force && self.at_rest()) {
                return false;
            }
        }
        true
    }

    fn at_rest(&self) -> bool {
        self.value.iter().map(|part| part * part).sum::<f64>() < REST * REST / 2.0
    }

    /// Counts the value that was.
    fn end(&mut self) {
        if self.last - self.since >= LAZY_SECS {
            self.lazy += self.rows;
        }
    }

    /// Whether all rows were surely of a sensor that lives.
    pub fn finish(&self, rows: usize) -> bool {
        let last = if self.last - self.since >= LAZY_SECS { self.rows } else { 0 };
        let is_frozen = self.components.iter().any(|component| component.is_frozen(rows));
        !self.is_force || !is_frozen && (self.rests || (self.lazy + last) * 2 <= rows)
    }
}

/// Returns an issue for fingertips whose position is repeated bit by bit while every other fingertip of the hand travels.
pub fn frozen(time: &[f64], columns: &Columns) -> Vec<Issue> {
    let mut issues = vec![];
    for side in Side::BOTH {
        let tips: Vec<(String, Vector)> = Finger::ALL
            .into_iter()
            .filter(|finger| *finger != Finger::Palm)
            .map(|finger| LogChannel::Finger(side, finger, FingerPart::Position).to_string())
            .filter_map(|channel| vector(columns, &channel).map(|values| (channel, values)))
            .collect();
        for (channel, values) in &tips {
            let others: Vec<&Vector> = tips.iter().filter(|(other, _)| other != channel).map(|(_, it)| it).collect();
            let travel = |rows: &Range<usize>| {
                !others.is_empty() && others.iter().all(|tip| tip.iter().any(|axis| range(axis, rows) > TRAVELLED))
            };
            issues.extend(repeats(time, *values, STUCK_SECS).iter().filter(|rows| travel(rows)).map(|rows| {
                let message = format!(
                    "the fingertip stays at exactly {} while the others of its hand travel; it is read as it is",
                    value(columns, channel, rows.start, "m")
                );
                Issue { message, ..interval(time, channel, rows) }
            }));
        }
    }
    issues
}

/// The rows in which the sensor behind a channel is dead.
fn stuck(time: &[f64], columns: &Columns, channel: &str, forces: &[String]) -> Vec<Range<usize>> {
    let Some(force) = vector(columns, channel) else { return vec![] };
    let tip = match LogChannel::parse(channel) {
        Some(LogChannel::Finger(side, finger, FingerPart::Force)) => {
            vector(columns, &LogChannel::Finger(side, finger, FingerPart::Position).to_string())
        }
        _ => None,
    };
    let others: Vec<Vector> =
        forces.iter().filter(|other| *other != channel).filter_map(|other| vector(columns, other)).collect();
    let moves = |rows: &Range<usize>| {
        tip.iter().flatten().any(|axis| range(axis, rows) > MOVED)
            || others.iter().flatten().any(|axis| range(axis, rows) > CHANGED)
    };
    let loaded = |rows: &Range<usize>| norm(&force, rows.start) >= REST;
    let runs: Vec<Range<usize>> =
        repeats(time, force, STUCK_SECS).into_iter().filter(|rows| loaded(rows) && moves(rows)).collect();
    let lazy: usize = repeats(time, force, LAZY_SECS).iter().map(Range::len).sum();
    let rests = (0..time.len()).any(|row| norm(&force, row) < REST);
    let all = 0..time.len();
    if !rests && lazy * 2 > time.len() && (!runs.is_empty() || moves(&all)) {
        vec![all]
    } else if is_lively(time, &force) || never_repeats(time, &force) {
        runs
    } else {
        vec![]
    }
}

/// Whether a sensor has noise while it is loaded, far finer than its changes: such a sensor never repeats itself for long.
fn is_lively(time: &[f64], force: &Vector) -> bool {
    let mut repeated = vec![false; time.len()];
    for rows in repeats(time, *force, LAZY_SECS) {
        repeated.get_mut(rows).unwrap_or_default().fill(true);
    }
    let counts = |row: usize| norm(force, row) >= REST && repeated.get(row) == Some(&false);
    force.iter().any(|axis| {
        let at = |row: usize| axis.get(row).copied().unwrap_or_default();
        let rows = (1..time.len()).filter(|row| counts(*row) && counts(row - 1));
        let mut changes: Vec<f64> = rows.map(|row| at(row) - at(row - 1)).filter(|change| *change != 0.0).collect();
        let turns = changes.iter().zip(changes.iter().skip(1)).filter(|(one, next)| *one * *next < 0.0).count();
        if changes.len() < CHANGES || (turns as f64) < TURNS * changes.len() as f64 {
            return false;
        }
        let middle = changes.len() / 2;
        let (finer, usual, _) = changes.select_nth_unstable_by(middle, |a, b| a.abs().total_cmp(&b.abs()));
        finer.iter().map(|change| change.abs()).fold(usual.abs(), f64::min) * FINER <= usual.abs()
    })
}

/// Whether a sensor gives a new value with nearly every sample but for some long runs, and never exactly zero: what is simulated or coarse does repeat
/// itself, and rests at zero.
fn never_repeats(time: &[f64], force: &Vector) -> bool {
    let mut counts = vec![true; time.len()];
    for rows in repeats(time, *force, LAZY_SECS) {
        counts.get_mut(rows).unwrap_or_default().fill(false);
    }
    let at = |row: usize| force.map(|axis| axis.get(row).copied().unwrap_or(f64::NAN).to_bits());
    let pairs = (1..time.len()).filter(|row| counts.get(*row) == Some(&true) && counts.get(row - 1) == Some(&true));
    let (mut all, mut same) = (0, 0);
    for row in pairs {
        all += 1;
        same += usize::from(at(row) == at(row - 1));
    }
    let zero = (0..time.len()).any(|row| norm(force, row) == 0.0);
    !zero && all >= LIVELY && (same as f64) < REPEATED * all as f64
}

fn vector<'a>(columns: &'a Columns, channel: &str) -> Option<Vector<'a>> {
    let axis = |axis: &str| columns.get(format!("{channel}.{axis}").as_str()).map(|(_, values)| values.as_ref());
    Some([axis("x")?, axis("y")?, axis("z")?])
}

fn norm(values: &Vector, row: usize) -> f64 {
    values.iter().map(|axis| axis.get(row).map_or(0.0, |value| value * value)).sum::<f64>().sqrt()
}

/// A vector for a message.
fn value(columns: &Columns, channel: &str, row: usize, unit: &str) -> String {
    let parts = vector(columns, channel).map(|axes| axes.map(|axis| axis.get(row).copied().unwrap_or_default()));
    let [x, y, z] = parts.unwrap_or_default();
    format!("({x}, {y}, {z}) {unit}")
}

/// The first row of the longest repetition within some rows.
fn longest(time: &[f64], columns: &Columns, channel: &str, rows: &Range<usize>) -> usize {
    let runs = vector(columns, channel).map_or(vec![], |values| repeats(time, values, 0.0));
    let within = runs.into_iter().filter(|run| rows.start <= run.start && run.end <= rows.end);
    within.max_by_key(|run| (run.len(), std::cmp::Reverse(run.start))).map_or(rows.start, |run| run.start)
}

/// How far values are apart within some rows.
fn range(values: &[f64], rows: &Range<usize>) -> f64 {
    let values = values.get(rows.clone()).unwrap_or_default();
    let measured = values.iter().filter(|value| !value.is_nan());
    let (low, high) =
        measured.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(*value), high.max(*value)));
    high - low
}

/// Runs of rows in which a vector keeps exactly one value for at least `secs`.
fn repeats(time: &[f64], columns: Vector, secs: f64) -> Vec<Range<usize>> {
    let at = |row: usize| columns.map(|column| column.get(row).copied().unwrap_or(f64::NAN).to_bits());
    let mut runs = vec![];
    let mut start = 0;
    for row in 0..time.len() {
        let next = row + 1;
        if next < time.len() && at(row) == at(next) {
            continue;
        }
        let lasted = time.get(row).zip(time.get(start)).map_or(0.0, |(to, from)| to - from);
        if lasted >= secs && at(start).iter().all(|bits| !f64::from_bits(*bits).is_nan()) {
            runs.push(start..next);
        }
        start = next;
    }
    runs
}

fn interval(time: &[f64], channel: &str, rows: &Range<usize>) -> Issue {
    let at = |row: usize| time.get(row).or(time.last()).copied().unwrap_or_default();
    Issue {
        kind: IssueKind::STUCK_SENSOR,
        start_s: at(rows.start),
        end_s: at(rows.end),
        channel: channel.into(),
        message: String::new(),
    }
}
