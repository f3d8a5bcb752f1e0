//! Tests of `engine`: the compiled evaluator against the reference, on random rules and random logs.

pub mod random;

use proptest::prelude::*;
use teachtree::engine::evaluator::{evaluate, evaluate_in_blocks};
use teachtree::engine::reference;
use teachtree::graph::lower;

proptest! {
    // PROPTEST_CASES asks for more than the usual 256.
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// The compiled graph and the literal evaluator give the same leaves, frame for frame; any block size gives the same leaves.
    #[test]
    fn compiled_equals_reference_in_blocks_of_any_size(seed in any::<u64>(), depth in 1_u32..5, block in 1_usize..80) {
        let (rules, frames) = random::case(seed, depth);
        let graph = lower(&rules);
        let expected = reference::evaluate(&rules, &frames).unwrap();
        let whole = evaluate(&graph, &frames).unwrap();
        prop_assert_eq!(&whole, &expected);
        let blocks = evaluate_in_blocks(&graph, &frames, block).unwrap();
        prop_assert_eq!(&blocks, &expected);
    }
}

/// The random cases are no walk-over: they reach many different leaves and all kinds of operators.
#[test]
fn random_cases_are_worth_testing() {
    let mut changes = 0;
    let mut windows = 0;
    for seed in 0..200 {
        let (rules, frames) = random::case(seed, 3);
        let leaves = evaluate(&lower(&rules), &frames).unwrap();
        changes += leaves.iter().flat_map(|leaves| leaves.hands.values()).map(|runs| runs.len() - 1).sum::<usize>();
        windows += teachtree::engine::open::open(&lower(&rules), &frames.layout).unwrap().cost().state_bytes;
    }
    assert!(changes > 1000, "the leaves change only {changes} times");
    assert!(windows > 10_000, "the cases have only {windows} bytes of memory");
}
