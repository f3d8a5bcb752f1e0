//! The known ways to an exponential graph: whatever is said twice, of something that was said twice itself. Rules that are twice as long become a
//! graph that is twice as large, before and after it is opened. Nodes are counted; no clock is asked.

use super::{graph, open_for_a_hand};
use proptest::prelude::*;
use std::fmt::Write;

/// The nodes of a graph and of what it becomes when it is opened.
fn nodes(rules: &str) -> [usize; 2] {
    let graph = graph(rules);
    let plan = open_for_a_hand(&graph).unwrap();
    let tests = |lens: Vec<usize>| lens.into_iter().sum::<usize>();
    let lowered = graph.values.len() + tests(graph.trees.iter().map(|tree| tree.decision.tests.len()).collect());
    let opened = tests(plan.trees.iter().map(|tree| tree.decision.tests.len()).collect());
    [lowered, plan.numbers.len() + plan.conditions.len() + plan.stateful.len() + opened]
}

/// Rules that are twice as long make at most twice as many nodes, and some for what they are all about.
fn grows_linearly(name: &str, short: usize, rules: impl Fn(usize) -> String) {
    let [one, two, four] = [short, 2 * short, 4 * short].map(|length| nodes(&rules(length)));
    for layer in 0..2 {
        let (first, second) = (two[layer] - one[layer], four[layer] - two[layer]);
        assert!(first >= short, "{name}: what is asked vanished: {one:?}, {two:?}, {four:?} nodes");
        // One node more or less at an end is not growth.
        assert!(second <= 2 * first + 4, "{name}: {one:?}, {two:?}, {four:?} nodes");
    }
}

/// Returns rules with `bools` boolean channels and a tree that tests `condition`.
fn asked(declarations: &str, bools: usize, condition: &str) -> String {
    let mut rules = String::from("stream { for each hand { speed : scalar m/s ");
    for at in 0..bools {
        let _ = write!(rules, "c{at} : bool ");
    }
    let _ = write!(rules, "}} }}\nfor each hand {{\n{declarations}}}\nprimitive A, B\n");
    let _ = writeln!(rules, "tree t for each hand {{ {condition} => A\n else => B }}");
    rules
}

/// A chain of declarations, each made of the one before.
fn chain(length: usize, bools: usize, first: &str, next: impl Fn(usize, usize) -> String, last: &str) -> String {
    let mut declarations = first.to_string();
    for at in 1..=length {
        let _ = writeln!(declarations, "  {}", next(at, at - 1));
    }
    asked(&declarations, bools, &last.replace("LAST", &length.to_string()))
}

#[test]
fn signals_that_read_the_one_before_several_times() {
    let first = "  signal s0 = c0\n";
    grows_linearly("operators with memory", 50, |length| {
        let next = |at, before| {
            format!("signal s{at} = (s{before}) for 10 ms and not rises(s{before}) or (s{before}) within last 20 ms")
        };
        chain(length, 1, first, next, "sLAST")
    });
    grows_linearly("parity", 50, |length| {
        let next =
            |at, before| format!("signal s{at} = s{before} and not c{before} or not s{before} and c{before} and c{at}");
        chain(length, length + 1, first, next, "sLAST")
    });
    grows_linearly("look-ahead", 20, |length| {
        let next = |at, before| {
            format!("signal s{at} = (s{before}) within next 10 ms and c{before} or s{before} and not c{before}")
        };
        chain(length, length + 1, first, next, "sLAST")
    });
    grows_linearly("numbers", 50, |length| {
        let next = |at, before| format!("signal x{at} = x{before} * x{before} - min(x{before}, abs(x{before}))");
        chain(length, 1, "  signal x0 = speed / 1 m/s\n", next, "xLAST > 1")
    });
}

#[test]
fn latches_that_read_the_one_before_several_times() {
    grows_linearly("latches of the log", 50, |length| {
        let next = |at, before| {
            format!(
                "latch l{at} set l{before} and not c{before} or not l{before} and c{before}  clear rises(l{before})"
            )
        };
        chain(length, length + 1, "  latch l0 set c0 clear not c0\n", next, "lLAST")
    });
    grows_linearly("latches of the leaf before", 50, |length| {
        let next = |at, before| {
            format!("latch l{at} set (l{before}) for 10 ms or not l{before} and c{before}  clear l{before} and c{at}")
        };
        chain(length, length + 1, "  latch l0 set from(A) clear not c0\n", next, "lLAST")
    });
}

#[test]
fn branches_that_share_their_conditions() {
    // Each branch asks again for what those above it asked for, and all end in the same choices.
    grows_linearly("nested branches", 10, |depth| {
        let mut open = String::new();
        for at in 0..depth {
            let _ = write!(open, "b{at}: c{at} or c{} {{ ", at + 1);
        }
        let close = "c0 and not c1 or from(A) => A  else => B } c0 and not c1 or from(A) => A ".repeat(depth);
        let rules = asked("  signal unused = c0\n", depth + 1, "TREE");
        rules.replace("TREE => A", &format!("{open} c0 => B  {close}"))
    });
    // Each choice asks for the same long condition and one of its own.
    grows_linearly("choices", 50, |length| {
        let choices: Vec<String> =
            (1..=length).map(|at| format!("(c0 or from(B)) and (c{at} or not c0) => {}", ["A", "B"][at % 2])).collect();
        let rules = asked("  signal unused = c0\n", length + 1, "TREE");
        rules.replace("TREE => A", &choices.join("\n  "))
    });
}

/// Conditions nested at random: each level joins the one inside with others, or with what the level before asked already.
fn nested(kinds: &[u8]) -> String {
    let mut condition = String::from("c0");
    for (at, kind) in kinds.iter().enumerate() {
        let (one, again) = (format!("c{}", at + 1), format!("c{at}"));
        condition = match kind % 5 {
            0 => format!("({condition} and {one})"),
            1 => format!("({one} or {condition})"),
            2 => format!("({one} and not {condition} or {again})"),
            3 => format!("(({again} or {one}) and {condition})"),
            _ => format!("not ({condition} or {again} and {one})"),
        };
    }
    asked("  signal unused = c0\n", kinds.len() + 1, &condition)
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) })]

    /// However conditions are nested in a tree, each of them that is written is at most one test, and one value with its name and its negation.
    #[test]
    fn nested_conditions_become_as_many_tests_as_are_written(kinds in prop::collection::vec(any::<u8>(), 1..40)) {
        let rules = nested(&kinds);
        let written = 1 + kinds.iter().map(|kind| if kind % 5 < 2 { 1 } else { 2 }).sum::<usize>();
        let lowered = graph(&rules);
        let tests = lowered.trees.iter().map(|tree| tree.decision.tests.len()).sum::<usize>();
        prop_assert!(tests <= written, "{tests} tests of {written} conditions: {rules}");
        let [_, opened] = nodes(&rules);
        prop_assert!(opened <= 4 * written + 16, "{opened} nodes of {written} conditions: {rules}");
    }
}
