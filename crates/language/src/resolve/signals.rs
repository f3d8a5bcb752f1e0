//! Signals in the order of their dependence, and latches in the order of their declaration.

use super::Resolver;
use super::names::{Declarations, State};
use crate::codes;
use crate::rules::{Hand, Latch, Signal, SignalId, Type};
use crate::syntax::{self, ExprKind};
use crate::types::{Scope, describe};
use std::collections::{BTreeMap, BTreeSet};
use teachtree_base::diagnostic::Diagnostic;

impl Resolver {
    /// Checks the signals, each after those that it reads.
    pub(super) fn signals(&mut self, declared: &Declarations<'_>) {
        // A name that is declared twice means its first declaration.
        let signals: Vec<(&syntax::Signal, bool)> = declared
            .signals
            .iter()
            .filter(|(signal, _)| {
                let value = self.names.values.get(&signal.name.text);
                signal.value.is_some() && value.is_some_and(|value| value.span == signal.name.span)
            })
            .copied()
            .collect();
        let at: BTreeMap<&str, usize> =
            signals.iter().enumerate().map(|(at, (signal, _))| (signal.name.text.as_str(), at)).collect();
        let reads: Vec<BTreeSet<usize>> = signals.iter().map(|(signal, _)| read_signals(signal, &at)).collect();
        let mut readers: Vec<Vec<usize>> = vec![Vec::new(); signals.len()];
        let mut missing: Vec<usize> = reads.iter().map(BTreeSet::len).collect();
        for (reader, reads) in reads.iter().enumerate() {
            for read in reads {
                if let Some(readers) = readers.get_mut(*read) {
                    readers.push(reader);
                }
            }
        }
        let mut ready: BTreeSet<usize> = (0..signals.len()).filter(|at| missing.get(*at) == Some(&0)).collect();
        let mut waiting: BTreeSet<usize> = (0..signals.len()).collect();
        while !waiting.is_empty() {
            // With nothing ready there is a circle: report it, and go on as if its signals were known.
            let next: Vec<usize> = match ready.pop_first() {
                Some(next) => vec![next],
                None => self.circle(&signals, &reads, &waiting),
            };
            for done in next {
                if !waiting.remove(&done) {
                    continue;
                }
                if let Some((signal, per_hand)) = signals.get(done) {
                    self.signal(signal, *per_hand, declared);
                }
                for reader in readers.get(done).into_iter().flatten() {
                    if let Some(missing) = missing.get_mut(*reader) {
                        *missing = missing.saturating_sub(1);
                        if *missing == 0 && waiting.contains(reader) {
                            ready.insert(*reader);
                        }
                    }
                }
            }
        }
    }

    /// Reports a circle among the waiting signals and returns its members.
    fn circle(
        &mut self,
        signals: &[(&syntax::Signal, bool)],
        reads: &[BTreeSet<usize>],
        waiting: &BTreeSet<usize>,
    ) -> Vec<usize> {
        let mut path: Vec<usize> = waiting.first().copied().into_iter().collect();
        let mut seen: BTreeSet<usize> = path.iter().copied().collect();
        let mut again = None;
        while let Some(next) = path
            .last()
            .and_then(|last| reads.get(*last))
            .and_then(|reads| reads.iter().find(|read| waiting.contains(read)).copied())
        {
            if !seen.insert(next) {
                again = path.iter().position(|at| *at == next);
                break;
            }
            path.push(next);
        }
        let circle: Vec<usize> = path.split_off(again.unwrap_or(0));
        let members: Vec<&syntax::Name> =
            circle.iter().filter_map(|at| signals.get(*at)).map(|(signal, _)| &signal.name).collect();
        let words: Vec<String> = members.iter().chain(members.first()).map(|name| format!("`{}`", name.text)).collect();
        let mut finding = Diagnostic::error(
            codes::CIRCULAR_SIGNALS,
            if members.len() == 1 {
                format!("the signal {} is defined by itself", words.first().map_or("", String::as_str))
            } else {
                format!("the definitions of signals form a cycle: {}", words.join(" reads "))
            },
        );
        for member in members.iter().take(6) {
            finding = finding.at(member.span, "a signal of the cycle");
        }
        self.report(finding.help("a latch remembers; a signal is computed from this frame"));
        for member in members {
            self.names.set_state(&member.text, State::Broken);
        }
        circle
    }

    fn signal(&mut self, signal: &syntax::Signal, per_hand: bool, declared: &Declarations<'_>) {
        let name = &signal.name;
        if self.names.values.get(&name.text).is_none_or(|value| value.state == State::Broken) {
            return;
        }
        let scope = if per_hand { Scope::HAND } else { Scope::SHARED };
        let expr = signal.value.as_ref().and_then(|value| self.expr(value, scope));
        let declarations =
            declared.signals.iter().filter(|(other, _)| other.name.text == name.text && other.ty.is_some());
        let mut state = State::Broken;
        if let Some(expr) = expr {
            let mut fits = true;
            for (declared_as, _) in declarations {
                fits &= self.implements(declared_as, signal, per_hand, expr.ty);
            }
            if let Some(id) = u32::try_from(self.rules.signals.len()).ok().filter(|_| fits) {
                self.signal_picks.push(self.picked(&expr));
                if self.is_exact(&expr) {
                    self.exact_signals.insert(SignalId(id));
                }
                let (name, ty) = (name.text.clone(), expr.ty);
                self.rules.signals.push(Signal { name, per_hand, ty, expr });
                state = State::Known(id);
            }
        }
        self.names.set_state(&name.text, state);
    }

    /// Whether a signal has the type that is written for it, here or in an abstract signal.
    fn implements(
        &mut self,
        declared_as: &syntax::Signal,
        implementation: &syntax::Signal,
        per_hand: bool,
        found: Type,
    ) -> bool {
        let Some(written) = declared_as.ty else { return true };
        let hand = if per_hand { Hand::This } else { Hand::Shared };
        let wanted = Type {
            shape: written.shape,
            dimension: written.dimension,
            axis: written.axis.map(|axis| (axis, found.axis.map_or(hand, |(_, hand)| hand))),
        };
        let name = &implementation.name.text;
        if wanted == found {
            if declared_as.value.is_none() {
                // The files that declare it, or those that use them, read it.
                self.used.insert(name.clone());
            }
            return true;
        }
        let place = implementation.value.as_ref().map_or(implementation.name.span, |value| value.span);
        self.report(
            Diagnostic::error(codes::WRONG_IMPLEMENTATION, format!("`{name}` is to be {}", describe(wanted)))
                .at(place, format!("this is {}", describe(found)))
                .at(written.span, "its type is written here"),
        );
        false
    }

    /// Checks the latches.
    pub(super) fn latches(&mut self, declared: &Declarations<'_>) {
        for (latch, per_hand) in &declared.latches {
            let name = &latch.name;
            if self.names.values.get(&name.text).is_none_or(|value| value.span != name.span) {
                continue;
            }
            let scope = if *per_hand { Scope::HAND } else { Scope::SHARED }.with_memory();
            let set = self.condition(&latch.set, scope, "a latch is set by");
            let clear = self.condition(&latch.clear, scope, "a latch is cleared by");
            let id = u32::try_from(self.rules.latches.len()).ok();
            let state = match (set, clear, id) {
                (Some(set), Some(clear), Some(id)) => {
                    let (name, span) = (name.text.clone(), name.span);
                    self.rules.latches.push(Latch { name, per_hand: *per_hand, set, clear, span });
                    State::Known(id)
                }
                _ => State::Broken,
            };
            self.names.set_state(&name.text, state);
        }
    }
}

/// The signals that a signal reads, by their positions.
fn read_signals(signal: &syntax::Signal, at: &BTreeMap<&str, usize>) -> BTreeSet<usize> {
    let mut reads = BTreeSet::new();
    if let Some(value) = &signal.value {
        value.walk(&mut |expr| {
            if let ExprKind::Path(path) = &expr.kind {
                let name = path.whose().1.first();
                reads.extend(name.and_then(|name| at.get(name.text.as_str())).copied());
            }
        });
    }
    reads
}
