//! Prepares a recording for the rules: returns its trusted columns on an even time base.
//!
//! Unknown columns are ignored, dead force sensors read zero, short drop-outs are bridged, rows in which a value is missing
//! become gaps.
//! Each of these is an issue (docs/logs.md).

use crate::clean::contact_level::{LearnedLevel, vector_as_list};
use crate::clean::dropouts;
use crate::clean::fingertip_level::{FingertipLevel, RestLevel};
use crate::clean::held_poses::{self, HeldChannel};
use crate::clean::lost_bodies;
use crate::clean::stuck_sensors;
use crate::clean::timebase::{Timebase, timebase};
use crate::clean::unknown_columns::{self, UnknownColumn};
use crate::clean::untracked_bodies;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_base::recording::{Column, Recording};
use teachtree_base::scene::Scene;
use teachtree_base::units::Dimension;
use teachtree_logs::issue::{Issue, IssueKind};
use teachtree_logs::names;

/// Columns by name.
pub type Columns<'a> = BTreeMap<&'a str, (Dimension, Cow<'a, [f64]>)>;

/// A log that can be trusted frame by frame: no NaN, an even step within each stretch.
pub struct CleanLog<'a> {
    /// Bodies and hands.
    pub scene: &'a Scene,
    /// Time of each frame, s.
    pub time: Vec<f64>,
    /// Frames per second.
    pub rate_hz: f64,
    /// Gap-free stretches of frames.
    pub stretches: Vec<Range<usize>>,
    /// The frames in which a hand involves a body that was lost, by hand.
    pub unseen: BTreeMap<Side, Vec<Range<usize>>>,
    /// The issues and their treatment.
    pub issues: Vec<Issue>,
    /// The noise of force sensors, by channel, where it is known.
    pub noise: BTreeMap<String, Noise>,
    /// The force levels at which sensors are in contact, by channel.
    pub levels: BTreeMap<String, LearnedLevel>,
    /// The contact levels from the readings of fingertips, by channel, if neither distances from objects nor `levels` determine them.
    pub fingertips: BTreeMap<String, FingertipLevel>,
    /// The noise of the positions of bodies, by name, where it counts.
    pub positions: BTreeMap<String, PositionNoise>,
    /// The channels whose poses the log repeats, by name; they are interpolated.
    pub held: BTreeMap<String, HeldChannel>,
    /// Start and end of the whole log, s.
    pub span: [f64; 2],
    /// The window of the log; `None` for the whole log.
    pub window: Option<Window<'a>>,
    /// The columns.
    pub columns: Columns<'a>,
}

/// A part of a stretch with as many frames around it as averages look at. What follows a log from frame to frame goes on from the window
/// before.
pub struct Window<'a> {
    /// The frames that count.
    pub core: Range<usize>,
    /// Those of them around which everything that is followed is known, so that it can be averaged.
    pub averaged: Range<usize>,
    /// Whether the stretch begins here.
    pub is_first: bool,
    /// The states before the frames that count, by what is followed.
    pub before: &'a BTreeMap<String, State>,
    /// The states before the frame `kept`, or after the last frame.
    pub after: &'a RefCell<BTreeMap<String, State>>,
    /// The frame with which the next window begins to count.
    pub kept: usize,
    /// The states before the averaged frames.
    pub averaged_before: &'a BTreeMap<String, State>,
    /// The states before the frame `averaged_kept`, or after the last frame.
    pub averaged_after: &'a RefCell<BTreeMap<String, State>>,
    /// The frame with which the averaged frames of the next window begin.
    pub averaged_kept: usize,
    /// The learned data of contacts that are computed from shapes, by object.
    pub touches: &'a BTreeMap<usize, Touches>,
    /// The places in the frames before `core` of the objects that the log does not show, by object, m.
    pub places_before: &'a BTreeMap<usize, Vec<Vector3<f64>>>,
    /// Those from the start of `core` to the frame `kept`.
    pub places_after: &'a RefCell<BTreeMap<usize, Vec<Vector3<f64>>>>,
    /// The holds of these objects before `core`.
    pub holds_before: &'a BTreeMap<usize, Hold>,
    /// Those before the frame `kept`.
    pub holds_after: &'a RefCell<BTreeMap<usize, Hold>>,
}

/// An object that the log does not show, and the hands around it, at a frame.
#[derive(Clone, Debug, Default)]
pub struct Hold {
    /// The position of the object, reference frame, m; `None` if it is unknown.
    pub place: Option<Vector3<f64>>,
    /// The hand that moves it.
    pub holder: Option<usize>,
    /// The hands with a gripper.
    pub hands: Vec<HandHold>,
}

/// A hand with a gripper at a frame.
#[derive(Clone, Debug, Default)]
pub struct HandHold {
    /// The mean of its fingertips, reference frame, m.
    pub at: Vector3<f64>,
    /// Whether it is closed, with the object as its target.
    pub closed: bool,
    /// Whether it has closed on the object and not let go since.
    pub has_it: bool,
}

impl Hold {
    /// An object that nothing has held yet.
    pub fn of_place(hands: usize, place: Option<Vector3<f64>>) -> Self {
        Self { place, holder: None, hands: vec![HandHold::default(); hands] }
    }
}

/// The learned data of an object's contacts that are computed from shapes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Touches {
    /// The bodies that it may touch.
    pub pairs: Vec<TouchPair>,
    /// The least force of the balance of forces that is not noise, N; `None` where the balance does not come out.
    pub noise: Option<f64>,
    /// The supports whose contacts with it are known as flags.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub supports: Vec<FlaggedSupport>,
}

/// The learned data of a support whose contact with an object is a flag.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlaggedSupport {
    /// The body, as its index in the scene.
    pub other: usize,
    /// The levels at which the object rests on it while no hand touches it.
    pub levels: Vec<SupportLevel>,
    /// Whether it moves.
    pub moves: bool,
}

/// An object at rest on a support.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SupportLevel {
    /// The height of its origin above that of the support, m.
    pub height: f64,
    /// The direction of up in the frame of the object.
    #[serde(with = "vector_as_list")]
    pub up: Vector3<f64>,
}

/// An object and a body that it may touch.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TouchPair {
    /// The body, as its index in the scene.
    pub other: usize,
    /// The gap at which they touch in truth, m.
    pub offset: f64,
    /// The tolerance, m.
    pub within: f64,
    /// Whether they touched at all.
    pub touched: bool,
}

/// The state at a frame, for quantities that depend on the frame before.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State {
    /// Whether it holds.
    pub on: bool,
    /// Which body it is.
    pub which: Option<usize>,
    /// The initial distance of the body from the hand, m.
    pub way: f64,
}

/// The noise of a sensor, independent from sample to sample.
#[derive(Clone, Copy, Debug)]
pub struct Noise {
    /// The sum over the vector's components, squares of the unit.
    pub variance: f64,
}

/// The noise of a body's positions, independent from sample to sample.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PositionNoise {
    /// Standard deviation of a component, m.
    pub deviation: f64,
    /// The largest speed that it makes of a body at rest, m/s; 0 if the log has the velocity, or if no rule is that slow.
    pub limit: f64,
}

impl<'a> CleanLog<'a> {
    /// Takes the columns with canonical names, and those that are `asked` for by name although they are not canonical. The forces named in
    /// `trust` count as they are, however long they stay constant.
    ///
    /// # Errors
    /// When a column is not as long as the time, a vector lacks a component, a flag is not a flag, or the time base is unusable.
    pub fn new(recording: &'a Recording, trust: &[String], asked: impl Fn(&str) -> bool) -> Result<Self, InputError> {
        let time = &recording.time;
        let (mut unknown, mut columns) = (vec![], Columns::new());
        for (name, column) in &recording.columns {
            if column.values.len() != time.len() {
                let message = format!("the column has {} values, the time has {}", column.values.len(), time.len());
                return Err(InputError::new(format!("channel {name}"), message));
            }
            match UnknownColumn::of(name, &recording.scene) {
                Some(unknown_column) if !asked(name) => unknown.push((name.as_str(), unknown_column)),
                _ => {
                    columns.insert(name, (column.dimension, Cow::Borrowed(&column.values)));
                }
            }
        }
        let mut issues = unknown_columns::ignored(recording, &unknown);
        issues.extend(dropouts::impossible(time, &mut columns)?);
        issues.extend(untracked_bodies::unmeasure(time, &mut columns));
        issues.extend(never_measured(time, &mut columns));
        whole_vectors(&columns)?;
        issues.extend(dropouts::bridge(time, &mut columns));
        issues.extend(stuck_sensors::frozen(time, &columns));
        issues.extend(stuck_sensors::silence(time, &mut columns, trust));
        let lost = lost_bodies::interpolate(time, &recording.scene, &mut columns, &mut issues);
        let keep = dropouts::measured_rows(time, &columns, &mut issues);
        let Timebase { rate_hz, rows, stretches } = timebase(time, &keep, &mut issues)?;
        if rows.len() < time.len() {
            for (_, values) in columns.values_mut() {
                *values = Cow::Owned(rows.iter().filter_map(|row| values.get(*row).copied()).collect());
            }
        }
        let unseen = lost_bodies::frames(&lost, &rows);
        let time: Vec<f64> = rows.iter().filter_map(|row| time.get(*row).copied()).collect();
        let held = held_poses::interpolate(&time, rate_hz, &stretches, &mut columns, &mut issues);
        let (scene, noise, levels, span) = (&recording.scene, BTreeMap::new(), BTreeMap::new(), span(&time));
        let (fingertips, positions, window) = (BTreeMap::new(), BTreeMap::new(), None);
        Ok(Self {
            scene,
            time,
            rate_hz,
            stretches,
            unseen,
            issues,
            noise,
            levels,
            fingertips,
            positions,
            held,
            span,
            window,
            columns,
        })
    }

    /// The frames that count.
    pub fn core(&self) -> Range<usize> {
        self.window.as_ref().map_or(0..self.len(), |window| window.core.clone())
    }

    /// Goes through each stretch frame by frame with what was so at the frame before; at the beginning of a stretch nothing is. The key says
    /// what is followed.
    pub fn follow(&self, key: &str, step: impl FnMut(usize, State) -> State) {
        let part = |window: &Window<'a>| {
            let before = window.before.get(key).copied().filter(|_| !window.is_first);
            (window.core.clone(), before.unwrap_or_default(), window.kept, window.after)
        };
        self.follow_part(key, part, step);
    }

    /// Like the above, for quantities that depend on averages.
    pub fn follow_averaged(&self, key: &str, step: impl FnMut(usize, State) -> State) {
        let part = |window: &Window<'a>| {
            let before = window.averaged_before.get(key).copied();
            (window.averaged.clone(), before.unwrap_or_default(), window.averaged_kept, window.averaged_after)
        };
        self.follow_part(key, part, step);
    }

    fn follow_part(
        &self,
        key: &str,
        part: impl Fn(&Window<'a>) -> (Range<usize>, State, usize, &'a RefCell<BTreeMap<String, State>>),
        mut step: impl FnMut(usize, State) -> State,
    ) {
        match &self.window {
            None => {
                for stretch in &self.stretches {
                    stretch.clone().fold(State::default(), |state, frame| step(frame, state));
                }
            }
            Some(window) => {
                let (frames, before, kept, after) = part(window);
                let kept = kept.clamp(frames.start, frames.end);
                let state = (frames.start..kept).fold(before, |state, frame| step(frame, state));
                after.borrow_mut().insert(key.to_string(), state);
                (kept..frames.end).fold(state, |state, frame| step(frame, state));
            }
        }
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

    /// Subtracts the bias of a sensor from a channel of three columns.
    pub fn subtract_rest(&mut self, name: &str, level: &RestLevel) {
        for (axis, component) in ["x", "y", "z"].into_iter().enumerate() {
            if let Some((_, values)) = self.columns.get_mut(format!("{name}.{component}").as_str()) {
                values
                    .to_mut()
                    .iter_mut()
                    .zip(&self.time)
                    .for_each(|(value, time)| *value -= level.rest_at(*time)[axis]);
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
    pub fn over_all(&self, kind: IssueKind, channel: &str, message: String) -> Issue {
        over_all(&self.span, kind, channel, message)
    }

    /// Returns the log as a recording, without true labels.
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

/// Returns start and end of a log, s.
pub fn span(time: &[f64]) -> [f64; 2] {
    [time.first(), time.last()].map(|stamp| stamp.copied().unwrap_or_default())
}

/// An issue over a whole log.
pub fn over_all(time: &[f64], kind: IssueKind, channel: &str, message: String) -> Issue {
    let [start_s, end_s] = span(time);
    Issue { kind, start_s, end_s, channel: channel.into(), message }
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
    never.iter().map(|channel| over_all(time, IssueKind::NOT_A_NUMBER, channel, message.into())).collect()
}

/// Checks that a vector has all its components.
pub fn whole_vectors(columns: &Columns) -> Result<(), InputError> {
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
