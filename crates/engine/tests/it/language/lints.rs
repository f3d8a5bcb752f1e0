//! What is reported about conditions is so: on random rules and random logs the reference evaluator never shows a case against it.

use crate::engine::random;
use proptest::prelude::*;
use std::collections::BTreeSet;
use teachtree_base::diagnostic::{Diagnostic, Span};
use teachtree_engine::reference;
use teachtree_frames::frames::Frames;
use teachtree_language::codes;
use teachtree_language::lints::choices::dead_choices;
use teachtree_language::lints::conditions::idle_conditions;
use teachtree_language::rules::*;

/// The primitive that nothing gives but what is reported never to be taken.
const MARKED: Label = Label { primitive: PrimitiveId(4), side: None };

/// Gives every piece of every condition a place of its own, which holds those of its pieces.
pub fn with_places(mut rules: Rules) -> Rules {
    fn expr(piece: &mut Expr, next: &mut u32) {
        let start = *next;
        *next += 1;
        piece.arguments_mut().into_iter().for_each(|argument| expr(argument, next));
        piece.span = Span { file: 0, start, end: *next };
    }
    fn branch(inner: &mut Branch, next: &mut u32) {
        for choice in &mut inner.choices {
            choice.condition.iter_mut().for_each(|condition| expr(condition, next));
            if let Consequent::Branch(below) = &mut choice.then {
                branch(below, next);
            }
        }
    }
    let mut next = 1;
    rules.signals.iter_mut().for_each(|signal| expr(&mut signal.expr, &mut next));
    for latch in &mut rules.latches {
        expr(&mut latch.set, &mut next);
        expr(&mut latch.clear, &mut next);
    }
    rules.trees.iter_mut().for_each(|tree| branch(&mut tree.root, &mut next));
    rules
}

/// Makes the choices that a finding says are never taken give a primitive that nothing else gives.
fn mark(branch: &mut Branch, finding: &Diagnostic, marked: &mut usize) {
    let place = finding.place().unwrap();
    let has = |choice: &Choice| {
        let mut has = false;
        choice.condition.iter().for_each(|condition| condition.walk(&mut |piece| has |= piece.span == place));
        has
    };
    let at = branch.choices.iter().position(has);
    if let Some(at) = at {
        let dead = match finding.code {
            codes::NEVER_TAKEN => at..at + 1,
            _ => at + 1..branch.choices.len(),
        };
        *marked += dead.len();
        branch.choices[dead].iter_mut().for_each(|choice| choice.then = Consequent::Primitive(MARKED));
    }
    for choice in &mut branch.choices {
        if let Consequent::Branch(below) = &mut choice.then {
            mark(below, finding, marked);
        }
    }
}

fn marked_is_given(rules: &Rules, frames: &Frames) -> bool {
    let leaves = reference::evaluate(rules, frames).unwrap();
    let mut runs = leaves.iter().flat_map(|leaves| leaves.hands.values().flatten().chain(&leaves.both));
    runs.any(|run| run.label == Some(MARKED))
}

fn random_case(seed: u64, depth: u32) -> (Rules, Frames) {
    let (mut rules, frames) = random::case_of_few_numbers(seed, depth);
    rules.primitives.push(Primitive {
        name: "Marked".into(),
        sided: false,
        is: None,
        does: None,
        other: None,
        span: Span::default(),
    });
    (with_places(rules), frames)
}

fn dead(rules: &Rules) -> Vec<Diagnostic> {
    dead_choices(rules, &BTreeSet::from([0])).into_iter().map(|dead| dead.finding).collect()
}

/// Returns each condition that is reported as never or always true, with the value that would disprove the report.
fn against(rules: &Rules) -> Vec<Expr> {
    let against = |(condition, finding): (&Expr, Diagnostic)| {
        let of = |kind, ty| Expr { kind, ty, span: Span::default() };
        let condition = condition.clone();
        let ty = condition.ty;
        let wrong =
            if finding.code == codes::ALWAYS_HOLDS { of(ExprKind::Not(Box::new(condition)), ty) } else { condition };
        match ty.axis {
            Some(_) => of(ExprKind::Call(Function::Any, vec![wrong]), Type::BOOL),
            None => wrong,
        }
    };
    idle_conditions(rules, &BTreeSet::from([0]), &[]).into_iter().map(against).collect()
}

/// The rules with a tree that gives the marked primitive when any of these holds.
fn with_tree(rules: &Rules, any: Vec<Expr>) -> Rules {
    let choice =
        |condition, label| Choice { name: None, condition, then: Consequent::Primitive(label), span: Span::default() };
    let other = Label { primitive: PrimitiveId(0), side: None };
    let mut choices: Vec<Choice> = any.into_iter().map(|condition| choice(Some(condition), MARKED)).collect();
    choices.push(choice(None, other));
    let root = Branch { choices, span: Span::default() };
    let tree = Tree { name: "t".into(), scope: TreeScope::EachHand, settle: None, root, span: Span::default() };
    Rules { trees: vec![tree], ..rules.clone() }
}

proptest! {
    // PROPTEST_CASES asks for more than the usual 256.
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn what_is_reported_to_be_never_taken_is_never_taken(seed in any::<u64>(), depth in 1_u32..4) {
        let (mut rules, frames) = random_case(seed, depth);
        let findings = dead(&rules);
        let mut marked = 0;
        for finding in &findings {
            rules.trees.iter_mut().for_each(|tree| mark(&mut tree.root, finding, &mut marked));
        }
        prop_assert!(marked >= findings.len(), "{findings:?}");
        prop_assert!(marked == 0 || !marked_is_given(&rules, &frames), "{findings:?}");
    }

    #[test]
    fn what_is_reported_to_hold_never_or_always_does(seed in any::<u64>(), depth in 1_u32..4) {
        let (rules, frames) = random_case(seed, depth);
        let against = against(&rules);
        if !against.is_empty() {
            prop_assert!(!marked_is_given(&with_tree(&rules, against.clone()), &frames), "{against:?}");
        }
    }
}

/// The random cases have much to tell, of every kind, and what is not told is often so.
#[test]
fn random_conditions_are_worth_telling() {
    let mut counts = [0; 5];
    for seed in 0..120 {
        let (mut rules, frames) = random_case(seed, 3);
        let (dead, idle) = (dead(&rules), idle_conditions(&rules, &BTreeSet::from([0]), &[]));
        let printed = |code| {
            let idle = idle.iter().map(|(_, finding)| finding);
            idle.chain(&dead).filter(|finding| finding.code == code).count()
        };
        let codes = [codes::NEVER_TAKEN, codes::ALWAYS_TAKEN, codes::NEVER_HOLDS, codes::ALWAYS_HOLDS];
        let printed = codes.map(printed);
        counts.iter_mut().zip(printed).for_each(|(count, printed)| *count += printed);
        rules.trees.iter_mut().for_each(|tree| tree.root.choices[1].then = Consequent::Primitive(MARKED));
        counts[4] += usize::from(marked_is_given(&rules, &frames));
    }
    assert!(counts.iter().zip([5, 5, 5, 5, 5]).all(|(count, least)| *count >= least), "{counts:?}");
}
