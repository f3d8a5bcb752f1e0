/**
 * @file Rule files of teachtree.
 * @license MIT OR Apache-2.0
 */

/// <reference types="tree-sitter-cli/dsl" />
// @ts-check

// This file follows `grammar/*.pest`. Most nodes have the names of its rules; what the compiler checks after parsing is also
// refused here if an LR grammar can express it: windows without parentheses, keys that mix `or` and `and`.

/** Words that are never names: `reserved` in `grammar/tokens.pest`. */
const RESERVED = [
  "above", "and", "become", "becomes", "below", "between", "clear", "else", "extend", "false", "for", "from", "in", "latch", "none",
  "not", "optional", "or", "param", "per", "primitive", "relabel", "separate", "sequence", "set", "settle", "signal", "stay", "stream",
  "task", "tree", "true", "until", "use", "with", "within", "without",
];

const list = (rule) => seq(rule, repeat(seq(",", rule)));
const separated = (word, rule) => seq(rule, repeat1(seq(word, rule)));
const braces = (rule) => seq("{", repeat(rule), "}");

module.exports = grammar({
  name: "teachtree",

  word: ($) => $.name,
  reserved: { global: () => RESERVED },
  extras: ($) => [/[ \t\r\n]/, $.comment, $.doc_comment],

  conflicts: ($) => [
    // `… = (a) for each hand {` begins a block behind the signal, `… = (a) for delay` continues it.
    [$._composed, $.window],
    // `2 mm / s` is one unit, `2 mm / delay` a quotient.
    [$.unit],
  ],

  rules: {
    source_file: ($) => repeat($._declaration),

    _declaration: ($) =>
      choice(
        $.use_file, $.param, $.signal, $.latch, $.primitives, $.stream, $.hands, $.tree, $.extension, $.task, $.extend_task,
        $.relabel,
      ),

    // Declarations.

    use_file: ($) => seq("use", field("file", $.text), optional(seq("before", field("before", $.text)))),

    param: ($) => seq("param", field("name", $.name), "=", field("value", $._sum), optional($.range)),
    range: ($) => seq("in", field("low", $._sum), "..", field("high", $._sum)),

    signal: ($) =>
      seq(
        "signal",
        field("name", $.name),
        choice(
          seq(":", field("type", $.value_type), optional(seq("=", field("value", $._expression)))),
          seq("=", field("value", $._expression)),
        ),
      ),

    latch: ($) =>
      seq("latch", field("name", $.name), "set", field("set", $._expression), "clear", field("clear", $._expression)),

    primitives: ($) => seq("primitive", list($.declared_primitive)),
    declared_primitive: ($) =>
      seq(
        field("name", $.primitive_name),
        optional($.side_mark),
        optional(choice(seq($._kind_of, optional($._meaning)), seq($._meaning, optional($._kind_of)))),
      ),
    _kind_of: ($) => seq("is", field("kind_of", $.primitive_name)),
    _meaning: ($) => seq("does", field("does", $.meaning), optional($._other_does)),
    _other_does: ($) => seq("while", "other", "does", field("other_does", $.meaning)),
    meaning: ($) => choice($.name, $.primitive_name),

    stream: ($) => seq("stream", braces(choice($.channel, alias($.hand_channels, $.hands)))),
    hand_channels: ($) => seq("for", "each", "hand", braces($.channel)),
    hands: ($) => seq("for", "each", "hand", braces(choice($.signal, $.latch))),
    channel: ($) =>
      choice(
        seq("optional", field("name", $.path), ":", field("type", $.value_type), "=", field("default", $._expression)),
        seq(field("name", $.path), ":", field("type", $.value_type)),
      ),
    value_type: ($) => seq($.kind, optional($.unit), optional(seq("per", $.axis))),
    kind: () => choice("bool", "scalar", "vec3", "rotation", "object"),
    axis: () => choice("finger", "contact"),

    // Trees.

    tree: ($) =>
      seq("tree", field("name", $.name), "for", $.tree_scope, optional(seq(",", "settle", field("settle", $._sum))), $.choices),
    tree_scope: () => choice(seq("each", "hand"), seq("left", ",", "right")),
    extension: ($) => seq("extend", field("branch", $.path), $.anchor, $.choices),
    anchor: ($) => choice("first", "last", seq(choice("before", "after"), choice($.primitive_name, $.name))),
    choices: ($) => braces($.choice),
    choice: ($) =>
      seq(
        optional(seq(field("name", $.name), ":")),
        field("guard", choice("else", $._expression)),
        choice(seq("=>", field("leaf", $.leaf)), $.choices),
      ),
    leaf: ($) => choice("stay", "separate", $.each_side, $.label),
    each_side: ($) => seq($.primitive_name, $.side_mark),

    // Tasks.

    task: ($) => seq("task", field("name", $.name), "=", choice($._parts, $._span)),
    _parts: ($) => seq(list($.part), optional($.is_failure)),
    part: ($) => seq($.name, optional("+")),
    _span: ($) =>
      seq(
        field("first", $.label), "..", field("last", $.label),
        $.keys,
        optional($._without),
        optional($.is_failure),
        optional(seq("before", field("before", $.name))),
      ),
    _without: ($) => choice(seq("without", list($.label), optional($._joined)), $._joined),
    _joined: () => seq(",", "joined"),
    extend_task: ($) => seq("extend", "task", field("name", $.name), $.keys),
    keys: ($) => seq("with", choice($.key, separated("or", $.key), separated("and", $.key))),
    key: ($) => seq($.label, repeat($.demand)),
    demand: ($) => seq(choice("lasting", "travelling", "turning"), $._duration),
    is_failure: () => seq("is", "failure"),

    // Relabeling.

    relabel: ($) => seq("relabel", optional(field("task", $.name)), braces(choice($.sequence, $.rewrite))),
    sequence: ($) => seq("sequence", list($.element), $._becomes, $.label),
    element: ($) => seq($._alternatives, optional(choice("*", "+"))),
    rewrite: ($) => choice($._in_both, $._between_rule, $._list_rule),
    _alternatives: ($) => choice($.label, $.alternatives),
    alternatives: ($) => seq("(", $.label, repeat(seq("or", $.label)), ")"),
    _in_both: ($) => seq($._alternatives, "in", "both", "without", list($.label), $._becomes, "separate"),
    _between_rule: ($) =>
      seq(
        $._alternatives,
        optional("+"),
        optional(seq("shorter", "than", $._duration)),
        $.between,
        choice(
          seq($._becomes, $.label),
          seq("in", "one", "hand", "and", $.between, "in", "the", "other", $._becomes, choice("separate", $.label)),
        ),
      ),
    between: ($) => seq("between", $._alternatives, "and", $._alternatives),
    _list_rule: ($) => seq($._alternatives, repeat(seq(",", $.label)), $._becomes, $.label),
    _becomes: () => choice("becomes", "become"),

    // Expressions. Comparison and hysteresis bind tighter than `not`, `not` tighter than `and`, `and` tighter than `or`.

    _expression: ($) => choice($.disjunction, $._conjunction),
    disjunction: ($) => seq($._expression, "or", $._conjunction),
    _conjunction: ($) => choice($.conjunction, $._negation),
    conjunction: ($) => seq($._conjunction, "and", $._negation),
    _negation: ($) => choice($.negation, $._comparison),
    negation: ($) => seq("not", $._negation),
    _comparison: ($) => choice($.comparison, $.hysteresis, $._sum),
    comparison: ($) => seq($._sum, choice("<=", ">=", "==", "!=", "<", ">"), $._sum),
    hysteresis: ($) =>
      seq($._sum, choice(seq("above", $._sum, "until", "below", $._sum), seq("below", $._sum, "until", "above", $._sum))),
    _sum: ($) => choice($.sum, $._product),
    sum: ($) => seq($._sum, choice("+", "-"), $._product),
    _product: ($) => choice($.product, $._signed),
    product: ($) => seq($._product, choice("*", "/"), $._signed),
    _signed: ($) => choice($.opposite, $._operand),
    opposite: ($) => seq("-", $._signed),
    _operand: ($) => choice($.path, $.quantity, $.truth, $._composed),
    // What may be followed by a component or a window. The dots behind a path belong to the path.
    _composed: ($) => choice($.call, $.from, $.group, $.pick, $.component, $.window),

    truth: () => choice("true", "false"),
    group: ($) => seq("(", $._expression, ")"),
    call: ($) =>
      seq(field("function", $.name), "(", $._expression, choice($.samples, repeat(seq(",", $._expression))), ")"),
    samples: ($) => choice(seq("over", "last", $._duration), seq("since", $._expression)),
    from: ($) => seq("from", "(", list(choice("none", $.label)), ")"),
    pick: ($) => seq(choice($.path, $._composed), "[", field("slot", $.name), "]"),
    component: ($) => seq($._composed, ".", field("member", $.name)),
    window: ($) =>
      seq(
        field("condition", $.group),
        choice(
          "for",
          "bridging",
          "lasting",
          seq("within", choice("last", "next")),
          seq("at", "least", field("count", choice($.number, $.group, $.path)), "times", "within", "last"),
        ),
        field("duration", $._duration),
      ),
    _duration: ($) => choice($.quantity, $.group, $.path),

    // Tokens.

    path: ($) => prec.right(seq(field("root", $.name), repeat(seq(".", field("member", $.name))))),
    name: () => /[a-z_][A-Za-z0-9_]*/,
    primitive_name: () => /[A-Z][A-Za-z0-9_]*/,
    label: ($) => seq($.primitive_name, optional($.side)),
    // Without a blank before the parenthesis.
    side: () => token.immediate(seq("(", /[ \t]*/, choice("left", "right"), /[ \t]*/, ")")),
    side_mark: () => token.immediate(seq("(", /[ \t]*/, "side", /[ \t]*/, ")")),
    text: () => /"[^"\n]*"/,

    quantity: ($) => seq($.number, optional($.unit)),
    number: () => /[0-9]+(\.[0-9]+)?([eE][+-]?[0-9]+)?/,
    unit: ($) => seq($._factor, repeat(prec.dynamic(1, seq(optional(choice("/", "·")), $._factor)))),
    _factor: ($) => seq($._symbol, optional($.exponent)),
    _symbol: () =>
      choice("%", "mm", "cm", "um", "ms", "mN", "kg", "rad", "deg", "kHz", "Hz", "m", "s", "N", "g"),
    exponent: () => token.immediate(/\^-?[0-9]+/),

    comment: () => token(seq("//", /[^\n]*/)),
    doc_comment: () => token(prec(1, seq("///", /[^\n]*/))),
  },
});
