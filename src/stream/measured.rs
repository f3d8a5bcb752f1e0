//! What was measured, made fit for the rules: a recording in, its trusted columns on an even time base out.
//!
//! Columns that nobody knows are left aside, dead force sensors read as no contact, rows in which a value is missing become gaps.
//! Each of these is told as an issue (docs/logs.md).

use super::dead;
use super::frames::Issue;
use super::names::{self, Meaning};
use super::timebase::{Timebase, timebase};
use crate::base::error::InputError;
use crate::base::recording::Recording;
use crate::base::scene::Scene;
use crate::base::units::Dimension;
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// A value beyond this, in SI, was not measured: nothing that a hand does is so large, and what is computed from it would overflow.
const LARGEST: f64 = 1e12;

/// A log that can be trusted frame by frame: no NaN, an even step within each stretch.
pub struct Measured<'a> {
    /// Bodies and hands.
    pub scene: &'a Scene,
    /// Time of each frame, s.
    pub time: Vec<f64>,
    /// Frames per second.
    pub rate_hz: f64,
    /// Gap-free stretches of frames.
    pub stretches: Vec<Range<usize>>,
    /// What was found and done.
    pub issues: Vec<Issue>,
    columns: BTreeMap<&'a str, (Dimension, Cow<'a, [f64]>)>,
}

impl<'a> Measured<'a> {
    /// Takes the columns with canonical names, and those that `asked` for by name although they are not canonical.
    ///
    /// # Errors
    /// When a column is not as long as the time, a vector lacks a component, or the time base is unusable.
    pub fn new(recording: &'a Recording, asked: impl Fn(&str) -> bool) -> Result<Self, InputError> {
        let rows = recording.time.len();
        let (mut issues, mut strangers, mut never) = (vec![], vec![], BTreeSet::new());
        let mut columns: BTreeMap<&str, (Dimension, Cow<[f64]>)> = BTreeMap::new();
        for (name, column) in &recording.columns {
            if column.values.len() != rows {
                let message = format!("the column has {} values, the time has {rows}", column.values.len());
                return Err(InputError::new(format!("channel {name}"), message));
            }
            if !asked(name)
                && let Some(stranger) = stranger(name, recording)
            {
                strangers.push((name, stranger));
            } else if rows > 0 && column.values.iter().all(|value| value.is_nan()) {
                never.insert(channel_of(name));
            } else {
                columns.insert(name, (column.dimension, Cow::Borrowed(&column.values)));
            }
        }
        issues.extend(unknown_channels(recording, &strangers));
        let absent = "no sample was measured; the channel counts as absent";
        issues.extend(never.iter().map(|channel| over_all(&recording.time, "not_a_number", channel, absent.into())));
        whole_vectors(&columns)?;
        issues.extend(dead::silence(&recording.time, &mut columns));
        let keep = measured_rows(&recording.time, &columns, &mut issues);
        let Timebase { rate_hz, rows, stretches } = timebase(&recording.time, &keep, &mut issues)?;
        if rows.len() < recording.time.len() {
            for (_, values) in columns.values_mut() {
                *values = Cow::Owned(rows.iter().filter_map(|row| values.get(*row).copied()).collect());
            }
        }
        let time = rows.iter().filter_map(|row| recording.time.get(*row).copied()).collect();
        Ok(Self { scene: &recording.scene, time, rate_hz, stretches, issues, columns })
    }

    /// Number of frames.
    pub fn len(&self) -> usize {
        self.time.len()
    }

    /// A channel of one column.
    pub fn scalar(&self, name: &str) -> Option<&[f64]> {
        self.columns.get(name).map(|(_, values)| values.as_ref())
    }

    /// The dimension of a column.
    pub fn dimension(&self, column: &str) -> Option<Dimension> {
        self.columns.get(column).map(|(dimension, _)| *dimension)
    }

    /// A channel of three columns.
    pub fn vec3(&self, name: &str) -> Option<[&[f64]; 3]> {
        Some([self.component(name, "x")?, self.component(name, "y")?, self.component(name, "z")?])
    }

    /// A channel of four columns w x y z.
    pub fn rotation(&self, name: &str) -> Option<[&[f64]; 4]> {
        Some([
            self.component(name, "w")?,
            self.component(name, "x")?,
            self.component(name, "y")?,
            self.component(name, "z")?,
        ])
    }

    fn component(&self, name: &str, component: &str) -> Option<&[f64]> {
        self.scalar(&format!("{name}.{component}"))
    }

    /// An issue over the whole log.
    pub fn over_all(&self, kind: &str, channel: &str, message: String) -> Issue {
        over_all(&self.time, kind, channel, message)
    }

    /// The names of the channels, without components, in order.
    pub fn channels(&self) -> Vec<&str> {
        let mut channels: Vec<&str> = self.columns.keys().map(|name| channel_of(name)).collect();
        channels.dedup();
        channels
    }
}

/// The channel that a column is a component of; the column itself when its name is not canonical.
fn channel_of(column: &str) -> &str {
    names::meaning(column).map_or(column, |meaning| meaning.channel)
}

fn over_all(time: &[f64], kind: &str, channel: &str, message: String) -> Issue {
    let [start_s, end_s] = [time.first(), time.last()].map(|stamp| stamp.copied().unwrap_or_default());
    Issue { kind: kind.into(), start_s, end_s, channel: channel.into(), message }
}

/// Why a column is not known.
enum Stranger<'a> {
    /// No channel has its name.
    Name,
    /// It names a body that the scene has not.
    Body(&'a str),
}

/// Why a column is not known, if it is not.
fn stranger<'a>(name: &'a str, recording: &Recording) -> Option<Stranger<'a>> {
    let Some(Meaning { bodies, .. }) = names::meaning(name) else { return Some(Stranger::Name) };
    bodies.into_iter().flatten().find(|body| !recording.scene.bodies.contains_key(*body)).map(Stranger::Body)
}

/// Tells which columns are ignored, and what may have been meant.
fn unknown_channels(recording: &Recording, strangers: &[(&String, Stranger)]) -> Vec<Issue> {
    /// Columns told one by one; more are summed up: such a log is none of ours.
    const TOLD: usize = 20;
    let bodies = &recording.scene.bodies;
    let body_columns = bodies.keys().flat_map(|body| BODY_ENDINGS.iter().map(move |ending| format!("{body}.{ending}")));
    let known: Vec<String> = canonical_hand_columns().chain(body_columns).collect();
    let meant = |near: Option<&str>| near.map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
    let told = strangers.iter().take(TOLD).map(|(name, stranger)| {
        let message = match stranger {
            Stranger::Body(body) => format!(
                "the scene has no body `{body}`; the column is ignored{}",
                meant(names::nearest(body, bodies.keys().map(String::as_str)))
            ),
            Stranger::Name => format!(
                "no channel has this name; the column is ignored{}",
                meant(names::nearest(name, known.iter().map(String::as_str)))
            ),
        };
        over_all(&recording.time, "unknown_channel", name, message)
    });
    let more = strangers.len().saturating_sub(TOLD);
    let rest = (more > 0)
        .then(|| over_all(&recording.time, "unknown_channel", "", format!("{more} more columns are ignored")));
    told.chain(rest).collect()
}

const BODY_ENDINGS: [&str; 13] = [
    "position.x",
    "position.y",
    "position.z",
    "rotation.w",
    "rotation.x",
    "rotation.y",
    "rotation.z",
    "velocity.x",
    "velocity.y",
    "velocity.z",
    "angular_velocity.x",
    "angular_velocity.y",
    "angular_velocity.z",
];

fn canonical_hand_columns() -> impl Iterator<Item = String> {
    use crate::base::hands::{Finger, Side};
    const ENDINGS: [&str; 7] = ["position.x", "position.y", "position.z", "force.x", "force.y", "force.z", "contact"];
    Side::BOTH.into_iter().flat_map(|side| {
        Finger::ALL
            .into_iter()
            .flat_map(move |finger| ENDINGS.iter().map(move |ending| format!("{side}.{finger}.{ending}")))
    })
}

/// Checks that a vector has all its components.
fn whole_vectors(columns: &BTreeMap<&str, (Dimension, Cow<[f64]>)>) -> Result<(), InputError> {
    for name in columns.keys() {
        let Some(meaning) = names::meaning(name) else { continue };
        let components = meaning.shape.components();
        let lacking = components.iter().find(|component| {
            !component.is_empty() && !columns.contains_key(format!("{}.{component}", meaning.channel).as_str())
        });
        if let Some(component) = lacking {
            let message = format!("the log has `{name}` but not `{}.{component}`", meaning.channel);
            return Err(InputError::new(format!("channel {}", meaning.channel), message));
        }
    }
    Ok(())
}

/// Which rows have every value; the others become gaps, each with an issue that names the channel.
fn measured_rows(
    time: &[f64],
    columns: &BTreeMap<&str, (Dimension, Cow<[f64]>)>,
    issues: &mut Vec<Issue>,
) -> Vec<bool> {
    /// Intervals told one by one for a channel; more are summed up.
    const TOLD: usize = 20;
    let mut keep = vec![true; time.len()];
    let mut channels: BTreeMap<&str, Vec<&[f64]>> = BTreeMap::new();
    for (name, (_, values)) in columns {
        channels.entry(channel_of(name)).or_default().push(values);
    }
    for (name, components) in channels {
        let mut intervals: Vec<Range<usize>> = vec![];
        for (row, keep) in keep.iter_mut().enumerate() {
            if !components.iter().all(|values| values.get(row).is_some_and(|value| value.abs() <= LARGEST)) {
                *keep = false;
                match intervals.last_mut() {
                    Some(last) if last.end == row => last.end = row + 1,
                    _ => intervals.push(row..row + 1),
                }
            }
        }
        let all: usize = intervals.iter().map(Range::len).sum();
        if let (true, Some(first), Some(last)) = (intervals.len() > TOLD, intervals.first(), intervals.last()) {
            let message =
                format!("{all} samples in {} intervals were not measured; those frames are left out", intervals.len());
            issues.push(Issue { message, ..not_measured(time, name, &(first.start..last.end)) });
        } else {
            issues.extend(intervals.iter().map(|interval| not_measured(time, name, interval)));
        }
    }
    keep
}

fn not_measured(time: &[f64], channel: &str, rows: &Range<usize>) -> Issue {
    let at = |row: usize| time.get(row).or(time.last()).copied().unwrap_or_default();
    let samples = if rows.len() == 1 { "1 sample was".to_string() } else { format!("{} samples were", rows.len()) };
    let message = format!("{samples} not measured; the frames are left out and everything restarts after them");
    Issue {
        kind: "not_a_number".into(),
        start_s: at(rows.start),
        end_s: at(rows.end),
        channel: channel.into(),
        message,
    }
}
