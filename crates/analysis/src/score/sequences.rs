//! The sequences of primitives that tasks should have, instead of what their truth is in each recording:
//! `pick_and_place: Move Approach Grasp Translate Place Release`.

use super::name_map::KnownNames;
use super::tally::Tally;
use indexmap::IndexMap;
use serde::Deserialize;
use teachtree_base::error::InputError;
use teachtree_base::yaml;

/// Sequences by task; each of several alternatives is right.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Sequences {
    tasks: IndexMap<String, Vec<Vec<String>>>,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a line of primitives or a list of such lines")]
enum Lines {
    One(String),
    Several(Vec<String>),
}

impl Sequences {
    /// Reads sequences from YAML: for each task a line of primitives, or a list of such lines. `file` is its name in errors.
    ///
    /// # Errors
    /// Text other than such a map, and names that the rules do not have.
    pub fn read(text: &str, file: &str, known: &KnownNames) -> Result<Self, InputError> {
        let lines: IndexMap<String, Lines> = yaml::read(text, file).map_err(|error| {
            let line = "pick_and_place: Move Approach Grasp Translate Place Release";
            error.help(format!("expected lines such as `{line}`; several sequences of one task are a list"))
        })?;
        let mut tasks = IndexMap::new();
        for (task, lines) in lines {
            let lines = match lines {
                Lines::One(line) => vec![line],
                Lines::Several(lines) => lines,
            };
            let sequences: Vec<Vec<String>> =
                lines.iter().map(|line| line.split_whitespace().map(str::to_string).collect()).collect();
            if !known.tasks.contains(&task) {
                let message = format!("`{task}` is not a task of the rules");
                return Err(known.advise(InputError::new(file, message), &task));
            }
            if let Some(name) = sequences.iter().flatten().find(|name| !known.primitives.contains(name)) {
                let message = format!("`{name}` in the sequence of `{task}` is not a primitive of the rules");
                return Err(known.advise(InputError::new(file, message), name));
            }
            if sequences.is_empty() || sequences.iter().any(Vec::is_empty) {
                return Err(InputError::new(file, format!("the sequence of `{task}` is empty")));
            }
            tasks.insert(task, sequences);
        }
        Ok(Self { tasks })
    }

    /// Makes them the true sequences of the tasks that they name: of several the one that was found, else the first.
    pub fn expect(&self, tally: &mut Tally) {
        for pair in tally.tasks.iter_mut().flatten() {
            let Some(alternatives) = self.tasks.get(&pair.truth) else { continue };
            let right = alternatives.iter().find(|sequence| **sequence == pair.sequence).or(alternatives.first());
            pair.true_sequence = right.cloned().unwrap_or_default();
        }
    }
}
