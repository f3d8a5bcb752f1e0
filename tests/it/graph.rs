//! Tests of `language::graph`: what rules compile to, and how large it gets.

mod growth;

use std::fmt::Write;
use teachtree_base::hands::{Finger, Side};
use teachtree_engine::compiled::instantiate::instantiate;
use teachtree_engine::compiled::plan::Plan;
use teachtree_frames::frames::{HandLayout, Layout};
use teachtree_language::graph::{Graph, lower, text};
use teachtree_language::{Request, load, load_text};

fn graph(rules: &str) -> Graph {
    let loaded = load_text("test.rules", rules);
    lower(&loaded.rules.unwrap_or_else(|| panic!("{:?}", loaded.diagnostics)))
}

/// One rule file each, with the graph that it becomes.
#[test]
fn rules_become_graphs() {
    insta::glob!("../fixtures/graphs", "*.rules", |path| {
        let rules = std::fs::read_to_string(path).unwrap();
        insta::with_settings!({ description => rules.clone(), omit_expression => true }, {
            insta::assert_snapshot!(text(&graph(&rules)));
        });
    });
}

#[test]
fn the_shipped_rules_become_this_graph() {
    let loaded = load(&Request::default());
    insta::assert_snapshot!(text(&lower(&loaded.rules.unwrap())));
}

fn tests(graph: &Graph) -> usize {
    graph.trees.iter().map(|tree| tree.decision.tests.len()).sum()
}

/// Conditions of `or` within `and` are the known way to an exponential graph: every path to the next operand would be copied.
#[test]
fn the_graph_grows_with_the_rules_and_not_faster() {
    let size = |operands: usize| {
        let mut rules = String::from("stream { ");
        for at in 0..2 * operands {
            let _ = write!(rules, "a{at} : bool ");
        }
        rules.push_str("}\nprimitive A, B\ntree t for each hand {\n  ");
        let pairs: Vec<String> = (0..operands).map(|at| format!("(a{} or a{})", 2 * at, 2 * at + 1)).collect();
        let _ = write!(rules, "{} => A\n  else => B\n}}\n", pairs.join(" and "));
        tests(&graph(&rules))
    };
    assert_eq!(size(10), 20);
    assert_eq!(size(100), 200);
}

/// The same condition in several signals and trees is one value, also when it has memory.
#[test]
fn equal_conditions_are_shared() {
    let rules = |copies: usize| {
        let mut rules = String::from("stream { speed : scalar m/s }\n");
        for at in 0..copies {
            let _ = writeln!(rules, "signal fast{at} = (speed above 2 m/s until below 1 m/s) for 50 ms");
        }
        let all: Vec<String> = (0..copies).map(|at| format!("fast{at}")).collect();
        let _ = write!(rules, "primitive A, B\ntree t for each hand {{ {} => A\n else => B }}\n", all.join(" or "));
        rules
    };
    assert_eq!(graph(&rules(1)).values.len(), graph(&rules(20)).values.len());
    assert_eq!(tests(&graph(&rules(20))), 1);
}

/// Opens a graph for one right hand with a thumb at 1 kHz.
fn open_for_a_hand(graph: &Graph) -> Result<Plan, String> {
    open_at(graph, 1000.0)
}

fn open_at(graph: &Graph, rate_hz: f64) -> Result<Plan, String> {
    let hand =
        HandLayout { side: Side::Right, fingers: vec![Finger::Thumb], contacts: Vec::new(), knows_distance: false };
    let layout = Layout { rate_hz, hands: vec![hand] };
    instantiate(graph, &layout).map_err(|error| error.to_string())
}

/// A chain of declarations is as long as its author likes: nothing recurses along it, and nothing walks it again for each of its members.
#[test]
fn long_chains_of_signals_and_latches_compile() {
    let tree = |last: &str| format!("primitive A, B\ntree t for each hand {{ {last} => A\n else => B }}\n");
    let mut signals = String::from("stream { speed : scalar m/s }\nsignal s0 = speed above 2 m/s until below 1 m/s\n");
    let mut latches = String::from("stream { speed : scalar m/s }\nlatch s0 set speed > 2 m/s clear speed < 1 m/s\n");
    for at in 1..4000 {
        let before = at - 1;
        let _ = writeln!(signals, "signal s{at} = rises(s{before}) or falls(s{before})");
        let _ = writeln!(latches, "latch s{at} set s{before} clear not s{before}");
    }
    for rules in [signals + &tree("s3999"), latches + &tree("s3999")] {
        assert!(open_for_a_hand(&graph(&rules)).unwrap().conditions.len() > 4000);
    }
}

#[test]
fn windows_that_no_memory_holds_are_refused() {
    let rules = |duration: &str| {
        format!(
            "stream {{ speed : scalar m/s }}\nprimitive A, B\n\
             tree t for each hand {{ rate(speed, {duration}) > 1 m/s^2 => A\n else => B }}\n"
        )
    };
    assert!(open_for_a_hand(&graph(&rules("60 s"))).is_ok());
    let refused = load_text("test.rules", &rules("1000000 s")).diagnostics;
    assert!(refused.iter().any(|it| it.message == "a duration is at most an hour"), "{refused:?}");
    // An hour may be too long for a log that is fast, and many of them for any.
    let refused = open_at(&graph(&rules("3600 s")), 2000.0).unwrap_err();
    assert!(refused.contains("is 7200000 samples at 2000.0 Hz, at most 4000000 are counted"), "{refused}");
    let many: Vec<String> = (0..20).map(|at| format!("rate(speed, {} s) > 1 m/s^2", 3600 - at)).collect();
    let many = rules("1 s").replace("rate(speed, 1 s) > 1 m/s^2", &many.join(" and "));
    let refused = open_for_a_hand(&graph(&many)).unwrap_err();
    assert!(refused.contains("MB of state, at most 256 MB are taken"), "{refused}");
}
