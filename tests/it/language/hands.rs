//! Rules for two hands that are written once: `other`, `either`, `both`, and leaves with `(side)`.

use super::report;
use std::collections::BTreeMap;
use teachtree_base::hands::{Finger, Side};
use teachtree_engine::evaluator::evaluate;
use teachtree_engine::reference;
use teachtree_frames::frames::{ColumnKey, Frames, HandLayout, Layout};
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

/// A choice with `(side)` is one where others are put before or behind it, and where it has a name.
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

/// A log of the hands with their loads, in N.
fn log(rules: &Rules, loads: &[(Side, Vec<f64>)]) -> Frames {
    let len = loads[0].1.len();
    let hand = |(side, _): &(Side, _)| HandLayout {
        side: *side,
        fingers: vec![Finger::Thumb],
        contacts: Vec::new(),
        knows_distance: false,
    };
    let channel = rules.channels.iter().position(|channel| channel.name == "load").unwrap() as u32;
    let column = |(side, load): &(Side, Vec<f64>)| {
        let key = ColumnKey { channel, side: Some(*side), slot: 0, component: 0 };
        (key, load.clone())
    };
    Frames {
        layout: Layout { rate_hz: 1000.0, hands: loads.iter().map(hand).collect() },
        channels: rules.channels.clone(),
        columns: loads.iter().map(column).collect::<BTreeMap<_, _>>(),
        len,
        time: (0..len).map(|frame| frame as f64 / 1000.0).collect(),
        stretches: std::iter::once(0..len).collect(),
        ..Frames::default()
    }
}

#[test]
fn other_is_the_other_hand_and_nothing_where_there_is_none() {
    let text = "primitive More, Less
        for each hand {
          signal carried = load
          signal spare   = carried - other.carried          // seen from the other hand, `other` is this one
          latch  more    set spare > 0 N  clear other.spare >= 0 N
        }
        tree t for each hand { more => More  else => Less }";
    let rules = rules(text);
    let loads = [vec![1.0, 2.0, 3.0, 2.0, 2.0], vec![2.0, 1.0, 1.0, 2.0, 4.0]];
    let both = log(&rules, &[(Side::Left, loads[0].clone()), (Side::Right, loads[1].clone())]);
    let labels = |frames: &Frames, side: Side| -> Vec<String> {
        let compiled = evaluate(&lower(&rules), frames).unwrap();
        assert_eq!(compiled, reference::evaluate(&rules, frames).unwrap());
        let runs = compiled[0].hands[&side].iter();
        let labels = runs.flat_map(|run| (run.start..run.end).map(|_| rules.label_name(run.label.unwrap())));
        labels.collect()
    };
    assert_eq!(labels(&both, Side::Left), ["Less", "More", "More", "Less", "Less"]);
    assert_eq!(labels(&both, Side::Right), ["More", "Less", "Less", "Less", "More"]);
    // Alone, a hand has all of the load.
    let alone = log(&rules, &[(Side::Left, vec![0.0, 1.0, 1.0])]);
    assert_eq!(labels(&alone, Side::Left), ["Less", "More", "More"]);
}
