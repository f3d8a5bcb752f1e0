//! Which name stands where: every declaration with its comments, and every place that names it. From syntax alone, so that it is there for
//! files with mistakes too; a name that nothing declares is not in it.

use super::ops::function;
use super::source::used_file;
use super::syntax::{
    Anchor, Choice, Consequent, Expr, ExprKind, File, Item, ItemKind, Key, Label, Name, Path, RelabelKind,
};
use std::collections::BTreeMap;
use teachtree_base::channels::{DERIVED, derived};
use teachtree_base::diagnostic::{Sources, Span};

/// The meaning of a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// A threshold or duration.
    Param,
    /// A value per frame.
    Signal,
    /// One bit of memory.
    Latch,
    /// A channel of the log, or a derived one.
    Channel,
    /// A primitive.
    Primitive,
    /// A tree.
    Tree,
    /// A choice of a tree.
    Choice,
    /// A task.
    Task,
    /// A function of the language.
    Function,
    /// A rule file.
    File,
}

impl Kind {
    /// As people call it.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Param => "param",
            Self::Signal => "signal",
            Self::Latch => "latch",
            Self::Channel => "channel",
            Self::Primitive => "primitive",
            Self::Tree => "tree",
            Self::Choice => "choice",
            Self::Task => "task",
            Self::Function => "function",
            Self::File => "file",
        }
    }

    /// Things of one space cannot have the same name.
    pub const fn space(self) -> Self {
        match self {
            Self::Signal | Self::Latch => Self::Param,
            other => other,
        }
    }
}

/// A place that declares a name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Declaration {
    /// The name.
    pub name: Span,
    /// The whole declaration.
    pub extent: Span,
    /// The comments right above it and after it, without their slashes.
    pub doc: String,
}

/// A thing that has a name.
#[derive(Clone, Debug)]
pub struct Symbol {
    /// What it is.
    pub kind: Kind,
    /// Its name.
    pub name: String,
    /// The tree of a choice; else empty.
    pub tree: String,
    /// Its declarations: several for an abstract signal and its implementation, none for what is built in.
    pub declared: Vec<Declaration>,
}

/// A place that names a thing, its declarations among them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mention {
    /// The place.
    pub span: Span,
    /// Position in [`Index::symbols`].
    pub symbol: usize,
}

/// The names of a rule set with their places.
#[derive(Clone, Debug, Default)]
pub struct Index {
    /// The named items, in order of declaration.
    pub symbols: Vec<Symbol>,
    /// The occurrences of names, in order of files and places.
    pub mentions: Vec<Mention>,
    by_name: BTreeMap<(Kind, String, String), usize>,
}

/// An occurrence of a name.
enum Occurrence<'a> {
    /// A declaration: what it is, the tree of a choice, the name, the whole of it.
    Declaration(Kind, &'a str, String, Span, Span),
    /// A name whose kind is clear from where it stands: the kind, the tree of a choice, the name.
    Reference(Kind, &'a str, &'a Name),
    /// A name in an expression.
    Value(&'a Path),
    /// The name of a function.
    Call(&'a Path),
}

impl Index {
    /// The names of these files.
    pub fn new(files: &[File], sources: &Sources) -> Self {
        let mut index = Self::default();
        let mut comments: BTreeMap<u32, &[Span]> = BTreeMap::new();
        for file in files {
            if let Some(first) = file.comments.first() {
                comments.insert(first.file, &file.comments);
            }
        }
        walk(files, &mut |met| {
            if let Occurrence::Declaration(kind, tree, name, span, extent) = met {
                let doc = doc(comments.get(&span.file).copied().unwrap_or_default(), sources, extent);
                index.declare(kind, tree, name, Declaration { name: span, extent, doc });
            }
        });
        for channel in DERIVED {
            index.built_in(Kind::Channel, channel.name);
        }
        walk(files, &mut |met| index.visit(&met, sources));
        index.mentions.sort_by_key(|mention| mention.span);
        index
    }

    /// The thing that is named at a byte of a file; at the end of a name too.
    pub fn at(&self, file: u32, offset: u32) -> Option<Mention> {
        let near = |mention: &&Mention| {
            mention.span.file == file && mention.span.start <= offset && offset <= mention.span.end
        };
        // Between two adjacent names, the one that begins here.
        self.mentions.iter().rfind(near).copied()
    }

    /// The symbol of this kind and name; `tree` is empty unless it is a choice.
    pub fn find(&self, kind: Kind, tree: &str, name: &str) -> Option<usize> {
        self.by_name.get(&(kind.space(), tree.to_string(), name.to_string())).copied()
    }

    /// Returns the occurrences of an item's name.
    pub fn places(&self, symbol: usize) -> impl Iterator<Item = Span> {
        self.mentions.iter().filter(move |mention| mention.symbol == symbol).map(|mention| mention.span)
    }

    fn symbol(&mut self, kind: Kind, tree: &str, name: String) -> usize {
        let next = self.symbols.len();
        let at = *self.by_name.entry((kind.space(), tree.to_string(), name.clone())).or_insert(next);
        if at == next {
            self.symbols.push(Symbol { kind, name, tree: tree.to_string(), declared: Vec::new() });
        }
        at
    }

    fn built_in(&mut self, kind: Kind, name: &str) -> usize {
        self.symbol(kind, "", name.to_string())
    }

    fn declare(&mut self, kind: Kind, tree: &str, name: String, declared: Declaration) {
        let at = self.symbol(kind, tree, name);
        self.mentions.push(Mention { span: declared.name, symbol: at });
        if let Some(symbol) = self.symbols.get_mut(at) {
            symbol.declared.push(declared);
        }
    }

    fn visit(&mut self, met: &Occurrence<'_>, sources: &Sources) {
        let found = match met {
            Occurrence::Declaration(..) => None,
            Occurrence::Reference(Kind::File, _, name) => self.used_file(name, sources).map(|at| (at, name.span)),
            Occurrence::Reference(kind, tree, name) => self.find(*kind, tree, &name.text).map(|at| (at, name.span)),
            Occurrence::Call(path) => {
                function(&path.text()).map(|known| (self.built_in(Kind::Function, known.name), path.span))
            }
            Occurrence::Value(path) => self.value(path),
        };
        self.mentions.extend(found.map(|(symbol, span)| Mention { span, symbol }));
    }

    /// Returns the item at the start of a path without its hand: a param, signal or latch, else the longest channel.
    fn value(&self, path: &Path) -> Option<(usize, Span)> {
        let (_, parts) = path.whose();
        let head = parts.first()?;
        if let Some(at) = self.find(Kind::Param, "", &head.text) {
            return Some((at, head.span));
        }
        (1..=parts.len()).rev().find_map(|length| {
            let parts = parts.get(..length)?;
            let at = self.find(Kind::Channel, "", &super::syntax::join(parts))?;
            Some((at, head.span.to(parts.last()?.span)))
        })
    }

    /// The file that a `use` leads to: beside its user, else the one of that name.
    fn used_file(&mut self, name: &Name, sources: &Sources) -> Option<usize> {
        let file = used_file(name, sources)?;
        let found = sources.files.get(file as usize)?.name.clone();
        let symbol = self.symbol(Kind::File, "", found);
        let start = Span { file, start: 0, end: 0 };
        if let Some(symbol) = self.symbols.get_mut(symbol).filter(|symbol| symbol.declared.is_empty()) {
            symbol.declared.push(Declaration { name: start, extent: start, doc: String::new() });
        }
        Some(symbol)
    }
}

impl Symbol {
    /// Returns its documentation: its comments, or the built-in text.
    pub fn doc(&self) -> String {
        // The implementation says how, the abstract signal says what: both are shown.
        let docs: Vec<&str> =
            self.declared.iter().map(|declared| declared.doc.as_str()).filter(|doc| !doc.is_empty()).collect();
        match (docs.as_slice(), self.kind) {
            ([], Kind::Channel) => derived(&self.name).map_or(String::new(), |channel| channel.doc.to_string()),
            ([], Kind::Function) => function(&self.name).map_or(String::new(), |known| known.doc.to_string()),
            _ => docs.join("\n"),
        }
    }
}

/// The comments right above a declaration, and the one after it on its last line.
fn doc(comments: &[Span], sources: &Sources, extent: Span) -> String {
    let between = |start: u32, end: u32| sources.text(Span { start, end, ..extent });
    let words = |comment: &Span| sources.text(*comment).trim_start_matches('/').trim().to_string();
    let first_behind = comments.partition_point(|comment| comment.start < extent.start);
    let mut lines = Vec::new();
    let mut start = extent.start;
    for comment in comments.get(..first_behind).unwrap_or_default().iter().rev() {
        let gap = between(comment.end, start);
        let line = between(0, comment.start).rsplit('\n').next().unwrap_or("");
        if !gap.trim().is_empty() || gap.matches('\n').count() != 1 || !line.trim().is_empty() {
            break;
        }
        lines.insert(0, words(comment));
        start = comment.start;
    }
    let behind = comments.get(comments.partition_point(|comment| comment.start < extent.end));
    let behind = behind.filter(|comment| {
        let gap = between(extent.end, comment.start);
        gap.trim().is_empty() && !gap.contains('\n')
    });
    lines.extend(behind.map(words));
    lines.retain(|line| !line.is_empty());
    lines.join("\n")
}

/// Calls `visit` for every name of the files.
fn walk<'a>(files: &'a [File], visit: &mut dyn FnMut(Occurrence<'a>)) {
    for item in files.iter().flat_map(|file| &file.items) {
        walk_item(item, visit);
    }
}

fn walk_item<'a>(item: &'a Item, visit: &mut dyn FnMut(Occurrence<'a>)) {
    let mut declare =
        |kind, name: &'a Name, extent| visit(Occurrence::Declaration(kind, "", name.text.clone(), name.span, extent));
    match &item.kind {
        ItemKind::Use(used) => {
            let files = std::iter::once(&used.file).chain(&used.before);
            files.for_each(|name| visit(Occurrence::Reference(Kind::File, "", name)));
        }
        ItemKind::Stream(channels) => {
            for channel in channels {
                visit(Occurrence::Declaration(Kind::Channel, "", channel.name.text(), channel.name.span, channel.span));
                channel.default.iter().for_each(|default| walk_expr(default, visit));
            }
        }
        ItemKind::Param(param) => {
            declare(Kind::Param, &param.name, item.span);
            walk_expr(&param.value, visit);
            for end in param.range.iter().flat_map(|(low, high)| [low, high]) {
                walk_expr(end, visit);
            }
        }
        ItemKind::Signal(signal) => {
            declare(Kind::Signal, &signal.name, item.span);
            signal.value.iter().for_each(|value| walk_expr(value, visit));
        }
        ItemKind::Latch(latch) => {
            declare(Kind::Latch, &latch.name, item.span);
            walk_expr(&latch.set, visit);
            walk_expr(&latch.clear, visit);
        }
        ItemKind::ForEachHand(items) => items.iter().for_each(|item| walk_item(item, visit)),
        ItemKind::Primitives(primitives) => {
            primitives.iter().for_each(|primitive| declare(Kind::Primitive, &primitive.name, item.span));
        }
        ItemKind::Tree(tree) => {
            declare(Kind::Tree, &tree.name, tree.head);
            tree.settle.iter().for_each(|settle| walk_expr(settle, visit));
            walk_choices(&tree.choices, &tree.name.text, visit);
        }
        ItemKind::Extension(extend) => {
            let tree = extend.place.parts.first().map_or("", |tree| tree.text.as_str());
            for (at, part) in extend.place.parts.iter().enumerate() {
                let (kind, of) = if at == 0 { (Kind::Tree, "") } else { (Kind::Choice, tree) };
                visit(Occurrence::Reference(kind, of, part));
            }
            if let Anchor::Before(name) | Anchor::After(name) = &extend.anchor {
                let is_primitive = name.text.starts_with(|c: char| c.is_ascii_uppercase());
                let (kind, of) = if is_primitive { (Kind::Primitive, "") } else { (Kind::Choice, tree) };
                visit(Occurrence::Reference(kind, of, name));
            }
            walk_choices(&extend.choices, tree, visit);
        }
        ItemKind::Task(task) => {
            declare(Kind::Task, &task.name, item.span);
            [&task.first, &task.last].into_iter().chain(&task.without).for_each(|label| walk_label(label, visit));
            task.keys.iter().for_each(|key| walk_key(key, visit));
            task.before.iter().for_each(|before| visit(Occurrence::Reference(Kind::Task, "", before)));
        }
        ItemKind::Composite(composite) => {
            declare(Kind::Task, &composite.name, item.span);
            composite.parts.iter().for_each(|(task, _)| visit(Occurrence::Reference(Kind::Task, "", task)));
        }
        ItemKind::TaskExtension(extension) => {
            visit(Occurrence::Reference(Kind::Task, "", &extension.name));
            extension.keys.iter().for_each(|key| walk_key(key, visit));
        }
        ItemKind::Relabel(block) => {
            block.task.iter().for_each(|task| visit(Occurrence::Reference(Kind::Task, "", task)));
            block.rules.iter().for_each(|rule| walk_relabel(&rule.kind, visit));
        }
    }
}

fn walk_choices<'a>(choices: &'a [Choice], tree: &'a str, visit: &mut dyn FnMut(Occurrence<'a>)) {
    for choice in choices {
        if let Some(name) = &choice.name {
            visit(Occurrence::Declaration(Kind::Choice, tree, name.text.clone(), name.span, choice.span));
        }
        choice.condition.iter().for_each(|condition| walk_expr(condition, visit));
        match &choice.then {
            Consequent::Primitive(label) | Consequent::EachSide(label) => walk_label(label, visit),
            Consequent::Branch(below) => walk_choices(below, tree, visit),
            Consequent::Stay | Consequent::Separate | Consequent::Broken => {}
        }
    }
}

fn walk_label<'a>(label: &'a Label, visit: &mut dyn FnMut(Occurrence<'a>)) {
    visit(Occurrence::Reference(Kind::Primitive, "", &label.name));
}

fn walk_key<'a>(key: &'a Key, visit: &mut dyn FnMut(Occurrence<'a>)) {
    walk_label(&key.label, visit);
    key.demands.iter().for_each(|(_, demand)| walk_expr(demand, visit));
}

fn walk_relabel<'a>(rule: &'a RelabelKind, visit: &mut dyn FnMut(Occurrence<'a>)) {
    let mut labels = |labels: &'a [Label]| labels.iter().for_each(|label| walk_label(label, visit));
    match rule {
        RelabelKind::Between { what, shorter, between, other, becomes, .. } => {
            labels(what);
            for (before, behind) in [Some(between), other.as_ref()].into_iter().flatten() {
                labels(before);
                labels(behind);
            }
            labels(becomes.as_slice());
            shorter.iter().for_each(|shorter| walk_expr(shorter, visit));
        }
        RelabelKind::Become { what, becomes } => {
            labels(what);
            labels(std::slice::from_ref(becomes));
        }
        RelabelKind::Sequence { elements, becomes } => {
            elements.iter().for_each(|(element, _)| labels(element));
            labels(std::slice::from_ref(becomes));
        }
        RelabelKind::Separate { what, without } => {
            labels(std::slice::from_ref(what));
            labels(without);
        }
    }
}

fn walk_expr<'a>(expr: &'a Expr, visit: &mut dyn FnMut(Occurrence<'a>)) {
    expr.walk(&mut |part| match &part.kind {
        ExprKind::Path(path) => visit(Occurrence::Value(path)),
        ExprKind::Call(function, _) | ExprKind::Summary(function, ..) => visit(Occurrence::Call(function)),
        ExprKind::From(labels, _) => labels.iter().for_each(|label| walk_label(label, visit)),
        _ => {}
    });
}
