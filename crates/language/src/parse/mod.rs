//! From text to syntax tree. A linear scan finds words and brackets, the file is split into pieces at the words that begin a declaration
//! (inside blocks: a signal, a choice, a rule), and pest parses each piece alone, so that every mistake is reported at its own place.

mod candidates;
mod declarations;
mod expressions;
mod grammar;
mod mistakes;
mod piece;
mod scan;
mod tasks;
mod trees;
mod words;

use super::codes;
use super::resolve::nearest;
use super::syntax::{File, Item, ItemKind, RelabelBlock, Tree};
pub use candidates::{Candidate, candidates};
use expressions::Builder;
use grammar::{Grammar, Rule};
use pest::Parser as _;
use piece::Piece;
use scan::{HAND_WORDS, ITEM_WORDS, Kind, Scan};
use std::ops::Range;
use teachtree_base::diagnostic::{Diagnostic, Span};
use teachtree_base::units;

/// Parses a file. Whatever the text is, the rest of it is read after a mistake.
pub fn parse(text: &str, file: u32) -> (File, Vec<Diagnostic>) {
    let mut findings = Vec::new();
    let scan = Scan::new(text, file, &mut findings);
    let mut parser = Parser { scan, findings, broken: Vec::new(), cursor: None };
    let items = parser.items(0..parser.scan.tokens.len(), Level::File);
    let file = File { items, comments: parser.scan.comments, broken: parser.broken, is_cut: parser.scan.is_cut };
    (file, parser.findings)
}

/// Reads `number unit`, as an override gives it: the value in SI, its dimension and whether no unit is written.
pub fn quantity(text: &str) -> Option<(f64, units::Dimension, bool)> {
    let text = text.trim();
    let digits = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | '+' | 'e' | 'E');
    let end = (0..=text.len()).rev().find(|end| {
        text.get(..*end).is_some_and(|head| head.trim_end().ends_with(digits) && head.trim_end().parse::<f64>().is_ok())
    })?;
    let number: f64 = text.get(..end)?.trim_end().parse().ok()?;
    let unit = text.get(end..)?.trim();
    let (in_si, dimension) = units::compound(unit).ok()?;
    let value = number * in_si;
    value.is_finite().then_some((value, dimension, unit.is_empty()))
}

/// Whether a text is a name of a value, tree, choice or task.
pub fn is_name(text: &str) -> bool {
    is_whole(Rule::name, text)
}

/// Whether a text is a name of a primitive.
pub fn is_primitive(text: &str) -> bool {
    is_whole(Rule::primitive_name, text)
}

fn is_whole(rule: Rule, text: &str) -> bool {
    Grammar::parse(rule, text).is_ok_and(|mut pairs| pairs.next().is_some_and(|pair| pair.as_str() == text))
}

/// The context of declarations.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Level {
    File,
    Hand,
}

/// Walks over the tokens of a file.
struct Parser<'a> {
    scan: Scan<'a>,
    findings: Vec<Diagnostic>,
    broken: Vec<String>,
    /// Where an author is writing, and what is known of the piece there; none when a whole file is read.
    cursor: Option<candidates::Cursor>,
}

impl<'a> Parser<'a> {
    /// Parses one piece and builds syntax from it.
    fn piece<T>(
        &mut self,
        tokens: Range<usize>,
        rule: Rule,
        build: impl FnOnce(&mut Builder<'_, 'a, '_>, expressions::RulePair<'a>) -> Option<T>,
    ) -> Option<T> {
        if let Some(cursor) = self.cursor.as_mut().filter(|cursor| tokens.contains(&cursor.token)) {
            cursor.look(&self.scan, tokens, rule);
            return None;
        }
        let (piece, mut pairs) = Piece::parse(&self.scan, tokens, rule, &mut self.findings)?;
        let pair = pairs.next()?;
        build(&mut Builder { piece, findings: &mut self.findings }, pair)
    }

    /// The declarations among these tokens.
    fn items(&mut self, tokens: Range<usize>, level: Level) -> Vec<Item> {
        let mut items = Vec::new();
        let mut at = tokens.start;
        if let Some(cursor) = self.cursor.as_mut().filter(|cursor| tokens.contains(&cursor.token)) {
            cursor.level = level;
        }
        while at < tokens.end {
            let first = at;
            let (kind, end) = self.item(at, tokens.end, level);
            at = end.max(first + 1);
            items.extend(kind.map(|kind| Item { doc: self.doc(first), kind, span: self.scan.span(first, at) }));
        }
        items
    }

    /// The declaration that begins at `at`, and the token after it.
    fn item(&mut self, at: usize, end: usize, level: Level) -> (Option<ItemKind>, usize) {
        let next = self.next_item(at + 1, end);
        let word = self.scan.word(at);
        let simple = |rule| (rule, at..next);
        let (rule, tokens) = match (word, level) {
            ("signal", _) => simple(Rule::only_signal),
            ("latch", _) => simple(Rule::only_latch),
            ("use", Level::File) => simple(Rule::only_use),
            ("param", Level::File) => simple(Rule::only_param),
            ("primitive", Level::File) => simple(Rule::only_primitives),
            ("task", Level::File) => simple(Rule::only_task),
            ("extend", Level::File) if self.scan.word(at + 1) == "task" => simple(Rule::only_extend_task),
            ("stream" | "tree" | "extend" | "relabel" | "for", Level::File) if self.scan.begins_item(at) => {
                return self.block(at, next);
            }
            _ => return (None, self.unknown_item(at, next, level)),
        };
        let item = self.piece(tokens.clone(), rule, |builder, pair| builder.item(pair));
        if item.is_none() {
            self.break_names(tokens);
        }
        (item, next)
    }

    /// The declaration with braces that begins at `at`, and the token after its closing brace; the next declaration begins at `next`.
    fn block(&mut self, at: usize, next: usize) -> (Option<ItemKind>, usize) {
        let open = (at..next).find(|at| self.scan.word(*at) == "{");
        let (head, body) = match open {
            Some(open) => {
                (at..open + 1, open + 1..self.scan.tokens.get(open).map_or(next, |open| open.partner.min(next)))
            }
            None => (at..next, next..next),
        };
        let behind = open.map_or(next, |open| self.scan.behind(open));
        let brace = open.unwrap_or(next);
        let item = match self.scan.word(at) {
            "stream" => {
                self.head(head, Rule::only_stream_head, |_, _| Some(()));
                Some(ItemKind::Stream(self.channels(body, false)))
            }
            "for" => {
                self.head(head, Rule::only_hands_head, |_, _| Some(()));
                Some(ItemKind::ForEachHand(self.items(body, Level::Hand)))
            }
            "relabel" => {
                let task = self.head(head, Rule::only_relabel_head, |builder, pair| Some(builder.relabel_task(pair)));
                let rules = self.relabels(body);
                task.map(|task| ItemKind::Relabel(RelabelBlock { task, rules }))
            }
            "extend" => {
                let extend = self.head(head, Rule::only_extend_head, |builder, pair| builder.extend(pair));
                let choices = self.branch_choices(brace, body);
                extend.map(|mut extend| {
                    extend.choices = choices;
                    ItemKind::Extension(extend)
                })
            }
            _ => {
                let tree = self.head(head.clone(), Rule::only_tree_head, |builder, pair| builder.tree(pair));
                let choices = self.branch_choices(brace, body);
                if tree.is_none() {
                    self.break_names(head);
                }
                tree.map(|tree| ItemKind::Tree(Tree { choices, ..tree }))
            }
        };
        (item, behind.min(next).max(at + 1))
    }

    /// A head, whose own brace may be the faulty one: then the words before it are read as if it were whole.
    fn head<T>(
        &mut self,
        tokens: Range<usize>,
        rule: Rule,
        build: impl FnOnce(&mut Builder<'_, 'a, '_>, expressions::RulePair<'a>) -> Option<T>,
    ) -> Option<T> {
        let brace = tokens.end.checked_sub(1).filter(|last| self.scan.word(*last) == "{");
        if let Some(token) = brace.and_then(|brace| self.scan.tokens.get_mut(brace)) {
            token.faulty = false;
        }
        self.piece(tokens, rule, build)
    }

    /// Something that begins no declaration. Returns where the next one begins.
    fn unknown_item(&mut self, at: usize, next: usize, level: Level) -> usize {
        self.break_names(at..next);
        let place = self.scan.span(at, at + 1);
        let word = self.scan.word(at);
        if self.scan.tokens.get(at).is_some_and(|token| token.faulty) {
            return next;
        }
        if level == Level::Hand && self.scan.begins_item(at) {
            let message = format!("`{word}` does not belong in `for each hand`");
            let finding = Diagnostic::error(codes::NO_DECLARATION, message).at(place, "only signals and latches do");
            self.findings.push(finding.help("move it out of the braces"));
            return next;
        }
        let known = || HAND_WORDS.iter().chain(ITEM_WORDS.iter().filter(|_| level == Level::File)).copied();
        let finding = Diagnostic::error(codes::NO_DECLARATION, format!("no declaration begins with `{word}`"))
            .at(place, "expected a declaration");
        self.findings.push(match nearest(word, known()) {
            Some(near) => finding.fix(format!("did you mean `{near}`?"), place, near),
            None => finding.help(format!("declarations begin with {}", known().collect::<Vec<_>>().join(", "))),
        });
        next
    }

    /// Returns the start of the next declaration at this level.
    fn next_item(&self, from: usize, end: usize) -> usize {
        let mut at = from;
        while at < end {
            if self.scan.begins_item(at) || self.looks_like_item(at) {
                return at;
            }
            let is_open = self.scan.tokens.get(at).is_some_and(|token| token.kind == Kind::Open);
            at = if is_open { self.scan.behind(at) } else { at + 1 };
        }
        end
    }

    /// Whether a mistyped declaration begins here: a line with two names in a row, which stand so nowhere else, the first one near to a
    /// word that begins declarations.
    fn looks_like_item(&self, at: usize) -> bool {
        let operators = [
            "and", "or", "above", "below", "until", "for", "within", "in", "set", "clear", "becomes", "become",
            "between",
        ];
        let is_word = |at: usize| self.scan.tokens.get(at).is_some_and(|token| token.kind == Kind::Word);
        self.scan.leads(at)
            && is_word(at)
            && is_word(at + 1)
            && !operators.contains(&self.scan.word(at))
            && !operators.contains(&self.scan.word(at + 1))
            && nearest(self.scan.word(at), HAND_WORDS.iter().chain(ITEM_WORDS).copied()).is_some()
    }

    /// Remembers the names that an unreadable piece declares: the words that stand after its first one.
    fn break_names(&mut self, tokens: Range<usize>) {
        let many = self.scan.word(tokens.start) == "primitive";
        let words: Vec<String> = tokens
            .skip(1)
            .filter(|at| self.scan.tokens.get(*at).is_some_and(|token| token.kind == Kind::Word))
            .take(if many { usize::MAX } else { 1 })
            .map(|at| self.scan.word(at).to_string())
            .collect();
        self.broken.extend(words);
    }

    /// The `///` lines right above the token.
    fn doc(&self, at: usize) -> Option<Span> {
        let start = self.scan.tokens.get(at)?.start;
        let floor = at.checked_sub(1).and_then(|before| self.scan.tokens.get(before)).map_or(0, |token| token.end);
        let above = self.scan.comments.partition_point(|comment| (comment.start as usize) < start);
        let comments = self.scan.comments.get(..above)?;
        let is_doc = |comment: &&Span| {
            let text = self.scan.text.get(comment.start as usize..comment.end as usize).unwrap_or("");
            comment.start as usize >= floor && text.starts_with("///")
        };
        let mut lines = comments.iter().rev().take_while(is_doc);
        let last = *lines.next()?;
        Some(lines.fold(last, |all, line| all.to(*line)))
    }
}
