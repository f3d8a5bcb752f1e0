//! What is proved about branches, and what is not.

use super::report;
use teachtree_language::rules::{Consequent, TreeScope};
use teachtree_language::{self as language, codes};

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
        "load > 1 N => A  not (load > 2 N) => B",
        "load > 2 N { load > 1 N => A }  else => B",
        "load above 2 N until below 1 N => A  load <= 2 N => B",
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
        "load > 2 N => A  load < 2 N => B",
        "load > 1 N => A  load above 2 N until below 1 N => B",
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
            assert!(matches!(choice.then, Consequent::Primitive(_)));
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

#[test]
fn a_second_tree_is_checked_too() {
    let text = "primitive A, B\ntree one for each hand { else => A }\n\
        tree two for each hand { else => A  true => B }\n\
        tree three for each hand { load > 1 N => A }\n";
    let loaded = language::load_text("my.rules", text);
    let codes: Vec<&str> = loaded.diagnostics.iter().map(|finding| finding.code).collect();
    assert_eq!(
        codes,
        [codes::SECOND_TREE, codes::AFTER_ELSE, codes::NOT_EXHAUSTIVE, codes::SECOND_TREE],
        "{}",
        report(&loaded)
    );
}

/// The warnings for a file that extends the shipped trees and declares `Wait`.
fn warnings(text: &str) -> Vec<&'static str> {
    let loaded = language::load_text("my.rules", &format!("use \"contact.rules\"\nprimitive Wait\n{text}"));
    assert!(loaded.rules.is_some(), "{}", report(&loaded));
    let found = loaded.diagnostics.iter().map(|finding| finding.code);
    found.filter(|code| *code == codes::FORGOTTEN_FROM).collect()
}

#[test]
fn a_branch_that_loses_its_thread_behind_a_new_leaf_is_warned_of() {
    for text in [
        "extend single_hand.apart first { near => Wait }",
        "extend single_hand.apart first { from(Wait) or near => Wait }",
        "extend single_hand.apart first { close: near { from(Move) => Wait  else => Approach } }",
        "extend single_hand.inside before Turn { moving => Wait }",
    ] {
        assert_eq!(warnings(text), [codes::FORGOTTEN_FROM], "{text}");
    }
}

#[test]
fn a_new_leaf_that_takes_no_thread_away_is_not_a_reason_to_warn() {
    for text in [
        // Something asks for it.
        "extend single_hand.apart first { near and from(Approach, Wait) => Wait  from(Wait) and near => Approach }",
        "extend single_hand.apart first { near => Wait }  extend single_hand first { from(Wait) and touching => Approach }",
        "extend single_hand.apart first { near => Wait }  for each hand { latch waited set (from(Wait)) for 60 ms clear touching }
         extend single_hand first { waited and moving => Slide }",
        // Nothing of the branch's own is asked for after it.
        "extend single_hand.apart last { near => Wait }",
        "extend single_hand before carried { moving => Wait }",
        "extend single_hand first { moving => Wait }",
        "extend single_hand.loose before Trace { moving => Wait }",
        "extend single_hand.held before Press { moving => Wait }",
    ] {
        assert_eq!(warnings(text), [""; 0], "{text}");
    }
}

/// The examples of two authors extend one place; a file that uses both says which one comes first.
#[test]
fn a_third_file_orders_the_extensions_of_two_others() {
    let folder = tempfile::tempdir().unwrap();
    let example = |name: &str| {
        std::fs::read_to_string(format!("{}/examples/primitives/{name}/{name}.rules", crate::ROOT)).unwrap()
    };
    for name in ["shake", "pour", "show"] {
        std::fs::write(folder.path().join(format!("{name}.rules")), example(name)).unwrap();
    }
    let load = |uses: &str| {
        let path = folder.path().join("mine.rules");
        std::fs::write(&path, uses).unwrap();
        language::load(&language::Request { files: vec![path], ..language::Request::default() })
    };
    // The primitives of the leaves in front of `carried`, in order; or the report.
    let order = |uses: &str| {
        let loaded = load(uses);
        let Some(rules) = &loaded.rules else { return vec![report(&loaded)] };
        let leaves = rules.trees[0].root.choices.iter().filter_map(|choice| match &choice.then {
            Consequent::Primitive(label) => Some(rules.primitives[label.primitive.index()].name.clone()),
            _ => None,
        });
        leaves.filter(|name| ["Shake", "Pour", "Show"].contains(&name.as_str())).collect()
    };
    let [clash] = order("use \"shake.rules\"\nuse \"pour.rules\"\n").try_into().unwrap();
    assert!(clash.starts_with("error[E406]"), "{clash}");
    let advice = "or give the order in the file that uses both: `use \"pour.rules\" before \"shake.rules\"`";
    assert!(clash.contains(advice), "{clash}");
    assert_eq!(order("use \"shake.rules\"\nuse \"pour.rules\" before \"shake.rules\"\n"), ["Pour", "Shake"]);
    assert_eq!(order("use \"pour.rules\"\nuse \"shake.rules\" before \"pour.rules\"\n"), ["Shake", "Pour"]);
    assert_eq!(order("use \"shake.rules\" before \"pour.rules\"\nuse \"pour.rules\"\n"), ["Shake", "Pour"]);
    // Of three files two orders make one, but only where they do.
    let chain =
        "use \"shake.rules\" before \"pour.rules\"\nuse \"pour.rules\"\nuse \"show.rules\" before \"shake.rules\"\n";
    assert_eq!(order(chain), ["Show", "Shake", "Pour"]);
    let [clash] = order(&chain.replace("before \"shake.rules\"", "before \"pour.rules\"")).try_into().unwrap();
    assert!(clash.contains("E406"), "{clash}");
    // The order is for the files that say it, wherever they are used from.
    std::fs::write(
        folder.path().join("both.rules"),
        "use \"shake.rules\"\nuse \"pour.rules\" before \"shake.rules\"\n",
    )
    .unwrap();
    assert_eq!(order("use \"both.rules\"\n"), ["Pour", "Shake"]);
    let [unknown] = order("use \"shake.rules\" before \"pur.rules\"\nuse \"pour.rules\"\n").try_into().unwrap();
    assert!(unknown.contains("E201") && unknown.contains("pur.rules"), "{unknown}");
    // What `fmt` writes says the same.
    let written = language::format::format("use   \"pour.rules\"    before \"shake.rules\"\n");
    assert_eq!(written.unwrap_or_default(), "use \"pour.rules\" before \"shake.rules\"\n");
}
