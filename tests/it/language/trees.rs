//! What is proved about branches, and what is not.

use super::report;
use teachtree::language::rules::{Then, TreeScope};
use teachtree::language::{self, codes};

/// The codes that a tree of each hand with these choices is reported for.
fn codes_of(choices: &str) -> Vec<&'static str> {
    let text = format!(
        "primitive A, B, C, D(side)\n\
         for each hand {{\n\
           signal p = target.over_socket\n  signal q = target.depth > 1 mm\n  signal r = load > 1 N\n\
           latch l set p clear q\n\
         }}\n\
         tree t for each hand {{\n{choices}\n}}\n"
    );
    let loaded = language::load_text("my.rules", &text);
    loaded.diagnostics.iter().map(|finding| finding.code).filter(|code| code.starts_with('E')).collect()
}

#[test]
fn exhaustive_branches_need_no_else() {
    for choices in [
        "p => A  not p => B",
        "p and q => A  not p => B  not q => C",
        "p => A  q => B  not (p or q) => C",
        "from(A) => A  not from(A, B) => B  from(B) => C",
        "from(none) => A  not from(none) => B",
        "from(D(left)) => A  from(D(right)) => B  not from(D) => C",
        "l => A  not l and p => B  not l and not p { q => A  not q => B }",
        "load > 1 N => A  not (load > 1 N) => B",
        "(p) for 30 ms => A  not ((p) for 30 ms) => B",
        "true => A",
    ] {
        assert_eq!(codes_of(choices), [""; 0], "{choices}");
    }
}

#[test]
fn what_is_not_proved_needs_else() {
    for choices in [
        "p => A  q => B",
        "p and q => A  not p and not q => B",
        "from(A) => A  from(B, C, D, none) and p => B",
        "from(D(left)) => A  from(D(right)) => B  not from(D) and not p => C",
        "(p) for 30 ms => A  not ((p) for 40 ms) => B",
        "load > 1 N => A  not (load > 2 N) => B",
        "p => A  not p { q => A }",
        "",
    ] {
        assert_eq!(codes_of(choices), [codes::NOT_EXHAUSTIVE], "{choices}");
    }
}

#[test]
fn stay_is_for_when_something_is_going_on() {
    for choices in [
        "from(none) => A  else => stay",
        "from(A) => stay  else => B",
        "not from(none) { p => stay  else => A }  else => A",
        "from(none, A) and p => A  from(none) => B  q => stay  else => A",
        "rises(p) => stay  else => A",
        "p and from(none) => A  not p and from(none) => A  not from(none) => stay  else => A",
        "p { from(none) => A  else => stay }  else => A",
        "p or not p and from(none) or from(none) => A  else => stay",
    ] {
        assert_eq!(codes_of(choices), [""; 0], "{choices}");
    }
    for choices in [
        "p => stay  else => A",
        "from(none) and p => A  else => stay",
        "l => stay  else => A",
        "p { from(none) => A  else => A }  else => stay",
        "not rises(p) => stay  else => A",
        "from(A, none) => stay  else => A",
    ] {
        assert_eq!(codes_of(choices), [codes::STAY_FROM_NONE], "{choices}");
    }
}

#[test]
fn anchors_put_choices_where_they_say() {
    let text = "use \"hand_flags.rules\"\n\
        primitive A, B, C\n\
        tree t for each hand { grasped => A  named: any(touches) => B  else => C }\n\
        extend t last { all(touches) => C }\n\
        extend t before named { grasped and from(A) => C }\n\
        extend t after A { grasped and from(B) => C }\n\
        extend t first { grasped and from(C) => C }\n\
        extend t first { second: grasped and from(none) => C }\n\
        extend t before second { beside: grasped and all(touches) => B }\n";
    let loaded = language::load_text("my.rules", text);
    let rules = loaded.rules.clone().unwrap_or_else(|| panic!("{}", report(&loaded)));
    let root = &rules.tree(TreeScope::EachHand).unwrap().root;
    let order: Vec<String> = root
        .choices
        .iter()
        .map(|choice| {
            assert!(matches!(choice.then, Then::Primitive(_)));
            choice.condition.as_ref().map_or("else", |condition| rules.sources.text(condition.span)).to_string()
        })
        .collect();
    assert_eq!(
        order,
        [
            "grasped and from(C)",
            "grasped and all(touches)",
            "grasped and from(none)",
            "grasped",
            "grasped and from(B)",
            "grasped and from(A)",
            "any(touches)",
            "all(touches)",
            "else"
        ]
    );
}
