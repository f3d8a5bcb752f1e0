; Each node has one capture, because editors disagree on which of several applies.

(comment) @comment
(doc_comment) @comment.documentation
(text) @string
(number) @constant.numeric
(unit) @string.special
(truth) @constant.builtin.boolean
"none" @constant.builtin

[
  "above" "after" "at" "become" "becomes" "before" "below" "between" "both" "bridging" "clear" "does" "each" "else" "extend" "failure" "first" "for"
  "from" "hand" "in" "is" "joined" "last" "lasting" "latch" "least" "next" "one" "optional" "other" "over" "param" "per" "primitive" "relabel"
  "separate" "sequence" "set" "settle" "shorter" "signal" "since" "stay" "stream" "task" "than" "the" "times" "travelling" "tree" "turning" "until"
  "use" "while" "with" "within" "without"
] @keyword
["and" "not" "or"] @keyword.operator
["=" "=>" "+" "-" "*" "/" "<" "<=" ">" ">=" "==" "!=" ".."] @operator
["(" ")" "[" "]" "{" "}"] @punctuation.bracket
["," ":" "."] @punctuation.delimiter

[(kind) (axis)] @type.builtin
(primitive_name) @type
[(side) (side_mark) "left" "right"] @variable.builtin
(meaning) @constant

(param name: (name) @function)
(signal name: (name) @function)
(latch name: (name) @function)
(tree name: (name) @function)
(task name: (name) @function)
(choice name: (name) @label)
(call function: (name) @function.builtin)

((path root: (name) @variable.builtin member: (name)) (#any-of? @variable.builtin "left" "right" "other" "either" "both"))
((path root: (name) @variable) (#not-any-of? @variable "left" "right" "other" "either" "both"))
(path member: (name) @variable.member)
(component member: (name) @variable.member)
(pick slot: (name) @variable.member)
(anchor (name) @label)
(part (name) @function)
(extend_task name: (name) @function)
(relabel task: (name) @function)
(task before: (name) @function)
