//! Maps foreign names to ours: `S1: [Move, Approach]`, `S2: Grasp`, `S9: mask` (docs/score.md).

use indexmap::IndexMap;
use serde::Deserialize;
use teachtree_base::error::InputError;
use teachtree_base::spelling::nearest;
use teachtree_base::yaml;
use teachtree_language::rules::{Label, Rules, Task};

/// The target of names whose time is not scored.
pub const MASK: &str = "mask";
/// The name of a time without coordination.
pub const SEPARATE: &str = "separate";

/// A map of names. A name that is not in the map does not change.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NameMap {
    /// The alternatives of each foreign name; none for one that is not scored.
    entries: IndexMap<String, Vec<String>>,
}

/// A name in YAML, where `1` is a number.
#[derive(PartialEq, Eq, Hash, Deserialize)]
#[serde(untagged, expecting = "expected a name")]
enum Name {
    Text(String),
    Number(i64),
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a name or a list of names")]
enum Names {
    One(String),
    Several(Vec<String>),
}

impl NameMap {
    /// Reads a map from YAML; `file` is its name in errors.
    ///
    /// # Errors
    /// Text other than a map from names to names.
    pub fn read(text: &str, file: &str) -> Result<Self, InputError> {
        let map: IndexMap<Name, Names> = yaml::read(text, file).map_err(|error| {
            error.help("a map has lines such as `S1: [Move, Approach]`, `S2: Grasp` and `S9: mask`")
        })?;
        let mut entries = IndexMap::new();
        for (foreign, ours) in map {
            let foreign = match foreign {
                Name::Text(text) => text,
                Name::Number(number) => number.to_string(),
            };
            let ours = match ours {
                Names::One(name) => vec![name],
                Names::Several(names) => names,
            };
            insert(&mut entries, foreign, ours).map_err(|message| InputError::new(file, message))?;
        }
        Ok(Self { entries })
    }

    /// Reads a map from pairs such as `S1=Move|Approach,S2=Grasp,S9=mask`.
    ///
    /// # Errors
    /// Text other than a pair.
    pub fn of_pairs(text: &str) -> Result<Self, InputError> {
        let mut entries = IndexMap::new();
        for pair in text.split(',') {
            let (foreign, ours) = pair.split_once('=').ok_or_else(|| {
                InputError::new("--map", format!("found `{pair}`, expected FOREIGN=OURS"))
                    .help("separate pairs by commas and alternatives by bars: `S1=Move|Approach,S9=mask`")
            })?;
            let ours = ours.split('|').map(|name| name.trim().to_string()).collect();
            insert(&mut entries, foreign.trim().to_string(), ours)
                .map_err(|message| InputError::new("--map", message))?;
        }
        Ok(Self { entries })
    }

    /// Checks that every name of ours is one of the rules.
    ///
    /// # Errors
    /// The first that is not, with the nearest that is.
    pub fn check(&self, known: &KnownNames, place: &str) -> Result<(), InputError> {
        let ours = self.entries.iter().flat_map(|(foreign, ours)| ours.iter().map(move |name| (foreign, name)));
        for (foreign, name) in ours {
            if !known.primitives.contains(name) && !known.tasks.contains(name) {
                let message =
                    format!("`{foreign}` is mapped to `{name}`, which is neither a primitive nor a task of the rules");
                return Err(known.advise(InputError::new(place, message), name));
            }
        }
        Ok(())
    }

    /// Our alternatives for a name; `None` for one that is not in the map.
    pub fn get(&self, foreign: &str) -> Option<&[String]> {
        self.entries.get(foreign).map(Vec::as_slice)
    }
}

fn insert(entries: &mut IndexMap<String, Vec<String>>, foreign: String, mut ours: Vec<String>) -> Result<(), String> {
    if foreign.is_empty() || ours.is_empty() || ours.iter().any(String::is_empty) {
        return Err(format!("`{foreign}` is mapped to an empty name; `{MASK}` leaves its time out"));
    }
    if ours.iter().any(|name| name == MASK) {
        if ours.len() > 1 {
            return Err(format!("`{foreign}` is mapped to `{MASK}` and to other names"));
        }
        ours.clear();
    }
    match entries.insert(foreign.clone(), ours) {
        Some(_) => Err(format!("`{foreign}` is mapped twice")),
        None => Ok(()),
    }
}

/// The names that a result can have.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct KnownNames {
    /// Primitives as they are shown: `Grasp`, `MainGrasp(left)`.
    pub primitives: Vec<String>,
    /// Tasks.
    pub tasks: Vec<String>,
    /// The parts of each of them, in their order.
    pub parts: Vec<TaskParts>,
}

/// The primitives of a task that show where it ends.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TaskParts {
    /// Those that close it.
    pub last: Vec<String>,
    /// Those of which it has one, or all.
    pub keys: Vec<String>,
    /// Whether a new touch continues the same task.
    pub joined: bool,
}

impl KnownNames {
    /// The names of a rule set.
    pub fn new(rules: &Rules) -> Self {
        let primitives = rules.primitives.iter().flat_map(|primitive| match primitive.sided {
            true => ["left", "right"].map(|side| format!("{}({side})", primitive.name)).to_vec(),
            false => vec![primitive.name.clone()],
        });
        let covered = |of: &dyn Fn(Label) -> bool| -> Vec<String> {
            rules.labels().filter(|label| of(*label)).map(|label| rules.label_name(label)).collect()
        };
        let parts = |task: &Task| TaskParts {
            last: covered(&|label| task.last.covers(label)),
            keys: covered(&|label| task.keys.iter().any(|key| key.label.covers(label))),
            joined: task.joined,
        };
        Self {
            primitives: primitives.chain([SEPARATE.to_string()]).collect(),
            tasks: rules.tasks.iter().map(|task| task.name.clone()).collect(),
            parts: rules.tasks.iter().map(parts).collect(),
        }
    }

    /// The error with the nearest known name, else with all of them.
    pub fn advise(&self, error: InputError, name: &str) -> InputError {
        let names: Vec<&str> = self.primitives.iter().chain(&self.tasks).map(String::as_str).collect();
        match nearest(name, names.iter().copied()) {
            Some(near) => error.help(format!("did you mean `{near}`?")),
            None => error.help(format!("expected one of {}", names.join(", "))),
        }
    }
}
