//! Bindings: a YAML file that says which columns of a foreign log are which channels (docs/bindings.md).

mod apply;
pub mod arm_models;
pub mod assumed_log;
mod body_poses;
mod check;
mod element_places;
mod fixture_localization;
mod frame_composition;
mod frame_tree;
mod header;
mod join;
mod joint_columns;
mod lerobot_motors;
mod linear;
mod live_frames;
mod live_limits;
mod normals;
mod offsets;
mod pads;
mod pattern;
mod resample;
mod resampler;
mod robots;
mod rotations;
mod rows;
mod sampled_transform;
mod sensor_vectors;
mod sensors;
mod sentinels;
mod shifter;
mod sources;
mod stamp_merger;
mod start_trimmer;
mod tare;
mod tool;
mod topic_filter;
mod turning_weight;

pub use apply::{bind, check_channels};
pub use linear::LinearForm;
pub use rows::{BoundRows, RowBinder, WAIT_S};
pub use stamp_merger::{LiveLine, StampMerger};
pub use topic_filter::TopicFilter;

use pads::Pads;
pub use pattern::{Columns, LinkPoint, OffsetPoint, Pattern, PlaceholderValues, PointDistance, Template, Threshold};
use robots::{BoundRobot, Robot};

use indexmap::IndexMap;
use serde::{Deserialize, Deserializer, de};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::Path;
use teachtree_base::channels::Shape;
use teachtree_base::error::InputError;
use teachtree_base::field_names::FieldNames;
use teachtree_base::file_kind::FileKind;
use teachtree_base::log_channel::LogChannel;
use teachtree_base::quantity::{Force, Frequency, Mass, Time, above_zero};
use teachtree_base::scene::Scene;
use teachtree_base::short_number::ShortNumber;
use teachtree_base::units::Dimension;
use teachtree_base::yaml;
use teachtree_description::tree::KinematicTree;
use teachtree_logs::read::csv::{StampSource, check_scene};
use teachtree_logs::read::text;

/// The most rule parameters that a binding may override.
pub const MAX_PARAMS: usize = 3;
/// The highest rate to resample to, Hz.
pub const MAX_RATE_HZ: f64 = 10_000.0;
/// Stands in a binding where the name of a column is to be filled in.
pub const BLANK: &str = "???";

/// A binding: which columns of a foreign log are which channels.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Binding {
    /// A description of the log for readers of the file.
    #[serde(default)]
    #[allow(dead_code, reason = "the key is for readers of the file")]
    about: String,
    /// The file of the rules that implements the trees' abstract signals for this hardware.
    #[serde(default)]
    pub hand_file: Option<String>,
    /// Rule parameters that this hardware needs otherwise, each a value with its unit.
    #[serde(default, deserialize_with = "few_params")]
    #[schemars(with = "IndexMap<String, Param>")]
    pub params: IndexMap<String, String>,
    /// The column of the time stamps.
    #[serde(default = "time_column")]
    pub time: Pattern,
    /// The rate of rows that have no stamps; there is then no column of time.
    #[serde(default)]
    pub rate: Option<Frequency>,
    /// What is added to every stamp.
    #[serde(default)]
    pub time_offset: Time,
    /// The even rate to which the log is resampled; by default the log is not resampled.
    #[serde(default)]
    pub resample: Option<Frequency>,
    /// The longest step, and the longest drop-out of a pose, that resampling bridges.
    #[serde(default = "bridge")]
    pub bridge: Time,
    /// The frame of the log's transforms in which poses are expressed; by default their nearest common ancestor.
    #[serde(default)]
    pub frame: Option<String>,
    /// The columns of each channel; by default the columns have canonical names.
    #[serde(default)]
    pub channels: IndexMap<String, Columns>,
    /// Where contacts without a logged normal get it from.
    #[serde(default)]
    pub normals: Normals,
    /// What is to be corrected of sensors, by channel without component, such as `right.palm.force`.
    #[serde(default)]
    pub sensors: IndexMap<String, Sensor>,
    /// An interval in which some channels should read zero.
    #[serde(default)]
    pub tare: Option<Tare>,
    /// Robots whose joints the log has, by name; channels name their links: `{link: arm.hand}`.
    #[serde(default)]
    pub robots: IndexMap<String, Robot>,
    /// The pads of the grippers whose tool point, rotation and opening are bound.
    #[serde(default)]
    pub pads: Option<Pads>,
    /// Bodies whose place the log shows, by name; their `position` in the scene counts from there.
    #[serde(default)]
    pub places: IndexMap<String, Place>,
    /// Forces that count as they are, although they stay constant.
    #[serde(default)]
    pub trust: Vec<String>,
    /// The tasks that a recording should contain, in order: `peg_in_hole x 2, turn_screw`.
    #[serde(default)]
    pub expect: Option<String>,
    /// Signals by which parts of a demonstration end, with when they rise: `start of Grasp of cube`.
    #[serde(default)]
    pub signals: IndexMap<String, String>,
    /// Signals by which parts begin.
    #[serde(default)]
    pub start_signals: IndexMap<String, String>,
    /// The bodies and hands; by default the scene file beside the log.
    #[serde(default)]
    pub scene: Option<Scene>,
}

/// The schema of bindings.
pub fn schema() -> schemars::Schema {
    schemars::schema_for!(Binding)
}

/// The value of a param: a text with its unit, or a number.
#[derive(schemars::JsonSchema)]
#[schemars(untagged)]
#[allow(dead_code, missing_docs, reason = "it is only described")]
pub enum Param {
    Text(String),
    Number(f64),
}

/// Where contacts without a logged normal get it from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Normals {
    /// The direction of the force.
    #[default]
    ByForce,
    /// Upwards from a support, level from a wall, out of the face of a body whose shape is known, along the force otherwise.
    ByRole,
}

/// What is to be corrected of a sensor.
#[derive(Clone, Debug, Default, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Sensor {
    /// What is added to its stamps: negative when it reports late.
    pub time_offset: Time,
    /// The channel of the rotation reference_from_frame of what it is fixed to, such as `right.palm.rotation`.
    pub frame: Option<String>,
    /// How it is fixed there: the rotation frame_from_sensor (reference_from_sensor without `frame`), quaternion w x y z.
    pub mounted: Option<[f64; 4]>,
    /// The tool that it bears, whose weight is taken off.
    pub tool: Option<ToolMass>,
}

/// What a tool between a sensor and what is touched weighs.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(untagged, expecting = "a mass such as `430 g`, or `learned`")]
pub enum ToolMass {
    /// Fitted to the log, with the bias of the sensor.
    Learned(LearnedKeyword),
    /// Known.
    Known(Mass),
}

/// The word `learned`.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Learned")]
pub enum LearnedKeyword {
    /// From the log.
    Learned,
}

/// An interval in which some channels should read zero: their mean in it is subtracted everywhere.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Tare {
    /// Channels without component, such as `right.thumb.force`.
    pub channels: Vec<String>,
    /// Start, as the log counts time.
    pub from: Time,
    /// End.
    pub to: Time,
}

/// How a log shows where a body stands: by the plug point of an object at an instant.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Place {
    /// The object.
    pub by: String,
    /// The instant.
    pub when: Instant,
    /// Of a first contact, the force from which on there is one, where no contact of the two bodies is logged as a flag.
    #[serde(default, deserialize_with = "above_zero")]
    pub above: Option<Force>,
}

/// An instant at which an object shows where another body stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Instant {
    /// The beginning of the first contact that lasts.
    FirstContact,
    /// The last rest of the object, elsewhere than it began.
    Rest,
}

/// A binding with its file, for messages about what it says.
#[derive(Clone, Debug)]
pub struct BindingFile {
    /// What the file says.
    pub binding: Binding,
    name: String,
    text: String,
    /// How it spells the channels; `binding` has the names inside the program.
    spelling: FieldNames,
    /// The links and joints of its robots.
    trees: IndexMap<String, BoundRobot>,
}

impl Binding {
    /// The column that has the stamps of a log with canonical names.
    fn stamp_column(&self) -> StampSource {
        StampSource::Column {
            name: self.time.name.fill(PlaceholderValues::default()),
            unit: self.time.unit.clone(),
            scale: self.time.linear.as_ref().map_or(1.0, |form| form.scale),
        }
    }

    /// Whether its stamps are those that the log has by itself, not those of another column.
    pub fn has_stamps_of_log(&self) -> bool {
        self.rate.is_none() && self.time == time_column()
    }
}

impl BindingFile {
    /// Reads a binding file.
    ///
    /// # Errors
    /// What it says that a binding cannot say, at `file:line:column`.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        let name = path.display().to_string();
        text::parsed(path, yaml::MAX_BYTES as u64, FileKind::Binding, |text| Self::parse(text, name))
    }

    /// Reads the text of a binding file; `name` is its name in messages.
    ///
    /// # Errors
    /// What it says that a binding cannot say, at `file:line:column`.
    pub fn parse(text: String, name: String) -> Result<Self, InputError> {
        let binding: Binding = yaml::read(&text, &name).map_err(|error| {
            let bracket = error.message.ends_with("expected `,` or `]`");
            if bracket {
                error.help("within a list, write a column with its unit in quotes: `[\"a [mm]\", \"b [mm]\"]`")
            } else {
                error
            }
        })?;
        let mut file = Self { binding, name, text, spelling: FieldNames::default(), trees: IndexMap::new() };
        file.rename_channels()?;
        for (key, rate) in [("resample", file.binding.resample), ("rate", file.binding.rate)] {
            let rate = rate.map_or(1.0, |rate| rate.0);
            if !(rate > 0.0 && rate <= MAX_RATE_HZ) {
                let message =
                    format!("found {} Hz, expected a rate above 0 and up to {MAX_RATE_HZ} Hz", ShortNumber(rate));
                return Err(file.error(key, message));
            }
        }
        if file.binding.rate.is_some() && file.binding.time != time_column() {
            let message = "is for rows without stamps, and `time` names a column of stamps: expected one of the two";
            return Err(file.error("rate", message.into()));
        }
        match &file.binding.time.linear {
            Some(form) if form.offset != 0.0 => {
                return Err(file.error("time", "has an offset, expected it as `time_offset: 5 s`".into()));
            }
            Some(form) if form.scale < 0.0 => {
                return Err(file.error("time", "has a negative scale: time would run backward".into()));
            }
            _ => {}
        }
        if file.binding.bridge.0 < 0.0 {
            return Err(file.error("bridge", "found a negative time".into()));
        }
        if let Some(scene) = &file.binding.scene {
            check_scene(scene).map_err(|error| {
                let place = format!("scene.{}", error.place);
                yaml::located(InputError { place, ..error }, &file.text, &file.name)
            })?;
        }
        robots::resolve(&mut file)?;
        Ok(file)
    }

    /// Gives the channels the names inside the program.
    ///
    /// # Errors
    /// A channel is bound under both of its names.
    fn rename_channels(&mut self) -> Result<(), InputError> {
        let (mut channels, mut spelling) = (IndexMap::new(), FieldNames::default());
        for (key, columns) in std::mem::take(&mut self.binding.channels) {
            if let Some((first, _)) = channels.insert(spelling.take(&key), (key.clone(), columns)) {
                let message = format!("`{first}` and `{key}` are one channel, expected one of the two");
                return Err(self.error(&key, message));
            }
        }
        let Binding { sensors, tare, trust, .. } = &mut self.binding;
        *sensors = std::mem::take(sensors)
            .into_iter()
            .map(|(channel, sensor)| {
                let frame = sensor.frame.map(|frame| spelling.take(&frame));
                (spelling.take(&channel), Sensor { frame, ..sensor })
            })
            .collect();
        for channel in tare.iter_mut().flat_map(|tare| &mut tare.channels).chain(trust) {
            *channel = spelling.take(channel);
        }
        self.binding.channels = channels.into_iter().map(|(name, (_, columns))| (name, columns)).collect();
        self.spelling = spelling;
        Ok(())
    }

    /// How it spells the channels.
    pub fn spelling(&self) -> &FieldNames {
        &self.spelling
    }

    /// Its robots with their links and joints.
    pub fn robots(&self) -> impl Iterator<Item = (&String, &KinematicTree)> {
        self.trees.iter().map(|(name, robot)| (name, &robot.tree))
    }

    /// The columns of the joints of its robots: robot, joint, columns.
    fn joints(&self) -> impl Iterator<Item = (&str, &str, &Columns)> {
        self.trees.iter().flat_map(|(robot, bound)| {
            bound.joints.iter().map(|(joint, columns)| (robot.as_str(), joint.as_str(), columns))
        })
    }

    /// The dimension of a joint of a robot.
    fn dimension_of_joint(&self, robot: &str, joint: &str) -> Dimension {
        self.trees.get(robot).map_or(Dimension::ANGLE, |bound| robots::dimension(&bound.tree, joint))
    }

    /// The columns of its flags, as written and with the opposite comparison, by channel.
    pub fn turned_flags(&self) -> BTreeMap<String, [String; 2]> {
        let is_flag = |key: &str| LogChannel::parse(key).is_some_and(|channel| channel.shape() == Shape::Bool);
        let flags = self.binding.channels.iter().filter_map(|(key, columns)| match columns {
            Columns::Pattern(pattern) if is_flag(key) => {
                Some((key.clone(), [pattern.written.clone(), pattern.turned()?]))
            }
            _ => None,
        });
        flags.collect()
    }

    /// The flags that it sets to a constant, by channel.
    pub fn constant_flags(&self) -> BTreeSet<String> {
        let is_flag = |key: &str| LogChannel::parse(key).is_some_and(|channel| channel.shape() == Shape::Bool);
        let is_constant = |columns: &Columns| matches!(columns, Columns::Pattern(it) if it.constant.is_some());
        let flags = self.binding.channels.iter().filter(|(key, columns)| is_flag(key) && is_constant(columns));
        flags.map(|(key, _)| key.clone()).collect()
    }

    /// The places `file:line:column` of the params that it sets, by name.
    pub fn param_places(&self) -> BTreeMap<String, String> {
        self.binding.params.keys().map(|name| (name.clone(), self.place(&["params", name]))).collect()
    }

    /// The place `file:line:column` of the value at a path of keys.
    pub fn place(&self, keys: &[&str]) -> String {
        yaml::place(&self.text, &self.name, keys)
    }

    /// An error about a key: the place is where the key first stands.
    pub fn error(&self, key: &str, message: String) -> InputError {
        let (key, message) = (&*self.spelling.shown(key), self.spelling.shown(&message).into_owned());
        let at = self.text.lines().enumerate().find_map(|(line, text)| {
            let column = text.find(key)?;
            let head = text.get(..column)?.trim_end_matches(['"', '\'']);
            let tail = text.get(column + key.len()..)?.trim_start_matches(['"', '\'']);
            let begins = head.is_empty() || head.ends_with([' ', '{', ',', '-']);
            (begins && tail.trim_start().starts_with(':'))
                .then_some((line + 1, text.get(..column)?.chars().count() + 1))
        });
        let place = at.map_or(self.name.clone(), |(line, column)| format!("{}:{line}:{column}", self.name));
        InputError::new(place, message)
    }
}

fn time_column() -> Pattern {
    Pattern::of(Template::text("time"))
}

const fn bridge() -> Time {
    teachtree_base::quantity::Quantity(0.1)
}

/// Reads parameter overrides, numbers or texts, at most [`MAX_PARAMS`].
///
/// # Errors
/// More of them, or other values.
pub fn few_params<'de, D: Deserializer<'de>>(deserializer: D) -> Result<IndexMap<String, String>, D::Error> {
    /// A value as its text.
    struct Value(String);
    impl<'de> Deserialize<'de> for Value {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            struct Visitor;
            impl de::Visitor<'_> for Visitor {
                type Value = Value;
                fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                    f.write_str("a value with its unit, such as `15 mm/s`")
                }
                fn visit_str<E: de::Error>(self, text: &str) -> Result<Value, E> {
                    Ok(Value(text.to_string()))
                }
                fn visit_u64<E: de::Error>(self, number: u64) -> Result<Value, E> {
                    Ok(Value(number.to_string()))
                }
                fn visit_i64<E: de::Error>(self, number: i64) -> Result<Value, E> {
                    Ok(Value(number.to_string()))
                }
                fn visit_f64<E: de::Error>(self, number: f64) -> Result<Value, E> {
                    Ok(Value(number.to_string()))
                }
            }
            deserializer.deserialize_any(Visitor)
        }
    }
    struct ParamsVisitor;
    impl<'de> de::Visitor<'de> for ParamsVisitor {
        type Value = IndexMap<String, String>;
        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("parameters with their values")
        }
        fn visit_map<A: de::MapAccess<'de>>(self, mut entries: A) -> Result<Self::Value, A::Error> {
            let mut params = IndexMap::new();
            while let Some((name, Value(value))) = entries.next_entry()? {
                if params.len() == MAX_PARAMS {
                    let message = format!(
                        "`{name}` is one parameter too many, expected at most {MAX_PARAMS}: write more into `params` of another entry in teachtree.yaml, or use `--set`"
                    );
                    return Err(de::Error::custom(message));
                }
                params.insert(name, value);
            }
            Ok(params)
        }
    }
    deserializer.deserialize_map(ParamsVisitor)
}
