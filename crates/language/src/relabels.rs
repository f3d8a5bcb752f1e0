//! Relabeling rules: labels, durations, and the text that a rewritten segment carries as its trail.

use super::codes;
use super::resolve::Resolver;
use super::rules::{Constant, RelabelKind, RelabelRule, TaskId};
use super::syntax::{self, RelabelBlock};
use super::types::Scope;
use teachtree_base::diagnostic::{Diagnostic, Span};
use teachtree_base::units::Dimension;

impl Resolver {
    /// Checks the relabeling rules; the tasks are known and ordered.
    pub(super) fn relabels(&mut self, blocks: &[&RelabelBlock]) {
        for block in blocks {
            let task = match &block.task {
                None => None,
                Some(name) => match self.rules.tasks.iter().position(|task| task.name == name.text) {
                    Some(at) => u32::try_from(at).ok().map(TaskId),
                    None => {
                        self.unknown("task", &name.text, name.span, |resolver| {
                            resolver.rules.tasks.iter().map(|task| task.name.clone()).collect()
                        });
                        continue;
                    }
                },
            };
            for rule in &block.rules {
                let separates = matches!(
                    &rule.kind,
                    syntax::RelabelKind::Separate { .. } | syntax::RelabelKind::Between { becomes: None, .. }
                );
                if let (Some(name), true) = (&block.task, separates) {
                    self.report(
                        Diagnostic::error(codes::SEPARATE_TASK, "a rule for one task makes its segments `separate`")
                            .at(rule.span, "this labels both hands")
                            .at(name.span, "when this task is known, the hands have their labels already")
                            .help("write it in `relabel { … }`, for all tasks"),
                    );
                    continue;
                }
                if let Some(mut kind) = self.relabel(&rule.kind) {
                    self.kinds_in_relabel(&mut kind);
                    let text = self.folded(rule.span);
                    self.rules.relabels.push(RelabelRule { task, kind, text, span: rule.span });
                }
            }
        }
    }

    fn relabel(&mut self, kind: &syntax::RelabelKind) -> Option<RelabelKind> {
        Some(match kind {
            syntax::RelabelKind::Between { what, run, shorter, between, other, becomes } => {
                let what = self.labels(what);
                let shorter = shorter.as_ref().map(|shorter| self.bound(shorter));
                let between = self.pair(between);
                let other = other.as_ref().map(|other| self.pair(other));
                let becomes = becomes.as_ref().map(|becomes| self.label(becomes, true));
                let becomes = match becomes {
                    Some(None) => return None,
                    Some(becomes) => becomes,
                    None => None,
                };
                let shorter = match shorter {
                    Some(None) => return None,
                    Some(shorter) => shorter,
                    None => None,
                };
                let (what, run) = (what?, *run);
                match other {
                    Some(other) => {
                        RelabelKind::BetweenInHands { what, run, shorter, one: between?, other: other?, becomes }
                    }
                    None => RelabelKind::Between { what, run, shorter, between: between?, becomes: becomes? },
                }
            }
            syntax::RelabelKind::Become { what, becomes } => {
                let (what, becomes) = (self.labels(what), self.label(becomes, true));
                RelabelKind::Become { what: what?, becomes: becomes? }
            }
            syntax::RelabelKind::Sequence { elements, becomes } => {
                let read: Vec<_> =
                    elements.iter().map(|(labels, repeat)| Some((self.labels(labels)?, *repeat))).collect();
                let becomes = self.label(becomes, true);
                RelabelKind::Sequence { elements: read.into_iter().collect::<Option<_>>()?, becomes: becomes? }
            }
            syntax::RelabelKind::Separate { what, without } => {
                let (what, without) = (self.label(what, false), self.labels(without));
                RelabelKind::Separate { what: vec![what?], without: without? }
            }
        })
    }

    /// The limit of a rule: a duration, or a distance of the target.
    fn bound(&mut self, limit: &syntax::Expr) -> Option<Constant> {
        let read = self.constant(limit, None, Scope::SHARED)?;
        if read.dimension == Dimension::LENGTH {
            return Some(read);
        }
        self.constant(limit, Some(Dimension::TIME), Scope::SHARED)
    }

    fn pair(
        &mut self,
        pair: &(syntax::Labels, syntax::Labels),
    ) -> Option<(super::rules::Labels, super::rules::Labels)> {
        let (one, two) = (self.labels(&pair.0), self.labels(&pair.1));
        one.zip(two)
    }

    /// The text of a rule without its comments, blanks folded.
    fn folded(&self, span: Span) -> String {
        let lines = self.rules.sources.text(span).lines();
        let words = lines.flat_map(|line| line.split("//").next().unwrap_or("").split_whitespace());
        words.collect::<Vec<_>>().join(" ")
    }
}
