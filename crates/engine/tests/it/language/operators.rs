//! The table of operators, row by row, against everything that has to know operators: the evaluators and the inspector, the proofs, lints and mutants,
//! the grammar, the editors and the language reference.

use super::report;
use crate::engine::stepped;
use crate::numbers::Random;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use teachtree_base::channels::{Axis, Shape};
use teachtree_base::diagnostic::Span;
use teachtree_base::hands::{Finger, Side};
use teachtree_engine::evaluator::evaluate;
use teachtree_engine::inspect::Inspector;
use teachtree_engine::reference;
use teachtree_frames::frames::{ColumnKey, Frames, HandLayout, Layout};
use teachtree_language::graph::{AbstractValue, lower, reachable_leaves};
use teachtree_language::mutation::mutants;
use teachtree_language::ops::{self, CheckedForm, Kind, OPERATORS, Operand, Operator};
use teachtree_language::rules::{Expr, Rules, TreeScope};
use teachtree_language::{self as language, LoadedRules};

const FILE: &str = "operators.rules";

/// Rules whose tree gives A where a condition of a hand holds, and B elsewhere.
fn load(condition: &str) -> LoadedRules {
    let text = format!(
        "use \"hand_force.rules\"\nprimitive A, B\nfor each hand {{\n  signal moving = target.velocity.z > 10 mm/s\n  \
         signal example = {condition}\n}}\ntree t for each hand {{ example => A  else => B }}\n"
    );
    language::load_text(FILE, &text)
}

fn rules(condition: &str) -> Rules {
    let loaded = load(condition);
    let printed = report(&loaded);
    loaded.rules.unwrap_or_else(|| panic!("{printed}"))
}

/// The condition of the example, and what the tree asks for.
fn example(rules: &Rules) -> (&Expr, &Expr) {
    let signal = rules.signals.iter().find(|signal| signal.name == "example").unwrap();
    let asked = rules.tree(TreeScope::EachHand).unwrap().root.choices[0].condition.as_ref().unwrap();
    (&signal.expr, asked)
}

/// A log of two hands at 100 Hz, whose columns `value` makes.
fn log(rules: &Rules, len: usize, mut value: impl FnMut(Shape) -> Vec<f64>) -> Frames {
    let hand = |side| HandLayout {
        side,
        fingers: Finger::ALL.to_vec(),
        contacts: vec!["table".into(), "wall".into()],
        knows_distance: false,
    };
    let layout = Layout { rate_hz: 100.0, hands: Side::BOTH.map(hand).to_vec() };
    let mut columns = BTreeMap::new();
    for (spec, channel) in rules.channels.iter().zip(0..) {
        let sides = if spec.per_hand { Side::BOTH.map(Some).to_vec() } else { vec![None] };
        let slots = match spec.axis {
            None => 1,
            Some(Axis::Fingers) => Finger::ALL.len(),
            Some(Axis::Contacts) => 2,
        };
        for side in sides {
            for (slot, component) in
                (0..slots).flat_map(|slot| (0..spec.shape.components().len()).map(move |c| (slot, c)))
            {
                let key = ColumnKey { channel, side, slot: slot as u32, component: component as u32 };
                columns.insert(key, value(spec.shape));
            }
        }
    }
    Frames {
        layout,
        channels: rules.channels.clone(),
        columns,
        len,
        time: (0..len).map(|frame| frame as f64 / 100.0).collect(),
        stretches: vec![0..len / 3, len / 3..len],
        objects: vec!["cube".into()],
        ..Frames::default()
    }
}

fn random_log(rules: &Rules, random: &mut Random) -> Frames {
    let len = 200;
    log(rules, len, |shape| {
        let mut value = 0.0;
        let values = (0..len).map(|frame| {
            if frame == 0 || random.chance(20) {
                value = match shape {
                    Shape::Bool => random.below(2) as f64,
                    Shape::Object => 0.0,
                    _ => [0.0, 0.005, 0.03, -0.03, 1.2, -2.5, 4.0][random.below(7)],
                };
            }
            value
        });
        values.collect()
    })
}

#[test]
fn every_evaluator_knows_every_operator() {
    for operator in OPERATORS {
        let rules = rules(operator.example);
        let (expr, asked) = example(&rules);
        let mut found = operator.becomes == CheckedForm::Contact;
        expr.walk(&mut |part| found |= ops::of(&part.kind).is_some_and(|known| known.name == operator.name));
        assert!(found, "the example of `{}` does not have it", operator.name);

        let graph = lower(&rules);
        let mut random = Random::new(7);
        let mut seen = BTreeSet::new();
        for _ in 0..12 {
            let frames = random_log(&rules, &mut random);
            let expected = reference::evaluate(&rules, &frames).unwrap();
            assert_eq!(evaluate(&graph, &frames).unwrap(), expected, "`{}`, compiled", operator.name);
            assert_eq!(stepped(&graph, &frames), expected, "`{}`, live", operator.name);
            for leaves in &expected {
                let mut inspector = Inspector::new(&rules, &frames, leaves);
                for side in Side::BOTH {
                    let truth = inspector.truth(asked, Some(side)).unwrap();
                    for (at, frame) in leaves.frames.clone().enumerate() {
                        let label = rules.label_name(inspector.leaf(Some(side), frame).unwrap());
                        assert_eq!(truth.holds(0, at), label == "A", "`{}`, frame {frame}, inspected", operator.name);
                        seen.insert(label);
                    }
                    if let Some(at_start) = operator.at_start {
                        assert_eq!(truth.holds(0, 0), at_start, "`{}` on a first frame", operator.name);
                    }
                }
            }
        }
        assert_eq!(seen.len(), 2, "the example of `{}` always comes out as {seen:?}", operator.name);
    }
}

/// What is known without a log holds on logs that do not change.
#[test]
fn what_is_known_of_an_operator_is_so() {
    for operator in OPERATORS {
        let rules = rules(operator.example);
        let graph = lower(&rules);
        for constant in [0.0, 1.0, 0.03, -4.0] {
            let reachable_leaves =
                reachable_leaves(&graph, TreeScope::EachHand, |_, _| AbstractValue::Constant(constant), |_, _| true);
            let frames = log(&rules, 90, |_| vec![constant; 90]);
            for leaves in evaluate(&graph, &frames).unwrap() {
                for run in leaves.hands.values().flatten() {
                    let label = run.label.unwrap();
                    let name = rules.label_name(label);
                    assert!(reachable_leaves.contains(&label), "`{}` of {constant} gives {name}", operator.name);
                }
            }
        }
    }
}

/// Numbers that are never negative are known to be so: that they are less than a negative number never holds.
#[test]
fn proofs_know_which_numbers_are_never_negative() {
    for operator in OPERATORS {
        let Some((left, right)) = operator.example.split_once('>') else { continue };
        if !left.starts_with(&format!("{}(", operator.name)) {
            continue;
        }
        let printed = report(&load(&format!("{left} < -1 * {}", right.trim_start_matches('='))));
        assert_eq!(printed.contains("W301"), operator.never_negative, "`{}`:\n{printed}", operator.name);
    }
}

fn takes(operator: &Operator, wanted: Operand) -> bool {
    operator.signatures.iter().any(|signature| signature.takes.contains(&wanted))
}

#[test]
fn durations_are_looked_at_and_changed_for_trial() {
    let within = |one: Span, other: Span| one.file == other.file && other.start <= one.start && one.end <= other.end;
    for operator in OPERATORS.iter().filter(|operator| takes(operator, Operand::Duration)) {
        let short = operator.example.replace("200 ms", "0.1 ms").replace("100 ms", "0.1 ms");
        assert!(report(&load(&short)).contains("W303"), "`{}`", operator.name);
        let rules = rules(operator.example);
        let (expr, _) = example(&rules);
        let changed: BTreeSet<&str> =
            mutants(&rules).filter(|mutant| within(mutant.span, expr.span)).map(|mutant| mutant.what).collect();
        assert!(changed.contains("the time doubled"), "`{}`: {changed:?}", operator.name);
        assert_eq!(changed.contains("once more often"), takes(operator, Operand::Times), "`{}`", operator.name);
    }
}

#[test]
fn the_grammar_the_editors_and_the_reference_have_every_operator() {
    let read = |name: &str| std::fs::read_to_string(std::path::Path::new(crate::ROOT).join(name)).unwrap();
    let (tokens, reference) = (read("grammar/tokens.pest"), read("grammar/README.md"));
    let (vim, code) =
        (read("editors/vim/syntax/teachtree.vim"), read("editors/vscode/syntaxes/teachtree.tmLanguage.json"));
    for operator in OPERATORS {
        for signature in operator.signatures {
            let entry = format!("`{}`", signature.written);
            assert!(reference.contains(&entry), "{entry} has no entry in grammar/README.md");
        }
        for word in operator.name.split(' ') {
            // Which word is which the tests of `editors` hold; functions are names, no tokens.
            assert!(operator.is_called() || tokens.contains(&format!("kw_{word} ")), "the grammar has no `{word}`");
            assert!(vim.contains(word) && code.contains(word), "an editor does not color `{word}`");
        }
        assert_eq!(operator.kind == Kind::Temporal, operator.becomes != CheckedForm::Contact && has_memory(operator));
    }
}

fn has_memory(operator: &Operator) -> bool {
    matches!(
        operator.becomes,
        CheckedForm::Temporal | CheckedForm::Rate | CheckedForm::Summary(_) | CheckedForm::Hysteresis
    )
}

/// `(c) at least N times within last D`: an overlap of the definition's cases, frame by frame.
#[test]
fn a_condition_is_counted_where_it_begins() {
    // At 100 Hz the window has 10 frames. It moves on the first frame, on 5 and 6, and from 18 on.
    let held = held("(moving) at least 2 times within last 100 ms", &[0..1, 5..7, 18..60]);
    // It began on frames 0 and 5: both are among the last 10 until frame 9. On 18 the beginning on 5 is too long ago, and that the second stretch begins
    // while it moves counts once.
    assert_eq!(held, vec![5..10]);
}

/// The frames on which a condition holds when the target of the right hand moves on some frames. The log has 100 Hz and a gap before frame 25.
fn held(condition: &str, moving: &[Range<usize>]) -> Vec<Range<usize>> {
    let rules = rules(condition);
    let moves = |frame: usize| moving.iter().any(|moving| moving.contains(&frame));
    let speed: Vec<f64> = (0..60).map(|frame| if moves(frame) { 1.0 } else { 0.0 }).collect();
    let mut frames = log(&rules, 60, |_| vec![0.0; 60]);
    frames.stretches = vec![0..25, 25..60];
    let channel = frames.channel("target.velocity").unwrap();
    for side in Side::BOTH {
        frames.columns.insert(ColumnKey { channel, side: Some(side), slot: 0, component: 2 }, speed.clone());
    }
    let leaves = evaluate(&lower(&rules), &frames).unwrap();
    let held = leaves.iter().flat_map(|leaves| &leaves.hands[&Side::Right]);
    held.filter(|run| rules.label_name(run.label.unwrap()) == "A").map(|run| run.start..run.end).collect()
}

/// `(c) bridging D`: gaps of less than D between two frames of one stretch, and the frames of longer gaps that are less than D from both.
#[test]
fn gaps_of_a_condition_are_bridged() {
    // The gaps have 9, 10, 6 and 18 frames; the third one contains the gap of the log.
    let moving = [2..3, 12..13, 23..24, 30..31, 49..50];
    assert_eq!(held("(moving) bridging 100 ms", &moving), [2..13, 14..22, 23..24, 30..31, 49..50]);
}

/// `(c) lasting D`: intervals of at least D in one stretch, from their first frame on.
#[test]
fn intervals_of_a_condition_last() {
    // The intervals have 9, 10, 5 and 5 about the gap of the log, 15 and 8 frames.
    let moving = [2..11, 12..22, 23..30, 35..50, 52..60];
    assert_eq!(held("(moving) lasting 100 ms", &moving), [12..22, 35..50]);
}

#[test]
fn a_number_of_times_is_checked() {
    for (times, wanted) in [
        ("0", "expected a count of 1 or more"),
        ("2000", "expected a count of 1000 or less"),
        ("2.5", "a whole number"),
        ("(3 N)", "is expected here"),
        ("three", "E201"),
    ] {
        let printed = report(&load(&format!("(moving) at least {times} times within last 2 s")));
        assert!(printed.contains(wanted), "{times}:\n{printed}");
    }
    for bare in ["moving at least 3 times within last 2 s", "moving bridging 2 s", "moving lasting 2 s"] {
        assert!(report(&load(bare)).contains("E105"), "{bare}");
    }
}
