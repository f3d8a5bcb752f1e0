//! Tasks that never name a span, since an earlier one takes every span that has their keys.

use crate::codes;
use crate::formula::shown;
use crate::rules::{Constant, Key, Pattern, Rules, Task};
use std::collections::BTreeSet;
use teachtree_base::diagnostic::Diagnostic;

/// Maximum number of tasks that are examined.
const MAX_TASKS: usize = 1000;

/// Warns of tasks that an earlier one always wins over, when one of the two stands in one of the `named` files.
pub fn hidden_tasks(rules: &Rules, named: &BTreeSet<u32>) -> Vec<Diagnostic> {
    let mut findings = Vec::new();
    for (at, task) in rules.tasks.iter().enumerate().take(MAX_TASKS) {
        let earlier = rules.tasks.iter().take(at).find(|earlier| takes_all(earlier, task));
        let Some(earlier) = earlier else { continue };
        if !named.contains(&task.span.file) && !named.contains(&earlier.span.file) {
            continue;
        }
        findings.push(
            Diagnostic::warning(codes::HIDDEN_TASK, format!("the task `{}` never names anything", task.name))
                .at(task.span, format!("segments with its keys also have those of `{}`", earlier.name))
                .at(earlier.span, "this is tried first, and matches")
                .note(format!("for instance {} is `{}`", span_of(task, rules), earlier.name))
                .help(format!("add `before {}` at its end, or give it a key that `{0}` lacks", earlier.name)),
        );
    }
    findings
}

/// Whether whatever a task names is named by an earlier one. The spans of a joined task depend on its keys: of them nothing is said.
fn takes_all(earlier: &Task, task: &Task) -> bool {
    let same_spans = (&earlier.first, &earlier.last) == (&task.first, &task.last) && !earlier.joined && !task.joined;
    let implied = |wanted: &Key| {
        let mut given = task.keys.iter().map(|key| implies(key, wanted));
        if task.all_keys { given.any(|implied| implied) } else { given.all(|implied| implied) }
    };
    let keys = if earlier.all_keys {
        earlier.keys.iter().all(implied)
    } else if task.all_keys {
        earlier.keys.iter().any(implied)
    } else {
        // Each of its keys may be the one that is found.
        task.keys.iter().all(|key| earlier.keys.iter().any(|wanted| implies(key, wanted)))
    };
    let excluded = |label| task.without.iter().any(|other| other.covers(label));
    same_spans && !task.keys.is_empty() && keys && earlier.without.iter().all(|label| excluded(*label))
}

/// Whether what has one key has the other.
fn implies(key: &Key, other: &Key) -> bool {
    let least = |constant: &Option<Constant>| constant.as_ref().map_or(f64::NEG_INFINITY, |constant| constant.value);
    let at_least = |given: &Option<Constant>, wanted: &Option<Constant>| least(given) >= least(wanted);
    let pieces = at_least(&key.lasting, &other.lasting) && at_least(&key.travelling, &other.travelling);
    // Pieces more may turn back, so for an angle they have to be the same ones.
    let same_pieces = key.label == other.label
        && at_least(&other.lasting, &key.lasting)
        && at_least(&other.travelling, &key.travelling);
    other.label.includes(&key.label)
        && pieces
        && (other.turning.is_none() || same_pieces && at_least(&key.turning, &other.turning))
}

/// The segments of a span that has the keys of a task.
fn span_of(task: &Task, rules: &Rules) -> String {
    let name = |pattern: &Pattern| format!("`{}`", rules.label_name(pattern.label));
    let key = |key: &Key| {
        let demands = [("lasting", &key.lasting), ("travelling", &key.travelling), ("turning", &key.turning)];
        let demand = |(word, value): (&str, &Option<Constant>)| {
            Some(format!(" {word} {}", shown(value.as_ref()?.value, value.as_ref()?.dimension)))
        };
        name(&key.label) + &demands.into_iter().filter_map(demand).collect::<String>()
    };
    let keys = task.keys.iter().take(if task.all_keys { task.keys.len() } else { 1 }).map(key);
    let all: Vec<String> = [name(&task.first)].into_iter().chain(keys).chain([name(&task.last)]).collect();
    all.join(", ")
}
