//! Words for every rule of the grammar, as an author hears them when a piece of a file does not parse.

use super::grammar::Rule;

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
    let needed = words(&|rule| !goes_on(rule) && rule != Rule::EOI);
    let possible = words(&goes_on);
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
