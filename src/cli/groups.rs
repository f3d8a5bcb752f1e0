//! Groups of recordings by their names: recordings of one person, tool or day are held out together.

use regex_lite::Regex;
use std::collections::BTreeSet;
use std::path::PathBuf;
use teachtree_base::error::InputError;
use teachtree_logs::read::formats::stem;

/// The groups of recordings.
pub struct Groups {
    /// In the order in which they first occur.
    pub names: Vec<String>,
    /// The position of the group of each recording.
    pub of_logs: Vec<usize>,
    /// Where they come from, for people.
    pub origin: &'static str,
}

impl Groups {
    /// The groups of a pattern; without one, of the names up to their last `_` or `-` where that makes fewer groups than recordings, else each recording.
    ///
    /// # Errors
    /// A pattern that is not a regular expression, or that a name does not match.
    pub fn new(logs: &[PathBuf], pattern: Option<&str>) -> Result<Self, InputError> {
        let stems: Vec<String> = logs.iter().map(|log| stem(log)).collect();
        if let Some(pattern) = pattern {
            let wrong = |message: String| InputError::new("--group-by", message);
            let regex = Regex::new(pattern)
                .map_err(|error| wrong(format!("found `{pattern}`, expected a regular expression: {error}")))?;
            let group = |stem: &String| {
                let found = regex.captures(stem).and_then(|found| found.get(1).or(found.get(0)));
                found.map(|found| found.as_str().to_string()).ok_or_else(|| {
                    wrong(format!("`{pattern}` does not match `{stem}`")).help(
                        "the pattern is searched in the name of each recording, without its folder and its ending",
                    )
                })
            };
            let names = stems.iter().map(group).collect::<Result<_, _>>()?;
            return Ok(Self::of(names, "by --group-by"));
        }
        let prefix =
            |stem: &String| stem.rsplit_once(['_', '-']).map_or(stem.clone(), |(prefix, _)| prefix.to_string());
        let prefixes: Vec<String> = stems.iter().map(prefix).collect();
        let count = prefixes.iter().collect::<BTreeSet<_>>().len();
        if (2..logs.len()).contains(&count) {
            Ok(Self::of(prefixes, "by the beginnings of names; --group-by names others"))
        } else {
            Ok(Self::of(
                logs.iter().map(|log| log.display().to_string()).collect(),
                "each recording; --group-by names others",
            ))
        }
    }

    fn of(of_logs: Vec<String>, origin: &'static str) -> Self {
        let mut names: Vec<String> = Vec::new();
        let position = |name: String| {
            names.iter().position(|known| *known == name).unwrap_or_else(|| {
                names.push(name);
                names.len() - 1
            })
        };
        let of_logs = of_logs.into_iter().map(position).collect();
        Self { names, of_logs, origin }
    }
}
