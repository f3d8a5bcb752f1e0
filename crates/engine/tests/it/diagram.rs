//! Transitions that are not drawn never occur.

use crate::engine::random;
use proptest::prelude::*;
use teachtree_engine::evaluator::evaluate;
use teachtree_language::graph::lower;
use teachtree_language::graph::transitions::{NONE, SEPARATE, transitions};
use teachtree_language::rules::TreeScope;

proptest! {
    // PROPTEST_CASES asks for more than the usual 256.
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever follows whatever in a recording, there is an arrow for it.
    #[test]
    fn a_missing_arrow_never_occurs(seed in any::<u64>(), depth in 1_u32..4) {
        let (rules, frames) = random::case(seed, depth);
        let all = transitions(&rules);
        for stretch in evaluate(&lower(&rules), &frames).unwrap() {
            let hands = stretch.hands.values().map(|runs| (TreeScope::EachHand, runs));
            for (scope, runs) in hands.chain([(TreeScope::BothHands, &stretch.both)]) {
                let Some(of) = all.iter().find(|of| of.scope == scope) else { continue };
                let name = |label: Option<_>| label.map_or(SEPARATE.to_string(), |label| rules.label_name(label));
                let mut before = NONE.to_string();
                for run in runs {
                    let leaf = name(run.label);
                    let at = |name: &str| of.leaves.iter().position(|leaf| leaf == name);
                    let ends = at(&before).zip(at(&leaf));
                    prop_assert!(ends.is_some_and(|ends| of.arrows.contains_key(&ends)), "{before} to {leaf} of {}", of.tree);
                    before = leaf;
                }
            }
        }
    }
}
