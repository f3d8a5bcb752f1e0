//! The tasks that a recording should contain, in order: `peg_in_hole x 2, turn_screw`.

use std::fmt;
use teachtree_base::spelling::nearest;
use teachtree_language::rules::Rules;

/// The most tasks that are expected of a recording.
const MOST: usize = 100;

/// The tasks that a recording should contain, in order, each with how often in a row. The recording may contain others between them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ExpectedTasks(Vec<ExpectedTask>);

/// A task and how often it is expected.
#[derive(Clone, Debug, PartialEq, Eq)]
struct ExpectedTask {
    name: String,
    times: usize,
}

/// A task that is missing in a recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct MissingTask {
    /// Its name.
    pub name: String,
    /// In words.
    pub message: String,
}

impl ExpectedTasks {
    /// Reads `peg_in_hole x 2, turn_screw`.
    ///
    /// # Errors
    /// An empty name, a name with other characters than letters, digits and `_`, a number that is missing or 0, or more than 100 tasks.
    pub fn parse(text: &str) -> Result<Self, String> {
        let tasks = text.split(',').map(|part| ExpectedTask::parse(part.trim())).collect::<Result<Vec<_>, _>>()?;
        let count = tasks.iter().fold(0_usize, |count, task| count.saturating_add(task.times));
        if count > MOST {
            return Err(format!("found {count} tasks, expected at most {MOST}"));
        }
        Ok(Self(tasks))
    }

    /// Checks that the rules have these tasks, and that none of them is a failure.
    ///
    /// # Errors
    /// The first task that the rules do not have, with the nearest one, or that is a failure.
    pub fn check(&self, rules: &Rules) -> Result<(), String> {
        let tasks = rules.tasks.iter().map(|task| (task.name.as_str(), task.failure));
        let known: Vec<(&str, bool)> =
            tasks.chain(rules.composites.iter().map(|task| (task.name.as_str(), task.failure))).collect();
        for ExpectedTask { name, .. } in &self.0 {
            match known.iter().find(|(known, _)| known == name) {
                Some((_, false)) => {}
                Some((_, true)) => return Err(format!("`{name}` is a failure, expected tasks that succeed")),
                None => {
                    let successes: Vec<&str> =
                        known.iter().filter(|(_, failure)| !failure).map(|(it, _)| *it).collect();
                    return Err(match nearest(name, successes.iter().copied()) {
                        Some(near) => format!("the rules have no task `{name}`; did you mean `{near}`?"),
                        None => format!("the rules have no task `{name}`; their tasks are {}", successes.join(", ")),
                    });
                }
            }
        }
        Ok(())
    }

    /// Whether nothing is expected.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The tasks that are missing among these names, which are in order of time: those outside of a longest common subsequence.
    pub(super) fn missing(&self, found: &[&str]) -> Vec<MissingTask> {
        let expected: Vec<usize> =
            self.0.iter().enumerate().flat_map(|(at, task)| std::iter::repeat_n(at, task.times)).collect();
        let is_same = |at: usize, name: &str| self.0.get(at).is_some_and(|task| task.name == name);
        let matched = matched(&expected, found, &is_same);
        let missing = |(at, task): (usize, &ExpectedTask)| {
            let has = matched.iter().filter(|other| **other == at).count();
            (has < task.times).then(|| MissingTask { name: task.name.clone(), message: self.message(task, found) })
        };
        self.0.iter().enumerate().filter_map(missing).collect()
    }

    fn message(&self, task: &ExpectedTask, found: &[&str]) -> String {
        let all = found.iter().filter(|name| **name == task.name).count();
        let wanted: usize = self.0.iter().filter(|other| other.name == task.name).map(|other| other.times).sum();
        match all {
            0 => format!("expected {task}, found none"),
            all if all >= wanted => format!("expected {task} in the order `{self}`, found it in another order"),
            all => {
                let all_of_them = ExpectedTask { name: task.name.clone(), times: wanted };
                format!("expected {all_of_them}, found {all}")
            }
        }
    }
}

/// The expected tasks of a longest common subsequence, by their places.
fn matched(expected: &[usize], found: &[&str], is_same: &dyn Fn(usize, &str) -> bool) -> Vec<usize> {
    let width = found.len() + 1;
    // The length of the longest common subsequence of what begins at each pair of places.
    let mut lengths = vec![0_usize; (expected.len() + 1) * width];
    let get = |lengths: &[usize], row: usize, column: usize| lengths.get(row * width + column).copied().unwrap_or(0);
    for (row, at) in expected.iter().enumerate().rev() {
        for (column, name) in found.iter().enumerate().rev() {
            let length = if is_same(*at, name) {
                get(&lengths, row + 1, column + 1) + 1
            } else {
                get(&lengths, row + 1, column).max(get(&lengths, row, column + 1))
            };
            lengths.get_mut(row * width + column).into_iter().for_each(|place| *place = length);
        }
    }
    let (mut row, mut column, mut matched) = (0, 0, Vec::new());
    while let (Some(at), Some(name)) = (expected.get(row), found.get(column)) {
        if is_same(*at, name) {
            matched.push(*at);
            (row, column) = (row + 1, column + 1);
        } else if get(&lengths, row + 1, column) >= get(&lengths, row, column + 1) {
            row += 1;
        } else {
            column += 1;
        }
    }
    matched
}

impl ExpectedTask {
    fn parse(text: &str) -> Result<Self, String> {
        let example = "expected tasks with their numbers, such as `peg_in_hole x 2, turn_screw`";
        let is_name =
            |name: &str| !name.is_empty() && name.chars().all(|letter| letter.is_alphanumeric() || letter == '_');
        let (name, times) = match text.split_once(|letter: char| letter.is_whitespace()) {
            None => (text, 1),
            Some((name, rest)) => {
                let count = rest.trim().strip_prefix(['x', '×']).and_then(|count| count.trim().parse().ok());
                let count = count.filter(|count| *count > 0);
                (name, count.ok_or_else(|| format!("found `{text}`, {example}"))?)
            }
        };
        if !is_name(name) {
            return Err(format!("found `{text}`, {example}"));
        }
        Ok(Self { name: name.into(), times })
    }
}

/// As it is read.
impl fmt::Display for ExpectedTasks {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (at, task) in self.0.iter().enumerate() {
            let comma = if at == 0 { "" } else { ", " };
            write!(f, "{comma}{task}")?;
        }
        Ok(())
    }
}

impl fmt::Display for ExpectedTask {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.times {
            1 => f.write_str(&self.name),
            times => write!(f, "{} x {times}", self.name),
        }
    }
}
