//! What an author hears when a piece of a file does not parse: words for every rule of the grammar, and advice for habits from
//! other languages.

use super::grammar::Rule;
use super::scan::Scan;
use crate::base::diagnostic::{Diagnostic, Span};
use crate::language::codes;
use pest::error::{Error, ErrorVariant, InputLocation};
use std::ops::Range;

/// The report for a piece that did not parse: what was found, what was expected there, and a fix for well-known habits.
///
/// `start` is where the piece begins in the file.
pub fn finding(scan: &Scan<'_>, start: usize, tokens: Range<usize>, error: &Error<Rule>) -> Diagnostic {
    let at = start
        + match error.location {
            InputLocation::Pos(at) => at,
            InputLocation::Span((at, _)) => at,
        };
    let found = scan.tokens.partition_point(|token| token.end <= at).max(tokens.start);
    let wanted = match &error.variant {
        ErrorVariant::ParsingError { positives, .. } => expected(positives),
        ErrorVariant::CustomError { .. } => String::new(),
    };
    let wanted = if wanted.is_empty() { "something else".to_string() } else { wanted };
    if found >= tokens.end {
        let last = tokens.end.saturating_sub(1).max(tokens.start);
        let end = scan.span(last, tokens.end).end;
        let place = Span { start: end, ..scan.span(last, tokens.end) };
        return Diagnostic::error(codes::SYNTAX, format!("expected {wanted} after `{}`", scan.word(last)))
            .at(place, format!("{wanted} is missing here"));
    }
    let place = scan.span(found, found + 1);
    let finding = Diagnostic::error(codes::SYNTAX, format!("expected {wanted}, found `{}`", scan.word(found)))
        .at(place, "this does not fit here");
    let primitive = |rule: &Rule| {
        matches!(rule, Rule::leaf | Rule::label | Rule::primitive_name | Rule::declared_primitive | Rule::key)
    };
    match &error.variant {
        ErrorVariant::ParsingError { positives, .. }
            if positives.contains(&Rule::arrow) && is_leaf(scan.word(found)) =>
        {
            finding.fix("write `=>` before a leaf", place, format!("=> {}", scan.word(found)))
        }
        ErrorVariant::ParsingError { positives, .. } if positives.iter().any(primitive) => {
            capitalise(finding, scan, found)
        }
        _ => advise(finding, scan, found),
    }
}

/// Whether a word can only be a leaf.
pub fn is_leaf(word: &str) -> bool {
    word.starts_with(|c: char| c.is_ascii_uppercase()) || matches!(word, "stay" | "separate")
}

/// Advice where a primitive was expected and a lower-case word stands.
fn capitalise(finding: Diagnostic, scan: &Scan<'_>, found: usize) -> Diagnostic {
    let mut letters = scan.word(found).chars();
    match letters.next() {
        Some(first) if first.is_ascii_lowercase() => {
            let word = format!("{}{}", first.to_ascii_uppercase(), letters.as_str());
            finding.fix("primitives are capitalised", scan.span(found, found + 1), word)
        }
        _ => finding,
    }
}

/// The rules that were tried as a list: what has to come before what may come.
fn expected(rules: &[Rule]) -> String {
    let mut words: Vec<&str> = Vec::new();
    let mut add = |rule: &Rule| {
        let word = word(*rule);
        if !word.is_empty() && !words.contains(&word) {
            words.push(word);
        }
    };
    rules.iter().filter(|rule| !goes_on(**rule)).for_each(&mut add);
    // The end is possible wherever only something optional is missing, and says nothing beside what is needed.
    if words.len() > 1 {
        words.retain(|word| *word != self::word(Rule::EOI));
    } else if words.iter().all(|word| *word == self::word(Rule::EOI)) {
        words.insert(0, "an operator");
    }
    match words.as_slice() {
        [] => String::new(),
        [one] => (*one).to_string(),
        [most @ .., last] => format!("{} or {last}", most.join(", ")),
    }
}

/// Advice for what people write who come from other languages.
fn advise(finding: Diagnostic, scan: &Scan<'_>, found: usize) -> Diagnostic {
    let place = scan.span(found, found + 1);
    let word = scan.word(found);
    let replace = |by: &str| (format!("write `{}`", by.trim()), by.to_string());
    let (help, by) = match word {
        "&&" | "&" => replace("and"),
        "||" | "|" => replace("or"),
        "!" => replace("not "),
        "->" => replace("=>"),
        "=" => replace("=="),
        "if" | "when" => ("a choice is its condition, then `=>` or `{`".to_string(), String::new()),
        ";" => ("no sign ends a declaration".to_string(), String::new()),
        "#" => return finding.help("comments begin with `//`"),
        "is" | "equals" => replace("=="),
        _ if word.starts_with(|c: char| c.is_ascii_uppercase()) => {
            return finding
                .help("only primitives are capitalised; `from(Grasp)` asks for the primitive of the frame before");
        }
        _ => return finding,
    };
    finding.fix(help, place, by)
}

/// Whether a rule only carries an expression on: of little help beside what has to come.
const fn goes_on(rule: Rule) -> bool {
    matches!(
        rule,
        Rule::arguments
            | Rule::compared
            | Rule::comparison_operator
            | Rule::component
            | Rule::dot
            | Rule::hysteresis
            | Rule::kw_above
            | Rule::kw_and
            | Rule::kw_below
            | Rule::kw_for
            | Rule::kw_or
            | Rule::kw_within
            | Rule::minus
            | Rule::open_bracket
            | Rule::open_paren
            | Rule::over
            | Rule::pick
            | Rule::plus
            | Rule::side_mark
            | Rule::side_suffix
            | Rule::times
            | Rule::unit
            | Rule::unknown_unit
            | Rule::window
    )
}

/// The words for a rule; empty for rules that are never reported.
const fn word(rule: Rule) -> &'static str {
    match rule {
        Rule::anchor => "`first`, `last`, `before` or `after`",
        Rule::anchor_name => "the name of a choice",
        Rule::arrow => "`=>`",
        Rule::axis => "`finger` or `contact`",
        Rule::both_hands => "`left, right`",
        Rule::channel => "a channel such as `fingers.force : vec3 N per finger`",
        Rule::choice => "a choice such as `near => Approach`",
        Rule::choice_name => "a name and `:`",
        Rule::close_bracket => "`]`",
        Rule::close_paren => "`)`",
        Rule::colon | Rule::promised_type => "`:`",
        Rule::comma => "`,`",
        Rule::declared_primitive => "a capitalised name such as `Grasp`",
        Rule::demand => "a demand such as `lasting 150 ms`",
        Rule::dot | Rule::component => "`.`",
        Rule::each_hand => "`each hand`",
        Rule::element | Rule::rewrite | Rule::alternatives => {
            "a primitive such as `Grasp`, or alternatives in parentheses"
        }
        Rule::equals => "`=`",
        Rule::expression | Rule::conjunction | Rule::negation | Rule::comparison | Rule::truth => {
            "a condition or value"
        }
        Rule::extend_task => "`extend task`",
        Rule::from => "`from(…)`",
        Rule::from_label => "a primitive such as `Grasp`, or `none`",
        Rule::guard => "a condition or `else`",
        Rule::hands_head => "`for each hand`",
        Rule::in_both => "`in both`",
        Rule::joined => "`, joined`",
        Rule::kw_above => "`above`",
        Rule::kw_after => "`after`",
        Rule::kw_and => "`and`",
        Rule::kw_becomes | Rule::list_rule => "`becomes`",
        Rule::kw_before | Rule::before_task => "`before`",
        Rule::kw_below => "`below`",
        Rule::kw_between | Rule::between_rule | Rule::between => "`between`",
        Rule::kw_both => "`both`",
        Rule::kw_clear => "`clear`",
        Rule::kw_each => "`each`",
        Rule::kw_else => "`else`",
        Rule::kw_extend | Rule::extend_head => "`extend`",
        Rule::kw_false => "`false`",
        Rule::kw_first => "`first`",
        Rule::kw_for => "`for`",
        Rule::kw_from => "`from`",
        Rule::kw_hand => "`hand`",
        Rule::kw_in => "`in`",
        Rule::kw_joined => "`joined`",
        Rule::kw_last => "`last`",
        Rule::kw_lasting => "`lasting`",
        Rule::kw_latch | Rule::latch => "`latch`",
        Rule::kw_left => "`left`",
        Rule::kw_next => "`next`",
        Rule::kw_none => "`none`",
        Rule::kw_not => "`not`",
        Rule::kw_one => "`one`",
        Rule::kw_optional => "`optional`",
        Rule::kw_or => "`or`",
        Rule::kw_other => "`other`",
        Rule::kw_param | Rule::param => "`param`",
        Rule::kw_per => "`per`",
        Rule::kw_primitive | Rule::primitives => "`primitive`",
        Rule::kw_relabel | Rule::relabel_head => "`relabel`",
        Rule::kw_right => "`right`",
        Rule::kw_separate => "`separate`",
        Rule::kw_sequence | Rule::sequence => "`sequence`",
        Rule::kw_set => "`set`",
        Rule::kw_settle => "`settle`",
        Rule::kw_shorter => "`shorter`",
        Rule::kw_signal | Rule::signal => "`signal`",
        Rule::kw_stay => "`stay`",
        Rule::kw_stream | Rule::stream_head => "`stream`",
        Rule::kw_task | Rule::task => "`task`",
        Rule::kw_than => "`than`",
        Rule::kw_the => "`the`",
        Rule::kw_travelling => "`travelling`",
        Rule::kw_tree | Rule::tree_head => "`tree`",
        Rule::kw_true => "`true`",
        Rule::kw_turning => "`turning`",
        Rule::kw_until => "`until`",
        Rule::kw_use | Rule::use_file => "`use`",
        Rule::kw_with | Rule::with_keys => "`with`",
        Rule::kw_within => "`within`",
        Rule::kw_without | Rule::without_keys => "`without`",
        Rule::leaf => "a primitive, `stay` or `separate`",
        Rule::name => "a name such as `touching`",
        Rule::number => "a number",
        Rule::one_hand => "`in one hand`",
        Rule::open_brace => "`{`",
        Rule::open_bracket | Rule::pick => "`[`",
        Rule::open_paren | Rule::group | Rule::arguments => "`(`",
        Rule::other_hand => "`in the other`",
        Rule::path | Rule::reference => "a name such as `target.velocity`",
        Rule::plus
        | Rule::minus
        | Rule::times
        | Rule::over
        | Rule::comparison_operator
        | Rule::compared
        | Rule::hysteresis => "an operator",
        Rule::primitive_name | Rule::label | Rule::key => "a primitive such as `Grasp`",
        Rule::quantity | Rule::duration => "a quantity such as `30 ms`",
        Rule::range => "`..`",
        Rule::relabel => "a rule such as `Insert, Pullout become Turn`",
        Rule::repeat => "`*` or `+`",
        Rule::settling => "`, settle 50 ms`",
        Rule::shorter => "`shorter than`",
        Rule::sum | Rule::product | Rule::operand => "a value",
        Rule::text => "a file name in quotes",
        Rule::tree_scope => "`each hand` or `left, right`",
        Rule::unit | Rule::unknown_unit => "a unit",
        Rule::value_type | Rule::kind => "a type such as `vec3 m/s`",
        Rule::window => "a window such as `for 30 ms`",
        Rule::EOI => "the end of the declaration",
        Rule::WHITESPACE
        | Rule::COMMENT
        | Rule::boundary
        | Rule::name_char
        | Rule::blank
        | Rule::reserved
        | Rule::unit_symbol
        | Rule::unit_factor
        | Rule::operand_head
        | Rule::postfix
        | Rule::only_use
        | Rule::only_param
        | Rule::only_signal
        | Rule::only_latch
        | Rule::only_primitives
        | Rule::only_stream_head
        | Rule::only_hands_head
        | Rule::only_channel
        | Rule::only_tree_head
        | Rule::only_extend_head
        | Rule::only_choice
        | Rule::only_task
        | Rule::only_extend_task
        | Rule::only_relabel_head
        | Rule::only_relabel
        | Rule::side_suffix
        | Rule::side_mark => "",
    }
}
