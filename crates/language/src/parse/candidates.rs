//! What may stand where an author is writing, as the grammar says it: the text up to there is read with a sign after it that fits nowhere,
//! and what pest expected instead of that sign is the answer. The text that follows is not read and may contain errors.

use super::grammar::{Grammar, MAX_TOKENS, Rule};
use super::scan::{HAND_WORDS, ITEM_WORDS, Kind, Scan};
use super::words::keyword;
use super::{Level, Parser};
use pest::Parser as _;
use pest::error::{ErrorVariant, InputLocation};
use std::ops::Range;
use teachtree_base::units;

/// The sign that fits nowhere.
const NOWHERE: char = '\u{1}';

/// A kind of word that the grammar accepts at a place.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Candidate {
    /// A word or words of the language.
    Word(&'static str),
    /// The first word or words of an operator over time.
    Operator(&'static str),
    /// A param, signal, latch or channel, or a function.
    Value,
    /// A primitive.
    Primitive,
    /// The action of a hand in a primitive.
    Meaning,
    /// A unit.
    Unit,
    /// A finger, or `opposing`.
    Finger,
    /// `x`, `y` or `z`.
    Component,
    /// A task.
    Task,
    /// A tree, or a branch of it.
    Tree,
    /// A choice of the branch with this name, `tree` or `tree.branch`.
    Choice(String),
    /// A rule file, in quotes that are open already.
    File,
}

/// What may stand at a byte of a text, and where the word begins that is being written there: words joined by dots are one.
pub fn candidates(text: &str, at: usize) -> (usize, Vec<Candidate>) {
    let head = text.get(..at).unwrap_or(text);
    let start = word_start(head);
    let cut = format!("{}{NOWHERE}", head.get(..start).unwrap_or_default());
    let scan = Scan::new(&cut, 0, &mut Vec::new());
    let Some(token) = scan.tokens.len().checked_sub(1) else { return (start, Vec::new()) };
    let last = scan.tokens.get(token).map(|token| token.kind);
    if !scan.word(token).ends_with(NOWHERE) {
        // In a comment, or after a bound at which the file is cut.
        return (start, Vec::new());
    }
    if last == Some(Kind::Text) {
        let is_use = token.checked_sub(1).is_some_and(|before| matches!(scan.word(before), "use" | "before"));
        let open = scan.tokens.get(token).map_or(start, |quote| quote.start + 1);
        return (open, if is_use { vec![Candidate::File] } else { Vec::new() });
    }
    let tokens = scan.tokens.len();
    let cursor = Cursor { token, level: Level::File, found: None };
    let mut parser = Parser { scan, findings: Vec::new(), broken: Vec::new(), cursor: Some(cursor) };
    parser.items(0..tokens, Level::File);
    let mut found = match parser.cursor {
        Some(Cursor { found: Some(found), .. }) => found,
        // No declaration has begun.
        Some(Cursor { level, .. }) => declarations(level),
        None => Vec::new(),
    };
    found.sort();
    found.dedup();
    (start, found)
}

/// Where the word begins that ends a text; a number is none.
fn word_start(head: &str) -> usize {
    let tail = head.rsplit(|c: char| !(c.is_ascii_alphanumeric() || matches!(c, '_' | '.'))).next().unwrap_or("");
    let tail = tail.rsplit("..").next().unwrap_or(tail);
    let word = if tail.starts_with(|c: char| c.is_ascii_digit()) {
        tail.trim_start_matches(|c: char| c.is_ascii_digit() || c == '.')
    } else {
        tail
    };
    head.len() - word.len()
}

/// The place at which an author is writing.
pub(super) struct Cursor {
    /// The sign.
    pub token: usize,
    /// The context of its declarations.
    pub level: Level,
    found: Option<Vec<Candidate>>,
}

impl Cursor {
    /// Asks the grammar what it expects in a piece.
    pub fn look(&mut self, scan: &Scan<'_>, tokens: Range<usize>, rule: Rule) {
        let head = scan.word(tokens.start);
        let word =
            |back: usize| self.token.checked_sub(back).filter(|at| *at >= tokens.start).map_or("", |at| scan.word(at));
        let place: String =
            tokens.clone().skip(1).take_while(|at| *at + 1 < self.token).map(|at| scan.word(at)).collect();
        let begin = scan.tokens.get(tokens.start).map_or(0, |token| token.start);
        let end = scan.tokens.get(self.token).map_or(begin, |token| token.start);
        let rules = match scan
            .text
            .get(begin..)
            .filter(|_| tokens.len() <= MAX_TOKENS)
            .map(|piece| Grammar::parse(rule, piece))
        {
            Some(Err(error)) => match (error.location, error.variant) {
                (InputLocation::Pos(at), ErrorVariant::ParsingError { positives, .. }) if begin + at == end => {
                    positives
                }
                // The text before is invalid, so any candidate is possible.
                _ => vec![Rule::expression, Rule::label],
            },
            _ => Vec::new(),
        };
        let mut found = Vec::new();
        for rule in &rules {
            found.extend(keyword(*rule).map(Candidate::Word));
            let kind =
                if matches!(rule, Rule::window | Rule::hysteresis) { Candidate::Operator } else { Candidate::Word };
            found.extend(words(*rule).iter().copied().map(kind));
            found.extend(meant(*rule, head, word(1), &place));
        }
        if head == "extend" && word(1) == head {
            found.push(Candidate::Word("task"));
        }
        if word(1) == "/" && units::unit(word(2)).is_some() {
            found.push(Candidate::Unit);
        }
        if rules.contains(&Rule::EOI) && scan.leads(self.token) {
            found.extend(declarations(self.level));
        }
        self.found = Some(found);
    }
}

/// The words that begin declarations.
fn declarations(level: Level) -> Vec<Candidate> {
    let of_files = ITEM_WORDS.iter().chain(&["for each hand"]).filter(|_| level == Level::File);
    HAND_WORDS.iter().chain(of_files).copied().map(Candidate::Word).collect()
}

/// The words that a rule may begin with, where it is more than one word.
const fn words(rule: Rule) -> &'static [&'static str] {
    match rule {
        Rule::anchor => &["first", "last", "before", "after"],
        Rule::axis => &["finger", "contact"],
        Rule::value_type | Rule::kind => &["bool", "scalar", "vec3", "rotation", "object"],
        Rule::tree_scope => &["each hand", "left, right"],
        Rule::each_hand => &["each hand"],
        Rule::both_hands => &["left, right"],
        Rule::demand => &["lasting", "travelling", "turning"],
        Rule::leaf => &["stay", "separate"],
        Rule::from_label => &["none"],
        Rule::guard | Rule::choice => &["else", "not", "from", "true", "false"],
        Rule::expression | Rule::conjunction | Rule::negation => &["not", "from", "true", "false"],
        Rule::comparison | Rule::sum | Rule::product | Rule::operand => &["from", "true", "false"],
        Rule::truth => &["true", "false"],
        Rule::hysteresis => &["above", "below"],
        Rule::samples => &["over last", "since"],
        Rule::window => &["for", "within last", "within next", "bridging", "lasting", "at least"],
        Rule::shorter => &["shorter than"],
        Rule::in_both => &["in both without"],
        Rule::one_hand => &["in one hand"],
        Rule::other_hand => &["in the other"],
        Rule::between_rule => &["between", "shorter than"],
        Rule::rewrite | Rule::relabel => &["sequence"],
        Rule::channel => &["optional", "for each hand"],
        _ => &[],
    }
}

/// What a rule is about, in a declaration that begins with `head` and directly after the word `before`; `place` is what an `extend` names.
fn meant(rule: Rule, head: &str, before: &str, place: &str) -> Option<Candidate> {
    Some(match rule {
        Rule::expression
        | Rule::conjunction
        | Rule::negation
        | Rule::comparison
        | Rule::sum
        | Rule::product
        | Rule::operand
        | Rule::guard
        | Rule::choice
        | Rule::duration
        | Rule::reference => Candidate::Value,
        // A new name has no candidates.
        Rule::primitive_name if head == "primitive" && before != "is" => return None,
        Rule::meaning_name => Candidate::Meaning,
        Rule::path if head == "extend" => Candidate::Tree,
        Rule::path if matches!(head, "stream" | "optional") || before.is_empty() => return None,
        Rule::path => Candidate::Value,
        Rule::label
        | Rule::leaf
        | Rule::key
        | Rule::from_label
        | Rule::primitive_name
        | Rule::alternatives
        | Rule::element
        | Rule::rewrite
        | Rule::relabel => Candidate::Primitive,
        Rule::unit | Rule::unknown_unit => Candidate::Unit,
        Rule::parts | Rule::part => Candidate::Task,
        Rule::anchor_name => Candidate::Choice(place.to_string()),
        Rule::name => match (before, head) {
            ("[", _) => Candidate::Finger,
            (".", _) => Candidate::Component,
            ("before" | "=" | ",", "task") | ("task", "extend") | ("relabel", _) => Candidate::Task,
            _ => return None,
        },
        _ => return None,
    })
}
