//! `fmt`: one style, comments and meaning kept.

use proptest::prelude::*;
use teachtree_language::format::format;
use teachtree_language::graph::{lower, text};
use teachtree_language::{SHIPPED, load_text};

/// Words, signs and comments, without blanks.
fn bare(text: &str) -> String {
    text.chars().filter(|c| !c.is_whitespace()).collect()
}

/// A text whose blanks between words were stretched at random, and whose lines were moved.
fn shaken(text: &str, mut seed: u64) -> String {
    let mut out = String::new();
    for line in text.lines() {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let random = |at: u32| (seed >> at) as usize % 4;
        let code = line.trim();
        out.push_str(&" ".repeat(random(33)));
        if code.starts_with("//") {
            out.push_str(code);
        } else {
            let mut rest = code.splitn(2, "//");
            let words: Vec<&str> = rest.next().unwrap().split(' ').filter(|word| !word.is_empty()).collect();
            out.push_str(&words.join(&" ".repeat(1 + random(37))));
            if let Some(comment) = rest.next() {
                out.push_str(&format!("{}//{comment}", " ".repeat(1 + random(41))));
            }
        }
        out.push_str(&" ".repeat(random(45)));
        out.push_str(if random(49) == 0 { "\r\n" } else { "\n" });
        if code.is_empty() {
            out.push('\n');
        }
    }
    out
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn formatting_keeps_the_meaning_and_is_done_once(which in 0..SHIPPED.len(), seed in any::<u64>()) {
        let (name, shipped) = SHIPPED[which];
        let shaken = shaken(shipped, seed);
        let once = format(&shaken).unwrap_or_else(|findings| panic!("{name}: {findings:?}\n{shaken}"));
        prop_assert_eq!(&format(&once).unwrap(), &once, "{} is not formatted at once", name);
        prop_assert_eq!(bare(&once), bare(shipped));
        let graph = |text_of: &str| load_text(name, text_of).rules.map(|rules| text(&lower(&rules)));
        prop_assert_eq!(graph(&once), graph(shipped));
    }
}

#[test]
fn shipped_rules_are_in_the_one_style() {
    for (name, shipped) in SHIPPED {
        assert_eq!(&format(shipped).unwrap(), shipped, "{name}: `teachtree fmt` would change it");
    }
}

#[test]
fn a_file_takes_the_one_style() {
    let written = "\n\nuse \"contact.rules\"   \n\n\n\nparam   far=1 m in 0.5 m..2 m // the range\n  primitive A,B( side )\nfor each hand {\nsignal   x = norm( target.velocity )>1 m/s\n      signal long = x\n                 and x\n}\nextend single_hand first{\n   x   => A\n   long=> B(left)   // a comment\n}";
    let expected = "use \"contact.rules\"\n\nparam far = 1 m in 0.5 m .. 2 m // the range\nprimitive A, B(side)\nfor each hand {\n  signal x = norm(target.velocity) > 1 m/s\n  signal long = x\n             and x\n}\nextend single_hand first {\n  x => A\n  long => B(left)   // a comment\n}\n";
    assert_eq!(format(written).unwrap(), expected);
}

#[test]
fn what_is_not_understood_is_not_moved() {
    assert!(format("param = 3\n").is_err());
}

/// The style is the house's: what the shipped files align stays aligned.
#[test]
fn shipped_columns_stay_below_each_other() {
    let text = SHIPPED.iter().find(|(name, _)| *name == "single_hand.rules").unwrap().1;
    let formatted = format(text).unwrap();
    let changed: Vec<(&str, &str)> = text.lines().zip(formatted.lines()).filter(|(was, is)| was != is).collect();
    assert!(changed.len() <= 3, "{changed:#?}");
}
