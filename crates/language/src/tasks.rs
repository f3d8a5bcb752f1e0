//! Tasks: their labels and demands, and their order: by declaration, moved in front of what they are declared `before`.

use super::codes;
use super::resolve::Resolver;
use super::rules::{Key, Pattern, Task};
use super::syntax::{self, Demand};
use super::types::Scope;
use std::collections::{BTreeMap, BTreeSet};
use teachtree_base::diagnostic::{Diagnostic, Span};
use teachtree_base::units::Dimension;

impl Resolver {
    /// Checks and orders the tasks.
    pub(super) fn tasks(&mut self, tasks: &[(&syntax::Task, Span)], extensions: &[&syntax::TaskExtension]) {
        let mut declared: Vec<(&syntax::Task, Option<Task>)> = Vec::new();
        let mut at: BTreeMap<&str, usize> = BTreeMap::new();
        for (task, span) in tasks {
            if let Some(first) = at.get(task.name.text.as_str()).and_then(|at| declared.get(*at)) {
                let first = first.0.name.span;
                self.declared_twice("task", &task.name, first);
                continue;
            }
            at.insert(&task.name.text, declared.len());
            let checked = self.task(task, *span);
            if checked.is_none() {
                self.names.broken.insert(task.name.text.clone());
            }
            declared.push((task, checked));
        }
        for extension in extensions {
            let keys = self.keys(&extension.keys);
            let Some(at) = at.get(extension.name.text.as_str()) else {
                self.unknown("task", &extension.name.text, extension.name.span, |_| {
                    at.keys().map(ToString::to_string).collect()
                });
                continue;
            };
            let Some((task, Some(checked))) = declared.get_mut(*at) else { continue };
            if checked.all_keys {
                let finding =
                    Diagnostic::error(codes::EXTENDED_AND, format!("`{}` needs all of its keys", checked.name))
                        .at(extension.name.span, "another alternative has no place in it")
                        .at(task.name.span, "its keys are joined by `and`")
                        .help("declare a task of its own");
                self.report(finding);
                continue;
            }
            checked.keys.extend(keys.into_iter().flatten());
        }
        declared.iter_mut().filter_map(|(_, task)| task.as_mut()).for_each(|task| self.kinds_in_task(task));
        let order = self.task_order(&declared, &at);
        let mut checked: Vec<Option<Task>> = declared.into_iter().map(|(_, task)| task).collect();
        self.rules.tasks = order.into_iter().filter_map(|at| checked.get_mut(at).and_then(Option::take)).collect();
    }

    fn task(&mut self, task: &syntax::Task, span: Span) -> Option<Task> {
        let first = self.label(&task.first, false);
        let last = self.label(&task.last, false);
        let keys = self.keys(&task.keys);
        let without = self.labels(&task.without);
        Some(Task {
            name: task.name.text.clone(),
            first: Pattern::of(first?),
            last: Pattern::of(last?),
            keys: keys?,
            all_keys: task.all_keys,
            without: without?,
            joined: task.joined,
            failure: task.failure,
            span,
        })
    }

    fn keys(&mut self, keys: &[syntax::Key]) -> Option<Vec<Key>> {
        let read: Vec<Option<Key>> = keys.iter().map(|key| self.key(key)).collect();
        read.into_iter().collect()
    }

    fn key(&mut self, key: &syntax::Key) -> Option<Key> {
        let label = self.label(&key.label, false);
        let mut demanded =
            Key { label: Pattern::of(label?), lasting: None, travelling: None, turning: None, span: key.span };
        for (demand, value) in &key.demands {
            let (place, dimension) = match demand {
                Demand::Lasting => (&mut demanded.lasting, Dimension::TIME),
                Demand::Travelling => (&mut demanded.travelling, Dimension::LENGTH),
                Demand::Turning => (&mut demanded.turning, Dimension::ANGLE),
            };
            if place.is_some() {
                self.report(
                    Diagnostic::error(codes::DECLARED_TWICE, "this is demanded twice").at(value.span, "demanded again"),
                );
                return None;
            }
            *place = Some(self.constant(value, Some(dimension), Scope::SHARED)?);
        }
        Some(demanded)
    }

    /// The tasks in the order in which they are tried: each in the order of declaration, after those that are declared before it.
    fn task_order(&mut self, declared: &[(&syntax::Task, Option<Task>)], at: &BTreeMap<&str, usize>) -> Vec<usize> {
        let mut ahead: Vec<Vec<usize>> = vec![Vec::new(); declared.len()];
        for (task, (syntax, _)) in declared.iter().enumerate() {
            let Some(before) = &syntax.before else { continue };
            match at.get(before.text.as_str()) {
                Some(other) => {
                    if let Some(ahead) = ahead.get_mut(*other) {
                        ahead.push(task);
                    }
                }
                None => {
                    self.unknown("task", &before.text, before.span, |_| at.keys().map(ToString::to_string).collect());
                }
            }
        }
        // A task names one other at most, so that following the names either ends or comes back to itself.
        let next = |task: usize| {
            let before = declared.get(task).and_then(|(task, _)| task.before.as_ref())?;
            at.get(before.text.as_str()).copied()
        };
        let mut reported: BTreeSet<usize> = BTreeSet::new();
        let mut ended: BTreeSet<usize> = BTreeSet::new();
        for start in 0..declared.len() {
            let mut path: BTreeSet<usize> = BTreeSet::new();
            let mut task = Some(start);
            while let Some(here) = task.filter(|here| !ended.contains(here) && path.insert(*here)) {
                task = next(here);
            }
            if let Some(here) = task.filter(|here| path.contains(here) && !reported.contains(here)) {
                reported.extend(&path);
                self.circular_tasks(here, &next, declared);
            }
            ended.extend(path);
        }
        if !reported.is_empty() {
            return (0..declared.len()).collect();
        }
        // Depth first, with a stack of our own: first what comes before a task, then the task.
        let mut order = Vec::new();
        let mut placed: BTreeSet<usize> = BTreeSet::new();
        for start in 0..declared.len() {
            let mut stack = vec![(start, false)];
            while let Some((task, ready)) = stack.pop() {
                if ready {
                    order.push(task);
                } else if placed.insert(task) {
                    stack.push((task, true));
                    stack.extend(ahead.get(task).into_iter().flatten().rev().map(|before| (*before, false)));
                }
            }
        }
        order
    }

    fn circular_tasks(
        &mut self,
        start: usize,
        next: &dyn Fn(usize) -> Option<usize>,
        declared: &[(&syntax::Task, Option<Task>)],
    ) {
        let mut finding = Diagnostic::error(codes::CIRCULAR_TASKS, "the `before` orders of tasks form a cycle");
        let mut task = start;
        for _ in 0..declared.len().min(6) {
            if let Some((syntax, _)) = declared.get(task) {
                let before = syntax.before.as_ref().map_or("", |before| before.text.as_str());
                finding = finding.at(syntax.name.span, format!("before `{before}`"));
            }
            match next(task) {
                Some(other) if other != start => task = other,
                _ => break,
            }
        }
        self.report(finding);
    }
}
