//! `primitive Lift is Translate`, `primitive Push does push`: what primitives are, and where their kinds count.

use super::{Resolver, nearest};
use crate::codes;
use crate::rules::{Label, Labels, MOST_KINDS, Pattern, PrimitiveId, RelabelKind, Task};
use crate::syntax;
use std::collections::{BTreeMap, BTreeSet};
use teachtree_base::diagnostic::Diagnostic;
use teachtree_base::meaning::Meaning;

/// The primitives of these labels.
pub fn named<'a>(labels: impl IntoIterator<Item = &'a Label>) -> BTreeSet<PrimitiveId> {
    labels.into_iter().map(|label| label.primitive).collect()
}

impl Resolver {
    /// Finds what each primitive is a kind of, and what a hand does in it.
    pub(super) fn kinds_and_meanings(&mut self, declared: &[&syntax::Primitive]) {
        for primitive in declared {
            let name = &primitive.name;
            // A second declaration of a name was reported.
            let Some(id) = self.rules.primitive(&name.text) else { continue };
            if self.rules.primitives.get(id.index()).is_none_or(|first| first.span != name.span) {
                continue;
            }
            let above = primitive.is.as_ref().and_then(|above| self.parent(primitive, above));
            let does = primitive.does.as_ref().and_then(|does| self.read_meaning(does));
            let other = primitive.other.as_ref().and_then(|other| self.read_meaning(other));
            if let Some(other) = primitive.other.as_ref().filter(|_| !primitive.sided) {
                let finding = Diagnostic::error(codes::WRONG_SIDE, format!("`{}` has no side", name.text))
                    .at(other.span, "which hand is the other one?")
                    .at(name.span, "declared without a side")
                    .fix(format!("declare `{}(side)`", name.text), name.span, format!("{}(side)", name.text));
                self.report(finding);
            }
            if let (Some(above), Some(does)) = (&primitive.is, &primitive.does) {
                let message = format!("`{}` is a kind of `{}` and declares an action", name.text, above.text);
                let (is, root) = (above.text.clone(), name.text.clone());
                self.report(
                    Diagnostic::error(codes::KIND_WITH_MEANING, message)
                        .at(does.span, "a kind does what its parent does")
                        .at(above.span, "the parent")
                        .help(format!("write `{root} is {is}`, or `{root} does {}`", does.text)),
                );
            }
            if let Some(own) = self.rules.primitives.get_mut(id.index()) {
                (own.is, own.does, own.other) = (above, does, other);
            }
        }
        self.circular_kinds();
        self.kinds = self.rules.kinds();
        self.too_many_kinds();
    }

    fn parent(&mut self, primitive: &syntax::Primitive, above: &syntax::Name) -> Option<PrimitiveId> {
        let Some(id) = self.rules.primitive(&above.text) else {
            self.unknown("primitive", &above.text, above.span, |resolver| {
                resolver.rules.primitives.iter().map(|primitive| primitive.name.clone()).collect()
            });
            return None;
        };
        self.used.insert(above.text.clone());
        let parent = self.rules.primitives.get(id.index())?;
        if parent.sided && !primitive.sided {
            let name = &primitive.name;
            let finding = Diagnostic::error(codes::WRONG_SIDE, format!("`{}` is sided, so its kinds are", above.text))
                .at(name.span, "declared without a side")
                .at(parent.span, "declared with a side")
                .fix(format!("declare `{}(side)`", name.text), name.span, format!("{}(side)", name.text));
            self.report(finding);
            return None;
        }
        Some(id)
    }

    fn read_meaning(&mut self, word: &syntax::Name) -> Option<Meaning> {
        let meaning = Meaning::from_name(&word.text);
        if meaning.is_none() {
            let known = || Meaning::ALL.into_iter().map(Meaning::name);
            let finding = Diagnostic::error(codes::UNKNOWN_MEANING, format!("there is no action `{}`", word.text))
                .at(word.span, "expected an action");
            if self.rules.primitive(&word.text).is_some() {
                self.report(
                    finding.help(format!("a kind of a primitive is declared by `is`: `primitive … is {}`", word.text)),
                );
                return None;
            }
            self.report(match nearest(&word.text, known()) {
                Some(near) => finding.fix(format!("did you mean `{near}`?"), word.span, near),
                None => finding.help(format!("actions are {}", known().collect::<Vec<_>>().join(", "))),
            });
        }
        meaning
    }

    /// Reports primitives that are kinds of each other in a circle, and cuts the circle.
    fn circular_kinds(&mut self) {
        let mut ended: BTreeSet<PrimitiveId> = BTreeSet::new();
        for start in (0..).map(PrimitiveId).take(self.rules.primitives.len()) {
            let mut path: Vec<PrimitiveId> = Vec::new();
            let mut on_path: BTreeSet<PrimitiveId> = BTreeSet::new();
            let mut next = Some(start);
            while let Some(here) = next.filter(|here| !ended.contains(here) && on_path.insert(*here)) {
                path.push(here);
                next = self.rules.primitives.get(here.index()).and_then(|one| one.is);
            }
            if let Some(first) = next.and_then(|here| path.iter().position(|one| *one == here)) {
                let circle: Vec<_> =
                    path.iter().skip(first).filter_map(|id| self.rules.primitives.get(id.index())).collect();
                let mut finding = Diagnostic::error(codes::CIRCULAR_KINDS, "primitives are kinds of each other");
                for (at, one) in circle.iter().enumerate().take(6) {
                    let above = circle.get((at + 1) % circle.len()).map_or("", |above| above.name.as_str());
                    finding = finding.at(one.span, format!("is a kind of `{above}`"));
                }
                self.report(finding.help("declare an action for one of them: `primitive … does carry`"));
                for id in path.iter().skip(first) {
                    if let Some(one) = self.rules.primitives.get_mut(id.index()) {
                        one.is = None;
                    }
                }
            }
            ended.extend(path);
        }
    }

    /// Reports primitives with more kinds than the bound, and takes their kinds away.
    fn too_many_kinds(&mut self) {
        let mut counts: BTreeMap<PrimitiveId, usize> = BTreeMap::new();
        for primitive in &self.rules.primitives {
            let mut above = primitive.is;
            for _ in 0..=MOST_KINDS {
                let Some(id) = above else { break };
                *counts.entry(id).or_default() += 1;
                above = self.rules.primitives.get(id.index()).and_then(|one| one.is);
            }
        }
        let mut findings = Vec::new();
        for (id, count) in counts.into_iter().filter(|(_, count)| *count > MOST_KINDS) {
            let Some(one) = self.rules.primitives.get(id.index()) else { continue };
            let message = format!("`{}` has {count} kinds or more, at most {MOST_KINDS} are allowed", one.name);
            findings.push(Diagnostic::error(codes::TOO_MANY_KINDS, message).at(one.span, "kinds of kinds are counted"));
            self.kinds.remove(&id);
        }
        self.findings.extend(findings);
    }

    /// Labels with the kinds that count for them, where these primitives are named.
    pub fn with_kinds(&self, labels: &[Label], named: &BTreeSet<PrimitiveId>) -> Labels {
        let mut all = labels.to_vec();
        if !self.kinds.is_empty() {
            for label in labels {
                let kinds = self.rules.kinds_of(*label, named, &self.kinds);
                all.extend(kinds.into_iter().filter(|kind| !labels.contains(kind)));
            }
        }
        all
    }

    fn pattern(&self, pattern: &mut Pattern, named: &BTreeSet<PrimitiveId>) {
        if !self.kinds.is_empty() {
            pattern.kinds = self.rules.kinds_of(pattern.label, named, &self.kinds);
        }
    }

    /// Adds the kinds that count in a task for what it names.
    pub fn kinds_in_task(&self, task: &mut Task) {
        let keys = task.keys.iter().map(|key| &key.label.label);
        let named = named([&task.first.label, &task.last.label].into_iter().chain(keys).chain(&task.without));
        self.pattern(&mut task.first, &named);
        self.pattern(&mut task.last, &named);
        task.keys.iter_mut().for_each(|key| self.pattern(&mut key.label, &named));
        task.without = self.with_kinds(&task.without, &named);
    }

    /// Adds the kinds that count in a rule for what it names.
    pub fn kinds_in_relabel(&self, rule: &mut RelabelKind) {
        let becomes = rule.becomes();
        let mut lists: Vec<&mut Labels> = match rule {
            RelabelKind::Between { what, between, .. } => vec![what, &mut between.0, &mut between.1],
            RelabelKind::BetweenInHands { what, one, other, .. } => {
                vec![what, &mut one.0, &mut one.1, &mut other.0, &mut other.1]
            }
            RelabelKind::Become { what, .. } => vec![what],
            RelabelKind::Sequence { elements, .. } => elements.iter_mut().map(|(labels, _)| labels).collect(),
            RelabelKind::Separate { what, without } => vec![what, without],
        };
        let named = named(lists.iter().flat_map(|list| list.iter()).chain(&becomes));
        for list in &mut lists {
            **list = self.with_kinds(list, &named);
        }
    }
}
