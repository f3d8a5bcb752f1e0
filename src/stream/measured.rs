//! What was measured, made fit for the rules: a recording in, its trusted columns on an even time base out.
//!
//! Columns that nobody knows are left aside, dead force sensors read zero, short drop-outs are bridged, rows in which a value is missing
//! become gaps.
//! Each of these is told as an issue (docs/logs.md).

use super::dead;
use super::dropouts;
use super::frames::Issue;
use super::names;
use super::strangers::{self, Stranger};
use super::timebase::{Timebase, timebase};
use crate::base::error::InputError;
use crate::base::recording::{Column, Recording};
use crate::base::scene::Scene;
use crate::base::units::Dimension;
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// Columns by name.
pub type Columns<'a> = BTreeMap<&'a str, (Dimension, Cow<'a, [f64]>)>;

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
    /// The noise of force sensors, by channel, where it is known.
    pub noise: BTreeMap<String, Noise>,
    columns: Columns<'a>,
}

/// The noise of a sensor, independent from sample to sample.
#[derive(Clone, Copy, Debug)]
pub struct Noise {
    /// Of the vector's components together, squares of the unit.
    pub variance: f64,
}

impl<'a> Measured<'a> {
    /// Takes the columns with canonical names, and those that are `asked` for by name although they are not canonical. The forces named in
    /// `trust` count as they are, however long they stay constant.
    ///
    /// # Errors
    /// When a column is not as long as the time, a vector lacks a component, a flag is no flag, or the time base is unusable.
    pub fn new(recording: &'a Recording, trust: &[String], asked: impl Fn(&str) -> bool) -> Result<Self, InputError> {
        let time = &recording.time;
        let (mut strangers, mut columns) = (vec![], Columns::new());
        for (name, column) in &recording.columns {
            if column.values.len() != time.len() {
                let message = format!("the column has {} values, the time has {}", column.values.len(), time.len());
                return Err(InputError::new(format!("channel {name}"), message));
            }
            match Stranger::of(name, &recording.scene) {
                Some(stranger) if !asked(name) => strangers.push((name.as_str(), stranger)),
                _ => {
                    columns.insert(name, (column.dimension, Cow::Borrowed(&column.values)));
                }
            }
        }
        let mut issues = strangers::ignored(recording, &strangers);
        issues.extend(dropouts::impossible(time, &mut columns)?);
        issues.extend(never_measured(time, &mut columns));
        whole_vectors(&columns)?;
        issues.extend(dropouts::bridge(time, &mut columns));
        issues.extend(dead::frozen(time, &columns));
        issues.extend(dead::silence(time, &mut columns, trust));
        let keep = dropouts::measured_rows(time, &columns, &mut issues);
        let Timebase { rate_hz, rows, stretches } = timebase(time, &keep, &mut issues)?;
        if rows.len() < time.len() {
            for (_, values) in columns.values_mut() {
                *values = Cow::Owned(rows.iter().filter_map(|row| values.get(*row).copied()).collect());
            }
        }
        let time = rows.iter().filter_map(|row| time.get(*row).copied()).collect();
        Ok(Self { scene: &recording.scene, time, rate_hz, stretches, issues, noise: BTreeMap::new(), columns })
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

    /// Subtracts a constant from a channel of three columns.
    pub fn subtract(&mut self, name: &str, constant: [f64; 3]) {
        for (component, constant) in ["x", "y", "z"].into_iter().zip(constant) {
            if let Some((_, values)) = self.columns.get_mut(format!("{name}.{component}").as_str()) {
                values.to_mut().iter_mut().for_each(|value| *value -= constant);
            }
        }
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

    /// The same as a recording, without what is true of it besides.
    pub fn recording(&self) -> Recording {
        let column = |(name, (dimension, values)): (&&str, &(Dimension, Cow<[f64]>))| {
            (name.to_string(), Column { dimension: *dimension, values: values.to_vec() })
        };
        Recording {
            time: self.time.clone(),
            columns: self.columns.iter().map(column).collect(),
            scene: self.scene.clone(),
            ..Recording::default()
        }
    }

    /// The names of the channels, without components, in order.
    pub fn channels(&self) -> Vec<&str> {
        let mut channels: Vec<&str> = self.columns.keys().map(|name| channel_of(name)).collect();
        channels.dedup();
        channels
    }
}

/// The channel that a column is a component of; the column itself when its name is not canonical.
pub fn channel_of(column: &str) -> &str {
    names::meaning(column).map_or(column, |meaning| meaning.channel)
}

/// An issue over a whole log.
pub fn over_all(time: &[f64], kind: &str, channel: &str, message: String) -> Issue {
    let [start_s, end_s] = [time.first(), time.last()].map(|stamp| stamp.copied().unwrap_or_default());
    Issue { kind: kind.into(), start_s, end_s, channel: channel.into(), message }
}

/// Takes away the channels with a component of which no sample was measured.
fn never_measured(time: &[f64], columns: &mut Columns) -> Vec<Issue> {
    let never: BTreeSet<String> = columns
        .iter()
        .filter(|(_, (_, values))| !values.is_empty() && values.iter().all(|value| value.is_nan()))
        .map(|(name, _)| channel_of(name).to_string())
        .collect();
    columns.retain(|name, (_, values)| !never.contains(channel_of(name)) || values.is_empty());
    let message = "no sample was measured; the channel counts as absent";
    never.iter().map(|channel| over_all(time, "not_a_number", channel, message.into())).collect()
}

/// Checks that a vector has all its components.
fn whole_vectors(columns: &Columns) -> Result<(), InputError> {
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
