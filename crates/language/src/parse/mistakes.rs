//! The report for a piece of a file that does not parse: what was expected, what was found, and advice for habits from elsewhere.

use super::grammar::{Grammar, Rule};
use super::scan::{Kind, Scan};
use super::words::{expected, keyword};
use crate::codes;
use crate::resolve::nearest;
use pest::Parser as _;
use pest::error::{Error, ErrorVariant, InputLocation};
use std::ops::Range;
use teachtree_base::diagnostic::{Diagnostic, Span};
use teachtree_base::meaning::Meaning;
use teachtree_base::units;

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
        let finding = Diagnostic::error(codes::SYNTAX, format!("expected {wanted} after `{}`", scan.word(last)))
            .at(Span { start: whole.end, ..whole }, format!("{wanted} is missing here"));
        return match example(scan.word(tokens.start), rules) {
            Some(example) => finding.help(example),
            None => finding,
        };
    }
    let message = format!("expected {wanted}, found `{}`", scan.word(found));
    let finding = Diagnostic::error(codes::SYNTAX, message).at(scan.span(found, found + 1), "this does not fit here");
    match example(scan.word(tokens.start), rules) {
        Some(example) => finding.help(example),
        None => advise(finding, scan, found, rules),
    }
}

/// How a declaration that begins with `head` is written, where an example says more than the word that is missing.
fn example(head: &str, rules: &[Rule]) -> Option<&'static str> {
    let expects = |wanted: Rule| rules.contains(&wanted);
    match head {
        "task" if expects(Rule::range) => {
            Some("a task runs from one primitive to another: `task lift = Move .. Release with Lift`")
        }
        "relabel" if expects(Rule::open_brace) => {
            Some("rules are written in braces: `relabel { … }`, `relabel task { … }`")
        }
        "extend" if expects(Rule::anchor) || expects(Rule::kw_first) => {
            Some("name the place in the branch: `extend single_hand before carried { … }`")
        }
        _ => None,
    }
}

/// Whether a word can only be a leaf.
pub fn is_leaf(word: &str) -> bool {
    is_capitalized(word) || matches!(word, "stay" | "separate")
}

fn is_capitalized(word: &str) -> bool {
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
    if expects(&[Rule::arrow]) && word == "=" && is_leaf(scan.word(found + 1)) {
        return finding.fix("write `=>` before a leaf", place, "=>");
    }
    let primitive = [
        Rule::leaf,
        Rule::label,
        Rule::from_label,
        Rule::primitive_name,
        Rule::declared_primitive,
        Rule::declared_name,
        Rule::key,
    ];
    if expects(&primitive) && lower_case {
        if before == "is" && Meaning::from_name(word).is_some() {
            let help = "an action is declared by `does`";
            return finding.fix(help, scan.span(found - 1, found + 1), format!("does {word}"));
        }
        let (first, rest) = word.split_at(1);
        return finding.fix("primitives are capitalized", place, format!("{}{rest}", first.to_ascii_uppercase()));
    }
    let kind = |at: usize| scan.tokens.get(at).map(|token| token.kind);
    if expects(&[Rule::name]) && matches!(before, "task" | "param" | "signal" | "latch") && is_capitalized(word) {
        return finding.fix("only primitives are capitalized", place, word.to_ascii_lowercase());
    }
    if word == "." && before.ends_with("..") {
        return finding.fix("write `..`, with two dots", place, "");
    }
    if before == "use" && kind(found) == Some(Kind::Word) {
        let ends = scan.word(found + 1) == "." && scan.word(found + 2) == "rules";
        let name = if ends { scan.span(found, found + 3) } else { place };
        return finding.fix("a file name is written in quotes", name, format!("\"{word}.rules\""));
    }
    if word == ":" && expects(&[Rule::equals]) {
        return finding.fix("write `=`", place, "=");
    }
    let declares = found.checked_sub(2).map_or("", |at| scan.word(at));
    if declares == "task" && expects(&[Rule::equals]) {
        return finding.help("a task names its first and last primitive: `task lift = Move .. Release with Translate`");
    }
    if let Some(near) = nearest(word, rules.iter().filter_map(|rule| keyword(*rule))) {
        return finding.fix(format!("did you mean `{near}`?"), place, near);
    }
    if before == "," && matches!(word, "lasting" | "travelling" | "turning") {
        let comma = scan.span(found.saturating_sub(1), found);
        return finding.fix("a demand follows its primitive without a comma", comma, "");
    }
    if expects(&[Rule::comma]) && word == "last" {
        return finding.fix("write `over` before `last`", gap, " over ");
    }
    if expects(&[Rule::comma]) && !expects(&[Rule::demand]) && kind(found) == Some(Kind::Word) {
        return finding.fix("write `,` between them", gap, ", ");
    }
    let arrow = [found.saturating_sub(1), found].into_iter().find(|at| scan.word(*at) == "=>");
    if let Some(arrow) = arrow.filter(|at| kind(at + 1) == Some(Kind::Number)) {
        return finding.fix("write `>=` to compare", scan.span(arrow, arrow + 1), ">=");
    }
    let is_digits = |at: usize| kind(at) == Some(Kind::Number);
    if word == "," && found.checked_sub(1).is_some_and(is_digits) && is_digits(found + 1) {
        return finding.help("a fraction is written with a point: `0.5 N`");
    }
    if expects(&[Rule::kw_and]) && matches!(word, "becomes" | "become") {
        return finding.help("a rule names both neighbors: `X between A and B becomes C`");
    }
    if word == "(" && matches!(scan.word(found + 1), "left" | "right") && is_capitalized(before) {
        return finding.fix("a side touches its primitive", gap, "");
    }
    let value = [Rule::expression, Rule::guard, Rule::sum, Rule::choice, Rule::conjunction, Rule::comparison];
    if expects(&value) && is_capitalized(word) {
        return finding.help("only primitives are capitalized; `from(Grasp)` tests the primitive of the frame before");
    }
    let names = [Rule::name, Rule::path, Rule::choice, Rule::choice_name, Rule::anchor_name];
    if expects(&names) && lower_case && Grammar::parse(Rule::name, word).is_err() {
        return finding.help(format!("`{word}` is a word of the language; choose another name"));
    }
    if word == "=" && matches!(scan.word(found + 1), "true" | "false") {
        return finding.help(format!("write the condition itself: `{before}`, `not {before}`"));
    }
    if word == "=" && units::unit(scan.word(found + 2)).is_some() {
        return finding.help("measured numbers are compared by `<` and `>`");
    }
    if word == "is" && scan.word(found + 1) == "failure" {
        return finding.help("`is failure` belongs at the end of a task, ahead of `before`");
    }
    let replacement = match word {
        "&&" | "&" => "and",
        "||" | "|" => "or",
        "!" => "not ",
        "->" => "=>",
        "=" | "is" | "equals" if expects(&[Rule::comparison_operator, Rule::compared]) => "==",
        "°" => "deg",
        ";" => "",
        "," if expects(&[Rule::choice]) => "",
        "#" => return finding.help("comments begin with `//`"),
        "<" | ">" | "<=" | ">=" => return finding.help("comparisons do not chain: write `1 N < load and load < 3 N`"),
        _ if matches!(before, "if" | "when") || matches!(word, "if" | "when" | "then") => {
            return finding.help("there is no `if`: write the condition itself before `=>` or `{`");
        }
        _ => return finding,
    };
    let help = if replacement.is_empty() { "remove it".to_string() } else { format!("write `{}`", replacement.trim()) };
    finding.fix(help, place, replacement)
}

/// Units in full, in the singular.
const SPELLINGS: &[(&str, &str)] = &[
    ("degree", "deg"),
    ("gram", "g"),
    ("hertz", "Hz"),
    ("kilogram", "kg"),
    ("meter", "m"),
    ("metre", "m"),
    ("millimeter", "mm"),
    ("millimetre", "mm"),
    ("millisecond", "ms"),
    ("msec", "ms"),
    ("newton", "N"),
    ("percent", "%"),
    ("radian", "rad"),
    ("sec", "s"),
    ("second", "s"),
];
/// Prefixes of units that the language does not know.
const PREFIXES: &[(&str, &str)] =
    &[("k", "1000"), ("M", "1e6"), ("c", "0.01"), ("d", "0.1"), ("u", "1e-6"), ("n", "1e-9")];

/// The report for a unit that is unknown. Only the same unit in another spelling is proposed: a near one is another magnitude.
pub fn unknown_unit(word: &str, place: Span) -> Diagnostic {
    let known = || units::UNITS.iter().map(|unit| unit.symbol);
    let finding = Diagnostic::error(codes::UNKNOWN_UNIT, format!("`{word}` is not a unit"))
        .at(place, "a unit such as `mm/s` belongs here");
    // `M` is mega, never a large letter for milli.
    let same = known().find(|unit| unit.eq_ignore_ascii_case(word) && !word.starts_with('M'));
    let singular = word.strip_suffix('s').unwrap_or(word);
    let spelled = || {
        let (_, unit) =
            SPELLINGS.iter().find(|(full, _)| [word, singular].iter().any(|it| full.eq_ignore_ascii_case(it)))?;
        Some(*unit)
    };
    if let Some(same) = same.or_else(spelled) {
        return finding.fix(format!("did you mean `{same}`?"), place, same);
    }
    let prefixed = PREFIXES.iter().find_map(|(prefix, times)| {
        let unit = word.strip_prefix(prefix)?;
        ["m", "s", "N", "g", "rad", "Hz"].contains(&unit).then(|| format!("1 {word} is `{times} {unit}`"))
    });
    finding.help(prefixed.unwrap_or_else(|| {
        let units = known().collect::<Vec<_>>().join(", ");
        format!("the units are {units}, and combinations of them, such as `mm/s` and `N m`")
    }))
}
