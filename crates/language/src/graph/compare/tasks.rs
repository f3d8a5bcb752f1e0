//! Compares the tasks of two rule sets: their conditions, their order, their first and last primitives, and the tasks that are composed of them.

use super::labels::{CommonLabels, Names};
use super::{Finding, moved};
use crate::rules::{Composite, Constant, Pattern, Rules, Task};

/// Returns the tasks that may change the analysis of a recording without new primitives.
pub fn acts(base: &Rules, extended: &CommonLabels) -> Vec<Finding> {
    let rules = extended.rules;
    let all = CommonLabels::all(base);
    let place = |task: &Task| rules.sources.place(task.span);
    let mut findings = Vec::new();
    for task in &base.tasks {
        let name = &task.name;
        match rules.tasks.iter().find(|other| other.name == *name) {
            None => {
                let place = base.sources.place(task.span);
                findings.push(Finding { what: format!("the task `{name}` is gone"), place });
            }
            Some(other) if asks(task, &all) != asks(other, extended) => {
                findings.push(Finding { what: format!("the task `{name}` has other keys"), place: place(other) });
            }
            Some(other) if task.failure != other.failure => {
                findings.push(Finding { what: outcome(name, other.failure), place: place(other) });
            }
            Some(_) => {}
        }
    }
    for name in moved(&names(base), &names(rules)) {
        let at = rules.tasks.iter().find(|task| task.name == name).map_or(String::new(), place);
        findings.push(Finding { what: format!("the task `{name}` comes earlier than in the base"), place: at });
    }
    let is_known = |task: &Task| base.tasks.iter().any(|known| known.name == task.name);
    for task in rules.tasks.iter().filter(|task| !is_known(task) && !needs_new(task, extended)) {
        findings.push(Finding { what: format!("the task `{}` needs no new primitive", task.name), place: place(task) });
    }
    // A span that ends with the last primitive of a task but has no task's keys is `unknown`.
    let (ours, theirs) = (ends(&all), ends(extended));
    let others = theirs.iter().zip(ours.iter().map(Some).chain(std::iter::repeat(None)));
    let other =
        others.into_iter().find(|((_, first, last), known)| known.is_none_or(|it| (&it.1, &it.2) != (first, last)));
    if let Some(((task, ..), _)) = other {
        let (from, to) = (rules.label_name(task.first.label), rules.label_name(task.last.label));
        let what = format!(
            "the task `{}` runs from {from} to {to}: spans with this end and without a key become `unknown`",
            task.name
        );
        findings.push(Finding { what, place: place(task) });
    }
    let never = |task: &Task| !is_known(task) && needs_new(task, extended);
    findings.extend(composites(base, rules, &never));
    findings
}

/// Returns the composite tasks that may change the analysis while the tasks selected by `never` do not occur.
fn composites(base: &Rules, rules: &Rules, never: &dyn Fn(&Task) -> bool) -> Vec<Finding> {
    let place = |it: &Composite| rules.sources.place(it.span);
    let mut findings = Vec::new();
    for composite in &base.composites {
        let name = &composite.name;
        match rules.composites.iter().find(|other| other.name == *name) {
            None => {
                let place = base.sources.place(composite.span);
                findings.push(Finding { what: format!("the task `{name}` is gone"), place });
            }
            Some(other) if made(composite, base) != made(other, rules) => {
                findings
                    .push(Finding { what: format!("the task `{name}` is made of other tasks"), place: place(other) });
            }
            Some(other) if composite.failure != other.failure => {
                findings.push(Finding { what: outcome(name, other.failure), place: place(other) });
            }
            Some(_) => {}
        }
    }
    for name in moved(&composite_names(base), &composite_names(rules)) {
        let at = rules.composites.iter().find(|it| it.name == name).map_or(String::new(), place);
        findings.push(Finding { what: format!("the task `{name}` comes earlier than in the base"), place: at });
    }
    for composite in rules.composites.iter().filter(|it| !base.composites.iter().any(|known| known.name == it.name)) {
        let mut parts = composite.parts.iter().filter_map(|part| rules.tasks.get(part.task.index()));
        if !parts.any(never) {
            let what = format!("the task `{}`, made of tasks, needs no new primitive", composite.name);
            findings.push(Finding { what, place: place(composite) });
        }
    }
    findings
}

/// Lists the differences between the tasks.
pub fn differences(one: &Rules, other: &Rules) -> Vec<String> {
    let (all, with_new, without_new) =
        (CommonLabels::all(one), CommonLabels::all(other), CommonLabels::new(other, one));
    let mut lines = Vec::new();
    for task in &one.tasks {
        let name = &task.name;
        match other.tasks.iter().find(|other| other.name == *name) {
            None => lines.push(format!("the task `{name}` is gone")),
            Some(theirs) if asks(task, &all) == asks(theirs, &with_new) => {
                lines.extend((task.failure != theirs.failure).then(|| outcome(name, theirs.failure)));
            }
            Some(theirs) if asks(task, &all) == asks(theirs, &without_new) => {
                lines.push(format!("the task `{name}` differs only in new primitives"));
                lines.extend((task.failure != theirs.failure).then(|| outcome(name, theirs.failure)));
            }
            Some(_) => lines.push(format!("the task `{name}` has other keys")),
        }
    }
    for composite in &one.composites {
        let name = &composite.name;
        match other.composites.iter().find(|other| other.name == *name) {
            None => lines.push(format!("the task `{name}` is gone")),
            Some(theirs) if made(composite, one) != made(theirs, other) => {
                lines.push(format!("the task `{name}` is made of other tasks"));
            }
            Some(theirs) if composite.failure != theirs.failure => lines.push(outcome(name, theirs.failure)),
            Some(_) => {}
        }
    }
    let earlier = |name: &str| format!("the task `{name}` comes earlier");
    lines.extend(moved(&names(one), &names(other)).into_iter().map(earlier));
    lines.extend(moved(&composite_names(one), &composite_names(other)).into_iter().map(earlier));
    for (ours, theirs) in [(names(one), names(other)), (composite_names(one), composite_names(other))] {
        let new = theirs.into_iter().filter(|name| !ours.contains(name));
        lines.extend(new.map(|name| format!("the task `{name}` is new")));
    }
    lines
}

/// Reports that a task has another outcome than in the first rule set.
fn outcome(name: &str, failure: bool) -> String {
    format!("the task `{name}` is a {} now", if failure { "failure" } else { "success" })
}

fn names(rules: &Rules) -> Vec<&str> {
    rules.tasks.iter().map(|task| task.name.as_str()).collect()
}

fn composite_names(rules: &Rules) -> Vec<&str> {
    rules.composites.iter().map(|it| it.name.as_str()).collect()
}

/// Returns the tasks that a composite task consists of.
fn made<'r>(composite: &Composite, rules: &'r Rules) -> Vec<(&'r str, bool)> {
    let name = |part: &crate::rules::Part| {
        (rules.tasks.get(part.task.index()).map_or("", |task| task.name.as_str()), part.many)
    };
    composite.parts.iter().map(name).collect()
}

/// The condition of a task as long as no new primitive occurs.
#[derive(PartialEq)]
struct TaskCondition {
    ends: (Names, Names),
    keys: Vec<(Names, [Option<u64>; 3])>,
    without: Names,
    all_keys: bool,
    joined: bool,
}

fn asks(task: &Task, shared: &CommonLabels) -> TaskCondition {
    let value = |constant: &Option<Constant>| constant.as_ref().map(|constant| constant.value.to_bits());
    let keys = task
        .keys
        .iter()
        .map(|key| (pattern(&key.label, shared), [value(&key.lasting), value(&key.travelling), value(&key.turning)]));
    // A key that never occurs has no effect if any one key is sufficient.
    let keys = keys.filter(|(names, _)| task.all_keys || !names.is_empty()).collect();
    TaskCondition {
        ends: (pattern(&task.first, shared), pattern(&task.last, shared)),
        keys,
        without: shared.names(task.without.iter().copied()),
        all_keys: task.all_keys,
        joined: task.joined,
    }
}

fn pattern(pattern: &Pattern, shared: &CommonLabels) -> Names {
    shared.names(pattern.labels())
}

/// Whether the keys of a task require a new primitive. (A span may have the keys of a task without its first or last primitive.)
fn needs_new(task: &Task, shared: &CommonLabels) -> bool {
    let is_new = |key: &crate::rules::Key| pattern(&key.label, shared).is_empty();
    if task.all_keys { task.keys.iter().any(is_new) } else { task.keys.iter().all(is_new) }
}

/// Returns the first and last primitives of spans without a key, by priority, each with its task. A track is divided by the last primitive
/// alone, so of several tasks with the same one only the first counts. A last primitive that never occurs ends no span.
fn ends<'r>(shared: &CommonLabels<'r>) -> Vec<(&'r Task, Names, Names)> {
    let mut ends: Vec<(&Task, Names, Names)> = Vec::new();
    for task in &shared.rules.tasks {
        let (first, last) = (pattern(&task.first, shared), pattern(&task.last, shared));
        if !last.is_empty() && !ends.iter().any(|(.., known)| *known == last) {
            ends.push((task, first, last));
        }
    }
    ends
}
