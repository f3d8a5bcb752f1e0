//! The declarations of the files, and the meaning of each name.

use super::Resolver;
use crate::codes;
use crate::ops;
use crate::rules::Primitive;
use crate::source::SHIPPED;
use crate::syntax::{self, File, Item, ItemKind};
use indexmap::IndexMap;
use std::collections::{BTreeMap, BTreeSet};
use teachtree_base::channels::{ChannelSpec, DERIVED};
use teachtree_base::diagnostic::{Diagnostic, Span};
use teachtree_base::hands::Side;
use teachtree_base::units;

/// All declarations in order of evaluation, by kind.
#[derive(Default)]
pub struct Declarations<'a> {
    pub channels: Vec<&'a syntax::Channel>,
    pub params: Vec<&'a syntax::Param>,
    pub signals: Vec<(&'a syntax::Signal, bool)>,
    pub latches: Vec<(&'a syntax::Latch, bool)>,
    pub primitives: Vec<&'a syntax::Primitive>,
    pub trees: Vec<&'a syntax::Tree>,
    pub extends: Vec<&'a syntax::Extension>,
    pub tasks: Vec<(&'a syntax::Task, Span)>,
    pub composites: Vec<(&'a syntax::Composite, Span)>,
    pub task_extensions: Vec<&'a syntax::TaskExtension>,
    pub relabels: Vec<&'a syntax::RelabelBlock>,
    /// Files whose extensions come before those of others.
    pub orders: Vec<(&'a syntax::Name, &'a syntax::Name)>,
}

impl<'a> Declarations<'a> {
    /// Sorts the declarations of the files by kind.
    pub fn collect(files: &[&'a File]) -> Self {
        let mut declared = Self::default();
        for item in files.iter().flat_map(|file| &file.items) {
            declared.item(item, false);
        }
        declared
    }

    fn item(&mut self, item: &'a Item, per_hand: bool) {
        match &item.kind {
            ItemKind::Use(used) => {
                self.orders.extend(used.before.as_ref().map(|before| (&used.file, before)));
            }
            ItemKind::Stream(channels) => self.channels.extend(channels),
            ItemKind::Param(param) => self.params.push(param),
            ItemKind::Signal(signal) => self.signals.push((signal, per_hand)),
            ItemKind::Latch(latch) => self.latches.push((latch, per_hand)),
            ItemKind::ForEachHand(items) => items.iter().for_each(|item| self.item(item, true)),
            ItemKind::Primitives(primitives) => self.primitives.extend(primitives),
            ItemKind::Tree(tree) => self.trees.push(tree),
            ItemKind::Extension(extend) => self.extends.push(extend),
            ItemKind::Task(task) => self.tasks.push((task, item.span)),
            ItemKind::Composite(composite) => self.composites.push((composite, item.span)),
            ItemKind::TaskExtension(extension) => self.task_extensions.push(extension),
            ItemKind::Relabel(block) => self.relabels.push(block),
        }
    }
}

/// The meanings of the names of a rule set.
#[derive(Default)]
pub struct Names {
    /// Params, signals and latches.
    pub values: BTreeMap<String, Value>,
    /// Every channel that may be read: declared in `stream`, or derived.
    pub channels: IndexMap<String, ChannelSpec>,
    /// The first words of their names.
    pub channel_heads: BTreeSet<String>,
    /// Names whose declarations could not be read.
    pub broken: BTreeSet<String>,
    /// Whether a used file is missing.
    pub incomplete: bool,
}

/// A param, signal or latch.
#[derive(Clone, Copy, Debug)]
pub struct Value {
    /// Which of them.
    pub what: ValueKind,
    /// Whether every hand has its own.
    pub per_hand: bool,
    /// The name in its declaration.
    pub span: Span,
    /// Whether it is known yet.
    pub state: State,
}

/// A kind of value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ValueKind {
    /// A param.
    Param,
    /// A signal.
    Signal,
    /// A latch.
    Latch,
}

/// The state of a value's resolution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// Not resolved yet.
    Waiting,
    /// Its position in the list of its kind.
    Known(u32),
    /// Invalid and reported.
    Broken,
}

impl Names {
    /// The channel with this name.
    pub fn channel(&self, name: &str) -> Option<&ChannelSpec> {
        self.channels.get(name)
    }

    /// Sets how far a value is.
    pub fn set_state(&mut self, name: &str, state: State) {
        if let Some(value) = self.values.get_mut(name) {
            value.state = state;
        }
    }
}

impl Resolver {
    /// Gives every param, signal, latch and primitive its name; channels are declared already.
    pub(super) fn declare_names(&mut self, declared: &Declarations<'_>) {
        for param in &declared.params {
            self.declare(&param.name, ValueKind::Param, false);
        }
        // An abstract signal gives way to its implementation.
        let implemented: BTreeSet<&str> = declared
            .signals
            .iter()
            .filter(|(signal, _)| signal.value.is_some())
            .map(|(signal, _)| signal.name.text.as_str())
            .collect();
        let declarations: BTreeMap<&str, (&syntax::Name, bool)> = declared
            .signals
            .iter()
            .filter(|(signal, _)| signal.value.is_none())
            .map(|(signal, per_hand)| (signal.name.text.as_str(), (&signal.name, *per_hand)))
            .collect();
        let mut missing: BTreeSet<&str> = BTreeSet::new();
        let mut misplaced: BTreeSet<&str> = BTreeSet::new();
        for (signal, per_hand) in &declared.signals {
            let name = signal.name.text.as_str();
            if signal.value.is_some() {
                let declaration = declarations.get(name).filter(|(_, declared_per_hand)| declared_per_hand != per_hand);
                match declaration.filter(|_| !self.names.values.contains_key(name)) {
                    Some((declaration, declared_per_hand)) if misplaced.insert(name) => {
                        self.wrong_hand(&signal.name, declaration, *declared_per_hand);
                    }
                    _ if misplaced.contains(name) => {}
                    _ => self.declare(&signal.name, ValueKind::Signal, *per_hand),
                }
            } else if !implemented.contains(name) && missing.insert(name) {
                self.declare(&signal.name, ValueKind::Signal, *per_hand);
                self.not_implemented(&signal.name);
            }
        }
        for (latch, per_hand) in &declared.latches {
            self.declare(&latch.name, ValueKind::Latch, *per_hand);
        }
        for primitive in &declared.primitives {
            let name = &primitive.name;
            if let Some(first) =
                self.rules.primitives.iter().find(|known| known.name == name.text).map(|known| known.span)
            {
                self.declared_twice("primitive", name, first);
            } else {
                let (name, span) = (name.text.clone(), name.span);
                self.rules.primitives.push(Primitive {
                    name,
                    sided: primitive.sided,
                    is: None,
                    does: None,
                    other: None,
                    span,
                });
            }
        }
        self.kinds_and_meanings(&declared.primitives);
    }

    fn declare(&mut self, name: &syntax::Name, what: ValueKind, per_hand: bool) {
        let word = name.text.as_str();
        let meaning = if units::unit(word).is_some() {
            Some("a unit")
        } else if Side::from_name(word).is_some() {
            Some("a hand")
        } else if ops::function(word).is_some() {
            Some("a function")
        } else if self.names.channel_heads.contains(word) {
            Some("a channel")
        } else {
            None
        };
        if let Some(meaning) = meaning {
            let mut finding = Diagnostic::error(codes::NAME_TAKEN, format!("`{word}` is {meaning} already"))
                .at(name.span, "choose another name");
            if let Some(derived) = DERIVED.iter().find(|derived| derived.name == word) {
                finding = finding.note(format!("`{word}` is {}", derived.doc));
            }
            self.report(finding);
            self.names.broken.insert(name.text.clone());
            return;
        }
        if let Some(first) = self.names.values.get(word) {
            let span = first.span;
            self.declared_twice("value", name, span);
            return;
        }
        let value = Value { what, per_hand, span: name.span, state: State::Waiting };
        self.names.values.insert(name.text.clone(), value);
    }

    /// Reports a name that is declared twice.
    pub fn declared_twice(&mut self, kind: &str, name: &syntax::Name, first: Span) {
        let finding = Diagnostic::error(codes::DECLARED_TWICE, format!("there is a {kind} `{}` already", name.text))
            .at(name.span, "declared again here")
            .at(first, "first declared here");
        self.report(finding);
    }

    /// Reports an abstract signal for each hand that is implemented for none, or the other way round; its name is broken.
    fn wrong_hand(&mut self, implementation: &syntax::Name, declaration: &syntax::Name, per_hand: bool) {
        self.names.broken.insert(implementation.text.clone());
        let (wanted, found) = if per_hand { ("each hand", "no hand") } else { ("no hand", "each hand") };
        let message = format!("the abstract signal `{}` is declared for {wanted}", implementation.text);
        let finding = Diagnostic::error(codes::WRONG_IMPLEMENTATION, message)
            .at(implementation.span, format!("implemented for {found}"))
            .at(declaration.span, "declared here");
        self.report(if per_hand { finding.help("put it into `for each hand { … }`") } else { finding });
    }

    fn not_implemented(&mut self, name: &syntax::Name) {
        self.names.set_state(&name.text, State::Broken);
        if self.names.incomplete || self.names.broken.contains(&name.text) {
            return;
        }
        let hands: Vec<String> = SHIPPED
            .iter()
            .filter(|(file, _)| file.starts_with("hand_"))
            .map(|(file, _)| format!("`rules/{file}`"))
            .collect();
        let finding = Diagnostic::error(
            codes::NOT_IMPLEMENTED,
            format!("no file implements the abstract signal `{}`", name.text),
        )
        .at(name.span, "declared here")
        .help(format!("load a hand model that declares `signal {} = …`: {}", name.text, hands.join(", ")));
        self.report(finding);
    }
}
