//! Tasks and relabeling rules.

use super::Parser;
use super::expressions::{Builder, RulePair};
use super::grammar::Rule;
use crate::codes;
use crate::rules::Repetition;
use crate::syntax::{Composite, Demand, ItemKind, Key, Labels, Name, RelabelKind, RelabelRule, Task, TaskExtension};
use std::ops::Range;
use teachtree_base::diagnostic::Diagnostic;

impl Builder<'_, '_, '_> {
    /// `task name = A .. B with K`, `task name = task, task`
    pub fn task_item(&mut self, pair: RulePair<'_>) -> Option<ItemKind> {
        let Some(parts) = pair.clone().into_inner().find(|part| part.as_rule() == Rule::parts) else {
            return self.task(pair).map(ItemKind::Task);
        };
        let failure = pair.clone().into_inner().any(|part| part.as_rule() == Rule::is_failure);
        let part = |part: RulePair<'_>| {
            let many = part.clone().into_inner().any(|sign| sign.as_rule() == Rule::plus);
            Some((self.word(part)?, many))
        };
        let parts = parts.into_inner().filter(|part| part.as_rule() == Rule::part).map(part).collect::<Option<_>>()?;
        Some(ItemKind::Composite(Composite { name: self.word(pair)?, parts, failure }))
    }

    fn task(&mut self, pair: RulePair<'_>) -> Option<Task> {
        let mut name = None;
        let mut ends = Vec::new();
        let (mut keys, mut all_keys) = (Vec::new(), false);
        let (mut without, mut joined, mut failure, mut before) = (Vec::new(), false, false, None);
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::name => name = Some(self.name(&part)),
                Rule::label => ends.push(self.label(part)?),
                Rule::with_keys => (keys, all_keys) = self.keys(part)?,
                Rule::without_keys => without = self.labels(part)?,
                Rule::joined => joined = true,
                Rule::is_failure => failure = true,
                Rule::before_task => before = Some(self.word(part)?),
                _ => {}
            }
        }
        let mut ends = ends.into_iter();
        let (name, first, last) = (name?, ends.next()?, ends.next()?);
        Some(Task { name, first, last, keys, all_keys, without, joined, failure, before })
    }

    /// `extend task name with K`
    pub fn extend_task(&mut self, pair: RulePair<'_>) -> Option<TaskExtension> {
        let mut parts = pair.into_inner().skip(2);
        let name = self.name(&parts.next()?);
        let keys = parts.next()?;
        let span = self.piece.span(&keys);
        let (keys, all) = self.keys(keys)?;
        if all {
            self.findings.push(
                Diagnostic::error(codes::MIXED_KEYS, "keys that are added to a task are alternatives")
                    .at(span, "these are joined by `and`")
                    .help("join them by `or`"),
            );
            return None;
        }
        Some(TaskExtension { name, keys })
    }

    fn keys(&mut self, pair: RulePair<'_>) -> Option<(Vec<Key>, bool)> {
        let mut keys = Vec::new();
        let mut joint: Option<RulePair<'_>> = None;
        let mut mixed = false;
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::key => keys.push(self.key(part)),
                Rule::kw_or | Rule::kw_and => match &joint {
                    Some(first) if first.as_rule() != part.as_rule() && !mixed => {
                        mixed = true;
                        self.findings.push(
                            Diagnostic::error(codes::MIXED_KEYS, "`or` and `and` are mixed between keys")
                                .at(self.piece.span(&part), "this is the other one")
                                .at(self.piece.span(first), "the keys above are joined by this")
                                .help("a task has any of its keys (`or`) or all of them (`and`); write two tasks"),
                        );
                    }
                    Some(_) => {}
                    None => joint = Some(part),
                },
                _ => {}
            }
        }
        let all = joint.is_some_and(|joint| joint.as_rule() == Rule::kw_and);
        let keys = keys.into_iter().collect::<Option<_>>()?;
        (!mixed).then_some((keys, all))
    }

    fn key(&mut self, pair: RulePair<'_>) -> Option<Key> {
        let span = self.piece.span(&pair);
        let mut parts = pair.into_inner();
        let label = self.label(parts.next()?)?;
        let mut demands = Vec::new();
        for demand in parts {
            let mut words = demand.into_inner();
            let kind = match words.next()?.as_rule() {
                Rule::kw_lasting => Demand::Lasting,
                Rule::kw_travelling => Demand::Travelling,
                _ => Demand::Turning,
            };
            demands.push((kind, self.expression(words.next()?)?));
        }
        Some(Key { label, demands, span })
    }

    /// The labels among the children of a pair.
    fn labels(&mut self, pair: RulePair<'_>) -> Option<Labels> {
        pair.into_inner().filter(|part| part.as_rule() == Rule::label).map(|label| self.label(label)).collect()
    }

    /// The name among the children of a pair.
    fn word(&mut self, pair: RulePair<'_>) -> Option<Name> {
        pair.into_inner().find(|part| part.as_rule() == Rule::name).map(|name| self.name(&name))
    }

    /// The task that a relabeling block is for.
    pub fn relabel_task(&mut self, pair: RulePair<'_>) -> Option<Name> {
        self.word(pair)
    }

    fn relabel(&mut self, pair: RulePair<'_>) -> Option<RelabelRule> {
        let span = self.piece.span(&pair);
        let rule = pair.into_inner().next()?;
        let kind = if rule.as_rule() == Rule::sequence { self.sequence(rule)? } else { self.rewrite(rule)? };
        Some(RelabelRule { kind, span })
    }

    fn sequence(&mut self, pair: RulePair<'_>) -> Option<RelabelKind> {
        let mut elements = Vec::new();
        let mut becomes = None;
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::element => {
                    let mut parts = part.into_inner();
                    let labels = self.labels(parts.next()?)?;
                    let repeat = match parts.next().map(|repeat| repeat.as_str().to_string()).as_deref() {
                        Some("*") => Repetition::ZeroOrMore,
                        Some(_) => Repetition::OneOrMore,
                        None => Repetition::Once,
                    };
                    elements.push((labels, repeat));
                }
                Rule::label => becomes = Some(self.label(part)?),
                _ => {}
            }
        }
        Some(RelabelKind::Sequence { elements, becomes: becomes? })
    }

    fn rewrite(&mut self, pair: RulePair<'_>) -> Option<RelabelKind> {
        let mut parts = pair.into_inner();
        let first = parts.next()?;
        let place = self.piece.span(&first);
        let mut what = self.labels(first)?;
        let rest = parts.next()?;
        match rest.as_rule() {
            Rule::between_rule => self.between(what, rest),
            Rule::list_rule => {
                what.extend(self.labels(rest)?);
                let becomes = what.pop()?;
                Some(RelabelKind::Become { what, becomes })
            }
            _ if what.len() > 1 => {
                self.findings.push(
                    Diagnostic::error(codes::SYNTAX, "`in both` takes one primitive")
                        .at(place, "these are several")
                        .help("write one rule for each"),
                );
                None
            }
            _ => Some(RelabelKind::Separate { what: what.pop()?, without: self.labels(rest)? }),
        }
    }

    fn between(&mut self, what: Labels, pair: RulePair<'_>) -> Option<RelabelKind> {
        let (mut run, mut shorter, mut becomes, mut separate) = (false, None, None, false);
        let mut pairs = Vec::new();
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::plus => run = true,
                Rule::shorter => {
                    let duration = part.into_inner().find(|part| part.as_rule() == Rule::duration)?;
                    shorter = Some(self.expression(duration)?);
                }
                Rule::between => {
                    let mut sides = part.into_inner().filter(|part| part.as_rule() == Rule::alternatives);
                    let (left, right) = (sides.next()?, sides.next()?);
                    pairs.push((self.labels(left)?, self.labels(right)?));
                }
                Rule::label => becomes = Some(self.label(part)?),
                Rule::kw_separate => separate = true,
                _ => {}
            }
        }
        if becomes.is_none() && !separate {
            return None;
        }
        let mut pairs = pairs.into_iter();
        let (between, other) = (pairs.next()?, pairs.next());
        Some(RelabelKind::Between { what, run, shorter, between, other, becomes })
    }
}

impl Parser<'_> {
    /// The rules of a relabeling block: each ends with the word behind `becomes`.
    pub(super) fn relabels(&mut self, tokens: Range<usize>) -> Vec<RelabelRule> {
        let mut rules = Vec::new();
        let mut at = tokens.start;
        while at < tokens.end {
            let becomes = (at..tokens.end).find(|at| matches!(self.scan.word(*at), "becomes" | "become"));
            let mut next = becomes.map_or(tokens.end, |becomes| (becomes + 2).min(tokens.end));
            if next < tokens.end && self.scan.word(next) == "(" && self.touches(next) {
                next = self.scan.behind(next).min(tokens.end);
            }
            rules.extend(self.piece(at..next, Rule::only_relabel, |builder, pair| builder.relabel(pair)));
            at = next.max(at + 1);
        }
        rules
    }
}
