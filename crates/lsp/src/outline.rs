//! The declarations of a file, as a tree.

use super::lines::Lines;
use lsp_types::{DocumentSymbol, SymbolKind};
use teachtree_base::diagnostic::Span;
use teachtree_language::parse_text;
use teachtree_language::syntax::{Choice, Consequent, Item, ItemKind};

/// The declarations of a text.
pub fn outline(text: &str) -> Vec<DocumentSymbol> {
    let outline = Outline { text, lines: Lines::new(text) };
    let (file, _) = parse_text(text);
    file.items.iter().flat_map(|item| outline.item(item)).collect()
}

struct Outline<'a> {
    text: &'a str,
    lines: Lines,
}

impl Outline<'_> {
    fn item(&self, item: &Item) -> Vec<DocumentSymbol> {
        let one =
            |name: &str, detail: &str, kind, span, inner| vec![self.symbol(name, detail, kind, item.span, span, inner)];
        match &item.kind {
            ItemKind::Use(used) => one(&used.file.text, "use", SymbolKind::File, used.file.span, Vec::new()),
            ItemKind::Stream(channels) => {
                let inner = channels.iter().map(|channel| {
                    self.symbol(
                        &channel.name.text(),
                        "channel",
                        SymbolKind::Field,
                        channel.span,
                        channel.name.span,
                        Vec::new(),
                    )
                });
                one("stream", "", SymbolKind::Namespace, first_word(item.span, "stream"), inner.collect())
            }
            ItemKind::Param(param) => one(&param.name.text, "param", SymbolKind::Constant, param.name.span, Vec::new()),
            ItemKind::Signal(signal) => {
                let detail = if signal.value.is_some() { "signal" } else { "abstract signal" };
                one(&signal.name.text, detail, SymbolKind::Variable, signal.name.span, Vec::new())
            }
            ItemKind::Latch(latch) => one(&latch.name.text, "latch", SymbolKind::Boolean, latch.name.span, Vec::new()),
            ItemKind::ForEachHand(items) => {
                let inner = items.iter().flat_map(|item| self.item(item)).collect();
                one("for each hand", "", SymbolKind::Namespace, first_word(item.span, "for each hand"), inner)
            }
            ItemKind::Primitives(primitives) => {
                let symbol = |name: &teachtree_language::syntax::Name| {
                    self.symbol(&name.text, "primitive", SymbolKind::EnumMember, name.span, name.span, Vec::new())
                };
                primitives.iter().map(|primitive| symbol(&primitive.name)).collect()
            }
            ItemKind::Tree(tree) => {
                one(&tree.name.text, "tree", SymbolKind::Class, tree.name.span, self.choices(&tree.choices))
            }
            ItemKind::Extension(extend) => {
                let name = format!("extend {}", extend.place.text());
                one(&name, "", SymbolKind::Class, extend.place.span, self.choices(&extend.choices))
            }
            ItemKind::Task(task) => one(&task.name.text, "task", SymbolKind::Event, task.name.span, Vec::new()),
            ItemKind::Composite(task) => one(&task.name.text, "task", SymbolKind::Event, task.name.span, Vec::new()),
            ItemKind::TaskExtension(task) => {
                one(&format!("extend task {}", task.name.text), "", SymbolKind::Event, task.name.span, Vec::new())
            }
            ItemKind::Relabel(block) => {
                let name = block.task.as_ref().map_or("relabel".to_string(), |task| format!("relabel {}", task.text));
                one(&name, "", SymbolKind::Namespace, first_word(item.span, "relabel"), Vec::new())
            }
        }
    }

    fn choices(&self, choices: &[Choice]) -> Vec<DocumentSymbol> {
        let symbol = |choice: &Choice| {
            let text = |span: Span| self.text.get(span.start as usize..span.end as usize).unwrap_or("");
            let leaf = match &choice.then {
                Consequent::Primitive(label) | Consequent::EachSide(label) => text(label.span),
                Consequent::Stay => "stay",
                Consequent::Separate => "separate",
                Consequent::Branch(_) => "",
                Consequent::Broken => return None,
            };
            let condition = choice.condition.as_ref().map_or("else".to_string(), |condition| {
                text(condition.span).split_whitespace().collect::<Vec<_>>().join(" ")
            });
            let (name, detail) = match &choice.name {
                Some(name) => (name.text.clone(), condition),
                None => (condition, String::new()),
            };
            let name = if leaf.is_empty() { name } else { format!("{name} => {leaf}") };
            let (kind, below) = match &choice.then {
                Consequent::Branch(below) => (SymbolKind::Object, self.choices(below)),
                _ => (SymbolKind::Key, Vec::new()),
            };
            let last = below_end(choice);
            Some(self.symbol(&name, &detail, kind, choice.span.to(last), choice.span, below))
        };
        choices.iter().filter_map(symbol).collect()
    }

    fn symbol(
        &self,
        name: &str,
        detail: &str,
        kind: SymbolKind,
        whole: Span,
        span: Span,
        below: Vec<DocumentSymbol>,
    ) -> DocumentSymbol {
        let (range, selection) = (self.lines.range(self.text, whole), self.lines.range(self.text, span));
        let detail = (!detail.is_empty()).then(|| detail.to_string());
        let below = (!below.is_empty()).then_some(below);
        DocumentSymbol::new(name.to_string(), detail, kind, None, None, range, selection, below)
    }
}

/// The end of what is below a choice.
fn below_end(choice: &Choice) -> Span {
    match &choice.then {
        Consequent::Branch(below) => below.last().map_or(choice.span, below_end),
        _ => choice.span,
    }
}

/// The words that an item begins with.
fn first_word(span: Span, word: &str) -> Span {
    Span { end: span.end.min(span.start + u32::try_from(word.len()).unwrap_or(0)), ..span }
}
