//! The report for a piece of a file that does not parse: what was expected, what was found, and advice for habits from elsewhere.

use super::grammar::{Grammar, Rule};
use super::scan::{Kind, Scan};
use super::words::expected;
use crate::base::diagnostic::{Diagnostic, Span};
use crate::language::codes;
use pest::Parser as _;
use pest::error::{Error, ErrorVariant, InputLocation};
use std::ops::Range;

/// The report for the tokens of a piece that begins at the byte `start` of the file.
pub fn finding(scan: &Scan<'_>, start: usize, tokens: Range<usize>, error: &Error<Rule>) -> Diagnostic {
    let at = start
        + match error.location {
            InputLocation::Pos(at) => at,
            InputLocation::Span((at, _)) => at,
        };
    let found = scan.tokens.partition_point(|token| token.end <= at).max(tokens.start);
    let rules = match &error.variant {
        ErrorVariant::ParsingError { positives, .. } => positives.as_slice(),
        ErrorVariant::CustomError { .. } => &[],
    };
    let wanted = expected(rules);
    if found >= tokens.end {
        let last = tokens.end.saturating_sub(1).max(tokens.start);
        let whole = scan.span(last, tokens.end);
        return Diagnostic::error(codes::SYNTAX, format!("expected {wanted} after `{}`", scan.word(last)))
            .at(Span { start: whole.end, ..whole }, format!("{wanted} is missing here"));
    }
    let message = format!("expected {wanted}, found `{}`", scan.word(found));
    let finding = Diagnostic::error(codes::SYNTAX, message).at(scan.span(found, found + 1), "this does not fit here");
    advise(finding, scan, found, rules)
}

/// Whether a word can only be a leaf.
pub fn is_leaf(word: &str) -> bool {
    is_capitalised(word) || matches!(word, "stay" | "separate")
}

fn is_capitalised(word: &str) -> bool {
    word.starts_with(|c: char| c.is_ascii_uppercase())
}

/// Adds a fix or advice, when it is clear what was meant.
fn advise(finding: Diagnostic, scan: &Scan<'_>, found: usize, rules: &[Rule]) -> Diagnostic {
    let place = scan.span(found, found + 1);
    let word = scan.word(found);
    let before = found.checked_sub(1).map_or("", |before| scan.word(before));
    let expects = |wanted: &[Rule]| rules.iter().any(|rule| wanted.contains(rule));
    let gap = scan.tokens.get(found.saturating_sub(1)).map_or(place, |before| Span {
        start: scan.place(before.end, before.end).start,
        end: place.start,
        ..place
    });
    let lower_case = word.starts_with(|c: char| c.is_ascii_lowercase());

    if expects(&[Rule::arrow]) && is_leaf(word) {
        return finding.fix("write `=>` before a leaf", place, format!("=> {word}"));
    }
    let primitive =
        [Rule::leaf, Rule::label, Rule::from_label, Rule::primitive_name, Rule::declared_primitive, Rule::key];
    if expects(&primitive) && lower_case {
        let (first, rest) = word.split_at(1);
        return finding.fix("primitives are capitalised", place, format!("{}{rest}", first.to_ascii_uppercase()));
    }
    if expects(&[Rule::comma]) && scan.tokens.get(found).is_some_and(|token| token.kind == Kind::Word) {
        return finding.fix("write `,` between them", gap, ", ");
    }
    if word == "(" && matches!(scan.word(found + 1), "left" | "right") && is_capitalised(before) {
        return finding.fix("a side touches its primitive", gap, "");
    }
    let value = [Rule::expression, Rule::guard, Rule::sum, Rule::choice, Rule::conjunction, Rule::comparison];
    if expects(&value) && is_capitalised(word) {
        return finding
            .help("only primitives are capitalised; `from(Grasp)` asks for the primitive of the frame before");
    }
    let names = [Rule::name, Rule::path, Rule::choice, Rule::choice_name, Rule::anchor_name];
    if expects(&names) && lower_case && Grammar::parse(Rule::name, word).is_err() {
        return finding.help(format!("`{word}` is a word of the language; choose another name"));
    }
    let replacement = match word {
        "&&" | "&" => "and",
        "||" | "|" => "or",
        "!" => "not ",
        "->" => "=>",
        "=" | "is" | "equals" if expects(&[Rule::comparison_operator, Rule::compared]) => "==",
        ";" => "",
        "," if expects(&[Rule::choice]) => "",
        "#" => return finding.help("comments begin with `//`"),
        "<" | ">" | "<=" | ">=" => return finding.help("comparisons do not chain: write `a < x and x < b`"),
        _ if matches!(before, "if" | "when") || matches!(word, "if" | "when" | "then") => {
            return finding.help("there is no `if`: a condition stands alone, before `=>` or `{`");
        }
        _ => return finding,
    };
    let help = if replacement.is_empty() { "remove it".to_string() } else { format!("write `{}`", replacement.trim()) };
    finding.fix(help, place, replacement)
}
