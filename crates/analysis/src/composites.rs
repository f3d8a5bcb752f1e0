//! Tasks that are made of tasks: the names of a hand's tasks in, one at a time, the rows of tasks that are one task of theirs out.
//!
//! From the first task on, the first rule whose tasks follow each other here takes them, and matching continues after these tasks. Tasks
//! without a name between two of them belong to it. Each task is decided as early as possible, and a live log has the same composite tasks as a whole one.

use super::{TaskSpan, UNKNOWN};
use std::ops::Range;
use teachtree_language::rules::Rules;

/// The most tasks that are one, those without a name between them included: a longer run (`task+`) is more than one.
const MOST_TASKS: usize = 1000;

/// A task that is made of tasks, in a track.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CompositeSpan {
    /// Its name.
    pub task: String,
    /// Whether the rules declare it as a failure; else it is a success.
    pub failure: bool,
    /// The names of its tasks, in order; `unknown` ones between them are among them.
    pub parts: Vec<String>,
    /// The tasks of the track that it is made of `[start, end)`, counted from 0.
    pub tasks: Range<usize>,
    /// The frames `[start, end)`.
    pub frames: Range<usize>,
    /// The rows of the log `[start, end)`, counted from 0.
    pub rows: Range<usize>,
    /// Start, s.
    pub start_s: f64,
    /// End, s.
    pub end_s: f64,
    /// Whether the beginning of its first task was cut off.
    pub open_start: bool,
    /// Whether the end of its last task was cut off.
    pub open_end: bool,
}

/// The declaration of a composite task.
#[derive(Clone, Debug)]
struct Rule {
    name: String,
    /// The names of its tasks, each with whether it may come several times in a row.
    parts: Vec<(String, bool)>,
    failure: bool,
}

/// Looks for tasks of tasks in the tasks of a hand, which come in order of time.
#[derive(Clone, Debug, Default)]
pub struct Composites {
    rules: Vec<Rule>,
    /// The tasks that are not decided yet; of those before the first one nothing is kept.
    waiting: Vec<TaskSpan>,
    /// Number of tasks before the waiting ones.
    first: usize,
}

/// How far the waiting tasks match a rule.
enum MatchState {
    /// The tasks cannot match.
    Mismatch,
    /// Later tasks may complete the match.
    Partial,
    /// The number of matching tasks, and whether the next task may extend the match.
    Complete(usize, bool),
}

impl Composites {
    /// Looks for what the rules declare.
    pub fn new(rules: &Rules) -> Self {
        let name = |task: teachtree_language::rules::TaskId| {
            rules.tasks.get(task.index()).map_or(String::new(), |task| task.name.clone())
        };
        let composite = |it: &teachtree_language::rules::Composite| Rule {
            name: it.name.clone(),
            parts: it.parts.iter().map(|part| (name(part.task), part.many)).collect(),
            failure: it.failure,
        };
        Self { rules: rules.composites.iter().map(composite).collect(), ..Self::default() }
    }

    /// Takes the next task, and returns what is clear now.
    pub fn push(&mut self, task: &TaskSpan) -> Vec<CompositeSpan> {
        if self.rules.is_empty() {
            return Vec::new();
        }
        // The segments are those of the task.
        self.waiting.push(TaskSpan { segments: Vec::new(), secondary: Vec::new(), ..task.clone() });
        self.decide(false)
    }

    /// Ends the sequence: returns the remaining matches, and begins a new sequence.
    pub fn finish(&mut self) -> Vec<CompositeSpan> {
        self.decide(true)
    }

    fn decide(&mut self, ends: bool) -> Vec<CompositeSpan> {
        let mut found = Vec::new();
        // The number of decided tasks.
        let mut done = 0;
        while let Some(waiting) = self.waiting.get(done..).filter(|waiting| !waiting.is_empty()) {
            let mut taken = 0;
            let mut is_open = false;
            for rule in &self.rules {
                match fit(&rule.parts, waiting) {
                    MatchState::Partial if !ends => is_open = true,
                    MatchState::Complete(_, true) if !ends => is_open = true,
                    MatchState::Complete(count, _) => {
                        taken = count;
                        let tasks = self.first + done..self.first + done + count;
                        found.extend(waiting.get(..count).and_then(|own| span(rule, own, tasks)));
                    }
                    MatchState::Mismatch | MatchState::Partial => continue,
                }
                break;
            }
            if is_open {
                break;
            }
            done += taken.max(1);
        }
        self.waiting.drain(..done.min(self.waiting.len()));
        self.first += done;
        found
    }
}

/// Whether tasks begin with these parts.
fn fit(parts: &[(String, bool)], tasks: &[TaskSpan]) -> MatchState {
    let mut at = 0;
    let is_full = tasks.len() >= MOST_TASKS;
    let tasks = tasks.get(..MOST_TASKS).unwrap_or(tasks);
    // The index of the next named task.
    let named = |from: usize| (from..tasks.len()).find(|at| tasks.get(*at).is_some_and(|task| task.task != UNKNOWN));
    let mut is_open = false;
    for (place, (name, many)) in parts.iter().enumerate() {
        let is_it = |at: usize| tasks.get(at).is_some_and(|task| task.task == *name);
        let next = if place == 0 { Some(0) } else { named(at) };
        let Some(next) = next else { return if is_full { MatchState::Mismatch } else { MatchState::Partial } };
        if !is_it(next) {
            return MatchState::Mismatch;
        }
        at = next + 1;
        is_open = false;
        if !*many {
            continue;
        }
        loop {
            match named(at) {
                Some(next) if is_it(next) => at = next + 1,
                Some(_) => break,
                None => {
                    is_open = !is_full;
                    break;
                }
            }
        }
    }
    MatchState::Complete(at, is_open)
}

fn span(rule: &Rule, own: &[TaskSpan], tasks: Range<usize>) -> Option<CompositeSpan> {
    let (first, last) = (own.first()?, own.last()?);
    Some(CompositeSpan {
        task: rule.name.clone(),
        failure: rule.failure,
        parts: own.iter().map(|task| task.task.clone()).collect(),
        tasks,
        frames: first.frames.start..last.frames.end,
        rows: first.rows.start..last.rows.end,
        start_s: first.start_s,
        end_s: last.end_s,
        open_start: first.open_start,
        open_end: last.open_end,
    })
}

/// Those of a stretch without gaps; `before` tasks of the track came before it.
pub(super) fn of_stretch(rules: &Rules, tasks: &[TaskSpan], before: usize) -> Vec<CompositeSpan> {
    let mut composites = Composites { first: before, ..Composites::new(rules) };
    let mut found: Vec<CompositeSpan> = tasks.iter().flat_map(|task| composites.push(task)).collect();
    found.extend(composites.finish());
    found
}
