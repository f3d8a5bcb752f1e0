//! `primitive Lift is Translate`: a kind counts for its parent wherever that is named, unless it is itself named there.

use super::report;
use proptest::prelude::*;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use teachtree_analysis::analyze;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::meaning::Meaning;
use teachtree_engine::evaluator::evaluate;
use teachtree_engine::reference;
use teachtree_frames::frames::{ColumnKey, Frames, HandLayout, Layout};
use teachtree_language::graph::lower;
use teachtree_language::rules::*;
use teachtree_language::{self as language, codes};

fn rules(text: &str) -> Rules {
    let loaded = language::load_text("my.rules", text);
    let printed = report(&loaded);
    loaded.rules.unwrap_or_else(|| panic!("{printed}"))
}

/// The leaves of the tree, each on a speed of its own, so that a log with these speeds has these labels.
const TREE: [&str; 6] = ["A", "B", "C", "D", "E", "F"];

/// A rule set in which the primitives are kinds as `parents` says (position of the parent), or with each list written out in full.
struct KindRules {
    parents: Vec<Option<usize>>,
    expands: bool,
}

impl KindRules {
    /// The nearest of the named primitives that this one is, or is a kind of.
    fn counts_for(&self, mut one: usize, named: &[usize]) -> Option<usize> {
        loop {
            if named.contains(&one) {
                return Some(one);
            }
            one = self.parents[one]?;
        }
    }

    /// What stands where `labels` are written in something that names `named`.
    fn list(&self, labels: &[usize], named: &[usize]) -> Vec<&'static str> {
        let counts = |one: &usize| match self.expands {
            true => self.counts_for(*one, named).is_some_and(|label| labels.contains(&label)),
            false => labels.contains(one),
        };
        (0..TREE.len()).filter(counts).map(|one| TREE[one]).collect()
    }

    fn any(&self, labels: &[usize], named: &[usize]) -> String {
        format!("({})", self.list(labels, named).join(" or "))
    }

    fn text(&self, from: &[Vec<usize>], tasks: &[(usize, usize)], relabels: &[[usize; 4]]) -> String {
        let mut text = "stream { for each hand { speed : scalar m/s } }\nprimitive ".to_string();
        let declared = TREE.iter().zip(&self.parents).map(|(name, parent)| match parent {
            Some(parent) if !self.expands => format!("{name} is {}", TREE[*parent]),
            _ => name.to_string(),
        });
        text += &(declared.collect::<Vec<_>>().join(", ") + "\n");
        // Which leaf was before changes what comes: a list of `from` is seen in the leaves.
        text += "tree t for each hand {\n";
        for (at, list) in from.iter().enumerate() {
            let _ = writeln!(
                text,
                "  from({}) and speed > {at} m/s and speed < {}.4 m/s => {}",
                self.list(list, list).join(", "),
                at,
                TREE[(at + 1) % 6]
            );
        }
        for (at, name) in TREE.iter().enumerate() {
            let _ = writeln!(text, "  speed < {} m/s => {name}", at + 1);
        }
        text += "  else => A\n}\n";
        for (at, (key, without)) in tasks.iter().enumerate() {
            // A task begins with A, ends with F: they are named too.
            let named = [0, 5, *key, *without];
            let keys = self.list(&[*key], &named).join(" or ");
            let without = self.list(&[*without], &named).join(", ");
            let _ = writeln!(text, "task t{at} = A .. F with {keys} without {without}");
        }
        text += "relabel {\n";
        for rule in relabels {
            let [what, before, after, becomes] = *rule;
            let [what, before, after] = [what, before, after].map(|label| self.any(&[label], rule));
            let _ = writeln!(text, "  {what}+ between {before} and {after} becomes {}", TREE[becomes]);
        }
        text + "}\n"
    }
}

/// A log of one hand at 100 Hz with these speeds, each for 50 ms.
fn log(rules: &Rules, speeds: &[f64]) -> Frames {
    let values: Vec<f64> = speeds.iter().flat_map(|speed| [*speed; 5]).collect();
    let len = values.len();
    let key = ColumnKey { channel: 0, side: Some(Side::Right), slot: 0, component: 0 };
    let hand =
        HandLayout { side: Side::Right, fingers: vec![Finger::Thumb], contacts: Vec::new(), knows_distance: false };
    assert_eq!(rules.channels[0].name, "speed");
    Frames {
        layout: Layout { rate_hz: 100.0, hands: vec![hand] },
        channels: rules.channels.clone(),
        columns: BTreeMap::from([(key, values)]),
        len,
        time: (0..len).map(|frame| frame as f64 / 100.0).collect(),
        stretches: std::iter::once(0..len).collect(),
        ..Frames::default()
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, failure_persistence: None, ..ProptestConfig::default() })]

    /// Any rules with kinds do what the same rules do in which every list is written out by hand: in both evaluators, relabeled, and in tasks.
    #[test]
    fn kinds_are_lists_written_out(
        // A parent stands before its kinds, so there is no circle; the first and the last label are the ends of tasks.
        parents in prop::collection::vec(prop::option::of(0..6_usize), 6..7),
        from in prop::collection::vec(prop::collection::vec(0..6_usize, 1..4), 0..6),
        tasks in prop::collection::vec((0..6_usize, 0..6_usize), 0..3),
        relabels in prop::collection::vec(prop::array::uniform4(0..6_usize), 0..4),
        speeds in prop::collection::vec(0..12_u32, 1..60),
    ) {
        let parents: Vec<Option<usize>> =
            parents.iter().enumerate().map(|(at, parent)| parent.filter(|parent| *parent < at)).collect();
        let speeds: Vec<f64> = speeds.into_iter().map(|speed| f64::from(speed) / 2.0 + 0.2).collect();
        let [short, long] = [false, true].map(|expands| {
            // What a task begins and ends with is one label, so in the written-out rules kinds of A and F would be missing there.
            let ends = |parent: &usize| *parent != 0 && *parent != 5;
            let parents = parents.iter().map(|parent| parent.filter(|parent| tasks.is_empty() || ends(parent))).collect();
            let rules = rules(&KindRules { parents, expands }.text(&from, &tasks, &relabels));
            let frames = log(&rules, &speeds);
            let literal = reference::evaluate(&rules, &frames).unwrap();
            assert_eq!(evaluate(&lower(&rules), &frames).unwrap(), literal);
            let analysis = analyze(&rules, &frames, &literal);
            let track = analysis.tracks.into_iter().next().unwrap();
            let names = |segments: &[teachtree_analysis::Segment]| -> Vec<_> {
                segments.iter().map(|one| (one.primitive.clone(), one.frames.clone())).collect()
            };
            let tasks: Vec<_> = track.tasks.iter().map(|task| (task.task.clone(), task.secondary.clone(), task.frames.clone())).collect();
            (literal, names(&track.segments), names(&track.relabeled), tasks)
        });
        prop_assert_eq!(short, long);
    }
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
fn what_nobody_writes_is_refused_at_once() {
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
