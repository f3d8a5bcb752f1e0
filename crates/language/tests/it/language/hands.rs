//! Rules for two hands that are written once: `other`, `either`, `both`, and leaves with `(side)`.

use super::report;
use teachtree_language::graph::{lower, text as plan};
use teachtree_language::rules::Rules;
use teachtree_language::{self as language, codes};

fn rules(text: &str) -> Rules {
    let loaded = language::load_text("my.rules", text);
    loaded.rules.unwrap_or_else(|| panic!("{}", report(&language::load_text("my.rules", text))))
}

/// The errors of a text.
fn codes_of(rules: &str) -> Vec<&'static str> {
    let codes = language::load_text("my.rules", rules).diagnostics.into_iter().map(|finding| finding.code);
    codes.filter(|code| code.starts_with('E')).collect()
}

const HEAD: &str = "primitive A, B, C, D(side)
    for each hand {
      signal p = target.over_socket
      signal q = target.depth > 1 mm
      latch  l set p and other.q clear other.p and not q
    }\n";

/// A tree of both hands with these choices.
fn tree(choices: &str) -> String {
    format!("{HEAD}tree t for left, right {{\n{choices}\n}}\n")
}

/// What is written once is what would be written for each hand.
#[test]
fn what_is_written_once_is_the_same_as_what_is_written_twice() {
    for (once, twice) in [
        ("either.p => A  else => B", "left.p or right.p => A  else => B"),
        ("both.p and not either.q => A  else => B", "left.p and right.p and not (left.q or right.q) => A  else => B"),
        ("either.l => A  else => B", "left.l or right.l => A  else => B"),
        ("p => D(side)  else => B", "left.p => D(left)  right.p => D(right)  else => B"),
        (
            "q and not other.q and load > 1 N => D(side)  else => B",
            "left.q and not right.q and left.load > 1 N => D(left)
             right.q and not left.q and right.load > 1 N => D(right)  else => B",
        ),
        (
            "p { from(D) => stay  l => D(side)  else => A }  else => B",
            "left.p { from(D) => stay  left.l => D(left)  right.l => D(right)  else => A }  else => B",
        ),
        (
            "(either.target.over_socket) for 20 ms => A  else => B",
            "(left.target.over_socket or right.target.over_socket) for 20 ms => A  else => B",
        ),
    ] {
        let once = once.replacen("p {", "left.p {", usize::from(once.starts_with("p {")));
        let (one, two) = (rules(&tree(&once)), rules(&tree(twice)));
        assert_eq!(plan(&lower(&one)), plan(&lower(&two)), "{once}");
    }
}

/// A choice with `(side)` is one where others are put before or after it, and where it has a name.
#[test]
fn a_choice_for_each_side_is_one_place() {
    let base = tree("mine: p => D(side)  else => B");
    for (anchor, wanted) in [
        ("before D", "left.q => A  left.p => D(left)  right.p => D(right)  else => B"),
        ("before mine", "left.q => A  left.p => D(left)  right.p => D(right)  else => B"),
        ("after D", "left.p => D(left)  right.p => D(right)  left.q => A  else => B"),
        ("after mine", "left.p => D(left)  right.p => D(right)  left.q => A  else => B"),
    ] {
        let extended = rules(&format!("{base}extend t {anchor} {{ left.q => A }}\n"));
        let written = rules(&tree(wanted));
        assert_eq!(plan(&lower(&extended)), plan(&lower(&written)), "{anchor}");
    }
}

#[test]
fn hands_that_cannot_be_meant_are_reported() {
    for (text, code) in [
        ("signal a = other.load > 1 N\n".to_string(), codes::WHOSE_HAND),
        (tree("other.p => A  else => B"), codes::WHOSE_HAND),
        ("signal a = either.load > 1 N\n".to_string(), codes::WRONG_TYPE),
        ("signal a = both.contacts.handled\n".to_string(), codes::WRONG_TYPE),
        ("signal a = either.closing > 1 mm/s\n".to_string(), codes::NO_HAND),
        ("for each hand { signal a = other.closing > 1 mm/s }\n".to_string(), codes::NO_HAND),
        ("signal a = either.touchin\n".to_string(), codes::UNKNOWN_NAME),
        (tree("p => C(side)  else => B"), codes::WRONG_SIDE),
        (format!("{HEAD}tree t for each hand {{ p => D(side)  else => B }}\n"), codes::WRONG_SIDE),
        ("stream { both.force : vec3 N }\n".to_string(), codes::NAME_TAKEN),
        (
            "for each hand { signal a = any(contacts.handled and other.contacts.handled) }\n".to_string(),
            codes::DIFFERENT_ARRAYS,
        ),
    ] {
        assert_eq!(codes_of(&text), [code], "{text}");
    }
}

/// The words were names before they were hands, and still are.
#[test]
fn values_may_be_called_like_the_hands() {
    let text = "primitive A, B
        for each hand { signal p = target.over_socket }
        signal both   = left.p and right.p
        signal other  = left.target.velocity - right.target.velocity
        signal either = other.z > 1 mm/s or both
        tree t for left, right { either and both.p => A  else => B }\n";
    let twice = text.replace("both.p", "left.p and right.p");
    assert_eq!(plan(&lower(&rules(text))), plan(&lower(&rules(&twice))));
}
