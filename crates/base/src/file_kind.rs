//! The kinds of files that commands take. An error about a file that was given in the place of another one names both kinds.

use super::error::InputError;
use super::yaml;
use std::path::Path;

/// A kind of files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileKind {
    /// A recording.
    Log,
    /// Rules.
    Rules,
    /// Bodies and hands.
    Scene,
    /// The script of a simulated operator.
    Operator,
    /// The channels of the columns of a foreign log.
    Binding,
    /// Links, joints and fingers.
    Robot,
    /// The settings of the logs in a folder, [`PROJECT`].
    Project,
}

/// The name of project files.
pub const PROJECT: &str = "teachtree.yaml";

/// Endings of logs that are not read as anything else.
const LOG_ENDINGS: [&str; 12] =
    ["csv", "tsv", "parquet", "mcap", "bag", "db3", "hdf5", "h5", "npz", "zarr", "jsonl", "ndjson"];

impl FileKind {
    /// The kind in words, with its article.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Log => "a log",
            Self::Rules => "a rule file",
            Self::Scene => "a scene",
            Self::Operator => "an operator script",
            Self::Binding => "a binding",
            Self::Robot => "a robot file",
            Self::Project => "a project file",
        }
    }

    /// The kind of a file by its ending, and of a YAML file without one by the keys of its text.
    pub fn of(path: &Path, text: &str) -> Option<Self> {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let named = |kind: &str| [".yaml", ".yml"].iter().any(|ending| name.ends_with(&format!(".{kind}{ending}")));
        let has = |keys: &[&str]| {
            text.lines()
                .any(|line| keys.iter().any(|key| line.strip_prefix(key).is_some_and(|rest| rest.starts_with(':'))))
        };
        let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        match () {
            () if ending == "rules" => Some(Self::Rules),
            () if LOG_ENDINGS.contains(&ending.as_str()) => Some(Self::Log),
            () if !yaml::is_yaml(path) => None,
            () if name == PROJECT => Some(Self::Project),
            () if named("scene") => Some(Self::Scene),
            () if named("binding") => Some(Self::Binding),
            () if named("operator") || has(&["grips"]) => Some(Self::Operator),
            () if named("robot") || has(&["links", "urdf"]) => Some(Self::Robot),
            () if has(&["channels"]) => Some(Self::Binding),
            () if has(&["bodies"]) => Some(Self::Scene),
            () if has(&["parts"]) => Some(Self::Robot),
            () => None,
        }
    }

    /// The error about a file of another kind that was given where this kind is expected; `None` for a file of this kind or of an unknown one.
    pub fn misplaced(self, path: &Path, text: &str) -> Option<InputError> {
        let found = Self::of(path, text).filter(|found| *found != self)?;
        let shown = path.display();
        let message = format!("found {}, expected {}", found.name(), self.name());
        let help = match found {
            Self::Log => format!("`teachtree analyze {shown}` reads it"),
            Self::Rules => format!("name it with `--rules {shown}`, or check it with `teachtree check {shown}`"),
            Self::Scene => format!("name it with `--scene {shown}`"),
            Self::Binding => format!("name it with `--binding {shown}`"),
            Self::Robot => format!("`teachtree simulate` takes it with `--robot {shown}`"),
            Self::Project => {
                format!("commands read it for the logs beside and below it; `teachtree check {shown}` checks it")
            }
            Self::Operator => "`teachtree teach SCENE OPERATOR` takes it as its second argument".to_string(),
        };
        Some(InputError::new(shown.to_string(), message).help(help))
    }
}
