//! Tests of `language::graph`: what rules compile to, and how large it gets.

use std::fmt::Write;
use teachtree_language::graph::{Graph, lower, text};
use teachtree_language::{Request, load, load_text};

fn graph(rules: &str) -> Graph {
    let loaded = load_text("test.rules", rules);
    lower(&loaded.rules.unwrap_or_else(|| panic!("{:?}", loaded.diagnostics)))
}

/// One rule file each, with the graph that it becomes.
#[test]
fn rules_become_graphs() {
    insta::glob!("../../../../tests/fixtures/graphs", "*.rules", |path| {
        let rules = std::fs::read_to_string(path).unwrap();
        insta::with_settings!({ description => rules.clone(), omit_expression => true }, {
            insta::assert_snapshot!(text(&graph(&rules)));
        });
    });
}

#[test]
fn the_shipped_rules_become_this_graph() {
    let loaded = load(&Request { files: vec!["contact.rules".into()], ..Request::default() });
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
