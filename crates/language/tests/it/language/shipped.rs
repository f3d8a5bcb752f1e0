//! The shipped rule files, and samples of the language.

use super::report;
use std::path::PathBuf;
use teachtree_base::channels::Fallback;
use teachtree_base::diagnostic::Severity;
use teachtree_base::hands::Side;
use teachtree_language::rules::{Branch, Consequent, RelabelKind, TreeScope};
use teachtree_language::{self as language, LoadedRules, Request, Rules, SHIPPED, codes};

fn load(file: &str, hand: Option<&str>, overrides: &[(&str, &str)]) -> LoadedRules {
    language::load(&Request {
        files: vec![PathBuf::from(file)],
        hand_file: hand.map(str::to_string),
        overrides: overrides.iter().map(|(name, value)| ((*name).to_string(), (*value).to_string())).collect(),
        ..Request::default()
    })
}

/// The path of a shipped file in the repository.
fn in_repository(name: &str) -> String {
    format!("{}/rules/{name}", crate::ROOT)
}

fn rules(loaded: LoadedRules) -> Rules {
    // A part needs no tree.
    let (parts, found): (Vec<_>, Vec<_>) =
        loaded.diagnostics.iter().partition(|finding| finding.code == codes::NO_TREE);
    assert!(parts.len() <= 1 && found.is_empty(), "{}", report(&loaded));
    loaded.rules.unwrap()
}

/// A branch as indented text, conditions as they are written.
fn draw(rules: &Rules, branch: &Branch, indent: usize, text: &mut String) {
    for choice in &branch.choices {
        let name = choice.name.as_ref().map_or(String::new(), |name| format!("{name}: "));
        let condition = choice.condition.as_ref().map_or("else", |condition| rules.sources.text(condition.span));
        let then = match &choice.then {
            Consequent::Primitive(label) => format!(" => {}", rules.label_name(*label)),
            Consequent::Stay => " => stay".to_string(),
            Consequent::Separate => " => separate".to_string(),
            Consequent::Branch(_) => String::new(),
        };
        let condition = condition.split_whitespace().collect::<Vec<_>>().join(" ");
        text.push_str(&format!("{}{name}{condition}{then}\n", "  ".repeat(indent)));
        if let Consequent::Branch(below) = &choice.then {
            draw(rules, below, indent + 1, text);
        }
    }
}

#[test]
fn shipped_files_load_without_a_word() {
    // What hand models share says nothing by itself.
    for (name, _) in SHIPPED.iter().filter(|(name, _)| *name != "wrist_force.rules") {
        for hand in [&in_repository("hand_force.rules"), "hand_flags.rules"] {
            rules(load(&in_repository(name), Some(hand), &[]));
        }
    }
}

#[test]
fn nothing_named_is_the_contact_rules_with_forces_and_failures() {
    let rules = rules(language::load(&Request::default()));
    let files: Vec<&str> = rules.sources.files.iter().map(|source| source.name.as_str()).collect();
    assert_eq!(
        files,
        [
            "rules/contact.rules",
            "rules/single_hand.rules",
            "rules/stream.rules",
            "rules/failures.rules",
            "rules/jaws.rules",
            "rules/hand_force.rules"
        ]
    );
    assert_eq!(rules.primitives.len(), 21);
    assert_eq!(rules.tasks.iter().filter(|task| task.failure).count(), 5);
    let force = rules.channels.iter().find(|channel| channel.name == "fingers.force").unwrap();
    assert_eq!(force.absent, Fallback::Refused, "a hand that trusts forces needs them");
    let contact = rules.channels.iter().find(|channel| channel.name == "fingers.contact").unwrap();
    assert!(matches!(&contact.absent, Fallback::NormAbove { channel, on, off, needed: true }
        if channel == "fingers.force" && (*on, *off) == (0.05, 0.02)));
}

/// The default rules share names and channels with no hand model, but for channels that are declared alike.
#[test]
fn the_default_rules_go_with_every_hand_file() {
    for (name, _) in SHIPPED.iter().filter(|(name, _)| name.starts_with("hand_")) {
        for two_hands in [false, true] {
            // This file brings the rules of two hands.
            let two_hands = two_hands || *name == "hand_gripper_pair.rules";
            let loaded =
                language::load(&Request { two_hands, hand_file: Some((*name).to_string()), ..Request::default() });
            let errors = loaded.diagnostics.iter().filter(|finding| finding.severity == Severity::Error).count();
            assert!(errors == 0 && loaded.rules.is_some(), "{name}: {}", report(&loaded));
        }
    }
}

#[test]
fn flags_do_without_forces() {
    let rules = rules(load("contact.rules", Some(&in_repository("hand_flags.rules")), &[]));
    let force = rules.channels.iter().find(|channel| channel.name == "fingers.force").unwrap();
    assert_eq!(force.absent, Fallback::Constant(0.0));
    assert!(rules.param("grasp_on").is_none());
}

#[test]
fn extensions_are_spliced_into_the_tree() {
    let rules = rules(load("bimanual.rules", None, &[]));
    let mut text = String::new();
    for tree in &rules.trees {
        text.push_str(&format!("{}\n", tree.name));
        draw(&rules, &tree.root, 1, &mut text);
    }
    insta::assert_snapshot!(text);
}

#[test]
fn tasks_stand_in_the_order_of_the_chapter() {
    let rules = rules(load("bimanual.rules", None, &[]));
    let tasks: Vec<&str> = rules.tasks.iter().map(|task| task.name.as_str()).collect();
    assert_eq!(
        tasks,
        [
            "turn_screw",
            "peg_in_hole",
            "peg_pullout_from_hole",
            "fit",
            "pick_and_follow",
            "push_and_trace",
            "pick_and_press",
            "push",
            "carry_together",
            "pick_and_place",
            "slide"
        ]
    );
    let place = rules.tasks.iter().find(|task| task.name == "pick_and_place").unwrap();
    let keys: Vec<String> = place.keys.iter().map(|key| rules.label_name(key.label.label)).collect();
    assert_eq!(keys, ["Translate", "Place", "Pass"]);
    let trail: Vec<&str> = rules.relabels.iter().map(|rule| rule.text.as_str()).collect();
    insta::assert_snapshot!(trail.join("\n"));
    let hand_over = rules.relabels.iter().find(|rule| matches!(rule.kind, RelabelKind::BetweenInHands { .. }));
    assert!(hand_over.is_some());
}

#[test]
fn sides_and_settling_are_resolved() {
    let rules = rules(load("bimanual.rules", None, &[]));
    let tree = rules.tree(TreeScope::BothHands).unwrap();
    assert_eq!(tree.settle.as_ref().unwrap().value, 0.05);
    let mut sides = Vec::new();
    fn leaves(branch: &Branch, sides: &mut Vec<Side>) {
        for choice in &branch.choices {
            match &choice.then {
                Consequent::Branch(below) => leaves(below, sides),
                Consequent::Primitive(label) => sides.extend(label.side),
                _ => {}
            }
        }
    }
    leaves(&tree.root, &mut sides);
    assert_eq!(sides, [Side::Left, Side::Right]);
}

#[test]
fn signals_come_after_what_they_read() {
    let loaded = language::load_text("my.rules", "signal a = b or c\nsignal b = c\nsignal c = true\nsignal d = true\n");
    let rules = loaded.rules.unwrap();
    let names: Vec<&str> = rules.signals.iter().map(|signal| signal.name.as_str()).collect();
    assert_eq!(names, ["c", "b", "a", "d"]);
}

#[test]
fn overrides_change_params_and_what_is_computed_from_them() {
    let text = "param a = 3 mm in 1 mm .. 9 mm\nparam b = 2 * a\n";
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("my.rules");
    std::fs::write(&file, text).unwrap();
    let rules = rules(load(file.to_str().unwrap(), None, &[("a", "0.5 cm")]));
    assert!((rules.param("b").unwrap().value - 0.010).abs() < 1e-15);

    let plain = language::load_text("my.rules", text).rules.unwrap();
    assert_ne!(plain.digest(), rules.digest());
    assert_eq!(plain.digest(), language::load_text("other name.rules", text).rules.unwrap().digest());
}

#[test]
fn bad_overrides_are_named() {
    let mut text = String::new();
    for bad in ["touch_on=3 mm", "touch_on=3", "touch_on=much", "touch_on=9 N", "tuch_on=0.1 N"] {
        let (name, value) = bad.split_once('=').unwrap();
        let loaded = load(&in_repository("stream.rules"), None, &[(name, value)]);
        assert!(loaded.rules.is_none());
        text.push_str(&report(&loaded));
    }
    insta::assert_snapshot!(text);
}

#[test]
fn a_file_beside_yours_replaces_the_shipped_one() {
    let folder = tempfile::tempdir().unwrap();
    let stream = SHIPPED.iter().find(|(name, _)| *name == "stream.rules").unwrap().1.replace("0.05 N", "0.07 N");
    std::fs::write(folder.path().join("stream.rules"), stream).unwrap();
    let mine = folder.path().join("mine.rules");
    std::fs::write(&mine, "use \"stream.rules\"\nuse \"contact.rules\"\n").unwrap();
    let rules = rules(load(mine.to_str().unwrap(), None, &[]));
    assert_eq!(rules.param("touch_on").unwrap().value, 0.07);
    assert_eq!(rules.sources.files.iter().filter(|source| source.name.ends_with("stream.rules")).count(), 1);
}

#[test]
fn copies_of_shipped_files_are_the_shipped_files() {
    let folder = tempfile::tempdir().unwrap();
    let copy = |name: &str, from: &str, to: &str| {
        let text = SHIPPED.iter().find(|(shipped, _)| *shipped == name).unwrap().1.replace(from, to);
        std::fs::write(folder.path().join(name), text).unwrap();
    };
    copy("contact.rules", "", "");
    copy("stream.rules", "0.05 N", "0.07 N");
    let copied = folder.path().join("contact.rules");
    // A copy still looks beside itself first: the changed file is found through it, and once.
    let beside = load(copied.to_str().unwrap(), None, &[]);
    assert_eq!(beside.sources.files.len(), 4);
    assert_eq!(rules(beside).param("touch_on").unwrap().value, 0.07);
    let shipped = rules(load("contact.rules", None, &[]));
    assert_eq!(shipped.param("touch_on").unwrap().value, 0.05);
    let both = language::load(&Request {
        files: vec![in_repository("contact.rules").into(), folder.path().join("contact.rules")],
        ..Request::default()
    });
    assert_eq!(rules(both).digest(), shipped.digest());
}

#[test]
fn samples_of_the_design_load() {
    let folder = format!("{}/tests/fixtures/language", crate::ROOT);
    let loaded = load(&format!("{folder}/bimanual.rules"), None, &[]);
    assert!(loaded.rules.is_some(), "{}", report(&loaded));
    assert!(loaded.sources.files.iter().all(|source| source.name.starts_with(&folder)));
}
