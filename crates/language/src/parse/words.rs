//! Words for every rule of the grammar, as an author hears them when a piece of a file does not parse.

use super::grammar::Rule;
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// The rules that were tried as a list: what has to come before what may come.
pub fn expected(rules: &[Rule]) -> String {
    let words = |which: &dyn Fn(Rule) -> bool| {
        let mut words: Vec<&str> = Vec::new();
        for word in rules.iter().filter(|rule| which(**rule)).map(|rule| word(*rule)) {
            if !word.is_empty() && !words.contains(&word) {
                words.push(word);
            }
        }
        words
    };
    let needed = words(&|rule| !is_continuation(rule) && rule != Rule::EOI);
    let possible = words(&is_continuation);
    // The end is possible wherever only something optional is missing, and says nothing beside what is needed.
    let ends = rules.contains(&Rule::EOI);
    let list = match (needed.is_empty(), ends, possible.len()) {
        (false, ..) => needed,
        (true, true, _) => vec!["an operator", word(Rule::EOI)],
        (true, false, 0..=2) => possible,
        (true, false, _) => vec!["an operator"],
    };
    match list.as_slice() {
        [] => "something else".to_string(),
        [one] => (*one).to_string(),
        [most @ .., last] => format!("{} or {last}", most.join(", ")),
    }
}

/// The word of the language that a rule stands for, if it is one.
pub fn keyword(rule: Rule) -> Option<&'static str> {
    let word = word(rule).strip_prefix('`')?.strip_suffix('`')?;
    word.chars().all(|c| c.is_ascii_lowercase()).then_some(word)
}

/// Whether a rule only continues an expression: of little help beside what has to come.
const fn is_continuation(rule: Rule) -> bool {
    matches!(
        rule,
        Rule::arguments
            | Rule::compared
            | Rule::comparison_operator
            | Rule::component
            | Rule::dot
            | Rule::hysteresis
            | Rule::kind_of
            | Rule::kw_above
            | Rule::kw_and
            | Rule::kw_at
            | Rule::kw_below
            | Rule::kw_bridging
            | Rule::kw_does
            | Rule::kw_for
            | Rule::kw_is
            | Rule::kw_or
            | Rule::kw_over
            | Rule::kw_since
            | Rule::kw_while
            | Rule::kw_within
            | Rule::meaning
            | Rule::minus
            | Rule::open_bracket
            | Rule::open_paren
            | Rule::other_does
            | Rule::over
            | Rule::pick
            | Rule::plus
            | Rule::side_mark
            | Rule::side_suffix
            | Rule::times
            | Rule::unit
            | Rule::unknown_unit
            | Rule::samples
            | Rule::window
    )
}

/// The words for a rule; empty for rules that are never reported. The rule of a word of the language is called as that word is written.
fn word(rule: Rule) -> &'static str {
    static WORDS: LazyLock<BTreeMap<Rule, String>> = LazyLock::new(|| {
        let rules = Rule::all_rules().iter();
        rules.filter_map(|rule| Some((*rule, format!("`{}`", format!("{rule:?}").strip_prefix("kw_")?)))).collect()
    });
    match WORDS.get(&rule) {
        Some(word) => word,
        None => described(rule),
    }
}

/// The words for a rule that is not a word of the language.
const fn described(rule: Rule) -> &'static str {
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
        Rule::colon | Rule::declared_type => "`:`",
        Rule::comma => "`,`",
        Rule::declared_primitive | Rule::declared_name => "a capitalized name such as `Grasp`",
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
        Rule::list_rule => "`becomes`",
        Rule::before_task => "`before`",
        Rule::between_rule | Rule::between => "`between`",
        Rule::extend_head => "`extend`",
        Rule::latch => "`latch`",
        Rule::param => "`param`",
        Rule::primitives => "`primitive`",
        Rule::relabel_head => "`relabel`",
        Rule::sequence => "`sequence`",
        Rule::signal => "`signal`",
        Rule::stream_head => "`stream`",
        Rule::task => "`task`",
        Rule::tree_head => "`tree`",
        Rule::use_file => "`use`",
        Rule::before_file => "`before`",
        Rule::parts | Rule::part => "a task",
        Rule::each_side => "a primitive with `(side)`",
        Rule::with_keys => "`with`",
        Rule::without_keys => "`without`",
        Rule::kind_of => "`is`",
        Rule::other_does => "`while other does`",
        Rule::meaning => "`does`",
        Rule::meaning_name => "a meaning such as `carry`",
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
        Rule::count => "a number of times",
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
        Rule::samples => "samples such as `over last 200 ms`",
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
        // Words of the language: `word`.
        _ => "",
    }
}
