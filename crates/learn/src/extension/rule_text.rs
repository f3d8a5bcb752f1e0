//! The extension as a rule file.

use super::evidence::{Condition, Evidence, Whose};
use super::guards::Guard;
use super::{Declaration, LoadRules};
use std::fmt::Write;
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_language::format::format;
use teachtree_language::rules::{PrimitiveId, Rules, Task};

/// Writes the declarations, the choice and the task of a guard. `comment` is written behind the choice.
pub(super) fn body(
    evidence: &Evidence,
    guard: &Guard,
    base: &Rules,
    declaration: &Declaration,
    lasting_s: f64,
    comment: &str,
) -> String {
    let text_of = |at: &usize| evidence.conditions[*at].text.as_str();
    let name = &declaration.name;
    let sided = if declaration.sided { "(side)" } else { "" };
    let parent = parent(evidence, base, declaration);
    let meaning = declaration.meaning.clone().or_else(|| Some(format!("is {}", parent?)));
    let mut text =
        format!("primitive {name}{sided}{}\n\n", meaning.map_or(String::new(), |meaning| format!(" {meaning}")));
    let read: Vec<&str> = guard.conditions.iter().chain(&guard.sustains).map(text_of).collect();
    let mut declared = evidence.vocabulary.declarations_of(&read);
    let mut joined = |at: &usize| joined(&evidence.conditions[*at], &snake_case(name), &mut declared);
    let conditions: Vec<String> = guard.conditions.iter().map(&mut joined).collect();
    let sustains = guard.sustains.as_ref().map(joined);
    // A condition of the other hand needs a declaration of each hand in a tree over both.
    let mut stated = |condition: String, what: &str| {
        if !declaration.sided {
            return condition;
        }
        let signal = format!("{}_{what}", snake_case(name));
        declared.push(format!("signal {signal} = {condition}"));
        signal
    };
    let place = &evidence.places[guard.place];
    let narrow = |condition: String| match &place.condition {
        Some(also) if also.contains(" or ") => format!("({also}) and {condition}"),
        Some(also) => format!("{also} and {condition}"),
        None => condition,
    };
    let condition = narrow(stated(conditions.join(" and "), "begins"));
    let sustains = sustains.map(|condition| narrow(stated(condition, "goes_on")));
    if !declared.is_empty() {
        let _ = writeln!(text, "for each hand {{\n  {}\n}}\n", declared.join("\n  "));
    }
    let place = &place.text;
    let _ = writeln!(text, "extend {place} {{\n  {condition} => {name}{sided}{comment}");
    if let Some(condition) = sustains {
        let _ = writeln!(text, "  from({name}) and {condition} => {name}{sided}");
    }
    text.push_str("}\n");
    if let Some(task) = model_task(base) {
        let (first, last) = (base.label_name(task.first.label), base.label_name(task.last.label));
        let lasting = format!("{:.0} ms", lasting_s * 1e3);
        let _ = writeln!(
            text,
            "\ntask {} = {first} .. {last} with {name} lasting {lasting} before {}",
            free_task(base, name),
            task.name
        );
    }
    text
}

/// A condition as a choice reads it. One of either or both hands is declared for each hand, unless it is a name.
fn joined(condition: &Condition, primitive: &str, declared: &mut Vec<String>) -> String {
    let (hands, opposite) = match condition.whose {
        Whose::Own | Whose::Other => return condition.text.clone(),
        Whose::Either => ("either", "both"),
        Whose::Both => ("both", "either"),
    };
    let is_name = |text: &str| text.chars().all(|letter| letter.is_alphanumeric() || letter == '_');
    match condition.text.strip_prefix("not ") {
        _ if is_name(&condition.text) => format!("{hands}.{}", condition.text),
        Some(name) if is_name(name) => format!("not {opposite}.{name}"),
        _ => {
            let signal = format!("{primitive}_{}", declared.len() + 1);
            declared.push(format!("signal {signal} = {}", condition.text));
            format!("{hands}.{signal}")
        }
    }
}

/// The primitive that the new one is a kind of: what the rules call most of the marked time.
fn parent(evidence: &Evidence, base: &Rules, declaration: &Declaration) -> Option<String> {
    let is_alike = |id: &PrimitiveId| base.primitives.get(id.index()).is_some_and(|it| it.sided == declaration.sided);
    let leaves = evidence.leaves.iter().filter(|(id, _)| is_alike(id));
    let (id, _) = leaves.reduce(|best, next| if next.1 > best.1 { next } else { best })?;
    base.primitives.get(id.index()).map(|it| it.name.clone())
}

/// The task of the base whose ends the new task has: the first one that is not a failure.
fn model_task(base: &Rules) -> Option<&Task> {
    base.tasks.iter().find(|task| !task.failure)
}

fn free_task(base: &Rules, name: &str) -> String {
    let name = snake_case(name);
    let is_used = |name: &str| {
        base.tasks.iter().any(|it| it.name == name)
            || base.composites.iter().any(|it| it.name == name)
            || base.signals.iter().any(|it| it.name == name)
            || base.latches.iter().any(|it| it.name == name)
            || base.params.iter().any(|it| it.name == name)
    };
    if is_used(&name) { format!("{name}_task") } else { name }
}

/// The text in the style of rule files, and its rules.
///
/// # Errors
/// The text is not a rule file, for example because the place of a guard is taken.
pub(super) fn checked(load: &LoadRules, text: &str) -> Result<(String, Rules), InputError> {
    let text = format(text).map_err(|found| {
        InputError::new("teachtree learn", found.first().map_or("", |found| &found.message))
            .or_kind(ErrorKind::Internal)
    })?;
    let rules = load(&text)?;
    Ok((text, rules))
}

/// `PickUp` as `pick_up`.
pub(super) fn snake_case(name: &str) -> String {
    super::super::rule_file::snake_case(name)
}
