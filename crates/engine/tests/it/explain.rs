//! Paths through trees that the inspector finds.

use crate::engine::random;
use proptest::prelude::*;
use teachtree_base::hands::Side;
use teachtree_engine::evaluator::evaluate;
use teachtree_engine::inspect::Inspector;
use teachtree_engine::runs::Leaves;
use teachtree_language::graph::lower;
use teachtree_language::rules::{Branch, Consequent, Label, Rules, TreeScope};

/// The leaf at the end of a path.
fn at_end(branch: &Branch, path: &[usize], before: Option<Label>) -> Option<Label> {
    match &branch.choices[path[0]].then {
        Consequent::Primitive(label) => Some(*label),
        Consequent::Separate => None,
        Consequent::Stay => before,
        Consequent::Branch(below) => at_end(below, &path[1..], before),
    }
}

fn paths_lead_to_leaves(
    rules: &Rules,
    leaves: &Leaves,
    inspector: &mut Inspector,
    side: Option<Side>,
) -> Result<(), TestCaseError> {
    let scope = if side.is_some() { TreeScope::EachHand } else { TreeScope::BothHands };
    let Some(tree) = rules.tree(scope).filter(|_| inspector.tree(side).is_some()) else { return Ok(()) };
    for frame in leaves.frames.clone() {
        let before = if frame > leaves.frames.start { inspector.leaf(side, frame - 1) } else { None };
        let path = inspector.path(side, frame).unwrap();
        prop_assert_eq!(
            at_end(&tree.root, &path, before),
            inspector.leaf(side, frame),
            "frame {} of {:?}",
            frame,
            side
        );
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 48, ..ProptestConfig::default() })]

    /// The way that the inspector finds through a tree ends, on every frame, in the leaf that the evaluator gave.
    #[test]
    fn explained_paths_end_in_the_leaves_of_the_evaluator(seed in any::<u64>(), depth in 1_u32..4) {
        let (rules, frames) = random::case(seed, depth);
        for leaves in evaluate(&lower(&rules), &frames).unwrap() {
            let mut inspector = Inspector::new(&rules, &frames, &leaves);
            for side in [Some(Side::Left), Some(Side::Right), None] {
                paths_lead_to_leaves(&rules, &leaves, &mut inspector, side)?;
            }
        }
    }
}
