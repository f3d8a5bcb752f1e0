//! Completion: the grammar determines the possible kinds of words, and the index lists the words.

use super::hover::kind;
use super::workspace::{RuleSet, Spot, rule_files};
use lsp_types::{CompletionItem, CompletionItemKind, Range, TextEdit};
use teachtree_base::channels::Shape;
use teachtree_base::diagnostic::Span;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::meaning::Meaning;
use teachtree_base::units::UNITS;
use teachtree_language::index::{Kind, Symbol};
use teachtree_language::syntax::HandPrefix;
use teachtree_language::{Candidate, SHIPPED, candidates, ops};

/// Compound units that are proposed beside the simple ones.
const COMPOUND: &[&str] = &["m/s", "mm/s", "mm/s^2", "m/s^2", "rad/s", "deg/s", "N m", "N/s"];

/// What may be written at a place.
pub fn complete(spot: &Spot) -> Vec<CompletionItem> {
    let rule_set = &spot.rule_set;
    let text = rule_set.text(spot.file);
    let cursor = spot.offset as usize;
    let (start, wanted) = candidates(text, cursor);
    let written = text.get(start..cursor).unwrap_or("");
    let is_path = !wanted.contains(&Candidate::File);
    // Only the part after the last dot is replaced.
    let before = if is_path { written.rfind('.').map_or("", |dot| written.split_at(dot + 1).0) } else { "" };
    let place = |offset: usize| u32::try_from(offset).unwrap_or(u32::MAX);
    let span = Span { file: spot.file, start: place(start + before.len()), end: spot.offset };
    let mut list = List { rule_set, before, range: rule_set.range(span), items: Vec::new() };
    for wanted in &wanted {
        match wanted {
            Candidate::Value => list.values(),
            Candidate::Tree => list.trees(),
            Candidate::File => list.files(spot),
            _ if !before.is_empty() => {}
            Candidate::Word(word) => list.plain(word, CompletionItemKind::Keyword),
            Candidate::Operator(words) => list.operator(words),
            Candidate::Primitive => list.symbols(Kind::Primitive, CompletionItemKind::EnumMember),
            Candidate::Meaning => list.meanings(),
            Candidate::Task => list.symbols(Kind::Task, CompletionItemKind::Event),
            Candidate::Choice(branch) => list.anchors(branch),
            Candidate::Unit => {
                UNITS.iter().for_each(|unit| list.plain(unit.symbol, CompletionItemKind::Unit));
                COMPOUND.iter().for_each(|unit| list.plain(unit, CompletionItemKind::Unit));
            }
            Candidate::Finger => {
                let names = Finger::ALL.iter().map(ToString::to_string).chain(["opposing", "tips"].map(str::to_string));
                names.for_each(|finger| list.plain(&finger, CompletionItemKind::EnumMember));
            }
            Candidate::Component => list.components(),
        }
    }
    list.items
}

struct List<'a> {
    rule_set: &'a RuleSet,
    /// The text before the word, with its dot.
    before: &'a str,
    range: Range,
    items: Vec<CompletionItem>,
}

impl List<'_> {
    fn push(&mut self, item: CompletionItem) {
        if self.items.iter().any(|known| known.label == item.label) {
            return;
        }
        let edit = TextEdit { range: self.range, new_text: item.label.clone() };
        // Names before the words of the language.
        let group = if item.kind == Some(CompletionItemKind::Keyword) { '2' } else { '1' };
        self.items.push(CompletionItem {
            sort_text: Some(format!("{group}{}", item.label)),
            text_edit: Some(edit.into()),
            ..item
        });
    }

    fn plain(&mut self, label: &str, kind: CompletionItemKind) {
        self.push(CompletionItem { label: label.to_string(), kind: Some(kind), ..CompletionItem::default() });
    }

    /// An operator over time by its first words.
    fn operator(&mut self, words: &str) {
        let operator = ops::OPERATORS.iter().find(|operator| {
            let begins =
                operator.name == words || operator.name.strip_prefix(words).is_some_and(|rest| rest.starts_with(' '));
            begins && !operator.is_called()
        });
        self.push(CompletionItem {
            label: words.to_string(),
            kind: Some(CompletionItemKind::Keyword),
            detail: operator.map(|operator| operator.calls().join(", ")),
            documentation: operator.map(|operator| operator.doc.to_string().into()),
            ..CompletionItem::default()
        });
    }

    fn symbol(&mut self, label: &str, symbol: &Symbol, icon: CompletionItemKind) {
        let rules = &self.rule_set.survey.rules;
        let doc = Some(symbol.doc()).filter(|doc| !doc.is_empty());
        self.push(CompletionItem {
            label: label.to_string(),
            kind: Some(icon),
            detail: Some(kind(rules, symbol).unwrap_or_else(|| symbol.kind.word().to_string())),
            documentation: doc.map(Into::into),
            ..CompletionItem::default()
        });
    }

    fn symbols(&mut self, kind: Kind, icon: CompletionItemKind) {
        let rule_set = self.rule_set;
        for symbol in rule_set.survey.index.symbols.iter().filter(|symbol| symbol.kind == kind) {
            self.symbol(&symbol.name, symbol, icon);
        }
    }

    /// The actions of a hand in a primitive.
    fn meanings(&mut self) {
        for meaning in Meaning::ALL {
            self.push(CompletionItem {
                label: meaning.name().to_string(),
                kind: Some(CompletionItemKind::EnumMember),
                documentation: Some(meaning.doc().to_string().into()),
                ..CompletionItem::default()
            });
        }
    }

    /// Params, signals, latches, channels and functions, each as a continuation of the written text.
    fn values(&mut self) {
        let rule_set = self.rule_set;
        let (side, before) = match self.before.split_once('.') {
            Some((word, behind)) if HandPrefix::from_name(word).is_some() => (Some(word), behind),
            _ => (None, self.before),
        };
        for symbol in &rule_set.survey.index.symbols {
            let icon = match symbol.kind {
                Kind::Param => CompletionItemKind::Constant,
                Kind::Signal | Kind::Latch => CompletionItemKind::Variable,
                Kind::Channel => CompletionItemKind::Field,
                _ => continue,
            };
            if side.is_some() && is_shared(rule_set, symbol) {
                continue;
            }
            if let Some(rest) = symbol.name.strip_prefix(before) {
                self.symbol(rest, symbol, icon);
            }
        }
        if !before.is_empty() {
            self.components();
        } else if side.is_none() {
            for function in ops::functions() {
                self.push(CompletionItem {
                    label: function.name.to_string(),
                    kind: Some(CompletionItemKind::Function),
                    detail: Some(function.calls().join(", ")),
                    documentation: Some(function.doc.to_string().into()),
                    ..CompletionItem::default()
                });
            }
            let hands = Side::BOTH.map(Side::name).into_iter().chain(HandPrefix::WORDS);
            hands.for_each(|hand| self.plain(hand, CompletionItemKind::Keyword));
        }
    }

    /// The components of a vec3, where what is written is one or is not known.
    fn components(&mut self) {
        let rules = &self.rule_set.survey.rules;
        let name = self.before.trim_end_matches('.');
        let name = name
            .split_once('.')
            .filter(|(word, _)| HandPrefix::from_name(word).is_some())
            .map_or(name, |(_, name)| name);
        let signal = rules.signals.iter().find(|signal| signal.name == name).map(|signal| signal.ty.shape);
        let channel = rules.channels.iter().find(|channel| channel.name == name).map(|channel| channel.shape);
        let derived = teachtree_base::channels::derived(name).map(|channel| channel.shape);
        let shape = signal.or(channel).or(derived);
        let unknown = shape.is_none()
            && !self.rule_set.survey.index.symbols.iter().any(|symbol| symbol.name.starts_with(self.before));
        if shape == Some(Shape::Vec3) || unknown {
            ["x", "y", "z"].iter().for_each(|component| self.plain(component, CompletionItemKind::Property));
        }
    }

    /// Trees, and after a tree's name its branches.
    fn trees(&mut self) {
        let Some(tree) = self.before.strip_suffix('.') else {
            return self.symbols(Kind::Tree, CompletionItemKind::Class);
        };
        self.choices(tree, true);
    }

    /// The names for `before` and `after`: choices, and primitives of leaves.
    fn anchors(&mut self, branch: &str) {
        let tree = branch.split('.').next().unwrap_or(branch);
        self.choices(tree, false);
        self.symbols(Kind::Primitive, CompletionItemKind::EnumMember);
    }

    fn choices(&mut self, tree: &str, branches: bool) {
        let rule_set = self.rule_set;
        let choices =
            rule_set.survey.index.symbols.iter().filter(|symbol| symbol.kind == Kind::Choice && symbol.tree == tree);
        for symbol in choices {
            let heads = |symbol: &Symbol| {
                symbol.declared.iter().any(|at| rule_set.survey.sources.text(at.extent).trim_end().ends_with('{'))
            };
            if !branches || heads(symbol) {
                self.symbol(&symbol.name, symbol, CompletionItemKind::Property);
            }
        }
    }

    /// Files beside this one, and those that come with the program.
    fn files(&mut self, spot: &Spot) {
        let own = self.rule_set.path(spot.file);
        let beside = own.and_then(|path| path.parent()).map(rule_files).unwrap_or_default();
        let beside =
            beside.iter().filter(|path| Some(path.as_path()) != own).filter_map(|path| path.file_name()?.to_str());
        let names = beside.chain(SHIPPED.iter().map(|(name, _)| *name));
        names.for_each(|name| self.plain(name, CompletionItemKind::File));
    }
}

/// Whether a symbol is declared once, not per hand, as far as the survey shows.
fn is_shared(rule_set: &RuleSet, symbol: &Symbol) -> bool {
    let (rules, name) = (&rule_set.survey.rules, symbol.name.as_str());
    let per_hand = match symbol.kind {
        Kind::Signal => rules.signals.iter().find(|signal| signal.name == name).map(|signal| signal.per_hand),
        Kind::Latch => rules.latches.iter().find(|latch| latch.name == name).map(|latch| latch.per_hand),
        Kind::Channel => teachtree_base::channels::derived(name).map(|channel| channel.per_hand),
        _ => Some(false),
    };
    per_hand == Some(false)
}
