//! `primitive Lift is Translate`: a kind counts for its parent wherever that is named, unless it is itself named there.

use super::report;
use teachtree_base::hands::Side;
use teachtree_base::meaning::Meaning;
use teachtree_language::rules::*;
use teachtree_language::{self as language, codes};

fn rules(text: &str) -> Rules {
    let loaded = language::load_text("my.rules", text);
    let printed = report(&loaded);
    loaded.rules.unwrap_or_else(|| panic!("{printed}"))
}

#[test]
fn a_task_begins_and_ends_with_kinds_too() {
    let rules = rules(
        "primitive Move does free, Creep is Move, Grasp does close, Carry does carry, Lift is Carry, Heave is Lift, Drop is Release, Release does open
         tree t for each hand { load < 1 N => Creep  load < 2 N => Heave  load < 3 N => Lift  load < 4 N => Grasp  load < 5 N => Drop  load < 6 N => Carry  load < 7 N => Release  else => Move }
         task lift = Move .. Release with Lift without Grasp",
    );
    let names = |labels: Vec<Label>| labels.into_iter().map(|label| rules.label_name(label)).collect::<Vec<_>>();
    let task = &rules.tasks[0];
    assert_eq!(names(task.first.labels().collect()), ["Move", "Creep"]);
    assert_eq!(names(task.last.labels().collect()), ["Release", "Drop"]);
    assert_eq!(names(task.keys[0].label.labels().collect()), ["Lift", "Heave"]);
    let meaning = |name: &str| rules.meaning(rules.primitive(name).unwrap());
    assert_eq!([meaning("Heave"), meaning("Drop")], [Some(Meaning::Carry), Some(Meaning::Open)]);
}

#[test]
fn a_side_is_that_of_the_parent() {
    let rules = rules(
        "use \"bimanual.rules\"\nprimitive Assist(side) is MainGrasp\n\
         extend both_hands.shared before EqualGrasp { left.load > 3 N => Assist(left)  from(MainGrasp(left)) and right.load > 3 N => Assist(right) }",
    );
    let mut lists = Vec::new();
    for tree in &rules.trees {
        for way in tree.root.paths() {
            way.asked.iter().for_each(|(_, asked, _)| {
                asked.walk(&mut |part| {
                    if let ExprKind::From { labels, .. } = &part.kind {
                        lists.push(labels.iter().map(|label| rules.label_name(*label)).collect::<Vec<_>>());
                    }
                });
            });
        }
    }
    assert!(lists.contains(&vec!["MainGrasp(left)".to_string(), "Assist(left)".to_string()]), "{lists:?}");
}

/// In a sided primitive each hand may do something else.
#[test]
fn the_other_hand_does_something_else() {
    let rules = rules(
        "use \"bimanual.rules\"\nprimitive Join(side) does insert while other does hold, Link(side) is Join\n\
         extend both_hands.mating first { left.load > 3 N => Join(left)  right.load > 3 N => Link(right) }",
    );
    let meaning = |name: &str, side, hand| {
        rules.meaning_for(Label { primitive: rules.primitive(name).unwrap(), side: Some(side) }, hand)
    };
    for name in ["Join", "Link"] {
        for side in Side::BOTH {
            assert_eq!(meaning(name, side, Some(side)), Some(Meaning::Insert));
            assert_eq!(meaning(name, side, Some(side.other())), Some(Meaning::Hold));
            assert_eq!(meaning(name, side, None), Some(Meaning::Insert));
        }
    }
    let loaded = language::load_text("my.rules", "primitive Join does insert while other does hold\n");
    assert_eq!(loaded.diagnostics.iter().map(|one| one.code).next(), Some(codes::WRONG_SIDE));
}

#[test]
fn every_meaning_has_its_word() {
    for meaning in Meaning::ALL {
        assert_eq!(Meaning::from_name(meaning.name()), Some(meaning));
        let text = format!("primitive A does {}\ntree t for each hand {{ else => A }}", meaning.name());
        assert_eq!(rules(&text).primitives[0].does, Some(meaning));
    }
}

/// What every shipped primitive does is known.
#[test]
fn every_shipped_primitive_has_a_meaning() {
    let rules = rules("use \"bimanual.rules\"");
    assert!(rules.primitives.len() >= 18);
    for (primitive, at) in rules.primitives.iter().zip((0..).map(PrimitiveId)) {
        assert!(rules.meaning(at).is_some(), "{}", primitive.name);
    }
}

#[test]
fn pathological_declarations_are_refused_at_once() {
    // More kinds than are allowed, beside each other and in a chain; each list would name all of them.
    let beside: String = (0..5000).map(|at| format!("primitive K{at} is A\n")).collect();
    let chain: String = (1..3000).map(|at| format!("primitive K{at} is K{}\n", at - 1)).collect();
    for kinds in [beside, format!("primitive K0 is A\n{chain}")] {
        let lists = "from(A) => A ".repeat(500);
        let tree = format!("tree t for each hand {{ from(none) => A {lists} else => A }}");
        let loaded = language::load_text("my.rules", &format!("primitive A\n{kinds}{tree}"));
        assert!(loaded.diagnostics.iter().any(|one| one.code == codes::TOO_MANY_KINDS), "{}", report(&loaded));
    }
    let circle: String = (0..3000).map(|at| format!("primitive K{at} is K{}\n", (at + 1) % 3000)).collect();
    let loaded = language::load_text("my.rules", &format!("{circle}tree t for each hand {{ else => K0 }}"));
    let codes: Vec<&str> = loaded.diagnostics.iter().map(|one| one.code).collect();
    assert_eq!(codes, [codes::CIRCULAR_KINDS]);
}
